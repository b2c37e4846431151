"""Test `vrs view` as a process with its page: a robot, a program, a trajectory, a served robot."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from math import inf
from pathlib import Path
from socket import create_server
from typing import TYPE_CHECKING
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest

from tests.live import PATIENCE
from tests.page.browser import drawn, line, until
from vrs_cli.net.tokens import add_tokens

if TYPE_CHECKING:
    from playwright.sync_api import Page

ROOT = Path(__file__).parents[2]
SPIN = ".PROGRAM spin\nDO\nDRIVE 1, 20, 100\nDRIVE 1, -20, 100\nUNTIL FALSE\n.END\n"
OUTPUT = "document.querySelector('[data-slot=output]').innerText"


@contextmanager
def started(folder: Path, *words: str, stdin: str = "", **more: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start a command of vrs, and return the last word of its first line."""
    process = subprocess.Popen(
        [sys.executable, "-m", "vrs_cli", *words], cwd=folder,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(folder / "state"), **more},
    )  # fmt: skip
    try:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(stdin)
        process.stdin.close()
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait()
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()


def view(folder: Path, *words: str, **options: str) -> object:
    return started(folder, "view", "--no-open", *words, **options)


def opened(page: Page, said: str) -> None:
    """Open the page at a printed address."""
    page.goto(said.split()[-1])
    drawn(page)


def free_port() -> int:
    with create_server(("127.0.0.1", 0)) as it:
        return int(it.getsockname()[1])


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_the_first_page_executes_the_program_and_a_signal_ends_it(tmp_path: Path, page: Page, number: int) -> None:
    (tmp_path / "spin.v2").write_text(SPIN)
    with started(tmp_path, "view", "--no-open", "spin.v2") as (process, said):
        opened(page, said)
        until(page, f"{OUTPUT}.includes('EXECUTE spin')")
        until(page, "app.source.timeline.segments.some(s => s.motion.text == 'DRIVE 1, 20, 100')")
        assert "token" not in page.url, "the secret leaves the address"
        page.reload()
        drawn(page)
        other = page.context.new_page()
        opened(other, said)
        for one in (page, other):
            until(one, "app.connection.state == 'open'")
            assert one.evaluate("app.connection.welcome.first_line ?? ''") == "", "it is executed once"
        other.close()
        process.send_signal(number)
        assert process.wait(PATIENCE) == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""
        until(page, "document.body.classList.contains('cut')")


@pytest.mark.long
def test_a_program_may_wait_for_its_user(tmp_path: Path, page: Page) -> None:
    (tmp_path / "spin.v2").write_text(SPIN)
    with started(tmp_path, "view", "--no-open", "--no-run", "spin.v2") as (_process, said):
        opened(page, said)
        assert page.evaluate("app.connection.welcome.first_line ?? ''") == ""
        line(page, "DIRECTORY")
        until(page, f"{OUTPUT}.includes('spin') || document.body.innerText.includes('spin')")
        assert page.evaluate("app.source.timeline.segments.length") == 1


@pytest.mark.long
def test_lines_of_a_pipe_are_carried_out_and_the_page_stays(tmp_path: Path, page: Page) -> None:
    with started(tmp_path, "view", "--no-open", stdin="MOVE #PPOINT(33, -80, 80, 0, 0, 0)\n") as (process, said):
        opened(page, said)
        until(page, "app.source.timeline.segments.some(s => s.motion.text?.startsWith('MOVE #PPOINT(33'))")
        line(page, "DRIVE 1, 5")
        process.terminate()
        assert process.wait(PATIENCE) == 0


