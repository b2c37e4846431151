"""Represent one user of a served robot, over all successive connections of this user.

A client session turns messages of the client into requests to the robot, and the robot's answers into messages, in the
order of the answers. Its methods never wait.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, Protocol

from msgspec import structs

from vrs_cli.errors import LimitReached, RequestRefused, RoleWanted, VrsError, sentence
from vrs_cli.interfaces.dialogue import Dialogue, Ticket, beside, quietly
from vrs_cli.interfaces.monitor.explaining import Drawable, sketch
from vrs_cli.interfaces.port.port import Outlet
from vrs_cli.interfaces.port.user_session import Pending, UserSession
from vrs_cli.interfaces.session.acts import ACTS, TARGETS
from vrs_cli.interfaces.targets import TargetControl
from vrs_cli.interfaces.users import USUAL_ALLOWED, HolderTimes, UserState, check_may
from vrs_cli.language.text.parser import MAX_LINE_CHARS
from vrs_cli.language.words.word import Role
from vrs_cli.net import messages
from vrs_cli.net.broadcast import Listener, Sink
from vrs_cli.net.delivery_log import DeliveryLog, is_long, may_hold, parts_of, without
from vrs_cli.net.limits import SendPace, Share
from vrs_cli.net.protocol import ServerConnection
from vrs_cli.net.served_robot import ServedRobot
from vrs_cli.net.stream import MessageForm
from vrs_cli.net.tokens import Grant
from vrs_cli.values.acts import KeepDraft, Say, StopProgram, Survey, Undo
from vrs_cli.values.hand import Press, StopJog
from vrs_cli.values.questions import Amendment, Confirmation, Parting, PromptStatus, Question
from vrs_cli.values.replies import DiagnosticsReport, Reply, refusal
from vrs_cli.values.results import Message, Tone, UserAct
from vrs_cli.wire.codec import Encoding

TYPING = messages.Complete | messages.Check  # requests that a client sends while its user types
AT_ONCE = messages.Interrupt | messages.Ping | messages.Bye  # messages that are never delayed to share CPU time
CHANGING = (KeepDraft, StopProgram, Press, StopJog)  # types of acts that move or change something
MAX_PENDING_QUESTIONS = 200  # maximum number of requests for data that one user may have pending


class ClientSocket(Protocol):
    """A socket for a client session. Its methods never wait and never raise."""

    connection: ServerConnection
    address: str
    deflates: bool

    @property
    def sink(self) -> Sink:
        """Return the receiver of broadcast messages."""

    def flush(self) -> None:
        """Send the waiting frames of the connection; close the socket if the connection is closing."""

    def ping(self) -> None:
        """Ping the client; its answer calls `ClientSession.beat`."""


class ClientSession(UserSession):
    """A user of a served robot. `users`: all users of the robot; `name` is unique among them. `robot`: the name of the
    robot. `link`: the user's socket; None while the connection is cut."""

    def __init__(
        self,
        robot: ServedRobot,
        users: Mapping[str, ClientSession],
        name: str,
        grant: Grant,
        delivery_log: DeliveryLog,
        hello: messages.Hello,
    ) -> None:
        self.name, self.robot, self.grant, self.delivery_log = name, robot.name, grant, delivery_log
        self.wanted_name = hello.name
        user_state = UserState(name, grant.role)
        super().__init__(robot.session, user_state)
        user_state.attended, self._answers = hello.attended, hello.attended or hello.answers
        user_state.lives = hello.attended and robot.session.engine.realtime
        user_state.times = HolderTimes(
            hello.offset, USUAL_ALLOWED if hello.delay is None else min(hello.delay, USUAL_ALLOWED)
        )
        self.link: ClientSocket | None = None
        self.pace = SendPace()
        self._share = Share(robot.allowance, robot.lookers, robot.wall())
        self._parked: deque[tuple[messages.ClientMessage, int]] = deque()  # delayed messages, and their bytes
        self.parked_bytes = 0
        self.address = ""
        self.console = False
        self.heard_at = robot.wall()
        self._robot, self._users, self._wall = robot, users, robot.wall
        self._listener: Listener | None = None
        self._drag_targets: deque[messages.Drag] = deque(maxlen=1000)  # targets that the robot has not taken yet
        self._pulling: Pending | None = None  # the pending request in which the robot takes this target
        self._to_tell: deque[Iterator[messages.Numbered]] = deque()  # a long reply in parts, then the later messages
        self._status: PromptStatus | None = None  # the status that was last sent
        self._columns: int | None = None  # width of the client's screen, for rendered replies

    # --- connections ---

    def attach(self, link: ClientSocket, hello: messages.Hello) -> None:
        """Give the client a new socket, and drop the old socket."""
        self.detach()
        self.link, self.address = link, link.address
        form = MessageForm(text=hello.format is Encoding.JSON, full=hello.full)
        self._listener = self._robot.broadcast.join(link.sink, form, deflates=link.deflates)
        self._status, self._columns = None, hello.rendered
        self.beat()

    def detach(self) -> None:
        """Drop the closed socket; the client may connect again with another one."""
        listener, self._listener, self.link = self._listener, None, None
        if self.user_state.streams:
            self.session.actor.call(lambda: TargetControl(self.session).lose(self.user_state))
        self.pace.waiting = 0
        if listener is not None:
            self._robot.broadcast.leave(listener)

    def beat(self) -> None:
        """Record that a message of the client has arrived."""
        self.heard_at = self._wall()
        self._robot.driving.beat(self.name)

    def flush(self) -> None:
        """Send the waiting messages to the user."""
        if self.link is not None:
            self.link.flush()

    def tell(self, message: messages.Numbered) -> None:
        """Send a message that must arrive exactly once: now, after a long reply that is being sent, or after the client
        has reconnected."""
        self._robot.touched[self.flush] = None
        prefixes, long = self._robot.prefixes, isinstance(message, messages.Told) and is_long(message.reply)
        if long or may_hold(prefixes, message):
            message = without(prefixes, message)
        if isinstance(message, messages.Told):
            lines = () if self._columns is None else self._robot.plan.styled(message.reply, self._columns)
            if long:
                self._to_tell.append(parts_of(message, lines))
                return
            drawn = sketch(message.reply) if self._columns is not None and isinstance(message.reply, Drawable) else None
            message = structs.replace(message, lines=tuple(lines), sketch=drawn)
        if self._to_tell:
            self._to_tell.append(iter((message,)))
        else:
            self.delivery_log.tell(message, self._wall())

    @property
    def has_more(self) -> bool:
        """Return whether a long reply is being sent."""
        return bool(self._to_tell)

    def tell_more(self) -> None:
        """Send the next part of a long reply; after the last part, send all messages that waited for its end."""
        while self._to_tell:
            if (message := next(self._to_tell[0], None)) is not None:
                self.delivery_log.tell(message, self._wall())
                if isinstance(message, messages.Told) and message.goes_on:
                    return
            else:
                self._to_tell.popleft()
        self.session.actor.let_go_on(self.user_state)

    def say(self, message: messages.ServerMessage) -> None:
        """Send a message if the client is connected; otherwise drop it."""
        self._robot.touched[self.flush] = None
        if self.link is not None:
            self.link.connection.send(message, self._wall())

    def send(self, message: messages.ServerMessage) -> None:
        """Send a message; a numbered message arrives even if the connection is cut meanwhile."""
        self.tell(message) if isinstance(message, messages.Numbered) else self.say(message)

    def leave(self) -> None:
        self.detach()
        super().leave()

    # --- messages of the client ---

    def receive(self, message: messages.ClientMessage, *, waited: bool = False) -> None:
        """Carry out a message, or send the client the reason for a refusal. A command that arrives after its `until` is
        refused, because its user no longer expects an effect, unless it stops the robot. `waited`: the message arrived
        in time and was delayed here."""
        self.beat()
        try:
            until = message.until if isinstance(message, messages.Command) and not waited else None
            if until is not None and (late := self._wall() - until) > 0.0 and not self.is_stop(message):
                what = f"it was held up on the way, and arrived {late:.1f} s too late: it was not done"
                raise RequestRefused(what, "give it again")
            self.carry_out(message, self.send)
        except Exception as error:
            if what := _audit_text(message):
                self.note(what, f"refused: {error}")
            self.refuse(message, error, self.send)

    def carry_out(self, message: messages.ClientMessage, outlet: Outlet) -> None:
        match message:
            case (
                messages.Line(text=text)
                | messages.At(act=Say(line=text))
                | messages.Complete(text=text)
                | messages.Check(text=text)
            ):
                check_short(text)
        match message:
            case messages.Subscribe() | messages.Play() | messages.Resync():
                self._watch(message)
            case messages.Window(id, begin, end):
                stream = self._robot.broadcast.stream
                # encode the part now, because a later change would make it outdated
                part = stream.part(begin, end, None if self._listener is None else self._listener.form.joints)
                self.say(messages.Shown(id, part, stream.number, part.segments[0].start))
            case messages.Who(id):
                driver = self._robot.driving.lease.holder
                self.say(messages.Present(id, self._robot.robots(self.grant), tuple(self._users), driver))
            case messages.Screen(columns):
                self._columns = columns
            case messages.Ping(sent):
                now = self._wall()
                self.say(messages.Pong(sent, now, now, self.now))
            case messages.Drive():
                self._drive(message)
            case messages.Drag():
                self._drag(message)
            case messages.Put() | messages.Get() | messages.Names():
                self._use_folder(message, outlet)
            case messages.Embody() | messages.Measured() | messages.MeasuredWindow():
                self._use_body(message)
            case messages.Bye():
                pass  # the connection closes itself after this message
            case _ if isinstance(message, messages.OF_CLASS):
                raise RequestRefused("this server has no class", "vrs serve --class serves one")
            case _:
                super().carry_out(message, outlet)

    def is_stop(self, message: messages.ClientMessage) -> bool:
        """Return whether a message stops the robot."""
        match message:
            case messages.Abort() | messages.At(act=StopProgram() | StopJog()):
                return True
            case messages.Line(text=text) | messages.At(act=Say(line=text)):
                return self.stops(text)
        return False

    def wait(self, message: messages.ClientMessage) -> float:
        """Return how long a request must wait [s] so that its user does not slow down other users. The driver's
        requests never wait, and no request waits if no other user sends requests.
        """
        robot = self._robot
        if robot.driving.lease.holder in ("", self.name) or not robot.others_ask(self):
            return 0.0
        return self._share.wait(self._wall(), len(self._users), typing=isinstance(message, TYPING))

    def spend(self, seconds: float, *, typing: bool = False) -> None:
        """Charge the user CPU time [s]. Any thread may call this method."""
        if self._robot.driving.lease.holder != self.name:
            self._share.spend(seconds, self._wall(), typing=typing)

    def refuse(self, message: messages.ClientMessage, error: Exception, outlet: Outlet) -> None:
        drag = isinstance(message, messages.Drag) and message.pose is not None
        if drag or (isinstance(message, messages.At) and isinstance(message.act, Press)):
            self.put(quietly(lambda: TargetControl(self.session).refuse(str(error), drag=drag)))
        super().refuse(message, error, outlet)

    def park(self, message: messages.ClientMessage, size: int) -> bool:
        """Queue a request of `size` bytes if it has to wait; return whether it was queued. Of the queued completions,
        and of the queued checks, only the newest stays; the older requests get an empty answer."""
        reports = isinstance(message, messages.Measured) and self._robot.served_body.body.name == self.name
        if reports or isinstance(message, AT_ONCE) or self.is_stop(message) or not (self._parked or self.wait(message)):
            return False
        if isinstance(message, TYPING):
            for old, its in [one for one in self._parked if type(one[0]) is type(message)]:
                self._parked.remove((old, its))
                self.parked_bytes -= its
                assert isinstance(old, TYPING)
                empty = messages.Completed if isinstance(old, messages.Complete) else messages.Checked
                self.say(empty(old.id))
        self._parked.append((message, size))
        self.parked_bytes += size
        return True

    def unpark(self) -> float | None:
        """Carry out the queued requests that need not wait any longer. Return how long the next request must wait [s];
        None if none is left.
        """
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
        """Submit a request to the robot, within the limits of a served robot. Raises LimitReached."""
        looks = sum(one.answer is not None for one in self.pending.values())
        if answer is not None and looks >= MAX_PENDING_QUESTIONS:
            raise LimitReached(f"{MAX_PENDING_QUESTIONS} questions wait already", "wait for some answers first")
        if isinstance(message, messages.Line | messages.At):
            dialogue = self._check_turn(message, dialogue)
        if urgent and self._robot.works:
            stopped = messages.Told(Message(f"{self.name} stops the robot", Tone.WARNING))
            for other in [other for other in self._users.values() if other is not self]:
                other.tell(stopped)
                other.flush()
        super().ask(message, dialogue, outlet, answer, urgent=urgent)

    def _check_turn(self, message: messages.Line | messages.At, dialogue: Dialogue[Any]) -> Dialogue[Any]:
        """Return a dialogue that checks the user's rights when it starts, because the lease may change before."""
        robot = self._robot
        match message:
            case messages.Line(text=text) | messages.At(act=Say(line=text)):
                return robot.check_and_note(dialogue, lambda: robot.may_always(text))
            case messages.At(act=UserAct() as act):
                always = not isinstance(act, KeepDraft)
            case messages.At(act=act):
                always = isinstance(act, Undo | TARGETS) or ACTS[type(act)].role is Role.OBSERVER
        return robot.check_and_note(dialogue, lambda: always)

    def submit(self, dialogue: Dialogue[Any], pending: Pending, *, urgent: bool = False) -> None:
        if pending.id:
            self._robot.asked_at[self] = self._wall()
        self._robot.broadcast.hold()
        ticket = self.put(dialogue, partial(self._take_reply, pending), urgent=urgent)
        self.pending[ticket] = pending

    def status(self) -> PromptStatus:
        return structs.replace(super().status(), driver=self._robot.driving.lease.holder)

    # --- viewing ---

    def _watch(self, message: messages.Subscribe | messages.Play | messages.Resync) -> None:
        broadcast, listener = self._robot.broadcast, self._listener
        match message:
            case messages.Subscribe(id, console=console):
                if listener is not None:
                    broadcast.subscribe(listener, message)
                self.console = console
                self.tell(messages.Done(id, version=self.timeline.version))
            case messages.Play() if listener is not None:
                broadcast.play(listener, message)
            case messages.Resync(full) if listener is not None:
                broadcast.resync(listener, full=full)
        self._robot.wake()

    # --- lease, body, dragging and files ---

    def _drive(self, message: messages.Drive) -> None:
        if message.act is not messages.LeaseAct.GIVE:
            check_may("to drive", Role.DESIGNER, self.grant.role)
        driving, name = self._robot.driving, self.name
        match message.act:
            case messages.LeaseAct.ACQUIRE:
                driving.change(lambda lease, now: lease.acquire(name, now))
            case messages.LeaseAct.ASK:
                driving.change(lambda lease, now: lease.ask(name, now))
            case messages.LeaseAct.GIVE:
                if message.to not in self._users:
                    raise RequestRefused(f"{message.to} does not hold this robot", f"there is {', '.join(self._users)}")
                driving.change(lambda lease, now: lease.give(name, message.to, now))
            case messages.LeaseAct.RELEASE:
                driving.change(lambda lease, now: lease.give(name, "", now))
        self.tell(messages.Done(message.id, version=self.timeline.version))
        self.note(_audit_text(message), "done")

    def _use_body(self, message: messages.OF_BODY) -> None:
        """Carry out a message of a body, or a request for measured reports."""
        served = self._robot.served_body
        match message:
            case messages.MeasuredWindow():
                self.say(served.window(message))
            case messages.Measured():
                served.take(self.name, message)
            case messages.Embody():
                if not self.grant.body:
                    raise RoleWanted(
                        "to be the body needs a token of the role body", f"you are {self.grant.role.title_with_article}"
                    )
                before = self._users.get(served.body.name)
                own = self.grant, self.wanted_name
                if before is not None and before.link is None and (before.grant, before.wanted_name) == own:
                    served.body.leave(before.name)  # the client's process was restarted
                self.say(served.embody(self.name, message))
                self.note(_audit_text(message), "done")

    def note(self, what: str, result: str) -> None:
        """Write a line into the audit."""
        self._robot.audit.note(self._robot.name, self.name, self.address, what, result)

    def _drag(self, message: messages.Drag) -> None:
        """Give the robot a target for the dragged tool. If the robot has not taken the previous targets yet, only the
        releases of the tool and the newest target count."""
        self._drag_targets.append(message)
        self._pull()

    def _pull(self) -> None:
        if self._pulling is not None or not self._drag_targets:
            return
        self._pulling = Pending(0, self.send, answer=lambda _found: None)
        self.submit(self._robot.check_and_note(self._pull_tool(), lambda: True), self._pulling)

    def _pull_tool(self) -> Dialogue[None]:
        waiting = [self._drag_targets.popleft() for _ in range(len(self._drag_targets))]
        for target in [one for one in waiting if one.pose is None or one is waiting[-1]]:
            try:
                TargetControl(self.session).pull(target.pose, target.issued)
            except VrsError as error:  # it ends the stream: later targets are ignored
                if not isinstance(error, RequestRefused):
                    yield refusal(error, "")

    def _use_folder(self, message: messages.Put | messages.Get | messages.Names, outlet: Outlet) -> None:
        robot = self._robot
        match message:
            case messages.Put(name=name, data=data, replace=replace):
                check_may("to put a file", Role.SUPERVISOR, self.grant.role)
                self.ask(message, beside(lambda: robot.files.put(name, data, replace=replace)), outlet)
            case messages.Get(id, name):
                check_may("to get a file", Role.SUPERVISOR, self.grant.role)
                self.ask(message, beside(lambda: robot.files.fetch(name)), outlet, partial(messages.Fetched, id, name))
            case messages.Names(id):
                self.ask(message, beside(robot.files.list), outlet, partial(messages.Listed, id))

    # --- replies of the robot ---

    def _take_reply(self, pending: Pending, ticket: Ticket[Any], said: Reply | Question | None) -> None:
        """Take a reply or a question of a request, in the robot's thread; None: the request has ended. After a long
        reply, the user's next request begins when the connection has taken the whole reply.
        """
        if said is not None and not isinstance(said, Question) and is_long(said):
            self.session.actor.let_wait(self.user_state)
        self._robot.put(lambda: self.hear(pending, ticket, said))

    def hear(self, pending: Pending, ticket: Ticket[Any], said: Reply | Question | None) -> None:
        if isinstance(said, Confirmation | Parting | Amendment) and not self._answers:
            what = f"{said.text} is asked, and this client answers no questions"
            ticket.throw(RequestRefused(what, "DISABLE INTERACTIVE asks none; hello says who answers"), said.id)
        else:
            super().hear(pending, ticket, said)

    def end(self, pending: Pending, ticket: Ticket[Any]) -> None:
        super().end(pending, ticket)
        self._robot.broadcast.release()
        pulled = pending is self._pulling
        if pulled:
            self._pulling = None
            self._pull()
        if what := _audit_text(pending.message):
            error = ticket.error(0.0)
            wrong = str(error) if error is not None else None if pending.wrong is None else _wrong(pending.wrong)
            self.note(what, "done" if wrong is None else f"refused: {wrong}")
        if what or pulled:
            self._robot.ended()

    def types(self, ticket: Ticket[Any]) -> bool:
        """Return whether a request serves the typing of a line (completion, check, prompt status). Any thread may call
        this method."""
        pending = self.pending.get(ticket)
        return pending is not None and (isinstance(pending.message, TYPING) or pending.answer == self._status_if_new)

    def look(self) -> None:
        """Request the status of the prompt from the robot, and send it if it has changed."""
        self.submit(quietly(self.status), Pending(0, self.send, answer=self._status_if_new))

    def _status_if_new(self, status: PromptStatus) -> messages.ServerMessage | None:
        before, self._status = self._status, status
        return None if status == before else messages.Status(status)


