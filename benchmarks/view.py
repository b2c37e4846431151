"""The page of `vrs view`: what an arm at rest and a moving one cost the server and the browser, and how soon the first
picture is there: `python -m benchmarks view`. On Linux, with Chromium.

The browser has no window and no graphics card: it draws by software, in as many threads as there are cores. The first
picture is timed in a browser that runs already and has drawn something, as a user's has.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.page.browser import drawn, missing, running_chromium, until, window

SIZE = (1400, 800)  # of the page [px]
SECONDS = 20.0  # that are measured
SETTLED = 3.0  # [s] until the page has drawn what it was given at first
TICK = os.sysconf("SC_CLK_TCK")  # [1/s] of the times that the system tells
WARM = "data:text/html,<canvas id=c></canvas><script>c.getContext('webgl2').clear(0)</script>"
PROGRAM = """\
.PROGRAM spin()
DO
MOVE #PPOINT(60, -80, 80, 20, 40, 30)
MOVE #PPOINT(-60, -60, 60, -20, -40, -30)
UNTIL FALSE
.END
"""


def main() -> None:
    if missing():
        print(missing())
        return
    with running_chromium() as browser, tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "spin.v2"
        program.write_text(PROGRAM, encoding="utf-8")
        with window(browser, size=SIZE) as page:
            page.goto(WARM)
            with _command() as (_, begun, address):
                told = time.time() - begun
                page.goto(address)
                drawn(page)
                print(f"its address is told after {told:.2f} s, the picture is there after {time.time() - begun:.2f} s")
        for what, options in (("at rest", ["--no-run"]), ("while it moves", [])):
            with window(browser, size=SIZE) as page, _command(str(program), *options) as (process, _, address):
                page.goto(address)
                drawn(page)
                if not options:
                    until(page, "app.source.timeline.segments.length > 4")
                time.sleep(SETTLED)
                pictures, server, chromium = page.evaluate("scene.stage.pictures"), _cpu({process}), _cpu(_chromium())
                time.sleep(SECONDS)
                pictures = page.evaluate("scene.stage.pictures") - pictures
                server, chromium = _cpu({process}) - server, _cpu(_chromium()) - chromium
                each = f", {1000.0 * chromium / pictures:.0f} ms of CPU each" if pictures else ""
                print(
                    f"{what}, of a core: server {server / SECONDS:.1%}, Chromium {chromium / SECONDS:.1%}; "
                    f"{pictures / SECONDS:.1f} pictures a second{each}"
                )


def _stat(process: int) -> tuple[str, list[str]]:
    """The name of a process, and what the system tells after it; empty where it has ended."""
    try:
        name, _, rest = Path(f"/proc/{process}/stat").read_text().partition("(")[2].rpartition(")")
    except OSError:
        return "", []
    return name, rest.split()


def _chromium() -> set[int]:
    """The processes of the browser that this one has started."""
    found, parents = {os.getpid()}, dict[int, int]()
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and (told := _stat(int(entry.name))[1]):
            parents[int(entry.name)] = int(told[1])
    while more := {process for process, parent in parents.items() if parent in found} - found:
        found |= more
    return {process for process in found if "chrom" in _stat(process)[0]}


def _cpu(processes: set[int]) -> float:
    """The CPU time that processes have used [s]."""
    return sum(sum(map(int, told[11:13])) for process in processes if (told := _stat(process)[1])) / TICK


@contextmanager
def _command(*words: str) -> Iterator[tuple[int, float, str]]:
    """`vrs view`: its process, when it was begun [s], and its address."""
    begun = time.time()
    command = [sys.executable, "-m", "vrs_cli", "view", "--no-open", *words]
    running = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
    try:
        assert running.stdout is not None
        yield running.pid, begun, running.stdout.readline().split()[-1]
    finally:
        running.terminate()
        running.wait()


if __name__ == "__main__":
    main()
