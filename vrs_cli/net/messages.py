"""Messages between a server and its clients: connections, viewing, the lease, files, classes, and a robot's body.

A body is the arm, real or simulated, that executes the motions. One message is one frame. Messages that are also needed
without a connection are in `wire/messages.py`. `FromClient` and `FromServer` are the unions of all messages.
"""

from __future__ import annotations

from enum import Enum
from typing import Any

from msgspec import Struct

from vrs_cli.interfaces.users import Notice
from vrs_cli.kinematics.transform import Transform
from vrs_cli.values.dragging import DragState as PulledState
from vrs_cli.values.measured import BodyMode, BodySeen, DivergenceAlarm
from vrs_cli.values.world import ContactSpan, CourseRows
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
    How,  # noqa: F401
    Interrupt,
    LeaseAct,  # noqa: F401
    Line,
    Located,
    Numbered,
    Positions,
    Refusal,
    Refused,
    Request,
    Result,
    ServerMessage,
    SnapshotRecord,
    Status,
    Told,
    Typed,
    Withdrawn,
)
from vrs_cli.wire.records import Columns, Count, DeltaRecord, Joints, Length, Name, Number, Text, Time
from vrs_cli.wire.reports import ReportRows
from vrs_cli.wire.steered import SteeredRecord

VERSION = 1
PORT = 8765  # the default TCP port of a server


class Change(ServerMessage, frozen=True, kw_only=True):
    """A change of the timeline. `number` counts the changes of one robot from 1; it is the same for all clients."""

    number: Count = 0


# --- from the client: a connection ----------------------------------------------------------------------------------


class Resume(Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True):
    """The connection to resume: its key, the last `seq` received, and the ids of commands that have no `done` yet."""

    connection: Name
    seq: Count
    unanswered: tuple[Count, ...] = ()


class Hello(ClientMessage, frozen=True, forbid_unknown_fields=False):
    """The first message of a client, always JSON. `versions`: the versions of the protocol that the client supports;
    `format`: the encoding of all messages that the server sends after `welcome`.

    `robot`: the robot to join, empty if there is only one. `name`: the name that other users see. `full`: send each
    change as a `delta`, never as `steered`. `attended`: a person can answer questions. `answers`: a program answers
    them. If both are false, a command that asks a question is refused. `delay`: the maximum delay that the client
    claims for its commands [s]. `offset`: how far the client's clock, which dates its motions, is ahead of the robot's
    [s]; if commands take D_f to arrive, use -D_f, so that no motion comes too late. `rendered`: the width of the
    client's screen in columns; each reply is also sent as `lines` of this width.
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
    rendered: Columns | None = None
    resume: Resume | None = None


class Screen(ClientMessage, frozen=True):
    """The width of the client's screen has changed. Later replies are rendered for the new width, as with `rendered` in
    `hello`."""

    columns: Columns


class Ping(ClientMessage, frozen=True):
    """Measure the delay. `sent`: the time of sending by the client's clock [s]. `pong` answers."""

    sent: Number


class Bye(ClientMessage, frozen=True):
    """The client leaves and will not resume."""


# --- from the client: viewing ---------------------------------------------------------------------------------------


class Subscribe(Request, frozen=True):
    """Choose what the server sends from now on; this replaces the previous subscription. `done` answers.

    `deltas`: send the timeline as `replaced`, then every change. `window`: how many seconds before the robot's clock
    this timeline begins; absent: send all of it. If that is too long for one message, the timeline begins later: then
    `first` of the snapshot is not 0, and the message `window` asks for the rest. `after`: the number of the last change
    that the client has; the server sends only later changes. `rate`: samples per second (0: none), each for the time
    `ahead` seconds after the robot's clock. If `ahead` is D_b, the delay of samples, the viewer sees the present. If it
    is D_b + D_f, the delay of samples and of commands, the viewer sees the robot as it will be when a command sent now
    arrives. `console`: also send the output of TYPE of other users' programs. `joints`: also send straight lines as
    `pieces` in joint space, with at most this error of each joint [rad, m], from 1e-5 to 0.1; the server uses the next
    lower power of ten. `world`: with `deltas`, also send the positions of parts, the states of sensors and the
    contacts, as `course` and `contacts`. `measured`: also send new measurements of the robot's body, as `measurements`,
    at most 20 times a second.
    """

    deltas: bool = False
    rate: Length = 0.0
    ahead: Length = 0.0
    console: bool = False
    window: Length | None = None
    after: Count | None = None
    joints: Number | None = None
    world: bool = False
    measured: bool = False


