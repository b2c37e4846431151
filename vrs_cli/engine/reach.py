"""Why a location is in reach or not: every configuration, what MOVE would choose, and the straight line from here.

What is found is data (WHY shows it). Nothing is moved.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import dist

from vrs_cli.engine.line_check import Standpoint, check_line
from vrs_cli.engine.targets import check_joint_count
from vrs_cli.errors import LocationOutOfRange, MotionError
from vrs_cli.kinematics.arm import RobotArm, Solution
from vrs_cli.kinematics.configuration import NONE, Configuration
from vrs_cli.kinematics.joints import Joints, joints_outside
from vrs_cli.kinematics.transform import Transform, compose, inverse, position
from vrs_cli.values.motion import JointTarget, PoseTarget
from vrs_cli.values.results import LineCheck, Option, Overrun, Reach, WayOut


def reach_of(stand: Standpoint, target: PoseTarget | JointTarget) -> Reach:
    """Why a target can be reached from a standpoint, or not. Raises IllegalValue for the joints of another robot."""
    arm, holding = stand.arm, stand.arm.holding(stand.frames.tool)
    options, goal = tuple[Option, ...](), None
    if isinstance(target, JointTarget):
        check_joint_count(arm.model, target.joints)
        pose = stand.tool(target.joints)
        goal = Option(arm.configuration(target.joints), target.joints, _overruns(arm, target.joints))
    else:
        pose = compose(stand.frames.base, target.T_world_tool)
        T_robot_flange = compose(pose, inverse(stand.frames.tool))
        options = tuple(_option(stand, T_robot_flange, solution) for solution in holding.inverse_all(T_robot_flange))
    chosen, reason = _chosen(stand, target, options)
    try:
        stand.resolved(target, straight=True)
        line = check_line(stand, pose, reachable=chosen is not None)
    except MotionError as error:  # no line goes there, wherever it begins
        far = dist(position(stand.tool(stand.here)), position(pose))
        line = LineCheck(far, None, str(error), None, (WayOut(),) if chosen is not None else ())
    T_world_robot = inverse(stand.frames.base)
    begin, end = (position(compose(T_world_robot, T)) for T in (stand.tool(stand.here), pose))
    return Reach(options, goal, chosen, reason, line, begin, end)


def _option(stand: Standpoint, T_robot_flange: Transform, solution: Solution) -> Option:
    c = solution.configuration
    if solution.joints is not None:
        return Option(c, solution.joints, _overruns(stand.arm, solution.joints))
    try:
        stand.arm.holding(stand.frames.tool).select(T_robot_flange, stand.here, c)
    except LocationOutOfRange as error:
        return Option(c, None, too_far=error.beyond)
    except MotionError:
        pass
    return Option(c, None)


def _overruns(arm: RobotArm, joints: Joints) -> tuple[Overrun, ...]:
    model = arm.model
    found = []
    for joint in joints_outside(joints, model.lower, model.upper):
        q, low, high = joints[joint - 1], model.lower[joint - 1], model.upper[joint - 1]
        limit = high if q > high else low
        found.append(Overrun(joint, limit, q - limit))
    return tuple(found)


def _chosen(
    stand: Standpoint, target: PoseTarget | JointTarget, options: Sequence[Option]
) -> tuple[Configuration | None, str]:
    """What MOVE would take, and why."""
    try:
        joints = stand.resolved(target)
    except MotionError as error:
        return None, str(error)
    chosen, have = stand.arm.configuration(joints), stand.configuration
    if isinstance(target, JointTarget):
        return chosen, "a precision point says all joints"
    if chosen == NONE:
        return chosen, "the nearest joints that were found"
    asked = stand.settings.configuration
    reasons = [f"{asked} asked"] if asked != NONE else []
    if not stand.arm.lines_keep_words:  # nor does a MOVE
        return chosen, ", ".join((*reasons, "the nearest of all solutions"))
    if not Configuration(have.arm, have.elbow).words_beside((chosen,)):
        reasons.append("arm and elbow stay as they are" if chosen.elbow else "arm as it is")
    if asked.wrist is None:
        reasons += _why_this_wrist(stand, chosen, options)
    return chosen, ", ".join(reasons)


def _why_this_wrist(stand: Standpoint, chosen: Configuration, options: Sequence[Option]) -> Iterator[str]:
    """Why this wrist and not the other."""
    if chosen.wrist is None:
        return
    both = [one for one in options if (one.configuration.arm, one.configuration.elbow) == (chosen.arm, chosen.elbow)]
    this = [one for one in both if one.configuration.wrist is chosen.wrist]
    other = [one for one in both if one.configuration.wrist is not chosen.wrist]
    if not this or not other or other[0].configuration.wrist is None:
        return
    name = other[0].configuration.wrist.name
    if not other[0].usable:
        yield f"{name} is out of range"
    else:
        times = [_shortest(stand, one.joints) for one in (this[0], other[0]) if one.joints is not None]
        if times[0] < times[1]:
            yield f"{chosen.wrist.name} is reached sooner than {name}"
        else:
            yield f"{chosen.wrist.name} as it is"


def _shortest(stand: Standpoint, joints: Joints) -> float:
    """The time that the slowest joint needs at its full velocity [s]."""
    rows = zip(stand.here, joints, stand.arm.model.max_velocity, strict=True)
    return max(abs(y - x) / v for x, y, v in rows)
