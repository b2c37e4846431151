"""Define the kinds of checks, one frozen struct each. Lengths are in mm, angles in degrees, times in seconds, as in
checks.toml."""

from __future__ import annotations

from enum import Enum

from msgspec import Struct

from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.transform import Vector
from vrs_cli.language.run.variables import Item
from vrs_cli.teach.exercise_text import BaseCheck, ModelPlace, Place
from vrs_cli.trajectory.instant import LATEST
from vrs_cli.trajectory.segment import Phase
from vrs_cli.values.commands import MotionKind
from vrs_cli.values.diagnostics import Dialect

NO_OFFSET: Vector = (0.0, 0.0, 0.0)
Pair = tuple[str, str]  # names of two objects that may touch each other


# --- where things are at the end -------------------------------------------------------------------------------------


class ToolAtCheck(BaseCheck, frozen=True, tag="tool_at"):
    """A check that the tool's tip ends at `at`, shifted by `offset` [m]. If `deg` is None, any orientation passes."""

    at: Place
    mm: float
    deg: float | None = None
    offset: Vector = NO_OFFSET


class PartAtCheck(BaseCheck, frozen=True, tag="part_at"):
    """A check that a part ends with its centre at `at`, shifted by `offset` [m]. If `deg` is None, any orientation
    passes."""

    part: str
    at: Place
    mm: float
    deg: float | None = None
    offset: Vector = NO_OFFSET


class HeldCheck(BaseCheck, frozen=True, tag="held"):
    """A check that the hand holds `part` at the end; "": that it holds nothing."""

    part: str = ""


# --- the path of the tool --------------------------------------------------------------------------------------------


class PlacesCheck(BaseCheck, frozen=True, tag="places"):
    """A check that the tool's tip passes these places in this order, each within the tolerance `mm`."""

    places: tuple[Place, ...]
    mm: float


class PathCheck(BaseCheck, frozen=True, tag="path"):
    """A check that the tip moves from one place to another on a straight line or, with `via`, on the arc through `via`.

    `deg`: maximum rotation of the tool from the orientation of the first place; None: any orientation.
    """

    begin: Place
    end: Place
    mm: float
    via: Place | None = None
    deg: float | None = None


class NoStopCheck(BaseCheck, frozen=True, tag="no_stop"):
    """A check that the arm moves from one place to another, both passed within `mm`, without a stop between them."""

    begin: Place
    end: Place
    mm: float


class KeepOutCheck(BaseCheck, frozen=True, tag="keep_out"):
    """A check that the tool's tip does not enter a box around `at` with edges of `size` [m]."""

    at: Place
    size: Vector


class ContactCheck(BaseCheck, frozen=True, tag="contact"):
    """A check that nothing in the cell touches anything else. `allow`: pairs of bodies that may touch."""

    allow: tuple[Pair, ...] = ()


class ClearanceCheck(BaseCheck, frozen=True, tag="clearance"):
    """A check that the arm (with the part that it holds) keeps a distance of at least `mm` from everything else.
    `allow`: pairs of bodies that may be closer."""

    mm: float
    allow: tuple[Pair, ...] = ()


class StretchCheck(BaseCheck, frozen=True):
    """A check that judges only a part (stretch) of the run: while the tip is within `radius` mm of `around`, while it
    moves from `begin` to `end`, or while the hand holds a part."""

    around: Place | None = None
    radius: float = 0.0
    begin: Place | None = None
    end: Place | None = None
    holding: str = ""


class SpeedCheck(StretchCheck, frozen=True, tag="speed", kw_only=True):
    """A check that the speed of the tip never exceeds `mm_s`."""

    mm_s: float


class AccelerationCheck(StretchCheck, frozen=True, tag="acceleration", kw_only=True):
    """A check that the acceleration of the tip never exceeds `mm_s2`."""

    mm_s2: float


class LikeModelCheck(BaseCheck, frozen=True, tag="like_model"):
    """A check that the tip follows the path of the model solution. `times`: it must also be at the same positions at
    the same times, with the same orientation within `deg`."""

    mm: float
    deg: float | None = None
    times: bool = False

    @property
    def needs_model(self) -> bool:
        """Return True, because the check compares the whole run with the run of the model solution."""
        return True


# --- times, signals, texts -------------------------------------------------------------------------------------------


class CycleTimeCheck(BaseCheck, frozen=True, tag="cycle_time"):
    """A check that the run, or the motion from `begin` to `end`, takes at least `least` and at most `most` seconds."""

    most: float
    least: float = 0.0
    begin: Place | None = None
    end: Place | None = None


