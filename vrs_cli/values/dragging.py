"""Define the values for dragging the tool in a picture: who drags it, and what keeps it from its target."""

from __future__ import annotations

from enum import Enum

from msgspec import Struct

from vrs_cli.kinematics.model import RobotModel
from vrs_cli.values.results import TaggedValue


class Limit(Enum):
    """The kind of limit that stops the tool before the requested pose."""

    JOINT = "joint"
    REACH = "reach"
    SINGULARITY = "singularity"
    SPEED = "speed"
    CONTACT = "contact"


class Hold(Struct, frozen=True, omit_defaults=True):
    """A limit that keeps the tool from its target. `joint`, counted from 1: the joint that is at its `end` (`lower`,
    `upper`), or at its maximum speed. `which`: `far` or `close` (out of reach), `shoulder`, `elbow` or `wrist`
    (singularity), or the names of the two objects that would touch (contact)."""

    limit: Limit
    joint: int = 0
    end: str = ""
    which: str = ""

    def describe(self, model: RobotModel) -> str:
        """Describe the limit in words."""
        match self.limit:
            case Limit.JOINT:
                ends = model.lower if self.end == "lower" else model.upper
                limit = model.joint_text(self.joint, ends[self.joint - 1], 1)
                return f"JT{self.joint} is at its {self.end} limit, {limit}"
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


class Shortfall(TaggedValue, frozen=True, omit_defaults=True):
    """The remaining distance of the tool from the requested pose [m, rad], and the limits that cause it. There are no
    limits once the tool has arrived."""

    away: float = 0.0
    turned: float = 0.0
    holds: tuple[Hold, ...] = ()


class DragState(Struct, frozen=True, omit_defaults=True):
    """The user who drags the tool (empty: nobody). `held`: the tool's remaining distance from the dragged pose. `why`:
    the reason if the robot ended the drag. `issued` [s]: when the user sent the newest pose that the robot has followed
    or skipped."""

    by: str = ""
    held: Shortfall = Shortfall()
    why: str = ""
    issued: float | None = None
