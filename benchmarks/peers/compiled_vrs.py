"""vrs itself, built with the modules that mypyc compiles to C (`VRS_COMPILED=1 pip install .`), runs a program."""

from __future__ import annotations

import gc
from typing import Any

from benchmarks.peers.timing import serve
from benchmarks.program import run_once
from vrs_cli.__main__ import COLLECT_AFTER
from vrs_cli.trajectory.laws import lspb


def measure(work: dict[str, Any]) -> dict[str, float]:
    """Return the `rate` of robot time: seconds in a second of the processor, for `program`, the best of `rounds`."""
    if lspb.__file__.endswith(".py"):
        raise SystemExit("vrs was installed without compiled modules")
    gc.set_threshold(COLLECT_AFTER)
    took, robot, _ = min(run_once(work["program"]) for _ in range(work["rounds"]))
    return {"rate": robot / took}


if __name__ == "__main__":
    serve(measure)