@pytest.mark.long
def test_the_cell_of_a_program_is_around_its_robot(tmp_path: Path, page: Page) -> None:
    (tmp_path / "take.v2").write_text(".PROGRAM take\nWAIT SIG(1001)\nDRIVE 1, 20, 100\n.END\n")
    (tmp_path / "take.toml").write_text(
        '[[part]]\nname = "box"\nshape = "box"\nsize = [40, 40, 60]\nat = [0, 550, -250]\n'
        '[[sensor]]\nname = "there"\nsignal = 1001\nkind = "beam"\nfrom = [-100, 550, -250]\nto = [100, 550, -250]\n'
    )
    with started(tmp_path, "view", "--no-open", "take.v2") as (process, said):
        opened(page, said)
        until(page, "app.source.timeline.segments.some(s => s.motion.text == 'DRIVE 1, 20, 100')")
        assert page.evaluate("app.connection.welcome.cell.scene.parts.map(p => p.name)") == ["box"]
        process.terminate()
        assert process.wait(PATIENCE) == 0
        assert process.stderr is not None
        assert process.stderr.read() == "vrs view: the cell is take.toml (beside take.v2)\n"


@pytest.mark.long
def test_a_page_goes_on_when_vrs_view_is_started_again_at_its_port(tmp_path: Path, page: Page) -> None:
    port = str(free_port())
    with started(tmp_path, "view", "--no-open", "--port", port) as (process, said):
        opened(page, said)
        line(page, "DRIVE 1, 10")
        process.kill()
        until(page, "document.body.classList.contains('cut')")
        assert "is not heard since" in page.inner_text("body")
    with started(tmp_path, "view", "--no-open", "--port", port) as (_process, again):
        assert again == said, "the secret is kept"
        until(page, "!document.body.classList.contains('cut')")
        until(page, "app.source.timeline.segments.length == 1")
        line(page, "DRIVE 1, 20")
        until(page, "app.source.timeline.segments.length > 1")
    secret = tmp_path / "state" / "vrs" / "view" / port
    assert secret.stat().st_mode & 0o777 == 0o600
    assert secret.read_text() in said


@pytest.mark.long
def test_a_saved_trajectory_is_played_at_its_rate(tmp_path: Path, page: Page) -> None:
    (tmp_path / "one.v2").write_text(".PROGRAM one\nDRIVE 1, 90, 10\n.END\n")
    with started(tmp_path, "run", "one.v2", "--save", "day.vrst") as (run, _):
        assert run.wait(PATIENCE) == 0
    with started(tmp_path, "view", "--no-open", "day.vrst", "--rate", "0.5") as (_process, said):
        opened(page, said)
        assert page.title() == "day.vrst"
        assert page.evaluate("app.playback.rate") == 0.5
        assert page.evaluate("app.source.timeline.segments.some(s => s.motion.text == 'DRIVE 1, 90, 10')")
        page.evaluate("app.playback.seek(app.source.timeline.end)")
        angle = "Math.round(app.shown.q[0] * 180 / Math.PI)"
        until(page, f"app.shown ? {angle} == 90 : document.body.innerText.includes('90.0')")
        page.reload()
        drawn(page)
        with pytest.raises(HTTPError, match="401"):
            urlopen(f"{page.url.partition('/view/')[0]}/recording/day.vrst.json")


def test_a_wrong_secret_shows_nothing(tmp_path: Path, page: Page) -> None:
    with started(tmp_path, "view", "--no-open") as (_process, said):
        page.goto(said.split()[-1].partition("#")[0] + "#token=another")
        until(page, "document.body.innerText.includes('this token is not known here')")


# --- a robot that is served elsewhere --------------------------------------------------------------------------------


@contextmanager
def far_robot(folder: Path, *words: str, delay: str = "") -> Iterator[tuple[str, ExitStack]]:
    """Serve a robot in real time behind a delay line; return its address. The stack ends the server."""
    with ExitStack() as stack, ExitStack() as server:
        _, said = server.enter_context(started(folder, "serve", "--port", "0", "--realtime", *words))
        address = said.split()[2].rstrip(",")
        if delay:
            ways = ("--forward", delay, "--backward", delay)
            _, line = stack.enter_context(started(folder, "lab", "delay", "0", address.removeprefix("ws://"), *ways))
            address = f"ws://{line.split()[0]}"
        yield address, server


