"""A motion as the timeline knows it: where to, how fast, how it begins. Enough to plan it again from another place."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.kinematics.joints import Joints, Profile
from vrs_cli.kinematics.transform import IDENTITY, Transform


class MotionKind(Enum):
    """JOINT: joint-interpolated. STRAIGHT: the tool tip on a straight line. REST: stand still (DELAY, hand, tool).
    STEERED: the joints follow a stream of targets, which are not kept. EVENT: no motion, but channels take values
    (SIGNAL). RECORDED: the same from outside, or observed: no command; UNDO takes it along with the one before it.
    """

    JOINT = "joint"
    STRAIGHT = "straight"
    REST = "rest"
    STEERED = "steered"
    EVENT = "event"
    RECORDED = "recorded"

    @property
    def space(self) -> str:
        """Where such a motion is planned, as tables say it."""
        return "joint" if self is MotionKind.STEERED else str(self.value)


class Start(Enum):
    """How a motion begins, which decides when it begins if an earlier one changes."""

    AT = "at"  # at its own time, or as soon as the motion before has ended
    AFTER = "after"  # when the motion before has ended, plus the pause there was
    BLEND = "blend"  # at the start of the deceleration of the motion before (continuous path)


class Frames(Struct, frozen=True):
    """What stands at both ends of the arm: T_robot_world (BASE) and T_flange_tool (TOOL)."""

    base: Transform = IDENTITY
    tool: Transform = IDENTITY


class ToolOffsetTarget(NamedTuple):
    """DEPART: from where the motion before ends, a pose in that tool frame, T_destination_target."""

    T_destination_target: Transform


class JointOffsetTarget(NamedTuple):
    """DRIVE: one joint (counted from 1) changed by so many radians (metres) from where the motion before ends."""

    joint: int
    change: float


class AlignedTarget(Struct, frozen=True):
    """ALIGN: where the motion before ends, with the tool's Z along the nearest axis of the world (BASE)."""


RelativeTarget = ToolOffsetTarget | JointOffsetTarget | AlignedTarget


class Swivel(NamedTuple):
    """Where a joint, counted from 1, is at the end of a straight line [rad, m]; None: where it is at its start."""

    joint: int
    value: float | None = None


class Motion(NamedTuple):
    """`number` counts the motions of a timeline from 1; 0 is the initial pose.

    `goal`: the joints to reach [rad] (JOINT), or the first target (STEERED). `pose`: T_robot_tool to reach (STRAIGHT).
    `relative`: what both follow from, for a motion whose target depends on where the one before it ends. `speed` and
    `acceleration` are fractions of the nominal ones. For a straight line `tip_speed` [m/s] and `rotation` (fraction of
    the nominal angular speed) replace what `speed` gives.
    `duration` [s]: the least time (for REST, the time). `hand`: the opening from its start on (1 open, 0 closed), in
    older files alone: now it is a channel. `text`: the instruction that asked for it. `rounding` [m]: with
    Start.BLEND, how near the tip comes to the end of the motion before, until this one begins; None: as soon as that
    one slows down. `swivel`: of a straight line, for an arm with a joint too many.
    """

    number: int
    kind: MotionKind
    start: Start
    goal: Joints | None = None
    pose: Transform | None = None
    speed: float = 1.0
    acceleration: float = 1.0
    tip_speed: float | None = None
    rotation: float | None = None
    duration: float = 0.0
    hand: float = 0.0
    frames: Frames = Frames()
    text: str = ""
    relative: RelativeTarget | None = None
    profile: Profile = Profile.LSPB
    rounding: float | None = None
    swivel: Swivel | None = None


class PoseTarget(Struct, frozen=True):
    """A transformation: the tool tip in the world (BASE) frame, T_world_tool."""

    T_world_tool: Transform


class JointTarget(Struct, frozen=True):
    """A precision point."""

    joints: Joints


class NamedTarget(Struct, frozen=True):
    """A pose of the robot model: "ready", "nest"."""

    name: str


Target = PoseTarget | JointTarget | NamedTarget | RelativeTarget
