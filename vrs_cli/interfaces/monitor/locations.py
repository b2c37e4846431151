"""Commands on locations and other variables: WHERE (position of the robot, of a part or of the measured robot), PARTS,
WHY (whether a location can be reached), HERE, POINT and TEACH (define locations), and commands that list and delete
variables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import TYPE_CHECKING, cast

from msgspec.structs import replace

from vrs_cli.engine import comparison, position
from vrs_cli.errors import IllegalValue, InvalidName, TypeMismatch, UndefinedName, UndefinedValue, UsageError, VrsError
from vrs_cli.interfaces.dialogue import Dialogue, beside, beside_if
from vrs_cli.interfaces.monitor.explaining import Sight
from vrs_cli.interfaces.station import operands
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics import joints, transform
from vrs_cli.language.run import runtime, variables
from vrs_cli.language.text import ast, printer
from vrs_cli.language.words import functions, values
from vrs_cli.values import commands, questions, replies, results
from vrs_cli.values.numbers import Value, count

if TYPE_CHECKING:
    from vrs_cli.world.course import WorldCourse


@operands.handles("WHERE")
def _where(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Show the position of the robot, of the measured robot or of a part: now, at a given time, or at several times."""
    named, stamped, over = operands.operand(it, 0), it.modifiers.has_time, operands.has_times(it)
    if operands.is_measured(named):
        yield from where_measured(station, it)
        return
    if isinstance(named, ast.BareWord | ast.StringConstant):
        yield from where_part(station, it, named)
        return
    number = 1.0 if named is None else operands.real(station, named)
    if values.whole(number) != 1:
        raise IllegalValue(f"robot {values.plain(number)}", "there is one robot, number 1")
    engine, units = station.engine, station.units
    if not over:
        passes = engine.realtime and not engine.clock.paused
        yield replies.Whereabouts(engine.position(operands.moment(station, it)), stamped=stamped or passes, units=units)
        return
    _check_either(it)
    arm, timeline, instants = engine.arm, engine.timeline, tuple(operands.times(station, it))
    rows = yield from beside(lambda: tuple(position.position_at(arm, timeline, t) for t in instants))
    yield replies.WhereaboutsTable(rows, units)


def _check_either(it: ast.Instruction, what: str = "") -> None:
    """Check that WHERE does not have both AT and FROM. `what`: the operand of WHERE, for the hint. Raises
    UsageError."""
    if it.modifiers.has_time:
        raise UsageError("AT and FROM do not go together", f"WHERE {what}AT t, or WHERE {what}FROM t1 TO t2 STEP dt")