class PlayStep(Enum):
    """The actions that control the playback of samples."""

    PLAY = "play"
    PAUSE = "pause"
    REWIND = "rewind"
    SEEK = "seek"
    RATE = "rate"
    FOLLOW = "follow"


class Play(ClientMessage, frozen=True):
    """Control the playback of samples. `value`: the time to seek [s], or the rate."""

    step: PlayStep
    value: Number = 0.0


class Resync(ClientMessage, frozen=True):
    """Ask for the timeline again, because a change is missing or does not fit; `replaced` follows. `full`: as in
    `hello`, for all later changes.
    """

    full: bool = False


class Window(Request, frozen=True):
    """Ask for the timeline from `begin` to `end` [s] (absent: to its end). `shown` answers."""

    begin: Time
    end: Time | None = None


class Who(Request, frozen=True):
    """Ask for the robots of the server, and the clients of this robot. `present` answers."""


# --- from the client: driving, and files ----------------------------------------------------------------------------


class Drag(ClientMessage, frozen=True):
    """Drag the tool to `pose` (T_world_tool, 12 numbers by rows); without `pose`, release it. The newest message
    replaces all earlier ones. The tool is also released after 0.6 s without a message. `pulled` tells all clients how
    far the tool is from `pose`; a refusal is sent once. `issued`: as in `line`."""

    pose: Transform | None = None
    issued: Number | None = None


class Put(Command, frozen=True):
    """Write a file into the robot's folder."""

    name: Name
    data: bytes
    replace: bool = False


class Names(Request, frozen=True):
    """Ask for the list of files in the robot's folder. `listed` answers."""


# --- from the client: a class ---------------------------------------------------------------------------------------


class AskHelp(Command, frozen=True):
    """A student asks the teacher for help, or withdraws the request (`wanted` false). A teacher who has helped sends
    the name of the `student`, with `wanted` false."""

    wanted: bool = True
    student: Name = ""


class HandIn(Command, frozen=True):
    """A student hands in a program, which is the text of a .v2 file; without `text`, all programs and variables of the
    robot. `name`: the student's name for the program."""

    name: Name = ""
    text: str | None = None


class WatchClass(Command, frozen=True):
    """A teacher asks for `classstate` of all students from now on."""


class Announce(Command, frozen=True):
    """A teacher sends a message to all students, or to one student; they get `announced`."""

    text: Text
    student: Name = ""


class Freeze(Command, frozen=True):
    """A teacher freezes the class: commands of students are refused, except those that stop a robot, until `frozen` is
    false.
    """

    frozen: bool = True


class Collect(Request, frozen=True):
    """A teacher asks for the newest program of each student as a ZIP file. `fetched` answers."""


TEACHING = WatchClass | Announce | Freeze | Collect
OF_CLASS = AskHelp | HandIn | TEACHING

# --- from the client: a body, whose reports are numbered from 0 -------------------------------------------------------


class Embody(Request, frozen=True):
    """Become the robot's body; with `held` false, stop being the body. `embodied` answers. Only one client at a time
    can be the body. `first`: the number of the oldest report that the client can still send; `rate`: the number of
    reports per second."""

    held: bool = True
    first: Count = 0
    rate: Length = 0.0


class Measured(ClientMessage, ReportRows, frozen=True, kw_only=True):
    """At most 2,000 reports of the body, with rising times. `first`: the number of the first report; the others count
    up from it. `sent`: the time of sending, on the same clock as `times` [s]. `round_trip`: the shortest measured delay
    to the server and back [s]. The server sends at most one refusal a second.
    """

    first: Count
    sent: Number
    round_trip: Length = 0.0


class MeasuredWindow(Request, frozen=True):
    """Ask for the reports of the body from `begin` to `end` [s] (absent: to the last one). `shownmeasured` answers."""

    begin: Time
    end: Time | None = None


OF_BODY = Embody | Measured | MeasuredWindow

FromClient = (
    Hello
    | Screen
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
    | AskHelp
    | HandIn
    | WatchClass
    | Announce
    | Freeze
    | Collect
    | OF_BODY
)


