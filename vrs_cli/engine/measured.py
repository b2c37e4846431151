"""The measured robot beside the timeline: where it is, and how far from where it should be."""

from __future__ import annotations

from itertools import pairwise
from math import nan, sqrt
from typing import TYPE_CHECKING

from vrs_cli.engine.position import places_at, poses_along, position_at, world_pose
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.measured import GAP, MeasuredTimeline
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.measured import Deviation, MeasuredComparison, MeasuredPosition
from vrs_cli.values.numbers import seconds
from vrs_cli.values.results import Apart, Position

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats

AT_ONCE = 20_000  # reports whose poses are in memory at a time


def measured_position(
    arm: RobotArm, timeline: Timeline, measured: MeasuredTimeline, t: float
) -> MeasuredPosition | None:
    """Return where the robot was measured at t [s], with BASE and TOOL of the timeline; None where it is unknown."""
    joints, mode = measured.joints_at(t), measured.mode_at(t)
    if joints is None or mode is None:
        return None
    expected = position_at(arm, timeline, t)
    still = (0.0,) * len(joints)
    velocity = measured.velocity_at(t) or still
    pose = world_pose(arm, timeline.locate(t)[0].motion.frames, joints)
    at = Position(t, joints, velocity, still, pose, expected.hand, expected.moving, expected.text)
    return MeasuredPosition(at, expected, mode)


def why_unknown(measured: MeasuredTimeline, t: float) -> str:
    """Say why nothing is known of the measured robot at t [s], where there are reports."""
    assert measured.start is not None, "there are reports"
    assert measured.end is not None, "there are reports"
    if t > measured.end:
        why = f"the last report is of {seconds(measured.end)}"
    elif t < measured.start:
        why = f"the first report is of {seconds(measured.start)}"
    else:
        why = f"there is no report for more than {seconds(GAP)} about then"
    return f"The measured robot is unknown at {seconds(t)}: {why}"


def compare_measured(arm: RobotArm, timeline: Timeline, measured: MeasuredTimeline) -> MeasuredComparison | None:
    """Compare each report with g at its own time; None if there is no report."""
    if measured.start is None or measured.end is None:
        return None
    unknown, before = 0.0, measured.start
    joints = [_Sum() for _ in range(arm.model.joint_count)]
    tool, turned = _Sum(), _Sum()
    for columns, begin, end in measured.parts():
        for first in range(begin, end, AT_ONCE):
            at = columns.arrays(first, min(first + AT_ONCE, end))
            _add(arm, timeline, at.times, at.joints, (*joints, tool, turned))
            times = [before, *at.times.tolist()]
            unknown += sum(b - a for a, b in pairwise(times) if b - a > GAP)
            before = times[-1]
    return MeasuredComparison(
        begin=measured.start,
        end=measured.end,
        reports=len(measured),
        unknown=unknown,
        tool=tool.deviation(),
        turned=turned.deviation(),
        joints=tuple(one.deviation(number) for number, one in enumerate(joints, 1)),
    )


def _add(arm: RobotArm, timeline: Timeline, times: Floats, joints: Floats, sums: tuple[_Sum, ...]) -> None:
    """Add by how much reports (N,) with joints (N, n) differ: each joint, the tool's place, and how it is turned."""
    import numpy as np

    expected, here = places_at(arm, timeline, times), poses_along(arm, timeline, times, joints)
    apart = expected.T_world_tool - here.T_world_tool
    distance = np.linalg.norm(apart[:, :, 3], axis=1)
    chord = np.linalg.norm(apart[:, :, :3], axis=(1, 2)) / sqrt(8.0)  # the sine of half the angle between
    angle = 2.0 * np.arcsin(np.minimum(chord, 1.0))
    for one, values in zip(sums, (*np.abs(expected.joints - joints).T, distance, angle), strict=True):
        one.add(times, values)


class _Sum:
    """The greatest of many distances, its time, and the sum of their squares."""

    def __init__(self) -> None:
        self._greatest, self._time, self._squares, self._count = -1.0, nan, 0.0, 0

    def add(self, times: Floats, values: Floats) -> None:
        place = int(values.argmax())
        if values[place] > self._greatest:
            self._greatest, self._time = float(values[place]), float(times[place])
        self._squares += float(values @ values)
        self._count += len(values)

    def deviation(self, joint: int = 0) -> Deviation:
        return Deviation(sqrt(self._squares / self._count), Apart(self._greatest, self._time, joint))
