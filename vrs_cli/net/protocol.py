"""The two ends of a connection, without sockets: they take frames, and return messages and frames. Times are arguments.

    connection = ServerConnection(now)
    for message in connection.receive(frame, now):
        ...                                 # a Hello first; `welcome` or `close` answers it
    connection.send(Told(Message("hello")), now)
    for frame in connection.frames():
        ...                                 # to the socket
    connection.closing                      # if True, close the socket after its frames are sent

No received frame raises an exception.
"""

from __future__ import annotations

from enum import Enum
from math import inf

from msgspec.structs import replace

from vrs_cli.errors import RequestRefused
from vrs_cli.net import messages
from vrs_cli.net.delivery_log import DeliveryLog, Outbox, join_parts
from vrs_cli.net.limits import USUAL
from vrs_cli.wire.codec import Frame, Reader, UnknownType, encode, marks_of
from vrs_cli.wire.messages import Refusal
from vrs_cli.wire.records import RecordError

HELLO_SECONDS = 10.0  # maximum time until a client has sent its hello [s]
HELLO_BYTES = 32_000  # maximum bytes of a hello
CLIENT_BYTES = 2_000_000  # maximum bytes of one message of a client
SERVER_BYTES = 256_000_000  # maximum bytes of one message of a server (a snapshot)
BACKLOG = 4_000_000  # maximum bytes that wait for a socket
COMMAND_BACKLOG_FACTOR = 8  # factor on BACKLOG while a command runs, because programs TYPE fast
MAX_PENDING = 1000  # maximum number of a client's unanswered requests, and of unanswered questions to it

_from_client: Reader[messages.FromClient] = Reader(messages.FromClient)
_from_server: Reader[messages.FromServer] = Reader(messages.FromServer)


class ConnectionState(Enum):
    """The state of a connection: without a socket, before `hello`, before `welcome`, open, or closing."""

    CUT = "cut"
    HELLO = "hello"
    WELCOME = "welcome"
    OPEN = "open"
    CLOSING = "closing"


