"""Who may open the page, asked with bare sockets: nobody but a page of this very server that knows the secret."""

from __future__ import annotations

import http.client
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from types import SimpleNamespace
from urllib.parse import urlsplit

import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.live import PATIENCE
from tests.view3d.pages import PROTOCOL, Page, asked_of
from vrs_cli.api.robot import Robot
from vrs_cli.errors import UsageError
from vrs_cli.interfaces.roles.observer import RecordedRobot
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.view3d.app import App
from vrs_cli.view3d.door import kept_secret, opened
from vrs_cli.view3d.guard import GOES_ON, OPENS


@pytest.fixture(scope="module")
def app() -> Iterator[App]:
    recorded = RecordedRobot(arm_for(load_robot("puma560")), Robot().timeline)
    app = App(lambda _told: recorded)
    yield app
    app.close()


@pytest.fixture(scope="module")
def port(app: App) -> int:
    return urlsplit(app.address).port or 0


def status(port: int, path: str, **headers: str) -> tuple[int, str]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    return answer.status, answer.read(200).decode()


def test_the_address_leads_to_the_page(app: App, port: int) -> None:
    code, text = status(port, urlsplit(app.address).path)
    assert code == 200
    assert text.lower().startswith("<!doctype html>")


def test_who_does_not_know_the_secret_gets_nothing(port: int) -> None:
    for path in ("/", "/index.html", "/x/", "/../", "//", "/?x", f"/{'A' * 24}/"):
        assert status(port, path) == (403, "open the address that vrs view tells, with all that is in it\n")


def test_a_name_that_leads_here_is_not_this_machine(app: App, port: int) -> None:
    """DNS rebinding: the browser believes that the page is the attacker's own."""
    path = urlsplit(app.address).path
    for host in ("evil.example", f"evil.example:{port}", "127.0.0.1.evil.example", "192.168.0.4", ""):
        assert status(port, path, Host=host)[0] == 403
    for host in (f"localhost:{port}", f"127.0.0.1:{port}", "localhost:9999"):  # the last through ssh -L
        assert status(port, path, Host=host)[0] == 200


@pytest.mark.parametrize(
    "origin", ["https://evil.example", "http://localhost:3000", "null", "http://127.0.0.1", "file://"]
)
def test_another_page_opens_no_socket(app: App, origin: str) -> None:
    with pytest.raises(InvalidStatus) as refused:
        connect(app.address.replace("http", "ws"), origin=origin, subprotocols=[PROTOCOL])
    assert refused.value.response.status_code == 403


def test_a_socket_wants_the_secret_too(port: int) -> None:
    for path in ("", "/", f"/{'A' * 24}"):
        with pytest.raises(InvalidStatus) as refused:
            connect(f"ws://127.0.0.1:{port}{path}", subprotocols=[PROTOCOL])
        assert refused.value.response.status_code == 403


def test_a_header_that_comes_twice_is_refused(app: App) -> None:
    for header in ("Origin", "Host"):
        with pytest.raises(InvalidStatus) as refused:
            connect(
                app.address.replace("http", "ws"),
                additional_headers=[(header, "http://127.0.0.1"), (header, "http://evil.example")],
                subprotocols=[PROTOCOL],
            )
        assert refused.value.response.status_code == 403


def test_the_page_itself_is_let_in(app: App) -> None:
    with Page(app.address) as page:
        assert page.until(lambda: page.of("FrameMessage"))


def test_no_way_is_opened_from_outside(app: App, monkeypatch: pytest.MonkeyPatch) -> None:
    """viser's page can ask for an address at a server of others that leads here: that is never asked for."""
    opened: list[object] = []
    monkeypatch.setattr(viser._viser, "ViserTunnel", lambda *it: opened.append(it))
    with Page(app.address) as page:
        page._send({"type": "ShareUrlRequest"})
        page.key("Play or pause")
        page.quiet(0.3)
    assert not opened


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.0.4", "example.org", ""])
def test_no_address_is_listened_at_that_others_reach(host: str) -> None:
    with pytest.raises(UsageError, match="for this machine alone"):
        opened(host)


