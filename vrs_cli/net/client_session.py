"""One user of a served robot, over all the connections that it has one after the other.

What a client asks for becomes a request to the robot; what comes of it becomes messages, in the order in which the
robot said it. Nothing here waits.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, Protocol

from msgspec import structs

from vrs_cli.errors import LimitReached, RequestRefused, VrsError, sentence
from vrs_cli.files.bounds import Folder
from vrs_cli.interfaces.actor.ticket import Ticket
from vrs_cli.interfaces.dialogue import Dialogue, beside, quietly
from vrs_cli.interfaces.port.port import Outlet
from vrs_cli.interfaces.port.user_session import TAKEN, Pending, UserSession
from vrs_cli.interfaces.rights import check_may
from vrs_cli.interfaces.session.acts import ACTS
from vrs_cli.interfaces.session.drag_control import DragControl
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.user_state import UserState
from vrs_cli.interfaces.tasks.holder_times import USUAL_ALLOWED, HolderTimes
from vrs_cli.language.text.source import MAX_LINE_CHARS
from vrs_cli.language.words.word import Role
from vrs_cli.net import messages, robot_folder
from vrs_cli.net.broadcast import Broadcast, Listener, Sink
from vrs_cli.net.delivery_log import DeliveryLog
from vrs_cli.net.driving import Driving
from vrs_cli.net.limits import Allowance, Bucket, SendPace, Share
from vrs_cli.net.parts import is_long, parts_of
from vrs_cli.net.places import may_hold, without
from vrs_cli.net.protocol import ServerConnection
from vrs_cli.net.stream import MessageForm
from vrs_cli.net.tokens import Grant
from vrs_cli.values.acts import KeepDraft, Say, StopProgram, Survey, Undo
from vrs_cli.values.hand import Press, StopJog
from vrs_cli.values.prompt import PromptStatus
from vrs_cli.values.questions import Amendment, Confirmation, Parting, Question
from vrs_cli.values.replies import DiagnosticsReport, Reply, refusal
from vrs_cli.values.tagged import UserAct
from vrs_cli.wire.codec import Encoding

TYPING = messages.Complete | messages.Check  # asked while a line is typed
AT_ONCE = messages.Interrupt | messages.Ping | messages.Bye  # what waits for nobody's share
# what whoever types moves or changes by acts: what that is called, and the role that it needs
CHANGING: Mapping[type, tuple[str, Role]] = {
    KeepDraft: ("a program", Role.SUPERVISOR),
    Press: ("JOG", Role.DESIGNER),
    StopJog: ("JOG", Role.DESIGNER),
    StopProgram: ("ABORT", Role.DESIGNER),
}
MOST_LOOKS = 200  # of one holder that wait for an answer


class ClientSocket(Protocol):
    """A socket, to the robot that it leads to. It never waits and never raises."""

    connection: ServerConnection
    address: str
    deflates: bool

    @property
    def sink(self) -> Sink:
        """For what is told to many."""

    def flush(self) -> None:
        """Send what the connection has to send, and close where that is due."""

    def ping(self) -> None:
        """Find out whether somebody is there; that is told by `ClientSession.beat`."""


class RoomServices(Protocol):
    """Services of a room for its client sessions. `lookers`: the request budget of users who do not drive."""

    @property
    def session(self) -> Session: ...

    drag_control: DragControl
    broadcast: Broadcast
    driving: Driving
    folder: Folder
    prefixes: tuple[str, ...]
    allowance: Allowance
    lookers: Bucket
    clients: dict[str, ClientSession]

    def begin(self, client: ClientSession, pending: Pending) -> None:
        """A user asks for something."""

    def hear(self, client: ClientSession, pending: Pending, ticket: Ticket[Any], said: Reply | Question | None) -> None:
        """Something was said of a request, None: it has ended. In the robot's thread."""

    def checked(self, dialogue: Dialogue[Any], always: Callable[[], bool]) -> Dialogue[Any]:
        """The same dialogue, refused if nothing may be changed now and it is not one that may `always` be; what it
        changes is written down.
        """

    def may_always(self, line: str) -> bool:
        """Whether a line only looks, stops, or makes room."""

    def others_ask(self, client: ClientSession) -> bool:
        """Whether anybody else has asked for something lately."""

    def stops(self, client: ClientSession) -> None:
        """A holder stops the robot: the others are told who it was."""

    def note(self, client: ClientSession, what: str, result: str) -> None:
        """A line for the audit."""

    def present(self, client: ClientSession) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The robots that it may hold, and who holds this one."""

    def stirred(self) -> None:
        """There is something to broadcast."""


class ClientSession(UserSession):
    """One user of a served robot. `name`: its own among the users of the robot; `link`: its socket, None while that is
    cut.
    """

    def __init__(
        self,
        services: RoomServices,
        name: str,
        grant: Grant,
        delivery_log: DeliveryLog,
        hello: messages.Hello,
        wall: Callable[[], float],
    ) -> None:
        self.name, self.grant, self.delivery_log = name, grant, delivery_log
        user_state = UserState(name, grant.role)
        super().__init__(services.session, user_state)
        user_state.attended, self._answers = hello.attended, hello.attended or hello.answers
        user_state.lives = hello.attended and services.session.engine.realtime
        user_state.times = HolderTimes(
            hello.offset, USUAL_ALLOWED if hello.delay is None else min(hello.delay, USUAL_ALLOWED)
        )
        self.link: ClientSocket | None = None
        self.pace = SendPace()
        self._share = Share(services.allowance, services.lookers, wall())
        self._parked: deque[tuple[messages.ClientMessage, int]] = deque()  # waits for its share; bytes of each
        self.parked_bytes = 0
        self.address = ""
        self.console = False
        self.heard_at = wall()
        self._services, self._wall = services, wall
        self._listener: Listener | None = None
        self._wishes: deque[messages.Drag] = deque(maxlen=1)  # where the tool is to be, until the robot takes it
        self._pulling: Pending | None = None  # a wish that the robot has not taken
        self._drag_refused = False  # which is told once
        self._to_tell: deque[Iterator[messages.Numbered]] = deque()  # a long reply, and what comes after it
        self._status: PromptStatus | None = (
            None  # as it was told last, the ends of requests aside: not all look at these
        )

    # --- connections ---

    def attach(self, link: ClientSocket, hello: messages.Hello) -> None:
        """Give the client a socket, in place of the one before."""
        self.detach()
        self.link, self.address = link, link.address
        form = MessageForm(text=hello.format is Encoding.JSON, full=hello.full)
        self._listener = self._services.broadcast.join(link.sink, form, deflates=link.deflates)
        self._status = None
        self.beat()

    def detach(self) -> None:
        """The socket is gone; the client may come again with another one."""
        listener, self._listener, self.link = self._listener, None, None
        self.pace.waiting = 0
        if listener is not None:
            self._services.broadcast.leave(listener)

    def beat(self) -> None:
        """Note that the client was heard."""
        self.heard_at = self._wall()
        self._services.driving.beat(self.name)

    def tell(self, message: messages.Numbered) -> None:
        """Send what the client has to hear once: now, when it is connected again, or after the long reply before it."""
        prefixes, long = self._services.prefixes, isinstance(message, messages.Told) and is_long(message.reply)
        if long or may_hold(prefixes, message):
            message = without(prefixes, message)
        if long and isinstance(message, messages.Told):
            self._to_tell.append(parts_of(message))
        elif self._to_tell:
            self._to_tell.append(iter((message,)))
        else:
            self.delivery_log.tell(message, self._wall())

    @property
    def has_more(self) -> bool:
        """Whether a long reply is being sent."""
        return bool(self._to_tell)

    def tell_more(self) -> None:
        """Tell the next part of a long reply, and all that comes after its last part."""
        while self._to_tell:
            message = next(self._to_tell[0], None)
            if message is not None:
                self.delivery_log.tell(message, self._wall())
                if isinstance(message, messages.Told) and message.goes_on:
                    return
            else:
                self._to_tell.popleft()
        self.session.actor.let_go_on(self.user_state)

    def say(self, message: messages.ServerMessage) -> None:
        """Send a message if the client is connected; else it is lost."""
        if self.link is not None:
            self.link.connection.send(message, self._wall())

    def send(self, message: messages.ServerMessage) -> None:
        """Tell or say a message, as its kind wants it."""
        self.tell(message) if isinstance(message, messages.Numbered) else self.say(message)

    def leave(self) -> None:
        self.detach()
        super().leave()

    # --- what comes ---

    def receive(self, message: messages.ClientMessage, *, waited: bool = False) -> None:
        """Carry out a message; `waited`: it came in time, and has waited here. What cannot be done is told."""
        self.beat()
        try:
            if not waited:
                self._check_in_time(message)
            self.carry_out(message, self.send)
        except Exception as error:
            if what := _deed(message):
                self._services.note(self, what, f"refused: {error}")
            self.refuse(message, error, self.send)

    def carry_out(self, message: messages.ClientMessage, outlet: Outlet) -> None:
        match message:
            case messages.Line(text=text) | messages.At(act=Say(line=text)):
                check_short(text)
            case messages.Complete(text=text) | messages.Check(text=text):
                check_short(text)
        (TAKEN.get(type(message)) or _TAKEN[type(message)])(self, message, outlet)

    def _check_in_time(self, message: messages.ClientMessage) -> None:
        """A command that was held up on the way is not done, for its user expects it no more; but a stop always is.
        Raises RequestRefused.
        """
        if not isinstance(message, messages.Command) or message.until is None:
            return
        late = self._wall() - message.until
        if late > 0.0 and not self._is_stop(message):
            what = f"it was held up on the way, and arrived {late:.1f} s too late: it was not done"
            raise RequestRefused(what, "give it again")

    def _is_stop(self, command: messages.Command) -> bool:
        match command:
            case messages.Abort() | messages.At(act=StopProgram() | StopJog()):
                return True
            case messages.Line(text=text) | messages.At(act=Say(line=text)):
                return self.stops(text)
        return False

    def wait(self, message: messages.ClientMessage) -> float:
        """How long a request is to wait [s], so that others do not wait for all that one wants: who drives never, nor
        who is alone.
        """
        services = self._services
        if services.driving.lease.holder in ("", self.name) or not services.others_ask(self):
            return 0.0
        return self._share.wait(self._wall(), len(services.clients), typing=isinstance(message, TYPING))

    def spend(self, seconds: float, *, typing: bool = False) -> None:
        """It has cost CPU time [s]. In any thread."""
        if self._services.driving.lease.holder != self.name:
            self._share.spend(seconds, self._wall(), typing=typing)

    def park(self, message: messages.ClientMessage, size: int) -> bool:
        """Keep a request, of so many bytes, that is to wait; false for one that goes first, or need not wait. Of what
        is asked while a line is typed the newest alone waits: those before it are answered with nothing.
        """
        if isinstance(message, AT_ONCE) or (isinstance(message, messages.Command) and self._is_stop(message)):
            return False
        if not self._parked and not self.wait(message):
            return False
        if isinstance(message, TYPING):
            for old, its in [one for one in self._parked if type(one[0]) is type(message)]:
                self._parked.remove((old, its))
                self.parked_bytes -= its
                self.say(_nothing_found(old))
        self._parked.append((message, size))
        self.parked_bytes += size
        return True

    def unpark(self) -> float | None:
        """Do what need not wait any more; how long the next is to wait [s], None where nothing waits."""
        while self._parked:
            message, size = self._parked[0]
            if wait := self.wait(message):
                return wait
            self._parked.popleft()
            self.parked_bytes -= size
            begun = time.thread_time()
            self.receive(message, waited=True)
            self.spend(time.thread_time() - begun, typing=isinstance(message, TYPING))
        return None

    def ask(
        self,
        message: messages.Request,
        dialogue: Dialogue[Any],
        outlet: Outlet,
        answer: Callable[[Any], messages.ServerMessage] | None = None,
        *,
        urgent: bool = False,
    ) -> None:
        """As every user, but no more than may be asked of this robot now."""
        looks = sum(one.answer is not None for one in self.pending.values())
        if answer is not None and looks >= MOST_LOOKS:
            raise LimitReached(f"{MOST_LOOKS} questions wait already", "wait for some answers first")
        if isinstance(message, messages.Line | messages.At):
            dialogue = self._checked(message, dialogue)
        if urgent:
            self._services.stops(self)
        super().ask(message, dialogue, outlet, answer, urgent=urgent)

    def _checked(self, message: messages.Line | messages.At, dialogue: Dialogue[Any]) -> Dialogue[Any]:
        """What moves the arm, or changes a program, is checked when its turn comes: the lease may be in other hands."""
        services = self._services
        match message:
            case messages.Line(text=text) | messages.At(act=Say(line=text)):
                return services.checked(dialogue, lambda: services.may_always(text))
            case messages.At(act=UserAct() as act):
                needs = CHANGING.get(type(act))
                always = needs is None or isinstance(act, StopJog | StopProgram)
                dialogue = dialogue if needs is None else self._permitted(needs, dialogue)
            case messages.At(act=act):
                always = isinstance(act, Undo) or ACTS[type(act)].role is Role.OBSERVER
        return services.checked(dialogue, lambda: always)

    def _permitted(self, needs: tuple[str, Role], dialogue: Dialogue[Any]) -> Dialogue[Any]:
        self.session.check_may(*needs)
        return (yield from dialogue)

    def submit(self, dialogue: Dialogue[Any], pending: Pending, *, urgent: bool = False) -> None:
        services = self._services
        services.begin(self, pending)
        ticket = self.put(dialogue, partial(services.hear, self, pending), urgent=urgent)
        self.pending[ticket] = pending

    def status(self) -> PromptStatus:
        return structs.replace(super().status(), driver=self._services.driving.lease.holder)

    # --- looking ---

    def _subscribe(self, message: messages.Subscribe, _outlet: Outlet) -> None:
        if self._listener is not None:
            self._services.broadcast.subscribe(self._listener, message)
        self.console = message.console
        self.tell(messages.Done(message.id, version=self.timeline.version))
        self._services.stirred()

    def _play(self, message: messages.Play, _outlet: Outlet) -> None:
        if self._listener is not None:
            self._services.broadcast.play(self._listener, message)
            self._services.stirred()

    def _resync(self, message: messages.Resync, _outlet: Outlet) -> None:
        if self._listener is not None:
            self._services.broadcast.resync(self._listener, full=message.full)
            self._services.stirred()

    def _window(self, message: messages.Window, _outlet: Outlet) -> None:
        stream = self._services.broadcast.stream
        part = stream.part(message.begin, message.end)  # at once: later it would be out of date
        self.say(messages.Shown(message.id, part.record, stream.number, part.snapshot.segments[0].start))

    def _who(self, message: messages.Who, _outlet: Outlet) -> None:
        robots, holders = self._services.present(self)
        self.say(messages.Present(message.id, robots, holders, self._services.driving.lease.holder))

    def _pong(self, message: messages.Ping, _outlet: Outlet) -> None:
        now = self._wall()
        self.say(messages.Pong(message.sent, now, now, self.now))

    # --- driving, and files ---

    def _drive(self, message: messages.Drive, _outlet: Outlet) -> None:
        if message.act is not messages.LeaseAct.GIVE:
            check_may("to drive", Role.DESIGNER, self.grant.role)
        driving = self._services.driving
        match message.act:
            case messages.LeaseAct.ACQUIRE:
                driving.acquire(self.name)
            case messages.LeaseAct.ASK:
                driving.ask(self.name)
            case messages.LeaseAct.GIVE:
                driving.give(self.name, self._known(message.to))
            case messages.LeaseAct.RELEASE:
                driving.give(self.name, "")
        self.tell(messages.Done(message.id, version=self.timeline.version))
        self._services.note(self, _deed(message), "done")

    def _drag(self, message: messages.Drag, _outlet: Outlet) -> None:
        """The newest wish counts: one that has come before the robot has taken the last one replaces it."""
        self._wishes.append(message)
        if self._pulling is None:
            self._pull()

    def _pull(self) -> None:
        self._pulling = Pending(0, self.send, answer=lambda _found: None)
        self.submit(self._services.checked(self._pulled(), lambda: False), self._pulling)

    def _pulled(self) -> Dialogue[None]:
        """In the robot's thread."""
        wish = self._wishes.pop()
        try:
            yield from self._services.drag_control.pull(wish.pose, wish.issued)
        except VrsError as error:
            if not self._drag_refused:
                yield refusal(error, "")
            self._drag_refused = True
        else:
            self._drag_refused = self._drag_refused and wish.pose is not None

    def _known(self, name: str) -> str:
        """Return the name if a user of the robot has it. Raises RequestRefused."""
        holders = self._services.present(self)[1]
        if name not in holders:
            raise RequestRefused(f"{name} does not hold this robot", f"there is {', '.join(holders)}")
        return name

    def _put_file(self, message: messages.Put, outlet: Outlet) -> None:
        check_may("to put a file", Role.SUPERVISOR, self.grant.role)
        folder, allowance = self._services.folder, self._services.allowance
        dialogue = beside(
            lambda: robot_folder.put(folder, message.name, message.data, allowance, replace=message.replace)
        )
        self.ask(message, dialogue, outlet)

    def _get(self, message: messages.Get, outlet: Outlet) -> None:
        check_may("to get a file", Role.SUPERVISOR, self.grant.role)
        folder = self._services.folder
        dialogue = beside(lambda: robot_folder.fetch(folder, message.name))
        self.ask(message, dialogue, outlet, partial(messages.Fetched, message.id, message.name))

    def _names(self, message: messages.Names, outlet: Outlet) -> None:
        folder = self._services.folder
        self.ask(message, beside(lambda: robot_folder.listed(folder)), outlet, partial(messages.Listed, message.id))

    def _nothing(self, _message: messages.ClientMessage, _outlet: Outlet) -> None:
        """The connection has seen to it."""

    # --- what the robot says ---

    def hear(self, pending: Pending, ticket: Ticket[Any], said: Reply | Question | None) -> None:
        if isinstance(said, Confirmation | Parting | Amendment) and not self._answers:
            what = f"{said.text} is asked, and this client answers no questions"
            ticket.throw(RequestRefused(what, "DISABLE INTERACTIVE asks none; hello says who answers"), said.id)
        else:
            super().hear(pending, ticket, said)

    def end(self, pending: Pending, ticket: Ticket[Any]) -> None:
        super().end(pending, ticket)
        if pending is self._pulling:
            self._pulling = None
            if self._wishes:
                self._pull()
        if what := _deed(pending.message):
            error = ticket.error(0.0)
            wrong = str(error) if error is not None else None if pending.wrong is None else _wrong(pending.wrong)
            self._services.note(self, what, "done" if wrong is None else f"refused: {wrong}")

    def types(self, ticket: Ticket[Any]) -> bool:
        """Whether a request helps a line that is typed, or its prompt. In any thread."""
        pending = self.pending.get(ticket)
        return pending is not None and (isinstance(pending.message, TYPING) or pending.answer == self._changed)

    def look(self) -> None:
        """Ask what stands around the prompt; it is told where that is something else than before."""
        self.submit(quietly(self.status), Pending(0, self.send, answer=self._changed))

    def _changed(self, status: PromptStatus) -> messages.ServerMessage | None:
        before, self._status = self._status, status
        return None if status == before else messages.Status(status)


