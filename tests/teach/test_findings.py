"""Test the findings of `vrs grade --check` with faults planted into a good exercise."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.teach.runs import PICK, evidence
from vrs_cli.errors import FileDamaged
from vrs_cli.teach.exercise import read_exercise
from vrs_cli.teach.findings import findings_of, mutants_of
from vrs_cli.values.diagnostics import Dialect


@pytest.fixture
def pick(tmp_path: Path) -> Path:
    """Return a copy of the exercise for planting faults."""
    shutil.copytree(PICK, tmp_path / "pick")
    return tmp_path / "pick"


def spoil(folder: Path, file: str, before: str, after: str) -> None:
    path = folder / file
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after))


def found(folder: Path) -> list[str]:
    """Return all findings without the folder."""
    return [one.text.replace(f"{folder}/", "") for one in findings_of(read_exercise(folder), evidence)]


def unread(folder: Path) -> str:
    with pytest.raises(FileDamaged) as caught:
        read_exercise(folder)
    return str(caught.value).replace(f"{folder}/", "")


CHECKS = "teacher/checks.toml"


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("mm = 5", "mn = 5", "checks.toml:23: [[check]] 2: mn: there are kind, name"),
        ('kind = "words"', 'kind = "word"', "checks.toml:31: [[check]] 4: kind: did you mean words?"),
        ('"MOVES", "DEP', '"MOVS", "DEP', "checks.toml:33: [[check]] 4: use: 'MOVS' is no word of the language"),
        (
            'part = "box"',
            'part = "bax"',
            "checks.toml:12: [[check]] 1: part: 'bax': no part of this name; did you mean",
        ),
        ('at = "place"\nmm = 2', 'at = "plate"\nmm = 2', "did you mean place?"),
        ('kind = "no_error"', 'kind = "no_error"\nneeds = ["it says dane"]', "is the name of no other check"),
        ('move = ["stand"', 'move = ["stando"', "'stando' is nothing that can be moved: a given location or real"),
        ("by = [30, 30, 0]", "", "nothing changes: write by = [50, 50, 0]"),
        ("seed = [1, 2]", "seed = 1.5", "1.5: a whole number from 0, or a list of them such as [1, 2, 3]"),
        ("rounding_mm = 0.1", "rounding_mm = 0", "rounding_mm: 0: a number from 1e-06 to 10 mm"),
        ("time = 60", "tim = 60", "checks.toml:6: [limits] tim: did you mean time?"),
        ('robot = "puma560"', 'robot = "puma"', "checks.toml:2: robot: *Nonexistent file* no robot is called 'puma'"),
        ('lines = ["done"]', 'lines = [{pattern = "("}]', "it is no regular expression: missing )"),
        ('name = "It says done"', 'name = "The box is on the stand"', "is the name of another check"),
    ],
)
def test_mistakes_in_checks_toml_are_told_with_line_and_remedy(pick: Path, before: str, after: str, said: str) -> None:
    spoil(pick, CHECKS, before, after)
    assert said in unread(pick)


def test_all_mistakes_are_told_at_once(pick: Path) -> None:
    spoil(pick, CHECKS, "mm = 2", "mm = -2")
    spoil(pick, CHECKS, "mm = 5", "")
    spoil(pick, "exercise/given.v2", "gripper", "#gripper[")
    spoil(pick, "teacher/wrong/too_far.v2", "The box is on the stand", "The box")
    (pick / "teacher/model.v2").unlink()
    text = unread(pick)
    for said in ("mm: -2: a number from 0 to", "mm: it is missing", "given.v2:4:", "too_far.v2:1: no check is called"):
        assert said in text, text
    assert "model.v2 cannot be read: No such file or directory" in text


def test_a_sound_exercise_has_no_findings() -> None:
    assert found(PICK) == []


def test_a_check_and_a_variant_that_the_model_fails(pick: Path) -> None:
    spoil(pick, CHECKS, 'lines = ["done"]', 'lines = ["ready"]')
    spoil(pick, CHECKS, 'move = ["stand", "place"]\nby = [30, 30, 0]', 'move = ["stand"]\nby = [300, 300, 0]')
    text = found(pick)
    assert text[0].startswith(
        f'{CHECKS}:25: It says done: the model fails it: "ready" was not typed (0 of 1 wanted line) (correct the check'
    )
    assert any("The box is on the stand: the model fails it in variant 1" in one for one in text)


def test_wrong_submissions_that_fail_other_checks_than_they_say(pick: Path) -> None:
    spoil(pick, "teacher/wrong/too_far.v2", "; fails: The box is on the stand", "; fails: It says done")
    first, second = found(pick)
    assert first.startswith("teacher/wrong/too_far.v2:1: it passes 'It says done', which it says that it fails")
    assert second.startswith("teacher/wrong/too_far.v2:1: it fails 'The box is on the stand' too: the box ended 3.0 mm")


def test_a_check_that_nothing_fails_and_one_without_weight(tmp_path: Path) -> None:
    (tmp_path / "exercise").mkdir()
    (tmp_path / "teacher").mkdir()
    (tmp_path / "teacher" / "model.v2").write_text(".PROGRAM a\nDRIVE 1, 10\nSIGNAL 1\n.END\n")
    checks = (
        'kind = "speed"\nname = "Slowly"\nmm_s = 100000',
        'kind = "signals"\nchanges = [1]\npoints = 0',
        'kind = "no_error"',
    )
    (tmp_path / CHECKS).write_text("\n\n".join(f"[[check]]\n{check}" for check in checks))
    assert found(tmp_path) == [
        "exercise/text.md: there is no text for students (write what they are to do)",
        f"{CHECKS}:6: signals: its weight is 0 (give it points, or remove it)",
        "teacher/wrong: warning: there are no wrong submissions (add typical ones, such as wrong/no_tool.v2)",
        f"{CHECKS}: warning: there are no variants "
        "([[variant]] moves parts and locations together, so that copied numbers fail)",
        f"{CHECKS}:1: Slowly: nothing fails it, no wrong submission and no mutant of the model "
        "(make it stricter, or add a wrong submission that fails it)",
    ]


def test_variants_that_are_not_sound(pick: Path) -> None:
    spoil(pick, CHECKS, "by = [40, 40, 0]", "by = [40, 40, 200]")
    spoil(pick, CHECKS, "by = [30, 30, 0]", "by = [900, 900, 0]")
    text = "\n".join(found(pick))
    assert "box stands on nothing in variant" in text
    assert "The arm is above the stand: the model fails it in variant" in text


def test_bodies_in_each_other_and_places_out_of_reach(pick: Path) -> None:
    spoil(pick, "exercise/cell.toml", "at = [0, 550, -250]", "at = [0, 550, -255]")
    spoil(pick, CHECKS, 'at = "place"\noffset = [0, 0, 80]', "at = [3000, 0, 0]")
    text = "\n".join(found(pick))
    assert f"{CHECKS}: box is in table (move them apart, or move them less)" in text
    assert "The arm is above the stand: [3000.0, 0.0, 0.0] is 1" in text
    assert "mm farther away than the arm and a long tool reach" in text


def test_variants_in_which_copied_numbers_pass(pick: Path) -> None:
    spoil(pick, "exercise/given.v2", ".END", "unused     0 500 0 90 90 0\n.END")
    text = (pick / CHECKS).read_text()
    (pick / CHECKS).write_text(
        text[: text.index("[[variant]]")] + '[[variant]]\nseed = 3\nmove = ["unused"]\nby = [9, 9, 9]\n'
    )
    (only,) = found(pick)
    assert "the model passes everything with the numbers of the given locations copied in variant 3" in only


def test_mutants_have_one_mistake_each() -> None:
    text = ".PROGRAM a\n10 MOVES p ; there\n    SIGNAL -2\n    SPEED 30\n    IF x THEN\n    CLOSEI\n    END\n.END\n"
    texts = {mutant.what: mutant.text for mutant in mutants_of(text, Dialect.VPLUS, {})}
    assert "10 \n" in texts["without line 2, 10 MOVES p"]
    assert "10 MOVE p\n" in texts["with MOVE p in line 2"]
    assert "SIGNAL 2" in texts["with SIGNAL reversed in line 3"]
    assert "SPEED 7\n" in texts["with SPEED 7 % throughout"]
    assert "10 MOVES p ; there\nBREAK\n" in texts["with BREAK after each motion"]
    assert not any("END" in what for what in texts)  # blocks stay whole
    assert len(set(texts.values())) == len(texts)
