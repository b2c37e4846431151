"""The joints along the path of a tool, in one constant configuration.

The path is sampled, more finely where the joints change quickly; neighbouring samples explain each other, so that no
joint jumps unseen. What the samples show is the load: the greatest joint velocity and acceleration as parts of their
limits.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import cbrt, sqrt
from typing import NamedTuple

from vrs_cli.errors import (
    JointOutOfRange,
    LocationOutOfRange,
    LocationTooClose,
    LocationTooFar,
    MotionError,
    StraightLineSingular,
)
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.configuration import Configuration
from vrs_cli.kinematics.joints import Joints, joints_outside
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, inverse, position
from vrs_cli.trajectory.segment import CartesianPath, Twist

SAMPLES = 8  # a stretch, before it is refined
FEWER_SAMPLES = 4  # a stretch of a jerk-limited motion, which has more of them
FINEST = 2.0**-10  # of a stretch: no finer
SINGULAR = 1e-4  # measure of a pose in which a line may begin or end, and where it is looked at more closely
CLOSER = tuple(2.0**-k for k in range(12, 3, -1))  # parts of a stretch, next to such a pose
JOINT_STEP = 0.15  # [rad] at most between neighbouring samples
RATE_STEP = 0.15  # change of joint velocity between neighbours, as a part of its limit
JUMP = 2e-3  # [rad] at most, beyond what the velocities of two neighbours explain
STILL = 1e-9  # [m/s, rad/s] a tool that stands
MARGIN = 1.01  # velocities are taken so much higher than the samples show, for what lies between them
SMALL_MARGIN = 1.0005
ROUNDING = 1e-6  # a velocity that is this little above its limit is at it
ACCELERATION_MARGIN = 1.025
JERK_MARGIN = 1.1
NEAR_LIMIT_OF_JERK = 0.7  # a mean jerk between two samples from which it is looked at more closely
NEAR_LIMIT = 0.9  # of an acceleration limit: the mean between two samples may hide a peak above it
NEAR_PEAK = 0.95  # of the worst joint's part of its limit: the joints whose peaks between samples are looked for
GOLDEN = 0.6180339887498949
CLOSE_BY = 0.2  # measure of a pose that a singularity is to blame for
PASSED = "use MOVE there, or a via point farther from the singularity"
WAYS_ROUND = {  # by the singularity
    "shoulder": "use MOVE there, or a via point that keeps the wrist farther from the axis of joint 1",
    "elbow": "use MOVE there, or a via point where the arm is neither stretched out nor folded up",
    "wrist": "use MOVE there, or a via point with the tool tilted, so that joint 5 does not come to 0",
}
DRIVEN_ROUND = {"shoulder": (1,), "wrist": (4, 6)}  # the joints that a singularity turns far
AT_REST = (0.0,) * 6
EDGE_STEPS = 30  # to find the place where a line is no longer possible, as well as it is shown
PEAK_STEPS = 14  # leave a thousandth of the way between two samples


class Sample(NamedTuple):
    """Joints and joint velocity at a time of a stretch [s, rad, rad/s]."""

    s: float
    joints: Joints
    velocity: Joints


@dataclass(frozen=True, slots=True)
class Load:
    """The greatest joint velocity, acceleration and jerk as parts of their limits; which joint asks most, and where."""

    velocity: float = 0.0
    acceleration: float = 0.0
    joint: int = 0
    place: Transform | None = None
    jerk: float = 0.0

    @property
    def slowing(self) -> float:
        """By how much time would have to be stretched for the joints to follow."""
        return max(self.velocity, sqrt(self.acceleration), cbrt(self.jerk))

    def worse(self, other: Load) -> Load:
        worst = self if self.slowing >= other.slowing else other
        velocity, acceleration = max(self.velocity, other.velocity), max(self.acceleration, other.acceleration)
        return Load(velocity, acceleration, worst.joint, worst.place, max(self.jerk, other.jerk))


class Follower:
    """Follows paths of a tool with one arm in one configuration."""

    def __init__(
        self,
        arm: RobotArm,
        configuration: Configuration,
        T_flange_tool: Transform,
        T_robot_world: Transform = IDENTITY,
    ) -> None:
        self.arm, self.configuration, self.tool = arm, configuration, T_flange_tool
        self.T_world_robot = inverse(T_robot_world)
        self.T_tool_flange = inverse(T_flange_tool)
        self.no_tool = T_flange_tool == IDENTITY
        self._biased: tuple[Joints, Twist] = ((), AT_REST)
        self.max_velocity = arm.model.max_velocity
        self.lower, self.upper = arm.model.lower, arm.model.upper
        self.rate_steps = tuple(RATE_STEP * limit for limit in arm.model.max_velocity)

    def samples(
        self, path: CartesianPath, duration: float, near: Joints, steps: int = SAMPLES, before: Sample | None = None
    ) -> list[Sample]:
        """In order of time, at `steps` intervals or finer; the first joints are next to `near`. `before`: the last
        sample of the stretch before, which is at the same instant.

        Raises LocationOutOfRange, JointOutOfRange, StraightLineSingular with the place.
        """
        samples = [self._sample(path, 0.0, near) if before is None else before._replace(s=0.0)]
        finest = duration * FINEST
        if self._singular(samples[0]):  # from there a joint may turn about at once
            for part in CLOSER:
                self._refine(path, samples, duration * part, finest)
        for step in range(1, steps + 1):
            self._refine(path, samples, duration * step / steps, finest)
        if self._singular(samples[-1]):
            samples.pop()
            for part in reversed(CLOSER):
                if duration * (1.0 - part) - samples[-1].s > finest:
                    self._refine(path, samples, duration * (1.0 - part), finest)
            self._refine(path, samples, duration, finest)
        return samples

    def _singular(self, sample: Sample) -> bool:
        return not any(sample.velocity) and min(self.arm.singularity(sample.joints)) < SINGULAR

    def _refine(self, path: CartesianPath, samples: list[Sample], until: float, finest: float) -> None:
        """Append samples up to time `until`, halving the way while neighbours differ too much."""
        pending = [until]
        while pending:
            last = samples[-1]
            try:
                sample = self._sample(path, pending[-1], last.joints)
            except (LocationOutOfRange, JointOutOfRange) as refusal:
                raise self._earliest(path, last, pending[-1], refusal) from None
            if self._close(last, sample):
                self._check_turns(path, last, sample)
                samples.append(sample)
                pending.pop()
            elif sample.s - last.s > finest:
                pending.append(0.5 * (last.s + sample.s))
            else:
                self._check_no_jump(last, sample, path)
                samples.append(sample)
                pending.pop()

    def _earliest(self, path: CartesianPath, good: Sample, until: float, refusal: MotionError) -> MotionError:
        """The refusal where the line first leaves the reach or a range, after a good sample."""
        low, high = good.s, until
        for _ in range(EDGE_STEPS):
            middle = 0.5 * (low + high)
            if self._possible(path, middle, good.joints):
                low = middle
            else:
                high = middle
        try:
            self._sample(path, high, good.joints)
        except (LocationOutOfRange, JointOutOfRange) as earliest:
            return earliest
        return refusal

    def _possible(self, path: CartesianPath, s: float, near: Joints) -> bool:
        """Whether the arm reaches the path at time s, every joint in its range."""
        joints = self.arm.branch_joints(compose(path.pose(s), self.T_tool_flange), self.configuration, near)
        return joints is not None and self.arm.limits_ok(joints)

    def _close(self, a: Sample, b: Sample) -> bool:
        half = 0.5 * (b.s - a.s)
        for p, q, v, w, step in zip(a.joints, b.joints, a.velocity, b.velocity, self.rate_steps, strict=True):
            change = q - p
            if not (
                -JOINT_STEP <= change <= JOINT_STEP
                and -step <= w - v <= step
                and -JUMP <= change - half * (v + w) <= JUMP
            ):
                return False
        return True

    def _check_turns(self, path: CartesianPath, a: Sample, b: Sample) -> None:
        """A joint that turns back between two samples is farthest there: inside its range too?"""
        half = 0.5 * (b.s - a.s)
        for i, (v, w) in enumerate(zip(a.velocity, b.velocity, strict=True)):
            if v * w < 0.0 and not self.lower[i] <= a.joints[i] + half * v <= self.upper[i]:
                self._turn(path, i, a, b)

    def _turn(self, path: CartesianPath, joint: int, a: Sample, b: Sample) -> None:
        """Look where a joint turns back; a sample outside the range is refused."""
        low, high = a.s, b.s
        for _ in range(PEAK_STEPS):
            middle = self._sample(path, 0.5 * (low + high), a.joints)
            if middle.velocity[joint] * a.velocity[joint] > 0.0:
                low = middle.s
            else:
                high = middle.s

    def _check_no_jump(self, a: Sample, b: Sample, path: CartesianPath) -> None:
        """At a singularity joints may jump: they change in next to no time, though their velocities are small."""
        half = 0.5 * (b.s - a.s)
        rows = zip(a.joints, b.joints, a.velocity, b.velocity, strict=True)
        jumps = [abs(q - p - half * (v + w)) for p, q, v, w in rows]
        if max(jumps) > JUMP:
            pose = path.pose(b.s)
            near, hint = self.place(pose)
            joint = jumps.index(max(jumps)) + 1
            raise StraightLineSingular(
                f"near {near} joint {joint} would have to jump by {self.arm.model.said(joint, max(jumps), 1)}",
                hint or PASSED,
            ).at(*position(pose))

    def place(self, pose: Transform) -> tuple[str, str]:
        """Where T_robot_tool is, with the singularity that it is close to, and the way round that; "" for none."""
        which = self.singularity(pose)
        return (f"{self.shown(pose)} ({which} singularity)", WAYS_ROUND[which]) if which else (self.shown(pose), "")

    def shown(self, pose: Transform) -> str:
        """The place of T_robot_tool in the world, as people read it."""
        x, y, z = (round(1e3 * part, 1) + 0.0 for part in position(compose(self.T_world_robot, pose)))  # no -0.0
        return f"X {x:.1f} Y {y:.1f} Z {z:.1f} mm"

    def singularity(self, pose: Transform) -> str:
        """Which singularity T_robot_tool is close to, if one is: shoulder, elbow or wrist."""
        joints = self.arm.branch_joints(compose(pose, self.T_tool_flange), self.configuration, self._middle)
        if joints is None:
            return ""
        measures = self.arm.singularity(joints)
        nearest = min(range(len(measures)), key=measures.__getitem__)
        return measures._fields[nearest] if measures[nearest] < CLOSE_BY else ""

    @property
    def _middle(self) -> Joints:
        return tuple(0.5 * (low + high) for low, high in zip(self.lower, self.upper, strict=True))

    def _sample(self, path: CartesianPath, s: float, near: Joints) -> Sample:
        pose, twist = path.state(s)
        flange = pose if self.no_tool else compose(pose, self.T_tool_flange)
        joints = self.arm.branch_joints(flange, self.configuration, near)
        if joints is None:
            raise self._out_of_reach(pose, near)
        if not self.arm.limits_ok(joints):
            raise self._outside(joints, pose)
        if max(twist) <= STILL and min(twist) >= -STILL:
            return Sample(s, joints, (0.0,) * len(joints))
        return Sample(s, joints, self.arm.joint_velocity(joints, twist, self.tool))

    def _out_of_reach(self, pose: Transform, near: Joints) -> LocationOutOfRange:
        """The refusal of a line that leaves the reach: outward, next to the robot, or for how the tool is turned."""
        leaves = f"the straight line leaves the reach of the arm near {self.shown(pose)}"
        what, hint = ", for how the tool is turned there", "turn it less on the way"
        try:
            self.arm.select(compose(pose, self.T_tool_flange), near)
            if self.arm.words:
                what, hint = " as it is configured", "another configuration"
        except LocationTooClose:
            what, hint = ", too close", "a via point farther from the robot"
        except LocationTooFar:
            what, hint = ", too far", "a via point nearer to the robot"
        except MotionError:
            pass
        return LocationOutOfRange(leaves + what, f"use MOVE, or {hint}").at(*position(pose))

    def _outside(self, joints: Joints, pose: Transform) -> JointOutOfRange:
        model = self.arm.model
        joint = joints_outside(joints, model.lower, model.upper)[0]
        near, hint = self.place(pose)
        if joint not in DRIVEN_ROUND.get(self.singularity(pose), ()):
            near, hint = self.shown(pose), ""
        return JointOutOfRange(
            joint,
            f"the straight line leaves its range, {model.range_of(joint, 0)}, near {near}",
            hint or "use MOVE, or another configuration",
        ).at(*position(pose))

    # --- what the samples show ---

    def load(self, path: CartesianPath, samples: list[Sample], start: Joints) -> Load:
        """The greatest load. A joint that is no faster than at the start of the motion, `start`, is given
        little margin: the motion that was interrupted may have been at its limit.
        """
        accelerations = self._accelerations(path, samples)
        columns = _columns([sample.velocity for sample in samples])
        fastest = [max(column[1:]) for column in columns]
        rows = [(v, MARGIN if v > abs(before) else SMALL_MARGIN) for v, before in zip(fastest, start, strict=True)]
        velocity = self._velocity_load(path, samples[-1].s, rows)
        if velocity.place is not None:
            at = columns[velocity.joint - 1].index(fastest[velocity.joint - 1], 1)
            velocity = replace(velocity, place=path.pose(samples[at].s))
        peaks = _first_peaks(samples, accelerations)
        velocity = velocity.worse(self._velocity_load(path, samples[0].s, [(v, 1.0) for v in peaks]))
        for sample in self._peaks(path, samples, columns, velocity.velocity):
            velocity = velocity.worse(self._velocity_load(path, sample.s, [(v, SMALL_MARGIN) for v in sample.velocity]))
        return velocity.worse(self._acceleration_load(path, accelerations))

    def _acceleration_load(self, path: CartesianPath, accelerations: list[tuple[float, Joints]]) -> Load:
        columns = _columns([rates for _, rates in accelerations])
        limits = self.arm.model.max_acceleration
        ratios = [max(column) / limit * ACCELERATION_MARGIN for column, limit in zip(columns, limits, strict=True)]
        worst = max(ratios)
        if worst <= 1.0:
            return Load(0.0, worst)
        column = columns[ratios.index(worst)]
        s, _ = accelerations[column.index(max(column))]
        return Load(0.0, worst, ratios.index(worst) + 1, path.pose(s))

    def _peaks(
        self, path: CartesianPath, samples: list[Sample], columns: list[list[float]], worst: float
    ) -> Iterator[Sample]:
        """Where the joints that may be too fast are fastest: past a singularity that is for a moment only."""
        for i, (speeds, limit) in enumerate(zip(columns, self.max_velocity, strict=True)):
            k = speeds.index(max(speeds))
            if k and speeds[k] / limit >= NEAR_PEAK * max(worst, 1.0):  # what the first interval has is known
                yield self._peak(path, i, samples[k - 1], samples[min(k + 1, len(samples) - 1)])

    def _peak(self, path: CartesianPath, joint: int, before: Sample, after: Sample) -> Sample:
        """Where a joint is fastest between two samples, by golden section."""
        low, high, near = before.s, after.s, before.joints
        a = self._sample(path, high - GOLDEN * (high - low), near)
        b = self._sample(path, low + GOLDEN * (high - low), near)
        for _ in range(PEAK_STEPS):
            if abs(a.velocity[joint]) > abs(b.velocity[joint]):
                high, b = b.s, a
                a = self._sample(path, high - GOLDEN * (high - low), near)
            else:
                low, a = a.s, b
                b = self._sample(path, low + GOLDEN * (high - low), near)
        return max(a, b, key=lambda sample: abs(sample.velocity[joint]))

    def _accelerations(self, path: CartesianPath, samples: list[Sample]) -> list[tuple[float, Joints]]:
        """Joint accelerations at both ends, where they are often greatest, the mean ones between samples, and those of
        the samples at a mean that is near its limit.
        """
        means = [
            (0.5 * (a.s + b.s), tuple([(w - v) / (b.s - a.s) for v, w in zip(a.velocity, b.velocity, strict=True)]))
            for a, b in pairwise(samples)
        ]
        first, last = samples[0], samples[-1]
        at_first = self._acceleration(path, first) or _carried_on(means[0], means[1], first.s)
        at_last = self._acceleration(path, last) or _carried_on(means[-1], means[-2], last.s)
        return [(first.s, at_first), *means, *self._near_limit(path, samples, means), (last.s, at_last)]

    def _near_limit(
        self, path: CartesianPath, samples: list[Sample], means: list[tuple[float, Joints]]
    ) -> Iterator[tuple[float, Joints]]:
        """The joint accelerations at both samples of the greatest mean of a joint, where that is near its limit."""
        for column, limit in zip(_columns([rates for _, rates in means]), self.arm.model.max_acceleration, strict=True):
            greatest = max(column)
            if NEAR_LIMIT * limit < greatest:
                k = column.index(greatest)
                for sample in samples[k : k + 2]:
                    rates = self._acceleration(path, sample)
                    if rates is not None:
                        yield sample.s, rates

    def _acceleration(self, path: CartesianPath, sample: Sample) -> Joints | None:
        """The joint acceleration at a sample; None in a singular pose, where none is defined."""
        bias = self._bias(sample)
        vx, vy, vz, wx, wy, wz = (a - b for a, b in zip(path.twist_rate(sample.s), bias, strict=True))
        try:
            return self.arm.joint_velocity(sample.joints, (vx, vy, vz, wx, wy, wz), self.tool)
        except StraightLineSingular:
            return None

    def _bias(self, sample: Sample) -> Twist:
        """J' qd; the last one is kept, for a stretch begins where the one before it ends."""
        if not any(sample.velocity):
            return AT_REST
        if self._biased[0] is not sample.joints:
            self._biased = sample.joints, self.arm.acceleration_bias(sample.joints, sample.velocity, self.tool)
        return self._biased[1]

    def jerk_load(self, path: CartesianPath, samples: list[Sample]) -> Load:
        """The greatest joint jerk, from the changes of the joint accelerations; where one is near its limit, also from
        those at times between samples. At both ends the changes are carried on.
        """
        rates = [(sample, rate) for sample in samples if (rate := self._acceleration(path, sample)) is not None]
        means = [mean for (a, before), (b, after) in pairwise(rates) for mean in self._jerks(path, a, before, b, after)]
        if len(means) > 1:
            ends = _carried_on(means[0], means[1], rates[0][0].s), _carried_on(means[-1], means[-2], rates[-1][0].s)
            means += zip((rates[0][0].s, rates[-1][0].s), ends, strict=True)
        load = Load()
        for s, jerks in means:
            ratios = self._jerk_ratios(jerks)
            worst = max(ratios)
            if worst > load.jerk:
                load = Load(0.0, 0.0, ratios.index(worst) + 1, path.pose(s) if worst > 1.0 else None, worst)
        return load

    def _jerk_ratios(self, jerks: Joints) -> list[float]:
        return [abs(j) / most * JERK_MARGIN for j, most in zip(jerks, self.arm.model.max_jerk, strict=True)]

    def _jerks(
        self, path: CartesianPath, a: Sample, before: Joints, b: Sample, after: Joints
    ) -> list[tuple[float, Joints]]:
        """The mean jerks between two samples with their accelerations; where they are near a limit, in four parts."""
        whole = _mean_jerk(a.s, before, b.s, after)
        if max(self._jerk_ratios(whole[1])) < NEAR_LIMIT_OF_JERK:
            return [whole]
        row = [(a.s, before)]
        for part in (0.25, 0.5, 0.75):
            sample = self._sample(path, a.s + part * (b.s - a.s), a.joints)
            rates = self._acceleration(path, sample)
            if rates is not None:
                row.append((sample.s, rates))
        return [_mean_jerk(s, first, t, then) for (s, first), (t, then) in pairwise([*row, (b.s, after)])]

    def _velocity_load(self, path: CartesianPath, s: float, rows: list[tuple[float, float]]) -> Load:
        """The load of joint velocities, each taken higher by its margin."""
        ratios = [abs(v) * margin / limit for (v, margin), limit in zip(rows, self.max_velocity, strict=True)]
        worst = max(ratios)
        return Load(worst, 0.0, ratios.index(worst) + 1, path.pose(s) if worst > 1.0 + ROUNDING else None)


