"""Who may open the page. viser answers everybody who reaches its port, and that is every page in a browser of this
machine: a WebSocket may be opened to any host from any site, and a name that an attacker owns may lead to 127.0.0.1
(DNS rebinding). So each request is looked at before viser sees it: it names this machine, comes from this very page or
from no page, and knows the secret of the address.
"""

from __future__ import annotations

import asyncio
import hmac
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from threading import Lock
from typing import Any
from urllib.parse import urlsplit

import websockets.asyncio.server as sockets
from websockets.asyncio.server import ServerConnection, serve
from websockets.http11 import Request, Response

from vrs_cli.view3d.addition import STOP, THERE, addition
from vrs_cli.view3d.door import LOOPBACK, Door

_replacing = Lock()
Asked = Callable[[ServerConnection, Request], Response | None]


class Guard:
    """Lets in who knows the secret of a door: a page gets what it is made of at once, and is talked with from `let_in`
    on. `failed` is told what goes wrong with what a page sends: viser lets it lie. `look` says, as JSON, how the robot
    is reached; `stop` stops it, and says why where it does not.
    """

    def __init__(
        self,
        door: Door,
        failed: Callable[[BaseException], object],
        look: Callable[[], str],
        stop: Callable[[], str],
    ) -> None:
        self._door, self._failed, self._look, self._stop = door, failed, look, stop
        self.stands = False
        self.let_in: Callable[[], object] = lambda: None

    def refuses(self, request: Request) -> str:
        """Why a request is not answered, or empty."""
        host, origin = request.headers.get("Host", ""), request.headers.get("Origin")
        secret = urlsplit(request.path).path.lstrip("/").partition("/")[0]
        if urlsplit(f"//{host}").hostname not in LOOPBACK:
            return "this page is for this machine alone: open the address that vrs view tells"
        if origin is not None and urlsplit(origin).netloc != host:
            return "another page may not look at this robot"
        if not hmac.compare_digest(secret.encode(), self._door.secret.encode()):
            return "open the address that vrs view tells, with all that is in it"
        return ""

    async def admit(self, connection: ServerConnection, request: Request, then: Asked) -> Response | None:
        """Refuse a request, or hand it on without the secret."""
        try:
            why = self.refuses(request)
        except (ValueError, LookupError):  # no address, a header that comes twice
            why = "this is no request of a browser"
        if why:
            return connection.respond(HTTPStatus.FORBIDDEN, f"{why}\n")
        request.path = "/" + request.path.removeprefix(f"/{self._door.secret}").lstrip("/")
        if request.path == THERE:
            return connection.respond(HTTPStatus.OK, self._look())
        if request.path == STOP:
            wrong = await asyncio.to_thread(self._stop)
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE if wrong else HTTPStatus.OK, wrong)
        if "Accept-Encoding" in request.headers:
            del request.headers["Accept-Encoding"]  # most of the page is compressed anyway
        answer = then(connection, request)
        if answer is not None and answer.headers.get("Content-Type", "").startswith("text/html"):
            answer.body += addition(comes_back=self._door.kept)
            del answer.headers["Content-Length"]
            answer.headers["Content-Length"] = str(len(answer.body))
        return answer

    @contextmanager
    def standing(self) -> Iterator[None]:
        """viser opens its server meanwhile: at the door, behind this guard, which `stands` then.

        viser takes neither (its `process_request` answers with its page), so the function that opens servers is
        another one for as long.
        """

        def guarded(handler: Any, _host: Any, _port: Any, *, process_request: Asked, **options: Any) -> serve:
            async def asked(connection: ServerConnection, request: Request) -> Response | None:
                answer = await self.admit(connection, request, process_request)
                if answer is None:  # the page begins to talk
                    await ready.wait()
                return answer

            loop, ready = asyncio.get_running_loop(), asyncio.Event()
            self.let_in = lambda: loop.call_soon_threadsafe(ready.set)
            self.stands = True
            loop.set_exception_handler(self._hear_of_failure)
            return serve(handler, sock=self._door.listening, process_request=asked, **options)

        with _replacing:
            vars(sockets)["serve"] = guarded
            try:
                yield
            finally:
                vars(sockets)["serve"] = serve

    def _hear_of_failure(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if error is not None:
            self._failed(error)
