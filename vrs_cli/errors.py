"""The errors of vrs as one tree, with the texts and codes of VAL-II (V+ numbering).

    VrsError
    ├── ProgramError          a step of a program, or a line at the prompt, cannot be carried out
    │   ├── UndefinedValue, IllegalValue, IllegalAssignment, IllegalArrayIndex, IllegalSignal, ...
    │   └── StackOverflow
    ├── MotionError           the robot cannot do the motion
    │   ├── PowerOff, TooLate, TooNear, LocationOutOfRange, JointOutOfRange, IllegalJoint
    │   ├── CollisionAhead
    │   └── StraightLineConfiguration, StraightLineSingular
    ├── PathWithoutJoints     a straight line in a loaded trajectory leaves the arm's reach
    ├── FileError             a file cannot be read or written
    ├── RequestRefused        a robot refuses to begin a request
    └── UsageError            a command or an option does not exist, or is used wrongly

The code that raises an error gives the facts (`detail`), a correction (`hint`), and the numbers in both. The class has
VAL-II's text and code. In a hint, braces enclose a command to type: "{ABORT} stops it" is shown as "ABORT stops it" in
the shell, and as "abort() stops it" in Python (see `METHODS`; a command without a method is shown as `do("CLOCK GO")`).
Errors are immutable: `reworded` makes a new error.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, ClassVar, Final, Self

Place = tuple[float, float, float]
METHODS = {  # the method of `vrs_cli.api.robot` for each word or whole command; `rest`: the text after the word
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
_TYPED = r"\{([A-Z][^{}]*)\}"


class VrsError(Exception):
    """An error that a user can understand and correct. `str()` returns the whole message.

    `value` is the wanted value, `lower` and `upper` are its bounds: in m and rad for lengths and angles of the robot,
    otherwise in the user's units. `joint`: the number of the joint, from 1 (0: not about a single joint). `place`: the
    position of the tool tip in the robot's frame [m]. `in_python`: the hint for callers of methods; empty if it equals
    `hint`.
    """

    code: ClassVar[int] = -1
    text: ClassVar[str] = "Error"

    def __init_subclass__(cls, *, code: int | None = None, text: str | None = None) -> None:
        """Set the code and the text of a subclass; by default they are the code and the text of its base class."""
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
        self.hint: Final = re.sub(_TYPED, r"\1", hint)
        self.value: Final = value
        self.lower: Final = lower
        self.upper: Final = upper
        self.joint: Final = joint
        self.place: Final = place
        self.in_python: Final = in_python or (re.sub(_TYPED, _method, hint) if self.hint != hint else "")

    def reworded(self, detail: str | None = None, hint: str | None = None, place: Place | None = None) -> Self:
        """Return a copy of this error with another detail, hint or place."""
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
        """Return this error with the hint for callers of methods, which names methods instead of shell commands."""
        return self.reworded(hint=self.in_python) if self.in_python else self

    def __str__(self) -> str:
        return sentence(self.title, self.detail, self.hint)

    @property
    def title(self) -> str:
        """Return the part of the message between the asterisks."""
        return self.text

    @property
    def numbers(self) -> dict[str, float | Place]:
        """Return those of `value`, `lower`, `upper`, `joint` and `place` that are known, by name."""
        given = {name: getattr(self, name) for name in ("value", "lower", "upper", "joint", "place")}
        return {name: number for name, number in given.items() if number is not None and (name, number) != ("joint", 0)}


def _method(typed: re.Match[str]) -> str:
    first, _, rest = typed[1].partition(" ")
    form = METHODS.get(typed[1]) or METHODS.get(first, "do({typed!r})")
    return form.format(rest=rest, typed=typed[1])


def sentence(title: str, detail: str, hint: str) -> str:
    """Return the sentence of a message: `*Unknown instruction* MOVEE (did you mean MOVE?)`."""
    return f"*{title}*{f' {detail}' if detail else ''}{f' ({hint})' if hint else ''}"


def nearest(word: str, known: Iterable[str], least: float = 0.6) -> str:
    """Return the known word that is most similar to `word`, or "". Case and the dashes before an option do not count.
    `least`: the minimum similarity, 0 to 1."""
    from difflib import get_close_matches

    names = {name.lower().lstrip("-"): name for name in known}
    return next((names[found] for found in get_close_matches(word.lower().lstrip("-"), names, 1, least)), "")


def did_you_mean(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return the hint `did you mean MOVES?`, or `otherwise` if no known word is similar."""
    return f"did you mean {near}?" if (near := nearest(word, known)) else otherwise


