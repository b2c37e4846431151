"""The lines of a table that other programs write: fields between commas, blank lines and comments passed over."""

from __future__ import annotations


def fields_of(line: str) -> list[str]:
    """The fields of a line; none where it is blank, or a comment (`;` or `#`)."""
    said = line.partition(";")[0].partition("#")[0].strip()
    return [field.strip() for field in said.split(",")] if said else []
