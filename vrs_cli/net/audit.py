"""The audit: one line for every command, and for every user who came or went: when, who, where, what, and the result.

    {"when": "2027-03-01T09:30:00.123Z", "robot": "cell1", "who": "ada", "from": "10.0.0.7:51344", "what": "MOVE part",
     "result": "done"}

Lines are given to the system at once. The file is bounded: at `most` bytes it becomes audit.1.jsonl, replacing the old
one, and a new file is begun.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from vrs_cli.files.atomic import writing
from vrs_cli.files.opening import reason

MOST = 10_000_000  # bytes of one file; there are two
LONGEST = 1000  # characters of one command
LONGEST_NAME = 40  # characters of a name: a stranger may send any
ADDING = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_BINARY", 0)
PRIVATE = 0o600


class Audit:
    """Adds lines to a file; without a path it does nothing. `now` tells seconds since 1970. `tell` is called once when
    the file cannot be written, and once when it can again; commands go on meanwhile.

    Raises FileError if the file cannot be begun.
    """

    def __init__(
        self, path: Path | None, now: Callable[[], float], tell: Callable[[str], None], most: int = MOST
    ) -> None:
        self._path, self._now, self._tell, self._most = path, now, tell, most
        self._handle, self._size = -1, 0
        self._failing = False
        if path is not None:
            with writing(path, "name another place"):
                self._open(path)

    def note(self, robot: str, who: str, address: str, what: str, result: str) -> None:
        """Add a line: what `who`, at an address, did or tried at a robot, and the result. Never raises."""
        if self._path is None:
            return
        when = datetime.fromtimestamp(self._now(), UTC).isoformat(timespec="milliseconds")
        row = {
            "when": when.replace("+00:00", "Z"),
            "robot": robot[:LONGEST_NAME],
            "who": who[:LONGEST_NAME],
            "from": address,
            "what": what if len(what) <= LONGEST else f"{what[:LONGEST]}... ({len(what)} characters)",
            "result": result[:LONGEST],
        }
        try:
            self._add(self._path, json.dumps(row).encode() + b"\n")
        except OSError as error:
            if not self._failing:
                self._tell(f"*File error* the audit {self._path} cannot be written: {reason(error)}; commands go on")
            self._failing = True
        else:
            if self._failing:
                self._tell(f"the audit {self._path} is written again")
            self._failing = False

    def close(self) -> None:
        handle, self._handle = self._handle, -1
        if handle >= 0:
            os.close(handle)

    def _add(self, path: Path, line: bytes) -> None:
        if self._handle < 0:
            self._open(path)
        if self._size + len(line) > self._most:
            self.close()
            os.replace(path, path.with_suffix(f".1{path.suffix}"))
            self._open(path)
        written = os.write(self._handle, line)
        if written < len(line):  # the disk is full: no half of a line stays
            os.ftruncate(self._handle, self._size)
            raise OSError(0, "there is no room")
        self._size += written

    def _open(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._handle = os.open(path, ADDING, PRIVATE)
        self._size = os.fstat(self._handle).st_size
