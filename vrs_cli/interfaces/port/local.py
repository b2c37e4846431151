"""The port to a robot in the same process. A thread that waits for a message at this port advances the robot's clock
and tasks in the meantime."""

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
from vrs_cli.values import questions, results
from vrs_cli.values.measured import DivergenceAlarm, Report, alarm_text
from vrs_cli.wire.messages import ClientMessage, Line, Refusal, ServerMessage

if TYPE_CHECKING:
    from vrs_cli.world.course import World

T = TypeVar("T")
LOOK_AGAIN_S = 0.005  # [s] while another thread runs the robot, check at this interval whether a message has arrived


class KnownError(Refusal, frozen=True, kw_only=True):
    """A refusal by a robot in the same process; it contains the exception itself."""

    cause: BaseException

    def error(self) -> VrsError:
        """Return the VrsError. Any other exception is raised instead."""
        if isinstance(self.cause, VrsError):
            return self.cause
        raise self.cause


class _LocalUser(user_session.UserSession):
    """The user of a robot in the same process. The state that the prompt shows can be read at any time, so no message
    contains it."""

    tells_status, begins = False, -inf
    conditions: station.Conditions | None = None  # conditions under which all requests of this user are carried out

    @property
    def rate(self) -> float | None:
        """The seconds of the robot's time that pass per second of real time; None if the robot's clock does not follow
        real time."""
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
    """The port of a user to a robot in the same process. `typed` is called with each line before the line is carried
    out."""

    name, one_user, open, cuts, stalls = "", True, True, 0, 0

    def __init__(self, session: Session, console: port.Console) -> None:
        self.session, self.console = session, console
        self.user = _LocalUser(session, session.own_user_state)
        self.typed: Callable[[str], None] = lambda _text: None
        self._actor = session.actor
        self._ids = count(1)
        self._driving = Lock()
        session.body.listeners.append(self._warn)

    def under(self, conditions: station.Conditions) -> LocalPort:
        """Return a port to the same robot that carries out its requests under the given conditions."""
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
        """Return the next message in an inbox, and run the robot until there is one. If `seconds` is given, only carry
        out the events due now (which may take longer than that), and return None if there is still no message."""
        if seconds is not None and not inbox:
            self._do_what_is_due()
        while seconds is None and not inbox:
            if not self._driving.acquire(timeout=LOOK_AGAIN_S):
                continue  # another thread is running the robot: check the inbox again
            try:
                if inbox:
                    break  # another thread has delivered a message in the meantime
                goes_on = self._actor.lets_time_pass
                self._actor.step()
                if goes_on:
                    self.console.progress(Running(self.session.engine.now))
            except Exception as error:  # an error in a task for which no user waits; the task has been stopped
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
        """Carry out the next event of the robot. If there is none now, wait for one, or until `wake` is called."""
        with self._driving:
            try:
                self._actor.step()
            except Exception as error:
                self.console.show(internal_error(error))

    def wake(self) -> None:
        """Make `step` return if it is waiting. Any thread may call this method."""
        self._actor.wake()

    def give_up(self, error: BaseException) -> str:
        """Drop the requests that have not ended. Their outlets receive the error as the reason."""
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
        """Add reports of a body (the real or simulated arm) to the robot's record, and react to an alarm as configured.
        Raises IllegalValue."""
        with self._driving:
            self.session.body.take(reports)
        self._do_what_is_due()

    def _warn(self, news: body.BodyNews) -> None:
        if isinstance(news, DivergenceAlarm | results.Message):
            text = alarm_text(news) if isinstance(news, DivergenceAlarm) else news.text
            self.console.show(results.Message(text, results.Tone.WARNING))

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
        """The real time until the next event that `take` carries out [s]; infinity in virtual time."""
        clock = self.session.engine.clock
        return clock.until(self.session.driver.peek()) if isinstance(clock, WallClock) else inf

    def close(self) -> None:
        self.session.close()
