"""Define the context in which functions and instructions run (the robot, the system, variables, signals, timers,
programs), and check their operands."""

from __future__ import annotations

from collections import UserDict
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field

from vrs_cli import errors
from vrs_cli.engine.targets import check_joint_limits
from vrs_cli.kinematics.joints import TURNING, Configuration, Joints, JointUnits, put_inside
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.language.analysis.names import Analysis
from vrs_cli.language.run.effects import BrokenOff, CallProgram, Event, Reactions
from vrs_cli.language.run.signals import Signals
from vrs_cli.language.run.variables import Reference, Variables, closest
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.collector import free_in_parts
from vrs_cli.language.text.printer import statement_text
from vrs_cli.language.words.values import integer_between, key_of, plain
from vrs_cli.trajectory.instant import LATEST, on_grid
from vrs_cli.values.commands import Stamp

if TYPE_CHECKING:
    from random import Random

    from vrs_cli.engine.engine import Engine

ROBOT_NUMBER = 1  # SELECT ROBOT: the number of the only robot
TICK = on_grid(0.028)  # [s] trajectory tick of VAL-II: the interval between tests of a WAIT or passes of a busy loop

# INRANGE returns as bits why a location cannot be reached: joints 1 to 6, then too close, too far, then joints 7 and
# up. (V+ Keyword Reference, INRANGE, names such bits; the numbers are ours.)
TOO_CLOSE_BIT, TOO_FAR_BIT = 1 << 6, 1 << 7
JOINTS_BELOW, BITS_BETWEEN = 6, 2

NO_POWER, PROGRAM_CONTROL = 2, 7  # values of STATE(1)
NEVER_MOVED, MOVING, AT_REST = 0, 1, 2  # values of STATE(2)
COMPUTER_CONTROL = 5  # value of STATE(3): the last of the modes that the V+ 12.4 release notes list
# values of STATE(4), whose bit 3 is the emergency stop, and of STATE(5), as drivers for ROS read them
NO_FLAGS, AUTOMATIC = 0, 1


def speed(engine: Engine, number: int) -> float:
    """Return the speed that SPEED(number) gives [%]. Raises IllegalValue."""
    settings = engine.settings
    speeds = (settings.monitor_speed, settings.speed.always.value, settings.speed.present.value)
    if not 1 <= number <= len(speeds):
        raise errors.IllegalValue(f"SPEED({number})", "1 monitor speed, 2 program speed, 3 speed of the next motion")
    return speeds[number - 1]


def state(engine: Engine, number: int) -> float:
    """Return the state that STATE(number) gives. Raises IllegalValue."""
    if (tell := STATES.get(number)) is None:
        raise errors.IllegalValue(f"STATE({number})", f"it tells {', '.join(map(str, STATES))}")
    return float(tell(engine))


def in_range(engine: Engine, place: Transform | Joints) -> int:
    """Return 0 if a location or a joint position can be reached, otherwise the reason as a bit."""
    try:
        if isinstance(place, Transform):
            engine.joints_for(place)
        else:
            check_joint_limits(engine.model, place)
    except errors.MotionError as error:
        return _reason(error)
    return 0


def solve(engine: Engine, T_world_tool: Transform, near: Joints, asked: Configuration | None) -> tuple[Joints, int]:
    """Return the joints of a pose, put inside their ranges, and 0 or a bit with the reason why the pose cannot be
    reached. `asked`: the configuration, None for that of `near`."""
    way = engine.arm.configuration(near) if asked is None else asked
    try:
        return engine.joints_for(T_world_tool, near, way), 0
    except errors.JointOutOfRange as error:
        T_robot_flange = compose(compose(engine.frames.base, T_world_tool), inverse(engine.frames.tool))
        found = engine.arm.branch_joints(T_robot_flange, way, near) or near
        return put_inside(found, engine.model.lower, engine.model.upper), _reason(error)
    except errors.MotionError as error:
        return near, _reason(error)


def _reason(error: errors.MotionError) -> int:
    """Return the reason why a location cannot be reached, as a bit."""
    if isinstance(error, errors.JointOutOfRange):
        return 1 << (error.joint - 1 + (BITS_BETWEEN if error.joint > JOINTS_BELOW else 0))
    return TOO_CLOSE_BIT if isinstance(error, errors.LocationTooClose) else TOO_FAR_BIT


