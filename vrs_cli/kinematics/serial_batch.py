"""Compute the kinematics of arms for arrays of poses and joints, such as whole timelines.

Forward kinematics and Jacobians use the functions of `compiled` with the sine and cosine of numpy; the inverse of a
closed form is its formula for floats, rewritten for arrays. The work is done in chunks that fit into the processor's
cache, with one contiguous row for each joint and each matrix element.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from math import pi
from typing import Any

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats, compose_batch, stack
from vrs_cli.kinematics.clearance import ON_BOUNDARY, Unchanging
from vrs_cli.kinematics.compiled import biases, formulas
from vrs_cli.kinematics.joints import ALL, LIMIT_TOLERANCE, TURN, Configuration, JointKind
from vrs_cli.kinematics.model import LEVEL, STRAIGHT, Chain, RobotModel, link_transform
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    compose,
    cross,
    dot,
    inverse,
    position,
    rotate,
    vector_difference,
    vector_sum,
)

CHUNK = 2048


def chunks(n: int) -> Iterator[slice]:
    return (slice(start, min(start + CHUNK, n)) for start in range(0, n, CHUNK))


def columns(rows: Floats) -> Floats:
    """Transpose rows (N, ...) of k numbers each to a contiguous array (k, N)."""
    return np.ascontiguousarray(rows.reshape(len(rows), -1).T)


def fill_rows(n: int, size: int, entries: Callable[[slice], Iterable[Any]]) -> Floats:
    """Return an array (n, size), computed chunk by chunk. `entries`: a function that returns, for a slice of rows, the
    `size` columns as numbers or arrays.
    """
    found = np.empty((n, size))
    for part in chunks(n):
        for i, entry in enumerate(entries(part)):
            found[part, i] = entry
    return found


def _solve(J: Floats, wanted: Floats) -> Floats:
    """Return the rates (N, n) that solve J rates = wanted, with J (N, n, n) and wanted (N, n). Raises LinAlgError if a
    matrix is singular.
    """
    return np.asarray(np.linalg.solve(J, wanted[:, :, None])[:, :, 0], dtype=float)


def _three(rows: Floats) -> Any:
    """Convert three rows of an array to a `Vector` whose components are arrays."""
    return tuple(rows)


def _by_halves(J: Any) -> Callable[[Any, Any], tuple[Any, ...]]:
    """Return a function that solves six equations whose matrix J (6 rows of 6 numbers or arrays) has only zeros in its
    upper right quarter. The function takes the first three and the last three right sides.
    """
    arm, wrist = _cramer([row[:3] for row in J[:3]]), _cramer([row[3:] for row in J[3:]])

    def solve(first: Any, last: Any) -> tuple[Any, ...]:
        some = arm(first)
        done: Any = tuple([dot(row[:3], some) for row in J[3:]])
        return (*some, *wrist(vector_difference(last, done)))

    return solve


def _cramer(rows: Sequence[Sequence[Any]]) -> Callable[[Any], Any]:
    """Return a function that solves three equations with the matrix `rows` by Cramer's rule, for given right sides."""
    a, b, c = (tuple(column) for column in zip(*rows, strict=True))
    normals = cross(b, c), cross(c, a), cross(a, b)
    volume = dot(a, normals[0])
    return lambda wanted: tuple([dot(normal, wanted) / volume for normal in normals])


