"""A robot in this process, held by one who drives it whenever something is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from math import inf
from pathlib import Path
from threading import Lock
from typing import TypeVar, cast

from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.engine import Event
from vrs_cli.engine.feed import Subscription
from vrs_cli.engine.position import position_at
from vrs_cli.errors import VrsError
from vrs_cli.files.trajectory_file import write_trajectory
from vrs_cli.interfaces.actor.ticket import Ticket
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.dialogue import Answers, Dialogue, Notes
from vrs_cli.interfaces.holders.holder import Holder
from vrs_cli.interfaces.port.port import Port
from vrs_cli.interfaces.port.preview import Previewed
from vrs_cli.interfaces.roles.designer import Designer
from vrs_cli.interfaces.roles.observer import Observer
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.station import Conditions
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import DeltaLog, Timeline
from vrs_cli.values.replies import Reply
from vrs_cli.values.results import Position
from vrs_cli.values.tagged import Act

PATIENCE = 0.005  # [s] between two looks whether another thread, which drives the robot, has done what was asked for
T = TypeVar("T")


class LocalRobot:
    """Any thread may call any method. Who waits for the end of something drives the robot meanwhile, unless another
    thread does already.
    """

    def __init__(self, session: Session, notes: Notes) -> None:
        self._session, self._notes = session, notes
        self._holder = Holder(session)
        self._holder.user_state = session.user_state
        self._driving = Lock()
        self._talking = Lock()  # what is typed has one place
        self._conditions: Conditions | None = None  # of all that is asked for here

    def under(self, conditions: Conditions) -> LocalRobot:
        """Return the same robot with these conditions for all its requests."""
        other = copy(self)
        other._conditions = conditions
        return other

    def _held_to(self, dialogue: Dialogue[T]) -> Dialogue[T]:
        return dialogue if self._conditions is None else self._session.under(self._conditions, dialogue)

    # --- reading ---

    @property
    def arm(self) -> RobotArm:
        return self._holder.arm

    @property
    def timeline(self) -> Timeline:
        return self._holder.timeline

    @property
    def now(self) -> float:
        return self._holder.now

    @property
    def rate(self) -> float | None:
        clock = self._session.engine.clock
        return clock.rate if isinstance(clock, WallClock) and not clock.paused else None

    @property
    def begins(self) -> float:
        return -inf

    def past(self, times: Sequence[float]) -> tuple[Position, ...]:
        return tuple(position_at(self.arm, self.timeline, t) for t in times)

    # --- asking ---

    def act(self, act: Act[T], answer: Answers | None = None, issued: float | None = None) -> T:
        dialogue = self._held_to(self._holder.user_state.given(issued, act_on(self._session, act)))
        if answer is None:
            return self._end(self._holder.submit(dialogue))
        with self._conversing(answer):
            return self._end(self._holder.submit(dialogue))

    def send(self, act: Act[T], issued: float | None = None) -> Callable[[], T]:
        """There is no way to it: it is done at once. What it refuses is raised by who waits."""
        try:
            found = self.act(act, issued=issued)
        except VrsError as error:
            refused = error
        else:
            return lambda: found

        def wait() -> T:
            raise refused.with_traceback(None)

        return wait

    def previewed(self) -> Previewed:
        return Previewed.of(self.timeline, self.now)

    def say(self, line: str, answer: Answers) -> tuple[Reply, ...]:
        with self._conversing(answer):
            self._end(self._holder.submit(self._held_to(self._session.answers(line)), urgent=self._holder.stops(line)))
            return self._notes.taken()

    def type(self, text: str, answer: Answers) -> tuple[Reply, ...]:
        with self._conversing(answer), self._driving:
            conversation = Conversation(self._session)
            conversation.take(text)
            conversation.perform(conversation.leave_entry("the text ends; "))
            return self._notes.taken()

    def abort(self) -> None:
        self._end(self._holder.call(Session.abort, urgent=True))

    def save(self, path: Path) -> None:
        def course(session: Session) -> tuple[Timeline, DeltaLog]:
            return session.engine.book.initial, session.engine.book.deltas.copy()

        write_trajectory(path, self.arm.model, *self._end(self._holder.call(course)))

    def subscribe(self) -> Subscription[Event]:
        return self._end(self._holder.subscribe())

    def close(self) -> None:
        self._session.close()

    # --- driving ---

    @contextmanager
    def _conversing(self, answer: Answers) -> Iterator[None]:
        with self._talking:
            self._notes.begin(answer)
            yield

    def _end(self, ticket: Ticket[T]) -> T:
        """Wait until a request is over; what comes of it. A refusal does not show how the robot works inside."""
        try:
            return self._drive(ticket)
        except VrsError as refusal:
            raise refusal.with_traceback(None) from None

    def _drive(self, ticket: Ticket[T]) -> T:
        """Let the robot do what is due, unless another thread does, until a request is over."""
        while not ticket.done():
            if self._driving.acquire(timeout=PATIENCE):
                try:
                    return self._session.actor.finish(ticket, self._notes)
                finally:
                    self._driving.release()
            self._hear(ticket)
        self._hear(ticket)
        return ticket.result()

    def _hear(self, ticket: Ticket[T]) -> None:
        """What was said while another thread drove."""
        for said in ticket.heard():
            self._session.actor.put(said, ticket, self._notes)


class LocalSupervisor(Supervisor):
    """A supervisor whose port is the robot itself."""

    def __init__(self, robot: LocalRobot) -> None:
        self.robot = self.followed = robot
        Observer.__init__(self, robot)
        Designer.__init__(self, self._perform)
        self._sent = None
        self.act, self.start, self.say, self.type = robot.act, robot.send, robot.say, robot.type  # type: ignore[method-assign]
        self.abort, self.save = robot.abort, robot.save  # type: ignore[method-assign]
        self.port = cast(Port, robot)
