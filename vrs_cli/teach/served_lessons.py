"""Serve lessons to the browsers of a class, on the second robot of each student.

Each lesson has its own robot, which replaces the robot of the previous lesson under the same name. A `Learner` blocks
while its robot works, so each has its own thread.
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
from vrs_cli.interfaces.dialogue import Notes, Terminal, internal_error
from vrs_cli.interfaces.port.user_session import UserSession
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.users import UserState
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
LESSON_ROBOT = "-2"  # suffix of the name of a student's second robot, which is for lessons
WORDS = frozenset(("HINT", "AGAIN", "SKIP", "BACK", "LESSONS", "LESSON"))
MAX_KEPT = 20  # maximum number of messages of the current step that are kept for clients that connect later
LINE_SECONDS = 60.0  # [s] maximum time to execute a line of a lesson


def student_of(robot: str) -> str | None:
    """Return the student whose robot for lessons has this name; None for any other robot."""
    return robot.removesuffix(LESSON_ROBOT) if robot.endswith(LESSON_ROBOT) else None


class ServedLessons:
    """The lessons of all students. `folder`: the folder with their progress.

    `begin_anew`: restarts a robot with another lesson. `tell`: shows a message to the person who runs the server.
    """

    def __init__(self, folder: Path, begin_anew: Callable[[str, str], None], tell: Callable[[str], None]) -> None:
        self._folder, self._begin_anew, self._tell = folder, begin_anew, tell
        self._course = {  # omit lessons on delays, because this server cannot delay its connections
            one: lesson for one in lesson_folders(lessons_folder()) if (lesson := read_lesson(one)).delays is None
        }
        self._wanted: dict[str, Path] = {}
        self._tutors: dict[str, Tutor] = {}

    # --- robots ---

    def plan(self, robot: str, plan: Plan) -> Plan:
        """Return the plan of a robot. A robot for lessons gets the plan of the lesson that its student chose, or else
        of the first unfinished lesson."""
        student = student_of(robot)
        if student is None:
            return plan
        lesson = self._course[self._wanted.get(student) or self._next(self._record(student))]
        cell = None if lesson.cell_file is None else lesson.cell
        return replace(plan, model=lesson.robot, journal=None, realtime=None, cell=cell, one_user=True, idle=inf)

    def start_at(self, room: Room) -> None:
        """If the robot is for lessons, start a tutor for it, and end the student's previous tutor."""
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
        """Return the first unfinished lesson, searching from the latest lesson on and then from the start; the first
        lesson if all are finished."""
        folders = {progress_key(one): one for one in self._course}
        keys = [*folders]
        start = keys.index(record.latest) if record.latest in keys else 0
        return folders[next((key for key in keys[start:] + keys[:start] if not record.of(key).is_finished), keys[0])]

    # --- clients ---

    def enter(self, client: ClientSession) -> None:
        """Start the lesson, or send the texts of the current step to a client that connects later."""
        if (tutor := self._at(client)) is not None:
            tutor.enter(client)

    def take(self, client: ClientSession, line: messages.Line) -> bool:
        """Execute a line and return True if the line is a word of lessons; otherwise return False."""
        first = line.text.partition(";")[0].split()[:1]
        tutor = self._at(client)
        if tutor is None or not first or first[0].upper() not in WORDS:
            return False
        tutor.take(client, line)
        return True

    def progress_of(self, student: str) -> tuple[str, int, int]:
        """Return the title of a student's current lesson, the number of passed steps, and the number of all steps."""
        tutor = self._tutors.get(student)
        if tutor is None or not tutor.begun:
            return "", 0, 0
        return tutor.lesson.title, tutor.standing.passed, tutor.standing.of

    def _at(self, client: ClientSession) -> Tutor | None:
        student = student_of(client.robot)
        return None if student is None else self._tutors.get(student)


class Tutor:
    """A `Learner` at a served robot, in its own thread. `goes` is called with the folder of the lesson that the student
    chooses to start next."""

    def __init__(self, room: Room, lesson: Lesson, record: LearnerRecord, course: dict[Path, str]) -> None:
        self.lesson, self.begun = lesson, False
        self.goes: Callable[[Path], None] = lambda _folder: None
        self._room = room
        standing = record.of(lesson.key)
        begin = 0 if standing.is_finished else standing.passed
        self._learner = Learner(lesson, self._look, self._show, record, course, begin)
        self._said: list[messages.LessonText] = []  # messages of the current step, for clients that connect later
        self._work: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._looks = False  # whether a check of the step is already queued
        room.ended = self._line_ended
        Thread(target=self._serve, name=f"lesson of {room.name}", daemon=True).start()

    @property
    def standing(self) -> LessonStanding:
        return self._learner.standing

    def end(self) -> None:
        """End the thread, because another robot replaces this one."""
        self._work.put(None)

    # --- in the thread of the connections ---

    def enter(self, client: ClientSession) -> None:
        """Start the lesson, or send the texts of the current step to a client that connects later."""
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
        self._look(self.lesson.give)
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
        """Show a message of the lesson to all clients of the robot."""
        standing = self._learner.standing
        said = messages.LessonText(text, self.lesson.title, min(standing.passed + 1, standing.of), standing.of)

        def tell() -> None:
            if text.startswith(("# ", "## Step")):
                self._said = []
            self._said = [*self._said, said][-MAX_KEPT:]
            for client in tuple(self._room.clients.values()):
                client.tell(said)

        self._room.put(tell)


class _ServedPrompt:
    """The prompt of a lesson at a served robot. Replies to its lines go to all clients."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._user = UserSession(room.session, UserState("lesson", Role.SUPERVISOR))
        self._id = 0
        self.terminal: Terminal = _BroadcastTerminal(room)

    def take(self, text: str) -> None:
        """Send a line of the lesson to the robot, and wait until the robot has executed it."""
        ended, self._id = Event(), self._id + 1

        def hear(message: messages.ServerMessage) -> None:
            if isinstance(message, messages.Told):
                self.terminal.show(message.reply)
            elif isinstance(message, messages.Done | messages.Refused):
                ended.set()

        self._user.take(messages.Line(self._id, text), hear)
        ended.wait(LINE_SECONDS)

    def status(self) -> PromptStatus:
        """Return the state of the prompt: whether a student, or the lesson itself, is typing a program."""
        clients = tuple(self._room.clients.values())
        typing = any(client.conversation.in_program for client in clients) or self._user.conversation.in_program
        return PromptStatus(in_program=typing)


class _BroadcastTerminal(Notes):
    """A terminal that sends its replies to all clients of a robot."""

    def __init__(self, room: Room) -> None:
        super().__init__()
        self._room = room

    def show(self, reply: Reply) -> None:
        def tell() -> None:
            for client in tuple(self._room.clients.values()):
                client.tell(messages.Told(reply))

        if not isinstance(reply, Farewell):
            self._room.put(tell)
