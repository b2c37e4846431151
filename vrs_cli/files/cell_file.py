"""The file of `--cell`: a TOML file with the names of signals, and what follows of which.

[signals]
"feeder.go" = 3
"part.there" = 1003

[[follow]]
when = "feeder.go"          # a signal comes on; "-feeder.go": it goes off; a number will do, too
set = "part.there"
after = 0.8                 # [s]
lasting = 0.5               # [s], then back again; without it, it stays

[[follow]]
when = "camera.trigger"
set = "camera.ready"
variables = ["found.x", "found.y"]
rows = [[120.0, 40.5], [80.0, -12.0]]    # one a time
again = true                # after the last row comes the first
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from vrs_cli.errors import FileDamaged, did_you_mean
from vrs_cli.files.opening import text_at
from vrs_cli.language.run.signals import Cell, Follow
from vrs_cli.language.words.instructions import RESERVED, why_reserved
from vrs_cli.language.words.values import INPUTS, INTERNAL, OUTPUTS, STRING_LENGTH
from vrs_cli.trajectory.instant import LATEST, on_grid
from vrs_cli.values.numbers import LIMIT, Value

KEYS = ("when", "set", "after", "lasting", "variables", "rows", "again")
_KNOWN = f"there are {', '.join(KEYS)}"
_VARIABLE = re.compile(r"(?i)\$?[A-Z][A-Z0-9._]*")  # NAME of grammar/val2.lark, without locations


def read_cell(path: str) -> Cell:
    """Raises NonexistentFile, and FileDamaged which says what is wrong where."""
    return parse_cell(text_at(path), path)


def parse_cell(text: str, path: str = "cell") -> Cell:
    """The cell that a text describes. Raises FileDamaged."""
    try:
        given = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise FileDamaged(f"{path}: {error}", "a cell is a TOML file: [signals] and [[follow]]") from None
    reader = _Reader(path, text, given)
    if reader.wrong:
        raise FileDamaged("\n".join(reader.wrong), "[signals] names signals, each [[follow]] says what follows")
    return Cell({number: name for name, number in reader.names.items()}, tuple(reader.follows))


class _Part(NamedTuple):
    """A part of the file: how it is called in messages, and its lines, from 0."""

    name: str
    lines: range


class _Reader:
    """Reads a cell, and goes on after each mistake."""

    def __init__(self, path: str, text: str, given: Mapping[str, Any]) -> None:
        self.wrong: list[str] = []
        self.names: dict[str, int] = {}
        self._path, self._lines = path, text.splitlines()
        self._whole = _Part("", range(len(self._lines)))
        for key in given.keys() - {"signals", "follow"}:
            near = did_you_mean(key, ("signals", "follow"), "there are [signals] and [[follow]]")
            self._fault(self._whole, key, near)
        signals, rules = given.get("signals", {}), given.get("follow", [])
        if isinstance(signals, dict):
            self._name(signals)
        else:
            self._fault(self._whole, "signals", "write [signals], and below it part.there = 1003")
        if not isinstance(rules, list):
            self._fault(self._whole, "follow", "write [[follow]], and below it what follows of what")
            rules = []
        parts = zip(self._parts(len(rules)), rules, strict=True)
        self.follows = [one for part, rule in parts if (one := self._follow(part, rule)) is not None]

    def _parts(self, count: int) -> Iterator[_Part]:
        """The lines of each [[follow]]; of none where they stand otherwise, as in `follow = [{when = 3}]`."""
        heads = [at for at, line in enumerate(self._lines) if re.match(r"\s*\[\[\s*follow\s*\]\]", line)]
        ends = [*heads[1:], len(self._lines)]
        lines = list(map(range, heads, ends)) if len(heads) == count else [self._whole.lines] * count
        return (_Part(f"[[follow]] {number}: ", one) for number, one in enumerate(lines, 1))

    def _fault(self, part: _Part, key: str, what: str) -> None:
        """`key`: what is wrong in that part; its line, or the first of the part where none begins with it."""
        last = re.escape(key.rpartition(".")[2])
        begins = re.compile(rf"""(?i)[\s\["'\w.-]*(?<!\w){last}["']?\s*[=.\]]""")
        line = next((at for at in part.lines if begins.match(self._lines[at])), min(part.lines, default=0))
        self.wrong.append(f"{self._path}:{line + 1}: {part.name}{key}: {what}")

    # --- signals ---

    def _name(self, given: Mapping[str, Any], before: str = "") -> None:
        """A name with dots need not stand in quotes: TOML makes tables of it."""
        for last, number in given.items():
            name = f"{before}{last}".lower()
            twin = next((known for known, other in self.names.items() if other == number), "")
            if isinstance(number, dict):
                self._name(number, f"{before}{last}.")
            elif not _is_signal(number):
                self._fault(self._whole, name, f"{number!r} is no signal: 1-512, 1001-1512 or 2001-2512")
            elif twin:
                self._fault(self._whole, name, f"signal {number} is called {twin} already")
            else:
                self.names[name] = number

    def _signal(self, part: _Part, key: str, given: Any) -> int | None:
        """Read a signal, by name or number; a minus stands for off."""
        if isinstance(given, str):
            name = given.removeprefix("-").lower()
            found = self.names.get(name)
            if found is None:
                near = did_you_mean(name, self.names)
                self._fault(part, key, f"no signal is called {name}" + (f" ({near})" if near else ""))
                return None
            return -found if given.startswith("-") else found
        if type(given) is int and _is_signal(abs(given)):
            return given
        self._fault(part, key, "it is missing" if given is None else f"{given!r} is no signal")
        return None

    # --- what follows ---

    def _follow(self, part: _Part, rule: Any) -> Follow | None:
        mistakes = len(self.wrong)
        if not isinstance(rule, dict):
            self._fault(part, "follow", "it is a table")
            return None
        for key in rule.keys() - set(KEYS):
            self._fault(part, key, did_you_mean(key, KEYS, _KNOWN))
        when = self._signal(part, "when", rule.get("when"))
        sets = self._signal(part, "set", rule["set"]) if "set" in rule else None
        after, lasting = (self._seconds(part, key, rule.get(key)) for key in ("after", "lasting"))
        variables, rows = self._table(part, rule)
        again = rule.get("again", False)
        if type(again) is not bool:
            self._fault(part, "again", f"{again!r} is neither true nor false")
        if sets is not None and abs(sets) in OUTPUTS:
            self._fault(part, "set", "an output is the program's; an input or an internal signal follows")
        if "set" not in rule and not {"variables", "rows"} & rule.keys():
            self._fault(part, "set", "nothing follows: it needs set, or variables and rows")
        if len(self.wrong) > mistakes or when is None:
            return None
        return Follow(when, sets, after or 0.0, lasting, variables, rows, again)

    def _seconds(self, part: _Part, key: str, given: Any) -> float | None:
        if given is None:
            return None
        if type(given) not in (int, float) or not 0.0 <= given <= LATEST:
            self._fault(part, key, f"{given!r} is no time from 0 to {LATEST:g} s")
            return None
        return on_grid(float(given))

    def _table(self, part: _Part, rule: Mapping[str, Any]) -> tuple[tuple[str, ...], tuple[tuple[Value, ...], ...]]:
        variables, rows = rule.get("variables", []), rule.get("rows", [])
        if not (isinstance(variables, list) and all(isinstance(one, str) for one in variables)):
            self._fault(part, "variables", "a list of names, such as x, or $name for a string")
            return (), ()
        for name in variables:
            if wrong := _wrong_variable(name):
                self._fault(part, "variables", wrong)
        if not (isinstance(rows, list) and all(isinstance(row, list) for row in rows)):
            self._fault(part, "rows", "a list of rows, each a list of values")
            return (), ()
        if not variables or not rows:
            if {"variables", "rows"} & rule.keys():
                self._fault(part, "rows" if variables else "variables", "variables and rows belong together")
            return (), ()
        for number, row in enumerate(rows, 1):
            if len(row) != len(variables) or not all(map(_fits, variables, row)):
                self._fault(part, "rows", f"row {number}: a value for each of {', '.join(variables)} is wanted")
                return (), ()
        return tuple(variables), tuple(
            tuple(one if isinstance(one, str) else float(one) for one in row) for row in rows
        )


def _is_signal(given: Any) -> bool:
    return type(given) is int and any(given in bank for bank in (OUTPUTS, INPUTS, INTERNAL))


def _wrong_variable(name: str) -> str:
    """Say why a name cannot be that of a real or a string; "" if it can."""
    if _VARIABLE.fullmatch(name) is None:
        return f"{name!r} is no name of a real, as found.x is, or of a string, as $kind is"
    if name.upper() in RESERVED:
        told, hint = why_reserved(name.upper())
        return f"{told}: {hint}"
    return ""


def _fits(variable: str, value: Any) -> bool:
    if variable.startswith("$"):
        return isinstance(value, str) and len(value) <= STRING_LENGTH
    return type(value) in (int, float) and abs(value) <= LIMIT
