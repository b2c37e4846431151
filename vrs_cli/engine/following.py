"""Follow the path of a tool with the joints, in one constant configuration.

The path is sampled, more finely where the joints change quickly. The motion between two samples must agree with the
joint velocities at both samples, so that no jump of a joint is missed. `load` computes what the samples demand of the
joints.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from itertools import accumulate, pairwise
from math import ceil, inf
from typing import NamedTuple

from vrs_cli.engine.problem import joint_velocity, joints_on, state_on
from vrs_cli.errors import (
    JointOutOfRange,
    LocationOutOfRange,
    LocationTooClose,
    LocationTooFar,
    MotionError,
    StraightLineSingular,
)
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.compiled import comma_list, compile_function
from vrs_cli.kinematics.joints import LIMIT_TOLERANCE, Configuration, Joints, joints_outside, largest_change
from vrs_cli.kinematics.model import ArmTask
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, inverse, position
from vrs_cli.trajectory.polynomial import bisect_interval
from vrs_cli.trajectory.segment import CartesianPath

FIRST_INTERVALS = 8  # number of intervals of a stretch before refinement
FINEST_INTERVAL = 2.0**-10  # finest interval, as a fraction of a stretch
SINGULAR_MEASURE = (
    1e-4  # singular measure (0: singular) below which a pose counts as singular: a line may only begin or end there
)
NEARLY_SINGULAR = 0.1  # singular measure of a pose above which differences of sampled velocities show all accelerations
MAX_GUESSED_PART = 0.2  # fraction of an interval: if Newton's method fails, longer parts are halved at once
MIN_INTERVAL = 1e-9  # minimum interval between samples, as a fraction of a stretch
CLOSER_PARTS = tuple(
    2.0**-k for k in range(12, 3, -1)
)  # distances of the samples next to a singular pose from it, as fractions of a stretch
JOINT_STEP = 0.15  # [rad] maximum change of a joint between neighbouring samples
RATE_STEP = 0.15  # maximum change of a joint velocity between two samples, as a fraction of the velocity limit
# a line that needs this many times the allowed slowing will be refused, so it is sampled less finely
HOPELESS_SLOWING = 2.0
# [rad] maximum difference between the change of a joint and what its velocities at both samples predict
MAX_JUMP = 2e-3
MIN_JUMP = 1e-6  # [rad] a joint change up to this next to a singular pose may be due to rounding
OVERSHOOT = 4.0 / 27.0  # maximum overshoot of a cubic beyond its ends, as a fraction of velocity times duration
RANGE_STEPS = 24  # maximum number of halvings between two samples, to check the ranges of joints
STANDING_SPEED = 1e-9  # [m/s, rad/s] a tool slower than this counts as at rest
NEAR_SINGULAR = 0.2  # singular measure of a pose below which an error names the singularity
SINGULAR_HINT = "use {MOVE} there, or a via point farther from the singularity"
WAYS_ROUND = {  # hints, by the name of the singularity
    "shoulder": "use {MOVE} there, or a via point that keeps the wrist farther from the axis of joint 1",
    "elbow": "use {MOVE} there, or a via point where the arm is neither stretched out nor folded up",
    "wrist": "use {MOVE} there, or a via point with the tool tilted, so that joint 5 does not come to 0",
}
DRIVEN_ROUND = {"shoulder": (1,), "wrist": (4, 6)}  # joints that turn far at a singularity
MAX_SEED_STEP = 2.0  # [rad, m] maximum change from a seed to the next, even where a joint is fast only briefly
EDGE_STEPS = 12  # number of halvings between two samples, to find where a line becomes impossible

_new = tuple.__new__


class Sample(NamedTuple):
    """The time since the start of a stretch [s], and the joints [rad] and joint velocities [rad/s] at that time."""

    s: float
    joints: Joints
    velocity: Joints


class Follower:
    """A solver for the joints along tool paths: one arm with its tool, in one configuration. `slowest`: the factor by
    which lines may be slowed down.
    """

    def __init__(
        self,
        arm: RobotArm,
        configuration: Configuration,
        T_flange_tool: Transform,
        T_robot_world: Transform = IDENTITY,
        slowest: float = inf,
    ) -> None:
        self.arm = solver = arm.for_tool(T_flange_tool)
        self.configuration, self.tool = configuration, T_flange_tool
        self.T_world_robot = inverse(T_robot_world)
        self.T_tool_flange = inverse(T_flange_tool)
        self.no_tool = T_flange_tool == IDENTITY
        self.lower, self.upper = arm.model.lower, arm.model.upper
        self.rate_steps = tuple(RATE_STEP * limit for limit in arm.model.max_velocity)
        # multiple of a velocity limit above which a line is refused in any case
        self.hopeless = HOPELESS_SLOWING * slowest
        self.widest = 0.0  # the greatest change of any joint over the last samples
        self._close = _closeness(self.rate_steps, self.hopeless)
        self._ahead = _extrapolation(len(self.lower))
        self._path: CartesianPath | None = None  # the last path, and the function that returns its samples
        self._at: Callable[..., Sample | None]
        # the singular measure of joints; a stretch begins with the last joints of the previous stretch
        self._measure = cache(lambda joints: min(solver.singularity(joints)))

    def samples(
        self,
        path: CartesianPath,
        duration: float,
        near: Joints,
        steps: int = FIRST_INTERVALS,
        before: Sample | None = None,
        marks: Sequence[float] = (),
    ) -> list[Sample]:
        """Sample a path in order of time, at `steps` intervals or finer; the first joints are those nearest to `near`.
        `before`: the last sample of the previous stretch, at the same instant. `marks`: additional instants to sample
        [s].

        Raises LocationOutOfRange, JointOutOfRange or StraightLineSingular; the error gives the position.
        """
        samples = [self.sample(path, 0.0, near) if before is None else Sample(0.0, before.joints, before.velocity)]
        finest = duration * FINEST_INTERVAL
        if self.singular(samples[0]):  # in a singular pose a joint may change its direction abruptly
            for part in CLOSER_PARTS:
                self._refine(path, samples, duration * part, finest)
            self._check_starts(path, samples)
        instants, guesses = [duration * step / steps for step in range(1, steps + 1)], self.arm.guesses
        at, close, ahead = self._sampler(path), self._close, self._ahead
        for until in sorted({*marks, *instants}) if marks else instants:
            last = samples[-1]
            if until - last.s <= MIN_INTERVAL * duration:
                continue
            sample = at(until, ahead(samples, until) if guesses else last.joints, guesses)
            if sample is not None and close(last, sample):  # true for most samples
                samples.append(sample)
            else:
                self._refine(path, samples, until, min(finest, steps * FINEST_INTERVAL * (until - last.s)), sample)
        if self.singular(samples[-1]):
            samples.pop()
            steady = len(samples) - 1
            for part in reversed(CLOSER_PARTS):
                if duration * (1.0 - part) - samples[-1].s > finest:
                    self._refine(path, samples, duration * (1.0 - part), finest)
            self._refine(path, samples, duration, finest)
            self._check_starts(path, samples[steady:])
        self._check_range(path, samples, duration / steps)
        return samples

    def singular(self, sample: Sample) -> bool:
        """Return whether the tool rests in a singular pose. A line may begin or end there."""
        return not any(sample.velocity) and self._measure(sample.joints) < SINGULAR_MEASURE

    def nearly_singular(self, sample: Sample) -> bool:
        """Return whether joints may be fast near a sample for so short a time that differences of sampled velocities do
        not show their accelerations.

        True for arms whose singularities are not known.
        """
        return self.arm.hand is None or self._measure(sample.joints) < NEARLY_SINGULAR

    def _refine(
        self, path: CartesianPath, samples: list[Sample], until: float, finest: float, far: Sample | None = None
    ) -> None:
        """Append samples up to time `until`; halve intervals while the samples at both ends differ too much. The sample
        at the end of a halved interval is kept until the samples before it are found. `far`: the sample at `until`, if
        it is known to differ too much from the last one.
        """
        pending: list[tuple[float, Sample | None]] = [(until, None)]
        short = MAX_GUESSED_PART * (until - samples[-1].s) if self.arm.guesses else inf
        while pending:
            last, (s, sample) = samples[-1], pending.pop()
            halves = s - last.s > finest
            soon = halves and s - last.s > short
            if far is not None:
                sample, far = far, None
            elif sample is None or not self._close(last, sample):
                sample = self._next_sample(path, samples, s, halves=halves, soon=soon)
            if sample is not None and self._close(last, sample):
                samples.append(sample)
            elif halves and (sample is not None or soon):
                pending += (s, sample), (0.5 * (last.s + s), None)
            elif sample is None:
                raise self._earliest(path, last, s)
            else:
                self._check_no_jump(last, sample, path)
                samples.append(sample)

    def _next_sample(
        self, path: CartesianPath, samples: list[Sample], s: float, *, halves: bool, soon: bool
    ) -> Sample | None:
        """Return the next sample, at time s; None if it is not found. If the arm uses guesses, search first near the
        extrapolated joints, which may lie beyond a fold of the arm. `soon`: search by Newton's method only, since the
        interval is long.
        """
        last, sample = samples[-1], None
        if self.arm.guesses:
            sample = self._sampler(path)(s, self._ahead(samples, s), soon=True)
        if sample is not None and (halves or self._close(last, sample)):
            return sample
        return None if soon else self._sampler(path)(s, last.joints)

    def _earliest(self, path: CartesianPath, good: Sample, until: float) -> MotionError:
        """Return the error for the first position after the sample `good` at which the line leaves the reach or a joint
        leaves its range.
        """

        def possible(s: float) -> bool:
            joints = self.joints(path, s, good.joints)
            return joints is not None and self.arm.limits_ok(joints)

        _, first = bisect_interval(possible, good.s, until, EDGE_STEPS)
        return self._refusal(path, first, good.joints)

    def _check_range(self, path: CartesianPath, samples: list[Sample], gap: float) -> None:
        """Check that no joint leaves its range between samples, which are at most `gap` [s] apart."""
        # maximum distance that a joint moves between two samples that `_close` has accepted
        way = JOINT_STEP + MAX_JUMP + 0.5 * gap * max(self.rate_steps)
        far = 2.0 * OVERSHOOT * way + MAX_JUMP
        self.widest, outside = 0.0, False
        columns = zip(*[sample.joints for sample in samples], strict=True)
        for column, low, high in zip(columns, self.lower, self.upper, strict=True):
            least, most = min(column), max(column)
            outside = outside or not (low + far < least and most < high - far)
            if most - least > self.widest:
                self.widest = most - least
        for a, b in pairwise(samples) if outside else ():
            self._check_between(path, a, b)

    def _check_between(self, path: CartesianPath, a: Sample, b: Sample, left: int = RANGE_STEPS) -> None:
        """Check that no joint leaves its range between two samples. The interval is halved where a joint could leave
        it, at most `left` times.
        """
        lasting = b.s - a.s
        rows = zip(a.joints, b.joints, a.velocity, b.velocity, self.lower, self.upper, strict=True)
        for p, q, v, w, low, high in rows if left else ():
            over = _overshoot(q - p, lasting * v, lasting * w)
            if max(p, q) + over > high + LIMIT_TOLERANCE or min(p, q) - over < low - LIMIT_TOLERANCE:
                middle = self.sample(path, 0.5 * (a.s + b.s), a.joints)
                self._check_between(path, a, middle, left - 1)
                self._check_between(path, middle, b, left - 1)
                return

    def _check_starts(self, path: CartesianPath, samples: list[Sample]) -> None:
        """Check samples next to a singular pose in which the tool is at rest: there the velocities must explain nearly
        the whole change of each joint.
        """
        for a, b in pairwise(samples):
            moved = 0.5 * (b.s - a.s) * max([abs(v + w) for v, w in zip(a.velocity, b.velocity, strict=True)])
            self._check_no_jump(a, b, path, min(MAX_JUMP, MIN_JUMP + moved))

    def refuse_kink(self, path: CartesianPath, at: float, inside: float, near: Joints) -> StraightLineSingular:
        """Return the error for a path on which a joint would have to change its speed abruptly at a boundary."""
        changes = self.changes(path, at, inside, near)
        joint = changes.index(max(changes)) + 1
        return self.refuse(path, at, f"joint {joint} would have to change its speed in no time", joint)

    def changes(self, path: CartesianPath, before: float, after: float, near: Joints) -> list[float]:
        """Return how far each joint moves between two times. `near`: joints used where the path is out of reach."""
        a, b = (self.joints(path, s, near) for s in (before, after))
        return [abs(y - x) for x, y in zip(a or near, b or near, strict=True)]

    def refuse_beyond(self, path: CartesianPath, s: float, near: Joints) -> MotionError:
        """Return the error for a path that is out of reach at time s, which may be between two samples."""
        begin = self.joints(path, 0.0, near)
        if begin is None or not self.arm.limits_ok(begin):
            return self._refusal(path, 0.0, near)
        return self._out_of_reach(path, s, near)

    def refuse(self, path: CartesianPath, s: float, what: str, joint: int = 0) -> StraightLineSingular:
        """Return the error for a path that the joints cannot follow near time s. `what`: the reason, as the user reads
        it.
        """
        near, hint = self.place(path, s)
        return StraightLineSingular(
            f"near {near} {what}", hint or SINGULAR_HINT, joint=joint, place=position(path.pose(s))
        )

    def refuse_jump(self, path: CartesianPath, s: float, jumps: Sequence[float]) -> StraightLineSingular:
        joint = jumps.index(max(jumps)) + 1
        far = self.arm.model.joint_text(joint, max(jumps), 1)
        return self.refuse(path, s, f"joint {joint} would have to jump by {far}", joint)

    def flange(self, pose: Transform) -> Transform:
        """Return T_robot_flange for a given T_robot_tool."""
        return pose if self.no_tool else compose(pose, self.T_tool_flange)

    def _check_no_jump(self, a: Sample, b: Sample, path: CartesianPath, most: float = MAX_JUMP) -> None:
        """Check that no joint jumps by more than `most` between two samples. At a singularity joints may jump although
        their velocities are small.
        """
        half = 0.5 * (b.s - a.s)
        rows = zip(a.joints, b.joints, a.velocity, b.velocity, strict=True)
        jumps = [abs(q - p - half * (v + w)) for p, q, v, w in rows]
        if max(jumps) > most:
            raise self.refuse_jump(path, b.s, jumps)

    def place(self, path: CartesianPath, s: float) -> tuple[str, str]:
        """Return the tool position at time s as a string, with the singularity if one is near, and a hint on how to
        avoid the singularity ("": no hint).
        """
        which, text = self.singularity(path, s), self.place_text(path.pose(s))
        return (f"{text} ({which} singularity)", WAYS_ROUND[which]) if which else (text, "")

    def place_text(self, pose: Transform) -> str:
        """Return the position of the pose T_robot_tool in the world, as a string for the user."""
        x, y, z = (round(1e3 * part, 1) + 0.0 for part in position(compose(self.T_world_robot, pose)))  # avoids -0.0
        return f"X {x:.1f} Y {y:.1f} Z {z:.1f} mm"

    def singularity(self, path: CartesianPath, s: float) -> str:
        """Return the singularity to which the arm is close at time s: shoulder, elbow or wrist; "" if there is none."""
        joints = self.joints(path, s, path.seed(s))
        if joints is None:
            return ""
        measures = self.arm.singularity(joints)
        nearest = min(range(len(measures)), key=measures.__getitem__)
        return measures._fields[nearest] if measures[nearest] < NEAR_SINGULAR else ""

    def sample(self, path: CartesianPath, s: float, near: Joints) -> Sample:
        sample = self._sampler(path)(s, near)
        if sample is None:
            raise self._refusal(path, s, near)
        return sample

    def _sampler(self, path: CartesianPath) -> Callable[..., Sample | None]:
        """Return a function that takes a time and joints near the solution, and returns the sample; None if the path is
        out of reach or a joint is out of range. With `soon` it also returns None if Newton's method does not find the
        joints.
        """
        if path is self._path:
            return self._at
        arm, tool, configuration, T_tool_flange = self.arm, self.tool, path.configuration, self.T_tool_flange
        states, branch, inside, no_tool = path.states(), arm.branch_joints, arm.limits_ok, self.no_tool
        velocity = arm.joint_velocity
        searched = arm.guesses or path.guides or arm.steady is not None

        def sample(s: float, near: Joints, soon: bool = False) -> Sample | None:
            at_once, (pose, twist) = None, states(s)
            T_robot_flange = pose if no_tool else compose(pose, T_tool_flange)
            if searched:
                at_once = state_on(arm, path, s, (pose, twist), T_robot_flange, near) if arm.guesses else None
                if at_once is None and soon:
                    return None
                joints = at_once[0] if at_once else joints_on(arm, path, s, T_robot_flange, near)
            else:
                joints = branch(T_robot_flange, configuration, near)
            if joints is None or not inside(joints):
                return None
            vx, vy, vz, wx, wy, wz = twist
            if vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz < STANDING_SPEED * STANDING_SPEED:
                return Sample(s, joints, (0.0,) * len(joints))
            if at_once:
                return _new(Sample, (s, *at_once))
            if searched:
                return _new(Sample, (s, joints, joint_velocity(arm, path, s, joints, twist, tool)))
            return _new(Sample, (s, joints, velocity(joints, twist, tool)))

        self._path, self._at = path, sample
        return sample

    def joints(self, path: CartesianPath, s: float, near: Joints) -> Joints | None:
        """Return the joints at time s [rad]; None where the path is out of reach."""
        return joints_on(self.arm, path, s, self.flange(path.pose(s)), near)

    def _refusal(self, path: CartesianPath, s: float, near: Joints) -> MotionError:
        """Return the error for a path that leaves the reach, or the range of a joint, at time s."""
        joints = self.joints(path, s, near)
        return self._out_of_reach(path, s, near) if joints is None else self._outside(path, s, joints)

    def _out_of_reach(self, path: CartesianPath, s: float, near: Joints) -> LocationOutOfRange:
        """Return the error for a line that leaves the reach: it is too far from the robot, too close to it, or the tool
        is turned in a way that the arm cannot reach.
        """
        pose = path.pose(s)
        leaves = f"the straight line leaves the reach of the arm near {self.place_text(pose)}"
        what, hint = ", for how the tool is turned there", self._less_turned(path)
        steady, flange = self.arm.steady, self.flange(pose)
        try:
            if steady is None or steady.within_ranges(flange, near) is None:  # `steady` checks this far more quickly
                self.arm.select(flange, near)
            if self.arm.words:
                what, hint = " as it is configured", "another configuration"
            elif self.arm.redundancy:
                what, hint = " out of the joints that it begins with", "begin with others"
        except LocationTooClose:
            what, hint = ", too close", "a via point farther from the robot"
        except LocationTooFar:
            what, hint = ", too far", "a via point nearer to the robot"
        except MotionError:
            pass
        return LocationOutOfRange(leaves + what, f"use {{MOVE}}, or {hint}", place=position(pose))

    def _less_turned(self, path: CartesianPath) -> str:
        """Return a hint for a line on which the arm cannot turn the tool as requested."""
        count = self.arm.model.joint_count
        if self.arm.steady is not None:
            return f"a location with the tool turned as {count} joints can have it: {{MOVE}} there, and {{HERE}}"
        if count < self.arm.model.task.size:
            return f"give the arm the task {ArmTask.STEADY.value!r}: {count} joints cannot turn the tool every way"
        return "turn it less on the way" if path.turns else "turn the tool otherwise first"

    def _outside(self, path: CartesianPath, s: float, joints: Joints) -> JointOutOfRange:
        model, pose = self.arm.model, path.pose(s)
        joint = joints_outside(joints, model.lower, model.upper)[0]
        driven = joint in DRIVEN_ROUND.get(self.singularity(path, s), ())
        near, hint = self.place(path, s) if driven else (self.place_text(pose), "")
        other = "another configuration"
        if self.arm.steady is not None:
            other = "turn the tool otherwise on the way"
        elif self.arm.redundancy:
            other = "begin with other joints"
        return JointOutOfRange(
            f"the straight line leaves its range, {model.range_of(joint, 0)}, near {near}",
            hint or f"use {{MOVE}}, or {other}",
            joint=joint,
            value=joints[joint - 1],
            lower=model.lower[joint - 1],
            upper=model.upper[joint - 1],
            place=position(pose),
        )


@cache
def _closeness(rate_steps: Joints, hopeless: float) -> Callable[[Sample, Sample], bool]:
    """Return a function that decides whether two neighbouring samples agree: their differences are small, and the
    velocities explain the motion between them.

    If a joint is so fast that the line is refused (`hopeless`), its velocity may change by a fraction of itself. The
    function is generated with the tests of all joints written out, because it is called for every sample.
    """
    numbers = range(len(rate_steps))
    rows = zip("pqvw", ("a.joints", "b.joints", "a.velocity", "b.velocity"), strict=True)
    lines = [f"{comma_list(f'{letter}{i}' for i in numbers)} = {row}" for letter, row in rows]
    tests = [
        f"{-JOINT_STEP} <= (change := q{i} - p{i}) <= {JOINT_STEP}"
        f" and ({-step} <= w{i} - v{i} <= {step} or {step} * hopeless < {RATE_STEP}"
        f" * min(abs(v{i}), abs(w{i})) >= abs(w{i} - v{i}))"
        f" and {-MAX_JUMP} <= change - half * (v{i} + w{i}) <= {MAX_JUMP}"
        for i, step in enumerate(rate_steps)
    ]
    lines += ["half = 0.5 * (b.s - a.s)", f"return {' and '.join(tests)}"]
    return compile_function("closely(a, b)", lines, {"hopeless": hopeless})


@cache
def _extrapolation(count: int) -> Callable[[Sequence[Sample], float], Joints]:
    """Return a function that extrapolates the joints to a time after the last sample: with the cubics through the last
    two samples, or with the joint velocities of the only sample. Its code has the terms of all joints written out.
    """
    q, v, p, w = ([f"{name}{i}" for i in range(count)] for name in "qvpw")
    cubics = (
        f"{a} + h * ({b} + x * ({b} - (m := k * ({a} - {c})) + y * ({b} + {d} - 2.0 * m)))"
        for a, b, c, d in zip(q, v, p, w, strict=True)
    )
    lines = [
        f"t, ({comma_list(q)}), ({comma_list(v)}) = samples[-1]",
        f"r, ({comma_list(p)}), ({comma_list(w)}) = samples[-2] if len(samples) > 1 else samples[-1]",
        "h = s - t; k = 1.0 / (t - r) if t > r else 0.0; x = h * k; y = 1.0 + x",
        f"return {comma_list(cubics)}",
    ]
    return compile_function("ahead(samples, s)", lines, {})


def _overshoot(change: float, before: float, after: float) -> float:
    """Return how far a joint may go beyond its positions at the ends of a short interval [rad, m]. `before`, `after`:
    the velocity at each end times the duration.

    The bound is the overshoot of the cubic with these velocities, 0 if the cubic is monotonic (Fritsch and Carlson,
    1980), plus half of the change that the velocities do not explain. The error of the cubic is smaller than this
    bound, since the error decreases with a higher power of the duration.
    """
    unexplained = 0.5 * abs(change - 0.5 * (before + after))
    rising = before * change >= 0.0 <= after * change and max(abs(before), abs(after)) <= 3.0 * abs(change)
    return unexplained + (0.0 if rising else OVERSHOOT * (abs(before) + abs(after)))


def seeds_of(samples: list[Sample], widest: float, step: float) -> tuple[Joints, ...]:
    """Return seeds: joints at equal intervals from the first sample to the last, so many that neighbours differ by at
    most `step`. `widest`: the greatest change of any joint over the samples.
    """
    if widest < step:
        return samples[0].joints, samples[-1].joints
    ways = [largest_change(a.joints, b.joints) for a, b in pairwise(samples)]
    travelled = list(accumulate(ways, initial=0.0))
    # shortest time in which a joint moves by MAX_SEED_STEP: seeds are also this close, since joints may be fast briefly
    shortest, behind = (samples[-1].s, 0)
    for sample, way in zip(samples, travelled, strict=True):
        while way - travelled[behind] >= MAX_SEED_STEP:
            shortest = min(shortest, sample.s - samples[behind].s)
            behind += 1
    count = 2 * max(int(travelled[-1] / step) + 1, ceil(0.5 * samples[-1].s / shortest))
    seeds = []
    at = 0
    for k in range(count + 1):
        s = samples[-1].s * k / count
        while at < len(samples) - 1 and abs(samples[at + 1].s - s) <= abs(samples[at].s - s):
            at += 1
        seeds.append(samples[at].joints)
    return tuple(seeds)
