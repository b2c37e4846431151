"""Commands on the timeline: UNDO and REDO, branches, listings, and PLOT, which draws curves over time. This module
knows no terminal.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.engine.book import Parts
from vrs_cli.engine.branches import MAIN
from vrs_cli.engine.comparison import compare, compare_measured
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import PositionArrays, positions_at
from vrs_cli.errors import IllegalJoint, IllegalValue, InvalidName, UsageError
from vrs_cli.interfaces.dialogue import Dialogue, beside, in_parts
from vrs_cli.interfaces.station.operands import (
    NO_REPORT,
    Handler,
    agreed,
    is_measured,
    may_write,
    operand,
    real_or,
    word,
)
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.observations import untrue
from vrs_cli.interfaces.tasks.tasks import ROBOT_PROGRAM
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.language.text.ast import Instruction
from vrs_cli.language.words.monitor import QUANTITIES
from vrs_cli.language.words.values import whole
from vrs_cli.trajectory.segment import Segment, stops_on_the_way
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.replies import (
    BranchRow,
    BranchTable,
    ComparisonTable,
    Curve,
    MeasuredComparisonTable,
    Message,
    Plot,
    SegmentRow,
    TimelineTable,
)
from vrs_cli.values.results import CommandRecord, Untrue

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats


def _through_history(work: Callable[[Engine, int], Parts[tuple[str, ...]]], done: str) -> Handler:
    """UNDO, REDO."""

    def go(station: Station, it: Instruction) -> Dialogue[None]:
        engine, steps = station.engine, whole(real_or(station, it, 0, 1.0))
        if steps < 1:
            raise IllegalValue(f"{it.word} {steps}", "at least one command")
        texts = yield from in_parts(work(engine, steps))
        last = texts[-1] or "a motion"
        what = f"{last} is {done}" if len(texts) == 1 else f"{len(texts)} commands are {done}, up to {last}"
        yield Message(f"{what}; the clock is at {engine.now:.3f} s")

    return go


def _branch(station: Station, it: Instruction) -> Dialogue[None]:
    branches, asked = station.branches, operand(it, 0)
    if asked is None:
        yield branch_table(station)
        return
    name = word(asked)
    if not name[:1].isalpha():
        raise InvalidName(name, "a branch is named as a program is: BRANCH trial")
    if is_measured(asked):
        raise InvalidName(name, "COMPARE means what was measured by it: take another name")
    check_tasks_stand(station)
    if name in branches:
        branches.change_over(name)
        yield Message(f"On {branches.present}; the clock is at {station.engine.now:.3f} s")
    else:
        origin = branches.present
        branches.make(name)
        yield Message(f"On {name}, a new branch of {origin}; the clock is at {station.engine.now:.3f} s")


def branch_table(station: Station) -> BranchTable:
    """List all branches, main first."""
    present, rows = station.branches.present, list[BranchRow]()
    for name in station.branches.names:
        left = station.branches.left(name)
        rows.append(BranchRow(name, name == present, left.book.history.commands, left.book.timeline.end, left.clock))
    return BranchTable(tuple(rows))


def check_tasks_stand(station: Station) -> None:
    """Raises UsageError while a task waits for a time of the present branch."""
    running = next(station.tasks.running, None)
    if running is not None:
        number = "" if running.number == ROBOT_PROGRAM else f" {running.number}"
        raise UsageError(f"{running.task.program} is running", f"{{ABORT{number}}} stops it")


def _compare(station: Station, it: Instruction) -> Dialogue[None]:
    a, b = operand(it, 0), operand(it, 1)
    if is_measured(a):
        yield (yield from measured_comparison(station, station.branches.present if b is None else word(b)))
        return
    first, second = MAIN if a is None else word(a), station.branches.present if b is None else word(b)
    if first.lower() == second.lower():
        raise UsageError(f"{first} is the same as {second}", "{COMPARE a, b}; {BRANCH} lists the branches")
    yield (yield from comparison(station, first, second))


def comparison(station: Station, first: str, second: str) -> Dialogue[ComparisonTable]:
    """Compare two branches. Raises UsageError where there is no branch of a name."""
    branches = station.branches
    arm, one, other = station.engine.arm, branches.book(first).copy(), branches.book(second).copy()
    found = yield from beside(lambda: compare(arm, one, other))
    return ComparisonTable(branches.spelling(first), branches.spelling(second), found, station.units)


def measured_comparison(station: Station, branch: str) -> Dialogue[MeasuredComparisonTable]:
    """Compare what was measured with a branch. Raises UsageError where there is no such branch, or no report."""
    branches, measured = station.branches, station.engine.measured.view
    arm, timeline = station.engine.arm, branches.book(branch).timeline
    found = yield from beside(lambda: compare_measured(arm, timeline, measured))
    if found is None:
        raise UsageError(*NO_REPORT)
    return MeasuredComparisonTable(branches.spelling(branch), found, station.units)


def _merge(station: Station, it: Instruction) -> Dialogue[None]:
    asked = operand(it, 0)
    name = station.branches.spelling(station.branches.present if asked is None else word(asked))
    check_tasks_stand(station)
    again = yield from in_parts(station.branches.merging(name))
    how = f", {again} command{'' if again == 1 else 's'} of it planned again" if again else ""
    yield Message(f"{name} is merged into main{how}; the timeline ends at {station.engine.end:.3f} s")


def _deleteb(station: Station, it: Instruction) -> Dialogue[None]:
    branches = station.branches
    doomed = [branches.droppable(word(argument)) for argument in it.arguments]
    check_tasks_stand(station)
    if not (yield from agreed(station, f"{', '.join(doomed)} will be deleted.")):
        return
    for name in doomed:
        branches.drop(name)


def _timeline(station: Station, _it: Instruction) -> Dialogue[None]:
    yield (yield from motions(station))


def motions(station: Station) -> Dialogue[TimelineTable]:
    """List the present timeline."""
    engine, signals = station.engine, station.environment.signals
    timeline, commands, now = engine.timeline, engine.book.all_records(), engine.now
    wrong = tuple(untrue(engine.book, signals))
    return beside(lambda: timeline_table(timeline, commands(), now, wrong))


def timeline_table(
    timeline: Timeline, commands: tuple[CommandRecord, ...], now: float, wrong: tuple[Untrue, ...] = ()
) -> TimelineTable:
    """List a timeline, the commands in force on it, and what programs have read and no longer holds."""
    segments = [segment for segment in timeline if segment.motion.number > 0]
    stops = tuple(map(_segment_row, stops_on_the_way(segments)))
    return TimelineTable(commands, tuple(map(_segment_row, segments)), stops, now, wrong)


def _segment_row(segment: Segment) -> SegmentRow:
    motion = segment.motion
    return SegmentRow(motion.number, motion.text, segment.start, segment.finish, segment.phase.value, motion.kind.space)


def _plot(station: Station, it: Instruction) -> Dialogue[None]:
    engine = station.engine
    words, file = in_file([word(argument) for argument in it.arguments if argument is not None])
    asked = selected(engine.arm, words)
    if engine.end <= engine.timeline.start:
        yield Message("No motions yet")
    else:
        arm, timeline = engine.arm, engine.timeline
        plot = yield from beside(lambda: plotted(arm, timeline, asked))
        yield plot if not file else (yield from _drawn(station, plot, file))


def _drawn(station: Station, plot: Plot, file: str) -> Dialogue[Message]:
    """Draw a plot into a file. Raises UsageError where this robot draws no files, FileError."""
    draw, path = station.draw, station.folder.path(file)
    if draw is None:
        raise UsageError("PLOT draws no file at this robot", "PLOT alone shows the curves")
    yield from may_write(station, path)
    yield from beside(lambda: draw(path, plot))
    return Message(f"{path} written")


TIMELINE: Mapping[str, Handler] = {
    "UNDO": _through_history(Engine.undoing, "undone"),
    "REDO": _through_history(Engine.redoing, "done again"),
    "BRANCH": _branch,
    "COMPARE": _compare,
    "MERGE": _merge,
    "DELETEB": _deleteb,
    "TIMELINE": _timeline,
    "PLOT": _plot,
}


SAMPLES = 481  # more than the dots of the widest drawing need


PICTURES = (".svg", ".png", ".pdf")  # how the name of a file ends that a plot is drawn into
SYNTAX = f"PLOT {', '.join(QUANTITIES)}; joints by number: PLOT 1, 2 or PLOT VELOCITY, 1; into a file: PLOT 1, arm.svg"


IN_PYTHON = f'plot(1, 2), plot("velocity", 1), plot("X", "Z"); quantities: {", ".join(QUANTITIES).lower()}'
_JOINT = re.compile(r"[0-9]{1,3}")


class Selection(Struct, frozen=True):
    """The names of quantities on one scale, and joints from 1 (none for quantities of the tool)."""

    names: tuple[str, ...]
    joints: tuple[int, ...]


def in_file(words: Sequence[str]) -> tuple[Sequence[str], str]:
    """Separate the words for what is plotted from the file that is named last; "" where there is none."""
    named = bool(words) and words[-1].lower().endswith(PICTURES)
    return (words[:-1], words[-1]) if named else (words, "")


def selected(arm: RobotArm, words: Sequence[str]) -> Selection:
    """`PLOT`, `PLOT 1,2`, `PLOT VELOCITY,3`, `PLOT X,Z`. Raises UsageError, IllegalJoint."""
    numbers = [int(word) for word in words if _JOINT.fullmatch(word)]
    names = _chosen([word for word in words if not _JOINT.fullmatch(word)])
    first = QUANTITIES[names[0]]
    if first.joints:
        return Selection(tuple(names), tuple(_joints(arm, numbers)))
    if numbers:
        raise UsageError(f"{first.title.lower()} has no joint {numbers[0]}", SYNTAX, in_python=IN_PYTHON)
    return Selection(tuple(names), ())


def plotted(arm: RobotArm, timeline: Timeline, asked: Selection) -> Plot:
    """The curves that are asked for, over a timeline with motions."""
    import numpy as np

    first = QUANTITIES[asked.names[0]]
    times = np.linspace(timeline.start, timeline.end, SAMPLES)
    positions = positions_at(arm, timeline, times)
    if first.joints:
        units, columns = arm.model.units, getattr(positions, first.joints).T.tolist()
        curves = tuple(
            Curve(f"JT{joint}", str(joint), tuple(units.one_shown(joint, x) for x in columns[joint - 1]))
            for joint in asked.joints
        )
        unit = ", ".join(dict.fromkeys(first.unit.replace("deg", units.unit(joint)) for joint in asked.joints))
        return Plot(first.title, unit, tuple(times.tolist()), curves)
    rows, names = _tool_values(positions), (curve for name in asked.names for curve in QUANTITIES[name].curves)
    curves = tuple(Curve(name, name[0], tuple(rows[name].tolist())) for name in dict.fromkeys(names))
    return Plot(first.title, first.unit, tuple(times.tolist()), curves)


def _chosen(words: Sequence[str]) -> list[str]:
    """The quantities in full. Raises UsageError for an unknown one, and for two that do not go on one scale."""
    names = [_full_name(word.upper()) for word in words] or ["POSITION"]
    units = {QUANTITIES[name].unit for name in names}
    if len(units) > 1 or (QUANTITIES[names[0]].joints and len(set(names)) > 1):
        raise UsageError(f"{' and '.join(names)} do not go on one scale", SYNTAX, in_python=IN_PYTHON)
    return list(dict.fromkeys(names))


def _full_name(word: str) -> str:
    if word in QUANTITIES:
        return word
    found = [name for name in QUANTITIES if name.startswith(word)]
    if len(found) != 1:
        raise UsageError(f"{word} is no curve", SYNTAX, in_python=IN_PYTHON)
    return found[0]


def _joints(arm: RobotArm, numbers: Sequence[int]) -> Sequence[int]:
    count = arm.model.joint_count
    for number in numbers:
        if not 1 <= number <= count:
            raise IllegalJoint(f"joint {number}", f"this robot has joints 1 to {count}")
    return list(dict.fromkeys(numbers)) or range(1, count + 1)


def _tool_values(positions: PositionArrays) -> Mapping[str, Floats]:
    """Every curve of the tool [mm, mm/s]. The speed is that between neighbouring samples."""
    import numpy as np

    xyz = positions.T_world_tool[:, :, 3] * 1000.0
    speed = np.linalg.norm(np.gradient(xyz, positions.times, axis=0), axis=1)
    return {"X": xyz[:, 0], "Y": xyz[:, 1], "Z": xyz[:, 2], "SPEED": speed, "HAND": positions.hand}
