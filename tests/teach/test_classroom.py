"""Test rehearsals of lessons: the shipped lessons have no faults, and faulty steps are reported."""

from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.teach.lesson_files import CHECKS, lesson
from vrs_cli.interfaces.dialogue import Notes
from vrs_cli.teach.classroom import Classroom, faults
from vrs_cli.teach.judging.basis import evidence_of
from vrs_cli.teach.learn import marks_of
from vrs_cli.teach.lessons import Lesson, lesson_folders, lessons_folder, read_lesson

LESSONS = [read_lesson(folder) for folder in lesson_folders(lessons_folder())]


@pytest.mark.parametrize("lesson", [one for one in LESSONS if one.delays is None], ids=lambda lesson: lesson.name)
def test_the_model_lines_pass_each_step_and_nothing_passes_before(lesson: Lesson) -> None:
    """`vrs learn --check programs/lessons` tries wrong lines too, and the lesson behind a delay."""
    with ExitStack() as stack:
        room = Classroom(lesson, stack, lambda _text: None)
        front_end = room.front_end(Notes())
        stack.callback(front_end.closing)
        for step in lesson.steps:
            started = room.look(lambda session: session.engine.now)
            assert not all(one.passed for one in marks_of(lesson, step, room.look(evidence_of), started)), step.name
            for line in step.model:
                front_end.take(line)
            marks = marks_of(lesson, step, room.look(evidence_of), started)
            assert [(one.name, one.reason) for one in marks if not one.passed] == []


def test_a_sound_lesson_has_no_faults(tmp_path: Path) -> None:
    assert list(faults(read_lesson(lesson(tmp_path)))) == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("at = [30, -90]", "at = [0, -90]", ":3: step 1, Turn: it is passed before anything is done"),
        ('model = ["DRIVE 1, 30"]', 'model = ["DRIVE 1, 29"]', ":3: step 1, Turn: its model lines do not pass it: joi"),
        ('["DRIVE 1, 20"]', '["DRIVE 1, 10", "DRIVE 1, 20"]', "step 1, Turn: wrong lines pass it: ['DRIVE 1, 10', "),
    ],
)
def test_a_step_that_teaches_nothing_is_told(tmp_path: Path, old: str, new: str, said: str) -> None:
    (found,) = faults(read_lesson(lesson(tmp_path, CHECKS.replace(old, new, 1))))
    assert said in found
