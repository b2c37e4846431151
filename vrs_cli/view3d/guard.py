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

from vrs_cli.view3d.door import LOOPBACK, Door

THERE = "/there"  # what the page asks for to know whether vrs is there, and the robot
STOP = "/stop"
OPENS, GOES_ON = "Started again it opens a page of its own.", "This page goes on when it is started again."

SCRIPT = """
<style>
#vrs-band {
    position: fixed; z-index: 10000; top: 4.2rem; left: 50%; transform: translateX(-50%); width: max-content;
    max-width: min(34rem, 90vw); box-sizing: border-box; padding: 0.8rem 1.1rem; border-radius: 6px;
    background: #a83232; color: #fff; font: 15px/1.4 sans-serif; pointer-events: none;
}
#vrs-stop {
    position: fixed; z-index: 10001; top: 0.75rem; right: 16.5rem; padding: 0.6rem 1.6rem; border: 2px solid #fff;
    border-radius: 8px; background: #d01f1f; color: #fff; font: bold 18px/1.2 sans-serif; cursor: pointer;
    box-shadow: 0 1px 6px #0008;
}
#vrs-stop:active { background: #8f1010; }
.vrs-lost #vrs-stop { background: repeating-linear-gradient(45deg, #6b6b6b 0 8px, #828282 8px 16px); }
.vrs-lost canvas { filter: grayscale(1) brightness(0.85) contrast(0.7); }
.vrs-lost .tabler-icon-cloud-check { stroke: #d01f1f !important; }
.vrs-lost .tabler-icon-cloud-check path:last-child { display: none; }
@media (max-width: 800px) { #vrs-stop { right: 0.75rem; } }
@media (max-width: 30rem) { [style*="width: 20em"] { width: 100vw !important; } }
</style>
<div id="vrs-band" role="status" hidden></div>
<button id="vrs-stop" hidden>STOP</button>
<script>
(() => {
    const ask = window.fetch, hall = "data:image/jpeg";
    window.fetch = (what, ...how) =>
        (what.url ?? String(what)).startsWith(hall) ? new Promise(() => {}) : ask(what, ...how);

    const band = document.getElementById("vrs-band"), stop = document.getElementById("vrs-stop");
    const here = `/${location.pathname.split("/")[1]}`;
    const get = (path, patience) => ask(here + path, {cache: "no-store", signal: AbortSignal.timeout(patience)});
    let lost = "", since = "", said = "", stopping = "";
    function show() {
        document.body.classList.toggle("vrs-lost", Boolean(lost));
        band.textContent = [said, lost].filter(Boolean).join(" ");
        band.hidden = !band.textContent;
        stop.textContent = stopping || (lost ? "STOP: no connection" : "STOP");
    }
    async function look() {
        try {
            const answer = await get("PATH-THERE", 5000);
            const found = answer.ok ? await answer.json() : null;
            lost = found ? found.lost : "Another vrs view is at this address now: open the one that it tells.";
            stop.hidden = !found?.drives;
            since = "";
        } catch {
            since ||= new Date().toLocaleTimeString();
            lost = `vrs view has ended (${since}): what is seen here is where the robot was last. `
                + "STOP does not reach the robot. AGAIN";
        }
        if (lost && stopping === "STOPPED") stopping = "";
        show();
        setTimeout(look, 1000);
    }
    look();

    stop.onclick = async () => {
        stopping = "STOP ...";
        show();
        try {
            const answer = await get("PATH-STOP", 3000);
            said = answer.ok ? "" : await answer.text();
        } catch {
            said = "STOP has no answer: the robot may move on.";
        }
        stopping = said ? "NOT STOPPED" : "STOPPED";
        show();
        setTimeout(() => { said = stopping = ""; show(); }, said ? 8000 : 2000);
    };

    let step = null;
    new MutationObserver(() => {
        const now = document.querySelector('[data-step="here"]');
        if (now && now !== step) {
            const list = now.parentElement;
            const below = now.getBoundingClientRect().top - list.getBoundingClientRect().top;
            list.scrollTop += below - list.clientHeight / 2;
        }
        step = now;
    }).observe(document.body, {childList: true, subtree: true});
})();
</script>
"""


def addition(*, comes_back: bool) -> bytes:
    """What is appended to viser's page. `comes_back`: vrs that is started again is at the same address.

    STOP is above everything else, on a phone too, and says what became of it. A page without a connection, to the robot
    or to vrs itself, looks so, and says since when: viser says nothing, or `Connecting...`. A list of steps is scrolled
    to the one that is marked as the present one, once it is another; and on a phone the sheet, which has one width in
    viser, is as wide as the page. And it never gets the picture of a hall that viser's page begins to prepare for its
    light before it hears that there is another: software takes half a second.
    """
    again = GOES_ON if comes_back else OPENS
    return SCRIPT.replace("PATH-THERE", THERE).replace("PATH-STOP", STOP).replace("AGAIN", again).encode()


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
