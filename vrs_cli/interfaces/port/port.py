"""The port to a robot: one user sends requests, and hears replies, questions, and how each request ended.

There are two transports: `interfaces/port/local.py` in this process, and `net/` over a connection. Front ends and roles
stand on either.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import Inbox, Subscription
from vrs_cli.engine.position import Watched
from vrs_cli.errors import EndOfInput
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.interfaces.port.preview import Previewed
from vrs_cli.language.text.ast import Program
from vrs_cli.trajectory.measured import MeasuredTimeline
from vrs_cli.values.prompt import PromptStatus
from vrs_cli.values.questions import Answer as Answered
from vrs_cli.values.questions import Question
from vrs_cli.values.replies import Reply
from vrs_cli.wire.messages import (
    Answer,
    Asked,
    ClientMessage,
    Done,
    How,
    Refused,
    Request,
    Result,
    ServerMessage,
    Told,
    Typed,
)

if TYPE_CHECKING:
    from vrs_cli.world.course import World

MakeRequest = Callable[[int], Request]  # a request with that id
Outlet = Callable[[ServerMessage], None]


class Console:
    """The terminal of a session whose user speaks in messages. `attended`: a person is there. `progress` is called
    while a program runs or a file is read.
    """

    def __init__(self, attended: bool = False) -> None:
        self.attended = attended
        self.outlets: list[Outlet] = []
        self.progress: Callable[[Running | Reading], None] = lambda _doing: None

    def show(self, reply: Reply) -> None:
        self._tell(Told(reply))

    def type(self, text: str, newline: bool) -> None:
        self._tell(Typed(text, newline))

    def ask(self, _question: Question) -> Answered:
        """Nobody is asked here: a user is asked by the request that he sent."""
        return None

    def _tell(self, message: ServerMessage) -> None:
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
        """Return the cell around the robot, where it is known here."""

    @property
    def cuts(self) -> int:
        """Return how often the connection was cut."""

    @property
    def stalls(self) -> int:
        """Return how often the connection was quiet for so long that it may have been cut."""

    def check_open(self) -> None:
        """Raises RequestRefused if there is no connection now."""

    def begin(self, make: MakeRequest, outlet: Outlet) -> int:
        """Send a request and return its id. All that comes of it goes to the outlet, its end last. Raises
        RequestRefused where there is no connection.
        """

    def take(self, inbox: Inbox[ServerMessage], seconds: float | None = None) -> ServerMessage | None:
        """Wait for the next message of an inbox, and return it; None after so many seconds [s]. In this process the
        robot's time and tasks go on meanwhile.
        """

    def tell(self, message: ClientMessage) -> None:
        """Send what has no answer. Safe in a signal handler."""

    def post(self, make: MakeRequest, outlet: Outlet) -> None:
        """Send a request and wait for nothing, not even its sending. `Refused` goes to the outlet where there is no
        connection. Safe in a signal handler.
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
        """The timeline, which is followed, and every change of it from now on."""

    def previewed(self) -> Previewed:
        """Return what the robot will do, with the requests that are on their way to it. The timeline is followed."""

    def status(self) -> PromptStatus:
        """Return the state that a prompt shows now, as far as it is known here."""

    def program(self, key: str) -> Program | None:
        """A program in memory, where it is in this process."""

    @property
    def on_screen(self) -> object:
        """The object that the open question shows on the screen, where that is in this process."""

    @property
    def due(self) -> float:
        """Something happens in so many seconds that `take` lets happen; infinity where what happens comes by itself."""

    def close(self) -> None:
        """Leave the robot: nothing more is asked of it."""


def ends(message: ServerMessage, id: int) -> bool:
    """Return whether the message is the end of the request with this id."""
    return isinstance(message, Done | Refused | Result) and message.id == id


def checked(end: ServerMessage) -> ServerMessage:
    """Return the end of a request. Raises what the robot refused."""
    if isinstance(end, Done | Refused) and end.refusal is not None:
        raise end.refusal.error()
    return end


def answer_to(asked: Asked, ask: Callable[[Question], Answered]) -> Answer:
    """Ask the user a question; return the answer, or that the user leaves it."""
    try:
        return Answer(asked.number, ask(asked.question))
    except EndOfInput:
        return Answer(asked.number, how=How.ENDED)
    except KeyboardInterrupt:
        return Answer(asked.number, how=How.INTERRUPTED)
