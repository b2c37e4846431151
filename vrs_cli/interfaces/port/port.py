"""The port to a robot: through it one user sends requests, and receives replies, questions, and the end of each
request. There are two kinds: `interfaces/port/local.py` for a robot in this process, and `net/` for a robot at the
other end of a connection. Front ends and roles work with both. `Previewed` is the timeline as a user knows it,
including the effects of commands that are still being transmitted."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator
from contextlib import suppress
from math import inf
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct, structs

from vrs_cli.engine import engine, feed, position
from vrs_cli.errors import EndOfInput, RequestRefused, VrsError
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.text.ast import Program
from vrs_cli.trajectory.measured import MeasuredTimeline
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import hand, numbers, questions, replies
from vrs_cli.wire import messages

if TYPE_CHECKING:
    from vrs_cli.world.course import World

MakeRequest = Callable[[int], messages.Request]  # makes a request with the given id
Outlet = Callable[[messages.ServerMessage], None]


class Console:
    """The terminal of a session whose user communicates by messages: each reply becomes a message to the `outlets`.
    `attended`: a person is present. `progress` is called while a program runs or a file is read."""

    def __init__(self, attended: bool = False) -> None:
        self.attended = attended
        self.outlets: list[Outlet] = []
        self.progress: Callable[[Running | Reading], None] = lambda _doing: None

    def show(self, reply: replies.Reply) -> None:
        self._tell(messages.Told(reply))

    def type(self, text: str, newline: bool) -> None:
        self._tell(messages.Typed(text, newline))

    def ask(self, _question: questions.Question) -> questions.Answer:
        """Return no answer: the user receives questions as messages about a request."""
        return None

    def _tell(self, message: messages.ServerMessage) -> None:
        for outlet in self.outlets:
            outlet(message)


class FollowedRobot(position.Watched, Protocol):
    """A robot with a timeline that is kept up to date. `begins`: the timeline is known after this time [s]; `measured`:
    the reports of the robot's body (the real or simulated arm), also kept up to date."""

    @property
    def rate(self) -> float | None:
        """The seconds of the robot's time that pass per second of real time; None if the robot's clock does not follow
        real time."""

    @property
    def begins(self) -> float: ...
    @property
    def measured(self) -> MeasuredTimeline: ...


class Port(Protocol):
    """The connection of one user to a robot. Any thread may send; only the thread that waits for an answer calls
    `take`."""

    @property
    def name(self) -> str:
        """The user's name at the robot; "" for a robot in the same process."""

    @property
    def one_user(self) -> bool:
        """True if the robot has no other users."""

    @property
    def open(self) -> bool:
        """True if there is a connection now; always true for a robot in the same process."""

    @property
    def world(self) -> World | None:
        """The world of the cell around the robot (its parts and sensors); None if it is not known in this process."""

    @property
    def cuts(self) -> int:
        """The number of times the connection has been lost."""

    @property
    def stalls(self) -> int:
        """The number of times nothing has arrived for so long that the connection may have been lost."""

    def check_open(self) -> None:
        """Check that there is a connection now. Raises RequestRefused."""

    def begin(self, make: MakeRequest, outlet: Outlet) -> int:
        """Send the request that `make` returns for an id; return the id. The outlet receives the replies to the request
        and, as the last message, its end. Raises RequestRefused if there is no connection."""

    def take(
        self, inbox: feed.Inbox[messages.ServerMessage], seconds: float | None = None
    ) -> messages.ServerMessage | None:
        """Wait for the next message in an inbox, and return it; None if there is none after `seconds` [s]. The clock
        and the tasks of a robot in the same process advance in the meantime."""

    def tell(self, message: messages.ClientMessage) -> None:
        """Send a message that has no answer. Signal handlers may call this method."""

    def post(self, make: MakeRequest, outlet: Outlet) -> None:
        """Send a request without waiting, not even until it is sent. If there is no connection, the outlet receives
        `Refused`. Signal handlers may call this method."""

    def interrupt(self) -> bool:
        """Stop the request for which the user is waiting (Ctrl-C). Return whether the request will now end by itself.
        Signal handlers may call this method."""

    def give_up(self, error: BaseException) -> str:
        """Stop waiting for the requests already sent, because of an error in this process. Return a message for the
        user about these requests; "" if there is nothing to say."""

    def listen(self, outlet: Outlet) -> None:
        """Send all messages that do not answer a request to this outlet."""

    def follow(self) -> FollowedRobot:
        """Return the robot's timeline and clock, which are kept up to date from now on. Raises RequestRefused."""

    def subscribe(self) -> feed.Subscription[engine.TimelineChange]:
        """Subscribe to the timeline and all later changes of it. `follow` must have been called before."""

    def preview_now(self) -> Previewed:
        """Return the robot's future, including the effects of requests that are still being transmitted. `follow` must
        have been called before."""

    def status(self) -> questions.PromptStatus:
        """Return the state that a prompt shows, as far as it is known in this process."""

    def program(self, key: str) -> Program | None:
        """Return a program in the robot's memory by its key; None if there is none, or if the robot is in another
        process."""

    @property
    def on_screen(self) -> object:
        """The content that the open question shows on the full screen; None if the robot is in another process."""

    @property
    def due(self) -> float:
        """The real time until `take` has an event to carry out [s]; infinity if the robot does not depend on `take`."""

    def close(self) -> None:
        """Disconnect from the robot; no more requests are sent."""


