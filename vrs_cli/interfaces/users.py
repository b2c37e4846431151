"""The users of a robot: the role that a line requires, the lines that may be carried out while a program runs, the
lease (the exclusive right to drive the robot), the conversion from a user's clock to the robot's clock, and the state
that is kept for each user. Every function that needs the time of day takes it as an argument.

One user at a time holds the lease and drives; regular heartbeats prolong it. Other users can ask for the lease. The
holder can give it away, and may lose it only after a fixed time without a heartbeat.

The robot has one clock. A command that was issued at t_iss takes effect at its arrival t_c = t_iss + D_f (D_f: the
transmission delay) or later: nothing before t_c changes. The sender states the time of issue; vrs limits it to possible
values. A user's clock may be ahead of the robot's by an offset D. With D = -D_f the user's clock is behind by the
transmission delay, so a command for the user's "now" is never late. (A viewer, which receives data after a delay D_b,
has D = D_b, or looks further ahead: `Subscribe.ahead`.)
"""

from __future__ import annotations

from collections import deque
from enum import Enum, auto
from math import inf
from typing import TYPE_CHECKING, Protocol, TypeVar

from msgspec import Struct, field, structs

from vrs_cli.errors import LeaseHeld, RoleWanted, UsageError
from vrs_cli.kinematics.transform import IDENTITY, Transform
from vrs_cli.language.text.ast import Assignment, DoInstruction, ExplainCommand, Instruction, Show, Statement
from vrs_cli.language.words import instructions, monitor
from vrs_cli.language.words.word import Role
from vrs_cli.values import commands, diagnostics, questions, results

if TYPE_CHECKING:
    from vrs_cli.interfaces.dialogue import Dialogue
    from vrs_cli.interfaces.dragging import Dragging
    from vrs_cli.values.acts import Go
    from vrs_cli.values.replies import Reply

CHANGE = "a change of a variable"
STOPPING = ("ABORT",)  # commands that are carried out before all waiting requests


def check_may(said: str, wanted: Role, role: Role) -> None:
    """Check that a user's `role` includes the role `wanted`. `said`: the name of the request, for the error message.
    Raises RoleWanted."""
    if wanted not in role:
        raise RoleWanted(f"{said} is for {wanted.title_with_article}", f"you are {role.title_with_article}")


def may_all(said: str, wanted: Role) -> bool:
    """Return whether users who do not drive may also make this request. They may make requests that only look at the
    robot or stop it. `said`: the name of the request; `wanted`: the role that it needs."""
    return wanted is Role.OBSERVER or said in STOPPING


def must_drive(said: str, wanted: Role, role: Role) -> bool:
    """Return whether only the user who drives may make a request. Every user may look at the robot, and a supervisor
    may stop it without driving. `said`: the name of the request; `wanted`: the role that it needs; `role`: the user's
    role."""
    return not may_all(said, wanted) or (said in STOPPING and Role.SUPERVISOR not in role)


def check_beside(statement: Statement, *, elsewhere: bool) -> None:
    """Check that a line can be carried out while a program runs. `elsewhere`: whether the program runs on a branch
    other than the user's. Raises UsageError if the line must wait."""
    said, role = need_of(statement)
    check_goes_beside(CHANGE if isinstance(_inner(statement), Assignment) else said, role, elsewhere=elsewhere)


def check_goes_beside(said: str, role: Role, *, elsewhere: bool) -> None:
    """Check that a request can be carried out while a program runs. `said`: the name of the request; `role`: the role
    that it needs; `elsewhere`: whether the program runs on a branch other than the user's. Raises UsageError if the
    request must wait."""
    if elsewhere and said in monitor.ON_BRANCH:
        raise UsageError(f"{said} has to wait until the program on another branch stops", "{ABORT} stops it")
    if not (said == CHANGE or said in monitor.BESIDE or role is Role.OBSERVER):
        raise UsageError(f"{said} has to wait until the program stops", "{ABORT} stops it")


def role_of(word: str) -> Role:
    """Return the role that a user needs for the command or instruction `word`."""
    return (monitor.COMMANDS.get(word) or instructions.INSTRUCTIONS[word]).role


def need_of(statement: Statement) -> tuple[str, Role]:
    """Return the name that messages use for a line, and the role that the line needs."""
    statement = _inner(statement)
    if isinstance(statement, Show):
        return "a look at a value", Role.OBSERVER
    if isinstance(statement, ExplainCommand):
        return "EXPLAIN", role_of("EXPLAIN")
    if isinstance(statement, Instruction):
        return statement.word, role_of(statement.word)
    return "a change of a variable or a program", Role.SUPERVISOR


def _inner(statement: Statement) -> Statement:
    """Return the statement inside a DO; return any other statement unchanged."""
    return statement.statement or statement if isinstance(statement, DoInstruction) else statement


USUAL_LENGTH = 10.0  # [s] default time after a heartbeat during which no other user can take the lease


