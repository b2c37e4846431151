"""Run many searches of a numerical arm at once, each row independently."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats
from vrs_cli.kinematics.clearance import Unchanging
from vrs_cli.kinematics.joints import NONE, Configuration, Joints
from vrs_cli.kinematics.model import LEVEL, STRAIGHT, ArmTask, RobotModel
from vrs_cli.kinematics.numeric.search import CONVERGED, DAMPING, FREE_STEPS, LARGEST_STEP, LEAST_DAMPING, STEPS, rounds
from vrs_cli.kinematics.serial_batch import SerialBatch
from vrs_cli.kinematics.transform import Transform

SINGULAR = 5e-9  # [m, rad] allowed error in a singular pose, where steps do not lessen it


class NumericBatch(SerialBatch):
    """`NumericArm` over arrays. Rows that do not converge are NaN."""

    def __init__(self, model: RobotModel, unchanging: Unchanging, held: tuple[int, ...]) -> None:
        super().__init__(model, (NONE,), unchanging)
        self.still_joints, self.short = held, model.joint_count < model.task.size
        self.counts = np.array(model.counts)

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        """Return for each pose the joints from the first start whose search succeeds."""
        q, middle = np.full((len(T), self.joints), np.nan), (self.lower + self.upper) / 2
        for start in next(rounds(self.model, tuple(middle))):
            for bounded in (False, True):
                missing = np.flatnonzero(np.isnan(q[:, 0]))
                if not len(missing):
                    break
                found = self.turned_near(self.search(T[missing], np.array(start), bounded=bounded), middle)
                q[missing] = np.where(self.inside(found)[:, None], found, np.nan)
        return q[:, None], self.inside(q)[:, None]

    def solutions(self, T: Transform, near: Joints, inside: Callable[[Joints, Joints], Joints | None]) -> list[Joints]:
        """Return joints of one pose inside the limits, nearest to `near`, from the first round of starts that finds
        any.
        """
        for begin in rounds(self.model, near):
            poses = np.broadcast_to(np.reshape(T, (3, 4)), (len(begin), 3, 4))
            for bounded in (False, True):
                q = self.search(poses, np.array(begin), bounded=bounded, steps=STEPS if bounded else FREE_STEPS)
                turned = [inside(tuple(row), near) for row in q[~np.isnan(q[:, 0])].tolist()]
                if found := [joints for joints in turned if joints is not None]:
                    return found
        return []

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:  # noqa: ARG002
        axes = np.eye(self.joints)[list(self.still_joints)]
        return self.solve_guided(
            T, near, axes, np.broadcast_to(near, (len(T), self.joints))[:, list(self.still_joints)]
        )

    def solve_guided(self, T: Floats, near: Floats, weights: Floats, values: Floats) -> Floats:
        return self.search(T, near, bounded=False, guides=(weights, values))

    def search(
        self, T: Floats, near: Floats, *, bounded: bool, guides: tuple[Floats, Floats] | None = None, steps: int = STEPS
    ) -> Floats:
        """Return joints (N, n) for poses (N, 3, 4) from starts (N, n) or (n,).

        `guides`: the weights (r, n) of sums of the joints, and their values (N, r).
        """
        q = np.array(np.broadcast_to(near, (len(T), self.joints)))
        found = np.full_like(q, np.nan)
        rows = np.flatnonzero(self.in_task(T))
        for _ in range(steps):
            if not len(rows):
                break
            J, error = self.error(q[rows], T[rows])
            if guides is not None:
                weights, values = guides
                J, error = with_guides(J, error, q[rows], weights, values[rows])
            done = np.abs(error).max(axis=1) < CONVERGED
            before = q[rows]
            q[rows] = self._next_joints(before, J, error, bounded=bounded)
            found[rows[done]] = q[rows[done]]  # one more step than needed, so that results agree
            rows, before = rows[~done], before[~done]
            if self.short:
                stuck = rows[np.abs(q[rows] - before).max(axis=1) < CONVERGED]
                missing = self._missing(self.forward(q[stuck]), T[stuck])
                away, turned = np.linalg.norm(missing[:, :3], axis=1), np.linalg.norm(missing[:, 3:], axis=1)
                there = stuck[(away <= LEVEL) & (turned <= STRAIGHT)]  # the error is less than three decimals show
                found[there] = q[there]
                rows = np.setdiff1d(rows, stuck)
        if guides is None and len(rows):  # a single pose, not a line
            there = rows[np.abs(self.error(q[rows], T[rows])[1]).max(axis=1) < SINGULAR]
            found[there] = q[there]
        return found

    def _next_joints(self, q: Floats, J: Floats, error: Floats, *, bounded: bool) -> Floats:
        """Return the joints after one damped step, without the joints that it would push out of their range."""
        still = np.zeros(q.shape, dtype=np.bool_)
        step = self._step(J, error, still)
        if bounded:
            for _ in range(self.joints):
                pushed = ~still & (((q <= self.lower) & (step < 0.0)) | ((q >= self.upper) & (step > 0.0)))
                if not pushed.any():
                    break
                still |= pushed
                step = self._step(J, error, still)
        largest = np.abs(step).max(axis=1, keepdims=True)
        q = q + step * np.minimum(1.0, LARGEST_STEP / np.maximum(largest, 1e-300))
        return np.clip(q, self.lower, self.upper) if bounded else q

    def _step(self, J: Floats, error: Floats, still: Flags) -> Floats:
        J = np.where(still[:, None, :], 0.0, J)
        damping = DAMPING * (error * error).sum(axis=1) + LEAST_DAMPING
        gram = J @ np.swapaxes(J, 1, 2) + damping[:, None, None] * np.eye(J.shape[1])
        step: Floats = np.einsum("nij,ni->nj", J, np.linalg.solve(gram, error[..., None])[..., 0])
        return step

    def error(self, q: Floats, T: Floats) -> tuple[Floats, Floats]:
        """Return the rows of the Jacobian that count (N, m, n) and the error in them (N, m) [m, rad].

        Turns are about the axes of the flange.
        """
        have, J = self.forward_and_jacobian(q)
        missing = self._missing(have, T)
        if self.counts.all():
            return J, missing
        turned = np.einsum("nji,nj->ni", have[..., :3], missing[:, 3:])
        missing = np.concatenate((missing[:, :3], turned), axis=1)
        return self._that_count(have, J), missing[:, self.counts]

    def rows(self, q: Floats) -> Floats:
        """Return the rows of the Jacobian that count (N, m, n)."""
        return self.jacobian(q) if self.counts.all() else self._that_count(*self.forward_and_jacobian(q))

    def _that_count(self, have: Floats, J: Floats) -> Floats:
        turned = np.swapaxes(have[..., :3], -1, -2) @ J[:, 3:]
        return np.concatenate((J[:, :3], turned), axis=1)[:, self.counts]

    def _missing(self, have: Floats, T: Floats) -> Floats:
        """Return the displacement and the turn from poses of the flange to other poses (N, 6) [m, rad]."""
        if self.model.task is ArmTask.POINTING:
            a, b = have[..., 2], T[..., 2]
            turn = _as_long_as_angle(np.cross(a, b), (a * b).sum(axis=1))
        else:
            h, w = have[..., :3], T[..., :3]
            v = 0.5 * np.cross(h, w, axis=1).sum(axis=2)
            turn = _as_long_as_angle(v, 0.5 * ((h * w).sum(axis=(1, 2)) - 1.0))
        return np.concatenate((T[..., 3] - have[..., 3], turn), axis=1)


def with_guides(J: Floats, error: Floats, q: Floats, weights: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return rows of the Jacobian (N, m, n) and the error (N, m) with those of r guides added: (N, m + r, ...)."""
    rows = np.broadcast_to(weights, (len(J), *weights.shape))
    return np.concatenate((J, rows), axis=1), np.concatenate((error, values - q @ weights.T), axis=1)


def _as_long_as_angle(v: Floats, cosine: Floats) -> Floats:
    """Return vectors (N, 3) whose lengths are angles, from vectors whose lengths are the sines of these angles."""
    sine = np.linalg.norm(v, axis=1)
    factor = np.arctan2(sine, cosine) / np.maximum(sine, 1e-12)
    half = (sine < 1e-12) & (cosine < 0.0)  # half a turn: take any axis, the next step corrects it
    turn = v * np.where(sine < 1e-12, 1.0, factor)[:, None]
    turn[half] = (1e-3, 0.0, 0.0)
    return turn
