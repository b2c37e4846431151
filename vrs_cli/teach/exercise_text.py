"""Read the common parts of exercises and lessons: values of checks.toml, places, the robot, the cell, given programs.

Each mistake is recorded with its line and its correction.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from math import radians
from pathlib import Path
from typing import Any, TypeVar

from msgspec import Struct

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile, VrsError, did_you_mean
from vrs_cli.extras import shipped_folder
from vrs_cli.files.cell_file import read_cell
from vrs_cli.files.cell_text import MAX_LENGTH_MM, UPRIGHT, CellEntry, CellText, quote_value
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
from vrs_cli.values.diagnostics import DIALECTS, Dialect, Severity


class FixedPlace(Struct, frozen=True, tag=True):
    """A place given as numbers, T_world_place. `turned`: whether an orientation was given."""

    T: Transform
    turned: bool


class GivenPlace(Struct, frozen=True, tag=True):
    """A location of `given.v2`, or a compound of several locations (`pallet:corner`). `text`: the place as written."""

    text: str
    items: tuple[Item, ...]


class ModelPlace(Struct, frozen=True, tag=True):
    """A place taken from the run of the model solution, such as the final pose of the tool."""


Place = FixedPlace | GivenPlace | ModelPlace
MODEL = "model"


T = TypeVar("T")
MAX_TEXT_CHARS = 2000
MAX_LIST_ITEMS = 200
_LOCATION = re.compile(r"(?i)\s*([A-Z][A-Z0-9._]*)\s*(?:\[\s*(\d+(?:\s*,\s*\d+){0,2})\s*\])?\s*")


class ExerciseText(CellText):
    """A reader of checks.toml that records mistakes and continues.

    `table`: the content of the file. `locations`: the locations that the exercise gives. `parts`: names of the parts
    (workpieces). `bodies`: names of everything that the arm can touch.
    """

    def __init__(self, path: str, text: str) -> None:
        """Raise FileDamaged if the file is not TOML."""
        super().__init__(path, text)
        self.locations, self.parts, self.bodies = frozenset[Item](), tuple[str, ...](), tuple[str, ...]()
        try:
            self.table = tomllib.loads(text)
        except (ValueError, RecursionError) as error:
            raise FileDamaged(f"{path}: {str(error)[:500]}", "checks.toml is a TOML file") from None

    @property
    def whole(self) -> CellEntry:
        return super().whole._replace(given=self.table)

    def optional_table(self, key: str, keys: Iterable[str], form: str) -> CellEntry | None:
        """Return the table [key]; None if it is missing or is not a table. `form`: the lines that belong below its
        heading, for the message."""
        given = self.table.get(key)
        if isinstance(given, dict):
            return self.entry(key, given, keys)
        if key in self.table:
            self.fault(self.whole, key, f"write [{key}], and below it {form}")
        return None

    def number(self, entry: CellEntry, key: str, least: float, most: float, unit: str = "") -> float:
        """Read a number from `least` to `most`; if it is wrong, record the mistake and return `least`."""
        given: Any = entry.given.get(key)
        if type(given) in (int, float) and least <= given <= most:
            return float(given)
        self.fault(entry, key, f"{self.prefix(given)}a number from {least:g} to {most:g}{f' {unit}' if unit else ''}")
        return least

    def text(self, entry: CellEntry, key: str) -> str:
        """Read a non-empty string."""
        given = entry.given.get(key)
        if isinstance(given, str) and given.strip() and len(given) <= MAX_TEXT_CHARS:
            return given
        self.fault(entry, key, f"{self.prefix(given)}a text in quotes, at most {MAX_TEXT_CHARS} characters")
        return ""

    def dialect(self, entry: CellEntry, key: str) -> Dialect:
        """Read the name of a dialect; if it is wrong, record the mistake and return V+."""
        word = self.one_of(entry, key, DIALECTS)
        return next((one for one in Dialect if one.value == word), Dialect.VPLUS)

    def list_of(self, entry: CellEntry, key: str, wanted: str) -> list[Any]:
        """Read a list with at least one item."""
        given = entry.given.get(key)
        if isinstance(given, list) and 0 < len(given) <= MAX_LIST_ITEMS:
            return given
        self.fault(entry, key, f"{self.prefix(given)}{wanted}, {MAX_LIST_ITEMS} at most")
        return []

    def texts(self, entry: CellEntry, key: str) -> tuple[str, ...]:
        """Read a list of strings."""
        found = self.list_of(entry, key, 'a list of texts, such as ["one", "two"]')
        if not all(isinstance(one, str) and one and len(one) <= MAX_TEXT_CHARS for one in found):
            self.fault(entry, key, 'each is a text in quotes, such as ["one", "two"]')
            return ()
        return tuple(found)

    def part(self, entry: CellEntry, key: str) -> str:
        """Read the name of a part of the cell."""
        return self.name(entry, key, entry.given.get(key), self.parts, "part")

    def name(self, entry: CellEntry, key: str, given: Any, known: Sequence[str], what: str) -> str:
        """Return the name `given` in lower case if it is in `known`; otherwise record the mistake and return "".
        `what`: the kind of object that is named."""
        if isinstance(given, str) and given.lower() in known:
            return given.lower()
        there = f"there are {', '.join(known)}" if known else f"the cell has no {what}"
        near = did_you_mean(given.lower(), known, there) if isinstance(given, str) else there
        self.fault(entry, key, f"{self.prefix(given)}no {what} of this name; {near}")
        return ""

    def prefix(self, given: Any) -> str:
        """Return the start of a message about a wrong value."""
        return "it is missing: " if given is None else f"{quote_value(given)}: "

    # --- places ---

    def exercise_place(self, entry: CellEntry, key: str) -> Place:
        """Read a place; if it is wrong, record the mistake and return the origin."""
        return self.place_of(entry, key, entry.given.get(key))

    def place_of(self, entry: CellEntry, key: str, given: Any) -> Place:
        """Return the place that a value of the file describes."""
        if given == MODEL:
            return ModelPlace()
        if isinstance(given, str):
            pairs = [(text.strip(), item_of_text(text)) for text in given.split(":")]
            unknown = next((text for text, item in pairs if item not in self.locations), None)
            if unknown is None:
                return GivenPlace(given, tuple(item for _, item in pairs if item is not None))
            known = sorted({name for name, _ in self.locations})
            there = f"given.v2 has {', '.join(known)}" if known else "given.v2 has no locations"
            what = f"{quote_value(given)}: no given location is called {unknown[:40]!r}"
            self.fault(entry, key, f"{what}; {did_you_mean(unknown.lower(), known, there)}")
            return FixedPlace(IDENTITY, turned=False)
        is_list = isinstance(given, list) and len(given) in (3, 6)
        if is_list and all(type(one) in (int, float) and abs(one) <= MAX_LENGTH_MM for one in given):
            x, y, z, *angles = map(float, given)
            o, a, t = map(radians, angles or UPRIGHT)
            return FixedPlace(from_oat(x / 1000.0, y / 1000.0, z / 1000.0, o, a, t), bool(angles))
        wanted = '[X, Y, Z] in mm, [X, Y, Z, O, A, T] with degrees, the name of a given location, or "model"'
        self.fault(entry, key, f"{self.prefix(given)}{wanted}")
        return FixedPlace(IDENTITY, turned=False)


def item_of_text(text: str) -> Item | None:
    """Return the variable that a string names, such as `corner` or `slot[2,1]`; None if the string is not a name."""
    found = _LOCATION.fullmatch(text)
    if found is None:
        return None
    indexes = tuple(int(one) for one in (found[2] or "").split(",") if one)
    return key_of(found[1]), None if not indexes else indexes if len(indexes) > 1 else indexes[0]


class BaseCheck(Struct, frozen=True, kw_only=True):
    """A check of any kind. `points`: the maximum points that it earns. `hidden`: students see neither its name nor its
    reason. `needs`: names of checks that must earn at least some points; otherwise this check earns none."""

    name: str
    points: float = 1.0
    hint: str = ""
    hidden: bool = False
    partial: bool = True
    needs: tuple[str, ...] = ()

    @property
    def needs_model(self) -> bool:
        """Return whether the check compares the run with the run of the model solution."""
        return any(isinstance(place, ModelPlace) for place in self.all_places())

    def all_places(self) -> Iterator[Place]:
        """Yield the places that the check refers to."""
        for name in self.__struct_fields__:
            value = getattr(self, name)
            for one in value if isinstance(value, tuple) else (value,):
                near = getattr(one, "near", one)
                if isinstance(near, Place):
                    yield near


MAX_PROGRAM_BYTES = 1_000_000  # maximum size of a submission, of the model solution, and of given.v2


program_text = partial(text_at, most=MAX_PROGRAM_BYTES)


class SurroundingsReader:
    """A reader of the files in the folder `around` that collects their mistakes."""

    def __init__(self, around: Path) -> None:
        self.around, self.wrong = around, list[str]()

    def robot(self, reader: ExerciseText) -> RobotModel | None:
        """Load the robot, which is built in or described by a file in the folder; return None if it cannot be
        loaded."""
        given = reader.table.get("robot", "puma560")
        if not isinstance(given, str):
            reader.fault(reader.whole, "robot", 'the name of a robot, such as "puma560"')
            return None
        beside = self.around / given
        try:
            return load_robot(beside if beside.suffix in (".toml", ".urdf") and beside.is_file() else given)
        except VrsError as error:
            reader.fault(reader.whole, "robot", str(error))
            return None

    def read_file(self, path: Path, reading: Callable[[str], T], missing: T, *, required: bool = False) -> T:
        """Read a file; return `missing` if it cannot be read, or if it does not exist and is not required."""
        try:
            return reading(str(path)) if required or path.exists() else missing
        except FileError as error:
            self.wrong.append(error.detail)
            return missing

    def cell(self) -> Cell:
        return self.read_file(self.around / "cell.toml", read_cell, NO_CELL)

    def read_given(self, robot: RobotModel, dialect: Dialect) -> LoadedFile | None:
        """Read the programs and locations of given.v2; return None if the file is missing or unreadable."""
        path = self.around / "given.v2"
        text = self.read_file(path, program_text, None)
        if text is None:
            return None
        file, unreadable = parse_file(text, dialect)
        loaded = LoadedFile.of(file, text, Memory(units=robot.units), vplus=True)
        wrong = (one for one in (*unreadable, *loaded.diagnostics) if one.severity is Severity.ERROR)
        self.wrong += [f"{path}:{one.span.line}: {one.message}" for one in wrong]
        return loaded


def find_exercise(named: str) -> Path:
    """Return the folder of an exercise, given as that folder or as the name of a shipped exercise. Raises
    NonexistentFile."""
    if Path(named).is_dir():
        return Path(named)
    exercises = Path(shipped_folder("programs"), "exercises")
    names = sorted(path.name for path in exercises.glob("*") if path.is_dir())
    if named in names:
        return exercises / named
    hint = did_you_mean(named, names, f"it is a folder, or one of {', '.join(names)}" if names else "it is a folder")
    raise NonexistentFile(f"there is no exercise {named}", hint)
