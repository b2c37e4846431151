"""Prove that the joints of an arm whose tool is turned as nearly as possible lead from sample to sample.

As `numeric.continuation` proves it of other arms, of which this is the theorem again: the unknowns are the joints and
the multipliers, x = (q, l), and F is what misses in the conditions (`conditions`). F is a gradient, that of

    G(q, l) = l . (p(q) - p) + 1 - cos phi,   cos phi = (trace(W^T R) - 1) / 2,

so derivatives by joints of the second part are at most 1 each, for half the trace of a product of rotations and the
matrices of the cross products with unit axes is (they have rank 2), and those of the first the lever of the last of
these joints, times the length of l.

F is looked at on the cubic c(x) at the ends of pieces. It and its slope are 0 at both samples, so its second derivative
is 1/12 of its fourth at most (the remainder of Hermite's interpolation), and between the ends of a piece of g of the
gap F is no farther than g2 / 96 of that from the chord. The second derivative of F' bounds F' between them likewise.
As F' is regular on the whole way, the turn that is missing stays a least one.
"""

from __future__ import annotations

from collections.abc import Callable
from math import comb
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats, Rows
from vrs_cli.kinematics.model import levers
from vrs_cli.kinematics.numeric.continuation import LENGTH, LOST, MOST, Cubic, fourth_of_turn, inverse_or_nan, norm
from vrs_cli.kinematics.numeric.steady.conditions import PLACES, SteadyConditions
from vrs_cli.kinematics.transform import length, position

CHORD = 1.0 / 96.0  # of the fourth derivative of F: how far F is from its chord on a gap of one piece
AROUND = 0.5  # of the multipliers: how far from the cubic those that solve F can be
BLOCKS = 1.155  # of the bilinear part of a derivative of third order: at most so much of it on unit vectors
ROUNDING = 1e-12


class SteadyGaps(NamedTuple):
    """The ways between neighbouring samples, by the part of their time.

    `poses`: of the flange that are asked for (k, m, 3, 4), of the gaps in `which`, at these parts (m,) of their time.
    """

    which: Rows
    begin: Floats  # joints (k, n)
    end: Floats
    twists: Floats  # of the tool at both ends (k, 2, 6), by the part
    place: Floats  # (k,) a bound of the fourth derivative of the place that is asked for [m]
    turn: Floats  # (k, 4) of the first four of the angles of the turn that is asked for, together [rad]
    poses: Callable[[Rows, Floats], Floats]

    def some(self, which: Rows) -> SteadyGaps:
        """Select the gaps with these numbers."""
        numbers, *rows = self[:-1]
        begin, end, twists, place, turn = (row[which] for row in rows)
        return SteadyGaps(numbers[which], begin, end, twists, place, turn, self.poses)


