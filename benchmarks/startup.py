"""How soon `vrs` is there, and what a key costs then: `python -m benchmarks.startup` (needs a pseudo-terminal).

Ratios to a bare `python -c pass` and to a bare prompt-toolkit prompt, in turn, in one run. Of short commands and of
keys the least time of the processor, of prompts the median of what a person waits.
"""

from __future__ import annotations

import os
import pty
import select
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

REPEATS = 15
PATIENCE = 20.0  # [s]
QUIET = 0.05  # [s] in which a screen that stays as it is is done
TYPED = 5  # times that a line is typed
LINE = "MOVES SHIFT(part BY 10, 0, 20)"
VRS = [sys.executable, "-m", "vrs_cli"]
# as where only vrs and its dependencies are installed: msgspec imports `typing_extensions` if it is there
VRS_ALONE = "import sys; sys.modules['typing_extensions'] = None; from vrs_cli.__main__ import process; process()"
SIGN = b"\x1b[0m.\x1b[0m"  # the dot, as prompt-toolkit paints it
HELLO = str(Path(__file__).parents[1] / "programs" / "hello.v2")
BARE_PROMPT = "from prompt_toolkit import PromptSession; PromptSession('.READY>').prompt()"


def commands(turns: int = REPEATS) -> dict[str, float]:
    """Seconds of the processor for each short command, in turn, the least; `vrs serve` until it is ready."""
    with TemporaryDirectory() as folder:
        saved = os.path.join(folder, "hello.vrst")
        subprocess.run([*VRS, "run", HELLO, "--save", saved], check=True, stdout=subprocess.DEVNULL)
        works = {
            "python -c pass": [sys.executable, "-c", "pass"],
            "vrs --version": [*VRS, "--version"],
            "vrs run hello.v2": [*VRS, "run", HELLO],
            "vrs run hello.v2, vrs alone installed": [sys.executable, "-c", VRS_ALONE, "run", HELLO],
            "vrs check hello.v2": [*VRS, "check", HELLO],
            "vrs where": [*VRS, "where", saved, "--at", "1"],
            "vrs export, csv": [*VRS, "export", saved, "--to", "csv"],
        }
        serving = [*VRS, "serve", "--port", "0", "--journal", os.path.join(folder, "day")]
        turns_of = [
            {**{name: process_seconds(one) for name, one in works.items()}, "vrs serve": ready_seconds(serving)}
            for _ in range(turns)
        ]
    return {name: min(turn[name] for turn in turns_of) for name in turns_of[0]}


def ready_seconds(command: list[str]) -> float:
    """What a process takes of the processor until it says where it is."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as served:
        assert served.stdout is not None
        first = served.stdout.readline()
        ticks = Path(f"/proc/{served.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[11:13]
        served.kill()
    if b"ws" not in first and b"robot" not in first:
        raise SystemExit(f"vrs serve is not ready: {first!r}")
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def process_seconds(command: list[str]) -> float:
    """What a process takes of the processor."""
    before = getrusage(RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = getrusage(RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


@contextmanager
def at_prompt(command: list[str], sign: bytes, home: str) -> Iterator[tuple[int, int]]:
    """A process at a terminal of its own, and that terminal, once `sign` is on its screen."""
    child, terminal = pty.fork()
    if not child:
        os.environ.update(TERM="xterm-256color", XDG_STATE_HOME=home, PROMPT_TOOLKIT_NO_CPR="1")
        os.execvp(command[0], command)
    seen = b""
    try:
        while sign not in seen:
            if not select.select([terminal], [], [], PATIENCE)[0]:
                raise SystemExit(f"no prompt from {' '.join(command)}: {seen!r}")
            seen += os.read(terminal, 4096)
        yield child, terminal
    finally:
        os.kill(child, 9)
        os.close(terminal)
        os.waitpid(child, 0)


def prompt_seconds(command: list[str], sign: bytes, home: str) -> float:
    """From start to the first time that `sign` is on the screen of a terminal."""
    begin = perf_counter()
    with at_prompt(command, sign, home):
        return perf_counter() - begin


def key_seconds(turns: int = TYPED) -> dict[str, float]:
    """Seconds of the processor for a key of a line, at a bare prompt and at that of `vrs`, in turn, the least."""
    with (
        TemporaryDirectory() as home,
        at_prompt([sys.executable, "-c", BARE_PROMPT], b".READY>", home) as bare,
        at_prompt(VRS, SIGN, home) as ours,
    ):
        prompts = {"bare": bare, "vrs": ours}
        took = [{name: _typed(*one) for name, one in prompts.items()} for _ in range(turns + 1)][
            1:
        ]  # the first warms up
    return {name: min(turn[name] for turn in took) for name in prompts}


def _typed(process: int, terminal: int) -> float:
    """Seconds for each key of a line, which is taken away again."""
    _settle(terminal)
    before = _processor_seconds(process)
    for key in LINE:
        os.write(terminal, key.encode())
        _settle(terminal)
    took = _processor_seconds(process) - before
    os.write(terminal, b"\x15")
    return took / len(LINE)


def _settle(terminal: int) -> None:
    """Read until the screen stays as it is."""
    while select.select([terminal], [], [], QUIET)[0]:
        os.read(terminal, 65536)


def _processor_seconds(process: int) -> float:
    """What all threads of a process have had of the processor."""
    tasks = Path(f"/proc/{process}/task").glob("*/schedstat")
    return 1e-9 * sum(int(task.read_text(encoding="ascii").split()[0]) for task in tasks)


def main() -> None:
    least, plain_prompt, our_prompt = commands(), list[float](), list[float]()
    with TemporaryDirectory() as home:
        for turn in range(REPEATS + 1):
            plain = prompt_seconds([sys.executable, "-c", BARE_PROMPT], b".READY>", home)
            ours = prompt_seconds(VRS, SIGN, home)
            if turn:  # the first turn warms the caches
                plain_prompt.append(plain)
                our_prompt.append(ours)
    bare = least["python -c pass"]
    print(f"least of {REPEATS}, milliseconds of the processor")
    for name, seconds in least.items():
        print(f"{name:37}  {seconds * 1e3:7.1f}   {seconds / bare:.1f} times")
    print(f"medians of {REPEATS}, milliseconds")
    print(f"bare prompt-toolkit       {median(plain_prompt) * 1e3:7.1f}")
    ratio = median(our_prompt) / median(plain_prompt)
    print(f"vrs, first prompt         {median(our_prompt) * 1e3:7.1f}   {ratio:.2f} times (bar: 1.5)")
    keys = key_seconds()
    print(f"least of {TYPED}, milliseconds of the processor for a key")
    print(f"bare prompt-toolkit       {keys['bare'] * 1e3:7.2f}")
    print(f"vrs                       {keys['vrs'] * 1e3:7.2f}   {keys['vrs'] / keys['bare']:.2f} times")


if __name__ == "__main__":
    main()
