"""Streams of targets, turned into motions that begin while the robot moves. The newest target replaces earlier ones.
The engine follows it within all limits, and brakes if no more targets arrive. A target to steer to may have a time. In
virtual time, a stream of an hour takes a minute. In real time, an early target waits for its time on the clock, and a
late target is followed from the current instant on: its time still determines how fast the target moves, but does not
change the past."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from msgspec import Struct, field

from vrs_cli.engine.engine import Engine
from vrs_cli.kinematics.joints import Joints, JointUnits, put_inside
from vrs_cli.kinematics.transform import Transform
from vrs_cli.trajectory.state import Target

# --- intervals between the targets of a stream -----------------------------------------------------------------------


class Tempo(NamedTuple):
    """The `text` of a stream's motions, and the minimum and maximum time from one target to the next [s]. A longer time
    is a gap, after which the arm stops."""

    text: str
    shortest: float
    longest: float

    def tick(self, seconds: float) -> float:
        """Return a time between targets, limited to this range [s]."""
        return min(max(seconds, self.shortest), self.longest)


STEERING = Tempo("STEER", 0.001, 0.5)
DRAGGING = Tempo("DRAG", 0.001, 0.1)
DRAG_TICK = 0.02  # [s] time between targets for the tool, and before the first one


def velocity_between(a: Joints, b: Joints, seconds: float) -> Joints:
    """Return the constant velocity of joints that move from a to b in a given time [rad/s, m/s]."""
    return tuple([(y - x) / seconds for x, y in zip(a, b, strict=True)])


def chase(
    engine: Engine, tempo: Tempo, target: Target, lasting: float, speed: float = 1.0, issued: float | None = None
) -> None:
    """Follow a moving target for the time until the next target, `lasting` [s], beginning now. Raises PowerOff,
    JointOutOfRange, CollisionAhead."""
    engine.steer(target, tempo.tick(lasting), speed=speed, text=tempo.text, issued=issued)


# --- targets to steer to ---------------------------------------------------------------------------------------------

WAIT_DECAY = 0.95  # factor by which the maximum wait for late targets decreases with each target


class TrackingError(Struct):
    """Statistics of the distance between the robot and its target at the arrival of each target: the maximum over the
    joints of a kind [rad, m], or the delay [s]."""

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
    """How well the robot follows: the number of targets, the number of targets limited to the end of a joint's range,
    the delays of targets [s], and the errors of the revolute and of the prismatic joints."""

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
    """A stream of joint or pose targets to an engine, which extrapolates linearly from the last two targets."""

    def __init__(self, engine: Engine, *, speed: float = 1.0) -> None:
        self.engine, self.speed = engine, speed
        self.following = Following()
        self._last: tuple[float, Joints] | None = None
        # when the last target arrived, and the maximum wait for the next one [s]
        self._came, self._wait = 0.0, 0.0

    def to(self, target: Joints | Transform, t: float | None = None) -> None:
        """Go to a target at t [s], or now. A target outside the range of a joint is limited to the end of the range.
        Raises LocationOutOfRange and other errors for a pose that no configuration reaches; the robot then follows the
        previous target until it stops."""
        engine = self.engine
        now = self._wait_for(t)
        where, model = engine.position().joints, engine.model
        near = where if self._last is None else self._last[1]
        asked = engine.joints_for(target, near) if isinstance(target, Transform) else target
        goal = put_inside(asked, model.lower, model.upper)
        stamp = now if t is None else t
        self.following.count(where, goal, model.units, held=goal != asked, lag=max(now - stamp, 0.0))
        self._wait = max(now - self._came, WAIT_DECAY * self._wait) if now > stamp else 0.0
        last, self._last, self._came = self._last, (stamp, goal), now
        since = stamp - last[0] if last is not None else 0.0
        if last is None or not 0.0 < since <= STEERING.longest:  # the velocity of the target is unknown
            engine.redirect(goal, speed=self.speed, text=STEERING.text)
            return
        tick = STEERING.tick(since)
        moving = Target(goal, velocity_between(last[1], goal, tick))
        # late targets arrive in bursts: keep moving until the next burst
        chase(engine, STEERING, moving, max(tick, self._wait), self.speed)

    def _wait_for(self, t: float | None) -> float:
        """Wait until a time that may already have passed. Return the current instant [s]."""
        clock = self.engine.clock
        clock.advance(clock.reached if t is None else max(t, clock.reached))
        return clock.now

    def finish(self) -> None:
        """Stop at the last target, because no more targets follow."""
        self._wait_for(None)
        if self._last is not None:
            self.engine.redirect(self._last[1], speed=self.speed, text=f"{STEERING.text} ends")
            self._last = None