def _motion_state(engine: Engine) -> int:
    if engine.position().moving:
        return MOVING
    return AT_REST if len(engine.timeline) > 1 else NEVER_MOVED


def _present_motion(engine: Engine) -> tuple[float, float] | None:
    """Return the start and end of the present motion [s], or None if the robot is at rest."""
    if not engine.position().moving:
        return None
    timeline = engine.timeline
    first = last = timeline.index_at(engine.now)
    number = timeline[first].motion.number
    while first and timeline[first - 1].motion.number == number:
        first -= 1
    while last + 1 < len(timeline) and timeline[last + 1].motion.number == number:
        last += 1
    return timeline[first].start, timeline[last].finish


def _time_left(engine: Engine) -> float:
    """Return the time until the present motion ends [s]; 0 if the robot is at rest."""
    span = _present_motion(engine)
    return 0.0 if span is None else span[1] - engine.now


def _percent_done(engine: Engine) -> float:
    """Return the completed part of the present motion [%]; 100 if the robot is at rest."""
    span = _present_motion(engine)
    return 100.0 if span is None else 100.0 * (engine.now - span[0]) / (span[1] - span[0])


# The functions of STATE, by its argument. 1 to 3: V+ 12.4 release notes. 9 is above 0 during motion, as drivers for ROS
# expect. That 9 counts seconds, and the meaning of 10, are from memory of the eV+ reference.
STATES: Mapping[int, Callable[[Engine], float]] = {
    1: lambda engine: PROGRAM_CONTROL if engine.settings.switch("POWER") else NO_POWER,
    2: _motion_state,
    3: lambda _engine: COMPUTER_CONTROL,
    4: lambda _engine: NO_FLAGS,
    5: lambda _engine: AUTOMATIC,
    9: _time_left,
    10: _percent_done,
}


# --- the system --------------------------------------------------------------------------------------------------


class System:
    """The system that runs programs, as the calling task sees it. This base class is for a program that runs alone:
    one task and no devices."""

    def task(self) -> int:
        """Return the number of the task; -1 for a line of the prompt."""
        return 0

    def priority(self) -> int:
        return 0

    def run_state(self, task: int) -> int:  # noqa: ARG002 (subclasses use the argument, also below)
        """Return the state of a task (`operations.IDLE` and the like)."""
        return 0

    def event(self, task: int) -> bool:  # noqa: ARG002
        """Return whether the event of a task is set."""
        return False

    def robot_of(self, task: int) -> int:  # noqa: ARG002
        """Return the number of the robot that a task has attached; 0 for none."""
        return ROBOT_NUMBER

    def take_latch(self) -> bool:
        """Return whether the latch signal has occurred since the last call."""
        return False

    def latch(self) -> tuple[Transform, Joints] | None:
        """Return T_world_tool and the joints at the last latch signal; None before the first one."""
        return None

    def program_status(self, name: str) -> int:  # noqa: ARG002
        return 0

    def identity(self, component: int) -> float:  # noqa: ARG002
        """Return the value of the V+ function ID for a component. Raises IllegalValue for an unknown component."""
        return 0.0

    def unit_status(self, unit: int) -> int:  # noqa: ARG002
        """Return the status of the last operation on a logical unit: 1 for success, or an error code."""
        return errors.UnitNotAttached.code

    def record_length(self, unit: int) -> int:  # noqa: ARG002
        """Return the number of characters in the last record of a logical unit."""
        return 0

    def connection(self, unit: int) -> int | None:  # noqa: ARG002
        """Return the connection handle of the last READ of a logical unit; None if the unit has no connections."""
        return None

    def begin_reading(self) -> None:
        """Record that a step with GETC begins."""

    def put_back(self) -> None:
        """Put back the characters that the present step has read, because the step will be repeated."""

    def character(self, unit: int, wait: bool) -> int:  # noqa: ARG002
        """Return the code of the next character of a logical unit, or an error code. Raises LineMissing if no line has
        arrived."""
        return errors.UnitNotAttached.code


# --- timers and programs ---------------------------------------------------------------------------------------------


LAST_TIMER = 15  # highest timer number; V+ also has timers with negative numbers


