"""PARTS, and WHERE of a part: where the parts of the cell are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from vrs_cli.errors import UndefinedName, UsageError
from vrs_cli.interfaces.station.operands import Handler, moment, operand, times
from vrs_cli.interfaces.station.station import Station
from vrs_cli.language.run.variables import closest
from vrs_cli.language.text.ast import BareWord, Instruction, StringConstant
from vrs_cli.language.words.values import NAME_LENGTH
from vrs_cli.values.replies import Message, PartRow, PartTable, Reply

if TYPE_CHECKING:
    from vrs_cli.world.course import WorldCourse

BRINGS_PARTS = "a cell with [[part]] brings some: vrs --cell FILE"


def part_table(station: Station, t: float | None) -> PartTable:
    """Tell where all parts are at a time [s], or now."""
    stamped, t = t is not None, station.engine.now if t is None else t
    course = station.driver.course
    rows = () if course is None else tuple(_row(course, name, t) for name in course.parts())
    return PartTable(rows, stamped)


def _row(course: WorldCourse, name: str, t: float) -> PartRow:
    state = course.state(name, t)
    return PartRow(name, t, state.pose if state.exists else None, state.held, state.on)


def _parts(station: Station, it: Instruction) -> Iterable[Reply]:
    table = part_table(station, moment(station, it) if it.modifiers.timed else None)
    yield table if table.rows else Message(f"There are no parts; {BRINGS_PARTS}")
    if table.rows:
        station.contacts.tell_missing()


def where_part(station: Station, it: Instruction, asked: BareWord | StringConstant) -> Iterable[Reply]:
    """WHERE of a part: now, at a time, or over a stretch of time. Raises UndefinedName, UsageError."""
    course, said = station.driver.course, asked.text if isinstance(asked, BareWord) else asked.value
    names = {name.lower(): name for name in (() if course is None else course.parts())}
    if said.lower() not in names and said.lower()[:NAME_LENGTH] in station.environment.kinds:
        raise UsageError(f"{said} is a variable, no part", f"LISTL {said} shows a place, WHERE tells where the arm is")
    if course is None or not names:
        raise UsageError("there are no parts", f"{BRINGS_PARTS}; LISTL shows places")
    name = names.get(said.lower())
    if name is None:
        raise UndefinedName(f"part {said}", closest(said.lower(), names) or f"the cell has {', '.join(names.values())}")
    over = any(operand(it, index) is not None for index in (1, 2, 3))
    if over and it.modifiers.timed:
        raise UsageError("AT and FROM do not go together", f"WHERE {name} AT t, or WHERE {name} FROM t1 TO t2 STEP dt")
    rows = tuple(_row(course, name, t) for t in (times(station, it) if over else (moment(station, it),)))
    yield PartTable(rows, it.modifiers.timed or over)


PARTS: Mapping[str, Handler] = {"PARTS": _parts}
