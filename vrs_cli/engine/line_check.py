"""The straight line from where the robot stands: whether it is possible, where it stops, what would do instead."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from msgspec import Struct, structs

from vrs_cli.engine.commands import JointTarget, Move, PoseTarget, SetConfiguration
from vrs_cli.engine.motions import motion_to, program_speed
from vrs_cli.engine.one_motion import plan_motion
from vrs_cli.engine.problem import Here, Problem, segment_joints
from vrs_cli.engine.settings import Settings
from vrs_cli.engine.targets import Goal, Situation, resolve
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.configuration import Configuration
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    at_position,
    axis_angle,
    compose,
    inverse,
    position,
    rotation_about,
)
from vrs_cli.trajectory.motion import Frames, Motion, Start
from vrs_cli.trajectory.segment import CartesianPath, Segment, stops_on_the_way
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.vector import added, cross, length, scaled, subtracted

STEPS = 200  # in which a line is walked
HALVINGS = 40
SIDEWAYS = (0.05, 0.1, 0.2, 0.3, 0.4)  # [m] how far from the line a via point is tried
NO_WAY = 1e-9  # [m] a line that only turns the tool


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


class Standpoint(Struct, frozen=True):
    """A robot that stands at the joints `here` after the motion `before`, and its settings."""

    arm: RobotArm
    settings: Settings
    here: Joints
    before: Motion

    @property
    def frames(self) -> Frames:
        return self.before.frames

    @property
    def configuration(self) -> Configuration:
        return self.arm.configuration(self.here)

    def tool(self, joints: Joints) -> Transform:
        """T_robot_tool."""
        return compose(self.arm.forward(joints), self.frames.tool)

    def resolved(self, target: PoseTarget | JointTarget, straight: bool = False) -> Goal:
        """Where a motion to a target goes. Raises as `targets.resolve` does."""
        situation = Situation(self.here, self.here, self.frames)
        return resolve(self.arm, self.settings, Move(target, straight), situation)

    def line(self, pose: Transform, *, once: bool = True) -> Motion:
        """MOVES to T_robot_tool, with the settings for the next motion, or with those for the ones after it."""
        settings = self.settings
        duration = settings.duration.present if once else settings.duration.always
        speed = settings.speed.present if once else settings.speed.always
        fast, number = program_speed(speed, settings, self.arm.model), self.before.number + 1
        return motion_to(Goal(pose=pose), Start.AT, fast, self.before, number, settings, duration=duration)

    def planned(self, line: Motion) -> tuple[Segment, ...]:
        """The segments of a line that begins here, at rest, at time 0. Raises MotionError."""
        still = JointState(self.here, (0.0,) * len(self.here))
        return plan_motion(Problem(self.arm, Here(still), line, 0.0, self.settings.slowest))


class Way(Struct, frozen=True):
    """A straight way of the tool from one pose to another, T_robot_tool."""

    begin: Transform
    end: Transform
    T_flange_tool: Transform

    @property
    def displacement(self) -> Vector:
        return subtracted(position(self.end), position(self.begin))

    @property
    def length(self) -> float:
        return length(self.displacement)

    def pose(self, part: float) -> Transform:
        axis, angle = axis_angle(compose(inverse(self.begin), self.end))
        R = compose(self.begin, rotation_about(axis, angle * part))
        return at_position(R, *added(position(self.begin), scaled(self.displacement, part)))

    def flange(self, part: float) -> Transform:
        return compose(self.pose(part), inverse(self.T_flange_tool))


def check_line(stand: Standpoint, way: Way, *, reachable: bool) -> LineCheck:
    """The straight line along a way from here, as MOVES would plan it. `reachable`: MOVE goes to its end."""
    try:
        segments = stand.planned(stand.line(way.end))
    except MotionError as error:
        out = tuple(_ways_out(stand, way, reachable=reachable))
        return LineCheck(way.length, None, str(error), _where(stand, way, error), out)
    ends = [s.path.pose(s.duration) for s in stops_on_the_way(segments) if isinstance(s.path, CartesianPath)]
    stops = tuple(length(subtracted(position(end), position(way.begin))) for end in ends)
    return LineCheck(way.length, segments[-1].finish, stops=stops)


def _where(stand: Standpoint, way: Way, error: MotionError) -> float | None:
    """How far along the way it goes [m]: until the arm is out of reach or out of range, or as the error says."""
    stopped = _stopped(stand, way)
    if stopped is not None:
        return stopped * way.length
    if error.place is None:
        return None
    return length(subtracted(error.place, position(way.begin)))


def _stopped(stand: Standpoint, way: Way) -> float | None:
    """The part of the way after which the arm is out of reach or out of range in this configuration; None: never."""
    near, last = stand.here, 0.0
    for step in range(STEPS + 1):
        part = step / STEPS
        q = _joints_at(stand, way, near, part)
        if q is None:
            return _boundary(stand, way, near, last, part)
        near, last = q, part
    return None


def _boundary(stand: Standpoint, way: Way, near: Joints, good: float, bad: float) -> float:
    """The part of the way where it is no longer possible, between one where it is and one where it is not."""
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        if _joints_at(stand, way, near, middle) is None:
            bad = middle
        else:
            good = middle
    return bad


def _joints_at(stand: Standpoint, way: Way, near: Joints, part: float) -> Joints | None:
    """The joints on the way; None where the arm does not reach, or a joint leaves its range."""
    q = stand.arm.branch_joints(way.flange(part), stand.configuration, near)
    return q if q is not None and stand.arm.limits_ok(q) else None


# --- the ways out ----------------------------------------------------------------------------------------------


def _ways_out(stand: Standpoint, way: Way, *, reachable: bool) -> Iterator[WayOut]:
    """What would do instead: another configuration for the whole line, a via point, a MOVE."""
    yield from _other_configurations(stand, way)
    if not stand.settings.configuration.words_beside((stand.configuration,)):  # else no line goes to a transformation
        via = _via_point(stand, way)
        if via is not None:
            yield WayOut(via=compose(inverse(stand.frames.base), via))
    if reachable:
        yield WayOut()


def _other_configurations(stand: Standpoint, way: Way) -> Iterator[WayOut]:
    """The configuration in which the line is possible from the same place, that of the fewest words."""
    found = []
    for words in filter(None, (other.words_beside((stand.configuration,)) for other in stand.arm.ways)):
        try:
            moved = structs.replace(stand, here=_joints_after(stand, words, way.begin))
            moved.planned(stand.line(way.end, once=False))
        except MotionError:
            continue
        found.append(words)
    if found:
        yield WayOut(words=min(found, key=len))


def _joints_after(stand: Standpoint, words: Sequence[str], T_robot_tool: Transform) -> Joints:
    """The joints after some configuration words and a MOVE to a pose. Raises MotionError."""
    settings = stand.settings
    for flag in stand.arm.words:
        if flag.name in words:
            settings = settings.after(SetConfiguration(flag))
    target = PoseTarget(compose(inverse(stand.frames.base), T_robot_tool))
    joints = structs.replace(stand, settings=settings).resolved(target).joints
    assert joints is not None
    return joints


def _via_point(stand: Standpoint, way: Way) -> Transform | None:
    """A pose half-way, beside the line, by which two lines lead to the target; the nearest of those tried."""
    middle = way.pose(0.5)
    for distance in SIDEWAYS:
        for direction in _across(way.displacement):
            via = at_position(middle, *added(position(middle), scaled(direction, distance)))
            if _has_joints(stand, structs.replace(way, begin=via)) and _leads_by(stand, via, way.end):
                return via
    return None


def _has_joints(stand: Standpoint, way: Way) -> bool:
    """Whether the arm, as it is configured, has joints for both ends of a way: seen sooner than in a plan."""
    at_begin = stand.arm.branch_joints(way.flange(0.0), stand.configuration, stand.here)
    if at_begin is None:
        return False
    return stand.arm.branch_joints(way.flange(1.0), stand.configuration, at_begin) is not None


def _leads_by(stand: Standpoint, via: Transform, end: Transform) -> bool:
    """Whether a line to a via point, and another one from there, are possible."""
    try:
        first = stand.planned(stand.line(via))[-1]
        at_via = structs.replace(stand, here=segment_joints(stand.arm, first, first.duration))
        at_via.planned(stand.line(end, once=False))
    except MotionError:
        return False
    return True


def _across(displacement: Vector) -> Sequence[Vector]:
    """Directions across a way: up and down, to both sides."""
    size = length(displacement)
    if size < NO_WAY:
        return ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
    along = scaled(displacement, 1.0 / size)
    upward = (0.0, 0.0, 1.0) if abs(along[2]) < 0.9 else (1.0, 0.0, 0.0)
    side = cross(along, upward)
    side = scaled(side, 1.0 / length(side))
    up = cross(side, along)
    return (up, scaled(up, -1.0), side, scaled(side, -1.0))
