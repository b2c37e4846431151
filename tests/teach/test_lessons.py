"""Test reading lessons, and the messages about wrong ones."""

from pathlib import Path

import pytest

from tests.teach.lesson_files import CHECKS, TEXT, lesson
from vrs_cli.errors import FileDamaged, NonexistentFile
from vrs_cli.teach.lessons import chosen_folder, lesson_folders, lessons_folder, read_lesson
from vrs_cli.values.diagnostics import Dialect


def wrong(folder: Path, checks: str = CHECKS, text: str = TEXT) -> str:
    with pytest.raises(FileDamaged) as caught:
        read_lesson(lesson(folder, checks, text))
    return caught.value.detail.replace(str(folder), "")


def test_a_lesson_is_read(tmp_path: Path) -> None:
    found = read_lesson(lesson(tmp_path / "07_two"))
    assert (found.name, found.number, found.title, found.summary) == ("07_two", 7, "Two steps", "a turn and a number")
    assert found.intro == "What comes first."
    assert [(step.name, step.task, step.line) for step in found.steps] == [
        ("Turn", "Turn joint 1 by 30 degrees.", 3),
        ("Say", "Keep 5 in `n`.", 16),
    ]
    assert found.steps[0].wrong == (("DRIVE 1, 20",), ("READY",))
    assert (found.robot.name, found.dialect, found.delays) == ("puma560", Dialect.VPLUS, None)


def test_checks_of_one_kind_in_a_step_have_names_of_their_own(tmp_path: Path) -> None:
    more = '\n[[step.check]]\nkind = "variable"\nof = "m"\nvalue = 6\n'
    found = read_lesson(lesson(tmp_path, CHECKS + more))
    assert [check.name for check in found.steps[1].checks] == ["variable", "variable 2"]


def test_a_delay_is_read(tmp_path: Path) -> None:
    found = read_lesson(lesson(tmp_path, f'{CHECKS}\n[delay]\nforward = "0.1s"\nbackward = "gamma 0.2s 50ms"\n'))
    assert found.delays is not None


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'name = "Say"',
            'name = "Sai"',
            "/checks.toml:17: [[step]] 2: name: lesson.md has no step Sai; did you",
        ),
        ('name = "Say"', 'name = "Turn"', "/checks.toml:17: [[step]] 2: name: Turn is the name of another step"),
        ('nudge = "DRIVE"\n', "", "/checks.toml:3: [[step]] 1: nudge: it is missing: a text in quotes"),
        ('model = ["n = 5"]', "model = []", "/checks.toml:20: [[step]] 2: model: []: a list of texts"),
        ('wrong = [["DRIVE 1, 20"]', 'wrong = ["DRIVE 1, 20"', "/checks.toml:8: [[step]] 1: wrong: each is a list of"),
        ('kind = "joints"', 'kind = "joint"', "/checks.toml:12: [[step]] 1: check: kind: did you mean joints?"),
        ("deg = 0.1", "deg = -1", "/checks.toml:14: [[step]] 1: check: deg: -1: a number from 0 to 180 deg"),
        ('kind = "variable"\nof = "n"\nvalue = 5', "", "/checks.toml:23: [[step]] 2: check: kind: it is one of"),
        ('[[step.check]]\nkind = "variable"\nof = "n"\nvalue = 5', "", "check: there is none: write [[step.check]]"),
        ('summary = "a turn and a number"', 'robot = "puma"', "robot"),
        ('summary = "a turn and a number"', 'dialect = "basic"', "/checks.toml:1: dialect: it is one of val"),
        ('summary = "a turn and a number"', "delay = 3", "/checks.toml:1: delay: write [delay], and below it"),
        ('summary = "a turn and a number"', "sumary = 3", "/checks.toml:1: sumary: did you mean summary?"),
    ],
)
def test_a_mistake_in_the_checks_is_told_with_its_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in CHECKS
    assert said in wrong(tmp_path, CHECKS.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("# Two steps\n", "", "/lesson.md:1: the lesson has no title: begin with a line `# Title`"),
        ("## Say", "## Say\n\n## More\n\nand more\n\n## Even more", "/lesson.md:9: there is no task below ## Say"),
        ("Keep 5 in `n`.", "x\n\n## More\n\ny", "/lesson.md:13: there is no step More in checks.toml: write [[step]]"),
    ],
)
def test_a_mistake_in_the_text_is_told_with_its_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert said in wrong(tmp_path, CHECKS, TEXT.replace(old, new, 1))


def test_mistakes_in_the_cell_and_in_what_is_given_are_told(tmp_path: Path) -> None:
    lesson(tmp_path)
    (tmp_path / "cell.toml").write_text("[[part]]\nname = 3\n", encoding="utf-8")
    (tmp_path / "given.v2").write_text(".PROGRAM p\nMOVEE a\n.END\n", encoding="utf-8")
    said = wrong(tmp_path)
    assert "/cell.toml:2" in said
    assert "/given.v2:2: *Unknown instruction* MOVEE" in said


def test_headings_in_code_are_no_steps(tmp_path: Path) -> None:
    found = read_lesson(lesson(tmp_path, CHECKS, TEXT.replace("What comes first.", "```\n## Turn\n```")))
    assert found.intro == "```\n## Turn\n```"


def test_what_is_no_lesson_is_told(tmp_path: Path) -> None:
    with pytest.raises(NonexistentFile, match=r"is no lesson: it has no checks.toml"):
        read_lesson(tmp_path)


def test_a_lesson_is_chosen_by_number_or_name() -> None:
    folders = lesson_folders(lessons_folder())
    assert len(folders) == 13
    assert [chosen_folder(word, folders).name for word in ("3", "ANGLES", "10_laboratory", "continuous path")] == [
        "03_angles",
        "03_angles",
        "10_laboratory",
        "08_continuous_path",
    ]
    for word, said in (("14", "there are 1 to 13"), ("anglse", "did you mean angles?"), ("s", "say more of the name")):
        with pytest.raises(NonexistentFile) as caught:
            chosen_folder(word, folders)
        assert said in str(caught.value)
