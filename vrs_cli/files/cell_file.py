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

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from vrs_cli.errors import FileDamaged, NonexistentFile, did_you_mean
from vrs_cli.files.opening import open_to_read
from vrs_cli.language.run.cell import Cell, Follow
from vrs_cli.language.words.signals import INPUTS, INTERNAL, OUTPUTS
from vrs_cli.language.words.values import Value
from vrs_cli.trajectory.instant import LATEST, on_grid

KEYS = ("when", "set", "after", "lasting", "variables", "rows", "again")
_KNOWN = f"there are {', '.join(KEYS)}"


def read_cell(path: str) -> Cell:
    """Raises NonexistentFile, and FileDamaged which says what is wrong where."""
    try:
        with open_to_read(Path(path)) as stream:
            text = stream.read().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else "it is no text"
        raise NonexistentFile(f"{path} cannot be read: {why}") from None
    return parse_cell(text, path)


def parse_cell(text: str, path: str = "cell") -> Cell:
    """The cell that a text describes. Raises FileDamaged."""
    try:
        given = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FileDamaged(f"{path}: {error}", "a cell is a TOML file: [signals] and [[follow]]") from None
    reader = _Reader(path, given)
    if reader.wrong:
        raise FileDamaged("\n".join(reader.wrong), "[signals] names signals, each [[follow]] says what follows")
    return Cell({number: name for name, number in reader.names.items()}, tuple(reader.follows))


class _Reader:
    """Reads a cell, and goes on after each mistake."""

    def __init__(self, path: str, given: Mapping[str, Any]) -> None:
        self.wrong: list[str] = []
        self._path = path
        for key in given.keys() - {"signals", "follow"}:
            self._fault(key, did_you_mean(key, ("signals", "follow"), "there are [signals] and [[follow]]"))
        signals, follow = given.get("signals", {}), given.get("follow", [])
        self.names = dict(self._names(signals if isinstance(signals, dict) else {}))
        rules = follow if isinstance(follow, list) else []
        if rules is not follow or not isinstance(signals, dict):
            self._fault("signals, follow", "write [signals] and [[follow]]")
        self.follows = [one for place, rule in enumerate(rules, 1) if (one := self._follow(place, rule)) is not None]

    def _fault(self, where: str, what: str) -> None:
        self.wrong.append(f"{self._path}: {where}: {what}")

    def _names(self, given: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, int]]:
        """A name with dots need not stand in quotes: TOML makes tables of it."""
        for name, number in given.items():
            if isinstance(number, dict):
                yield from self._names(number, f"{before}{name}.")
            elif type(number) is int and any(number in bank for bank in (OUTPUTS, INPUTS, INTERNAL)):
                yield f"{before}{name}".lower(), number
            else:
                self._fault(f"{before}{name}", f"{number!r} is no signal: 1-512, 1001-1512 or 2001-2512")

    def _follow(self, place: int, rule: Any) -> Follow | None:
        where, mistakes = f"[[follow]] {place}", len(self.wrong)
        if not isinstance(rule, dict):
            self._fault(where, "it is a table")
            return None
        for key in rule.keys() - set(KEYS):
            self._fault(where, f"{key}: {did_you_mean(key, KEYS, _KNOWN)}")
        when = self._signal(where, "when", rule.get("when"))
        sets = self._signal(where, "set", rule["set"]) if "set" in rule else None
        after, lasting = (self._seconds(where, key, rule.get(key)) for key in ("after", "lasting"))
        variables, rows = self._table(where, rule)
        if sets is not None and abs(sets) in OUTPUTS:
            self._fault(where, "set: an output is the program's; an input or an internal signal follows")
        if sets is None and not rows:
            self._fault(where, "nothing follows: it needs set, or variables and rows")
        if len(self.wrong) > mistakes or when is None:
            return None
        return Follow(when, sets, after or 0.0, lasting, variables, rows, bool(rule.get("again", False)))

    def _signal(self, where: str, key: str, given: Any) -> int | None:
        """Of a name or a number; a minus stands for off."""
        if isinstance(given, str):
            name = given.removeprefix("-").lower()
            found = self.names.get(name)
            if found is None:
                self._fault(where, f"{key}: no signal is called {name}" + self._near(name))
                return None
            return -found if given.startswith("-") else found
        if type(given) is int and any(abs(given) in bank for bank in (OUTPUTS, INPUTS, INTERNAL)):
            return given
        self._fault(where, f"{key}: {'it is missing' if given is None else f'{given!r} is no signal'}")
        return None

    def _near(self, name: str) -> str:
        near = did_you_mean(name, self.names)
        return f" ({near})" if near else ""

    def _seconds(self, where: str, key: str, given: Any) -> float | None:
        if given is None:
            return None
        if type(given) not in (int, float) or not 0.0 <= given <= LATEST:
            self._fault(where, f"{key}: {given!r} is no time from 0 to {LATEST:g} s")
            return None
        return on_grid(float(given))

    def _table(self, where: str, rule: Mapping[str, Any]) -> tuple[tuple[str, ...], tuple[tuple[Value, ...], ...]]:
        variables, rows = rule.get("variables", []), rule.get("rows", [])
        if not (isinstance(variables, list) and all(isinstance(one, str) for one in variables)):
            self._fault(where, "variables: a list of names, such as x, or $name for a string")
            return (), ()
        if bool(variables) is not bool(rows) or not isinstance(rows, list):
            self._fault(where, "variables and rows belong together")
            return (), ()
        for number, row in enumerate(rows, 1):
            if not isinstance(row, list) or len(row) != len(variables) or not all(map(_fits, variables, row)):
                self._fault(where, f"row {number}: a value for each of {', '.join(variables)} is wanted")
        return tuple(variables), tuple(tuple(_value(one) for one in row) for row in rows if isinstance(row, list))


def _fits(variable: str, value: Any) -> bool:
    return isinstance(value, str) if variable.startswith("$") else type(value) in (int, float)


def _value(given: Any) -> Value:
    return given if isinstance(given, str) else float(given)
