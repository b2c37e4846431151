"""Test the shipped exercises: correct programs pass, wrong ones fail the checks that they name."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from tests.examples import first
from tests.teach.planted import EXERCISES, NAMES, correct_programs, fault, graded, grader
from vrs_cli.teach.exercise import WrongSubmission, read_exercise

WRONG = [(name, one) for name in NAMES for one in read_exercise(EXERCISES / name).wrong]
SLOW = ("pallet", "sensor")  # to run
QUICK_FIRST = sorted(NAMES, key=SLOW.__contains__)
EVERY = 20  # of the wrong submissions this many-th is tried here; all: python -m tests.teach.planted


@cache
def points(name: str) -> float:
    return sum(check.points for check in read_exercise(EXERCISES / name).checks)


def some_wrong() -> list[tuple[str, WrongSubmission]]:
    """Return some wrong submissions of each exercise; all fail in the long run."""
    return [one for name in QUICK_FIRST for one in [pair for pair in WRONG if pair[0] == name][::EVERY]]


def test_there_are_five_exercises_with_ten_wrong_submissions_and_three_variants_each() -> None:
    assert NAMES == ("cycle", "line", "pallet", "pick", "sensor")
    for name in NAMES:
        exercise = read_exercise(EXERCISES / name)
        assert len(exercise.wrong) >= 10, name
        assert len(exercise.variants) >= 3, name
        assert len(correct_programs(name)) >= 3, name
        assert all(check.hint or check.hidden for check in exercise.checks), name


@pytest.mark.parametrize("name", first(3, QUICK_FIRST))
def test_a_correct_program_earns_all_points(name: str) -> None:
    path = correct_programs(name)[1]
    assert graded(name, path.read_text(encoding="utf-8")) == (), path


@pytest.mark.parametrize(
    ("name", "wrong"), first(3, some_wrong()), ids=lambda one: Path(getattr(one, "path", one)).stem
)
def test_a_wrong_submission_fails_the_checks_that_it_names(name: str, wrong: WrongSubmission) -> None:
    assert graded(name, wrong.text) == wrong.fails


@pytest.mark.parametrize("name", first(3, QUICK_FIRST))
def test_a_program_that_does_nothing_earns_nothing(name: str) -> None:
    program = grader(name).exercise.program
    assert len(graded(name, f".PROGRAM {program}\n READY\n.END\n")) == len(grader(name).exercise.checks)


@pytest.mark.parametrize("name", ["cycle", "line"])
def test_a_planted_fault_is_caught(name: str) -> None:
    assert graded(name, fault(name, 1).text)


@pytest.mark.parametrize("name", NAMES)
def test_what_students_read_is_what_is_given(name: str) -> None:
    """Locations of start.v2 and numbers of text.md are those of given.v2, points those of the checks."""
    folder = EXERCISES / name / "exercise"
    given, start = ((folder / file).read_text(encoding="utf-8") for file in ("given.v2", "start.v2"))
    assert start.endswith(given)
    text = (folder / "text.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \|.*\| ([-\d., ]+ \| [-\d, ]+) \|$", text, re.MULTILINE))
    for line in given.splitlines()[1:-1]:
        location, *numbers = line.split()
        assert re.split(r"[ ,|]+", rows[location]) == numbers, location
    marked = text.split("## What is marked")[1]
    assert sum(int(row) for row in re.findall(r"\| (\d+)(?: \([a-z ]+\))? \|$", marked, re.MULTILINE)) == points(name)
