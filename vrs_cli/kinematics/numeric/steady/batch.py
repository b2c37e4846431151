"""`SteadyArm` over arrays; one pose alone is a row too.

A search goes down by Newton's method where the conditions bend upwards, and by that of Gauss and Newton where they do
not, so that it ends in a least turn and in no greatest one. Joints at a limit that would leave it are held.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats, Rows
from vrs_cli.kinematics.configuration import NONE, Configuration
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.numeric.search import FREE_STEPS, LARGEST_STEP, STEPS, rounds
from vrs_cli.kinematics.numeric.steady.conditions import PLACES, SteadyConditions, Terms
from vrs_cli.kinematics.numeric.steady.planar import PlanarStarts, is_planar
from vrs_cli.kinematics.serial_batch import SerialBatch
from vrs_cli.kinematics.transform import Transform
from vrs_cli.kinematics.unchanging import LEVEL, STRAIGHT, Unchanging

FOLLOWING = 12  # steps of Newton's method from joints that are near
SETTLED = 1e-7  # [rad, m] after a step so small the next one would be rounding: they shrink with the square
THERE, TURNED = 1e-10, 1e-7  # [m, rad] of a pose: nothing is missing, though in singular joints steps shrink slowly
BRANCH = 0.5  # [rad, m] from joints that are near: farther off is another branch
ROUNDING = 1e-12  # [rad, m] of a joint at a limit
POSES = 64  # whose searches go on at once
DAMPING = 1e-6  # of the way downhill, where nothing else decides it


class Found(NamedTuple):
    """Joints (N, n), NaN where there are none, and the turns that are missing there (N,) [rad]."""

    joints: Floats
    turned: Floats


class SteadyBatch(SerialBatch):
    """Rows that do not converge are NaN."""

    def __init__(self, model: RobotModel, unchanging: Unchanging, T_flange_tool: Transform) -> None:
        super().__init__(model, (NONE,), unchanging)
        self.conditions = SteadyConditions(self, T_flange_tool)
        self.middle = (self.lower + self.upper) / 2
        self._planar = PlanarStarts(self, self.conditions.tip) if is_planar(self) else None

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        """One way: that with the least turn of those that are found from all starts, within the limits."""
        q = np.full((len(T), self.joints), np.nan)
        others = next(rounds(self.model, tuple(self.middle.tolist())))[1:]
        for first in range(0, len(T), POSES):
            starts = [others if (some := self.starts(pose)) is None else some for pose in T[first : first + POSES]]
            rows = first + np.repeat(np.arange(len(starts)), [len(begin) for begin in starts])
            found = self.settled(T[rows], self._rows([q for begin in starts for q in begin]), rows)
            order = np.lexsort((found.turned, rows))
            row, at = np.unique(rows[order], return_index=True)
            q[row] = found.joints[order[at]]
        return q[:, None], self.inside(q)[:, None]

    def settled(self, T: Floats, begin: Floats, pose: Rows) -> Found:
        """`search` from starts that may be beside the limits, for the poses of these numbers (N,): where that leaves
        the limits, and no other start leads to the pose itself, along them.
        """
        free = self.search(T, begin, bounded=False)
        joints = self.turned_near(free.joints, self.middle)
        inside = self.inside(joints)
        found = Found(np.where(inside[:, None], joints, np.nan), np.where(inside, free.turned, np.inf))
        least = np.full(pose.max(initial=0) + 1, np.inf)
        np.minimum.at(least, pose, found.turned)
        rows = np.flatnonzero(~inside & (least[pose] > STRAIGHT))
        found.joints[rows], found.turned[rows] = self.search(T[rows], begin[rows])
        return found

    def starts(self, T: Transform | Floats) -> list[Joints] | None:
        """Joints from which searches lead to all least turns at the place of a pose; None where no table of them can be
        made.
        """
        return None if self._planar is None else self._planar.of(np.reshape(T, (3, 4)))

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:  # noqa: ARG002
        """From joints that are near, whatever their limits: by Newton's method, else downhill."""
        near = np.broadcast_to(near, (len(T), self.joints))
        found = self._by_newton(T, near)
        rows = np.flatnonzero(np.isnan(found[:, 0]))
        if len(rows):
            others = self.search(T[rows], near[rows], bounded=False, steps=FOLLOWING).joints
            close = np.abs(others - near[rows]).max(axis=1) < BRANCH
            found[rows[close]] = others[close]
        return found

    def _by_newton(self, T: Floats, near: Floats) -> Floats:
        conditions, q = self.conditions, near.copy()
        found, rows = np.full_like(q, np.nan), np.flatnonzero(self.in_task(T))
        at = conditions.terms(q[rows], T[rows])
        multipliers = conditions.multipliers(at)
        for _ in range(FOLLOWING):
            if not len(rows):
                break
            bend = conditions.bend(at, multipliers)
            step, multipliers = self._solved(at, bend, at.sine)
            size = np.abs(step).max(axis=1)
            q[rows] += step * np.minimum(1.0, LARGEST_STEP / np.maximum(size, LARGEST_STEP))[:, None]
            done = size < SETTLED
            if done.any():
                least = conditions.is_least(at, bend)
                found[rows[done & least]] = q[rows[done & least]]
            goes_on = ~done & (np.abs(q[rows] - near[rows]).max(axis=1) <= 2.0 * BRANCH)
            rows, multipliers = rows[goes_on], multipliers[goes_on]
            at = conditions.terms(q[rows], T[rows])
        return found

    def least_turns(self, T: Transform) -> list[tuple[Joints, float]] | None:
        """Joints of the least turns for one pose within the limits, and what is missing; None without `starts`."""
        begin = self.starts(T)
        if begin is None:
            return None
        poses = np.broadcast_to(np.reshape(T, (3, 4)), (len(begin), 3, 4))
        return self._listed(self.settled(poses, self._rows(begin), np.zeros(len(begin), dtype=np.intp)))

    def _rows(self, joints: Sequence[Joints]) -> Floats:
        return np.reshape(joints, (-1, self.joints))

    def followed(self, T: Transform, near: Joints) -> Joints | None:
        """`inverse_branch` of one pose."""
        q = self.inverse_branch(np.reshape(T, (1, 3, 4)), NONE, np.array(near))[0].tolist()
        return None if isnan(q[0]) else tuple(q)

    def searched(self, T: Transform, begin: Sequence[Joints], *, bounded: bool = True) -> list[tuple[Joints, float]]:
        """What `search` finds for one pose from several joints, and the turns that are missing there."""
        poses = np.broadcast_to(np.reshape(T, (3, 4)), (len(begin), 3, 4))
        found = self.search(poses, self._rows(begin), bounded=bounded)
        return self._listed(found)

    @staticmethod
    def _listed(found: Found) -> list[tuple[Joints, float]]:
        there = np.isfinite(found.turned)
        return list(zip(map(tuple, found.joints[there].tolist()), found.turned[there].tolist(), strict=True))

    def search(self, T: Floats, near: Floats, *, bounded: bool = True, steps: int = STEPS) -> Found:
        """(N, 3, 4) and starts (N, n) or (n,): the least turn downhill from there, within the limits of the joints."""
        conditions, q = self.conditions, np.array(np.broadcast_to(near, (len(T), self.joints)))
        found, turned = np.full_like(q, np.nan), np.full(len(T), np.inf)
        rows = np.flatnonzero(self.in_task(T))
        multipliers = np.zeros((len(rows), PLACES))
        for _ in range(min(steps, STEPS if bounded else FREE_STEPS)):
            if not len(rows):
                break
            at = conditions.terms(q[rows], T[rows])
            step, multipliers = self._downhill(at, multipliers, q[rows], bounded=bounded)
            size = np.abs(step).max(axis=1)
            part = np.minimum(1.0, LARGEST_STEP / np.maximum(size, LARGEST_STEP))
            if bounded:
                part = np.minimum(part, self._until_limit(q[rows], step))
            q[rows] += part[:, None] * step
            if bounded:
                q[rows] = self._at_limits(q[rows])
            done = size < SETTLED
            there = rows[done & (np.linalg.norm(at.away, axis=1) < LEVEL)]
            found[there], turned[there] = q[there], at.angle[np.isin(rows, there)]
            rows, multipliers = rows[~done], multipliers[~done]
        if len(rows):
            at = conditions.terms(q[rows], T[rows])
            had = (np.linalg.norm(at.away, axis=1) < THERE) & (at.angle < TURNED)
            found[rows[had]], turned[rows[had]] = q[rows[had]], at.angle[had]
        return Found(found, turned)

    def _until_limit(self, q: Floats, step: Floats) -> Floats:
        """(N,): the part of each step that brings the first joint to its limit, where it is held: a step cut short
        keeps the place, joints cut short each by itself do not.
        """
        room = np.where(step > 0.0, self.upper - q, q - self.lower)
        return np.asarray((room / np.maximum(np.abs(step), 1e-300)).min(axis=1, where=room > 0.0, initial=np.inf))

    def _at_limits(self, q: Floats) -> Floats:
        """Joints that are at a limit but for rounding, or beyond it, at it."""
        low, high = self.lower + ROUNDING, self.upper - ROUNDING
        return np.where(q <= low, self.lower, np.where(q >= high, self.upper, q))

    def _downhill(self, at: Terms, multipliers: Floats, q: Floats, *, bounded: bool) -> tuple[Floats, Floats]:
        """One step and its multipliers; where it pushes joints out of their range, again without these."""
        conditions = self.conditions
        bend = conditions.bend(at, multipliers)
        least = conditions.is_least(at, bend)
        flat = conditions.flat_bend(at) + DAMPING * np.eye(self.joints)
        bend = np.where(least[:, None, None], bend, flat)
        missing = np.where(least[:, None], at.sine, at.rotation)
        still = np.zeros(q.shape, dtype=np.bool_)
        while True:
            step, solved = self._solved(at, bend, missing, still)
            pushed = ~still & (((q <= self.lower) & (step < 0.0)) | ((q >= self.upper) & (step > 0.0)))
            if not bounded or not pushed.any():
                return step, solved
            still |= pushed

    def _solved(self, at: Terms, bend: Floats, turn: Floats, still: Flags | None = None) -> tuple[Floats, Floats]:
        """The step (N, n) to where linear conditions are met, and the multipliers there (N, 3); `still` joints stay."""
        conditions, n = self.conditions, self.joints
        wanted = np.concatenate(((at.turn @ turn[:, :, None])[:, :, 0], at.away), axis=1)
        table = conditions.system(at, bend)
        table[:, n:, n:] -= 1e-13 * np.eye(PLACES)  # a place that no joint changes asks for nothing
        if still is not None and still.any():
            table[:, :n][still] = 0.0
            np.swapaxes(table, 1, 2)[:, :n][still] = 0.0
            row, joint = np.nonzero(still)
            table[row, joint, joint] = 1.0
            wanted[row, joint] = 0.0
        try:
            solved = np.linalg.solve(table, wanted[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:  # of one row at least: a singular pose
            solved = (np.linalg.pinv(table) @ wanted[:, :, None])[:, :, 0]
        return np.asarray(solved[:, :n]), np.asarray(solved[:, n:])
