"""Search the joints for many poses of a numerical arm at once, each independently, and prove that the joints are
continuous between neighbouring samples of a path.

`SearchBatch.search` is the loop of all searches over arrays; a subclass gives the step of one kind of arm
(`search_state`). Arms of four or five joints that turn their tool as closely as possible to the wanted orientation have
another step (`steady.batch`). A search that stops coming nearer is given up, and searches that meet are merged.
Searches start from the sample joints that bring the tool nearest to the pose. Single poses have another loop,
`NumericArm._search` for floats: one step of one pose takes 0.03 ms there, and 0.3 ms as an array.

Let c(x), with x from 0 to 1, be the cubic through the joints and rates at two samples. Between the samples it is near
the joints that solve F(x, q) = 0, where F is the error of the flange: of its position, and the vector of the sines of
its rotation error. The theorem of Kantorovich (Ortega and Rheinboldt, "Iterative Solution of Nonlinear Equations in
Several Variables", 1970, 12.6.2) is applied at c(x): with beta >= |F'(c)^-1|, eta >= beta |F(c)| and |F'(p) - F'(q)| <=
L |p - q|, a solution exists within 2 eta of c if beta L eta <= 1/2, and no other solution within 1 / (beta L). As this
is true at every x, and c is exact at both samples, one continuous branch of solutions connects the samples.

|F(c(x))| is at most 1/384 of the maximum of its fourth derivative with respect to x, because F and its slope are 0 at
both samples (the remainder of Hermite's interpolation; Davis, "Interpolation and Approximation", 1963, 3.1).
Derivatives of the rotation with respect to x are bounded by Faa di Bruno's formula, from the sums of the derivatives of
all angles (of joints and of the path). For the position, each term is multiplied by the lever of the last of its
joints: the greatest distance of the flange from the axis of this joint.

To bound beta, c is divided into pieces, each of length g in x. On a piece the Jacobian J differs from the chord between
its values at the ends by at most g^2 / 8 times the maximum of its second derivative, and F' differs from J by at most
|F| |J|. With A the inverse of the mean of J at both ends, |1 - A F'| is at most |A| times a sum: half of the difference
of J between the ends, and the two errors above. So |F'^-1| is at most |A| / (1 - |1 - A F'|) (Neumann series).

A redundant arm has guides: weighted sums of the joints, each with a prescribed value. F has one more row for each: the
sum minus its prescribed value. This row is linear in the joints and does not change L.

Lengths [m], including those of prismatic joints, are divided by `Continuation.length` [m], so that all unknowns are in
rad. Norms of vectors are Euclidean, those of inverse matrices Frobenius norms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from itertools import islice
from math import hypot, pi, sqrt
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats, Rows
from vrs_cli.kinematics.clearance import Unchanging
from vrs_cli.kinematics.formula import over_arrays
from vrs_cli.kinematics.joints import MAX_RATE_ERROR, NONE, Configuration, Joints
from vrs_cli.kinematics.model import LEVEL, STRAIGHT, RobotModel, levers, link_transform, some_joints
from vrs_cli.kinematics.numeric.search import CONVERGED, DAMPING, LARGEST_STEP, LEAST_DAMPING, STEPS, missing
from vrs_cli.kinematics.serial_batch import SerialBatch, columns
from vrs_cli.kinematics.transform import Transform

# [m, rad] a result with this error is accepted if further steps do not reduce it, as in singular poses
SINGULAR = 5e-9
NEARER, WAITS = 0.9, 8  # a search is given up after WAITS steps that do not reduce the error by the factor NEARER
# factors of the radius after a step in the same direction, and after a step that reverses the direction
LONGER, SHORTER = 1.5, 0.5
FAR = 0.05  # [rad] a search with a larger rotation error ends if another search has reached the same pose exactly
# [rad, m] searches for the same pose whose joints come this close are merged, because they would end alike
ALIKE = 0.03
MERGED = 6, 3  # number of steps before searches are first merged, and between later merges
SAMPLES = 512
TURN_COUNTS = 0.1  # [arm lengths/rad] weight of the rotation error relative to the distance of the tip

Guides = tuple[Floats, Floats]
# rounds of searches: the start of each round in the list of sample joints nearest to a pose, their number, and whether
# to search within the limits. Without limits more searches converge, and whole turns may bring joints back inside
Rounds = Sequence[tuple[int, int, bool]]


class SearchState(NamedTuple):
    """The state of N searches: the next steps of the joints (N, n), the errors that must become 0 (N,) [m, rad], and
    the rotation errors that may remain (N,) [rad]. `exact` (N,): whether a search succeeds with this step; `close`
    (N,): whether it succeeds if no further step comes nearer.
    """

    step: Floats
    missed: Floats
    turned: Floats
    exact: Flags
    close: Flags


class Found(NamedTuple):
    """The results of searches: joints (N, n), which are NaN if a search failed, and rotation errors (N,) [rad]."""

    joints: Floats
    turned: Floats

    def each(self) -> list[tuple[Joints, float]]:
        there = np.isfinite(self.turned)
        return list(zip(map(tuple, self.joints[there].tolist()), self.turned[there].tolist(), strict=True))


class SearchBatch(SerialBatch):
    """The functions of an arm without a closed form for arrays. Joints are NaN in rows whose search does not converge.

    `rounds`, `rounds_of_one`: the rounds of searches for many poses and for one pose. `at_once`: the number of poses
    that are searched at once. `settled`: a search has converged if its step is smaller [rad, m]. `scaled`: whether a
    long step is shortened as a whole; else its bounds keep each joint within a radius. `tip` (3,): the point whose
    distance decides which samples are near a pose, in the frame of the flange.
    """

    rounds: Rounds
    rounds_of_one: Rounds
    at_once: int
    settled: float
    scaled: bool
    tip: Floats

    def __init__(self, model: RobotModel, ways: tuple[Configuration, ...], unchanging: Unchanging) -> None:
        super().__init__(model, ways, unchanging)
        self.middle = (self.lower + self.upper) / 2

    def search_state(self, q: Floats, T: Floats, low: Floats, high: Floats, guides: Guides | None) -> SearchState:
        """Return the state of searches at joints (N, n). `low`, `high` (N, n): the bounds of the steps."""
        raise NotImplementedError

    def search(
        self,
        T: Floats,
        near: Floats,
        *,
        bounded: bool,
        steps: int = STEPS,
        pose: Rows | None = None,
        guides: Guides | None = None,
    ) -> Found:
        """Search joints for poses (N, 3, 4) from starts (N, n) or (n,), within the limits if `bounded`.

        `pose` (N,): the index of the pose of each search; if searches for the same pose meet, only one of them
        continues. `guides`: the weights (r, n) of prescribed sums of the joints, and the values (N, r) of these sums.
        """
        lower, upper = (self.lower, self.upper) if bounded else (-np.inf, np.inf)
        q = np.clip(np.broadcast_to(near, (len(T), self.joints)), lower, upper)
        found = Found(np.full_like(q, np.nan), np.full(len(q), np.inf))
        rows, before, waited = np.flatnonzero(self.in_task(T)), np.zeros_like(q), np.zeros(len(q), dtype=int)
        radius, least = np.full(len(q), LARGEST_STEP), np.full(len(q), np.inf)
        for count in range(steps):
            if not len(rows):
                break
            held = None if guides is None else (guides[0], guides[1][rows])
            at, low, high = q[rows], lower - q[rows], upper - q[rows]
            if not self.scaled:
                low, high = np.maximum(low, -radius[rows, None]), np.minimum(high, radius[rows, None])
            step, missed, turned, exact, close = self.search_state(at, T[rows], low, high, held)
            size = np.abs(step).max(axis=1)
            if self.scaled:
                step *= np.minimum(1.0, LARGEST_STEP / np.maximum(size, LARGEST_STEP))[:, None]
            else:
                back = (step * before[rows]).sum(axis=1) < 0.0
                shorter = SHORTER * np.minimum(radius[rows], size)
                radius[rows] = np.where(back, shorter, np.minimum(LONGER * radius[rows], LARGEST_STEP))
                before[rows] = step
            there = at + step
            q[rows] = np.clip(there, lower, upper) if bounded else there
            nearer = missed <= NEARER * least[rows]
            least[rows], waited[rows] = np.where(nearer, missed, least[rows]), np.where(nearer, 0, waited[rows] + 1)
            ended = exact | (size < self.settled) | (waited[rows] > WAITS)
            done = exact | (close & ended)
            if done.any():
                found.joints[rows[done]], found.turned[rows[done]] = q[rows[done]], turned[done]
            if pose is not None and (turned[~done] > FAR).any():  # another search may have reached the pose exactly
                had = pose[rows[done & (turned < STRAIGHT)]]
                ended |= np.isin(pose[rows], had) & (turned > FAR)
            rows = rows[~ended]
            if pose is not None and count + 1 in range(MERGED[0], steps, MERGED[1]):
                cells = np.column_stack((pose[rows], np.rint(q[rows] / ALIKE)))
                # one number for each cell of joints: numpy compares numbers much faster than rows
                rows = rows[np.sort(np.unique(cells @ np.exp(np.arange(self.joints + 1.0)), return_index=True)[1])]
        return found

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        """Search each pose from its starts, and return the joints within the limits that have the least rotation
        error.
        """
        q = np.full((len(T), self.joints), np.nan)
        for first in range(0, len(T), self.at_once):
            pose, found = self.search_all(T[first : first + self.at_once], self.rounds, self.middle)
            order = np.lexsort((found.turned, pose))
            row, at = np.unique(pose[order], return_index=True)
            q[first + row] = found.joints[order[at]]
        return q[:, None], self.inside(q)[:, None]

    def solutions(self, T: Transform, near: Joints) -> list[tuple[Joints, float]]:
        """Search one pose from its starts and from `near`. Return the joints found within the limits, with their
        rotation errors [rad].
        """
        return self.search_all(np.reshape(T, (1, 3, 4)), self.rounds_of_one, near)[1].each()

    def search_all(self, T: Floats, rounds: Rounds, near: Joints | Floats) -> tuple[Rows, Found]:
        """Search poses (N, 3, 4) from `near` (n,) and from their starts. Return the index of the pose of each result,
        and the results within the limits.

        Each round searches the poses that earlier rounds have not reached; the first, and rounds without starts, begin
        from `near` too.
        """
        poses, results, left, own = list[Rows](), list[Found](), np.arange(len(T)), np.array([near])
        for after, count, bounded in rounds:
            begin = list(self.starts(T[left], after, count)) if count else [own] * len(left)
            if count and not poses:
                begin = [np.concatenate((own, one)) if len(one) else one for one in begin]
            pose = np.repeat(left, [len(one) for one in begin])
            found = self.search(T[pose], np.concatenate(begin), bounded=bounded, pose=pose)
            poses.append(pose)
            results.append(self._within_limits(found))
            left = np.setdiff1d(pose, pose[results[-1].turned <= STRAIGHT])
            if not len(left):
                break
        return np.concatenate(poses), Found(*map(np.concatenate, zip(*results, strict=True)))

    def starts(self, T: Floats, after: int, count: int) -> Iterable[Floats]:
        """Return start joints (k, n) for each of the poses (N, 3, 4); none for poses that are surely out of reach."""
        return self.samples.near(T, after, count)

    @cached_property
    def samples(self) -> SampledStarts:
        return SampledStarts(self, self.tip)

    def _within_limits(self, found: Found) -> Found:
        """Add whole turns that bring the results nearest to the middles of the ranges, and discard those outside the
        limits: NaN joints, and an infinite rotation error.
        """
        joints = self.turned_near(found.joints, self.middle)
        inside = self.inside(joints)
        return Found(np.where(inside[:, None], joints, np.nan), np.where(inside, found.turned, np.inf))


class SampledStarts:
    """Chooses start joints of searches from random samples, for one arm and the tip of one tool (3,) in the frame of
    the flange.
    """

    def __init__(self, batch: SerialBatch, tip: Floats) -> None:
        self.tip, self.joints = tip, np.array(list(islice(some_joints(batch.model), SAMPLES)))
        self.poses = batch.forward(self.joints)
        self.tips = self.poses[:, :, :3] @ tip + self.poses[:, :, 3]
        self.length = np.ptp(self.tips, axis=0).max() / 2.0

    def near(self, T: Floats, after: int, count: int) -> Floats:
        """Sort the samples by their distance from each pose (N, 3, 4), skip the first `after`, and return the next
        `count` (N, count, n).
        """
        away = np.linalg.norm(self.tips - (T[:, None, :, :3] @ self.tip + T[:, None, :, 3]), axis=2)
        cosine = 0.5 * (T[:, :, :3].reshape(-1, 9) @ self.poses[:, :, :3].reshape(-1, 9).T - 1.0)
        missed = away / self.length + TURN_COUNTS * np.arccos(np.clip(cosine, -1.0, 1.0))
        return np.asarray(self.joints[np.argsort(missed, axis=1)[:, after : after + count]])


class NumericBatch(SearchBatch):
    """The functions of `NumericArm` for arrays.

    `solve`: a function that solves a single pose, used in `inverse` in place of the search; it returns what
    `RobotArm.branches` returns. `held`: the indexes of the joints that keep their values.
    """

    # a step as small as CONVERGED may still leave a larger error, because links are levers
    at_once, settled, scaled = 512, 0.1 * CONVERGED, True
    rounds_of_one = tuple((*part, bounded) for part in ((0, 24), (24, 104), (128, 384)) for bounded in (True, False))
    rounds = tuple((*part, bounded) for part in ((0, 0), (0, 1), (1, 3), (4, 20)) for bounded in (True, False))
    rounds += rounds_of_one[2:]

    def __init__(
        self,
        model: RobotModel,
        unchanging: Unchanging,
        held: tuple[int, ...],
        solve: Callable[[Transform], tuple[Joints | None, ...]] | None = None,
    ) -> None:
        super().__init__(model, (NONE,), unchanging)
        self.solve = solve
        self.still_joints, self.short = held, model.joint_count < model.task.size
        self.counting, self.tip = np.array(model.counts), np.zeros(3)

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        if self.solve is None:
            return super().inverse(T)
        q = np.full((len(T), self.joints), np.nan)
        for row, pose in enumerate(T.reshape(-1, 12).tolist()):
            q[row] = self.solve(Transform(*pose))[0] or np.nan
        return q[:, None], self.inside(q)[:, None]

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:  # noqa: ARG002
        axes = np.eye(self.joints)[list(self.still_joints)]
        return self.solve_guided(
            T, near, axes, np.broadcast_to(near, (len(T), self.joints))[:, list(self.still_joints)]
        )

    def solve_guided(self, T: Floats, near: Floats, weights: Floats, values: Floats) -> Floats:
        return self.search(T, near, bounded=False, guides=(weights, values)).joints

    def search_state(self, q: Floats, T: Floats, low: Floats, high: Floats, guides: Guides | None) -> SearchState:
        J, error = self.error(q, T)
        if guides is not None:
            J, error = with_guides(J, error, q, *guides)
        step = damped_step(J, error, low, high)
        missed = np.abs(error).max(axis=1)
        exact = missed < CONVERGED
        close = exact if guides is not None else missed < SINGULAR
        if self.short:  # errors this small do not show in three decimals, so the pose counts as reached
            places = sum(self.model.counts[:3])
            away, turned = (np.linalg.norm(part, axis=1) for part in (error[:, :places], error[:, places:]))
            close = (away <= LEVEL) & (turned <= STRAIGHT)
        return SearchState(step, missed, np.zeros_like(missed), exact, close)

    def error(self, q: Floats, T: Floats) -> tuple[Floats, Floats]:
        """Return the m rows of the Jacobian that count for the task (N, m, n), and the remaining errors from q to T in
        these rows (N, m) [m, rad].

        Rotations are expressed in the axes of the flange if only a part of the pose counts.
        """
        have, J = self.forward_and_jacobian(q)
        missing = self._missing(have, T)
        if self.counting.all():
            return J, missing
        turned = np.einsum("nji,nj->ni", have[..., :3], missing[:, 3:])
        missing = np.concatenate((missing[:, :3], turned), axis=1)
        return self._that_count(have, J), missing[:, self.counting]

    def rows(self, q: Floats) -> Floats:
        """Return the rows of the Jacobian that count for the task (N, m, n)."""
        return self.jacobian(q) if self.counting.all() else self._that_count(*self.forward_and_jacobian(q))

    def _that_count(self, have: Floats, J: Floats) -> Floats:
        turned = np.swapaxes(have[..., :3], -1, -2) @ J[:, 3:]
        return np.concatenate((J[:, :3], turned), axis=1)[:, self.counting]

    def _missing(self, have: Floats, T: Floats) -> Floats:
        """Return the displacements and rotation vectors that take the flange poses `have` to the poses T, as an array
        of shape (N, 6) [m, rad].
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            found = MISSING(self.model.task, Transform(*columns(have)), Transform(*columns(T)))
        return np.stack(found, axis=1)