@contextmanager
def hints_for_python() -> Iterator[None]:
    """Give errors raised in the `with` block their hints for callers of Python methods (`in_python`)."""
    try:
        yield
    except VrsError as error:
        raise error.for_python() from None


class ProgramError(VrsError):
    """A step of a program, or a line at the prompt, cannot be carried out."""


class UndefinedValue(ProgramError, code=-401, text="Undefined value"):
    """A variable is read before it has a value."""


class IllegalValue(ProgramError, code=-402, text="Illegal value"):
    """A value is outside the range that an instruction accepts."""


class IllegalAssignment(ProgramError, code=-403, text="Illegal assignment"):
    """A value is assigned to an expression that is not a variable."""


class IllegalArrayIndex(ProgramError, code=-404, text="Illegal array index"):
    """An index is negative or too large, or there are too many indexes."""


class IllegalSignal(ProgramError, code=-405, text="Illegal digital signal"):
    """There is no signal with that number, or the signal cannot be set."""


class UndefinedName(ProgramError, code=-406, text="Undefined program or variable name"):
    """No program or variable has that name."""


class ArgumentMismatch(ProgramError, code=-408, text="Program argument mismatch"):
    """A program is called with arguments that do not match its parameters."""


class ArithmeticOverflow(ProgramError, code=-409, text="Arithmetic overflow"):
    """A result is too large for a real."""


class NegativeSquareRoot(ProgramError, code=-410, text="Negative square root"):
    """The argument of a square root is negative."""


class StringOverflow(ProgramError, code=-416, text="String variable overflow"):
    """A string has more characters than a string variable can hold."""


class UndefinedLabel(ProgramError, code=-412, text="Branch to undefined label"):
    """GOTO names a label that the program does not have."""


class StackOverflow(ProgramError, code=-413, text="Not enough program stack space"):
    """Programs call one another too deeply."""


class TypeMismatch(ProgramError, code=-465, text="Variable type mismatch"):
    """A value does not have the required type."""


class UnknownKeyword(ProgramError, code=-424, text="Unknown keyword"):
    """A word inside a statement is unknown."""


class CannotInterpret(ProgramError, code=-450, text="Can't interpret line"):
    """A line cannot be read as a statement."""


class UnknownInstruction(ProgramError, code=-452, text="Unknown instruction"):
    """A line begins with an unknown word."""


class NotAvailable(ProgramError, code=-453, text="Not available"):
    """A word of VAL-II or a related language that vrs knows but cannot execute."""


class InvalidName(ProgramError, code=-455, text="Invalid program or variable name"):
    """A name breaks the rules for names."""


class InvalidNumber(ProgramError, code=-456, text="Invalid number format"):
    """A number is not in VAL-II's format."""


class MissingParenthesis(ProgramError, code=-457, text="Missing parenthesis"):
    """A parenthesis is not closed."""


class IllegalExpression(ProgramError, code=-458, text="Illegal expression syntax"):
    """An expression cannot be read."""


class MissingQuote(ProgramError, code=-460, text="Missing quote mark"):
    """A string is not closed."""


class DuplicateLabel(ProgramError, code=-464, text="Duplicate statement label"):
    """Two steps of a program have the same label."""


class MisplacedDeclaration(ProgramError, code=-471, text="Misplaced declaration statement"):
    """A declaration (AUTO, LOCAL, GLOBAL) follows another statement."""


class ControlStructure(ProgramError, code=-473, text="Control structure error"):
    """IF, CASE, WHILE or another structure is not closed, or is closed twice."""


class AmbiguousGrouping(ProgramError, code=56, text="Ambiguous grouping"):
    """A warning: VAL-II's own operator precedence would group an expression differently."""


class OldMeaning(ProgramError, code=58, text="Taken as in VAL"):
    """A warning: a statement that is read with its meaning in VAL, the predecessor of VAL-II."""


class WordAsName(ProgramError, code=59, text="Word as a name"):
    """A warning: a variable whose name a reader could take for a function or an instruction, or the reverse."""


class HiddenStatement(ProgramError, code=62, text="Statement in a comment"):
    """A warning: a comment that looks like a second statement of the line."""


