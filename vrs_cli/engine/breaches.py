"""The laws that every timeline keeps, checked for many segments at once.

Position and velocity go on from each segment to the next, in a gap and after the end the robot stands, and no joint
leaves its range. In joint space no joint is faster, or gains speed faster, than it can: the polynomials say where they
are greatest, those of degree 3 at most all at once. A straight line is looked at where it begins, where it ends, and
where its seeds change; `on_lines` goes all the way along.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from vrs_cli.engine.following import Follower
from vrs_cli.errors import MotionError, StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.kinematics.transform import compose, distance, inverse
from vrs_cli.trajectory.block_table import coefficients
from vrs_cli.trajectory.motion import Kind
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

MANY = 4096  # segments that are looked at at once
CUBIC = 4  # coefficients
PLACE = 1e-5  # [rad, m] of a joint, [m] of a pose: rounding, also next to a singular pose
RATE = 1e-4  # [rad/s, m/s] of a joint; of a faster one as a part of its velocity
EXCESS = 1e-4  # of a limit, as a part of it
FAR = 3.0  # [rad] of a joint from its seed: at half a turn another turn of it would be nearer


class Breach(Struct, frozen=True):
    """A law that is broken in a segment, counted from 0, or where that begins."""

    index: int
    what: str


def breaches(arm: RobotArm, timeline: Timeline) -> Iterator[Breach]:
    """What is wrong with a timeline, in its order."""
    rest, first, before = iter(timeline), 0, list[Segment]()
    while segments := list(islice(rest, MANY)):
        stretch = _Stretch(arm, [*before, *segments], first - len(before))
        yield from sorted(stretch.breaches(), key=lambda breach: breach.index)
        first, before = first + len(segments), segments[-1:]
    yield from _Stretch(arm, before, first - 1).at_the_end()


def on_lines(arm: RobotArm, timeline: Timeline) -> Iterator[Breach]:
    """What is wrong along the straight lines of a timeline: reach, ranges and velocities of joints, jumps."""
    for index, segment in enumerate(timeline):
        if isinstance(segment.path, CartesianPath) and segment.duration:
            what = _along(arm, segment, segment.path)
            if what:
                yield Breach(index, what)


class _Stretch:
    """Neighbouring segments as arrays (m, n): joints, their velocity and acceleration where each begins and ends.

    What the arm cannot follow is NaN there, which breaks no other law.
    """

    def __init__(self, arm: RobotArm, segments: list[Segment], first: int) -> None:
        self.arm, self.model, self.segments, self.first = arm, arm.model, segments, first
        self.starts = np.array([segment.start for segment in segments])
        self.durations = np.array([segment.duration for segment in segments])
        self.straight = np.array([not isinstance(segment.path, JointPath) for segment in segments])
        self.resting = np.array([segment.phase is Phase.REST for segment in segments])
        given = coefficients([segment.path for segment in segments])
        self.coefficients = np.concatenate((given, np.zeros((max(CUBIC - len(given), 0), *given.shape[1:]))))
        self.steep = [
            (row, segment.path, segment.duration)
            for row, segment in enumerate(segments)
            if isinstance(segment.path, JointPath) and segment.path.degree >= CUBIC
        ]
        self.begin, self.begin_rate, self.begin_gain = self._at(np.zeros(len(segments)))
        self.end, self.end_rate, self.end_gain = self._at(self.durations)
        self.lines = [breach for row in np.flatnonzero(self.straight) for breach in self._line(int(row))]

    def breaches(self) -> Iterator[Breach]:
        yield from self.lines
        yield from self._seams()
        yield from self._ranges()
        yield from self._rests()
        yield from self._limits()

    def at_the_end(self) -> Iterator[Breach]:
        """After the last segment the robot stands; but a stream of targets may have ended at any time."""
        rate = np.abs(self.end_rate[-1:])
        if self.segments[-1].motion.kind is not Kind.STEERED:
            yield from self._tell(rate > RATE, rate, "joint {joint} moves with {size}/s at the end")

    # --- laws ----------------------------------------------------------------------------------------------------

    def _seams(self) -> Iterator[Breach]:
        """From each segment to the next."""
        jump = np.abs(self.begin[1:] - self.end[:-1])
        yield from self._tell(jump > PLACE, jump, "joint {joint} jumps by {size}", 1)
        touching = (self.starts[1:] == self.starts[:-1] + self.durations[:-1])[:, None]
        before, after = self.end_rate[:-1], self.begin_rate[1:]
        kick, fast = np.abs(after - before), np.maximum(np.abs(after), np.abs(before))
        wrong = touching & (kick > RATE * np.maximum(1.0, fast))
        yield from self._tell(wrong, kick, "the velocity of joint {joint} jumps by {size}/s", 1)
        yield from self._tell(~touching & (fast > RATE), fast, "joint {joint} moves with {size}/s next to a gap", 1)

    def _ranges(self) -> Iterator[Breach]:
        """A joint is farthest at an end, or where it turns back."""
        low, high = self._extremes()
        beyond = np.maximum(np.array(self.model.lower) - low, high - np.array(self.model.upper))
        yield from self._tell(beyond > PLACE, beyond, "joint {joint} is {size} beyond its range")

    def _rests(self) -> Iterator[Breach]:
        resting = self.resting[:, None]
        moved = np.maximum(np.abs(self.end - self.begin), np.maximum(np.abs(self.begin_rate), np.abs(self.end_rate)))
        yield from self._tell(resting & (moved > RATE), moved, "joint {joint} moves by {size} while the robot stands")

    def _limits(self) -> Iterator[Breach]:
        """The velocity is greatest at an end or, in joint space, where the acceleration is 0; that one at an end."""
        moving = self.durations[:, None] > 0.0
        rate = np.maximum(np.maximum(np.abs(self.begin_rate), np.abs(self.end_rate)), np.abs(self._steady_rate()))
        gain = np.maximum(np.abs(self.begin_gain), np.abs(self.end_gain))
        for row, path, duration in self.steep:
            rate[row], gain[row] = (np.abs(path.extremes(duration, order)).max(axis=1) for order in (1, 2))
        wrong = moving & (rate > np.array(self.model.max_velocity) * (1.0 + EXCESS))
        yield from self._tell(wrong, rate, "joint {joint} moves with {size}/s, faster than it can")
        wrong = moving & ~self.straight[:, None] & (gain > np.array(self.model.max_acceleration) * (1.0 + EXCESS))
        yield from self._tell(wrong, gain, "joint {joint} accelerates with {size}/s2, more than it can")

    def _tell(self, wrong: Flags, size: Floats, what: str, shift: int = 0) -> Iterator[Breach]:
        """A breach for each row (of n joints) that is wrong, of its worst joint. `shift` 1: each is of a seam."""
        for row in np.flatnonzero(wrong.any(axis=1)).tolist():
            joint = int(np.where(wrong[row], size[row], 0.0).argmax()) + 1
            text = what.format(joint=joint, size=self.model.said(joint, float(size[row, joint - 1]), 4))
            yield self._breach(row + shift, text)

    def _breach(self, row: int, what: str) -> Breach:
        return Breach(self.first + row, f"{what}, {self.starts[row]:.3f} s")

    # --- polynomials ---------------------------------------------------------------------------------------------

    def _at(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Joints, velocity and acceleration (m, n) of every segment at its own time s (m,) or (m, n)."""
        t = s if s.ndim > 1 else s[:, None]
        joints = rates = gains = np.zeros_like(self.coefficients[0])
        for row in self.coefficients[::-1]:  # Horner, of the derivatives too
            gains = gains * t + 2.0 * rates
            rates = rates * t + joints
            joints = joints * t + row
        return joints, rates, gains

    def _extremes(self) -> tuple[Floats, Floats]:
        """The least and the greatest joints (m, n)."""
        low, high = np.minimum(self.begin, self.end), np.maximum(self.begin, self.end)
        for s in self._turns():
            there = np.where(self.straight[:, None], self.begin, self._at(s)[0])
            low, high = np.minimum(low, there), np.maximum(high, there)
        for row, path, duration in self.steep:
            low[row], high[row] = np.transpose(path.extremes(duration))
        return low, high

    def _turns(self) -> tuple[Floats, Floats]:
        """Where the velocity of each joint is 0 (m, n), or 0 where it is so nowhere inside."""
        _, c, b, a = self.coefficients[:CUBIC]
        b, a = 2.0 * b, 3.0 * a
        with np.errstate(all="ignore"):
            q = -0.5 * (b + np.copysign(np.sqrt(b * b - 4.0 * a * c), b))  # the two roots, without cancellation
            return self._inside(q / a), self._inside(c / q)

    def _steady_rate(self) -> Floats:
        """The velocity where the acceleration of each joint is 0 (m, n)."""
        c2, c3 = self.coefficients[2:CUBIC]
        with np.errstate(all="ignore"):
            return self._at(self._inside(-c2 / (3.0 * c3)))[1]

    def _inside(self, s: Floats) -> Floats:
        return np.where((s > 0.0) & (s < self.durations[:, None]), s, 0.0)

    # --- lines ---------------------------------------------------------------------------------------------------

    def _line(self, row: int) -> Iterator[Breach]:
        """Find the joints and rates where a line begins and ends; look at the rest of it roughly."""
        segment = self.segments[row]
        path = segment.path
        assert isinstance(path, CartesianPath)
        for s, joints, rates in ((0.0, self.begin, self.begin_rate), (segment.duration, self.end, self.end_rate)):
            found = _joints(self.arm, segment, path, s, path.seed(s))
            joints[row] = np.nan if found is None else found
            rates[row] = np.nan if found is None else _rates(self.arm, segment, path, s, found)
        if np.isnan(self.begin[row]).any() or np.isnan(self.end[row]).any():
            yield self._breach(row, "the straight line leaves the reach of the arm")
        elif not _seeds_agree(self.arm, segment, path):
            yield self._breach(row, "the joints jump in the straight line")