def _columns(rows: list[Joints]) -> list[list[float]]:
    """The sizes of the values of each joint, row after row."""
    return [[abs(v) for v in column] for column in zip(*rows, strict=True)]


def _mean_jerk(s: float, before: Joints, t: float, after: Joints) -> tuple[float, Joints]:
    """The time in the middle between s and t, and the mean change of accelerations."""
    return 0.5 * (s + t), tuple([(w - v) / (t - s) for v, w in zip(before, after, strict=True)])


def _first_peaks(samples: list[Sample], accelerations: list[tuple[float, Joints]]) -> Joints:
    """The greatest joint velocities between the first two samples: parabolas with the acceleration at the start."""
    lasting = samples[1].s - samples[0].s
    peaks = []
    for v, at_start, mean in zip(samples[0].velocity, accelerations[0][1], accelerations[1][1], strict=True):
        bend = at_start - mean
        peaks_between = at_start * v > 0.0 and abs(at_start) < 2.0 * abs(bend) and bend * v > 0.0
        peaks.append(v + at_start * at_start * lasting / (4.0 * bend) if peaks_between else v)
    return tuple(peaks)


def _carried_on(near: tuple[float, Joints], far: tuple[float, Joints], s: float) -> Joints:
    """The line through two timed values, at time s."""
    part = (s - near[0]) / (near[0] - far[0])
    return tuple([a + part * (a - b) for a, b in zip(near[1], far[1], strict=True)])


def seeds_of(samples: list[Sample], step: float) -> tuple[Joints, ...]:
    """Joints at equal intervals from the first sample to the last, so many that neighbours are near: within `step`."""
    travelled = 0.0
    for a, b in pairwise(samples):
        travelled += max([abs(y - x) for x, y in zip(a.joints, b.joints, strict=True)])
    count = 1 if travelled < step else 2 * (int(travelled / step) + 1)
    seeds = []
    at = 0
    for k in range(count + 1):
        s = samples[-1].s * k / count
        while at < len(samples) - 1 and abs(samples[at + 1].s - s) <= abs(samples[at].s - s):
            at += 1
        seeds.append(samples[at].joints)
    return tuple(seeds)
