"""Read what exercises and lessons share: values of checks.toml, places, the robot, the cell, and given programs.

Each mistake is recorded with its line and its correction.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from math import radians
from pathlib import Path
from typing import Any

from msgspec import Struct

from vrs_cli.errors import FileError, NonexistentFile, VrsError, did_you_mean
from vrs_cli.extras import shipped_folder
from vrs_cli.files.cell_file import read_cell
from vrs_cli.files.cell_text import MAX_LENGTH_MM, UPRIGHT, CellEntry, CellText
from vrs_cli.files.opening import text_at
from vrs_cli.interfaces.station.loaded_file import LoadedFile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, from_oat
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.run.signals import NO_CELL, Cell
from vrs_cli.language.run.variables import Item
from vrs_cli.language.text.parser import parse_file
from vrs_cli.language.words.values import key_of
from vrs_cli.values.diagnostics import Dialect, Severity


class FixedPlace(Struct, frozen=True, tag=True):
    """A place given as numbers, T_world_place. `turned`: whether an orientation was given."""

    T: Transform
    turned: bool


class GivenPlace(Struct, frozen=True, tag=True):
    """A location of `given.v2`, or a compound of several (`pallet:corner`). `text`: the place as written."""

    text: str
    items: tuple[Item, ...]


class ModelPlace(Struct, frozen=True, tag=True):
    """A place that is taken from the model's run."""


Place = FixedPlace | GivenPlace | ModelPlace
MODEL = "model"


MAX_TEXT_CHARS = 2000
MAX_LIST_ITEMS = 200
_LOCATION = re.compile(r"(?i)\s*([A-Z][A-Z0-9._]*)\s*(?:\[\s*(\d+(?:\s*,\s*\d+){0,2})\s*\])?\s*")


