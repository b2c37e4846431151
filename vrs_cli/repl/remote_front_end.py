"""A seat at a robot afar: lines go over a connection, and what is said comes back over it.

Nothing is given twice by itself: of a line that was on its way when the connection was cut it is told what became of
it. What concerns the connection itself is told by `told`, never at the terminal.
"""

from __future__ import annotations

import tempfile
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from math import inf
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace

from vrs_cli.engine.feed import Inbox
from vrs_cli.engine.position import Watched
from vrs_cli.errors import EndOfInput, RequestRefused, VrsError
from vrs_cli.files.trajectory_file import Recording, read_trajectory
from vrs_cli.interfaces.conversation.internal_error import internal_error
from vrs_cli.interfaces.conversation.signature import Signature, signature
from vrs_cli.interfaces.dialogue import Running, Terminal
from vrs_cli.interfaces.editor.screen import EditedProgram, Found
from vrs_cli.interfaces.jog.jogger import JogArm
from vrs_cli.interfaces.port.port import Port, answer_to
from vrs_cli.interfaces.station.lease import Lost, Notice, Requested
from vrs_cli.net import messages
from vrs_cli.net.far_hand import FarHand
from vrs_cli.net.messages import Abort, Asked, At, Done, Drive, LeaseAct, Line, Refused, Request, ServerMessage
from vrs_cli.repl.front_end import KEEPING_UP, RESTING
from vrs_cli.values.acts import Attend, Findings, KeepDraft, Kept, LeaveEntry, ReadDraft, StopProgram
from vrs_cli.values.hand import Look, Seen
from vrs_cli.values.prompt import PromptStatus, Suggestion
from vrs_cli.values.questions import Answer, Editing, Jogging, Playing, Question
from vrs_cli.values.replies import Farewell, Message, Tone, refusal
from vrs_cli.values.tagged import UserAct
from vrs_cli.wire.messages import How

AT_ONCE = 1.0  # [s] that the answer to a look is waited for: a key does not wait longer
COMING_BACK = 60.0  # [s] that a file is waited for
LONGEST = 50_000  # characters of one message
SLASH = "/"  # no line of VAL-II begins with it
WORDS = "/who is there and drives, /ask to drive, /give NAME lets another drive, /release lets anybody; all may ABORT"
M = TypeVar("M", bound=ServerMessage)


