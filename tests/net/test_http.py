"""The page of a server over raw sockets: what is answered, to whom, and what is refused."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import suppress
from gzip import decompress
from http.client import HTTPResponse
from pathlib import Path
from urllib.parse import quote, urlsplit

import pytest
from websockets.exceptions import InvalidStatus

from tests.live import PATIENCE
from tests.net.serving import Serving, serving
from vrs_cli.errors import NonexistentFile
from vrs_cli.net import http
from vrs_cli.net.http import OwnNames, ServedPage
from vrs_cli.net.messages import Closing, Hello, Welcome
from vrs_cli.net.tokens import add_tokens, take_out

INDEX, WALL, SCRIPT = b"<!doctype html>view" + b"." * 900, b"<!doctype html>wall", b"const a = 1;" * 100
HARDENED = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


def built(folder: Path) -> Path:
    """A page like the built one, and a file beside it that is none of it."""
    (folder / "built" / "assets").mkdir(parents=True)
    (folder / "secret.txt").write_text("secret")
    for name, data in (("index.html", INDEX), ("wall.html", WALL), ("assets/index-abc.js", SCRIPT), ("x.key", b"key")):
        (folder / "built" / name).write_bytes(data)
    (folder / "built" / "assets" / "link.txt").symlink_to(folder / "secret.txt")
    return folder / "built"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Serving]:
    folder = tmp_path_factory.mktemp("pages")
    with serving(folder, ("cell1", "cell2"), pages=ServedPage.read(built(folder))) as it:
        yield it


class Classroom:
    """A server with tokens, and a robot of her own for each."""

    def __init__(self, it: Serving, file: Path, tokens: dict[str, str]) -> None:
        self.it, self.file, self.tokens = it, file, tokens


@pytest.fixture(scope="module")
def classroom(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Classroom]:
    folder = tmp_path_factory.mktemp("class")
    file = folder / "tokens.toml"
    tokens = add_tokens(file, ("ada", "bob", "eve")) | add_tokens(file, ("tom",), "teacher")
    pages = ServedPage.read(built(folder), cookies=True)
    pages.add("/recording/day.json", "application/json", b"{}")
    with serving(folder, ("demo",), tokens=file, own=1, pages=pages) as it:
        yield Classroom(it, file, tokens)


def host(server: Serving) -> str:
    return urlsplit(server.address).netloc


def raw(server: Serving, data: bytes) -> bytes:
    """What the server sends, to its end, to who sends this."""
    parts = urlsplit(server.address)
    with socket.create_connection((parts.hostname or "", parts.port or 0), PATIENCE) as it:
        it.sendall(data)
        found = b""
        with suppress(ConnectionResetError):
            while more := it.recv(65536):
                found += more
        return found


def get(server: Serving, path: str, *headers: str, method: str = "GET", at: str | None = None) -> HTTPResponse:
    """The answer to a request, with its body in `read`."""
    lines = (f"{method} {path} HTTP/1.1", f"Host: {at or host(server)}", *headers, "", "")
    parts = urlsplit(server.address)
    it = socket.create_connection((parts.hostname or "", parts.port or 0), PATIENCE)
    it.sendall("\r\n".join(lines).encode("latin-1"))
    found = HTTPResponse(it, method=method)
    found.begin()
    it.close()  # the file of the answer holds it
    return found


# --- what is answered -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "body", "cache"),
    [
        ("/view/cell1", INDEX, "no-cache"),
        ("/view/nobody", INDEX, "no-cache"),
        ("/view/cell1?x=1", INDEX, "no-cache"),
        ("/wall", WALL, "no-cache"),
        ("/assets/index-abc.js", SCRIPT, "public, max-age=31536000, immutable"),
    ],
)
def test_files_of_the_page_are_served_with_hard_headers(server: Serving, path: str, body: bytes, cache: str) -> None:
    found = get(server, path)
    assert (found.status, found.read(), found.headers["Cache-Control"]) == (200, body, cache)
    assert {name: found.headers[name] for name in HARDENED} == HARDENED
    policy = found.headers["Content-Security-Policy"]
    assert "default-src 'none'; script-src 'self';" in policy
    assert "connect-src 'self' blob:;" in policy
    assert "base-uri 'none'" in policy
    assert "frame-ancestors 'self'" in policy
    assert "unsafe-eval" not in policy


def test_a_file_is_compressed_for_who_takes_that_and_sent_once(server: Serving) -> None:
    zipped = get(server, "/assets/index-abc.js", "Accept-Encoding: br, gzip;q=0.8")
    assert zipped.headers["Content-Encoding"] == "gzip"
    assert decompress(zipped.read()) == SCRIPT
    assert get(server, "/assets/index-abc.js", "Accept-Encoding: gzip;q=0").headers["Content-Encoding"] is None
    again = get(server, "/assets/index-abc.js", f'If-None-Match: "other", {zipped.headers["ETag"]}')
    assert (again.status, again.read()) == (304, b"")


def test_head_tells_all_but_the_body(server: Serving) -> None:
    for path in ("/", "/view/cell1", "/none", "/robots/cell1"):
        full, head = get(server, path), get(server, path, method="HEAD")
        assert (head.status, head.headers["Content-Length"]) == (full.status, str(len(full.read())))
    assert raw(server, f"HEAD /wall HTTP/1.1\r\nHost: {host(server)}\r\n\r\n".encode()).endswith(b"\r\n\r\n")


def test_the_address_explains_itself_and_lists_the_robots(server: Serving) -> None:
    found = get(server, "/")
    text = found.read().decode()
    assert found.status == 200
    assert 'href="/view/cell1"' in text
    assert "vrs connect ws://127.0.0.1" in text
    assert "script-src 'self'; style-src 'self' 'sha256-" in found.headers["Content-Security-Policy"]


def test_a_server_without_a_page_explains_itself_too(tmp_path: Path) -> None:
    with serving(tmp_path) as it:
        assert b"vrs serve --pages" in get(it, "/").read()
        assert get(it, "/view/cell1").status == 404
        assert get(it, "/robots/cell1").status == 426
        with pytest.raises(InvalidStatus) as refused:
            it.call("/robots/cell1", origin=f"http://{host(it)}")
        assert refused.value.response.status_code == 403


def test_where_the_page_is_not_built_the_command_is_told(tmp_path: Path) -> None:
    with pytest.raises(NonexistentFile, match=r"hatch_build\.py"):
        ServedPage.read(tmp_path)


# --- what is refused --------------------------------------------------------------------------------------------------

HOSTILE = (
    "/../secret.txt",
    "/assets/../../secret.txt",
    "/assets/%2e%2e/%2e%2e/secret.txt",
    "/assets/..%2f..%2fsecret.txt",
    "/assets\\..\\..\\secret.txt",
    "/assets/link.txt",
    "/assets/index-abc.js%00",
    "/assets/",
    "/assets",
    "//assets/index-abc.js",
    "/x.key",
    "/view/",
    "/view/a/b",
    "/view/..%5c\\x",
    "/view/\x00",
    "/view/\xff",
    "/view/" + "a" * 201,
    "/wall/x",
    "/recording/day.json",
    "/robots/cell1/mesh/..%2f..%2fsecret.txt",
    "/robots/nobody/mesh/abc.glb",
    "http://elsewhere.example/wall",
    "*",
)


def test_where_tokens_are_no_cookies_a_page_that_wants_one_keeps_its_token(server: Serving) -> None:
    found = get(server, "/enter/cell1")
    assert (found.status, found.read(), cookies_of(found)) == (200, b"", [])


@pytest.mark.parametrize("path", HOSTILE, ids=range(len(HOSTILE)))
def test_other_paths_lead_nowhere(server: Serving, path: str) -> None:
    found = get(server, path)
    body = found.read()
    assert found.status == 404
    assert b"secret" not in body
    assert len(body) < 100


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE"])
def test_other_methods_are_refused(server: Serving, method: str) -> None:
    found = get(server, "/view/cell1", "Content-Length: 0", method=method)
    assert (found.status, found.headers["Allow"]) == (405, "GET, HEAD")


GARBAGE = (
    b"",
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(200),
    b"GET\r\n\r\n",
    b"GET /" + b"a" * 20_000 + b" HTTP/1.1\r\n\r\n",
    b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 200 + b"\r\n",
    b"GET / HTTP/1.0\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nhello",
    b"GET / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
)


@pytest.mark.parametrize("data", GARBAGE, ids=range(len(GARBAGE)))
def test_what_is_no_request_ends_the_connection(server: Serving, data: bytes) -> None:
    parts = urlsplit(server.address)
    with socket.create_connection((parts.hostname or "", parts.port or 0), PATIENCE) as it:
        with suppress(OSError):  # the server may close before it has read all
            it.sendall(data)
            it.shutdown(socket.SHUT_WR)
        with suppress(ConnectionResetError):
            assert not it.recv(100).startswith(b"HTTP/1.1 2")
    assert get(server, "/wall").status == 200


@pytest.mark.parametrize("hosts", [(), ("a", "127.0.0.1")])
def test_one_host_is_wanted(server: Serving, hosts: tuple[str, ...]) -> None:
    headers = "".join(f"Host: {one}\r\n" for one in hosts)
    assert raw(server, f"GET /wall HTTP/1.1\r\n{headers}\r\n".encode()).startswith(b"HTTP/1.1 400")


def test_a_slow_request_is_cut(server: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "REQUEST_SECONDS", 0.05)
    assert raw(server, b"GET /wall HTT") == b""
    assert raw(server, b"G") == b""


def test_only_so_many_ask_at_once(server: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "MAX_ASKING", 3)
    parts = urlsplit(server.address)
    waiting = [socket.create_connection((parts.hostname or "", parts.port or 0), PATIENCE) for _ in range(3)]
    try:
        assert raw(server, b"GET /wall HTTP/1.1\r\n") == b""
    finally:
        for one in waiting:
            one.close()
    with server.call("/robots/cell1") as ada:  # who has a connection is not one of them
        assert isinstance(ada.heard[0], Welcome)


def test_answers_that_wait_have_a_limit(server: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "MAX_SENDING", 10)
    assert (get(server, "/wall").status, get(server, "/view/a").headers["Retry-After"]) == (503, "2")


# --- which pages may connect ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", "LOCALHOST", "[::1]"])
def test_the_page_itself_may_connect(server: Serving, name: str) -> None:
    at = f"{name}:{urlsplit(server.address).port}"
    assert get(server, "/view/cell1", at=at).status == 200
    assert upgraded(server, at, f"http://{at}") == 101


def upgraded(server: Serving, at: str, *origins: str) -> int:
    """The status of the answer to a request for a connection."""
    headers = ["Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13"]
    headers += ["Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", *(f"Origin: {origin}" for origin in origins)]
    with get(server, "/robots/cell1", *headers, at=at) as found:
        return found.status


@pytest.mark.parametrize(
    ("name", "origin", "status"),
    [
        ("evil.example", "http://evil.example", 403),  # DNS that leads here
        ("evil.example", None, 101),  # a program, by any name
        ("127.0.0.1", "http://evil.example", 403),
        ("127.0.0.1", "null", 403),
        ("127.0.0.1", "https://{host}", 403),
        ("127.0.0.1", "http://127.0.0.1", 403),  # another port
        ("127.0.0.1", "http://{host}", 101),
        ("127.0.0.1", "http://{host} http://evil.example", 403),
        ("127.0.0.1.evil.example", "http://{host}", 403),
        ("localhost.evil.example", "http://{host}", 403),
        ("8.8.8.8", "http://{host}", 403),
    ],
)
def test_pages_of_others_may_not(server: Serving, name: str, origin: str | None, status: int) -> None:
    at = f"{name}:{urlsplit(server.address).port}"
    origins = () if origin is None else (origin.format(host=at),)
    assert upgraded(server, at, *origins) == status


def test_two_origins_are_refused(server: Serving) -> None:
    at = host(server)
    assert upgraded(server, at, f"http://{at}", f"http://{at}") == 400


@pytest.mark.parametrize("path", ["/", "/view/cell1", "/wall", "/assets/index-abc.js", "/robots/cell1"])
def test_names_of_others_get_no_page(server: Serving, path: str) -> None:
    found = get(server, path, at="evil.example:8765")
    assert found.status == 421
    assert b"--origin" in found.read()


def test_a_server_answers_to_its_names() -> None:
    local = OwnNames("127.0.0.1", tls=False, origins=())
    assert "localhost:80" in local
    assert "[::1]:80" in local
    assert all(
        one not in local for one in ("", ":80", "192.0.2.1", "robots.school", "[", "a b", "localhost@evil.example")
    )
    wide = OwnNames("0.0.0.0", tls=False, origins=("http://robots.school:8765",))
    assert "192.0.2.1:8765" in wide
    assert "Robots.School:8765" in wide
    assert "evil.example" not in wide
    assert "evil.example" in OwnNames("0.0.0.0", tls=True, origins=())  # the browser has compared the certificate


# --- tokens and cookies -----------------------------------------------------------------------------------------------


def cookies_of(found: HTTPResponse) -> list[str]:
    return found.headers.get_all("Set-Cookie") or []


def test_the_address_of_a_class_names_nobody(classroom: Classroom) -> None:
    text = get(classroom.it, "/").read()
    assert b"link" in text
    assert b"demo" not in text
    assert b"ada" not in text


def enter(classroom: Classroom, name: str, who: str) -> HTTPResponse:
    return get(classroom.it, f"/enter/{name}", f"Authorization: Bearer {classroom.tokens[who]}")


def test_a_cookie_takes_the_place_of_a_token(classroom: Classroom) -> None:
    entered = enter(classroom, "ada", "ada")
    port = urlsplit(classroom.it.address).port
    (cookie,) = cookies_of(entered)
    assert (entered.status, entered.read()) == (204, b"")
    token = quote(classroom.tokens["ada"], safe="")
    assert cookie == f"vrs-{port}={token}; Path=/robots/ada; HttpOnly; SameSite=Strict"
    sent = {"Cookie": f"other=1; {cookie.partition(';')[0]}"}
    own = f"http://{host(classroom.it)}"
    with classroom.it.call("/robots/ada", origin=own, additional_headers=sent) as ada:
        assert isinstance(ada.heard[0], Welcome)
    for told, origin in ((sent, None), ({}, own)):  # a program says its token; who has none stays outside
        with classroom.it.call("/robots/ada", origin=origin, additional_headers=told) as nobody:
            assert isinstance(nobody.heard[0], Closing)


def test_a_teacher_has_one_cookie_for_all_robots(classroom: Classroom) -> None:
    (cookie,) = cookies_of(enter(classroom, "ada", "tom"))
    assert "; Path=/robots;" in cookie


def test_a_cookie_is_for_the_robots_of_its_token(classroom: Classroom) -> None:
    refused = enter(classroom, "ada", "bob")
    assert (refused.status, cookies_of(refused)) == (401, [])
    wrong = get(classroom.it, "/enter/ada", "Authorization: Bearer nonsense")
    assert (wrong.status, cookies_of(wrong)) == (401, [])
    assert get(classroom.it, "/enter/ada").status == 401


def test_a_cookie_is_taken_back_by_the_page_alone(classroom: Classroom) -> None:
    assert get(classroom.it, "/leave/ada").status == 400
    left = get(classroom.it, "/leave/ada", "X-Vrs: leave")
    assert all("Max-Age=0" in cookie for cookie in cookies_of(left))
    assert {cookie.split("; ")[1] for cookie in cookies_of(left)} == {"Path=/robots/ada", "Path=/robots"}
    assert get(classroom.it, "/leave/a%0d%0aSet-Cookie:x", "X-Vrs: leave").status == 404


def test_a_token_that_is_taken_out_of_the_file_ends_its_cookie(classroom: Classroom) -> None:
    cookie = cookies_of(enter(classroom, "eve", "eve"))[0].partition(";")[0]
    page = {"origin": f"http://{host(classroom.it)}", "additional_headers": {"Cookie": cookie}}
    with classroom.it.call("/robots/eve", **page) as eve:
        take_out(classroom.file, ["eve"])
        closing = eve.until(lambda one: isinstance(one, Closing))
        assert isinstance(closing, Closing)
        assert "revoked" in closing.why
    with classroom.it.call("/robots/eve", Hello((1,)), **page) as eve:
        assert isinstance(eve.heard[0], Closing)


def test_data_wants_a_token_where_the_server_does(classroom: Classroom) -> None:
    path = "/recording/day.json"
    assert get(classroom.it, path).status == 401
    found = get(classroom.it, path, f"Authorization: Bearer {classroom.tokens['bob']}")
    assert (found.status, found.read()) == (200, b"{}")


def test_a_page_learns_the_robots_of_its_token(server: Serving, classroom: Classroom) -> None:
    assert get(server, "/robots").read() == b'{"robots": ["cell1", "cell2"]}'
    assert get(classroom.it, "/robots").status == 401
    own = get(classroom.it, "/robots", f"Authorization: Bearer {classroom.tokens['bob']}")
    assert own.read() == b'{"robots": ["bob", "demo"]}'
    (cookie,) = cookies_of(enter(classroom, "ada", "tom"))
    all_of_them = get(classroom.it, "/robots", f"Cookie: {cookie.partition(';')[0]}")
    assert all_of_them.headers["Cache-Control"] == "no-store"
    assert b'"ada", "bob"' in all_of_them.read()
