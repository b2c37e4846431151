"""Acts: what is asked of a robot by value, to the bit, where a line of the prompt says it in words and digits.

An act is data, and goes over a connection; `interfaces/session/acts.py` carries it out.
"""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.errors import IllegalValue
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, Vector, is_rotation
from vrs_cli.values import commands, replies
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.hand import Shortfall
from vrs_cli.values.measured import ResyncReport
from vrs_cli.values.numbers import LIMIT, Value
from vrs_cli.values.results import CommandRecord, FollowReport, RunResult, Untrue
from vrs_cli.values.tagged import RobotAct, Spoken, UserAct


class Goal(Struct, frozen=True, omit_defaults=True):
    """The target of a motion: exactly one of these. `joint` is changed by `change`; `offset` is that of DEPART."""

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
        """Raises IllegalValue for what is no place."""
        if self.pose is not None:
            return commands.PoseTarget(rotating(self.pose))
        if self.joints is not None:
            return commands.JointTarget(_finite(self.joints))
        if self.named is not None:
            return commands.NamedTarget(self.named)
        if self.joint is not None:
            return commands.JointOffsetTarget(self.joint, *_finite((self.change,)))
        if self.offset is not None:
            return commands.ToolOffsetTarget(rotating(self.offset))
        if self.aligned:
            return commands.AlignedTarget()
        raise IllegalValue("a motion to nowhere", "a pose, joints, or the name of a pose")


class Valued(Spoken, frozen=True, omit_defaults=True):
    """The value of a variable or an expression: exactly one of these."""

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
        """Raises IllegalValue for what is no value."""
        if self.location is not None:
            return rotating(self.location)
        if self.joints is not None:
            return _finite(self.joints)
        if self.text is not None:
            return self.text
        if self.real is not None:
            return _finite((self.real,))[0]
        raise IllegalValue("no value at all", "a number, a text, a location or joints")


def _finite(numbers: Joints) -> Joints:
    """Raises IllegalValue for what is no number."""
    for number in numbers:
        if not isfinite(number):
            raise IllegalValue(f"{number}", "a finite number")
    return numbers


def rotating(T: Transform) -> Transform:
    """Raises IllegalValue for a matrix that is no location, or a place that no line could name."""
    if max(map(abs, _finite(T))) > LIMIT:
        raise IllegalValue("a location beyond all numbers", "reals go to about 3E38")
    if not is_rotation((T[0:3], T[4:7], T[8:11])):
        raise IllegalValue("a location whose axes are not at right angles, or not of length 1")
    return T


class Say(RobotAct[None], frozen=True):
    """A line of the prompt. What is refused is raised, and not answered."""

    line: str


class Go(RobotAct[None], frozen=True, omit_defaults=True):
    """A motion: `executed` is t_exec [s], after the last motion where that is None; `speed` the fraction of nominal."""

    goal: Goal
    straight: bool = False
    executed: float | None = None
    speed: float | None = None
    text: str = ""


class FollowChunk(RobotAct[FollowReport], frozen=True, omit_defaults=True):
    """A chunk of time-stamped joints, which takes the place of everything from its first time on: `times` [s] in
    increasing order, `joints` [rad, m] at each; `speed` the fraction of nominal.
    """

    times: tuple[float, ...]
    joints: tuple[Joints, ...]
    speed: float | None = None


class Steer(RobotAct[None], frozen=True, omit_defaults=True):
    """One target of a stream: chase `joints` [rad, m] that move at `velocity` [rad/s, m/s], from now on, for `lasting`
    [s] until the next target comes. Without `velocity`, which the first and the last target of a stream do not have,
    come to rest there. What was scheduled is dropped. `speed`: the fraction of nominal.
    """

    joints: Joints
    velocity: Joints | None = None
    lasting: float = 0.0
    speed: float | None = None


class DragTool(RobotAct[Shortfall], frozen=True, omit_defaults=True):
    """Drag the tool towards `pose` (T_world_tool), as near as the arm comes, from now on; without one, let it go."""

    pose: Transform | None = None


class ResyncBody(RobotAct[ResyncReport], frozen=True, omit_defaults=True):
    """Bring the body and the timeline together; if it `stops`, nothing that was scheduled is done."""

    stops: bool = False


class Rest(RobotAct[None], frozen=True):
    """In virtual time: go on to when the robot stands."""


class Undo(RobotAct[None], frozen=True):
    count: int = 1


class Redo(RobotAct[None], frozen=True):
    count: int = 1


class Explain(RobotAct[replies.ReachReport], frozen=True):
    """WHY; `name`: how the goal is called in the report."""

    goal: Goal
    name: str


class Compare(RobotAct[replies.ComparisonTable], frozen=True):
    """Two branches."""

    a: str
    b: str


class Evaluate(RobotAct[Valued], frozen=True):
    expression: str


class Assign(RobotAct[None], frozen=True):
    """Give a variable, or an element of an array, a value."""

    variable: str
    value: Valued


class Defined(Spoken, frozen=True):
    """The names of programs that were put in memory."""

    names: tuple[str, ...]


class Define(RobotAct[Defined], frozen=True):
    """Put the programs and variables of a text in memory; `where` stands before the number of a wrong line."""

    text: str
    where: str = "line "


class Execute(RobotAct[RunResult], frozen=True):
    """A program that is in memory, to its end."""

    program: str
    cycles: int = 1


