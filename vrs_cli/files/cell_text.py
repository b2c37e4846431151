"""Read values from the parsed tables of a cell file, and collect mistakes with their line numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from math import radians, sqrt
from pathlib import Path
from typing import Any, NamedTuple

from vrs_cli.errors import did_you_mean
from vrs_cli.kinematics.transform import Transform, Vector, from_oat
from vrs_cli.language.words.values import INPUTS, INTERNAL, OUTPUTS
from vrs_cli.trajectory.instant import LATEST, on_grid

MAX_MISTAKES = 50  # maximum number of mistakes that are reported
MAX_MESSAGE_CHARS = 400  # maximum number of characters of one message
MAX_LENGTH_MM = 100_000.0  # [mm] maximum absolute value of coordinates and sizes


_CONTROL = re.compile(r"[\x00-\x1f\x7f]")


class CellEntry(NamedTuple):
    """One table of a cell file: its name in messages, the range of its lines (counted from 0), and its
    keys and values.
    """

    name: str
    lines: range
    given: Mapping[str, Any]


class CellText:
    """Reads values of a cell file, and collects mistakes in `wrong`: after a mistake a default value is returned, and
    reading continues. `names`: the number of each named signal.
    """

    def __init__(self, path: str, text: str) -> None:
        self.wrong: list[str] = []
        self.names: dict[str, int] = {}
        self._claimed: dict[int, str] = {}
        self.path, self._lines = path, text.splitlines()

    @property
    def whole(self) -> CellEntry:
        return CellEntry("", range(len(self._lines)), {})

    def entries(self, key: str, given: Any, keys: Iterable[str] | None) -> Iterator[CellEntry]:
        """Yield the tables of [[key]] with the lines of each. Tables written inline, as in `follow = [{when = 3}]`, get
        all lines of the file. `keys`: the allowed keys; None: the caller checks the keys.
        """
        if not isinstance(given, list):
            self.fault(self.whole, key, f"write [[{key}]], and below it what it is")
            return
        head = re.compile(rf"\s*\[\[\s*{key}\s*\]\]")
        heads = [at for at, line in enumerate(self._lines) if head.match(line)]
        ends = [*heads[1:], len(self._lines)]
        lines = list(map(range, heads, ends)) if len(heads) == len(given) else [range(len(self._lines))] * len(given)
        for number, (one, where) in enumerate(zip(given, lines, strict=True), 1):
            entry = CellEntry(f"[[{key}]] {number}: ", where, one if isinstance(one, dict) else {})
            if isinstance(one, dict):
                if keys is not None:
                    self.check_keys(entry, keys)
                yield entry
            else:
                self.fault(entry, key, "it is a table")

    def entry(self, key: str, given: Mapping[str, Any], keys: Iterable[str]) -> CellEntry:
        """Return the table [key] with its lines, which end before the next heading. `keys`: the allowed keys."""
        head = re.compile(rf"\s*\[\s*{key}\s*\]")
        first = next((at for at, line in enumerate(self._lines) if head.match(line)), 0)
        ends = (at for at in range(first + 1, len(self._lines)) if self._lines[at].lstrip().startswith("["))
        entry = CellEntry(f"[{key}] ", range(first, next(ends, len(self._lines))), given)
        self.check_keys(entry, keys)
        return entry

    def check_keys(self, entry: CellEntry, keys: Iterable[str]) -> None:
        """Report keys of a table that are not in `keys`, in alphabetical order."""
        known = tuple(keys)
        for key in sorted(entry.given.keys() - set(known)):
            self.fault(entry, key, did_you_mean(key, known, f"there are {', '.join(known)}"))

    def fault(self, entry: CellEntry, key: str, what: str) -> None:
        """Report a mistake at a key of a table. The message has the number of the line that begins with the key, or of
        the table's first line if there is no such line.
        """
        if len(self.wrong) == MAX_MISTAKES:
            self.wrong.append(f"{self.path}: there are more mistakes")
        if len(self.wrong) > MAX_MISTAKES:
            return
        line = min(self.lines_from(entry, key), default=0)
        message = _CONTROL.sub("?", f"{entry.name}{key}: {what}")  # keep the message on one line
        if len(message) > MAX_MESSAGE_CHARS:
            message = f"{message[: MAX_MESSAGE_CHARS - 3]}..."
        self.wrong.append(f"{self.path}:{line + 1}: {message}")

    def lines_from(self, entry: CellEntry, key: str) -> range:
        """Return the range of a table's lines from the line that begins with `key`; if no line begins with it, return
        all lines of the table.
        """
        last = re.escape(key.rpartition(".")[2])
        begins = re.compile(rf"""(?i)[\s\["'\w.-]*(?<!\w){last}["']?\s*[=.\]]""")
        first = next((at for at in entry.lines if begins.match(self._lines[at])), entry.lines.start)
        return range(first, entry.lines.stop)

    # --- signals and times ---

    def name_signals(self, given: Mapping[str, Any], before: str = "") -> None:
        """Read the names and numbers of signals. TOML turns names with dots that are not quoted into nested tables;
        `before` is the part of the name before such a table.
        """
        for last, number in given.items():
            name = f"{before}{last}".lower()
            twin = next((known for known, other in self.names.items() if other == number), "")
            if isinstance(number, dict):
                self.name_signals(number, f"{before}{last}.")
            elif not _is_signal(number):
                self.fault(self.whole, name, f"{quote_value(number)} is no signal: 1-512, 1001-1512 or 2001-2512")
            elif twin:
                self.fault(self.whole, name, f"signal {number} is called {twin} already")
            else:
                self.names[name] = number

    def signal(self, entry: CellEntry, key: str) -> int | None:
        """Read a signal, given by name or number, and return its number; a minus sign means the signal is off."""
        given = entry.given.get(key)
        if isinstance(given, str):
            name = given.removeprefix("-").lower()
            found = self.names.get(name)
            if found is None:
                near = did_you_mean(name, self.names)
                self.fault(entry, key, f"no signal is called {name[:80]}" + (f" ({near})" if near else ""))
                return None
            return -found if given.startswith("-") else found
        if type(given) is int and _is_signal(abs(given)):
            return given
        self.fault(entry, key, "it is missing" if given is None else f"{quote_value(given)} is no signal")
        return None

    def input_signal(self, entry: CellEntry, key: str) -> int | None:
        """Read the signal that a sensor sets, which must be an input (1001 to 1512)."""
        found = self.signal(entry, key)
        if found is not None and abs(found) not in INPUTS:
            self.fault(entry, key, f"{found} is no input: a sensor sets one of 1001 to 1512")
            return None
        return found

    def claim(self, entry: CellEntry, key: str, signal: int) -> None:
        """Record that a table sets a signal; report a mistake if another table sets the same signal."""
        if signal and (other := self._claimed.setdefault(abs(signal), entry.name)) != entry.name:
            self.fault(entry, key, f"{abs(signal)} is set by {other.rstrip(' :')} already")

    def seconds(self, entry: CellEntry, key: str) -> float | None:
        given = entry.given.get(key)
        if given is None:
            return None
        if type(given) not in (int, float) or not 0.0 <= given <= LATEST:
            self.fault(entry, key, f"{quote_value(given)} is no time from 0 to {LATEST:g} s")
            return None
        return on_grid(float(given))

    def switch(self, entry: CellEntry, key: str) -> bool:
        given = entry.given.get(key, False)
        if type(given) is not bool:
            self.fault(entry, key, f"{quote_value(given)} is neither true nor false")
        return given is True

    # --- lengths and poses: millimetres and degrees in the file, metres and radians in results ---

    def length(self, entry: CellEntry, key: str, default: float | None = None, *, least: float = 0.01) -> float:
        """Read a length in mm of at least `least` mm, and return it in metres. `default`: the length in mm if the key
        is missing; None: the key is required.
        """
        given = entry.given.get(key, default)
        if type(given) not in (int, float) or not least <= given <= MAX_LENGTH_MM:
            missing = "it is missing; " if given is None else f"{quote_value(given)}: "
            self.fault(entry, key, f"{missing}a length from {least:g} to {MAX_LENGTH_MM:g} mm")
            return 1.0
        return float(given) / 1000.0

    def size(self, entry: CellEntry, key: str = "size") -> Vector:
        """Read three lengths in mm, and return them in metres."""
        found = self._numbers(entry, key, (3,), "[x, y, z] in mm, such as [40, 40, 60]")
        if found is None:
            return (1.0, 1.0, 1.0)
        if not all(0.01 <= one <= MAX_LENGTH_MM for one in found):
            self.fault(entry, key, f"sizes are from 0.01 to {MAX_LENGTH_MM:g} mm")
        x, y, z = found
        return (x / 1000.0, y / 1000.0, z / 1000.0)

    def place(self, entry: CellEntry, key: str) -> Vector:
        """Read a point in mm, and return it in metres."""
        x, y, z = self._numbers(entry, key, (3,), "[X, Y, Z] in mm") or (0.0, 0.0, 0.0)
        return (x / 1000.0, y / 1000.0, z / 1000.0)

    def direction(self, entry: CellEntry, key: str) -> Vector:
        """Read a direction, given as a vector of any length, and return it as a unit vector."""
        x, y, z = self._numbers(entry, key, (3,), "[x, y, z], such as [0, 0, -1]") or (0.0, 0.0, 1.0)
        length = sqrt(x * x + y * y + z * z)
        if not length > 1e-6:
            self.fault(entry, key, "[0, 0, 0] has no direction")
            return (0.0, 0.0, 1.0)
        return (x / length, y / length, z / length)

    def pose(self, entry: CellEntry, key: str) -> Transform:
        """Read a pose given as [X, Y, Z] or [X, Y, Z, O, A, T]. Without angles, its axes are parallel to those of the
        world.
        """
        wanted = "[X, Y, Z] in mm, or [X, Y, Z, O, A, T] with degrees"
        x, y, z, *angles = self._numbers(entry, key, (3, 6), wanted) or (0.0, 0.0, 0.0)
        o, a, t = map(radians, angles or UPRIGHT)
        return from_oat(x / 1000.0, y / 1000.0, z / 1000.0, o, a, t)

    def _numbers(self, entry: CellEntry, key: str, lengths: tuple[int, ...], wanted: str) -> tuple[float, ...] | None:
        given = entry.given.get(key)
        if (
            isinstance(given, list)
            and len(given) in lengths
            and all(type(one) in (int, float) and abs(one) <= MAX_LENGTH_MM for one in given)
        ):
            return tuple(map(float, given))
        missing = "it is missing: " if given is None else f"{quote_value(given)}: "
        self.fault(entry, key, f"{missing}{wanted}")
        return None

    # --- other values ---

    def one_of(self, entry: CellEntry, key: str, known: Iterable[str]) -> str | None:
        """Read a word that must be one of `known`; report a mistake and return None if it is not."""
        given, words = entry.given.get(key), tuple(known)
        if isinstance(given, str) and given in words:
            return given
        otherwise = f"it is one of {', '.join(words)}"
        self.fault(entry, key, did_you_mean(given[:80], words, otherwise) if isinstance(given, str) else otherwise)
        return None

    def beside(self, name: str) -> Path:
        """Return the path of a file whose name is relative to the folder of the cell file."""
        return Path(self.path).parent / name


UPRIGHT = (90.0, -90.0, 0.0)  # [deg] O, A, T of a frame whose axes are parallel to those of the world


def quote_value(given: Any) -> str:
    """Return a value as a string of at most 80 characters, for messages."""
    text = repr(given) if not isinstance(given, int) or abs(given) < 1e30 else "a huge number"
    return text if len(text) <= 80 else f"{text[:77]}..."


def _is_signal(given: Any) -> bool:
    return type(given) is int and any(given in bank for bank in (OUTPUTS, INPUTS, INTERNAL))
