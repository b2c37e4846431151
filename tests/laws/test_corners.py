"""Rounding a corner is never slower than stopping in it, whatever the motions, the profile and ROUNDING."""

from __future__ import annotations

from itertools import islice, product
from math import inf
from random import Random
from statistics import median

import pytest

from tests.examples import some
from tests.laws.corners import PAIRS, PROFILES, ROUNDINGS, Corner, beside, corners, ends, random_corner, spliced
from tests.laws.motion_laws import check_continuous, check_limits, check_rounding, check_target
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.transform import Transform, from_oat

SETTINGS = list(product(PROFILES, ROUNDINGS))


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize(("profile", "rounding"), SETTINGS)
def test_rounding_is_no_slower_and_keeps_the_laws(profile: str, rounding: str | float, pair: str) -> None:
    source = Random(f"laws {profile} {rounding} {pair}")
    for corner, times in islice(corners(source, pair, profile, rounding), some(8)):
        assert not times.slower, (corner, times)
        engine, _ = ends(corner, profile, rounding)
        assert engine is not None
        segments = list(engine.timeline)
        check_continuous(engine, segments)
        check_limits(engine, segments)
        check_rounding(engine, segments)
        check_target(engine)


@pytest.mark.parametrize(("profile", "rounding"), SETTINGS)
def test_a_corner_planned_again_is_no_slower(profile: str, rounding: str | float) -> None:
    source, seen = Random(f"splices {profile} {rounding}"), 0
    while seen < some(8):
        corner = random_corner(source, source.choice(PAIRS))
        place, part = beside(source, corner.places[1]), source.random()
        try:
            times = spliced(corner, profile, rounding, place, part)
        except MotionError:
            continue
        assert not times.slower, (corner, place, part, times)
        seen += 1


@pytest.mark.parametrize("profile", PROFILES)
def test_lines_gain_by_being_rounded(profile: str) -> None:
    source = Random(f"gain {profile}")
    ratios = [times.ratio for _, times in islice(corners(source, PAIRS[0], profile, "DECEL"), 20)]
    assert median(ratios) < 0.93


def _located(x: float, y: float, z: float) -> Transform:
    return from_oat(0.001 * x, 0.001 * y, 0.001 * z, 1.5707963267948966, 1.5707963267948966, 0.0)


@pytest.mark.parametrize(
    ("profile", "rounding", "places"),
    [
        ("SCURVE", 5.0, ((-218.6, 345.3, -279.1), (-134.3, 413.1, -218.6), (-111.9, 339.5, -89.1))),
        ("LSPB", "DECEL", ((91.4, 527.2, -149.6), (4.5, 428.3, -109.4), (-28.1, 466.7, -248.8))),
    ],
)
def test_lines_that_turn_back_at_full_speed(
    profile: str, rounding: str | float, places: tuple[tuple[float, float, float], ...]
) -> None:
    start, via, end = (_located(*place) for place in places)
    _, times = ends(Corner((start, via, end), (True, True), (100.0, 100.0)), profile, rounding)
    assert times.rounded <= times.stopped < inf