def commands(client: ClientSession, message: messages.ClientMessage) -> bool:
    """Return whether a message moves or changes something; False for messages that stop a robot."""
    match message:
        case messages.Line() | messages.At(act=Say()):
            return not client.is_stop(message)
        case messages.At(act=UserAct() as act):
            return type(act) in CHANGING and not client.is_stop(message)
        case messages.At(act=act):
            return ACTS[type(act)].role is not Role.OBSERVER
        case messages.Drag(pose=pose):
            return pose is not None
    return isinstance(message, messages.Drive | messages.Put)


def check_short(text: str) -> None:
    """Check that no line is too long to parse quickly. Raises LimitReached."""
    longest = max(map(len, text.splitlines()), default=0)
    if longest > MAX_LINE_CHARS:
        raise LimitReached(f"a line of {longest} characters, {MAX_LINE_CHARS} at most", "give it in parts")


def _audit_text(message: messages.ClientMessage | None) -> str:
    """Describe a message for the audit; return "" if the audit does not list it."""
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
        case messages.Embody(held=held):
            return "(be the body)" if held else "(be the body no longer)"
        case messages.Put(name=name, data=data):
            return f"(put {name}, {len(data)} bytes)"
        case messages.Get(name=name):
            return f"(get {name})"
    return ""


def _wrong(reply: Reply) -> str:
    """Describe an error for the audit."""
    if isinstance(reply, DiagnosticsReport):
        return "; ".join(sentence(one.diagnostic.text, one.diagnostic.detail, "") for one in reply.items)
    return str(getattr(reply, "text", "")) or type(reply).__name__
