"""The dialects of a program: how far the language goes, and how its operators group. A property of loading.

A file says its own in a comment above its first program: `; dialect: val2`. Each dialect has the words of those before
it. That VAL and VAL-II group AND, OR and NOT tighter than relations is from memory (val2 section 2.2), and no paper
manual has confirmed it.
"""

from __future__ import annotations

from enum import Enum


class Dialect(Enum):
    """By the name that a file and `--dialect` give; `title`: its name in messages."""

    VAL = "val", "VAL"
    VAL2 = "val2", "VAL-II"
    VPLUS = "vplus", "V+"

    def __new__(cls, word: str, title: str) -> Dialect:
        dialect = object.__new__(cls)
        dialect._value_ = word
        dialect.title = title
        return dialect

    title: str

    def knows(self, where: str) -> bool:
        """Return whether it has what a row of the tables says of its lineage; what is ours is in all of them."""
        marks = where.split()
        return not marks or any(mark in self._marks for mark in marks)

    @property
    def _marks(self) -> frozenset[str]:
        return _MARKS[self]


_MARKS = {
    Dialect.VAL: frozenset({"1"}),
    Dialect.VAL2: frozenset({"1", "2"}),
    Dialect.VPLUS: frozenset({"1", "2", "+"}),
}
DIALECTS = tuple(dialect.value for dialect in Dialect)
