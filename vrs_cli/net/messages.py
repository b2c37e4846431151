"""What goes over a connection between a robot and somebody who holds it from afar, as values.

A message is one frame. Those of the conversation are in `wire/messages.py`; here are those of connections, of looking
at the robot, of the lease and of files, and the unions of all that a client and a server send.
"""

from __future__ import annotations

from enum import Enum
from typing import Any

from msgspec import Struct

from vrs_cli.interfaces.station.lease import Notice
from vrs_cli.kinematics.transform import Transform
from vrs_cli.values.hand import DragState as PulledState
from vrs_cli.wire.codec import Encoding
from vrs_cli.wire.messages import (
    Abort,
    Answer,
    Asked,
    At,
    Check,
    Checked,
    ClientMessage,
    Command,
    Complete,
    Completed,
    Done,
    Drive,
    Fetched,
    Get,
    How,  # noqa: F401 (of Answer)
    Interrupt,
    LeaseAct,  # noqa: F401 (of Drive)
    Line,
    Located,
    Numbered,
    Positions,
    Refused,
    Request,
    Result,
    ServerMessage,
    Status,
    Told,
    Typed,
    Withdrawn,
)
from vrs_cli.wire.records import Count, DeltaRecord, Joints, Length, Name, Number, Time
from vrs_cli.wire.refusal import Refusal
from vrs_cli.wire.snapshots import SnapshotRecord
from vrs_cli.wire.steered import SteeredRecord

VERSION = 1
PORT = 8765  # where a server listens, unless it is told otherwise

Ids = tuple[Count, ...]


class Change(ServerMessage, frozen=True, kw_only=True):
    """What makes up the timeline of whoever follows it. `number` counts these messages of one robot, from 1: they are
    the same for all.
    """

    number: Count = 0


# --- from the client: a connection ----------------------------------------------------------------------------------


class Resume(Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True):
    """The connection that was cut, the last `seq` that was heard of it, and the commands without an answer."""

    connection: Name
    seq: Count
    unanswered: Ids = ()


class Hello(ClientMessage, frozen=True, forbid_unknown_fields=False):
    """The first message, always JSON: the versions that the client speaks, and the form that it wants to hear.

    `robot`: the one it is about, empty for the only one. `name`: what others call this holder. `full`: deltas hold all
    that a client cannot compute by itself. `attended`: a person is there, who can be asked. `answers`: a
    program is, which answers questions; where neither is, a command that asks one ends. `delay`: the longest way of
    a command [s] that it claims. `offset`: the clock by which it says when motions begin is so far ahead of the robot's
    [s]; -D_f for one who is D_f away, and wants none of them to come too late.
    """

    versions: tuple[Count, ...]
    token: Name = ""
    robot: Name = ""
    format: Encoding = Encoding.JSON
    name: Name = ""
    full: bool = False
    attended: bool = False
    answers: bool = False
    delay: Length | None = None
    offset: Number = 0.0
    resume: Resume | None = None


class Ping(ClientMessage, frozen=True):
    """`sent`: when, by the clock of who sends it [s]."""

    sent: Number


class Bye(ClientMessage, frozen=True):
    """The holder leaves for good."""


# --- from the client: looking ---------------------------------------------------------------------------------------


class Subscribe(Request, frozen=True):
    """What is heard from now on, in place of what was before. `Done` answers.

    `deltas`: the timeline of the last `window` seconds (None: all of it), and every change; `after`: the number of the
    last change that is known, if the connection was cut. `rate`: so many samples in a second, 0 for none, of the robot
    as it will be `ahead` [s] later: D_b for one who wants to see the present, D_f + D_b for one who wants to see where
    a command of now will find it. `console`: what the programs of others TYPE.
    """

    deltas: bool = False
    rate: Length = 0.0
    ahead: Length = 0.0
    console: bool = False
    window: Length | None = None
    after: Count | None = None


class PlayStep(Enum):
    """What a viewer of samples does with what it is shown."""

    PLAY = "play"
    PAUSE = "pause"
    REWIND = "rewind"
    SEEK = "seek"
    RATE = "rate"
    FOLLOW = "follow"


class Play(ClientMessage, frozen=True):
    """`value`: the time to SEEK [s], or the RATE."""

    step: PlayStep
    value: Number = 0.0


class Resync(ClientMessage, frozen=True):
    """What was heard does not fit together: `Replaced` comes; `full` asks for the full form from then on."""

    full: bool = False


class Window(Request, frozen=True):
    """The timeline from `begin` to `end`; None for its end. `Shown` answers."""

    begin: Time
    end: Time | None = None


class Who(Request, frozen=True):
    """The robots, and who holds this one. `Present` answers."""


# --- from the client: driving, and files ----------------------------------------------------------------------------


class Drag(ClientMessage, frozen=True):
    """The tool is wished at `pose` (T_world_tool) from now on; without one it is let go. The newest counts; without a
    message for 0.6 s it is let go too. What becomes of it all hear by `Pulled`; a refusal is told once. `issued`: when,
    as in `Line` [s].
    """

    pose: Transform | None = None
    issued: Number | None = None


