"""Test marks of runs: points, reasons and hidden checks."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.teach.runs import PICK, evidence
from vrs_cli.errors import FileDamaged
from vrs_cli.extras import shipped_folder
from vrs_cli.teach.exercise import Exercise, read_exercise
from vrs_cli.teach.grading import mark


@pytest.fixture(scope="module")
def pick() -> Exercise:
    return read_exercise(PICK)


def test_the_model_earns_all_points_in_all_variants(pick: Exercise) -> None:
    for seed in pick.seeds:
        variant = pick.variant(seed)
        assert [one.name for one in mark(variant, evidence(variant, pick.solution)) if not one.passed] == []


def test_a_wrong_submission_fails_what_it_says(pick: Exercise) -> None:
    (wrong,) = pick.wrong
    marks = mark(pick, evidence(pick, wrong.text))
    assert tuple(one.name for one in marks if not one.passed) == wrong.fails
    (failed,) = (one for one in marks if not one.passed)
    assert failed.reason == "the box ended 3.0 mm from the place, 2.0 mm allowed; at [303.0, 450.0, -200.0]"
    assert (failed.points, failed.of) == (2.0, 4.0)


def test_one_line_tells_that_contacts_cannot_be_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.teach.kinds.find_spec", lambda _name: None)
    with pytest.raises(FileDamaged) as raised:
        read_exercise(Path(shipped_folder("programs"), "exercises", "pick"))
    assert raised.value.detail.count("\n") == 0
    assert "checks of contacts need mujoco-core (" in raised.value.detail
