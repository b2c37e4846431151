"""Everything that can go wrong, as one tree, with the texts and codes of VAL-II (V+ numbering).

    VrsError
    ├── ProgramError          a step of a program, or a line at the prompt, cannot be done
    │   ├── UndefinedValue, IllegalValue, IllegalAssignment, IllegalArrayIndex, IllegalSignal, ...
    │   └── StackOverflow
    ├── MotionError           the robot cannot do the motion
    │   ├── PowerOff, TooLate, TooNear, LocationOutOfRange, JointOutOfRange, IllegalJoint
    │   └── StraightLineConfiguration, StraightLineSingular
    ├── PathWithoutJoints     a straight line on the timeline, from a file, leaves the reach
    ├── FileError             a file cannot be read or written
    ├── RequestRefused        a robot does not begin with what it is asked for
    └── UsageError            a command or an option does not exist, or is used in a way it cannot be

The raiser gives what happened (`detail`), what would be right (`hint`), and the numbers behind both; the class holds
VAL-II's text and code. No error is changed after it was made: `reworded` makes another one.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar, Final, Self

Place = tuple[float, float, float]


class VrsError(Exception):
    """A mistake that a user can understand and mend. `str()` is the one message that is shown.

    `value` is what was asked for, `lower` and `upper` are its bounds: of the robot in m and rad, else as the user
    writes them. `joint` counts from 1 (0: no single one). `place`: the tool tip in the robot's frame [m].
    """

    code: ClassVar[int] = -1
    text: ClassVar[str] = "Error"

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
    ) -> None:
        super().__init__(detail, hint)
        self.detail: Final = detail
        self.hint: Final = hint
        self.value: Final = value
        self.lower: Final = lower
        self.upper: Final = upper
        self.joint: Final = joint
        self.place: Final = place

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


class ProgramError(VrsError):
    """A step of a program, or a line at the prompt, cannot be done."""


class UndefinedValue(ProgramError):
    code, text = -401, "Undefined value"


class IllegalValue(ProgramError):
    code, text = -402, "Illegal value"


class IllegalAssignment(ProgramError):
    code, text = -403, "Illegal assignment"


class IllegalArrayIndex(ProgramError):
    code, text = -404, "Illegal array index"


class IllegalSignal(ProgramError):
    code, text = -405, "Illegal digital signal"


class UndefinedName(ProgramError):
    code, text = -406, "Undefined program or variable name"


class ArgumentMismatch(ProgramError):
    code, text = -408, "Program argument mismatch"


class ArithmeticOverflow(ProgramError):
    code, text = -409, "Arithmetic overflow"


class NegativeSquareRoot(ProgramError):
    code, text = -410, "Negative square root"


class StringOverflow(ProgramError):
    """A string of more characters than a variable holds."""

    code, text = -416, "String variable overflow"


class UndefinedLabel(ProgramError):
    code, text = -412, "Branch to undefined label"


class StackOverflow(ProgramError):
    code, text = -413, "Not enough program stack space"


class TypeMismatch(ProgramError):
    code, text = -465, "Variable type mismatch"


class UnknownKeyword(ProgramError):
    code, text = -424, "Unknown keyword"


class CannotInterpret(ProgramError):
    code, text = -450, "Can't interpret line"


class UnknownInstruction(ProgramError):
    code, text = -452, "Unknown instruction"


class NotAvailable(ProgramError):
    """A word of VAL-II or its relatives that is known here, and not carried out."""

    code, text = -453, "Not available"


class InvalidName(ProgramError):
    code, text = -455, "Invalid program or variable name"


class InvalidNumber(ProgramError):
    code, text = -456, "Invalid number format"


class MissingParenthesis(ProgramError):
    code, text = -457, "Missing parenthesis"


class IllegalExpression(ProgramError):
    code, text = -458, "Illegal expression syntax"


class MissingQuote(ProgramError):
    code, text = -460, "Missing quote mark"


class DuplicateLabel(ProgramError):
    code, text = -464, "Duplicate statement label"


class MisplacedDeclaration(ProgramError):
    """AUTO, LOCAL or GLOBAL after a step that does something."""

    code, text = -471, "Misplaced declaration statement"


class ControlStructure(ProgramError):
    code, text = -473, "Control structure error"


class AmbiguousGrouping(ProgramError):
    """A warning: VAL-II's own table of operators groups an expression otherwise."""

    code, text = 56, "Ambiguous grouping"


class OldMeaning(ProgramError):
    """A warning: a form that the first VAL has, and VAL-II reads otherwise."""

    code, text = 58, "Taken as in VAL"


class WordAsName(ProgramError):
    """A warning: a variable whose name a reader could take for a function or an instruction, or the reverse."""

    code, text = 59, "Word as a name"


class UnreachableCode(ProgramError):
    """A warning: nothing leads to a step."""

    code, text = 57, "Unreachable code"


class PauseOfArm(ProgramError):
    """A warning: a DELAY that a reader could take for a pause of the program."""

    code, text = 60, "Pause of the arm"


class WithoutEffect(ProgramError):
    """A warning: a switch or a parameter that means nothing to a virtual robot."""

    code, text = 61, "No effect here"


class NoProgramSpecified(ProgramError):
    code, text = -301, "No program specified"


class ProgramNotExecutable(ProgramError):
    code, text = -307, "Program not executable"


class ProgramInterlocked(ProgramError):
    """A program on the stack of a task cannot be changed or deleted."""

    code, text = -308, "Program interlocked"


