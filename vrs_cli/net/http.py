"""Answer HTTP requests of browsers to a server: pages, meshes, cookies; check which pages may open a connection."""

from __future__ import annotations

import asyncio
import hashlib
import ipaddress
import json
from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping
from gzip import compress
from html import escape
from http import HTTPStatus
from pathlib import Path
from socket import gethostname
from typing import Any
from urllib.parse import quote, unquote, urlsplit

from msgspec import Struct
from websockets.asyncio.server import ServerConnection as Socket
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from vrs_cli.errors import NonexistentFile, RequestRefused, VrsError
from vrs_cli.extras import BUILT_PAGE, how_to_build_page
from vrs_cli.files.opening import unreadable
from vrs_cli.net.page_data import MESH
from vrs_cli.net.tokens import OPEN, Grant

VIEW, WALL = "/view/", "/wall"
KINDS: Mapping[str, str] = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".ico": "image/x-icon",
    ".woff2": "font/woff2",
    ".txt": "text/plain; charset=utf-8",
    ".webmanifest": "application/manifest+json",
}
SMALL = 512  # [bytes] files of at most this size are not compressed
ASK_FIRST = "no-cache"  # Cache-Control: the browser keeps the file, but asks each time whether it is still valid

# inline styles are allowed, because CodeMirror adds <style> elements to the page; inline scripts are not
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' {styles}; connect-src 'self' blob:; "
    "img-src 'self' data: blob:; font-src 'self' data:; worker-src 'self' blob:; manifest-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
