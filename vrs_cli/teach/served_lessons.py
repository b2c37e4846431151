"""Lessons of a class in browsers: the second robot of each student has one, and a learner who takes part in it.

Each lesson has a robot of its own, so another lesson is another robot of the same name. A learner waits for the robot,
so each has a thread.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from pathlib import Path
from queue import SimpleQueue
from threading import Event, Thread
from typing import TypeVar

from msgspec.structs import replace

from vrs_cli.errors import FileError, VrsError
from vrs_cli.interfaces.conversation.internal_error import internal_error
from vrs_cli.interfaces.dialogue import Notes, Terminal
from vrs_cli.interfaces.port.user_session import UserSession
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.user_state import UserState
from vrs_cli.language.words.word import Role
from vrs_cli.net import messages
from vrs_cli.net.client_session import ClientSession
from vrs_cli.net.room import Room
from vrs_cli.net.served_robot import Plan
from vrs_cli.teach.learn import Learner, LearnerRecord, LessonStanding
from vrs_cli.teach.lessons import Lesson, lesson_folders, lessons_folder, progress_key, read_lesson
from vrs_cli.values.questions import PromptStatus
from vrs_cli.values.replies import Farewell, Reply

T = TypeVar("T")
LESSON_ROBOT = "-2"  # how the name of the robot for lessons ends: the second of a student
WORDS = frozenset(("HINT", "AGAIN", "SKIP", "BACK", "LESSONS", "LESSON"))
MAX_KEPT = 20  # texts of the present step, for who comes later
LINE_SECONDS = 60.0  # in which a line of a lesson is done


def student_of(robot: str) -> str | None:
    """Return the student whose robot for lessons this is; None if it is another robot."""
    return robot.removesuffix(LESSON_ROBOT) if robot.endswith(LESSON_ROBOT) else None


class ServedLessons:
    """The lessons of all students. `folder` keeps where each is. `begin_anew`: has a robot begin anew, with another
    lesson; `tell` takes messages for whoever runs the server.
    """

    def __init__(self, folder: Path, begin_anew: Callable[[str, str], None], tell: Callable[[str], None]) -> None:
        self._folder, self._begin_anew, self._tell = folder, begin_anew, tell
        found = {one: read_lesson(one) for one in lesson_folders(lessons_folder())}
        self._course = {
            one: lesson for one, lesson in found.items() if lesson.delays is None
        }  # no line is delayed here
        self._wanted: dict[str, Path] = {}
        self._tutors: dict[str, Tutor] = {}

    # --- robots ---

    def plan(self, robot: str, plan: Plan) -> Plan:
        """Return the plan of a robot: for lessons that of the lesson that the student wants, or has not finished."""
        student = student_of(robot)
        if student is None:
            return plan
        lesson = self._course[self._wanted.get(student) or self._next(self._record(student))]
        cell = None if lesson.cell_file is None else lesson.cell
        return replace(plan, model=lesson.robot, journal=None, realtime=None, cell=cell, one_user=True, idle=inf)

    def opened(self, room: Room) -> None:
        """Take part at a robot for lessons."""
        student = student_of(room.name)
        if student is None:
            return
        if (before := self._tutors.get(student)) is not None:
            before.end()
        record = self._record(student)
        folder = self._wanted.get(student) or self._next(record)
        tutor = Tutor(room, self._course[folder], record, {one: it.title for one, it in self._course.items()})
        tutor.goes = lambda wanted: self._go(student, wanted)
        self._tutors[student] = tutor

    def _go(self, student: str, wanted: Path) -> None:
        self._wanted[student] = wanted
        self._begin_anew(student + LESSON_ROBOT, "another lesson begins")

    def _record(self, student: str) -> LearnerRecord:
        try:
            return LearnerRecord(self._folder / f"{student}.json")
        except FileError as error:
            self._tell(f"{error}; what {student} passes is not kept")
            return LearnerRecord(None)

    def _next(self, record: LearnerRecord) -> Path:
        """Return the lesson that is not finished, from the latest one on; the first where all are."""
        folders = [*self._course]
        keys = [progress_key(one) for one in folders]
        start = keys.index(record.latest) if record.latest in keys else 0
        order = [*zip(keys, folders, strict=True)]
        return next((one for key, one in order[start:] + order[:start] if not record.of(key).finished), folders[0])

    # --- clients ---

    def enter(self, client: ClientSession) -> None:
        """Begin the lesson, or tell who comes later what was said of the present step."""
        tutor = self._at(client)
        if tutor is not None:
            tutor.enter(client)

    def take(self, client: ClientSession, line: messages.Line) -> bool:
        """Carry out a line that is a word of lessons; return whether it is one."""
        first = line.text.partition(";")[0].split()[:1]
        tutor = self._at(client)
        if tutor is None or not first or first[0].upper() not in WORDS:
            return False
        tutor.take(client, line)
        return True

    def standing(self, student: str) -> tuple[str, int, int]:
        """Return the title of the lesson at which a student is, the steps that are passed, and how many there are."""
        tutor = self._tutors.get(student)
        if tutor is None or not tutor.begun:
            return "", 0, 0
        standing = tutor.standing
        return tutor.lesson.title, standing.passed, standing.of

    def _at(self, client: ClientSession) -> Tutor | None:
        student = student_of(client.robot)
        return None if student is None else self._tutors.get(student)


class Tutor:
    """A learner at a robot that is served, in a thread of its own. `goes` is called with the folder of the lesson to
    which the student wants to go.
    """

    def __init__(self, room: Room, lesson: Lesson, record: LearnerRecord, course: dict[Path, str]) -> None:
        self.lesson, self.begun = lesson, False
        self.goes: Callable[[Path], None] = lambda _folder: None
        self._room = room
        standing = record.of(lesson.key)
        begin = 0 if standing.finished else standing.passed
        self._learner = Learner(lesson, self._look, self._show, record, course, begin)
        self._said: list[messages.LessonText] = []  # of the present step
        self._work: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._looks = False  # a look is in the queue
        room.ended = self._line_ended
        Thread(target=self._serve, name=f"lesson of {room.name}", daemon=True).start()

    @property
    def standing(self) -> LessonStanding:
        return self._learner.standing

    def end(self) -> None:
        """Have the thread end: the robot is another one now."""
        self._work.put(None)

    # --- in the thread of the connections ---

    def enter(self, client: ClientSession) -> None:
        if self.begun:
            for said in self._said:
                client.tell(said)
            client.flush()
            return
        self.begun = True
        self._work.put(lambda: self._learner.join(_ServedPrompt(self._room)))

    def take(self, client: ClientSession, line: messages.Line) -> None:
        def carry_out() -> None:
            self._learner.take(line.text)
            self._room.put(lambda: client.tell(messages.Done(line.id, version=client.timeline.version)))
            if self._learner.wanted is not None:
                self.goes(self._learner.wanted)

        self._work.put(carry_out)

    def _line_ended(self) -> None:
        if self.begun and not self._looks:
            self._looks = True
            self._work.put(self._look_at_step)

    # --- in the thread of the lesson ---

    def _serve(self) -> None:
        self._look(lambda session: _give(session, self.lesson))
        while (work := self._work.get()) is not None:
            try:
                work()
            except Exception as error:
                if not isinstance(error, VrsError):
                    self._show(internal_error(error).text)

    def _look_at_step(self) -> None:
        self._looks = False
        self._learner.look()

    def _look(self, ask: Callable[[Session], T]) -> T:
        session = self._room.session
        return session.actor.call(lambda: ask(session)).result()

    def _show(self, text: str) -> None:
        """Tell everybody at the robot what the lesson says."""
        standing = self._learner.standing
        said = messages.LessonText(text, self.lesson.title, min(standing.passed + 1, standing.of), standing.of)

        def tell() -> None:
            if text.startswith(("# ", "## Step")):
                self._said = []
            self._said = [*self._said, said][-MAX_KEPT:]
            for client in tuple(self._room.clients.values()):
                client.tell(said)

        self._room.put(tell)


def _give(session: Session, lesson: Lesson) -> None:
    session.dialect = lesson.dialect
    session.unstored.asked_about = False
    if lesson.given is not None:
        session.take(lesson.given)


class _ServedPrompt:
    """The prompt of a lesson at a robot that is served: what its own lines say is told to all who are there."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._user = UserSession(room.session, UserState("lesson", Role.SUPERVISOR))
        self._id = 0
        self.terminal: Terminal = _Told(room)

    def take(self, text: str) -> None:
        """Carry out a line of the lesson, and wait until it is done."""
        ended, self._id = Event(), self._id + 1

        def hear(message: messages.ServerMessage) -> None:
            if isinstance(message, messages.Told):
                self.terminal.show(message.reply)
            elif isinstance(message, messages.Done | messages.Refused):
                ended.set()

        self._user.take(messages.Line(self._id, text), hear)
        ended.wait(LINE_SECONDS)

    def status(self) -> PromptStatus:
        """Return what stands around the prompt of a student who types a program, else around that of the lesson."""
        clients = tuple(self._room.clients.values())
        typing = any(client.conversation.in_program for client in clients) or self._user.conversation.in_program
        return PromptStatus(in_program=typing)


class _Told(Notes):
    """A terminal that tells all who are at a robot."""

    def __init__(self, room: Room) -> None:
        super().__init__()
        self._room = room

    def show(self, reply: Reply) -> None:
        def tell() -> None:
            for client in tuple(self._room.clients.values()):
                client.tell(messages.Told(reply))

        if not isinstance(reply, Farewell):
            self._room.put(tell)
