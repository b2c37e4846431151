"""The measured robot, as values: what a body reports, what is known of a body, and where it differs from the timeline.

A body is a client that is the robot, or stands for it. Metres, radians, seconds; all times are of the robot's clock,
unless another clock is named.
"""

from __future__ import annotations

from enum import Enum

from msgspec import Struct

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import angle_between, distance
from vrs_cli.values.results import Apart, Position
from vrs_cli.values.tagged import Spoken

MAX_LATENESS_S = 2.0  # [s] a report that is so much older than the newest one is dropped


class BodyMode(Enum):
    """What a body does: it follows the timeline, holds still by an order, or has stopped by itself (its own emergency
    stop, a brake, a fault).
    """

    FOLLOWS = "follows"
    HOLDS = "holds"
    STOPPED = "stopped"


class Report(Struct, frozen=True, omit_defaults=True):
    """What a body measured at time `t` [s]: joints [rad, m], and where it has them their velocities [rad/s, m/s] and
    efforts [N m, N].
    """

    t: float
    joints: Joints
    velocity: Joints | None = None
    effort: Joints | None = None
    mode: BodyMode = BodyMode.FOLLOWS


class ReportCounts(Struct, frozen=True, omit_defaults=True):
    """What became of reports.

    `received`: all that came. `lost`: numbers that have not come; one that comes later is counted as `reordered`
    instead. `late`: dropped, for they were more than LATE seconds older than the newest. `duplicate`: dropped, for
    there was a report of that time. `reordered`: came after a newer one, and were put in their place.
    """

    received: int = 0
    lost: int = 0
    late: int = 0
    duplicate: int = 0
    reordered: int = 0

    def __add__(self, other: ReportCounts) -> ReportCounts:
        return ReportCounts(
            self.received + other.received,
            self.lost + other.lost,
            self.late + other.late,
            self.duplicate + other.duplicate,
            self.reordered + other.reordered,
        )


class BodySeen(Struct, frozen=True, omit_defaults=True):
    """What is known of a body.

    `mode`: of its last report; `order`: what it was told last. `last`: the time of its last report. `offset` [s]: its
    clock minus the robot's; `drift` [s/s]: how fast that grows. `delay` [s]: how old its reports are when they come;
    `rate` [1/s]: how many come.
    """

    name: str
    mode: BodyMode = BodyMode.FOLLOWS
    order: BodyMode = BodyMode.FOLLOWS
    counts: ReportCounts = ReportCounts()
    last: float | None = None
    offset: float = 0.0
    drift: float = 0.0
    delay: float = 0.0
    rate: float = 0.0


class MeasuredPosition(Struct, frozen=True):
    """Where the robot was measured at one time, and where it should be by its timeline. The hand of `measured` is that
    of the timeline; its acceleration is unknown, and zero.
    """

    measured: Position
    expected: Position
    mode: BodyMode

    @property
    def errors(self) -> Joints:
        """Measured minus expected joints [rad, m]."""
        return tuple([a - b for a, b in zip(self.measured.joints, self.expected.joints, strict=True)])

    @property
    def distance(self) -> float:
        """Return how far the tool is from where it should be [m]."""
        return distance(self.measured.T_world_tool, self.expected.T_world_tool)

    @property
    def angle(self) -> float:
        """Return how far the tool is turned from how it should be [rad]."""
        return angle_between(self.measured.T_world_tool, self.expected.T_world_tool)


class Deviation(Struct, frozen=True):
    """The root of the mean square of many distances, and the greatest of them [rad, m]."""

    rms: float
    greatest: Apart


class MeasuredComparison(Struct, frozen=True):
    """All reports from `begin` to `end` [s] beside the timeline at their own times: of the place of the tool [m], of
    how it is turned [rad], and of each joint [rad, m]. `unknown` [s]: how much of the time lies in gaps.
    """

    begin: float
    end: float
    reports: int
    unknown: float
    tool: Deviation
    turned: Deviation
    joints: tuple[Deviation, ...]


class DivergenceCause(Enum):
    """The likely cause of a difference between the measured robot and its timeline."""

    BLOCKED = "blocked joint"
    PAYLOAD = "payload"
    LOST_COMMAND = "lost command"
    DELAY = "delay"
    OTHER_COMMANDER = "another commander"
    STOPPED = "stopped"
    PUSH = "push or collision"
    UNKNOWN = "unknown"


class DivergenceAlarm(Struct, frozen=True):
    """At `t` [s] the measured robot differs from the timeline by more than healthy noise.

    `joint`: from 1, the one that differs most for its noise; `size`: its residual (measured minus g) [rad, m]; `tool`:
    how far the tool is from where it should be [m]. `detail`: one plain sentence. `since` [s]: when the difference
    began.
    """

    t: float
    joint: int
    size: float
    tool: float
    cause: DivergenceCause
    detail: str
    since: float


def alarm_text(alarm: DivergenceAlarm) -> str:
    """Say an alarm in one sentence."""
    begun = f"since {alarm.since:.2f} s the body is not where the timeline says ({1e3 * alarm.tool:.1f} mm at the tool)"
    return f"{begun}: {alarm.cause.value}; {alarm.detail}"


class OnAlarm(Enum):
    """What is done about divergence: nobody looks for it; an alarm is told; the body is told to hold, too; the robot is
    stopped; or the body holds and RESYNC follows by itself.
    """

    OFF = "off"
    WARN = "warn"
    HOLD = "hold"
    ABORT = "abort"
    RESYNC = "resync"


class ResyncReport(Spoken, frozen=True):
    """RESYNC was done: from `t` [s] the timeline goes to the measured joints, and from `until` [s] the body follows.

    `distances`: how far each joint of the timeline was from the measured one [rad, m]. `goal`: where the robot goes
    from there, in words; empty where it stays.
    """

    t: float
    until: float
    distances: Joints
    goal: str = ""