class ExerciseText(CellText):
    """Reads values of checks.toml; after a mistake it continues.

    `locations`: the locations that the exercise gives. `parts`, `bodies`: names of the parts, and of all bodies that an
    arm can touch.
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
        """Read a number; return `least` if the number is wrong."""
        given: Any = entry.given.get(key)
        if type(given) in (int, float) and least <= given <= most:
            return float(given)
        self.fault(entry, key, f"{self.prefix(given)}a number from {least:g} to {most:g}{f' {unit}' if unit else ''}")
        return least

    def text(self, entry: CellEntry, key: str) -> str:
        """Read a text that is not empty."""
        given = entry.given.get(key)
        if isinstance(given, str) and given.strip() and len(given) <= MAX_TEXT_CHARS:
            return given
        self.fault(entry, key, f"{self.prefix(given)}a text in quotes, at most {MAX_TEXT_CHARS} characters")
        return ""

    def list_of(self, entry: CellEntry, key: str, wanted: str) -> list[Any]:
        """Read a list with at least one item."""
        given = entry.given.get(key)
        if isinstance(given, list) and 0 < len(given) <= MAX_LIST_ITEMS:
            return given
        self.fault(entry, key, f"{self.prefix(given)}{wanted}, {MAX_LIST_ITEMS} at most")
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
        """Return the name of a known body in lower case; "" if the name is unknown."""
        if isinstance(given, str) and given.lower() in known:
            return given.lower()
        there = f"there are {', '.join(known)}" if known else f"the cell has no {what}"
        near = did_you_mean(given.lower(), known, there) if isinstance(given, str) else there
        self.fault(entry, key, f"{self.prefix(given)}no {what} of this name; {near}")
        return ""

    def prefix(self, given: Any) -> str:
        """Return the start of a message about a wrong value."""
        return "it is missing: " if given is None else f"{_cut(given)}: "

    # --- places ---

    def exercise_place(self, entry: CellEntry, key: str) -> Place:
        """Read a place; return the origin if it is wrong."""
        return self.place_of(entry, key, entry.given.get(key))

    def place_of(self, entry: CellEntry, key: str, given: Any) -> Place:
        """Return the place that a value of the file describes."""
        if given == MODEL:
            return ModelPlace()
        if isinstance(given, str):
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
        is_list = isinstance(given, list) and len(given) in (3, 6)
        if is_list and all(type(one) in (int, float) and abs(one) <= MAX_LENGTH_MM for one in given):
            x, y, z, *angles = map(float, given)
            o, a, t = map(radians, angles or UPRIGHT)
            return FixedPlace(from_oat(x / 1000.0, y / 1000.0, z / 1000.0, o, a, t), bool(angles))
        wanted = '[X, Y, Z] in mm, [X, Y, Z, O, A, T] with degrees, the name of a given location, or "model"'
        self.fault(entry, key, f"{self.prefix(given)}{wanted}")
        return FixedPlace(IDENTITY, turned=False)


def item_of_text(text: str) -> Item | None:
    """Return the variable that a text names, such as `corner` or `slot[2,1]`; None if the text is not a name."""
    found = _LOCATION.fullmatch(text)
    if found is None:
        return None
    indexes = tuple(int(one) for one in (found[2] or "").split(",") if one)
    return key_of(found[1]), None if not indexes else indexes if len(indexes) > 1 else indexes[0]


def _cut(given: Any) -> str:
    text = repr(given) if not isinstance(given, int) or abs(given) < 1e30 else "a huge number"
    return text if len(text) <= 80 else f"{text[:77]}..."


class BaseCheck(Struct, frozen=True, kw_only=True):
    """A check of any kind. `points`: its weight. `hidden`: students see neither its name nor its reason. `needs`: names
    of checks that must earn at least some points; otherwise this check earns none."""

    name: str
    points: float = 1.0
    hint: str = ""
    hidden: bool = False
    partial: bool = True
    needs: tuple[str, ...] = ()

    @property
    def needs_model(self) -> bool:
        """Return whether the check compares the run with the run of the model solution."""
        values = (getattr(self, name) for name in self.__struct_fields__)
        rows = (value if isinstance(value, tuple) else (value,) for value in values)
        return any(isinstance(one, ModelPlace) for row in rows for one in row)


MAX_PROGRAM_BYTES = 1_000_000  # maximum size of a submission, of the model solution, and of given.v2


class SurroundingsReader:
    """Reads the files in the folder `around` and collects their mistakes."""

    def __init__(self, around: Path) -> None:
        self.around, self.wrong = around, list[str]()

    def robot(self, reader: ExerciseText, table: Mapping[str, Any]) -> RobotModel | None:
        """Load the robot, which is a built-in one or a file in the folder; return None if there is none."""
        given = table.get("robot", "puma560")
        if not isinstance(given, str):
            reader.fault(reader.whole, "robot", 'the name of a robot, such as "puma560"')
            return None
        beside = self.around / given
        try:
            return load_robot(beside if beside.suffix in (".toml", ".urdf") and beside.is_file() else given)
        except VrsError as error:
            reader.fault(reader.whole, "robot", str(error))
            return None

    def dialect(self, reader: ExerciseText, table: Mapping[str, Any]) -> Dialect:
        """Read the dialect of the session and of loaded programs."""
        entry = reader.whole._replace(given=table)
        if "dialect" not in table:
            return Dialect.VPLUS
        word = reader.one_of(entry, "dialect", (one.value for one in Dialect))
        return next((one for one in Dialect if one.value == word), Dialect.VPLUS)

    def cell(self) -> Cell:
        """Read cell.toml."""
        path = self.around / "cell.toml"
        try:
            return read_cell(str(path)) if path.exists() else NO_CELL
        except FileError as error:
            self.wrong.append(error.detail)
            return NO_CELL

    def read_given(self, robot: RobotModel, dialect: Dialect) -> LoadedFile | None:
        """Read given.v2: its programs and locations."""
        path = self.around / "given.v2"
        if not path.exists():
            return None
        try:
            text = text_at(str(path), MAX_PROGRAM_BYTES)
        except FileError as error:
            self.wrong.append(error.detail)
            return None
        file, unreadable = parse_file(text, dialect)
        loaded = LoadedFile.of(file, text, Memory(units=robot.units), vplus=True)
        for one in (*unreadable, *loaded.diagnostics):
            if one.severity is Severity.ERROR:
                self.wrong.append(f"{path}:{one.span.line}: {one.message}")
        return loaded


def find_exercise(named: str) -> Path:
    """Return the folder of an exercise, given as a folder or as the name of a shipped one. Raises NonexistentFile."""
    if Path(named).is_dir():
        return Path(named)
    exercises = shipped_folder("programs") / "exercises"
    names = sorted(path.name for path in exercises.glob("*") if path.is_dir())
    if named in names:
        return exercises / named
    hint = did_you_mean(named, names, f"it is a folder, or one of {', '.join(names)}" if names else "it is a folder")
    raise NonexistentFile(f"there is no exercise {named}", hint)
