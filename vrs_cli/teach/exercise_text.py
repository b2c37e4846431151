"""Reads the values of checks.toml; each mistake is noted with its line and what would be right."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from math import radians
from typing import Any

from vrs_cli.errors import did_you_mean
from vrs_cli.files.cell_text import FARTHEST, UPRIGHT, CellEntry, CellText
from vrs_cli.kinematics.transform import IDENTITY, from_oat
from vrs_cli.language.run.variables import Item
from vrs_cli.language.words.values import key_of
from vrs_cli.teach.places import MODEL, FixedPlace, GivenPlace, ModelPlace, Place

MAX_TEXT_CHARS = 2000
MAX_LIST_ITEMS = 200
_LOCATION = re.compile(r"(?i)\s*([A-Z][A-Z0-9._]*)\s*(?:\[\s*(\d+(?:\s*,\s*\d+){0,2})\s*\])?\s*")


class ExerciseText(CellText):
    """Reads values out of checks.toml, and goes on after each mistake.

    `locations`: those that the exercise gives. `parts`, `bodies`: names in its cell, of parts and of all that an arm
    can touch.
    """

    def __init__(
        self,
        path: str,
        text: str,
        locations: Iterable[Item] = (),
        parts: Sequence[str] = (),
        bodies: Sequence[str] = (),
    ) -> None:
        super().__init__(path, text)
        self.locations, self.parts, self.bodies = frozenset(locations), tuple(parts), tuple(bodies)

    def number(self, entry: CellEntry, key: str, least: float, most: float, unit: str = "") -> float:
        """Read a number; `least` where it is wrong."""
        given: Any = entry.given.get(key)
        if type(given) in (int, float) and least <= given <= most:
            return float(given)
        self.fault(entry, key, f"{self.said(given)}a number from {least:g} to {most:g}{f' {unit}' if unit else ''}")
        return least

    def text(self, entry: CellEntry, key: str) -> str:
        """Read a text that is not empty."""
        given = entry.given.get(key)
        if isinstance(given, str) and given.strip() and len(given) <= MAX_TEXT_CHARS:
            return given
        self.fault(entry, key, f"{self.said(given)}a text in quotes, at most {MAX_TEXT_CHARS} characters")
        return ""

    def list_of(self, entry: CellEntry, key: str, wanted: str) -> list[Any]:
        """Read a list of one thing or more."""
        given = entry.given.get(key)
        if isinstance(given, list) and 0 < len(given) <= MAX_LIST_ITEMS:
            return given
        self.fault(entry, key, f"{self.said(given)}{wanted}, {MAX_LIST_ITEMS} at most")
        return []

    def texts(self, entry: CellEntry, key: str) -> tuple[str, ...]:
        """Read a list of texts."""
        found = self.list_of(entry, key, 'a list of texts, such as ["one", "two"]')
        if not all(isinstance(one, str) and one and len(one) <= MAX_TEXT_CHARS for one in found):
            self.fault(entry, key, 'each is a text in quotes, such as ["one", "two"]')
            return ()
        return tuple(found)

    def part(self, entry: CellEntry, key: str) -> str:
        """Read the name of a part of the cell."""
        return self.name(entry, key, entry.given.get(key), self.parts, "part")

    def name(self, entry: CellEntry, key: str, given: Any, known: Sequence[str], what: str) -> str:
        """Return one of the known names of things of the cell, in lower case; "" where it is none."""
        if isinstance(given, str) and given.lower() in known:
            return given.lower()
        there = f"there are {', '.join(known)}" if known else f"the cell has no {what}"
        near = did_you_mean(given.lower(), known, there) if isinstance(given, str) else there
        self.fault(entry, key, f"{self.said(given)}no {what} of this name; {near}")
        return ""

    def said(self, given: Any) -> str:
        """Return the beginning of a message about a wrong value."""
        return "it is missing: " if given is None else f"{_cut(given)}: "

    # --- places ---

    def exercise_place(self, entry: CellEntry, key: str) -> Place:
        """Read a place; the origin where it is wrong."""
        return self.place_of(entry, key, entry.given.get(key))

    def place_of(self, entry: CellEntry, key: str, given: Any) -> Place:
        """Return the place that a value of the file means."""
        if given == MODEL:
            return ModelPlace()
        if isinstance(given, str):
            return self._given_place(entry, key, given)
        if isinstance(given, list) and len(given) in (3, 6) and all(map(_is_coordinate, given)):
            x, y, z, *angles = map(float, given)
            o, a, t = map(radians, angles or UPRIGHT)
            return FixedPlace(from_oat(x / 1000.0, y / 1000.0, z / 1000.0, o, a, t), bool(angles))
        wanted = '[X, Y, Z] in mm, [X, Y, Z, O, A, T] with degrees, the name of a given location, or "model"'
        self.fault(entry, key, f"{self.said(given)}{wanted}")
        return FixedPlace(IDENTITY, turned=False)

    def _given_place(self, entry: CellEntry, key: str, given: str) -> Place:
        items = list[Item]()
        for text in given.split(":"):
            item = item_of_text(text)
            if item is None or item not in self.locations:
                known = sorted({name for name, _ in self.locations})
                there = f"given.v2 has {', '.join(known)}" if known else "given.v2 has no locations"
                what = f"{_cut(given)}: no given location is called {text.strip()[:40]!r}"
                self.fault(entry, key, f"{what}; {did_you_mean(text.strip().lower(), known, there)}")
                return FixedPlace(IDENTITY, turned=False)
            items.append(item)
        return GivenPlace(given, tuple(items))


def item_of_text(text: str) -> Item | None:
    """Return the variable that a text names, `corner` or `slot[2,1]`; None where it is no name."""
    found = _LOCATION.fullmatch(text)
    if found is None:
        return None
    indexes = tuple(int(one) for one in (found[2] or "").split(",") if one)
    return key_of(found[1]), None if not indexes else indexes if len(indexes) > 1 else indexes[0]


def _is_coordinate(given: Any) -> bool:
    return type(given) in (int, float) and abs(given) <= FARTHEST


def _cut(given: Any) -> str:
    text = repr(given) if not isinstance(given, int) or abs(given) < 1e30 else "a huge number"
    return text if len(text) <= 80 else f"{text[:77]}..."


Read = Callable[[ExerciseText, CellEntry, str], Any]