# --- lines -------------------------------------------------------------------------------------------------------


def _joints(arm: RobotArm, segment: Segment, path: CartesianPath, s: float, seed: Joints) -> Joints | None:
    """The joints s seconds into a line; None where the arm does not reach it."""
    flange = compose(path.pose(s), inverse(segment.motion.frames.tool))
    found = arm.branch_joints(flange, path.configuration, seed)
    if found is None and distance(arm.forward(seed), flange) <= PLACE:  # at the very edge of the reach
        return seed
    return found


def _rates(arm: RobotArm, segment: Segment, path: CartesianPath, s: float, joints: Joints) -> Joints:
    """The joints' velocity s seconds into a line; NaN where a singular pose has none."""
    twist = path.twist(s)
    if not any(twist):
        return (0.0,) * len(joints)
    try:
        return arm.joint_velocity(joints, twist, segment.motion.frames.tool)
    except StraightLineSingular:
        return (np.nan,) * len(joints)


def _seeds_agree(arm: RobotArm, segment: Segment, path: CartesianPath) -> bool:
    """Whether neighbouring seeds mean the same joints where the one takes over from the other."""
    turns = [link.kind is JointKind.REVOLUTE for link in arm.model.links]
    for k, (seed, after) in enumerate(zip(path.seeds, path.seeds[1:], strict=False)):
        s = (k + 0.5) * path.seed_interval
        if s > segment.duration:
            return True
        one, other = (_joints(arm, segment, path, s, near) for near in (seed, after))
        if one is None or other is None or max(map(abs, np.subtract(one, other))) > PLACE:
            return False
        if any(turn and abs(q - near) > FAR for q, near, turn in zip(one, seed, turns, strict=True)):
            return False
    return True


def _along(arm: RobotArm, segment: Segment, path: CartesianPath) -> str:
    """What is wrong along a line; nothing: ""."""
    frames = segment.motion.frames
    follower = Follower(arm, path.configuration, frames.tool, frames.base)
    try:
        samples = follower.samples(path, segment.duration, path.seeds[0])
    except MotionError as error:
        return str(error)
    for sample in samples:
        for joint, (rate, most) in enumerate(zip(sample.velocity, arm.model.max_velocity, strict=True), 1):
            if abs(rate) > most * (1.0 + EXCESS):
                return (
                    f"joint {joint} moves with {arm.model.said(joint, abs(rate), 4)}/s, faster than it can, "
                    f"{segment.start + sample.s:.3f} s"
                )
    return ""
