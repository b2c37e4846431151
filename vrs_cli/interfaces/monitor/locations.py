"""Commands on locations: WHERE the robot is, WHY a place is in reach or not, and HERE, POINT and TEACH, which define
them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

from msgspec.structs import replace

from vrs_cli.engine.position import position_at
from vrs_cli.errors import IllegalValue, InvalidName, TypeMismatch, UndefinedValue, UsageError, VrsError
from vrs_cli.interfaces.dialogue import Dialogue, beside
from vrs_cli.interfaces.monitor.measured import where_measured
from vrs_cli.interfaces.monitor.parts import where_part
from vrs_cli.interfaces.monitor.showing import Sight
from vrs_cli.interfaces.station.operands import Handler, is_measured, moment, operand, real, sight, times
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.joints import TURNING, Joints, JointUnits
from vrs_cli.kinematics.transform import IDENTITY, Transform
from vrs_cli.language.run.runtime import definable
from vrs_cli.language.run.variables import Reference
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
from vrs_cli.values.motion import JointTarget, PoseTarget
from vrs_cli.values.questions import Amendment, Watching
from vrs_cli.values.replies import (
    LocationTable,
    Message,
    NamedLocation,
    ReachReport,
    Tone,
    Whereabouts,
    WhereaboutsTable,
)


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
