"""The file of `--cell`: a TOML file with the names of signals, what follows of which, and the scene (`scene_file`).

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
from pathlib import Path
from typing import Any

from vrs_cli.errors import FileDamaged, did_you_mean
from vrs_cli.extras import shipped_folder
from vrs_cli.files.cell_text import CellEntry, CellText
from vrs_cli.files.opening import text_at
from vrs_cli.files.scene_file import SCENE_KEYS, read_scene
from vrs_cli.language.run.signals import Cell, Follow
from vrs_cli.language.words.instructions import RESERVED, why_reserved
from vrs_cli.language.words.values import OUTPUTS, STRING_LENGTH
from vrs_cli.values.numbers import LIMIT, Value

KEYS = ("when", "set", "after", "lasting", "variables", "rows", "again")
TABLES = ("signals", "follow", *SCENE_KEYS)
LARGEST = 2_000_000  # characters of a cell
_VARIABLE = re.compile(r"(?i)\$?[A-Z][A-Z0-9._]*")  # NAME of grammar/val2.lark, without locations


def read_cell(path: str) -> Cell:
    """Read a cell and the meshes that it names; a name alone may be that of a sample, `pick_and_place`. Raises
    NonexistentFile, and FileDamaged which says what is wrong where.
    """
    if not Path(path).exists() and Path(path).name == path:
        sample = shipped_folder("programs") / f"{path.removesuffix('.toml')}.toml"
        path = str(sample) if sample.is_file() else path
    return parse_cell(text_at(path, LARGEST), path)


def parse_cell(text: str, path: str = "cell") -> Cell:
    """The cell that a text describes. Raises FileDamaged."""
    if len(text) > LARGEST:
        raise FileDamaged(f"{path}: {len(text)} characters", f"at most {LARGEST} are read")
    try:
        given = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise FileDamaged(f"{path}: {str(error)[:500]}", f"a cell is a TOML file: {_KNOWN}") from None
    reader = CellText(path, text)
    for key in sorted(given.keys() - set(TABLES)):
        reader.fault(reader.whole, key, did_you_mean(key[:80], TABLES, f"there are {_KNOWN}"))
    signals = given.get("signals", {})
    if isinstance(signals, dict):
        reader.name_signals(signals)
    else:
        reader.fault(reader.whole, "signals", "write [signals], and below it part.there = 1003")
    follows = [_follow(reader, entry) for entry in reader.entries("follow", given.get("follow", []), KEYS)]
    scene = read_scene(reader, given)
    if reader.wrong:
        raise FileDamaged("\n".join(reader.wrong), f"there are {_KNOWN}")
    names = {number: name for name, number in reader.names.items()}
    return Cell(names, tuple(rule for rule in follows if rule is not None), scene)


_KNOWN = "[signals], [[follow]], [[part]], [[fixture]], [[sensor]], [[feeder]], [[sink]], [hand] and floor"


def _follow(text: CellText, entry: CellEntry) -> Follow | None:
    """Read one [[follow]]; None where it is wrong."""
    rule, mistakes = entry.given, len(text.wrong)
    when = text.signal(entry, "when")
    sets = text.signal(entry, "set") if "set" in rule else None
    after, lasting = (text.seconds(entry, key) for key in ("after", "lasting"))
    variables, rows = _table(text, entry)
    again = text.switch(entry, "again")
    if sets is not None and abs(sets) in OUTPUTS:
        text.fault(entry, "set", "an output is the program's; an input or an internal signal follows")
    if "set" not in rule and not {"variables", "rows"} & rule.keys():
        text.fault(entry, "set", "nothing follows: it needs set, or variables and rows")
    if len(text.wrong) > mistakes or when is None:
        return None
    return Follow(when, sets, after or 0.0, lasting, variables, rows, again)


def _table(text: CellText, entry: CellEntry) -> tuple[tuple[str, ...], tuple[tuple[Value, ...], ...]]:
    """Read the variables of a rule and their rows."""
    rule = entry.given
    variables, rows = rule.get("variables", []), rule.get("rows", [])
    if not (isinstance(variables, list) and all(isinstance(one, str) for one in variables)):
        text.fault(entry, "variables", "a list of names, such as x, or $name for a string")
        return (), ()
    for name in variables:
        if wrong := _wrong_variable(name):
            text.fault(entry, "variables", wrong)
    if not (isinstance(rows, list) and all(isinstance(row, list) for row in rows)):
        text.fault(entry, "rows", "a list of rows, each a list of values")
        return (), ()
    if not variables or not rows:
        if {"variables", "rows"} & rule.keys():
            text.fault(entry, "rows" if variables else "variables", "variables and rows belong together")
        return (), ()
    for number, row in enumerate(rows, 1):
        if len(row) != len(variables) or not all(map(_fits, variables, row)):
            text.fault(entry, "rows", f"row {number}: a value for each of {', '.join(variables)} is wanted")
            return (), ()
    return tuple(variables), tuple(tuple(one if isinstance(one, str) else float(one) for one in row) for row in rows)


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
