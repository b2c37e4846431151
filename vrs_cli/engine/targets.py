"""Turn a request into the input of the planner f: the joints or the tool pose of a target, and the motion with its
speed.
"""

from __future__ import annotations

from array import array
from functools import lru_cache
from math import asin, degrees, hypot, pi

from msgspec import Struct, structs

from vrs_cli.engine.settings import FULL_SPEED, MM, Settings
from vrs_cli.errors import (
    IllegalJoint,
    IllegalValue,
    JointOutOfRange,
    LocationOutOfRange,
    LocationTooFar,
    NotAvailable,
    StraightLineConfiguration,
    UndefinedValue,
    VrsError,
)
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Configuration, Flag, Joints, joints_outside
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    at_position,
    compose,
    cross,
    dot,
    inverse,
    length,
    rotation_about,
)
from vrs_cli.trajectory.instant import on_grid
from vrs_cli.values.commands import (
    AlignedTarget,
    Frames,
    JointOffsetTarget,
    JointTarget,
    Mode,
    Motion,
    MotionKind,
    Move,
    NamedTarget,
    PoseTarget,
    RelativeTarget,
    SetSpeed,
    SpeedUnit,
    Start,
    Swivel,
    ToolOffsetTarget,
)

# [m] maximum distance of a location, a tool or a base; for greater ones rounding errors are too large
MAX_DISTANCE = 100.0
HALF_TURN = pi + 1e-9  # [rad] half a turn, with a margin for rounding
Goal = Joints | Transform  # joints to reach (joint-interpolated), or T_robot_tool (straight line)
# number of cached goals, so that a program with a loop computes the joints of each location only once
REMEMBERED_JOINTS = 512
MIN_SPEED = 1e-4  # minimum speed, as a fraction of nominal speed; a slower motion would hardly move
INCH = 0.0254  # [m] one inch


def resolve(arm: RobotArm, settings: Settings, move: Move, frames: Frames, here: Joints, destination: Joints) -> Goal:
    """Return the goal of a motion that begins at the joints `here`. The previous motion ends at the joints
    `destination`.

    Raises LocationOutOfRange, JointOutOfRange, StraightLineConfiguration, IllegalJoint, IllegalValue, UndefinedValue.
    """
    pose = _tool_pose(arm, move, frames, destination)
    if pose is None:
        joints = _joints(arm.model, move, destination)
        check_joint_limits(arm.model, joints)
        if move.straight:
            return compose(arm.forward(joints), frames.tool)
    elif move.straight:
        arm.check_task(compose(pose, inverse(frames.tool)), frames.base, frames.tool)
        have = arm.configuration(here)
        missing = settings.configuration.words_beside((have,))
        if missing:
            raise StraightLineConfiguration(f"{' '.join(missing)} asked, the arm is {have}", "use {MOVE} to change it")
        return pose
    else:
        joints = select(arm, settings, pose, frames, here)
    for joint, (at, to) in () if settings.mode(Mode.OVERLAP) else enumerate(zip(here, joints, strict=True), 1):
        if abs(to - at) > HALF_TURN and not arm.model.units.slides(joint):
            raise JointOutOfRange(
                f"would turn by {degrees(to - at):.1f} deg, NOOVERLAP allows half a turn",
                "say OVERLAP, or go there in two motions",
                joint=joint,
                value=to - at,
                lower=-HALF_TURN,
                upper=HALF_TURN,
            )
    return joints


def _tool_pose(arm: RobotArm, move: Move, frames: Frames, destination: Joints) -> Transform | None:
    """Return the pose T_robot_tool of a target; None if the target is given by joints."""
    target = move.target
    if isinstance(target, PoseTarget):
        pose = compose(frames.base, target.T_world_tool)
    elif isinstance(target, ToolOffsetTarget | AlignedTarget):
        pose = _relative_pose(arm, target, destination, frames)
    else:
        return None
    check_near(pose, "{} from the robot", LocationTooFar)
    return pose


def naming_null(refusal: LocationOutOfRange, T_robot_tool: Transform) -> LocationOutOfRange:
    """Return the error for a location out of reach. If the location is NULL, where no tool can be, the hint says so."""
    if T_robot_tool != IDENTITY:
        return refusal
    return refusal.reworded(hint="NULL is the robot's origin, X = Y = Z = 0, where no tool can be")


def check_near(T: Transform, what: str, refusal: type[VrsError] = IllegalValue) -> None:
    """Raise `refusal` for a location, tool or base that is too far away. `what`: the error message, with a placeholder
    for the distance.
    """
    away = hypot(*T[3::4])
    if not away <= MAX_DISTANCE:
        right = f"at most {MAX_DISTANCE * 1000.0:g} mm"
        raise refusal(what.format(f"{away * 1000.0:g} mm"), right, value=away, upper=MAX_DISTANCE)


