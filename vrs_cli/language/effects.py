"""What a running program asks of its driver, and the instructions as functions from evaluated operands to that.

A request of `engine.commands` goes to the robot. The effects below are for the terminal and the clock. What needs
neither (variables, signals, timers) the instruction does by itself, at its own instant of the program.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from math import radians
from typing import cast

from vrs_cli.engine.commands import (
    AlignedTarget,
    Brake,
    Break,
    Delay,
    JointOffsetTarget,
    JointTarget,
    Mode,
    Move,
    NamedTarget,
    OperateHand,
    PoseTarget,
    Request,
    SetAcceleration,
    SetBase,
    SetConfiguration,
    SetDuration,
    SetMode,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    SetSwitch,
    SetTool,
    SpeedUnit,
    Stamp,
    Target,
    ToolOffsetTarget,
)
from vrs_cli.errors import (
    IllegalJoint,
    IllegalValue,
    InvalidNumber,
    TypeMismatch,
    UnitNotAttached,
    VrsError,
)
from vrs_cli.kinematics.configuration import Arm, Elbow, Wrist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    compose,
    inverse,
    rotation_z,
    translation,
)
from vrs_cli.language.ast import Format, Kind, Span
from vrs_cli.language.environment import Context, Reference
from vrs_cli.language.operations import frame, pack, shift
from vrs_cli.language.reactions import DEFAULT, Reaction, checked_priority, checked_signal
from vrs_cli.language.units import (
    CHOOSE,
    ROBOT,
    Access,
    AttachUnit,
    CloseFile,
    DeleteFile,
    DetachUnit,
    OpenFile,
    ReadRecord,
    RecordRefused,
    UnitEffect,
    WriteRecord,
    checked_device,
    checked_disk,
    checked_mode,
    checked_unit,
)
from vrs_cli.language.values import (
    TypeItem,
    Value,
    encode,
    integer,
    integer_between,
    kind_of_value,
    numbers_of,
    plain,
    read_number,
    storable,
    whole,
)

# --- effects -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Type:
    """Text for the terminal; `newline`: a line ends after it."""

    text: str
    newline: bool = True


@dataclass(frozen=True, slots=True)
class Prompt:
    """Show the text and read one line, the answer to `resume`. `count`: how many values are wanted."""

    text: str
    count: int


@dataclass(frozen=True, slots=True)
class Wait:
    """Hold the program until `condition()` is true: asked at once, or after `ticks`, then every tick.

    The condition raises VrsError where it cannot be evaluated: the driver hands that to `Task.throw`.
    """

    condition: Callable[[], bool]
    ticks: int = 0


@dataclass(frozen=True, slots=True)
class WaitEvent:
    """WAIT.EVENT: hold the program until another sets its event, or for so many `seconds` where that is not None.

    `event`: whether an event ends it at all.
    """

    event: bool
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class SetEvent:
    """SET.EVENT: the event of a task."""

    task: int


@dataclass(frozen=True, slots=True)
class CycleBegins:
    """A cycle of the main program begins: the driver performs `settings` (val2 section 9.1). Cycles count from 1."""

    cycle: int
    settings: tuple[Request, ...]


@dataclass(frozen=True, slots=True)
class CallProgram:
    """CALL; the task does it by itself."""

    name: str
    arguments: tuple[Reference | None, ...]


@dataclass(frozen=True, slots=True)
class Return:
    """RETURN, or the end of a program; the task does it by itself. `steps`: how many after the call are left out."""

    steps: int = 0


@dataclass(frozen=True, slots=True)
class Stop:
    """STOP: the end of this cycle; the task does it by itself."""


@dataclass(frozen=True, slots=True)
class Pause:
    """PAUSE: the task says `Paused`."""


@dataclass(frozen=True, slots=True)
class Halt:
    """HALT: the task says `Halted`."""


@dataclass(frozen=True, slots=True)
class ReturnFromError:
    """RETURNE: RETURN, but from a REACTE routine to the step after the one that failed."""


@dataclass(frozen=True, slots=True)
class SignalsSet:
    """SIGNAL and its like: a reaction of the program itself may be due; the task looks by itself."""


@dataclass(frozen=True, slots=True)
class Ignore:
    """IGNORE: no more reaction to a signal; the task does it by itself."""

    signal: int


@dataclass(frozen=True, slots=True)
class Lock:
    """LOCK: the priority of the program; the task does it by itself."""

    priority: int


@dataclass(frozen=True, slots=True)
class ReactToErrors:
    """REACTE: call a program when a step fails, none any more where it is None; the task does it by itself."""

    program: str | None


@dataclass(frozen=True, slots=True)
class RunSignal:
    """RUNSIG: the signal has this state while the program runs, and the other one whenever it does not."""

    signal: int


@dataclass(frozen=True, slots=True)
class StartTask:
    """EXECUTE in a program, PCEXECUTE: `number` is None for the first task that is free."""

    number: int | None
    call: CallProgram
    cycles: int = 1
    step: int = 1


class Control(Enum):
    """What a program may do with a task."""

    ABORT = "ABORT"
    KILL = "KILL"
    CYCLE_END = "CYCLE.END"
    PROCEED = "PROCEED"
    RETRY = "RETRY"


@dataclass(frozen=True, slots=True)
class ControlTask:
    control: Control
    number: int


@dataclass(frozen=True, slots=True)
class AttachRobot:
    """ATTACH: take the robot, as soon as no other task has it."""


@dataclass(frozen=True, slots=True)
class DetachRobot:
    """DETACH: let the robot go, once it is at rest."""


Effect = (
    Type
    | Prompt
    | Wait
    | WaitEvent
    | SetEvent
    | CycleBegins
    | CallProgram
    | Return
    | ReturnFromError
    | Stop
    | Pause
    | Halt
    | Reaction
    | SignalsSet
    | Ignore
    | Lock
    | ReactToErrors
    | RunSignal
    | StartTask
    | ControlTask
    | AttachRobot
    | DetachRobot
    | UnitEffect
)
Yielded = Request | Effect
Answers = Generator[Yielded, str | None, None]

CYCLE_SETTINGS: tuple[Request, ...] = (
    SetSpeed(100.0, 100.0, SpeedUnit.PERCENT, always=True),
    SetDuration(0.0, always=True),
    SetMode(Mode.COARSE, on=False, always=True, tolerance=100.0),
    SetMode(Mode.NULLING, on=True, always=True),
    SetMode(Mode.CONTINUOUS_PATH, on=True, always=True),
    SetMode(Mode.SINGLE, on=False, always=True),
    SetMode(Mode.OVERLAP, on=True, always=True),
    SetMode(Mode.INTEGRAL, on=False, always=True),
)

# --- operands ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Definable:
    """A location that an instruction defines: a variable, seen from the product of those before it in `a:b:c`."""

    reference: Reference
    T_world_before: Transform | None = None

    def define(self, value: Transform | Joints) -> None:
        """Raises TypeMismatch for a precision point after others, or where the name is of another kind."""
        if self.T_world_before is None:
            self.reference.assign(value)
        elif isinstance(value, Transform):
            self.reference.assign(compose(inverse(self.T_world_before), value))
        else:
            raise TypeMismatch("a precision point in a compound", "only transformations can be compounded")

    @property
    def precision(self) -> bool:
        """Whether it holds joints."""
        return self.reference.cells.kind is Kind.PRECISION


Operand = Value | Reference | Definable | TypeItem | CallProgram | None


@dataclass(frozen=True, slots=True)
class Operands:
    """An instruction with its operands evaluated: None for an omitted one, trailing ones may be absent.

    `text` is the instruction in canonical form; `value` what followed `=`.
    """

    text: str
    arguments: tuple[Operand, ...] = ()
    value: Operand = None
    stamp: Stamp | None = None
    always: bool = False
    unit: str | None = None

    def get(self, index: int) -> Operand:
        return self.arguments[index] if index < len(self.arguments) else None

    def real(self, index: int) -> float:
        return cast(float, self.get(index))

    def optional(self, index: int) -> float | None:
        return cast("float | None", self.get(index))

    def real_or(self, index: int, default: float) -> float:
        given = self.optional(index)
        return default if given is None else given

    def transform(self, index: int) -> Transform:
        given = self.get(index)
        if not isinstance(given, Transform):
            raise TypeMismatch("a precision point", "a transformation is wanted here")
        return given

    def place(self, index: int) -> Transform | Joints:
        return cast("Transform | Joints", self.get(index))

    def definable(self, index: int) -> Definable:
        return cast(Definable, self.get(index))

    def positive(self, index: int, what: str) -> float:
        given = self.real(index)
        if not given > 0.0:
            raise IllegalValue(f"{what} {plain(given)}", "it must be greater than 0")
        return given


Handler = Callable[[Context, Operands], Iterable[Yielded]]

NOTHING: tuple[Yielded, ...] = ()
NOWHERE = Span(0, 0, 0)

# --- motions -----------------------------------------------------------------------------------------------------


def _target(place: Transform | Joints) -> Target:
    return PoseTarget(place) if isinstance(place, Transform) else JointTarget(place)


def _hand_of(opening: float | None) -> float | None:
    """An air hand opens for anything above 0, and for TRUE; otherwise it closes."""
    return None if opening is None else 1.0 if opening > 0.0 or opening == -1.0 else 0.0


def _move(straight: bool) -> Handler:
    def move(_context: Context, it: Operands) -> Iterable[Yielded]:
        hand = _hand_of(it.optional(1))
        return (Move(_target(it.place(0)), straight, hand=hand, stamp=it.stamp, text=it.text),)

    return move


def _back_off(distance: float) -> Transform:
    """So many mm along the tool's -Z."""
    return translation(0.0, 0.0, -distance / 1000.0)