class AngleUnit(ProgramError, code=63, text="Angle in degrees"):
    """A warning: an angle that seems to be in radians; VAL-II uses degrees."""


class LengthUnit(ProgramError, code=65, text="Length in millimetres"):
    """A warning: a location whose coordinates seem to be in metres; VAL-II uses millimetres."""


class TimeUnit(ProgramError, code=67, text="Time in seconds"):
    """A warning: a time that seems to be in milliseconds; VAL-II uses seconds."""


class SpeedInPercent(ProgramError, code=69, text="Speed in percent"):
    """A warning: a speed that seems to be a fraction of full speed; VAL-II uses percent."""


class UnreadStatus(ProgramError, code=68, text="Status of a file not read"):
    """A warning: a program opens a file for reading and does not check whether the file exists."""


class FixedCondition(ProgramError, code=66, text="Condition that never changes"):
    """A warning: a condition uses the number of a signal instead of its state, or compares TRUE with 1."""


class AboveFullSpeed(ProgramError, code=64, text="More than full speed"):
    """A warning: a speed or an acceleration above 100 %, which is reduced to 100 %."""


class UnreachableCode(ProgramError, code=57, text="Unreachable code"):
    """A warning: a step that is never carried out."""


class PauseOfArm(ProgramError, code=60, text="Pause of the arm"):
    """A warning: a DELAY, which stops only the arm, where the program itself should probably wait."""


class WithoutEffect(ProgramError, code=61, text="No effect here"):
    """A warning: a switch or parameter without effect on a virtual robot, or a step that does nothing."""


class NoProgramSpecified(ProgramError, code=-301, text="No program specified"):
    """A command needs the name of a program."""


class ProgramNotExecutable(ProgramError, code=-307, text="Program not executable"):
    """A program cannot run, because some of its lines have errors."""


class ProgramInterlocked(ProgramError, code=-308, text="Program interlocked"):
    """A program that a task is executing, or will return to after a CALL, cannot be changed or deleted."""


class ProgramExists(ProgramError, code=-309, text="Program already exists"):
    """A program with that name is in memory."""


class TaskActive(ProgramError, code=-310, text="Program task already active"):
    """A task already executes a program."""


class TaskNotActive(ProgramError, code=-311, text="Program task not active"):
    """A task executes no program."""


class LimitReached(ProgramError, code=-414, text="Program limit reached"):
    """A program was stopped because it reached a limit: time, steps, memory, or output."""


class EndlessWait(LimitReached, code=-419, text="Endless wait"):
    """A program waits in virtual time for a change that cannot happen. (Code chosen by vrs, not by V+.)"""


class ClockPaused(ProgramError, code=-415, text="Clock is paused"):
    """A program or command waits for a real-time clock that is paused."""


class EndOfInput(ProgramError, code=-504, text="Unexpected end of file"):
    """A program asks for a line, but there is no more input."""


class MotionError(VrsError):
    """The robot cannot do the motion. `place`: where a straight line fails [m]."""


class RobotNotAttached(MotionError, code=-602, text="Robot not attached to this program"):
    """Another task has attached the robot, or the program has not attached it."""


class AlterNotOn(MotionError, code=-634, text="ALTER mode is not on"):
    """ALTER is used in a task without ALTON. (The code is V+'s, quoted from memory.)"""


class PowerOff(MotionError, code=-604, text="Robot power off"):
    """The arm has no power."""


class TooLate(MotionError, code=-690, text="Execution time is past"):
    """In real time a command would change the past. (Code chosen by vrs, not by V+.)"""


class TooNear(MotionError, code=-691, text="Too near a singularity"):
    """A small step of the tool would need a large step of a joint. (Code chosen by vrs, not by V+.)"""


class CollisionAhead(MotionError, code=-696, text="Collision"):
    """With ENABLE COLLISION: the arm or the part in its hand would touch something. `value`: the depth of the overlap
    [m], `lower`: how much farther apart the two must stay [m], `place`: the point in the world [m]. (Code chosen by
    vrs, not by V+.)"""


class StreamIsOver(MotionError, code=-692, text="Stream of targets is over"):
    """A stream of targets has ended: its motion cannot be planned again, and a robot that was stopped does not follow
    the next chunk. (Code chosen by vrs, not by V+.)
    """


class IllegalJoint(MotionError, code=-609, text="Illegal joint number"):
    """The robot has no joint with that number."""


