"""vrs view: what is watched, and what it says where it cannot be."""

from __future__ import annotations

import webbrowser
from collections.abc import Iterator
from io import StringIO
from pathlib import Path
from socket import create_server
from typing import NoReturn

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.input import PipeInput, create_pipe_input
from prompt_toolkit.output import DummyOutput

from tests.cli.conftest import Vrs
from tests.interfaces.terminals import RecordingTerminal
from tests.net.serving import serving
from vrs_cli.cli import view
from vrs_cli.cli.view import PROGRAM, TRY, DemoPlace, News, has_browser
from vrs_cli.errors import NonexistentFile
from vrs_cli.interfaces.monitor.explaining import Sight
from vrs_cli.interfaces.monitor.help import TUTORIAL
from vrs_cli.net import http
from vrs_cli.net.local_server import LocalRobot
from vrs_cli.net.messages import Activity, Clock, Done, Hello, Line
from vrs_cli.repl.front_end import Place
from vrs_cli.repl.player import Player
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.replies import ArmPicture

ROOT = Path(__file__).parents[2]


@pytest.fixture
def keys(monkeypatch: pytest.MonkeyPatch) -> Iterator[PipeInput]:
    """A terminal, and what is typed at it."""
    monkeypatch.setattr(view, "on_terminal", lambda: True)
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        yield pipe


@pytest.mark.usefixtures("saved")
def test_a_pipe_is_no_terminal(vrs: Vrs) -> None:
    ended = vrs("view", "--terminal", "t.vrst")
    assert ended.status == 2
    assert ended.err.startswith("vrs view: this is no terminal (")


@pytest.mark.usefixtures("saved")
def test_a_trajectory_is_played_on_the_terminal(vrs: Vrs, keys: PipeInput) -> None:
    keys.send_text("q")
    assert vrs("view", "--terminal", "t.vrst") == (0, "", "")


CELL = ROOT / "programs" / "pick_and_place.toml"


@pytest.mark.parametrize(("given", "count"), [((), 0), (("--cell", str(CELL)), 4)])
@pytest.mark.usefixtures("saved")
def test_what_is_around_the_arm_is_on_the_terminal(
    vrs: Vrs, keys: PipeInput, monkeypatch: pytest.MonkeyPatch, given: tuple[str, ...], count: int
) -> None:
    seen, picture = list[ArmPicture](), Sight.picture

    def seeing(sight: Sight, timeline: Timeline, t: float) -> ArmPicture:
        seen.append(picture(sight, timeline, t))
        keys.send_text("q")
        return seen[-1]

    monkeypatch.setattr(Sight, "picture", seeing)
    assert vrs("view", "--terminal", "t.vrst", *given) == (0, "", "")
    assert {len(one.bodies) for one in seen} == {count}


def test_a_cell_that_is_wrong_is_told(vrs: Vrs, tmp_path: Path, keys: PipeInput, saved: Path) -> None:  # noqa: ARG001
    (tmp_path / "bad.toml").write_text("[[part]]\n")
    ended = vrs("view", "--terminal", str(saved), "--cell", str(tmp_path / "bad.toml"))
    assert ended.status != 0
    assert "bad.toml:1" in ended.err


