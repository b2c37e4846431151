"""A stream of targets for a robot: joints or tool poses, of which the latest counts.

A target may have a time. In virtual time a stream of an hour takes a minute. In real time a target that comes early
waits for its time on the clock, and a late one is followed from the present instant: its time still says how fast the
targets move, but does not change the past.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from queue import SimpleQueue
from threading import Thread

from msgspec import Struct, field

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.settings import Settings
from vrs_cli.engine.targets import select
from vrs_cli.errors import RequestRefused, TooLate, VrsError
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.kinematics.joints import Joints, JointUnits, put_inside
from vrs_cli.kinematics.transform import Transform, compose
from vrs_cli.trajectory.state import Target
from vrs_cli.values.acts import FollowChunk
from vrs_cli.values.results import FollowReport

STEER = "STEER"  # the text of its motions
KEPT = 0.95  # of the longest wait between targets that come late, from target to target
SHORTEST, LONGEST = 0.001, 0.5  # [s] between targets of a stream: a longer time is a gap
WINDOW = 0.25  # [s] of a stream that go to a served robot in one chunk


class TrackingError(Struct):
    """The distance of the robot from each target when that came: of the farthest joint of a kind [rad, m], or in time
    [s].
    """

    targets: int = 0
    squares: float = 0.0
    worst: float = 0.0

    @property
    def rms(self) -> float:
        return sqrt(self.squares / self.targets) if self.targets else 0.0

    def count(self, error: float) -> None:
        self.targets += 1
        self.squares += error * error
        self.worst = max(self.worst, error)


class Following(Struct):
    """Measures of how well the robot follows: targets taken, those held at the end of a joint's range, how late they
    came [s], and the errors of the joints that turn and of those that slide.
    """

    targets: int = 0
    held: int = 0
    lag: TrackingError = field(default_factory=TrackingError)
    turning: TrackingError = field(default_factory=TrackingError)
    sliding: TrackingError = field(default_factory=TrackingError)

    def count(self, joints: Joints, goal: Joints, units: JointUnits, *, held: bool, lag: float) -> None:
        self.targets += 1
        self.held += held
        self.lag.count(lag)
        for error, slides in ((self.turning, False), (self.sliding, True)):
            pairs = enumerate(zip(joints, goal, strict=True), 1)
            error.count(max((abs(b - a) for joint, (a, b) in pairs if units.slides(joint) is slides), default=0.0))


class Steering:
    """Feeds targets to an engine, which follows the line through the last two of them."""

    def __init__(self, engine: Engine, *, speed: float = 1.0) -> None:
        self.engine, self.speed = engine, speed
        self.following = Following()
        self._last: tuple[float, Joints] | None = None
        self._came, self._wait = 0.0, 0.0  # when the last target came, and how long the robot may wait for the next [s]

    def to(self, target: Joints | Transform, t: float | None = None) -> None:
        """Go to a target at time t [s], or now. A target outside the range of a joint is taken at its end.

        Raises LocationOutOfRange and others for a pose that no configuration reaches; the robot follows the target
        before then until it stands.
        """
        engine = self.engine
        now = self._wait_for(t)
        where, model = engine.position().joints, engine.model
        near = where if self._last is None else self._last[1]
        asked = engine.joints_for(target, near) if isinstance(target, Transform) else target
        goal = put_inside(asked, model.lower, model.upper)
        stamp = now if t is None else t
        self.following.count(where, goal, model.units, held=goal != asked, lag=max(now - stamp, 0.0))
        self._wait = max(now - self._came, KEPT * self._wait) if now > stamp else 0.0
        self._go(goal, stamp)
        self._last, self._came = (stamp, goal), now

    def _wait_for(self, t: float | None) -> float:
        """Wait until a time, which may have passed already. Return the present instant [s]."""
        clock = self.engine.clock
        clock.advance(clock.reached if t is None else max(t, clock.reached))
        return clock.now

    def finish(self) -> None:
        """Come to rest at the last target: no more targets come."""
        self._wait_for(None)
        if self._last is not None:
            self.engine.redirect(self._last[1], speed=self.speed, text=f"{STEER} ends")
            self._last = None

    def _go(self, goal: Joints, stamp: float) -> None:
        """Chase a target that moves; go to the first one, and to one after a gap, whose motion is not known. Late
        targets come in bunches: until the next bunch the robot goes on.
        """
        last = self._last
        since = stamp - last[0] if last is not None else 0.0
        if last is None or not 0.0 < since <= LONGEST:
            self.engine.redirect(goal, speed=self.speed, text=STEER)
            return
        tick = max(since, SHORTEST)
        velocity = tuple((b - a) / tick for a, b in zip(last[1], goal, strict=True))
        lasting = max(tick, min(self._wait, LONGEST))
        self.engine.steer(Target(goal, velocity), lasting, speed=self.speed, text=STEER)


class FollowedChunks(Struct):
    """Measures of how well a served robot follows: targets sent, those that came too late for it, those held at the
    end of a joint's range, those lost because there was no connection, chunks; `samples`: of chunks that were followed;
    and of the joints that turn and of those that slide the sum of the errors at these, and the largest [rad, m].
    """

    targets: int = 0
    late: int = 0
    held: int = 0
    lost: int = 0
    chunks: int = 0
    samples: int = 0
    turning: tuple[float, float] = (0.0, 0.0)
    sliding: tuple[float, float] = (0.0, 0.0)

    def count(self, report: FollowReport, targets: int, sent_before: int, units: JointUnits) -> None:
        """Count a chunk of new `targets`, after those sent before: its errors are those of its farthest joints."""
        self.late += max(report.late - sent_before, 0)
        self.held += report.held
        self.samples += targets
        self.turning = _summed(self.turning, report, targets, units, slides=False)
        self.sliding = _summed(self.sliding, report, targets, units, slides=True)


def _summed(
    before: tuple[float, float], report: FollowReport, targets: int, units: JointUnits, *, slides: bool
) -> tuple[float, float]:
    """Add the errors of the joints of one kind in a chunk to the sum and the largest of those before."""
    pairs = [
        (mean, worst)
        for joint, (mean, worst) in enumerate(zip(report.mean, report.worst, strict=True), 1)
        if units.slides(joint) is slides
    ]
    mean, worst = (max(errors) for errors in zip(*pairs, strict=True)) if pairs else (0.0, 0.0)
    return before[0] + targets * mean, max(before[1], worst)


class ChunkSteering:
    """Feeds targets to a served robot, in chunks of time-stamped joints: a target is due `lead` [s] after its time, so
    that it arrives in time over delays. Answers are heard in a thread, which nothing waits for before the end;
    `refused` is the first that ends the stream.
    """

    def __init__(self, robot: Supervisor, lead: float, *, speed: float = 1.0) -> None:
        self.robot, self.lead, self.speed = robot, lead, speed
        self.followed = FollowedChunks()
        self._shift: float | None = None  # from times of the stream to the robot's clock [s]
        self._times: list[float] = []
        self._joints: list[Joints] = []
        self._new = 0  # targets that were not sent yet
        self.refused: VrsError | None = None
        self._sent: SimpleQueue[tuple[int, int, Callable[[], FollowReport]] | None] = SimpleQueue()
        self._hearing = Thread(target=self._hear, name="vrs lab steer", daemon=True)
        self._hearing.start()

    def to(self, target: Joints | Transform, t: float) -> None:
        """Be at a target at time t [s] of the stream. Raises LocationOutOfRange and others for a pose that no
        configuration reaches.
        """
        robot = self.robot
        if self._shift is None:
            begin = robot.timeline.end if robot.followed.rate is None else robot.now
            self._shift = begin + self.lead - t
        joints = self._joints_for(target) if isinstance(target, Transform) else target
        due = t + self._shift
        if self._times and due <= self._times[-1]:
            due = self._times[-1] + SHORTEST
        if self._times and due - self._times[-1] > LONGEST:  # it is not known how the robot is to move meanwhile
            self.send()
            self._times, self._joints = [], []
        self._times.append(due)
        self._joints.append(joints)
        self._new += 1
        self.followed.targets += 1
        if due - self._times[0] >= WINDOW:
            self.send()

    def _joints_for(self, T_world_tool: Transform) -> Joints:
        frames = self.robot.frames
        near = self._joints[-1] if self._joints else self.robot.at().joints
        return select(self.robot.arm, Settings(), compose(frames.base, T_world_tool), frames, near)

    def send(self) -> None:
        """Send the targets that there are. The last one is the first of the next chunk too: the robot passes it without
        coming to rest.
        """
        if not self._new:
            return
        chunk, count = FollowChunk(tuple(self._times), tuple(self._joints), self.speed), self._new
        sent_before = len(self._times) - count
        self._times, self._joints, self._new = self._times[-1:], self._joints[-1:], 0
        self.followed.chunks += 1
        try:
            self._sent.put((count, sent_before, self.robot.start(chunk)))
        except RequestRefused:
            self.followed.lost += count

    def finish(self) -> None:
        """Send the rest, and hear what became of all. The robot rests at the last target. Raises what it refused."""
        self.send()
        self._sent.put(None)
        self._hearing.join()
        if self.refused is not None:
            raise self.refused

    def _hear(self) -> None:
        while (sent := self._sent.get()) is not None:
            count, sent_before, wait = sent
            try:
                self.followed.count(wait(), count, sent_before, self.robot.arm.model.units)
            except TooLate:
                self.followed.late += count
            except RequestRefused:
                self.followed.lost += count
            except VrsError as error:
                self.refused = self.refused or error