@operands.handles("SHOW")
def _show(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Show the arm on the user's screen while it moves. If the arm does not move, or if there is no screen, show one
    picture."""
    engine, stamped, t = station.engine, it.modifiers.has_time, operands.moment(station, it)
    arm, timeline = engine.arm, engine.timeline
    moves = engine.realtime and engine.now < engine.end and not stamped
    shown = moves and station.user_state.attended and (yield from station.user_state.show(None, questions.Watching()))
    if not shown:
        sight = Sight(arm, station.driver.world)
        yield (yield from beside(lambda: sight.picture(timeline, t, stamped)))


@operands.handles("TEACH")
def _teach(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Store the current location under the next unused name of a series, without a question: part, part1, part2;
    row[3], row[4]. Raises InvalidName if that name is too long."""
    name = operands.operand(it, 0)
    if not isinstance(name, ast.Variable):
        raise IllegalValue(printer.expression_text(name) if name else "TEACH", "the name of a location, as TEACH part")
    while runtime.definable(station.environment, station.engine, name).reference.has_value():
        name = _next_name(station, name)
    yield from station.do(replace(it, word="HERE", arguments=(name,)))
    reference = runtime.definable(station.environment, station.engine, name).reference
    yield _one_location(station, reference.name, cast("transform.Transform | joints.Joints", reference.value()))


def _next_name(station: Station, name: ast.Variable) -> ast.Variable:
    """Return the name after the given one in a series of names. Raises InvalidName if it is too long."""
    if name.indexes:
        *others, last = name.indexes
        following = operands.real(station, last) + 1.0
        return replace(name, indexes=(*others, ast.Number(following, values.plain(following), span=last.span)))
    letters = name.name.rstrip("0123456789")
    longer = f"{letters}{int(name.name[len(letters) :] or 0) + 1}"
    if len(longer) > values.NAME_LENGTH:
        raise InvalidName(f"{name.sigil}{longer}", f"at most {values.NAME_LENGTH} characters; TEACH a shorter name")
    return replace(name, name=longer)


@operands.handles("HERE", "POINT")
def _define(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Define a location, and show it. A person is asked for changes until an empty line is typed."""
    if it.word == "HERE" or it.value is not None:
        yield from station.do(it)
    expression = operands.operand(it, 0)
    assert expression is not None
    reference = runtime.definable(station.environment, station.engine, expression).reference
    if not station.user_state.attended:
        if not reference.has_value():
            raise UndefinedValue(reference.name, f"POINT {reference.name} = location gives it one")
        yield _one_location(station, reference.name, cast("transform.Transform | joints.Joints", reference.value()))
        return
    if reference.has_value():
        value = cast("transform.Transform | joints.Joints", reference.value())
    else:  # as in VAL, a new location is first shown with zeros
        joint_count = station.engine.model.joint_count
        value = (0.0,) * joint_count if reference.cells.kind is values.Kind.PRECISION else transform.IDENTITY
    while True:
        yield _one_location(station, reference.name, value)
        answer = yield questions.Amendment("Change?")
        if not isinstance(answer, str):
            yield results.Message(f"{reference.name} is left as it was")
            return
        answer = answer.partition(";")[0].strip()
        if not answer:
            reference.assign(value)
            return
        try:
            value = change_numbers(value, answer, station.units)
        except VrsError as error:
            yield results.Message(str(error), results.Tone.ERROR)


def change_numbers(
    value: transform.Transform | joints.Joints, answer: str, units: joints.JointUnits = joints.TURNING
) -> transform.Transform | joints.Joints:
    """Return a location with some of its numbers replaced by typed ones. `answer`: numbers between commas; a number
    that is left out stays unchanged. Raises IllegalValue."""
    numbers = list(values.numbers_of(value, units))
    fields = answer.split(",")
    if len(fields) > len(numbers):
        raise IllegalValue(f"{len(fields)} numbers", f"at most {len(numbers)}, commas between them")
    for i, field in enumerate(fields):
        if field.strip():
            if (number := values.read_number(field)) is None:
                raise IllegalValue(field.strip(), "numbers with commas between them; ,,50 changes the third alone")
            numbers[i] = number
    return values.transformation(numbers) if isinstance(value, transform.Transform) else units.read(numbers)


def _one_location(station: Station, name: str, value: transform.Transform | joints.Joints) -> replies.LocationTable:
    return replies.LocationTable((replies.NamedLocation.of(name, value),), station.units)


@operands.handles("TOOL", "BASE")
def _set_frame(station: Station, it: ast.Instruction) -> Dialogue[None]:
    yield from station.do(it)
    frames = station.engine.frames
    yield _one_location(station, it.word, frames.tool if it.word == "TOOL" else frames.base)


@operands.handles("WHY")
def _why(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Explain whether a location can be reached. Raises TypeMismatch if the operand is not a location."""
    expression = operands.operand(it, 0)
    assert expression is not None
    value, text = operands.evaluator(station, expression)(), printer.expression_text(expression)
    if not isinstance(value, tuple):
        raise TypeMismatch(f"{text} is a {values.kind_of_value(value).value}", "WHY explains a location")
    target = commands.PoseTarget(value) if isinstance(value, transform.Transform) else commands.JointTarget(value)
    yield (yield from explain_reach(station, target, text))


def explain_reach(
    station: Station, target: commands.PoseTarget | commands.JointTarget, name: str
) -> Dialogue[replies.ReachReport]:
    """Return whether the arm can reach a target from its current position, and if not, why. `name`: what the report
    calls the target."""
    reach = yield from beside(lambda: station.engine.explain(target))
    contacts = (station.contacts.ahead(commands.Move(target, straight)) for straight in (False, True))
    return replies.ReachReport(name, reach, station.units, *contacts)


# --- the measured robot ----------------------------------------------------------------------------------------------


def where_measured(station: Station, it: ast.Instruction) -> Dialogue[None]:
    """Show the measured position of the robot: in the last report, at a given time, or at several times. Raises
    UsageError if no report has arrived."""
    measured = station.engine.measured.view
    if measured.end is None:
        raise UsageError(*operands.NO_REPORT)
    arm, timeline, units = station.engine.arm, station.engine.timeline, station.units
    if not operands.has_times(it):
        t = operands.moment(station, it) if it.modifiers.has_time else measured.end
        if (at := comparison.measured_position(arm, timeline, measured, t)) is None:
            yield results.Message(comparison.why_unknown(measured, t))
        else:
            yield replies.MeasuredWhereabouts(at, t == measured.end, units)
        return
    _check_either(it, "MEASURED ")
    instants = tuple(operands.times(station, it))
    found = (comparison.measured_position(arm, timeline, measured, t) for t in instants)
    rows = yield from beside(lambda: tuple(at.measured for at in found if at is not None))
    yield replies.WhereaboutsTable(rows, units)
    if len(rows) < len(instants):
        yield results.Message(f"The measured robot is unknown at {count(len(instants) - len(rows), 'other time')}")


# --- parts -----------------------------------------------------------------------------------------------------------


BRINGS_PARTS = "a cell with [[part]] brings some: vrs --cell FILE"


def part_table(station: Station, t: float | None) -> replies.PartTable:
    """Return the positions of all parts at time t [s], by default now."""
    stamped, t = t is not None, station.engine.now if t is None else t
    course = station.driver.course
    return replies.PartTable(
        () if course is None else tuple(_part_row(course, name, t) for name in course.parts()), stamped
    )


def _part_row(course: WorldCourse, name: str, t: float) -> replies.PartRow:
    state = course.state(name, t)
    return replies.PartRow(name, t, state.pose if state.exists else None, state.held, state.on)


@operands.handles("PARTS")
def _list_parts(station: Station, it: ast.Instruction) -> Iterable[replies.Reply]:
    table = part_table(station, operands.moment(station, it) if it.modifiers.has_time else None)
    yield table if table.rows else results.Message(f"There are no parts; {BRINGS_PARTS}")
    if table.rows:
        station.contacts.tell_missing()


def where_part(
    station: Station, it: ast.Instruction, asked: ast.BareWord | ast.StringConstant
) -> Iterable[replies.Reply]:
    """Show the position of a part: now, at a given time, or at several times. Raises UndefinedName, UsageError."""
    course, said = station.driver.course, asked.text if isinstance(asked, ast.BareWord) else asked.value
    names = {name.lower(): name for name in (() if course is None else course.parts())}
    if said.lower() not in names and said.lower()[: values.NAME_LENGTH] in station.environment.kinds:
        raise UsageError(f"{said} is a variable, no part", f"LISTL {said} shows a place, WHERE tells where the arm is")
    if course is None or not names:
        raise UsageError("there are no parts", f"{BRINGS_PARTS}; LISTL shows places")
    if (name := names.get(said.lower())) is None:
        raise UndefinedName(
            f"part {said}", variables.closest(said.lower(), names) or f"the cell has {', '.join(names.values())}"
        )
    over = operands.has_times(it)
    if over:
        _check_either(it, f"{name} ")
    times = operands.times(station, it) if over else (operands.moment(station, it),)
    yield replies.PartTable(tuple(_part_row(course, name, t) for t in times), it.modifiers.has_time or over)


# --- variables -------------------------------------------------------------------------------------------------------

Rows = tuple[tuple[str, Value], ...]  # pairs of a name (or an expression as typed) and its value

REALS, STRINGS = (values.Kind.REAL,), (values.Kind.STRING,)


def _table(kinds: tuple[values.Kind, ...], rows: Rows, units: joints.JointUnits, truth: bool = False) -> replies.Reply:
    """Return the reply that lists values of these kinds. `truth`: show real numbers as true or false."""
    if kinds == REALS:
        return replies.RealTable(tuple((name, cast(float, value)) for name, value in rows), truth)
    if kinds == STRINGS:
        return replies.StringTable(tuple((name, cast(str, value)) for name, value in rows))
    return replies.LocationTable(
        tuple(
            replies.NamedLocation.of(name, cast("transform.Transform | joints.Joints", value)) for name, value in rows
        ),
        units,
    )


@operands.handles("LISTL", kinds=operands.PLACES, hint="LISTR lists reals, LISTS strings")
@operands.handles("LISTR", kinds=REALS, hint="LISTL lists locations, LISTS strings")
@operands.handles("LISTS", kinds=STRINGS, hint="LISTL lists locations, LISTR reals")
def _list_variables(station: Station, it: ast.Instruction, kinds: tuple[values.Kind, ...], hint: str) -> Dialogue[None]:
    """List the values of the arguments; without arguments, of all variables of the given kinds. `hint`: which commands
    list other kinds. Raises TypeMismatch for an argument of another kind."""
    rows, expressions = (
        list[tuple[str, Value]](),
        [argument for argument in it.arguments if argument is not None],
    )
    if not expressions:
        memory = station.environment.copy()
        rows += yield from beside(lambda: list(chain.from_iterable(map(memory.variables, kinds))))
    for expression in expressions:
        found = yield from _values(station, expression)
        for name, value in found:
            if values.kind_of_value(value) not in kinds:
                raise TypeMismatch(f"{name} is a {values.kind_of_value(value).value}", hint)
        rows += found
    yield (yield from beside_if(len(rows) > operands.LONG_LIST, lambda: _table(kinds, tuple(rows), station.units)))


def show_value(station: Station, expression: ast.Expression) -> Dialogue[None]:
    """Show the value of an expression that was typed alone at the prompt, as LISTR, LISTL or LISTS would."""
    if isinstance(expression, ast.Binary) and expression.operator == "==" and isinstance(expression.left, ast.Variable):
        left, right = printer.expression_text(expression.left), printer.expression_text(expression.right)
        yield results.Message(f"== compares; {left} = {right} assigns")
    rows = yield from _values(station, expression)
    truth = (
        isinstance(expression, ast.Binary | ast.Unary)
        and expression.operator in functions.RELATIONS | functions.LOGICAL
    )
    yield _table((values.kind_of_value(rows[0][1]),), rows, station.units, truth)


def _values(station: Station, expression: ast.Expression) -> Dialogue[Rows]:
    """Return an expression as a string, and its value. A bare name stands for the simple variable and all elements of
    the array with that name."""
    rows: Rows = ()
    if isinstance(expression, ast.Variable) and not expression.indexes:
        if (reference := operands.own_variables(station).get(expression.key)) is not None:
            rows = tuple(_own_elements(station, expression, reference))
        else:
            found = station.environment.alone(expression.key)
            rows = yield from beside_if(
                found.count() > operands.LONG_LIST,
                lambda: tuple(chain.from_iterable(map(found.variables, values.Kind))),
            )
    return rows or ((printer.expression_text(expression), operands.evaluator(station, expression)()),)


def _own_elements(station: Station, asked: ast.Variable, reference: variables.Reference) -> Iterator[tuple[str, Value]]:
    """Yield the name and the value of an own variable of the stopped program (AUTO, LOCAL or argument); for an array,
    of each of its elements. Raises UndefinedValue."""
    program, name = station.task.program if station.task is not None else "", asked.sigil + asked.name
    if reference.key is not None:
        yield f"{name} ({program})", reference.value()
        return
    for cells in (reference.cells, reference.locations):
        indexes = [index for index in cells if not isinstance(index, str)]
        for index in sorted(indexes, key=lambda index: index if isinstance(index, tuple) else (index,)):
            yield f"{name}[{variables.subscript(index)}] ({program})", cells[index]


@operands.handles("DELETEL", "DPOINT", kinds=operands.PLACES)
@operands.handles("DELETER", kinds=REALS)
@operands.handles("DELETES", kinds=STRINGS)
def _delete_variables(station: Station, it: ast.Instruction, kinds: tuple[values.Kind, ...]) -> Dialogue[None]:
    """Delete variables of the given kinds, or elements of arrays, if the user agrees. Raises UndefinedValue,
    TypeMismatch."""
    named = list[tuple[str, variables.Index | None]]()
    for expression in it.arguments:
        if not isinstance(expression, ast.Variable):
            raise TypeMismatch("an expression", "the name of a variable is wanted")
        name = expression.sigil + expression.name
        if (kind := station.environment.kind_of(name)) is None:
            raise UndefinedValue(name, "there is nothing to delete")
        if kind not in kinds:
            raise TypeMismatch(f"{name} is a {kind.value}")
        indexes = tuple(values.whole(operands.real(station, index)) for index in expression.indexes or ())
        named.append((name, None if not indexes else indexes[0] if len(indexes) == 1 else indexes))
    if (yield from operands.may_delete(station, f"{', '.join(name for name, _ in named)} will be deleted.")):
        for name, index in named:
            station.environment.delete(name, index)
