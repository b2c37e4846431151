"""Search the joints for many poses of a `SteadyArm` at once, and prove that the joints are continuous along a path.

The search is sequential quadratic programming (Nocedal and Wright, "Numerical Optimization", 2006, chapter 18). Each
step goes to the minimum of a quadratic model of 1 - cos phi, where phi is the rotation error, among the joints that
reach the position (to first order) and are within the limits; no joint moves farther than a radius. These bounds form a
box. The multipliers are computed without the joints that are at a limit, so that the search also converges
quadratically along a side of the box. A search whose steps reverse direction takes shorter steps.

The minimum of the model is inside the box, on one of its sides (one joint at a bound), or on a corner (two joints at a
bound). There are few sides and corners, so the search computes the minimum on each of them. This also finds the minimum
if the function is not convex, and needs no iteration from side to side as in 16.8 of the same book.

The proof is that of `numeric.batch`, but its unknowns are joints and multipliers, x = (q, l), and F is the residual of
the conditions (`conditions`). F is the gradient of

    G(q, l) = l . (p(q) - p) + 1 - cos phi,   cos phi = (trace(W^T R) - 1) / 2,

Derivatives of the second part, 1 - cos phi, with respect to joints are at most 1 each, because half the trace of a
product of rotations and cross-product matrices of unit axes (which have rank 2) is at most 1. Those of the first part
are at most the lever of the last of these joints, times the length of l. F is evaluated on the cubic c(x) at the ends
of pieces. F and its slope are 0 at both samples, so its second derivative is at most 1/12 of the maximum of its fourth
(the remainder of Hermite's interpolation). So on a piece that is the fraction g of a gap, F differs from its chord by
at most g^2 / 96 of this maximum. In the same way the second derivative of F' bounds F' on the piece. As F' is regular
on the whole path, the rotation error stays a local minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import combinations
from math import comb, isnan
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats, Rows
from vrs_cli.kinematics.clearance import Unchanging
from vrs_cli.kinematics.joints import NONE, Configuration, Joints
from vrs_cli.kinematics.model import LEVEL, RobotModel, levers
from vrs_cli.kinematics.numeric.batch import (
    LENGTH,
    MAX_KANTOROVICH,
    Cubic,
    Guides,
    SearchBatch,
    SearchState,
    fourth_of_turn,
    inverse_bound,
    inverses,
)
from vrs_cli.kinematics.numeric.search import LARGEST_STEP
from vrs_cli.kinematics.numeric.steady.conditions import PLACES, PlanarStarts, SteadyConditions, Terms, is_planar
from vrs_cli.kinematics.transform import Transform, length, position

# rounds of searches from samples, and from the table of starts (for a pose that leaves joint 1 free: from 48 samples)
SAMPLED, PLANAR = ((0, 16, True), (0, 16, False), (16, 32, False)), ((0, 48, True),)
FOLLOWING = 12  # maximum number of steps of Newton's method from the joints `near` in `inverse_branch`
SETTLED = 1e-7  # [rad, m] a search has converged if its step is smaller
# [m, rad] a pose counts as reached exactly within these errors, even if steps are still larger than SETTLED
THERE, TURNED = 1e-10, 5e-10
# [rad, m] a solution farther from the joints `near` counts as a solution of another branch (another
# continuous set of solutions)
BRANCH = 0.5
ROUNDING = 1e-12  # [rad, m] a joint closer to a limit counts as at the limit
DAMPING = 1e-13  # [m2, rad2] damping of steps towards a position; it has an effect only in singular poses
FLAT = 1e-12  # smaller second derivatives, squared lengths and determinants count as 0
OVER = 1e-9  # [rad, m] a step that leaves the box by less than this counts as inside (rounding)


class SteadyBatch(SearchBatch):
    """The functions of `SteadyArm` for arrays. Joints are NaN in rows whose search does not converge."""

    at_once, settled, scaled = 64, SETTLED, False

    def __init__(self, model: RobotModel, unchanging: Unchanging, T_flange_tool: Transform) -> None:
        super().__init__(model, (NONE,), unchanging)
        self.conditions = SteadyConditions(self, T_flange_tool)
        self.tip = self.conditions.tip
        self._planar = PlanarStarts(self, self.tip) if is_planar(self) else None
        self.rounds = self.rounds_of_one = SAMPLED if self._planar is None else PLANAR

    def without_limits(self, T: Transform, near: Joints) -> list[tuple[Joints, float]]:
        """Return the same as `solutions`, but search only from the first starts and ignore the limits."""
        (begin,) = self.starts(np.reshape(T, (1, 3, 4)), *self.rounds[0][:2])
        begin = np.concatenate(((near,), begin)) if len(begin) else begin
        poses = np.broadcast_to(np.reshape(T, (3, 4)), (len(begin), 3, 4))
        return self.search(poses, begin, bounded=False, pose=np.zeros(len(begin), dtype=np.intp)).each()

    def starts(self, T: Floats, after: int, count: int) -> Iterable[Floats]:
        tables = [None if self._planar is None else self._planar.of(pose) for pose in T]
        rows = zip(tables, T, strict=True)
        return [self.samples.near(pose[None], after, count)[0] if table is None else table for table, pose in rows]

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:  # noqa: ARG002
        """Return the joints near `near` that solve each pose, ignoring the limits. Newton's method is tried first, then
        a descent search.
        """
        conditions, near = self.conditions, np.broadcast_to(near, (len(T), self.joints))
        q = near.copy()
        found, rows = np.full_like(q, np.nan), np.arange(len(T))
        at = conditions.terms(q, T)
        multipliers = conditions.multipliers(at)
        for _ in range(FOLLOWING):
            if not len(rows):
                break
            bend = conditions.bend(at, multipliers)
            step, multipliers = conditions.newton(at, bend)
            size = np.abs(step).max(axis=1)
            q[rows] += step * np.minimum(1.0, LARGEST_STEP / np.maximum(size, LARGEST_STEP))[:, None]
            done = size < SETTLED
            if done.any():
                least = conditions.is_least(at, bend)
                found[rows[done & least]] = q[rows[done & least]]
            goes_on = ~done & (np.abs(q[rows] - near[rows]).max(axis=1) <= 2.0 * BRANCH)
            rows, multipliers = rows[goes_on], multipliers[goes_on]
            at = conditions.terms(q[rows], T[rows])
        rows = np.flatnonzero(np.isnan(found[:, 0]))
        if len(rows):
            others = self.search(T[rows], near[rows], bounded=False, steps=FOLLOWING).joints
            close = np.abs(others - near[rows]).max(axis=1) < BRANCH
            found[rows[close]] = others[close]
        return found

    def within_ranges(self, T: Transform, near: Joints) -> Joints | None:
        """Return the joints with a locally least rotation error, found by a descent search from `near` within the
        limits; None if it fails.
        """
        found = self.search(np.reshape(T, (1, 3, 4)), np.array(near), bounded=True).joints[0].tolist()
        return None if isnan(found[0]) else tuple(found)

    def follow(self, T: Transform, near: Joints) -> Joints | None:
        """Return the result of `inverse_branch` for one pose; None if it fails."""
        q = self.inverse_branch(np.reshape(T, (1, 3, 4)), NONE, np.array(near))[0].tolist()
        return None if isnan(q[0]) else tuple(q)

    def search_state(self, q: Floats, T: Floats, low: Floats, high: Floats, guides: Guides | None) -> SearchState:  # noqa: ARG002
        at = self.conditions.terms(q, T)
        away, turned, held = np.linalg.norm(at.away, axis=1), at.angle, (low >= -ROUNDING) | (high <= ROUNDING)
        step = self._downhill(at, held, low, high)
        exact, close = (away < THERE) & (turned < TURNED), away < LEVEL
        return SearchState(np.where(exact[:, None], 0.0, step), np.where(close, 0.0, away), turned, exact, close)

    def _downhill(self, at: Terms, held: Flags, low: Floats, high: Floats) -> Floats:
        """Return the steps (N, n) to the minimum of the quadratic model. `low`, `high`: bounds of the steps. `held`:
        which joints are at a limit.
        """
        conditions, place = self.conditions, at.place
        radius = np.maximum(high, -low).max(axis=1)
        across = np.swapaxes(place, 1, 2)
        to_place = (place @ np.linalg.solve(across @ place + DAMPING * np.eye(PLACES), at.away[:, :, None]))[:, :, 0]
        to_place *= np.minimum(1.0, radius / np.maximum(np.abs(to_place).max(axis=1), radius))[:, None]
        bend = conditions.bend(at, conditions.multipliers(at, ~held))
        ways = np.zeros((len(place), self.joints, 2))
        ways[:, :, : self.joints - PLACES] = np.linalg.qr(place, mode="complete")[0][
            :, :, PLACES:
        ]  # directions of joint motion that keep the tip's position
        bent = bend @ ways
        curve = np.swapaxes(ways, 1, 2) @ bent
        # an arm of four joints has only one such direction: keep the matrix regular
        curve[:, 1, 1] += self.joints - PLACES < 2
        pull = (at.turn @ at.sine[:, :, None])[:, :, 0]
        slope = (np.swapaxes(bent, 1, 2) @ to_place[:, :, None] - np.swapaxes(ways, 1, 2) @ pull[:, :, None])[:, :, 0]
        return np.clip(to_place + least_in_box(ways, slope, curve, low - to_place, high - to_place), low, high)


# --- minimum in a box ----------------------------------------------------------------------------------------------


def least_in_box(ways: Floats, slope: Floats, bend: Floats, low: Floats, high: Floats) -> Floats:
    """Minimise the quadratic `slope` · z + z · `bend` z / 2 over z (two variables), subject to `low` <= `ways` z <=
    `high`. Return the joint steps `ways` z (N, n).

    `ways` (N, n, 2): the derivatives of the joints with respect to z. `low`, `high` (N, n): the box of allowed steps.
    If no step stays in the box, return the step that leaves it by the smallest distance.
    """
    determinant = bend[:, 0, 0] * bend[:, 1, 1] - bend[:, 0, 1] ** 2
    upwards = (determinant > FLAT) & (bend[:, 0, 0] > 0.0)
    x = bend[:, 0, 1] * slope[:, 1] - bend[:, 1, 1] * slope[:, 0]
    y = bend[:, 0, 1] * slope[:, 0] - bend[:, 0, 0] * slope[:, 1]
    z = np.stack((x, y), axis=1) / np.where(upwards, determinant, np.nan)[:, None]
    step = np.asarray((ways @ z[:, :, None])[:, :, 0])  # step to where the gradient is 0; NaN if that is not a minimum
    rows = np.flatnonzero(~(_over(step, low, high) <= OVER))
    if len(rows):
        step[rows] = _on_sides(*(some[rows] for some in (ways, slope, bend, low, high, step)))
    return step


def _over(step: Floats, low: Floats, high: Floats) -> Floats:
    """Return for each step (..., n) the greatest distance by which a component leaves the box (...). The distance is
    negative if the step is inside the box.
    """
    return np.asarray(np.maximum(step - high, low - step).max(axis=-1))


def _on_sides(ways: Floats, slope: Floats, bend: Floats, low: Floats, high: Floats, inside: Floats) -> Floats:
    """Return the best steps (N, n) among those to the sides and corners of the box and the steps `inside`."""
    ends = np.stack((low, high), axis=2)  # both bounds of each joint's step (N, n, 2)
    # compute the variables z at the corners, where two joints are at a bound: (N, 2 n (n - 1), 2)
    first, second = np.array(list(combinations(range(ways.shape[1]), 2))).T
    a, b = ways[:, first], ways[:, second]
    determinant = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    a, b = (one / np.where(np.abs(determinant) > FLAT, determinant, np.nan)[..., None] for one in (a, b))
    at, other = ends[:, first][:, :, :, None], ends[:, second][:, :, None]
    x = at * b[..., 1, None, None] - other * a[..., 1, None, None]
    y = other * a[..., 0, None, None] - at * b[..., 0, None, None]
    z = np.concatenate(
        (_least_on_sides(ways, slope, bend, ends), np.stack((x, y), axis=-1).reshape(len(ways), -1, 2)), axis=1
    )
    steps = np.concatenate((inside[:, None], z @ np.swapaxes(ways, 1, 2)), axis=1)
    value = (z * (slope[:, None] + 0.5 * (z @ bend))).sum(axis=2)
    value = np.concatenate((np.full((len(z), 1), np.inf), value), axis=1)
    over = _over(steps, low[:, None], high[:, None])
    over[np.isnan(over)] = np.inf
    within = over <= OVER
    best = np.where(within.any(axis=1), np.where(within, value, np.inf).argmin(axis=1), over.argmin(axis=1))
    return np.asarray(np.nan_to_num(steps[np.arange(len(steps)), best]))


def _least_on_sides(ways: Floats, slope: Floats, bend: Floats, ends: Floats) -> Floats:
    """Return the variables z (N, 2 n, 2) that minimise the model on each side of the box, where one joint is at a
    bound.
    """
    size = (ways * ways).sum(axis=2)
    # the point nearest to z = 0 on the line of each side (N, n, 2, 2)
    foot = (ways / np.where(size > FLAT, size, np.nan)[:, :, None])[:, :, None] * ends[..., None]
    along = np.stack((-ways[:, :, 1], ways[:, :, 0]), axis=2)
    bent = along @ bend
    curve = (bent * along).sum(axis=2)
    fall = (along * slope[:, None]).sum(axis=2)[:, :, None] + (foot * bent[:, :, None]).sum(axis=3)
    part = -fall / np.where(curve > FLAT, curve, np.nan)[:, :, None]
    return np.asarray((foot + part[..., None] * along[:, :, None]).reshape(len(ways), -1, 2))


# maximum difference between F and its chord on a whole gap (interval between samples), as a fraction of F's fourth
# derivative
CHORD = 1.0 / 96.0
AROUND = 0.5  # the proof is valid for solutions whose multipliers are at most this far from the cubic
# bound, for unit vectors, of the third derivative's part that is bilinear in joints and linear in multipliers
BLOCKS = 1.155
PROOF_ROUNDING = 1e-12


class SteadyGaps(NamedTuple):
    """k gaps: the intervals between neighbouring samples of a path. All derivatives are by the fraction of the time
    between the samples, 0 to 1.

    `which`: the indexes of the gaps. `poses`: a function of indexes of gaps (k,) and of fractions of their time (m,)
    that returns the desired poses of the flange (k, m, 3, 4).
    """

    which: Rows
    begin: Floats  # joints at the start of each gap (k, n); `end`: at its end
    end: Floats
    twists: Floats  # twists of the tool at both ends (k, 2, 6), per gap instead of per second
    place: Floats  # (k,) bounds of the fourth derivative of the desired position [m]
    turn: Floats  # (k, 4) bounds of the first four derivatives of the desired rotation's angles, added up [rad]
    poses: Callable[[Rows, Floats], Floats]

    def some(self, which: Rows) -> SteadyGaps:
        """Return the subset of the gaps (intervals between samples) at the given positions."""
        numbers, *rows = self[:-1]
        begin, end, twists, place, turn = (row[which] for row in rows)
        return SteadyGaps(numbers[which], begin, end, twists, place, turn, self.poses)


class SteadyContinuation:
    """Proves for one arm and one position of the tip in the flange's frame that joints are continuous between samples.
    `sure` is 0: Newton's method is not certain to converge even from close start joints, so callers check the joints
    from which it starts.
    """

    sure = 0.0

    def __init__(self, conditions: SteadyConditions) -> None:
        self.conditions, batch = conditions, conditions.batch
        self.n, turning = conditions.joints, batch.turning
        reached = np.array(levers(batch.model)[1]) + length(position(conditions.tool))
        self.length = LENGTH * reached[0]
        # for each joint: the number of prismatic joints from it to the end of the arm; each of these may be one unit of
        # length beyond its range, which lengthens the lever of the joint
        sliding = np.cumsum(~turning[::-1])[::-1]
        self.levers = np.where(turning, reached / self.length + sliding, 1.0)
        i = np.arange(self.n)
        later = np.maximum.outer(i, i)
        self.pair = float(np.linalg.norm(self.levers[later]))
        self.triple = float(np.linalg.norm(self.levers[np.maximum(later[:, :, None], i)]))
        self.single = float(np.linalg.norm(self.levers))
        self.units = np.concatenate((np.where(turning, 1.0, self.length), np.full(PLACES, 1.0 / self.length)))

    def prove(self, gaps: SteadyGaps, pieces: int) -> Flags:
        """Return for each gap (interval between samples) whether the joints are proved to be continuous in it (k,). The
        proof divides each gap into `pieces` pieces.
        """
        parts = np.linspace(0.0, 1.0, pieces + 1)
        poses = np.swapaxes(gaps.poses(gaps.which, np.array((0.0, 1.0))), 0, 1)
        ends = zip((gaps.begin, gaps.end), poses, np.swapaxes(gaps.twists, 0, 1), strict=True)
        (a, v), (b, w) = (self._state(*end) for end in ends)
        cubic = Cubic(a, b, v, w)
        x, conditions, n = cubic.at(parts), self.conditions, self.n
        rows = (x * self.units).reshape(-1, x.shape[2])
        at = conditions.terms(rows[:, :n], gaps.poses(gaps.which, parts).reshape(-1, 3, 4))
        missed = np.linalg.norm(conditions.residual(at, rows[:, n:]) * self.units, axis=1).reshape(x.shape[:2])
        table = conditions.system(at, conditions.bend(at, rows[:, n:])) * self.units * self.units[:, None]
        table = table.reshape(*x.shape[:2], *table.shape[1:])
        fourth, bend, curved = self._bounds(gaps, cubic)
        beta = inverse_bound(table[:, :-1], table[:, 1:], bend / (8.0 * pieces**2))
        off = np.maximum(missed[:, 1:], missed[:, :-1]) + (CHORD * fourth / pieces**2)[:, None] + PROOF_ROUNDING
        return np.asarray((beta * beta * curved[:, None] * off <= MAX_KANTOROVICH).all(axis=1))

    def step(self, q: Floats, T: Floats, guides: tuple[Floats, Floats] | None) -> Floats:  # noqa: ARG002 (no guides)
        """Return joints (N, n) after one step of Newton's method from q to poses T (N, 3, 4)."""
        conditions = self.conditions
        at = conditions.terms(q, T)
        step, _ = conditions.newton(at, conditions.bend(at, conditions.multipliers(at)))
        return q + step

    def _state(self, q: Floats, T: Floats, twist: Floats) -> tuple[Floats, Floats]:
        """Return joints and multipliers (N, n + 3), and their rates for the twists of the tool, in the units of the
        proof (`units`).
        """
        conditions = self.conditions
        at = conditions.terms(q, T)
        multipliers = conditions.multipliers(at)
        table = conditions.system(at, conditions.bend(at, multipliers))
        rate = (inverses(table) @ conditions.wanted_rates(at, twist)[:, :, None])[:, :, 0]
        return np.concatenate((q, multipliers), axis=1) / self.units, rate / self.units

    def _bounds(self, gaps: SteadyGaps, cubic: Cubic) -> tuple[Floats, Floats, Floats]:
        """Return bounds (k,) of the fourth derivative of F on the cubic, of the second derivative of F' on it, and of
        the change of F' per distance from the cubic.
        """
        pace = [order[:, : self.n].sum(axis=1) for order in cubic.most()]
        greatest = (
            np.maximum(np.abs(cubic.begin), np.abs(cubic.end)) + cubic.most()[1] / 8.0
        )  # bounds of the unknowns themselves
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
    """Return bounds of a rotation matrix and its first four derivatives, from bounds of the derivatives of the sum of
    its angles (Faa di Bruno's formula).
    """
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