# --- from the server: a connection ----------------------------------------------------------------------------------


class Clock(ServerMessage, frozen=True):
    """A reading of the robot's clock: it shows `now` [s] when the server's clock shows `wall` [s]. `realtime`: the
    robot's clock advances by itself, at `rate`, unless it is `paused`."""

    now: float
    rate: float = 1.0
    paused: bool = False
    realtime: bool = False
    wall: float = 0.0


class Outcome(Enum):
    """The outcome of a command: it was carried out, refused, or accepted (`done` will follow), it never arrived, or it
    is so old that the server has forgotten it."""

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
    """The answer to `hello`. `connection`: the key with which the client can resume this connection; `seq`: the number
    of the last numbered message sent before it. `resumed`: the server now sends all numbered messages after the
    client's `seq`. If false, it has lost some, and sends the `done` of the commands in `unanswered` under new numbers.
    `fates`: the outcome of each command in `unanswered`. Open questions are sent again.

    `life`: the id of this run of the robot; each run counts `number` from 1 again. `model`: the robot model, with the
    keys of its TOML file, in m and rad (`docs/robots.md`). `role`: the role of this client. `one_user`: all clients
    belong to one user, who drives without the lease until a client requests it. `cell`: the cell around the robot, with
    the keys of its cell file (`docs/cell.md`), in m and rad; absent without a cell, or if it has more than 1 MB.
    `first_line`: a line that this client executes once, as if its user had typed it.
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
    cell: dict[str, Any] | None = None
    first_line: str = ""


class Closing(ServerMessage, frozen=True):
    """The server closes the connection."""

    why: str
    refusal: Refusal | None = None


class Pong(ServerMessage, frozen=True):
    """The answer to `ping`. `sent`: as in the ping; `came`, `left`: the time when the ping arrived and when this answer
    was sent, by the server's clock [s]; `clock`: the robot's clock at that time, a number [s].
    """

    sent: float
    came: float
    left: float
    clock: float


# --- from the server: viewing ---------------------------------------------------------------------------------------


class Delta(Change, frozen=True):
    """A change of the timeline in full; `applied`: the robot's clock when it was applied [s]."""

    delta: DeltaRecord
    applied: float


class Steered(Change, frozen=True):
    """A change of the timeline by one steering target, in a short form. Clients that asked for `full` get a `delta`
    instead."""

    target: SteeredRecord


class Replaced(Change, frozen=True):
    """A timeline that replaces the previous one. If `first` of the snapshot is not 0, the snapshot omits that many
    segments at the start: subtract `first` from `keep` of later deltas."""

    snapshot: SnapshotRecord


class Course(ServerMessage, frozen=True):
    """The state of the cell over time (parts, signals, sensors), starting at time `since` [s] (absent: at the start).
    In each list of `rows`, the rows replace all known rows that begin at `since` or later. The state is known up to
    `until` [s]; absent: without end."""

    rows: CourseRows
    since: float | None = None
    until: float | None = None


class Contacts(ServerMessage, frozen=True):
    """The contacts between `since` and `until` [s] (absent: without end). They replace all contacts known before for
    this interval."""

    touches: tuple[ContactSpan, ...]
    since: float
    until: float | None = None


class Missed(ServerMessage, frozen=True):
    """The client was too slow: the server left out `count` changes. A `replaced` message with the whole state
    follows."""

    count: Count


class Sample(ServerMessage, frozen=True):
    """The joints at time `t` [s] according to timeline `version`; `clock`: the robot's clock at sending [s]. `wrong`: a
    command has changed the timeline after this time [s], so samples already sent for later times are wrong.
    """

    t: float
    joints: Joints
    version: Count = 0
    clock: float = 0.0
    wrong: float | None = None


class Activity(ServerMessage, frozen=True):
    """The client that has the lease (empty: none) and the running programs. Sent to all clients at each change."""

    driver: str = ""
    programs: tuple[str, ...] = ()


class Pulled(ServerMessage, frozen=True):
    """The user who drags the tool, the tool's distance from the target, and the limit that stops it. Sent to all
    clients at each change."""

    state: PulledState


class Lease(Numbered, frozen=True):
    """The client that has the lease; empty: none."""

    holder: str
    notice: Notice | None = None


