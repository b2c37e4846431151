"""What monitor commands answer, as values: they know nothing of terminals, colours or columns (`render` does).

Metres, radians, seconds; `render` shows millimetres and degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from vrs_cli.kinematics.joints import TURNING, JointUnits

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from vrs_cli.engine.comparison import Comparison
    from vrs_cli.engine.displacement import Displacement
    from vrs_cli.engine.history import CommandRecord
    from vrs_cli.engine.position import Position
    from vrs_cli.engine.reach import Reach
    from vrs_cli.kinematics.configuration import Configuration
    from vrs_cli.kinematics.joints import Joints
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.kinematics.transform import Transform
    from vrs_cli.language.text.diagnostics import Diagnostic
    from vrs_cli.trajectory.timeline import Timeline


# --- messages ------------------------------------------------------------------------------------------------------


class Tone(Enum):
    """NOTE says what happened; WARNING and ERROR are about a mistake."""

    NOTE = "note"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class Message:
    """One line of text, or a few."""

    text: str
    tone: Tone = Tone.NOTE


@dataclass(frozen=True, slots=True)
class Diagnosed:
    """A diagnostic with the source line that it points into. `path` is None for what was typed."""

    diagnostic: Diagnostic
    source_line: str
    path: str | None = None


@dataclass(frozen=True, slots=True)
class DiagnosticsReport:
    """What is wrong with a line or a file, in the order of the lines."""

    items: tuple[Diagnosed, ...]


@dataclass(frozen=True, slots=True)
class ProgramStopped:
    """A program ended before its end: `what` is VAL-II's word or message for it, `step` counts from 1.

    `source` is the text of the step, empty where there is none to show.
    """

    what: str
    program: str
    step: int
    source: str = ""
    tone: Tone = Tone.NOTE


# --- positions and values ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Whereabouts:
    """WHERE. `stamped`: the time was asked for, and is shown."""

    position: Position
    stamped: bool = False
    units: JointUnits = TURNING


@dataclass(frozen=True, slots=True)
class WhereaboutsTable:
    """WHERE FROM t1 TO t2 STEP dt."""

    positions: tuple[Position, ...]
    units: JointUnits = TURNING


@dataclass(frozen=True, slots=True)
class ReachReport:
    """WHY: the text of the location, and what was found."""

    name: str
    reach: Reach
    units: JointUnits = TURNING


@dataclass(frozen=True, slots=True)
class NamedLocation:
    """A transformation or the joints of a precision point; `value` is None where it is not defined."""

    name: str
    value: Transform | Joints | None


@dataclass(frozen=True, slots=True)
class LocationTable:
    """LISTL, HERE, POINT, TOOL, BASE."""

    rows: tuple[NamedLocation, ...]
    units: JointUnits = TURNING


@dataclass(frozen=True, slots=True)
class RealTable:
    """LISTR: a name or the text of an expression, and its value. `truths`: the values say whether something is so."""

    rows: tuple[tuple[str, float], ...]
    truths: bool = False


@dataclass(frozen=True, slots=True)
class StringTable:
    """LISTS."""

    rows: tuple[tuple[str, str], ...]


# --- programs ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ListedStep:
    """A step as LISTP shows it; `bad`: it could not be read."""

    number: int
    text: str
    bad: bool = False


@dataclass(frozen=True, slots=True)
class ProgramText:
    """LISTP: the header line, and the steps indented."""

    header: str
    steps: tuple[ListedStep, ...]


@dataclass(frozen=True, slots=True)
class ProgramPart:
    """EDIT: some steps of a program; its header on entry, otherwise ""."""

    header: str
    steps: tuple[ListedStep, ...]


@dataclass(frozen=True, slots=True)
class FileText:
    """FLIST: a text file, line by line."""

    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FileRow:
    """A row of FDIRECTORY: `size` in bytes, None for a folder."""

    name: str
    size: int | None


@dataclass(frozen=True, slots=True)
class FileTable:
    """FDIRECTORY."""

    folder: str
    rows: tuple[FileRow, ...]


@dataclass(frozen=True, slots=True)
class ProgramName:
    """A row of DIRECTORY. `steps` is how many."""

    name: str
    executable: bool
    steps: int
    comment: str = ""


@dataclass(frozen=True, slots=True)
class ProgramNames:
    """DIRECTORY."""

    rows: tuple[ProgramName, ...]


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a program is. `step` counts from 1; `cycles_left` is None when it runs for ever."""

    program: str
    state: str
    step: int | None
    cycles_done: int
    cycles_left: int | None


@dataclass(frozen=True, slots=True)
class StatusReport:
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


