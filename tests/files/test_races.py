"""A few of the races, kills and losses of `python -m tests.files.long`, with real processes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.files.identity import CHANGES
from tests.files.kills import killed
from tests.files.long import taken_away
from tests.files.races import RACES


@pytest.mark.long
@pytest.mark.parametrize("name", ["two begin one file"])
def test_a_race_for_one_file_loses_nothing(tmp_path: Path, name: str) -> None:
    for one in RACES[name](tmp_path):
        one.check()


def test_a_session_that_is_killed_loses_nothing(tmp_path: Path) -> None:
    acknowledged: list[str] = []
    for seed in (1, 3):
        killed(tmp_path, seed, acknowledged)
    assert acknowledged


@pytest.mark.parametrize(("name", "more"), [pytest.param("replaced", 2, marks=pytest.mark.long), ("rm", 0)])
def test_a_session_whose_file_is_taken_away_loses_nothing(tmp_path: Path, name: str, more: int) -> None:
    taken_away(tmp_path, CHANGES[name], more)
