"""Test grading on a Dask scheduler: equal results, and one message without a scheduler."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import pytest
from msgspec import structs

from tests.teach.runs import PICK
from tests.teach.test_grading import COPIED, LOOP
from vrs_cli.teach import many
from vrs_cli.teach.exercise import Exercise, read_exercise
from vrs_cli.teach.grading import Grader, Submission, by_student
from vrs_cli.teach.many import ClusterError, grade_many, grade_on_cluster

needs_dask = pytest.mark.skipif(
    find_spec("distributed") is None, reason="no distributed: pip install 'vrs-cli[cluster]'"
)


@pytest.fixture
def address() -> Iterator[str]:
    """Return the address of a scheduler with one worker in this process, which grades in its own processes."""
    distributed: Any = import_module("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp://", dashboard_address=None
    ) as local:
        yield local.scheduler_address


def an_exercise() -> Exercise:
    read = read_exercise(PICK)
    return structs.replace(read, folder=str(PICK))


@pytest.mark.long
@needs_dask
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_gives_the_same_gradings(address: str) -> None:
    exercise = an_exercise()
    submissions = [
        Submission("ann", "ann.v2", exercise.solution),
        Submission("bob", "bob.v2", COPIED),
        Submission("carl", "carl.v2", LOOP),
        Submission("dora", "dora.v2", "", "it is a link"),
    ]
    here, there = (
        by_student([one.grading for one in found])
        for found in (
            grade_many(Grader(exercise), submissions, 2),
            grade_on_cluster(address, exercise, submissions, replays=False),
        )
    )
    assert here == there


@needs_dask
def test_who_does_not_answer_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(many, "SCHEDULER_TIMEOUT_S", 1)
    with pytest.raises(ClusterError, match=r"no scheduler answers at tcp://127\.0\.0\.1:9"):
        list(grade_on_cluster("tcp://127.0.0.1:9", an_exercise(), [Submission("a", "a.v2", LOOP)], replays=False))


def test_without_dask_one_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(many, "find_spec", lambda _name: None)
    with pytest.raises(ClusterError, match=r"which is not installed.*pip install.* dask distributed"):
        list(grade_on_cluster("tcp://x:1", an_exercise(), [Submission("a", "a.v2", LOOP)], replays=False))
