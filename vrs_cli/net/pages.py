"""The page that a server shows in browsers: its built files, loaded once, and the text at the address of the server."""

from __future__ import annotations

import hashlib
from base64 import b64encode
from collections.abc import Iterable, Mapping
from gzip import compress
from html import escape
from http import HTTPStatus
from pathlib import Path
from urllib.parse import quote

from msgspec import Struct
from websockets.datastructures import Headers
from websockets.http11 import Response

from vrs_cli.errors import NonexistentFile
from vrs_cli.extras import BUILT_PAGE, how_to_build_page
from vrs_cli.files.opening import unreadable

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
SMALL = 512  # bytes below which a file is not compressed
HASHED = "/assets/"  # files below it have a hash of their content in the name
YEAR = "public, max-age=31536000, immutable"
ASK_FIRST = "no-cache"  # the browser keeps it, and asks each time whether it is still valid

# CodeMirror puts <style> elements into the page, so styles may be inline; scripts never are
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
    """Return an answer to a request. `kind`: the type of its body; `more`: headers beside the usual ones."""
    headers = Headers([("Connection", "close"), ("Content-Length", str(len(body))), *SECURITY, *more])
    if body or status is not HTTPStatus.NO_CONTENT:
        headers["Content-Type"] = kind
    return Response(status.value, status.phrase, headers, body)


def refusal_of(status: HTTPStatus, text: str, *more: tuple[str, str]) -> Response:
    """Return an answer that says in one line why there is no other."""
    return response_of(status, f"{text}\n".encode(), KINDS[".txt"], ("Cache-Control", "no-store"), *more)


class PageFile(Struct, frozen=True):
    """A file of the page as it is sent. `mark`: its ETag; `zipped`: compressed by gzip, empty where that saves nothing.
    `guarded`: it is for those whom a token lets in.
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
            more = (*same, policy, ("Content-Encoding", "gzip"))
            return response_of(HTTPStatus.OK, self.zipped, self.kind, *more)
        return response_of(HTTPStatus.OK, self.data, self.kind, *same, policy)


def page_file(data: bytes, kind: str, cache: str = ASK_FIRST, *, guarded: bool = False) -> PageFile:
    """Return a file with its mark, and compressed where that saves something."""
    zipped = compress(data, 9, mtime=0) if len(data) > SMALL else b""
    mark = f'"{hashlib.sha256(data).hexdigest()[:32]}"'
    return PageFile(data, kind, mark, cache, zipped if len(zipped) < len(data) else b"", guarded)


class ServedPage:
    """The files of the page by their paths at the server. `cookies`: a token can be exchanged for a cookie, so that a
    reload needs no token.
    """

    def __init__(self, files: Mapping[str, PageFile], *, cookies: bool = False) -> None:
        self._files, self.cookies = dict(files), cookies

    @classmethod
    def read(cls, folder: Path | None = None, *, cookies: bool = False) -> ServedPage:
        """Read the built page, by default that of the package. Raises NonexistentFile, which tells how it is built, and
        FileError.
        """
        folder = folder or BUILT_PAGE
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
                files[name] = page_file(data, KINDS[path.suffix], YEAR if name.startswith(HASHED) else ASK_FIRST)
        return cls(files, cookies=cookies)

    def add(self, path: str, kind: str, data: bytes) -> None:
        """Serve data at a path, to those whom a token lets in: `/recording/day.json`."""
        self._files[path] = page_file(data, kind, ASK_FIRST, guarded=True)

    def find(self, path: str) -> PageFile | None:
        """Return the file of a path as a request has it. Only paths of the table lead anywhere: none is decoded, and
        none becomes the name of a file.
        """
        if path.startswith(VIEW) and _is_segment(path.removeprefix(VIEW)):
            path = "/index.html"
        elif path in (WALL, f"{WALL}/"):
            path = "/wall.html"
        return self._files.get(path)


def _is_segment(text: str) -> bool:
    """Return whether a text is one segment of a path: the page itself says if there is no robot of that name."""
    return 0 < len(text) <= 200 and not set(text) & set("/\\") and text.isprintable()


def _all(headers: Headers, name: str) -> str:
    return ",".join(headers.get_all(name))


def _takes_gzip(headers: Headers) -> bool:
    for part in _all(headers, "Accept-Encoding").lower().split(","):
        coding, _, quality = part.partition(";")
        if coding.strip() in ("gzip", "*") and quality.replace(" ", "") not in ("q=0", "q=0.0", "q=0.00", "q=0.000"):
            return True
    return False


# --- the address of the server --------------------------------------------------------------------------------------


def explanation(address: str, robots: Iterable[str], *, shown: bool, tokens: bool) -> Response:
    """Return what a browser shows at the address of a server. `robots`: those that may be seen without a token;
    `shown`: the server has the page; `tokens`: it wants them.
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
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
    head += '<link rel="icon" href="data:,">'
    html = (
        f'<!doctype html><html lang="en"><head>{head}<title>vrs: virtual robots</title><style>{STYLE}</style></head>'
        f"<body><main>{''.join(parts)}</main></body></html>"
    )
    styles = f"'sha256-{b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()}'"
    policy = ("Content-Security-Policy", POLICY.format(styles=styles))
    return response_of(HTTPStatus.OK, html.encode(), KINDS[".html"], ("Cache-Control", "no-store"), policy)
