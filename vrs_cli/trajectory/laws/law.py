"""Define the functions by which a velocity profile plans motions (`LAWS[profile]`), and the `Course` (the times) of a
motion, which LSPB and SCURVE share. The file named after a profile contains its `LAW`.

A course has three phases: the velocity changes, stays constant, and goes to zero. The laws differ in how the velocity
changes (`Blend`, `Change`) and in how the times of the phases are found. From these times, all laws compute the motion
of joints and tools in the same way. `scurve` explains the formulas of `Change`.

In the files of this folder `way` is the displacement that a joint or the tool still has to cover: a number with a sign
[rad, m], or a vector [m].
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from math import sqrt
from typing import NamedTuple

from vrs_cli.kinematics.joints import Joints, Profile
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    axis_angle,
    compose,
    inverse,
    position,
    rotation_about,
    vector_difference,
)
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.polynomial import Polynomial, parabola, value, values
from vrs_cli.trajectory.segment import STILL, JointPath, Path, Phase, Segment, ToolStretch
from vrs_cli.trajectory.state import FrozenValue, JointLimits, JointState, Target, ToolLimits, ToolState
from vrs_cli.values.commands import Motion

VERSION = 2  # increase it if a law plans a state differently; in version 1, all joints of SCURVE shared all times
SLIVER = 1e-6  # [s] a cruise shorter than this is left out
Pieces = tuple[tuple[float, float], ...]  # (duration, jerk) pairs of one joint, in order
# a cubic of one joint: its start [grid instants], its start [s], and its four coefficients
Row = tuple[int, float, float, float, float, float]
# returns the cubics that each joint will follow, as planned so far; None if its polynomials are not cubics
Coming = Callable[[], Sequence[Sequence[Row]] | None]


class NoTimes(ValueError):
    """Raised if the motion cannot reach its target from its start state within the limits."""


class Law(FrozenValue, frozen=True):
    """The functions with which motions of a profile gain and lose velocity.

    `smooth`: the acceleration does not jump, and the jerk is limited. `samples`: the number of intervals in which each
    stretch of a straight line is sampled at first. All planned motions end at rest:

    `joint_motion(state, goal, limits, start, motion, least)`: the segments of a joint-interpolated motion to `goal`;
    `least`: the least duration [s]. Raises NoTimes.

    `joint_stops(state, limits, start, motion)`: the possible stops, in the order in which they are tried.

    `straight_motion(state, target, limits, least)`: the stretches of a straight line to T_robot_tool `target`; none if
    the tool is at it already. Raises NoTimes.

    `straight_stop(state, limits)`: the stretches that bring the tool to rest on its line. Raises NoTimes.

    `steer(state, target, limits, hardest, tick, start, motion, coming)`: a tick [s] towards a moving target, then a
    stop; `hardest`: the limits for the hardest braking; `coming`: returns the previous plan. Empty if neither the tick
    nor the previous plan keeps the limits.

    `replay_steering(state, rates, limits, tick, start, motion)`: the segments that `steer` planned, from the rate of
    each joint that `steering_of(segments)` returns; None if the rates do not determine the segments.
    """

    smooth: bool
    samples: int
    joint_motion: Callable[[JointState, Joints, JointLimits, float, Motion, float], tuple[Segment, ...]]
    joint_stops: Callable[[JointState, JointLimits, float, Motion], Iterator[tuple[Segment, ...]]]
    straight_motion: Callable[[ToolState, Transform, ToolLimits, float], list[ToolStretch]]
    straight_stop: Callable[[ToolState, ToolLimits], list[ToolStretch]]
    steer: Callable[[JointState, Target, JointLimits, JointLimits, float, float, Motion, Coming], tuple[Segment, ...]]
    replay_steering: Callable[[JointState, Joints, JointLimits, float, float, Motion], tuple[Segment, ...]]
    steering_of: Callable[[Sequence[Segment]], Joints | None]


class _Laws(dict[Profile, Law]):
    def __missing__(self, profile: Profile) -> Law:
        """Import the module that is named after the profile; most programs need only one."""
        law: Law = import_module(f"{__package__}.{profile.value}").LAW
        return self.setdefault(profile, law)


LAWS = _Laws()


class Blend(FrozenValue, frozen=True):
    """A change of velocity at constant acceleration, which may jump at both ends."""

    lasts: float

    @property
    def durations(self) -> list[float]:
        return [self.lasts] if self.lasts else []

    @property
    def lag(self) -> float:
        return 0.5 * self.lasts

    def ahead(self, way: float, v0: float, a0: float) -> float:  # noqa: ARG002 (the acceleration jumps)
        """Return the part of a distance `way` that the velocity after the change must cover; the velocity at the start
        covers the remainder.
        """
        return way - 0.5 * v0 * self.lasts

    def to_rest(self, v0: float, a0: float) -> float:  # noqa: ARG002
        """Return the distance that a change to rest covers."""
        return 0.5 * v0 * self.lasts

    def polynomials(self, p: float, v0: float, a0: float, v1: float) -> list[Polynomial]:  # noqa: ARG002
        """Return the polynomials of a change from v0 to v1 that starts at position p, one for each stretch."""
        return [parabola(p, v0, v1, self.lasts)]

    def paths(
        self,
        p: Sequence[float],
        v0: Sequence[float],
        a0: Sequence[float],  # noqa: ARG002
        v1: Sequence[float],
    ) -> list[tuple[Polynomial, ...]]:
        """Return the changes of several components: for each stretch, the polynomials of all components."""
        lasts = self.lasts
        return [tuple([(at, v, 0.5 * (w - v) / lasts) for at, v, w in zip(p, v0, v1, strict=True)])]


class Change(NamedTuple):
    """Times of a change of velocity at limited jerk [s]: the acceleration rises, stays, and falls."""

    rise: float
    hold: float
    fall: float

    @property
    def lasts(self) -> float:
        return self.rise + self.hold + self.fall

    @property
    def reach(self) -> float:
        """R of the formula in `scurve`: the velocity gained for each unit of the held acceleration."""
        return 0.5 * self.rise + self.hold + 0.5 * self.fall

    @property
    def ways(self) -> tuple[float, float]:
        """K0 and K1 of the formula in `scurve`: the distance for each unit of the acceleration at the start, and for
        each unit of the acceleration that is held.
        """
        rise, hold, fall = self
        by_start = rise * rise / 3.0 + 0.5 * rise * (hold + fall)
        by_level = (
            rise * rise / 6.0 + 0.5 * (rise * hold + hold * hold) + (0.5 * rise + hold) * fall + fall * fall / 3.0
        )
        return by_start, by_level

    @property
    def lag(self) -> float:
        return self.ways[1] / self.reach

    def level(self, v0: float, a0: float, v1: float) -> float:
        """Return A of the formula in `scurve`: the acceleration that is held."""
        return (v1 - v0 - 0.5 * self.rise * a0) / self.reach

    def ahead(self, way: float, v0: float, a0: float) -> float:
        """Return E of the formula in `scurve`: the distance that the velocity after the change must cover."""
        by_start, _ = self.ways
        carried = v0 + 0.5 * self.rise * a0
        return way - v0 * self.lasts - a0 * by_start + self.lag * carried

    def to_rest(self, v0: float, a0: float) -> float:
        by_start, by_level = self.ways
        return v0 * self.lasts + a0 * by_start + self.level(v0, a0, 0.0) * by_level

    def pieces(self, v0: float, a0: float, v1: float) -> Pieces:
        """Return the change from v0 to v1 as pieces of constant jerk."""
        level = self.level(v0, a0, v1) if self.rise else a0
        rates = (level - a0) / (self.rise or 1.0), 0.0, -level / self.fall
        return tuple((duration, rate) for duration, rate in zip(self, rates, strict=True) if duration)

    def polynomials(self, p: float, v0: float, a0: float, v1: float) -> list[Polynomial]:
        """Return the polynomials of a change from v0 to v1 that starts at position p, one for each part that is not
        empty.
        """
        level = self.level(v0, a0, v1)
        polynomials: list[Polynomial] = []
        a, v = a0, v0
        for duration, after in zip(self, (level, level, 0.0), strict=True):
            if duration:
                rate = (after - a) / duration
                polynomials.append((p, v, 0.5 * a, rate / 6.0))
                p, v, a = value(polynomials[-1], duration), v + 0.5 * duration * (a + after), after
        return polynomials

    def paths(
        self, p: Sequence[float], v0: Sequence[float], a0: Sequence[float], v1: Sequence[float]
    ) -> list[tuple[Polynomial, ...]]:
        """Return the changes of several components: for each stretch, the polynomials of all components."""
        return list(zip(*map(self.polynomials, p, v0, a0, v1), strict=True))

    @property
    def durations(self) -> list[float]:
        """The durations of the three parts of the change that are not 0."""
        return [duration for duration in self if duration]


NONE = Change(0.0, 0.0, 0.0)
VelocityChange = Blend | Change


def ramps(by_acceleration: float, by_jerk: float) -> Change:
    """Return the shortest change of velocity with two equal ramps. Its velocities are given by the maxima of |v| / a
    and |v| / j over all components.
    """
    if by_jerk <= 0.0:
        return NONE
    reach = max(by_acceleration, sqrt(by_jerk))
    ramp = by_jerk / reach
    if reach - ramp < SLIVER:
        ramp = up_to_grid(reach)
        return Change(ramp, 0.0, ramp)
    ramp = up_to_grid(ramp)
    return Change(ramp, up_to_grid(reach - ramp), ramp)


class Course(FrozenValue, frozen=True):
    """The times of a whole motion: a change of velocity, the cruise [s], and slowing down, all on the time grid."""

    change: VelocityChange
    cruise: float
    slow: VelocityChange

    @property
    def reach(self) -> float:
        """S of the formula in `lspb`, 1/u in `scurve`: the distance ahead divided by the cruise velocity [s]."""
        lag = self.change.lag if self.change.lasts else 0.0
        return lag + self.cruise + 0.5 * self.slow.lasts

    @property
    def total(self) -> float:
        return self.change.lasts + self.cruise + self.slow.lasts

    @property
    def stops_at_once(self) -> bool:
        """True if the change itself ends on the target."""
        return not self.cruise and not self.slow.lasts

    def stretches(self, first: Phase) -> list[tuple[float, Phase]]:
        """Return the duration and the phase of each stretch. `first`: the phase of the first change."""
        cruise = [(self.cruise, Phase.CRUISE)] if self.cruise else []
        slowing = [(duration, Phase.DECELERATE) for duration in self.slow.durations]
        return [(duration, first) for duration in self.change.durations] + cruise + slowing

    def paths(
        self,
        p: Sequence[float],
        v0: Sequence[float],
        a0: Sequence[float],
        v1: Sequence[float],
        after: float | None = None,
    ) -> list[tuple[Polynomial, ...]]:
        """Return a motion of several components from positions p, with cruise velocities v1: for each stretch, the
        polynomials of all components. `after`: the position of the last component at the end of the change, if the
        caller knows it.
        """
        paths, still = self.change.paths(p, v0, a0, v1), (0.0,) * len(p)
        q = values(paths[-1], self.change.durations[-1])
        if after is not None:
            q[-1] = after
        if self.cruise:
            paths.append(tuple(zip(q, v1, strict=True)))
            q = values(paths[-1], self.cruise)
        return paths + self.slow.paths(q, v1, still, still) if self.slow.lasts else paths


def joint_stretches(
    course: Course, joints: Joints, velocity: Joints, cruising: Sequence[float], first: Phase
) -> Iterator[tuple[float, Phase, Path]]:
    """Yield the stretches of joints that change from their velocities to the velocities `cruising` and then stop."""
    paths = course.paths(joints, velocity, (0.0,) * len(joints), cruising)
    for (duration, phase), path in zip(course.stretches(first), paths, strict=True):
        yield duration, phase, JointPath(path)


class ToolMotion:
    """A straight line of the tool from a state to a target, with its rotation: the current angular velocity (spin)
    decays while a single turn makes the remaining rotation. `dying`: the turns by which the spin decays, each with its
    axis, and its speed and acceleration at the start. `acceleration`: that of the tip at the start.
    """

    def __init__(
        self,
        state: ToolState,
        target: Transform,
        limits: ToolLimits,
        dying: Sequence[tuple[Vector, float, float]],
        acceleration: Vector = STILL,
    ) -> None:
        self.state, self.target, self.limits, self.dying = state, target, limits, dying
        self.acceleration, self.at_rest = acceleration, state.at_rest
        self.displacement = vector_difference(position(target), position(state.pose))

    def orientation_after(self, change: VelocityChange) -> Transform:
        """Return the orientation that the tool reaches if its current angular velocity is braked to zero."""
        R = self.state.pose
        for axis, rate, acceleration in self.dying:
            R = compose(R, rotation_about(axis, change.to_rest(rate, acceleration)))
        return R

    def turn(self, change: VelocityChange) -> tuple[Vector, float]:
        """Return axis and angle of the turn to the target that remains after the angular velocity is braked to zero."""
        if not self.dying:
            return self.state.turn_to(self.target)
        return axis_angle(compose(inverse(self.orientation_after(change)), self.target))

    def turn_after_change(self, change: VelocityChange, spin: float) -> float | None:  # noqa: ARG002 (LSPB uses it)
        """Return the angle turned at the end of the change to this spin; None if the value of the polynomials is exact
        enough.
        """
        return None

    def stretches(self, course: Course) -> Iterator[ToolStretch]:
        """Yield the stretches (parts with one polynomial each) of the line, timed by a course; none if the line has no
        length.
        """
        reach, state, change = course.reach, self.state, course.change
        if reach <= 0.0:
            return
        going, (axis, angle) = not course.stops_at_once, self.turn(change)
        starts = zip(position(state.pose), state.velocity, self.acceleration, self.displacement, strict=True)
        part, spin = 1.0 / reach, angle / reach if going else 0.0
        rows = [(p, v, a, change.ahead(way, v, a) * part if going else 0.0) for p, v, a, way in starts]
        for guide in state.guides:
            ahead = change.ahead(guide.end - guide.value, guide.rate, guide.acceleration)
            rows.append((guide.value, guide.rate, guide.acceleration, ahead / reach if going else 0.0))
        if spin:
            rows.append((0.0, 0.0, 0.0, spin))
        turned = self.turn_after_change(change, spin) if spin else None
        p, v, a, v1 = zip(*rows, strict=True)
        paths = course.paths(p, v, a, v1, turned)
        dying = [(k, change.polynomials(0.0, rate, acceleration, 0.0)) for k, rate, acceleration in self.dying]
        begins, after = len(change.durations), self.orientation_after(change)
        first = Phase.ACCELERATE if self.at_rest else Phase.BLEND
        for i, ((duration, phase), (x, y, z, *others)) in enumerate(zip(course.stretches(first), paths, strict=True)):
            turns = [(k, polynomials[i]) for k, polynomials in dying] if i < begins else []
            if spin:
                turns.append((axis, others.pop()))
            R = state.pose if i < begins else after
            yield ToolStretch(duration, phase, (x, y, z), R, tuple(turns), tuple(others))
