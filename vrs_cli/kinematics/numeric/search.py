"""Search joints for a pose: by damped least squares, by Newton's method, and by descent to the nearest reachable pose.

The search is the Levenberg-Marquardt method with the damping of Sugihara (2011), a fraction of the squared error: far
from the goal a step follows the gradient, near the goal it is a step of Newton's method. A search within the limits
stops joints at a limit that they would pass, and may get stuck there. A search without limits does not get stuck, and
three in four of its results can be brought inside the limits by whole turns. So the solver tries both. Searches start
from the near joints, and from the sample joints that bring the tool nearest to the pose: from a few at first, and from
more if the first searches find no solution. So the same location always has the same solution. For an arm with fewer
than six joints a pose counts as reached if the error does not show in three decimals.

A redundant arm reaches one pose with many joint vectors. A MOVE takes the result of the search that starts at the
current joints. On a straight line guides prescribe sums of joints (`numeric.arm`), so the joints depend only on the
pose and the time.

`newton` generates Python code for one arm that computes one step of Newton's method, and the joint rates. Velocities
are those of the point of the flange at the origin of the base, where the Jacobian has the most zeros.

`Aim.nearest` minimises the squared distance of the tool from a pose plus, with less weight, its squared rotation error.
It takes the same steps as the search, within the bounds (`step_within`), but none that increases the error, so the arm
never jumps. The steps end at the locally nearest pose, so a dragged tool slides along the edge of the reach.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from math import atan2, cos, hypot, sin, sqrt
from operator import mul
from typing import Any, NamedTuple, cast

from vrs_cli.kinematics import compiled
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Demands, JointKind, Joints, Twist
from vrs_cli.kinematics.model import ArmTask, Link
from vrs_cli.kinematics.transform import IDENTITY, Transform, Vector, compose, cross, dot

CONVERGED = 1e-10  # [m, rad] a search has succeeded if all components of the error are smaller
STEPS = 60  # maximum number of steps of a search; nearly all searches end sooner
LARGEST_STEP = 0.5  # [rad, m] maximum change of a joint in one step
# damping of the least-squares step, as a fraction of the squared error; constant added to it
DAMPING, LEAST_DAMPING = 0.1, 1e-13
HOPELESS = 1e-3  # a search is given up if its steps are smaller than this fraction of the error and do not grow
NEWTON = 1e-3  # [m2, rad2] below this damping an undamped Newton step is taken instead, which takes half the time
# `guided_state` gives up Newton's method after a larger step [rad, m], or after this number of steps
SHORT, FEW = 0.35, 6
# [rad, m] `guided_state` compares the first step of Newton's method with this size, as if it were the previous step
LAST = 1e-6


def missing(task: ArmTask, have: Transform, want: Transform) -> Twist:
    """Return the displacement [m] and the rotation vector [rad] from the pose `have` to the pose `want`, in the axes of
    the base.
    """
    points = task is ArmTask.POINTING
    a, b = (have.ax, have.ay, have.az), (want.ax, want.ay, want.az)
    turn = turn_between(a, b) if points else rotation_vector(have, want)
    return want.px - have.px, want.py - have.py, want.pz - have.pz, *turn


def turn_between(a: Vector, b: Vector) -> Vector:
    """Return the rotation vector of the smallest rotation from direction a to direction b [rad]."""
    return as_long_as_angle(cross(a, b), dot(a, b))


def rotation_vector(have: Transform, want: Transform) -> Vector:
    """Return the rotation vector from the orientation of `have` to that of `want` (of R_want R_have^T), in the axes of
    the base [rad].
    """
    h, w = have, want
    x = 0.5 * (h.ny * w.nz - h.nz * w.ny + h.sy * w.sz - h.sz * w.sy + h.ay * w.az - h.az * w.ay)
    y = 0.5 * (h.nz * w.nx - h.nx * w.nz + h.sz * w.sx - h.sx * w.sz + h.az * w.ax - h.ax * w.az)
    z = 0.5 * (h.nx * w.ny - h.ny * w.nx + h.sx * w.sy - h.sy * w.sx + h.ax * w.ay - h.ay * w.ax)
    trace = (
        h.nx * w.nx + h.ny * w.ny + h.nz * w.nz
        + h.sx * w.sx + h.sy * w.sy + h.sz * w.sz
        + h.ax * w.ax + h.ay * w.ay + h.az * w.az
    )  # fmt: skip
    return as_long_as_angle((x, y, z), 0.5 * (trace - 1.0))


def as_long_as_angle(v: Vector, cosine: float) -> Vector:
    """Return v, scaled so that its length is an angle [rad] in place of the sine of this angle. `cosine`: the cosine of
    the angle.
    """
    sine = hypot(*v)
    small = sine < 1e-12  # the angle is 0, or 180 deg with an unknown axis: use any, because the next step corrects it
    x = 1e-3 if small and cosine <= 0.0 else v[0]
    factor = 1.0 if small else atan2(sine, cosine) / sine
    return x * factor, v[1] * factor, v[2] * factor


SIDES = 2  # number of right sides of the equations: the errors, and the wanted rates
NO_TWIST: Twist = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

Newton = Callable[[Joints, Transform, Demands, Twist, Sequence[float]], tuple[Joints, Joints] | None]


@cache
def newton(links: tuple[Link, ...], base: Transform, flange: Transform) -> Newton:
    """Generate for an arm the function `newton(q, T, demands, twist, rates)`, which returns one Newton step and the
    joint rates at q.

    The step leads from q towards the pose T of the flange and the sums of joints in `demands` (one for each joint
    beyond six). The joint rates give the flange the twist `twist`, and they give the sums the rates in `rates`. The
    result is None if q is singular.
    """
    names: dict[str, Any] = {
        "cos": cos,
        "sin": sin,
        "turned": as_long_as_angle,
        "SMALL": compiled.SMALL,
        "LARGE": compiled.LARGE,
    }
    exec(compile(_StepWriter(links, base, flange).step_text(), "<newton>", "exec"), names)
    return cast(Newton, names["newton"])


class _StepWriter(compiled.Writer):
    """Generates the code of `newton`. Velocities are those of the point of the flange that is at the origin of the
    base.
    """

    def step_text(self) -> str:
        count = len(self.links)
        weights = [[f"g{k}_{i}" for i in range(count)] for k in range(count - 6)]
        head = [self.unpack_line("q", "q")]
        head += [f"{compiled.comma_list(f'p{i}' for i in range(12))} = T"]
        head += [f"{compiled.comma_list(f'u{i}' for i in range(6))} = twist"]
        if weights:
            demands = (f"(({compiled.comma_list(row)}), v{k})" for k, row in enumerate(weights))
            head += [f"{compiled.comma_list(demands)} = demands"]
            head += [f"{compiled.comma_list(f'r{k}' for k in range(len(weights)))} = rates"]
        *have, o = self.columns
        v, w, turn = ("u0", "u1", "u2"), ("u3", "u4", "u5"), ("x", "y", "z")
        missing = *self.add_crosses(self._missing(have), (o, turn)), *turn
        rows = list[tuple[compiled.Entry, ...]]()  # of the Jacobian and the two right sides, transposed
        for link, (z, at) in zip(self.links, self.axes, strict=True):
            rows.append((*z, *compiled.STILL) if link.kind is JointKind.PRISMATIC else (*self.cross(at, z), *z))
        table = list(zip(*rows, missing, (*self.add_crosses(v, (o, w)), *w), strict=True))
        for k, row in enumerate(weights):
            products = [(compiled.minus(x), f"q{i}") for i, x in enumerate(row)]
            table.append((*row, self.sum([(1.0, f"v{k}"), *products]), f"r{k}"))
        for r, entries in enumerate(sorted(table, key=lambda row: row[0] == 0.0)):
            self.lines += [f"a{r}_{c} = {compiled.text_of(x)}" for c, x in enumerate(entries)]
        found = (compiled.comma_list(f"x{k}_{side}" for k in range(count)) for side in range(SIDES))
        lines = [*head, *self.lines, *compiled.elimination_lines(count, SIDES)]
        lines += [f"return {compiled.comma_list(f'({one})' for one in found)}"]
        return compiled.function("newton(q, T, demands, twist, rates)", lines)

    def _missing(self, have: Sequence[compiled.Column]) -> compiled.Column:
        """Add lines that compute the rotation vector (`x`, `y`, `z`) to the pose T. Return the displacement to it."""
        *want, p = [(f"p{i}", f"p{i + 4}", f"p{i + 8}") for i in range(4)]
        x, y, z = map(compiled.text_of, self.add_crosses(compiled.STILL, *zip(have, want, strict=True)))
        trace = self.sum([pair for a, b in zip(have, want, strict=True) for pair in zip(a, b, strict=True)])
        self.lines.append(
            f"x, y, z = turned((0.5 * {x}, 0.5 * {y}, 0.5 * {z}), 0.5 * ({compiled.text_of(trace)} - 1.0))"
        )
        return self.mix((1.0, p), (-1.0, self.columns[3]))


LEVER = 0.1  # fraction of the arm's length; an angle [rad] times this length is compared with distances [m]
SLIGHT = 0.05  # factor of LEVER for the task STEADY, so that the position matters more than the orientation
NEAREST_STEPS = 6  # maximum number of steps of `Aim.nearest`
CLOSE = 1e-18  # [m2] `Aim.nearest` ends if the squared error is smaller
NEAREST_DAMPING = 0.05  # damping in `Aim.nearest`, as a fraction of the squared error
MIN_DAMPING_M2, MAX_DAMPING_M2 = 1e-9, 5e-4  # [m2] minimum and maximum damping in `Aim.nearest`
# weight of a distance beyond the border to the other side of axis 1, relative to a distance from the pose
HEAVY = 100.0
DIFFERENCE = 1e-7  # [rad, m] change of a joint with which `Side.slope` computes difference quotients


class Miss(NamedTuple):
    """The distance [m] and the angle [rad] between a tool and a pose; only the parts of a pose that count for the robot
    are compared.
    """

    away: float
    turned: float

    def within(self, away: float, turned: float) -> bool:
        return self.away <= away and self.turned <= turned


class Nearest(NamedTuple):
    """The result of a search for the nearest reachable pose.

    `gain`: by which fraction the distance from the pose became smaller (1: the tool reaches the pose). `pressed`: for
    each joint -1 if its lower bound stops it, 1 if its upper bound stops it, else 0.
    """

    joints: Joints
    gain: float
    pressed: tuple[int, ...]


class Side(NamedTuple):
    """The side of axis 1 on which an arm must stay. `sign`: -1 for RIGHTY, 1 for LEFTY. `margin`: the least distance
    from axis 1 [m].
    """

    arm: RobotArm
    sign: float
    margin: float

    def room(self, q: Joints) -> float:
        """Return how far the arm is from the border of this side (axis 1 plus the margin) [m]. The distance is negative
        if the arm is beyond the border.
        """
        return self.sign * self.arm.outward(q) - self.margin

    def slope(self, q: Joints) -> Joints:
        room = self.room(q)
        return tuple((self.room((*q[:i], x + DIFFERENCE, *q[i + 1 :])) - room) / DIFFERENCE for i, x in enumerate(q))


class Aim:
    """A pose of a tool, T_base_flange T_flange_tool, that an arm tries to reach. If `side` is given, the arm stays on
    this side of axis 1.
    """

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
        """Search by descent from joints q within the bounds, and return the joints that bring the tool nearest to the
        pose.
        """
        rows, error = self._linear(q)
        first = cost = self._cost(q, error)
        damping = min(max(NEAREST_DAMPING * cost, MIN_DAMPING_M2), MAX_DAMPING_M2)
        for _ in range(NEAREST_STEPS):
            if cost <= CLOSE:
                break
            there = self._step(q, rows, error, damping, lower, upper)
            rows_there, error_there = self._linear(there)
            after = self._cost(there, error_there)
            if after >= cost:
                damping *= 10.0  # factor of the damping after a step that did not reduce the error
                continue
            gained, q, rows, error, cost = cost - after, there, rows_there, error_there, after
            if gained < 1e-4 * cost:  # the search ends if a step reduces the squared error by less than this fraction
                break
            damping = min(max(NEAREST_DAMPING * cost, MIN_DAMPING_M2), damping)
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
        """Return the joints after one step. If the step would cross the border of `side`, take a step along the border
        instead.
        """
        room = [(low - x, high - x) for x, low, high in zip(q, lower, upper, strict=True)]
        there = _move_within(q, step_within(rows, error, damping, room), lower, upper)
        if self.side is None or self.side.room(there) >= min(left := self.side.room(q), 0.0):
            return there
        beside = tuple([HEAVY * x for x in self.side.slope(q)])
        return _move_within(q, step_within([*rows, beside], [*error, -HEAVY * left], damping, room), lower, upper)

    def _cost(self, q: Joints, error: Sequence[float]) -> float:
        beyond = 0.0 if self.side is None else min(self.side.room(q), 0.0)
        return sum([e * e for e in error]) + (HEAVY * beyond) ** 2

    def _linear(self, q: Joints) -> tuple[list[Joints], list[float]]:
        """Return the rows of the tool's Jacobian that count for the task, and the error of the tool; angles are
        converted to lengths by `lever` [m].
        """
        arm, lever, places = self.arm, self.lever, self.places
        twist = missing(self.task, compose(arm.forward(q), self.tool), self.pose)
        rows, error = arm.rows_that_count(q, arm.jacobian(q, self.tool), twist)
        turns = [tuple([lever * x for x in row]) for row in rows[places:]]
        return [*rows[:places], *turns], [*error[:places], *[lever * e for e in error[places:]]]


_NO_ROWS = ((0.0,),) * 6


def _move_within(q: Joints, change: Sequence[float], lower: Joints, upper: Joints) -> Joints:
    rows = zip(q, change, lower, upper, strict=True)
    return tuple([min(max(x + dx, low), high) for x, dx, low, high in rows])


def step_within(
    rows: Sequence[Joints], error: Sequence[float], damping: float, room: Sequence[tuple[float, float]]
) -> tuple[float, ...]:
    """Return the damped least-squares step d that makes `rows` d equal to `error`. `room`: the bounds of each component
    of d, which include 0; empty if there are none.

    Components that leave their bounds are held at the bounds, and the step is computed again for the others. A held
    component that would then move inwards is released, once.
    """
    held, kept = dict[int, float](), set[int]()  # `kept`: the components that are not released again
    while True:
        free = tuple([i for i in range(len(rows[0])) if i not in held])
        J = [tuple([row[i] for i in free]) for row in rows] if held else rows
        left = (
            [e - sum([row[i] * x for i, x in held.items()]) for e, row in zip(error, rows, strict=True)]
            if held
            else error
        )
        newton = compiled.squares(J, left) if len(free) == len(J) and damping < NEWTON else None
        part = newton[0] if newton else compiled.solve_damped(J, left, damping) if free else ()
        outside = {i: x for i, x in zip(free, part, strict=True) if room and not room[i][0] <= x <= room[i][1]}
        if not outside and not held:
            return part
        if outside:
            held |= {i: min(max(x, room[i][0]), room[i][1]) for i, x in outside.items()}
            continue
        left = [e - sum(map(mul, row, part)) for e, row in zip(left, J, strict=True)]
        columns = [(i, column) for i, column in enumerate(zip(*rows, strict=True)) if i in held and i not in kept]
        pulls = {i: sum(map(mul, column, left)) - damping * held[i] for i, column in columns}
        inwards = {i for i, pull in pulls.items() if (pull > 0.0 if held[i] == room[i][0] else pull < 0.0)}
        if not inwards:
            return tuple([x for _, x in sorted([*held.items(), *zip(free, part, strict=True)])])
        kept |= inwards
        held = {i: x for i, x in held.items() if i not in inwards}
