"""Sample the joints over a stretch of time, and bound how far the bodies that they move can come.

Each body has a ball around it. Between two samples a point of the body moves no farther than the ball's centre plus the
angle of the turn times the radius. The change of speed from sample to sample bounds how much faster it can be for a
moment. Two links approach each other by no more than the turns of the joints between them times their levers. The sums
of these ways grow with time, so halving finds the time at which a way may be done. Steps of this length reach the first
contact and never pass it (conservative advancement; Mirtich, "Impulse-based dynamic simulation of rigid body systems",
1996).
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from math import ceil, hypot
from typing import NamedTuple

import numpy as np

from vrs_cli.contacts.physics import Ball, Bounds
from vrs_cli.engine.position import joints_at, joints_over
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import RobotModel, link_pose
from vrs_cli.kinematics.transform import Vector, length, position
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Timeline

STEP = 0.006  # [s] between samples of a motion
LEAST_STEPS = 3  # of a segment
SAFE = 1.5  # times the change of speed between samples


class LinkFrames(NamedTuple):
    """T_base_link of each link over N samples: rotations (n + 1, N, 3, 3) and places (n + 1, N, 3)."""

    turns: Floats
    places: Floats


def frames_over(model: RobotModel, q: Floats) -> LinkFrames:
    """Return the frames of all links for joints (N, n)."""
    n, count = model.joint_count, len(q)
    turns, places = np.empty((n + 1, count, 3, 3)), np.empty((n + 1, count, 3))
    base = np.array(model.base).reshape(3, 4)
    turns[0], places[0] = base[:, :3], base[:, 3]
    cosine, sine = np.cos(q.T)[:, :, None], np.sin(q.T)[:, :, None]
    turned = np.empty((count, 3, 3))  # by the joint alone
    for i, link in enumerate(model.links, 1):
        step, before = np.array(link_pose(model, i, 0.0)).reshape(3, 4), turns[i - 1]
        if link.kind is JointKind.PRISMATIC:
            moved = (before.reshape(-1, 3) @ step).reshape(count, 3, 4)
            moved[:, :, 3] += before[:, :, 2] * q[:, i - 1, None]
        else:
            x, y, c, s = before[:, :, 0], before[:, :, 1], cosine[i - 1], sine[i - 1]
            turned[:, :, 0], turned[:, :, 1], turned[:, :, 2] = c * x + s * y, c * y - s * x, before[:, :, 2]
            moved = (turned.reshape(-1, 3) @ step).reshape(count, 3, 4)  # one product of matrices, not `count`
        turns[i], places[i] = moved[:, :, :3], moved[:, :, 3] + places[i - 1]
    return LinkFrames(turns, places)


def levers(model: RobotModel, body: Bounds, other: int) -> tuple[float, ...]:
    """Return the greatest distance of points of a body from the axis of each joint between another link and its own
    [m]: 1 for a joint that slides, 0 for all other joints.
    """
    (link, ball), steps = body, _steps(model)
    far, found = length(ball.centre) + ball.radius, [0.0] * model.joint_count
    for i in range(link, other, -1):
        x, y, z = steps[i - 1]
        if model.links[i - 1].kind is JointKind.PRISMATIC:
            found[i - 1] = 1.0
            far += hypot(x, y, z) + max(abs(model.lower[i - 1]), abs(model.upper[i - 1]))
        else:
            found[i - 1] = far + hypot(x, y)
            far += hypot(x, y, z)
    return tuple(found)


@lru_cache
def _steps(model: RobotModel) -> tuple[Vector, ...]:
    """Return the pose of each link's frame in the frame of the link before, at joint 0."""
    return tuple(position(link_pose(model, i, 0.0)) for i in range(1, model.joint_count + 1))


