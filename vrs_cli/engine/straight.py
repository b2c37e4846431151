"""Straight lines: the joints along the path of the tool, and how far they are from their limits.

A straight-line motion is planned for the tool first; here its joints are found by inverse kinematics in one constant
configuration, sampled more finely where they change quickly, and compared with every joint's limits. A line that asks
too much is slowed down as a whole; one that would have to be slowed beyond a bound is refused with the place.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import degrees, sqrt

from vrs_cli.errors import JointOutOfRange, LocationOutOfRange, MotionError, StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.configuration import Configuration, Wrist
from vrs_cli.kinematics.joints import Joints, joints_outside, largest_change
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.trajectory.blend import ToolLimits, ToolState, ToolStretch, straight_motion
from vrs_cli.trajectory.motion import Motion
from vrs_cli.trajectory.segment import CartesianPath, Segment, Turn

SAMPLES = 8  # a stretch, before it is refined
FINEST = 2.0**-10  # of a stretch: no finer
JOINT_STEP = 0.08  # [rad] between neighbouring samples
JUMP = 2e-3  # [rad] more than the velocities of two neighbours explain
RATE_STEP = 0.12  # change of joint velocity between neighbours, as a part of its limit
SEED_STEP = 1.0  # [rad] between neighbouring seeds: far less than the half turn that would confuse them
STILL = 1e-9  # [m/s, rad/s] a tool that stands
WRIST_SINGULAR = 1e-6  # [rad] joint 5 this near to straight: FLIP and NOFLIP meet
MARGIN = 1.01  # loads are taken so much higher than the samples show, for what lies between them
SPARE = 1.001  # a line is slowed so much more than it must be, to be done with it
ATTEMPTS = 8
SLOWEST = 20.0  # PARAMETER STRETCH: a line is slowed down at most so many times


@dataclass(frozen=True, slots=True)
class Sample:
    """Joints and joint velocity at a time of a stretch [s, rad, rad/s]."""

    s: float
    joints: Joints
    velocity: Joints


@dataclass(frozen=True, slots=True)
class Load:
    """The greatest joint velocity and acceleration of a line as parts of their limits, and where they are."""

    velocity: float = 0.0
    acceleration: float = 0.0
    joint: int = 0
    place: Transform | None = None

    def worse(self, other: Load) -> Load:
        worst = (
            self
            if max(self.velocity, sqrt(self.acceleration)) >= max(other.velocity, sqrt(other.acceleration))
            else other
        )
        return Load(
            max(self.velocity, other.velocity),
            max(self.acceleration, other.acceleration),
            worst.joint,
            worst.place,
        )


def straight_segments(
    arm: RobotArm, state: ToolState, joints: Joints, motion: Motion, start: float, slowest: float = SLOWEST
) -> tuple[Segment, ...]:
    """The segments of a straight-line motion from a tool state (whose joints are `joints`) to `motion.pose`.

    Raises LocationOutOfRange or JointOutOfRange when the line leaves the reach, StraightLineSingular when the joints
    could follow only at less than 1/`slowest` of the speed asked.
    """
    failure: MotionError | None = None
    for configuration in _configurations(arm, joints):
        try:
            return _Follower(arm, state, joints, motion, configuration, slowest).segments(start)
        except MotionError as error:
            failure = failure or error
    assert failure is not None
    raise failure


def _configurations(arm: RobotArm, joints: Joints) -> Iterator[Configuration]:
    """The configuration of the arm; at a straight wrist, where both hold, the other wrist too."""
    present = arm.configuration(joints)
    yield present
    if abs(joints[4]) < WRIST_SINGULAR:
        other = Wrist.FLIP if present.wrist is Wrist.NOFLIP else Wrist.NOFLIP
        yield Configuration(present.arm, present.elbow, other)


def tool_limits(arm: RobotArm, motion: Motion) -> ToolLimits:
    """Nominal tool speed and acceleration, at the motion's fractions of them."""
    model = arm.model
    speed = model.linear_speed * motion.speed if motion.tip_speed is None else motion.tip_speed
    return ToolLimits(
        speed,
        model.linear_acceleration * motion.acceleration,
        model.angular_speed * (motion.speed if motion.rotation is None else motion.rotation),
        model.angular_acceleration * motion.acceleration,
    )


