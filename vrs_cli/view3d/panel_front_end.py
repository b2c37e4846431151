"""The front end of a panel: what the user does there goes to the robot, and what the robot says comes back. It does
not know the page.

Nothing waits: what comes is heard in the thread of the connection, and looked at by whoever draws the panel.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from html import escape
from threading import RLock
from typing import NamedTuple

from msgspec.structs import replace

from vrs_cli.errors import VrsError
from vrs_cli.interfaces.station.lease import Lost, Requested, notice_text
from vrs_cli.net import messages
from vrs_cli.net.messages import Asked, At, Done, Drive, LeaseAct, Line, Refused, Request, ServerMessage
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.render.blocks import PIPE, Block, Grid, line
from vrs_cli.render.colours import Ink
from vrs_cli.render.html import blocks_html, html, pieces_html
from vrs_cli.render.layout import blocks
from vrs_cli.render.scan import scan
from vrs_cli.values.acts import Attend, Define, Defined
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.numbers import count
from vrs_cli.values.prompt import PromptStatus, Suggestion
from vrs_cli.values.questions import Answer, OnScreen
from vrs_cli.values.replies import Plot, ReachReport, Reply, refusal
from vrs_cli.values.results import ChainReport, MotionReport

MOST = 100  # entries
MOST_ROWS = 60  # of one: more of them are for a file
MAX_TYPED_CHARS = 2000  # characters of a line that a program TYPEs


class TranscriptEntry(NamedTuple):
    """`open`: a line that a program TYPEs and has not ended; `again`: what takes its place if it comes next."""

    html: str
    open: str = ""
    again: str = ""


class PanelTranscript:
    """Any thread may add, and look. `version` is another one when something was added."""

    def __init__(self) -> None:
        self.version = 0
        self._entries: deque[TranscriptEntry] = deque(maxlen=MOST)
        self._lock = RLock()

    def html(self) -> str:
        with self._lock:
            return "".join(entry.html for entry in self._entries)

    def echo(self, prompt: str, text: str, again: str = "") -> None:
        """Lines as they were typed. `again`: what they are another one of, if they come one after the other."""
        lines = "\n".join(pieces_html(((prompt, Ink.NOTE), *scan(one))) for one in text.split("\n"))
        entry = TranscriptEntry(f'<pre style="font-weight:600">{lines}</pre>', again=again)
        with self._lock:
            if again and self._entries and self._entries[-1].again == again:
                self._entries.pop()
            self._add(entry)

    def reply(self, reply: Reply) -> None:
        shown = html((reply,)) if isinstance(reply, Plot) else blocks_html(_shortened(blocks(reply, PIPE)))
        self._add(TranscriptEntry(shown))

    def note(self, text: str, ink: Ink = Ink.NOTE) -> None:
        self._add(TranscriptEntry(f"<pre>{pieces_html(line(text, ink).pieces)}</pre>"))

    def type(self, text: str, newline: bool) -> None:
        """Add what a program TYPEs; a line may come in parts."""
        with self._lock:
            before = self._entries.pop().open if self._entries and self._entries[-1].open else ""
            whole = (before + text)[:MAX_TYPED_CHARS]
            self._add(TranscriptEntry(f"<pre>{escape(whole)}</pre>", "" if newline else whole))

    def _add(self, entry: TranscriptEntry) -> None:
        with self._lock:
            self._entries.append(entry)
            self.version += 1


def _shortened(shown: Iterable[Block]) -> Iterator[Block]:
    """The first rows; how many more there are."""
    left = MOST_ROWS
    more = 0
    for block in shown:
        rows = len(block.rows) if isinstance(block, Grid) else 1
        more += max(rows - left, 0)
        if isinstance(block, Grid) and left > 0:
            yield replace(block, rows=block.rows[:left])
        elif left > 0:
            yield block
        left -= rows
    if more:
        yield line(f"... and {count(more, 'more row')}", Ink.NOTE)


# --- the front end ---------------------------------------------------------------------------------------------------


MAX_SENT_CHARS = 50_000  # characters of what is typed at once
HISTORY = 500  # lines


class PanelLease(NamedTuple):
    """The names of the user who drives (empty: nobody), and of one who has asked this user to let him drive."""

    driver: str = ""
    asking: str = ""


class PanelFrontEnd:
    """`question`: the open question to the user. `waiting`: the commands that have not ended, by id. `happened` is
    called when one ends, `explained` gets the reports of WHY and EXPLAIN, and `refused` the lines that were not done.
    """

    def __init__(self, robot: SocketPort, happened: Callable[[], None] = lambda: None) -> None:
        self.robot, self._happened = robot, happened
        self.transcript = PanelTranscript()
        self.lease = PanelLease()
        self.running: tuple[str, ...] = ()
        self.waiting: dict[int, str] = {}
        self.history: list[str] = []
        self.explained: Callable[[ReachReport | MotionReport | ChainReport], None] = lambda _report: None
        self.refused: Callable[[str], None] = lambda _text: None
        self._questions: dict[int, Asked] = {}
        self._attends = False
        robot.listen(self._hear)
        self.attend()

    @property
    def may_drive(self) -> bool:
        """Return whether nobody else drives."""
        return self.lease.driver in ("", self.robot.name)

    @property
    def question(self) -> Asked | None:
        return next(iter(self._questions.values()), None)

    # --- what is done ---

    def type(self, text: str) -> None:
        """Send lines to the robot."""
        if len(text) > MAX_SENT_CHARS:
            self.note(f"{len(text)} characters at once: load them as a file", Ink.ERROR)
            return
        self._keep(text)
        self.command(text)

    def drop(self, text: str) -> None:
        """Keep lines that are not sent in the history."""
        self._keep(text)
        self.note(f"Not given, for the connection was cut meanwhile: {text.strip()}", Ink.WARNING)

    def _keep(self, text: str) -> None:
        if text.strip() and text not in self.history[-1:]:
            self.history = [*self.history, text][-HISTORY:]

    def command(self, text: str, again: str = "") -> None:
        """Send a line that the user typed, or that a button stands for. `again` as in `Transcript.echo`."""
        self.transcript.echo(self.robot.status().prompt, text, again)
        self._do(lambda id: Line(id, text), text)

    def load(self, name: str, data: bytes) -> None:
        """Put the programs of a file in memory."""
        try:
            text = data.decode()
        except UnicodeDecodeError:
            self.note(f"{name} is no text", Ink.ERROR)
            return
        self.note(f"Loading {name}")
        self._do(lambda id: At(id, Define(text, f"{name}:")), "")

    def drive(self, act: LeaseAct, to: str = "") -> None:
        self._do(lambda id: Drive(id, act, to), "")

    def attend(self) -> None:
        """Have the questions of programs put to this user."""
        if not self._attends:
            self._attends = True
            self._do(lambda id: At(id, Attend()), "")

    def answer(self, asked: Asked, value: Answer, how: messages.How = messages.How.ANSWERED) -> None:
        """Answer a question once: the first of two users does. Without a connection the question stays open."""
        if not self.robot.open:
            self.note(str(self.robot.far.no_connection), Ink.ERROR)
            return
        if self._questions.pop(asked.number, None) is not None:
            said = ("Y" if value else "N") if isinstance(value, bool) else value or ""
            self.transcript.echo(f"{getattr(asked.question, 'text', '')} ", said)
            self.robot.tell(messages.Answer(asked.number, value, how))

    def complete(self, text: str, found: Callable[[tuple[Suggestion, ...]], None]) -> None:
        """Give `found` what may come next after a text."""

        def hear(message: ServerMessage) -> None:
            if isinstance(message, messages.Completed):
                found(message.choices)

        self.robot.post(lambda id: messages.Complete(id, text), hear)

    def check(self, text: str, found: Callable[[Diagnostic | None], None]) -> None:
        """Give `found` the mistake in a line that is not sent yet; None if there is none, or no connection."""

        def hear(message: ServerMessage) -> None:
            found(message.mistake if isinstance(message, messages.Checked) else None)

        self.robot.post(lambda id: messages.Check(id, text), hear)

    def note(self, text: str, ink: Ink = Ink.NOTE) -> None:
        self.transcript.note(text, ink)

    def _do(self, make: Callable[[int], Request], text: str) -> None:
        """Send a command; its replies go into the transcript."""

        def made(id: int) -> Request:
            self.waiting = {**self.waiting, id: text}
            return make(id)

        before = self.waiting
        try:
            self.robot.begin(made, self._hear)
        except VrsError as error:
            self.waiting, self._attends = before, False
            self.note(str(error), Ink.ERROR)

    # --- what comes ---

    def _hear(self, message: ServerMessage) -> None:
        match message:
            case messages.Told(reply):
                self.transcript.reply(reply)
                if isinstance(reply, MotionReport) and reply.plan is None:
                    self.refused(reply.text)  # which has the same picture as a motion that was refused
                elif isinstance(reply, ReachReport | MotionReport | ChainReport):
                    self.explained(reply)
            case messages.Typed(text, newline):
                self.transcript.type(text, newline)
            case Asked() if isinstance(message.question, OnScreen):  # it fills a screen, which a panel has not
                self.robot.tell(messages.Answer(message.number, None))
            case Asked():
                self._questions[message.number] = message
            case messages.Withdrawn(number):
                self._questions.pop(number, None)
            case messages.Status(around):
                self._see(around)
            case Done() | Refused():
                self._ended(message)
            case messages.Activity(driver, programs):
                self.running = programs
                self.lease = self.lease._replace(driver=driver)
            case messages.Lease():
                self._leased(message)
            case messages.Welcome(resumed=resumed):
                if not resumed:
                    self._questions.clear()
                self.note("connected again")
                self._attends = False
                self.attend()

    def _see(self, status: PromptStatus) -> None:
        self.lease = self.lease._replace(driver=status.driver)
        if status.asked and self.question is None:
            self.attend()

    def _ended(self, end: Done | Refused) -> None:
        text = self.waiting.get(end.id, "") if end.id is not None else ""
        self.waiting = {id: one for id, one in self.waiting.items() if id != end.id}
        self._happened()
        if isinstance(end, Refused) or not end.ok:
            self.refused(text)
        if isinstance(end, Done) and end.status is not None:
            self._attends = False
            self._see(end.status)
        if isinstance(end, Done) and isinstance(end.found, Defined):
            names = ", ".join(end.found.names)
            self.note(f"In memory: {names or 'no program'}")
        if end.refusal is not None:
            self.transcript.reply(refusal(end.refusal.error(), text))

    def _leased(self, told: messages.Lease) -> None:
        """Tell who drives, and notices of the lease."""
        notice, before = told.notice, self.lease
        asking = before.asking if told.holder == before.driver else ""
        concerned = isinstance(notice, Requested | Lost) and notice.of == self.robot.name
        if isinstance(notice, Requested) and concerned:
            asking = notice.by
        if text := notice_text(notice, self.robot.name):
            self.note(text, Ink.WARNING if concerned else Ink.NOTE)
        elif told.holder != before.driver:
            self.note(self.who_drives(told.holder))
        self.lease = PanelLease(told.holder, asking)

    def who_drives(self, driver: str) -> str:
        return "You drive" if driver == self.robot.name else f"{driver or 'Nobody'} drives"