class Granted(results.TaggedValue, frozen=True):
    """Notice: the user `to` is now the driver."""

    to: str


class Requested(results.TaggedValue, frozen=True):
    """Notice to the user `of`, who holds the lease: the user `by` asks to drive."""

    of: str
    by: str


class Lost(results.TaggedValue, frozen=True):
    """Notice: the user `by` has taken the lease from the user `of`, whose heartbeat did not arrive in time."""

    of: str
    by: str


Notice = Granted | Requested | Lost


def notice_text(notice: Notice | None, user: str) -> str:
    """Return the text of a notice for a user; the text is empty if the notice only reports which user drives."""
    match notice:
        case Requested(of, by) if of == user:
            return f"{by} would like to drive"
        case Requested(of, by):
            return f"{of} is asked to let {'you' if by == user else by} drive"
        case Lost(of, by) if of == user:
            return f"{by} drives, for nothing was heard of you"
    return ""


class RobotLease(Struct, frozen=True):
    """The right to drive. `holder`: the user who drives; empty if nobody drives. `until` [s]: until this time nobody
    can take the lease from the holder; afterwards the holder keeps it until another user takes it. `asking`: the users
    who have asked for the lease, in order. `length` [s]: the time after a heartbeat during which no other user can take
    the lease."""

    holder: str = ""
    until: float = 0.0
    asking: tuple[str, ...] = ()
    length: float = USUAL_LENGTH

    def drives(self, who: str) -> bool:
        return bool(who) and who == self.holder

    def is_free(self, now: float) -> bool:
        """Return whether another user may take the lease now."""
        return not self.holder or now > self.until

    def check(self, who: str) -> None:
        """Check that a user drives. Raises LeaseHeld."""
        if not self.drives(who):
            raise LeaseHeld(
                self._holder_text(), "ask for the lease; in the shell: /ask", in_python='lease("ask") asks for it'
            )

    def acquire(self, who: str, now: float) -> tuple[RobotLease, tuple[Notice, ...]]:
        """Give the lease to `who` if nobody drives, or if the holder's time has passed. Return the new lease and the
        notices to send. Raises LeaseHeld if another user drives."""
        if self.drives(who):
            return self.beat(who, now), ()
        if not self.is_free(now):
            raise LeaseHeld(
                self._holder_text(), f"ask for the lease; it ends in {self.until - now:.1f} s without a heartbeat"
            )
        lost = (Lost(self.holder, who),) if self.holder else ()
        return self._give(who, now), (*lost, Granted(who))

    def ask(self, who: str, now: float) -> tuple[RobotLease, tuple[Notice, ...]]:
        """Ask for the lease: take it now if possible; otherwise notify the holder, once for each user who asks."""
        if self.is_free(now) or self.drives(who):
            return self.acquire(who, now)
        if who in self.asking:
            return self, ()
        return structs.replace(self, asking=(*self.asking, who)), (Requested(self.holder, who),)

    def give(self, who: str, to: str, now: float) -> tuple[RobotLease, tuple[Notice, ...]]:
        """Give the lease to another user, or to nobody if `to` is empty. Raises LeaseHeld if `who` does not drive."""
        self.check(who)
        if not to:
            return structs.replace(self, holder="", until=now), ()
        return self._give(to, now), (Granted(to),)

    def beat(self, who: str, now: float) -> RobotLease:
        """Prolong the lease after a heartbeat of its holder. Raises LeaseHeld if `who` does not drive or has lost the
        lease."""
        self.check(who)
        return structs.replace(self, until=max(now + self.length, self.until))

    def leave(self, who: str, now: float) -> tuple[RobotLease, tuple[Notice, ...]]:
        """Record that a user has left. If this user drove, the lease goes to the user who has asked for it first; if
        none has asked, nobody drives."""
        asking = tuple(one for one in self.asking if one != who)
        left = structs.replace(self, asking=asking)
        return left.give(who, asking[0] if asking else "", now) if self.drives(who) else (left, ())

    def _give(self, to: str, now: float) -> RobotLease:
        return structs.replace(
            self, holder=to, until=now + self.length, asking=tuple(one for one in self.asking if one != to)
        )

    def _holder_text(self) -> str:
        return f"{self.holder} drives" if self.holder else "nobody drives"


USUAL_ALLOWED = 10.0  # [s] maximum transmission time that a user may claim for a command


class HolderTimes(Struct, frozen=True):
    """How to convert times given by a user [s]. `offset`: D, how far the user's clock is ahead of the robot's.
    `allowed`: the maximum time that a command may have been in transmission; a user cannot claim more."""

    offset: float = 0.0
    allowed: float = USUAL_ALLOWED

    def issue_time(self, claim: float | None, arrival: float) -> float:
        """Return when a command was issued, by the robot's clock [s]: the time `claim` given by the user, limited to
        the range from `arrival` - `allowed` to `arrival`."""
        if claim is None or claim != claim:
            return arrival
        return min(max(claim, arrival - self.allowed), arrival)

    def robot_time(self, t: float) -> float:
        """Convert a time in a command (t in MOVE ... AT t) from the user's clock to the robot's clock [s]."""
        return t - self.offset


