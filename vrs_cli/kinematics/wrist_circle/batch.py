"""`WristCircleArm` over arrays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats
from vrs_cli.kinematics.axes import Chain
from vrs_cli.kinematics.configuration import ALL, NONE, Configuration
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.numeric.batch import NumericBatch
from vrs_cli.kinematics.transform import Transform, inverse
from vrs_cli.kinematics.transform_batch import compose_batch, stack
from vrs_cli.kinematics.unchanging import Unchanging
from vrs_cli.kinematics.wrist_circle.circle import Circle
from vrs_cli.kinematics.wrist_circle.search import Indices, near_solutions

POSES = 64  # at once, which stay in the processor's cache
STEPS = 12  # of Newton's method, from next to a solution
SAME = 1e-5  # [rad] two solutions that are one: rounding, where two are about to meet


class WristCircleBatch(NumericBatch):
    """`all_solutions` finds what `inverse` and `inverse_branch` choose from."""

    def __init__(
        self,
        model: RobotModel,
        unchanging: Unchanging,
        chain: Chain,
        circle: Circle,
        configuration: Callable[[Joints], Configuration],
    ) -> None:
        super().__init__(model, unchanging, ())
        self.ways, self.circle, self.configuration = ALL, circle, configuration
        self.signs, self.zeros = np.array(chain.signs), np.array([link.theta for link in chain.links])
        self.ends = stack([inverse(chain.base), inverse(chain.flange)])
        self.middle = (self.lower + self.upper) / 2

    def all_solutions(self, T: Floats) -> tuple[Floats, Indices]:
        """Of poses (N, 3, 4) all solutions (K, 6), whatever the limits, and their poses (K,) in order."""
        found, rows = list[Floats](), list[Indices]()
        for begin in range(0, len(T), POSES):
            q, row = self._solutions(T[begin : begin + POSES])
            found.append(q)
            rows.append(row + begin)
        return np.concatenate(found), np.concatenate(rows)

    def _solutions(self, T: Floats) -> tuple[Floats, Indices]:
        canonical = compose_batch(compose_batch(self.ends[0], T), self.ends[1])
        near, rows = near_solutions(self.circle, canonical)
        q = self.search(T[rows], self.signs * (near - self.zeros), bounded=False, steps=STEPS)
        there = np.flatnonzero(~np.isnan(q[:, 0]))
        there = there[np.argsort(rows[there], kind="stable")]
        q, rows = q[there], rows[there]
        q = self.turned_near(q, self.middle)
        first = _first_of_each(q, rows)
        return q[first], rows[first]

    def solutions_of(self, T: Transform) -> tuple[Joints, ...]:
        """All solutions of one pose, whatever the limits, each joint on the turn nearest to the middle of its range."""
        q, _ = self.all_solutions(np.reshape(T, (1, 3, 4)))
        return tuple(map(tuple, q.tolist()))

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        """Of the solutions with the same words one inside the limits, and the nearest to the middle of the ranges."""
        _, every, inside = self.every_inverse(T)
        return every[:, : len(self.ways)], inside[:, : len(self.ways)]

    def every_inverse(self, T: Floats) -> tuple[tuple[Configuration, ...], Floats, Flags]:
        """All solutions (N, m 8, 6), NaN where there are fewer: the best of each words, then the second best, ..."""
        q, rows = self.all_solutions(T)
        words = rows * len(self.ways) + self._indices(q)
        order = np.lexsort((self._duration(q, self.middle), ~self.inside(q), words))
        q, words = q[order], words[order]
        better = np.arange(len(q)) - np.searchsorted(words, words)  # solutions of the same pose and words
        every = np.full((len(T), max(better, default=0) + 1, len(self.ways), self.joints), np.nan)
        every[words // len(self.ways), better, words % len(self.ways)] = q
        every = every.reshape(len(T), -1, self.joints)
        return self.ways * (every.shape[1] // len(self.ways)), every, self.inside(every)

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        if configuration == NONE:
            return super().inverse_branch(T, configuration, near)
        q, rows = self.all_solutions(T)
        suited = self._indices(q) == configuration.index
        q, rows = q[suited], rows[suited]
        near = np.broadcast_to(near, (len(T), self.joints))[rows]
        q = self.turned_near(q, near)
        order = np.argsort(self._duration(q, near), kind="stable")[::-1]
        best = np.full((len(T), self.joints), np.nan)
        best[rows[order]] = q[order]
        return best

    def _indices(self, q: Floats) -> Indices:
        """(K, 6) -> (K,): the places of their words in ALL."""
        return np.array([self.configuration(tuple(row)).index for row in q.tolist()], dtype=np.intp)

    def _duration(self, q: Floats, near: Floats) -> Floats:
        """(K, 6) -> (K,) [s]: `RobotArm._duration`."""
        return np.asarray((np.abs(q - near) / np.array(self.model.max_velocity)).max(axis=-1))


def _first_of_each(q: Floats, rows: Indices) -> Flags:
    """(K, 6) and their poses (K,), in order -> (K,): whether none before it is the same."""
    first = np.ones(len(q), dtype=np.bool_)
    for apart in range(1, len(q)):
        same_pose = rows[apart:] == rows[:-apart]
        if not same_pose.any():
            break
        turn = np.abs(np.sin((q[apart:] - q[:-apart]) / 2.0)).max(axis=1)
        first[apart:] &= ~(same_pose & (turn < SAME))
    return first
