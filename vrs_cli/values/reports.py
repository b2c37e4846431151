"""Define the results of COMPARE (two timelines) and of WHY (a location)."""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.kinematics.joints import Configuration, Joints
from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.values.results import CommandRecord


class Extent(Struct, frozen=True):
    """The size of a timeline. `duration`: from its start to its end [s]. `segments`: the number of segments, without
    the initial segment s_0. `tool_path`: the length of the tool's path [m]; `joint_travel`: the total rotation of all
    revolute joints [rad]; `joint_slide`: the total travel of all prismatic joints [m]."""

    duration: float
    commands: int
    segments: int
    tool_path: float
    joint_travel: float
    joint_slide: float = 0.0


class Pair(Struct, frozen=True):
    """The records of one command in the timelines a and b. A record is None if its timeline lacks the command."""

    a: CommandRecord | None
    b: CommandRecord | None

    @property
    def text(self) -> str:
        return next(record.text for record in (self.a, self.b) if record is not None)


class Apart(Struct, frozen=True):
    """The maximum distance between two timelines, and the time at which it occurs [s]. `joint` counts from 1; 0: the
    distance between the tool positions."""

    distance: float
    time: float
    joint: int = 0


class Comparison(Struct, frozen=True):
    """The difference between two timelines. `since` [s]: the first time at which the two positions may differ; None if
    the timelines are equal. `tool` [m] and `joints` [rad]: the maximum distances at equal times."""

    a: Extent
    b: Extent
    commands: tuple[Pair, ...]
    since: float | None
    tool: Apart
    joints: Apart


class WayOut(Struct, frozen=True):
    """A feasible alternative to a straight-line motion that cannot be executed: the same line in another configuration
    (`words`, such as LEFTY), two lines through `via` (T_world_tool), or a MOVE (neither field is set)."""

    words: tuple[str, ...] = ()
    via: Transform | None = None


class LineCheck(Struct, frozen=True):
    """The result of checking the straight line from the current position to a location. `length` [m]; `duration` [s] if
    the line is possible. Otherwise `trouble`: the error's text; `at` [m]: the distance at which the motion fails (None:
    unknown); `ways_out`: the possible alternatives. `stops` [m]: the distances at which the arm stops along a possible
    line before its end."""

    length: float
    duration: float | None = None
    trouble: str = ""
    at: float | None = None
    ways_out: tuple[WayOut, ...] = ()
    stops: tuple[float, ...] = ()


class Overrun(Struct, frozen=True):
    """A joint, counted from 1, that would be out of its range. `by` [rad]: the signed distance beyond `limit`."""

    joint: int
    limit: float
    by: float


class Option(Struct, frozen=True):
    """One configuration for a location: its joints and the joints that are out of range, or the reason why no joints
    reach the location. `too_far` [m]: how far the location is out of reach; negative if it is too close; None if the
    joints are known or the distance is unknown."""

    configuration: Configuration
    joints: Joints | None
    overruns: tuple[Overrun, ...] = ()
    too_far: float | None = None

    @property
    def usable(self) -> bool:
        return self.joints is not None and not self.overruns


class Reach(Struct, frozen=True):
    """The answer to WHY. `options` is empty for a precision point, whose only set of joints is `goal`. `chosen`: the
    configuration that MOVE would use, None if MOVE would fail; `reason`: the reason for this choice. `begin`, `end`:
    the tool tip now and at the location, in the world [m]."""

    options: tuple[Option, ...]
    goal: Option | None
    chosen: Configuration | None
    reason: str
    line: LineCheck
    begin: Vector
    end: Vector
