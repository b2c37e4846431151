"""Read the lines of a pipe in a thread, so that whoever waits for a line can drive the robot meanwhile."""

from __future__ import annotations

import codecs
import os
from collections.abc import Callable, Iterator
from io import IncrementalNewlineDecoder, TextIOBase
from queue import Empty, Queue
from threading import Thread
from typing import Protocol

KEEPING_UP, RESTING = 0.1, 1.0  # [s] between two updates in real time: while the arm moves, and at rest
MIN_WAIT_S = 0.01  # minimum wait [s]
QUESTION = "\0"  # a reader of lines returns it in place of a line when a program asks
AHEAD = 1000  # maximum number of lines that are read ahead
CHUNK = 65536  # maximum number of bytes of one read


class Driven(Protocol):
    """A robot that is driven while somebody waits for something else."""

    def step(self) -> None:
        """Do the next thing that is due; if nothing is, wait for it, or until `wake` is called."""

    def wake(self) -> None:
        """End the wait. Any thread may call this."""


class PipedLines:
    """The lines of a stream with a file descriptor. While a line is waited for, `robot` is driven, if one is set."""

    def __init__(self, stream: TextIOBase) -> None:
        """Take the descriptor. Raises OSError for a stream without one."""
        self.robot: Driven | None = None
        self.after: Callable[[], object] = lambda: None  # called after each step
        self._descriptor = stream.fileno()
        made = codecs.getincrementaldecoder(stream.encoding or "utf-8")(stream.errors or "strict")
        self._decoder = IncrementalNewlineDecoder(made, translate=True)
        self._lines: Queue[str | Exception | None] = Queue(AHEAD)  # None at the end
        self._reader: Thread | None = None

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        """Return the next line. Raises UnicodeDecodeError."""
        if self._reader is None:  # a raw read holds no lock of the stream, so the process may end during it
            self._reader = Thread(target=self._read, name="input", daemon=True)
            self._reader.start()
        line = self._next()
        if isinstance(line, str):
            return line
        self._lines.put(None)  # marks the end again, for a second call
        raise StopIteration if line is None else line

    def _next(self) -> str | Exception | None:
        while self.robot is not None:
            try:
                return self._lines.get_nowait()
            except Empty:
                self.robot.step()
                self.after()
        return self._lines.get()

    def _read(self) -> None:
        left = ""
        try:
            while chunk := os.read(self._descriptor, CHUNK):
                *lines, left = (left + self._decoder.decode(chunk)).split("\n")
                for line in lines:
                    self._put(f"{line}\n")
            left += self._decoder.decode(b"", final=True)
        except OSError:
            pass  # the terminal is closed
        except UnicodeError as error:
            self._put(error)
        if left:
            self._put(left)
        self._put(None)

    def _put(self, line: str | Exception | None) -> None:
        self._lines.put(line)
        if self.robot is not None:
            self.robot.wake()


def lines_of_pipe(stream: object) -> PipedLines | None:
    """Return the lines of a stream; None for a stream that a thread cannot read (a text in memory)."""
    try:
        return PipedLines(stream) if isinstance(stream, TextIOBase) else None
    except OSError:
        return None
