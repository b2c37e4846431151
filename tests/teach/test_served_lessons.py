"""Test lessons of a class over a connection: steps, words, another lesson, a restart."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.live import until
from tests.net.serving import Caller, Serving, serving
from vrs_cli.net.class_board import ClassBoard
from vrs_cli.net.messages import ClassState, Closing, Hello, LessonText, Welcome
from vrs_cli.net.tokens import OWN_ROBOTS, ClassFolder
from vrs_cli.teach.served_lessons import ServedLessons


class Student(Caller):
    """A student at a lesson, who reads its messages in order."""

    read = 0  # of all messages

    def told(self, has: str) -> LessonText:
        """Return the next message of the lesson that contains these words."""
        while True:
            for one in self.heard[self.read :]:
                self.read += 1
                if isinstance(one, LessonText) and has in one.text:
                    return one
            self.until(lambda _one: True)


class Course:
    """A served class with lessons."""

    def __init__(self, it: Serving, folder: ClassFolder) -> None:
        self.it, self.folder = it, folder

    def call(self, robot: str = "ada-2") -> Student:
        hello = Hello((1,), token=self.folder.students()["ada"], attended=True)
        return Student(f"{self.it.address}/robots/{robot}", hello)


@pytest.fixture
def course(tmp_path: Path) -> Iterator[Course]:
    folder = ClassFolder(tmp_path)
    folder.make(["ada"])
    with serving(tmp_path, (), tokens=folder.tokens, own=OWN_ROBOTS) as it:
        it.server.board = ClassBoard(folder, it.hub.clients, it.server.grants, it.hub.own_names, lambda: 1e9)
        lessons = ServedLessons(folder.lessons, it.server.begin_anew, it.told.append)
        it.server.board.lessons, it.hub.planned = lessons, lessons.plan
        it.server.opened.append(lessons.start_at)
        yield Course(it, folder)
        assert it.told == []


def test_a_lesson_sees_what_was_done_and_helps(course: Course) -> None:
    with course.call() as ada:
        first = ada.told("Step 1 of")
        assert (first.title, first.step) == ("First motion", 1)
        assert "DRIVE" in first.text
        assert ada.line("HINT").ok
        ada.told("So far")
        assert ada.line("DRIVE 1, 30").ok
        ada.told("Done")
        second = ada.told("Step 2 of")
        assert second.step == 2
        assert ada.line("skip").ok
        ada.told("Step 3 of")
        assert ada.line("LESSONS").ok
        assert "2 of 6 (you are here)" in ada.told("LESSON and a number").text
        while (states := [one for one in ada.heard if isinstance(one, ClassState)])[-1].students[0].step != 2:
            ada.until(lambda one: isinstance(one, ClassState))
        state = states[-1].students[0]
        assert (state.lesson, state.step, state.of, state.at) == ("First motion", 2, 6, "ada-2")


def test_who_comes_again_goes_on_with_the_step(course: Course) -> None:
    with course.call() as ada:
        ada.told("Step 1 of")
        assert ada.line("DRIVE 1, 30").ok
        ada.told("Step 2 of")
    with course.call() as again:
        again.told("Step 2 of")
        course.it.server.begin_anew("ada-2", "the server starts again")
        again.until(lambda one: isinstance(one, Closing))
    until(lambda: "ada-2" not in course.it.hub.rooms)
    with course.call() as later:
        later.told("You go on at step 2")
        assert abs(course.it.hub.rooms["ada-2"].session.engine.now) > 0.0  # what the steps before ask for is done
        later.told("Step 2 of")


def test_another_lesson_has_another_robot(course: Course) -> None:
    with course.call() as ada:
        ada.told("Step 1 of")
        life = next(one for one in ada.heard if isinstance(one, Welcome)).life
        ada.line("LESSON 9")
        assert isinstance(ada.until(lambda one: isinstance(one, Closing)), Closing)
    with course.call() as ada:
        assert ada.told("Step 1 of").title.startswith("Palletising")
        welcome = next(one for one in ada.heard if isinstance(one, Welcome))
        assert welcome.life != life
        assert ada.line("LESSON 99").ok
        ada.told("there is no lesson 99")


def test_the_robot_for_work_has_no_lesson(course: Course) -> None:
    with course.call("ada") as ada:
        assert not ada.line("HINT").ok
        assert ada.line("DRIVE 1, 30").ok
        assert not [one for one in ada.heard if isinstance(one, LessonText)]


def test_a_program_is_typed_before_it_is_looked_at(course: Course) -> None:
    with course.call() as ada:
        ada.told("Step 1 of")
        ada.lines(".PROGRAM turn", "DRIVE 1, 30")
        assert ada.line("SKIP").ok
        ada.told("A program is being typed")
        ada.lines(".END", "EXECUTE turn")
        ada.told("Step 2 of")


def test_every_lesson_of_the_course_can_be_skipped_through(course: Course) -> None:
    with course.call() as ada:
        said = ada.told("Step 1 of")
        for _ in range(said.of):
            assert ada.line("SKIP").ok
        ada.told("That was the lesson")
