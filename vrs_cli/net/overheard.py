"""A connection that a page leads, as a client in Python hears it. The page holds the timeline, but cannot plan; so what
its commands will do is computed here, and told to it. Pure: frames of both directions are put in, the wall clock is an
argument.

    far = OverheardEnd(wall)
    far.begin(hello)                        # of the page, on each new socket to the robot
    far.hear_page(message)                  # each later message of the page
    if far.hear_robot(frame):
        ...                                 # the frame is for the page
    for frame in far.connection.frames():
        ...                                 # to the robot: pings, and requests for a snapshot
    preview = far.news_of_preview()         # what the page is to be told, if it is not what it was told last
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from msgspec import Struct, structs

from vrs_cli.interfaces.port.preview import Expected
from vrs_cli.net import messages
from vrs_cli.net.delivery_log import Outbox
from vrs_cli.net.far_end import Ahead, FarEnd
from vrs_cli.net.mirror import Mirror
from vrs_cli.net.preview import Preview
from vrs_cli.net.protocol import BACKLOG, ClientConnection, ConnectionState
from vrs_cli.wire.codec import Frame, Reader, encode
from vrs_cli.wire.messages import ClientMessage, ServerMessage
from vrs_cli.wire.records import DeltaRecord, Motions, Number, RecordError, delta_record

_from_server: Reader[messages.FromServer] = Reader(messages.FromServer)
LOST = (messages.Outcome.UNSEEN, messages.Outcome.FORGOTTEN)
PRESENT = Ahead.PRESENT.value
ROUND_TRIP_DIGITS = 3  # of seconds: a pong each two seconds is not news


class ExpectedRecord(Struct, frozen=True, omit_defaults=True):
    """The expected effect of the command `id`, `issued` at that time of the robot's clock [s]: it changes the timeline
    from `begin` on [s] (absent: it does not), or `refused` says why the robot will not do it. `planned` false: what it
    does is not known here, and all from `begin` on may change.
    """

    id: int
    text: str
    issued: float
    begin: float | None = None
    refused: str = ""
    planned: bool = True


class PreviewMessage(ServerMessage, frozen=True, tag="preview"):
    """What is expected of a robot behind a line with delays. The predicted timeline is that after change `number` and
    all `deltas`. `since_heard`: a tool is dragged, and nothing is confirmed but what has happened already. `flagged`:
    times of which something wrong was shown, in order [s]. `round_trip`: D_f + D_b in seconds of the robot. `ahead`:
    how far ahead of what is heard the robot is shown: `present`, `auto`, or a time [s]. `near`: the delays are too
    short to matter.
    """

    number: int
    deltas: tuple[DeltaRecord, ...] = ()
    expected: tuple[ExpectedRecord, ...] = ()
    since_heard: bool = False
    flagged: tuple[tuple[float, float], ...] = ()
    round_trip: float = 0.0
    ahead: str | float = PRESENT
    near: bool = False


class LookAhead(ClientMessage, frozen=True, tag="ahead"):
    """The user's choice of how far ahead the robot is shown, as in `preview`."""

    ahead: str | Number = PRESENT

    def value(self) -> float | Ahead | None:
        """None if it is no choice."""
        if isinstance(self.ahead, str):
            return next((one for one in Ahead if one.value == self.ahead), None)
        return self.ahead if self.ahead >= 0.0 else None