class _Follower:
    """One straight-line motion in one configuration."""

    def __init__(
        self,
        arm: RobotArm,
        state: ToolState,
        joints: Joints,
        motion: Motion,
        configuration: Configuration,
        slowest: float,
    ) -> None:
        self.arm, self.state, self.joints, self.motion = arm, state, joints, motion
        self.configuration, self.slowest = configuration, slowest
        self.tool = motion.frames.tool
        self.T_tool_flange = inverse(motion.frames.tool)
        assert motion.pose is not None
        self.target = motion.pose

    def segments(self, start: float) -> tuple[Segment, ...]:
        limits = tool_limits(self.arm, self.motion)
        slowed = 1.0
        for _ in range(ATTEMPTS):
            stretches = straight_motion(self.state, self.target, limits, self.motion.duration)
            segments, load = self.follow(stretches, start)
            if load.velocity <= 1.0 and load.acceleration <= 1.0:
                return segments
            by_velocity, by_acceleration = self.slowing(load)
            slowed *= by_velocity
            if slowed > self.slowest:
                break
            limits = limits.slowed(by_velocity, by_acceleration)
        raise self.too_singular(load)

    def slowing(self, load: Load) -> tuple[float, float]:
        """By how much to divide velocities and accelerations. From rest, time is stretched as a whole: exact."""
        if self.state.at_rest:
            factor = max(load.velocity, sqrt(load.acceleration)) * SPARE
            return factor, factor * factor
        return max(load.velocity, 1.0) * SPARE, max(load.acceleration, 1.0) * SPARE

    def too_singular(self, load: Load) -> StraightLineSingular:
        place = load.place or self.target
        times = max(load.velocity, sqrt(load.acceleration))
        return StraightLineSingular(
            f"near X {place.px * 1e3:.1f} Y {place.py * 1e3:.1f} Z {place.pz * 1e3:.1f} mm joint {load.joint} "
            f"would have to move {times:.0f} times too fast",
            "use MOVE there, or a via point farther from the singularity",
        )

    def follow(self, stretches: list[ToolStretch], start: float) -> tuple[tuple[Segment, ...], Load]:
        """Segments with their joints known, and the greatest load on a joint."""
        segments, load, near = [], Load(), self.joints
        for stretch in stretches:
            path = self.bare_path(stretch)
            samples = self.samples(path, stretch.duration, near)
            near = samples[-1].joints
            load = load.worse(self.load(path, samples))
            seeds = self.seeds(samples, stretch.duration)
            interval = stretch.duration / max(len(seeds) - 1, 1)
            path = CartesianPath(path.position, path.orientation, path.turns, self.configuration, seeds, interval)
            segments.append(Segment(start, start + stretch.duration, path, stretch.phase, self.motion))
            start += stretch.duration
        return tuple(segments), load

    def bare_path(self, stretch: ToolStretch) -> CartesianPath:
        turns = tuple(Turn(axis, angle) for axis, angle in stretch.turns)
        return CartesianPath(stretch.position, stretch.orientation, turns, self.configuration, (self.joints,), 1.0)

    # --- joints along the path ---

    def samples(self, path: CartesianPath, duration: float, near: Joints) -> list[Sample]:
        """In order of time, closer together where the joints change quickly; the first joints are next to `near`."""
        samples = [self.sample(path, 0.0, near)]
        for step in range(1, SAMPLES + 1):
            self.refine(path, samples, duration * step / SAMPLES, duration * FINEST)
        return samples

    def refine(self, path: CartesianPath, samples: list[Sample], until: float, finest: float) -> None:
        """Append samples up to time `until`, halving the way while neighbours differ too much."""
        pending = [until]
        while pending:
            last = samples[-1]
            sample = self.sample(path, pending[-1], last.joints)
            if self.close(last, sample):
                samples.append(sample)
                pending.pop()
            elif sample.s - last.s > finest:
                pending.append(0.5 * (last.s + sample.s))
            else:
                self.check_no_jump(last, sample, path)
                samples.append(sample)
                pending.pop()

    def close(self, a: Sample, b: Sample) -> bool:
        if largest_change(a.joints, b.joints) > JOINT_STEP or _unexplained(a, b)[0] > JUMP:
            return False
        limits = self.arm.model.max_velocity
        return all(abs(w - v) <= RATE_STEP * limit for v, w, limit in zip(a.velocity, b.velocity, limits, strict=True))

    def check_no_jump(self, a: Sample, b: Sample, path: CartesianPath) -> None:
        """At a singularity joints may jump: they change in next to no time, though their velocities are small."""
        jump, joint = _unexplained(a, b)
        if jump > JUMP:
            raise StraightLineSingular(
                f"near {_place(path.pose(b.s))} joint {joint} would have to jump by {degrees(jump):.1f} deg",
                "use MOVE there, or a via point farther from the singularity",
            )

    def sample(self, path: CartesianPath, s: float, near: Joints) -> Sample:
        pose = path.pose(s)
        joints = self.arm.branch_joints(compose(pose, self.T_tool_flange), self.configuration, near)
        if joints is None:
            raise LocationOutOfRange(
                f"the straight line leaves the reach of the arm near {_place(pose)}",
                "use MOVE, or a via point nearer to the robot",
            )
        self.check_limits(joints, pose)
        twist = path.twist(s)
        if max(map(abs, twist)) <= STILL:
            return Sample(s, joints, (0.0,) * len(joints))
        return Sample(s, joints, self.arm.joint_velocity(joints, twist, self.tool))

    def check_limits(self, joints: Joints, pose: Transform) -> None:
        model = self.arm.model
        outside = joints_outside(joints, model.lower, model.upper)
        if outside:
            joint = outside[0]
            i = joint - 1
            raise JointOutOfRange(
                joint,
                f"the straight line needs {degrees(joints[i]):.1f} deg near {_place(pose)}, "
                f"its range is {degrees(model.lower[i]):.0f} to {degrees(model.upper[i]):.0f}",
                "use MOVE, or another configuration",
            )

    def load(self, path: CartesianPath, samples: list[Sample]) -> Load:
        model = self.arm.model
        load = Load()
        for sample in samples:
            ratios = [abs(v) / limit for v, limit in zip(sample.velocity, model.max_velocity, strict=True)]
            load = load.worse(_load(ratios, path, sample.s, 0))
        for s, acceleration in _accelerations(samples):
            ratios = [abs(a) / limit for a, limit in zip(acceleration, model.max_acceleration, strict=True)]
            load = load.worse(_load(ratios, path, s, 1))
        return Load(load.velocity * MARGIN, load.acceleration * MARGIN * MARGIN, load.joint, load.place)

    def seeds(self, samples: list[Sample], duration: float) -> tuple[Joints, ...]:
        """Joints at equal intervals, so many that neighbours are near each other."""
        travelled = sum(largest_change(a.joints, b.joints) for a, b in pairwise(samples))
        count = max(int(travelled / SEED_STEP) + 1, 1) * (1 if travelled < SEED_STEP else 2)
        seeds = []
        at = 0
        for k in range(count + 1):
            s = duration * k / count
            while at < len(samples) - 1 and abs(samples[at + 1].s - s) <= abs(samples[at].s - s):
                at += 1
            seeds.append(samples[at].joints)
        return tuple(seeds)


