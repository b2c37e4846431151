from __future__ import annotations

import io

import pytest

from vrs_cli.render.progress import DELAY, PERIOD, RunProgress, reading_progress


class Screen(io.StringIO):
    """A terminal that stores its output."""

    def __init__(self, terminal: bool) -> None:
        super().__init__()
        self.terminal = terminal

    def isatty(self) -> bool:
        return self.terminal


def shown_on(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> Screen:
    """Replace standard error until the end of the test."""
    monkeypatch.setenv("TERM", "xterm")
    screen = Screen(terminal)
    monkeypatch.setattr("sys.stderr", screen)
    return screen


@pytest.mark.parametrize("terminal", [True, False])
def test_a_long_run_shows_its_time_on_a_terminal_only(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> None:
    screen = shown_on(monkeypatch, terminal)
    wall = [0.0]
    with RunProgress("pick", wall=lambda: wall[0]) as progress:
        progress(1.0)
        assert screen.getvalue() == ""
        wall[0] = DELAY
        progress(12.5)
        progress(13.5)
    assert ("t = 12.50 s" in screen.getvalue()) is terminal
    assert "13.5" not in screen.getvalue()


@pytest.mark.parametrize("terminal", [True, False])
def test_it_hides_for_other_text_and_comes_back(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> None:
    screen = shown_on(monkeypatch, terminal)
    wall = [0.0]
    progress = RunProgress("pick", wall=lambda: wall[0])
    wall[0] = DELAY
    progress(1.0)
    progress.hide()
    screen.write("TYPED\n")
    wall[0] += PERIOD
    progress(2.0)
    progress.hide()
    _, _, after = screen.getvalue().partition("TYPED\n")
    assert ("t = 2.00 s" in after) is terminal


def test_a_file_tells_how_much_of_it_has_been_read(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = shown_on(monkeypatch, terminal=True)
    with reading_progress("day.vrst") as progress:
        progress._next = 0.0  # the wall clock of this one is real
        progress(0.42)
    assert "reading day.vrst" in screen.getvalue()
    assert "42%" in screen.getvalue()