class ServerConnection:
    """The server's end of a connection. `hello`: the first message of the client. `delivery_log`: the messages of the
    client session, with which a later connection can resume it. `why`: the reason for closing.
    """

    def __init__(self, now: float, most: int = CLIENT_BYTES, backlog: int = BACKLOG) -> None:
        self.state = ConnectionState.HELLO
        self.hello: messages.Hello | None = None
        self.delivery_log: DeliveryLog | None = None
        self.version, self.why = 0, ""
        self._until, self._most = now + HELLO_SECONDS, most
        self._backlog, self._outbox = backlog, Outbox(backlog)

    # --- received frames ---

    def receive(self, frame: Frame, now: float) -> list[messages.ClientMessage]:
        """Read a frame; return the messages to carry out. A command is returned only once, even if the client sends it
        several times.
        """
        self.look(now)
        if self.state is ConnectionState.CLOSING:
            return []
        most = HELLO_BYTES if self.state is ConnectionState.HELLO else self._most
        if len(frame) > most:
            return self._refuse(f"a message of {len(frame)} bytes", f"at most {most}")
        try:
            message = _from_client.read(frame)
        except RecordError as error:
            marks = marks_of(frame)
            if self.delivery_log is None or marks is None:  # the other end is not a client of this protocol
                self._refuse(str(error), "see docs/protocol.md")
            else:  # the client may be of a later version
                self.delivery_log.tell(messages.Refused(_refusal(str(error)), marks.known_id), now)
            return []
        if self.delivery_log is not None and not isinstance(message, messages.Hello):
            return self._take_from_client(message, self.delivery_log, now)
        if (
            not isinstance(message, messages.Hello)
            or self.state is not ConnectionState.HELLO
            or isinstance(frame, bytes)
        ):
            return self._refuse("hello comes first, as JSON, and once; then the welcome of the server", "")
        if messages.VERSION not in message.versions:
            spoken = ", ".join(map(str, message.versions)) or "none"
            return self._refuse(
                f"the client speaks version {spoken}, this server {messages.VERSION}", "install the same vrs on both"
            )
        self.state, self.version, self.hello = ConnectionState.WELCOME, messages.VERSION, message
        return [message]

    def _take_from_client(
        self, message: messages.ClientMessage, delivery_log: DeliveryLog, now: float
    ) -> list[messages.ClientMessage]:
        match message:
            case messages.Command():
                return [message] if self._is_new(message, delivery_log, now) else []
            case messages.Answer(number, until=until):
                if (asked := delivery_log.questions.get(number)) is None:
                    return []  # the question was already withdrawn or answered
                if until is not None and now > until:
                    delivery_log.tell(asked, now)
                    return []
                delivery_log.tell(messages.Withdrawn(number), now)
            case messages.Bye():
                self.state = ConnectionState.CLOSING
        return [message]

    def _is_new(self, command: messages.Command, delivery_log: DeliveryLog, now: float) -> bool:
        """Return whether a command is new and is to be carried out. Answer a finished command from the delivery log; a
        running command is answered when it ends. Accept ABORT even if too many commands wait.
        """
        id = command.id
        outcome, done = delivery_log.outcome(id), delivery_log.ended.get(id)
        if outcome is messages.Outcome.UNSEEN:
            if delivery_log.begin(id, always=isinstance(command, messages.Abort)):
                self._outbox.most = COMMAND_BACKLOG_FACTOR * self._backlog
                return True
            delivery_log.tell(
                messages.Refused(_refusal(f"{delivery_log.bounds.waiting} commands wait already", "wait for some"), id),
                now,
            )
        elif outcome is messages.Outcome.FORGOTTEN:
            delivery_log.tell(
                messages.Refused(_refusal(f"command {id} was there before; its end is forgotten"), id), now
            )
        elif done is not None:
            delivery_log.tell(done, now)
        return False

    def look(self, now: float) -> None:
        """Close the connection if hello did not come in time, or if the user has a newer connection."""
        if self.state is ConnectionState.HELLO and now > self._until:
            self._refuse(f"no hello came within {HELLO_SECONDS:g} s", "")
        elif self.delivery_log is not None and self.delivery_log.put != self._outbox.put:
            self.close("the holder is at another connection now")

    # --- messages to the client ---

    def welcome(self, welcome: messages.Welcome, delivery_log: DeliveryLog, now: float) -> None:
        """Answer the hello: complete the caller's `welcome` with the state of the user's session. Then send the
        messages that the user has missed, the `done` of commands for which the client waits, and open questions.
        """
        assert self.hello is not None, "hello comes first"
        resume, encoding = self.hello.resume, self.hello.format
        known = resume is not None and resume.connection == delivery_log.key
        missed = delivery_log.since(resume.seq) if resume is not None and known else None
        ids = resume.unanswered if resume is not None else ()
        fates = tuple(
            messages.Fate(id, delivery_log.outcome(id) if known else messages.Outcome.FORGOTTEN) for id in ids
        )
        self.state, self.delivery_log, self._outbox.encoding = ConnectionState.OPEN, delivery_log, encoding
        delivery_log.attach(self._outbox.put, encoding)
        said = replace(welcome, version=self.version, connection=delivery_log.key, seq=delivery_log.seq)
        self._outbox.send(replace(said, resumed=missed is not None, fates=fates))
        for frame in missed or ():
            self._outbox.put(frame, counts=False)  # the delivery log limits these bytes
        for id in ids if missed is None else ():
            if (done := delivery_log.ended.get(id)) is not None:
                delivery_log.tell(done, now)
        for question in tuple(delivery_log.questions.values()):
            delivery_log.tell(question, now)

    def send(self, message: messages.ServerMessage, now: float) -> None:
        """Send a message. The delivery log keeps numbered messages, so that these arrive even if the connection is cut
        meanwhile."""
        if isinstance(message, messages.Numbered):
            assert self.delivery_log is not None, "welcome comes first"
            self.delivery_log.tell(message, now)
        elif self.state is ConnectionState.OPEN:
            self._outbox.send(message)

    def close(self, why: str, refusal: Refusal | None = None) -> None:
        """Send the client the reason why the connection closes, as the last message. The user may resume it."""
        if self.state is not ConnectionState.CLOSING:
            self.state, self.why = ConnectionState.CLOSING, why
            self._outbox.send(messages.Closing(why, refusal))

    def _refuse(self, detail: str, hint: str) -> list[messages.ClientMessage]:
        self.close(detail, _refusal(detail, hint))
        return []

    def cut(self, now: float) -> None:
        """Record that the socket is closed."""
        self.state = ConnectionState.CLOSING
        if self.delivery_log is not None and self.delivery_log.put == self._outbox.put:
            self.delivery_log.cut(now)

    @property
    def waiting(self) -> int:
        """Return the number of bytes that wait for the socket."""
        return self._outbox.size

    def frames(self, most: float = inf) -> list[Frame]:
        """Return the next frames for the socket, until they have `most` bytes or more."""
        if self._outbox.overflown and self.state is not ConnectionState.CLOSING:
            self.state, self.why = ConnectionState.CLOSING, f"the client has not taken {self._outbox.most} bytes"
        taken = self._outbox.take_frames(most)
        if self.delivery_log is not None and not self.delivery_log.waiting and self._outbox.size <= self._backlog:
            self._outbox.most = self._backlog
        return taken

    @property
    def closing(self) -> bool:
        return self.state is ConnectionState.CLOSING or self._outbox.overflown


