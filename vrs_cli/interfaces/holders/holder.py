"""One of many who hold a robot at once, each in a thread, or behind a connection, of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from vrs_cli.engine.engine import Event
from vrs_cli.engine.feed import MOST, Subscription
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.actor.ticket import Outlet, Ticket
from vrs_cli.interfaces.dialogue import Dialogue, quietly
from vrs_cli.interfaces.rights import STOPPING
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.user_state import UserState
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.language.text.ast import Instruction
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.word import Role
from vrs_cli.trajectory.timeline import Timeline

T = TypeVar("T")


class Holder:
    """Asks one session for things, in a role and with its own `user_state`. `name`: of the lease, where there is one.
    Any thread may call any method.
    """

    def __init__(self, session: Session, role: Role = Role.SUPERVISOR, name: str = "") -> None:
        self.user_state = UserState(name, role)
        self._session, self._actor = session, session.actor
        self._tickets: list[Ticket[Any]] = []

    # --- reading: nothing of it waits ---

    @property
    def arm(self) -> RobotArm:
        return self._session.engine.arm

    @property
    def timeline(self) -> Timeline:
        """All that has been and will be, as far as is known."""
        return self._session.branches.seen_by(self.user_state)[0]

    @property
    def now(self) -> float:
        """How far time has come [s]."""
        return self._session.branches.seen_by(self.user_state)[1]

    # --- asking ---

    def ask(self, line: str) -> Ticket[None]:
        """A line of VAL-II. ABORT overtakes all that waits, which is refused."""
        return self.submit(self._session.answers(line), urgent=self.stops(line))

    def call(self, act: Callable[[Session], T], *, urgent: bool = False) -> Ticket[T]:
        """Something to be done while nobody else changes anything."""
        return self.submit(quietly(lambda: act(self._session)), urgent=urgent)

    def submit(self, dialogue: Dialogue[T], *, urgent: bool = False, outlet: Outlet | None = None) -> Ticket[T]:
        """What a talk does."""
        ticket = self._actor.submit(
            self._session.at(self.user_state, dialogue), urgent=urgent, by=self.user_state, outlet=outlet
        )
        self._tickets = [one for one in self._tickets if not one.done()] + [ticket]
        return ticket

    def stop(self) -> Ticket[None]:
        """The emergency stop: brake, stop every task, refuse what waits."""
        return self.call(Session.stop, urgent=True)

    def subscribe(self, most: int = MOST) -> Ticket[Subscription[Event]]:
        """The timeline, and every change of it from then on."""
        return self.call(lambda session: session.engine.events.subscribe(most))

    def leave(self) -> None:
        """It holds the robot no longer: what it has asked for and is not done is left."""
        for ticket in self._tickets:
            ticket.withdraw()
        self._actor.call(lambda: self._session.leave(self.user_state))

    def stops(self, line: str) -> bool:
        """Whether a line overtakes all that waits."""
        if self.user_state.editor is not None or line.lstrip()[:2].upper() not in {word[:2] for word in STOPPING}:
            return False
        try:
            statement = parse_prompt(line, ())
            if not isinstance(statement, Instruction) or statement.word not in STOPPING:
                return False
            self._session.check_may_stop(self.user_state)
        except VrsError:
            return False
        return True
