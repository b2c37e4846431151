"""The kinds of checks, one frozen value each. Lengths in mm, angles in degrees, times in seconds, as in checks.toml."""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.kinematics.transform import Vector
from vrs_cli.teach.exercise_text import BaseCheck, ModelPlace, Place
from vrs_cli.teach.state_checks import StateCheck
from vrs_cli.trajectory.instant import LATEST
from vrs_cli.values.diagnostics import Dialect

NO_OFFSET: Vector = (0.0, 0.0, 0.0)
Pair = tuple[str, str]  # the names of two things that may touch


# --- where things are at the end -------------------------------------------------------------------------------------


class ToolAtCheck(BaseCheck, frozen=True, tag="tool_at"):
    """Asks that the tool's tip is at the end at `at`, moved by `offset` [m]. `deg` None: any orientation."""

    at: Place
    mm: float
    deg: float | None = None
    offset: Vector = NO_OFFSET


class PartAtCheck(BaseCheck, frozen=True, tag="part_at"):
    """Asks that a part is at the end with its centre at `at`, moved by `offset` [m]. `deg` None: any orientation."""

    part: str
    at: Place
    mm: float
    deg: float | None = None
    offset: Vector = NO_OFFSET


class HeldCheck(BaseCheck, frozen=True, tag="held"):
    """Asks what the hand holds at the end; "": nothing."""

    part: str = ""


# --- the way of the tool ---------------------------------------------------------------------------------------------


class PlacesCheck(BaseCheck, frozen=True, tag="places"):
    """Places that the tool's tip passes, in this order, each no farther than `mm`."""

    places: tuple[Place, ...]
    mm: float


class PathCheck(BaseCheck, frozen=True, tag="path"):
    """The tip goes along the straight line from one place to another, or (`via`) along the arc through a third.
    `deg`: how far the tool may be turned from the orientation of the first place; None: any orientation.
    """

    begin: Place
    end: Place
    mm: float
    via: Place | None = None
    deg: float | None = None


class NoStopCheck(BaseCheck, frozen=True, tag="no_stop"):
    """The arm goes from one place to another, each passed no farther than `mm`, and stops nowhere between them."""

    begin: Place
    end: Place
    mm: float


class KeepOutCheck(BaseCheck, frozen=True, tag="keep_out"):
    """A box about `at`, with these whole sizes [m], that the tool's tip does not enter."""

    at: Place
    size: Vector


class ContactCheck(BaseCheck, frozen=True, tag="contact"):
    """Nothing touches that should not. `allow`: pairs that may."""

    allow: tuple[Pair, ...] = ()


class ClearanceCheck(BaseCheck, frozen=True, tag="clearance"):
    """Nothing comes nearer to the arm and what it holds than `mm`. `allow`: pairs that may."""

    mm: float
    allow: tuple[Pair, ...] = ()


class StretchCheck(BaseCheck, frozen=True):
    """Holds only within `radius` mm of `around`, only on the way from `begin` to `end`, or only while the hand holds a
    part, where these are given.
    """

    around: Place | None = None
    radius: float = 0.0
    begin: Place | None = None
    end: Place | None = None
    holding: str = ""


class SpeedCheck(StretchCheck, frozen=True, tag="speed", kw_only=True):
    """The tip is nowhere faster than `mm_s`."""

    mm_s: float


class AccelerationCheck(StretchCheck, frozen=True, tag="acceleration", kw_only=True):
    """The acceleration of the tip is nowhere more than `mm_s2`."""

    mm_s2: float


class LikeModelCheck(BaseCheck, frozen=True, tag="like_model"):
    """The tip goes where it goes in the model's run; `times`: at the same times, and turned like there (`deg`)."""

    mm: float
    deg: float | None = None
    times: bool = False

    @property
    def needs_model(self) -> bool:
        """Return True: the whole run is compared."""
        return True


# --- times, signals, texts -------------------------------------------------------------------------------------------


class CycleTimeCheck(BaseCheck, frozen=True, tag="cycle_time"):
    """The run, or the way from `begin` to `end`, lasts at most `most` seconds, and at least `least`."""

    most: float
    least: float = 0.0
    begin: Place | None = None
    end: Place | None = None


class SignalChange(Struct, frozen=True):
    """An output that comes on (negative: goes off), between the times `after` and `before` [s] of the run, or since the
    input `since` comes on for the first time; and with the tip within `mm` of `near`, where that is given.
    """

    signal: int
    after: float = 0.0
    before: float = LATEST
    since: int | None = None
    near: Place | None = None
    mm: float = 0.0


class SignalsCheck(BaseCheck, frozen=True, tag="signals"):
    """Changes of outputs, in this order. `only`: these outputs change at no other time."""

    changes: tuple[SignalChange, ...]
    only: bool = False


class TypedText(Struct, frozen=True):
    """A line of TYPE that is wanted: the text, or a pattern. It comes between the times `after` and `before` [s]."""

    text: str
    pattern: bool = False
    after: float = 0.0
    before: float = LATEST


class TypedCheck(BaseCheck, frozen=True, tag="typed"):
    """Lines that TYPE writes, in this order; those of the model's run where a ModelPlace stands alone. `only`: and no
    others.
    """

    lines: tuple[TypedText | ModelPlace, ...]
    only: bool = False


class WordsCheck(BaseCheck, frozen=True, tag="words"):
    """Words that the submission must use, and words that it must not use."""

    use: tuple[str, ...] = ()
    avoid: tuple[str, ...] = ()


class DialectCheck(BaseCheck, frozen=True, tag="dialect"):
    """The submission uses nothing that a dialect does not have."""

    dialect: Dialect


class NoErrorCheck(BaseCheck, frozen=True, tag="no_error"):
    """The program ends without an error."""


AnyCheck = (
    ToolAtCheck
    | PartAtCheck
    | HeldCheck
    | PlacesCheck
    | PathCheck
    | NoStopCheck
    | KeepOutCheck
    | ContactCheck
    | ClearanceCheck
    | SpeedCheck
    | AccelerationCheck
    | LikeModelCheck
    | CycleTimeCheck
    | SignalsCheck
    | TypedCheck
    | WordsCheck
    | DialectCheck
    | NoErrorCheck
    | StateCheck
)
