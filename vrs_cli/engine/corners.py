"""Continuous path: where a motion rounds the corner at which the one before would end."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile

from msgspec import structs

from vrs_cli.engine.one_motion import plan_directly, plan_motion
from vrs_cli.engine.problem import NotInTime, NoWay, Problem, segment_joints
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform, compose, distance
from vrs_cli.trajectory.instant import up_to_grid
from vrs_cli.trajectory.segment import Phase, Segment
from vrs_cli.trajectory.timeline import Timeline

NEARLY_NOW = 1e-6  # [s] to which the instant is found at which a corner is near
SLOWER = 1e-3  # [s] by which rounding a corner may take longer than stopping in it
SAME_PLACE = 1e-9  # [m] two places that are one


def slowing_down(segments: Timeline | Sequence[Segment]) -> list[Segment]:
    """The last segments of a timeline, or of a part of it, in which the last motion slows down."""
    last = segments[-1]
    backwards = (segments[index] for index in range(len(segments) - 1, -1, -1))
    same = takewhile(lambda one: one.phase is Phase.DECELERATE and one.motion.number == last.motion.number, backwards)
    return list(same)[::-1]


def rounding_begins(arm: RobotArm, slowing: Sequence[Segment], rounding: float | None) -> float:
    """When a motion begins that blends into one that slows down so [s]: then, or once the tip is within `rounding`
    [m] of the place where that one would end.

    From there on the path is another, and at that instant the tip is that near.
    """
    last = slowing[-1]
    if rounding is None:
        return slowing[0].start
    if rounding <= SAME_PLACE:
        return last.finish
    corner = _tip(arm, last, last.duration)
    ends_near = (one for one in slowing if distance(_tip(arm, one, one.duration), corner) <= rounding)
    return _arrival(arm, next(ends_near), corner, rounding)


def _arrival(arm: RobotArm, segment: Segment, corner: Transform, near: float) -> float:
    """When the tip comes within `near` [m] of a place that it is so near to when the segment ends."""
    low, high = 0.0, segment.duration
    if distance(_tip(arm, segment, low), corner) <= near:
        return segment.start
    while high - low > NEARLY_NOW:
        middle = 0.5 * (low + high)
        if distance(_tip(arm, segment, middle), corner) <= near:
            high = middle
        else:
            low = middle
    return min(up_to_grid(segment.start + high), segment.finish)


def _tip(arm: RobotArm, segment: Segment, s: float) -> Transform:
    return compose(arm.forward(segment_joints(arm, segment, s)), segment.motion.frames.tool)


def plan_corner(moving: Problem, resting: Problem) -> tuple[Segment, ...]:
    """A motion that rounds the corner where the one before would end; where that would take longer, it begins once the
    arm stands there. Raises MotionError where it is possible from neither.
    """
    refusal: MotionError | None = None
    try:
        stopped = plan_motion(resting)
        moving = structs.replace(moving, latest=stopped[-1].finish + SLOWER)
    except MotionError as error:
        refusal = error
    try:
        rounded = plan_directly(moving)
    except (NoWay, NotInTime):
        if refusal is not None:
            raise refusal from None
        return stopped
    return rounded if rounded[-1].finish <= moving.latest else stopped