@pytest.mark.long
def test_a_robot_elsewhere_is_predicted(tmp_path: Path, page: Page) -> None:
    """The delay is 0.15 s each way; the page never gets the token."""
    tokens = tmp_path / "tokens.toml"
    token = add_tokens(tokens, ["ada"])["ada"]
    with (
        far_robot(tmp_path, "--tokens", str(tokens), delay="150ms") as (address, _server),
        started(tmp_path, "view", "--no-open", address, VRS_TOKEN=token) as (process, said),
    ):
        assert token not in said
        opened(page, said)
        assert page.evaluate("app.connection.welcome.name") == "ada"
        delays = page.locator("section.delays")
        until(page, "!app.source.preview.near && app.source.preview.roundTrip >= 0.3")
        delays.get_by_label("The robot is shown").select_option("as it is heard, with a prediction")
        until(page, "app.source.preview.predicts")
        delays.get_by_text("predicted:").wait_for()
        ahead = page.evaluate("app.source.preview.shown(app.connection.now()) - app.source.now()")
        assert ahead == pytest.approx(page.evaluate("app.source.preview.roundTrip"), abs=1e-3)
        goal = {"kind": "Go", "goal": {"joints": [0.5, -1.5707, 1.5707, 0, 0, 0]}, "text": "MOVE far"}
        page.evaluate(
            """act => { window.unconfirmed = []; window.done = null;
                app.connection.on('preview', () => unconfirmed.push([app.source.preview.expected.map(e => e.text),
                    app.source.timeline.end > app.connection.timeline.end]));
                app.connection.ask('at', { act }).then(d => (done = d)); }""",
            goal,
        )
        until(page, "done && unconfirmed.length && !app.source.preview.expected.length")
        assert page.evaluate("done.ok ?? true")
        assert [["MOVE far"], True] in page.evaluate("unconfirmed"), "it was seen before the robot answered"
        assert page.evaluate("app.source.preview.unconfirmed(app.connection.now())") == inf
        process.terminate()
        assert process.wait(PATIENCE) == 0


@pytest.mark.long
def test_a_server_that_is_killed_comes_back(tmp_path: Path, page: Page) -> None:
    with ExitStack() as stack:
        port = str(free_port())
        serve = ("serve", "--port", port, "--realtime", "--journal", "journal")
        server, _ = stack.enter_context(started(tmp_path, *serve))
        _, said = stack.enter_context(started(tmp_path, "view", "--no-open", f"ws://127.0.0.1:{port}"))
        opened(page, said)
        line(page, "DRIVE 1, 10")
        server.kill()
        until(page, "document.body.classList.contains('cut')")
        assert page.evaluate("app.source.preview.away")
        assert page.title().endswith("(not heard)")
        stack.enter_context(started(tmp_path, *serve))
        until(page, "!document.body.classList.contains('cut')")
        assert page.evaluate("app.source.timeline.segments.some(s => s.motion.text == 'DRIVE 1, 10')")
        line(page, "DRIVE 1, 20")


@pytest.mark.long
def test_two_pages_are_two_holders(tmp_path: Path, page: Page) -> None:
    with (
        far_robot(tmp_path) as (address, _server),
        started(tmp_path, "view", "--no-open", address, "--name", "eve") as (_process, said),
    ):
        opened(page, said)
        other = page.context.new_page()
        opened(other, said)
        assert [one.evaluate("app.connection.welcome.name") for one in (page, other)] == ["eve", "eve-2"]
        line(page, "DRIVE 1, 20")
        until(other, "app.source.timeline.segments.some(s => s.motion.text == 'DRIVE 1, 20')")
        done = other.evaluate("app.connection.ask('line', { text: 'DRIVE 1, 5' })")
        assert (done["ok"], done["status"]["driver"]) == (False, "eve"), "one of them drives"
        other.close()
