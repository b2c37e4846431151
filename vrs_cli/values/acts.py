"""Define acts: requests to a robot as structs instead of lines of text. The numbers of an act are exact, while a typed
line has rounded decimals. Acts can be sent over a connection; `interfaces/session/acts.py` executes them."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.errors import IllegalValue
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, Vector, is_rotation
from vrs_cli.values import commands, replies
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.dragging import Shortfall
from vrs_cli.values.numbers import LIMIT, Value
from vrs_cli.values.results import (
    CommandRecord,
    FollowReport,
    ResyncReport,
    RobotAct,
    RunResult,
    TaggedValue,
    Untrue,
    UserAct,
)


class Goal(Struct, frozen=True, omit_defaults=True):
    """The target of a motion. Exactly one field is set, except that `joint` (from 1) needs its `change` [rad, m].
    `offset`: the target of DEPART, in the tool frame."""

    pose: Transform | None = None
    joints: Joints | None = None
    named: str | None = None
    joint: int | None = None
    change: float = 0.0
    offset: Transform | None = None
    aligned: bool = False

    @classmethod
    def of(cls, target: commands.Target) -> Goal:
        match target:
            case commands.PoseTarget():
                return cls(pose=target.T_world_tool)
            case commands.JointTarget():
                return cls(joints=target.joints)
            case commands.NamedTarget():
                return cls(named=target.name)
            case commands.JointOffsetTarget():
                return cls(joint=target.joint, change=target.change)
            case commands.ToolOffsetTarget():
                return cls(offset=target.T_destination_target)
            case commands.AlignedTarget():
                return cls(aligned=True)

    @property
    def target(self) -> commands.Target:
        """Return the target. Raises IllegalValue if no field is set, or if the pose is not a valid location."""
        if self.pose is not None:
            return commands.PoseTarget(check_rotation(self.pose))
        if self.joints is not None:
            return commands.JointTarget(_finite(self.joints))
        if self.named is not None:
            return commands.NamedTarget(self.named)
        if self.joint is not None:
            return commands.JointOffsetTarget(self.joint, *_finite((self.change,)))
        if self.offset is not None:
            return commands.ToolOffsetTarget(check_rotation(self.offset))
        if self.aligned:
            return commands.AlignedTarget()
        raise IllegalValue("a motion to nowhere", "a pose, joints, or the name of a pose")


class Valued(TaggedValue, frozen=True, omit_defaults=True):
    """The value of a variable or an expression; exactly one field is set."""

    real: float | None = None
    text: str | None = None
    location: Transform | None = None
    joints: Joints | None = None

    @classmethod
    def of(cls, value: Value) -> Valued:
        if isinstance(value, Transform):
            return cls(location=value)
        if isinstance(value, tuple):
            return cls(joints=value)
        return cls(text=value) if isinstance(value, str) else cls(real=value)

    @property
    def value(self) -> Value:
        """Return the value. Raises IllegalValue if no field is set, or if a number is not finite."""
        if self.location is not None:
            return check_rotation(self.location)
        if self.joints is not None:
            return _finite(self.joints)
        if self.text is not None:
            return self.text
        if self.real is not None:
            return _finite((self.real,))[0]
        raise IllegalValue("no value at all", "a number, a text, a location or joints")


def _finite(numbers: Joints) -> Joints:
    """Return the numbers unchanged. Raises IllegalValue if one of them is not finite."""
    for number in numbers:
        if not isfinite(number):
            raise IllegalValue(f"{number}", "a finite number")
    return numbers


def check_rotation(T: Transform) -> Transform:
    """Return a transformation unchanged. Raises IllegalValue if its axes do not form a rotation, or if a number is
    outside the range of reals."""
    if max(map(abs, _finite(T))) > LIMIT:
        raise IllegalValue("a location beyond all numbers", "reals go to about 3E38")
    if not is_rotation((T[0:3], T[4:7], T[8:11])):
        raise IllegalValue("a location whose axes are not at right angles, or not of length 1")
    return T


class Say(RobotAct[None], frozen=True):
    """Execute a line as if it were typed at the prompt. If the line is refused, raises its error."""

    line: str


class Go(RobotAct[None], frozen=True, omit_defaults=True):
    """Move to `goal`, beginning at time `executed` [s] (None: after the last motion). `speed`: fraction of the nominal
    speed."""

    goal: Goal
    straight: bool = False
    executed: float | None = None
    speed: float | None = None
    text: str = ""


class FollowChunk(RobotAct[FollowReport], frozen=True, omit_defaults=True):
    """Follow time-stamped joint positions: `times` [s] in increasing order, and the `joints` [rad, m] at each time.
    They replace all motions after the first time stamp. `speed`: fraction of the nominal speed."""

    times: tuple[float, ...]
    joints: tuple[Joints, ...]
    speed: float | None = None


class Steer(RobotAct[None], frozen=True, omit_defaults=True):
    """Follow one target of a stream: `joints` [rad, m], which move at `velocity` [rad/s, m/s] for `lasting` [s] or
    until the next target arrives. Without `velocity`, as in the first and the last target of a stream, come to rest at
    `joints`. Drop scheduled motions. `speed`: fraction of the nominal speed."""

    joints: Joints
    velocity: Joints | None = None
    lasting: float = 0.0
    speed: float | None = None


class DragTool(RobotAct[Shortfall], frozen=True, omit_defaults=True):
    """Drag the tool towards `pose` (T_world_tool), as far as the arm can follow. If there is no pose, end the drag."""

    pose: Transform | None = None


class ResyncBody(RobotAct[ResyncReport], frozen=True, omit_defaults=True):
    """Resynchronise the timeline with the measured robot. `stops`: drop the scheduled motions."""

    stops: bool = False


class Rest(RobotAct[None], frozen=True):
    """In virtual time: advance the clock until the robot is at rest."""


class Undo(RobotAct[None], frozen=True):
    """Undo the last `count` commands."""

    count: int = 1


class Redo(RobotAct[None], frozen=True):
    """Redo the last `count` undone commands."""

    count: int = 1


class Explain(RobotAct[replies.ReachReport], frozen=True):
    """WHY: explain whether a goal can be reached. `name`: the name of the goal in the report."""

    goal: Goal
    name: str


class Compare(RobotAct[replies.ComparisonTable], frozen=True):
    """Compare two branches by name."""

    a: str
    b: str


class Evaluate(RobotAct[Valued], frozen=True):
    """Evaluate an expression."""

    expression: str


class Assign(RobotAct[None], frozen=True):
    """Assign a value to a variable or an element of an array."""

    variable: str
    value: Valued


class Defined(TaggedValue, frozen=True):
    """The names of the programs that Define stored in memory."""

    names: tuple[str, ...]


class Define(RobotAct[Defined], frozen=True):
    """Store in memory the programs and variables of `text`, the contents of a program file. `where`: the words before
    the line number in error messages."""

    text: str
    where: str = "line "


class Execute(RobotAct[RunResult], frozen=True):
    """Run a program from memory until it ends."""

    program: str
    cycles: int = 1


class CommandList(TaggedValue, frozen=True):
    """The motion commands that are in effect (not undone)."""

    commands: tuple[CommandRecord, ...]


class ListCommands(RobotAct[CommandList], frozen=True):
    """List all motion commands that are in effect (not undone)."""


class ListBranches(RobotAct[replies.BranchTable], frozen=True):
    """List all branches, main first."""


class ListMotions(RobotAct[replies.TimelineTable], frozen=True):
    """Return the timeline as a table."""


class LookAtParts(RobotAct[replies.PartTable], frozen=True):
    """PARTS: list the parts of the cell at a time [s]; None: now."""

    time: float | None = None


class Recorded(TaggedValue, frozen=True):
    """The bytes of a trajectory file."""

    data: bytes


class Record(RobotAct[Recorded], frozen=True):
    """Return the trajectory as the file that SAVE would write."""


class PartialList(Struct, frozen=True):
    """A list, or its first rows; `more`: the number of rows left out."""

    more: int = 0


class LocationList(PartialList, frozen=True, kw_only=True):
    """The result of LISTL: transformations, then precision points, each group sorted by name."""

    rows: tuple[replies.NamedLocation, ...]


class ProgramList(PartialList, frozen=True, kw_only=True):
    """The programs that DIRECTORY lists."""

    rows: tuple[replies.ProgramName, ...]


class TaskRow(Struct, frozen=True):
    """A task that runs or has stopped: its `program` and `step` (from 1; None at the end), its `state` in the words of
    STATUS, and the question that it `asks`."""

    number: int
    program: str
    state: str
    step: int | None
    running: bool
    asks: str = ""


class BranchSeen(Struct, frozen=True):
    """A branch, and the version of its timeline."""

    row: replies.BranchRow
    version: int


MAX_UNTRUE = 3  # maximum number of outdated signal readings in one Surveyed


class Surveyed(TaggedValue, frozen=True):
    """The state of a robot. A list is None if the client already has its latest version. `marks`: version marks of both
    lists and of the requested program. A mark changes whenever the list or program is stored again; it is empty for an
    unknown program. `on`: the signals that are on. `base`: T_robot_world, the frame of the locations; `tool`:
    T_flange_tool [m]. `driver`: the holder of the lease, empty if nobody holds it. `untrue`: the first MAX_UNTRUE
    signal readings that no longer hold. `breakpoints`: the steps of the requested program before which it stops."""

    places: LocationList | None
    programs: ProgramList | None
    marks: tuple[str, ...]
    tasks: tuple[TaskRow, ...]
    branches: tuple[BranchSeen, ...]
    on: tuple[int, ...]
    base: Transform
    tool: Transform
    monitor_speed: float
    speed: float
    speed_unit: str
    driver: str = ""
    untrue: tuple[Untrue, ...] = ()
    breakpoints: tuple[int, ...] = ()


class Survey(RobotAct[Surveyed], frozen=True, omit_defaults=True):
    """Return the state of the robot. `program`: the program whose mark and breakpoints are requested; empty if no
    program is requested. `known`: marks of the lists that the client already has."""

    program: str = ""
    known: tuple[str, ...] = ()


class ProgramSource(TaggedValue, frozen=True):
    """A program as SEE shows it: `text` is the `.PROGRAM` line and one line for each step, without `.END`."""

    name: str
    text: str


class LookAtProgram(RobotAct[ProgramSource], frozen=True):
    """Return the text of a program in memory."""

    program: str


class RecordProgram(RobotAct[Defined], frozen=True):
    """Make a program that moves the tool along its recorded path from `begin` to `end` [s], within 2 mm and 1 degree,
    and store it in memory."""

    name: str
    begin: float
    end: float


# --- pictures ---------------------------------------------------------------------------------------------------------

Line = tuple[Vector, Vector]


class SketchBall(NamedTuple):
    """A ball in a sketch, at a point in the world [m]. `mood`: `good` at a goal within reach, `stop` where the tool
    stops, `bad` at a contact."""

    name: str
    place: Vector
    mood: str


class Sketch(TaggedValue, frozen=True, omit_defaults=True):
    """A picture of an explanation, in the world [m]: paths that can be `followed`, paths that are `refused`, balls, the
    frames of a chain of transformations, and a label at a point."""

    text: str
    at: Vector
    followed: tuple[Line, ...] = ()
    refused: tuple[Line, ...] = ()
    balls: tuple[SketchBall, ...] = ()
    frames: tuple[Transform, ...] = ()


class WhyRefused(RobotAct[Sketch | None], frozen=True):
    """Return the answer to WHY for the target of the motion `text` as a picture; None if the motion has no target."""

    text: str


class BoundaryCurves(TaggedValue, frozen=True):
    """The boundary of the points that the tool can reach in its current configuration with the current TOOL. `lines`:
    sequences of points (distance from the axis of joint 1 [m], height [m], angle about that axis [rad]) in the frame of
    the model's `base`, with joint 1 at 0. `turns`: the range of joint 1 [rad]; the lines rotate with this joint."""

    lines: tuple[tuple[Vector, ...], ...]
    turns: tuple[float, float]