SECURITY: tuple[tuple[str, str], ...] = (
    ("Referrer-Policy", "no-referrer"),
    ("X-Content-Type-Options", "nosniff"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
)
STYLE = """\
:root { color-scheme: light dark; font: 1.05rem/1.5 system-ui, sans-serif; }
body { max-width: 40rem; margin: 3rem auto; padding: 0 1rem; }
code { font-family: ui-monospace, monospace; overflow-wrap: anywhere; }
li { padding: 0.3rem 0; }
"""


def response_of(status: HTTPStatus, body: bytes = b"", kind: str = KINDS[".txt"], *more: tuple[str, str]) -> Response:
    """Return an answer to a request. `kind`: the media type of its body; `more`: additional headers."""
    headers = Headers([("Connection", "close"), ("Content-Length", str(len(body))), *SECURITY, *more])
    if body or status is not HTTPStatus.NO_CONTENT:
        headers["Content-Type"] = kind
    return Response(status.value, status.phrase, headers, body)


def refusal_of(status: HTTPStatus, text: str, *more: tuple[str, str]) -> Response:
    """Return a refusal with a message of one line."""
    return response_of(status, f"{text}\n".encode(), KINDS[".txt"], ("Cache-Control", "no-store"), *more)


class PageFile(Struct, frozen=True):
    """A file of the page with its headers. `mark`: its ETag; `zipped`: the data compressed with gzip, empty if that
    saves nothing. `guarded`: the file is sent only with a valid token.
    """

    data: bytes
    kind: str
    mark: str
    cache: str
    zipped: bytes = b""
    guarded: bool = False

    def response(self, headers: Headers) -> Response:
        """Return the answer to a request with these headers."""
        same = ("ETag", self.mark), ("Cache-Control", self.cache), ("Vary", "Accept-Encoding")
        if self.mark in [mark.strip().removeprefix("W/") for mark in _all(headers, "If-None-Match").split(",")]:
            return response_of(HTTPStatus.NOT_MODIFIED, b"", self.kind, *same)
        policy = ("Content-Security-Policy", POLICY.format(styles="'unsafe-inline'"))
        if self.zipped and _takes_gzip(headers):
            return response_of(HTTPStatus.OK, self.zipped, self.kind, *same, policy, ("Content-Encoding", "gzip"))
        return response_of(HTTPStatus.OK, self.data, self.kind, *same, policy)


def page_file(data: bytes, kind: str, cache: str = ASK_FIRST, *, guarded: bool = False) -> PageFile:
    """Return a file with its ETag, and with compressed data if that is shorter."""
    zipped = compress(data, 9, mtime=0) if len(data) > SMALL else b""
    mark = f'"{hashlib.sha256(data).hexdigest()[:32]}"'
    return PageFile(data, kind, mark, cache, zipped if len(zipped) < len(data) else b"", guarded)


class ServedPage:
    """The files of the page, by their paths at the server. `cookies`: the page can exchange its token for a cookie, so
    that it needs no token after a reload.
    """

    def __init__(self, files: Mapping[str, PageFile], *, cookies: bool = False) -> None:
        self._files, self.cookies = dict(files), cookies

    @classmethod
    def read(cls, folder: Path | None = None, *, cookies: bool = False) -> ServedPage:
        """Read a built page, by default the page of the package. Raises NonexistentFile, which says how to build it,
        and FileError.
        """
        folder = folder or Path(BUILT_PAGE)
        if not (folder / "index.html").is_file():
            raise NonexistentFile(f"the page is not built here ({folder})", f"this builds it: {how_to_build_page()}")
        files = dict[str, PageFile]()
        for path in sorted(folder.rglob("*")):
            name = f"/{path.relative_to(folder).as_posix()}"
            if path.is_file() and not path.is_symlink() and path.suffix in KINDS:
                try:
                    data = path.read_bytes()
                except OSError as error:
                    raise unreadable(path, error) from None
                hashed = name.startswith("/assets/")  # such names contain a hash of the content
                cache = "public, max-age=31536000, immutable" if hashed else ASK_FIRST
                files[name] = page_file(data, KINDS[path.suffix], cache)
        return cls(files, cookies=cookies)

    def add(self, path: str, kind: str, data: bytes) -> None:
        """Serve data at a path such as `/recording/day.json`, only with a valid token."""
        self._files[path] = page_file(data, kind, ASK_FIRST, guarded=True)

    def find(self, path: str) -> PageFile | None:
        """Return the file for the path of a request; None if there is none. Paths are only looked up in a table; they
        are not decoded, and never used as file names.
        """
        name = path.removeprefix(VIEW)
        if path.startswith(VIEW) and 0 < len(name) <= 200 and not set(name) & set("/\\") and name.isprintable():
            path = "/index.html"  # for an unknown robot the page itself reports the error
        elif path in (WALL, f"{WALL}/"):
            path = "/wall.html"
        return self._files.get(path)


def _all(headers: Headers, name: str) -> str:
    return ",".join(headers.get_all(name))


def _takes_gzip(headers: Headers) -> bool:
    parts = (part.partition(";") for part in _all(headers, "Accept-Encoding").lower().split(","))
    wanted = (quality.replace(" ", "") for coding, _, quality in parts if coding.strip() in ("gzip", "*"))
    return any(quality not in ("q=0", "q=0.0", "q=0.00", "q=0.000") for quality in wanted)


# --- the start page of a server -------------------------------------------------------------------------------------


def explanation(address: str, robots: Iterable[str], *, shown: bool, tokens: bool) -> Response:
    """Return the start page of a server for a browser. `robots`: the names that are visible without a token; `shown`:
    the server has the page of robots; `tokens`: the server requires tokens.
    """
    parts = ["<h1>Virtual robots</h1>", "<p>This is a server of <code>vrs</code>: it has robots that others hold.</p>"]
    if shown and tokens:
        parts.append(
            "<p>Each robot has a page. To enter, open the link that you were given: it has your token. "
            "Without a link, ask whoever runs this server.</p>"
        )
    elif shown:
        links = "".join(f'<li><a href="{VIEW}{quote(name)}">{escape(name)}</a></li>' for name in robots)
        parts.append(f'<ul>{links}</ul><p><a href="{WALL}">All of them</a></p>' if links else "<p>It has none yet.</p>")
    else:
        names = ", ".join(escape(name) for name in robots)
        parts += [f"<p>Robots: {names}.</p>"] if names and not tokens else []
        parts.append("<p>It shows no page: whoever runs it can start it with <code>vrs serve --pages</code>.</p>")
    needs = ", with a token in <code>VRS_TOKEN</code>" if tokens else ""
    parts.append(
        f"<p>From a terminal: <code>vrs connect {escape(address)}</code>{needs}; from Python: "
        f"<code>vrs_cli.connect({escape(repr(address))})</code>.</p>"
    )
    html = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">'
        f"<title>vrs: virtual robots</title><style>{STYLE}</style></head>"
        f"<body><main>{''.join(parts)}</main></body></html>"
    )
    styles = f"'sha256-{b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()}'"
    policy = ("Content-Security-Policy", POLICY.format(styles=styles))
    return response_of(HTTPStatus.OK, html.encode(), KINDS[".html"], ("Cache-Control", "no-store"), policy)


