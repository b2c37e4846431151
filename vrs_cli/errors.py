"""Everything that can go wrong, as one tree, with the texts and codes of VAL-II (V+ numbering).

    VrsError
    ├── ProgramError          a step of a program, or a line at the prompt, cannot be done
    │   ├── UndefinedValue, IllegalValue, IllegalAssignment, IllegalArrayIndex, IllegalSignal, ...
    │   └── StackOverflow
    ├── MotionError           the robot cannot do the motion
    │   ├── PowerOff, TooLate, TooNear, LocationOutOfRange, JointOutOfRange, IllegalJoint
    │   ├── CollisionAhead
    │   └── StraightLineConfiguration, StraightLineSingular
    ├── PathWithoutJoints     a straight line on the timeline, from a file, leaves the reach
    ├── FileError             a file cannot be read or written
    ├── RequestRefused        a robot does not begin with what it is asked for
    └── UsageError            a command or an option does not exist, or is used in a way it cannot be

The raiser gives what happened (`detail`), what would be right (`hint`), and the numbers behind both; the class holds
VAL-II's text and code. A hint has what may be typed in braces: "{ABORT} stops it" is shown as "ABORT stops it", and to
who calls methods as "abort() stops it" (`METHODS`; a word without a method as `do("CLOCK GO")`). No error is changed
after it was made: `reworded` makes another one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, ClassVar, Final, Self

Place = tuple[float, float, float]
METHODS = {  # of `vrs_cli.api.robot`, for words of the shell or whole commands; `rest`: what stands behind the word
    "ABORT": "abort()",
    "AT": "at={rest}",
    "BRANCH": "branches",
    "COMPARE": "compare({rest})",
    "EXECUTE": "do('EXECUTE name(value)')",
    "EXECUTE name": "execute(name)",
    "IN": "at=now + {rest}",
    "LOAD": "run({rest!r})",
    "MERGE": "merge({rest})",
    "MOVE": "move",
    "REDO": "redo({rest})",
    "RESYNC": "resync()",
    "RESYNC STOP": "resync(stop=True)",
    "UNDO": "undo({rest})",
}
_TYPED = re.compile(r"\{([A-Z][^{}]*)\}")


class VrsError(Exception):
    """A mistake that a user can understand and mend. `str()` is the one message that is shown.

    `value` is what was asked for, `lower` and `upper` are its bounds: of the robot in m and rad, else as the user
    writes them. `joint` counts from 1 (0: no single one). `place`: the tool tip in the robot's frame [m]. `in_python`:
    the hint for who calls methods; empty: it is the same.
    """

    code: ClassVar[int] = -1
    text: ClassVar[str] = "Error"

    def __init_subclass__(cls, *, code: int | None = None, text: str | None = None) -> None:
        """A class without a code or a text of its own has that of its base."""
        if code is not None:
            cls.code = code
        if text is not None:
            cls.text = text

    def __init__(
        self,
        detail: str = "",
        hint: str = "",
        *,
        value: float | None = None,
        lower: float | None = None,
        upper: float | None = None,
        joint: int = 0,
        place: Place | None = None,
        in_python: str = "",
    ) -> None:
        super().__init__(detail, hint)
        self.detail: Final = detail
        self.hint: Final = _TYPED.sub(r"\1", hint)
        self.value: Final = value
        self.lower: Final = lower
        self.upper: Final = upper
        self.joint: Final = joint
        self.place: Final = place
        self.in_python: Final = in_python or (_TYPED.sub(_method, hint) if self.hint != hint else "")

    def reworded(self, detail: str | None = None, hint: str | None = None, place: Place | None = None) -> Self:
        """The same error with another detail, hint or place."""
        return type(self)(
            self.detail if detail is None else detail,
            self.hint if hint is None else hint,
            value=self.value,
            lower=self.lower,
            upper=self.upper,
            joint=self.joint,
            place=self.place if place is None else place,
            in_python="" if hint is not None else self.in_python,
        )

    def for_python(self) -> VrsError:
        """The same error for who calls methods, and types no words of the shell."""
        return self.reworded(hint=self.in_python) if self.in_python else self

    def __str__(self) -> str:
        return sentence(self.title, self.detail, self.hint)

    @property
    def title(self) -> str:
        """What stands between the stars of the message."""
        return self.text

    @property
    def numbers(self) -> dict[str, float | Place]:
        """Those of value, lower, upper, joint and place that are known."""
        told = {"value": self.value, "lower": self.lower, "upper": self.upper, "joint": self.joint or None}
        return {name: number for name, number in {**told, "place": self.place}.items() if number is not None}


def _method(typed: re.Match[str]) -> str:
    first, _, rest = typed[1].partition(" ")
    form = METHODS.get(typed[1]) or METHODS.get(first, "do({typed!r})")
    return form.format(rest=rest, typed=typed[1])


def sentence(title: str, detail: str, hint: str) -> str:
    """`*Unknown instruction* MOVEE (did you mean MOVE?)`."""
    return f"*{title}*{f' {detail}' if detail else ''}{f' ({hint})' if hint else ''}"


def nearest(word: str, known: Iterable[str], least: float = 0.6) -> str:
    """The known word that is most like the one given, "" where none is. `least`: how like it must be, up to 1."""
    from difflib import get_close_matches

    return next(iter(get_close_matches(word, tuple(known), 1, least)), "")


def did_you_mean(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """`did you mean MOVES?`, or another hint where no known word is near."""
    near = nearest(word, known)
    return f"did you mean {near}?" if near else otherwise


@contextmanager
def told_in_python() -> Iterator[None]:
    """Raise errors with hints for who calls methods."""
    try:
        yield
    except VrsError as error:
        raise error.for_python() from None


class ProgramError(VrsError):
    """A step of a program, or a line at the prompt, cannot be done."""


class UndefinedValue(ProgramError, code=-401, text="Undefined value"):
    """A variable without a value is read."""


class IllegalValue(ProgramError, code=-402, text="Illegal value"):
    """A value is outside the range that a word takes."""


class IllegalAssignment(ProgramError, code=-403, text="Illegal assignment"):
    """A value is assigned to something that takes none."""


class IllegalArrayIndex(ProgramError, code=-404, text="Illegal array index"):
    """An index is negative, too large, or one too many."""


class IllegalSignal(ProgramError, code=-405, text="Illegal digital signal"):
    """There is no signal of that number, or it cannot be set."""


class UndefinedName(ProgramError, code=-406, text="Undefined program or variable name"):
    """No program or variable has that name."""


class ArgumentMismatch(ProgramError, code=-408, text="Program argument mismatch"):
    """A program is called with other arguments than it takes."""


class ArithmeticOverflow(ProgramError, code=-409, text="Arithmetic overflow"):
    """A result is too large for a real."""


class NegativeSquareRoot(ProgramError, code=-410, text="Negative square root"):
    """The square root of a negative number."""


class StringOverflow(ProgramError, code=-416, text="String variable overflow"):
    """A string of more characters than a variable holds."""


class UndefinedLabel(ProgramError, code=-412, text="Branch to undefined label"):
    """GOTO names a label that the program does not have."""


class StackOverflow(ProgramError, code=-413, text="Not enough program stack space"):
    """Programs call one another too deeply."""


class TypeMismatch(ProgramError, code=-465, text="Variable type mismatch"):
    """A value of another type is wanted."""


class UnknownKeyword(ProgramError, code=-424, text="Unknown keyword"):
    """A word that stands inside a statement is not known."""


class CannotInterpret(ProgramError, code=-450, text="Can't interpret line"):
    """A line is no statement."""


class UnknownInstruction(ProgramError, code=-452, text="Unknown instruction"):
    """A line begins with an unknown word."""


class NotAvailable(ProgramError, code=-453, text="Not available"):
    """A word of VAL-II or its relatives that is known here, and not carried out."""


class InvalidName(ProgramError, code=-455, text="Invalid program or variable name"):
    """A name breaks the rules for names."""


class InvalidNumber(ProgramError, code=-456, text="Invalid number format"):
    """A number is not written as VAL-II writes numbers."""


class MissingParenthesis(ProgramError, code=-457, text="Missing parenthesis"):
    """A parenthesis is not closed."""


class IllegalExpression(ProgramError, code=-458, text="Illegal expression syntax"):
    """An expression cannot be read."""


class MissingQuote(ProgramError, code=-460, text="Missing quote mark"):
    """A string is not closed."""


class DuplicateLabel(ProgramError, code=-464, text="Duplicate statement label"):
    """Two steps of a program have the same label."""


class MisplacedDeclaration(ProgramError, code=-471, text="Misplaced declaration statement"):
    """AUTO, LOCAL or GLOBAL after a step that does something."""


class ControlStructure(ProgramError, code=-473, text="Control structure error"):
    """IF, CASE, WHILE or another structure is not closed, or is closed twice."""


class AmbiguousGrouping(ProgramError, code=56, text="Ambiguous grouping"):
    """A warning: VAL-II's own table of operators groups an expression otherwise."""