class Timers:
    """Timers -15 to 15, in seconds of the robot clock. A timer that is not set counts from the start of the clock."""

    def __init__(self) -> None:
        self._zero: dict[int, float] = {}

    def set(self, number: float, seconds: float, now: float) -> None:
        """Set a timer to `seconds`. Raises IllegalValue for an unknown timer or a time out of range."""
        if not abs(seconds) <= LATEST:
            raise errors.IllegalValue(f"a timer at {plain(seconds)} s", f"it is from {-LATEST:g} to {LATEST:g} s")
        self._zero[self._check_number(number)] = now - seconds

    def read(self, number: float, now: float) -> float:
        """Return the time of a timer [s]. Raises IllegalValue for an unknown timer."""
        return now - self._zero.get(self._check_number(number), 0.0)

    def _check_number(self, number: float) -> int:
        return integer_between(number, -LAST_TIMER, LAST_TIMER, "timer")


class StoredProgram(Struct, frozen=True, eq=False, weakref=True):
    """A program in memory. `lines`: the lines of its file, which all programs of the file share."""

    analysis: Analysis
    lines: tuple[str, ...] = ()

    @property
    def program(self) -> Program:
        return self.analysis.program

    @property
    def name(self) -> str:
        return self.program.name

    def source(self, step: int) -> str:
        """Return the text of a step (counted from 0) as it was read; without the file's lines, in canonical form."""
        if not self.program.steps:
            return ""
        it = self.program.steps[step]
        if 1 <= it.span.line <= len(self.lines):
            return self.lines[it.span.line - 1].strip()
        return "" if it.statement is None else statement_text(it.statement)


# a function that makes a call, and the called executable (None while it is unknown)
Bound = tuple[Callable[..., int], Any]


def by_task(context: Context, _left: int, _executable: Any, *given: Any) -> int:
    """Let the task make a call: record the arguments, and return 0."""
    context.kept[:] = given
    return 0


not_bound = partial(by_task)  # `by_task` as a distinct object, which marks a call that is not bound yet
NOT_BOUND: Bound = (not_bound, None)


class Programs(UserDict[str, StoredProgram]):
    """The programs of a memory, by key. `bound`: lists of calls that are bound to programs. Every change to the
    programs unbinds all calls."""

    def __init__(self, *programs: Mapping[str, StoredProgram]) -> None:
        self.bound: list[list[Bound]] = []
        super().__init__(*programs)

    def unbind(self) -> None:
        """Forget the programs that are bound to calls, so that every call looks up its program again."""
        for calls in self.bound:
            calls[:] = [NOT_BOUND] * len(calls)
        self.bound.clear()

    def __setitem__(self, key: str, stored: StoredProgram) -> None:
        self.unbind()
        super().__setitem__(key, stored)

    def __delitem__(self, key: str) -> None:
        self.unbind()
        super().__delitem__(key)

    def __ior__(self, other: Mapping[str, StoredProgram]) -> Programs:  # type: ignore[override, misc]
        self.update(other)
        return self


class Memory(Variables):
    """The memory that programs share and keep between runs. Equal values of `seed` give equal random numbers. `system`:
    the system that runs the programs."""

    def __init__(self, seed: int = 0, units: JointUnits = TURNING) -> None:
        super().__init__(units)
        self.programs = Programs()
        self.signals = Signals()
        self.timers = Timers()
        self._seed = seed
        self.last_error = 0
        self.system = System()

    @cached_property
    def random(self) -> Random:
        from random import Random  # imported here, because few programs use it

        return Random(self._seed)

    def copy(self) -> Memory:
        """Copy the present variables and programs, for readers in any thread."""
        copied = Memory(units=self.units)
        copied.take(self)
        copied.programs |= self.programs
        return copied

    def store(self, analysis: Analysis, lines: tuple[str, ...] = ()) -> StoredProgram:
        """Store a program; it replaces one of the same name. `lines`: the lines of its whole file."""
        stored = StoredProgram(analysis, lines)
        free_in_parts(stored.program, stored.program.steps, lines)
        self.programs[analysis.program.key] = stored
        return stored

    def meant(self, typed: str) -> StoredProgram:
        """Return the program with a name, or the program whose name it abbreviates. Raises UndefinedName."""
        key = key_of(typed)
        begun = [stored for other, stored in self.programs.items() if other.startswith(key)]
        if not begun:
            names = {other: stored.name for other, stored in self.programs.items()}
            raise errors.UndefinedName(
                f"program {typed}",
                closest(key, names) or f"{{LOAD {typed}}} reads it from {typed.removesuffix('.v2')}.v2",
            )
        if key in self.programs:
            return self.programs[key]
        if len(begun) > 1:
            raise errors.UndefinedName(f"program {typed}", f"{', '.join(stored.name for stored in begun)} begin so")
        return begun[0]

    def program(self, name: str) -> StoredProgram:
        """Return the program with a name. Raises UndefinedName, with a similar name as a hint."""
        key = name if name in self.programs else key_of(name)
        if key not in self.programs:
            names = {other: stored.name for other, stored in self.programs.items()}
            raise errors.UndefinedName(
                f"program {name}", closest(key, names) or f"{{LOAD {name}}} reads it from {name}.v2"
            )
        return self.programs[key]