def test_a_robot_that_is_served_is_watched(
    vrs: Vrs, keys: PipeInput, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []

    def text(player: Player) -> str:
        if shown and "bob drives; spin runs" in shown[-1] and "DRIVE 1, " in shown[-1]:
            keys.send_text("q")  # until it is read, the screen stays, though the arm may rest between two motions
        else:
            shown.append(drawn(player))  # what it does may be told later
        return shown[-1]

    drawn = Player.text
    monkeypatch.setattr(Player, "text", text)
    with serving(tmp_path, realtime=1.0) as server, server.call(hello=Hello((1,), name="bob")) as bob:
        bob.lines(".PROGRAM spin", "DO", "DRIVE 1, 20, 100", "DRIVE 1, -20, 100", "UNTIL FALSE", ".END")
        bob.send(lambda id: Line(id, "EXECUTE spin"))
        assert vrs("view", "--terminal", server.address) == (0, "", "")
    assert all("   live, rate 1" in text for text in shown)
    assert "DRIVE 1, " in shown[-1]


def test_ctrl_x_stops_a_robot_that_is_watched(
    vrs: Vrs, keys: PipeInput, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pressed, shown = [], [""]

    def text(player: Player) -> str:
        shown.append(drawn(player))
        if "bob drives; spin runs" in shown[-1] and not pressed:
            pressed.append(keys.send_text("\x18"))
        elif "Program stopped at spin" in shown[-1]:
            keys.send_text("q")
        return shown[-1]

    drawn = Player.text
    monkeypatch.setattr(Player, "text", text)
    with serving(tmp_path, realtime=1.0) as server, server.call(hello=Hello((1,), name="bob")) as bob:
        bob.lines(".PROGRAM spin", "DO", "DRIVE 1, 20, 100", "DRIVE 1, -20, 100", "UNTIL FALSE", ".END")
        id = bob.send(lambda id: Line(id, "EXECUTE spin"))
        assert vrs("view", "--terminal", server.address) == (0, "", "")
        bob.until(lambda message: isinstance(message, Done) and message.id == id)
    assert any("^X ABORT" in text for text in shown)


@pytest.mark.parametrize(("ahead", "told"), [("auto", ""), ("300ms", "0.300 s ahead of what is heard")])
def test_a_robot_is_seen_as_it_will_be(
    ahead: str, told: str, vrs: Vrs, keys: PipeInput, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []

    def text(player: Player) -> str:
        shown.append(drawn(player))
        if "s ahead of what is heard, D_f + D_b is 0." in shown[-1] and told in shown[-1]:
            keys.send_text("q")
        return shown[-1]

    drawn = Player.text
    monkeypatch.setattr(Player, "text", text)
    with serving(tmp_path, realtime=1.0, journal=False) as server:
        assert vrs("view", "--terminal", "--ahead", ahead, server.address) == (0, "", "")


@pytest.mark.usefixtures("keys")
def test_ahead_is_a_time(vrs: Vrs) -> None:
    ended = vrs("view", "--terminal", "--ahead", "soon", "ws://127.0.0.1:1")
    assert ended.status == 2
    assert "--ahead: 'soon' is no duration; as 200ms, 0.2s or 0.2, or auto" in ended.err


@pytest.mark.usefixtures("keys")
@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("gone.vrst", "vrs view: *Nonexistent file* gone.vrst"),
        ("ws://127.0.0.1:1", "vrs view: *Request refused* ws://127.0.0.1:1 does not answer"),
        ("http://here", "vrs view: http://here is no address of a robot"),
    ],
)
def test_what_is_not_there_is_said(vrs: Vrs, target: str, said: str) -> None:
    ended = vrs("view", "--terminal", target)
    assert ended.err.startswith(said)
    assert ended.status in (1, 2)
    assert ended.err.count("\n") == 1


def test_who_drives_what_runs_and_that_the_line_is_cut() -> None:
    news = News()
    assert news.line() == ""
    news.hear(Activity())
    assert news.line() == "nobody drives; no program runs"
    news.hear(Activity("ann", ("pick", "place")))
    news.hear(Clock(1.0))
    assert news.line() == "ann drives; pick, place run"
    news.cut("the connection was cut; it is tried again")
    assert news.line() == "the connection was cut; it is tried again"


# --- in a browser: the page itself is tried in tests/page/test_view.py ------------------------------------------------


@pytest.fixture(autouse=True)
def _page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A page is built, whatever is in it."""
    (tmp_path / "built").mkdir()
    (tmp_path / "built" / "index.html").write_text("")
    monkeypatch.setattr(http, "BUILT_PAGE", tmp_path / "built")


def test_a_page_that_others_reach_is_refused(vrs: Vrs) -> None:
    ended = vrs("view", "--host", "0.0.0.0", "--no-open")
    assert ended.status == 2
    assert ended.err.startswith("vrs view: --host 0.0.0.0: the page is for this machine alone")
    assert ended.err.count("\n") == 1


def test_a_port_that_is_taken_is_said(vrs: Vrs) -> None:
    with create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        ended = vrs("view", "--port", str(port), "--no-open")
    assert ended.status == 2
    assert f"127.0.0.1:{port}: address already in use" in ended.err


def test_without_the_page_it_is_said_how_to_build_it(vrs: Vrs, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(http, "BUILT_PAGE", tmp_path / "nothing")
    ended = vrs("view")
    assert ended.status == 2
    assert "the page is not built here" in ended.err
    assert "hatch_build.py" in ended.err


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("gone.vrst", "vrs view: *Nonexistent file* gone.vrst"),
        ("gone.v2", "vrs view: *Nonexistent file* gone.v2"),
        ("ws://127.0.0.1:1", "vrs view: *Request refused* ws://127.0.0.1:1 does not answer"),
        ("http://here", "vrs view: http://here is no address of a robot"),
    ],
)
def test_what_is_not_there_has_no_page(vrs: Vrs, target: str, said: str) -> None:
    ended = vrs("view", "--no-open", target)
    assert ended.err.startswith(said)
    assert (ended.status in (1, 2), ended.out, ended.err.count("\n")) == (True, "", 1)


def test_what_is_wrong_with_a_program_is_said_before_there_is_a_page(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "bad.v2").write_text(".PROGRAM bad\nMOVE\n.END\n")
    ended = vrs("view", "--no-open", "bad.v2")
    assert ended.status == 1
    assert "bad.v2:2" in ended.err


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