class OldMeaning(ProgramError, code=58, text="Taken as in VAL"):
    """A warning: a form that the first VAL has, and VAL-II reads otherwise."""


class WordAsName(ProgramError, code=59, text="Word as a name"):
    """A warning: a variable whose name a reader could take for a function or an instruction, or the reverse."""


class HiddenStatement(ProgramError, code=62, text="Statement in a comment"):
    """A warning: what stands after a semicolon looks like a second statement of the line, and is a comment."""


class AngleUnit(ProgramError, code=63, text="Angle in degrees"):
    """A warning: an angle that looks like one in radians."""


class LengthUnit(ProgramError, code=65, text="Length in millimetres"):
    """A warning: a place whose coordinates look like metres."""


class TimeUnit(ProgramError, code=67, text="Time in seconds"):
    """A warning: a time that looks like milliseconds."""


class SpeedInPercent(ProgramError, code=69, text="Speed in percent"):
    """A warning: a speed that looks like a fraction of the full one."""


class UnreadStatus(ProgramError, code=68, text="Status of a file not read"):
    """A warning: a program opens a file to be read, and goes on where it is not there."""


class FixedCondition(ProgramError, code=66, text="Condition that never changes"):
    """A warning: the number of a signal where its state is meant, or TRUE compared with 1."""


