"""The part of f that steers: the joints chase a target from now on, and what was scheduled is dropped."""

from __future__ import annotations

from functools import partial

from vrs_cli.engine.planner import Place, braked, joint_limits, place_at, stays_inside
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.profile import Profile
from vrs_cli.trajectory.delta import Cause, TimelineDelta
from vrs_cli.trajectory.laws.lspb import joint_stop_each
from vrs_cli.trajectory.laws.lspb_steering import Room, steered
from vrs_cli.trajectory.laws.scurve_steering import smoothly_steered
from vrs_cli.trajectory.laws.scurve_times import Pieces
from vrs_cli.trajectory.limits import JointLimits
from vrs_cli.trajectory.motion import Motion
from vrs_cli.trajectory.segment import JointPath, Segment
from vrs_cli.trajectory.state import JointState, Target
from vrs_cli.trajectory.timeline import Timeline


def plan_steering(
    arm: RobotArm, timeline: Timeline, motion: Motion, executed: float, target: Target, tick: float
) -> TimelineDelta:
    """The change of the timeline that lets the joints chase a target from `executed` on, for a tick [s]; all that was
    scheduled after it is dropped. Raises NoRoomToStop where what is under way has to go on.
    """
    place = place_at(arm, timeline, executed)
    return TimelineDelta(
        version=timeline.version,
        cause=Cause.COMMAND,
        motion=motion,
        issued=executed,
        executed=executed,
        cut=executed,
        keep=place.keep,
        drop=len(timeline) - place.keep,
        shift=0.0,
        segments=_chasing(arm, timeline, place, motion, executed, target, tick),
    )


def _chasing(
    arm: RobotArm, timeline: Timeline, place: Place, motion: Motion, start: float, target: Target, tick: float
) -> tuple[Segment, ...]:
    here, model, limits = place.here.joints, arm.model, joint_limits(arm, motion)
    room = Room(model.lower, model.upper)
    if motion.profile is Profile.SCURVE:
        coming = partial(_coming, timeline, place.keep, start)
        segments = smoothly_steered(here, target, limits, room, tick, start, motion, coming)
        return segments or braked(arm, here, motion, start)
    segments = steered(here, target, limits, room, tick, start, motion)
    if stays_inside(arm, segments):
        return segments
    # the motion before left no room for a whole tick
    return joint_stop_each(here, JointLimits(model.max_velocity, model.max_acceleration), start, motion)


def _coming(timeline: Timeline, keep: int, t: float) -> list[Pieces] | None:
    """What each joint was to do from t [s] on until the robot rests; None where that is not jerk-limited, or not in
    joint space.
    """
    rows: list[Pieces] = []
    for index in range(keep - 1, len(timeline)):
        segment = timeline[index]
        begin, path = max(segment.start, t), segment.path
        if begin >= segment.finish:
            continue
        if segment.motion.profile is not Profile.SCURVE or not isinstance(path, JointPath):
            return None
        lasting, end = segment.finish - begin, segment.duration
        rows.append(tuple((lasting, 6.0 * a[3] if len(a) > 3 else 0.0) for a in path.coefficients))
        if JointState(path.joints(end), path.velocity(end), path.acceleration(end)).at_rest:
            break
    return list(zip(*rows, strict=True))
