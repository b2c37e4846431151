"""The guides of a straight line: what joints that are too many follow, out of the state that it begins in."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, dist, inf
from operator import mul

from vrs_cli.engine.problem import Problem
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import (
    Transform,
    at_position,
    axis_angle,
    compose,
    inverse,
    position,
    rotation_about,
)
from vrs_cli.kinematics.walk import Asked, Walk
from vrs_cli.trajectory.limits import ToolLimits
from vrs_cli.trajectory.state import GuideState, JointState, ToolState
from vrs_cli.values.motion import Motion

STEP, TURN = 0.03, 0.15  # [m, rad] of a walk along a line
FEWEST = 6  # steps
FINER = (1, 5)  # how many times more steps, where the walks before have led to no line


def guided_states(problem: Problem, state: ToolState, goal: Transform) -> Iterator[ToolState]:
    """The state of the tool with guides to T_robot_tool `goal`, in the ways that there are, the one to try first
    first; as it is where no joint is too many.
    """
    arm = problem.arm
    if not arm.redundancy:
        yield state
        return
    T_tool_flange, begin = inverse(problem.motion.frames.tool), problem.here.joints
    asked, none = _asked(problem), True
    for finer in FINER:
        poses = [compose(pose, T_tool_flange) for pose in _poses(state.pose, goal, finer)]
        for walk in arm.walks(begin.joints, poses, asked):
            none = False
            yield state._replace(guides=_guides(begin, walk))
    if none:  # to be refused
        yield state._replace(guides=_guides(begin, arm.shortest_walk(begin.joints, poses, asked)))


def _asked(problem: Problem) -> Asked:
    swivel, here = problem.motion.swivel, problem.here.joints.joints
    if swivel is None:
        return ()
    i = swivel.joint - 1
    return ((i, here[i] if swivel.value is None else swivel.value),)


def _poses(begin: Transform, goal: Transform, finer: int) -> Iterator[Transform]:
    """Poses of a tool along a line, both ends among them."""
    axis, angle = axis_angle(compose(inverse(begin), goal))
    p, q = position(begin), position(goal)
    steps = finer * max(ceil(dist(p, q) / STEP), ceil(angle / TURN), FEWEST)
    for k in range(steps + 1):
        part = k / steps
        turned = compose(begin, rotation_about(axis, part * angle)) if angle else begin
        yield at_position(turned, *(a + part * (b - a) for a, b in zip(p, q, strict=True)))


def _guides(state: JointState, walk: Walk) -> tuple[GuideState, ...]:
    still = (0.0,) * len(state.joints)
    columns = state.joints, state.velocity, state.acceleration or still
    return tuple(
        GuideState(weights, at, end, rate, acceleration)
        for weights, end in zip(walk.weights, walk.ends, strict=True)
        for at, rate, acceleration in [[_sum(weights, column) for column in columns]]
    )


def _sum(weights: Joints, joints: Joints) -> float:
    return float(sum(map(mul, weights, joints)))


def guide_limits(model: RobotModel, motion: Motion, state: ToolState, limits: ToolLimits) -> ToolLimits:
    """The limits with those of guides, at the motion's fractions: what the joints can where nothing else moves them."""
    if not state.guides:
        return limits
    speed, acceleration, jerk = (
        min([a / abs(w) for guide in state.guides for a, w in zip(most, guide.weights, strict=True) if w] or [inf])
        for most in (model.max_velocity, model.max_acceleration, model.max_jerk)
    )
    return limits._replace(
        guide=speed * motion.speed, guide_acceleration=acceleration * motion.acceleration, guide_jerk=jerk
    )