class Context(Struct, frozen=True):
    """The context of functions and instructions. `reactions`: the reactions of the task. `turn`: the steps left in the
    task's turn, and the present operation, while its programs are suspended. `kept`: the arguments of a call that the
    task must make, or the frames of a call that it must continue."""

    environment: Memory
    engine: Engine
    reactions: Reactions = field(default_factory=Reactions)
    turn: list[int] = field(default_factory=lambda: [0, 0])
    kept: list[Any] = field(default_factory=list)

    def break_off(self, result: int, left: int, frame: tuple[Any, ...]) -> int:
        """Record the frame of a direct call that the task must continue. Return minus the steps left in the turn.

        `result`: the result of a call that the program has made; it is negative if that call has recorded a frame.
        `left`: the steps left in the turn if `result` is 0.
        """
        if not result:
            self.kept.clear()
        self.kept.append(frame)
        return result or -left

    def task_call(self, name: str, site: int, left: int, result: int) -> CallProgram | BrokenOff:
        """Return the event that makes the task carry out, or continue, a call. `result`: what the call returned, 0 or
        negative."""
        kept, self.turn[0] = tuple(self.kept), -result or left
        self.kept.clear()
        return BrokenOff(kept) if result else CallProgram(name, kept, site)

    def reading_begins(self) -> None:
        """Record that a step with GETC begins. If the step has to wait, it is repeated and reads the same characters
        again."""
        self.environment.system.begin_reading()

    def observes_at(self, op: int) -> None:
        """Record which operation will read signals next."""
        self.environment.signals.place = op

    def fold_case(self, text: str) -> str:
        """Return a string as comparisons use it: in upper case while the switch UPPER is on."""
        return text.upper() if self.engine.settings.switch("UPPER") else text


class Definable(Struct, frozen=True):
    """A location that an instruction defines: a variable, relative to the product of the names before it in `a:b:c`."""

    reference: Reference
    T_world_before: Transform | None = None

    def define(self, value: Transform | Joints) -> None:
        """Assign the location. Raises TypeMismatch for a precision point in a compound, and for a name of another
        kind."""
        if self.T_world_before is None:
            self.reference.assign(value)
        elif isinstance(value, Transform):
            self.reference.assign(compose(inverse(self.T_world_before), value))
        else:
            raise errors.TypeMismatch("a precision point in a compound", "only transformations can be compounded")


class Wording(Struct, frozen=True):
    """The parts of an instruction besides its operands. `text`: the instruction in canonical form; `value`: the value
    after `=`."""

    text: str
    value: Any = None  # its kind is the one that the table of instructions requires
    stamp: Stamp | None = None
    always: bool = False
    unit: str | None = None


# A function that carries out an instruction. It takes these operands (None for an omitted one; the last ones may be
# missing) and returns the requests and effects for the driver, or None.
Handler = Callable[..., Iterable[Event] | None]


def transform(place: Transform | Joints) -> Transform:
    """Return a value that is a transformation. Raises TypeMismatch for a precision point."""
    if not isinstance(place, Transform):
        raise errors.TypeMismatch("a precision point", "a transformation is wanted here")
    return place


def checked_seconds(what: str, seconds: float) -> float:
    """Return a duration. Raises IllegalValue if it is negative."""
    if seconds < 0.0:
        raise errors.IllegalValue(f"{what} of {plain(seconds)} seconds", "it must not be negative")
    return seconds


def stamp_of(at: float | None, within: float | None) -> Stamp | None:
    """Return the time stamp of a motion from `AT t` or `IN dt`. Raises IllegalValue for a negative time."""
    seconds = within if at is None else at
    if seconds is None:
        return None
    if seconds < 0.0:
        raise errors.IllegalValue(f"{'IN' if at is None else 'AT'} {plain(seconds)}", "times are 0 or more seconds")
    return Stamp(seconds, relative=at is None)
