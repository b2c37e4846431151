"""The waist between language and engine: what is asked of the robot, as pure data.

The language yields these; it knows no clock. The engine makes a `Motion` of each `Move`, with its issue and execution
times, and gives it to the planner f. Metres, radians, seconds.
"""

from __future__ import annotations

from enum import Enum

from msgspec import Struct

from vrs_cli.kinematics.joints import Flag
from vrs_cli.kinematics.transform import Transform
from vrs_cli.values.motion import Swivel, Target


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
