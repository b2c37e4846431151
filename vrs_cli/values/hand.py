"""Moving the arm by hand: the steps of JOG, and the tool dragged in a picture."""

from __future__ import annotations

from enum import Enum

from msgspec import Struct

from vrs_cli.kinematics.model import RobotModel
from vrs_cli.values.results import Position
from vrs_cli.values.tagged import Spoken, UserAct


class Limit(Enum):
    """The kind of limit that keeps the tool from a wish."""

    JOINT = "joint"
    REACH = "reach"
    SINGULARITY = "singularity"
    SPEED = "speed"
    CONTACT = "contact"


class Hold(Struct, frozen=True, omit_defaults=True):
    """One limit. `joint`, counted from 1: at its `end` (`lower`, `upper`), or as fast as it may be. `which`: of the
    reach `far` or `close`, of the singularities `shoulder`, `elbow` or `wrist`; of a contact, what it is.
    """

    limit: Limit
    joint: int = 0
    end: str = ""
    which: str = ""

    def describe(self, model: RobotModel) -> str:
        match self.limit:
            case Limit.JOINT:
                ends = model.lower if self.end == "lower" else model.upper
                return f"JT{self.joint} is at its {self.end} limit, {model.said(self.joint, ends[self.joint - 1], 1)}"
            case Limit.REACH:
                return {"far": "out of reach: too far", "close": "out of reach: too close"}.get(
                    self.which, "out of reach"
                )
            case Limit.SINGULARITY:
                hurried = f": JT{self.joint} is as fast as it may be" if self.joint else ""
                return f"near the {self.which} singularity{hurried}"
            case Limit.CONTACT:
                return f"it stops before a contact: {self.which}"
            case Limit.SPEED:
                return f"JT{self.joint} is as fast as it may be"


class Shortfall(Spoken, frozen=True, omit_defaults=True):
    """The distance of a tool from a wish [m, rad], and the limits that hold it; no holds where it is there."""

    away: float = 0.0
    turned: float = 0.0
    holds: tuple[Hold, ...] = ()


class DragState(Struct, frozen=True, omit_defaults=True):
    """The user who drags the tool, empty for nobody, and how it follows; `why` it was let go, where that was not by who
    dragged it. `issued`: when the newest wish was given that the robot goes after, or passes over, as its sender says
    [s].
    """

    by: str = ""
    held: Shortfall = Shortfall()
    why: str = ""
    issued: float | None = None


class Frame(Enum):
    """The axes of a jog: the value is its name on the screen."""

    JOINT = "joints"
    WORLD = "world"
    TOOL = "tool"


class Axis(Struct, frozen=True):
    """`index` counts from 0: joints, or X, Y, Z and the rotations about them."""

    frame: Frame
    index: int

    @property
    def name(self) -> str:
        if self.frame is Frame.JOINT:
            return str(self.index + 1)
        return ("T" if self.frame is Frame.TOOL else "") + CARTESIAN[self.index]

    @property
    def turns(self) -> bool:
        """Return whether a step along it is an angle of the tool."""
        return self.frame is not Frame.JOINT and self.index >= 3


CARTESIAN = ("X", "Y", "Z", "RX", "RY", "RZ")


class Seen(Spoken, frozen=True):
    """The arm and its clock; `end`: when it comes to rest [s]. `said`: what there is to say of the last step."""

    position: Position
    end: float
    paused: bool = False
    said: str = ""


class Press(UserAct[Seen], frozen=True):
    """A key: a step of so much [mm, deg] along an axis, with `speed` [%]."""

    axis: Axis
    amount: float
    speed: float


class StopJog(UserAct[Seen], frozen=True, tag="Brake"):
    """Stop now."""


class Look(UserAct[Seen], frozen=True):
    """Return where the arm is."""
