"""Hostile submissions: each gets a mark and a reason, and harms nothing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from msgspec import structs

from benchmarks.grading import HOSTILE
from tests.teach.runs import PICK
from vrs_cli.teach.exercise import read_exercise
from vrs_cli.teach.grading import Grader, Submission
from vrs_cli.teach.many import grade_many

LIMIT, OUTSIDE = "*Program limit reached*", "*File outside the folder of the run*"
REASONS = {
    "loop": LIMIT,
    "memory": LIMIT,
    "output": LIMIT,
    "typed lines": LIMIT,
    "disk": LIMIT,
    "paths": OUTSIDE,
    "another student": OUTSIDE,
    "recursion": LIMIT,
    "reactions": LIMIT,
    "giant arrays": LIMIT,
    "deep expressions": "a line of 6009 characters",
    "deep structures": "the file has 4002 lines, and 2000 are allowed",
    "prompts": "PROMPT has nothing to read",
    "time": LIMIT,
    "many motions": LIMIT,
    "tasks": LIMIT,
    "no text": "a program file is VAL-II text",
    "long line": "a line of 200006 characters",
    "long file": "the file has 100002 lines, and 2000 are allowed",
}


@pytest.fixture(scope="module")
def reasons() -> dict[str, str]:
    """Return why each submission ended, after grading all as a class."""
    grader = Grader(structs.replace(read_exercise(PICK), variants=()))
    handed_in = [Submission(name, "x.v2", text) for name, text in HOSTILE.items()]
    honest = Submission("honest", "x.v2", grader.exercise.solution)
    found = [one.grading for one in grade_many(grader, [honest, *handed_in, honest], 2)]
    assert not any(one.lost for one in found)
    assert [one.points for one in found if one.student == "honest"] == [8.0, 8.0]
    return {one.student: one.stopped for one in found}


def test_all_have_a_reason() -> None:
    assert set(REASONS) == set(HOSTILE)


@pytest.mark.parametrize("name", HOSTILE)
def test_each_gets_a_mark_and_a_reason(reasons: dict[str, str], name: str) -> None:
    assert REASONS[name] in reasons[name]


@pytest.fixture
def secrets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Write files that a submission must not reach, beside its folder and in the temporary folder."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    (tmp_path / "secret.txt").write_text("secret")
    yield tmp_path
    assert [path.name for path in tmp_path.iterdir()] == ["secret.txt"]
    assert (tmp_path / "secret.txt").read_text() == "secret"


READS = """\
.PROGRAM pick()
    ATTACH (5)
    FOPENR (5) "{path}"
    READ (5) $line
    TYPE "<", $line, ">"
.END
"""


@pytest.mark.parametrize("path", ["../secret.txt", "../../secret.txt", "../../../secret.txt", "{tmp}/secret.txt"])
def test_no_other_file_is_read(secrets: Path, path: str) -> None:
    grader = Grader(structs.replace(read_exercise(PICK), variants=()))
    text = READS.format(path=path.format(tmp=secrets))
    ((grading, _),) = grade_many(grader, [Submission("eve", "x.v2", text)], 1)
    assert OUTSIDE in grading.stopped
    assert "secret\n" not in str(grading)