class CommandList(Spoken, frozen=True):
    commands: tuple[CommandRecord, ...]


class ListCommands(RobotAct[CommandList], frozen=True):
    """List all motion commands that hold."""


class ListBranches(RobotAct[replies.BranchTable], frozen=True):
    """List all branches, main first."""


class ListMotions(RobotAct[replies.TimelineTable], frozen=True):
    """The timeline as a table."""


class LookAtParts(RobotAct[replies.PartTable], frozen=True):
    """PARTS, at a time [s]; None: now."""

    time: float | None = None


class Recorded(Spoken, frozen=True):
    """A trajectory file."""

    data: bytes


class Record(RobotAct[Recorded], frozen=True):
    """The trajectory as SAVE would write it to a file."""


class PartialList(Struct, frozen=True):
    """A list, or its first rows: there are `more`."""

    more: int = 0


class LocationList(PartialList, frozen=True, kw_only=True):
    """LISTL: transformations, and then precision points, each kind in the order of names."""

    rows: tuple[replies.NamedLocation, ...]


class ProgramList(PartialList, frozen=True, kw_only=True):
    """DIRECTORY."""

    rows: tuple[replies.ProgramName, ...]


class TaskRow(Struct, frozen=True):
    """A task that runs or has stopped: where it is (`program`, and `step`, which counts from 1; None at its end), its
    `state` as STATUS says it, and the question it waits for.
    """

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


MAX_UNTRUE = 3  # readings that a survey tells


class Surveyed(Spoken, frozen=True):
    """A list is None where its mark is among those that are known. `marks`: of both lists, and of the program that is
    asked for: another one whenever it is stored anew, empty where it is not in memory.

    `on`: the signals that are on. `base`: T_robot_world, in which places are; `tool`: T_flange_tool [m]. `driver`:
    whose lease it is, empty where nobody has one. `untrue`: what programs have read of signals and no longer holds, the
    first MAX_UNTRUE of it. `breakpoints`: the steps of the program asked for before which it stops.
    """

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
    """Survey the robot. `program`: whose mark and breakpoints are wanted, empty for none; `known`: the marks of lists
    that are known.
    """

    program: str = ""
    known: tuple[str, ...] = ()


class ProgramSource(Spoken, frozen=True):
    """A program as SEE shows it: `text` is the `.PROGRAM` line and one line a step, without `.END`."""

    name: str
    text: str


class LookAtProgram(RobotAct[ProgramSource], frozen=True):
    """Return the text of a program in memory."""

    program: str


class RecordProgram(RobotAct[Defined], frozen=True):
    """Make a program that leads the tool along the way that it went from `begin` to `end` [s], within 2 mm and
    1 degree, and put it in memory.
    """

    name: str
    begin: float
    end: float


# --- pictures ---------------------------------------------------------------------------------------------------------

Line = tuple[Vector, Vector]


class SketchBall(NamedTuple):
    """A place in a sketch [m]. `mood`: `good` for an end that is reached, `stop` where the tool stops, `bad` for a
    contact.
    """

    name: str
    place: Vector
    mood: str


class Sketch(Spoken, frozen=True, omit_defaults=True):
    """An explanation as a picture, in the world [m]: ways that can be `followed`, ways that are `refused`, places,
    frames of a chain, and a text at a place.
    """

    text: str
    at: Vector
    followed: tuple[Line, ...] = ()
    refused: tuple[Line, ...] = ()
    balls: tuple[SketchBall, ...] = ()
    frames: tuple[Transform, ...] = ()


class WhyRefused(RobotAct[Sketch | None], frozen=True):
    """WHY of the place to which a motion of that text goes, as a picture; None where it goes to none."""

    text: str


class BoundaryCurves(Spoken, frozen=True):
    """The boundary of the places that the tool reaches in its present configuration, with its present TOOL.

    `lines`: of points (distance from the first axis [m], height [m], angle about it [rad]) in the frame of the model's
    `base`, while joint 1 is 0. `turns`: the range of joint 1 [rad], through which the lines turn.
    """

    lines: tuple[tuple[Vector, ...], ...]
    turns: tuple[float, float]


class Boundary(RobotAct[BoundaryCurves], frozen=True):
    """The boundary of the reach. Raises IllegalValue for an arm whose first joint slides."""


# --- texts ------------------------------------------------------------------------------------------------------------


class Findings(Spoken, frozen=True):
    """All mistakes in a text, by line."""

    findings: tuple[Diagnostic, ...]


class ReadDraft(UserAct[Findings], frozen=True):
    """Find the mistakes in the text of SEE; where no SEE is open, in the text of any program."""

    text: str


class Kept(Spoken, frozen=True):
    """The program is stored, under this name; what is said of it."""

    name: str
    said: str


class KeepDraft(UserAct[Kept], frozen=True):
    """Store the program of SEE; where no SEE is open, any program that does not run, in place of the one of its
    name.
    """

    text: str


class Attend(UserAct[None], frozen=True):
    """Put the questions that programs have to whoever types."""


class LeaveEntry(UserAct[None], frozen=True):
    """Forget the program that is typed; `why` stands before the message."""

    why: str = ""


class StopProgram(UserAct[None], frozen=True):
    """Stop the program that runs beside an empty line."""
