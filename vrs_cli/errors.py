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
    └── UsageError            a command or an option does not exist, or is used in a way it cannot be

The raiser gives what happened (`detail`) and what would be right (`hint`); the class holds VAL-II's text and code.
"""

from __future__ import annotations

from typing import ClassVar, Self


class VrsError(Exception):
    """A mistake that a user can understand and mend. `str()` is the one message that is shown."""

    code: ClassVar[int] = -1
    text: ClassVar[str] = "Error"

    def __init__(self, detail: str = "", hint: str = "") -> None:
        super().__init__(detail, hint)
        self.detail = detail
        self.hint = hint

    def __str__(self) -> str:
        tail = f" {self.detail}" if self.detail else ""
        hint = f" ({self.hint})" if self.hint else ""
        return f"*{self.text}*{tail}{hint}"


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


class ClockPaused(ProgramError):
    """Something waits for a clock on the wall that was told to stand."""

    code, text = -415, "Clock is paused"


class EndOfInput(ProgramError):
    """A program asks for a line, and there is no more input."""

    code, text = -504, "Unexpected end of file"


class MotionError(VrsError):
    """The robot cannot do the motion. `place`: where on a straight line, the tool tip in the robot's frame [m]."""

    place: tuple[float, float, float] | None = None

    def at(self, x: float, y: float, z: float) -> Self:
        """The same error, with its place."""
        self.place = x, y, z
        return self


class RobotNotAttached(MotionError):
    """Another task has the robot, or none has it and the program did not ask for it."""

    code, text = -602, "Robot not attached to this program"


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
    """`by`: how much nearer, or farther away, the location would have to be [m]; None where that is not known."""

    code, text = -610, "Location out of range"

    def __init__(self, detail: str = "", hint: str = "", by: float | None = None) -> None:
        super().__init__(detail, hint)
        self.by = by


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
    """A joint would leave its range. `joint` counts from 1."""

    code = -1023

    def __init__(self, joint: int, detail: str = "", hint: str = "") -> None:
        super().__init__(detail, hint)
        self.joint = joint

    def __str__(self) -> str:
        tail = f" {self.detail}" if self.detail else ""
        hint = f" ({self.hint})" if self.hint else ""
        return f"*Joint {self.joint} out of range*{tail}{hint}"


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


class NoDataReceived(FileError):
    """GETC does not wait, and nothing is there."""

    code, text = -526, "No data received"


class FileOutside(FileError):
    """A program names a file that is not in the folder it runs in."""

    code, text = -517, "File outside the folder of the run"


class UsageError(VrsError):
    """A command or an option does not exist, or is used in a way it cannot be."""

    code, text = -300, "Illegal monitor command"
