"""Test that exercises of `vrs grade --new` have no mistakes, and that nothing is overwritten."""

from __future__ import annotations

from contextlib import chdir
from pathlib import Path

import pytest

from vrs_cli.errors import FileDamaged, FileExists, NonexistentFile
from vrs_cli.kinematics.transform import position
from vrs_cli.teach.exercise import Exercise, read_exercise
from vrs_cli.teach.findings import findings_of
from vrs_cli.teach.grading import Submission, SubmissionRuns
from vrs_cli.teach.propose import propose

PROGRAMS = Path(__file__).parents[2] / "programs"


def mistakes(exercise: Exercise, folder: Path) -> list[str]:
    with chdir(folder):
        found = findings_of(exercise, lambda it, text: SubmissionRuns(Submission("", "", text)).run(it))
        return [one.text for one in found if not one.doubtful]


@pytest.mark.long
def test_a_solution_with_a_cell_becomes_an_exercise_without_mistakes(tmp_path: Path) -> None:
    folder, told = propose(str(tmp_path / "mine"), str(PROGRAMS / "pick_and_place.v2"))
    exercise = read_exercise(folder)
    assert exercise.name == exercise.title == "mine"
    assert exercise.program == "pick.and.place"
    assert {item[0] for item in exercise.locations} == {"part", "place", "gripper"}
    assert [part.name for part in exercise.cell.scene.parts] == ["box"]
    assert {one.name for one in exercise.checks} > {"box is in its place", "the hand is empty", "nothing is touched"}
    assert len(exercise.wrong) >= 3
    assert mistakes(exercise, tmp_path) == []
    assert told[-1] == "3 variants move part, box, place, stand"
    box, part = (
        [position(pose)[:2] for pose in (one.cell.scene.parts[0].T_world_part, one.locations["part", None])]
        for one in (exercise.variant(None), exercise.variant(1))
    )
    assert box[0] == box[1] != part[0]
    assert part[0] == pytest.approx(part[1])
    assert not [path.name for path in tmp_path.iterdir() if path.name.startswith(".vrs-new-")]
    for name in ("text.md", "start.v2", "given.v2", "cell.toml"):
        assert (folder / "exercise" / name).is_file()
    assert "LOCATIONS" not in exercise.solution


@pytest.mark.parametrize("sample", [pytest.param("corner.v2", marks=pytest.mark.long), "hello.v2"])
def test_a_solution_without_a_cell_becomes_one_too(sample: str, tmp_path: Path) -> None:
    folder, _ = propose(str(tmp_path / "mine"), str(PROGRAMS / sample))
    exercise = read_exercise(folder)
    assert len(exercise.checks) >= 3
    assert mistakes(exercise, tmp_path) == []


def test_hostile_names_and_texts_are_written_as_strings(tmp_path: Path) -> None:
    solution = tmp_path / "a.v2"
    solution.write_text(
        '.PROGRAM a()\n  TYPE "it\'s \\ ", $CHR(34), $CHR(39)\n  TYPE "<b>[x] 5.5 (y)*"\n  DRIVE 1, 10, 100\n.END\n'
    )
    folder, _ = propose(str(tmp_path / 'q"uoted'), str(solution))
    exercise = read_exercise(folder)
    assert exercise.title == 'q"uoted'
    assert mistakes(exercise, tmp_path) == []


@pytest.mark.parametrize(
    ("text", "error", "said"),
    [
        (".PROGRAM a()\n  MOVVE x\n.END\n", FileDamaged, "a.v2:2: "),
        (".PROGRAM a()\n  MOVE TRANS(0, 3000)\n.END\n", FileDamaged, "*Location too far*"),
        (".LOCATIONS\na 1 2 3 4 5 6\n.END\n", FileDamaged, "holds no program"),
        (".PROGRAM a()\n 10 GOTO 10\n.END\n", FileDamaged, "*Program limit reached*"),
        (None, NonexistentFile, "a.v2"),
    ],
)
def test_a_solution_that_cannot_be_one_leaves_nothing(
    text: str | None, error: type[Exception], said: str, tmp_path: Path
) -> None:
    solution = tmp_path / "a.v2"
    if text is not None:
        solution.write_text(text)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(error) as raised:
        propose(str(tmp_path / "mine"), str(solution))
    assert said in str(raised.value)
    assert sorted(tmp_path.iterdir()) == before


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    taken = tmp_path / "mine"
    taken.mkdir()
    with pytest.raises(FileExists):
        propose(str(taken), str(PROGRAMS / "hello.v2"))
    assert list(taken.iterdir()) == []
    with pytest.raises(FileDamaged):
        propose(str(tmp_path / "no" / "mine"), str(PROGRAMS / "hello.v2"))