ROBOTS, ENTER, LEAVE = "/robots/", "/enter/", "/leave/"
LIST = "/robots"  # path of the list of a token's robots (JSON)
LEAVING = ("X-Vrs", "leave")  # required header of LEAVE, which only a page of this server can send
METHOD_CHARS = 8  # length of the longest method name (OPTIONS, CONNECT) and the space that follows
OTHER_METHODS = (b"POST", b"PUT", b"PATCH", b"DELETE", b"OPTIONS", b"TRACE", b"CONNECT")
REQUEST_SECONDS = 10.0  # [s] maximum time until a request is complete
BODY_SECONDS = 60.0  # [s] maximum time until the client has received an answer
MAX_ASKING = 1000  # maximum number of sockets that are not connected to a robot
MAX_SENDING = 64_000_000  # maximum bytes of answers that wait for their sockets


class Doorway:
    """Counts of a server's sockets that are not connected to a robot. `asking`: number of these sockets; `sending`:
    bytes of answers that wait for them."""

    def __init__(self) -> None:
        self.asking = self.sending = 0


class HttpSocket(Socket):
    """A socket that also answers HEAD, closes slow requests, and refuses other methods with an explanation."""

    same_origin = False  # whether a page of this server opened the connection

    def __init__(self, *given: Any, doorway: Doorway, **options: Any) -> None:
        super().__init__(*given, **options)
        self.asks_head = False
        self._doorway, self._begin, self._asks = doorway, b"", True
        self._sent = 0  # number of bytes of the answer that were counted
        self._slow: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._doorway.asking += 1
        super().connection_made(transport)
        if self._doorway.asking > MAX_ASKING:
            self.transport.abort()
        self._slow = asyncio.get_running_loop().call_later(REQUEST_SECONDS, self._look)

    def _look(self) -> None:
        if self.request is None:
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self.let_in()
        self._doorway.sending -= self._sent
        if self._slow is not None:
            self._slow.cancel()
        super().connection_lost(exc)

    def let_in(self) -> None:
        """Stop counting this socket in `asking`: it has a connection to a robot, or is closed."""
        self._doorway.asking -= self._asks
        self._asks = False

    def data_received(self, data: bytes) -> None:
        if self.request is None:
            data = self._begin + data
            method, space, rest = data.partition(b" ")
            if not space and len(data) < METHOD_CHARS:
                self._begin = data
                return
            self._begin = b""
            if method in OTHER_METHODS:
                said = refusal_of(
                    HTTPStatus.METHOD_NOT_ALLOWED, "only GET and HEAD are answered", ("Allow", "GET, HEAD")
                )
                self.transport.write(said.serialize())
                self.transport.close()
                return
            self.asks_head |= method == b"HEAD"
            data = b"GET " + rest if method == b"HEAD" else data
        super().data_received(data)

    def answer(self, response: Response) -> Response:
        """Return the response to send, which is a refusal if too many bytes of answers wait already."""
        if self.asks_head:
            response.body = b""
        if self._doorway.sending + len(response.body) > MAX_SENDING:
            response = refusal_of(HTTPStatus.SERVICE_UNAVAILABLE, "too many ask at once", ("Retry-After", "2"))
        self._sent = len(response.body)
        self._doorway.sending += self._sent
        self.close_timeout = BODY_SECONDS
        return response


# --- host names -------------------------------------------------------------------------------------------------------


def is_local(host: str) -> bool:
    """Return whether an address can be reached only from this machine."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"


class OwnNames:
    """The host names under which a server answers browsers. Other names are refused: a hostile site could make its own
    name point to this server, so that browsers treat its pages as pages of this server (DNS rebinding). Numeric
    addresses are safe; so is TLS, because the browser compares the name with the certificate.
    """

    def __init__(self, host: str, *, tls: bool, origins: Iterable[str]) -> None:
        self._any, self._local = tls, is_local(host)
        own = gethostname().lower()
        others = () if self._local else (own, f"{own.partition('.')[0]}.local")
        named = (urlsplit(origin).hostname or "" for origin in origins)
        self._names = {"localhost", host.lower(), *others, *named} - {""}

    def __contains__(self, host: str) -> bool:
        """Return whether a Host header, with or without a port, contains one of the names."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        if self._any or name.rstrip(".") in self._names:
            return bool(name)
        try:
            number = ipaddress.ip_address(name)
        except ValueError:
            return False
        return number.is_loopback or not self._local


