"""Check, for many segments at once, that a timeline obeys its rules.

Position and velocity are continuous from each segment to the next. In gaps and after the end the robot is at rest. No
joint leaves its range. In joint space no joint exceeds its velocity or acceleration limit: the greatest values follow
from the polynomials; polynomials up to degree 3 are evaluated all at once. A straight line is checked only where it
begins, where it ends, and where its seeds (stored joints that select the solution) change; `on_lines` checks all of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from math import inf

import numpy as np
from msgspec import Struct, structs

from vrs_cli.engine.boundary import survey
from vrs_cli.engine.following import MIN_INTERVAL, Follower, Sample
from vrs_cli.engine.load import ACCELERATION_MARGIN, StretchLoad
from vrs_cli.engine.problem import joint_velocity, joints_on
from vrs_cli.errors import MotionError, StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Flags, Floats
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.kinematics.transform import compose, distance, inverse
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.rope import RowPart
from vrs_cli.trajectory.row import CODES, coefficients
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import MotionKind

BLOCKS_AT_ONCE = 16  # number of blocks of segments checked at once
CUBIC_LENGTH = 4  # number of coefficients of a cubic
PLACE_TOLERANCE = 1e-5  # tolerance for rounding, also next to a singular pose: [rad, m] of a joint, [m] of a pose
RATE_TOLERANCE = 1e-4  # tolerance of a joint's velocity [rad/s, m/s]; above 1 rad/s, a fraction of the velocity
LIMIT_EXCESS = 1e-4  # allowed excess over a limit, as a fraction of the limit
JERK_EXCESS = 1.05  # allowed factor on the jerk limit, since between samples only an upper bound of the jerk is known
# [rad, m] joints farther than this from the proved joints are on another branch of the inverse kinematics
BRANCH_TOLERANCE = 1e-2
# [rad] maximum distance of a joint from its seed; beyond half a revolution (pi) the seed selects another revolution
MAX_SEED_DISTANCE = 3.0


class Breach(Struct, frozen=True):
    """A broken rule: the number of the segment (counted from 0), and what is wrong inside the segment or at its
    start.
    """

    index: int
    what: str


def breaches(arm: RobotArm, timeline: Timeline) -> Iterator[Breach]:
    """Yield the breaches of a timeline, in the order of its segments."""
    rest, first, before = timeline.blocks(-inf, inf), 0, list[RowPart]()
    while blocks := list(islice(rest, BLOCKS_AT_ONCE)):
        stretch = _Stretch(arm, [*before, *blocks], first - len(before))
        yield from sorted(stretch.breaches(), key=lambda breach: breach.index)
        first += sum(block.last - block.first for block in blocks)
        before = [structs.replace(blocks[-1], first=blocks[-1].last - 1)]
    yield from _Stretch(arm, before, first - 1).at_the_end()


def on_lines(arm: RobotArm, timeline: Timeline) -> Iterator[Breach]:
    """Yield the breaches along the straight lines of a timeline, checked as the planner does: reach, jumps, ranges of
    the joints, velocities, accelerations and jerks."""
    for index, segment in enumerate(timeline):
        if isinstance(segment.path, CartesianPath) and segment.duration:
            try:
                yield from _on_line(arm, index, segment, segment.path)
            except MotionError as error:
                yield Breach(index, str(error))


def _on_line(arm: RobotArm, index: int, segment: Segment, path: CartesianPath) -> Iterator[Breach]:
    """Yield the breaches of one straight-line segment. Raises MotionError if the joints cannot follow the line."""
    frames, law, lasting = segment.motion.frames, LAWS[segment.motion.profile], segment.duration
    follower = Follower(arm, path.configuration, frames.tool, frames.base)
    found = survey(follower, path, lasting)
    for touch in found.touches:
        if touch.begin > 0.0 and touch.end < lasting:
            raise follower.refuse_kink(path, touch.begin, touch.end, path.seed(touch.begin))
    samples = _samples(follower, path, lasting, law.samples, found.marks)
    if follower.arm.continuation is not None:
        from vrs_cli.engine.continuity import check_continuous  # imported here because closed forms do not need it

        (proved,) = check_continuous(follower.arm.continuation, follower, [(path, lasting, samples)])
        times = proved.looked_at(path)
        for s, joints in zip(times.tolist(), proved.joints(times).tolist(), strict=True):
            had = _joints(arm, segment, path, s, path.seed(s))
            if had is None or max(map(abs, np.subtract(had, joints))) > BRANCH_TOLERANCE:
                yield Breach(index, f"the joints jump in the straight line, {segment.start + s:.3f} s")
                return
    yield from _too_fast(arm, index, segment.start, samples)
    asked = StretchLoad(follower, path, samples, closely=bool(found.marks))
    load = asked.smooth(samples[0].velocity) if law.smooth else asked.parabolic(samples[0].velocity)
    at = segment.start + (load.at[1] if load.at else 0.0)
    if load.acceleration > ACCELERATION_MARGIN * (1.0 + LIMIT_EXCESS):
        yield Breach(
            index, f"joint {load.joint} has {load.acceleration:.2f} times the acceleration that it can, {at:.3f} s"
        )
    if load.jerk > JERK_EXCESS:
        yield Breach(index, f"joint {load.joint} has {load.jerk:.2f} times the jerk that it can, {at:.3f} s")


def _samples(
    follower: Follower, path: CartesianPath, lasting: float, steps: int, marks: Sequence[float]
) -> list[Sample]:
    """Sample a line as the planner does. If Newton's method does not lead from each sample to the next, start from the
    stored joints instead; the caller then proves that these are continuous. Raises MotionError if the joints cannot
    follow the line.
    """
    try:
        return follower.samples(path, lasting, path.seeds[0], steps, None, marks)
    except MotionError:
        if follower.arm.continuation is None or len(path.seeds) < 2:
            raise
    stored = (index * path.seed_interval for index in range(len(path.seeds) - 1))
    instants = [0.0]
    for s in sorted((*stored, *marks, *(lasting * step / steps for step in range(1, steps)))):
        if min(s - instants[-1], lasting - s) > MIN_INTERVAL * lasting:
            instants.append(s)
    return [follower.sample(path, s, path.seed(s)) for s in (*instants, lasting)]


class _Stretch:
    """Consecutive segments as arrays (m, n): the joints with their velocity and acceleration where each segment begins
    and ends.

    Values that the arm cannot follow are NaN, which breaks no other rule. `first`: the index of the first segment.
    """

    def __init__(self, arm: RobotArm, blocks: Sequence[RowPart], first: int) -> None:
        self.arm, self.model, self.blocks, self.first = arm, arm.model, blocks, first
        self.starts, finishes = map(np.concatenate, zip(*[block.times() for block in blocks], strict=True))
        self.durations = (finishes - self.starts)[:, None]
        paths = [path for block in blocks for path in block.row.paths[block.first : block.last]]
        phases = b"".join(block.row.phases[block.first : block.last] for block in blocks)
        self.resting = np.frombuffer(phases, np.uint8)[:, None] == CODES[Phase.REST]
        joints, straight = coefficients(paths)
        self.straight = straight[:, None]
        rates = _derivative(joints)
        self.orders = joints, rates, _derivative(rates)
        self.steep = [
            (row, path, float(self.durations[row, 0]))
            for row, path in enumerate(paths if len(joints) > CUBIC_LENGTH else ())
            if isinstance(path, JointPath) and path.degree >= CUBIC_LENGTH
        ]
        self.begin, self.end = [a[0].copy() for a in self.orders], [_value(a, self.durations) for a in self.orders]
        self.lines = [breach for row in np.flatnonzero(self.straight) for breach in self._line(int(row))]

    def breaches(self) -> Iterator[Breach]:
        """Yield the breaches of all segments, rule by rule."""
        yield from self.lines
        # jumps between segments
        jump = np.abs(self.begin[0][1:] - self.end[0][:-1])
        yield from self._breaches_of(jump > PLACE_TOLERANCE, jump, "joint {joint} jumps by {size}", 1)
        touching = self.starts[1:, None] == self.starts[:-1, None] + self.durations[:-1]
        before, after = self.end[1][:-1], self.begin[1][1:]
        kick, fast = np.abs(after - before), np.maximum(np.abs(after), np.abs(before))
        wrong = touching & (kick > RATE_TOLERANCE * np.maximum(1.0, fast))
        yield from self._breaches_of(wrong, kick, "the velocity of joint {joint} jumps by {size}/s", 1)
        yield from self._breaches_of(
            ~touching & (fast > RATE_TOLERANCE), fast, "joint {joint} moves with {size}/s next to a gap", 1
        )
        # ranges of the joints
        low, high = self._extremes(0)
        beyond = np.maximum(np.array(self.model.lower) - low, high - np.array(self.model.upper))
        yield from self._breaches_of(beyond > PLACE_TOLERANCE, beyond, "joint {joint} is {size} beyond its range")
        # segments at rest
        moved = np.abs(self.end[0] - self.begin[0])
        moved = np.maximum(moved, np.maximum(np.abs(self.begin[1]), np.abs(self.end[1])))
        wrong = self.resting & (moved > RATE_TOLERANCE)
        yield from self._breaches_of(wrong, moved, "joint {joint} moves by {size} while the robot stands")
        # limits of velocity and acceleration
        moving = self.durations > 0.0
        for order, limits, where, what in (
            (1, self.model.max_velocity, moving, "moves with {size}/s, faster than it can"),
            (2, self.model.max_acceleration, moving & ~self.straight, "accelerates with {size}/s2, more than it can"),
        ):
            low, high = self._extremes(order)
            most = np.maximum(high, -low)
            yield from self._breaches_of(
                where & (most > np.array(limits) * (1.0 + LIMIT_EXCESS)), most, "joint {joint} " + what
            )

    def at_the_end(self) -> Iterator[Breach]:
        """Yield a breach if the robot moves after the last segment; only a stream of targets may end in motion."""
        rate = np.abs(self.end[1][-1:])
        block = self.blocks[-1]
        if block.row.motions[block.last - 1].kind is not MotionKind.STEERED:
            yield from self._breaches_of(rate > RATE_TOLERANCE, rate, "joint {joint} moves with {size}/s at the end")

    def _breaches_of(self, wrong: Flags, size: Floats, what: str, shift: int = 0) -> Iterator[Breach]:
        """Yield a breach for each row (of n joints) in which a joint is wrong, and name the worst joint of the row.
        `what`: the message, with the placeholders {joint} and {size}. `shift` is 1 if the rows are boundaries between
        segments.
        """
        for row in np.flatnonzero(wrong.any(axis=1)).tolist() if wrong.any() else ():
            joint = int(np.where(wrong[row], size[row], 0.0).argmax()) + 1
            text = what.format(joint=joint, size=self.model.joint_text(joint, float(size[row, joint - 1]), 4))
            yield self._breach(row + shift, text)

    def _breach(self, row: int, what: str) -> Breach:
        return Breach(self.first + row, f"{what}, {self.starts[row]:.3f} s")

    def _extremes(self, order: int) -> tuple[Floats, Floats]:
        """Return the minimum and maximum (m, n) of the joints, or of their derivative of this order, in each segment:
        at its ends or at turning points. For a straight line only the ends count.
        """
        a, begin, end = self.orders[order], self.begin[order], self.end[order]
        low, high = np.minimum(begin, end), np.maximum(begin, end)
        for s in self._turns(self.orders[order + 1]) if order < 2 and len(a) > 2 else ():
            there = np.where(self.straight, begin, _value(a, s))
            low, high = np.minimum(low, there), np.maximum(high, there)
        for row, path, duration in self.steep:
            low[row], high[row] = np.transpose(path.extremes(duration, order))
        return low, high

    def _turns(self, rates: Floats) -> Iterator[Floats]:
        """Yield the times (m, n) at which cubics turn back, or 0 if they do not. `rates`: their derivatives."""
        c, b, *more = rates
        d = more[0] if more else 0.0
        with np.errstate(all="ignore"):
            # both roots follow from q, without cancellation
            q = -0.5 * (b + np.copysign(np.sqrt(b * b - 4.0 * d * c), b))
            for s in (c / q, q / d) if np.any(d) else (c / q,):
                yield np.where((s > 0.0) & (s < self.durations), s, 0.0)

    # --- lines ---------------------------------------------------------------------------------------------------

    def _segment(self, row: int) -> Segment:
        for block in self.blocks:
            if row < block.last - block.first:
                return block.row[block.first + row].shift_by(block.offset)
            row -= block.last - block.first
        raise IndexError(row)

    def _line(self, row: int) -> Iterator[Breach]:
        """Find the joints and rates at both ends of a straight line, and check coarsely that it can be followed: in
        reach, and with seeds that agree.
        """
        segment = self._segment(row)
        path = segment.path
        assert isinstance(path, CartesianPath)
        for s, (joints, rates, _) in ((0.0, self.begin), (segment.duration, self.end)):
            found = _joints(self.arm, segment, path, s, path.seed(s))
            joints[row] = np.nan if found is None else found
            rates[row] = np.nan if found is None else _rates(self.arm, segment, path, s, found)
        if np.isnan([self.begin[0][row], self.end[0][row]]).any():
            yield self._breach(row, "the straight line leaves the reach of the arm")
        elif not _seeds_agree(self.arm, segment, path):
            yield self._breach(row, "the joints jump in the straight line")


def _derivative(a: Floats) -> Floats:
    """Differentiate polynomials (k, m, n), which gives (k - 1, m, n); constants give (1, m, n)."""
    return a[1:] * np.arange(1.0, len(a))[:, None, None] if len(a) > 1 else np.zeros_like(a)


def _value(a: Floats, s: Floats) -> Floats:
    """Evaluate polynomials (k, m, n) at times (m, n) or (m, 1)."""
    value: Floats = np.zeros_like(a[0])
    for row in a[::-1]:  # Horner's rule
        value *= s
        value += row
    return value


# --- straight lines ----------------------------------------------------------------------------------------------


def _joints(arm: RobotArm, segment: Segment, path: CartesianPath, s: float, seed: Joints) -> Joints | None:
    """Return the joints s seconds into a line; None if the arm does not reach the pose."""
    flange = compose(path.pose(s), inverse(segment.motion.frames.tool))
    found = joints_on(arm.for_tool(segment.motion.frames.tool), path, s, flange, seed)
    # the seed is as good as a solution at the edge of the reach
    if found is None and distance(arm.forward(seed), flange) <= PLACE_TOLERANCE:
        return seed
    return found


def _rates(arm: RobotArm, segment: Segment, path: CartesianPath, s: float, joints: Joints) -> Joints:
    """Return the joints' velocity s seconds into a line; NaN in a singular pose."""
    twist = path.twist(s)
    if not any(twist):
        return (0.0,) * len(joints)
    try:
        return joint_velocity(arm, path, s, joints, twist, segment.motion.frames.tool)
    except StraightLineSingular:
        return (np.nan,) * len(joints)


