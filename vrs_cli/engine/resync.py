"""RESYNC: the timeline goes from its own state to the joints that a body measured, and then on to where it was going.

The body holds meanwhile. So the way to the measured joints is one of the virtual robot alone, as fast as its limits
allow; where it ends both are in one place, and the body follows again. It is one motion command with one delta: nothing
jumps, motions that are scheduled later stay, and the file of the trajectory has it as any other command.
"""

from __future__ import annotations

from contextlib import suppress

from vrs_cli.engine.planner import plan, plan_by_way_of
from vrs_cli.engine.position import finish_after, joints_at
from vrs_cli.engine.problem import SLOWEST
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints, put_inside
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import Motion, MotionKind, Start
from vrs_cli.values.measured import ResyncReport

RESYNC = "RESYNC"


def plan_resync(
    arm: RobotArm,
    timeline: Timeline,
    measured: Joints,
    resting: Motion,
    times: tuple[float, float],
    leaves: float,
    *,
    stops: bool,
    slowest: float = SLOWEST,
) -> tuple[TimelineDelta, ResyncReport]:
    """f for RESYNC: to the measured joints [rad, m], put inside the ranges of the joints, and from there on to the end
    of the motion under way; if it `stops`, what was scheduled is dropped.

    `times`: issued and executed [s]. `leaves`: the robot stands at the measured joints until then at least [s], so
    that the body hears of it in time. `resting`: the motion to use where none is under way; its goal is replaced.
    Raises MotionError.
    """
    issued, begin = times
    under_way, index = timeline.locate(begin)[0].motion, timeline.index_at(begin)
    moves = begin < timeline[index].finish
    goal = joints_at(arm, timeline, finish_after(timeline, begin))
    before = joints_at(arm, timeline, begin)
    there = put_inside(measured, arm.model.lower, arm.model.upper)
    distances = tuple([q - p for p, q in zip(before, there, strict=True)])
    numbered = resting._replace(kind=MotionKind.JOINT, start=Start.AT, frames=under_way.frames, text=RESYNC)
    way = numbered._replace(goal=there, speed=1.0, acceleration=1.0, duration=0.0)
    if stops:
        delta = plan(arm, timeline, way, issued, begin, insert=False, slowest=slowest)
        return delta, ResyncReport(begin, delta.segments[-1].finish, distances)
    on = numbered._replace(goal=goal)
    if moves and under_way.kind in (MotionKind.JOINT, MotionKind.STRAIGHT):
        on = under_way._replace(number=numbered.number, start=Start.AT, goal=goal, relative=None, rounding=None)
        on = on._replace(duration=0.0, text=RESYNC)
    if on.kind is MotionKind.STRAIGHT:
        with suppress(MotionError):  # from another place the line may leave the reach: then the joints go there
            return _by_way(arm, timeline, way, on._replace(goal=None), times, leaves, distances, slowest)
    on = on._replace(kind=MotionKind.JOINT, pose=None, tip_speed=None, rotation=None, swivel=None)
    return _by_way(arm, timeline, way, on, times, leaves, distances, slowest)


def _by_way(
    arm: RobotArm,
    timeline: Timeline,
    way: Motion,
    on: Motion,
    times: tuple[float, float],
    leaves: float,
    distances: Joints,
    slowest: float,
) -> tuple[TimelineDelta, ResyncReport]:
    way = way._replace(profile=on.profile)
    delta, comes = plan_by_way_of(arm, timeline, way, on, *times, leaves, slowest=slowest)
    text = timeline.locate(times[1])[0].motion.text
    goal = text if text and text != RESYNC else "where the timeline stood"
    return delta, ResyncReport(times[1], comes, distances, goal)
