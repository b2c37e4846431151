"""The names that docs/stability.md promises to keep, as they are now; frozen.json has those of the last release.

`python -m tests.docs.frozen` adds to it what has come since. What is gone stays in it, and a test says so.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

import vrs_cli as vrs
from tests.docs.makers import DOCS
from vrs_cli.cli.command_line import Parser
from vrs_cli.cli.commands import SUBCOMMANDS
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import State
from vrs_cli.version import __version__
from vrs_cli.wire.lines import CheckpointRecord, HeaderRecord
from vrs_cli.wire.records import DeltaRecord
from vrs_cli.wire.reports import ReportsRecord

FILE = Path(__file__).with_name("frozen.json")
BY_USERS = {"Robot", "Limits", "LeRobotArm", "Predictor", "RemoteController"}  # classes that users make objects of
INSIDE = {"of", "seen"}  # how vrs makes its own objects
Names = dict[str, dict[str, list[str]]]  # of each surface: what there is, and the parts of each

MARKS = "!*="
REQUIRED, MANY, NAMED = MARKS  # a part that has to be given, takes any number, is given by its name alone


def now() -> Names:
    """Return all names that are promised, as the code has them now."""
    return {
        "python": dict(_python()),
        "commands": {name: sorted(_options(name)) for name in SUBCOMMANDS},
        "words": {"all": sorted(_words())},
        "messages": _fields(json.loads((DOCS / "protocol.schema.json").read_text("utf-8"))["$defs"]),
        "trajectory file": _fields(
            msgspec.json.schema_components([HeaderRecord, DeltaRecord, CheckpointRecord, ReportsRecord])[1]
        ),
    }


def _python() -> Iterator[tuple[str, list[str]]]:
    """Yield each public name, and its parameters; of a class also its public members and theirs."""
    for name in vrs.__all__:
        found = getattr(vrs, name)
        if isinstance(found, str):
            yield name, []
        elif not inspect.isclass(found):
            yield name, _parameters(found)
        else:
            yield name, _parameters(found) if name in BY_USERS else []
            for member in dir(found):
                if member.startswith("_") or member in INSIDE or hasattr(tuple, member) or hasattr(Exception, member):
                    continue
                value = inspect.getattr_static(found, member)
                value = value.__func__ if isinstance(value, classmethod | staticmethod) else value
                yield f"{name}.{member}", _parameters(value) if inspect.isfunction(value) else []


def _parameters(function: Any) -> list[str]:
    """Return the parameters in order: `robot`, `times!` without a default, `at=` by name alone, `*to` any number."""
    shown = []
    for name, parameter in inspect.signature(function).parameters.items():
        if name not in ("self", "cls"):
            variable = parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
            required = parameter.default is parameter.empty and not variable
            by_name = parameter.kind is parameter.KEYWORD_ONLY
            shown.append(f"{MANY * variable}{name}{NAMED * by_name}{REQUIRED * required}")
    return shown


def _options(name: str) -> Iterator[str]:
    """Yield the options of a subcommand."""
    for action in Parser(name, f"vrs {name}").arguments():
        yield from (option for option in action.option_strings if option.startswith("--"))


def _words() -> Iterator[str]:
    for kind, rows in (
        ("command", COMMANDS),
        ("control", CONTROL),
        ("instruction", INSTRUCTIONS),
        ("function", FUNCTIONS),
    ):
        yield from (f"{kind} {row.name}" for row in rows.values() if row.state is State.SUPPORTED)


def _fields(definitions: Mapping[str, Any]) -> dict[str, list[str]]:
    """Return the fields of each type of a JSON Schema, those that have to be there with `!`."""
    return {
        name: sorted(f"{field}{REQUIRED * (field in one.get('required', ()))}" for field in one["properties"])
        for name, one in definitions.items()
        if "properties" in one
    }


def broken(promised: Names, names: Names) -> list[str]:
    """Return what of the promised names is not there any more, or is not as it was."""
    found = []
    for surface, rows in promised.items():
        for row, parts in rows.items():
            has = names.get(surface, {}).get(row)
            if has is None:
                found.append(f"{surface}: {row} is gone")
            elif surface == "python":
                found += [f"{surface}: {row}: {what}" for what in _broken_call(parts, has)]
            else:
                found += [f"{surface}: {row}: {part} is gone" for part in parts if part not in has]
                found += [
                    f"{surface}: {row}: {part} has to be given"
                    for part in has
                    if REQUIRED in part and part not in parts
                ]
    return found


def _broken_call(promised: Sequence[str], names: Sequence[str]) -> Iterator[str]:
    """Yield why a call that was right is so no more."""
    places = {part.strip(MARKS): (place, part) for place, part in enumerate(names)}
    known = {part.strip(MARKS) for part in promised}
    for place, part in enumerate(promised):
        now_at, now_is = places.get(part.strip(MARKS), (-1, ""))
        if not now_is:
            yield f"{part} is gone"
        elif NAMED not in part and (now_at != place or NAMED in now_is):
            yield f"{part} has another place"
        elif REQUIRED in now_is and REQUIRED not in part:
            yield f"{part} has to be given"
    yield from (f"{part} has to be given" for part in names if REQUIRED in part and part.strip(MARKS) not in known)


def frozen() -> Names:
    """Return the names that were promised."""
    found: Names = json.loads(FILE.read_text("utf-8"))
    return found


if __name__ == "__main__":
    before = {} if __version__.startswith("0.") else frozen()  # nothing was promised before 1.0
    made = {surface: {**before.get(surface, {}), **rows} for surface, rows in now().items()}
    for surface, rows in before.items():
        for row, parts in rows.items():
            made[surface][row] += [part for part in parts if part not in made[surface][row]]
    lines = [
        f'"{surface}": {{\n'
        + ",\n".join(f" {json.dumps(row)}: {json.dumps(parts)}" for row, parts in rows.items())
        + "\n}"
        for surface, rows in made.items()
    ]
    FILE.write_text("{" + ",\n".join(lines) + "}\n", "utf-8")
