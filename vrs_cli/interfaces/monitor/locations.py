"""Commands on locations: WHERE the robot, a part or the measured robot is, PARTS, WHY a place is in reach or not, and
HERE, POINT and TEACH, which define locations.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, cast

from msgspec.structs import replace

from vrs_cli.engine.comparison import measured_position, why_unknown
from vrs_cli.engine.position import position_at
from vrs_cli.errors import IllegalValue, InvalidName, TypeMismatch, UndefinedName, UndefinedValue, UsageError, VrsError
from vrs_cli.interfaces.dialogue import Dialogue, beside
from vrs_cli.interfaces.monitor.pictures import Sight
from vrs_cli.interfaces.station.operands import NO_REPORT, Handler, is_measured, moment, operand, real, sight, times
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.joints import TURNING, Joints, JointUnits
from vrs_cli.kinematics.transform import IDENTITY, Transform
from vrs_cli.language.run.runtime import definable
from vrs_cli.language.run.variables import Reference, closest
from vrs_cli.language.text.ast import BareWord, Instruction, Number, StringConstant, Variable
from vrs_cli.language.text.printer import expression_text
from vrs_cli.language.words.values import (
    NAME_LENGTH,
    Kind,
    kind_of_value,
    numbers_of,
    plain,
    read_number,
    transformation,
    whole,
)
from vrs_cli.values.commands import Move
from vrs_cli.values.measured import MeasuredPosition
from vrs_cli.values.motion import JointTarget, PoseTarget
from vrs_cli.values.numbers import count
from vrs_cli.values.questions import Amendment, Watching
from vrs_cli.values.replies import (
    LocationTable,
    MeasuredWhereabouts,
    Message,
    NamedLocation,
    PartRow,
    PartTable,
    ReachReport,
    Reply,
    Tone,
    Whereabouts,
    WhereaboutsTable,
)

if TYPE_CHECKING:
    from vrs_cli.world.course import WorldCourse


def _where(station: Station, it: Instruction) -> Dialogue[None]:
    asked = operand(it, 0)
    if is_measured(asked):
        yield from where_measured(station, it)
        return
    if isinstance(asked, BareWord | StringConstant):
        yield from where_part(station, it, asked)
        return
    number = 1.0 if asked is None else real(station, asked)
    if whole(number) != 1:
        raise IllegalValue(f"robot {plain(number)}", "there is one robot, number 1")
    engine, stamped, units = station.engine, it.modifiers.timed, station.units
    if not any(operand(it, index) is not None for index in (1, 2, 3)):
        passes = engine.realtime and not engine.clock.paused
        yield Whereabouts(engine.position(moment(station, it)), stamped=stamped or passes, units=units)
        return
    if stamped:
        raise UsageError("AT and FROM do not go together", "WHERE AT t, or WHERE FROM t1 TO t2 STEP dt")
    arm, timeline, instants = engine.arm, engine.timeline, tuple(times(station, it))
    rows = yield from beside(lambda: tuple(position_at(arm, timeline, t) for t in instants))
    yield WhereaboutsTable(rows, units)


def _show(station: Station, it: Instruction) -> Dialogue[None]:
    engine, stamped, t = station.engine, it.modifiers.timed, moment(station, it)
    arm, timeline = engine.arm, engine.timeline
    moves = engine.realtime and engine.now < engine.end and not stamped
    shown = moves and station.user_state.attended and (yield from station.user_state.show(None, Watching()))
    if not shown:
        sight = Sight(arm, station.driver.world)
        yield (yield from beside(lambda: sight.picture(timeline, t, stamped)))


def _define(station: Station, it: Instruction) -> Dialogue[None]:
    """HERE, POINT."""
    if it.word == "HERE" or it.value is not None:
        yield from station.do(it)
    yield from _defined(station, it)


def _teach(station: Station, it: Instruction) -> Dialogue[None]:
    """Define the present location without a question, under the next name of a series: no pendant has a
    button for it.
    """
    expression = operand(it, 0)
    if not isinstance(expression, Variable):
        raise IllegalValue(
            expression_text(expression) if expression else "TEACH", "the name of a location, as TEACH part"
        )
    name = next_in_series(station, expression)
    yield from station.do(replace(it, word="HERE", arguments=(name,)))
    reference = _defined_by(station, replace(it, arguments=(name,)))
    yield _one_location(station, reference.name, cast("Transform | Joints", reference.value()))


def next_in_series(station: Station, first: Variable) -> Variable:
    """The first name of a series that has no value: part, part1, part2; row[3], row[4].

    Raises InvalidName for a name that cannot be counted up.
    """
    environment, name = station.environment, first
    while definable(environment, station.engine, name).reference.defined():
        name = _counted_up(station, name)
    return name


def _counted_up(station: Station, name: Variable) -> Variable:
    if name.indexes:
        *others, last = name.indexes
        following = real(station, last) + 1.0
        return replace(name, indexes=(*others, Number(following, plain(following), span=last.span)))
    letters = name.name.rstrip("0123456789")
    longer = f"{letters}{int(name.name[len(letters) :] or 0) + 1}"
    if len(longer) > NAME_LENGTH:
        raise InvalidName(f"{name.sigil}{longer}", f"at most {NAME_LENGTH} characters; TEACH a shorter name")
    return replace(name, name=longer)


def _defined(station: Station, it: Instruction) -> Dialogue[None]:
    """Show a location, and where a user is there, ask for changes until an empty line."""
    reference = _defined_by(station, it)
    if not station.user_state.attended:
        if not reference.defined():
            raise UndefinedValue(reference.name, f"POINT {reference.name} = location gives it one")
        yield _one_location(station, reference.name, cast("Transform | Joints", reference.value()))
        return
    if reference.defined():
        value = cast("Transform | Joints", reference.value())
    else:  # what the six zeros of VAL stand for
        joint_count = station.engine.model.joint_count
        value = (0.0,) * joint_count if reference.cells.kind is Kind.PRECISION else IDENTITY
    while True:
        yield _one_location(station, reference.name, value)
        answer = yield Amendment("Change?")
        if not isinstance(answer, str):
            yield Message(f"{reference.name} is left as it was")
            return
        answer = answer.partition(";")[0].strip()
        if not answer:
            reference.assign(value)
            return
        try:
            value = changed(value, answer, station.units)
        except VrsError as error:
            yield Message(str(error), Tone.ERROR)


def _defined_by(station: Station, it: Instruction) -> Reference:
    expression = operand(it, 0)
    assert expression is not None
    return definable(station.environment, station.engine, expression).reference


def changed(value: Transform | Joints, answer: str, units: JointUnits = TURNING) -> Transform | Joints:
    """Change a location by the numbers that were typed; commas skip those that stay. Raises IllegalValue."""
    numbers = list(numbers_of(value, units))
    fields = answer.split(",")
    if len(fields) > len(numbers):
        raise IllegalValue(f"{len(fields)} numbers", f"at most {len(numbers)}, commas between them")
    for i, field in enumerate(fields):
        if field.strip():
            number = read_number(field)
            if number is None:
                raise IllegalValue(field.strip(), "numbers with commas between them; ,,50 changes the third alone")
            numbers[i] = number
    return transformation(numbers) if isinstance(value, Transform) else units.read(numbers)


def _one_location(station: Station, name: str, value: Transform | Joints) -> LocationTable:
    return LocationTable((NamedLocation.of(name, value),), station.units)


def _frame(station: Station, it: Instruction) -> Dialogue[None]:
    """TOOL, BASE."""
    yield from station.do(it)
    frames = station.engine.frames
    yield _one_location(station, it.word, frames.tool if it.word == "TOOL" else frames.base)


def _why(station: Station, it: Instruction) -> Dialogue[None]:
    asked = operand(it, 0)
    assert asked is not None
    value = sight(station, asked)()
    if not isinstance(value, tuple):
        raise TypeMismatch(f"{expression_text(asked)} is a {kind_of_value(value).value}", "WHY explains a location")
    target = PoseTarget(value) if isinstance(value, Transform) else JointTarget(value)
    yield (yield from explained(station, target, expression_text(asked)))


def explained(station: Station, target: PoseTarget | JointTarget, name: str) -> Dialogue[ReachReport]:
    """Explain whether a place of that name can be reached from here."""
    reach = yield from beside(lambda: station.engine.explain(target))
    contacts = (station.contacts.ahead(Move(target, straight)) for straight in (False, True))
    return ReachReport(name, reach, station.units, *contacts)


LOCATIONS: Mapping[str, Handler] = {
    "WHERE": _where,
    "SHOW": _show,
    "WHY": _why,
    "HERE": _define,
    "POINT": _define,
    "TEACH": _teach,
    "TOOL": _frame,
    "BASE": _frame,
}


def where_measured(station: Station, it: Instruction) -> Dialogue[None]:
    """WHERE MEASURED: the last report, a time, or a stretch of time."""
    measured = station.engine.measured.view
    if measured.end is None:
        raise UsageError(*NO_REPORT)
    arm, timeline, units = station.engine.arm, station.engine.timeline, station.units
    if not any(operand(it, index) is not None for index in (1, 2, 3)):
        t = moment(station, it) if it.modifiers.timed else measured.end
        at = measured_position(arm, timeline, measured, t)
        yield Message(why_unknown(measured, t)) if at is None else MeasuredWhereabouts(at, t == measured.end, units)
        return
    if it.modifiers.timed:
        what = "WHERE MEASURED AT t, or WHERE MEASURED FROM t1 TO t2 STEP dt"
        raise UsageError("AT and FROM do not go together", what)
    instants = tuple(times(station, it))

    def looks() -> Iterator[MeasuredPosition | None]:
        return (measured_position(arm, timeline, measured, t) for t in instants)

    rows = yield from beside(lambda: tuple(at.measured for at in looks() if at is not None))
    yield WhereaboutsTable(rows, units)
    if len(rows) < len(instants):
        yield Message(f"The measured robot is unknown at {count(len(instants) - len(rows), 'other time')}")


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
