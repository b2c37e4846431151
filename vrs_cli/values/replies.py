"""Replies of monitor commands as values, without terminals, colours or columns (`render` adds these). Units are metres,
radians, seconds; `render` converts them to millimetres and degrees."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum

from msgspec import Struct

from vrs_cli.errors import VrsError
from vrs_cli.kinematics.joints import TURNING, Configuration, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.values import measured, results
from vrs_cli.values.diagnostics import Diagnostic, LineRefused, Severity, in_order
from vrs_cli.values.results import TaggedValue
from vrs_cli.values.world import Contact

# --- messages ------------------------------------------------------------------------------------------------------


class Tone(Enum):
    """The tone of a message: NOTE reports what was done; WARNING and ERROR report a mistake."""

    NOTE = "note"
    WARNING = "warning"
    ERROR = "error"


class Message(TaggedValue, frozen=True):
    """A message of one or more lines."""

    text: str
    tone: Tone = Tone.NOTE


class Diagnosed(Struct, frozen=True):
    """A diagnostic with its source line. `path` is None for typed input."""

    diagnostic: Diagnostic
    source_line: str
    path: str | None = None


class DiagnosticsReport(TaggedValue, frozen=True):
    """The mistakes in a line or a file, sorted by line."""

    items: tuple[Diagnosed, ...]


class ProgramStopped(TaggedValue, frozen=True):
    """The message that a program stopped early. `what`: VAL-II's word or message for the stop; `step` counts from 1.
    `source`: the text of the step, empty if there is none."""

    what: str
    program: str
    step: int
    source: str = ""
    tone: Tone = Tone.NOTE


# --- positions and values ------------------------------------------------------------------------------------------


class Whereabouts(TaggedValue, frozen=True):
    """The answer to WHERE. `stamped`: also show the time, because the user gave a time or the clock runs in real
    time."""

    position: results.Position
    stamped: bool = False
    units: JointUnits = TURNING


class WhereaboutsTable(TaggedValue, frozen=True):
    """The answer to WHERE FROM t1 TO t2 STEP dt: positions at these times."""

    positions: tuple[results.Position, ...]
    units: JointUnits = TURNING


class MeasuredWhereabouts(TaggedValue, frozen=True):
    """The answer to WHERE MEASURED. `is_last`: this is the last report; nothing is known after it."""

    at: measured.MeasuredPosition
    is_last: bool = False
    units: JointUnits = TURNING


class PartRow(Struct, frozen=True):
    """A part of the cell at a time [s]; T_world_part is None for an absent part. `on`: the body on which the part
    rests."""

    name: str
    time: float
    T_world_part: Transform | None
    held: bool = False
    on: str = ""


class PartTable(TaggedValue, frozen=True):
    """The answer to PARTS, and to WHERE of a part. `stamped`: also show the time, because the user gave a time or the
    clock runs in real time."""

    rows: tuple[PartRow, ...]
    stamped: bool = False


class BodyKind(Enum):
    """The kind of an object in the picture of SHOW."""

    FIXTURE = "fixture"
    PART = "part"
    HELD = "held"
    SENSOR = "sensor"
    SENSOR_ON = "sensor on"


class PicturedBody(Struct, frozen=True):
    """An object near the arm, as points [m]. In any view, the outline of the object is the convex hull of these
    points."""

    kind: BodyKind
    points: tuple[Vector, ...]


class ArmPicture(TaggedValue, frozen=True, tag="Picture"):
    """The picture of SHOW: the arm at one time, as points in the world [m]. `links`: points from the base to the
    flange, including the corners of links; `joints`: those points that are joints. `past`, `planned`: the path of the
    tool tip, as lines; `target`: the end of the current motion. `reach`: the outermost positions of the tool tip.
    `stamped`: show the time. `bodies`: the objects of the cell."""

    position: results.Position
    links: tuple[Vector, ...]
    joints: tuple[Vector, ...]
    past: tuple[tuple[Vector, ...], ...]
    planned: tuple[tuple[Vector, ...], ...]
    target: Vector | None
    reach: tuple[Vector, ...]
    stamped: bool = False
    bodies: tuple[PicturedBody, ...] = ()


class ReachReport(TaggedValue, frozen=True):
    """The answer to WHY: the text of the location, and the result. `move_contact`, `line_contact`: the first contacts
    of MOVE and of MOVES to the location."""

    name: str
    reach: results.Reach
    units: JointUnits = TURNING
    move_contact: Contact | None = None
    line_contact: Contact | None = None


class NamedLocation(Struct, frozen=True):
    """A named location: its transformation, or the joints of a precision point; both are None if the name is
    undefined."""

    name: str
    pose: Transform | None = None
    joints: Joints | None = None

    @classmethod
    def of(cls, name: str, value: Transform | Joints) -> NamedLocation:
        return cls(name, value) if isinstance(value, Transform) else cls(name, None, value)


class LocationTable(TaggedValue, frozen=True):
    """The locations shown by LISTL, HERE, POINT, TOOL and BASE."""

    rows: tuple[NamedLocation, ...]
    units: JointUnits = TURNING


class RealTable(TaggedValue, frozen=True):
    """The answer to LISTR: names or expressions as typed, and their values. `truths`: show the values as TRUE or
    FALSE."""

    rows: tuple[tuple[str, float], ...]
    truths: bool = False


class StringTable(TaggedValue, frozen=True):
    """The answer to LISTS: names and strings."""

    rows: tuple[tuple[str, str], ...]


# --- programs ------------------------------------------------------------------------------------------------------


class ListedStep(Struct, frozen=True):
    """A step as LISTP shows it; `bad`: the step could not be read."""

    number: int
    text: str
    bad: bool = False


class ProgramText(TaggedValue, frozen=True):
    """The answer to LISTP: the header line and the indented steps."""

    header: str
    steps: tuple[ListedStep, ...]


class ProgramPart(TaggedValue, frozen=True):
    """A reply of EDIT: some steps of a program. `header` is set only in the reply that opens EDIT."""

    header: str
    steps: tuple[ListedStep, ...]


class FileText(TaggedValue, frozen=True):
    """The answer to FLIST: the lines of a text file."""

    lines: tuple[str, ...]


class FileRow(Struct, frozen=True):
    """A row of FDIRECTORY: `size` in bytes, None for a folder."""

    name: str
    size: int | None


class FileTable(TaggedValue, frozen=True):
    """The answer to FDIRECTORY: the files of a folder."""

    folder: str
    rows: tuple[FileRow, ...]


class ProgramName(Struct, frozen=True):
    """A row of DIRECTORY: the name of a program and the number of its steps."""

    name: str
    executable: bool
    steps: int
    comment: str = ""


class ProgramNames(TaggedValue, frozen=True):
    """The answer to DIRECTORY: the programs in memory."""

    rows: tuple[ProgramName, ...]


class Progress(Struct, frozen=True):
    """The progress of a program. `step` counts from 1; `cycles_left` is None for an endless run."""

    program: str
    state: str
    step: int | None
    cycles_done: int
    cycles_left: int | None


class StatusReport(TaggedValue, frozen=True):
    """The answer to STATUS. Speeds in percent, times in seconds; `progress` is None before the first run.
    `next_motion`: settings that apply only to the next motion, as VAL-II words."""

    robot: str
    progress: Progress | None
    monitor_speed: float
    program_speed: str
    power: bool
    clock: float
    end: float
    configuration: Configuration
    next_motion: tuple[str, ...] = ()


class StatusThen(TaggedValue, frozen=True):
    """The answer to STATUS AT t [s]: the `motion` at that time, empty if the robot is at rest; `hand` from 0 (closed)
    to 1 (open); the signals that are `on`, and the names of the named signals."""

    time: float
    motion: str
    configuration: Configuration
    hand: float
    on: tuple[int, ...] = ()
    names: Mapping[int, str] = {}


# --- settings and the system ---------------------------------------------------------------------------------------


class SignalBank(Struct, frozen=True):
    """Consecutive signals, beginning with number `first`. `names`: the names of the named signals."""

    title: str
    first: int
    states: tuple[bool, ...]
    names: Mapping[int, str] = {}


class SignalTable(TaggedValue, frozen=True):
    """The answer to IO: the states of signals."""

    banks: tuple[SignalBank, ...]


class SettingRow(Struct, frozen=True):
    """A setting with its value and its meaning."""

    name: str
    value: str
    summary: str


class SettingTable(TaggedValue, frozen=True):
    """The answer to SWITCH, PARAMETER and SPEED: the requested settings."""

    title: str
    rows: tuple[SettingRow, ...]


class ClockReport(TaggedValue, frozen=True):
    """The answer to TIME and CLOCK: the robot clock [s], and its rate relative to real time."""

    clock: float
    rate: float | None = None
    paused: bool = False


class BodyReport(TaggedValue, frozen=True):
    """The answer to BODY: the state of the measured arm, real or simulated (None: no arm has reported). `unknown` [s]:
    the time at which the measurements stopped. `on_alarm`: the reaction to alarms; `alarm`: the last alarm, while the
    arm still differs from the timeline."""

    body: measured.BodySeen | None = None
    unknown: float | None = None
    on_alarm: measured.OnAlarm = measured.OnAlarm.WARN
    alarm: measured.DivergenceAlarm | None = None


class Resynchronised(TaggedValue, frozen=True):
    """The message that RESYNC has finished; `units`: the units in which `distances` are shown."""

    report: measured.ResyncReport
    units: JointUnits


class Identification(TaggedValue, frozen=True):
    """The answer to ID. `robot` is the title of the model, `name` its name on a command line."""

    version: str
    python: str
    robot: str
    name: str
    joint_count: int


class FreeReport(TaggedValue, frozen=True):
    """The answer to FREE: the contents of the memory, and the free share of the computer's memory [%], None if
    unknown."""

    programs: int
    steps: int
    variables: int
    segments: int
    percent: float | None


# --- help ----------------------------------------------------------------------------------------------------------


class HelpGroup(Struct, frozen=True):
    """A group of words in the overview of HELP."""

    title: str
    words: tuple[str, ...]


class HelpOverview(TaggedValue, frozen=True):
    """The answer to HELP: all words, in groups."""

    groups: tuple[HelpGroup, ...]


class HelpTopic(TaggedValue, frozen=True):
    """The answer to HELP with a topic: forms of words, or keys, with their meanings."""

    title: str
    rows: tuple[tuple[str, str], ...]


class HelpEntry(Struct, frozen=True):
    """One meaning of a word. `sort`: "instruction", "function" and so on."""

    sort: str
    form: str
    summary: str
    example: str = ""
    where: str = ""
    note: str = ""


class HelpPage(TaggedValue, frozen=True):
    """The answer to HELP with a word: the meanings of the word."""

    word: str
    entries: tuple[HelpEntry, ...]


# --- the timeline --------------------------------------------------------------------------------------------------


class Displaced(TaggedValue, frozen=True):
    """The effect of a command on motions that were scheduled earlier."""

    displacement: results.Displacement


class NoLongerTrue(TaggedValue, frozen=True):
    """The signal readings that no longer hold after a command."""

    readings: tuple[results.Untrue, ...]


class SegmentRow(Struct, frozen=True):
    """A segment from `start` to `finish` [s], with the number and the text of its motion."""

    motion: int
    text: str
    start: float
    finish: float
    phase: str
    space: str


class TimelineTable(TaggedValue, frozen=True):
    """The answer to TIMELINE: the commands and their segments. `stops`: segments at which a motion stops before its
    end; `untrue`: signal readings that no longer hold."""

    commands: tuple[results.CommandRecord, ...]
    segments: tuple[SegmentRow, ...]
    stops: tuple[SegmentRow, ...]
    clock: float
    untrue: tuple[results.Untrue, ...] = ()


class BranchRow(Struct, frozen=True):
    """A branch: the number of its commands in effect, the end of its timeline, and its clock [s]."""

    name: str
    present: bool
    commands: int
    end: float
    clock: float


class BranchTable(TaggedValue, frozen=True):
    """The answer to BRANCH: all branches."""

    rows: tuple[BranchRow, ...]


class ComparisonTable(TaggedValue, frozen=True):
    """The answer to COMPARE: two branches by name, and their difference."""

    a: str
    b: str
    comparison: results.Comparison
    units: JointUnits = TURNING


class MeasuredComparisonTable(TaggedValue, frozen=True):
    """The answer to COMPARE MEASURED: the measured joints compared with the timeline of a branch."""

    branch: str
    comparison: measured.MeasuredComparison
    units: JointUnits = TURNING


class Curve(Struct, frozen=True):
    """A curve of a plot; `mark`: the character that draws the curve without colours."""

    label: str
    mark: str
    values: tuple[float, ...]


class Plot(TaggedValue, frozen=True):
    """The answer to PLOT: curves over the same times [s], in the displayed unit."""

    title: str
    unit: str
    times: tuple[float, ...]
    curves: tuple[Curve, ...]


class ReplayRow(Struct, frozen=True):
    """The position of the tool at the end [s] of a motion, with the motion's number and text."""

    motion: int
    text: str
    end: float
    T_world_tool: Transform


