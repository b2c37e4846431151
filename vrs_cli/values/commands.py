"""The waist between language and engine: what is asked of the robot, as pure data.

The language yields these; it knows no clock. The engine makes a `Motion` of each `Move`, with its issue and execution
times, and gives it to the planner f. Metres, radians, seconds.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.kinematics.joints import Flag, Joints, Profile
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


HAND = 0  # the channel of the hand; those of outputs are 1 to 512
FIRST_INPUT = 1001  # the channels of inputs are 1001 to 1512


class Event(NamedTuple):
    """A channel takes a value.

    `time` [s]: on the time grid. `channel`: HAND (its value is from 0, closed, to 1, open), or the number of a signal
    (0 or 1). `number`: of the command that caused the event, as `Motion.number`. `tied`: after an edit the event
    follows its motion; otherwise it keeps its own time. `duration` [s]: how long the fingers take; they arrive at
    `time + duration`. `observed`: nothing changes; a program read this value at that time.
    """

    time: float
    channel: int
    value: float
    number: int = 0
    tied: bool = False
    duration: float = 0.0
    observed: bool = False

    def shift_by(self, shift: float) -> Event:
        """Return the event so many seconds later."""
        return self._replace(time=self.time + shift) if shift else self


class EventEdit(NamedTuple):
    """The events' part of a timeline delta.

    The first `keep` events stay and the next `drop` go. `events` come in their place. All events after them are
    shifted by `shift` [s].
    """

    keep: int
    drop: int = 0
    shift: float = 0.0
    events: tuple[Event, ...] = ()

    @property
    def adds(self) -> bool:
        """Return whether all events of before stay as they are."""
        return not self.drop and not self.shift


class Stamp(Struct, frozen=True):
    """When a motion is executed: `AT seconds` on the timeline, or `IN seconds` from now (`relative`)."""

    seconds: float
    relative: bool = False


# --- targets: where a motion goes ------------------------------------------------------------------------------


# --- what programs and the prompt ask for ----------------------------------------------------------------------


class Move(Struct, frozen=True):
    """A motion: joint-interpolated, or a straight line of the tool tip.

    `hand`: opening during the motion (1 open, 0 closed, None as it is). `speed`: fraction in (0, 1] that replaces the
    program speed for this motion alone (DRIVE). `text`: the instruction as typed, for tables and files.
    """

    target: Target
    straight: bool
    hand: float | None = None
    speed: float | None = None
    stamp: Stamp | None = None
    text: str = ""


class Delay(Struct, frozen=True):
    """DELAY: a null motion of so many seconds."""

    seconds: float
    text: str = ""


class Break(Struct, frozen=True):
    """Wait until the robot has come to rest."""


class Brake(Struct, frozen=True):
    """Stop the present motion at once, within limits, and drop what was scheduled after it."""


class OperateHand(Struct, frozen=True):
    """OPENI, CLOSEI, RELAXI (`immediate`): break, operate, wait HAND.TIME. OPEN, CLOSE, RELAX: during the next motion.

    `opening`: 1 open, 0 closed; None relaxed. `width` [m]: how far apart the fingers are to be, for a robot of which
    that is known. `stamp` (OPENI AT t): the hand operates then, whatever the arm does; nobody waits.
    """

    opening: float | None
    immediate: bool
    text: str = ""
    width: float | None = None
    stamp: Stamp | None = None


class SetChannels(Struct, frozen=True):
    """Channels of the timeline take values, in this order: (HAND or the number of a signal, value).

    Without a stamp: now, tied to the motions there. With a stamp: at its own time. `text`: the instruction as typed;
    without a text the change came from outside (a script, a device, a rule of the cell), and UNDO takes it along with
    the command before it. `observed`: nothing changes; a program has read these values. `duration`: of the
    events [s].
    """

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
    """Program speed: percent of nominal, or tool-tip speed in mm/s or inch/s; for the next motion unless `always`."""

    value: float
    rotation: float | None = None
    unit: SpeedUnit = SpeedUnit.PERCENT
    always: bool = False


class SetMonitorSpeed(Struct, frozen=True):
    percent: float


class SetDuration(Struct, frozen=True):
    """Minimum time of motions [s]."""

    seconds: float
    always: bool = False


class SetSwivel(Struct, frozen=True):
    """Where a joint is at the end of straight lines, of an arm with a joint too many; None: as suits the line."""

    swivel: Swivel | None
    always: bool = False


class SetAcceleration(Struct, frozen=True):
    """ACCEL: percent of nominal acceleration and deceleration."""

    acceleration: float
    deceleration: float | None = None


class SetConfiguration(Struct, frozen=True):
    """RIGHTY, LEFTY, ABOVE, BELOW, FLIP, NOFLIP: asked of the next joint-interpolated motion to a transformation."""

    flag: Flag


class Mode(Enum):
    """Settings that are on or off for the next motion, or always."""

    CONTINUOUS_PATH = "CP"
    COARSE = "COARSE"
    NULLING = "NULL"
    SINGLE = "SINGLE"
    OVERLAP = "OVERLAP"
    INTEGRAL = "INT"


class SetMode(Struct, frozen=True):
    mode: Mode
    on: bool
    always: bool = False
    tolerance: float | None = None


class SetTool(Struct, frozen=True):
    """T_flange_tool."""

    T_flange_tool: Transform


class SetBase(Struct, frozen=True):
    """The world frame seen from the robot's own: T_robot_world."""

    T_robot_world: Transform


class SetParameter(Struct, frozen=True):
    """`PARAMETER name = value`; the value is a number or a word (`LSPB`)."""

    name: str
    value: float | str


class SetSwitch(Struct, frozen=True):
    name: str
    on: bool


class AlterMode(Struct, frozen=True):
    """ALTON: how displacements of the path are meant. `world`: along and about its axes, else those of the tool;
    `adds`: each is added to those before it.
    """

    world: bool
    adds: bool


class SetAlter(Struct, frozen=True):
    """ALTON, and (None) ALTOFF: what comes then goes where it says again."""

    mode: AlterMode | None


class Alter(Struct, frozen=True):
    """ALTER: from now on the motion under way goes to a place that is displaced, and so does every one that comes."""

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