class RemoteFrontEnd:
    """`told` hears what concerns the connection."""

    def __init__(self, terminal: Terminal, port: Port, told: Callable[[str], None]) -> None:
        self.interrupted = self.failed = False
        self.noted = ""
        self._terminal, self._port, self._told = terminal, port, told
        self._heard: Inbox[ServerMessage] = Inbox()
        self._later: deque[ServerMessage] = deque()  # for when the user has no question before him
        self._status, self._told_at = PromptStatus(), 0.0
        self._floor = -inf  # [s] of the clock that was shown: it does not go back while time passes
        self._waits = self._asks = False
        self._breaks = self._count_breaks()  # when the last line was taken
        self._withdrawn: set[int] = set()
        self._question = 0  # that is before the user
        self._wake: Callable[[], object] = int  # nobody waits
        port.listen(self._come)

    # --- what is done ---

    def begin(self) -> None:
        """What a prompt shows comes with the answer."""
        if self._terminal.attended:
            self._act(Attend())
            if not self._port.one_user:
                self._told(WORDS)
            if self._status.driver:
                self._told(self._named(self._status.driver))

    def take(self, text: str) -> None:
        """A line for the robot; one that begins with a slash is about who drives it."""
        self.interrupted = False
        self._breaks = self._count_breaks()
        if text.startswith(SLASH):
            self._drive(text[1:].split())
            return
        *parts, last = _parts(text)
        for part in parts:
            if not self._do(partial(Line, text=part, more=True), part) or self.interrupted:
                return
        self._do(partial(Line, text=last), last)

    def answer(self) -> None:
        self._act(Attend())

    def was_cut(self) -> bool:
        return not self._port.open or self._breaks != self._count_breaks()

    def _count_breaks(self) -> int:
        """A person expects nothing any more of a line that is quiet for long; a pipe waits."""
        return self._port.cuts + self._port.stalls * self._terminal.attended

    def drop(self, what: str) -> None:
        self._lost(f"not given, for the connection was cut meanwhile: {what}")

    def leave_entry(self, why: str = "") -> None:
        if self._port.open:  # else the server forgets it by itself
            self._act(LeaveEntry(why))

    def leave(self) -> None:
        """The robot goes on for others: nothing is lost."""
        self._terminal.show(Farewell())

    def end(self) -> None:
        self._port.close()

    def stop_program(self) -> None:
        self._act(StopProgram())

    def abort(self) -> None:
        self._port.post(Abort, self._come)

    def _act(self, act: UserAct[None]) -> None:
        self._do(lambda id: At(id, act))

    def _drive(self, words: list[str]) -> None:
        match [words[0].lower() if words else "", *words[1:]]:
            case ["who"]:
                found = self._look(messages.Who, messages.Present)
                if found is not None:
                    there = f"there are {', '.join(found.holders)}"
                    self._told(f"{there}; {self._named(found.driver)}")
            case ["ask"]:
                self._do(lambda id: Drive(id, LeaseAct.ASK))
            case ["give", to]:
                self._do(lambda id: Drive(id, LeaseAct.GIVE, to))
            case ["release"]:
                self._do(lambda id: Drive(id, LeaseAct.RELEASE))
            case _:
                self._told(WORDS)

    def _named(self, driver: str) -> str:
        return f"{driver or 'nobody'} drives" if driver != self._port.name else "you drive"

    def _do(self, make: Callable[[int], Request], line: str = "") -> bool:
        """Send a command; show what is said of it, and ask what is asked, until it has ended. Whether the robot has
        told of its end.
        """
        self.noted = ""
        self._waits = True
        try:
            id = self._port.begin(make, self._come)
            while True:
                message = self._next()
                if isinstance(message, Done | Refused) and message.id == id:
                    self._ended(message, line)
                    return bool(message.seq)
                self._hear(message)
        except KeyboardInterrupt:
            self.interrupted = True
            self._lost("it is not waited for any more: the robot may do it still")
        except RequestRefused as error:
            self._lost(str(error))
        finally:
            self._waits = False
        return False

    def _next(self) -> ServerMessage:
        if self._later:
            return self._later.popleft()
        message = self._port.take(self._heard)
        assert message is not None, "it waits as long as that takes"
        return message

    def _see(self, status: PromptStatus) -> None:
        """What was told on its way, however long that took, tells no more of the clock than that it is not earlier."""
        now, before = time.monotonic(), self._status
        goes_on = before.pace is not None and status.pace is not None and not (before.pace.paused or status.pace.paused)
        self._floor = self.status().clock if goes_on else -inf
        if goes_on and status.pace == before.pace:
            status = replace(status, clock=max(status.clock, self._extrapolated(now)))
        self._status, self._told_at = status, now

    def _ended(self, end: Done | Refused, line: str) -> None:
        if isinstance(end, Done) and end.status is not None:
            self._see(end.status)
        if end.refusal is None:
            return
        if end.seq:
            self._terminal.show(refusal(end.refusal.error(), line))
        else:  # no robot has said it
            self._lost(str(end.refusal.error()))

    def _lost(self, why: str) -> None:
        self.failed = True
        self._told(why)

    # --- what comes ---

    def _hear(self, message: ServerMessage) -> None:
        match message:
            case messages.Told(reply):
                self._terminal.show(reply)
            case messages.Typed(text, newline):
                self._terminal.type(text, newline)
            case Asked(number):
                if number not in self._withdrawn:
                    self._ask(message)
            case messages.Withdrawn(number):
                self._withdrawn.add(number)
            case messages.Status(around):
                self._see(around)
                if self._waits and around.running:
                    self._terminal.progress(Running(around.clock))
            case Done() | Refused():
                self._ended(message, "")
            case messages.Welcome(resumed=resumed):
                if not resumed:  # its questions are gone, and are counted anew; so is the time of another server
                    self._withdrawn = {self._question} - {0}
                    self._status = replace(self._status, pace=None)
                self._again()
            case messages.Lease(holder, notice) if self._terminal.attended:
                self._told(self._noticed(holder, notice))

    def _again(self) -> None:
        """The connection is there again: what the prompt shows is asked for."""
        self._told("connected again")
        if self._terminal.attended:
            with suppress(RequestRefused):
                self._port.begin(lambda id: At(id, Attend()), self._come)

    def _noticed(self, holder: str, notice: Notice | None) -> str:
        me = self._port.name
        if isinstance(notice, Requested) and notice.of == me:
            return f"{notice.by} would like to drive: /give {notice.by}"
        if isinstance(notice, Lost) and notice.of == me:
            return f"{notice.by} drives, for nothing was heard of you"
        if isinstance(notice, Requested):
            return f"{notice.of} is asked to let {'you' if notice.by == me else notice.by} drive"
        return self._named(holder)

    def _ask(self, asked: Asked) -> None:
        """Have a question answered."""
        self._asks, self._question = True, asked.number
        try:
            answer = answer_to(asked, self._answered)
        finally:
            self._asks, self._question = False, 0
        self.interrupted |= answer.how is How.INTERRUPTED
        self._port.tell(answer)

    def _answered(self, question: Question) -> Answer:
        """What cannot fill the screen is told, and has been left."""
        try:
            return self._terminal.ask(question)
        except EndOfInput:
            raise
        except VrsError as error:
            self._terminal.show(Message(str(error), Tone.ERROR))
            return True

    # --- Ctrl-C ---

    def interrupt(self) -> bool:
        """Whoever is asked something answers with it; the robot stops all else that is waited for."""
        if not self._waits or self._asks:
            return False
        self.interrupted = self._port.interrupt()
        return self.interrupted

    # --- while a line is typed ---

    def note(self, error: Exception) -> None:
        self.noted = internal_error(error).text

    def status(self) -> PromptStatus:
        """As it was told last; a clock on the wall has gone on since."""
        return replace(self._status, clock=max(self._floor, self._extrapolated(time.monotonic())))

    def _extrapolated(self, now: float) -> float:
        pace, clock = self._status.pace, self._status.clock
        return clock if pace is None or pace.paused else clock + pace.rate * (now - self._told_at)

    def signature(self, text: str, *, steps: bool = False) -> Signature | None:
        """By the tables, which are here; the programs are not."""
        return signature(text, lambda _key: None, at_prompt=not (self._status.in_program or steps))

    def suggestions(self, text: str, everything: bool) -> list[Suggestion]:
        found = self._look(lambda id: messages.Complete(id, text, everything), messages.Completed)
        return [] if found is None else list(found.choices)

    def _look(self, make: Callable[[int], Request], kind: type[M], seconds: float = AT_ONCE) -> M | None:
        """What a look finds; None where it finds nothing in that time."""
        found: Inbox[ServerMessage] = Inbox()
        try:
            self._port.begin(make, found.put)
        except RequestRefused:
            return None
        end = self._port.take(found, seconds)
        return end if isinstance(end, kind) else None

    @property
    def driven(self) -> None:
        """The robot is driven at the server."""

    @property
    def withdrawn(self) -> bool:
        return self._question in self._withdrawn

    def rest(self) -> float:
        """As long as the clock on the wall is to be seen to go on; what comes wakes."""
        now = self.status()
        return KEEPING_UP if now.clock < now.end else RESTING

    def woken_by(self, wake: Callable[[], object]) -> None:
        self._wake = wake

    def _come(self, message: ServerMessage) -> None:
        """Something is there to be looked at, in the thread of the connection."""
        self._heard.put(message)
        self._wake()

    def keep_up(self) -> None:
        """What belongs to a command whose question is before the user comes after it."""
        for message in self._heard.taken():
            if isinstance(message, Asked) or (self._waits and isinstance(message, Done | Refused)):
                self._later.append(message)
            else:
                self._hear(message)

    # --- what fills the screen ---

    def page(self, question: Editing) -> EditedProgram:
        return _Page(question, self._port)

    def hand(self, question: Jogging) -> JogArm:
        seen = self._look(lambda id: At(id, Look()), Done)
        if seen is None or not isinstance(seen.found, Seen):
            raise RequestRefused("the robot does not answer", "JOG again")
        return FarHand(self._port.begin, question.joints, question.units, seen.found)

    def recording(self, question: Playing) -> Recording:
        """The file comes here."""
        fetched = self._look(lambda id: messages.Get(id, question.path), messages.Fetched, COMING_BACK)
        if fetched is None:
            raise RequestRefused(f"{question.path} does not come from the robot", "REPLAY again")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / Path(question.path).name
            path.write_bytes(fetched.data)
            return read_trajectory(path)

    def watched(self) -> Watched | None:
        try:
            return self._port.follow()
        except RequestRefused:
            return None