# --- from the server: answers ---------------------------------------------------------------------------------------


class Shown(Result, frozen=True):
    """The answer to `window`. `number`: the number of the last change that the snapshot contains; a client that has a
    later change asks again. `begin`: the start of the snapshot [s]. It is later than requested if the snapshot would
    otherwise be too long for one message."""

    snapshot: SnapshotRecord
    number: Count = 0
    begin: float = 0.0


class Present(Result, frozen=True):
    """The answer to `who`: the robots that the token allows, the clients of this robot, and the client that has the
    lease."""

    robots: tuple[str, ...]
    holders: tuple[str, ...]
    driver: str = ""


class StoredFile(Struct, frozen=True):
    """A file. `size`: its length [bytes]; `changed`: the time of its last change by the server's clock [s]."""

    name: str
    size: int
    changed: float = 0.0


class Listed(Result, frozen=True):
    """The answer to `names`."""

    files: tuple[StoredFile, ...] = ()


# --- from the server: a body ------------------------------------------------------------------------------------------


class Embodied(Result, frozen=True):
    """The answer to `embody`. `next`: the number of the first report that the server lacks. `mode`, `at`: as in
    `bodyorder`.
    """

    next: Count = 0
    mode: BodyMode = BodyMode.FOLLOWS
    at: float = 0.0


class BodyOrder(Numbered, frozen=True):
    """An order to the body: from time `at` [s] on, follow the timeline or hold still."""

    mode: BodyMode
    at: float


class BodyReleased(Numbered, frozen=True):
    """The client is no longer the body."""


class BodyStatus(ServerMessage, frozen=True):
    """The state of the robot's body (`body` absent: there is none). `unknown`: the time since which reports are missing
    [s]. Sent to all clients at each change; if only counts and clock change, at most once a second.
    """

    body: BodySeen | None = None
    unknown: float | None = None


class Measurements(ServerMessage, ReportRows, frozen=True, kw_only=True):
    """Reports of the body for subscribers, in the order of arrival. `first`: the number of the first report, counted
    since the start of the robot. If reports before it are missing, the client was too slow; `measuredwindow` asks for
    them.
    """

    first: Count


class ShownMeasured(Result, frozen=True):
    """The answer to `measuredwindow`. `told`: all reports before this number, as counted in `measurements`, are
    included. `goes_on`: the reports do not fit into one message; ask again, from the last time received."""

    parts: tuple[ReportRows, ...] = ()
    told: Count = 0
    goes_on: bool = False


class Alarm(Numbered, frozen=True):
    """An alarm: the measured robot differs from the timeline."""

    alarm: DivergenceAlarm


# --- from the server: a class ---------------------------------------------------------------------------------------


class StudentState(Struct, frozen=True, omit_defaults=True):
    """A student: the student's own `robots`, the number of connections (`here`), and the robot used last (`at`).
    `help`: the time when the student asked for help, in seconds since 1970; null if the student needs none. `lesson`,
    `step`, `of`: the current lesson, the step in it, and the number of its steps. `handed_in`: the names of the
    hand-ins, the newest last."""

    name: str
    robots: tuple[str, ...] = ()
    here: Count = 0
    at: str = ""
    help: float | None = None
    lesson: str = ""
    step: Count = 0
    of: Count = 0
    handed_in: tuple[str, ...] = ()


class ClassState(ServerMessage, frozen=True):
    """The state of the class, sent when it changes. A student gets only the student's own state; a teacher who sent
    `watchclass` gets the state of all students. `frozen`: commands of students are refused."""

    frozen: bool = False
    students: tuple[StudentState, ...] = ()


class LessonText(Numbered, frozen=True):
    """A part of a lesson in Markdown: a step, a hint, or what the student still has to do. `title`: the title of the
    lesson; `step`: the number of the current step out of `of` steps, counted from 1."""

    text: str
    title: str = ""
    step: Count = 0
    of: Count = 0


class Announced(Numbered, frozen=True):
    """A message that the teacher sent to this student."""

    by: str
    text: str


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
    | Course
    | Contacts
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
    | ClassState
    | Announced
    | LessonText
    | Embodied
    | BodyOrder
    | BodyReleased
    | BodyStatus
    | Measurements
    | ShownMeasured
    | Alarm
)