def _approach(straight: bool) -> Handler:
    def approach(_context: Context, it: Operands) -> Iterable[Yielded]:
        pose = compose(it.transform(0), _back_off(it.real(1)))
        return (Move(PoseTarget(pose), straight, stamp=it.stamp, text=it.text),)

    return approach


def _depart(straight: bool) -> Handler:
    def depart(_context: Context, it: Operands) -> Iterable[Yielded]:
        target = ToolOffsetTarget(_back_off(it.real(0)))
        return (Move(target, straight, stamp=it.stamp, text=it.text),)

    return depart


def _drive(context: Context, it: Operands) -> Iterable[Yielded]:
    joint, change, speed = it.real(0), it.real(1), it.optional(2)
    if not 0.5 <= joint < context.robot.dof + 0.5:
        raise IllegalJoint(plain(joint), f"joints are 1 to {context.robot.dof}")
    if speed is not None and not 0.0 < speed <= 100.0:
        raise IllegalValue(f"a speed of {plain(speed)} percent", "more than 0, at most 100")
    target = JointOffsetTarget(whole(joint), context.environment.units.one_read(whole(joint), change))
    fraction = None if speed is None else speed / 100.0
    return (Move(target, False, speed=fraction, stamp=it.stamp, text=it.text),)


def _named(name: str) -> Handler:
    def named(_context: Context, it: Operands) -> Iterable[Yielded]:
        return (Move(NamedTarget(name), False, stamp=it.stamp, text=it.text),)

    return named


