"""A fault of a file."""

from __future__ import annotations

from msgspec import Struct


class Fault(Struct, frozen=True):
    """What is wrong in a file, and the line that says so."""

    line: int
    what: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.what}"
