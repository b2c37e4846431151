"""vrs demo: the sample on a pipe, on the terminal and on the page."""

from __future__ import annotations

import webbrowser
from io import StringIO
from typing import NoReturn

import pytest

from tests.cli.conftest import Vrs
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.cli import view
from vrs_cli.cli.view import PROGRAM, TRY, DemoPlace, has_browser
from vrs_cli.errors import NonexistentFile
from vrs_cli.interfaces.monitor.help import TUTORIAL
from vrs_cli.net.local_server import LocalRobot
from vrs_cli.repl.place import Place


@pytest.fixture
def places(monkeypatch: pytest.MonkeyPatch) -> list[Place]:
    """A terminal without a browser; the places at which the shell was to run."""
    found = list[Place]()
    monkeypatch.setattr(view, "on_terminal", lambda: True)
    monkeypatch.setattr(view, "has_browser", lambda: False)
    monkeypatch.setattr(view, "at", lambda place: found.append(place) or 0)
    return found


def test_on_a_pipe_the_sample_runs_and_ends(vrs: Vrs) -> None:
    ended = vrs("demo")
    assert ended.status == 0
    assert ended.out.startswith("Picked at")
    assert ended.out.endswith("Program completed\n")


@pytest.mark.parametrize("arguments", [(), ("--terminal",)])
def test_without_a_browser_the_arm_is_shown_on_the_terminal(
    vrs: Vrs, places: list[Place], capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...]
) -> None:
    assert vrs("demo", *arguments).status == 0
    (place,) = places
    assert isinstance(place, DemoPlace)
    assert place.clock is not None
    front_end = place.front_end(RecordingTerminal())
    lines = list[str]()
    front_end.take = lines.append  # type: ignore[method-assign]
    front_end.opening()
    assert lines == [f"EXECUTE {PROGRAM}", "SHOW"]
    assert TRY in capsys.readouterr().out


def test_where_the_page_is_not_built_the_arm_is_shown_on_the_terminal(
    vrs: Vrs, places: list[Place], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_options: object) -> NoReturn:
        raise NonexistentFile("the page", "build it")

    monkeypatch.setattr("vrs_cli.cli.view.page_place", refuse)
    assert "build it" in vrs("demo", "--no-open").out
    assert len(places) == 1


@pytest.mark.usefixtures("places")
def test_the_page_executes_the_sample_and_the_shell_beside_it_does_not(
    vrs: Vrs, monkeypatch: pytest.MonkeyPatch
) -> None:
    first_lines = list[str]()

    def look(_options: object, _stack: object, local_robot: LocalRobot) -> int:
        (room,) = local_robot.hub.rooms.values()
        port = local_robot.hold()  # attended, as the shell beside the page
        first_lines.extend((port.welcome.first_line, room.first_line))
        port.close()
        return 0

    monkeypatch.setattr("vrs_cli.cli.view.run_beside", look)
    monkeypatch.setattr("vrs_cli.cli.view.page_place", lambda _options: None)
    assert vrs("demo", "--no-open").status == 0
    assert first_lines == ["", f"EXECUTE {PROGRAM}"]


def test_the_lines_to_try_are_carried_out(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", StringIO("\n".join(TRY.splitlines()[2:])))
    assert vrs("shell").status == 0


@pytest.mark.parametrize(
    ("found", "environment", "opens"),
    [
        (webbrowser.BackgroundBrowser("firefox"), {}, True),
        (webbrowser.GenericBrowser("w3m"), {}, False),
        (webbrowser.GenericBrowser("mine %s"), {"BROWSER": "mine %s"}, True),
        (None, {}, False),
    ],
)
def test_a_browser_of_the_terminal_is_none(
    monkeypatch: pytest.MonkeyPatch,
    found: webbrowser.BaseBrowser | None,
    environment: dict[str, str],
    opens: bool,
) -> None:
    def get() -> webbrowser.BaseBrowser:
        if found is None:
            raise webbrowser.Error("none")
        return found

    monkeypatch.setattr(webbrowser, "get", get)
    monkeypatch.setattr("os.environ", environment)
    assert has_browser() is opens


def test_the_lines_of_the_tutorial_are_carried_out(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = [line for line, _ in TUTORIAL if not line.startswith("vrs ")]
    monkeypatch.setattr("sys.stdin", StringIO("\n".join(lines)))
    ended = vrs("shell")
    assert ended.status == 0
    assert "Hello from" in ended.out, "the sample program was executed"


@pytest.mark.parametrize("line", ["VIEW", "PICTURE", "vrs view", "HELP view", "HELP picture"])
def test_a_newcomer_finds_the_picture(vrs: Vrs, monkeypatch: pytest.MonkeyPatch, line: str) -> None:
    monkeypatch.setattr("sys.stdin", StringIO(line))
    told = vrs("shell").out
    assert "SHOW" in told or "HELP VIEW" in told
