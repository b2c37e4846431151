"""As near to a pose as joints within bounds bring a tool: by small steps downhill, from where they are.

Minimised is the squared way that the tool misses, and with less weight the turn. Each step is that of Levenberg and
Marquardt, the least of a quadratic form within a box, which is found by holding joints at their bounds one by one and
letting go those that would leave them inwards (the primal active-set method; Nocedal and Wright, "Numerical
Optimization", 2006, 16.5). It never goes uphill, so it never jumps; where it comes to rest the pose is the nearest one
around, which is what sliding along the edge of the reach means.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt
from typing import NamedTuple

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.elimination import gram, positive
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import ArmTask
from vrs_cli.kinematics.numeric.search import missing
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose

LEVER = 0.1  # of the arm's length: by that a turn [rad] weighs as much as a way [m]
SLIGHT = 0.05  # of that, where the tool is to be turned as nearly as can be: the place is not given up for it
STEPS = 6  # at most, of one search
FLAT = 1e-4  # of the squared miss: a step that gains less is the last
CLOSE = 1e-18  # [m2] a miss that is none
DAMPING = 0.05  # of the squared miss
LEAST_DAMPING, MOST_DAMPING = 1e-9, 5e-4  # [m2]
HEAVY = 100.0  # times the weight of a way, to stay on a side
DIFFERENCE = 1e-7  # [rad, m] of a joint, to see a slope
HARDER = 10.0  # times as much, after a step that led uphill


class Miss(NamedTuple):
    """How far a tool is from a pose, in what counts for the robot [m, rad]."""

    away: float
    turned: float

    def within(self, away: float, turned: float) -> bool:
        return self.away <= away and self.turned <= turned


class Nearest(NamedTuple):
    """The joints, by how much they gain on where they began (1: they are there), and those that their bounds hold
    back: below (-1), above (1).
    """

    joints: Joints
    gain: float
    pressed: tuple[int, ...]


class Side(NamedTuple):
    """Of the axis of joint 1, on which an arm stays: RIGHTY (-1) or LEFTY (1), and by how much at least [m]."""

    arm: RobotArm
    sign: float
    margin: float

    def room(self, q: Joints) -> float:
        """How far it is away from passing over [m]."""
        return self.sign * self.arm.outward(q) - self.margin

    def slope(self, q: Joints) -> Joints:
        room = self.room(q)
        return tuple((self.room((*q[:i], x + DIFFERENCE, *q[i + 1 :])) - room) / DIFFERENCE for i, x in enumerate(q))


class Aim:
    """A pose of the flange for a tool, T_base_flange T_flange_tool; an arm that has a `side` stays on it."""

    def __init__(
        self, arm: RobotArm, T_base_flange: Transform, T_flange_tool: Transform = IDENTITY, side: Side | None = None
    ) -> None:
        self.arm, self.flange, self.tool, self.side = arm, T_base_flange, T_flange_tool, side
        self.pose = compose(T_base_flange, T_flange_tool)
        self.task = arm.model.task
        self.places = sum(arm.model.counts[:3])
        self.lever = LEVER * arm.length * (SLIGHT if self.task is ArmTask.STEADY else 1.0)

    def miss(self, q: Joints) -> Miss:
        have = compose(self.arm.forward(q), self.tool)
        _, error = self.arm.rows_that_count(q, _NO_ROWS, missing(self.task, have, self.pose))
        turned = 0.0 if self.task is ArmTask.STEADY else hypot(*error[self.places :])
        return Miss(hypot(*error[: self.places]), turned)

    def nearest(self, q: Joints, lower: Joints, upper: Joints) -> Nearest:
        """From joints q, which are within the bounds."""
        rows, error = self._linear(q)
        first = cost = self._cost(q, error)
        damping = min(max(DAMPING * cost, LEAST_DAMPING), MOST_DAMPING)
        for _ in range(STEPS):
            if cost <= CLOSE:
                break
            there = self._step(q, rows, error, damping, lower, upper)
            rows_there, error_there = self._linear(there)
            after = self._cost(there, error_there)
            if after >= cost:
                damping *= HARDER
                continue
            gained, q, rows, error, cost = cost - after, there, rows_there, error_there, after
            if gained < FLAT * cost:
                break
            damping = min(max(DAMPING * cost, LEAST_DAMPING), damping)
        downhill = (sum([a * e for a, e in zip(column, error, strict=True)]) for column in zip(*rows, strict=True))
        pressed = tuple(
            [
                1 if x >= high and fall > 0.0 else -1 if x <= low and fall < 0.0 else 0
                for x, low, high, fall in zip(q, lower, upper, downhill, strict=True)
            ]
        )
        return Nearest(q, 1.0 - sqrt(cost / first) if first > CLOSE else 1.0, pressed)

    def _step(
        self, q: Joints, rows: Sequence[Joints], error: Sequence[float], damping: float, lower: Joints, upper: Joints
    ) -> Joints:
        """Where a step leads; one that would pass over to the other side is made along it."""
        room = [(low - x, high - x) for x, low, high in zip(q, lower, upper, strict=True)]
        there = _moved(q, bounded_step(rows, error, damping, room), lower, upper)
        if self.side is None or self.side.room(there) >= min(left := self.side.room(q), 0.0):
            return there
        beside = tuple([HEAVY * x for x in self.side.slope(q)])
        return _moved(q, bounded_step([*rows, beside], [*error, -HEAVY * left], damping, room), lower, upper)

    def _cost(self, q: Joints, error: Sequence[float]) -> float:
        beyond = 0.0 if self.side is None else min(self.side.room(q), 0.0)
        return sum([e * e for e in error]) + (HEAVY * beyond) ** 2

    def _linear(self, q: Joints) -> tuple[list[Joints], list[float]]:
        """The rows of the Jacobian that count and what the tool misses, both as lengths."""
        arm, lever, places = self.arm, self.lever, self.places
        twist = missing(self.task, compose(arm.forward(q), self.tool), self.pose)
        rows, error = arm.rows_that_count(q, arm.jacobian(q, self.tool), twist)
        turns = [tuple([lever * x for x in row]) for row in rows[places:]]
        return [*rows[:places], *turns], [*error[:places], *[lever * e for e in error[places:]]]


_NO_ROWS = ((0.0,),) * 6


def _moved(q: Joints, change: Sequence[float], lower: Joints, upper: Joints) -> Joints:
    rows = zip(q, change, lower, upper, strict=True)
    return tuple([min(max(x + dx, low), high) for x, dx, low, high in rows])


def bounded_step(
    rows: Sequence[Sequence[float]], error: Sequence[float], damping: float, room: Sequence[tuple[float, float]]
) -> list[float]:
    """The step d that makes |rows d - error|^2 + damping |d|^2 least, each d within its room, which holds 0."""
    columns = list(zip(*rows, strict=True))
    table = gram(columns)
    for k, row in enumerate(table):
        row[k] += damping
    slope = [sum([a * e for a, e in zip(column, error, strict=True)]) for column in columns]
    n = len(columns)
    d, held = [0.0] * n, [0] * n
    for _ in range(4 * n):
        free = [i for i in range(n) if not held[i]]
        wanted = [slope[i] - sum([table[i][k] * d[k] for k in range(n) if held[k]]) for i in free]
        best = positive([[table[i][k] for k in free] for i in free], wanted)
        part, blocking = (
            1.0,
            0,
        )  # of the way that is within the room, and the joint that ends it, counted from 1, signed
        for i, x in zip(free, best, strict=True):
            low, high = room[i]
            if x < low and (low - d[i]) > part * (x - d[i]):
                part, blocking = (low - d[i]) / (x - d[i]), -1 - i
            elif x > high and (high - d[i]) < part * (x - d[i]):
                part, blocking = (high - d[i]) / (x - d[i]), 1 + i
        for i, x in zip(free, best, strict=True):
            d[i] += part * (x - d[i])
        if blocking:
            held[abs(blocking) - 1] = 1 if blocking > 0 else -1
            d[abs(blocking) - 1] = room[abs(blocking) - 1][blocking > 0]
            continue
        pull = [held[i] * (sum([a * b for a, b in zip(table[i], d, strict=True)]) - slope[i]) for i in range(n)]
        inwards = max(range(n), key=lambda i: pull[i] if held[i] else 0.0)
        if not held[inwards] or pull[inwards] <= 0.0:
            break
        held[inwards] = 0
    return d
