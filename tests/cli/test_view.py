"""vrs view: what is watched, and what it says where it cannot be."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.input import PipeInput, create_pipe_input
from prompt_toolkit.output import DummyOutput

from tests.cli.conftest import Vrs
from tests.net.serving import serving
from vrs_cli.cli import view
from vrs_cli.cli.view import News
from vrs_cli.net.messages import Activity, Clock, Hello, Line
from vrs_cli.repl.player import Player


@pytest.fixture
def keys(monkeypatch: pytest.MonkeyPatch) -> Iterator[PipeInput]:
    """A terminal, and what is typed at it."""
    monkeypatch.setattr(view, "is_at_terminal", lambda: True)
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


def test_a_robot_that_is_served_is_watched(
    vrs: Vrs, keys: PipeInput, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []

    def text(player: Player) -> str:
        shown.append(drawn(player))
        if "bob drives; spin runs" in shown[-1] and "DRIVE 1, " in shown[-1]:  # what it does may be told later
            keys.send_text("q")
        return shown[-1]

    drawn = Player.text
    monkeypatch.setattr(Player, "text", text)
    with serving(tmp_path, realtime=1.0) as server, server.call(hello=Hello((1,), name="bob")) as bob:
        bob.lines(".PROGRAM spin", "DO", "DRIVE 1, 20, 100", "DRIVE 1, -20, 100", "UNTIL FALSE", ".END")
        bob.send(lambda id: Line(id, "EXECUTE spin"))
        assert vrs("view", "--terminal", server.address) == (0, "", "")
    assert all("   live, rate 1" in text for text in shown)
    assert "DRIVE 1, " in shown[-1]


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