def test_a_port_that_is_taken_is_said(port: int) -> None:
    with pytest.raises(UsageError, match=f"127.0.0.1:{port}: address already in use .*name another --port"):
        opened(port=port)


def test_a_page_that_comes_before_all_is_there_waits_at_the_door(monkeypatch: pytest.MonkeyPatch) -> None:
    """viser answers from a thread of its own while it is still made."""
    recorded = RecordedRobot(arm_for(load_robot("puma560")), Robot().timeline)
    door, make, pages = opened(), viser.ViserServer.__init__, list[Page]()
    coming = Thread(target=lambda: pages.append(Page(door.address)))

    def made(self: viser.ViserServer, **options: object) -> None:
        make(self, **options)
        coming.start()
        connection = http.client.HTTPConnection(*door.listening.getsockname(), timeout=PATIENCE)
        connection.request("GET", urlsplit(door.address).path)
        assert connection.getresponse().status == 200, "it has what it is made of"

    monkeypatch.setattr(viser.ViserServer, "__init__", made)
    app = App(lambda _told: recorded, door=door)
    coming.join()
    with pages[0] as page:
        page.until(lambda: page.of("SetPositionMessage"))
    app.close()


def test_a_viser_that_opens_its_server_in_another_way_is_not_served(monkeypatch: pytest.MonkeyPatch) -> None:
    from vrs_cli.view3d import guard

    monkeypatch.setattr(guard, "sockets", SimpleNamespace())
    with pytest.raises(RuntimeError, match="nobody would guard it"):
        App(lambda _told: pytest.fail("nobody comes"))


def test_what_no_page_sends_is_told_in_a_line(capfd: pytest.CaptureFixture[str]) -> None:
    told: list[str] = []
    recorded = RecordedRobot(arm_for(load_robot("puma560")), Robot().timeline)
    app = App(lambda _told: recorded, tell=told.append)
    with Page(app.address) as page:
        slider = page.gui("GuiSliderMessage")
        page.set(slider["uuid"], None)
        page.key("Play or pause")
        page.until(lambda: told or not page.quiet(0.1))
    app.close()
    assert "internal error: TypeError" in told[0]
    assert "Traceback" not in capfd.readouterr().err


def test_a_page_that_nobody_sees_is_furnished_too(app: App) -> None:
    with Page(app.address, image_width=0, image_height=0) as page:
        page.until(lambda: page.told_of_time() or page.said())
        assert page.said() == []


def test_the_page_finds_out_that_vrs_has_ended_and_says_so(app: App) -> None:
    assert asked_of(app.address, "there") == (200, '{"drives": false, "lost": ""}')
    code, text = asked_of(app.address, "")
    assert code == 200
    assert text.rindex("</html>") < text.index("vrs view has ended") < text.index(OPENS)


def test_a_page_of_before_is_let_in_where_the_secret_is_kept(tmp_path: Path) -> None:
    recorded = RecordedRobot(arm_for(load_robot("puma560")), Robot().timeline)
    addresses = []
    for _ in range(2):
        secret = kept_secret(tmp_path / "state" / "view" / "8001")
        app = App(lambda _told: recorded, door=opened(secret=secret))
        addresses.append(urlsplit(app.address).path)
        assert GOES_ON in asked_of(app.address, "")[1]
        app.close()
    assert addresses[0] == addresses[1] == f"/{secret}/"
    assert (tmp_path / "state" / "view" / "8001").stat().st_mode & 0o077 == 0
    assert kept_secret(tmp_path / "state" / "view" / "8002") != secret
    (tmp_path / "no folder").touch()
    assert kept_secret(tmp_path / "no folder" / "8001") == "", "a new one each time"