class ClientConnection:
    """The client's end of a connection, which may use several sockets, one after another.

    Call `begin` when a socket is open and `cut` when it is closed; call `receive` and `frames` in between. Commands are
    not sent again after the connection was cut: a command that did not reach the robot ends with a refusal.
    """

    def __init__(self, hello: messages.Hello, most: int = SERVER_BYTES) -> None:
        self.hello, self.state, self.why = hello, ConnectionState.CUT, ""
        self.welcomed: messages.Welcome | None = None
        self._most, self._outbox = most, Outbox(BACKLOG)
        self._id = 0
        self._heard = 0  # `seq` of the last numbered message
        self._unanswered: dict[int, messages.Request] = {}
        self._questions: dict[int, bool] = {}  # whether each question was answered, by number
        self._reply_parts: list[messages.Told] = []  # the received parts of a long reply
        self.subscription: messages.Subscribe | None = None  # the last subscription
        self._change: int | None = None  # number of the last change; None while a snapshot is awaited

    # --- sockets ---

    def begin(self) -> None:
        """Say hello on a new socket."""
        self._outbox = Outbox(BACKLOG)
        resume = None
        if self.welcomed is not None:
            commands = (id for id, request in self._unanswered.items() if isinstance(request, messages.Command))
            resume = messages.Resume(self.welcomed.connection, self._heard, tuple(commands))
        self._outbox.send(replace(self.hello, resume=resume))
        self._outbox.encoding = self.hello.format
        self.state, self.why = ConnectionState.WELCOME, ""

    @property
    def waiting(self) -> int:
        """Return the number of bytes that wait for the socket."""
        return self._outbox.size

    def cut(self) -> None:
        """Record that the socket is closed."""
        self.state = ConnectionState.CUT

    def frames(self) -> list[Frame]:
        """Return the next frames for the socket."""
        return self._outbox.take_frames()

    @property
    def closing(self) -> bool:
        return self.state is ConnectionState.CLOSING or self._outbox.overflown

    # --- messages to the server ---

    def next_id(self) -> int:
        """Return the id for the next request."""
        self._id += 1
        return self._id

    def send(self, message: messages.ClientMessage) -> None:
        """Send a message. Raises RequestRefused if there is no connection, if the message is too long for a server, or
        if too many requests are unanswered (ABORT is sent nevertheless).
        """
        if isinstance(message, messages.Answer) and message.question in self._questions:
            self._questions[message.question] = True
        if self.state is not ConnectionState.OPEN:
            raise RequestRefused("there is no connection", "connect again")
        frame = encode(message, self._outbox.encoding)
        if len(frame) > USUAL.message:  # the server would cut the connection without giving a reason
            raise RequestRefused(f"{len(frame)} bytes at once, {USUAL.message} at most", "give it in parts")
        if isinstance(message, messages.Request):
            if len(self._unanswered) >= MAX_PENDING and not isinstance(message, messages.Abort):
                raise RequestRefused(f"{MAX_PENDING} requests wait already", "wait for some answers first")
            self._unanswered[message.id] = message
        if isinstance(message, messages.Subscribe):
            self.subscription, self._change = message, message.after
        self._outbox.put(frame)

    # --- received frames ---

    def receive(self, frame: Frame) -> list[messages.ServerMessage]:
        """Return the messages of a frame; omit repeated ones. The last message of a connection is `Closing`, also after
        an unreadable frame."""
        if self.state not in (ConnectionState.WELCOME, ConnectionState.OPEN):
            return []
        if len(frame) > self._most:
            return self._close(f"a message of {len(frame)} bytes; at most {self._most} are taken")
        try:
            message = _from_server.read(frame)
        except RecordError as error:
            return self._skip(frame, error)
        if isinstance(message, messages.Closing):
            self.state, self.why = ConnectionState.CLOSING, message.why
            return [message]
        if isinstance(message, messages.Welcome) is not (self.state is ConnectionState.WELCOME):
            return self._close("welcome comes first, and once")
        return self._begin_or_resume(message) if isinstance(message, messages.Welcome) else self._take(message)

    def _skip(self, frame: Frame, error: RecordError) -> list[messages.ServerMessage]:
        """Skip a message of a type that only later servers send. A numbered message is counted, and returned as
        `Refused`."""
        marks = marks_of(frame)
        if marks is None or self.state is not ConnectionState.OPEN or type(marks.seq) is not int:
            return [] if isinstance(error, UnknownType) else self._close(str(error))
        ended = marks.known_id if marks.type == "done" else None
        refusal = _refusal(f"what the robot says cannot be read here: {error}", "install the same vrs on both")
        return self._take(messages.Refused(refusal, ended, seq=marks.seq))

    def _close(self, why: str) -> list[messages.ServerMessage]:
        self.state, self.why = ConnectionState.CLOSING, why
        return [messages.Closing(why)]

    def _begin_or_resume(self, welcome: messages.Welcome) -> list[messages.ServerMessage]:
        """Begin or resume the connection. Return the welcome, and a `Done` for each command that the robot did not
        receive or has forgotten. Send requests that change nothing again.
        """
        if welcome.version not in self.hello.versions:
            return self._close(f"the server speaks version {welcome.version}")
        before, self.welcomed, self.state = self.welcomed, welcome, ConnectionState.OPEN
        if not welcome.resumed:
            self._heard = welcome.seq
            self._questions.clear()
            self._reply_parts.clear()
        if before is not None and before.life != welcome.life:
            self._change = None
        lost: list[messages.ServerMessage] = []
        unseen = _refusal("the connection was cut before it came to the robot: it was not done", "give it again")
        unknown = _refusal("nobody knows whether it was done", "look before you give it again: the server began anew")
        refusals = {messages.Outcome.UNSEEN: unseen, messages.Outcome.FORGOTTEN: unknown}
        for fate in welcome.fates:
            why = refusals.get(fate.outcome)
            if why is not None and isinstance(self._unanswered.get(fate.id), messages.Command):
                del self._unanswered[fate.id]
                lost.append(messages.Done(fate.id, ok=False, refusal=why))
        for request in tuple(self._unanswered.values()):
            if isinstance(request, messages.Subscribe):
                del self._unanswered[request.id]
            elif not isinstance(request, messages.Command):
                self._outbox.send(request)
        if self.subscription is not None:
            self._unanswered[self.subscription.id] = self.subscription
            self._outbox.send(replace(self.subscription, after=self._change))
        return [welcome, *lost]

    def _take(self, message: messages.ServerMessage) -> list[messages.ServerMessage]:
        if isinstance(message, messages.Numbered):
            if message.seq <= self._heard:
                return []
            if message.seq != self._heard + 1:
                return self._close(f"message {message.seq} came after {self._heard}")
            self._heard = message.seq
        if isinstance(message, messages.Change) and not self._fits(message):
            return []
        if isinstance(message, messages.Told) and (message.goes_on or self._reply_parts):
            self._reply_parts.append(message)
            if message.goes_on:
                return []
            message, self._reply_parts = join_parts(self._reply_parts), []
        match message:
            case messages.Done(id) | messages.Refused(id=int(id)) | messages.Result(id):
                self._unanswered.pop(id, None)
            case messages.Asked(number):
                if self._questions.get(number) is False:
                    return []  # the question is known, and its answer is still awaited
                self._questions[number] = False
                if len(self._questions) > MAX_PENDING:
                    del self._questions[next(iter(self._questions))]
            case messages.Withdrawn(number):
                self._questions.pop(number, None)
        return [message]

    def _fits(self, change: messages.Change) -> bool:
        """Return whether a change has the next number. If a change is missing, ask for a snapshot."""
        if isinstance(change, messages.Replaced) or change.number - 1 == self._change:
            self._change = change.number
            return True
        if self._change is not None and change.number > self._change:
            self._change = None
            self._outbox.send(messages.Resync())
        return False


def _refusal(detail: str, hint: str = "") -> Refusal:
    return Refusal.of(RequestRefused(detail, hint))
