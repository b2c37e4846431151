"""Define the values that the language sends to the engine: motions, events with their times, and commands to the robot.
A program yields commands as plain data. The engine turns each `Move` into a `Motion`, adds its issue and execution
times, and passes it to the planner f. Units: metres, radians, seconds."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.kinematics.joints import Flag, Joints, Profile
from vrs_cli.kinematics.transform import IDENTITY, Transform


class MotionKind(Enum):
    """JOINT: joint-interpolated. STRAIGHT: the tool tip moves on a straight line. REST: the arm is at rest (DELAY,
    hand, tool). STEERED: the joints follow a stream of targets, which the timeline does not store. EVENT: channels get
    values and nothing moves (SIGNAL). RECORDED: an EVENT from outside the program, or an observation; UNDO reverts it
    together with the command before it."""

    JOINT = "joint"
    STRAIGHT = "straight"
    REST = "rest"
    STEERED = "steered"
    EVENT = "event"
    RECORDED = "recorded"

    @property
    def space(self) -> str:
        """Return the name, for tables, of the space in which a motion of this kind is planned."""
        return "joint" if self is MotionKind.STEERED else str(self.value)


class Start(Enum):
    """The rule for when a motion begins after an earlier motion has changed."""

    AT = "at"  # at its own time, or when the previous motion ends if that is later
    AFTER = "after"  # when the previous motion has ended, after the same pause as before
    BLEND = "blend"  # when the previous motion begins to decelerate (continuous path)


class Frames(Struct, frozen=True):
    """The frames at both ends of the arm: T_robot_world (BASE) and T_flange_tool (TOOL)."""

    base: Transform = IDENTITY
    tool: Transform = IDENTITY


class ToolOffsetTarget(Struct, frozen=True):
    """DEPART: T_destination_target, the target in the frame of the tool at the end of the previous motion."""

    T_destination_target: Transform


class JointOffsetTarget(Struct, frozen=True):
    """DRIVE: change one joint (counted from 1) by `change` [rad, m], relative to the end of the previous motion."""

    joint: int
    change: float


class AlignedTarget(Struct, frozen=True):
    """ALIGN: the end location of the previous motion, with the tool's Z axis turned to the nearest axis of the world
    (BASE)."""


RelativeTarget = ToolOffsetTarget | JointOffsetTarget | AlignedTarget


class Swivel(Struct, frozen=True, array_like=True):
    """The value of a joint (counted from 1) at the end of a straight line [rad, m]; None: its value at the start."""

    joint: int
    value: float | None = None


class Motion(Struct, frozen=True):
    """A motion of a timeline, with all data needed to plan it again from another start. `number` counts the motions of
    a timeline from 1; 0 is the initial pose. `goal`: the joints to reach [rad] (JOINT), or the first target (STEERED).
    `pose`: T_robot_tool to reach (STRAIGHT). `relative`: the target from which goal and pose are computed if it depends
    on the end of the previous motion. `speed` and `acceleration` are fractions of the nominal values. On a straight
    line `tip_speed` [m/s] and `rotation` (fraction of the nominal angular speed) replace `speed`. `duration` [s]: the
    minimum duration (for REST, the duration). `hand`: the opening of the hand after the start of the motion (1 open, 0
    closed), only in older files; newer files have events. `text`: the instruction. `rounding` [m]: with Start.BLEND,
    this motion begins when the tip is at this distance from the end of the previous motion; None: when the previous
    motion begins to slow down. `swivel`: the value of a redundant joint at the end of a straight line."""

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
    """A transformation: T_world_tool, the tool tip in the world frame (BASE)."""

    T_world_tool: Transform


class JointTarget(Struct, frozen=True):
    """A precision point: the joints to reach [rad, m]."""

    joints: Joints


class NamedTarget(Struct, frozen=True):
    """A named pose of the robot model: "ready" or "nest"."""

    name: str


Target = PoseTarget | JointTarget | NamedTarget | RelativeTarget


HAND = 0  # the channel of the hand; the channels of outputs are 1 to 512
FIRST_INPUT = 1001  # the channels of inputs are 1001 to 1512


class Event(NamedTuple):
    """A change of a channel's value. `time` [s]: a multiple of 2^-30 s. `channel`: HAND (values from 0, closed, to 1,
    open), or the number of a signal (values 0 or 1). `number`: the number of the command that caused the event, as in
    `Motion.number`. `tied`: after an edit the event keeps its time relative to its motion; otherwise it keeps its own
    time. `duration` [s]: how long the fingers move; they arrive at `time + duration`. `observed`: the event changes
    nothing; it records that a program read this value at that time."""

    time: float
    channel: int
    value: float
    number: int = 0
    tied: bool = False
    duration: float = 0.0
    observed: bool = False

    def shift_by(self, shift: float) -> Event:
        """Return the event, moved by `shift` [s]."""
        return self._replace(time=self.time + shift) if shift else self


class EventEdit(Struct, frozen=True):
    """The change of events in a timeline delta: keep the first `keep` events, replace the next `drop` events with
    `events`, and move all later events by `shift` [s]."""

    keep: int
    drop: int = 0
    shift: float = 0.0
    events: tuple[Event, ...] = ()

    @property
    def adds(self) -> bool:
        """Return whether the edit only appends events."""
        return not self.drop and not self.shift


class Stamp(Struct, frozen=True):
    """The time at which a motion begins: `AT seconds` on the timeline, or `IN seconds` from now (`relative`)."""

    seconds: float
    relative: bool = False


# --- requests of programs and of the prompt ---------------------------------------------------------------------


class Move(Struct, frozen=True):
    """A motion: joint-interpolated, or a straight line of the tool tip. `hand`: the opening of the hand during the
    motion (1 open, 0 closed, None: unchanged). `speed`: a fraction in (0, 1] of the nominal speed, which replaces the
    program speed for this motion only (DRIVE). `text`: the instruction as typed, for tables and files."""

    target: Target
    straight: bool
    hand: float | None = None
    speed: float | None = None
    stamp: Stamp | None = None
    text: str = ""


class Delay(Struct, frozen=True):
    """DELAY: remain at rest for `seconds`."""

    seconds: float
    text: str = ""


class Break(Struct, frozen=True):
    """BREAK: wait until the robot is at rest."""


class Brake(Struct, frozen=True):
    """BRAKE: stop the current motion at once, within the limits, and drop all motions after it."""


class OperateHand(Struct, frozen=True):
    """OPENI, CLOSEI, RELAXI (`immediate`): come to rest, operate the hand, and wait HAND.TIME. OPEN, CLOSE, RELAX:
    operate the hand during the next motion. `opening`: 1 open, 0 closed; None: relaxed. `width` [m]: the distance
    between the fingers, for robots with a known hand width. `stamp` (OPENI AT t): operate the hand at that time,
    independently of the arm, and do not wait."""

    opening: float | None
    immediate: bool
    text: str = ""
    width: float | None = None
    stamp: Stamp | None = None


class SetChannels(Struct, frozen=True):
    """Set channels of the timeline, in the order given: pairs (HAND or the number of a signal, value). Without a stamp
    the change takes effect now, and is shifted together with the motions. With a stamp it keeps its own time. `text`:
    the instruction; empty if the change came from outside (a script, a device, a rule of the cell): then UNDO reverts
    it together with the command before it. `observed`: a program has read these values, and nothing changes. `duration`
    [s]: the duration of each event."""

    changes: tuple[tuple[int, float], ...]
    stamp: Stamp | None = None
    text: str = ""
    observed: bool = False
    duration: float = 0.0


class SpeedUnit(Enum):
    PERCENT = "%"
    MMPS = "MMPS"
    IPS = "IPS"


class SetSpeed(Struct, frozen=True):
    """Set the program speed, in percent of nominal, or as tool-tip speed in mm/s or inch/s. It applies only to the next
    motion, unless `always` is set."""

    value: float
    rotation: float | None = None
    unit: SpeedUnit = SpeedUnit.PERCENT
    always: bool = False


class SetMonitorSpeed(Struct, frozen=True):
    """Set the monitor speed [%]."""

    percent: float


class SetDuration(Struct, frozen=True):
    """Set the minimum duration of motions [s]."""

    seconds: float
    always: bool = False


class SetSwivel(Struct, frozen=True):
    """Set the value of a redundant joint at the end of straight lines; None: the planner chooses the value."""

    swivel: Swivel | None
    always: bool = False


class SetAcceleration(Struct, frozen=True):
    """ACCEL: set acceleration and deceleration, in percent of nominal."""

    acceleration: float
    deceleration: float | None = None


class SetConfiguration(Struct, frozen=True):
    """RIGHTY, LEFTY, ABOVE, BELOW, FLIP, NOFLIP: for the next joint-interpolated motion whose target is a
    transformation, set the configuration of the arm at its end."""

    flag: Flag


class Mode(Enum):
    """Settings that can be on or off, for the next motion or permanently."""

    CONTINUOUS_PATH = "CP"
    COARSE = "COARSE"
    NULLING = "NULL"
    SINGLE = "SINGLE"
    OVERLAP = "OVERLAP"
    INTEGRAL = "INT"


class SetMode(Struct, frozen=True):
    """Switch a mode on or off. `tolerance` [%]: the tolerance of COARSE and FINE."""

    mode: Mode
    on: bool
    always: bool = False
    tolerance: float | None = None


class SetTool(Struct, frozen=True):
    """TOOL: set T_flange_tool."""

    T_flange_tool: Transform


class SetBase(Struct, frozen=True):
    """BASE: set T_robot_world, the pose of the world frame in the robot's own frame."""

    T_robot_world: Transform


class SetParameter(Struct, frozen=True):
    """`PARAMETER name = value`; the value is a number or a word (`LSPB`)."""

    name: str
    value: float | str


class SetSwitch(Struct, frozen=True):
    """ENABLE, DISABLE: set a switch."""

    name: str
    on: bool


class AlterMode(Struct, frozen=True):
    """ALTON: the meaning of path displacements. `world`: displacements are along and about the axes of the world,
    otherwise of the tool. `adds`: each displacement is added to the earlier ones."""

    world: bool
    adds: bool


class SetAlter(Struct, frozen=True):
    """ALTON: set how displacements are applied. ALTOFF (None): later motions go to their own targets again."""

    mode: AlterMode | None


class Alter(Struct, frozen=True):
    """ALTER: displace the target of the current motion and of all later ones."""

    displacement: Transform
    text: str = ""


SettingChange = (
    SetSpeed
    | SetMonitorSpeed
    | SetDuration
    | SetSwivel
    | SetAcceleration
    | SetConfiguration
    | SetMode
    | SetParameter
    | SetSwitch
    | SetAlter
)
Request = Move | Alter | Delay | Break | Brake | OperateHand | SetChannels | SetTool | SetBase | SettingChange
