"""The robot as the panels of a window have it: behind a connection of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from vrs_cli.net.messages import ClientMessage, Request, ServerMessage, Welcome
from vrs_cli.trajectory.timeline import Timeline

Outlet = Callable[[ServerMessage], None]


class Afar(Protocol):
    """Any thread may call any method. Nothing waits for the robot."""

    @property
    def welcome(self) -> Welcome: ...
    @property
    def open(self) -> bool:
        """Whether there is a connection now."""

    @property
    def timeline(self) -> Timeline: ...

    def begin(self, make: Callable[[int], Request], outlet: Outlet) -> int:
        """Send a request; all that comes of it goes to the outlet, its end last. Raises RequestRefused where there is
        no connection.
        """

    def look(self, make: Callable[[int], Request], outlet: Outlet) -> None:
        """The same of what is asked again anyway: not even its sending is waited for, and no connection, no answer."""

    def tell(self, message: ClientMessage) -> None:
        """What has no answer; lost where there is no connection."""

    def listen(self, outlet: Outlet) -> None:
        """Have all told that belongs to no request."""
