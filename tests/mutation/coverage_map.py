"""Which tests run which line: `python -m tests.mutation.coverage_map [tests ...]` writes the map for `run`.

The tests are run with coverage, a context for each; what the map had of other tests stays in it. It is a file beside
this one that is not committed.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest

ROOT = Path(__file__).parents[2]
MAP = Path(__file__).with_name("coverage.json")
FOLDERS = ("trajectory", "engine", "kinematics", "language", "net")
USUAL = [
    f"tests/{name}" for name in (*FOLDERS, "interfaces", "laws", "oracle", "programs", "files", "wire", "errors", "lsp")
]


@dataclass(eq=False)
class Contexts:
    """A plugin: the name of the present test is the context, and how long each takes: seconds of CPU, or on the wall
    for a live test, which waits."""

    coverage: object
    seconds: dict[str, float] = field(default_factory=dict)
    live: set[str] = field(default_factory=set)

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self.live = {item.nodeid for item in session.items if item.get_closest_marker("live")}

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.coverage.switch_context(nodeid)  # type: ignore[attr-defined]
        self.seconds[nodeid] = -self._clock(nodeid)

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        self.seconds[nodeid] += self._clock(nodeid)

    def _clock(self, nodeid: str) -> float:
        return time.perf_counter() if nodeid in self.live else time.process_time()


def main(arguments: list[str]) -> int:
    import coverage
    import pytest

    sources = [str(ROOT / "vrs_cli" / folder) for folder in FOLDERS]
    measuring = coverage.Coverage(data_file=None, source=sources, config_file=False)
    contexts = Contexts(measuring)
    measuring.start()
    pytest.main(["-q", "-p", "no:cacheprovider", *(arguments or USUAL)], plugins=[contexts])
    measuring.stop()
    MAP.write_text(json.dumps(merged(measuring.get_data(), contexts.seconds)))
    return 0


def merged(data: object, seconds: dict[str, float]) -> dict[str, object]:
    """`tests`: their names and seconds, in order; for each file the tests of each line, by number."""
    found = json.loads(MAP.read_text()) if MAP.exists() else {"tests": {}}
    found["tests"] |= {test: round(one, 4) for test, one in seconds.items()}
    numbers = {test: number for number, test in enumerate(found["tests"])}
    for path in data.measured_files():  # type: ignore[attr-defined]
        lines = found.setdefault(str(Path(path).relative_to(ROOT)), {})
        for line, names in data.contexts_by_lineno(path).items():  # type: ignore[attr-defined]
            lines[str(line)] = sorted({*lines.get(str(line), ()), *(numbers[name] for name in names if name)})
    return dict(found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
