"""vrs learn: lessons in a pipe, where one goes on, lists, and what is wrong with a lesson."""

from __future__ import annotations

from collections.abc import Callable
from io import StringIO
from pathlib import Path

import pytest

from tests.cli.conftest import Ended, Vrs
from tests.teach.lesson_files import CHECKS, lesson
from vrs_cli.teach.lessons import lesson_folders, lessons_folder, read_lesson

FIRST = read_lesson(lesson_folders(lessons_folder())[0])
Learn = Callable[..., Ended]


@pytest.fixture
def learn(vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Learn:
    """Give lines to `vrs learn`: learn(["DRIVE 1, 30"], "1")."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))

    def run(lines: list[str], *arguments: object) -> Ended:
        monkeypatch.setattr("sys.stdin", StringIO("".join(f"{line}\n" for line in lines)))
        return vrs("learn", *arguments)

    return run


def model(*steps: int) -> list[str]:
    return [line for number in steps for line in FIRST.steps[number - 1].model]


def test_a_lesson_that_is_finished_gives_status_0(learn: Learn) -> None:
    ended = learn(model(1, 2, 3, 4, 5, 6), 1)
    assert (ended.status, ended.err) == (0, "")
    assert ended.out.count("**Done.**") == len(FIRST.steps)
    assert "LESSON goes on with the next one, Places and frames" in ended.out
    assert learn([], "--list").out.splitlines()[0].split() == [
        *("1", "First", "motion", "done", "DRIVE,", "WHERE,", "MOVE,", "UNDO,", "a", "first", "program")
    ]


def test_it_goes_on_where_it_was(learn: Learn) -> None:
    ended = learn([*model(1, 2), "DRIVE 1, 99"])
    assert ended.status == 1
    assert ended.err == "vrs learn: First motion: 2 of 6 steps are passed; the next is Turn back at half speed\n"
    ended = learn(model(3))
    assert "You go on at step 3." in ended.out
    assert "3 of 6 steps are passed" in ended.err
    assert "Lesson 2: Places and frames" in learn(["LESSON"]).out
    assert "Lesson 2: Places and frames" in learn([]).out
    assert learn([], 1, "--reset").out == "01_first_motion begins anew\n"
    assert "## Step 1 of 6" in learn([], 1).out
    assert learn([], "--reset").out == "All lessons begin anew\n"
    assert learn([], "--reset").out == "There is nothing to forget\n"


def test_a_record_that_is_none_is_told_once_and_kept(learn: Learn, tmp_path: Path) -> None:
    kept = tmp_path / "state" / "vrs" / "learn.json"
    kept.parent.mkdir(parents=True)
    kept.write_text("{", encoding="utf-8")
    ended = learn(model(1), 1)
    said = f"{kept} is no record of lessons (vrs learn --reset begins a new one); until then nothing is kept"
    assert ended.err.splitlines()[0] == f"vrs learn: *File is not what it should be* {said}"
    assert "Step 2 of 6" in ended.out
    assert kept.read_text(encoding="utf-8") == "{"


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("99", "there is no lesson 99 (there are 1 to 13: vrs learn --list)"),
        ("nowhere", "there is no lesson nowhere ("),
    ],
)
def test_a_lesson_that_is_not_there_is_told(learn: Learn, word: str, said: str) -> None:
    ended = learn([], word)
    assert (ended.status, ended.out) == (2, "")
    assert said in ended.err


def test_a_word_for_a_lesson_that_is_not_there_does_not_end_the_lesson(learn: Learn) -> None:
    ended = learn(["LESSON 99", "DRIVE 1, 30"], 1)
    assert "there is no lesson 99" in ended.out
    assert "Step 2 of 6" in ended.out


def test_lessons_of_a_teacher(learn: Learn, tmp_path: Path) -> None:
    one = lesson(tmp_path / "course" / "01_two")
    lesson(tmp_path / "course" / "02_two", CHECKS.replace("30", "31"))
    ended = learn(["DRIVE 1, 30", "n = 5"], one)
    assert ended.status == 0
    learn([], "--reset")
    ended = learn(["DRIVE 1, 30", "n = 5", "LESSON", "DRIVE 1, 31"], tmp_path / "course")
    assert "Lesson 2: Two steps" in ended.out
    assert ended.err == "vrs learn: Two steps: 1 of 2 steps are passed; the next is Say\n"


def test_what_is_wrong_with_lessons_is_told(learn: Learn, tmp_path: Path) -> None:
    lesson(tmp_path / "course" / "01_two")
    lesson(tmp_path / "course" / "02_two", CHECKS.replace("at = [30, -90]", "at = [0, -90]"))
    lesson(tmp_path / "course" / "03_two", CHECKS.replace('kind = "variable"', 'kind = "variabel"'))
    ended = learn([], "--check", tmp_path / "course")
    assert ended.status == 1
    sound, passed, unread = ended.out.replace(str(tmp_path), "").splitlines()
    assert sound == "01_two: 2 steps, each passed by its model lines, and not before"
    assert passed.startswith("/course/02_two/checks.toml:3: step 1, Turn: it is passed before anything is done")
    assert unread.startswith("/course/03_two/checks.toml:24: [[step]] 2: check: kind: did you mean variable?")
    assert learn([], "--check", tmp_path / "none").status == 2
    assert learn([], "--check", tmp_path / "course" / "01_two").status == 0
