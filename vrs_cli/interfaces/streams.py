"""Motions that follow a stream of targets while the robot moves. Each new target replaces the previous one. The engine
moves towards it within all limits, and brakes if no more targets arrive. A joint target may have a time. In virtual
time the stream runs faster than real time: an hour of targets takes about a minute. In real time, an early target waits
until the clock reaches its time; a late target takes effect at the current instant. Its time then still determines the
velocity of the target, but changes nothing in the past."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

from msgspec import Struct, field

from vrs_cli.engine.engine import Engine
from vrs_cli.kinematics.joints import Joints, JointUnits, put_inside
from vrs_cli.kinematics.transform import Transform
from vrs_cli.trajectory.state import Target

# --- intervals between the targets of a stream -----------------------------------------------------------------------


class Tempo(NamedTuple):
    """The rate limits of a kind of stream. `text`: the text of its motions in the timeline. `shortest`, `longest`: the
    minimum and maximum time between two targets [s]; if no target arrives for longer than that, the arm stops."""

    text: str
    shortest: float
    longest: float

    def tick(self, seconds: float) -> float:
        """Return the time between two targets [s], limited to the range from `shortest` to `longest`."""
        return min(max(seconds, self.shortest), self.longest)


STEERING = Tempo("STEER", 0.001, 0.5)
DRAGGING = Tempo("DRAG", 0.001, 0.1)
DRAG_TICK = 0.02  # [s] time between two targets for a dragged tool; also assumed before the first target


def velocity_between(a: Joints, b: Joints, seconds: float) -> Joints:
    """Return the constant velocity [rad/s, m/s] at which joints move from a to b in the given time [s]."""
    return tuple([(y - x) / seconds for x, y in zip(a, b, strict=True)])


# --- targets to steer to ---------------------------------------------------------------------------------------------

# factor applied with each late target to the longest wait so far, so that an old long wait is forgotten
WAIT_DECAY = 0.95


class TrackingError(Struct):
    """Statistics (count, sum, sum of squares, maximum) of a tracking error, measured when each target arrives. The
    error is the largest distance of a joint from its target, over all revolute joints [rad] or all prismatic joints
    [m]; or the delay of the target [s]."""

    targets: int = 0
    total: float = 0.0
    squares: float = 0.0
    worst: float = 0.0

    @property
    def mean(self) -> float:
        return self.total / max(self.targets, 1)

    @property
    def rms(self) -> float:
        return sqrt(self.squares / max(self.targets, 1))

    def add(self, mean: float, worst: float, targets: int = 1) -> None:
        """Add the errors of some targets; of several targets `rms` knows only the mean error."""
        self.targets += targets
        self.total += targets * mean
        self.squares += targets * mean * mean
        self.worst = max(self.worst, worst)


class Following(Struct):
    """Counts and errors that show how closely a robot follows a stream. `targets`: the number of targets; `held`: the
    number of targets that were limited to the end of a joint's range; `lag`: the delays of the targets [s]; `turning`,
    `sliding`: the tracking errors of the revolute and of the prismatic joints. For targets in chunks also their number,
    and the numbers of targets that arrived too `late` or got `lost` because there was no connection."""

    targets: int = 0
    held: int = 0
    late: int = 0
    lost: int = 0
    chunks: int = 0
    lag: TrackingError = field(default_factory=TrackingError)
    turning: TrackingError = field(default_factory=TrackingError)
    sliding: TrackingError = field(default_factory=TrackingError)

    def add_errors(self, mean: Sequence[float], worst: Sequence[float], units: JointUnits, targets: int = 1) -> None:
        """Add the errors of each joint for some targets [rad, m]: their mean and their maximum."""
        for error, slides in ((self.turning, False), (self.sliding, True)):
            joints = [i for i in range(len(mean)) if units.slides(i + 1) is slides]
            error.add(
                max([mean[i] for i in joints], default=0.0), max([worst[i] for i in joints], default=0.0), targets
            )


class Steering:
    """A stream of joint or pose targets that an engine follows. The velocity of the target is computed from the last
    two targets, and extrapolated linearly until the next target."""

    def __init__(self, engine: Engine, *, speed: float = 1.0) -> None:
        self.engine, self.speed = engine, speed
        self.following = Following()
        self._last: tuple[float, Joints] | None = None
        # when the last target arrived, and the longest expected wait for the next target if targets come late [s]
        self._came, self._wait = 0.0, 0.0

    def to(self, target: Joints | Transform, t: float | None = None) -> None:
        """Steer to a target: joints [rad, m] or a pose T_world_tool, due at t [s] (default: now). Joints outside their
        range are limited to its end. Raises LocationOutOfRange and other errors for a pose that no configuration
        reaches; the robot then follows the previous target until it stops."""
        engine = self.engine
        now = self._wait_for(t)
        where, model = engine.position().joints, engine.model
        near = where if self._last is None else self._last[1]
        asked = engine.joints_for(target, near) if isinstance(target, Transform) else target
        goal = put_inside(asked, model.lower, model.upper)
        stamp = now if t is None else t
        following, lag = self.following, max(now - stamp, 0.0)
        following.targets += 1
        following.held += goal != asked
        following.lag.add(lag, lag)
        errors = [abs(b - a) for a, b in zip(where, goal, strict=True)]
        following.add_errors(errors, errors, model.units)
        self._wait = max(now - self._came, WAIT_DECAY * self._wait) if now > stamp else 0.0
        last, self._last, self._came = self._last, (stamp, goal), now
        since = stamp - last[0] if last is not None else 0.0
        # the velocity of the target is unknown: move to it as to a fixed target
        if last is None or not 0.0 < since <= STEERING.longest:
            engine.redirect(goal, speed=self.speed, text=STEERING.text)
            return
        tick = STEERING.tick(since)
        moving = Target(goal, velocity_between(last[1], goal, tick))
        # late targets arrive in bursts: extrapolate long enough to keep moving until the next burst
        engine.steer(moving, STEERING.tick(max(tick, self._wait)), speed=self.speed, text=STEERING.text)

    def _wait_for(self, t: float | None) -> float:
        """Wait until time t [s]; do not wait if t is None or has already passed. Return the current instant [s]."""
        clock = self.engine.clock
        clock.advance(clock.reached if t is None else max(t, clock.reached))
        return clock.now

    def finish(self) -> None:
        """End the stream: move to the last target and stop there."""
        self._wait_for(None)
        if self._last is not None:
            self.engine.redirect(self._last[1], speed=self.speed, text=f"{STEERING.text} ends")
            self._last = None