class Put(Command, frozen=True):
    """A file for the robot's folder."""

    name: Name
    data: bytes
    replace: bool = False


class Names(Request, frozen=True):
    """The files in the robot's folder. `Listed` answers."""


FromClient = (
    Hello
    | Ping
    | Bye
    | Line
    | At
    | Abort
    | Interrupt
    | Answer
    | Complete
    | Check
    | Subscribe
    | Play
    | Resync
    | Positions
    | Window
    | Who
    | Drive
    | Drag
    | Put
    | Get
    | Names
)


# --- from the server: a connection ----------------------------------------------------------------------------------


class Clock(ServerMessage, frozen=True):
    """The robot's clock `now` [s], at the time `wall` [s] of the server; how fast it goes, if it goes by itself."""

    now: float
    rate: float = 1.0
    paused: bool = False
    realtime: bool = False
    wall: float = 0.0


class Outcome(Enum):
    """What has become of a command: it was done, it was refused, it is being done (`Done` comes), it never came, or
    that was so long ago that nobody knows.
    """

    DONE = "done"
    REFUSED = "refused"
    TAKEN = "taken"
    UNSEEN = "unseen"
    FORGOTTEN = "forgotten"


class Fate(Struct, frozen=True, omit_defaults=True):
    """The outcome of the command with this id."""

    id: Count
    outcome: Outcome


class Welcome(ServerMessage, frozen=True):
    """The first answer. `connection` is the key to resume it with; `seq`: the number of the last `Numbered` message
    that was sent before this connection; `resumed`: those after the `seq` of `Resume` follow. Where it is false, the
    ends of the commands that were asked about follow, under new numbers. Questions that are open come again.

    `life` names this run of the robot: another one counts its changes anew. `model`: the robot as data. `one_user`: all
    who hold it are the same one, who drives without having asked for it.
    """

    version: Count
    connection: str
    robot: str
    life: str
    role: str
    name: str
    clock: Clock
    model: dict[str, Any]
    robots: tuple[str, ...] = ()
    server: str = ""
    seq: Count = 0
    resumed: bool = False
    fates: tuple[Fate, ...] = ()
    one_user: bool = False


class Closing(ServerMessage, frozen=True):
    """The server closes the connection."""

    why: str
    refusal: Refusal | None = None


class Pong(ServerMessage, frozen=True):
    """`sent` of the ping; when it came and when this was sent, by the clock of the server [s]; the robot's clock."""

    sent: float
    came: float
    left: float
    clock: float


# --- from the server: looking ---------------------------------------------------------------------------------------


class Delta(Change, frozen=True):
    """A change of the timeline; `applied`: the robot's clock then."""

    delta: DeltaRecord
    applied: float


class Steered(Change, frozen=True):
    """A change by one target of steering, in short: for who has not asked for the full form."""

    target: SteeredRecord


class Replaced(Change, frozen=True):
    """Another timeline has taken the place of the one before."""

    snapshot: SnapshotRecord


class Missed(ServerMessage, frozen=True):
    """Who listens was too slow: so many changes are left out. `Replaced` makes up for them."""

    count: Count


class Sample(ServerMessage, frozen=True):
    """Where the robot is at the time `t` by timeline `version`, sent at `clock`. `wrong`: what was sent before this of
    that time and after it has been made invalid by a later command.
    """

    t: float
    joints: Joints
    version: Count = 0
    clock: float = 0.0
    wrong: float | None = None


class Activity(ServerMessage, frozen=True):
    """Who drives, empty for nobody, and which programs run: told to all when it changes."""

    driver: str = ""
    programs: tuple[str, ...] = ()


class Pulled(ServerMessage, frozen=True):
    """Who drags the tool, and what holds it where: told to all when it changes."""

    state: PulledState


class Lease(Numbered, frozen=True):
    """Who drives: empty for nobody."""

    holder: str
    notice: Notice | None = None


# --- from the server: answers ---------------------------------------------------------------------------------------


class Shown(Result, frozen=True):
    """For `Window`. `number`: of the last change that is in it; who knows a later one asks again. `begin`: where it
    begins [s], which is later than was asked for where that is too much at once.
    """

    snapshot: SnapshotRecord
    number: Count = 0
    begin: float = 0.0


class Present(Result, frozen=True):
    """For `Who`: the robots that the token may hold, the holders of this one, and who of them drives."""

    robots: tuple[str, ...]
    holders: tuple[str, ...]
    driver: str = ""


class StoredFile(Struct, frozen=True):
    """`size` in bytes, `changed` in seconds of the server's clock."""

    name: str
    size: int
    changed: float = 0.0


class Listed(Result, frozen=True):
    """For `Names`."""

    files: tuple[StoredFile, ...] = ()


FromServer = (
    Welcome
    | Refused
    | Closing
    | Pong
    | Clock
    | Status
    | Typed
    | Told
    | Asked
    | Withdrawn
    | Done
    | Delta
    | Steered
    | Replaced
    | Missed
    | Sample
    | Activity
    | Pulled
    | Lease
    | Located
    | Shown
    | Completed
    | Checked
    | Present
    | Fetched
    | Listed
)
