"""Explain why a location is in reach or not: every configuration, the choice of MOVE, and the straight line from here.

The report on the line says whether the line is possible, where the tool comes to rest on the way or the line becomes
impossible, and what would work instead. The findings are data, which WHY shows. The robot does not move.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import dist

from msgspec import Struct, structs

from vrs_cli.engine.problem import Here, Problem, segment_joints
from vrs_cli.engine.settings import Settings
from vrs_cli.engine.single_motion import plan_motion
from vrs_cli.engine.targets import After, Goal, check_joint_count, program_speed, resolve
from vrs_cli.errors import LocationOutOfRange, MotionError
from vrs_cli.kinematics.arm import RobotArm, Solution
from vrs_cli.kinematics.joints import NONE, Configuration, Joints, joints_outside
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    at_position,
    axis_angle,
    compose,
    cross,
    inverse,
    length,
    position,
    rotation_about,
    scaled_vector,
    vector_difference,
    vector_sum,
)
from vrs_cli.trajectory.segment import CartesianPath, Segment, stops_on_the_way
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.commands import JointTarget, Motion, Move, PoseTarget, SetConfiguration, Start
from vrs_cli.values.reports import LineCheck, Option, Overrun, Reach, WayOut

VIA_DISTANCES = (0.05, 0.1, 0.2, 0.3, 0.4)  # [m] via points are tried at these distances from the middle of the line
NO_LENGTH = 1e-9  # [m] on a line shorter than this, the tool only turns


class Standpoint(Struct, frozen=True):
    """The state from which reach is examined: a robot at rest at the joints `here`, after the motion `before`, and its
    settings.
    """

    arm: RobotArm
    settings: Settings
    here: Joints
    before: Motion

    @property
    def configuration(self) -> Configuration:
        return self.arm.configuration(self.here)

    def tool(self, joints: Joints) -> Transform:
        """Return T_robot_tool at these joints."""
        return compose(self.arm.forward(joints), self.before.frames.tool)

    def resolve_target(self, target: PoseTarget | JointTarget, straight: bool = False) -> Goal:
        """Return the goal of a motion to a target. Raises the errors of `targets.resolve`."""
        return resolve(self.arm, self.settings, Move(target, straight), self.before.frames, self.here, self.here)

    def line(self, pose: Transform, *, once: bool = True) -> Motion:
        """Return the motion of a MOVES to the pose T_robot_tool. `once`: include the settings that apply to the next
        motion only; otherwise use the permanent settings.
        """
        settings = self.settings
        duration = settings.duration.present if once else settings.duration.always
        speed = settings.speed.present if once else settings.speed.always
        fast, number = program_speed(speed, settings, self.arm.model), self.before.number + 1
        return After(self.before, number, settings).motion(Start.AT, pose, fast, duration=duration)

    def plan_line(self, line: Motion) -> tuple[Segment, ...]:
        """Plan a line that begins here, at rest, at time 0. Raises MotionError."""
        still = JointState(self.here, (0.0,) * len(self.here))
        return plan_motion(Problem(self.arm, Here(still), line, 0.0, self.settings.slowest))


def check_line(stand: Standpoint, end: Transform, *, reachable: bool) -> LineCheck:
    """Check the straight line from here to the pose T_robot_tool, as MOVES would plan it. `reachable`: whether MOVE
    reaches the end of the line.
    """
    begin = stand.tool(stand.here)
    long = dist(position(begin), position(end))
    try:
        segments = stand.plan_line(stand.line(end))
    except MotionError as error:
        at = None if error.place is None else dist(error.place, position(begin))
        return LineCheck(long, None, str(error), at, tuple(_ways_out(stand, begin, end, reachable=reachable)))
    ends = [s.path.pose(s.duration) for s in stops_on_the_way(segments) if isinstance(s.path, CartesianPath)]
    return LineCheck(long, segments[-1].finish, stops=tuple(dist(position(end), position(begin)) for end in ends))


# --- alternatives --------------------------------------------------------------------------------------------------


def _ways_out(stand: Standpoint, begin: Transform, end: Transform, *, reachable: bool) -> Iterator[WayOut]:
    """Yield the alternatives to an impossible line: another configuration for the whole line, a via point, a MOVE."""
    ways = filter(None, (other.words_beside((stand.configuration,)) for other in stand.arm.ways))
    found = [words for words in ways if _leads_as(stand, words, begin, end)]
    if found:
        yield WayOut(words=min(found, key=len))
    if not stand.settings.configuration.words_beside(
        (stand.configuration,)
    ):  # a line cannot change the configuration: requested words that differ exclude every line
        via = next((via for via in _via_poses(begin, end) if _leads_by(stand, via, end)), None)
        if via is not None:
            yield WayOut(via=compose(inverse(stand.before.frames.base), via))
    if reachable:
        yield WayOut()


def _leads_as(stand: Standpoint, words: Sequence[str], begin: Transform, end: Transform) -> bool:
    """Return whether the line is possible after a command with the given configuration words and a MOVE to its
    start.
    """
    settings = stand.settings
    for flag in stand.arm.words:
        if flag.name in words:
            settings = settings.after(SetConfiguration(flag))
    target = PoseTarget(compose(inverse(stand.before.frames.base), begin))
    try:
        moved = structs.replace(stand, settings=settings).resolve_target(target)
        structs.replace(stand, here=moved).plan_line(stand.line(end, once=False))
    except MotionError:
        return False
    return True


def _via_poses(begin: Transform, end: Transform) -> Iterator[Transform]:
    """Yield via poses beside the middle of a line, the nearest first."""
    way = vector_difference(position(end), position(begin))
    axis, angle = axis_angle(compose(inverse(begin), end))
    half_turned, middle = (
        compose(begin, rotation_about(axis, 0.5 * angle)),
        vector_sum(position(begin), scaled_vector(way, 0.5)),
    )
    for distance in VIA_DISTANCES:
        for direction in _across(way):
            yield at_position(half_turned, *vector_sum(middle, scaled_vector(direction, distance)))


def _leads_by(stand: Standpoint, via: Transform, end: Transform) -> bool:
    """Return whether a line to a via point, and a second line from there to the end, are possible."""
    near: Joints | None = stand.here
    arm, (way, *_) = stand.arm.for_tool(stand.before.frames.tool), stand.arm.line_ways(stand.here)
    for pose in (via, end):  # a quick check, before the lines are planned
        flange = compose(pose, inverse(stand.before.frames.tool))
        near = near and arm.branch_joints(flange, way, near)
    if near is None:
        return False
    try:
        first = stand.plan_line(stand.line(via))[-1]
        at_via = structs.replace(stand, here=segment_joints(stand.arm, first, first.duration))
        at_via.plan_line(stand.line(end, once=False))
    except MotionError:
        return False
    return True


def _across(way: Vector) -> Sequence[Vector]:
    """Return unit vectors perpendicular to a line: up and down, and to both sides."""
    size = length(way)
    if size < NO_LENGTH:
        across: Sequence[Vector] = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    else:
        along = scaled_vector(way, 1.0 / size)
        side = cross(along, (0.0, 0.0, 1.0) if abs(along[2]) < 0.9 else (1.0, 0.0, 0.0))
        side = scaled_vector(side, 1.0 / length(side))
        across = cross(side, along), side
    return [scaled_vector(direction, sense) for direction in across for sense in (1.0, -1.0)]


def reach_of(stand: Standpoint, target: PoseTarget | JointTarget) -> Reach:
    """Explain why a target can be reached from a standpoint, or not. Raises IllegalValue if the target's number of
    joints does not fit the robot.
    """
    arm, holding = stand.arm, stand.arm.for_tool(stand.before.frames.tool)
    options, goal = tuple[Option, ...](), None
    if isinstance(target, JointTarget):
        check_joint_count(arm.model, target.joints)
        pose = stand.tool(target.joints)
        goal = Option(arm.configuration(target.joints), target.joints, _overruns(arm, target.joints))
    else:
        pose = compose(stand.before.frames.base, target.T_world_tool)
        T_robot_flange = compose(pose, inverse(stand.before.frames.tool))
        options = tuple(_option(stand, T_robot_flange, solution) for solution in holding.inverse_all(T_robot_flange))
    chosen, reason = _choice(stand, target, options)
    try:
        stand.resolve_target(target, straight=True)
        line = check_line(stand, pose, reachable=chosen is not None)
    except MotionError as error:  # no straight line, from any position, reaches the target
        far = dist(position(stand.tool(stand.here)), position(pose))
        line = LineCheck(far, None, str(error), None, (WayOut(),) if chosen is not None else ())
    T_world_robot = inverse(stand.before.frames.base)
    begin, end = (position(compose(T_world_robot, T)) for T in (stand.tool(stand.here), pose))
    return Reach(options, goal, chosen, reason, line, begin, end)


def _option(stand: Standpoint, T_robot_flange: Transform, solution: Solution) -> Option:
    c = solution.configuration
    if solution.joints is not None:
        return Option(c, solution.joints, _overruns(stand.arm, solution.joints))
    try:
        stand.arm.for_tool(stand.before.frames.tool).select(T_robot_flange, stand.here, c)
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


def _choice(
    stand: Standpoint, target: PoseTarget | JointTarget, options: Sequence[Option]
) -> tuple[Configuration | None, str]:
    """Return the configuration that MOVE would take, and why."""
    try:
        joints = stand.resolve_target(target)
    except MotionError as error:
        return None, str(error)
    chosen, have = stand.arm.configuration(joints), stand.configuration
    if isinstance(target, JointTarget):
        return chosen, "a precision point says all joints"
    if chosen == NONE:
        return chosen, "the nearest joints that were found"
    asked = stand.settings.configuration
    reasons = [f"{asked} asked"] if asked != NONE else []
    if not stand.arm.lines_keep_words:  # a MOVE does not keep the configuration words either
        return chosen, ", ".join((*reasons, "the nearest of all solutions"))
    if not Configuration.of(have.arm, have.elbow).words_beside((chosen,)):
        reasons.append("arm and elbow stay as they are" if chosen.elbow else "arm as it is")
    if asked.wrist is None:
        reasons += _why_this_wrist(stand, chosen, options)
    return chosen, ", ".join(reasons)


def _why_this_wrist(stand: Standpoint, chosen: Configuration, options: Sequence[Option]) -> Iterator[str]:
    """Yield the reasons why MOVE takes this configuration of the wrist and not the other one."""
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
        pair = this[0], other[0]
        times = [stand.arm.shortest_time(stand.here, one.joints) for one in pair if one.joints is not None]
        if times[0] < times[1]:
            yield f"{chosen.wrist.name} is reached sooner than {name}"
        else:
            yield f"{chosen.wrist.name} as it is"
