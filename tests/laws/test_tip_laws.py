"""Searches along the way of a tool miss nothing between two looks (long run: `python -m tests.laws.ways_of_tips`)."""

from __future__ import annotations

from itertools import islice
from random import Random

import pytest

from tests.laws.ways_of_tips import ROBOTS, check, random_run


@pytest.mark.parametrize("robot", ROBOTS)
def test_searches_find_what_samples_find(robot: str) -> None:
    rng = Random(robot)
    runs = (random_run(rng, robot) for _ in range(20))
    for ran in islice((ran for ran in runs if ran.end > 0.0), 2):
        check(rng, ran)