def _parts(text: str) -> list[str]:
    """What was pasted, in messages of whole lines."""
    parts, size = [""], 0
    for line in text.splitlines(keepends=True):
        if size and size + len(line) > LONGEST:
            parts.append("")
            size = 0
        parts[-1] += line
        size += len(line)
    return parts


class _Page:
    """The program of SEE. One look at its text is on its way at a time, and the last text is looked at."""

    def __init__(self, question: Editing, port: Port) -> None:
        self.name, self.text, self.row, self.dialect = question.name, question.text, question.row, question.dialect
        self._port = port
        self._latest: tuple[str, Found] | None = None
        self._looking = False

    def look(self, text: str, found: Found) -> None:
        self._latest = text, found
        if not self._looking:
            self._send()

    def _send(self) -> None:
        assert self._latest is not None, "there is something to look at"
        (text, found), self._latest, self._looking = self._latest, None, True

        def hear(end: ServerMessage) -> None:
            self._looking = False
            if isinstance(end, Done) and isinstance(end.found, Findings):
                found(end.found.findings)
            if self._latest is not None:
                self._send()

        try:
            self._port.begin(lambda id: At(id, ReadDraft(text)), hear)
        except RequestRefused:  # there is no connection: the text is looked at when it changes again
            self._looking = False

    def note(self, text: str, *, stored: bool) -> None:
        """What would be lost is here until it is stored."""

    def save(self, text: str) -> str:
        """Raises VrsError."""
        heard: Inbox[ServerMessage] = Inbox()
        self._port.begin(lambda id: At(id, KeepDraft(text)), heard.put)
        end = self._port.take(heard, COMING_BACK)
        if isinstance(end, Done | Refused) and end.refusal is not None:
            raise end.refusal.error()
        if not isinstance(end, Done) or not isinstance(end.found, Kept):
            raise RequestRefused("the robot does not answer", "store it again")
        self.name = end.found.name
        return end.found.said