class LocationOutOfRange(MotionError, code=-610, text="Location out of range"):
    """The arm does not reach a location. `value`: the distance that the message names [m]; the arm reaches distances
    from `lower` to `upper`."""

    @property
    def beyond(self) -> float | None:
        """Return by how much the location is too far (negative: too close) [m]; None if that is unknown."""
        bound = self.lower if self.upper is None else self.upper
        return None if self.value is None or bound is None else self.value - bound


class StraightLineConfiguration(MotionError, code=-612, text="Straight-line motion can't alter configuration"):
    """A straight line would end in another configuration of the arm (such as LEFTY instead of RIGHTY)."""


class StraightLineSingular(MotionError, code=-613, text="Straight-line motion too near a singularity"):
    """A straight line passes too close to a singularity for the joints to follow."""


class PathWithoutJoints(VrsError, code=-693, text="No joints for a place on a straight line"):
    """A straight line in a trajectory loaded from a file leaves the reach of the arm. (Code chosen by vrs, not by
    V+.)"""


class LocationTooFar(LocationOutOfRange, code=-619, text="Location too far"):
    """A location is beyond the reach of the arm."""


class LocationTooClose(LocationOutOfRange, code=-618, text="Location too close"):
    """A location is too close to the base for the arm."""


class JointOutOfRange(MotionError, code=-1023, text="Joint out of range"):
    """A joint would leave its range."""

    @property
    def title(self) -> str:
        return f"Joint {self.joint} out of range"


class FileError(VrsError, code=-502, text="File error"):
    """A file cannot be read or written."""


class NonexistentFile(FileError, code=-501, text="Nonexistent file"):
    """There is no file with that name."""


class FileExists(FileError, code=-500, text="File already exists"):
    """A file with that name exists."""


class FileDamaged(FileError, code=-503, text="File is not what it should be"):
    """The content of a file does not fit its format."""


class FileOpened(FileError, code=-506, text="File already opened"):
    """Another program is writing a file, or a unit already has an open file."""


class FileNotOpened(FileError, code=-513, text="File not opened"):
    """A logical unit has no open file."""


class UnitNotAttached(FileError, code=-516, text="Logical unit not attached"):
    """A task uses a logical unit that it has not attached."""


class UnitAttached(FileError, code=-515, text="Device already attached"):
    """Another task has attached a device that cannot be shared."""


class DeviceNotReady(FileError, code=-508, text="Device not ready"):
    """A device does not exist here, or it cannot be opened."""


class NetworkClosed(FileError, code=-562, text="Network connection closed"):
    """The other end of a connection does not answer or has closed it. (The code is that in public V+ programs.)"""


class NetworkTimeout(FileError, code=-559, text="Network timeout"):
    """The other end of a connection has sent nothing for too long. (Code chosen by vrs, not by V+.)"""


class PortTaken(FileError, code=-560, text="Network port in use"):
    """Another program listens on the port. (Code chosen by vrs, not by V+.)"""


class NoDataReceived(FileError, code=-526, text="No data received"):
    """READ or GETC without waiting finds no data."""


class LineMissing(NoDataReceived):
    """GETC needs the next line of logical unit `value`. The task requests the line and then repeats the step."""


class FileOutside(FileError, code=-517, text="File outside the folder of the run"):
    """A program names a file outside the folder in which it may use files."""


class RequestRefused(VrsError, code=-390, text="Request refused"):
    """The robot refuses to begin a request. (Code chosen by vrs, not by V+.)"""


class UsageError(VrsError, code=-300, text="Illegal monitor command"):
    """A command or an option does not exist, or is used wrongly."""

    def for_python(self) -> VrsError:
        if type(self) is not UsageError:
            return super().for_python()
        numbers: dict[str, Any] = self.numbers
        return NotPossible(self.detail, self.in_python or self.hint, **numbers)


class NotPossible(UsageError, code=-395, text="Not possible"):
    """A method is used wrongly, or cannot be used now. (Code chosen by vrs, not by V+.)"""


class LeaseHeld(UsageError, code=-694, text="Lease is not yours"):
    """Another user, or nobody, has the lease to drive the robot. (Code chosen by vrs, not by V+.)"""


class RoleWanted(UsageError, code=-695, text="Not in your role"):
    """A command needs a role that its sender does not have. (Code chosen by vrs, not by V+.)"""
