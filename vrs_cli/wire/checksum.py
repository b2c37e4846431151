"""The checksum of a line of a trajectory file, its last key: `"crc":"5f0c8e1a"`.

It is the CRC-32 (that of zlib) of the line up to its comma, begun from the checksum of the line above: a line that is
changed, left out, doubled, moved or of another file does not fit.
"""

from __future__ import annotations

import re
import zlib

from vrs_cli.wire.records import RecordError

START = 0  # what the first line begins from
KEY = b',"crc":"'
SEALED = KEY + b'%08x"}'
LENGTH = len(SEALED % START)
_SAID = re.compile(rb',"crc":"([0-9a-f]{8})"}$')


class Checksums:
    """Those of the lines of one file, in their order. `last`: that of the last line; None where the lines have none,
    as files had it before."""

    def __init__(self, last: int | None = START) -> None:
        self.last = last

    def seal(self, record: bytes) -> bytes:
        """The next line with its checksum; `record` is one JSON object that is not empty."""
        if self.last is None:
            return record
        self.last = zlib.crc32(record[:-1], self.last)
        return record[:-1] + SEALED % self.last

    def open(self, line: bytes) -> bytes:
        """The record of the next line, which may have its line end. Raises RecordError where the checksum is not that
        of the line."""
        if self.last is None:
            return line
        line = line.removesuffix(b"\n")
        body = line[:-LENGTH]
        due = zlib.crc32(body, self.last)
        if line[-LENGTH:] != SEALED % due:
            raise RecordError("its checksum does not fit: it is not the line that was written here")
        self.last = due
        return body + b"}"

    def skip(self, line: bytes) -> bytes:
        """The record of a line whose checksum does not fit; the next line is held against what this one says."""
        line = line.removesuffix(b"\n")
        said = _SAID.search(line)
        if said is None:
            return line
        self.last = int(said[1], 16)
        return line[: said.start()] + b"}"
