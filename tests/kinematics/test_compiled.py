"""Formulas that are written out for an arm: the product of its links, whatever their lengths are."""

from __future__ import annotations

from math import pi
from random import Random

import pytest

from vrs_cli.kinematics.compiled import formulas
from vrs_cli.kinematics.model import Link, link_transform
from vrs_cli.kinematics.transform import IDENTITY, compose, translation

ROUND = (0.0, 1.0, -1.0, 0.1, 10.0, -10.0, 2.0)  # [m] what could be written shorter, or be taken for nothing


@pytest.mark.parametrize("seed", range(20))
def test_the_product_of_links_of_round_lengths(seed: int) -> None:
    random = Random(seed)
    links = tuple(
        Link(random.choice(ROUND), random.choice(ROUND), random.choice((0.0, pi / 2, -pi / 2, pi, 0.3)))
        for _ in range(4)
    )
    base, flange = translation(*random.choices(ROUND, k=3)), translation(*random.choices(ROUND, k=3))
    q = tuple(random.uniform(-3.0, 3.0) for _ in links)
    expected = compose(IDENTITY, base)
    for link, angle in zip(links, q, strict=True):
        expected = compose(expected, link_transform(link, angle))
    assert formulas(links, base, flange).forward(q) == pytest.approx(compose(expected, flange), abs=1e-13)


def test_the_rounding_of_a_right_angle_is_taken_away() -> None:
    """Half a turn about x, as a sine and a cosine give it."""
    almost = 1.0 - 2.0**-53
    base = IDENTITY._replace(nx=almost, sy=-almost, az=-almost, ay=1.2e-16, sz=1.2e-16)
    exact = IDENTITY._replace(sy=-1.0, az=-1.0)
    assert formulas((Link(0.0, 0.0, 0.0),), base, IDENTITY).forward((0.0,)) == exact
