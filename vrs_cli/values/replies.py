"""Replies of monitor commands as values, without terminals, colours or columns (`render` adds these). Units are metres,
radians, seconds; `render` converts them to millimetres and degrees."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum

from msgspec import Struct

from vrs_cli.errors import VrsError
from vrs_cli.kinematics.joints import TURNING, Configuration, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.values import measured, reports, results
from vrs_cli.values.diagnostics import Diagnostic, LineRefused, Severity, in_order
from vrs_cli.values.results import TaggedValue
from vrs_cli.values.world import Contact

# --- mistakes ---------------------------------------------------------------------------------------------------------


class Diagnosed(Struct, frozen=True):
    """A diagnostic with its source line. `path` is None for typed input."""

    diagnostic: Diagnostic
    source_line: str
    path: str | None = None


class DiagnosticsReport(TaggedValue, frozen=True):
    """The mistakes in a line or a file, sorted by line."""

    items: tuple[Diagnosed, ...]


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
    reach: reports.Reach
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


class FileTable(TaggedValue, frozen=True):
    """The answer to FDIRECTORY: the files of a folder."""

    folder: str
    rows: tuple[results.FileRow, ...]


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

    report: results.ResyncReport
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
    comparison: reports.Comparison
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


# --- EXPLAIN (`render/explained.py` lays out its answers) ------------------------------------------------------------


class Explainable(Struct, frozen=True):
    """A form of the EXPLAIN command, such as `SPLICE`, and a summary of its answer."""

    form: str
    summary: str


class ExplainOverview(TaggedValue, frozen=True):
    """The answer to EXPLAIN without an argument: the forms of EXPLAIN."""

    rows: tuple[Explainable, ...]


# --- EXPLAIN: a motion -----------------------------------------------------------------------------------------------


class CutIn(Struct, frozen=True):
    """The motion that a new motion interrupts: its number and text, its phase, the time at which that phase began [s],
    and the tool-tip speed at the interruption [m/s]."""

    number: int
    text: str
    phase: str
    since: float
    speed: float


class Stretch(Struct, frozen=True):
    """A phase of a motion, from `start` to `finish` [s]: the maximum speeds of the tool tip [m/s] and of its rotation
    [rad/s], and the joint that comes nearest to its velocity limit, with the fraction of that limit."""

    start: float
    finish: float
    phase: str
    space: str
    speed: float
    turn: float
    joint: int
    share: float


class Peak(Struct, frozen=True):
    """The maximum of a quantity in a motion, its limit, the first time at which it occurs [s], and the tool tip in the
    world at that time [m]."""

    value: float
    limit: float
    time: float
    place: Vector

    @property
    def share(self) -> float:
        return self.value / self.limit if self.limit else 0.0


class JointLoad(Struct, frozen=True):
    """The load of one joint (from 1) in a motion: maximum velocity, acceleration and jerk (None: not limited).
    `nearest`: the joint value that comes nearest to an end of the joint's range, and that end."""

    joint: int
    velocity: Peak
    acceleration: Peak
    jerk: Peak | None
    nearest: Peak

    @property
    def room(self) -> float:
        """Return the minimum distance of the joint from an end of its range [rad, m]."""
        return abs(self.nearest.limit - self.nearest.value)


class MotionPlan(Struct, frozen=True):
    """The plan of a motion that has not been commanded. `begin`, `end` [s]. `cut`: the motion that it interrupts; None
    if it begins at rest. `speed`, `acceleration`: fractions of nominal. `length`: the length of the tool tip's path
    [m]. `tip`: the maximum speed of the tool tip; its limit is the commanded speed of a straight line, otherwise 0.
    `joints`, `T_world_tool`, `configuration`: the position at the end. `displaced`: the effect on later motions;
    `contact`: the first contact of the arm; `notes`: messages that the robot would show."""

    begin: float
    end: float
    space: str
    profile: str
    speed: float
    acceleration: float
    cut: CutIn | None
    stretches: tuple[Stretch, ...]
    tip: Peak
    loads: tuple[JointLoad, ...]
    length: float
    joints: Joints
    T_world_tool: Transform
    configuration: Configuration
    path: tuple[Vector, ...] = ()
    displaced: results.Displacement | None = None
    contact: Contact | None = None
    notes: tuple[str, ...] = ()


class MotionReport(TaggedValue, frozen=True):
    """The answer to EXPLAIN for a motion, at the time `now` [s]: its plan, or the refusal, with the location where the
    motion fails if it is known."""

    text: str
    now: float
    plan: MotionPlan | None
    refusal: str = ""
    units: JointUnits = TURNING


# --- EXPLAIN: locations ----------------------------------------------------------------------------------------------


class Factor(Struct, frozen=True):
    """A named transformation T in a chain of transformations: the frames `outer` and `inner` that it connects, and the
    product of all factors up to it."""

    name: str
    outer: str
    inner: str
    T: Transform
    product: Transform


