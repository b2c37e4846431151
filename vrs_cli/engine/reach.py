"""Why a location is in reach or not: every configuration, what MOVE would choose, and the straight line from here.

What is found is data (WHY shows it). Nothing is moved.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from msgspec import Struct

from vrs_cli.engine.commands import JointTarget, Move, PoseTarget, SetConfiguration
from vrs_cli.engine.motions import at_program_speed, motion_to
from vrs_cli.engine.planner import Here, plan_motion, segment_joints
from vrs_cli.engine.settings import Settings
from vrs_cli.engine.targets import Goal, Situation, check_joint_count, resolve
from vrs_cli.errors import LocationOutOfRange, MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.configuration import NONE, Configuration
from vrs_cli.kinematics.joints import Joints, joints_outside
from vrs_cli.kinematics.serial_arm import Solution
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    at_position,
    axis_angle,
    compose,
    inverse,
    rotation_about,
)
from vrs_cli.trajectory.instant import on_grid
from vrs_cli.trajectory.motion import Frames, Motion, Start
from vrs_cli.trajectory.segment import CartesianPath, Segment, stops_on_the_way
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.vector import added, cross, length, scaled, subtracted

STEPS = 200  # in which a line is walked
HALVINGS = 40
SIDEWAYS = (0.05, 0.1, 0.2, 0.3, 0.4)  # [m] how far from the line a via point is tried
SMALL = 1e-9


class Overrun(Struct, frozen=True):
    """A joint, counted from 1, that would be outside its range; `by` [rad]: beyond `limit`, with its sign."""

    joint: int
    limit: float
    by: float


class Branch(Struct, frozen=True):
    """One configuration: its joints, and those that are out of range; or why there are none.

    `too_far` [m]: by how much the location is; negative: too close; None where `joints` are known, or it is not known.
    """

    configuration: Configuration
    joints: Joints | None
    overruns: tuple[Overrun, ...] = ()
    too_far: float | None = None

    @property
    def usable(self) -> bool:
        return self.joints is not None and not self.overruns


class WayOut(Struct, frozen=True):
    """What would do instead of a straight line: the same in another configuration (`words`), two lines by way of `via`
    (T_world_tool), or a MOVE (neither).
    """

    words: tuple[str, ...] = ()
    via: Transform | None = None


class LineCheck(Struct, frozen=True):
    """The straight line from here. `length` [m]; `duration` [s] where it is possible, else what stops it: the error's
    text, where (`at` [m] from here, None where not on the line), and the ways out. `stops` [m]: after how much of the
    way a line that is possible comes to rest, and goes on.
    """

    length: float
    duration: float | None = None
    trouble: str = ""
    at: float | None = None
    ways_out: tuple[WayOut, ...] = ()
    stops: tuple[float, ...] = ()


class Reach(Struct, frozen=True):
    """What WHY says. `branches` is empty for a precision point, which has one set of joints: `goal`.

    `chosen`: what MOVE would take, and `reason` why; where it is refused `chosen` is None and `reason` says why not.
    """

    branches: tuple[Branch, ...]
    goal: Branch | None
    chosen: Configuration | None
    reason: str
    line: LineCheck


Lines = tuple[Motion, Motion]  # straight, with the settings for the next motion and with those for the ones after it


def explained(
    arm: RobotArm,
    settings: Settings,
    target: PoseTarget | JointTarget,
    here: Joints,
    before: Motion,
) -> Reach:
    """Why a target can be reached from `here`, at rest after a motion, or not.

    Raises IllegalValue for the joints of another robot.
    """
    frames = before.frames
    pose = _tool_pose(arm, target, frames)
    branches: tuple[Branch, ...] = ()
    goal = None
    if isinstance(target, JointTarget):
        goal = Branch(arm.configuration(target.joints), target.joints, _overruns(arm, target.joints))
    else:
        T_robot_flange = compose(pose, inverse(frames.tool))
        branches = tuple(_branch(arm, T_robot_flange, here, solution) for solution in arm.inverse_all(T_robot_flange))
    situation = Situation(here, here, frames)
    chosen, reason = _chosen(arm, settings, target, situation, branches)
    way = _Way(compose(arm.forward(here), frames.tool), pose, frames.tool)
    try:
        resolve(arm, settings, Move(target, straight=True), situation)
    except MotionError as error:  # no line goes there, wherever it begins
        line = LineCheck(way.length, None, str(error), None, () if chosen is None else (WayOut(),))
    else:
        lines = _lines(arm, settings, pose, before)
        line = _line(arm, settings, way, here, lines, reachable=chosen is not None)
    return Reach(branches, goal, chosen, reason, line)


def _lines(arm: RobotArm, settings: Settings, pose: Transform, before: Motion) -> Lines:
    line = motion_to(Goal(pose=pose), Start.AT, before, before.number + 1, settings)
    duration, speed = settings.duration, settings.speed
    first = replace(line, duration=on_grid(duration.present))
    later = replace(line, duration=on_grid(duration.always))
    return (
        at_program_speed(first, speed.present, settings, arm.model),
        at_program_speed(later, speed.always, settings, arm.model),
    )


def _tool_pose(arm: RobotArm, target: PoseTarget | JointTarget, frames: Frames) -> Transform:
    """T_robot_tool."""
    if isinstance(target, JointTarget):
        check_joint_count(arm.model, target.joints)
        return compose(arm.forward(target.joints), frames.tool)
    return compose(frames.base, target.T_world_tool)


# --- the configurations ----------------------------------------------------------------------------------------


def _branch(arm: RobotArm, T_robot_flange: Transform, here: Joints, solution: Solution) -> Branch:
    if solution.joints is not None:
        return Branch(solution.configuration, solution.joints, _overruns(arm, solution.joints))
    c = solution.configuration
    try:
        arm.select(T_robot_flange, here, arm=c.arm, elbow=c.elbow, wrist=c.wrist)
    except LocationOutOfRange as error:
        return Branch(c, None, (), error.beyond)
    except MotionError:
        pass
    return Branch(c, None)


def _overruns(arm: RobotArm, joints: Joints) -> tuple[Overrun, ...]:
    model = arm.model
    found = []
    for joint in joints_outside(joints, model.lower, model.upper):
        q, low, high = joints[joint - 1], model.lower[joint - 1], model.upper[joint - 1]
        limit = high if q > high else low
        found.append(Overrun(joint, limit, q - limit))
    return tuple(found)


def _chosen(
    arm: RobotArm,
    settings: Settings,
    target: PoseTarget | JointTarget,
    situation: Situation,
    branches: tuple[Branch, ...],
) -> tuple[Configuration | None, str]:
    """What MOVE would take, and why."""
    try:
        joints = resolve(arm, settings, Move(target, straight=False), situation).joints
    except MotionError as error:
        return None, str(error)
    assert joints is not None
    here = situation.here
    chosen, have = arm.configuration(joints), arm.configuration(here)
    if isinstance(target, JointTarget):
        return chosen, "a precision point says all joints"
    if chosen == NONE:
        return chosen, "the nearest joints that were found"
    asked = settings.configuration
    reasons = [f"{asked} asked"] if asked != NONE else []
    if not Configuration(have.arm, have.elbow).words_beside((chosen,)):
        reasons.append("arm and elbow stay as they are" if chosen.elbow else "arm as it is")
    if asked.wrist is None:
        reasons += _why_this_wrist(arm, here, chosen, branches)
    return chosen, ", ".join(reasons)


def _why_this_wrist(arm: RobotArm, here: Joints, chosen: Configuration, branches: tuple[Branch, ...]) -> Iterator[str]:
    """Why this wrist and not the other."""
    if chosen.wrist is None:
        return
    both = [b for b in branches if (b.configuration.arm, b.configuration.elbow) == (chosen.arm, chosen.elbow)]
    this = [b for b in both if b.configuration.wrist is chosen.wrist]
    other = [b for b in both if b.configuration.wrist is not chosen.wrist]
    if not this or not other or other[0].configuration.wrist is None:
        return
    name = other[0].configuration.wrist.name
    if not other[0].usable:
        yield f"{name} is out of range"
    else:
        times = [_shortest(arm, here, b.joints) for b in (this[0], other[0]) if b.joints is not None]
        if times[0] < times[1]:
            yield f"{chosen.wrist.name} is reached sooner than {name}"
        else:
            yield f"{chosen.wrist.name} as it is"


def _shortest(arm: RobotArm, a: Joints, b: Joints) -> float:
    """The time that the slowest joint needs at its full velocity [s]."""
    return max(abs(y - x) / v for x, y, v in zip(a, b, arm.model.max_velocity, strict=True))


# --- the straight line -----------------------------------------------------------------------------------------


class _Way(Struct, frozen=True):
    """A straight way of the tool from one pose to another, T_robot_tool."""

    begin: Transform
    end: Transform
    T_flange_tool: Transform

    @property
    def displacement(self) -> Vector:
        return subtracted(_position(self.end), _position(self.begin))

    @property
    def length(self) -> float:
        return length(self.displacement)

    def pose(self, part: float) -> Transform:
        axis, angle = axis_angle(compose(inverse(self.begin), self.end))
        R = compose(self.begin, rotation_about(axis, angle * part))
        return at_position(R, *added(_position(self.begin), scaled(self.displacement, part)))

    def flange(self, part: float) -> Transform:
        return compose(self.pose(part), inverse(self.T_flange_tool))


def _position(T: Transform) -> Vector:
    return T.px, T.py, T.pz


def _line(arm: RobotArm, settings: Settings, way: _Way, here: Joints, lines: Lines, *, reachable: bool) -> LineCheck:
    """The straight line from here, planned as MOVES would."""
    try:
        segments = _planned(arm, here, lines[0], settings.slowest)
    except MotionError as error:
        stopped = _stopped(arm, way, arm.configuration(here), here)
        at = _along(way, error) if stopped is None else stopped * way.length
        out = tuple(_ways_out(arm, settings, way, here, lines, reachable=reachable))
        return LineCheck(way.length, None, str(error), at, out)
    ends = [s.path.pose(s.duration) for s in stops_on_the_way(segments) if isinstance(s.path, CartesianPath)]
    stops = tuple(length(subtracted(_position(end), _position(way.begin))) for end in ends)
    return LineCheck(way.length, segments[-1].finish, stops=stops)


def _planned(arm: RobotArm, here: Joints, motion: Motion, slowest: float) -> tuple[Segment, ...]:
    """The segments of a straight line that starts at rest at time 0. Raises MotionError."""
    still = JointState(here, (0.0,) * len(here))
    return plan_motion(arm, Here(still), motion, 0.0, slowest)


def _along(way: _Way, error: MotionError) -> float | None:
    if error.place is None:
        return None
    return length(subtracted(error.place, _position(way.begin)))


def _stopped(arm: RobotArm, way: _Way, configuration: Configuration, here: Joints) -> float | None:
    """The part of the way after which the arm is out of reach or out of range in this configuration; None: never."""
    near, last = here, 0.0
    for step in range(STEPS + 1):
        part = step / STEPS
        q = _held(arm, way, configuration, near, part)
        if q is None:
            return _between(arm, way, configuration, near, last, part)
        near, last = q, part
    return None


def _between(arm: RobotArm, way: _Way, configuration: Configuration, near: Joints, good: float, bad: float) -> float:
    """The part of the way where it is no longer possible, between one where it is and one where it is not."""
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        if _held(arm, way, configuration, near, middle) is None:
            bad = middle
        else:
            good = middle
    return bad


def _held(arm: RobotArm, way: _Way, configuration: Configuration, near: Joints, part: float) -> Joints | None:
    """The joints on the way; None where the arm does not reach, or a joint leaves its range."""
    q = arm.branch_joints(way.flange(part), configuration, near)
    return q if q is not None and arm.limits_ok(q) else None


# --- the ways out ----------------------------------------------------------------------------------------------


def _ways_out(
    arm: RobotArm, settings: Settings, way: _Way, here: Joints, lines: Lines, *, reachable: bool
) -> Iterator[WayOut]:
    """What would do instead: another configuration for the whole line, a via point, a MOVE."""
    yield from _other_configurations(arm, settings, way, here, lines[1])
    keeps = not settings.configuration.words_beside((arm.configuration(here),))  # else no line goes to a transformation
    via = _via_point(arm, way, here, lines, settings.slowest) if keeps else None
    if via is not None:
        yield WayOut(via=compose(inverse(lines[0].frames.base), via))
    if reachable:
        yield WayOut()


def _other_configurations(
    arm: RobotArm, settings: Settings, way: _Way, here: Joints, motion: Motion
) -> Iterator[WayOut]:
    """The configurations in which the line is possible from the same place, those of the fewest words."""
    have = arm.configuration(here)
    found = []
    for words in filter(None, (way.words_beside((have,)) for way in arm.ways)):
        try:
            _planned(arm, _moved(arm, settings, way.begin, here, motion.frames, words), motion, settings.slowest)
        except MotionError:
            continue
        found.append(words)
    if found:
        yield WayOut(words=min(found, key=len))


def _moved(
    arm: RobotArm, settings: Settings, T_robot_tool: Transform, here: Joints, frames: Frames, words: Sequence[str]
) -> Joints:
    """The joints after some words and a MOVE to a pose. Raises MotionError."""
    told = settings
    for flag in arm.words:
        if flag.name in words:
            told = told.changed(SetConfiguration(flag))
    target = PoseTarget(compose(inverse(frames.base), T_robot_tool))
    joints = resolve(arm, told, Move(target, straight=False), Situation(here, here, frames)).joints
    assert joints is not None
    return joints


def _via_point(arm: RobotArm, way: _Way, here: Joints, lines: Lines, slowest: float) -> Transform | None:
    """A pose half-way, beside the line, by which two lines lead to the target; the nearest of those tried."""
    motion, later = lines
    middle = way.pose(0.5)
    for distance in SIDEWAYS:
        for direction in _beside(way.displacement):
            via = at_position(middle, *added(_position(middle), scaled(direction, distance)))
            if not _both_held(arm, way, via, here):
                continue
            try:
                first = _planned(arm, here, replace(motion, pose=via), slowest)[-1]
                _planned(arm, segment_joints(arm, first, first.duration), later, slowest)
            except MotionError:
                continue
            return via
    return None


def _both_held(arm: RobotArm, way: _Way, via: Transform, here: Joints) -> bool:
    """Whether the arm, as it is configured, has joints for a via point and for the end: seen sooner than in a plan."""
    there = _Way(via, way.end, way.T_flange_tool)
    at_via = arm.branch_joints(there.flange(0.0), arm.configuration(here), here)
    return at_via is not None and arm.branch_joints(there.flange(1.0), arm.configuration(here), at_via) is not None


def _beside(displacement: Vector) -> Sequence[Vector]:
    """Directions across a way: up and down, to both sides."""
    size = length(displacement)
    if size < SMALL:
        return ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
    along = scaled(displacement, 1.0 / size)
    upward = (0.0, 0.0, 1.0) if abs(along[2]) < 0.9 else (1.0, 0.0, 0.0)
    side = cross(along, upward)
    side = scaled(side, 1.0 / length(side))
    up = cross(side, along)
    return (up, scaled(up, -1.0), side, scaled(side, -1.0))
