"""The port to a robot in this process. While a thread waits for a message, it advances the robot's time and tasks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from itertools import count
from math import inf
from threading import Lock
from typing import TYPE_CHECKING, TypeVar

from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import Inbox, Subscription
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.dialogue import Dialogue, Running, Ticket, internal_error
from vrs_cli.interfaces.dialogue import Outlet as ActorOutlet
from vrs_cli.interfaces.port.port import Console, MakeRequest, Outlet, Previewed
from vrs_cli.interfaces.port.user_session import UserSession
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.body import BodyNews
from vrs_cli.interfaces.station.station import Conditions
from vrs_cli.interfaces.tasks.driver import AskedInVain
from vrs_cli.language.text.ast import Program
from vrs_cli.trajectory.measured import MeasuredTimeline
from vrs_cli.values import questions, replies
from vrs_cli.values.measured import DivergenceAlarm, Report, alarm_text
from vrs_cli.wire.messages import ClientMessage, Line, Refusal, ServerMessage

if TYPE_CHECKING:
    from vrs_cli.world.course import World

T = TypeVar("T")
LOOK_AGAIN_S = 0.005  # time between two checks whether another thread, which runs the robot, has done the request [s]


class KnownError(Refusal, frozen=True, kw_only=True):
    """An error of this process, kept as the exception itself."""

    cause: BaseException

    def error(self) -> VrsError:
        """Return the error. Raises it if it is not a VrsError."""
        if isinstance(self.cause, VrsError):
            return self.cause
        raise self.cause


class _LocalUser(UserSession):
    """The user of a robot of this process, whose status can be read at any time."""

    tells_status, begins = False, -inf
    conditions: Conditions | None = None  # for all requests of the user

    @property
    def rate(self) -> float | None:
        """Return how many seconds of robot time pass in one real second; None if robot time does not advance in real
        time.
        """
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
    """The port of the user of a robot in this process. `typed` is called with each line before it is carried out."""

    name, one_user, open, cuts, stalls = "", True, True, 0, 0

    def __init__(self, session: Session, console: Console) -> None:
        self.session, self.console = session, console
        self.user = _LocalUser(session, session.own_user_state)
        self.typed: Callable[[str], None] = lambda _text: None
        self._actor = session.actor
        self._ids = count(1)
        self._driving = Lock()
        session.body.told.append(self._warn)

    def under(self, conditions: Conditions) -> LocalPort:
        """Return a port to the same robot, whose requests are carried out under these conditions."""
        other = copy(self)
        other.user = copy(self.user)
        other.user.conditions = conditions
        return other

    def check_open(self) -> None:
        """Do nothing: a robot in this process is always connected."""

    # --- messages ---

    def begin(self, make: MakeRequest, outlet: Outlet) -> int:
        request = make(next(self._ids))
        if isinstance(request, Line):
            self.typed(request.text)
        self.user.take(request, outlet)
        return request.id

    def post(self, make: MakeRequest, outlet: Outlet) -> None:
        self.begin(make, outlet)

    def tell(self, message: ClientMessage) -> None:
        self.user.take(message, lambda _answer: None)

    def interrupt(self) -> bool:
        return self.session.interrupt(self.user.user_state)

    def listen(self, outlet: Outlet) -> None:
        self.console.outlets.append(outlet)

    def take(self, inbox: Inbox[ServerMessage], seconds: float | None = None) -> ServerMessage | None:
        """Take a message. With `seconds`, carry out only what is due now, even if that takes longer than `seconds`."""
        if seconds is not None and not inbox:
            self._do_what_is_due()
        while seconds is None and not inbox:
            if not self._driving.acquire(timeout=LOOK_AGAIN_S):
                continue  # another thread drives the robot
            try:
                if inbox:
                    break  # that thread has filled the inbox meanwhile
                goes_on = self._actor.lets_time_pass
                self._actor.step()
                if goes_on:
                    self.console.progress(Running(self.session.engine.now))
            except Exception as error:  # an error in a task that nobody waits for; the error has ended the task
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
        """Carry out the next due event; if none is due, wait for one, or until `wake` is called."""
        with self._driving:
            try:
                self._actor.step()
            except Exception as error:
                self.console.show(internal_error(error))

    def wake(self) -> None:
        """End a wait of `step`. May be called from any thread."""
        self._actor.wake()

    def give_up(self, error: BaseException) -> str:
        """Drop the requests that have not ended; their outlets receive the reason."""
        self.user.drop(error)
        return ""

    # --- reading ---

    @property
    def world(self) -> World | None:
        return self.session.driver.world

    def follow(self) -> _LocalUser:
        return self.user

    def subscribe(self) -> Subscription[TimelineChange]:
        with self._driving:
            return self.session.engine.events.subscribe()

    def report(self, reports: Sequence[Report]) -> None:
        """Add reports of a body to the robot's record, and react to an alarm as configured. Raises IllegalValue."""
        with self._driving:
            self.session.body.take(reports)
        self._do_what_is_due()

    def _warn(self, news: BodyNews) -> None:
        if isinstance(news, DivergenceAlarm | replies.Message):
            text = alarm_text(news) if isinstance(news, DivergenceAlarm) else news.text
            self.console.show(replies.Message(text, replies.Tone.WARNING))

    def preview_now(self) -> Previewed:
        return Previewed.of(self.user.timeline, self.user.now)

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
        """Return in how many seconds `take` has an event to carry out; infinity in virtual time."""
        clock = self.session.engine.clock
        return clock.until(self.session.driver.peek()) if isinstance(clock, WallClock) else inf

    def close(self) -> None:
        self.session.close()
