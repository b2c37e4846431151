"""The part of f that steers: the joints chase a target from now on, and what was scheduled is dropped."""

from __future__ import annotations

from functools import partial

from vrs_cli.engine.one_motion import hardest_limits, joint_limits, plan_stop
from vrs_cli.engine.planner import place_at
from vrs_cli.engine.problem import Problem
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.delta import Cause, TimelineDelta
from vrs_cli.trajectory.laws.law import Pieces
from vrs_cli.trajectory.laws.table import LAWS
from vrs_cli.trajectory.motion import Motion
from vrs_cli.trajectory.segment import JointPath
from vrs_cli.trajectory.state import JointState, Target
from vrs_cli.trajectory.timeline import Timeline

CUBIC = 3  # degree of a path of constant jerk


def plan_steering(
    arm: RobotArm, timeline: Timeline, motion: Motion, executed: float, target: Target, tick: float
) -> TimelineDelta:
    """The change of the timeline that lets the joints chase a target from `executed` on, for a tick [s]; all that was
    scheduled after it is dropped. Raises NoRoomToStop where what is under way has to go on.
    """
    place = place_at(arm, timeline, executed)
    steer, coming = LAWS[motion.profile].steer, partial(_coming, timeline, place.keep, executed)
    here, limits = place.here.joints, joint_limits(arm, motion)
    segments = steer(here, target, limits, hardest_limits(arm), tick, executed, motion, coming)
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
        segments=segments or plan_stop(Problem(arm, place.here, motion, executed)),
    )


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
        if not (LAWS[segment.motion.profile].smooth and isinstance(path, JointPath) and path.degree <= CUBIC):
            return None
        lasting, end = segment.finish - begin, segment.duration
        rows.append(tuple((lasting, 6.0 * a[3] if len(a) > 3 else 0.0) for a in path.coefficients))
        if JointState(path.joints(end), path.velocity(end), path.acceleration(end)).at_rest:
            break
    return list(zip(*rows, strict=True))
