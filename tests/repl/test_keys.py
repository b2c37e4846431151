"""What is typed while something runs."""

from __future__ import annotations

import os
import sys
from threading import Event

import pytest

from tests.live import PATIENCE
from vrs_cli.repl.interactive import BackgroundValue, without_echo

termios = pytest.importorskip("termios")
pty = pytest.importorskip("pty")


@pytest.mark.parametrize("signals", [True, False])
def test_a_terminal_shows_nothing_meanwhile_and_takes_what_is_typed(
    signals: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    keyboard, terminal = pty.openpty()
    with open(keyboard, "r+b", buffering=0) as typed, open(terminal) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        before = termios.tcgetattr(stdin)
        with without_echo(signals=signals):
            assert not termios.tcgetattr(stdin)[3] & termios.ECHO
            typed.write(b"LISTR\x03WHERE\n")
            assert stdin.readline() == ("WHERE\n" if signals else "LISTR\x03WHERE\n")
        assert termios.tcgetattr(stdin) == before
        typed.write(b"!")
        assert typed.read(100) == b"!"


def test_what_is_no_terminal_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    with open(os.devnull) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        with without_echo(signals=True):
            pass


def test_nothing_is_made_before_it_is_begun() -> None:
    made: list[int] = []
    background = BackgroundValue(lambda: made.append(1) or "robot")
    assert (background.ready, made) == (None, [])


def test_it_is_made_once_and_waited_for() -> None:
    made: list[int] = []
    gate, told = Event(), Event()

    def make() -> str:
        gate.wait(PATIENCE)
        made.append(1)
        return "robot"

    background = BackgroundValue(make, told.set)
    background.begin()
    background.begin()
    assert background.ready is None
    gate.set()
    assert (background.wait(), background.wait()) == ("robot", "robot")
    assert (told.wait(PATIENCE), made, background.ready) == (True, [1], "robot")


def test_whoever_waits_gets_the_error() -> None:
    def make() -> str:
        raise FileNotFoundError("no robot")

    background = BackgroundValue(make)
    with pytest.raises(FileNotFoundError, match="no robot"):
        background.wait()
