"""Measure what a stretch of a straight line demands of the joints: velocity, acceleration and jerk, as fractions of
their limits (the load). The stretch is known at samples. Values between two samples are bounded by how well the rates
at both samples explain the change between them. Near a limit, where this bound is not tight enough, further samples are
taken.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, pairwise, repeat
from math import cbrt, sqrt
from operator import sub, truediv
from typing import TypeVar

from vrs_cli.engine.following import Follower, Sample
from vrs_cli.engine.problem import joint_acceleration, joint_acceleration_and_jerk
from vrs_cli.errors import StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform
from vrs_cli.trajectory.segment import CartesianPath
from vrs_cli.trajectory.state import FrozenValue

R = TypeVar("R")

MARGIN = 1.01  # factor on sampled velocities, to allow for greater values between samples
SMALL_MARGIN = 1.0005
ROUNDING = 1e-6  # fraction of a limit: a velocity that exceeds the limit by less counts as at the limit
ACCELERATION_MARGIN = 1.025
JERK_MARGIN = 1.01
CALM_PART = 0.8  # fraction of a limit: accelerations and jerks below it, estimated by differences, need no closer check
NEAR_LIMIT = 0.9  # fraction of a limit: next to a sample above it, acceleration or jerk may exceed the limit
NEAR_PEAK = 0.95  # fraction of the worst joint's load: joints above it are searched for peaks between samples
# fraction of a rate's bound: if the curvature between two samples causes more than this, a sample is taken between them
BENT_PART = 0.01
FAST_PART = 0.8  # fraction of a velocity limit: a joint that is slower at all samples stays below it between them
AT_LIMIT = 0.999  # fraction of a velocity limit: a joint that begins faster counts as at its limit
SLOWS_DOWN = 0.1  # [1/s] a joint that loses more than this fraction of its velocity per second is fastest at the start
CLOSER_STEPS = 8  # maximum number of halvings between two samples
PEAK_STEPS = 14
# fraction of a velocity limit: the search for a velocity peak ends when a sample differs by less from the expected peak
AS_EXPECTED = 1e-4
LOST_MEASURE = 1e-6  # singular measure of a pose in which joint rates are only rounding errors
EVEN_PART = 1e-3  # samples count as evenly spaced if their distances differ by less than this fraction
SINGULAR = 1e-14  # singular measure of a pose that is singular except for rounding


class Load(FrozenValue, frozen=True):
    """The maximum joint velocity, acceleration and jerk as fractions of their limits; the joint with the largest
    fraction; and `at`: the path, and the time on it [s], at which that fraction occurs.
    """

    velocity: float = 0.0
    acceleration: float = 0.0
    jerk: float = 0.0
    joint: int = 0
    at: tuple[CartesianPath, float] | None = None

    @property
    def slowing(self) -> float:
        """The factor by which the time must be stretched so that all joints keep their limits."""
        return max(self.velocity, sqrt(self.acceleration), cbrt(self.jerk))

    def worse(self, other: Load) -> Load:
        """Return the maxima of two loads, with the joint and time of the load that requires more slowing."""
        if other.velocity <= self.velocity and other.acceleration <= self.acceleration and other.jerk <= self.jerk:
            return self  # the most frequent case
        if not (self.velocity or self.acceleration or self.jerk):
            return other
        worst = self if self.slowing >= other.slowing else other
        velocity, acceleration = max(self.velocity, other.velocity), max(self.acceleration, other.acceleration)
        return Load(velocity, acceleration, max(self.jerk, other.jerk), worst.joint, worst.at)


class Moment(FrozenValue, frozen=True):
    """A sample together with the joint accelerations and jerks at its time [rad/s2, rad/s3]."""

    sample: Sample
    acceleration: Joints
    jerk: Joints


# a time on the stretch [s], and rates of the joints (velocities or accelerations) at that time
Rates = tuple[float, Joints]


class StretchLoad:
    """The load of a stretch of a path, computed from the samples of a follower. `closely`: the stretch passes close to
    a boundary of the reach.
    """

    def __init__(
        self, follower: Follower, path: CartesianPath, samples: list[Sample], *, closely: bool = False
    ) -> None:
        self.follower, self.path, self.samples, self.closely = follower, path, samples, closely
        self.arm, self.limits = follower.arm, follower.arm.model
        # for each joint, its velocities at the samples
        self.velocities = list(zip(*[sample.velocity for sample in samples], strict=True))

    def parabolic(self, start: Joints) -> Load:
        """Return the maximum load of a stretch with parabolic blends.

        `start`: the joint velocities at the start of the motion. A joint that is no faster than these gets little
        margin: the interrupted motion may have been at its limit.
        """
        samples, fast = self.samples, self._fast()
        times, means = _means(samples, self.velocities)
        greatest = _greatest(means)
        load = self._greatest_of(times, means, greatest, ACCELERATION_MARGIN)
        counts = max(load.acceleration, NEAR_LIMIT) / ACCELERATION_MARGIN
        # near a singular pose joints may accelerate too fast for a time that is short compared with an interval
        begins, ends = (0.0 if self.follower.nearly_singular(end) else counts for end in (samples[0], samples[-1]))
        first = self._at_end(samples[0], times[0], times[1], means, (0, 1), 0.0 if fast else begins)
        last = self._at_end(samples[-1], times[-1], times[-2], means, (-1, -2), ends)
        load = self._worse(load, chain(filter(None, (first, last)), self._bends() if self.closely else ()))
        if load.acceleration > NEAR_LIMIT:
            load = self._worse(load, self._near_limit(means, greatest, counts))
        if first is None or not fast:
            return load
        return self._velocity(start, first[1], tuple([column[0] for column in means])).worse(load)

    def smooth(self, start: Joints) -> Load:
        """Return the maximum load of a stretch of a jerk-limited motion, including its jerk.

        Return an empty load if the velocities of the samples show that no joint comes near a limit. Near a singular
        pose they cannot show this, because joints may be fast there for a short time.
        """
        clear, fast = self._clear(), self._fast()
        calm = clear is self.samples and not (fast or self.closely) and self._calm()
        if calm and not any(map(self.follower.nearly_singular, (clear[0], clear[-1]))):
            return Load()
        kept = list({sample.s: sample for sample in (self.samples[0], *clear, self.samples[-1])}.values())
        times, columns = _means(kept, zip(*[sample.velocity for sample in kept], strict=True))
        means = list(zip(times, zip(*columns, strict=True), strict=True))
        known = ((sample, self._rates_at(joint_acceleration_and_jerk, sample)) for sample in clear)
        moments = [Moment(sample, *rates) for sample, rates in known if rates is not None]
        at_first = moments[0].acceleration if moments and moments[0].sample is self.samples[0] else means[0][1]
        load = self._velocity(start, at_first, means[0][1]) if fast else Load()
        return load.worse(self._smooth_acceleration(moments, means)).worse(self._jerk(moments))

    def _calm(self) -> bool:
        """Return whether accelerations and jerks stay clearly below their limits, estimated from differences of
        velocities between samples.

        The estimates are extrapolated to the next samples. Return False if the samples are too few or not evenly
        spaced.
        """
        samples, lasting = self.samples, self.samples[-1].s - self.samples[0].s
        step = lasting / (len(samples) - 1)
        if len(samples) < 5 or not all(abs(b.s - a.s - step) < EVEN_PART * step for a, b in pairwise(samples)):
            return False
        part, square = CALM_PART * step, CALM_PART * step * step
        rows = zip(self.velocities, self.limits.max_acceleration, self.limits.max_jerk, strict=True)
        for column, most, hardest in rows:
            for u, v, w, x, y in zip(column, column[1:], column[2:], column[3:], column[4:], strict=False):
                a, b, c, d = v - u, w - v, x - w, y - x
                e, f, g = b - a, c - b, d - c
                h, i = f - e, g - f
                jerk = max(e, f, g, -e, -f, -g)
                if (
                    max(a, b, c, d, -a, -b, -c, -d) + jerk >= part * most
                    or jerk + 2.0 * (max(h, i, -h, -i) + abs(i - h)) >= square * hardest
                ):
                    return False
        return True

    # --- velocity ---

    def _fast(self) -> bool:
        """Return whether any joint comes so close to its velocity limit that the velocity load must be computed."""
        for column, limit in zip(self.velocities, self.limits.max_velocity, strict=True):
            if max(column) > FAST_PART * limit or min(column) < -FAST_PART * limit:
                return True
        return False

    def _velocity(self, start: Joints, at_first: Joints, first_mean: Joints) -> Load:
        """Return the load due to velocity.

        The maximum is taken over all samples except the first, whose velocity is given; the interval between the first
        two samples; and the peaks of the fastest joints.
        """
        samples, columns = self.samples, self.velocities
        fastest = _greatest([column[1:] for column in columns])
        starting = zip(fastest, start, self.limits.max_velocity, strict=True)
        later = [v * (MARGIN if v > abs(before) else SMALL_MARGIN) / most for v, before, most in starting]
        joint = _where_largest(later)
        at = samples[1 + _where_largest(columns[joint][1:])].s
        firsts = map(_first_peak, samples[0].velocity, at_first, first_mean, repeat(samples[1].s - samples[0].s))
        load = Load(later[joint], joint=joint + 1, at=(self.path, at))
        load = load.worse(self._velocity_at(Sample(samples[0].s, samples[0].joints, tuple(firsts)), 1.0))
        worst = load.velocity
        for sample in self._peaks(columns, worst) if worst >= NEAR_PEAK else ():
            load = load.worse(self._velocity_at(sample, SMALL_MARGIN))
        rows = zip(samples[0].velocity, at_first, self.limits.max_velocity, strict=True)
        for i, (v, a, limit) in enumerate(rows) if worst <= 1.0 + ROUNDING else ():
            # unless it slows down, a joint that begins at its limit is fastest before the second sample
            if abs(v) >= AT_LIMIT * limit and a * v > -SLOWS_DOWN * abs(v):
                load = load.worse(self._velocity_at(self._peak(i, samples[0], samples[1]), 1.0))
        return load

    def _velocity_at(self, sample: Sample, margin: float) -> Load:
        ratios = [abs(v) * margin / most for v, most in zip(sample.velocity, self.limits.max_velocity, strict=True)]
        joint = _where_largest(ratios)
        return Load(ratios[joint], joint=joint + 1, at=(self.path, sample.s))

    def _peaks(self, columns: Sequence[Joints], worst: float) -> Iterator[Sample]:
        """For each joint that may exceed its velocity limit, yield the sample at which its velocity peaks. Near a
        singularity, a peak may be very short.
        """
        samples, near = self.samples, NEAR_PEAK * max(worst, 1.0)
        for i, (most, limit) in enumerate(zip(_greatest(columns), self.limits.max_velocity, strict=True)):
            # k = 0: the peak in the first interval is already known
            if most / limit >= near and (k := _where_largest(columns[i])):
                yield self._peak(i, samples[k - 1], samples[min(k + 1, len(samples) - 1)])

    def _peak(self, joint: int, before: Sample, after: Sample) -> Sample:
        """Return the sample at which a joint is fastest between two samples. The top of a parabola through three
        samples is sampled until the joint is as fast there as the parabola predicts (successive parabolic
        interpolation; Brent, "Algorithms for Minimization without Derivatives", 1973, 5.2). If the parabola rises
        towards one of the two samples, return that sample.
        """
        limit = self.limits.max_velocity[joint]
        found = [before, self.follower.sample(self.path, 0.5 * (before.s + after.s), before.joints), after]
        for _ in range(PEAK_STEPS):
            top = _top_of(*((sample.s, abs(sample.velocity[joint])) for sample in found))
            if top is None or not found[0].s < top[0] < found[2].s:
                break
            s, expected = top
            k = 1 + (s > found[1].s)
            sample = self.follower.sample(self.path, s, found[k - 1].joints)
            found.insert(k, sample)
            fastest = max((1, 2), key=lambda i: abs(found[i].velocity[joint]))
            found = found[fastest - 1 : fastest + 2]
            if abs(abs(sample.velocity[joint]) - expected) < AS_EXPECTED * limit:
                break
        return max(found, key=lambda sample: abs(sample.velocity[joint]))

    # --- acceleration ---

    def _at_end(
        self,
        sample: Sample,
        near: float,
        far: float,
        means: list[Sequence[float]],
        nearest: tuple[int, int],
        counts: float,
    ) -> Rates | None:
        """Return the joint accelerations at the first or the last sample. Return None if the line through the two
        nearest mean accelerations shows that no joint comes near the fraction `counts` of its limit.

        `near`, `far`: the times of these means [s]; `nearest`: their indices.
        """
        part, (i, j) = (sample.s - near) / (near - far), nearest
        for column, limit in zip(means, self.limits.max_acceleration, strict=True):
            mean = column[i]
            guess = mean + part * (mean - column[j])
            if abs(guess) + 2.0 * abs(guess - mean) >= counts * limit:
                rates = self._rates_at(joint_acceleration, sample)
                return sample.s, rates or tuple([column[i] + part * (column[i] - column[j]) for column in means])
        return None

    def _near_limit(self, means: list[Sequence[float]], greatest: list[float], counts: float) -> Iterator[Rates]:
        """Yield the joint accelerations at the two samples around a joint's maximum mean acceleration, if this mean is
        near the limit and may hide an acceleration above the fraction `counts` of the limit.

        The first and last sample are left out, since the accelerations there are known.
        """
        near = dict[int, None]()  # the samples in order, each only once
        for column, most, limit in zip(means, greatest, self.limits.max_acceleration, strict=True):
            if most > NEAR_LIMIT * limit:
                k = _where_largest(column)
                around = column[max(k - 1, 0) : k + 2]
                if most + max(around) - min(around) > counts * limit:
                    near |= {k: None, k + 1: None}
        for sample in [self.samples[k] for k in near if 0 < k < len(self.samples) - 1]:
            rates = self._rates_at(joint_acceleration, sample)
            if rates is not None:
                yield sample.s, rates

    def _bends(self) -> Iterator[Rates]:
        """Yield the joint accelerations at all samples, and at further times between two samples whose accelerations do
        not explain the mean acceleration between them.
        """
        pending = [(a, b, CLOSER_STEPS) for a, b in pairwise(self._clear())][::-1]
        while pending:
            a, b, left = pending.pop()
            first, last = self._rates_at(joint_acceleration, a), self._rates_at(joint_acceleration, b)
            if first is None or last is None:
                continue
            yield a.s, first
            if left and self._bent(a, b, first, last):
                middle = self.follower.sample(self.path, 0.5 * (a.s + b.s), a.joints)
                pending += (middle, b, left - 1), (a, middle, left - 1)

    def _bent(self, a: Sample, b: Sample, first: Joints, last: Joints) -> bool:
        """Return whether an acceleration near its limit may be greater between two samples than at either of them."""
        found = _between(first, last, a.velocity, b.velocity, b.s - a.s)
        rows = zip(found, self.limits.max_acceleration, strict=True)
        return any(bent and most > NEAR_LIMIT * limit for (most, bent), limit in rows)

    def _rates_at(
        self, rates: Callable[[RobotArm, CartesianPath, float, Joints, Joints, Transform], R], sample: Sample
    ) -> R | None:
        """Return the rates of the joints that the function `rates` computes at a sample; None in a singular pose, where
        they are not defined.
        """
        try:
            return rates(self.arm, self.path, *sample, self.follower.tool)
        except StraightLineSingular:
            return None

    def _acceleration(self, rates: list[Rates], margin: float) -> Load:
        """Return the load due to the greatest joint accelerations, increased by a margin."""
        if not rates:
            return Load()
        times, rows = zip(*rates, strict=True)
        columns = list(zip(*rows, strict=True))
        return self._greatest_of(times, columns, _greatest(columns), margin)

    def _greatest_of(
        self, times: Sequence[float], columns: Sequence[Sequence[float]], greatest: list[float], margin: float
    ) -> Load:
        """Return the load due to accelerations. `columns`: the accelerations of each joint at the `times`; `greatest`:
        the maximum of each column; `margin`: the factor on the load.
        """
        ratios = list(map(truediv, greatest, self.limits.max_acceleration))
        worst = max(ratios)
        joint = ratios.index(worst)
        return Load(0.0, worst * margin, joint=joint + 1, at=(self.path, times[_where_largest(columns[joint])]))

    def _worse(self, load: Load, rates: Iterable[Rates]) -> Load:
        """Return the maximum of a load and the loads due to the given joint accelerations, with ACCELERATION_MARGIN."""
        for s, row in rates:
            ratios = list(map(truediv, map(abs, row), self.limits.max_acceleration))
            worst = max(ratios)
            if worst * ACCELERATION_MARGIN > load.acceleration:
                at = self.path, s
                load = load.worse(Load(0.0, worst * ACCELERATION_MARGIN, joint=ratios.index(worst) + 1, at=at))
        return load

    def _smooth_acceleration(self, moments: list[Moment], means: list[Rates]) -> Load:
        """Return the load due to acceleration: at the samples, and where the jerk changes its sign between two of them.
        The acceleration at the first sample gets no margin: the interrupted motion may have been at its limit.
        """
        rates = [*((moment.sample.s, moment.acceleration) for moment in moments), *means]
        load = self._acceleration(rates, SMALL_MARGIN)
        if load.acceleration < NEAR_LIMIT:
            return load
        # acceleration where the jerk of a joint is zero; 0 for joints whose jerk keeps its sign
        for a, b in pairwise(moments):
            half = 0.5 * (b.sample.s - a.sample.s)
            rows = zip(a.acceleration, a.jerk, b.jerk, strict=True)
            peaks = tuple([v + half * x * x / (x - y) if x * y < 0.0 else 0.0 for v, x, y in rows])
            rates.append((a.sample.s, peaks))
        return self._acceleration(rates[:1], 1.0).worse(self._acceleration(rates[1:], SMALL_MARGIN))

    # --- jerk ---

    def _clear(self) -> list[Sample]:
        """Return the samples without those next to a singular pose in which the line begins or ends.

        Singular measures that are nearly 0 on the whole line are ignored.
        """
        ends = [sample for sample in (self.samples[0], self.samples[-1]) if self.follower.singular(sample)]
        if not any(min(self.arm.singularity(sample.joints)) < SINGULAR for sample in ends):
            return self.samples
        measures = [self.arm.singularity(sample.joints) for sample in self.samples]
        left = [k for k, column in enumerate(zip(*measures, strict=True)) if max(column) > LOST_MEASURE]
        rows = zip(self.samples, measures, strict=True)
        return [sample for sample, measure in rows if min([measure[k] for k in left], default=1.0) > LOST_MEASURE]

    def _jerk(self, moments: list[Moment]) -> Load:
        """Return the load due to jerk: at the moments, and a bound of the jerk between them. Further samples are taken
        where the bound is near the limit.
        """
        load = Load()
        pending = [(a, b, CLOSER_STEPS) for a, b in pairwise(moments)]
        while pending:
            a, b, left = pending.pop()
            found = _between(a.jerk, b.jerk, a.acceleration, b.acceleration, b.sample.s - a.sample.s)
            ratios = [most * JERK_MARGIN / limit for (most, _), limit in zip(found, self.limits.max_jerk, strict=True)]
            joint = _where_largest(ratios)
            worst, (_, bent) = ratios[joint], found[joint]
            if worst > NEAR_LIMIT and bent and left:
                sample = self.follower.sample(self.path, 0.5 * (a.sample.s + b.sample.s), a.sample.joints)
                rates = self._rates_at(joint_acceleration_and_jerk, sample)
                if rates is not None:
                    middle = Moment(sample, *rates)
                    pending += (a, middle, left - 1), (middle, b, left - 1)
                    continue
            load = load.worse(Load(jerk=worst, joint=joint + 1, at=(self.path, a.sample.s)))
        return load


def _top_of(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> tuple[float, float] | None:
    """Return the position and value of the maximum of the parabola through three points, which are in order; None if
    the parabola has no maximum.
    """
    (x, u), (y, v), (z, w) = a, b, c
    if not x < y < z:
        return None
    rise, fall = (v - u) / (y - x), (w - v) / (z - y)
    bend = (fall - rise) / (z - x)
    if bend >= 0.0:
        return None
    slope = rise + bend * (y - x)  # slope of the parabola at point b
    return y - 0.5 * slope / bend, v - 0.25 * slope * slope / bend


def _between(a: Joints, b: Joints, before: Joints, after: Joints, lasting: float) -> list[tuple[float, bool]]:
    """For each joint, return a bound of a rate between two samples, and whether the rate may exceed its values at both
    samples. `a`, `b`: the rates at the samples; `before`, `after`: the integrals of the rate at the samples. The
    parabola with these end values and the right mean is used: its distance from its chord is greatest in the middle,
    where it is 1.5 times the distance of the mean from the chord.
    """
    found = []
    for x, y, v, w in zip(a, b, before, after, strict=True):
        bend = 1.5 * abs((w - v) / lasting - 0.5 * (x + y))
        most = max(abs(x), abs(y)) + bend
        found.append((most, bend > BENT_PART * most))
    return found


def _means(
    samples: Sequence[Sample], velocities: Iterable[Sequence[float]]
) -> tuple[list[float], list[Sequence[float]]]:
    """Return the times halfway between samples [s], and the mean accelerations between samples, one column for each
    joint.
    """
    times = [sample.s for sample in samples]
    steps = list(map(sub, times[1:], times))
    columns: list[Sequence[float]] = [list(map(truediv, map(sub, column[1:], column), steps)) for column in velocities]
    return [0.5 * (s + t) for s, t in pairwise(times)], columns


def _greatest(columns: Iterable[Sequence[float]]) -> list[float]:
    return [max(map(abs, column)) for column in columns]


def _where_largest(values: Sequence[float]) -> int:
    sizes = list(map(abs, values))
    return sizes.index(max(sizes))


def _first_peak(velocity: float, rate: float, mean: float, lasting: float) -> float:
    """Return the maximum velocity between the first two samples, by a parabola with the velocity and the acceleration
    `rate` at the start and the `mean` acceleration between the samples.
    """
    bend = rate - mean
    if rate * velocity > 0.0 and abs(rate) < 2.0 * abs(bend) and bend * velocity > 0.0:
        return velocity + rate * rate * lasting / (4.0 * bend)
    return velocity
