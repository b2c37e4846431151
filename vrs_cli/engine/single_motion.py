"""Plan a single motion: on its own path, after braking, or around the corner before it."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from contextlib import suppress
from functools import cache, lru_cache
from math import inf, sqrt
from operator import sub

from msgspec import structs

from vrs_cli.engine.problem import NoRoomToStop, NotInTime, NoWay, Problem, rest_after, segment_joints
from vrs_cli.errors import MotionError, StreamIsOver
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform, compose, distance
from vrs_cli.trajectory.instant import on_grid, up_to_grid
from vrs_cli.trajectory.laws.law import LAWS, NoTimes
from vrs_cli.trajectory.segment import Phase, Segment, rest, stay_inside
from vrs_cli.trajectory.state import JointLimits
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Motion, MotionKind

REMEMBERED_PLANS = 512  # number of cached plans, so that a program with a loop plans each of its motions only once
STREAM_STAYS = "give a time after it, or end where it begins; with PARAMETER INSERT = OFF it is dropped"
ROUNDING_PRECISION_S = 1e-6  # [s] precision of the instant at which the tip comes near a corner
MAX_ROUNDING_DELAY_S = 1e-3  # [s] a corner is rounded if the motion then ends at most this much later than with a stop
SAME_PLACE = 1e-9  # [m] positions closer than this are equal


def plan_motion(problem: Problem) -> tuple[Segment, ...]:
    """Plan a motion to rest. If the motion cannot start with the current velocities, the arm first comes to rest within
    all limits, if possible on the current straight line of the tool.

    Raises MotionError, NoRoomToStop, NotInTime.
    """
    with suppress(NoWay):
        return plan_directly(problem)
    here, stop = problem.here, tuple[Segment, ...]()
    if here.tool is not None and here.T_flange_tool == problem.motion.frames.tool:
        from vrs_cli.engine.straight import line_stop

        with suppress(MotionError):
            stop = line_stop(problem)
    stop = stop or plan_stop(problem)
    place = rest_after(problem.arm, stop[-1])
    return stop + plan_motion(structs.replace(problem, here=place, begin=stop[-1].finish))


def plan_directly(problem: Problem, resting: Problem | None = None) -> tuple[Segment, ...]:
    """Plan a motion without a stop before it. Raises MotionError, NoWay, NotInTime.

    A motion without any movement becomes a rest of no duration. So it keeps its place on the timeline, since it may
    need to move after an earlier motion changes. `resting`: the problem of the same motion from rest; a straight line
    that would end later than the motion from rest raises NotInTime.
    """
    state, motion, begin, lasting = problem.here.joints, problem.motion, problem.begin, 0.0
    segments: tuple[Segment, ...] = ()
    match motion.kind:
        case MotionKind.JOINT | MotionKind.STRAIGHT:
            outcome = _remembered_plan(_PlanKey(problem, resting))
            if not isinstance(outcome, tuple):
                if isinstance(outcome, MotionError) and state.at_rest:
                    raise outcome.reworded()
                raise NotInTime if isinstance(outcome, NotInTime) else NoWay
            segments = tuple([Segment(begin + s.start, begin + s.finish, s.path, s.phase, motion) for s in outcome])
        case MotionKind.REST:
            if not state.at_rest:
                raise NoWay
            lasting = on_grid(motion.duration)
        case MotionKind.STEERED:
            raise StreamIsOver("its targets came one by one, from the place where the arm was then", STREAM_STAYS)
    return segments or (rest(state.joints, lasting, begin, motion),)


class _PlanKey:
    """The cache key of a problem. Problems that differ only by a shift in time have equal keys and the same plan, since
    times are exact.

    Numbers are compared bit by bit: 0.0 and -0.0 are equal, but their plans may have different bits.
    """

    __slots__ = ("parts", "problem", "resting")

    def __init__(self, problem: Problem, resting: Problem | None = None) -> None:
        here, motion = problem.here, problem.motion
        tool, frames, (q, qd, qdd), target = here.tool, motion.frames, here.joints, motion.pose or motion.goal or ()
        numbers: tuple[float, ...] = (*q, *qd, *qdd, *target)
        others: tuple[object, ...] = ()
        if motion.kind is MotionKind.STRAIGHT:
            numbers = (*numbers, *frames.base, *frames.tool)
            if tool:
                numbers += (*tool.pose, *tool.velocity, *tool.spin, *tool.acceleration, *tool.spin_rate)
            limits = motion.tip_speed, motion.rotation, problem.slowest, problem.latest - problem.begin
            others = *limits, motion.swivel, here.T_flange_tool, tool is None, tool and tool.guides
            if resting is not None:
                others = *others, resting.begin - problem.begin, _PlanKey(resting).parts
        self.problem, self.resting = problem, resting
        self.parts: tuple[object, ...] = (
            *(id(problem.arm), id(motion.kind), id(motion.profile), motion.speed, motion.acceleration),
            *(motion.duration, len(here.joints.acceleration), array("d", numbers).tobytes(), *others),
        )

    def __hash__(self) -> int:
        return hash(self.parts)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _PlanKey) and self.parts == other.parts


@lru_cache(REMEMBERED_PLANS)
def _remembered_plan(key: _PlanKey) -> tuple[Segment, ...] | MotionError | NotInTime | NoWay:
    """Return the segments of a motion that begins at time 0, or the error that makes it impossible. A cached error is
    never raised itself, since its traceback would keep stack frames alive.
    """
    problem, resting = key.problem, key.resting
    state, motion = problem.here.joints, problem.motion
    try:
        if motion.kind is MotionKind.STRAIGHT:
            from vrs_cli.engine.straight import least_duration, straight_segments

            latest, deadline = problem.latest - problem.begin, None
            if resting is not None:
                latest = resting.begin + least_duration(resting) - problem.begin
                deadline = cache(lambda: _deadline(resting) - problem.begin)
            return straight_segments(structs.replace(problem, begin=0.0, latest=latest, deadline=deadline))
        assert motion.goal is not None
        limits = joint_limits(problem.arm, motion)
        segments = LAWS[motion.profile].joint_motion(state, motion.goal, limits, 0.0, motion, motion.duration)
    except MotionError as error:
        return error.reworded()
    except NotInTime:
        return NotInTime()
    except NoTimes:
        return NoWay()
    return segments if state.at_rest or stay_inside(segments, limits.lower, limits.upper) else NoWay()


def joint_limits(arm: RobotArm, motion: Motion) -> JointLimits:
    """Return the limits of the joints in a motion: velocities and accelerations multiplied by the fractions that the
    motion requests, jerks as the robot allows.
    """
    hardest = hardest_limits(arm)
    velocity = tuple(v * motion.speed for v in hardest.velocity)
    return structs.replace(
        hardest, velocity=velocity, acceleration=tuple(a * motion.acceleration for a in hardest.acceleration)
    )


def hardest_limits(arm: RobotArm) -> JointLimits:
    """Return the full limits of the joints, whatever speed and acceleration a motion requests."""
    model = arm.model
    most = model.max_velocity
    return JointLimits(most, model.max_acceleration, model.max_jerk, most, model.lower, model.upper)


def plan_stop(problem: Problem) -> tuple[Segment, ...]:
    """Plan a stop within all limits; an arm at rest stays where it is. Raises NoRoomToStop."""
    limits, motion, state = hardest_limits(problem.arm), problem.motion, problem.here.joints
    if state.at_rest:
        return (rest(state.joints, 0.0, problem.begin, motion),)
    for stop in LAWS[motion.profile].joint_stops(state, limits, problem.begin, motion):
        if stay_inside(stop, limits.lower, limits.upper):
            return stop
    raise NoRoomToStop


def slowing_segments(segments: Timeline | Sequence[Segment]) -> list[Segment]:
    """Return the segments at the end of a timeline, or of a part of it, in which the last motion slows down."""
    last, found, index = segments[-1], list[Segment](), len(segments) - 1
    segment = last
    while segment.phase is Phase.DECELERATE and segment.motion.number == last.motion.number:
        found.append(segment)
        if not index:
            break
        index -= 1
        segment = segments[index]
    return found[::-1]


def rounding_begins(arm: RobotArm, slowing: Sequence[Segment], rounding: float | None) -> float:
    """Return the start time [s] of a motion that blends into a motion that slows down: the start of the segments
    `slowing` or, with a distance `rounding` [m], the instant at which the tip comes within that distance of the corner.
    The path changes at that instant.
    """
    last = slowing[-1]
    if rounding is None:
        return slowing[0].start
    if rounding <= SAME_PLACE:
        return last.finish
    corner = _tip(arm, last, last.duration)
    ends_near = (one for one in slowing if distance(_tip(arm, one, one.duration), corner) <= rounding)
    segment = next(ends_near)
    low, high = 0.0, segment.duration
    if distance(_tip(arm, segment, low), corner) <= rounding:
        return segment.start
    while high - low > ROUNDING_PRECISION_S:
        middle = 0.5 * (low + high)
        near = distance(_tip(arm, segment, middle), corner) <= rounding
        low, high = (low, middle) if near else (middle, high)
    return min(up_to_grid(segment.start + high), segment.finish)


def _tip(arm: RobotArm, segment: Segment, s: float) -> Transform:
    """Return T_robot_tool at s seconds into a segment."""
    return compose(arm.forward(segment_joints(arm, segment, s)), segment.motion.frames.tool)


def _deadline(resting: Problem) -> float:
    """Return the time [s] by which a motion that rounds a corner must end to be better than the motion that stops in
    the corner.
    """
    planned = resting.motion.kind in (MotionKind.JOINT, MotionKind.STRAIGHT)
    known = _remembered_plan(_PlanKey(resting)) if planned else ()
    if isinstance(known, tuple) and known:  # the plan from rest is cached
        return resting.begin + known[-1].finish + MAX_ROUNDING_DELAY_S
    try:
        return plan_motion(resting)[-1].finish + MAX_ROUNDING_DELAY_S
    except MotionError:
        return inf


def _least_finish(resting: Problem) -> float:
    """Return a lower bound of the time [s] at which a joint-interpolated motion from rest ends: the end of the joint
    that takes longest if each moves on its own; -inf for other motions.
    """
    limits = joint_limits(resting.arm, resting.motion)
    ways = map(abs, map(sub, resting.motion.goal or (), resting.here.joints.joints))
    rows = zip(ways, limits.velocity, limits.acceleration, strict=False)  # no rows if there is no goal
    times = [way / v + v / a if way * a > v * v else 2.0 * sqrt(way / a) for way, v, a in rows]
    return resting.begin + max(times, default=-inf)


def plan_corner(moving: Problem, resting: Problem) -> tuple[Segment, ...]:
    """Plan a motion that rounds the corner in which the previous motion would end. If the rounded motion takes longer,
    plan the motion from rest in the corner. Raises MotionError if neither is possible.
    """
    with suppress(NoWay, NotInTime):
        rounded = plan_directly(moving, resting)
        straight = moving.motion.kind is MotionKind.STRAIGHT
        if straight or any(rounded[-1].finish <= limit(resting) for limit in (_least_finish, _deadline)):
            return rounded
    return plan_motion(resting)
