"""Whether a line of an arm without a closed form goes on between its samples: `kinematics.continuation`, on a path."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import pairwise
from math import hypot

import numpy as np
from msgspec import Struct

from vrs_cli.engine.boundary import most
from vrs_cli.engine.following import Follower, Sample
from vrs_cli.kinematics.numeric.continuation import Continuation, Gaps, fourth_of_turn
from vrs_cli.kinematics.transform import position
from vrs_cli.trajectory.polynomial import Polynomial, derivative
from vrs_cli.trajectory.segment import CartesianPath

FOURTH = 4
POWERS = np.arange(1.0, FOURTH + 1.0)
PIECES = (2, 8, 32, 64)  # in which the way between two samples is looked at, before there is a sample more
AT_REST = 2.0**-6  # of a stretch from rest or to it: less than a thousandth of its way
FINEST = 2.0**-24  # of a stretch, between samples
MOST_SAMPLES = 400  # of a line more than it had
TOGETHER = 8  # ways that are halved at once, the finest first: where nothing goes on that is found soon


class Followed(Struct, frozen=True, dict=True):
    """A stretch of a line, and what was sampled of it."""

    path: CartesianPath
    duration: float
    samples: list[Sample]

    @cached_property
    def pace(self) -> tuple[float, ...]:
        """Bounds: of the fourth derivative of the tool's place [m/s4], of the first four of the angles that it turns
        by, together [rad/s ...], and of the fourth of its guides.
        """
        rates, turns = [turn.angle for turn in self.path.turns], list[float]()
        for _ in range(FOURTH):
            rates = [derivative(rate) for rate in rates]
            turns.append(sum(most(rate, self.duration) for rate in rates))
        return self._bent(self.path.position), *turns, self._bent([guide.value for guide in self.path.guides])

    def _bent(self, rows: Iterable[Polynomial]) -> float:
        """A bound of the fourth derivatives together."""
        return hypot(*(most(_fourth(row), self.duration) for row in rows if len(row) > FOURTH))


class Gap(Struct, frozen=True):
    """The way between two neighbouring samples."""

    of: Followed
    a: Sample
    b: Sample

    @property
    def lasting(self) -> float:
        return self.b.s - self.a.s

    @property
    def part(self) -> float:
        """Of its stretch."""
        return self.lasting / self.of.duration

    def halves(self, follower: Follower) -> tuple[Gap, Gap]:
        middle = follower.sample(self.of.path, 0.5 * (self.a.s + self.b.s), self.a.joints)
        return Gap(self.of, self.a, middle), Gap(self.of, middle, self.b)


def check_continuous(
    continuation: Continuation, follower: Follower, stretches: Sequence[tuple[CartesianPath, float, list[Sample]]]
) -> None:
    """That the joints lead from each sample to the next, along paths of so many seconds.

    Raises LocationOutOfRange, JointOutOfRange, StraightLineSingular with the place.
    """
    gaps = [gap for stretch in stretches for gap in _gaps(follower, Followed(*stretch))]
    gaps = _gaps_without_proof(continuation, follower, gaps)
    left = MOST_SAMPLES
    while gaps:
        gaps.sort(key=lambda gap: gap.part)
        finest, left = gaps[0], left - len(gaps[:TOGETHER])
        if left < 0 or finest.part < FINEST:
            raise follower.refuse(finest.of.path, finest.a.s, "the line is too near to a singularity")
        halves = [half for gap in gaps[:TOGETHER] for half in gap.halves(follower)]
        gaps = _gaps_without_proof(continuation, follower, halves) + gaps[TOGETHER:]


def _gaps(follower: Follower, stretch: Followed) -> list[Gap]:
    """All gaps but those next to a singular pose where the tool rests: the follower's samples are close there."""
    samples, begin, end = stretch.samples, 0.0, stretch.duration
    if follower.singular(samples[0]):
        begin = AT_REST * stretch.duration
    if follower.singular(samples[-1]):
        end -= AT_REST * stretch.duration
    return [Gap(stretch, a, b) for a, b in pairwise(samples) if b.s > a.s and b.s > begin and a.s < end]


def _gaps_without_proof(continuation: Continuation, follower: Follower, gaps: list[Gap]) -> list[Gap]:
    if not gaps:
        return []
    arrays, left = _arrays(follower, gaps), np.arange(len(gaps))
    for pieces in PIECES:
        unsure = ~continuation.proved(arrays, pieces)
        left, arrays = left[unsure], arrays.some(unsure)
        if not len(left):
            break
    return [gaps[k] for k in left]


def _arrays(follower: Follower, gaps: list[Gap]) -> Gaps:
    paces = np.array([(gap.lasting, *gap.of.pace) for gap in gaps])
    h, place, turn, guide = paces[:, 0], paces[:, 1], paces[:, 2:6], paces[:, 6]
    rows = [(*gap.a.joints, *gap.b.joints, *gap.a.velocity, *gap.b.velocity) for gap in gaps]
    begin, end, begin_rate, end_rate = np.array(rows).reshape(len(gaps), 4, -1).transpose(1, 0, 2)
    turn = turn * h[:, None] ** POWERS
    weights = np.array([guide.weights for guide in gaps[0].of.path.guides]).reshape(-1, begin.shape[1])
    lever = hypot(*position(follower.T_tool_flange))  # of the flange, which the tool carries
    place = place * h**4 + lever * fourth_of_turn(*turn.T)
    return Gaps(begin, end, begin_rate * h[:, None], end_rate * h[:, None], place, turn, guide * h**4, weights)


def _fourth(a: Polynomial) -> Polynomial:
    for _ in range(FOURTH):
        a = derivative(a)
    return a