def ends(message: messages.ServerMessage, id: int) -> bool:
    """Return whether a message is the end of the request with the given id."""
    return isinstance(message, messages.Done | messages.Refused | messages.Result) and message.id == id


def check_end(end: messages.ServerMessage) -> messages.ServerMessage:
    """Return the message that ends a request. Raises the error in it if the robot has refused the request."""
    if isinstance(end, messages.Done | messages.Refused) and end.refusal is not None:
        raise end.refusal.error()
    return end


def answer_to(asked: messages.Asked, ask: Callable[[questions.Question], questions.Answer]) -> messages.Answer:
    """Ask the user a question. Return the message with the answer, or a message that the input has ended or was
    interrupted."""
    try:
        return messages.Answer(asked.number, ask(asked.question))
    except EndOfInput:
        return messages.Answer(asked.number, how=messages.How.ENDED)
    except KeyboardInterrupt:
        return messages.Answer(asked.number, how=messages.How.INTERRUPTED)


FRESH = 3.0  # [s] a note about a wrong display stays visible for this time after the interval in which it was wrong


class Expected(Struct, frozen=True):
    """The expected effect of a command that is still being transmitted to the robot. `text`: the command as typed.
    `issued`: when it was issued, by the robot's clock [s]. `begin`: the time from which it changes the timeline [s];
    None: no change. `refused`: the error that the robot will answer, if any. `planned`: the shown timeline contains the
    change; otherwise anything after its arrival may change."""

    id: int
    text: str
    issued: float
    begin: float | None = None
    refused: VrsError | None = None
    planned: bool = True


class Previewed(Struct, frozen=True):
    """A timeline that includes the effects of all commands that are still being transmitted. All times are of the
    robot's clock [s].

    - `now`: the current time. `shown`: the time that a viewer sees; `predicts`: whether it differs from `now`.
    - `heard`: the time t_c of the latest message from the robot, which is D_b old (D_b: the delay from the robot): the
      timeline is certain up to t_c. `arrives`: when a command sent now would arrive at the robot. `round_trip`: D_f +
      D_b.
    - `unconfirmed`: the robot has not confirmed the timeline after this time (infinity: all is confirmed), because
      commands are being transmitted (`expected`, in the order of sending) or the connection is lost (`away`).
    - `flagged`: intervals, in order, in which a wrong state was shown because a command was not known yet."""

    timeline: Timeline
    now: float
    heard: float
    arrives: float
    shown: float
    predicts: bool = False
    unconfirmed: float = inf
    expected: tuple[Expected, ...] = ()
    away: bool = False
    round_trip: float = 0.0
    flagged: tuple[tuple[float, float], ...] = ()

    def lines(self, t: float) -> Iterator[str]:
        """Yield the notes that a viewer shows at time t [s]: how far ahead it predicts, the interval in which it showed
        a wrong state, and which commands the robot has not confirmed."""
        if self.predicts:
            ahead, round_trip = numbers.seconds(self.shown - self.heard), numbers.seconds(self.round_trip)
            yield f"{ahead} ahead of what is heard, D_f + D_b is {round_trip}"
        before = bisect_right(self.flagged, (t, inf))
        if before and t < self.flagged[before - 1][1] + FRESH:
            begin, end = self.flagged[before - 1]
            yield f"flagged: {begin:.3f} to {numbers.seconds(end)} was shown before a command changed it"
        if t >= self.unconfirmed:
            why = "the robot is not heard" if self.away else ", ".join(it.text or "a command" for it in self.expected)
            yield f"unconfirmed from {numbers.seconds(self.unconfirmed)} on: {why}"


Begin = Callable[[Callable[[int], messages.Request], Callable[[messages.ServerMessage], None]], object]


class FarHand:
    """The sender of JOG steps for a held key. It waits for the arm's answer to each step before the next step, so that
    no steps are pending when the key is released. `begin`: the method of a port; `seen`: the state of the arm before
    the first step."""

    def __init__(self, begin: Begin, joints: int, units: JointUnits, seen: hand.Seen) -> None:
        self.joints, self.units = joints, units
        self._begin, self._seen = begin, seen
        self._on_way: list[hand.Press | hand.StopJog | hand.Look] = []

    def do(self, act: hand.Press | hand.StopJog | hand.Look) -> hand.Seen:
        """Send the action of a key. Return the last known state of the arm."""
        if act in self._on_way:
            return self._seen

        def hear(end: messages.ServerMessage) -> None:
            with suppress(ValueError):  # `act` is a brake command, or was dropped when the connection was lost
                self._on_way.remove(act)
            if isinstance(end, messages.Done) and isinstance(end.found, hand.Seen):
                self._seen = end.found
            elif isinstance(end, messages.Done | messages.Refused) and end.refusal is not None:
                self._seen = structs.replace(self._seen, said=str(end.refusal.error()))

        if not isinstance(act, hand.StopJog):
            self._on_way.append(act)
        try:
            self._begin(lambda id: messages.At(id, act), hear)
        except RequestRefused as error:
            self._on_way.clear()
            self._seen = structs.replace(self._seen, said=str(error))
        return self._seen