class SteadyContinuation:
    """The proof for one arm and one place of the tip. `sure`: as of `numeric.continuation`."""

    sure = 0.0

    def __init__(self, conditions: SteadyConditions) -> None:
        self.conditions, batch = conditions, conditions.batch
        self.n, turning = conditions.joints, batch.turning
        reached = np.array(levers(batch.model)[1]) + length(position(conditions.tool))
        self.length = LENGTH * reached[0]
        sliding = np.cumsum(~turning[::-1])[::-1]  # joints beyond their ranges, by a length at most
        self.levers = np.where(turning, reached / self.length + sliding, 1.0)
        i = np.arange(self.n)
        later = np.maximum.outer(i, i)
        self.pair = float(np.linalg.norm(self.levers[later]))
        self.triple = float(np.linalg.norm(self.levers[np.maximum(later[:, :, None], i)]))
        self.single = float(np.linalg.norm(self.levers))
        self.units = np.concatenate((np.where(turning, 1.0, self.length), np.full(PLACES, 1.0 / self.length)))

    def proved(self, gaps: SteadyGaps, pieces: int) -> Flags:
        """(k,): of each gap."""
        parts = np.linspace(0.0, 1.0, pieces + 1)
        poses = np.swapaxes(gaps.poses(gaps.which, np.array((0.0, 1.0))), 0, 1)
        ends = zip((gaps.begin, gaps.end), poses, np.swapaxes(gaps.twists, 0, 1), strict=True)
        (a, v), (b, w) = (self._state(*end) for end in ends)
        cubic = Cubic(a, b, v, w)
        x, conditions, n = cubic.at(parts), self.conditions, self.n
        rows = (x * self.units).reshape(-1, x.shape[2])
        at = conditions.terms(rows[:, :n], gaps.poses(gaps.which, parts).reshape(-1, 3, 4))
        missed = np.linalg.norm(conditions.missed(at, rows[:, n:]) * self.units, axis=1).reshape(x.shape[:2])
        table = conditions.system(at, conditions.bend(at, rows[:, n:])) * self.units * self.units[:, None]
        table = table.reshape(*x.shape[:2], *table.shape[1:])
        fourth, bend, curved = self._bounds(gaps, cubic)
        A = inverse_or_nan(0.5 * (table[:, 1:] + table[:, :-1]))
        size = norm(A)
        lost = 0.5 * norm(A @ (table[:, 1:] - table[:, :-1])) + size * (bend / (8.0 * pieces**2))[:, None]
        beta = size / np.where(lost < LOST, 1.0 - lost, np.nan)
        off = np.maximum(missed[:, 1:], missed[:, :-1]) + (CHORD * fourth / pieces**2)[:, None] + ROUNDING
        return np.asarray((beta * beta * curved[:, None] * off <= MOST).all(axis=1))

    def stepped(self, q: Floats, T: Floats, guides: tuple[Floats, Floats] | None) -> Floats:  # noqa: ARG002 (none)
        """Joints (N, n) after one step of Newton's method to poses (N, 3, 4)."""
        conditions = self.conditions
        at = conditions.terms(q, T)
        bend = conditions.bend(at, conditions.multipliers(at))
        wanted = np.concatenate(((at.turn @ at.sine[:, :, None])[:, :, 0], at.away), axis=1)
        step = inverse_or_nan(conditions.system(at, bend)) @ wanted[:, :, None]
        return np.asarray(q + step[:, : self.n, 0])

    def _state(self, q: Floats, T: Floats, twist: Floats) -> tuple[Floats, Floats]:
        """Joints and multipliers, and their rates, in units of the proof."""
        conditions = self.conditions
        at = conditions.terms(q, T)
        multipliers = conditions.multipliers(at)
        table = conditions.system(at, conditions.bend(at, multipliers))
        rate = (inverse_or_nan(table) @ conditions.gained(at, twist)[:, :, None])[:, :, 0]
        return np.concatenate((q, multipliers), axis=1) / self.units, rate / self.units

    def _bounds(self, gaps: SteadyGaps, cubic: Cubic) -> tuple[Floats, Floats, Floats]:
        """(k,): of the fourth derivative of F on the cubic, of the second of F', and of how F' changes beside it."""
        pace = [order[:, : self.n].sum(axis=1) for order in cubic.most()]
        greatest = (
            np.maximum(np.abs(cubic.begin), np.abs(cubic.end)) + cubic.most()[1] / 8.0
        )  # of the unknowns themselves
        pull = [np.linalg.norm(order[:, self.n :], axis=1) for order in (greatest, *cubic.most())]
        own = _of_turn(pace)
        turned = _of_turn([mine + asked for mine, asked in zip((*pace, 0.0), gaps.turn.T, strict=True)])
        pulled = [sum(comb(k, i) * own[i] * (*pull, 0.0)[k - i] for i in range(k + 1)) for k in (2, 4)]
        fourth = np.hypot(
            np.sqrt(self.n) * turned[4] + self.single * pulled[1], self.levers.max() * own[4] + gaps.place / self.length
        )
        bend = self.n * turned[2] + self.pair * pulled[0] + np.sqrt(2.0) * self.single * own[2]
        curved = self.n**1.5 + self.triple * (pull[0] + AROUND) + BLOCKS * self.pair
        return fourth, bend, curved


def _of_turn(angles: list[Floats]) -> list[Floats]:
    """Bounds of a turn and its derivatives up to the fourth, by those of its angles together (Faa di Bruno)."""
    first, second, third, *fourth = angles
    last = fourth[0] if fourth else np.zeros_like(first)
    square = first * first
    return [
        np.ones_like(first),
        first,
        square + second,
        first * square + 3.0 * first * second + third,
        fourth_of_turn(first, second, third, last),
    ]