class ReplayTable(TaggedValue, frozen=True):
    """The answer to REPLAY if there is no animation: the initial pose, and the end of each motion."""

    rows: tuple[ReplayRow, ...]


class Farewell(TaggedValue, frozen=True):
    """The answer to EXIT and QUIT: the shell ends."""


Reply = (
    Message
    | DiagnosticsReport
    | ProgramStopped
    | Whereabouts
    | WhereaboutsTable
    | MeasuredWhereabouts
    | PartTable
    | ArmPicture
    | ReachReport
    | LocationTable
    | RealTable
    | StringTable
    | ProgramText
    | ProgramPart
    | ProgramNames
    | FileText
    | FileTable
    | StatusReport
    | StatusThen
    | SignalTable
    | SettingTable
    | ClockReport
    | BodyReport
    | Resynchronised
    | Identification
    | FreeReport
    | HelpOverview
    | HelpTopic
    | HelpPage
    | Displaced
    | NoLongerTrue
    | TimelineTable
    | BranchTable
    | ComparisonTable
    | MeasuredComparisonTable
    | Plot
    | ReplayTable
    | results.ExplainOverview
    | results.MotionReport
    | results.ChainReport
    | results.AnglesReport
    | results.InverseReport
    | results.SpliceReport
    | Farewell
)

StyledLine = tuple[tuple[str, str], ...]  # a line of a drawn reply: pieces of text, each with the name of its style


def is_error(reply: Reply) -> bool:
    """Return whether a reply reports a failure."""
    if isinstance(reply, DiagnosticsReport):
        return any(item.diagnostic.severity is Severity.ERROR for item in reply.items)
    return isinstance(reply, Message | ProgramStopped) and reply.tone is Tone.ERROR


def report(diagnostics: Iterable[Diagnostic], text: str, path: str | None = None) -> DiagnosticsReport:
    """Return a report of the diagnostics of a program text, sorted, with their source lines."""
    lines = dict(enumerate(text.split("\n"), 1))  # a dict, because a diagnostic may point past the last line
    return DiagnosticsReport(tuple(Diagnosed(one, lines.get(one.span.line, ""), path) for one in in_order(diagnostics)))


def refusal(error: VrsError, line: str) -> Reply:
    """Return the reply to a line that was refused, with the position of the mistake if it is known."""
    if isinstance(error, LineRefused):
        return DiagnosticsReport((Diagnosed(error.diagnostic, line),))
    return Message(str(error), Tone.ERROR)