def _joints(model: RobotModel, move: Move, destination: Joints) -> Joints:
    target = move.target
    if isinstance(target, NamedTarget):
        if target.name not in model.poses:
            raise UndefinedValue(f"robot {model.name} has no pose {target.name.upper()}")
        return model.poses[target.name]
    if isinstance(target, JointOffsetTarget):
        return _drive(destination, target)
    assert isinstance(target, JointTarget)
    return target.joints


def _drive(joints: Joints, target: JointOffsetTarget) -> Joints:
    """Return the joints with one joint changed as DRIVE requests. Raises IllegalJoint."""
    if not 1 <= target.joint <= len(joints):
        right = f"this robot has joints 1 to {len(joints)}"
        raise IllegalJoint(f"joint {target.joint}", right, value=target.joint, lower=1, upper=len(joints))
    return tuple(q + target.change if i == target.joint else q for i, q in enumerate(joints, 1))


# --- targets that depend on the end of the previous motion -------------------------------------------------------

_AXES: tuple[Vector, ...] = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))


def retarget(arm: RobotArm, motion: Motion, destination: Joints) -> Motion:
    """Return the motion with its relative target recomputed, now that the previous motion ends at `destination`. A
    joint-interpolated motion keeps the configuration that arm and elbow have at `destination`. Raises
    LocationOutOfRange, JointOutOfRange.
    """
    target = motion.relative
    if target is None or motion.kind is MotionKind.REST:
        return motion
    if isinstance(target, JointOffsetTarget):
        joints = _drive(destination, target)
        check_joint_limits(arm.model, joints)
        if motion.kind is MotionKind.JOINT:
            return structs.replace(motion, goal=joints)
        return structs.replace(motion, pose=compose(arm.forward(joints), motion.frames.tool))
    pose = _relative_pose(arm, target, destination, motion.frames)
    if motion.kind is MotionKind.STRAIGHT:
        return structs.replace(motion, pose=pose)
    tool = motion.frames.tool
    return structs.replace(motion, goal=arm.for_tool(tool).select(compose(pose, inverse(tool)), destination))


def _relative_pose(
    arm: RobotArm, target: ToolOffsetTarget | AlignedTarget, destination: Joints, frames: Frames
) -> Transform:
    """Return T_robot_tool of a target that is relative to the end of the previous motion."""
    T_robot_destination = compose(arm.forward(destination), frames.tool)
    if isinstance(target, ToolOffsetTarget):
        return compose(T_robot_destination, target.T_destination_target)
    return compose(frames.base, align(compose(inverse(frames.base), T_robot_destination)))


def align(T: Transform) -> Transform:
    """Return a pose at the same position, turned by the smallest angle that makes its Z axis parallel to the nearest
    axis of the reference frame.
    """
    a = (T.ax, T.ay, T.az)
    nearest = max(_AXES, key=lambda axis: dot(a, axis))
    turn = cross(a, nearest)
    sine = length(turn)
    if sine < 1e-12:
        return T
    return at_position(compose(rotation_about(turn, asin(sine)), T), T.px, T.py, T.pz)


# --- configuration -----------------------------------------------------------------------------------------------


def select(arm: RobotArm, settings: Settings, T_robot_tool: Transform, frames: Frames, near: Joints) -> Joints:
    """Return the joints for a pose in the requested configuration, near the joints `near`. In mode SINGLE no joint
    leaves the range of one revolution.
    """
    T_robot_flange, asked = compose(T_robot_tool, inverse(frames.tool)), settings.configuration
    arm.check_task(T_robot_flange, frames.base, frames.tool)
    if settings.mode(Mode.SINGLE):
        model, slides = arm.model, arm.model.units.slides
        lower = tuple(low if slides(i) else max(low, -pi) for i, low in enumerate(model.lower, 1))
        upper = tuple(high if slides(i) else min(high, pi) for i, high in enumerate(model.upper, 1))
        arm = arm_for(structs.replace(model, lower=lower, upper=upper))
    return _remembered_joints(arm.for_tool(frames.tool), array("d", (*T_robot_flange, *near)).tobytes(), asked)


@lru_cache(REMEMBERED_JOINTS)
def _remembered_joints(arm: RobotArm, doubles: bytes, asked: Configuration) -> Joints:
    """Return the joints for a flange pose near given joints; `doubles`: pose and joints, as the bytes of doubles.

    Bits are compared, since -0.0 and 0.0 may lead to different joints.
    """
    numbers = array("d", doubles)
    return arm.select(Transform(*numbers[:12]), tuple(numbers[12:]), asked)