class AboveFullSpeed(ProgramError, code=64, text="More than full speed"):
    """A warning: a speed or an acceleration above 100 %, of which no more than 100 % is used."""


class UnreachableCode(ProgramError, code=57, text="Unreachable code"):
    """A warning: nothing leads to a step."""


class PauseOfArm(ProgramError, code=60, text="Pause of the arm"):
    """A warning: a DELAY that a reader could take for a pause of the program."""


class WithoutEffect(ProgramError, code=61, text="No effect here"):
    """A warning: a switch or a parameter that means nothing to a virtual robot, or a step that does nothing."""


class NoProgramSpecified(ProgramError, code=-301, text="No program specified"):
    """A command needs the name of a program."""


class ProgramNotExecutable(ProgramError, code=-307, text="Program not executable"):
    """A program has bad lines."""


class ProgramInterlocked(ProgramError, code=-308, text="Program interlocked"):
    """A program on the stack of a task cannot be changed or deleted."""


class ProgramExists(ProgramError, code=-309, text="Program already exists"):
    """A program of that name is in memory."""


class TaskActive(ProgramError, code=-310, text="Program task already active"):
    """A task already executes a program."""


class TaskNotActive(ProgramError, code=-311, text="Program task not active"):
    """A task executes no program."""


class LimitReached(ProgramError, code=-414, text="Program limit reached"):
    """A program was stopped by a limit of its run: time, steps, memory, what it types or writes."""


class EndlessWait(LimitReached, code=-419, text="Endless wait"):
    """A program waits for what nothing can change, in a time that would pass at once. (The code is ours.)"""


class ClockPaused(ProgramError, code=-415, text="Clock is paused"):
    """Something waits for a clock on the wall that was told to stand."""


class EndOfInput(ProgramError, code=-504, text="Unexpected end of file"):
    """A program asks for a line, and there is no more input."""


class MotionError(VrsError):
    """The robot cannot do the motion. A straight line fails at its `place`."""


class RobotNotAttached(MotionError, code=-602, text="Robot not attached to this program"):
    """Another task has the robot, or none has it and the program did not ask for it."""


class AlterNotOn(MotionError, code=-634, text="ALTER mode is not on"):
    """The code is of V+, from memory."""


class PowerOff(MotionError, code=-604, text="Robot power off"):
    """The arm has no power."""


class TooLate(MotionError, code=-690, text="Execution time is past"):
    """In real time: what was asked for would change what has happened already. (The code is ours.)"""


class TooNear(MotionError, code=-691, text="Too near a singularity"):
    """A small step of the tool would be a large one for a joint. (The code is ours.)"""


class CollisionAhead(MotionError, code=-696, text="Collision"):
    """With ENABLE COLLISION: something would touch on the way. `value`: how deep [m], `lower`: how much farther apart
    both would have to be [m], `place`: where, in the world [m]. (The code is ours.)
    """


