"""Random programs judged by an implementation of kinematics and laws that shares nothing with the product; and that the
judge sees what is wrong. `long.py` judges as many as one likes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.examples import some
from tests.oracle import laws
from tests.oracle.recording import Edit, Piece, edits
from tests.oracle.robot import Array, load, names, numbers, trans
from tests.oracle.trial import Trial
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot

PROGRAMS, MOST = some(80), 5


@pytest.mark.parametrize("seed", range(1, PROGRAMS + 1))
def test_a_random_program_keeps_every_law(seed: int, tmp_path: Path) -> None:
    trial = Trial(seed, tmp_path, MOST)
    assert not trial.judge(), trial.program
    assert trial.motions


# --- the judge itself ---


@pytest.mark.parametrize(
    ("joints", "expected"),
    [
        ((0, -90, 90, 0, 0, 0), (-20.32, 149.09, 921.12, 90, -90, 0)),
        ((20, -60, 150, 10, 30, -40), (602.95, 383.31, 366.57, 115.725, 29.499, -28.492)),
    ],
)
def test_it_knows_the_puma(joints: tuple[float, ...], expected: tuple[float, ...]) -> None:
    T = load("puma560").frames(np.radians([joints]))[-1][0]
    assert numbers(T) == pytest.approx(expected, abs=6e-3)
    assert np.abs(trans(*numbers(T)) - T).max() < 1e-15


@pytest.mark.parametrize("name", names())
def test_its_velocities_are_those_of_its_places(name: str) -> None:
    robot, h = load(name), 1e-6
    q, qd = (robot.lower + robot.upper) / 2 + 0.1, np.linspace(0.3, 0.9, robot.n)
    before, after = (robot.tip((q + step * qd)[None], np.eye(4))[0] for step in (-h, h))
    v = robot.twist(q[None], qd[None], np.eye(4))[0]
    assert v[:3] == pytest.approx((after - before)[:3, 3] / (2 * h), abs=1e-8)
    assert np.linalg.norm(v[3:]) == pytest.approx(laws.angle(before, after) / (2 * h), abs=1e-7)


@pytest.mark.parametrize("name", [name for name in names() if load(name).words(load(name).lower + 0.1)])
def test_its_words_are_those_of_the_product(name: str) -> None:
    robot, arm, random = load(name), arm_for(load_robot(name)), np.random.default_rng(1)
    for q in random.uniform(robot.lower, robot.upper, (30, robot.n)):
        flags = arm.configuration(tuple(q.tolist())).flags
        for said, (word, measure) in zip(flags, robot.words(q), strict=False):
            assert measure < laws.MEASURE or said is None or said.name == word


@pytest.fixture(scope="module")
def trial(tmp_path_factory: pytest.TempPathFactory) -> Trial:
    """A program that has been run, with lines and joint motions."""
    run = Trial(4, tmp_path_factory.mktemp("oracle"))
    assert not run.judge()
    return run


def bent(piece: Piece) -> Piece:
    """The same segment, its joints or its tool a little farther at once."""
    if piece.joints is not None:
        return replace(piece, joints=piece.joints + 1e-6 * (np.arange(piece.joints.shape[1]) == 0))
    assert piece.line is not None
    (x, *more), *others = piece.line["position"]
    return replace(piece, line={**piece.line, "position": [[x + 1e-6, *more], *others]})


def spoilt(edit: Edit, how: Callable[[Piece], Piece]) -> Edit:
    """With the last segment changed."""
    return replace(edit, after=[*edit.after[:-1], how(edit.after[-1])])


@pytest.mark.parametrize(
    ("how", "law"),
    [
        (bent, "continuity"),
        (bent, "targets"),
        (lambda piece: replace(piece, finish=piece.finish - 0.01), "order"),
        (lambda piece: replace(piece, finish=piece.finish - 2.0**-10), "rest_at_ends"),
    ],
)
def test_it_sees_a_spoilt_segment(trial: Trial, how: Callable[[Piece], Piece], law: str) -> None:
    whole = list(edits(trial.folder / "trial.vrst"))
    found = list(trial.laws_of_edits([spoilt(edit, how) for edit in whole]))
    assert any(fault.startswith(law) for fault in found), found


def test_it_sees_a_change_of_the_past(trial: Trial) -> None:
    late = [edit for edit in edits(trial.folder / "trial.vrst") if edit.delta["executed"] > 0.5][-1]
    changed = replace(late, after=[bent(late.after[0]), *map(bent, late.after[1:])])
    assert list(laws.past(laws.Case(trial.robot, changed, {})))


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda q: q + 1e-9, "from where they should be"),
        (lambda q: np.where(np.arange(len(q))[:, None] == len(q) // 2, q + 1e-2, q), "of its velocity"),
        (lambda q: q + 1e-5 * np.sin(np.arange(len(q)) * 3.0)[:, None], "of its acceleration"),
        (lambda q: q + 10.0, "leaves its range"),
    ],
)
def test_it_sees_wrong_samples(trial: Trial, change: Callable[[Array], Array], fault: str) -> None:
    timeline, samples = list(edits(trial.folder / "trial.vrst"))[-1].after, trial.samples()
    wrong = replace(samples, joints=change(samples.joints))
    assert any(fault in one for one in laws.every_millisecond(trial.robot, timeline, wrong))