THE_ROBOTS = HolderTimes()


def move_of(act: Go, times: HolderTimes) -> commands.Move:
    """Return the motion command in an act, with its times converted to the robot's clock."""
    stamp = None if act.executed is None else commands.Stamp(times.robot_time(act.executed))
    return commands.Move(act.goal.target, act.straight, speed=act.speed, stamp=stamp, text=act.text)


# --- the state of a user ---------------------------------------------------------------------------------------------

R = TypeVar("R")


class LineEditor(Protocol):
    """The line-based program editor (EDIT) while it is open: it takes lines, and stores a program in memory."""

    @property
    def name(self) -> str: ...
    @property
    def prompt(self) -> str: ...
    @property
    def done(self) -> bool: ...
    @property
    def changed(self) -> bool:
        """Return whether leaving the editor now would lose changes."""

    @property
    def source(self) -> str:
        """The edited program, as the text of a program file."""

    def take(self, line: str) -> Dialogue[tuple[Reply, ...]]:
        """Carry out one line typed in the editor. Raises LineRefused, VrsError."""

    def mistake(self, line: str) -> diagnostics.Diagnostic | None:
        """Return the mistake in a line that is still being typed; None if there is none."""


class StreamKind(Enum):
    """The ways in which a user sends a stream of targets: as joints, in chunks of joints, by dragging the tool, by
    holding a button of the page down, or by pressing keys in JOG."""

    STEER = auto()
    CHUNKS = auto()
    DRAG = auto()
    BUTTON = auto()
    KEYS = auto()


class TargetStream(Struct, eq=False):
    """A stream of targets that a user has opened and not yet closed. `ended`: why the robot no longer follows the
    stream; empty while the robot follows it. `last`: when the last pose arrived, or when the last chunk ends [s], by
    the robot's clock.

    Only the stream of a dragged tool sets the other fields. `version`: the version of the timeline after the last step.
    `dragging`: the controller that moves the arm to each target. `pose`: the last target. `issued` [s]: when the user
    sent it, by the user's clock."""

    kind: StreamKind
    user_state: UserState
    ended: str = ""
    version: int = -1
    dragging: Dragging | None = None
    pose: Transform = IDENTITY
    issued: float | None = None
    last: float = -inf


# the reason why the robot no longer follows a stream, shown to its user
STOPPED = "something else has moved or stopped the robot"
MAX_TYPED_LINES = 1000  # keep at most this many typed lines for HISTORY


class UserState(Struct, eq=False, weakref=True):
    """The state that is kept for one user.

    - `attended`: a person is present who can be asked.
    - `lives`: the user continues typing while a program runs, and does not wait for its end.
    - `times`: how the user's clock differs from the robot's.
    - `issued` [s]: when the current line was given, as claimed by the user, by the robot's clock.
    - `editor`: the open EDIT, which takes the lines. `last_edited`: the program that it edits, or that EDIT edited
      last.
    - `on_screen`: what fills the screen: the program of SEE, the arm of JOG, or the recording of REPLAY.
    - `drafted`: the unsaved text of SEE, as the text of a program file.
    - `last_statement`: the statement that a bare DO repeats.
    - `typed`: the lines typed so far.
    - `command_files`: the command files that are being carried out, the innermost last.
    - `interrupted`: Ctrl-C or ABORT was given; the lines after the current one are dropped.
    - `left`: the user has left; the program for which this user waited continues.
    - `streams`: the streams of targets that the user has opened and not yet closed."""

    name: str = ""
    role: Role = Role.SUPERVISOR
    attended: bool = False
    lives: bool = False
    times: HolderTimes = THE_ROBOTS
    issued: float | None = None
    editor: LineEditor | None = None
    last_edited: str | None = None
    on_screen: object = None
    drafted: str = ""
    last_statement: Statement | None = None
    command_files: list[str] = field(default_factory=list)
    typed: deque[str] = field(default_factory=lambda: deque(maxlen=MAX_TYPED_LINES))
    interrupted: bool = False
    left: bool = False
    streams: dict[StreamKind, TargetStream] = field(default_factory=dict)

    def show(self, it: object, question: questions.OnScreen) -> Dialogue[bool]:
        """Show `it` on the full screen until the user leaves the screen. `question`: asks the front end to open the
        screen. Return False if the user's front end has no full screen."""
        self.on_screen = it
        try:
            return (yield question) is not None
        finally:
            self.on_screen, self.drafted = None, ""

    def with_issue_time(self, issued: float | None, dialogue: Dialogue[R]) -> Dialogue[R]:
        """Carry out a dialogue for a line that was issued at time `issued` of the robot's clock [s]."""
        self.issued = issued
        try:
            return (yield from dialogue)
        finally:
            self.issued = None
