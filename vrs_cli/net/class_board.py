"""Carry out the messages of a class of students: requests for help, hand-ins, announcements, freezing."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Protocol

from vrs_cli.errors import LimitReached, RequestRefused
from vrs_cli.files.store import EVERYTHING, choose_parts, text_of
from vrs_cli.interfaces.session.session import Session
from vrs_cli.net import messages
from vrs_cli.net.client_session import ClientSession, commands
from vrs_cli.net.tokens import ClassFolder, Grant

MAX_CHARS = 4000  # maximum number of characters of an announcement
MAX_LISTED = 20  # maximum number of listed hand-ins per student


class Lessons(Protocol):
    """The lessons of a class. `teach/`, which imports `net/`, implements this protocol."""

    def enter(self, client: ClientSession) -> None:
        """Send a client the current step of its lesson, if its robot has a lesson."""

    def take(self, client: ClientSession, line: messages.Line) -> bool:
        """Carry out a line that is for the lesson, and answer it with `done`; return False for a line to the robot."""

    def progress_of(self, student: str) -> tuple[str, int, int]:
        """Return the title of a student's lesson, the number of passed steps, and the number of all steps."""


class ClassBoard:
    """The state of a class, and the messages that change it.

    `clients` returns the clients of all robots, `grants` the grants of all tokens, `own` the names of a grant's robots,
    and `wall` the seconds since 1970. Call all methods in the thread of the connections.
    """

    def __init__(
        self,
        folder: ClassFolder,
        clients: Callable[[], Iterable[ClientSession]],
        grants: Callable[[], Iterable[Grant]],
        own: Callable[[Grant], tuple[str, ...]],
        wall: Callable[[], float],
    ) -> None:
        self._folder, self._clients, self._grants, self._own, self._wall = folder, clients, grants, own, wall
        self.frozen_by = ""
        self.lessons: Lessons | None = None
        self._help: dict[str, float] = {}
        self._handed_in: dict[str, tuple[str, ...]] = {}
        self._at: dict[str, str] = {}  # the robot that each student used last
        self._watching: set[ClientSession] = set()
        self._sent: dict[ClientSession, messages.ClassState] = {}

    # --- messages ---

    async def receive(self, client: ClientSession, message: messages.ClientMessage) -> bool:
        """Carry out a message of a class, or refuse a command while the class is frozen. Return False if the message is
        for the robot."""
        try:
            if isinstance(message, messages.OF_CLASS):
                if isinstance(message, messages.TEACHING) and not _teaches(client):
                    raise RequestRefused("that is for the teacher", "ask the teacher")
                await self._carry_out(client, message)
                if not isinstance(message, messages.Collect):
                    client.tell(messages.Done(message.id, version=client.timeline.version))
            elif self.frozen_by and not client.grant.teacher and commands(client, message):
                raise RequestRefused(
                    f"{self.frozen_by} has stopped the class: nothing is done now", "wait for the teacher"
                )
            elif not (isinstance(message, messages.Line) and self.lessons and self.lessons.take(client, message)):
                return False
        except Exception as error:
            client.refuse(message, error, client.send)
        client.flush()
        return True

    async def _carry_out(self, client: ClientSession, message: messages.ClientMessage) -> None:
        match message:
            case messages.AskHelp(wanted=wanted, student=student):
                own = client.grant.name
                if _teaches(client):
                    if wanted or student not in self._help:
                        raise RequestRefused(f"{student or own} does not ask for help", "students ask")
                    own = student
                elif student and student != own:
                    raise RequestRefused("that is for the teacher", "ask for yourself")
                if wanted:
                    self._help.setdefault(own, self._wall())
                else:
                    self._help.pop(own, None)
            case messages.HandIn(name=name, text=text):
                student = client.grant.name
                if text is None:
                    text = await asyncio.to_thread(_memory_of, client.session)
                file = await asyncio.to_thread(self._folder.hand_in, student, name, text, self._wall())
                self._handed_in[student] = (*self._files_of(student), file)[-MAX_LISTED:]
                client.note(f"(hand in {file}, {len(text)} characters)", "done")
            case messages.WatchClass():
                self._watching.add(client)
            case messages.Announce(text=text, student=student):
                self._announce(client, text, student)
            case messages.Freeze(frozen=frozen):
                self.frozen_by = client.name if frozen else ""
                client.note("(freeze the class)" if frozen else "(let the class go on)", "done")
            case messages.Collect(id):
                client.send(messages.Fetched(id, "hand-ins.zip", await asyncio.to_thread(self._folder.archive)))
        self.tell()

    def _announce(self, client: ClientSession, text: str, student: str) -> None:
        if len(text) > MAX_CHARS:
            raise LimitReached(f"{len(text)} characters at once, {MAX_CHARS} at most", "say it in parts")
        known = {grant.name for grant in self._students()}
        if student and student not in known:
            raise RequestRefused(f"there is no student {student}", f"there is {', '.join(sorted(known)) or 'none'}")
        for other in self._clients():
            if not other.grant.teacher and student in ("", other.grant.name):
                other.tell(messages.Announced(client.name, text))
                other.flush()
        client.note(f"(say to {student or 'all'}: {text[:200]})", "done")

    # --- the state for clients ---

    def tell(self) -> None:
        """Send clients the state of the class if it has changed. Call this method also a few times a second."""
        clients = [client for client in self._clients() if client.link is not None]
        self._watching &= set(clients)
        here = dict[str, list[ClientSession]]()
        for client in clients:
            here.setdefault(client.grant.name, []).append(client)
        students = {grant.name: grant for grant in self._students()}
        self._help = {name: at for name, at in self._help.items() if name in students}
        self._at = {name: robot for name, robot in self._at.items() if name in students}
        states = {name: self._state(grant, here.get(name, [])) for name, grant in students.items()}
        whole = messages.ClassState(bool(self.frozen_by), tuple(states.values()))
        sent = dict[ClientSession, messages.ClassState]()
        for client in clients:
            if client in self._watching:
                state = whole
            elif client.grant.name in states:
                state = messages.ClassState(bool(self.frozen_by), (states[client.grant.name],))
            else:
                continue
            sent[client] = state
            if self._sent.get(client) != state:
                client.say(state)
                client.flush()
        self._sent = sent

    def _students(self) -> Iterator[Grant]:
        """Yield the grants of the students."""
        return (grant for grant in self._grants() if not grant.teacher and not grant.body)

    def enter(self, client: ClientSession) -> None:
        """Send a newly connected client the text of its lesson; the next `tell` sends it the state of the class."""
        self._sent.pop(client, None)
        if self.lessons is not None:
            self.lessons.enter(client)

    def _state(self, grant: Grant, here: Sequence[ClientSession]) -> messages.StudentState:
        name, own = grant.name, self._own(grant)
        at = max((client for client in here if client.robot in own), key=lambda one: one.heard_at, default=None)
        if at is not None:
            self._at[name] = at.robot
        robot = self._at.get(name, "")
        lesson, step, of = ("", 0, 0) if self.lessons is None else self.lessons.progress_of(name)
        return messages.StudentState(
            name, own, len(here), robot, self._help.get(name), lesson, step, of, self._files_of(name)
        )

    def _files_of(self, student: str) -> tuple[str, ...]:
        if student not in self._handed_in:
            self._handed_in[student] = tuple(path.name for path in self._folder.programs(student)[-MAX_LISTED:])
        return self._handed_in[student]


def _teaches(client: ClientSession) -> bool:
    return client.grant.teacher and bool(client.grant.name)


def _memory_of(session: Session) -> str:
    """Return all programs and variables of a robot, as STORE writes them. Raises RequestRefused if there are none."""
    memory, layout = session.actor.call(lambda: (session.environment.copy(), session.layout)).result()
    text = text_of(choose_parts(memory, [*EVERYTHING], ()), layout, everything=True)
    if not text.strip():
        raise RequestRefused("there is nothing to hand in", "write a program first")
    return text
