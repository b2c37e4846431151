"""Type lines into `vrs connect` on a pseudo-terminal while another client's program moves the robot.

    python -m tests.net.onlookers 1000 [SEED]

Each line has an answer of its own, which has to come before the next line is typed, after a random pause. At the end
ABORT is typed: it has to stop the program of the other client.
"""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.by_hand import command
from tests.net.serving import Caller
from tests.repl.ptys import shell_on_pty
from vrs_cli.net.messages import Done, Hello, Line

ENDLESS = (".PROGRAM swing()", "DO", "DRIVE 1, 30, 100", "DRIVE 1, -30, 100", "UNTIL FALSE", ".END")
LONGEST_PAUSE = 0.3  # [s] before a line


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of a robot in real time, which another process serves."""
    command = [sys.executable, "-m", "vrs_cli", "serve", "--port", "0", "--realtime", "--folder", str(folder)]
    process = subprocess.Popen([*command, "--robot", "cell1=puma560"], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().split()[2].rstrip(",") + "/robots/cell1"
    finally:
        process.kill()
        process.communicate()


def watch(lines: int, seed: int, folder: Path) -> float:
    """The longest time [s] between Enter and an answer."""
    chance, slowest = random.Random(seed), 0.0
    with served(folder) as address, Caller(address, Hello((1,))) as driver:
        driver.lines(*ENDLESS)
        running = driver.send(lambda id: Line(id, "EXECUTE swing"))
        with shell_on_pty(folder, "connect", address) as shell:
            shell.until("EXIT leaves")
            for number in range(1, lines + 1):
                time.sleep(chance.uniform(0.0, LONGEST_PAUSE))
                shell.type(f"LISTR {number}*7919\r")
                slowest = max(slowest, shell.until(str(number * 7919)))
                if not number % 100:
                    print(f"{number} lines, each answered within {slowest:.3f} s", flush=True)
            shell.type("ABORT\r")
            driver.until(lambda message: isinstance(message, Done) and message.id == running)
    return slowest


def main(lines: int = 1000, seed: int = 1) -> None:
    with tempfile.TemporaryDirectory() as folder:
        slowest = watch(lines, seed, Path(folder))
    print(
        f"{lines} lines on Python {sys.version.split()[0]}, slowest answer {slowest:.3f} s; ABORT stopped the program"
    )


if __name__ == "__main__":
    command(main)
