"""A stream of targets for a robot: joints or tool poses, of which the latest counts.

A target may have a time. In virtual time a stream of an hour takes a minute. In real time a target that comes early
waits for its time on the clock, and a late one is followed from the present instant: its time still says how fast the
targets move, but does not change the past.
"""

from __future__ import annotations

from math import sqrt

from msgspec import Struct, field

from vrs_cli.engine.engine import Engine
from vrs_cli.kinematics.joints import Joints, JointUnits, put_inside
from vrs_cli.kinematics.transform import Transform
from vrs_cli.trajectory.state import Target

STEER = "STEER"  # the text of its motions
SHORTEST, LONGEST = 0.001, 0.5  # [s] between targets of a stream: a longer time is a gap


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
        self._go(goal, stamp)
        self._last = stamp, goal

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
        """Chase a target that moves; go to the first one, and to one after a gap, whose motion is not known."""
        last = self._last
        since = stamp - last[0] if last is not None else 0.0
        if last is None or not 0.0 < since <= LONGEST:
            self.engine.redirect(goal, speed=self.speed, text=STEER)
            return
        tick = max(since, SHORTEST)
        velocity = tuple((b - a) / tick for a, b in zip(last[1], goal, strict=True))
        self.engine.steer(Target(goal, velocity), tick, speed=self.speed, text=STEER)
