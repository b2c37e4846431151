"""A seat at a robot of this process, over a line that takes every value through the wire's encoding, both ways."""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle
from typing import Any

from vrs_cli.engine.clock import RobotClock
from vrs_cli.engine.feed import Inbox
from vrs_cli.engine.position import Watched
from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.files.bounds import FREE, Folder
from vrs_cli.interfaces.actor.ticket import Ticket
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.dialogue import Dialogue, Reading, Running, Slice, Terminal
from vrs_cli.interfaces.monitor.running import emergency_stop
from vrs_cli.interfaces.port.port import Outlet
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.user_state import UserState
from vrs_cli.net import messages
from vrs_cli.net.messages import FromClient, FromServer, ServerMessage
from vrs_cli.repl.remote_front_end import RemoteFrontEnd
from vrs_cli.values.questions import Answer, Question, ended
from vrs_cli.values.replies import Reply, is_error
from vrs_cli.wire.codec import Encoding, Reader, encode
from vrs_cli.wire.messages import How
from vrs_cli.wire.refusal import Refusal

FORMS = (Encoding.MSGPACK, Encoding.JSON)


class Line:
    """The far end, and the line to it. What is asked for is done at once, as far as that goes without an answer;
    `cut`: nothing gets through.
    """

    name, one_user, cuts, stalls = "tester", False, 0, 0

    def __init__(self, attended: bool = False, clock: RobotClock | None = None, folder: Folder = FREE) -> None:
        self.session = Session(_There(self, attended), clock=clock, folder=folder)
        self.user_state = UserState(attended=attended, lives=attended and clock is not None)
        self.conversation = Conversation(self.session, self.user_state)
        self.cut = self.closed = False
        self._from_client: Reader[Any] = Reader(FromClient)
        self._from_server: Reader[Any] = Reader(FromServer)
        self._forms = cycle(FORMS)
        self._news: list[Outlet] = []
        self._outlets: dict[int, Outlet] = {}
        self._id = self._seq = 0
        self._tickets: dict[int, Ticket[Any]] = {}  # by the command
        self._asking: list[tuple[Ticket[Any], Question]] = []

    # --- here ---

    @property
    def open(self) -> bool:
        return not self.cut

    def begin(self, make: Callable[[int], messages.Request], outlet: Outlet) -> int:
        if self.cut:
            raise RequestRefused("there is no connection")
        self._id += 1
        self._outlets[self._id] = outlet
        request = self._carried(make(self._id), self._from_client)
        if isinstance(request, messages.Command):
            self._command(request)
        else:
            self._tell(self._answered(request))
        return self._id

    def take(self, inbox: Inbox[ServerMessage], seconds: float | None = None) -> ServerMessage | None:
        return inbox.take(seconds)

    def interrupt(self) -> bool:
        self.tell(messages.Interrupt())
        return True

    def tell(self, message: messages.ClientMessage) -> None:
        if not self.cut:
            self._take(self._carried(message, self._from_client))

    def post(self, make: Callable[[int], messages.Request], outlet: Outlet) -> None:
        self.begin(make, outlet)

    def listen(self, outlet: Outlet) -> None:
        self._news.append(outlet)

    def follow(self) -> Watched:
        if self.cut:
            raise RequestRefused("there is no connection")
        return self.session.engine

    def close(self) -> None:
        self.closed = True

    # --- between ---

    def _carried(self, message: Any, reader: Reader[Any]) -> Any:
        return reader.read(encode(message, next(self._forms)))

    def _tell(self, message: ServerMessage) -> None:
        arrived = self._carried(message, self._from_server)
        id = getattr(arrived, "id", None)
        ends = isinstance(arrived, messages.Done | messages.Result | messages.Refused)
        outlet = (self._outlets.pop if ends else self._outlets.get)(id, None) if id is not None else None
        for hear in [outlet] if outlet is not None else self._news:
            hear(arrived)

    def numbered(self) -> int:
        self._seq += 1
        return self._seq

    # --- there ---

    def _command(self, command: messages.Command) -> None:
        match command:
            case messages.Line(text=text, more=more):
                dialogue: Dialogue[Any] = self.conversation.lines(text, more)
            case messages.At(act=act):
                dialogue = self.conversation.act(act)  # type: ignore[arg-type]
            case _:
                dialogue = emergency_stop(self.session)
        done = self._done(command.id, dialogue)
        self._tickets[command.id] = self.session.actor.submit(
            self.session.at(self.user_state, done), urgent=isinstance(command, messages.Abort)
        )
        self._drive()

    def _done(self, id: int, dialogue: Dialogue[Any]) -> Dialogue[None]:
        """The same talk, which tells what is said in the order in which it is said, and how it has ended."""
        ok, reaction = True, None
        found = refused = None
        try:
            while True:
                said = dialogue.throw(reaction) if isinstance(reaction, BaseException) else dialogue.send(reaction)
                reaction = None
                if isinstance(said, Reply):
                    ok = ok and not is_error(said)
                    self._tell(messages.Told(said, id, seq=self.numbered()))
                    said = Slice.MORE
                try:
                    reaction = yield said
                except (Exception, KeyboardInterrupt) as error:
                    reaction = error  # type: ignore[assignment]
        except StopIteration as over:
            found = over.value
        except VrsError as error:
            ok, refused = False, Refusal.of(error)
        status = self.conversation.status()
        self._tell(messages.Done(id, ok, refused, 0, status, found, seq=self.numbered()))

    def _drive(self) -> None:
        """Until what was asked for is done, or asks something."""
        while self._busy():
            self.session.actor.step()
            for id, ticket in tuple(self._tickets.items()):
                for said in ticket.heard():
                    assert isinstance(said, Question), "replies are told as they are said"
                    self._asking.append((ticket, said))
                    self._tell(messages.Asked(said.id, said, id, seq=self.numbered()))

    def _busy(self) -> bool:
        asking = [ticket for ticket, _ in self._asking]
        return any(not one.done() and one not in asking for one in self._tickets.values())

    def _take(self, message: messages.ClientMessage) -> None:
        match message:
            case messages.Answer(number, value, how):
                ticket, question = self._asking.pop()
                assert question.id == number
                if how is How.ANSWERED:
                    ticket.answer(number, value)
                else:
                    interrupted = how is How.INTERRUPTED
                    ticket.throw(KeyboardInterrupt() if interrupted else ended(question), number)
                self._drive()
            case messages.Interrupt():
                for ticket in self._tickets.values():
                    if not ticket.done():
                        self.conversation.interrupt(ticket)

    def _answered(self, request: messages.Request) -> ServerMessage:
        match request:
            case messages.Check(id, text):
                return messages.Checked(id, self.conversation.mistake(text))
            case messages.Complete(id, text, everything):
                return messages.Completed(id, tuple(self.conversation.suggestions(text, everything)))
            case messages.Get(id, name):
                return messages.Fetched(id, name, (self.session.folder.root / name).read_bytes())
        raise AssertionError(request)


class _There:
    """What the robot says by itself, at the far end."""

    def __init__(self, line: Line, attended: bool) -> None:
        self._line, self.attended = line, attended

    def show(self, reply: Reply) -> None:
        self._line._tell(messages.Told(reply, seq=self._line.numbered()))

    def type(self, text: str, newline: bool) -> None:
        self._line._tell(messages.Typed(text, newline, seq=self._line.numbered()))

    def ask(self, question: Question) -> Answer:
        raise AssertionError(question)

    def progress(self, doing: Running | Reading) -> None:
        pass


def remote_front_end(
    terminal: Terminal, clock: RobotClock | None = None, told: list[str] | None = None
) -> RemoteFrontEnd:
    line = Line(terminal.attended, clock)
    return RemoteFrontEnd(terminal, line, (told if told is not None else []).append)
