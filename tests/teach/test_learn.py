"""Test a learner at the prompt: passing steps, words of lessons, and stored progress."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.teach.lesson_files import CHECKS, TEXT, lesson
from vrs_cli.errors import FileDamaged
from vrs_cli.interfaces.dialogue import Notes
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.teach.classroom import Classroom, LessonPlace
from vrs_cli.teach.learn import Learner, LearnerRecord, LessonStanding
from vrs_cli.teach.lessons import read_lesson
from vrs_cli.values.questions import Question
from vrs_cli.values.replies import Farewell


class Desk:
    """A learner with the shown texts and the robot's replies."""

    def __init__(self, folder: Path, stack: ExitStack, at: int = 0, progress: Path | None = None) -> None:
        self.shown, self.notes = list[str](), Notes()
        found = read_lesson(folder)
        room = Classroom(found, stack, self.shown.append)
        course = {folder: found.title, folder.parent / "09_next": "The next"}
        self.learner = Learner(found, room.look, self.shown.append, LearnerRecord(progress), course, at)
        self.front_end: FrontEnd = LessonPlace(room, self.learner).front_end(self.notes)
        stack.callback(self.front_end.closing)
        self.front_end.opening()

    def type(self, *lines: str) -> str:
        """Type lines; return the shown texts of the lesson."""
        del self.shown[:]
        for line in lines:
            self.front_end.take(line)
        return "\n".join(self.shown)


Seat = Callable[..., Desk]


@pytest.fixture
def seat(tmp_path: Path) -> Iterator[Seat]:
    with ExitStack() as stack:

        def take(checks: str = CHECKS, at: int = 0, progress: Path | None = None, text: str = TEXT) -> Desk:
            return Desk(lesson(tmp_path / "08_two", checks, text), stack, at, progress)

        yield take


def test_a_step_passes_by_what_was_done(seat: Seat) -> None:
    desk = seat()
    assert "## Step 1 of 2: Turn" in desk.shown[-1]
    assert desk.type("DRIVE 1, 10", "WHERE", "n = 5") == ""
    assert desk.type("DRIVE 1, 20").startswith("**Done.** It has turned.")
    assert desk.learner.standing == LessonStanding(2, 2)  # n was 5 already
    assert "LESSON goes on with the next one, The next; EXIT" in desk.shown[-1]


def test_wrong_lines_and_programs_that_are_typed_pass_nothing(seat: Seat) -> None:
    desk = seat()
    assert desk.type("DRIVE 1", ".PROGRAM p", "DRIVE 1, 30", "") == ""
    assert desk.type("SKIP") == "A program is being typed: end it first, with .END (or E in EDIT)."
    assert desk.type("HINT").startswith("DRIVE\n\nSo far: the joints are 0.0")
    assert desk.type(".END") == ""
    assert desk.type("EXECUTE p").startswith("**Done.**")


def test_hints_come_in_steps(seat: Seat) -> None:
    desk = seat()
    said = [desk.type("hint ; please") for _ in range(4)]
    so_far = "\n\nSo far: the joints are 0.0, -90.0, 90.0, 0.0, 0.0, 0.0 at 0.00 s."
    line = "This line passes the step:\n\n    DRIVE 1, 30"
    assert [one.removesuffix(so_far) for one in said] == ["DRIVE", "DRIVE joint, degrees", line, line]
    assert all(one.endswith(so_far) for one in said)
    assert desk.type("AGAIN").startswith("## Step 1 of 2: Turn")


def test_an_answer_that_is_not_right_is_told_once(seat: Seat) -> None:
    desk = seat(at=1)
    assert desk.type("n = 6") == "Not yet: n is 6."
    assert desk.type("m = 6", "WHERE") == ""
    assert desk.type("n = 7") == "Not yet: n is 7."
    assert desk.type("n = 5").startswith("**Done.** Said.")


def test_a_step_that_is_done_in_part_is_told(seat: Seat) -> None:
    more = '[[step.check]]\nkind = "variable"\nof = "m"\nvalue = 6\n\n[[step]]\nname = "Say"'
    desk = seat(CHECKS.replace('[[step]]\nname = "Say"', more))
    assert desk.type("DRIVE 1, 20", "WHERE") == ""
    assert desk.type("DRIVE 1, 10") == "Not yet: m has no value."


def test_skip_does_the_step_and_back_returns(seat: Seat) -> None:
    desk = seat()
    assert "Done for you:\n\n    DRIVE 1, 30\n**Done.** It has turned.\n## Step 2" in desk.type("SKIP")
    assert desk.type("BACK").startswith("## Step 1")
    assert desk.learner.standing.passed == 0
    assert desk.type("WHERE").startswith("**Done.**")  # the arm is there still


def test_undo_does_not_count_as_time_that_has_passed(seat: Seat) -> None:
    """After UNDO, a motion that begins before the step counts for the step."""
    motion = '[[step.check]]\nkind = "motion"\nlast = true\nseconds = [0, 9]\n\n[[step]]\nname = "Say"'
    desk = seat(CHECKS.replace('[[step]]\nname = "Say"', motion))
    desk.type("DRIVE 2, 10")
    desk.type("BACK")
    desk.type("UNDO")
    assert desk.type("DRIVE 1, 30").startswith("**Done.**")


