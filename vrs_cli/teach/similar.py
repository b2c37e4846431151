"""Find submissions that are like each other, by their words.

Each submission becomes a row of words without comments and blanks. A run of `RUN` words is
compared as a whole; in it each name stands for the place at which the run first has it, so that programs that differ in
names alone are equal. Runs that the exercise itself gives do not count. Of all runs some are kept, always the same of
equal runs (winnowing: Schleimer, Wilkerson, Aiken, SIGMOD 2003), and two submissions are compared by the runs that they
share: twice their number, divided by the number of both (Dice).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence

from msgspec import Struct

from vrs_cli.language.text.parser import variables_in
from vrs_cli.render.colours import Ink, scan

RUN = 8  # words
WINDOW = 4  # of so many runs in a row one is kept
LEAST_RUNS = 5  # a submission with fewer is too short to be compared
MAX_CHARS = 20_000  # of one submission: the first ones
DECIMALS = 2


class Likeness(Struct, frozen=True):
    """Two students whose submissions are alike, the first before the second in order; `similarity` from 0 to 1."""

    first: str
    second: str
    similarity: float


def similar(texts: Mapping[str, str], given: Iterable[str], least: float | None) -> tuple[Likeness, ...]:
    """Return the pairs of students whose texts are alike by `least` or more, the most alike first; None: no pairs.
    `given`: texts that the exercise gives.
    """
    if least is None:
        return ()
    known = {run for text in given for run in _runs(_words(text))}
    kept = {
        student: _winnowed([run for run in _runs(_words(text)) if run not in known]) for student, text in texts.items()
    }
    students = sorted((one for one in kept if len(kept[one]) >= LEAST_RUNS), key=lambda one: (one.casefold(), one))
    found = [
        Likeness(first, second, share)
        for number, first in enumerate(students)
        for second in students[number + 1 :]
        if (share := _dice(kept[first], kept[second])) >= least
    ]
    return tuple(sorted(found, key=lambda one: -one.similarity))


def _dice(first: frozenset[int], second: frozenset[int]) -> float:
    return round(2.0 * len(first & second) / (len(first) + len(second)), DECIMALS)


def _words(text: str) -> list[tuple[bool, str]]:
    """The first words of a text, and whether each is a name."""
    lines = text[:MAX_CHARS].splitlines()
    variables = variables_in(lines)
    return [
        (ink is Ink.NAME, word.upper() if ink is not Ink.STRING else word)
        for line in lines
        for piece, ink in scan(line, variables)
        if ink is not Ink.COMMENT
        for word in piece.split()
    ]


def _runs(words: Sequence[tuple[bool, str]]) -> list[int]:
    """A number for each run of words: of equal runs the same, whatever their names are."""
    found = []
    for begin in range(len(words) - RUN + 1):
        names = dict[str, str]()
        run = (
            names.setdefault(word, f"name {len(names)}") if named else word
            for named, word in words[begin : begin + RUN]
        )
        found.append(int.from_bytes(hashlib.blake2b("\0".join(run).encode(), digest_size=8).digest()))
    return found


def _winnowed(runs: Sequence[int]) -> frozenset[int]:
    """The least of each `WINDOW` runs in a row."""
    if len(runs) <= WINDOW:
        return frozenset(runs)
    return frozenset(min(runs[begin : begin + WINDOW]) for begin in range(len(runs) - WINDOW + 1))