def _nothing_found(message: messages.ClientMessage) -> messages.ServerMessage:
    """The answer to what was asked about a line that has changed since."""
    assert isinstance(message, TYPING)
    return messages.Completed(message.id) if isinstance(message, messages.Complete) else messages.Checked(message.id)


def check_short(text: str) -> None:
    """Raises LimitReached for a line that takes long to be read."""
    longest = max(map(len, text.splitlines()), default=0)
    if longest > MAX_LINE_CHARS:
        raise LimitReached(f"a line of {longest} characters, {MAX_LINE_CHARS} at most", "give it in parts")


def _deed(message: messages.ClientMessage | None) -> str:
    """What a message wants, for the audit; empty where that is none of its business."""
    match message:
        case messages.Line(text=text) | messages.At(act=Say(text)):
            return text
        case messages.At(act=act) if isinstance(act, Survey) or (
            isinstance(act, UserAct) and type(act) not in CHANGING
        ):
            return ""
        case messages.At(act=act):
            return f"({str(getattr(act, 'text', '')) or type(act).__name__.lower()})"
        case messages.Abort():
            return "(emergency stop)"
        case messages.Drive(act=act, to=to):
            return f"({act.value} the lease{f' to {to}' if to else ''})"
        case messages.Put(name=name, data=data):
            return f"(put {name}, {len(data)} bytes)"
        case messages.Get(name=name):
            return f"(get {name})"
    return ""


def _wrong(reply: Reply) -> str:
    """What an error is about, for the audit."""
    if isinstance(reply, DiagnosticsReport):
        return "; ".join(sentence(one.diagnostic.text, one.diagnostic.detail, "") for one in reply.items)
    return str(getattr(reply, "text", "")) or type(reply).__name__


_TAKEN: Mapping[type, Callable[[ClientSession, Any, Outlet], None]] = {
    messages.Subscribe: ClientSession._subscribe,
    messages.Play: ClientSession._play,
    messages.Resync: ClientSession._resync,
    messages.Window: ClientSession._window,
    messages.Who: ClientSession._who,
    messages.Ping: ClientSession._pong,
    messages.Drive: ClientSession._drive,
    messages.Drag: ClientSession._drag,
    messages.Put: ClientSession._put_file,
    messages.Get: ClientSession._get,
    messages.Names: ClientSession._names,
    messages.Bye: ClientSession._nothing,
}