def _seeds_agree(arm: RobotArm, segment: Segment, path: CartesianPath) -> bool:
    """Return whether every two adjacent seeds lead to the same joints at the time when the second seed replaces the
    first.
    """
    turns = [link.kind is JointKind.REVOLUTE for link in arm.model.links]
    for k, (seed, after) in enumerate(zip(path.seeds, path.seeds[1:], strict=False)):
        s = (k + 0.5) * path.seed_interval
        if s > segment.duration:
            return True
        one, other = (_joints(arm, segment, path, s, near) for near in (seed, after))
        if one is None or other is None or max(map(abs, np.subtract(one, other))) > PLACE_TOLERANCE:
            return False
        if any(turn and abs(q - near) > MAX_SEED_DISTANCE for q, near, turn in zip(one, seed, turns, strict=True)):
            return False
    return True


def _too_fast(arm: RobotArm, index: int, start: float, samples: Sequence[Sample]) -> Iterator[Breach]:
    """Yield a breach for the first joint that is too fast along a line."""
    for sample in samples:
        for joint, (rate, most) in enumerate(zip(sample.velocity, arm.model.max_velocity, strict=True), 1):
            if abs(rate) > most * (1.0 + LIMIT_EXCESS):
                fast = f"joint {joint} moves with {arm.model.joint_text(joint, abs(rate), 4)}/s, faster than it can"
                yield Breach(index, f"{fast}, {start + sample.s:.3f} s")
                return