class SerialBatch:
    """The functions of `arm.RobotArm` for arrays. `formula`: the inverse of a closed form in one configuration, for
    arrays (k, N), made by `formula.over_arrays`; None for other arms.
    """

    def __init__(
        self,
        model: RobotModel,
        ways: tuple[Configuration, ...],
        unchanging: Unchanging,
        formula: Callable[..., Floats] | None = None,
    ) -> None:
        self.model, self.ways, self.unchanging, self.joints = model, ways, unchanging, model.joint_count
        self.formula = formula
        self.lower, self.upper = np.array(model.lower), np.array(model.upper)
        self.turning = np.array([link.kind is JointKind.REVOLUTE for link in model.links])
        self.formulas = formulas(model.links, model.base, model.flange, arrays=True)
        self.biases = biases(model.links, model.base, model.flange, arrays=True)

    def forward(self, q: Floats) -> Floats:
        """Return T_base_flange (N, 3, 4) for joints (N, n)."""
        return fill_rows(len(q), 12, lambda part: self.formulas.forward(columns(q[part]))).reshape(-1, 3, 4)

    def jacobian(self, q: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        """Return the Jacobians (N, 6, n) of a tool at joints (N, n)."""
        tip = position(T_flange_tool)
        entries = fill_rows(
            len(q), 6 * self.joints, lambda part: chain(*self.formulas.jacobian(columns(q[part]), *tip))
        )
        return entries.reshape(-1, 6, self.joints)

    def rates(self, q: Floats, twists: Floats, changes: Floats, T_flange_tool: Transform) -> tuple[Floats, Floats]:
        """Return the velocities and accelerations (N, 6) of six joints that give a tool the twists (N, 6) and their
        rates `changes` (N, 6).

        Raises LinAlgError in a singular pose.
        """
        J, tip = self.jacobian(q, T_flange_tool), position(T_flange_tool)
        qd = _solve(J, twists)
        bias = fill_rows(len(q), 6, lambda part: self.biases.acceleration(columns(q[part]), columns(qd[part]), *tip))
        return qd, _solve(J, changes - bias)

    def forward_and_jacobian(self, q: Floats) -> tuple[Floats, Floats]:
        """Return T_base_flange (N, 3, 4) and the Jacobians of the flange (N, 6, n)."""

        def entries(part: slice) -> Iterable[Any]:
            pose, rows = self.formulas.both(columns(q[part]))
            return chain(pose, *rows)

        found = fill_rows(len(q), 12 + 6 * self.joints, entries)
        return found[:, :12].reshape(-1, 3, 4), found[:, 12:].reshape(-1, 6, self.joints)

    def solve_guided(self, T: Floats, near: Floats, weights: Floats, values: Floats) -> Floats:
        """Return `RobotArm.guided_joints` for each row. `weights` (r, n): the weights of r guides (prescribed sums of
        joints); `values` (N, r): their values.
        """
        raise NotImplementedError

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        """Return the joints (N, k, n) that reach poses (N, 3, 4) in each of the k configurations, and whether they are
        inside the limits (N, k).

        Joints are NaN where a pose is out of reach.
        """
        middle = (self.lower + self.upper) / 2
        q = np.stack([self.inverse_branch(T, way, middle) for way in self.ways], axis=1)
        return q, self.inside(q)

    def every_inverse(self, T: Floats) -> tuple[tuple[Configuration, ...], Floats, Flags]:
        """Return all solutions: their configurations (one may occur several times), their joints, and whether they are
        inside the limits, with the shapes of `inverse`.
        """
        return self.ways, *self.inverse(T)

    def inside(self, q: Floats) -> Flags:
        """Return whether all joints of each vector (..., n) are inside their limits (...)."""
        within = (q >= self.lower - LIMIT_TOLERANCE) & (q <= self.upper + LIMIT_TOLERANCE)
        return np.asarray(within.all(axis=-1))

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        """Return the joints (N, n) that reach poses (N, 3, 4) in one configuration, with whole turns that bring them
        nearest to `near` (N, n) or (n,); NaN out of reach.
        """
        assert self.formula is not None  # numerical arms override this method
        near, q = np.broadcast_to(near, (len(T), self.joints)), np.empty((len(T), self.joints))
        # both alternatives of a conditional expression are computed for all rows, so the one that is not used may be
        # invalid
        with np.errstate(invalid="ignore", divide="ignore"):
            for part in chunks(len(T)):
                q[part] = self.formula(columns(T[part]), configuration, columns(near[part])).T
        if self.unchanging != Unchanging():
            q[~self.in_task(T)] = np.nan
        return self.turned_near(q, near)

    def turned_near(self, q: Floats, near: Floats) -> Floats:
        """Return joints (N, n) with whole turns added that bring each revolute joint nearest to `near`."""
        return np.where(self.turning, q + TURN * np.rint((near - q) / TURN), q)

    def in_task(self, T: Floats) -> Flags:
        """Return, for each of N poses of the flange, whether it agrees with the coordinates and the direction that this
        arm cannot change (see `Unchanging.allows`).
        """
        places, approach = self.unchanging.places, self.unchanging.approach
        within = np.ones(len(T), dtype=np.bool_)
        for way, value in places:
            within &= np.abs(T[:, :, 3] @ way - value) <= LEVEL
        if approach is not None:
            cosine, sine = T[:, :, 2] @ approach, np.linalg.norm(np.cross(T[:, :, 2], approach), axis=1)
            within &= np.arctan2(sine, cosine) <= STRAIGHT
        return within


class WristBatch(SerialBatch):
    """The functions of an arm with a spherical wrist for arrays; FLIP solutions are computed from NOFLIP solutions."""

    def rates(self, q: Floats, twists: Floats, changes: Floats, T_flange_tool: Transform) -> tuple[Floats, Floats]:
        """Return joint velocities and accelerations as `SerialBatch.rates` does, but infinite or NaN in a singular
        pose.

        Joints 4 to 6 do not move the wrist centre, so the six equations split into two systems of three (Hollerbach and
        Sahar 1983).
        """
        centre = position(inverse(compose(link_transform(self.model.links[5], 0.0), self.model.flange)))
        lever = vector_difference(position(T_flange_tool), centre)

        def entries(part: slice) -> Iterable[Any]:
            joints, twist, change = (columns(rows[part]) for rows in (q, twists, changes))
            v, w, a, alpha = (_three(rows) for rows in (twist[:3], twist[3:], change[:3], change[3:]))
            T: Any = self.formulas.forward(joints)
            r = rotate(T, lever)  # vector from the wrist centre to the tool
            spin = cross(w, r)
            J = self.formulas.jacobian(joints, *centre)
            solve = _by_halves(J)
            qd = solve(vector_difference(v, spin), w)
            bias: Any = self.biases.acceleration(joints, qd, *centre)
            a = vector_difference(a, vector_sum(cross(alpha, r), cross(w, spin)))  # acceleration of the wrist centre
            return (*qd, *solve(vector_difference(a, bias[:3]), vector_difference(alpha, bias[3:])))

        with np.errstate(invalid="ignore", divide="ignore"):
            found = fill_rows(len(q), 12, entries)
        return found[:, :6], found[:, 6:]

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        assert self.formula is not None
        q, inside = np.empty((len(T), len(self.ways), 6)), np.empty((len(T), len(self.ways)), dtype=np.bool_)
        # value of joint 4 at a singular wrist, where it may have any value
        rest = np.where(np.arange(6) == 3, np.clip(0.0, self.lower, self.upper), 0.0)
        middle, half = 0.5 * (self.upper + self.lower)[:, None], 0.5 * (self.upper - self.lower)[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            for part in chunks(len(T)):
                poses = columns(T[part])
                near = np.broadcast_to(rest[:, None], (6, poses.shape[1]))
                for k, way in enumerate(self.ways):
                    if k % 2 == 0:
                        joints, first = self.formula(poses, way, near), 0
                    else:
                        bent, first = np.abs(np.sin(joints[4])) > ON_BOUNDARY, 3
                        joints[3:] = np.where(bent, (joints[3] + pi, -joints[4], joints[5] + pi), joints[3:])
                    joints[first:] += TURN * np.rint((middle[first:] - joints[first:]) / TURN)
                    q[part, k] = joints.T
                    inside[part, k] = (np.abs(joints - middle) <= half + LIMIT_TOLERANCE).all(axis=0)
        return q, inside


class MappedBatch(SerialBatch):
    """The functions of `forms.MappedArm` for arrays: converts joints and poses, and calls the inner arm's batch."""

    def __init__(self, model: RobotModel, unchanging: Unchanging, way: Chain, inner: SerialBatch, swapped: int) -> None:
        super().__init__(model, inner.ways, unchanging)
        self.inner, self.swapped = inner, swapped
        self.signs, self.zeros = np.array(way.signs), np.array([link.theta for link in way.links])
        self.ends = stack([inverse(way.base), inverse(way.flange)])

    def _inner_poses(self, T: Floats) -> Floats:
        return compose_batch(compose_batch(self.ends[0], T), self.ends[1])

    def _own_joints(self, q: Floats) -> Floats:
        return np.asarray(self.signs * (q - self.zeros))

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        q, inside = self.inner.inverse(self._inner_poses(T))
        order = np.arange(q.shape[1]) ^ self.swapped
        return self._own_joints(q[:, order]), inside[:, order]

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        other = ALL[configuration.index ^ self.swapped]
        return self._own_joints(self.inner.inverse_branch(self._inner_poses(T), other, self.signs * near + self.zeros))
