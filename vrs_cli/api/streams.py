"""Streams of targets, sent one by one: joints that a robot steers to, and a tool that is dragged."""

from __future__ import annotations

import time
from math import degrees, inf

from msgspec import Struct

from vrs_cli.api.location import Units
from vrs_cli.interfaces.dragging import DRAG, TICK
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.interfaces.steering import LONGEST, STEER
from vrs_cli.kinematics.joints import Joints, largest_change
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform
from vrs_cli.values.acts import DragTool, Steer
from vrs_cli.values.hand import Shortfall

RATES = 1.0 / LONGEST, 1000.0  # targets a second
STANDS = 1e-6  # [rad, m] of a joint and [1/s] of its velocity: it has come to rest
LONGEST_ARRIVAL = 10.0  # [s] of the robot's clock that a dragged tool may take to its last target


class Dragged(Struct, frozen=True):
    """How far a dragged tool is from its target, and what holds it.

    `distance`: [mm], or [m] in SI; `angle`: [degrees], or [rad]; `limits`: a sentence for each limit that holds the
    tool: the end of a joint's range, the reach, a singularity, a joint that is as fast as it may be, a contact. None:
    the tool is there, or on its way at its own pace.
    """

    distance: float
    angle: float
    limits: tuple[str, ...]
    units: Units

    @classmethod
    def of(cls, held: Shortfall, model: RobotModel, units: Units) -> Dragged:
        """Return the shortfall of a tool in some units."""
        val = units is Units.VAL
        limits = tuple(hold.describe(model) for hold in held.holds)
        return cls(
            1000.0 * held.away if val else held.away, degrees(held.turned) if val else held.turned, limits, units
        )

    @property
    def held(self) -> bool:
        """True where a limit holds the tool away from its target."""
        return bool(self.limits)

    def __repr__(self) -> str:
        if not self.limits:
            return "<Dragged: nothing holds the tool>"
        digits = 2 if self.units is Units.VAL else 5
        off = f"{self.distance:.{digits}f} {self.units.length} and {self.angle:.{digits}f} {self.units.angle} away"
        return f"<Dragged: {off}: {'; '.join(self.limits)}>"


class Streams:
    """Sends the targets of one robot. In virtual time each lets the clock go on; in real time each waits for its time.

    Times are those of the robot's clock [s].
    """

    def __init__(self) -> None:
        self._last: tuple[float, Joints] | None = None  # when the last joints were sent, and these
        self._moves = False  # more than one target of joints was sent
        self._wish: Transform | None = None  # where the tool is dragged to
        self._wished = -inf  # when that was sent

    def steer(self, robot: Supervisor, joints: Joints, rate: float, speed: float | None) -> None:
        """Send joints [rad, m], 1 / `rate` after those before at the earliest."""
        step = 1.0 / rate
        if self._last is not None:
            self._pace(robot, self._last[0] + step)
        now, last = robot.now, self._last
        since = LONGEST + 1.0 if last is None else max(now - last[0], step)
        self._moves, self._wish = since <= LONGEST, None
        velocity = None
        if last is not None and self._moves:
            velocity = tuple([(b - a) / since for a, b in zip(last[1], joints, strict=True)])
        self._last = None  # a target that is refused ends the stream
        robot.send(Steer(joints, velocity, step, speed))
        self._last = now, joints

    def drag(self, robot: Supervisor, T_world_tool: Transform) -> Shortfall:
        """Send a wish for the tool, a TICK after the one before at the earliest."""
        self._pace(robot, self._wished + TICK)
        self._last, self._wish = None, None
        self._wished = robot.now
        held = robot.act(DragTool(T_world_tool))
        self._wish = T_world_tool
        return held

    def arrive(self, robot: Supervisor) -> None:
        """Come to rest at the last target, where the robot still goes after it."""
        last, wish, timeline = self._last, self._wish, robot.timeline
        self._last = self._wish = None
        text = timeline[len(timeline) - 1].motion.text
        if last is not None and text == STEER and self._moves:
            robot.act(Steer(last[1]))
        elif wish is not None and text == DRAG:
            self._arrive_dragging(robot, wish)

    def _arrive_dragging(self, robot: Supervisor, wish: Transform) -> None:
        until = robot.now + LONGEST_ARRIVAL
        while robot.now < until:
            self.drag(robot, wish)
            here, left = robot.at(), robot.at(robot.timeline.end)
            if max(map(abs, here.velocity)) < STANDS and largest_change(here.joints, left.joints) < STANDS:
                break
        self._wish = None
        robot.act(DragTool())

    def release(self, robot: Supervisor) -> None:
        """Forget the targets: the robot was stopped here."""
        self._last = None
        if self._wish is not None:
            self._wish = None
            robot.act(DragTool())

    @staticmethod
    def _pace(robot: Supervisor, due: float) -> None:
        """In real time: wait until the robot's clock shows a time [s]."""
        rate = robot.followed.rate
        if rate is not None and (left := due - robot.now) > 0.0:
            time.sleep(left / rate)
