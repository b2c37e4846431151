"""The port to a robot: one user sends requests, and receives replies, questions, and the end of each request. There are
two transports: `interfaces/port/local.py` in this process, and `net/` over a connection. Front ends and roles work with
both. `Previewed` is the timeline as a user knows it, including commands that are still on their way."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator
from contextlib import suppress
from math import inf
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct

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

MakeRequest = Callable[[int], messages.Request]  # makes a request with this id
Outlet = Callable[[messages.ServerMessage], None]


class Console:
    """The terminal of a session whose user communicates by messages. `attended`: a person is present. `progress` is
    called while a program runs or a file is read."""

    def __init__(self, attended: bool = False) -> None:
        self.attended = attended
        self.outlets: list[Outlet] = []
        self.progress: Callable[[Running | Reading], None] = lambda _doing: None

    def show(self, reply: replies.Reply) -> None:
        self._tell(messages.Told(reply))

    def type(self, text: str, newline: bool) -> None:
        self._tell(messages.Typed(text, newline))

    def ask(self, _question: questions.Question) -> questions.Answer:
        """Return no answer, because questions reach the user through the request."""
        return None

    def _tell(self, message: messages.ServerMessage) -> None:
        for outlet in self.outlets:
            outlet(message)


class FollowedRobot(position.Watched, Protocol):
    """A robot whose timeline, known from the time `begins` [s], and whose body's reports, `measured`, are kept up to
    date."""

    @property
    def rate(self) -> float | None:
        """Return how many seconds of robot time pass per second of real time; None if robot time does not follow real
        time."""

    @property
    def begins(self) -> float: ...
    @property
    def measured(self) -> MeasuredTimeline: ...


class Port(Protocol):
    """The connection of one user to a robot. Any thread may send; only the waiting thread calls `take`."""

    @property
    def name(self) -> str:
        """The user's name at the robot; empty for a robot in the same process."""

    @property
    def one_user(self) -> bool:
        """Return whether the robot has only this user."""

    @property
    def open(self) -> bool:
        """Return whether there is a connection now; always true in the same process."""

    @property
    def world(self) -> World | None:
        """Return the cell around the robot, if it is known on this side."""

    @property
    def cuts(self) -> int:
        """Return how many times the connection was lost."""

    @property
    def stalls(self) -> int:
        """Return how many times the connection was silent for so long that it may have been cut."""

    def check_open(self) -> None:
        """Check that there is a connection now. Raises RequestRefused if not."""

    def begin(self, make: MakeRequest, outlet: Outlet) -> int:
        """Send a request and return its id. The outlet receives its replies and, last, its end. Raises RequestRefused
        without a connection."""

    def take(
        self, inbox: feed.Inbox[messages.ServerMessage], seconds: float | None = None
    ) -> messages.ServerMessage | None:
        """Wait for the next message in an inbox, and return it; None after `seconds` [s]. In the same process, the
        robot's time and tasks advance meanwhile."""

    def tell(self, message: messages.ClientMessage) -> None:
        """Send a message that has no answer. Safe to call in a signal handler."""

    def post(self, make: MakeRequest, outlet: Outlet) -> None:
        """Send a request without any waiting, even for the sending. Without a connection, the outlet receives
        `Refused`. Safe to call in a signal handler."""

    def interrupt(self) -> bool:
        """Stop the request for which the user waits (Ctrl-C). Return whether the request will end without further
        action. Safe to call in a signal handler."""

    def give_up(self, error: BaseException) -> str:
        """Stop waiting for sent requests because of an error on this side. Return a message about these requests for
        the user."""

    def listen(self, outlet: Outlet) -> None:
        """Send all messages that are not answers to requests to this outlet."""

    def follow(self) -> FollowedRobot:
        """Return the robot's timeline and clock, kept up to date afterwards. Raises RequestRefused."""

    def subscribe(self) -> feed.Subscription[engine.TimelineChange]:
        """Subscribe to the timeline and to all later changes of it. The timeline must be followed."""

    def preview_now(self) -> Previewed:
        """Return the robot's future, including the effects of requests that are on their way to it. The timeline must
        be followed."""

    def status(self) -> questions.PromptStatus:
        """Return the state that a prompt shows, as far as it is known on this side."""

    def program(self, key: str) -> Program | None:
        """Return a program in memory; only possible if the robot is in the same process."""

    @property
    def on_screen(self) -> object:
        """Return the object that the open question shows on the screen; only possible if the robot is in the same
        process."""

    @property
    def due(self) -> float:
        """Return the seconds until `take` has an event to carry out; infinity if events happen without `take`."""

    def close(self) -> None:
        """Disconnect from the robot: no more requests are sent."""