def _align(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (Move(AlignedTarget(), True, stamp=it.stamp, text=it.text),)


def _draw(context: Context, it: Operands) -> Iterable[Yielded]:
    target = shift(context.robot.destination(), *(it.real_or(index, 0.0) for index in range(3)))
    return (Move(PoseTarget(target), True, stamp=it.stamp, text=it.text),)


def _delay(_context: Context, it: Operands) -> Iterable[Yielded]:
    seconds = it.real(0)
    if seconds < 0.0:
        raise IllegalValue(f"a delay of {plain(seconds)} seconds", "it must not be negative")
    return (Delay(seconds, it.text),)


def _break(_context: Context, _it: Operands) -> Iterable[Yielded]:
    return (Break(),)


def stamp_of(at: float | None, within: float | None) -> Stamp | None:
    """`AT t` or `IN dt` of a motion. Raises IllegalValue for a time before 0."""
    seconds = within if at is None else at
    if seconds is None:
        return None
    if seconds < 0.0:
        raise IllegalValue(f"{'IN' if at is None else 'AT'} {plain(seconds)}", "times are 0 or more seconds")
    return Stamp(seconds, relative=at is None)


# --- settings of motions -----------------------------------------------------------------------------------------


def _speed(_context: Context, it: Operands) -> Iterable[Yielded]:
    speed = it.positive(0, "a speed of")
    if it.unit == "MONITOR":
        return (SetMonitorSpeed(speed),)
    rotation = None if it.get(1) is None else it.positive(1, "a rotation speed of")
    unit = SpeedUnit.PERCENT if it.unit is None else SpeedUnit(it.unit)
    return (SetSpeed(speed, rotation, unit, it.always),)


def _duration(_context: Context, it: Operands) -> Iterable[Yielded]:
    seconds = it.real(0)
    if seconds < 0.0:
        raise IllegalValue(f"a duration of {plain(seconds)} seconds", "it must not be negative")
    return (SetDuration(seconds, it.always),)


def _acceleration(_context: Context, it: Operands) -> Iterable[Yielded]:
    deceleration = None if it.get(1) is None else it.positive(1, "a deceleration of")
    return (SetAcceleration(it.positive(0, "an acceleration of"), deceleration),)


def _mode(mode: Mode, on: bool) -> Handler:
    def change(_context: Context, it: Operands) -> Iterable[Yielded]:
        tolerance = None if it.get(0) is None else it.positive(0, "a tolerance of")
        return (SetMode(mode, on, it.always, tolerance),)

    return change


def _configuration(flag: Arm | Elbow | Wrist) -> Handler:
    def choose(_context: Context, _it: Operands) -> Iterable[Yielded]:
        return (SetConfiguration(flag),)

    return choose


def _hand(opening: float | None, immediate: bool) -> Handler:
    def operate(_context: Context, it: Operands) -> Iterable[Yielded]:
        return (OperateHand(opening, immediate, it.text),)

    return operate


def _tool(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (SetTool(IDENTITY if it.get(0) is None else it.transform(0)),)


def _base(_context: Context, it: Operands) -> Iterable[Yielded]:
    dx, dy, dz, turn = (it.real_or(index, 0.0) for index in range(4))
    shift = translation(dx / 1000.0, dy / 1000.0, dz / 1000.0)
    return (SetBase(compose(shift, rotation_z(radians(turn)))),)


# --- locations ---------------------------------------------------------------------------------------------------


def _set(_context: Context, it: Operands) -> Iterable[Yielded]:
    it.definable(0).define(cast("Transform | Joints", it.value))
    return NOTHING


def _set_inverse(_context: Context, it: Operands) -> Iterable[Yielded]:
    it.definable(0).define(inverse(cast(Transform, it.value)))
    return NOTHING


def _set_frame(_context: Context, it: Operands) -> Iterable[Yielded]:
    origin, on_x, on_y = (it.transform(index) for index in (1, 2, 3))
    it.definable(0).define(frame(origin, on_x, on_y, origin))
    return NOTHING


def _shift(_context: Context, it: Operands) -> Iterable[Yielded]:
    """The last name of a compound is moved in the frame of those before it, as the numbers of it are."""
    reference = it.definable(0).reference
    T = reference.value()
    if not isinstance(T, Transform):
        raise TypeMismatch(f"{reference.name} is a {kind_of_value(T).value}", "a transformation is wanted")
    reference.assign(shift(T, *(it.real_or(index, 0.0) for index in (1, 2, 3))))
    return NOTHING


def _here(context: Context, it: Operands) -> Iterable[Yielded]:
    target = it.definable(0)
    target.define(context.robot.joints() if target.precision else context.robot.here())
    return NOTHING


def _set_integer(_context: Context, it: Operands) -> Iterable[Yielded]:
    cast(Reference, it.get(0)).assign(float(int(cast(float, it.value))))
    return NOTHING


def _decompose(context: Context, it: Operands) -> Iterable[Yielded]:
    """Elements from the one named on: X, Y, Z, O, A, T of a transformation, or the joints."""
    first = cast(Reference, it.get(0))
    if isinstance(first.key, str | tuple):
        raise TypeMismatch(first.name, "DECOMPOSE wants an element of an array with one index: a[1]")
    for offset, number in enumerate(numbers_of(cast("Transform | Joints", it.value), context.environment.units)):
        first._replace(key=(first.key or 0) + offset).assign(number)
    return NOTHING


def _pack(_context: Context, it: Operands) -> Iterable[Yielded]:
    pack(cast(Reference, it.get(0)), it.real(1), it.real(2), cast(str, it.value))
    return NOTHING


# --- signals and timers ------------------------------------------------------------------------------------------


_SIGNALS_SET = (SignalsSet(),)


def _signal(context: Context, it: Operands) -> Iterable[Yielded]:
    for number in it.arguments:
        if number is not None:
            context.environment.signals.write(cast(float, number))
    return _SIGNALS_SET


def _reset(context: Context, _it: Operands) -> Iterable[Yielded]:
    context.environment.signals.reset()
    return _SIGNALS_SET


def _bits(context: Context, it: Operands) -> Iterable[Yielded]:
    value = integer(cast(float, it.value))
    context.environment.signals.write_bits(it.real(0), it.real_or(1, 1.0), value)
    return _SIGNALS_SET


def _timer(context: Context, it: Operands) -> Iterable[Yielded]:
    context.environment.timers.set(it.real(0), cast(float, it.value), context.robot.time())
    return NOTHING


# --- the terminal ------------------------------------------------------------------------------------------------


def _type(context: Context, it: Operands) -> Iterable[Yielded]:
    items = [cast(TypeItem, item) for item in it.arguments if item is not None]
    return (Type(*encode(items, context.environment.units)),)


def _type_integer(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (Type(*encode([Format("I", 0, None, NOWHERE), it.real(0)])),)


_BETWEEN = re.compile(r"\s*,\s*|\s+")


def _fields(line: str, count: int) -> list[str]:
    """The values of a line, with commas or blanks between; one alone is the whole line."""
    return [line] if count == 1 else _BETWEEN.split(line.strip())


def _entered(field: str, kind: Kind) -> Value | None:
    """A field as the value of a variable; nothing at all is 0; None where it is no number."""
    if kind is Kind.STRING:
        return field
    return read_number(field) if field.strip() else 0.0


def _entries(line: str, kinds: list[Kind]) -> list[Value] | str:
    """The values that a line gives to variables of these kinds, or what is wrong with it."""
    fields = _fields(line, len(kinds))
    if len(fields) > len(kinds):
        return f"*Illegal value* {len(fields)} values where {len(kinds)} are wanted"
    fields += [""] * (len(kinds) - len(fields))
    values = [_entered(field, kind) for field, kind in zip(fields, kinds, strict=True)]
    for field, value in zip(fields, values, strict=True):
        if value is None:
            return f"*Invalid number format* {field.strip()} (a number is wanted, such as -12.5)"
    return [value for value in values if value is not None]


def _prompt(_context: Context, it: Operands) -> Answers:
    """Asks until the line can be read. The answer None stands for an empty line."""
    text = "".join(item for item in it.arguments if isinstance(item, str))
    targets = [item for item in it.arguments if isinstance(item, Reference)]
    values: list[Value] | str = []
    while True:
        answer = yield Prompt(text, len(targets))
        values = _entries(answer or "", [target.cells.kind for target in targets]) if targets else []
        if not isinstance(values, str):
            break
        yield Type(values)
    for target, value in zip(targets, values, strict=True):
        if kind_of_value(value) is not target.cells.kind:
            raise TypeMismatch(target.name, "PROMPT reads reals and strings")
        target.assign(value)


# --- units and files ----------------------------------------------------------------------------------------------


def _attach(_context: Context, it: Operands) -> Answers:
    """The robot where no unit is named. Mode 4: the system chooses one, and tells its number in the variable."""
    asked, device = it.get(0), cast("str | None", it.get(2))
    if checked_mode(it.real_or(1, 0.0)) & CHOOSE:
        yield from _attach_any(asked, device)
        return
    unit = whole(_number_of(asked))
    if device is not None:
        checked_device(device, unit)
    yield AttachRobot() if unit == ROBOT else AttachUnit(checked_unit(unit))


def _attach_any(asked: Operand, device: str | None) -> Answers:
    checked_device(device or "DISK", None)
    if not isinstance(asked, Reference):
        raise IllegalValue("ATTACH mode 4", "it wants a variable for the number: ATTACH (lun, 4)")
    answer = yield AttachUnit(None)
    if answer is None:
        raise UnitNotAttached("no unit is free", "DETACH one")
    asked.assign(float(answer))


def _number_of(unit: Operand) -> float:
    """A unit that is a number, a variable, or left out (the robot)."""
    value = unit.value() if isinstance(unit, Reference) else unit
    return float(ROBOT) if value is None else cast(float, value)


def _detach(_context: Context, it: Operands) -> Iterable[Yielded]:
    unit = whole(it.real_or(0, float(ROBOT)))
    return (Break(), DetachRobot()) if unit == ROBOT else (DetachUnit(checked_unit(unit)),)


def _open(access: Access) -> Handler:
    def open_file(_context: Context, it: Operands) -> Iterable[Yielded]:
        return (OpenFile(checked_disk(it.real(0), access.value), cast(str, it.get(1)), access),)

    return open_file


def _close(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (CloseFile(checked_disk(it.real(0), "FCLOSE")),)


def _delete_file(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (DeleteFile(checked_disk(it.real(0), "FDELETE"), cast(str, it.get(1))),)


def _write(context: Context, it: Operands) -> Iterable[Yielded]:
    items = [cast(TypeItem, item) for item in it.arguments[1:] if item is not None]
    return (WriteRecord(checked_unit(it.real(0)), *encode(items, context.environment.units)),)


def _read(_context: Context, it: Operands) -> Answers:
    """One record, whose values go to the variables: all of them, or none and the unit says why."""
    unit = checked_unit(it.real(0))
    line = yield ReadRecord(unit)
    if line is None:
        return
    targets = [item for item in it.arguments[1:] if isinstance(item, Reference)]
    try:
        values = _record(line, [target.cells.kind for target in targets])
    except VrsError as refused:
        yield RecordRefused(unit, refused.code)
        return
    for target, value in zip(targets, values, strict=True):
        target.assign(value)


def _record(line: str, kinds: list[Kind]) -> list[Value]:
    """A value for each variable; what is left of the line is passed over, but a string that comes last takes it all.

    Raises InvalidNumber where a number is missing or is none, IllegalValue for a string that cannot be stored.
    """
    if kinds == [Kind.STRING]:
        return [storable(line)]
    takes_rest = bool(kinds) and kinds[-1] is Kind.STRING
    fields = _BETWEEN.split(line.strip(), maxsplit=len(kinds) - 1 if takes_rest else 0)
    fields += [""] * (len(kinds) - len(fields))
    return [_field(field, kind) for field, kind in zip(fields, kinds, strict=False)]


def _field(text: str, kind: Kind) -> Value:
    if kind is Kind.STRING:
        return storable(text)
    number = read_number(text)
    if number is None:
        raise InvalidNumber(repr(text))
    return number


# --- switches, parameters and the flow ---------------------------------------------------------------------------


def _nothing(_context: Context, _it: Operands) -> Iterable[Yielded]:
    return NOTHING


def _select(_context: Context, it: Operands) -> Iterable[Yielded]:
    device, number = cast(str, it.get(0)), cast(float, it.value)
    if not "ROBOT".startswith(device) or whole(number) != 1:
        raise IllegalValue(f"SELECT {device} = {plain(number)}", "there is one robot: SELECT ROBOT = 1")
    return NOTHING


def _switches(on: bool) -> Handler:
    def change(_context: Context, it: Operands) -> Iterable[Yielded]:
        return tuple(SetSwitch(cast(str, name), on) for name in it.arguments)

    return change


def _switch(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (SetSwitch(cast(str, it.get(0)), bool(it.value)),)


def _parameter(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (SetParameter(cast(str, it.get(0)), cast("float | str", it.value)),)


# --- reactions -------------------------------------------------------------------------------------------------------


def _react(immediate: bool) -> Handler:
    def react(context: Context, it: Operands) -> Iterable[Yielded]:
        signal, program = checked_signal(it.real(0)), cast(CallProgram, it.get(1))
        context.environment.signals.read(signal)
        context.environment.program(program.name)
        return (Reaction(signal, program.name, checked_priority(it.real_or(2, DEFAULT), 1), immediate),)

    return react


def _react_to_errors(context: Context, it: Operands) -> Iterable[Yielded]:
    program = cast("CallProgram | None", it.get(0))
    if program is not None:
        context.environment.program(program.name)
    return (ReactToErrors(None if program is None else program.name),)


def _ignore(context: Context, it: Operands) -> Iterable[Yielded]:
    signal = checked_signal(it.real(0))
    context.environment.signals.read(signal)
    return (Ignore(signal),)


def _lock(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (Lock(checked_priority(it.real(0), 0)),)


def _run_signal(context: Context, it: Operands) -> Iterable[Yielded]:
    signal = checked_signal(it.real(0))
    context.environment.signals.writable(signal)
    return (RunSignal(signal),)


# --- tasks -----------------------------------------------------------------------------------------------------------

MOST_STEPS = 9999  # that RETURN n leaves out
LAST_TASK = 27  # V+ Language User's Guide: tasks 0 to 27
PROCESS_CONTROL = 1  # the task that the PC commands of VAL-II mean


def checked_task(number: float) -> int:
    """Raises IllegalValue."""
    return integer_between(number, 0, LAST_TASK, "task")


def _start(number: int | None) -> Handler:
    """EXECUTE, whose last operand is the task, or (`number`) PCEXECUTE, which has none."""

    def start(context: Context, it: Operands) -> Iterable[Yielded]:
        call = cast(CallProgram, it.get(0))
        context.environment.program(call.name)
        cycles, step = whole(it.real_or(1, 1.0)), whole(it.real_or(2, 1.0))
        asked = it.optional(3) if number is None else float(number)
        return (StartTask(None if asked is None else checked_task(asked), call, cycles, step),)

    return start


def _control(control: Control) -> Handler:
    def act(_context: Context, it: Operands) -> Iterable[Yielded]:
        return (ControlTask(control, checked_task(it.real_or(0, 0.0))),)

    return act


def _return(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (Return(integer_between(it.real_or(0, 0.0), 0, MOST_STEPS, "a number of steps of")),)


def _wait_event(_context: Context, it: Operands) -> Iterable[Yielded]:
    seconds = it.optional(1)
    if seconds is not None and seconds < 0.0:
        raise IllegalValue(f"a wait of {plain(seconds)} seconds", "it must not be negative")
    return (WaitEvent(it.get(0) is not None or seconds is None, seconds),)


def _set_event(_context: Context, it: Operands) -> Iterable[Yielded]:
    return (SetEvent(checked_task(it.real(0))),)


def _flow(effect: Effect | Request) -> Handler:
    def flow(_context: Context, _it: Operands) -> Iterable[Yielded]:
        return (effect,)

    return flow


# --- the table ---------------------------------------------------------------------------------------------------

MODE_WORDS = {
    "COARSE": (Mode.COARSE, True),
    "FINE": (Mode.COARSE, False),
    "NULL": (Mode.NULLING, True),
    "NONULL": (Mode.NULLING, False),
    "CPON": (Mode.CONTINUOUS_PATH, True),
    "CPOFF": (Mode.CONTINUOUS_PATH, False),
    "INTON": (Mode.INTEGRAL, True),
    "INTOFF": (Mode.INTEGRAL, False),
    "SINGLE": (Mode.SINGLE, True),
    "MULTIPLE": (Mode.SINGLE, False),
    "OVERLAP": (Mode.OVERLAP, True),
    "NOOVERLAP": (Mode.OVERLAP, False),
}

_CONFIGURATIONS: dict[str, Arm | Elbow | Wrist] = {flag.name: flag for flags in (Arm, Elbow, Wrist) for flag in flags}

_HANDS = {"OPEN": 1.0, "CLOSE": 0.0, "RELAX": None}

HANDLERS: Mapping[str, Handler] = {
    "MOVE": _move(straight=False),
    "MOVES": _move(straight=True),
    "MOVET": _move(straight=False),
    "MOVEST": _move(straight=True),
    "APPRO": _approach(straight=False),
    "APPROS": _approach(straight=True),
    "DEPART": _depart(straight=False),
    "DEPARTS": _depart(straight=True),
    "DRIVE": _drive,
    "READY": _named("ready"),
    "GO": _move(straight=False),
    "DRAW": _draw,
    "SHIFT": _shift,
    "INVERSE": _set_inverse,
    "FRAME": _set_frame,
    "SETI": _set_integer,
    "TYPEI": _type_integer,
    "GRASP": _hand(0.0, immediate=True),
    "CALIBRATE": _nothing,
    "SELECT": _select,
    "NEST": _named("nest"),
    "ALIGN": _align,
    "DELAY": _delay,
    "BREAK": _break,
    "SPEED": _speed,
    "DURATION": _duration,
    "ACCEL": _acceleration,
    **{word: _mode(mode, on) for word, (mode, on) in MODE_WORDS.items()},
    **{word: _configuration(flag) for word, flag in _CONFIGURATIONS.items()},
    **{word: _hand(opening, immediate=False) for word, opening in _HANDS.items()},
    **{f"{word}I": _hand(opening, immediate=True) for word, opening in _HANDS.items()},
    "TOOL": _tool,
    "BASE": _base,
    "SET": _set,
    "POINT": _set,
    "HERE": _here,
    "DECOMPOSE": _decompose,
    "SIGNAL": _signal,
    "RESET": _reset,
    "BITS": _bits,
    "TIMER": _timer,
    "PACK": _pack,
    "TYPE": _type,
    "PROMPT": _prompt,
    "ENABLE": _switches(on=True),
    "DISABLE": _switches(on=False),
    "SWITCH": _switch,
    "PARAMETER": _parameter,
    "RETURN": _return,
    "STOP": _flow(Stop()),
    "PAUSE": _flow(Pause()),
    "HALT": _flow(Halt()),
    "BRAKE": _flow(Brake()),
    "REACT": _react(immediate=False),
    "REACTI": _react(immediate=True),
    "REACTE": _react_to_errors,
    "RETURNE": _flow(ReturnFromError()),
    "IGNORE": _ignore,
    "LOCK": _lock,
    "RUNSIG": _run_signal,
    "EXECUTE": _start(None),
    "PCEXECUTE": _start(PROCESS_CONTROL),
    **{control.value: _control(control) for control in Control},
    "ATTACH": _attach,
    "DETACH": _detach,
    **{access.value: _open(access) for access in Access},
    "FCLOSE": _close,
    "FDELETE": _delete_file,
    "READ": _read,
    "WRITE": _write,
    "WAIT.EVENT": _wait_event,
    "SET.EVENT": _set_event,
}