def test_a_lesson_goes_on_where_it_was(seat: Seat, tmp_path: Path) -> None:
    kept = tmp_path / "learn.json"
    seat(progress=kept).type("DRIVE 1, 30")
    folder = str(tmp_path / "08_two")
    assert LearnerRecord(kept).of(folder) == LessonStanding(1, 2)
    assert LearnerRecord(kept).latest == folder
    desk = seat(at=1, progress=kept)
    assert desk.learner._look(lambda session: round(session.engine.now, 3)) == 0.666  # the model line was carried out
    assert desk.notes.take_all() == ()
    assert "Step 2 of 2" in desk.shown[-1]


def test_a_lesson_that_was_finished_stays_so(seat: Seat, tmp_path: Path) -> None:
    kept = tmp_path / "learn.json"
    seat(progress=kept).type("DRIVE 1, 30", "n = 5")
    seat(progress=kept).type("DRIVE 1, 30")
    assert LearnerRecord(kept).of(str(tmp_path / "08_two")).is_finished


def test_another_lesson_is_a_word_away(seat: Seat) -> None:
    desk = seat()
    assert "     1  Two steps                                 (you are here)\n     2  The next" in desk.type("LESSONS")
    assert "there is no lesson 7" in desk.type("LESSON 7")
    assert (desk.learner.wanted, desk.notes.take_all()) == (None, ())
    desk.type("LESSON")
    assert desk.learner.wanted is not None
    assert desk.learner.wanted.name == "09_next"
    assert isinstance(desk.notes.take_all()[-1], Farewell)
    desk.type("lesson two")
    assert desk.learner.wanted.name == "08_two"


def test_what_is_given_is_there(tmp_path: Path, seat: Seat) -> None:
    (tmp_path / "08_two").mkdir()
    (tmp_path / "08_two" / "given.v2").write_text(".LOCATIONS\npost 0 500 0 90 90 0\n.END\n", encoding="utf-8")
    desk = seat(CHECKS.replace("value = 5", 'value = 5\n\n[[step.check]]\nkind = "tool_at"\nat = "post"\nmm = 1'))
    desk.type("DRIVE 1, 30", "n = 5")
    assert desk.type("MOVE post").startswith("**Done.** Said.")


# --- the file of the progress -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"lessons": 3}', '{"lessons": {"a": {"passed": -1, "of": 2}}}', "\x00", "[" * 100_000]
)
def test_a_file_that_is_no_record_is_refused_with_the_way_out(tmp_path: Path, text: str) -> None:
    path = tmp_path / "learn.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileDamaged, match=r"learn.json is no record of lessons \(vrs learn --reset"):
        LearnerRecord(path)
    assert path.read_text(encoding="utf-8") == text


def test_two_shells_keep_a_lesson_each(tmp_path: Path) -> None:
    path = tmp_path / "new" / "learn.json"
    one, other = LearnerRecord(path), LearnerRecord(path)
    one.keep("01", LessonStanding(1, 3))
    other.keep("02", LessonStanding(3, 3))
    assert (LearnerRecord(path).of("01"), LearnerRecord(path).of("02").is_finished) == (LessonStanding(1, 3), True)
    assert json.loads(path.read_text(encoding="utf-8"))["latest"] == "02"


def test_a_disk_that_cannot_be_written_is_told_and_the_lesson_goes_on(seat: Seat, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    desk = seat(progress=tmp_path / "file" / "learn.json")
    assert [one for one in desk.shown if "Your progress is not kept: " in one and "learn.json cannot be" in one]
    said = desk.type("DRIVE 1, 30")
    assert "Step 2 of 2" in said
    assert "not kept" not in said
    assert desk.notes.take_all() == ()


class AttendedNotes(Notes):
    attended = True

    def ask(self, question: Question) -> str | None:
        raise AssertionError(f"it is asked: {question}")


def test_who_leaves_a_lesson_is_not_asked_what_to_store(tmp_path: Path) -> None:
    with ExitStack() as stack:
        room = Classroom(read_lesson(lesson(tmp_path)), stack, lambda _text: None)
        front_end = room.front_end(notes := AttendedNotes())
        stack.callback(front_end.closing)
        front_end.take("n = 4")
        front_end.take("EXIT")
        assert isinstance(notes.take_all()[-1], Farewell)


# --- a robot that is served -------------------------------------------------------------------------------------------


def test_what_is_done_elsewhere_counts_too(seat: Seat) -> None:
    """The robot moves from a page beside the prompt, or by a running program."""
    desk = seat()
    desk.front_end.kept_up()
    desk.learner._look(lambda session: session.perform("DRIVE 1, 30"))
    del desk.shown[:]
    desk.front_end.kept_up()
    assert desk.shown[0].startswith("**Done.** It has turned.")
    del desk.shown[:]
    desk.front_end.kept_up()
    assert desk.shown == []


def test_a_robot_behind_a_delay(seat: Seat) -> None:
    desk = seat(f'{CHECKS}\n[delay]\nforward = "5ms"\nbackward = "5ms"\n')
    assert desk.front_end.port.name
    assert desk.type("DRIVE 1, 30").startswith("**Done.** It has turned.")
    assert desk.type("n = 5").startswith("**Done.** Said.")
