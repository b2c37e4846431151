"""What is typed while something runs."""

from __future__ import annotations

import os
import sys

import pytest

termios = pytest.importorskip("termios")
pty = pytest.importorskip("pty")

from vrs_cli.repl.interactive import without_echo  # noqa: E402 (Windows has neither of them)


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
