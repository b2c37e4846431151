"""Define the context that the functions and instructions of a program use: the robot, the task system, variables,
signals, timers and programs; and check operands."""

from __future__ import annotations

from collections import UserDict
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

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

ROBOT_NUMBER = 1  # number of the only robot, for SELECT ROBOT and TASK
TICK = on_grid(0.028)  # [s] trajectory tick of VAL-II; a WAIT is tested, and a busy loop runs, once in this time

# INRANGE returns one bit as the reason why a location cannot be reached: bits 0 to 5 for the limits of joints 1 to 6,
# bit 6 for too close, bit 7 for too far, bits 8 and up for joints 7 and up. (V+ Keyword Reference, INRANGE, names such
# bits; their numbers are our choice.)
TOO_CLOSE_BIT, TOO_FAR_BIT = 1 << 6, 1 << 7
JOINTS_BELOW, BITS_BETWEEN = 6, 2  # number of joints with bits below these two bits, and number of these bits

NO_POWER, PROGRAM_CONTROL = 2, 7  # values of STATE(1), the state of the robot
NEVER_MOVED, MOVING, AT_REST = 0, 1, 2  # values of STATE(2), the motion
COMPUTER_CONTROL = 5  # value of STATE(3), the manual control mode: the last mode in the V+ 12.4 release notes
# constant values of STATE(4), whose bit 3 would be the emergency stop, and of STATE(5), with the meanings that public
# drivers for ROS expect
NO_FLAGS, AUTOMATIC = 0, 1


def speed(engine: Engine, number: int) -> float:
    """Return the value of the function SPEED(number) [%]. Raises IllegalValue for an unknown number."""
    settings = engine.settings
    speeds = (settings.monitor_speed, settings.speed.always.value, settings.speed.present.value)
    if not 1 <= number <= len(speeds):
        raise errors.IllegalValue(f"SPEED({number})", "1 monitor speed, 2 program speed, 3 speed of the next motion")
    return speeds[number - 1]


def state(engine: Engine, number: int) -> float:
    """Return the value of the function STATE(number). Raises IllegalValue for an unknown number."""
    if (tell := STATES.get(number)) is None:
        raise errors.IllegalValue(f"STATE({number})", f"it tells {', '.join(map(str, STATES))}")
    return float(tell(engine))


def in_range(engine: Engine, place: Transform | Joints) -> int:
    """Return 0 if the robot can reach a location or joint position, otherwise one bit that gives the reason."""
    try:
        if isinstance(place, Transform):
            engine.joints_for(place)
        else:
            check_joint_limits(engine.model, place)
    except errors.MotionError as error:
        return _reason(error)
    return 0


def solve(engine: Engine, T_world_tool: Transform, near: Joints, asked: Configuration | None) -> tuple[Joints, int]:
    """Return the joint positions for a pose, and 0; if the pose cannot be reached, joint positions within the limits,
    and one bit that gives the reason. `near`: the joint positions that the solution should be close to; `asked`: the
    configuration, None for the configuration of `near`."""
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
    """Return the bit of INRANGE for an error: the reason why a location cannot be reached."""
    if isinstance(error, errors.JointOutOfRange):
        return 1 << (error.joint - 1 + (BITS_BETWEEN if error.joint > JOINTS_BELOW else 0))
    return TOO_CLOSE_BIT if isinstance(error, errors.LocationTooClose) else TOO_FAR_BIT


def _motion_state(engine: Engine) -> int:
    if engine.position().moving:
        return MOVING
    return AT_REST if len(engine.timeline) > 1 else NEVER_MOVED


def _present_motion(engine: Engine) -> tuple[float, float] | None:
    """Return the start and end times of the current motion [s], or None if the robot is at rest."""
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
    """Return the time until the current motion ends [s]; 0 if the robot is at rest."""
    span = _present_motion(engine)
    return 0.0 if span is None else span[1] - engine.now


def _percent_done(engine: Engine) -> float:
    """Return the elapsed part of the current motion's time [%]; 100 if the robot is at rest."""
    span = _present_motion(engine)
    return 100.0 if span is None else 100.0 * (engine.now - span[0]) / (span[1] - span[0])