MISSING = over_arrays(missing)


def damped_step(J: Floats, error: Floats, low: Floats, high: Floats) -> Floats:
    """Return the damped least-squares steps d (N, n) that make J d equal to the errors (N, m); J (N, m, n). `low`,
    `high` (N, n): the distances of the joints from their limits.

    Joints that are at a limit, and that the step would push outside, are held, and the step is computed again.
    """
    damping = DAMPING * (error * error).sum(axis=1) + LEAST_DAMPING
    damped = damping[:, None, None] * np.eye(J.shape[1])
    while True:
        weights = np.linalg.solve(J @ np.swapaxes(J, 1, 2) + damped, error[..., None])[..., 0]
        step: Floats = np.einsum("nij,ni->nj", J, weights)
        pushed = ((low >= 0.0) & (step < 0.0)) | ((high <= 0.0) & (step > 0.0))
        if not pushed.any():
            return step
        J = np.where(pushed[:, None], 0.0, J)


def with_guides(J: Floats, error: Floats, q: Floats, weights: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Append a row for each of r guides to the Jacobians (N, m, n) and errors (N, m), and return both (N, m + r, ...).
    `weights` (r, n) and `values` (N, r): see `search`.
    """
    rows = np.broadcast_to(weights, (len(J), *weights.shape))
    return np.concatenate((J, rows), axis=1), np.concatenate((error, values - q @ weights.T), axis=1)


# --- the proof of continuous joints ----------------------------------------------------------------------------------

LENGTH = 0.4  # unit of length in proofs, as a fraction of the longest lever; proofs succeed most often with this value
MAX_KANTOROVICH = 0.5  # the theorem of Kantorovich is valid if beta L eta (see above) is at most this
LOST = 0.9  # a proof succeeds only if |1 - A F'| (see above) is below this value; below 1, F' certainly has an inverse
HERMITE = 1.0 / 384.0  # maximum interpolation error of the cubic, as a fraction of the fourth derivative
# maximum error of the cubic caused by errors of its slopes at both ends, as a fraction of these errors
SLOPES = 8.0 / 27.0


class Cubic(NamedTuple):
    """Cubic polynomials of n unknowns in k gaps between samples, given by the values and rates (k, n) at both ends. The
    parameter is the fraction of the time between the samples, 0 to 1.
    """

    begin: Floats
    end: Floats
    begin_rate: Floats
    end_rate: Floats

    def bends(self) -> tuple[Floats, Floats, Floats]:
        """Return the second derivatives at both ends, and the constant third derivative (k, n)."""
        way, v, w = 6.0 * (self.end - self.begin), self.begin_rate, self.end_rate
        both = v + w
        bend = way - 2.0 * (v + both)
        third = 6.0 * both - 2.0 * way
        return bend, bend + third, third

    def at(self, parts: Floats) -> Floats:
        """Return the values of the unknowns (k, m, n) at fractions (m,) of the time."""
        bend, _, third = self.bends()
        x = parts[:, None]
        halves = 0.5 * bend[:, None], third[:, None] / 6.0
        return np.asarray(self.begin[:, None] + x * (self.begin_rate[:, None] + x * (halves[0] + x * halves[1])))

    def most(self) -> tuple[Floats, Floats, Floats]:
        """Return upper bounds (k, n) of the absolute values of the first three derivatives."""
        before, after, third = (np.abs(bend) for bend in self.bends())
        rates = np.maximum(np.abs(self.begin_rate), np.abs(self.end_rate)) + third / 8.0
        return rates, np.maximum(before, after), third


class Gaps(NamedTuple):
    """k gaps: the intervals between neighbouring samples of a path. All derivatives are by the fraction of the time
    between the samples, 0 to 1.
    """

    way: Cubic  # cubics through the joints and rates at both samples (k, n) [rad, m]
    place: Floats  # (k,) bounds of the fourth derivative of the desired position [m]
    turn: Floats  # (k, 4) bounds of the first four derivatives of the desired rotation's angles, added up [rad]
    guide: Floats  # (k,) bounds of the fourth derivative of the guides' values
    weights: Floats  # (r, n) weights of the joints in r guides (prescribed sums)

    def some(self, which: Rows) -> Gaps:
        """Return the subset of the gaps (intervals between samples) with the given indices."""
        way, *rows, weights = self
        place, turn, guide = (row[which] for row in rows)
        return Gaps(Cubic(*(row[which] for row in way)), place, turn, guide, weights)


class Continuation:
    """Proves for one arm that joints are continuous between samples. The arm has as many joints as the parts of a pose
    that count and the guides together.

    `sure`: if start joints are closer than this to the proved joints [rad, m], Newton's method converges to the proved
    joints without a check.
    """

    sure = 0.1

    def __init__(self, batch: NumericBatch) -> None:
        self.batch, model = batch, batch.model
        self.turns = batch.turning
        _, reached = levers(model)
        self.length = LENGTH * reached[0]
        # for each joint: the number of prismatic joints from it to the end of the arm; each of these may be one unit of
        # length beyond its range, which lengthens the lever of the joint
        sliding = np.cumsum(~batch.turning[::-1])[::-1]
        self.levers = np.where(self.turns, np.array(reached) / self.length + sliding, 1.0)
        self.units = np.where(self.turns, 1.0, self.length)
        self.places = sum(model.counts[:3])
        n = model.joint_count
        first, later = np.minimum.outer(range(n), range(n)), np.maximum.outer(range(n), range(n))
        # bound of the second derivatives of the flange's position: the derivative with respect to two joints is at most
        # the lever of the later one
        self.place_bend = float(np.linalg.norm(np.where(self.turns[first], self.levers[later], 0.0), 2))
        # the transformation of a link with a revolute joint is a constant matrix (n, 1, 4, 4), plus another times the
        # cosine of the joint, plus another times its sine
        ends = [[_square(link_transform(link, x)) for x in (0.0, pi, 0.5 * pi)] for link in model.links]
        begin, half, quarter = np.array(ends)[:, :, None].swapaxes(0, 1)
        self.fixed, self.cosines = 0.5 * (begin + half), 0.5 * (begin - half)
        self.sines = quarter - self.fixed
        self.base, self.flange = _square(model.base), _square(model.flange)[:, 3]
        # The derivative of the flange's position by several joints is at most the lever of the last of them. So to
        # bound the position, sums over the joints up to each joint k are multiplied by lever k - lever k+1
        self.place_levers = self.levers - np.append(self.levers[1:], 0.0)
        # Such factors bound the columns of the Jacobian too. The upper half of column j is a derivative of the
        # position. The lower half is the axis of joint j. In the base frame the axis turns with the joints before j,
        # whose sum stands at j-1. In the frame of the flange it turns with the joints after j; the sum of all joints
        # bounds theirs
        upper = np.where(np.tri(n), self.place_levers[:, None], 0.0)
        before = np.eye(n, k=1) if batch.counting.all() else np.arange(n)[:, None] == n - 1
        self.bend_levers = np.hstack((upper, np.where(self.turns, before, 0.0)))

    def prove(self, gaps: Gaps, pieces: int) -> Flags:
        """Return for each gap (interval between samples) whether the joints are proved to be continuous in it (k,). The
        proof divides each gap into `pieces` pieces.
        """
        n, k = float(self.turns.sum()), len(gaps.place)
        missed, bend = self._bounds(gaps)
        # joints of the cubic at the ends of the pieces
        q = np.stack(gaps.way[:2], axis=1) if pieces == 1 else gaps.way.at(np.linspace(0.0, 1.0, pieces + 1))
        if (q[:-1, -1] == q[1:, 0]).all():  # each gap begins where the one before it ends
            J = self._system(np.concatenate((q[:, :-1].reshape(-1, q.shape[2]), q[-1:, -1])), gaps.weights)
            before, after = (J[i : i + k * pieces].reshape(k, pieces, *J.shape[1:]) for i in (0, 1))
        else:
            J = self._system(q.reshape(-1, q.shape[2]), gaps.weights).reshape(*q.shape[:2], -1, q.shape[2])
            before, after = J[:, :-1], J[:, 1:]
        beta = inverse_bound(before, after, bend / (8.0 * pieces**2) + sqrt(n) * missed)
        least = np.fmin(MAX_KANTOROVICH, MAX_KANTOROVICH / (beta * hypot(self.place_bend, n)))
        return np.asarray((beta * missed[:, None] <= least).all(axis=1))

    def step(self, q: Floats, T: Floats, guides: tuple[Floats, Floats] | None) -> Floats:
        """Return joints (N, n) after one step of Newton's method from q to poses T (N, 3, 4).

        `guides`: the weights (r, n) of prescribed sums of the joints, and the values (N, r) of these sums.
        """
        J, error = self.batch.error(q, T)
        if guides is not None:
            J, error = with_guides(J, error, q, *guides)
        return np.asarray(q + (inverses(J) @ error[:, :, None])[:, :, 0])

    def _system(self, q: Floats, weights: Floats) -> Floats:
        """Return F' (N, m + r, n) at few joints (N, n): the rows of the Jacobian that count for the task, and the
        weights of the guides.

        All links are computed together: for less than 200 joints this takes less time than the formulas of `batch`.
        """
        if not (self.batch.counting.all() and self.turns.all()):
            rows = self.batch.rows(q)
            system = np.concatenate((rows, np.broadcast_to(weights, (len(q), *weights.shape))), axis=1) * self.units
            system[:, : self.places] /= self.length
            return system
        turned = q.T[:, :, None, None]
        links = self.fixed + np.cos(turned) * self.cosines + np.sin(turned) * self.sines
        frames = np.empty((len(links) + 1, len(q), 4, 4))
        frames[0] = self.base
        for i, link in enumerate(links):
            np.matmul(frames[i], link, out=frames[i + 1])
        system = np.empty((6 + len(weights), len(links), len(q)))
        x, y, z = ((frames[-1] @ self.flange - frames[:-1, :, :, 3]) / self.length).transpose(2, 0, 1)[:3]
        system[3:6] = ax, ay, az = frames[:-1, :, :3, 2].transpose(2, 0, 1)
        system[:3] = ay * z - az * y, az * x - ax * z, ax * y - ay * x
        system[6:] = weights[:, :, None]
        return system.transpose(2, 0, 1)

    def _bounds(self, gaps: Gaps) -> tuple[Floats, Floats]:
        """Return for each gap bounds (k,) of |F| and of the second derivative of J by x, on the cubic."""
        # the bounds of the joints' first three derivatives, summed from the first joint to each joint (3, k, n)
        sums = np.cumsum(np.stack(gaps.way.most()) / self.units, axis=2)
        turn = sums[:, :, -1] + gaps.turn.T[:3]
        places, turned = fourth_of_turn(*sums), fourth_of_turn(*turn) + gaps.turn[:, 3]
        place = places @ self.place_levers + gaps.place / self.length
        fourth = np.sqrt(turned * turned + place * place + gaps.guide**2)
        size = 1.0 + float(np.linalg.norm(gaps.weights * self.units))
        missed = HERMITE * fourth + SLOPES * MAX_RATE_ERROR * (size * sums[0, :, -1] + sums[0] @ self.place_levers)
        bend = (sums[0] * sums[0] + sums[1]) @ self.bend_levers
        return missed, np.sqrt((bend * bend).sum(axis=1))


def _square(T: Transform) -> Floats:
    return np.reshape((*T, 0.0, 0.0, 0.0, 1.0), (4, 4))


def fourth_of_turn(first: Floats, second: Floats, third: Floats, fourth: Floats | float = 0.0) -> Floats:
    """Return a bound of the fourth derivative of a rotation matrix, from bounds of the first four derivatives of the
    sum of its angles.
    """
    square = first * first
    return np.asarray(square * (square + 6.0 * second) + 3.0 * second * second + 4.0 * first * third + fourth)


def inverse_bound(before: Floats, after: Floats, off: Floats) -> Floats:
    """Return bounds (k, m) of |F'^-1| on m pieces of each gap, from F' at both ends of each piece (k, m, n, n); NaN
    where F' may be singular.

    `off` (k,): bounds of the difference between F' and the chord between its values at the ends of a piece.
    """
    A = inverses(0.5 * (after + before))
    size = _norm(A)
    lost = 0.5 * _norm(A @ (after - before)) + size * off[:, None]
    return np.asarray(size / np.where(lost < LOST, 1.0 - lost, np.nan))


def _norm(matrices: Floats) -> Floats:
    """Return the Frobenius norms (...) of matrices (..., m, n)."""
    return np.asarray(np.sqrt(np.einsum("...ij,...ij->...", matrices, matrices)))


def inverses(J: Floats) -> Floats:
    """Return the inverses (..., n, m) of matrices (..., m, n), or their pseudo-inverses if m > n; NaN for singular
    matrices.
    """
    if J.shape[-2] > J.shape[-1]:
        return np.asarray(np.linalg.pinv(J), dtype=np.float64)
    try:
        return np.asarray(np.linalg.inv(J), dtype=np.float64)
    except np.linalg.LinAlgError:  # at least one matrix is singular: invert them one by one
        inverse = np.asarray(np.linalg.pinv(J), dtype=np.float64)
        inverse[np.linalg.matrix_rank(J) < J.shape[-1]] = np.nan
        return inverse