class Boundary(RobotAct[BoundaryCurves], frozen=True):
    """Return the boundary of the tool's reach. Raises IllegalValue if joint 1 is prismatic."""


# --- texts ------------------------------------------------------------------------------------------------------------


class Findings(TaggedValue, frozen=True):
    """All mistakes in a program text, sorted by line."""

    findings: tuple[Diagnostic, ...]


class ReadDraft(UserAct[Findings], frozen=True):
    """Find the mistakes in `text`: the text in the open editor (SEE) or, if no editor is open, any program."""

    text: str


class Kept(TaggedValue, frozen=True):
    """The name under which a program was stored; `said`: the last message shown while the program was stored."""

    name: str
    said: str


class KeepDraft(UserAct[Kept], frozen=True):
    """Store the program in the open editor (SEE). If no editor is open, store the program of `text`, and replace any
    program of the same name. A running program cannot be replaced."""

    text: str


class Attend(UserAct[None], frozen=True):
    """Direct the questions of programs to this user."""


class LeaveEntry(UserAct[None], frozen=True):
    """Discard the program that is being typed. `why`: the reason, shown before the message that says which program is
    discarded."""

    why: str = ""


class StopProgram(UserAct[None], frozen=True):
    """Stop the running program, but only while the user's input line is empty."""