# Functions that return STATE(n), by n. Sources: for 1 to 3 the V+ 12.4 release notes; 9 is above 0 during a motion
# because public drivers for ROS expect this; that 9 is in seconds, and the meaning of 10, are from memory of the eV+
# reference.
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
    """The task system that runs programs, as the calling task sees it. This base class is for a program that runs
    alone, as task 0 and without devices."""

    def task(self) -> int:
        """Return the number of the calling task; -1 for a line typed at the prompt."""
        return 0

    def priority(self) -> int:
        return 0

    def run_state(self, task: int) -> int:  # noqa: ARG002 (subclasses use the argument, also below)
        """Return the state of a task as the number that the function TASK(1, n) returns (`operations.IDLE` to
        `operations.PAUSED`)."""
        return 0

    def event(self, task: int) -> bool:  # noqa: ARG002
        """Return whether the event (a flag) of a task is set."""
        return False

    def robot_of(self, task: int) -> int:  # noqa: ARG002
        """Return the number of the robot that a task has attached; 0 for none."""
        return ROBOT_NUMBER

    def take_latch(self) -> bool:
        """Return whether the latch signal has occurred since the last call of this method."""
        return False

    def latch(self) -> tuple[Transform, Joints] | None:
        """Return T_world_tool and the joint positions at the last latch signal; None before the first one."""
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
        """Record that a step with GETC begins, for `put_back`."""

    def put_back(self) -> None:
        """Put back the characters that GETC has read in the current step, because the step will be repeated."""

    def character(self, unit: int, wait: bool) -> int:  # noqa: ARG002
        """Return the code of the next character from a logical unit, or an error code. If there is no character yet and
        `wait` is True, raises LineMissing."""
        return errors.UnitNotAttached.code


# --- timers and programs ---------------------------------------------------------------------------------------------


LAST_TIMER = 15  # highest timer number; the lowest is -15, because V+ also has negative timer numbers


class Timers:
    """The timers -15 to 15, which count seconds of the robot clock. A timer that was never set shows the time of the
    clock."""

    def __init__(self) -> None:
        self._zero: dict[int, float] = {}

    def set(self, number: float, seconds: float, now: float) -> None:
        """Set a timer to `seconds`. `now`: the time of the robot clock [s]. Raises IllegalValue for an unknown timer or
        a time out of range."""
        if not abs(seconds) <= LATEST:
            raise errors.IllegalValue(f"a timer at {plain(seconds)} s", f"it is from {-LATEST:g} to {LATEST:g} s")
        self._zero[self._check_number(number)] = now - seconds

    def read(self, number: float, now: float) -> float:
        """Return the value of a timer [s]. `now`: the time of the robot clock [s]. Raises IllegalValue for an unknown
        timer."""
        return now - self._zero.get(self._check_number(number), 0.0)

    def _check_number(self, number: float) -> int:
        return integer_between(number, -LAST_TIMER, LAST_TIMER, "timer")


class StoredProgram(Struct, frozen=True, eq=False, weakref=True):
    """A program in memory. `lines`: all lines of its file, in one tuple that the programs of the file share."""

    analysis: Analysis
    lines: tuple[str, ...] = ()

    @property
    def program(self) -> Program:
        return self.analysis.program

    @property
    def name(self) -> str:
        return self.program.name

    def source(self, step: int) -> str:
        """Return the text of a step as in the file, or in canonical form if the lines of the file are not known.
        `step`: the index of the step, from 0."""
        if not self.program.steps:
            return ""
        it = self.program.steps[step]
        if 1 <= it.span.line <= len(self.lines):
            return self.lines[it.span.line - 1].strip()
        return "" if it.statement is None else statement_text(it.statement)


# what is bound to a CALL in a program: the Python function that makes the call, and the called Executable (None before
# the first call)
Bound = tuple[Callable[..., int], Any]


def by_task(context: Context, _left: int, _executable: Any, *given: Any) -> int:
    """Record the arguments of a call and return 0, so that the task makes the call. (A direct function has the same
    parameters.)"""
    context.kept[:] = given
    return 0


not_bound = partial(by_task)  # does the same as `by_task`; a distinct object, to recognize calls that are not bound
NOT_BOUND: Bound = (not_bound, None)


class Programs(UserDict[str, StoredProgram]):
    """The programs in a memory, by key. `bound`: the Executables that have a CALL bound to the program that it calls.
    Every change to the programs unbinds all calls, because a CALL may now mean another program."""

    def __init__(self, *programs: Mapping[str, StoredProgram]) -> None:
        self.bound: WeakSet[Any] = WeakSet()  # weak, because each line typed at the prompt has an Executable
        super().__init__(*programs)

    def unbind(self, *binding: Any) -> None:
        """Unbind all calls, so that each call looks up its program again. `binding`: Executables in which the caller
        binds a CALL next."""
        for executable in self.bound:
            executable.calls[:] = [NOT_BOUND] * len(executable.calls)
        self.bound = WeakSet(binding)

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
    """The memory that programs share and that keeps its values between runs. `seed`: the seed of RANDOM; `system`: the
    task system that runs the programs; `last_error`: the code that ERROR returns."""

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
        from random import Random  # imported only when needed, because few programs use RANDOM

        return Random(self._seed)

    def copy(self) -> Memory:
        """Return a copy of the current variables and programs, which other threads can read."""
        copied = Memory(units=self.units)
        copied.take(self)
        copied.programs |= self.programs
        return copied

    def store(self, analysis: Analysis, lines: tuple[str, ...] = ()) -> StoredProgram:
        """Store a program, replacing any program of the same name. `lines`: the lines of its whole file."""
        stored = StoredProgram(analysis, lines)
        free_in_parts(stored.program, stored.program.steps, lines)
        self.programs[analysis.program.key] = stored
        return stored

    def program_by_prefix(self, typed: str) -> StoredProgram:
        """Return the program with the typed name, or the only program whose name begins with it. Raises
        UndefinedName."""
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
        """Return the program with a name. Raises UndefinedName, with a similar name as a hint if there is one."""
        key = name if name in self.programs else key_of(name)
        if key not in self.programs:
            names = {other: stored.name for other, stored in self.programs.items()}
            raise errors.UndefinedName(
                f"program {name}", closest(key, names) or f"{{LOAD {name}}} reads it from {name}.v2"
            )
        return self.programs[key]


