"""A user of a session in tests, who asks with lines and with functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import MAX_WAITING_EVENTS, Subscription
from vrs_cli.interfaces.dialogue import Dialogue, Outlet, Ticket, quietly
from vrs_cli.interfaces.port.user_session import UserSession
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.users import UserState
from vrs_cli.language.words.word import Role

T = TypeVar("T")


class Holder(UserSession):
    """`name`: of the lease, where there is one. Any thread may call any method."""

    def __init__(self, session: Session, role: Role = Role.SUPERVISOR, name: str = "") -> None:
        super().__init__(session, UserState(name, role))
        self._tickets: list[Ticket[Any]] = []

    def put(self, dialogue: Dialogue[T], outlet: Outlet | None = None, *, urgent: bool = False) -> Ticket[T]:
        ticket = super().put(dialogue, outlet, urgent=urgent)
        self._tickets = [one for one in self._tickets if not one.done()] + [ticket]
        return ticket

    def ask(self, line: str, outlet: Outlet | None = None) -> Ticket[None]:  # type: ignore[override]
        """Give a line of VAL-II. ABORT overtakes all requests that wait, and these are refused."""
        return self.put(self.session.answers(line), outlet, urgent=self.stops(line))

    def call(self, act: Callable[[Session], T], *, urgent: bool = False) -> Ticket[T]:
        """Call a function while nobody else changes anything."""
        return self.put(quietly(lambda: act(self.session)), urgent=urgent)

    def submit(self, dialogue: Dialogue[T], *, urgent: bool = False, outlet: Outlet | None = None) -> Ticket[T]:  # type: ignore[override]
        return self.put(dialogue, outlet, urgent=urgent)

    def stop(self) -> Ticket[None]:
        """The emergency stop: brake, stop every task, refuse what waits."""
        return self.call(Session.stop, urgent=True)

    def subscribe(self, most: int = MAX_WAITING_EVENTS) -> Ticket[Subscription[TimelineChange]]:
        return self.call(lambda session: session.engine.events.subscribe(most))

    def leave(self) -> None:
        for ticket in self._tickets:
            ticket.withdraw()
        super().leave()
