"""Test gradings of correct and wrong submissions, of limits, and of equal results for any number of processes."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.teach.runs import PICK
from vrs_cli.teach.exercise import read_exercise
from vrs_cli.teach.grading import Grader, Grading, Submission, by_student, total_of
from vrs_cli.teach.many import grade_many
from vrs_cli.teach.reports.results import canonical_json, grading_from, grading_object, results_object

LOOP = ".PROGRAM pick()\n  x = 0\n  WHILE TRUE DO\n    x = x+1\n  END\n.END\n"
COPIED = """\
.PROGRAM pick()
    TOOL gripper
    SET start = TRANS(0, 550, -250, 90, 90, 0)
    SET goal = TRANS(300, 450, -200, 90, 90, 90)
    OPENI
    APPRO start, 80
    MOVES start
    CLOSEI
    DEPARTS 80
    APPRO goal, 80
    MOVES goal
    OPENI
    DEPARTS 80
    BREAK
    TYPE "done"
.END
"""


@pytest.fixture(scope="module")
def grader() -> Grader:
    return Grader(read_exercise(PICK))


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path) -> Iterator[None]:
    before = os.getcwd()
    os.chdir(tmp_path)
    yield
    os.chdir(before)


def graded(grader: Grader, text: str) -> Grading:
    return grader.runs(Submission("ann", "ann.v2", text))[0]


def test_the_model_earns_all_points(grader: Grader) -> None:
    found = graded(grader, grader.exercise.solution)
    assert (found.points, found.stopped, found.lost) == (total_of(grader.exercise), "", "")
    assert [one.seed for one in found.variants] == [None, 1, 2]


def test_copied_numbers_fail_the_variants(grader: Grader) -> None:
    found = graded(grader, COPIED)
    assert all(one.passed for one in found.variants[0].marks)
    assert {one.name for _, one in found.marks if not one.passed} == {
        "The box is on the stand",
        "The arm is above the stand",
    }
    assert {seed for seed, one in found.marks if not one.passed} <= {1, 2}


def test_what_is_given_holds_whatever_the_file_says_of_it(grader: Grader) -> None:
    lied = grader.exercise.solution + ".LOCATIONS\npart 0 0 0 0 0 0\nplace 1 2 3 0 0 0\n.END\n"
    assert graded(grader, lied).points == total_of(grader.exercise)


def test_a_program_that_reaches_a_limit_is_not_run_again(grader: Grader) -> None:
    found = graded(grader, LOOP)
    assert [(one.seed, one.limited) for one in found.variants] == [(None, True)]
    assert found.stopped == (
        "line 4: *Program limit reached* the program was still running after 10000 steps: "
        "pick step 3 is busy at x = x+1 (the exercise allows no more)"
    )
    assert found.points < 1.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            ".PROGRAM p()\n MOVEE x\n FOO\n.END\n",
            "line 2: *Unknown instruction* MOVEE (did you mean MOVE?) (and 1 more mistake)",
        ),
        ("", "the file holds no program: a program begins with .PROGRAM"),
        (".LOCATIONS\na 1 2 3 0 0 0\n.END\n", "the file holds no program: a program begins with .PROGRAM"),
    ],
)  # fmt: skip
def test_what_is_not_executed_earns_nothing(grader: Grader, text: str, said: str) -> None:
    found = graded(grader, text)
    assert found.stopped == f"not executed: {said}"
    assert {(one.points, one.reason) for _, one in found.marks} == {(0.0, "not executed")}


def test_the_mistake_in_a_program_that_is_called_is_told(grader: Grader) -> None:
    found = graded(grader, ".PROGRAM pick()\n CALL visit\n.END\n.PROGRAM visit()\n ELSE\n.END\n")
    mistake = "line 5: *Control structure error* ELSE without IF"
    assert found.stopped == f"line 2: *Program not executable* visit (mend its errors first): {mistake}"


def test_prompts_have_no_answers(grader: Grader) -> None:
    found = graded(grader, '.PROGRAM p()\n  WHILE TRUE DO\n    PROMPT "more? ", $x\n  END\n.END\n')
    assert found.stopped.startswith("line 3: *Unexpected end of file* PROMPT has nothing to read")


def test_a_grading_is_the_same_after_a_way_as_json(grader: Grader) -> None:
    found = graded(grader, COPIED)
    assert grading_from(json.loads(json.dumps(grading_object(found)))) == found


def test_results_are_the_same_for_any_number_of_processes(grader: Grader) -> None:
    submissions = [
        Submission("ann", "ann.v2", grader.exercise.solution),
        Submission("bob", "bob.v2", COPIED),
        Submission("carl", "carl.v2", LOOP),
        Submission("dora", "dora.v2", "", "it is a link"),
    ]
    found = set()
    for jobs, order in ((1, submissions), (3, submissions[::-1])):
        gradings = by_student([one.grading for one in grade_many(grader, order, jobs)])
        assert [one.student for one in gradings] == ["ann", "bob", "carl", "dora"]
        assert gradings[3].lost == "it is a link"
        found.add(canonical_json(results_object(grader.exercise, gradings, ())))
    assert len(found) == 1


def test_the_digest_is_that_of_all_the_rest(grader: Grader) -> None:
    import hashlib

    results = results_object(grader.exercise, [graded(grader, LOOP)], ())
    digest = results.pop("digest")
    assert digest == hashlib.sha256(canonical_json(results).encode()).hexdigest()
    results["submissions"][0]["points"] += 0.01
    assert digest != hashlib.sha256(canonical_json(results).encode()).hexdigest()
