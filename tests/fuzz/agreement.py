"""`vrs check` and `vrs run` agree about every file: what one calls an error keeps the other from executing it.

`python -m tests.fuzz.agreement COUNT [SEED]` tries mutated programs; number n of a run is that of SEED + n. It prints
how many there were, what was done to them, in how many both found errors, and each disagreement. Status 1 where they
disagree.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import NamedTuple

from tests.by_hand import command
from tests.fuzz.lines import EXTREMES, PLACES
from tests.fuzz.probe import BOUNDS, Silent
from tests.fuzz.texts import FILES, FOREIGN, ROOT, words
from vrs_cli.errors import VrsError
from vrs_cli.files.opening import Folder
from vrs_cli.files.program_file import decode_program
from vrs_cli.interfaces.inspection import Inspector, beside_each
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.words.foreign import theirs
from vrs_cli.values.diagnostics import Diagnostic, errors

WORD = re.compile(r"[A-Za-z$#][\w.]*|\d+(?:\.\d+)?")
HEADING = re.compile(r"(?im)^[ \t]*\.PROGRAM\b")
MOST = 4  # mutations of a file
TOGETHER = 4  # every so many files one is cut into several


class Variant(NamedTuple):
    """A file with changes, and what was done to it."""

    text: str
    changes: tuple[str, ...]


def variant(random: Random) -> Variant:
    """A program of the samples, mutated."""
    text, done = random.choice(files()), list[str]()
    for _ in range(random.randint(1, MOST)):
        name = random.choice(tuple(CHANGES))
        text = CHANGES[name](text, random)
        done.append(name)
    return Variant(text, tuple(done))


@cache
def files() -> tuple[str, ...]:
    """The programs of the checkout, and some with the values of a controller."""
    paths = (path for pattern in FILES for path in sorted(ROOT.glob(pattern)))
    return (*(path.read_text(encoding="utf-8") for path in paths), *FOREIGN, *CONTROLLER)


CONTROLLER = (
    ".PROGRAM a()\n  MOVE now\n  MOVES now:off\n.END\n.LOCATIONS\nnow -1 0 0 0 1 0\n0 0 -1 430.16 49.7 710\n"
    "off 1 0 0 0 1 0 0 0 1 1 2 3 ; here\nrow[1] 0 1 0 -1 0 0\n 0 0 1 -20 550 -250\n#p 0 -90 90 0 0 0\n.END\n",
)


# --- changes ---------------------------------------------------------------------------------------------------------


def _at_word(text: str, random: Random, new: Callable[[str], str]) -> str:
    """The text with one of its words replaced."""
    found = list(WORD.finditer(text))
    if not found:
        return text + new("")
    one = random.choice(found)
    return text[: one.start()] + new(one[0]) + text[one.end() :]


def _line(text: str, random: Random, new: Callable[[str], Iterable[str]]) -> str:
    """The text with others in place of one of its lines."""
    rows = text.split("\n")
    at = random.randrange(len(rows))
    return "\n".join((*rows[:at], *new(rows[at]), *rows[at + 1 :]))


def _swap(text: str, random: Random) -> str:
    rows = text.split("\n")
    a, b = random.randrange(len(rows)), random.randrange(len(rows))
    rows[a], rows[b] = rows[b], rows[a]
    return "\n".join(rows)


def _control(text: str, random: Random) -> str:
    at = random.randint(0, len(text))
    return text[:at] + random.choice(("\0", "\0\0", "\x01", "\x07", "\x1a", "\r", "\x0c")) + text[at:]


def _block(text: str, random: Random) -> str:
    new = random.choice(("IF x = = 3 THEN", "IF x THN", "WHILE DO", "FOR i 1 TO", "CASE OF", "END", "ELSE", "UNTIL ("))
    return _line(text, random, lambda row: (new, row))


CHANGES: dict[str, Callable[[str, Random], str]] = {
    "a word": lambda text, random: _at_word(text, random, lambda _old: random.choice(words())),
    "an argument": lambda text, random: _at_word(text, random, lambda _old: random.choice((*EXTREMES, *PLACES))),
    "a word of another maker": lambda text, random: _at_word(text, random, lambda _old: random.choice(tuple(theirs()))),
    "a line of another maker": lambda text, random: _line(
        text, random, lambda row: (row, random.choice(random.choice(FOREIGN).split("\n")))
    ),
    "a misspelt word": lambda text, random: _at_word(text, random, lambda old: old[: random.randint(0, len(old))]),
    "a word gone": lambda text, random: _at_word(text, random, lambda _old: ""),
    "a line gone": lambda text, random: _line(text, random, lambda _row: ()),
    "a line twice": lambda text, random: _line(text, random, lambda row: (row, row)),
    "a line cut": lambda text, random: _line(text, random, lambda row: (row[: random.randint(0, len(row))],)),
    "lines swapped": _swap,
    "a control character": _control,
    "a line of a block": _block,
}


# --- the law ---------------------------------------------------------------------------------------------------------


class Agreement:
    """Checks and loads files, each by itself. `counted`: what was found."""

    def __init__(self) -> None:
        self._model = load_robot("puma560")
        self._inspector = Inspector(self._model)
        self.counted: Counter[str] = Counter()

    def __call__(self, text: str) -> None:
        """Raises AssertionError."""
        text = decode_program("file", text.encode("utf-8", errors="replace"))
        checked = _told(self._inspector.inspect(self._inspector.read(text)))
        with_it = Station(Silent(), self._model, limits=BOUNDS, folder=Folder(Path.cwd()))
        try:
            loaded = _told(with_it.load_text(text))
            assert checked == loaded, f"check alone: {checked - loaded}; run alone: {loaded - checked}"
            self.counted["both find errors" if checked else "both find none"] += 1
            if not checked:
                self._begins(with_it)
        finally:
            with_it.close()

    def together(self, text: str) -> None:
        """The same of a text that is cut into files of one name space. Raises AssertionError."""
        text = decode_program("file", text.encode("utf-8", errors="replace"))
        cuts = [at.start() for at in HEADING.finditer(text)][1:]
        files = [text[a:b] for a, b in pairwise((0, *cuts[:: max(len(cuts) // 3, 1)], len(text)))]
        inspectors = [Inspector(self._model) for _ in files]
        read = [one.read(file) for one, file in zip(inspectors, files, strict=True)]
        with_it = Station(Silent(), self._model, limits=BOUNDS, folder=Folder(Path.cwd()))
        try:
            loaded = with_it.load_texts([(file, "") for file in files])
        finally:
            with_it.close()
        for one, parts, beside, found in zip(inspectors, read, beside_each(read), loaded, strict=True):
            checked, refused = _told(one.inspect(parts, beside)), _told(found.diagnostics)
            assert checked == refused, f"together: check alone: {checked - refused}; run alone: {refused - checked}"
        self.counted["files of name spaces"] += len(files)

    def _begins(self, station: Station) -> None:
        """A file without errors has no program that is refused when it is executed."""
        for stored in tuple(station.programs.values()):
            try:
                station.begin(stored.name, primed=True)
            except VrsError as refused:
                raise AssertionError(f"check finds nothing in {stored.name}, EXECUTE refuses it: {refused}") from None
            _ = station.environment.executable(stored).compilation
            self.counted["programs primed"] += 1


def _told(found: Iterable[Diagnostic]) -> set[tuple[int, int, int, str]]:
    return {(one.span.line, one.span.column, one.code, one.detail) for one in errors(found)}


def disagreements(count: int, seed: int, law: Agreement, made: Counter[str]) -> Iterator[str]:
    """Try so many variants."""
    for number in range(seed, seed + count):
        it = variant(Random(number))
        made.update(it.changes)
        try:
            law(it.text)
            if number % TOGETHER == 0:
                law.together(it.text)
        except Exception as error:
            yield f"--- seed {number}: {type(error).__name__}: {error}\n{it.text}"


def main(count: int, seed: int = 1) -> int:
    law, made, wrong = Agreement(), Counter[str](), 0
    for one in disagreements(count, seed, law, made):
        print(one, flush=True)
        wrong += 1
    told = ", ".join(f"{number} {what}" for what, number in sorted({**law.counted, **made}.items()))
    print(f"{count} files: {told}; {wrong} disagreements")
    return 1 if wrong else 0


if __name__ == "__main__":
    command(main)
