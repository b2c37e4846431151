"""Any serial arm, without a closed form: damped least squares, within the limits of the joints.

Levenberg and Marquardt with the damping of Sugihara (2011), half the squared error: far from the goal a step follows
the gradient, near it it is Newton's. Joints at a limit that would leave it are held. Starts: the joints that are near,
then a fixed sequence of others in the joints' ranges, so that the same question always has the same answer.

An arm with fewer joints than six reaches a pose or does not; what misses by less than three decimals tell is reached.

An arm with more joints than the task has parts can be at one place in many ways. A MOVE takes what the search finds
from where the arm is. On a straight line the joints that are one too many stand still, which makes it definite: the
joints are then a function of the pose alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import islice
from math import atan2, degrees, hypot, inf, sqrt
from random import Random
from typing import TYPE_CHECKING

from vrs_cli.errors import JointOutOfRange, LocationOutOfRange, LocationTooFar
from vrs_cli.kinematics.configuration import Arm, Configuration, Elbow, Wrist
from vrs_cli.kinematics.elimination import determinant, solve, square
from vrs_cli.kinematics.jacobian import Jacobian, Singularity, Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.serial_arm import LEVEL, STRAIGHT, SerialArm
from vrs_cli.kinematics.task import Task
from vrs_cli.kinematics.transform import Transform

if TYPE_CHECKING:
    from vrs_cli.kinematics.continuation import Continuation
    from vrs_cli.kinematics.numeric_batch import NumericBatch
    from vrs_cli.kinematics.serial_batch import Floats

CONVERGED = 1e-10  # [m, rad] an error that is none
STEPS = 60  # of one search
LARGEST_STEP = 0.5  # [rad, m] of a joint
LEAST_DAMPING = 1e-13
HOPELESS = 1e-3  # a step, as a part of the error, from which steps that do not grow lead nowhere
NEWTON = 1e-3  # [m2, rad2] with less damping the step is Newton's, which costs half
STARTS = 40  # beside the middle of the ranges
ENOUGH = 3  # solutions among which the nearest is taken
SEED = 560
MEASURED = 16  # poses of a range over which freedoms are measured


class NumericArm(SerialArm):
    """Documented in `arm.RobotArm`. There is one way, without words."""

    seed_step = 0.1
    method = "damped least squares within the limits"

    def __init__(self, model: RobotModel) -> None:
        super().__init__(model)
        self._all = tuple(range(model.joint_count))
        self.short = model.joint_count < model.task.size  # of joints: most poses are out of its task

    # --- redundancy ------------------------------------------------------------------------------------------

    @cached_property
    def held(self) -> tuple[int, ...]:
        """The joints, by index, that stand still on a straight line: those that the others miss least."""
        held: tuple[int, ...] = ()
        while self.model.joint_count - len(held) > self.model.task.size:
            rest = [i for i in self._all if i not in held]
            held += (max(rest, key=lambda i: self._freedom([k for k in rest if k != i])),)
        return held

    @cached_property
    def _mean_freedom(self) -> float:
        return self._freedom(self._all) / MEASURED

    def _freedom(self, joints: Sequence[int]) -> float:
        """How well these joints alone move the flange: the sum of Yoshikawa's measure over some poses."""
        total = 0.0
        for q in islice(self._others(), MEASURED):
            rows, _ = self._counted(q, self.jacobian(q), (0.0,) * 6)
            rows = [tuple(row[i] for i in joints) for row in rows]
            gram = [[sum(a * b for a, b in zip(u, v, strict=True)) for v in rows] for u in rows]
            total += sqrt(max(determinant(gram), 0.0))
        return total

    def _rates(self, q: Joints, J: Jacobian, twist: Twist) -> Joints:
        rows, wanted = self._counted(q, J, twist)
        if self.held:
            rows = [tuple(0.0 if i in self.held else x for i, x in enumerate(row)) for row in rows]
        if self.short:
            columns = list(zip(*rows, strict=True))
            wanted = [sum([a * v for a, v in zip(column, wanted, strict=True)]) for column in columns]
            rows = [tuple([sum([a * b for a, b in zip(u, v, strict=True)]) for v in columns]) for u in columns]
        return self._solved(q, rows, wanted)

    def _others(self) -> Iterator[Joints]:
        random = Random(SEED)
        while True:
            yield tuple(random.uniform(low, high) for low, high in self._limits)

    def starts(self) -> Iterator[Joints]:
        """Where a search begins that has no joints near: the middle of the ranges, then a fixed sequence."""
        yield self._middle
        yield from islice(self._others(), STARTS)

    # --- inverse ---------------------------------------------------------------------------------------------

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:  # noqa: ARG002
        q, _ = self._search(T, near, [i for i in self._all if i not in self.held], bounded=False)
        return q

    def branches(self, T: Transform) -> tuple[Joints | None, ...]:
        q, _ = self._search(T, self._middle, self._all, bounded=True)
        if q is not None:
            return (q,)
        found = self._solutions(T, self._middle)
        if found:
            return (min(found, key=lambda q: self._duration(self._middle, q)),)
        q, _ = self._search(T, self._middle, self._all, bounded=False)
        return (None if q is None else self._best_turns(q),)

    def select(
        self,
        T: Transform,
        near: Joints,
        *,
        arm: Arm | None = None,  # noqa: ARG002 (this arm has no words)
        elbow: Elbow | None = None,  # noqa: ARG002
        wrist: Wrist | None = None,  # noqa: ARG002
    ) -> Joints:
        self.check_task(T)
        q, _ = self._search(T, near, self._all, bounded=True)
        if q is not None:
            return q
        found = self._solutions(T, near)
        if not found:
            raise self._nowhere(T, near)
        return min(found, key=lambda q: self._duration(near, q))

    def _solutions(self, T: Transform, near: Joints) -> list[Joints]:
        """Inside the limits: the first that are found, from all starts at once."""
        import numpy as np

        starts = np.array(list(self.starts()))
        poses = np.broadcast_to(np.reshape(T, (3, 4)), (len(starts), 3, 4))
        found = self._batch.search(poses, starts, bounded=True, enough=ENOUGH)
        turned = (self._inside(tuple(q), near) for q in found[~np.isnan(found[:, 0])].tolist())
        return [q for q in turned if q is not None]

    def _nowhere(self, T: Transform, near: Joints) -> LocationOutOfRange | JointOutOfRange:
        q, _ = self._search(T, near, self._all, bounded=False)
        if q is not None and self._outside(best := self._best_turns(q)):
            return self._joint_refusal(best, "turn the location, or move it nearer")
        refusal = self._out_of_reach(T, self.ways[0], "")
        away, turned = self._search(T, near, self._all, bounded=True)[1]
        hint = None
        if self.short and not isinstance(refusal, LocationTooFar):
            hint = f"{self.model.joint_count} joints cannot turn the tool every way: teach the location by HERE"
        nearest = f"the search from here comes as near as {1000 * away:.1f} mm and {degrees(turned):.1f} deg"
        return refusal.reworded(f"{refusal.detail}; {nearest}", hint)

    @cached_property
    def continuation(self) -> Continuation | None:  # type: ignore[override] # made when asked for: it brings numpy
        from vrs_cli.kinematics.continuation import Continuation

        return None if self.short else Continuation(self)

    def missed_batch(self, q: Floats, T: Floats) -> tuple[Floats, Floats]:
        """`_error` over arrays: (N, n) and (N, 3, 4) -> (N, m, n) and (N, m)."""
        return self._batch.error(q, T)

    @cached_property
    def _batch(self) -> NumericBatch:
        from vrs_cli.kinematics.numeric_batch import NumericBatch

        return NumericBatch(self)

    def _search(
        self, T: Transform, q: Joints, free: Sequence[int], *, bounded: bool
    ) -> tuple[Joints | None, tuple[float, float]]:
        """Joints that reach T from the start q, moving only `free`; None, and the miss [m, rad], if they do not."""
        if not self.in_task(T):
            return None, (0.0, 0.0)
        held = [q[i] for i in self._all]
        before = inf
        for _ in range(STEPS):
            at = tuple(held)
            rows, error = self._error(at, T)
            if max(map(abs, error)) < CONVERGED:
                return at, (0.0, 0.0)
            step = self._step(at, rows, error, free, bounded=bounded)
            largest = max(map(abs, step))
            if self.short and largest < CONVERGED and self.reaches(at, T):
                return at, (0.0, 0.0)
            if largest <= before and largest < HOPELESS * max(map(abs, error)):
                break
            before = largest
            scale = min(1.0, LARGEST_STEP / largest) if largest else 0.0
            held = [x + scale * dx for x, dx in zip(at, step, strict=True)]
            if bounded:
                held = [min(max(x, low), high) for x, (low, high) in zip(held, self._limits, strict=True)]
        return None, self._miss(tuple(held), T)

    def reaches(self, q: Joints, T: Transform) -> bool:
        away, turned = self._miss(q, T)
        return away <= LEVEL and turned <= STRAIGHT

    def _step(
        self, q: Joints, rows: Sequence[Joints], error: Sequence[float], free: Sequence[int], *, bounded: bool
    ) -> tuple[float, ...]:
        """The damped step; again without the joints that it would push out of their range."""
        damping = 0.5 * sum([e * e for e in error]) + LEAST_DAMPING
        free = list(free)
        while True:
            J = [[row[i] for i in free] for row in rows]
            newton = square(J, error) if len(free) == len(J) and damping < NEWTON else None
            part = newton or _damped(J, error, damping)
            pushed = [i for i, dx in zip(free, part, strict=True) if bounded and self._leaves(i, q[i], dx)]
            if not pushed:
                break
            free = [i for i in free if i not in pushed]
        step = [0.0] * len(q)
        for i, dx in zip(free, part, strict=True):
            step[i] = dx
        return tuple(step)

    def _leaves(self, joint: int, x: float, dx: float) -> bool:
        low, high = self._limits[joint]
        return (x <= low and dx < 0.0) or (x >= high and dx > 0.0)

    def _error(self, q: Joints, T: Transform) -> tuple[list[Joints], list[float]]:
        """Rows of the Jacobian that count, and what is missing in them [m, rad]."""
        return self._counted(q, self.jacobian(q), self._missing(self.forward(q), T))

    def _missing(self, have: Transform, want: Transform) -> Twist:
        if self.model.task is Task.POINTING:
            turn = _turn_between((have.ax, have.ay, have.az), (want.ax, want.ay, want.az))
        else:
            turn = _rotation_vector(have, want)
        return want.px - have.px, want.py - have.py, want.pz - have.pz, *turn

    def _miss(self, q: Joints, T: Transform) -> tuple[float, float]:
        counts = self.model.task.counts
        x, y, z, *turn = self._missing(self.forward(q), T)
        away = [v for v, counted in zip((x, y, z), counts, strict=False) if counted]
        return hypot(*away), hypot(*turn) if self.model.task.turns else 0.0

    def singularity(self, q: Joints) -> Singularity:
        """`elbow`: the freedom of this pose beside the mean of all; there is no telling which joints it is."""
        rows, _ = self._counted(q, self.jacobian(q), (0.0,) * 6)
        gram = [[sum(a * b for a, b in zip(u, v, strict=True)) for v in rows] for u in rows]
        mean = self._mean_freedom
        return Singularity(1.0, min(sqrt(max(determinant(gram), 0.0)) / mean, 1.0) if mean else 1.0, 1.0)


