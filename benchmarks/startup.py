"""How soon `vrs` is there: `python -m benchmarks.startup` (needs a pseudo-terminal; vrs installed in this Python).

Ratios to a bare `python -c pass` and to a bare prompt-toolkit prompt, in turn, in one run.
"""

from __future__ import annotations

import os
import pty
import select
import subprocess
import sys
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

REPEATS = 15
PATIENCE = 20.0  # [s]
VRS = str(Path(sys.executable).with_name("vrs"))
SIGN = b"\x1b[0m.\x1b[0m"  # the dot, as prompt-toolkit paints it
BARE_PROMPT = "from prompt_toolkit import PromptSession; PromptSession('.READY>').prompt()"


def process_seconds(command: list[str]) -> float:
    """From start to end of a process."""
    begin = perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return perf_counter() - begin


def prompt_seconds(command: list[str], sign: bytes, home: str) -> float:
    """From start to the first time that `sign` is on the screen of a terminal."""
    begin = perf_counter()
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
        return perf_counter() - begin
    finally:
        os.kill(child, 9)
        os.close(terminal)
        os.waitpid(child, 0)


def main() -> None:
    bare, version, plain_prompt, our_prompt = [], [], [], []
    with TemporaryDirectory() as home:
        for turn in range(REPEATS + 1):
            figures = (
                process_seconds([sys.executable, "-c", "pass"]),
                process_seconds([VRS, "--version"]),
                prompt_seconds([sys.executable, "-c", BARE_PROMPT], b".READY>", home),
                prompt_seconds([VRS], SIGN, home),
            )
            if turn:  # the first turn warms the caches
                for column, figure in zip((bare, version, plain_prompt, our_prompt), figures, strict=True):
                    column.append(figure * 1e3)
    print(f"medians of {REPEATS}, milliseconds")
    print(f"python -c pass            {median(bare):7.1f}")
    print(f"vrs --version             {median(version):7.1f}   {median(version) / median(bare):.2f} times (bar: 3)")
    print(f"bare prompt-toolkit       {median(plain_prompt):7.1f}")
    ratio = median(our_prompt) / median(plain_prompt)
    print(f"vrs, first prompt         {median(our_prompt):7.1f}   {ratio:.2f} times (bar: 1.5)")


if __name__ == "__main__":
    main()