class Sweep:
    """A stretch of a timeline, sampled at `times` [s]: joints `q` (N, n) [rad, m], and bounds on how far bodies come.

    A way is a row (N - 1,): how far a body comes at most from each sample to the next [m].
    """

    def __init__(self, arm: RobotArm, timeline: Timeline, begin: float, end: float) -> None:
        self.arm, self.timeline = arm, timeline
        self.times = _samples(timeline, begin, end)
        at = np.array(self.times)
        self.q = joints_over(arm, timeline, at)
        self.frames = frames_over(arm.model, self.q)
        self._spans = np.diff(at)
        self._joint_ways = self._inflate(np.abs(self.q[1:] - self.q[:-1]).T)
        # twice the sine of half the angle, which no angle of the way exceeds when it is inflated
        self._turned = np.sqrt(0.5 * np.square(np.diff(self.frames.turns, axis=1)).sum(axis=(2, 3)))

    def _inflate(self, ways: Floats) -> Floats:
        """Return ways (k, N - 1) with an allowance for speed that changes between two samples."""
        if ways.shape[1] < 2:
            return ways
        change = np.abs(np.diff(ways / self._spans, axis=1))
        most = np.zeros_like(ways)
        most[:, :-1] = change
        np.maximum(most[:, 1:], change, out=most[:, 1:])
        most[ways == 0.0] = 0.0  # it stands still, however long
        return np.asarray(ways + 0.5 * SAFE * self._spans * most)

    def centres(self, link: int, ball: Ball) -> Floats:
        """Return the positions of the centre of a ball of a link, in the robot's frame (N, 3) [m]."""
        return np.asarray(self.frames.turns[link] @ np.array(ball.centre) + self.frames.places[link])

    def ways(self, bodies: Sequence[Bounds]) -> Floats:
        """Return the ways of bodies (k, N - 1)."""
        return self.ways_of(bodies, np.array([self.centres(*one) for one in bodies]))

    def ways_of(self, bodies: Sequence[Bounds], centres: Floats) -> Floats:
        """Return the ways of bodies whose centres are known (k, N, 3) [m]."""
        moved = np.diff(centres, axis=1)
        far = np.sqrt(np.einsum("kni,kni->kn", moved, moved))
        radii = np.array([one.ball.radius for one in bodies])
        return self._inflate(far + radii[:, None] * self._turned[[one.link for one in bodies]])

    def way_between(self, levers: Floats) -> Floats:
        """Return the way by which two bodies approach each other, from the levers of the joints between them: a row
        (n,), or rows (k, n).
        """
        return np.asarray(levers @ self._joint_ways)

    def joints(self, t: float) -> Floats:
        """Return the joints at t, on a straight line between two samples [rad, m]."""
        k = self.place(t)
        part = (t - self.times[k]) / (self.times[k + 1] - self.times[k])
        return np.asarray(self.q[k] + part * (self.q[k + 1] - self.q[k]))

    def exact_joints(self, t: float) -> Sequence[float]:
        """Return the joints at t, as g gives them [rad, m]."""
        return joints_at(self.arm, self.timeline, t)

    def reaches(self, sums: Sequence[float], t: float, way: float) -> float:
        """Return the earliest time at which `way` metres can be done since t, at most the end. `sums`: the sums of the
        way's row, beginning with 0.
        """
        times, k = self.times, self.place(t)
        begun = sums[k] + (t - times[k]) / (times[k + 1] - times[k]) * (sums[k + 1] - sums[k])
        k = bisect_right(sums, begun + way, k) - 1
        if k + 1 >= len(times):
            return times[-1]
        return times[k] + (begun + way - sums[k]) / (sums[k + 1] - sums[k]) * (times[k + 1] - times[k])

    def place(self, t: float) -> int:
        """Return the number of the last sample up to t; at the end that of the last but one."""
        return min(bisect_right(self.times, t), len(self.times) - 1) - 1


def sums_of(way: Floats) -> list[float]:
    """Return the sums of a way's row, beginning with 0."""
    return [0.0, *np.cumsum(way).tolist()]


def _samples(timeline: Timeline, begin: float, end: float) -> list[float]:
    """Return times from `begin` to `end`: the ends of all segments, and times between them if the arm moves."""
    times, index = [begin], timeline.index_at(begin)
    while times[-1] < end:
        segment = timeline[index]
        index += 1
        until = min(segment.finish, end)
        if until > times[-1]:
            count = 1 if segment.phase is Phase.REST else max(ceil((until - times[-1]) / STEP), LEAST_STEPS)
            times += np.linspace(times[-1], until, count + 1)[1:].tolist()
        begins = timeline[index].start if index < len(timeline) else end
        if times[-1] < min(begins, end):  # the arm stands still until then
            times.append(min(begins, end))
    return times
