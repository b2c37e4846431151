"""Provide the robot of a lesson, and rehearse lessons.

The robot runs in this process, is served to a browser beside the prompt, or is served over a connection with simulated
delays (a delay line). A rehearsal tries each step three times: without lines, with its wrong lines, and with its model
lines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, TypeVar
from urllib.parse import urlsplit

from msgspec import Struct, structs

from vrs_cli.interfaces.dialogue import Notes, Terminal
from vrs_cli.interfaces.port.local import LocalPort
from vrs_cli.interfaces.session.session import Session
from vrs_cli.net.delay_line import Delays, DelayWays
from vrs_cli.repl.front_end import FrontEnd, Place
from vrs_cli.repl.shell import BANNER, Local
from vrs_cli.teach.grading import Mark
from vrs_cli.teach.judging.basis import evidence_of
from vrs_cli.teach.learn import Learner, marks_of
from vrs_cli.teach.lessons import Lesson, LessonStep

if TYPE_CHECKING:
    from vrs_cli.net.local_server import LocalRobot, PagePlace

T = TypeVar("T")
LOOPBACK = "127.0.0.1"
DELAY_LINE_TIMEOUT_S = 5.0  # [s] maximum time to open or close a delay line


class Classroom:
    """The robot of one lesson; it runs until the caller closes `stack`, an ExitStack.

    `page`: the files of its web page; None: no web page. `attended`: whether a person, rather than a rehearsal, uses
    the robot. `rate`: robot seconds per second of wall time, for a robot in real time.
    """

    def __init__(
        self,
        lesson: Lesson,
        stack: ExitStack,
        tell: Callable[[str], None],
        *,
        page: PagePlace | None = None,
        attended: bool = False,
        rate: float = 1.0,
    ) -> None:
        self.lesson = lesson
        self.local_robot: LocalRobot | None = None
        self._session: Session | None = None
        if lesson.delays is None and page is None:
            self.place: Place = Local(lesson.robot, cell=lesson.cell_file, dialect=lesson.dialect)
        else:
            self.local_robot, self.place = _serve(lesson, stack, tell, page, attended=attended, rate=rate)

    def look(self, ask: Callable[[Session], T]) -> T:
        """Call a function with the robot's session, between two actions of the robot; return its result."""
        if self.local_robot is not None:
            session = self.local_robot.session
            return session.actor.call(lambda: ask(session)).result()
        assert self._session is not None, "the front end is made first"
        return ask(self._session)

    def front_end(self, terminal: Terminal) -> FrontEnd:
        """Make the front end of a shell for the robot. Raises VrsError."""
        front_end = self.place.front_end(terminal)
        if isinstance(front_end.port, LocalPort):
            self._session = front_end.port.session
        self.look(self.lesson.give)
        return front_end


def _serve(
    lesson: Lesson,
    stack: ExitStack,
    tell: Callable[[str], None],
    page: PagePlace | None,
    *,
    attended: bool,
    rate: float,
) -> tuple[LocalRobot, Place]:
    """Serve the robot of a lesson in its own folder, behind a proxy that adds the delays of the lesson, if it has
    any."""
    from vrs_cli.net.client import Client, hello_of
    from vrs_cli.net.local_server import SHELL, LocalRobot
    from vrs_cli.net.socket_port import SocketPort
    from vrs_cli.render.text import styled_lines
    from vrs_cli.repl.connection import Remote

    local_robot = LocalRobot(
        lesson.robot,
        page,
        name="lesson",  # the same name for each lesson, so that an open page shows the next robot
        rate=None if lesson.delays is None else rate,
        folder=Path(stack.enter_context(TemporaryDirectory(prefix="vrs-lesson-"))),
        cell=None if lesson.cell_file is None else lesson.cell,
        styled=styled_lines,
        tell=tell,
    )
    stack.callback(local_robot.close)
    url = local_robot.url if lesson.delays is None else _add_delay(local_robot.url, DelayWays(*lesson.delays), stack)
    port = SocketPort(Client(url, hello_of(local_robot.tokens[SHELL], attended=attended), notify=tell))
    stack.callback(port.close)
    return local_robot, Remote(port, tell)


