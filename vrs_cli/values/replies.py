"""Replies of monitor commands, as values: they know nothing of terminals, colours or columns (`render` does).

Metres, radians, seconds; `render` shows millimetres and degrees.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum

from msgspec import Struct

from vrs_cli.errors import VrsError
from vrs_cli.kinematics.joints import TURNING, Configuration, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.values import measured, results
from vrs_cli.values.diagnostics import Diagnostic, LineRefused, Severity, in_order
from vrs_cli.values.tagged import Spoken
from vrs_cli.values.world import Contact

# --- messages ------------------------------------------------------------------------------------------------------


class Tone(Enum):
    """NOTE says what happened; WARNING and ERROR are about a mistake."""

    NOTE = "note"
    WARNING = "warning"
    ERROR = "error"


class Message(Spoken, frozen=True):
    """One line of text, or a few."""

    text: str
    tone: Tone = Tone.NOTE


class Diagnosed(Struct, frozen=True):
    """A diagnostic with the source line that it points into. `path` is None for what was typed."""

    diagnostic: Diagnostic
    source_line: str
    path: str | None = None


class DiagnosticsReport(Spoken, frozen=True):
    """The mistakes in a line or a file, in the order of the lines."""

    items: tuple[Diagnosed, ...]


class ProgramStopped(Spoken, frozen=True):
    """A program ended before its end: `what` is VAL-II's word or message for it, `step` counts from 1.

    `source` is the text of the step, empty where there is none to show.
    """

    what: str
    program: str
    step: int
    source: str = ""
    tone: Tone = Tone.NOTE


# --- positions and values ------------------------------------------------------------------------------------------


class Whereabouts(Spoken, frozen=True):
    """WHERE. `stamped`: the time is shown; it was asked for, or passes by itself."""

    position: results.Position
    stamped: bool = False
    units: JointUnits = TURNING


class WhereaboutsTable(Spoken, frozen=True):
    """WHERE FROM t1 TO t2 STEP dt."""

    positions: tuple[results.Position, ...]
    units: JointUnits = TURNING


class MeasuredWhereabouts(Spoken, frozen=True):
    """WHERE MEASURED. `is_last`: it is the last report, from which on all is unknown."""

    at: measured.MeasuredPosition
    is_last: bool = False
    units: JointUnits = TURNING


class PartRow(Struct, frozen=True):
    """A part of the cell at a time [s]; T_world_part is None for one that is not there. `on`: what it stands on."""

    name: str
    time: float
    T_world_part: Transform | None
    held: bool = False
    on: str = ""


class PartTable(Spoken, frozen=True):
    """PARTS, and WHERE of a part. `stamped`: the time is shown: it was asked for, or passes by itself."""

    rows: tuple[PartRow, ...]
    stamped: bool = False


class BodyKind(Enum):
    """What a body in a picture is."""

    FIXTURE = "fixture"
    PART = "part"
    HELD = "held"
    SENSOR = "sensor"
    SENSOR_ON = "sensor on"


class PicturedBody(Struct, frozen=True):
    """A body near the arm: points [m] whose convex outline it has, as seen from any side."""

    kind: BodyKind
    points: tuple[Vector, ...]


class ArmPicture(Spoken, frozen=True, tag="Picture"):
    """SHOW: the arm at one time, as points in the world [m].

    `links`: from the base to the flange, a corner where a link has one; `joints` of them are joints. `past`, `planned`:
    the way of the tool tip, as lines; `target`: where the motion under way ends. `reach`: the outermost places of the
    tool tip. `stamped`: the time was asked for. `bodies`: of the cell.
    """

    position: results.Position
    links: tuple[Vector, ...]
    joints: tuple[Vector, ...]
    past: tuple[tuple[Vector, ...], ...]
    planned: tuple[tuple[Vector, ...], ...]
    target: Vector | None
    reach: tuple[Vector, ...]
    stamped: bool = False
    bodies: tuple[PicturedBody, ...] = ()


class ReachReport(Spoken, frozen=True):
    """WHY: the text of the location, and what was found. `move_contact`, `line_contact`: the first contacts of MOVE and
    of MOVES.
    """

    name: str
    reach: results.Reach
    units: JointUnits = TURNING
    move_contact: Contact | None = None
    line_contact: Contact | None = None


class NamedLocation(Struct, frozen=True):
    """A transformation, or the joints of a precision point; neither where it is not defined."""

    name: str
    pose: Transform | None = None
    joints: Joints | None = None

    @classmethod
    def of(cls, name: str, value: Transform | Joints) -> NamedLocation:
        return cls(name, value) if isinstance(value, Transform) else cls(name, None, value)


class LocationTable(Spoken, frozen=True):
    """LISTL, HERE, POINT, TOOL, BASE."""

    rows: tuple[NamedLocation, ...]
    units: JointUnits = TURNING


class RealTable(Spoken, frozen=True):
    """LISTR: a name or the text of an expression, and its value. `truths`: the values say whether something is so."""

    rows: tuple[tuple[str, float], ...]
    truths: bool = False


class StringTable(Spoken, frozen=True):
    """LISTS."""

    rows: tuple[tuple[str, str], ...]


# --- programs ------------------------------------------------------------------------------------------------------


class ListedStep(Struct, frozen=True):
    """A step as LISTP shows it; `bad`: it could not be read."""

    number: int
    text: str
    bad: bool = False


class ProgramText(Spoken, frozen=True):
    """LISTP: the header line, and the steps indented."""

    header: str
    steps: tuple[ListedStep, ...]


class ProgramPart(Spoken, frozen=True):
    """EDIT: some steps of a program; its header on entry, otherwise ""."""

    header: str
    steps: tuple[ListedStep, ...]


class FileText(Spoken, frozen=True):
    """FLIST: a text file, line by line."""

    lines: tuple[str, ...]


class FileRow(Struct, frozen=True):
    """A row of FDIRECTORY: `size` in bytes, None for a folder."""

    name: str
    size: int | None


class FileTable(Spoken, frozen=True):
    """FDIRECTORY."""

    folder: str
    rows: tuple[FileRow, ...]


class ProgramName(Struct, frozen=True):
    """A row of DIRECTORY. `steps` is how many."""

    name: str
    executable: bool
    steps: int
    comment: str = ""


class ProgramNames(Spoken, frozen=True):
    """DIRECTORY."""

    rows: tuple[ProgramName, ...]


class Progress(Struct, frozen=True):
    """The progress of a program. `step` counts from 1; `cycles_left` is None when it runs for ever."""

    program: str
    state: str
    step: int | None
    cycles_done: int
    cycles_left: int | None


class StatusReport(Spoken, frozen=True):
    """STATUS. Speeds in percent, times in seconds; `progress` is None when nothing was run yet.

    `next_motion`: what was said for the next motion alone, in the words of the language.
    """

    robot: str
    progress: Progress | None
    monitor_speed: float
    program_speed: str
    power: bool
    clock: float
    end: float
    configuration: Configuration
    next_motion: tuple[str, ...] = ()


class StatusThen(Spoken, frozen=True):
    """STATUS AT t [s]: the `motion` that is under way then, empty where the robot stands; `hand` from 0, closed, to 1,
    open; the signals that are `on`, and what some of them are called.
    """

    time: float
    motion: str
    configuration: Configuration
    hand: float
    on: tuple[int, ...] = ()
    names: Mapping[int, str] = {}


# --- settings and the system ---------------------------------------------------------------------------------------


class SignalBank(Struct, frozen=True):
    """Consecutive signals from number `first` on; `names`: what some of them are called."""

    title: str
    first: int
    states: tuple[bool, ...]
    names: Mapping[int, str] = {}


class SignalTable(Spoken, frozen=True):
    """IO."""

    banks: tuple[SignalBank, ...]


class SettingRow(Struct, frozen=True):
    name: str
    value: str
    summary: str


class SettingTable(Spoken, frozen=True):
    """SWITCH, PARAMETER, SPEED: the settings asked for and what each does."""

    title: str
    rows: tuple[SettingRow, ...]


class ClockReport(Spoken, frozen=True):
    """TIME, CLOCK: the robot clock [s], and in real time its rate."""

    clock: float
    rate: float | None = None
    paused: bool = False


class BodyReport(Spoken, frozen=True):
    """BODY: what is known of the robot's body (None: there is none, and nothing was reported), since when nothing was
    measured [s], what is done on an alarm, and the last alarm while the body differs.
    """

    body: measured.BodySeen | None = None
    unknown: float | None = None
    on_alarm: measured.OnAlarm = measured.OnAlarm.WARN
    alarm: measured.DivergenceAlarm | None = None


class Resynchronised(Spoken, frozen=True):
    """RESYNC was done; `distances` are to be shown in these units."""

    report: measured.ResyncReport
    units: JointUnits


class Identification(Spoken, frozen=True):
    """ID. `robot` is the title of the model, `name` what it is called on a command line."""

    version: str
    python: str
    robot: str
    name: str
    joint_count: int


class FreeReport(Spoken, frozen=True):
    """FREE: what is in memory, and how much of the computer's memory is left (percent; None where it is not known)."""

    programs: int
    steps: int
    variables: int
    segments: int
    percent: float | None


