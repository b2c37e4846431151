"""Find the faults of a trajectory that was read, with the lines of its file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from vrs_cli.engine.breaches import PLACE, Breach, breaches
from vrs_cli.files.rebuild import Fault
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta

HEADER = 1  # its line


def faults(arm: RobotArm, timeline: Timeline, deltas: Sequence[TimelineDelta], lines: Sequence[int]) -> Iterator[Fault]:
    """Goals beyond a range; and where the timeline after all deltas jumps, leaves a range or exceeds a limit. `lines`:
    of the deltas.
    """
    goals_of = zip(lines, (delta.motion.goal for delta in deltas), strict=True)
    told = [(line, goal) for line, goal in goals_of if goal is not None]
    goals = np.array([goal for _, goal in told]).reshape(len(told), arm.model.joint_count)
    outside = (goals < np.array(arm.model.lower) - PLACE) | (goals > np.array(arm.model.upper) + PLACE)
    for row in np.flatnonzero(outside.any(axis=1)).tolist():
        joint = int(outside[row].argmax()) + 1
        said = arm.model.said(joint, float(goals[row, joint - 1]))
        yield Fault(told[row][0], f"the goal of joint {joint}, {said}, is beyond its range")
    yield from in_lines(breaches(arm, timeline), timeline, deltas, lines)


def in_lines(
    found: Iterable[Breach], timeline: Timeline, deltas: Sequence[TimelineDelta], lines: Sequence[int]
) -> Iterator[Fault]:
    """Breaches of a timeline, each in the last line that made one of the segments round it, or cut the first of them
    off where it ends now."""
    for breach in found:
        neighbours = [timeline[index] for index in (breach.index - 1, breach.index) if index >= 0]
        made = (
            line
            for line, delta in zip(reversed(lines), reversed(deltas), strict=True)
            if (delta.drop and delta.cut == neighbours[0].finish)
            or any(segment.path is one.path for segment in delta.segments for one in neighbours)
        )
        yield Fault(next(made, HEADER), breach.what)
