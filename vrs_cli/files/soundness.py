"""What is wrong with a trajectory that was read, and in which lines of its file that stands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from vrs_cli.engine.breaches import PLACE, Breach, breaches, on_lines
from vrs_cli.files.fault import Fault
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.delta import TimelineDelta
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline

FIRST_DELTA = 2  # its line


def faults(arm: RobotArm, timeline: Timeline, deltas: Sequence[TimelineDelta]) -> Iterator[Fault]:
    """Goals beyond a range; and where the timeline after all deltas jumps, leaves a range or exceeds a limit."""
    yield from _goals(arm, deltas)
    yield from _in_lines(breaches(arm, timeline), timeline, deltas)


def faults_along(arm: RobotArm, timeline: Timeline, deltas: Sequence[TimelineDelta]) -> Iterator[Fault]:
    """Where a straight line of the timeline leaves the reach or a range, or is too fast, anywhere along it."""
    yield from _in_lines(on_lines(arm, timeline), timeline, deltas)


def _goals(arm: RobotArm, deltas: Sequence[TimelineDelta]) -> Iterator[Fault]:
    told = [(line, goal) for line, delta in enumerate(deltas, FIRST_DELTA) if (goal := delta.motion.goal) is not None]
    if not told:
        return
    goals, lower, upper = np.array([goal for _, goal in told]), np.array(arm.model.lower), np.array(arm.model.upper)
    outside = (goals < lower - PLACE) | (goals > upper + PLACE)
    for row in np.flatnonzero(outside.any(axis=1)).tolist():
        joint = int(outside[row].argmax()) + 1
        said = arm.model.said(joint, float(goals[row, joint - 1]))
        yield Fault(told[row][0], f"the goal of joint {joint}, {said}, is beyond its range")


def _in_lines(found: Iterable[Breach], timeline: Timeline, deltas: Sequence[TimelineDelta]) -> Iterator[Fault]:
    for breach in found:
        neighbours = [timeline[index] for index in (breach.index - 1, breach.index) if index >= 0]
        yield Fault(_line_of(neighbours, deltas), breach.what)


def _line_of(neighbours: list[Segment], deltas: Sequence[TimelineDelta]) -> int:
    """The last line that made one of the segments, or cut the first of them off where it ends now."""
    for line in range(len(deltas) - 1, -1, -1):
        delta = deltas[line]
        made = any(segment.path is one.path for segment in delta.segments for one in neighbours)
        if made or (delta.drop and delta.cut == neighbours[0].finish):
            return line + FIRST_DELTA
    return FIRST_DELTA - 1
