"""Read the lines of a pipe in a thread, so that the robot's actions are carried out while the shell waits for a
line."""

from __future__ import annotations

import codecs
import os
from collections.abc import Callable, Iterator
from io import IncrementalNewlineDecoder, TextIOBase
from queue import Queue
from threading import Thread
from typing import Protocol

KEEPING_UP, RESTING = 0.1, 1.0  # [s] interval of updates in real time: while the arm moves, and at rest
MIN_WAIT_S = 0.01  # [s] minimum wait between updates
QUESTION = "\0"  # a reader returns this in place of a line when a program asks a question
AHEAD = 1000  # maximum number of lines that are read in advance


class Driven(Protocol):
    """A robot in this process, whose due actions the shell carries out while it waits for input."""

    def step(self) -> None:
        """Carry out the next action that is due. If none is due, wait for one, or until `wake` is called."""

    def wake(self) -> None:
        """End the wait of `step`. Any thread may call this method."""


class PipedLines:
    """An iterator over the lines of a stream that has a file descriptor. While it waits for a line, it carries out the
    due actions of `robot`, if one is set."""

    def __init__(self, stream: TextIOBase) -> None:
        """Start with the stream's file descriptor. Raises OSError if the stream has none."""
        self.robot: Driven | None = None
        self.after: Callable[[], object] = lambda: None  # called after each step of the robot
        self._descriptor = stream.fileno()
        made = codecs.getincrementaldecoder(stream.encoding or "utf-8")(stream.errors or "strict")
        self._decoder = IncrementalNewlineDecoder(made, translate=True)
        self._lines: Queue[str | Exception | None] = Queue(AHEAD)  # None marks the end
        self._reader: Thread | None = None

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        """Return the next line. Raises UnicodeDecodeError if the input is not valid text."""
        # it reads the descriptor, which needs no lock of the stream, so the process can end during a read
        if self._reader is None:
            self._reader = Thread(target=self._read, name="input", daemon=True)
            self._reader.start()
        while self.robot is not None and self._lines.empty():
            self.robot.step()
            self.after()
        line = self._lines.get()
        if isinstance(line, str):
            return line
        self._lines.put(None)  # so that a later call also finds the end
        raise StopIteration if line is None else line

    def _read(self) -> None:
        left = ""
        try:
            while chunk := os.read(self._descriptor, 65536):
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
    """Return the lines of a stream, or None for a stream without a file descriptor (such as a StringIO)."""
    try:
        return PipedLines(stream) if isinstance(stream, TextIOBase) else None
    except OSError:
        return None
