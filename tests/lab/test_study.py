"""Test a user study: balanced orders, the end of a trial, and results that survive a kill."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from math import dist
from pathlib import Path

import pytest

from vrs_cli.errors import FileDamaged, NonexistentFile
from vrs_cli.lab.study import FARTHER, HOLD, DryRun, Judge, Results, Study, latin_order, load_study, study_trials

TEXT = """\
task = "{task}"
trials = 2
tolerance = 15
timeout = 30
[[condition]]
name = "near"
[[condition]]
name = "far"
forward = "gamma 400ms 80ms"
backward = "400ms"
"""


def study_of(tmp_path: Path, task: str = "target", extra: str = "") -> Study:
    path = tmp_path / "study.toml"
    path.write_text(TEXT.format(task=task) + extra)
    return load_study(path)


@pytest.mark.parametrize("count", range(1, 8))
def test_every_condition_comes_as_often_at_each_place_and_after_each_other(count: int) -> None:
    rows = [latin_order(count, participant) for participant in range(1, count * (1 + count % 2) + 1)]
    assert all(sorted(row) == [*range(count)] for row in rows)
    assert len({*Counter(pair for row in rows for pair in enumerate(row)).values()}) == 1
    following = Counter(pair for row in rows for pair in pairwise(row))
    assert len(following) == count * (count - 1)
    assert len({*following.values()}) <= 1


def test_trials_of_a_participant_are_always_the_same(tmp_path: Path) -> None:
    study = study_of(tmp_path, "pick")
    trials = study_trials(study, 2)
    assert trials == study_trials(study, 2)
    assert trials != study_trials(study, 4)
    assert [trial.condition.name for trial in trials] == ["far", "far", "near", "near"]
    for trial in trials:
        closing, opening = trial.stages
        assert (closing.hand, opening.hand) == ("closed", "open")
        assert dist(closing.place, opening.place) >= FARTHER * study.tolerance


def test_a_trial_is_over_when_the_tool_has_stayed_at_the_place(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    trial = study_trials(study, 1)[0]
    x, y, z = trial.stages[0].place
    judge = Judge(study, trial, 10.0)
    judge.take(10.0, (x - 0.1, y, z), 1.0)
    judge.take(11.0, (x, y, z), 1.0)
    judge.take(11.0 + HOLD / 2, (x + 0.05, y, z), 1.0)  # an overshoot
    judge.take(13.0, (x, y, z), 1.0)
    assert not judge.over
    judge.take(13.0 + HOLD, (x, y, z), 1.0)
    assert judge.over
    found = judge.result()
    assert (found.reached, found.time, found.entries, found.error) == (True, 3.0, 2, 0.0)
    assert (found.path, found.direct) == (pytest.approx(0.2), pytest.approx(0.1))


def test_a_part_is_picked_with_the_hand_closed_and_put_with_it_open(tmp_path: Path) -> None:
    study = study_of(tmp_path, "pick")
    trial = study_trials(study, 1)[0]
    first, second = (stage.place for stage in trial.stages)
    judge = Judge(study, trial, 0.0)
    for t, place, hand in ((0, first, 1), (1, first, 1), (2, first, 0), (3, first, 0), (4, second, 0), (5, second, 0)):
        judge.take(float(t), place, float(hand))
    assert not judge.over
    judge.take(6.0, second, 1.0)
    judge.take(7.0, second, 1.0)
    assert judge.over
    assert judge.result().time == 6.0


def test_time_is_over(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    judge = Judge(study, study_trials(study, 1)[0], 0.0)
    judge.take(0.0, (0.0, 0.0, 0.0), 1.0)
    judge.take(30.0, (0.0, 0.0, 0.0), 1.0)
    assert judge.over
    assert not judge.result().reached
    assert judge.result().error > 0.015


@pytest.mark.parametrize("task", ["target", "pick"])
def test_a_scripted_participant_is_slower_behind_longer_delays(task: str, tmp_path: Path) -> None:
    study = study_of(tmp_path, task)
    person, times = DryRun(study, 1), dict[str, float]()
    for trial in study_trials(study, 1):
        found = person.do(trial)
        assert found.reached
        assert found.error <= study.tolerance
        assert found.path >= found.direct - 2 * len(trial.stages) * study.tolerance
        times[trial.condition.name] = times.get(trial.condition.name, 0.0) + found.time
    assert times["far"] > times["near"] + 1.0


def test_after_a_kill_the_next_trial_is_the_first_that_is_not_on_the_disk(tmp_path: Path) -> None:
    study, path = study_of(tmp_path), tmp_path / "study.csv"
    person, trials = DryRun(study, 1), study_trials(study, 1)
    results = Results(path, study)
    for trial in trials[:2]:
        results.add(1, trial, person.do(trial))
    whole = path.read_bytes()
    last = whole.rfind(b"\n", 0, len(whole) - 1) + 1
    for cut in range(last, len(whole)):
        path.write_bytes(whole[:cut])
        assert Results(path, study).finished_trials(1) == {1}
        assert path.read_bytes() == whole[:last]
    path.write_bytes(whole)
    again = Results(path, study)
    assert (again.finished_trials(1), again.finished_trials(2), again.next_participant(4)) == ({1, 2}, frozenset(), 1)
    for trial in trials[2:]:
        again.add(1, trial, person.do(trial))
    assert Results(path, study).next_participant(4) == 2
    assert all(row.split(",")[1] == "P001" for row in path.read_text().splitlines()[1:])


def test_results_of_something_else_are_left_alone(tmp_path: Path) -> None:
    study, path = study_of(tmp_path), tmp_path / "study.csv"
    for text, said in (("a,b\n1,2\n", "holds no results"), ("", "")):
        path.write_text(text)
        if said:
            with pytest.raises(FileDamaged, match=said):
                Results(path, study)
            assert path.read_text() == text
    Results(path, study).add(1, study_trials(study, 1)[0], DryRun(study, 1).do(study_trials(study, 1)[0]))
    with pytest.raises(FileDamaged, match="has results of another study"):
        Results(path, study_of(tmp_path, extra="# changed\n"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("task = ", "a study is a TOML file"),
        ("trials = 3", "has no condition"),
        ("condition = 3", "condition: is not a list of tables"),
        ("[[condition]]\nnam = 'x'", "has an unknown key"),
        ("task = 'grip'\n[[condition]]\nname = 'x'", "task: 'grip' is none"),
        ("robot = 'pumba'\n[[condition]]\nname = 'x'", "robot: "),
        ("trials = 0\n[[condition]]\nname = 'x'", "trials: 0 is none"),
        ("tolerance = -1\n[[condition]]\nname = 'x'", "tolerance: -1 is not above zero"),
        ("[[condition]]\nname = 'x'\nforward = 'gama 1 2'", "condition 1: forward: 'gama 1 2' is no kind of delays"),
        ("[[condition]]\nname = 'x'\n[[condition]]\nname = 'x'", "there are two of the name 'x'"),
    ],
)
def test_what_is_wrong_with_a_study_is_told(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(FileDamaged) as told:
        load_study(path)
    assert said in str(told.value)
    with pytest.raises(NonexistentFile):
        load_study(tmp_path / "nowhere.toml")
