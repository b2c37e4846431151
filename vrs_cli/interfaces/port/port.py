"""The port to a robot: one user sends requests, and hears replies, questions, and how each request ended.

There are two transports: `interfaces/port/local.py` in this process, and `net/` over a connection. Front ends and roles
stand on either. `Previewed` is the timeline as a user knows it, with commands that are still on their way.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import Inbox, Subscription
from vrs_cli.engine.position import Watched
from vrs_cli.errors import EndOfInput
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.language.text.ast import Program
from vrs_cli.trajectory.measured import MeasuredTimeline
from vrs_cli.values.questions import Answer as Answered
from vrs_cli.values.questions import PromptStatus, Question
from vrs_cli.values.replies import Reply
from vrs_cli.wire import messages

if TYPE_CHECKING:
    from vrs_cli.world.course import World
from bisect import bisect_right
from collections.abc import Iterator
from contextlib import suppress
from math import inf

from msgspec import Struct

from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.hand import Look, Press, Seen, StopJog
from vrs_cli.values.numbers import seconds
from vrs_cli.wire.messages import At

MakeRequest = Callable[[int], messages.Request]  # a request with that id
Outlet = Callable[[messages.ServerMessage], None]


class Console:
    """The terminal of a session whose user speaks in messages. `attended`: a person is there. `progress` is called
    while a program runs or a file is read.
    """

    def __init__(self, attended: bool = False) -> None:
        self.attended = attended
        self.outlets: list[Outlet] = []
        self.progress: Callable[[Running | Reading], None] = lambda _doing: None

    def show(self, reply: Reply) -> None:
        self._tell(messages.Told(reply))

    def type(self, text: str, newline: bool) -> None:
        self._tell(messages.Typed(text, newline))

    def ask(self, _question: Question) -> Answered:
        """Ask nobody: a user is asked by the request that this user sent."""
        return None

    def _tell(self, message: messages.ServerMessage) -> None:
        for outlet in self.outlets:
            outlet(message)


class FollowedRobot(Watched, Protocol):
    """A robot whose timeline is known from `begins` on [s], and is kept up to date; so are the reports of its body,
    `measured`.
    """

    @property
    def rate(self) -> float | None:
        """Return how many seconds of the robot pass in one; None if its time does not pass by itself."""

    @property
    def begins(self) -> float: ...
    @property
    def measured(self) -> MeasuredTimeline: ...


class Port(Protocol):
    """A robot in the hands of one user. Any thread may send; `take` is for the thread that waits."""

    @property
    def name(self) -> str:
        """The user's name at the robot, empty for a robot of this process."""

    @property
    def one_user(self) -> bool:
        """Return whether nobody else uses the robot."""

    @property
    def open(self) -> bool:
        """Return whether there is a connection now; always so in this process."""

    @property
    def world(self) -> World | None:
        """Return the cell around the robot, if it is known here."""

    @property
    def cuts(self) -> int:
        """Return how often the connection was cut."""

    @property
    def stalls(self) -> int:
        """Return how often the connection was quiet for so long that it may have been cut."""

    def check_open(self) -> None:
        """Check that there is a connection now. Raises RequestRefused."""

    def begin(self, make: MakeRequest, outlet: Outlet) -> int:
        """Send a request and return its id. Its replies go to the outlet, its end last. Raises RequestRefused without a
        connection.
        """

    def take(self, inbox: Inbox[messages.ServerMessage], seconds: float | None = None) -> messages.ServerMessage | None:
        """Wait for the next message of an inbox, and return it; None after so many seconds [s]. In this process the
        robot's time and tasks go on meanwhile.
        """

    def tell(self, message: messages.ClientMessage) -> None:
        """Send a message that has no answer. Safe in a signal handler."""

    def post(self, make: MakeRequest, outlet: Outlet) -> None:
        """Send a request without waiting, not even for the sending. Without a connection `Refused` goes to the outlet.
        Safe in a signal handler.
        """

    def interrupt(self) -> bool:
        """Stop what is waited for (Ctrl-C); whether it comes to an end by itself. Safe in a signal handler."""

    def give_up(self, error: BaseException) -> str:
        """Wait no longer for what was sent, because of an error here; what the user is to be told of it."""

    def listen(self, outlet: Outlet) -> None:
        """Let an outlet hear all that belongs to no request."""

    def follow(self) -> FollowedRobot:
        """Return the robot's timeline and clock, kept up to date from now on. Raises RequestRefused."""

    def subscribe(self) -> Subscription[TimelineChange]:
        """Subscribe to the timeline, which is followed, and to every change of it from now on."""

    def preview_now(self) -> Previewed:
        """Return what the robot will do, with the requests that are on their way to it. The timeline is followed."""

    def status(self) -> PromptStatus:
        """Return the state that a prompt shows now, as far as it is known here."""

    def program(self, key: str) -> Program | None:
        """Return a program in memory, if the robot is in this process."""

    @property
    def on_screen(self) -> object:
        """The object that the open question shows on the screen, if the robot is in this process."""

    @property
    def due(self) -> float:
        """Something happens in so many seconds that `take` lets happen; infinity if what happens comes by itself."""

    def close(self) -> None:
        """Leave the robot: nothing more is asked of it."""


