"""Define values of the measured robot: the reports and the state of its body, and the body's difference from the
timeline. A body is a client that moves a real arm, or simulates one, and reports its joints. Units are metres, radians,
seconds. Times are those of the robot's clock unless another clock is named."""

from __future__ import annotations

from enum import Enum

from msgspec import Struct

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import angle_between, distance
from vrs_cli.values.reports import Apart
from vrs_cli.values.results import Position

MAX_LATENESS_S = 2.0  # [s] a report is dropped if it is this much older than the newest one


class BodyMode(Enum):
    """The mode of a body: it follows the timeline, holds still as ordered, or has stopped for its own reason (emergency
    stop, brake, fault)."""

    FOLLOWS = "follows"
    HOLDS = "holds"
    STOPPED = "stopped"


class Report(Struct, frozen=True, omit_defaults=True):
    """A measurement of the arm at time `t` [s]: joints [rad, m] and, if known, their velocities [rad/s, m/s] and
    efforts [N m, N]."""

    t: float
    joints: Joints
    velocity: Joints | None = None
    effort: Joints | None = None
    mode: BodyMode = BodyMode.FOLLOWS


class ReportCounts(Struct, frozen=True, omit_defaults=True):
    """Counts of received and missing reports. `received`: all reports that arrived. `lost`: missing sequence numbers; a
    report that arrives later counts as `reordered` instead. `late`: reports dropped because they were more than
    MAX_LATENESS_S older than the newest one. `duplicate`: reports dropped because a report for the same time had
    already arrived. `reordered`: reports that arrived after a newer one and were sorted in."""

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
    """The state of a body. `mode`: the mode in its last report; `order`: the mode that was last ordered. `last` [s]:
    the time of its last report. `offset` [s]: its clock minus the robot's clock; `drift` [s/s]: the rate at which the
    offset grows. `delay` [s]: the age of its reports on arrival; `rate` [1/s]: reports per second."""

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
    """The measured and the expected position of the robot at one time. The hand opening in `measured` comes from the
    timeline; the measured acceleration is unknown and set to zero."""

    measured: Position
    expected: Position
    mode: BodyMode

    @property
    def errors(self) -> Joints:
        """Return the measured minus the expected joints [rad, m]."""
        return tuple([a - b for a, b in zip(self.measured.joints, self.expected.joints, strict=True)])

    @property
    def distance(self) -> float:
        """Return the distance of the tool from its expected position [m]."""
        return distance(self.measured.T_world_tool, self.expected.T_world_tool)

    @property
    def angle(self) -> float:
        """Return the angle between the tool's orientation and its expected orientation [rad]."""
        return angle_between(self.measured.T_world_tool, self.expected.T_world_tool)


class Deviation(Struct, frozen=True):
    """The root mean square and the maximum of distances [rad, m]."""

    rms: float
    greatest: Apart


class MeasuredComparison(Struct, frozen=True):
    """The reports from `begin` to `end` [s] compared with the timeline at their times: the tool's position [m], its
    orientation [rad], and each joint [rad, m]. `unknown` [s]: the total time for which reports are missing."""

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
    """An alarm raised at `t` [s]: the measured robot differs from the timeline by more than its usual noise. `joint`:
    the joint (from 1) that differs most relative to its noise; `size`: its residual (measured minus expected) [rad, m];
    `tool`: the distance of the tool from its expected position [m]. `detail`: one plain sentence. `since` [s]: when the
    difference began."""

    t: float
    joint: int
    size: float
    tool: float
    cause: DivergenceCause
    detail: str
    since: float


def alarm_text(alarm: DivergenceAlarm) -> str:
    """Describe an alarm in one sentence."""
    begun = f"since {alarm.since:.2f} s the body is not where the timeline says ({1e3 * alarm.tool:.1f} mm at the tool)"
    return f"{begun}: {alarm.cause.value}; {alarm.detail}"


class OnAlarm(Enum):
    """The reaction to divergence. OFF: do not check; WARN: notify the users; HOLD: notify, and order the arm to hold
    still; ABORT: stop the robot; RESYNC: hold, then resynchronise."""

    OFF = "off"
    WARN = "warn"
    HOLD = "hold"
    ABORT = "abort"
    RESYNC = "resync"
