"""Search joint 6 for many poses at once (`wrist_circle.arm` explains the formulas and names).

A grid of joint 6 shows where f changes its sign. Intervals in which the grid may miss a solution are searched again
with a finer grid: where f comes near 0 and turns back, where the circle of the wrist enters or leaves the reach (or
nearly does), and where joint 1 turns quickly because the circle passes close to axis 1.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vrs_cli.kinematics.arrays import Flags, Floats, compose_batch, stack
from vrs_cli.kinematics.clearance import Unchanging
from vrs_cli.kinematics.joints import ALL, NONE, Configuration, Joints
from vrs_cli.kinematics.model import Chain, RobotModel
from vrs_cli.kinematics.numeric.batch import NumericBatch
from vrs_cli.kinematics.spherical_wrist.inverse import Circle
from vrs_cli.kinematics.transform import Transform, inverse

GRID = 96  # number of grid intervals of joint 6 in a whole turn
CLOSER = 16  # number of pieces into which an interval is divided to be searched again
# number of grids before solutions are collected; maximum number of further grids where joint 1 turns quickly
LOOKS, MORE = 2, 4
QUICK = 0.1  # joint 1 turns quickly if the sine of half its change between neighbouring grid values is larger
NEAR = 0.1  # joints count as near a solution if |f| and `beyond` are smaller
# signs of u and of psi in the four solutions of joints 1 to 3
FOUR = np.array(((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)))

Indices = NDArray[np.intp]


class Arcs(NamedTuple):
    """Parts of wrist circles (K,): the index of the pose, which of the four solutions of joints 1 to 3, and an interval
    of joint 6 [rad].
    """

    rows: Indices
    ways: Indices
    begin: Floats
    end: Floats


class SearchPlaces:
    """The arm at M values of joint 6 for each of K poses, each with one of the four solutions of joints 1 to 3.

    `beyond`: how far the wrist is out of reach (at most 0 if it is in reach). Out of reach, f and the joints are those
    of the arm at the limit of its reach.
    """

    def __init__(self, circle: Circle, T: Floats, ways: Indices, q6: Floats) -> None:
        """Compute f and joints 1 to 3 for poses T (K, 3, 4) of frame 6 and values q6 (K, M) of joint 6. `ways`: which
        of the four solutions (K,).
        """
        g, self.q6 = circle.arm, q6
        n, s, a = (T[:, None, :, k] for k in range(3))
        c6, s6 = np.cos(q6)[..., None], np.sin(q6)[..., None]
        self.x5 = c6 * n - s6 * s
        self.z4 = sin(circle.alpha5) * (s6 * n + c6 * s) + cos(circle.alpha5) * a
        wrist = T[:, None, :, 3] - circle.a5 * self.x5 - circle.d5 * self.z4
        x, y, down = wrist[..., 0], wrist[..., 1], g.d1 - wrist[..., 2]
        shoulder, fold = FOUR[ways].T[..., None]
        outward2 = x * x + y * y - g.side * g.side
        u = shoulder * np.sqrt(np.maximum(outward2, 0.0))
        h = u - g.a1
        k = (h * h + down * down - g.a2 * g.a2 - g.forearm * g.forearm) / (2.0 * g.a2 * g.forearm)
        self.beyond = np.maximum(np.abs(k) - 1.0, -outward2 / (g.a2 + g.forearm) ** 2)
        psi = fold * np.arccos(np.clip(k, -1.0, 1.0))
        self.q1 = np.arctan2(u * y - g.side * x, u * x + g.side * y)
        self.q2 = np.arctan2(down, h) - np.arctan2(g.forearm * np.sin(psi), g.a2 + g.forearm * np.cos(psi))
        self.q3 = psi + g.beta
        c1, s1 = np.cos(self.q1), np.sin(self.q1)
        c23, s23 = np.cos(self.q2 + self.q3), np.sin(self.q2 + self.q3)
        self.x3, self.y3 = (
            np.stack((c1 * c23, s1 * c23, -s23), axis=-1),
            np.stack((-s1, c1, np.zeros_like(c1)), axis=-1),
        )
        self.z3 = np.stack((c1 * s23, s1 * s23, c23), axis=-1)
        self.f = (self.z3 * self.z4).sum(axis=-1) - cos(circle.alpha4)
        self._sense = sin(circle.alpha4)

    def joints(self) -> Floats:
        """Return all six joints (K, M, 6)."""
        x4 = self._sense * np.cross(self.z3, self.z4)
        y4 = np.cross(self.z4, x4)
        q4 = np.arctan2((x4 * self.y3).sum(axis=-1), (x4 * self.x3).sum(axis=-1))
        q5 = np.arctan2((self.x5 * y4).sum(axis=-1), (self.x5 * x4).sum(axis=-1))
        return np.stack((self.q1, self.q2, self.q3, q4, q5, self.q6), axis=-1)


def near_solutions(circle: Circle, T: Floats) -> tuple[Floats, Indices]:
    """Return start joints for Newton's method (K, 6), at least one near each solution for the poses (N, 3, 4), and the
    index of the pose of each (K,).
    """
    count, step = len(T), 2.0 * pi / GRID
    rows, ways = (part.ravel() for part in np.indices((count, len(FOUR))))
    # half a turn to either side, and one grid step more, so that solutions at +-180 deg have neighbours
    ends = np.full(len(rows), pi + step)
    arcs, pieces = Arcs(rows, ways, -ends, ends), GRID + 2
    for _ in range(LOOKS):
        arcs, pieces = _closer(circle, T, arcs, pieces), CLOSER
    joints, poses = list[Floats](), list[Indices]()
    for _ in range(MORE):
        arcs = _closer(circle, T, arcs, CLOSER)
        at = SearchPlaces(circle, T[arcs.rows], arcs.ways, np.stack((arcs.begin, arcs.end), axis=1))
        near = (np.abs(at.f) < NEAR) & (at.beyond < NEAR)
        joints.append(at.joints()[near])
        poses.append(arcs.rows[np.nonzero(near)[0]])
        left = ~near.all(axis=1) & _quick(at.q1)[:, 0]
        if not left.any():
            break
        arcs = Arcs(*(part[left] for part in arcs))
    return np.concatenate(joints), np.concatenate(poses)


def _closer(circle: Circle, T: Floats, arcs: Arcs, pieces: int) -> Arcs:
    """Divide each arc into pieces, and return those that may contain a solution: f changes its sign there, joint 1
    turns quickly, or f or `beyond` may reach 0 between grid values.
    """
    q6 = arcs.begin[:, None] + (arcs.end - arcs.begin)[:, None] * np.linspace(0.0, 1.0, pieces + 1)
    at = SearchPlaces(circle, T[arcs.rows], arcs.ways, q6)
    inside, positive = at.beyond <= 0.0, at.f > 0.0
    quick = _quick(at.q1)
    k, j = np.nonzero(inside[:, 1:] & inside[:, :-1] & ((positive[:, 1:] != positive[:, :-1]) | quick))
    a, b, c = (np.where(inside, np.abs(at.f), np.inf)[:, k : k + pieces - 1] for k in range(3))
    same = (positive[:, 1:-1] == positive[:, 2:]) & (positive[:, 1:-1] == positive[:, :-2])
    # three neighbouring values of f with the same sign: f may reach 0 between them if the middle value is nearest to 0
    with np.errstate(invalid="ignore"):
        turns = same & (b <= a) & (b <= c) & (b < a - 2.0 * b + c) & (c < np.inf) & (a < np.inf)
    turns &= ~(quick[:, 1:] & quick[:, :-1])
    middle = inside[:, 1:-1]
    # true where, of three neighbouring grid values, some are in reach and some are not
    edges = (middle != inside[:, 2:]) | (middle != inside[:, :-2])
    a, b, c = at.beyond[:, :-2], at.beyond[:, 1:-1], at.beyond[:, 2:]
    # three neighbouring values of `beyond`: it may reach 0 between them if the middle value is nearest to 0
    turns_at_0 = ((b - a) * (b - c) >= 0.0) & (np.abs(b) < np.abs(a - 2.0 * b + c))
    d, i = np.nonzero(edges | turns | turns_at_0)
    both, begin, end = np.concatenate((k, d)), np.concatenate((j, i)), np.concatenate((j + 1, i + 2))
    return Arcs(arcs.rows[both], arcs.ways[both], q6[both, begin], q6[both, end])


def _quick(q1: Floats) -> Flags:
    """Return whether joint 1 (K, M) turns quickly between neighbouring grid values (K, M - 1)."""
    return np.asarray(np.abs(np.sin(0.5 * np.diff(q1))) > QUICK)


POSES = 64  # number of poses searched at once, so that the data fits into the processor's cache
STEPS = 12  # number of steps of Newton's method from joints near a solution


class WristCircleBatch(NumericBatch):
    """The functions of `WristCircleArm` for arrays; `inverse` and `inverse_branch` choose from `all_solutions`."""

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

    def all_solutions(self, T: Floats) -> tuple[Floats, Indices]:
        """Return all solutions (K, 6) for poses (N, 3, 4), ignoring the limits, and the index of the pose of each (K,),
        in ascending order.
        """
        found, rows = list[Floats](), list[Indices]()
        for begin in range(0, len(T), POSES):
            q, row = self._solutions(T[begin : begin + POSES])
            found.append(q)
            rows.append(row + begin)
        return np.concatenate(found), np.concatenate(rows)

    def _solutions(self, T: Floats) -> tuple[Floats, Indices]:
        canonical = compose_batch(compose_batch(self.ends[0], T), self.ends[1])
        near, rows = near_solutions(self.circle, canonical)
        q = self.search(T[rows], self.signs * (near - self.zeros), bounded=False, steps=STEPS).joints
        there = np.flatnonzero(~np.isnan(q[:, 0]))
        there = there[np.argsort(rows[there], kind="stable")]
        q, rows = q[there], rows[there]
        q = self.turned_near(q, self.middle)
        first = np.ones(len(q), dtype=np.bool_)  # marks the first of several equal solutions
        for apart in range(1, len(q)):
            same_pose = rows[apart:] == rows[:-apart]
            if not same_pose.any():
                break
            turn = np.abs(np.sin((q[apart:] - q[:-apart]) / 2.0)).max(axis=1)
            first[apart:] &= ~(same_pose & (turn < 1e-5))  # [rad] solutions closer than this to each other are equal
        return q[first], rows[first]

    def solutions_of(self, T: Transform) -> tuple[Joints, ...]:
        """Return all solutions for one pose, ignoring the limits; whole turns bring the joints nearest to the middles
        of their ranges.
        """
        q, _ = self.all_solutions(np.reshape(T, (1, 3, 4)))
        return tuple(map(tuple, q.tolist()))

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        """Return for each configuration the best solution: inside the limits if possible, then nearest to the middle of
        the ranges. The shapes are those of `SerialBatch.inverse`.
        """
        _, every, inside = self.every_inverse(T)
        return every[:, : len(self.ways)], inside[:, : len(self.ways)]

    def every_inverse(self, T: Floats) -> tuple[tuple[Configuration, ...], Floats, Flags]:
        """Return all solutions (N, 8 m, 6) for m solutions per configuration: the best of each configuration, then the
        second best, and so on; NaN where there are fewer.
        """
        q, rows = self.all_solutions(T)
        words = rows * len(self.ways) + self._indices(q)
        order = np.lexsort((self._duration(q, self.middle), ~self.inside(q), words))
        q, words = q[order], words[order]
        better = np.arange(len(q)) - np.searchsorted(words, words)  # number of better solutions with the same words
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
        """Return for each row of joints (K, 6) the index in ALL of its configuration."""
        return np.array([self.configuration(tuple(row)).index for row in q.tolist()], dtype=np.intp)

    def _duration(self, q: Floats, near: Floats) -> Floats:
        """Return `RobotArm.shortest_time` from `near` to each row of joints (K, 6) [s]."""
        return np.asarray((np.abs(q - near) / np.array(self.model.max_velocity)).max(axis=-1))