class Context(Struct, frozen=True):
    """The objects that the functions and instructions of a task use. `environment`: variables and programs; `engine`:
    the robot; `reactions`: the reactions of the task; `turn`: the number of steps left in the task's time slice and the
    number of the current operation, valid while the program is suspended; `kept`: data that a direct call leaves for
    the task: the arguments of a call to make, or the frames of calls to continue."""

    environment: Memory
    engine: Engine
    reactions: Reactions = field(default_factory=Reactions)
    turn: list[int] = field(default_factory=lambda: [0, 0])
    kept: list[Any] = field(default_factory=list)

    def break_off(self, result: int, left: int, frame: tuple[Any, ...]) -> int:
        """Record the frame of a direct call that the task must continue. Return minus the number of steps left in the
        task's time slice.

        `result`: 0 if the direct function itself stops; negative if a call made by it has recorded a frame and returned
        this negative number. `left`: the number of steps left if `result` is 0.
        """
        if not result:
            self.kept.clear()
        self.kept.append(frame)
        return result or -left

    def task_call(self, name: str, site: int, left: int, result: int) -> CallProgram | BrokenOff:
        """Return the event that makes the task carry out a call (if `result` is 0) or continue it (if `result` is minus
        the number of steps left). `left`: the number of steps left if `result` is 0."""
        kept, self.turn[0] = tuple(self.kept), -result or left
        self.kept.clear()
        return BrokenOff(kept) if result else CallProgram(name, kept, site)

    def reading_begins(self) -> None:
        """Record that a step with GETC begins. If the step has to wait for input, it is repeated later, and must then
        read the same characters again."""
        self.environment.system.begin_reading()

    def observes_at(self, op: int) -> None:
        """Record the operation number `op` for the observer of signals: this operation is about to read signals."""
        self.environment.signals.place = op

    def fold_case(self, text: str) -> str:
        """Return a string in the form used for comparisons: in upper case if the switch UPPER is on."""
        return text.upper() if self.engine.settings.switch("UPPER") else text


class Definable(Struct, frozen=True):
    """A location that an instruction defines. `reference`: the variable to assign, the c in `a:b:c`; `T_world_before`:
    the pose a:b to which c is relative, None for a simple variable."""

    reference: Reference
    T_world_before: Transform | None = None

    def define(self, value: Transform | Joints) -> None:
        """Assign a value, so that the whole compound equals it. Raises TypeMismatch for a precision point in a
        compound, or if the variable is of another kind."""
        if self.T_world_before is None:
            self.reference.assign(value)
        elif isinstance(value, Transform):
            self.reference.assign(compose(inverse(self.T_world_before), value))
        else:
            raise errors.TypeMismatch("a precision point in a compound", "only transformations can be compounded")


class Wording(Struct, frozen=True):
    """The parts of an instruction besides its arguments. `text`: the instruction in canonical form; `value`: the value
    after `=`; `stamp`: the time from AT or IN; `always`, `unit`: the modifiers (ALWAYS; MMPS, IPS or MONITOR)."""

    text: str
    value: Any = None  # a value of the kind that the instruction's row in the word table requires
    stamp: Stamp | None = None
    always: bool = False
    unit: str | None = None


# A function that carries out an instruction. It takes the context, the Wording and the values of the arguments (None
# for an omitted one; omitted ones at the end may be missing), and returns the requests and effects to yield, or None.
Handler = Callable[..., Iterable[Event] | None]


def transform(place: Transform | Joints) -> Transform:
    """Check that a location is a transformation and return it. Raises TypeMismatch for a precision point."""
    if not isinstance(place, Transform):
        raise errors.TypeMismatch("a precision point", "a transformation is wanted here")
    return place


def checked_seconds(what: str, seconds: float) -> float:
    """Check a duration [s] and return it. `what`: its name in the message. Raises IllegalValue if it is negative."""
    if seconds < 0.0:
        raise errors.IllegalValue(f"{what} of {plain(seconds)} seconds", "it must not be negative")
    return seconds


def stamp_of(at: float | None, within: float | None) -> Stamp | None:
    """Return the time stamp of a motion from the value of AT or IN [s], or None if both are None. Raises IllegalValue
    for a negative time."""
    seconds = within if at is None else at
    if seconds is None:
        return None
    if seconds < 0.0:
        raise errors.IllegalValue(f"{'IN' if at is None else 'AT'} {plain(seconds)}", "times are 0 or more seconds")
    return Stamp(seconds, relative=at is None)