class SignalChange(Struct, frozen=True):
    """A required change of an output: on, or off if the number is negative.

    It must occur between `after` and `before` [s], counted from the start of the run or from the time when the input
    `since` first turned on. `near`: the tip must be within `mm` of this place.
    """

    signal: int
    after: float = 0.0
    before: float = LATEST
    since: int | None = None
    near: Place | None = None
    mm: float = 0.0


class SignalsCheck(BaseCheck, frozen=True, tag="signals"):
    """A check that outputs change in this order. `only`: these outputs must not change at other times."""

    changes: tuple[SignalChange, ...]
    only: bool = False


class TypedText(Struct, frozen=True):
    """A line that TYPE must show: a string or a pattern, typed between `after` and `before` [s]."""

    text: str
    pattern: bool = False
    after: float = 0.0
    before: float = LATEST


class TypedCheck(BaseCheck, frozen=True, tag="typed"):
    """A check that TYPE shows these lines in this order. A single ModelPlace means the lines that the model solution
    types. `only`: the program may type no other lines."""

    lines: tuple[TypedText | ModelPlace, ...]
    only: bool = False


class WordsCheck(BaseCheck, frozen=True, tag="words"):
    """A check that the submission uses certain words, and does not use certain other words."""

    use: tuple[str, ...] = ()
    avoid: tuple[str, ...] = ()


class DialectCheck(BaseCheck, frozen=True, tag="dialect"):
    """A check that the submission uses only words of a dialect."""

    dialect: Dialect


class NoErrorCheck(BaseCheck, frozen=True, tag="no_error"):
    """A check that the program ends without an error."""


# --- the state of the robot ---------------------------------------------------------------------------------------


class When(Enum):
    """The time at which joints are checked: the end of the run, or the end of any motion in the step of a lesson."""

    END = "end"
    PASSED = "passed"


class ValueRange(Struct, frozen=True):
    """Values from `least` to `most`."""

    least: float
    most: float


class Named(Struct, frozen=True):
    """A variable, or the items of a compound location. `text`: the name as written."""

    text: str
    items: tuple[Item, ...]


class JointsCheck(BaseCheck, frozen=True, tag="joints"):
    """A check of the joints [deg, mm]; None: any value passes. `time`: check them at this time [s] instead of `when`.
    `count`: the minimum number of motions that must end with these values."""

    at: tuple[float | None, ...]
    deg: float
    when: When = When.END
    time: float | None = None
    count: int = 1


class VariableCheck(BaseCheck, frozen=True, tag="variable"):
    """A check of the value of a real or string variable. `within`: maximum error of a real."""

    of: Named
    value: float | str
    within: float


class LocationCheck(BaseCheck, frozen=True, tag="location"):
    """A check of the value of a location, or of a compound such as `table:corner`. If `deg` is None, any orientation
    passes."""

    of: Named
    at: Place
    mm: float
    deg: float | None = None


class ConfigurationCheck(BaseCheck, frozen=True, tag="configuration"):
    """A check of the words that describe the arm's configuration at the end."""

    words: tuple[str, ...]


class SettingCheck(BaseCheck, frozen=True, tag="setting"):
    """A check that a switch is ON or OFF, or that a parameter has a value."""

    of: str
    value: float | str


class MotionCheck(BaseCheck, frozen=True, tag="motion"):
    """A check that one motion in the step of a lesson has all given properties. `last`: only the motion commanded last
    counts.

    `seconds`: its duration. `mm`: the distance between its ends. `joints`: the minimum number of joints that turn.
    `begins`: its start [s]. `lead`: the minimum time from its command to its start [s]. `displaced`: whether it starts
    at another time than requested.
    """

    last: bool = False
    space: MotionKind | None = None
    profile: Profile | None = None
    seconds: ValueRange | None = None
    mm: ValueRange | None = None
    joints: int = 0
    begins: float | None = None
    lead: float = 0.0
    displaced: bool | None = None


class PhasesCheck(BaseCheck, frozen=True, tag="phases"):
    """A check that consecutive segments of the timeline have these phases. `only`: there must be no other phases."""

    order: tuple[Phase, ...]
    only: bool = False


class PassesCheck(BaseCheck, frozen=True, tag="passes"):
    """A check of the smallest distance between the tool and a place during the step of a lesson."""

    at: Place
    mm: ValueRange


class UndoneCheck(BaseCheck, frozen=True, tag="undone"):
    """A check of the minimum number of undone commands, which REDO would repeat."""

    commands: int


class ProgramCheck(BaseCheck, frozen=True, tag="program"):
    """A check that a program is in memory."""

    of: str


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
    | JointsCheck
    | VariableCheck
    | LocationCheck
    | ConfigurationCheck
    | SettingCheck
    | MotionCheck
    | PhasesCheck
    | PassesCheck
    | UndoneCheck
    | ProgramCheck
)