class ChainReport(TaggedValue, frozen=True):
    """The answer to EXPLAIN for a location: `factors` from the world to the location. `arm`: the factors from the world
    to the flange (BASE, the location, TOOL); inverse kinematics solves their product. `joints` [rad]: the joints of a
    precision point; its factors are the links."""

    text: str
    factors: tuple[Factor, ...]
    arm: tuple[Factor, ...] = ()
    joints: Joints = ()
    units: JointUnits = TURNING


class AnglesReport(TaggedValue, frozen=True):
    """The answer to EXPLAIN OAT: O, A, T [rad] and the rotations whose product is the orientation: Rz(O), a fixed
    matrix M, Ry(A), Rz(T). `vertical`: O and T turn about the same axis, so only their sum or difference is
    determined."""

    text: str
    T: Transform
    angles: Vector
    turns: tuple[Transform, Transform, Transform, Transform]
    vertical: bool


class SolutionSteps(Struct, frozen=True):
    """One configuration in EXPLAIN IK: the intermediate values by their symbols, and the time [s] that the slowest
    joint takes from the current position at maximum velocity; None if the configuration cannot be used."""

    option: reports.Option
    steps: Mapping[str, float] = {}
    time: float | None = None


class InverseReport(TaggedValue, frozen=True):
    """The answer to EXPLAIN IK. `method`: how the arm's joints are computed; `constants`: its lengths and angles by
    symbol. `senses`: (sign, offset) of each joint, which convert an angle of the formulas to the robot's joint, joint =
    sign (theta - offset); empty if they are equal. `chosen`: the configuration that MOVE uses, None if MOVE fails;
    `reason`: the reason for this choice."""

    text: str
    method: str
    T_robot_flange: Transform
    constants: Mapping[str, float]
    solutions: tuple[SolutionSteps, ...]
    chosen: Configuration | None
    reason: str
    here: Joints
    have: Configuration
    senses: tuple[tuple[float, float], ...] = ()
    units: JointUnits = TURNING


# --- EXPLAIN: the last change ----------------------------------------------------------------------------------------


class SegmentFate(Enum):
    """The effect of a timeline change on a segment."""

    KEPT = "kept"
    CUT = "cut"
    DROPPED = "dropped"
    PLANNED = "planned"
    AGAIN = "planned again"
    SHIFTED = "shifted"
    BACK = "given back"


class SplicedSegment(Struct, frozen=True):
    """A segment, with the number and text of its motion, and its start and finish [s] before and after a change; None
    where the segment does not exist."""

    number: int
    text: str
    phase: str
    space: str
    before: tuple[float, float] | None
    after: tuple[float, float] | None
    fate: SegmentFate


class SpliceReport(TaggedValue, frozen=True):
    """The answer to EXPLAIN SPLICE: the last change by a command, UNDO or REDO (`cause`), with the times of the command
    [s]. `earlier`: the number of unchanged segments before the rows; `later`: the number of segments after the rows,
    which are shifted by `shift` [s]."""

    text: str
    cause: str
    issued: float
    executed: float
    cut: float
    shift: float
    rows: tuple[SplicedSegment, ...]
    earlier: int = 0
    later: int = 0


# --- all replies -----------------------------------------------------------------------------------------------------


class Farewell(TaggedValue, frozen=True):
    """The answer to EXIT and QUIT: the shell ends."""


Reply = (
    results.Message
    | DiagnosticsReport
    | results.ProgramStopped
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
    | ExplainOverview
    | MotionReport
    | ChainReport
    | AnglesReport
    | InverseReport
    | SpliceReport
    | Farewell
)

StyledLine = tuple[tuple[str, str], ...]  # a line of a drawn reply: pieces of text, each with the name of its style


def is_error(reply: Reply) -> bool:
    """Return whether a reply reports a failure."""
    if isinstance(reply, DiagnosticsReport):
        return any(item.diagnostic.severity is Severity.ERROR for item in reply.items)
    return isinstance(reply, results.Message | results.ProgramStopped) and reply.tone is results.Tone.ERROR


def report(diagnostics: Iterable[Diagnostic], text: str, path: str | None = None) -> DiagnosticsReport:
    """Return a report of the diagnostics of a program text, sorted, with their source lines."""
    lines = dict(enumerate(text.split("\n"), 1))  # a dict, because a diagnostic may point past the last line
    return DiagnosticsReport(tuple(Diagnosed(one, lines.get(one.span.line, ""), path) for one in in_order(diagnostics)))


def refusal(error: VrsError, line: str) -> Reply:
    """Return the reply to a line that was refused, with the position of the mistake if it is known."""
    if isinstance(error, LineRefused):
        return DiagnosticsReport((Diagnosed(error.diagnostic, line),))
    return results.Message(str(error), results.Tone.ERROR)
