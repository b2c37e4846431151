"""The port to a robot in the same process. A thread that waits for a message meanwhile advances the robot's time and
tasks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from itertools import count
from math import inf
from threading import Lock
from typing import TYPE_CHECKING, TypeVar

from vrs_cli.engine import engine, feed
from vrs_cli.engine.clock import WallClock
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.dialogue import Dialogue, Running, Ticket, internal_error
from vrs_cli.interfaces.dialogue import Outlet as ActorOutlet
from vrs_cli.interfaces.port import port, user_session
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station import body, station
from vrs_cli.interfaces.tasks.driver import AskedInVain
from vrs_cli.language.text.ast import Program
from vrs_cli.trajectory.measured import MeasuredTimeline
from vrs_cli.values import questions, replies
from vrs_cli.values.measured import DivergenceAlarm, Report, alarm_text
from vrs_cli.wire.messages import ClientMessage, Line, Refusal, ServerMessage

if TYPE_CHECKING:
    from vrs_cli.world.course import World

T = TypeVar("T")
LOOK_AGAIN_S = 0.005  # [s] time between two checks whether the thread that runs the robot has finished the request


class KnownError(Refusal, frozen=True, kw_only=True):
    """An error of this process, kept as the exception itself."""

    cause: BaseException

    def error(self) -> VrsError:
        """Return the error. If it is not a VrsError, raise it."""
        if isinstance(self.cause, VrsError):
            return self.cause
        raise self.cause


class _LocalUser(user_session.UserSession):
    """The user of a robot in the same process. Its status can be read at any time."""

    tells_status, begins = False, -inf
    conditions: station.Conditions | None = None  # used for all requests of the user

    @property
    def rate(self) -> float | None:
        """Return how many seconds of robot time pass per second of real time; None if robot time does not follow real
        time."""
        clock = self.session.engine.clock
        return clock.rate if isinstance(clock, WallClock) and not clock.paused else None

    @property
    def measured(self) -> MeasuredTimeline:
        return self.session.engine.measured.view

    def put(self, dialogue: Dialogue[T], outlet: ActorOutlet | None = None, *, urgent: bool = False) -> Ticket[T]:
        if self.conditions is not None:
            dialogue = self.session.under(self.conditions, dialogue)
        return super().put(dialogue, outlet, urgent=urgent)

    def refusal(self, error: BaseException) -> Refusal:
        return KnownError(getattr(error, "code", 0), getattr(error, "title", ""), str(error), cause=error)


class LocalPort:
    """The port of a user of a robot in the same process. `typed` is called with each line before it is carried out."""

    name, one_user, open, cuts, stalls = "", True, True, 0, 0

    def __init__(self, session: Session, console: port.Console) -> None:
        self.session, self.console = session, console
        self.user = _LocalUser(session, session.own_user_state)
        self.typed: Callable[[str], None] = lambda _text: None
        self._actor = session.actor
        self._ids = count(1)
        self._driving = Lock()
        session.body.told.append(self._warn)

    def under(self, conditions: station.Conditions) -> LocalPort:
        """Return a port to the same robot whose requests are carried out under these conditions."""
        other = copy(self)
        other.user = copy(self.user)
        other.user.conditions = conditions
        return other

    def check_open(self) -> None:
        """Do nothing: a robot in the same process is always connected."""

    # --- messages ---

    def begin(self, make: port.MakeRequest, outlet: port.Outlet) -> int:
        request = make(next(self._ids))
        if isinstance(request, Line):
            self.typed(request.text)
        self.user.take(request, outlet)
        return request.id

    def post(self, make: port.MakeRequest, outlet: port.Outlet) -> None:
        self.begin(make, outlet)

    def tell(self, message: ClientMessage) -> None:
        self.user.take(message, lambda _answer: None)

    def interrupt(self) -> bool:
        return self.session.interrupt(self.user.user_state)

    def listen(self, outlet: port.Outlet) -> None:
        self.console.outlets.append(outlet)

    def take(self, inbox: feed.Inbox[ServerMessage], seconds: float | None = None) -> ServerMessage | None:
        """Return the next message. With `seconds`, carry out only the events that are due now, even if these take
        longer than `seconds`."""
        if seconds is not None and not inbox:
            self._do_what_is_due()
        while seconds is None and not inbox:
            if not self._driving.acquire(timeout=LOOK_AGAIN_S):
                continue  # another thread runs the robot
            try:
                if inbox:
                    break  # that thread has meanwhile delivered a message
                goes_on = self._actor.lets_time_pass
                self._actor.step()
                if goes_on:
                    self.console.progress(Running(self.session.engine.now))
            except Exception as error:  # an error in a task that nobody waits for; it has ended the task
                self.console.show(internal_error(error))
            finally:
                self._driving.release()
        return inbox.take(0.0)

    def _do_what_is_due(self) -> None:
        while self._actor.has_requests:
            self.step()
        self.session.settle()
        if self.session.driver.has_withdrawn:
            for question, ticket in self.user.asked_by_programs:
                ticket.throw(AskedInVain(), question.id)
        while self._actor.has_requests:
            self.step()

    def step(self) -> None:
        """Carry out the next due event. If none is due, wait for one or until `wake` is called."""
        with self._driving:
            try:
                self._actor.step()
            except Exception as error:
                self.console.show(internal_error(error))

    def wake(self) -> None:
        """Make `step` return if it is waiting. May be called from any thread."""
        self._actor.wake()

    def give_up(self, error: BaseException) -> str:
        """Drop the unfinished requests. Their outlets receive the reason."""
        self.user.drop(error)
        return ""

    # --- reading ---

    @property
    def world(self) -> World | None:
        return self.session.driver.world

    def follow(self) -> _LocalUser:
        return self.user

    def subscribe(self) -> feed.Subscription[engine.TimelineChange]:
        with self._driving:
            return self.session.engine.events.subscribe()

    def report(self, reports: Sequence[Report]) -> None:
        """Add reports of a body to the robot's record, and react to an alarm as configured. Raises IllegalValue."""
        with self._driving:
            self.session.body.take(reports)
        self._do_what_is_due()

    def _warn(self, news: body.BodyNews) -> None:
        if isinstance(news, DivergenceAlarm | replies.Message):
            text = alarm_text(news) if isinstance(news, DivergenceAlarm) else news.text
            self.console.show(replies.Message(text, replies.Tone.WARNING))

    def preview_now(self) -> port.Previewed:
        now = self.user.now
        return port.Previewed(self.user.timeline, now, heard=now, arrives=now, shown=now)

    def status(self) -> questions.PromptStatus:
        return self.user.conversation.status()

    def program(self, key: str) -> Program | None:
        stored = self.session.programs.get(key)
        return None if stored is None else stored.program

    @property
    def on_screen(self) -> object:
        return self.user.user_state.on_screen

    @property
    def due(self) -> float:
        """Return the seconds until the next event for `take`; infinity in virtual time."""
        clock = self.session.engine.clock
        return clock.until(self.session.driver.peek()) if isinstance(clock, WallClock) else inf

    def close(self) -> None:
        self.session.close()
