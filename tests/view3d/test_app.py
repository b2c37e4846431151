"""Browsers come and go, servers too: each window shows its robot, and the others go on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from socket import create_server

import pytest

from tests.live import until
from tests.net.serving import serving
from tests.view3d.pages import Page, lost_of
from vrs_cli.engine.position import position_at
from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces.dialogue import no_answer
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.client import hello_of
from vrs_cli.net.hosted import SHELL, Hosted
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.net.tokens import add_tokens
from vrs_cli.values.acts import Define
from vrs_cli.view3d.app import App
from vrs_cli.view3d.parts import Shown


@pytest.fixture(scope="module")
def hosted() -> Iterator[Hosted]:
    hosted = Hosted(load_robot("puma560"))
    yield hosted
    hosted.close()


@contextmanager
def viewing(address: str) -> Iterator[App]:
    """A robot afar."""
    app = App(lambda told: SocketPort.connect(address, hello_of(name="browser"), told=told))
    try:
        yield app
    finally:
        app.close()


def test_two_browsers_see_the_same_and_have_a_time_of_their_own(app: App, hosted: Hosted) -> None:
    with Page(app.address) as one, Page(app.address) as other:
        until(lambda: len(app.windows) == 2)
        first, second = app.windows
        shell = Supervisor(hosted.hold(who=SHELL))
        shell.say("MOVE #PPOINT(60, -80, 80, 0, 0, 0)", no_answer)
        shell.close()
        for page in (one, other):
            page.until(lambda page=page: "MOVE #PPOINT(60" in page.html())
        one.key("Play or pause")
        one.until(lambda: not first.playback.playing or not second.playback.playing)
        assert first.playback.playing != second.playback.playing
    until(lambda: not app.windows)


def test_a_page_is_told_of_the_robot_where_it_stands_before_there_are_panels(app: App) -> None:
    with Page(app.address) as page:
        page.until(lambda: page.of("GuiSliderMessage"))
        first = next(k for k, message in enumerate(page.told) if message["type"] == "GuiButtonGroupMessage")
        named = {(message["type"], message.get("name")) for message in page.told[:first]}
    assert ("SetOrientationMessage", "/robot/0/1/2") in named
    assert ("SetPositionMessage", "/tool") in named


def test_the_shell_and_the_browser_of_one_user_do_not_keep_each_other_out(app: App, hosted: Hosted) -> None:
    shell = Supervisor(hosted.hold(who=SHELL))
    with Page(app.address):
        until(lambda: app.windows)
        robot = Supervisor(app.windows[0].robot)
        for holder in (robot, shell, robot):
            holder.say("DRIVE 1, 5", no_answer)
    shell.close()


def test_what_is_shown_is_where_g_puts_the_arm(app: App) -> None:
    with Page(app.address) as page:
        until(lambda: app.windows)
        window = app.windows[0]
        assert window.robot is not None
        Supervisor(window.robot).say("MOVE #PPOINT(-30, -70, 70, 10, 20, 30)", no_answer)
        until(lambda: window.watched.now > window.watched.timeline.end)
        expected = position_at(window.watched.arm, window.watched.timeline, window.watched.now).T_world_tool
        page.until(lambda: page.is_at("/tool", expected))


def is_let_go(robot: SocketPort) -> bool:
    try:
        Supervisor(robot).say("WHERE", no_answer)
    except RequestRefused:
        return True
    return False


def test_each_browser_is_a_holder_and_gone_with_it(app: App) -> None:
    with Page(app.address):
        until(lambda: app.windows)
        robot = app.windows[0].robot
        assert robot is not None
        assert robot.welcome.name.startswith("browser")
    until(lambda: is_let_go(robot))
    assert not app.windows


def test_the_first_browser_is_greeted_once(hosted: Hosted) -> None:
    greeted: list[object] = []
    app = App(hosted.hold, first=greeted.append)
    with Page(app.address):
        until(lambda: greeted)
        with Page(app.address):
            until(lambda: len(app.windows) == 2)
    app.close()
    assert len(greeted) == 1


def test_a_part_at_fault_is_told_of_and_the_others_go_on(app: App) -> None:
    class Wrong:
        def show(self, _shown: Shown) -> None:
            raise ZeroDivisionError("no such thing")

    with Page(app.address) as page:
        until(lambda: app.windows)
        window = app.windows[0]
        wrong = Wrong()
        window.parts.insert(0, wrong)
        page.until(lambda: any("internal error: ZeroDivisionError" in said for said in page.said()))
        assert wrong not in window.parts
        page.key("Play or pause")
        page.until(lambda: not window.playback.playing)
        assert len(page.said()) == 1


def test_what_a_button_does_wrong_is_said(app: App) -> None:
    with Page(app.address) as page:
        until(lambda: app.windows)
        window = app.windows[0]
        assert window.robot is not None
        robot = window.robot
        window.doing(lambda: Supervisor(robot).say("MOVE nowhere", no_answer))(None)
        page.until(lambda: any("nowhere" in said for said in page.said()))
        window.doing(lambda: 1 // 0)(None)
        page.until(lambda: any("internal error" in said for said in page.said()))


# --- a robot afar ----------------------------------------------------------------------------------------------------


@pytest.fixture
def port() -> int:
    with create_server(("127.0.0.1", 0)) as free:
        return int(free.getsockname()[1])


def test_a_server_that_goes_and_comes_back_is_until(tmp_path: Path, port: int) -> None:
    before = ExitStack()
    server = before.enter_context(serving(tmp_path, port=port, journal=False))
    with viewing(server.address) as app, Page(app.address) as page:
        until(lambda: app.windows)
        window = app.windows[0]
        server.call().lines("MOVE #PPOINT(60, -80, 80, 0, 0, 0)")
        page.until(lambda: "MOVE #PPOINT(60" in page.html())
        before.close()
        until(lambda: lost_of(app.address).startswith("No connection to the robot since "))
        with serving(tmp_path, port=port, journal=False) as again:
            until(lambda: lost_of(app.address) == "")
            again.call().lines("MOVE #PPOINT(-44, -80, 80, 0, 0, 0)")
            page.until(lambda: "MOVE #PPOINT(-44" in page.html())
            assert app.windows == (window,)


def test_a_browser_that_comes_while_the_server_is_away_is_shown_so(
    tmp_path: Path, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vrs_cli.view3d.app.AGAIN", 0.1)
    with viewing(f"ws://127.0.0.1:{port}") as app, Page(app.address) as page:
        page.until(lambda: any("does not answer" in str(m) for m in page.of("NotificationUpdateMessage")))
        with serving(tmp_path, port=port):
            page.until(lambda: app.windows)
            until(lambda: lost_of(app.address) == "")


def test_who_may_only_look_has_nothing_to_drive_with(tmp_path: Path) -> None:
    file = tmp_path / "tokens.toml"
    tokens = add_tokens(file, ["eve"], "observer") | add_tokens(file, ["ada"]) | add_tokens(file, ["tea"], "teacher")
    with serving(tmp_path, tokens=tmp_path / "tokens.toml") as server:
        for name, drives in (("eve", False), ("ada", True), ("tea", True)):
            hello = hello_of(tokens[name])
            app = App(lambda told, hello=hello: SocketPort.connect(server.address, hello, told=told))
            with Page(app.address):
                until(lambda app=app: app.windows)
                assert app.windows[0].drives is drives
            app.close()


def test_the_folder_of_a_user_may_be_as_full_as_it_is(tmp_path: Path) -> None:
    with (tmp_path / "film.mp4").open("wb") as film:
        film.truncate(500_000_000)
    hosted = Hosted(load_robot("puma560"), folder=tmp_path)
    robot = Supervisor(hosted.hold(who=SHELL))
    robot.act(Define(".PROGRAM there\nREADY\n.END\n"))
    robot.say("STORE there", no_answer)
    assert (tmp_path / "there.v2").exists()
    hosted.close()


def test_a_page_that_cannot_be_furnished_lets_its_robot_go(hosted: Hosted, monkeypatch: pytest.MonkeyPatch) -> None:
    held: list[SocketPort] = []

    def hold(told: Callable[[str], None]) -> SocketPort:
        held.append(hosted.hold(told))
        return held[-1]

    def fail(*_it: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("vrs_cli.view3d.app.furnish", fail)
    app = App(hold)
    try:
        with Page(app.address) as page:
            assert "internal error: ZeroDivisionError" in page.until(page.said)[0]
            halls = [message["hdri_data"] for message in page.of("EnvironmentMapMessage")]
            assert halls == [None], "no page begins with viser's picture of a hall"
            until(lambda: not held[0].open)
    finally:
        app.close()