def ends(message: messages.ServerMessage, id: int) -> bool:
    """Return whether a message is the end of the request with this id."""
    return isinstance(message, messages.Done | messages.Refused | messages.Result) and message.id == id


def check_end(end: messages.ServerMessage) -> messages.ServerMessage:
    """Return the last message of a request. Raises the error if the robot has refused the request."""
    if isinstance(end, messages.Done | messages.Refused) and end.refusal is not None:
        raise end.refusal.error()
    return end


def answer_to(asked: messages.Asked, ask: Callable[[questions.Question], questions.Answer]) -> messages.Answer:
    """Ask the user a question. Return the answer, or the message that there is none."""
    try:
        return messages.Answer(asked.number, ask(asked.question))
    except EndOfInput:
        return messages.Answer(asked.number, how=messages.How.ENDED)
    except KeyboardInterrupt:
        return messages.Answer(asked.number, how=messages.How.INTERRUPTED)


FRESH = 3.0  # [s] how long a flag (a mark on a wrong display) is shown after its interval


class Expected(Struct, frozen=True):
    """The expected effect of a command that is on its way to the robot. `issued`: its time of issue on the robot's
    clock [s]. `begin`: the time from which it changes the timeline [s]; None: no change. `refused`: the error that the
    robot will answer, if any. `planned`: the change is already shown; otherwise anything after its arrival may change.
    `text`: the command as typed."""

    id: int
    text: str
    issued: float
    begin: float | None = None
    refused: VrsError | None = None
    planned: bool = True


class Previewed(Struct, frozen=True):
    """A timeline that includes the effects of all commands on their way. `now`: the robot's clock. `heard`: the latest
    known time t_c of the robot's clock, which is D_b old: the timeline is certain up to t_c. `arrives`: when a command
    sent now would arrive at the robot. `shown`: the time that a viewer sees [s]; `predicts`: whether that differs from
    `now`. `unconfirmed`: the time [s] after which the robot has not confirmed the timeline (infinity: all confirmed),
    because commands are on their way (`expected`, in the order of sending), or the connection is lost (`away`).
    `round_trip`: D_f + D_b [s]. `flagged`: time intervals, in order, in which a wrong state was shown, because a
    command was not known yet."""

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
        """Yield the notes that apply at t [s]."""
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
    """The sender of jog steps for held keys. It waits for the arm's answer to each step, so that no step is left over
    after a key is released. `begin`: the method of a port; `seen`: the state of the arm before the first step."""

    def __init__(self, begin: Begin, joints: int, units: JointUnits, seen: hand.Seen) -> None:
        self.joints, self.units = joints, units
        self._begin, self._seen = begin, seen
        self._on_way: list[hand.Press | hand.StopJog | hand.Look] = []

    def do(self, act: hand.Press | hand.StopJog | hand.Look) -> hand.Seen:
        """Send the action of a key, and return the last known state of the arm."""
        if act not in self._on_way:
            self._send(act)
        return self._seen

    def _send(self, act: hand.Press | hand.StopJog | hand.Look) -> None:
        def hear(end: messages.ServerMessage) -> None:
            with suppress(ValueError):  # a brake command, or a request that is no longer known
                self._on_way.remove(act)
            if isinstance(end, messages.Done) and isinstance(end.found, hand.Seen):
                self._seen = end.found
            elif isinstance(end, messages.Done | messages.Refused) and end.refusal is not None:
                self._say(end.refusal.error())

        if not isinstance(act, hand.StopJog):
            self._on_way.append(act)
        try:
            self._begin(lambda id: messages.At(id, act), hear)
        except RequestRefused as error:
            self._on_way.clear()
            self._say(error)

    def _say(self, error: VrsError) -> None:
        seen = self._seen
        self._seen = hand.Seen(seen.position, seen.end, seen.paused, str(error))