# --- settings and the system ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SignalBank:
    """Consecutive signals from number `first` on."""

    title: str
    first: int
    states: tuple[bool, ...]


@dataclass(frozen=True, slots=True)
class SignalTable:
    """IO."""

    banks: tuple[SignalBank, ...]


@dataclass(frozen=True, slots=True)
class SettingRow:
    name: str
    value: str
    summary: str


@dataclass(frozen=True, slots=True)
class SettingTable:
    """SWITCH, PARAMETER, SPEED: the settings asked for and what each does."""

    title: str
    rows: tuple[SettingRow, ...]


@dataclass(frozen=True, slots=True)
class ClockReport:
    """TIME, CLOCK: the robot clock [s], and in real time its rate."""

    clock: float
    rate: float | None = None
    paused: bool = False


@dataclass(frozen=True, slots=True)
class Identification:
    """ID."""

    version: str
    python: str
    model: RobotModel


@dataclass(frozen=True, slots=True)
class FreeReport:
    """FREE: what is in memory, and how much of the computer's memory is left (percent; None where it is not known)."""

    programs: int
    steps: int
    variables: int
    segments: int
    percent: float | None


# --- help ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class HelpGroup:
    title: str
    words: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class HelpOverview:
    """HELP: every word, in groups."""

    groups: tuple[HelpGroup, ...]


@dataclass(frozen=True, slots=True)
class HelpEntry:
    """One meaning of a word. `sort` is what it is ("instruction", "function", ...)."""

    sort: str
    form: str
    summary: str
    example: str = ""
    where: str = ""
    note: str = ""


@dataclass(frozen=True, slots=True)
class HelpPage:
    """HELP word."""

    word: str
    entries: tuple[HelpEntry, ...]


# --- the timeline --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Displaced:
    """What a command did to motions that were scheduled already."""

    displacement: Displacement


@dataclass(frozen=True, slots=True)
class TimelineTable:
    """TIMELINE: the commands and what the planner made of them."""

    commands: tuple[CommandRecord, ...]
    timeline: Timeline
    clock: float


@dataclass(frozen=True, slots=True)
class BranchRow:
    """A branch: how many commands hold on it, when its timeline ends, and its clock [s]."""

    name: str
    present: bool
    commands: int
    end: float
    clock: float


@dataclass(frozen=True, slots=True)
class BranchTable:
    """BRANCH."""

    rows: tuple[BranchRow, ...]


@dataclass(frozen=True, slots=True)
class ComparisonTable:
    """COMPARE: two branches by name, and what is different."""

    a: str
    b: str
    comparison: Comparison
    units: JointUnits = TURNING


@dataclass(frozen=True, slots=True)
class Curve:
    """One line of a plot: `mark` is the character that draws it where there are no colours."""

    label: str
    mark: str
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Plot:
    """PLOT: curves over the same times [s], already in the unit that is shown."""

    title: str
    unit: str
    times: tuple[float, ...]
    curves: tuple[Curve, ...]


@dataclass(frozen=True, slots=True)
class Replay:
    """REPLAY: a recorded trajectory, animated on a terminal and summed up elsewhere.

    `changes`: how many deltas it holds. `dropped_tail`: its last line was torn.
    """

    path: Path
    model: RobotModel
    timeline: Timeline
    changes: int
    dropped_tail: bool


@dataclass(frozen=True, slots=True)
class Farewell:
    """EXIT, QUIT: the shell ends."""


Reply = (
    Message
    | DiagnosticsReport
    | ProgramStopped
    | Whereabouts
    | WhereaboutsTable
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
    | SignalTable
    | SettingTable
    | ClockReport
    | Identification
    | FreeReport
    | HelpOverview
    | HelpPage
    | Displaced
    | TimelineTable
    | BranchTable
    | ComparisonTable
    | Plot
    | Replay
    | Farewell
)


def is_error(reply: Reply) -> bool:
    """Whether a reply says that something could not be done."""
    if isinstance(reply, DiagnosticsReport):
        from vrs_cli.language.text.diagnostics import Severity

        return any(item.diagnostic.severity is Severity.ERROR for item in reply.items)
    return getattr(reply, "tone", None) is Tone.ERROR


def report(diagnostics: Iterable[Diagnostic], text: str, path: str | None = None) -> DiagnosticsReport:
    """Findings in a text with their lines, in order."""
    lines = ["", *text.split("\n")]
    ordered = sorted(diagnostics, key=lambda one: (one.span.line, one.span.column))
    return DiagnosticsReport(tuple(Diagnosed(one, _line(lines, one.span.line), path) for one in ordered))


def _line(lines: Sequence[str], number: int) -> str:
    """A line, counted from 1; empty behind the end."""
    return lines[number] if number < len(lines) else ""