def _damped(J: Sequence[Sequence[float]], error: Sequence[float], damping: float) -> list[float]:
    """J^T (J J^T + damping)^-1 error: no larger than the task, however many joints there are."""
    gram = [[sum([a * b for a, b in zip(u, v, strict=True)]) for v in J] for u in J]
    for k, row in enumerate(gram):
        row[k] += damping
    weights = solve(gram, error) or (0.0,) * len(J)
    return [sum([w * a for w, a in zip(weights, column, strict=True)]) for column in zip(*J, strict=True)]


Turn = tuple[float, float, float]


def _turn_between(a: Turn, b: Turn) -> Turn:
    """The shortest rotation vector that brings direction a to b."""
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return _scaled((x, y, z), a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _rotation_vector(have: Transform, want: Transform) -> Turn:
    """The rotation vector of R_want R_have^T, about axes of the base [rad]."""
    h, w = have, want
    x = 0.5 * (h.ny * w.nz - h.nz * w.ny + h.sy * w.sz - h.sz * w.sy + h.ay * w.az - h.az * w.ay)
    y = 0.5 * (h.nz * w.nx - h.nx * w.nz + h.sz * w.sx - h.sx * w.sz + h.az * w.ax - h.ax * w.az)
    z = 0.5 * (h.nx * w.ny - h.ny * w.nx + h.sx * w.sy - h.sy * w.sx + h.ax * w.ay - h.ay * w.ax)
    trace = (
        h.nx * w.nx + h.ny * w.ny + h.nz * w.nz
        + h.sx * w.sx + h.sy * w.sy + h.sz * w.sz
        + h.ax * w.ax + h.ay * w.ay + h.az * w.az
    )  # fmt: skip
    return _scaled((x, y, z), 0.5 * (trace - 1.0))


def _scaled(v: Turn, cosine: float) -> Turn:
    """A vector as long as the sine of its angle made as long as the angle."""
    sine = hypot(*v)
    if sine < 1e-12:  # no turn, or half a turn: about any axis, the next step sees which
        return v if cosine > 0.0 else (1e-3, 0.0, 0.0)
    factor = atan2(sine, cosine) / sine
    return v[0] * factor, v[1] * factor, v[2] * factor