class OverheardConnection(ClientConnection):
    """The client's end of a connection whose requests somebody else sends. It reads what the robot says, and sends
    pings and requests for a snapshot only. `cell`: put around a robot whose server tells none. `passed`: the last frame
    as the page is to have it; None: it is the answer to such a ping. `surrounded`: the robot is in that cell.
    """

    def __init__(self, cell: dict[str, Any] | None = None) -> None:
        super().__init__(messages.Hello((messages.VERSION,)))
        self.passed: Frame | None = None
        self.cell, self.surrounded = cell, False
        self._pings = set[float]()  # when those without an answer were sent

    def begin_with(self, hello: messages.Hello) -> None:
        """Take the hello that somebody else says on a new socket."""
        self.hello, self.state, self.why = hello, ConnectionState.WELCOME, ""
        self._outbox = Outbox(BACKLOG)
        self._outbox.encoding = hello.format
        self._pings.clear()

    def send(self, message: ClientMessage) -> None:
        """Raises RequestRefused without a connection."""
        if isinstance(message, messages.Ping):
            self._pings.add(message.sent)
        super().send(message)

    def receive(self, frame: Frame) -> list[ServerMessage]:
        """Return the message of a frame; none if it cannot be read here. Pongs of others say nothing of clocks here."""
        self.passed = frame
        if self.state not in (ConnectionState.WELCOME, ConnectionState.OPEN):
            return []
        try:
            message = _from_server.read(frame)
        except RecordError:
            return []
        match message:
            case messages.Welcome() if self.state is ConnectionState.WELCOME:
                self.state = ConnectionState.OPEN
                self.surrounded = self.cell is not None and message.cell is None
                if self.surrounded:
                    message = structs.replace(message, cell=self.cell)
                    self.passed = encode(message, self.hello.format)
            case messages.Closing(why):
                self.state, self.why = ConnectionState.CLOSING, why
            case messages.Pong(sent):
                if sent not in self._pings:
                    return []
                self._pings.discard(sent)
                self.passed = None
            case _ if self.state is ConnectionState.WELCOME or isinstance(message, messages.Welcome):
                return []
        return [message]


class OverheardEnd(FarEnd):
    """The client's side of a robot that a page holds. `ahead`: at first. `cell`: as in OverheardConnection."""

    connection: OverheardConnection

    def __init__(
        self, wall: Callable[[], float], ahead: float | Ahead = Ahead.PRESENT, cell: dict[str, Any] | None = None
    ) -> None:
        connection = OverheardConnection(cell)
        super().__init__(connection.hello, wall, connection)
        self.ahead = ahead
        self._told: PreviewMessage | None = None

    def begin(self, hello: messages.Hello) -> None:
        """Hear the page's hello on a new socket."""
        self.connection.begin_with(hello)
        self._told = None

    def hear_page(self, message: ClientMessage) -> ClientMessage:
        """Hear a message of the page, and return what to send to the robot: it says when a motion or a wish for a
        dragged tool was issued.
        """
        match message:
            case messages.Request():
                message = self.dated(message)
                self.expect(message)
            case messages.Drag(issued=issued) if self.mirror is not None:
                message = structs.replace(message, issued=self.now if issued is None else issued)
                self.expect_drag(message)
        return message

    def hear_robot(self, frame: Frame) -> Frame | None:
        """Hear a frame of the robot; return it as the page is to have it, None if it is not for the page."""
        self.receive(frame)
        return self.connection.passed

    def learn(self, message: ServerMessage) -> None:
        """Take what a message says of the robot, and of commands whose ends the page will not hear."""
        if isinstance(message, messages.Welcome) and self.preview is not None:
            for fate in message.fates:
                if fate.outcome in LOST:
                    self.preview.refused(fate.id)
        super().learn(message)

    def news_of_preview(self) -> PreviewMessage | None:
        """Return what is expected now; None if that was told already, or nothing is known of the robot."""
        if self.mirror is None or self.preview is None or self.mirror.lost or self.refusal is not None:
            return None
        now = self._previewed(self.mirror, self.preview)
        if now == self._told:
            return None
        self._told = now
        return now

    def _previewed(self, mirror: Mirror, preview: Preview) -> PreviewMessage:
        plan, motions, dragged = preview.plan, Motions(), self._dragged
        follows = dragged is not None and dragged.begin is not None and dragged.begin <= self.heard
        expected = plan.expected if dragged is None or follows else (*plan.expected, dragged)
        return PreviewMessage(
            mirror.seq,
            tuple(delta_record(mirror.whole(delta), motions) for delta in plan.deltas),
            tuple(_expected_record(one) for one in expected),
            follows,
            self.flags.windows,
            round(self.round_trip, ROUND_TRIP_DIGITS),
            self.ahead if isinstance(self.ahead, float) else self.ahead.value,
            self.near,
        )


def _expected_record(one: Expected) -> ExpectedRecord:
    refused = "" if one.refused is None else str(one.refused)
    return ExpectedRecord(one.id, one.text, one.issued, one.begin, refused, one.planned)