def check_flag(arm: RobotArm, flag: Flag) -> None:
    """Raise NotAvailable for a configuration word that the arm does not have."""
    if flag not in arm.words:
        known = ", ".join(word.name for word in arm.words)
        has = f"it has {known}" if known else "it has no configuration words"
        raise NotAvailable(f"{flag.name}: {arm.model.title} has no such configuration", has)


def check_swivel(arm: RobotArm, swivel: Swivel | None) -> None:
    """Check a SWIVEL request. Raises NotAvailable for an arm without a redundant joint, IllegalJoint, or
    JointOutOfRange.
    """
    model = arm.model
    if not arm.redundancy:
        raise NotAvailable(
            f"SWIVEL: {model.title} has no joint too many",
            f"it takes all {model.joint_count} to follow a line; SWIVEL is for arms with seven, as a rule",
        )
    if swivel is None:
        return
    if not 1 <= swivel.joint <= model.joint_count:
        right = f"this robot has joints 1 to {model.joint_count}"
        raise IllegalJoint(f"joint {swivel.joint}", right, value=swivel.joint, lower=1, upper=model.joint_count)
    at, i = swivel.value, swivel.joint - 1
    if at is not None and not model.lower[i] <= at <= model.upper[i]:
        raise model.refuse_joint(swivel.joint, at)


# --- joint limits ------------------------------------------------------------------------------------------------


def check_joint_count(model: RobotModel, joints: Joints) -> None:
    """Raise IllegalValue if the number of joints is not that of the robot."""
    if len(joints) != model.joint_count:
        raise IllegalValue(f"a precision point of {len(joints)} joints", f"this robot has {model.joint_count}")


def check_joint_limits(model: RobotModel, joints: Joints) -> None:
    """Raise JointOutOfRange for the first joint outside its range, IllegalValue for a wrong number of joints."""
    check_joint_count(model, joints)
    for joint in joints_outside(joints, model.lower, model.upper)[:1]:
        raise model.refuse_joint(joint, joints[joint - 1])


class Speed(Struct, frozen=True):
    """The speed of a motion: the `fraction` of nominal speed, the `rotation` speed of a line as a fraction of its
    nominal speed, and the speed of the `tip` [m/s]. `rotation` and `tip` are None if they are not given.
    """

    fraction: float
    tip: float | None = None
    rotation: float | None = None


FULL = Speed(1.0)


class After(Struct, frozen=True):
    """The context of a new motion: the motion `before` it on the timeline, its own number, and the settings."""

    before: Motion
    number: int
    settings: Settings

    def motion(
        self,
        start: Start,
        goal: Goal | None = None,
        speed: Speed = FULL,
        *,
        duration: float = 0.0,
        frames: Frames | None = None,
        text: str = "",
        relative: RelativeTarget | None = None,
    ) -> Motion:
        """Make a motion to joints or a pose, or a rest if there is no goal; BASE and TOOL are by default those of
        `before`.
        """
        pose = goal if isinstance(goal, Transform) else None
        return Motion(
            number=self.number,
            kind=MotionKind.REST if goal is None else MotionKind.JOINT if pose is None else MotionKind.STRAIGHT,
            start=start,
            goal=goal if pose is None else None,
            pose=pose,
            speed=speed.fraction,
            acceleration=1.0 if goal is None else self.settings.acceleration,
            tip_speed=speed.tip,
            rotation=speed.rotation,
            duration=on_grid(duration) if duration else 0.0,  # the shared constant 0.0 saves memory
            swivel=None if pose is None else self.settings.swivel.present.swivel,
            frames=frames or self.before.frames,
            text=text,
            relative=relative,
            profile=self.settings.profile,
            rounding=self.settings.rounding if start is Start.BLEND else None,
        )


# --- speed: actual = monitor x program -------------------------------------------------------------------------------


def fraction_of_full(fraction: float, settings: Settings) -> Speed:
    return Speed(_limit_speed(settings.monitor_speed / FULL_SPEED * fraction))


def program_speed(program: SetSpeed, settings: Settings, model: RobotModel) -> Speed:
    monitor = settings.monitor_speed / FULL_SPEED
    rotation = None if program.rotation is None else _limit_speed(monitor * program.rotation / FULL_SPEED)
    if program.unit is SpeedUnit.PERCENT:
        return Speed(_limit_speed(monitor * program.value / FULL_SPEED), None, rotation)
    tip, full = monitor * program.value * (MM if program.unit is SpeedUnit.MMPS else INCH), model.linear_speed
    fraction = _limit_speed(tip / full)
    return Speed(fraction, min(max(tip, MIN_SPEED * full), full), fraction if rotation is None else rotation)


def _limit_speed(speed: float) -> float:
    """Limit a fraction of nominal speed to at most 1, and to at least the minimum speed."""
    return min(1.0, max(speed, MIN_SPEED))  # the shared constant 1.0 saves memory