class ProgramExists(ProgramError):
    code, text = -309, "Program already exists"


class TaskActive(ProgramError):
    code, text = -310, "Program task already active"


class TaskNotActive(ProgramError):
    code, text = -311, "Program task not active"


class LimitReached(ProgramError):
    """A program was stopped by a limit of its run: time, steps, memory, what it types or writes."""

    code, text = -414, "Program limit reached"


class EndlessWait(LimitReached):
    """A program waits for what nothing can change, in a time that would pass at once. (The code is ours.)"""

    code, text = -419, "Endless wait"


class ClockPaused(ProgramError):
    """Something waits for a clock on the wall that was told to stand."""

    code, text = -415, "Clock is paused"


class EndOfInput(ProgramError):
    """A program asks for a line, and there is no more input."""

    code, text = -504, "Unexpected end of file"


class MotionError(VrsError):
    """The robot cannot do the motion. A straight line fails at its `place`."""

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
        )


class RobotNotAttached(MotionError):
    """Another task has the robot, or none has it and the program did not ask for it."""

    code, text = -602, "Robot not attached to this program"


class AlterNotOn(MotionError):
    """The code is of V+, from memory."""

    code, text = -634, "ALTER mode is not on"


class PowerOff(MotionError):
    code, text = -604, "Robot power off"


class TooLate(MotionError):
    """In real time: what was asked for would change what has happened already. (The code is ours.)"""

    code, text = -690, "Execution time is past"


class TooNear(MotionError):
    """A small step of the tool would be a large one for a joint. (The code is ours.)"""

    code, text = -691, "Too near a singularity"


class StreamIsOver(MotionError):
    """A motion that followed a stream of targets would have to be planned again. (The code is ours.)"""

    code, text = -692, "Stream of targets is over"


class IllegalJoint(MotionError):
    code, text = -609, "Illegal joint number"


class LocationOutOfRange(MotionError):
    """`value`: how far away the location is [m]; the arm reaches from `lower` to `upper`."""

    code, text = -610, "Location out of range"

    @property
    def beyond(self) -> float | None:
        """How much too far the location is, or too close if negative [m]; None where that is not known."""
        bound = self.lower if self.upper is None else self.upper
        return None if self.value is None or bound is None else self.value - bound


class StraightLineConfiguration(MotionError):
    code, text = -612, "Straight-line motion can't alter configuration"


class StraightLineSingular(MotionError):
    """A straight line that passes too near a singularity for the joints to follow."""

    code, text = -613, "Straight-line motion too near a singularity"


class PathWithoutJoints(VrsError):
    """A straight line on the timeline leads where the arm has no joints: no planned one does. (The code is ours.)"""

    code, text = -693, "No joints for a place on a straight line"


class LocationTooFar(LocationOutOfRange):
    code, text = -619, "Location too far"


class LocationTooClose(LocationOutOfRange):
    code, text = -618, "Location too close"


class JointOutOfRange(MotionError):
    """A joint would leave its range."""

    code, text = -1023, "Joint out of range"

    @property
    def title(self) -> str:
        return f"Joint {self.joint} out of range"


class FileError(VrsError):
    """A file cannot be read or written."""

    code, text = -502, "File error"


class NonexistentFile(FileError):
    code, text = -501, "Nonexistent file"


class FileExists(FileError):
    code, text = -500, "File already exists"


class FileDamaged(FileError):
    code, text = -503, "File is not what it should be"


class FileOpened(FileError):
    """A file that somebody writes is nobody else's, and a unit has one file."""

    code, text = -506, "File already opened"


class FileNotOpened(FileError):
    code, text = -513, "File not opened"


class UnitNotAttached(FileError):
    code, text = -516, "Logical unit not attached"


class UnitAttached(FileError):
    """A device that cannot be shared is another task's."""

    code, text = -515, "Device already attached"


class DeviceNotReady(FileError):
    """There is no such device here, or it cannot be had."""

    code, text = -508, "Device not ready"


class NetworkClosed(FileError):
    """Nobody is at the other end, or not any more. (Public V+ programs test this code.)"""

    code, text = -562, "Network connection closed"


class NetworkTimeout(FileError):
    """Nothing has come from the other end for too long. (The code is ours.)"""

    code, text = -559, "Network timeout"


class PortTaken(FileError):
    """Another program listens at that port. (The code is ours.)"""

    code, text = -560, "Network port in use"


class NoDataReceived(FileError):
    """READ or GETC does not wait, and nothing is there."""

    code, text = -526, "No data received"


class LineMissing(NoDataReceived):
    """GETC waits for something to come on the unit `value`: the task asks for it, and does the step again."""


class FileOutside(FileError):
    """A program names a file that is not in the folder it runs in."""

    code, text = -517, "File outside the folder of the run"


class RequestRefused(VrsError):
    """A robot does not begin with what it is asked for. (The code is ours.)"""

    code, text = -390, "Request refused"


class UsageError(VrsError):
    """A command or an option does not exist, or is used in a way it cannot be."""

    code, text = -300, "Illegal monitor command"


class LeaseHeld(UsageError):
    """Somebody else drives the robot, or nobody does. (The code is ours.)"""

    code, text = -694, "Lease is not yours"


class RoleWanted(UsageError):
    """A word needs a role that its sender has not. (The code is ours.)"""

    code, text = -695, "Not in your role"
