"""Commands on the timeline: UNDO and REDO, branches, listings, and PLOT, which draws curves over time. This module does
not depend on a terminal.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from msgspec import Struct

from vrs_cli.engine import book, position
from vrs_cli.engine.branches import MAIN
from vrs_cli.engine.comparison import compare, compare_measured
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import IllegalJoint, IllegalValue, InvalidName, UsageError
from vrs_cli.interfaces.dialogue import Dialogue, beside, in_parts
from vrs_cli.interfaces.station import operands
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks import observations, tasks
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.language.text.ast import Instruction
from vrs_cli.language.words import monitor, values
from vrs_cli.trajectory.segment import Segment, stops_on_the_way
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import replies, results


@operands.handles("UNDO", work=Engine.undo_in_parts, done="undone")
@operands.handles("REDO", work=Engine.redo_in_parts, done="done again")
def _undo_or_redo(
    station: Station, it: Instruction, work: Callable[[Engine, int], book.Parts[tuple[str, ...]]], done: str
) -> Dialogue[None]:
    """Undo or redo commands. Report which ones. `work`: the method of the engine; `done`: the verb for the report."""
    engine, steps = station.engine, values.whole(operands.real_or(station, it, 0, 1.0))
    if steps < 1:
        raise IllegalValue(f"{it.word} {steps}", "at least one command")
    texts = yield from in_parts(work(engine, steps))
    last = texts[-1] or "a motion"
    what = f"{last} is {done}" if len(texts) == 1 else f"{len(texts)} commands are {done}, up to {last}"
    yield results.Message(f"{what}; the clock is at {engine.now:.3f} s")


@operands.handles("BRANCH")
def _branch(station: Station, it: Instruction) -> Dialogue[None]:
    """List the branches, switch to a branch, or make a new one."""
    branches, given = station.branches, operands.operand(it, 0)
    if given is None:
        yield branch_table(station)
        return
    name = operands.word(given)
    if not name[:1].isalpha():
        raise InvalidName(name, "a branch is named as a program is: BRANCH trial")
    if operands.is_measured(given):
        raise InvalidName(name, "COMPARE means what was measured by it: take another name")
    check_tasks_stand(station)
    if name in branches:
        branches.change_over(name)
        yield results.Message(f"On {branches.present}; the clock is at {station.engine.now:.3f} s")
    else:
        origin = branches.present
        branches.make(name)
        yield results.Message(f"On {name}, a new branch of {origin}; the clock is at {station.engine.now:.3f} s")


def branch_table(station: Station) -> replies.BranchTable:
    """Return a table of all branches, main first."""
    branches = station.branches
    return replies.BranchTable(
        tuple(
            replies.BranchRow(
                name, name == branches.present, left.book.history.commands, left.book.timeline.end, left.clock
            )
            for name, left in ((name, branches.bookmark_of(name)) for name in branches.names)
        )
    )


def check_tasks_stand(station: Station) -> None:
    """Check that no task is running. Raises UsageError."""
    if (running := next(station.tasks.running, None)) is not None:
        number = "" if running.number == tasks.ROBOT_PROGRAM else f" {running.number}"
        raise UsageError(f"{running.task.program} is running", f"{{ABORT{number}}} stops it")


@operands.handles("COMPARE")
def _compare(station: Station, it: Instruction) -> Dialogue[None]:
    """Compare two branches, or the measured robot with a branch. Raises UsageError."""
    branches, second = station.branches, operands.word_or(it, 1, station.branches.present)
    if operands.is_measured(operands.operand(it, 0)):
        arm, timeline, measured = station.engine.arm, branches.book(second).timeline, station.engine.measured.view
        found = yield from beside(lambda: compare_measured(arm, timeline, measured))
        if found is None:
            raise UsageError(*operands.NO_REPORT)
        yield replies.MeasuredComparisonTable(branches.spelling(second), found, station.units)
        return
    first = operands.word_or(it, 0, MAIN)
    if first.lower() == second.lower():
        raise UsageError(f"{first} is the same as {second}", "{COMPARE a, b}; {BRANCH} lists the branches")
    yield (yield from comparison(station, first, second))


def comparison(station: Station, first: str, second: str) -> Dialogue[replies.ComparisonTable]:
    """Return the comparison of two branches. Raises UsageError for an unknown name."""
    branches = station.branches
    arm, one, other = station.engine.arm, branches.book(first).copy(), branches.book(second).copy()
    found = yield from beside(lambda: compare(arm, one, other))
    return replies.ComparisonTable(branches.spelling(first), branches.spelling(second), found, station.units)


@operands.handles("MERGE")
def _merge(station: Station, it: Instruction) -> Dialogue[None]:
    name = station.branches.spelling(operands.word_or(it, 0, station.branches.present))
    check_tasks_stand(station)
    again = yield from in_parts(station.branches.merge_in_parts(name))
    how = f", {again} command{'' if again == 1 else 's'} of it planned again" if again else ""
    yield results.Message(f"{name} is merged into main{how}; the timeline ends at {station.engine.end:.3f} s")


@operands.handles("DELETEB")
def _delete_branches(station: Station, it: Instruction) -> Dialogue[None]:
    names = [station.branches.droppable(operands.word(argument)) for argument in it.arguments]
    check_tasks_stand(station)
    if (yield from operands.may_delete(station, f"{', '.join(names)} will be deleted.")):
        for name in names:
            station.branches.drop(name)


def timeline_table(station: Station) -> Dialogue[replies.TimelineTable]:
    """Return the current timeline as a table: its commands that have not been undone, its segments, and the readings of
    signals by programs that no longer hold."""
    engine = station.engine
    timeline, commands, now = engine.timeline, engine.book.all_records(), engine.now
    wrong = tuple(observations.untrue(engine.book, station.environment.signals))

    def make_table() -> replies.TimelineTable:
        segments = [segment for segment in timeline if segment.motion.number > 0]
        return replies.TimelineTable(
            commands(),
            tuple(map(_segment_row, segments)),
            tuple(map(_segment_row, stops_on_the_way(segments))),
            now,
            wrong,
        )

    return beside(make_table)


@operands.handles("TIMELINE")
def _list_timeline(station: Station, _it: Instruction) -> Dialogue[None]:
    yield (yield from timeline_table(station))


def _segment_row(segment: Segment) -> replies.SegmentRow:
    motion = segment.motion
    return replies.SegmentRow(
        motion.number, motion.text, segment.start, segment.finish, segment.phase.value, motion.kind.space
    )


@operands.handles("PLOT")
def _plot(station: Station, it: Instruction) -> Dialogue[None]:
    """Show curves, or draw them into a file. Raises FileError, and UsageError if this robot cannot draw into files."""
    engine, (names, file) = station.engine, split_file(operands.words(it))
    selection = select_curves(engine.arm, names)
    if engine.end <= engine.timeline.start:
        yield results.Message("No motions yet")
        return
    arm, timeline = engine.arm, engine.timeline
    plot = yield from beside(lambda: plot_curves(arm, timeline, selection))
    if not file:
        yield plot
        return
    draw, path = station.draw, station.folder.path(file)
    if draw is None:
        raise UsageError("PLOT draws no file at this robot", "PLOT alone shows the curves")
    yield from operands.may_write(station, path)
    yield from beside(lambda: draw(path, plot))
    yield results.Message(f"{path} written")


SAMPLES = 481  # number of samples of a curve: more than the widest drawing has dots across
PICTURES = (".svg", ".png", ".pdf")  # file name suffixes that select a picture file for the plot
SYNTAX = (
    f"PLOT {', '.join(monitor.QUANTITIES)}; joints by number: PLOT 1, 2 or PLOT VELOCITY, 1;"
    " into a file: PLOT 1, arm.svg"
)
IN_PYTHON = f'plot(1, 2), plot("velocity", 1), plot("X", "Z"); quantities: {", ".join(monitor.QUANTITIES).lower()}'
_JOINT = re.compile(r"[0-9]{1,3}")


class Selection(Struct, frozen=True):
    """The curves to plot. `names`: quantities with the same unit; `joints`: joint numbers from 1, empty for quantities
    of the tool."""

    names: tuple[str, ...]
    joints: tuple[int, ...]


def split_file(names: Sequence[str]) -> tuple[Sequence[str], str]:
    """Split the arguments of PLOT into the names of curves, and the name of a picture file after them; "" if there is
    none."""
    has_file = bool(names) and names[-1].lower().endswith(PICTURES)
    return (names[:-1], names[-1]) if has_file else (names, "")


def select_curves(arm: RobotArm, names: Sequence[str]) -> Selection:
    """Return the curves that the arguments of PLOT select: none, `1, 2`, `VELOCITY, 3`, `X, Z`. Raises UsageError,
    IllegalJoint."""
    joints = list(dict.fromkeys(int(name) for name in names if _JOINT.fullmatch(name)))
    found = [_full_name(name.upper()) for name in names if not _JOINT.fullmatch(name)] or ["POSITION"]
    first, count = monitor.QUANTITIES[found[0]], arm.model.joint_count
    if len({monitor.QUANTITIES[name].unit for name in found}) > 1 or (first.joints and len(set(found)) > 1):
        raise UsageError(f"{' and '.join(found)} do not go on one scale", SYNTAX, in_python=IN_PYTHON)
    if joints and not first.joints:
        raise UsageError(f"{first.title.lower()} has no joint {joints[0]}", SYNTAX, in_python=IN_PYTHON)
    for number in joints:
        if not 1 <= number <= count:
            raise IllegalJoint(f"joint {number}", f"this robot has joints 1 to {count}")
    joints = (joints or list(range(1, count + 1))) if first.joints else []
    return Selection(tuple(dict.fromkeys(found)), tuple(joints))


def plot_curves(arm: RobotArm, timeline: Timeline, asked: Selection) -> replies.Plot:
    """Compute the selected curves over the whole timeline, which must contain a motion."""
    import numpy as np

    first = monitor.QUANTITIES[asked.names[0]]
    times = np.linspace(timeline.start, timeline.end, SAMPLES)
    positions = position.positions_at(arm, timeline, times)
    if first.joints:
        units, columns = arm.model.units, getattr(positions, first.joints).T.tolist()
        curves = tuple(
            replies.Curve(f"JT{joint}", str(joint), tuple(units.one_shown(joint, x) for x in columns[joint - 1]))
            for joint in asked.joints
        )
        unit = ", ".join(dict.fromkeys(first.unit.replace("deg", units.unit(joint)) for joint in asked.joints))
        return replies.Plot(first.title, unit, tuple(times.tolist()), curves)
    xyz = positions.T_world_tool[:, :, 3] * 1000.0
    # [mm/s], from the differences of neighbouring samples
    speed = np.linalg.norm(np.gradient(xyz, positions.times, axis=0), axis=1)
    rows = {"X": xyz[:, 0], "Y": xyz[:, 1], "Z": xyz[:, 2], "SPEED": speed, "HAND": positions.hand}
    names = (curve for name in asked.names for curve in monitor.QUANTITIES[name].curves)
    curves = tuple(replies.Curve(name, name[0], tuple(rows[name].tolist())) for name in dict.fromkeys(names))
    return replies.Plot(first.title, first.unit, tuple(times.tolist()), curves)


def _full_name(name: str) -> str:
    """Return the full name of a quantity, which may be abbreviated. Raises UsageError."""
    found = [name] if name in monitor.QUANTITIES else [full for full in monitor.QUANTITIES if full.startswith(name)]
    if len(found) != 1:
        raise UsageError(f"{name} is no curve", SYNTAX, in_python=IN_PYTHON)
    return found[0]
