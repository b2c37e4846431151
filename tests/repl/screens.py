"""A real shell on a terminal of tmux: keys in, rows of the screen out."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from types import MappingProxyType

import pytest

from tests.live import PATIENCE

PAUSE = 0.05  # [s] between two looks: they would take the time of the shell
NUMBERS = count()  # of servers: one that ends may still hold its socket
SIZE_OF_THE_PANE = {"COLUMNS": "", "LINES": ""}  # and not that of the terminal of the tests, which readline puts there
CHECKOUT = Path(__file__).parents[2]

needs_tmux = pytest.mark.skipif(shutil.which("tmux") is None, reason="there is no tmux")


class Screen:
    """One window of a tmux server of its own."""

    def __init__(self, folder: Path, columns: int, rows: int) -> None:
        self._tmux = ("tmux", "-S", str(folder / f"{next(NUMBERS)}.tmux"), "-f", os.devnull)
        self._place = ("-x", str(columns), "-y", str(rows), "-c", str(folder))

    def start(self, *arguments: str, environment: Mapping[str, str], under: Sequence[str]) -> None:
        """Begin `vrs` with these arguments; `under` a command that takes them."""
        given = [part for name, value in environment.items() for part in ("-e", f"{name}={value}")]
        command = (*under, sys.executable, "-m", "vrs_cli", *arguments)
        self._run("new-session", "-d", *self._place, *given, *command)
        self._run("set-option", "-g", "remain-on-exit", "on")

    def close_window(self) -> None:
        """What a terminal does to its processes when it is closed: SIGHUP, and no more input."""
        process = self.process
        self._run("kill-session")
        end = time.monotonic() + PATIENCE
        while _runs(process):
            assert time.monotonic() < end, "the shell does not end"
            time.sleep(PAUSE)

    def stop(self) -> None:
        """End the server and what runs in it."""
        with suppress(subprocess.CalledProcessError):
            self._run("kill-server")

    def type(self, *keys: str) -> None:
        """Text and names of keys (Enter, C-d)."""
        for key in keys:
            self._run("send-keys", *(("-l",) if len(key) > 1 and key not in _KEYS else ()), key)

    def paste(self, text: str) -> None:
        """As a terminal that brackets what is pasted."""
        self._run("set-buffer", "-b", "pasted", text)
        self._run("paste-buffer", "-p", "-b", "pasted")

    @property
    def process(self) -> int:
        """The process of the shell."""
        return int(self._run("list-panes", "-F", "#{pane_pid}"))

    @property
    def ended(self) -> bool:
        return self._run("list-panes", "-F", "#{pane_dead}").strip() == "1"

    def rows(self, *options: str) -> list[str]:
        """The screen from the first row that is not blank to the last."""
        return self._run("capture-pane", "-p", *options).rstrip("\n").split("\n")

    def wait(self, condition: Callable[[list[str]], bool]) -> list[str]:
        """The rows when they are as wanted."""
        end = time.monotonic() + PATIENCE
        while not condition(rows := self.rows()):
            assert time.monotonic() < end, "\n".join(rows)
            time.sleep(PAUSE)
        return rows

    def wait_for(self, text: str) -> list[str]:
        return self.wait(lambda rows: any(text in row for row in rows))

    def wait_for_end(self) -> None:
        self.wait(lambda _rows: self.ended)

    def _run(self, *arguments: str) -> str:
        done = subprocess.run((*self._tmux, *arguments), check=True, capture_output=True, text=True)
        return done.stdout


_KEYS = frozenset({"Enter", "C-d", "C-c", "Up", "Down", "Right", "BSpace", "Tab", "F1", "C-l", "C-q", "C-z", "Escape"})


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return "\nState:\tZ" not in Path(f"/proc/{process}/status").read_text() if Path("/proc").exists() else True


@contextmanager
def screen(
    folder: Path,
    *arguments: str,
    columns: int = 80,
    rows: int = 24,
    more: Mapping[str, str] = MappingProxyType({}),
    under: Sequence[str] = (),
) -> Iterator[Screen]:
    """A shell whose state lies in a folder of its own; `more` of its environment, `under` a command that starts it."""
    shell = Screen(folder, columns, rows)
    state = {
        "XDG_STATE_HOME": str(folder / "state"),
        "XDG_CONFIG_HOME": str(folder / "config"),
        "PYTHONPATH": str(CHECKOUT),
        "COLORTERM": "truecolor",
    }
    shell.start(*arguments, environment={**state, **SIZE_OF_THE_PANE, **more}, under=under)
    try:
        yield shell
    finally:
        shell.stop()