def _accelerations(samples: list[Sample]) -> Iterator[tuple[float, Joints]]:
    """Mean joint accelerations between samples, carried on to both ends, where they are often greatest."""
    means = [
        (0.5 * (a.s + b.s), tuple((w - v) / (b.s - a.s) for v, w in zip(a.velocity, b.velocity, strict=True)))
        for a, b in pairwise(samples)
    ]
    yield from means
    yield samples[0].s, _carried_on(means[0], means[1], samples[0].s)
    yield samples[-1].s, _carried_on(means[-1], means[-2], samples[-1].s)


def _carried_on(near: tuple[float, Joints], far: tuple[float, Joints], s: float) -> Joints:
    """The line through two timed values, at time s."""
    part = (s - near[0]) / (near[0] - far[0])
    return tuple(a + part * (a - b) for a, b in zip(near[1], far[1], strict=True))


def _unexplained(a: Sample, b: Sample) -> tuple[float, int]:
    """The greatest joint change that the velocities at both ends do not explain [rad], and its joint."""
    half = 0.5 * (b.s - a.s)
    gaps = [abs(q - p - half * (v + w)) for p, q, v, w in zip(a.joints, b.joints, a.velocity, b.velocity, strict=True)]
    worst = max(gaps)
    return worst, gaps.index(worst) + 1


def _load(ratios: list[float], path: CartesianPath, s: float, order: int) -> Load:
    """The load of one sample: of velocity (order 0) or acceleration (order 1)."""
    worst = max(ratios)
    if worst <= 1.0:
        return Load(acceleration=worst) if order else Load(velocity=worst)
    joint, place = ratios.index(worst) + 1, path.pose(s)
    return Load(0.0, worst, joint, place) if order else Load(worst, 0.0, joint, place)


def _place(pose: Transform) -> str:
    return f"X {pose.px * 1e3:.1f} Y {pose.py * 1e3:.1f} Z {pose.pz * 1e3:.1f} mm"