# --- help ----------------------------------------------------------------------------------------------------------


class HelpGroup(Struct, frozen=True):
    title: str
    words: tuple[str, ...]


class HelpOverview(Spoken, frozen=True):
    """HELP: every word, in groups."""

    groups: tuple[HelpGroup, ...]


class HelpTopic(Spoken, frozen=True):
    """HELP topic: forms of words, or keys, and what each does."""

    title: str
    rows: tuple[tuple[str, str], ...]


class HelpEntry(Struct, frozen=True):
    """One meaning of a word. `sort` is what it is ("instruction", "function", ...)."""

    sort: str
    form: str
    summary: str
    example: str = ""
    where: str = ""
    note: str = ""


class HelpPage(Spoken, frozen=True):
    """HELP word."""

    word: str
    entries: tuple[HelpEntry, ...]


# --- the timeline --------------------------------------------------------------------------------------------------


class Displaced(Spoken, frozen=True):
    """The effect of a command on motions that were scheduled already."""

    displacement: results.Displacement


class NoLongerTrue(Spoken, frozen=True):
    """What a command did to what programs have read of signals."""

    readings: tuple[results.Untrue, ...]


class SegmentRow(Struct, frozen=True):
    """A segment of the motion with this number and text, from `start` to `finish` [s]."""

    motion: int
    text: str
    start: float
    finish: float
    phase: str
    space: str


