"""A connection whose loop has a thread of its own, for a seat."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces.roles.observer import Watched
from vrs_cli.net.client import Client
from vrs_cli.net.messages import Abort, ClientMessage, Refused, Request
from vrs_cli.net.remote import LEAVING, Loop
from vrs_cli.repl.remote_front_end import Outlet
from vrs_cli.wire.refusal import Refusal

PAST = 60.0  # [s] of the timeline that are there at first


class Connection:
    """Opens the client. Raises RequestRefused where no robot answers, and what that refuses."""

    def __init__(self, client: Client) -> None:
        self._client, self._loop, self._closed = client, Loop(), False
        self._followed: Watched | None = None
        try:
            self._welcome = self._loop.wait(client.open())
        except BaseException:
            self.close()
            raise

    @property
    def name(self) -> str:
        return self._welcome.name

    @property
    def one_user(self) -> bool:
        return self._welcome.one_user

    @property
    def cuts(self) -> int:
        return self._client.far.cuts

    @property
    def stalls(self) -> int:
        return self._client.far.stalls

    @property
    def open(self) -> bool:
        return self._client.far.open

    @property
    def greeting(self) -> str:
        """Which robot it is, and who has come."""
        welcome = self._welcome
        return f"{welcome.robot} at {self._client.url}; you are {welcome.name}, {welcome.role}"

    def begin(self, make: Callable[[int], Request], outlet: Outlet) -> int:
        return self._loop.do(lambda: self._client.begin(make, outlet))

    def abort(self, outlet: Outlet) -> None:
        def begin() -> None:
            try:
                self._client.begin(Abort, outlet)
            except RequestRefused as error:
                outlet(Refused(Refusal.of(error)))

        self._loop.soon(begin)

    def send(self, message: ClientMessage) -> None:
        def send() -> None:
            try:
                self._client.send(message)
            except RequestRefused as refused:
                self._client.told(str(refused))

        self._loop.soon(send)

    def listen(self, outlet: Outlet) -> None:
        self._loop.do(lambda: self._client.far.news.append(outlet))

    def follow(self) -> Watched:
        if self._followed is None:
            self._followed = self._loop.wait(self._client.follow(PAST))
        return self._followed

    def close(self) -> None:
        """Once is enough."""
        if self._closed:
            return
        self._closed = True
        with suppress(TimeoutError):
            self._loop.wait(self._client.close(), LEAVING)
        self._loop.close()