# --- requests ---------------------------------------------------------------------------------------------------------


class HttpAnswers:
    """The answers to HTTP requests at the `port` of a server. `find`: returns the grant of a token that came from an
    address. `tokens`: the server requires tokens. `robots`: returns the names of a grant's robots. `own`: returns the
    names of the wanted robot and of the grant's own robots. `find` and `own` raise RequestRefused. `mesh`: returns a
    mesh of a robot; raises NonexistentFile.
    """

    port = 0

    def __init__(
        self,
        pages: ServedPage | None,
        names: OwnNames,
        origins: Iterable[str],
        find: Callable[[str, str], Grant],
        robots: Callable[[Grant], Iterable[str]],
        own: Callable[[Grant, str], tuple[str, ...]],
        mesh: Callable[[str, str], bytes],
        tell: Callable[[str], None],
        *,
        tls: bool,
        tokens: bool,
    ) -> None:
        self._pages, self._names, self._origins = pages, names, frozenset(origins)
        self._find, self._robots, self._own, self._mesh = find, robots, own, mesh
        self._tell, self._tls, self._tokens = tell, tls, tokens

    async def answer(self, socket: HttpSocket, request: Request) -> Response | None:
        """Return the answer to a request; None if the request opens a WebSocket connection and may do so."""
        path = path_of(request)
        if "websocket" in ",".join(request.headers.get_all("Upgrade")).lower():
            return self._refuse_connection(socket, request.headers, path)
        return socket.answer(await self._page(socket, request.headers, path))

    # --- connections ---

    def _refuse_connection(self, socket: HttpSocket, headers: Headers, path: str) -> Response | None:
        """Return the refusal of a WebSocket connection; None if it may be opened. Browsers send the origin of the page;
        programs send none."""
        origins, hosts = headers.get_all("Origin"), headers.get_all("Host")
        if len(origins) > 1 or len(hosts) != 1:
            return refusal_of(HTTPStatus.BAD_REQUEST, "one Host and one Origin at most are wanted")
        if origins:
            own = f"{'https' if self._tls else 'http'}://{hosts[0]}"
            socket.same_origin = self._pages is not None and origins[0] == own and hosts[0] in self._names
            if not socket.same_origin and origins[0] not in self._origins:
                return refusal_of(
                    HTTPStatus.FORBIDDEN, f"pages of {origins[0][:200]!a} may not connect: vrs serve --origin"
                )
        known = path in ("", "/") or path.startswith(ROBOTS)
        return None if known else refusal_of(HTTPStatus.NOT_FOUND, f"{ROBOTS}NAME is the address of a robot")

    # --- pages ---

    async def _page(self, socket: HttpSocket, headers: Headers, path: str) -> Response:
        name, _, file = path.removeprefix(ROBOTS).partition(f"/{MESH}/")
        if path.startswith(ROBOTS) and file:
            try:  # no token is needed: only clients of the robot know the secret address of a mesh
                found_mesh = await asyncio.to_thread(self._mesh, unquote(name), file)
            except VrsError as error:
                if not isinstance(error, NonexistentFile):
                    self._tell(f"{unquote(name)}: {error}")
                return refusal_of(HTTPStatus.NOT_FOUND, "there is no such mesh")
            return response_of(
                HTTPStatus.OK,
                found_mesh,
                "model/gltf-binary",
                ("Cache-Control", "private, max-age=31536000, immutable"),
            )
        hosts = headers.get_all("Host")
        if len(hosts) != 1:
            return refusal_of(HTTPStatus.BAD_REQUEST, "one Host is wanted")
        if hosts[0] not in self._names:
            what = f"this server does not answer to {hosts[0][:200]!a}; vrs serve --origin http://NAME:PORT names one"
            return refusal_of(HTTPStatus.MISDIRECTED_REQUEST, what)
        if path == "/":
            address = f"{'wss' if self._tls else 'ws'}://{hosts[0]}"
            robots = () if self._tokens else self._robots(OPEN)
            return explanation(address, robots, shown=self._pages is not None, tokens=self._tokens)
        if path.startswith(ROBOTS):
            page = f"; its page is {VIEW}{path.removeprefix(ROBOTS)}" if self._pages is not None else ""
            what = f"this is the address of a robot for programs, as vrs connect{page}"
            return refusal_of(HTTPStatus.UPGRADE_REQUIRED, what, ("Upgrade", "websocket"))
        if self._pages is not None and not self._pages.cookies and path.startswith(ENTER):
            return response_of(HTTPStatus.OK)  # without cookies the page keeps its token
        if self._pages is not None and self._pages.cookies and self._tokens and path.startswith((ENTER, LEAVE)):
            return self._exchange(socket, headers, path)
        found = None if self._pages is None else self._pages.find(path)
        if found is None and (self._pages is None or path != LIST):
            return refusal_of(HTTPStatus.NOT_FOUND, "there is no such page")
        grant = OPEN
        if self._tokens and (found is None or found.guarded):
            try:
                grant = self._find(token_of(headers, self.port), socket.remote_address[0])
            except RequestRefused as error:
                return refusal_of(HTTPStatus.UNAUTHORIZED, str(error))
        if found is None:
            names = json.dumps({"robots": [*self._robots(grant)]}).encode()
            return response_of(HTTPStatus.OK, names, KINDS[".json"], ("Cache-Control", "no-store"))
        return found.response(headers)

    # --- cookies ---

    def _exchange(self, socket: HttpSocket, headers: Headers, path: str) -> Response:
        """Exchange a token for a cookie that is valid for the token's own robots, or delete the cookie. Pages of other
        sites cannot do this: the headers require a preflight request, which this server refuses.
        """
        leaves, name = path.startswith(LEAVE), unquote(path.partition("/")[2].partition("/")[2])
        if leaves and headers.get_all(LEAVING[0]) != [LEAVING[1]]:
            return refusal_of(HTTPStatus.BAD_REQUEST, f"the header {': '.join(LEAVING)} is wanted")
        token = token_of(headers)
        try:
            grant = None if leaves else self._find(token, socket.remote_address[0])
            names = (name,) if grant is None else self._own(grant, name)
        except RequestRefused as error:
            return refusal_of(HTTPStatus.UNAUTHORIZED, str(error))
        if not all(one.isascii() and one.replace("-", "").replace("_", "").replace(".", "").isalnum() for one in names):
            return refusal_of(HTTPStatus.NOT_FOUND, "there is no such robot")
        paths = (LIST,) if grant is not None and grant.teacher else (f"{ROBOTS}{one}" for one in names)
        rest = f"HttpOnly; SameSite=Strict{'; Secure' if self._tls else ''}{'; Max-Age=0' if leaves else ''}"
        value = "" if leaves else quote(token, safe="")
        cookies = [f"{cookie_name(self.port)}={value}; Path={at}; {rest}" for at in dict.fromkeys(paths)]
        if leaves:
            cookies.append(f"{cookie_name(self.port)}=; Path={LIST}; {rest}")
        return response_of(
            HTTPStatus.NO_CONTENT, b"", "", ("Cache-Control", "no-store"), *(("Set-Cookie", one) for one in cookies)
        )


def path_of(request: Request) -> str:
    """Return the undecoded path of a request, without its query; "" if it has no path."""
    path = request.path.partition("?")[0].partition("#")[0]
    return path if path.startswith("/") else ""


def cookie_name(port: int) -> str:
    """Return the name of a server's cookie. It contains the port, because browsers send cookies to all ports of a
    host."""
    return f"vrs-{port}"


def token_of(headers: Headers, port: int = 0) -> str:
    """Return the token of a request, from the header Authorization, or from the cookie of the server at this port (0:
    no cookie); "" without a token.
    """
    given = headers.get_all("Authorization")
    if len(given) == 1 and given[0][:7].lower() == "bearer ":
        return given[0][7:].strip()
    found: Mapping[str, str] = {}
    if port:
        pairs = (one.strip().partition("=") for one in ";".join(headers.get_all("Cookie")).split(";"))
        # if cookies share a name, keep the first: the one with the longest path
        found = {name: value for name, _, value in reversed([*pairs])}
    return unquote(found.get(cookie_name(port), ""))
