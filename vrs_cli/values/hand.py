"""Define the values for moving the arm manually by JOG."""

from __future__ import annotations

from enum import Enum

from msgspec import Struct

from vrs_cli.values.results import Position, TaggedValue, UserAct


class Frame(Enum):
    """The frame whose axes a jog uses; the value is its name on the screen."""

    JOINT = "joints"
    WORLD = "world"
    TOOL = "tool"


class Axis(Struct, frozen=True):
    """An axis of a jog. `index` counts from 0: the joints, or X, Y, Z and the rotations about them."""

    frame: Frame
    index: int

    @property
    def name(self) -> str:
        of_tool = "T" if self.frame is Frame.TOOL else ""
        return str(self.index + 1) if self.frame is Frame.JOINT else f"{of_tool}{CARTESIAN[self.index]}"

    @property
    def turns(self) -> bool:
        """Return whether a step along this axis rotates the tool."""
        return self.frame is not Frame.JOINT and self.index >= 3


CARTESIAN = ("X", "Y", "Z", "RX", "RY", "RZ")


class Seen(TaggedValue, frozen=True):
    """The state of the arm and the clock. `end` [s]: when the arm comes to rest. `said`: messages about the last
    step."""

    position: Position
    end: float
    paused: bool = False
    said: str = ""


class Press(UserAct[Seen], frozen=True):
    """Move `amount` [mm, deg] along an axis at `speed` [%], like a pressed key of JOG."""

    axis: Axis
    amount: float
    speed: float


class StopJog(UserAct[Seen], frozen=True, tag="Brake"):
    """Stop the arm now."""


class Look(UserAct[Seen], frozen=True):
    """Return the state of the arm."""
