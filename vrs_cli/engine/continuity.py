"""Prove that the joints of a line are continuous between its samples, for arms without closed-form inverse kinematics.
The proof of `kinematics.continuation` is applied to paths.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import pairwise
from math import hypot
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct, structs

from vrs_cli.engine.following import Follower, Sample
from vrs_cli.engine.position import flange_poses, guide_values
from vrs_cli.kinematics.arm import LineProof
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.numeric.batch import Continuation, Cubic, Gaps, fourth_of_turn
from vrs_cli.kinematics.transform import position
from vrs_cli.trajectory.polynomial import Polynomial, derivative, most
from vrs_cli.trajectory.segment import CartesianPath

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats, Rows
    from vrs_cli.kinematics.numeric.steady.batch import SteadyGaps

FOURTH = 4
POWERS = np.arange(1.0, FOURTH + 1.0)
# numbers of pieces into which the proof cuts the gap between two samples, before it takes another sample
PROOF_PIECES = (1, 2, 8, 32, 64)
# next to a rest, this fraction of a stretch's time needs no proof: the tool then covers under 1/1000 of the distance
REST_PART = 2.0**-6
FINEST_GAP = 2.0**-24  # smallest gap, as a fraction of a stretch; if a smaller one is needed, the line is refused
MAX_EXTRA_SAMPLES = 400  # maximum number of samples added to a line
SEED_DOUBLINGS = 8  # maximum number of doublings of the number of seeds
SEED_SIDE = 1e-9  # seeds are also checked this close to the instant between two of them (fraction of that instant)
MAX_NEWTON_REST = 0.2  # fraction of the distance from a seed to the joints that Newton's first step may leave
PROOF_TOLERANCE = 1e-3  # [rad, m] allowed in addition to that part of the distance: such joints are on the right branch
# number of gaps halved together; the shortest come first, so that an impossible line is detected early
GAPS_AT_ONCE = 8


class Followed(Struct, frozen=True, dict=True):
    """A stretch of a straight line, its duration [s], and the samples on it."""

    path: CartesianPath
    duration: float
    samples: list[Sample]

    @cached_property
    def pace(self) -> tuple[float, ...]:
        """Upper bounds: of the fourth derivative of the tool's position [m/s4]; of the first to fourth derivatives of
        all turning angles, summed [rad/s ... rad/s4]; and of the fourth derivative of the guides.
        """
        rates, turns = [turn.angle for turn in self.path.turns], list[float]()
        for _ in range(FOURTH):
            rates = [derivative(rate) for rate in rates]
            turns.append(sum(most(rate, self.duration) for rate in rates))
        return self._bent(self.path.position), *turns, self._bent([guide.value for guide in self.path.guides])

    def looked_at(self, path: CartesianPath) -> Floats:
        """Return the times of the samples, and times just before and after each instant at which `path` changes from
        one seed to the next.
        """
        halfway = (np.arange(len(path.seeds) - 1) + 0.5) * path.seed_interval
        beside = np.concatenate([halfway * (1.0 + side) for side in (-SEED_SIDE, SEED_SIDE)])
        return np.concatenate(([sample.s for sample in self.samples], beside[beside < self.duration]))

    def joints(self, s: Floats) -> Floats:
        """Return the joints at times (N,), by the cubics through the samples (N, n)."""
        times, q, v = (np.array(column) for column in zip(*self.samples, strict=True))
        i = np.clip(np.searchsorted(times, s, side="right") - 1, 0, len(times) - 2)
        h = (times[i + 1] - times[i])[:, None]
        x, way = (s - times[i])[:, None] / h, q[i + 1] - q[i]
        bent = (x - 1.0) * (v[i] * h - way) + x * (v[i + 1] * h - way)
        return np.asarray(q[i] + x * way + x * (x - 1.0) * bent)

    def _bent(self, rows: Iterable[Polynomial]) -> float:
        """Return a bound of the fourth derivatives of several polynomials together."""
        bent = [row for row in rows if len(row) > FOURTH]
        for _ in range(FOURTH):
            bent = [derivative(row) for row in bent]
        return hypot(*(most(row, self.duration) for row in bent))


class Gap(Struct, frozen=True):
    """The part of a stretch between two neighbouring samples."""

    of: Followed
    a: Sample
    b: Sample

    @property
    def lasting(self) -> float:
        return self.b.s - self.a.s

    @property
    def part(self) -> float:
        """The duration of the gap as a fraction of its stretch."""
        return self.lasting / self.of.duration

    def halves(self, follower: Follower) -> tuple[Gap, Gap]:
        """Sample the middle, and return both halves of the gap."""
        middle = follower.sample(self.of.path, 0.5 * (self.a.s + self.b.s), self.a.joints)
        return Gap(self.of, self.a, middle), Gap(self.of, middle, self.b)


def check_continuous(
    continuation: LineProof,
    follower: Follower,
    stretches: Sequence[tuple[CartesianPath, float, list[Sample]]],
) -> list[Followed]:
    """Prove that the joints lead continuously from each sample to the next, on stretches (path, duration [s], samples).

    Return the stretches with all samples that the proof used. Raises LocationOutOfRange, JointOutOfRange, or
    StraightLineSingular with the position.
    """
    followed = [Followed(*stretch) for stretch in stretches]
    gaps = _gaps_without_proof(continuation, follower, [gap for one in followed for gap in _gaps(follower, one)])
    left, more = MAX_EXTRA_SAMPLES, list[tuple[Followed, Sample]]()
    while gaps:
        gaps.sort(key=lambda gap: gap.part)
        finest, left = gaps[0], left - len(gaps[:GAPS_AT_ONCE])
        if left < 0 or finest.part < FINEST_GAP:
            raise follower.refuse(finest.of.path, finest.a.s, "the line is too near to a singularity")
        halves = [half for gap in gaps[:GAPS_AT_ONCE] for half in gap.halves(follower)]
        more += [(half.of, half.b) for half in halves[::2]]
        gaps = _gaps_without_proof(continuation, follower, halves) + gaps[GAPS_AT_ONCE:]
    for one in followed if more else ():
        one.samples[:] = sorted([*one.samples, *(sample for of, sample in more if of is one)])
    return followed


def _gaps(follower: Follower, stretch: Followed) -> list[Gap]:
    """Return the gaps of a stretch, except those next to a singular pose in which the tool rests: samples are dense
    there.
    """
    begin, end = _proved_from_to(follower, stretch)
    rows = pairwise(stretch.samples)
    return [Gap(stretch, a, b) for a, b in rows if b.s > a.s and b.s > begin and a.s < end]


def _proved_from_to(follower: Follower, stretch: Followed) -> tuple[float, float]:
    """Return the start and end of the interval in which the joints of a stretch must be proved."""
    samples, begin, end = stretch.samples, 0.0, stretch.duration
    if follower.singular(samples[0]):
        begin = REST_PART * stretch.duration
    if follower.singular(samples[-1]):
        end -= REST_PART * stretch.duration
    return begin, end


def _gaps_without_proof(continuation: LineProof, follower: Follower, gaps: list[Gap]) -> list[Gap]:
    if not gaps:
        return []
    arrays = _arrays(continuation, follower, gaps)
    for pieces in PROOF_PIECES:
        proved = continuation.prove(arrays, pieces)
        if proved.all():
            return []
        left = np.flatnonzero(~proved)
        arrays, gaps = arrays.some(left), [gaps[k] for k in left]
    return gaps


# --- seeds -----------------------------------------------------------------------------------------------------------


def leading_seeds(follower: Follower, followed: Followed, seeds: tuple[Joints, ...]) -> tuple[Joints, ...]:
    """Return seeds from which Newton's method leads to the joints of a stretch at all times near each seed: the given
    seeds, or samples at equal intervals, twice as many after each failed check. Raises StraightLineSingular if
    SEED_DOUBLINGS checks fail.
    """
    continuation = follower.arm.continuation
    assert continuation is not None
    if max([abs(y - x) for a, b in pairwise(seeds) for x, y in zip(a, b, strict=True)]) < continuation.sure:
        return seeds
    for _ in range(SEED_DOUBLINGS):
        path = structs.replace(followed.path, seeds=seeds, seed_interval=followed.duration / max(len(seeds) - 1, 1))
        misled = misled_at(follower, path, followed)
        if not len(misled):
            return seeds
        count = 2 * (len(seeds) - 1)
        seeds = tuple(map(tuple, followed.joints(np.linspace(0.0, followed.duration, count + 1)).tolist()))
    raise follower.refuse(path, float(misled[0]), "the line is too near to a singularity")


def misled_at(follower: Follower, path: CartesianPath, followed: Followed) -> Floats:
    """Return the times at which Newton's first step from the seed leaves more than MAX_NEWTON_REST of the distance to
    the joints of a stretch: such a seed may lead to other joints. Joints nearer than `continuation.sure` to their seed
    need no check.
    """
    continuation, last = follower.arm.continuation, len(path.seeds) - 1
    assert continuation is not None
    begin, end = _proved_from_to(follower, followed)
    halfway = (np.arange(last) + 0.5) * path.seed_interval
    times = np.array([sample.s for sample in followed.samples])
    s = np.concatenate((times, halfway, halfway))
    number = np.concatenate((np.rint(times / path.seed_interval), np.arange(last), np.arange(last) + 1))
    inside = (s >= begin) & (s <= end)
    s, near = s[inside], np.array(path.seeds)[np.clip(number[inside], 0, last).astype(np.intp)]
    joints = followed.joints(s)
    before = np.abs(near - joints).max(axis=1)
    far = before >= continuation.sure
    if not far.any():
        return np.asarray(s[far])
    s, near, joints, before = s[far], near[far], joints[far], before[far]
    guides = (np.array([guide.weights for guide in path.guides]), guide_values(path, s)) if path.guides else None
    found = continuation.step(near, flange_poses([(path, s)], follower.tool), guides)
    after = np.abs(found - joints).max(axis=1)
    return np.asarray(s[~(after <= MAX_NEWTON_REST * before + PROOF_TOLERANCE)])


# --- as arrays -------------------------------------------------------------------------------------------------------


def _arrays(continuation: LineProof, follower: Follower, gaps: list[Gap]) -> Gaps | SteadyGaps:
    """Return the gaps as arrays, in the form that this kind of continuation proof needs."""
    paces = np.array([(gap.lasting, *gap.of.pace) for gap in gaps])
    h, place, turn, guide = paces[:, 0], paces[:, 1], paces[:, 2:6], paces[:, 6]
    powers = h[:, None] ** POWERS
    place, turn = place * powers[:, 3], turn * powers
    joints = np.array([gap.a.joints + gap.b.joints for gap in gaps]).reshape(len(gaps), 2, -1)
    if isinstance(continuation, Continuation):
        rates = np.array([gap.a.velocity + gap.b.velocity for gap in gaps]).reshape(joints.shape) * h[:, None, None]
        weights = np.array([guide.weights for guide in gaps[0].of.path.guides]).reshape(-1, joints.shape[2])
        # [m] distance of the flange from the tool tip: a turn about the tip moves the flange by this lever
        lever = hypot(*position(follower.T_tool_flange))
        place = place + lever * fourth_of_turn(*turn.T) if lever else place
        cubics = Cubic(joints[:, 0], joints[:, 1], rates[:, 0], rates[:, 1])
        return Gaps(cubics, place, turn, guide * powers[:, 3], weights)
    from vrs_cli.kinematics.numeric.steady.batch import SteadyGaps  # imported here because few arms need it

    begins = np.array([gap.a.s for gap in gaps])
    paths = {id(gap.of.path): gap.of.path for gap in gaps}
    of = np.array([id(gap.of.path) for gap in gaps])

    def poses(which: Rows, parts: Floats) -> Floats:
        found = np.empty((len(which), len(parts), 3, 4))
        times = begins[which, None] + h[which, None] * parts
        for number, path in paths.items():
            rows = of[which] == number
            found[rows] = flange_poses([(path, times[rows].ravel())], follower.tool).reshape(-1, len(parts), 3, 4)
        return found

    twists = np.array([[gap.of.path.twist(end.s) for end in (gap.a, gap.b)] for gap in gaps]) * h[:, None, None]
    return SteadyGaps(np.arange(len(gaps)), joints[:, 0], joints[:, 1], twists, place, turn, poses)
