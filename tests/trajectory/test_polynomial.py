"""Tests of zeros and extremes of polynomials."""

from __future__ import annotations

from random import Random

import pytest

from vrs_cli.trajectory.polynomial import Polynomial, bisect_interval, extremes, value, zeros


def product(roots: list[float], scale: float) -> Polynomial:
    """Return a polynomial with these zeros."""
    a: Polynomial = (scale,)
    for root in roots:
        a = tuple(low - root * high for low, high in zip((0.0, *a), (*a, 0.0), strict=True))
    return a


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_every_zero_inside_is_found(degree: int) -> None:
    random = Random(degree)
    for _ in range(100):
        lasting = 10.0 ** random.uniform(-3.0, 3.0)
        roots = [lasting * (k + random.uniform(0.2, 0.8)) / degree for k in range(-1, degree - 1)]
        found = zeros(product(roots, random.choice((-1.0, 1.0)) * 10.0 ** random.uniform(-3.0, 3.0)), lasting)
        assert found == pytest.approx(roots[1:], rel=1e-9, abs=1e-12 * lasting)


def test_a_zero_that_is_three_is_found_to_what_its_values_tell() -> None:
    assert zeros(product([0.3, 0.3, 0.3], 1.0), 1.0) == pytest.approx([0.3], abs=1e-5)


def test_where_the_rate_is_flat_the_interval_is_halved() -> None:
    """Newton's steps from the middle go far out here, or to and fro."""
    assert zeros((-1.0, 1e-9, 0.0, 0.0, 0.0, 1.0), 1.9) == pytest.approx([1.0], abs=1e-8)
    assert zeros((2.0, -2.0, 0.0, 1.0), 3.0) == []


def test_extremes_are_those_of_many_samples() -> None:
    random = Random(9)
    for _ in range(50):
        a = tuple(random.uniform(-1.0, 1.0) for _ in range(random.randint(2, 6)))
        sampled = [value(a, 0.002 * k) for k in range(1001)]
        low, high = extremes(a, 2.0)
        assert low <= min(sampled) < low + 1e-3
        assert high >= max(sampled) > high - 1e-3


def test_halving_ends_on_both_sides_of_where_something_ceases() -> None:
    assert bisect_interval(lambda x: x < 0.3, 0.0, 1.0, 3) == (0.25, 0.375)
    assert bisect_interval(lambda x: x > 0.3, 1.0, 0.0, 3) == (0.375, 0.25)
    assert bisect_interval(lambda _: True, 0.0, 1.0, 0) == (0.0, 1.0)