class TimelineTable(Spoken, frozen=True):
    """TIMELINE: the commands and what the planner made of them; `stops`: segments after which a motion rests on its
    way; `untrue`: what programs have read of signals and no longer holds."""

    commands: tuple[results.CommandRecord, ...]
    segments: tuple[SegmentRow, ...]
    stops: tuple[SegmentRow, ...]
    clock: float
    untrue: tuple[results.Untrue, ...] = ()


class BranchRow(Struct, frozen=True):
    """A branch: how many commands hold on it, when its timeline ends, and its clock [s]."""

    name: str
    present: bool
    commands: int
    end: float
    clock: float


class BranchTable(Spoken, frozen=True):
    """BRANCH."""

    rows: tuple[BranchRow, ...]


class ComparisonTable(Spoken, frozen=True):
    """COMPARE: two branches by name, and what is different."""

    a: str
    b: str
    comparison: results.Comparison
    units: JointUnits = TURNING


class MeasuredComparisonTable(Spoken, frozen=True):
    """COMPARE MEASURED: the reports of the body beside the timeline of a branch."""

    branch: str
    comparison: measured.MeasuredComparison
    units: JointUnits = TURNING


class Curve(Struct, frozen=True):
    """One line of a plot: `mark` is the character that draws it where there are no colours."""

    label: str
    mark: str
    values: tuple[float, ...]


class Plot(Spoken, frozen=True):
    """PLOT: curves over the same times [s], already in the unit that is shown."""

    title: str
    unit: str
    times: tuple[float, ...]
    curves: tuple[Curve, ...]


class ReplayRow(Struct, frozen=True):
    """The place of the tool when the motion with this number and text ends [s]."""

    motion: int
    text: str
    end: float
    T_world_tool: Transform


class ReplayTable(Spoken, frozen=True):
    """REPLAY where nothing can be animated: the initial pose, and the end of each motion."""

    rows: tuple[ReplayRow, ...]


class Farewell(Spoken, frozen=True):
    """EXIT, QUIT: the shell ends."""


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

StyledLine = tuple[tuple[str, str], ...]  # a line of a drawn reply: runs of text, each with the name of its style


def is_error(reply: Reply) -> bool:
    """Return whether a reply says that something could not be done."""
    if isinstance(reply, DiagnosticsReport):
        return any(item.diagnostic.severity is Severity.ERROR for item in reply.items)
    return isinstance(reply, Message | ProgramStopped) and reply.tone is Tone.ERROR


def report(diagnostics: Iterable[Diagnostic], text: str, path: str | None = None) -> DiagnosticsReport:
    """Findings in a text with their lines, in order."""
    lines = dict(enumerate(text.split("\n"), 1))  # a finding may stand behind the last
    items = (Diagnosed(one, lines.get(one.span.line, ""), path) for one in in_order(diagnostics))
    return DiagnosticsReport(tuple(items))


def refusal(error: VrsError, line: str) -> Reply:
    """The reply for a line that cannot be carried out, with its place where that is known."""
    if isinstance(error, LineRefused):
        return DiagnosticsReport((Diagnosed(error.diagnostic, line),))
    return Message(str(error), Tone.ERROR)