def _add_delay(url: str, ways: DelayWays, stack: ExitStack) -> str:
    """Start a proxy that delays messages to and from an address, and return the address of the proxy."""
    from vrs_cli.net.delay_line import DelayProxy, Endpoint
    from vrs_cli.net.socket_port import Loop

    parts = urlsplit(url)
    loop = Loop()
    stack.callback(loop.close)
    proxy = DelayProxy(Endpoint(parts.hostname or LOOPBACK, parts.port or 0), ways, lambda _text: None)
    at = loop.wait(proxy.listen(Endpoint(LOOPBACK, 0)), DELAY_LINE_TIMEOUT_S)
    stack.callback(lambda: loop.wait(proxy.close(), DELAY_LINE_TIMEOUT_S))
    return f"ws://{at}{parts.path}"


class LessonPlace:
    """The place (robot and learner) of a lesson, from which a shell makes its front end. `first`: whether it is the
    first lesson of the process."""

    waits = True

    def __init__(self, classroom: Classroom, learner: Learner, *, first: bool = True) -> None:
        self._classroom, self._learner = classroom, learner
        self.lives, self.remote = classroom.place.lives, classroom.place.remote
        self.banner = BANNER if first else ""

    def front_end(self, terminal: Terminal) -> FrontEnd:
        """Make the front end of the shell. Raises VrsError."""
        front_end = self._classroom.front_end(terminal)
        self._learner.attach(front_end)
        return front_end


SPEEDUP = 4.0  # factor by which a rehearsal speeds up robots with a delayed connection, and shortens the delays


class ShortenedDelays(Struct, frozen=True):
    """Delays of a lesson divided by SPEEDUP, for a rehearsal on a robot that runs SPEEDUP times as fast."""

    delays: Delays

    def source(self, random: Random) -> Callable[[float], float]:
        """Return a function that maps the time of sending [s] to the delay [s]."""
        slow = self.delays.source(random)
        return lambda t: slow(t * SPEEDUP) / SPEEDUP


def faults(lesson: Lesson) -> Iterator[str]:
    """Yield the faults in the steps of a lesson, each with its file, its line, and how to fix it."""
    if lesson.delays is not None:
        forward, backward = lesson.delays
        lesson = structs.replace(lesson, delays=(ShortenedDelays(forward), ShortenedDelays(backward)))
    before = list[str]()
    for number, step in enumerate(lesson.steps):
        for what, hint in _faults_of_step(lesson, step, before):
            yield f"{lesson.checks_file}:{step.line}: step {number + 1}, {step.name}: {what} ({hint})"
        before += step.model


def _faults_of_step(lesson: Lesson, step: LessonStep, before: list[str]) -> Iterator[tuple[str, str]]:
    start, *after = _try_marks(lesson, step, before, [(), step.model, *step.wrong])
    if not _failed_marks(start):
        hint = "let a check ask for something that is not so yet"
        yield "it is passed before anything is done: all its checks hold when it begins", hint
        return
    if failed := _failed_marks(after[0]):
        said = "; ".join(f"{one.name}: {one.reason}" for one in failed)
        yield f"its model lines do not pass it: {said}", "mend model, or the check"
    for lines, marks in zip(step.wrong, after[1:], strict=True):
        if not _failed_marks(marks):
            yield (
                f"wrong lines pass it: {list(lines)}",
                "let a check tell them from the model, or take them out of wrong",
            )


def _failed_marks(marks: Iterable[Mark]) -> list[Mark]:
    return [one for one in marks if not one.passed]


def _try_marks(
    lesson: Lesson, step: LessonStep, before: list[str], tries: Iterable[tuple[str, ...]]
) -> Iterator[tuple[Mark, ...]]:
    """Yield the marks of a step for each item of `tries`, the lines to try in this step. Each try runs in a new robot:
    first `before`, the model lines of all earlier steps, and then its own lines."""
    for lines in tries:
        with ExitStack() as stack:
            room = Classroom(lesson, stack, lambda _text: None, rate=1.0 if lesson.delays is None else SPEEDUP)
            front_end = room.front_end(Notes())
            stack.callback(front_end.closing)
            front_end.opening()
            for line in before:
                front_end.take(line)
            started = room.look(lambda session: session.engine.now)
            for line in lines:
                front_end.take(line)
            yield marks_of(lesson, step, room.look(evidence_of), started)
