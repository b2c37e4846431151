"""Real processes of vrs that share a folder: they begin at one moment, are driven line by line, and killed.

What a process has acknowledged is what it had done before an answer of a later line was read.
"""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from vrs_cli.files.trajectory_file import read_trajectory

ROOT = Path(__file__).parents[2]
BEGIN = """
import os, sys
import filelock, vrs_cli.files.journal, vrs_cli.repl.loop, vrs_cli.repl.local_robot
from vrs_cli.__main__ import main
print("ready", flush=True)
while os.read(0, 1) not in (b"\\n", b""):
    pass
sys.exit(main(sys.argv[1:]))
"""
MOVED = "all of it goes on in "


class Vrs:
    """One process. `acknowledged`: the motions that it has answered; `said`: all its other lines."""

    def __init__(self, name: int, folder: Path, *arguments: str) -> None:
        self.name, self.folder = name, folder
        self.journal = folder / arguments[-1]
        self.acknowledged: list[str] = []
        self.said: list[str] = []
        self._count = 0
        self.process = subprocess.Popen(
            [sys.executable, "-c", BEGIN, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        assert self.line() == "ready"

    def go(self) -> None:
        self.send("go")

    def send(self, *lines: str) -> None:
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):  # it has ended
            self.process.stdin.write("".join(f"{line}\n" for line in lines))
            self.process.stdin.flush()

    def drive(self, count: int = 1) -> bool:
        """So many motions, each with its answer; False where the process has ended."""
        for _ in range(count):
            self._count += 1
            text = f"DRIVE 1, {(-1) ** self._count * (1 + self.name / 10 + self._count / 1000):.3f}"
            if not self.answered(text):
                return False
            self.acknowledged.append(text)
        return True

    def answered(self, line: str) -> bool:
        """Whether a line and what it says are done, and not refused."""
        mark, before = f"answer {self.name} {self._count}", len(self.said)
        self.send(line, f'TYPE "{mark}"')
        while (said := self.line()) is not None:
            if said == mark:
                return not any("cannot be written" in one for one in self.said[before:])
            self._note(said)
        return False

    def _note(self, said: str) -> None:
        self.said.append(said)
        if MOVED in said:
            self.journal = self.folder / said.partition(MOVED)[2]

    def line(self) -> str | None:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        return line.rstrip("\n") if line else None

    def leave(self) -> int:
        """EXIT; the status."""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.close()
        while (said := self.line()) is not None:
            self._note(said)
        return self.process.wait()

    def kill(self) -> None:
        """As kill -9 does."""
        self.process.kill()
        self.process.wait()

    def check(self) -> None:
        """Nothing that was acknowledged is lost: it is in the file that was told last, in its order."""
        if not self.acknowledged:
            return
        written = iter([delta.motion.text for delta in read_trajectory(self.journal).deltas])
        assert all(text in written for text in self.acknowledged), f"lost of {self.name}: {self.said}"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.process.kill()
        for stream in (self.process.stdin, self.process.stdout):
            assert stream is not None
            with suppress(BrokenPipeError):
                stream.close()
        self.process.wait()
