"""A real shell on a pseudo-terminal: keys in, and the text that comes out, as soon as it comes."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tests.live import PATIENCE

try:
    import pty
    import termios
except ImportError:  # Windows has none
    pty = termios = None  # type: ignore[assignment]

CHECKOUT = Path(__file__).parents[2]
ROWS, COLUMNS = 24, 80


class Pty:
    """`vrs` with these arguments. `heard`: all of its output that no call of `until` has passed."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self._fd, terminal = pty.openpty()
        termios.tcsetwinsize(terminal, (ROWS, COLUMNS))
        state = {
            "XDG_STATE_HOME": str(folder / "state"),
            "XDG_CONFIG_HOME": str(folder / "config"),
            "PYTHONPATH": str(CHECKOUT),
            "PROMPT_TOOLKIT_NO_CPR": "1",  # nobody answers where the cursor is
            "TERM": "xterm",
            "COLUMNS": str(COLUMNS),
            "LINES": str(ROWS),
        }
        self.process = subprocess.Popen(
            [sys.executable, "-m", "vrs_cli", *arguments],
            stdin=terminal,
            stdout=terminal,
            stderr=terminal,
            env=os.environ | state,
            cwd=folder,
            start_new_session=True,
        )
        os.close(terminal)
        self.heard = ""

    def type(self, keys: str) -> None:
        os.write(self._fd, keys.encode())

    def until(self, text: str, patience: float = PATIENCE) -> float:
        """Read until the text has come; returns the seconds that took. Raises AssertionError if it does not come."""
        begun = time.monotonic()
        while text not in self.heard:
            left = begun + patience - time.monotonic()
            assert left > 0, f"no {text!r} after {patience:g} s, but: {self.heard[-2000:]!r}"
            if select.select([self._fd], [], [], left)[0]:
                self.heard += os.read(self._fd, 65536).decode(errors="replace")
        self.heard = self.heard.partition(text)[2]
        return time.monotonic() - begun

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        with suppress(OSError):
            os.close(self._fd)


@contextmanager
def shell_on_pty(folder: Path, *arguments: str) -> Iterator[Pty]:
    shell = Pty(folder, *arguments)
    try:
        yield shell
    finally:
        shell.close()