class StreamIsOver(MotionError, code=-692, text="Stream of targets is over"):
    """A motion that followed a stream of targets would have to be planned again. (The code is ours.)"""


class IllegalJoint(MotionError, code=-609, text="Illegal joint number"):
    """The robot has no joint of that number."""


class LocationOutOfRange(MotionError, code=-610, text="Location out of range"):
    """`value`: how far away the location is [m]; the arm reaches from `lower` to `upper`."""

    @property
    def beyond(self) -> float | None:
        """How much too far the location is, or too close if negative [m]; None where that is not known."""
        bound = self.lower if self.upper is None else self.upper
        return None if self.value is None or bound is None else self.value - bound


class StraightLineConfiguration(MotionError, code=-612, text="Straight-line motion can't alter configuration"):
    """A straight line would end in another configuration."""


class StraightLineSingular(MotionError, code=-613, text="Straight-line motion too near a singularity"):
    """A straight line that passes too near a singularity for the joints to follow."""


class PathWithoutJoints(VrsError, code=-693, text="No joints for a place on a straight line"):
    """A straight line on the timeline leads where the arm has no joints: no planned one does. (The code is ours.)"""


class LocationTooFar(LocationOutOfRange, code=-619, text="Location too far"):
    """A location is beyond the reach of the arm."""


class LocationTooClose(LocationOutOfRange, code=-618, text="Location too close"):
    """A location is too near to the base for the arm."""


class JointOutOfRange(MotionError, code=-1023, text="Joint out of range"):
    """A joint would leave its range."""

    @property
    def title(self) -> str:
        return f"Joint {self.joint} out of range"


class FileError(VrsError, code=-502, text="File error"):
    """A file cannot be read or written."""


class NonexistentFile(FileError, code=-501, text="Nonexistent file"):
    """There is no file of that name."""


class FileExists(FileError, code=-500, text="File already exists"):
    """A file of that name exists."""


class FileDamaged(FileError, code=-503, text="File is not what it should be"):
    """The content of a file is not of its format."""


class FileOpened(FileError, code=-506, text="File already opened"):
    """A file that somebody writes is nobody else's, and a unit has one file."""


class FileNotOpened(FileError, code=-513, text="File not opened"):
    """A unit has no open file."""


class UnitNotAttached(FileError, code=-516, text="Logical unit not attached"):
    """A task uses a logical unit that it has not attached."""


class UnitAttached(FileError, code=-515, text="Device already attached"):
    """A device that cannot be shared is another task's."""


class DeviceNotReady(FileError, code=-508, text="Device not ready"):
    """There is no such device here, or it cannot be had."""


class NetworkClosed(FileError, code=-562, text="Network connection closed"):
    """Nobody is at the other end, or not any more. (Public V+ programs test this code.)"""


class NetworkTimeout(FileError, code=-559, text="Network timeout"):
    """Nothing has come from the other end for too long. (The code is ours.)"""


class PortTaken(FileError, code=-560, text="Network port in use"):
    """Another program listens at that port. (The code is ours.)"""


class NoDataReceived(FileError, code=-526, text="No data received"):
    """READ or GETC does not wait, and nothing is there."""


class LineMissing(NoDataReceived):
    """GETC waits for something to come on the unit `value`: the task asks for it, and does the step again."""


class FileOutside(FileError, code=-517, text="File outside the folder of the run"):
    """A program names a file that is not in the folder it runs in."""


class RequestRefused(VrsError, code=-390, text="Request refused"):
    """A robot does not begin with what it is asked for. (The code is ours.)"""


class UsageError(VrsError, code=-300, text="Illegal monitor command"):
    """A command or an option does not exist, or is used in a way it cannot be."""

    def for_python(self) -> VrsError:
        if type(self) is not UsageError:
            return super().for_python()
        numbers: dict[str, Any] = self.numbers
        return NotPossible(self.detail, self.in_python or self.hint, **numbers)


class NotPossible(UsageError, code=-395, text="Not possible"):
    """A method is used in a way it cannot be, or not now. (The code is ours.)"""


class LeaseHeld(UsageError, code=-694, text="Lease is not yours"):
    """Somebody else drives the robot, or nobody does. (The code is ours.)"""


class RoleWanted(UsageError, code=-695, text="Not in your role"):
    """A word needs a role that its sender has not. (The code is ours.)"""
