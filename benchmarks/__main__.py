"""All benchmarks, one after the other: `python -m benchmarks [name ...]`; the page of results: `... results`."""

from __future__ import annotations

import sys
from importlib import import_module

ALL = (
    *(
        "kinematics",
        "robots",
        "engine",
        "steering",
        "chunks",
        "jitter",
        "measured",
        "body",
        "divergence",
        "timeline",
        "language",
        "program",
        "prompt",
        "startup",
        "bulk",
    ),
    *("longest", "crowd", "viewers", "view", "hostile", "contacts", "world", "events", "grading", "classroom"),
)


def main() -> None:
    if sys.argv[1:2] in (["results"], ["hostile"]):  # a page for a file, and one whose words after it are loads
        import_module(f"benchmarks.{sys.argv[1]}").main()
        return
    for name in [one for one in sys.argv[1:] if not one.replace(".", "").isdigit()] or ALL:
        if name not in ALL:
            raise SystemExit(f"there is no benchmark {name}: {', '.join(ALL)}")
        print(f"== {name}", flush=True)
        import_module(f"benchmarks.{name}").main()
        print(flush=True)


if __name__ == "__main__":
    main()
