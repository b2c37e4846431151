"""Bounds of clearances between two places."""

from __future__ import annotations

from math import hypot
from random import Random

import pytest

from vrs_cli.kinematics.clearance import shortest


@pytest.mark.parametrize(
    ("a", "b", "least"),
    [
        ((2.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0),
        ((1.0, 0.0, 0.0), (2.0, 0.0, 0.0), 1.0),
        ((1.0, -2.0, 0.0), (1.0, 3.0, 0.0), 1.0),
        ((0.0, 3.0, 4.0), (0.0, 3.0, 4.0), 5.0),
    ],
)
def test_a_straight_way_is_nearest_where_its_line_is(
    a: tuple[float, float, float], b: tuple[float, float, float], least: float
) -> None:
    assert shortest(a, b, 9.0, 0.0, 1.0) == pytest.approx(least)


def test_a_bent_way_is_never_nearer_than_its_bound() -> None:
    random = Random(3)
    for _ in range(300):
        p, v, w = ([random.uniform(-1.0, 1.0) for _ in range(3)] for _ in range(3))
        h = random.uniform(0.1, 1.0)

        def at(t: float, p: list[float] = p, v: list[float] = v, w: list[float] = w) -> tuple[float, float, float]:
            x, y, z = (a + t * (b + 0.5 * t * c) for a, b, c in zip(p, v, w, strict=True))
            return x, y, z

        fastest = max(hypot(*(b + t * c for b, c in zip(v, w, strict=True))) for t in (0.0, h))
        bound = shortest(at(0.0), at(h), fastest, hypot(*w), h)
        assert bound <= min(hypot(*at(h * k / 50)) for k in range(51)) + 1e-12