def ends(message: messages.ServerMessage, id: int) -> bool:
    """Return whether the message is the end of the request with this id."""
    return isinstance(message, messages.Done | messages.Refused | messages.Result) and message.id == id


def check_end(end: messages.ServerMessage) -> messages.ServerMessage:
    """Return the end of a request. Raises what the robot refused."""
    if isinstance(end, messages.Done | messages.Refused) and end.refusal is not None:
        raise end.refusal.error()
    return end


def answer_to(asked: messages.Asked, ask: Callable[[Question], Answered]) -> messages.Answer:
    """Ask the user a question; return the answer, or that the user leaves it."""
    try:
        return messages.Answer(asked.number, ask(asked.question))
    except EndOfInput:
        return messages.Answer(asked.number, how=messages.How.ENDED)
    except KeyboardInterrupt:
        return messages.Answer(asked.number, how=messages.How.INTERRUPTED)


FRESH = 3.0  # [s] that a flag is told of after the times that it is about


class Expected(Struct, frozen=True):
    """The expected effect of a command that is on its way, `issued` at that time of the robot's clock [s]. It changes
    the timeline from `begin` on [s] (None: it does not), or `refused` is the error that the robot will answer.
    `planned`: the change is shown already; else it may change everything from its arrival on. `text`: as it was typed.
    """

    id: int
    text: str
    issued: float
    begin: float | None = None
    refused: VrsError | None = None
    planned: bool = True


class Previewed(Struct, frozen=True):
    """A timeline with the effects of all commands that are on their way. `now`: the robot's clock; `heard`: the robot's
    clock t_c that was heard, D_b ago: up to it the timeline is certain; `arrives`: when a command of now arrives at the
    robot; `shown`: the time that a viewer is shown, `predicts` if that is not the present [s].

    From `unconfirmed` on [s] (infinity: nothing) the robot has not confirmed the timeline, because commands are on
    their way (`expected`, in the order of sending), or the connection is `away`. `round_trip`: D_f + D_b [s].
    `flagged`: stretches of time, in order, of which something wrong was shown before a command was known.
    """

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

    @classmethod
    def of(cls, timeline: Timeline, now: float) -> Previewed:
        """Preview a robot of this process: nothing is on its way."""
        return cls(timeline, now, now, now, now)

    @property
    def reported_time(self) -> float:
        """The time at which the robot stands in the picture [s]; in a prediction the time that was heard."""
        return self.heard if self.predicts else self.now

    def lines(self, t: float) -> Iterator[str]:
        """Yield the notes about time t [s]."""
        if self.predicts:
            yield f"{seconds(self.shown - self.heard)} ahead of what is heard, D_f + D_b is {seconds(self.round_trip)}"
        before = bisect_right(self.flagged, (t, inf))
        if before and t < self.flagged[before - 1][1] + FRESH:
            begin, end = self.flagged[before - 1]
            yield f"flagged: {begin:.3f} to {seconds(end)} was shown before a command changed it"
        if t >= self.unconfirmed:
            yield self.doubt

    @property
    def doubt(self) -> str:
        """The part that is not confirmed, and the reason; empty if all is confirmed."""
        return "" if self.unconfirmed == inf else f"unconfirmed from {seconds(self.unconfirmed)} on: {self._under_way}"

    @property
    def _under_way(self) -> str:
        return "the robot is not heard" if self.away else ", ".join(it.text or "a command" for it in self.expected)


Begin = Callable[[Callable[[int], messages.Request], Callable[[messages.ServerMessage], None]], object]


class FarHand:
    """Sends the steps of keys that are held down as fast as the arm answers, and no faster: after a key is released, no
    earlier step follows. `begin`: the method of a port; `seen`: the arm before the first step.
    """

    def __init__(self, begin: Begin, joints: int, units: JointUnits, seen: Seen) -> None:
        self.joints, self.units = joints, units
        self._begin, self._seen = begin, seen
        self._on_way: list[Press | StopJog | Look] = []

    def do(self, act: Press | StopJog | Look) -> Seen:
        """Send what a key says; return what was seen last."""
        if act not in self._on_way:
            self._send(act)
        return self._seen

    def _send(self, act: Press | StopJog | Look) -> None:
        def hear(end: messages.ServerMessage) -> None:
            with suppress(ValueError):  # a brake, or what was forgotten
                self._on_way.remove(act)
            if isinstance(end, messages.Done) and isinstance(end.found, Seen):
                self._seen = end.found
            elif isinstance(end, messages.Done | messages.Refused) and end.refusal is not None:
                self._say(end.refusal.error())

        if not isinstance(act, StopJog):
            self._on_way.append(act)
        try:
            self._begin(lambda id: At(id, act), hear)
        except RequestRefused as error:
            self._on_way.clear()
            self._say(error)

    def _say(self, error: VrsError) -> None:
        seen = self._seen
        self._seen = Seen(seen.position, seen.end, seen.paused, str(error))
