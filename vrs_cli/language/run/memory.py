"""What functions and instructions work on (the robot, the system, variables, signals, timers, programs), and
the operands they are given.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from random import Random
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field

from vrs_cli.errors import IllegalValue, TypeMismatch, UndefinedName
from vrs_cli.kinematics.joints import TURNING, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.language.analysis.result import Analysis
from vrs_cli.language.run.effects import Event, Reactions
from vrs_cli.language.run.robot import System
from vrs_cli.language.run.signals import Signals
from vrs_cli.language.run.variables import Reference, Variables, closest
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.collector import free_in_parts
from vrs_cli.language.text.printer import statement_text
from vrs_cli.language.words.values import integer_between, key_of, plain
from vrs_cli.trajectory.instant import LATEST
from vrs_cli.values.commands import Stamp

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine

LAST_TIMER = 15  # V+ has negative ones, too


class Timers:
    """Timers -15 to 15, in seconds of the robot clock; one never set counts from the start of the clock."""

    def __init__(self) -> None:
        self._zero: dict[int, float] = {}

    def set(self, number: float, seconds: float, now: float) -> None:
        """Set a timer to `seconds`. Raises IllegalValue for a timer that does not exist, or a time out of range."""
        if not abs(seconds) <= LATEST:
            raise IllegalValue(f"a timer at {plain(seconds)} s", f"it is from {-LATEST:g} to {LATEST:g} s")
        self._zero[self._known(number)] = now - seconds

    def read(self, number: float, now: float) -> float:
        """Raises IllegalValue for a timer that does not exist."""
        return now - self._zero.get(self._known(number), 0.0)

    def _known(self, number: float) -> int:
        return integer_between(number, -LAST_TIMER, LAST_TIMER, "timer")


class StoredProgram(Struct, frozen=True, eq=False, weakref=True):
    """A program as it was stored. `lines`: those of its whole file, which all of its programs share."""

    analysis: Analysis
    lines: tuple[str, ...] = ()

    @property
    def program(self) -> Program:
        return self.analysis.program

    @property
    def name(self) -> str:
        return self.program.name

    def source(self, step: int) -> str:
        """The text of a step (counted from 0) as it was read, or in canonical form where it was not."""
        if not self.program.steps:
            return ""
        it = self.program.steps[step]
        if 1 <= it.span.line <= len(self.lines):
            return self.lines[it.span.line - 1].strip()
        return "" if it.statement is None else statement_text(it.statement)


class Memory(Variables):
    """What programs share and keep between runs. The same `seed` gives the same random numbers.

    `system` is who runs the programs.
    """

    def __init__(self, seed: int = 0, units: JointUnits = TURNING) -> None:
        super().__init__(units)
        self.programs: dict[str, StoredProgram] = {}
        self.signals = Signals()
        self.timers = Timers()
        self.random = Random(seed)
        self.last_error = 0
        self.system = System()

    def copy(self) -> Memory:
        """Its variables and programs as they are now, for whoever reads them later, in any thread."""
        copied = Memory(units=self.units)
        copied.take(self)
        copied.programs |= self.programs
        return copied

    def store(self, analysis: Analysis, lines: tuple[str, ...] = ()) -> StoredProgram:
        """Keep a program, in the place of one of the same name. `lines`: those of its whole file."""
        stored = StoredProgram(analysis, lines)
        free_in_parts(stored.program, stored.program.steps, lines)
        self.programs[analysis.program.key] = stored
        return stored

    def meant(self, typed: str) -> StoredProgram:
        """The program of that name, or the one whose name is cut short. Raises UndefinedName."""
        key = key_of(typed)
        begun = [stored for other, stored in self.programs.items() if other.startswith(key)]
        if key in self.programs or not begun:
            return self.program(typed)
        if len(begun) > 1:
            raise UndefinedName(f"program {typed}", f"{', '.join(stored.name for stored in begun)} begin so")
        return begun[0]

    def program(self, name: str) -> StoredProgram:
        """Raises UndefinedName, with a similar name where there is one."""
        key = key_of(name)
        if key not in self.programs:
            names = {other: stored.name for other, stored in self.programs.items()}
            raise UndefinedName(f"program {name}", closest(key, names))
        return self.programs[key]


class Context(Struct, frozen=True):
    """What functions and instructions work on. `reactions`: those of the task."""

    environment: Memory
    engine: Engine
    reactions: Reactions = field(default_factory=Reactions)

    def reading_begins(self) -> None:
        """Call it before a step with GETC: a step that has to wait is done again, and reads the same again."""
        self.environment.system.begin_reading()

    def folded(self, text: str) -> str:
        """A string as comparisons see it: without regard to case while the switch UPPER is on."""
        return text.upper() if self.engine.settings.switch("UPPER") else text


class Definable(Struct, frozen=True):
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


class Wording(Struct, frozen=True):
    """What an instruction has beside its operands. `text`: its canonical form; `value`: what followed `=`."""

    text: str
    value: Any = None  # of the kind that the table of instructions asks for
    stamp: Stamp | None = None
    always: bool = False
    unit: str | None = None


# Carries out an instruction with these operands: None for one that is left out, the last ones may be missing. Returns
# what the driver is to do, or None.
Handler = Callable[..., Iterable[Event] | None]


def transform(place: Transform | Joints) -> Transform:
    """Raises TypeMismatch for a precision point."""
    if not isinstance(place, Transform):
        raise TypeMismatch("a precision point", "a transformation is wanted here")
    return place


def checked_seconds(what: str, seconds: float) -> float:
    """Return a length of time. Raises IllegalValue if it is negative."""
    if seconds < 0.0:
        raise IllegalValue(f"{what} of {plain(seconds)} seconds", "it must not be negative")
    return seconds


def stamp_of(at: float | None, within: float | None) -> Stamp | None:
    """`AT t` or `IN dt` of a motion. Raises IllegalValue for a time before 0."""
    seconds = within if at is None else at
    if seconds is None:
        return None
    if seconds < 0.0:
        raise IllegalValue(f"{'IN' if at is None else 'AT'} {plain(seconds)}", "times are 0 or more seconds")
    return Stamp(seconds, relative=at is None)
