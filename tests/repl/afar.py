"""A robot behind a line on which every message goes as bytes, in one form after the other, and is read again.

It is in this process and has no thread of its own: what is asked for is done at once, as far as that goes without an
answer.
"""

from __future__ import annotations

import time
from itertools import cycle
from math import inf
from typing import Any

from msgspec import structs

from vrs_cli.engine.clock import RobotClock
from vrs_cli.engine.feed import Inbox
from vrs_cli.engine.position import Watched
from vrs_cli.errors import RequestRefused
from vrs_cli.files.opening import FREE, Folder
from vrs_cli.interfaces.dialogue import Terminal, at_once
from vrs_cli.interfaces.editor.buffer import named_program, open_program
from vrs_cli.interfaces.editor.editors import ScreenDraft
from vrs_cli.interfaces.port.local import LocalPort
from vrs_cli.interfaces.port.port import Console, MakeRequest, Outlet
from vrs_cli.interfaces.port.user_session import UserSession
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.users import UserState
from vrs_cli.net import messages
from vrs_cli.net.messages import FromClient, FromServer, ServerMessage
from vrs_cli.net.mirror import LastStatus
from vrs_cli.repl.connection import Remote
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.repl.shell import Local
from vrs_cli.values.questions import Editing, PromptStatus
from vrs_cli.wire.codec import Encoding, Reader, encode

FORMS = (Encoding.MSGPACK, Encoding.JSON)


class Line:
    """The port of the user. `cut`: nothing gets through."""

    name, one_user, cuts, stalls, world = "tester", False, 0, 0, None
    on_screen, due = None, inf

    def __init__(self, attended: bool = False, clock: RobotClock | None = None, folder: Folder = FREE) -> None:
        console = Console(attended)
        console.outlets.append(self._tell)
        self.session = Session(console, clock=clock, folder=folder)
        user_state = UserState(attended=attended, lives=attended and clock is not None)
        self.user = UserSession(self.session, user_state)
        self.conversation = self.user.conversation
        self.cut = self.closed = False
        self._from_client: Reader[Any] = Reader(FromClient)
        self._from_server: Reader[Any] = Reader(FromServer)
        self._forms = cycle(FORMS)
        self._news: list[Outlet] = []
        self._outlets: dict[int, Outlet] = {}
        self._id = self._seq = 0
        self._status = LastStatus(lambda: time.monotonic())  # noqa: PLW0108 (tests replace it)

    # --- here ---

    @property
    def open(self) -> bool:
        return not self.cut

    def begin(self, make: MakeRequest, outlet: Outlet) -> int:
        self.check_open()
        self._id += 1
        self._outlets[self._id] = outlet
        self._take(make(self._id))
        return self._id

    def post(self, make: MakeRequest, outlet: Outlet) -> None:
        self.begin(make, outlet)

    def take(self, inbox: Inbox[ServerMessage], seconds: float | None = None) -> ServerMessage | None:
        return inbox.take(seconds)

    def tell(self, message: messages.ClientMessage) -> None:
        if not self.cut:
            self._take(message)

    def interrupt(self) -> bool:
        self.tell(messages.Interrupt())
        return True

    def give_up(self, error: BaseException) -> str:
        return f"it is not waited for any more: {error}"

    def listen(self, outlet: Outlet) -> None:
        self._news.append(outlet)

    def status(self) -> PromptStatus:
        return self._status.now()

    def program(self, _key: str) -> None:
        return None

    def follow(self) -> Watched:
        self.check_open()
        return self.session.engine

    def close(self) -> None:
        self.closed = True

    def check_open(self) -> None:
        if self.cut:
            raise RequestRefused("there is no connection")

    # --- between ---

    def _carried(self, message: Any, reader: Reader[Any]) -> Any:
        return reader.read(encode(message, next(self._forms)))

    def _tell(self, message: ServerMessage) -> None:
        if isinstance(message, messages.Numbered):
            self._seq += 1
            message = structs.replace(message, seq=self._seq)
        arrived = self._carried(message, self._from_server)
        match arrived:
            case messages.Done(status=PromptStatus() as status) | messages.Status(status):
                self._status.see(status)
        id = getattr(arrived, "id", None)
        ends = isinstance(arrived, messages.Done | messages.Result | messages.Refused)
        outlet = (self._outlets.pop if ends else self._outlets.get)(id, None) if id is not None else None
        for hear in [outlet] if outlet is not None else self._news:
            hear(arrived)

    # --- there ---

    def _take(self, sent: messages.ClientMessage) -> None:
        message = self._carried(sent, self._from_client)
        if isinstance(message, messages.Get):
            data = (self.session.folder.at / message.name).read_bytes()
            self._tell(messages.Fetched(message.id, message.name, data))
        else:
            self.user.take(message, self._tell)
        actor = self.session.actor
        while not isinstance(message, messages.Interrupt) and (actor.has_requests or actor.lets_time_pass):
            actor.step()


def remote_front_end(terminal: Terminal, clock: RobotClock | None = None, told: list[str] | None = None) -> FrontEnd:
    line = Line(terminal.attended, clock)
    return Remote(line, (told if told is not None else []).append).front_end(terminal)


def local_front_end(terminal: Terminal, clock: RobotClock | None = None) -> FrontEnd:
    return Local(clock=clock).front_end(terminal)


def front_end_at(session: Session, terminal: Terminal | None = None) -> FrontEnd:
    """The front end of a session that is there already."""
    return FrontEnd(terminal or session.terminal, LocalPort(session, Console()), lambda _text: None)


def question_of(front_end: FrontEnd, name: str, step: int = 1) -> Editing:
    """The question of SEE, whose program has the screen."""
    session = session_of(front_end)
    draft = session.user_state.on_screen = ScreenDraft(
        session, at_once(open_program(session, named_program(name), step))
    )
    return Editing(draft.name, draft.text, draft.row, draft.dialect)


def session_of(front_end: FrontEnd) -> Session:
    """The session of a front end in this process."""
    assert isinstance(front_end.port, LocalPort)
    return front_end.port.session
