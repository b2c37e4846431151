"""HELP: the tables of the language as pages. Nothing is written here that a table does not say."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import islice

from vrs_cli.dialogue.replies import HelpEntry, HelpGroup, HelpOverview, HelpPage
from vrs_cli.engine.parameters import PARAMETERS, SWITCHES, ParameterRow, Switch
from vrs_cli.errors import UsageError, did_you_mean
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS
from vrs_cli.language.words.kind import Kind
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.operators import LINKS, OPERATORS, Operator
from vrs_cli.language.words.values import plain
from vrs_cli.language.words.word import Route, Row, State, Word, rows_for

ROUTES: Mapping[Route, str] = {
    Route.MOTION: "Motion",
    Route.POSITION: "Locations",
    Route.PARAMETER: "Settings",
    Route.PROGRAM: "Input, output and program flow",
}
RESULTS: Mapping[str, tuple[Kind, ...]] = {
    "Functions with a real value": (Kind.REAL,),
    "Functions with a location": (Kind.LOCATION, Kind.PRECISION),
    "Functions with a string": (Kind.STRING,),
}


def overview() -> HelpOverview:
    """Every word that can be used, in groups."""
    return HelpOverview(tuple(group for group in _groups() if group.words))


def _groups() -> Iterator[HelpGroup]:
    yield HelpGroup("Monitor commands", _usable(COMMANDS.values()))
    for route, title in ROUTES.items():
        yield HelpGroup(title, _usable(word for word in INSTRUCTIONS.values() if word.route is route))
    yield HelpGroup("Control structures", _usable(CONTROL.values()))
    for title, kinds in RESULTS.items():
        yield HelpGroup(title, _usable(row for row in FUNCTIONS.values() if row.result in kinds))
    yield HelpGroup("Operators", tuple(OPERATORS))
    yield HelpGroup("Words that link", tuple(LINKS))
    yield HelpGroup("Switches", tuple(SWITCHES))
    yield HelpGroup("Parameters", tuple(PARAMETERS))


def _usable(rows: Iterable[Row]) -> tuple[str, ...]:
    return tuple(row.name for row in rows if row.state is State.SUPPORTED)


# --- one word ------------------------------------------------------------------------------------------------------


def page(typed: str) -> HelpPage:
    """Every meaning of a word, which may be cut short. Raises UsageError with what is near."""
    name = _full_name(typed.upper())
    entries = tuple(entry for source in _SOURCES for entry in source(name))
    if not entries or name in LINKS:
        entries += tuple(_users(name))
    if not entries:
        hint = did_you_mean(name, _all_names(), "HELP alone lists all words")
        raise UsageError(f"there is no help on {name}", hint)
    return HelpPage(name, entries)


def _all_names() -> list[str]:
    return [*COMMANDS, *INSTRUCTIONS, *CONTROL, *FUNCTIONS, *OPERATORS, *LINKS, *SWITCHES, *PARAMETERS]


def _full_name(name: str) -> str:
    """The word itself, or the one that it is cut short from, or another spelling of."""
    name = next((row.name for row in OPERATORS.values() if row.also == name), name)
    if name in _all_names() or any(_users(name)):
        return name
    found = rows_for(name, COMMANDS, INSTRUCTIONS, CONTROL)
    if len(found) == 1:
        return found[0].name
    starting = sorted({known for known in _all_names() if known.startswith(name)})
    if len(starting) > 1:
        raise UsageError(f"{name} can be {', '.join(starting)}", "write more of the word")
    return starting[0] if starting else name


MOST_USERS = 3
_TABLES: Mapping[str, Mapping[str, Word]] = {
    "control structure": CONTROL,
    "monitor command": COMMANDS,
    "instruction": INSTRUCTIONS,
}


def _users(name: str) -> Iterator[HelpEntry]:
    """For a word that only stands inside others (STEP, AT, THEN): the first of those."""
    users = (
        (sort, row)
        for sort, table in _TABLES.items()
        for row in table.values()
        if name in re.findall(r"[A-Z]+", row.form) and row.state is State.SUPPORTED
    )
    for sort, row in islice(users, MOST_USERS):
        yield _entry(sort, row, "")


def _entry(sort: str, row: Row, note: str) -> HelpEntry:
    """What a row says. One that is not available has no example, and says what to write instead."""
    if row.state is State.SUPPORTED:
        return HelpEntry(sort, row.form, row.summary, row.example, row.where, note)
    return HelpEntry(sort, row.form, row.summary, "", row.where, "; ".join(filter(None, (row.state.value, note))))


def _row(sort: str, table: Mapping[str, Row]) -> Callable[[str], Iterator[HelpEntry]]:
    def entries(name: str) -> Iterator[HelpEntry]:
        row = table.get(name)
        if row is not None:
            also = row.also if isinstance(row, Operator) else ""
            yield _entry(sort, row, f"also written {also}" if also else row.note)

    return entries


def _function(name: str) -> Iterator[HelpEntry]:
    for row in filter(None, map(FUNCTIONS.get, (name, f"${name}", f"#{name}"))):
        yield _entry("constant" if row.constant else f"function, {row.result.value}", row, "")


def _switch(name: str) -> Iterator[HelpEntry]:
    row: Switch | None = SWITCHES.get(name)
    if row is not None:
        default = "ON" if row.default else "OFF"
        yield HelpEntry("switch", row.name, f"{row.summary}; {default} at the start", f"ENABLE {row.name}")


def _parameter(name: str) -> Iterator[HelpEntry]:
    row: ParameterRow | None = PARAMETERS.get(name)
    if row is not None:
        default = row.default if isinstance(row.default, str) else f"{plain(row.default)} {row.unit}".rstrip()
        example = f"PARAMETER {row.name} = {row.default if isinstance(row.default, str) else plain(row.default)}"
        yield HelpEntry("parameter", row.name, f"{row.summary}; {default} at the start", example)


_SOURCES: tuple[Callable[[str], Iterator[HelpEntry]], ...] = (
    _row("monitor command", COMMANDS),
    _row("instruction", INSTRUCTIONS),
    _row("control structure", CONTROL),
    _function,
    _row("operator", OPERATORS),
    _row("word that links", LINKS),
    _switch,
    _parameter,
)
