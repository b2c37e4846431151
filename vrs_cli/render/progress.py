"""Show on stderr that a long run is in progress, with a line that disappears at the end."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

DELAY = 0.5  # [s] minimum duration of a run before the line is shown
PERIOD = 0.1  # [s] time between two updates of the line


class RunProgress(AbstractContextManager["RunProgress"]):
    """A progress line: call it with the robot's time [s] as often as you like. `total`: the latest time at which the
    run can end.

    `shown_as`: formats the time, or another quantity, for the line; `wall`: returns real time [s]. Nothing is shown
    unless stderr is a terminal. Call `hide` before you print anything else.
    """

    def __init__(
        self,
        what: str,
        total: float | None = None,
        wall: Callable[[], float] = time.monotonic,
        shown_as: Callable[[float], str] = lambda t: f"t = {t:.2f} s",
    ) -> None:
        self._what, self._total, self._wall, self._shown_as = what, total, wall, shown_as
        self._next = wall() + DELAY if sys.stderr.isatty() else float("inf")
        self._bar: Progress | None = None

    def __call__(self, t: float) -> None:
        now = self._wall()
        if now < self._next:
            return
        self._next = now + PERIOD
        if self._bar is None:
            self._bar = _progress(self._what, self._total)
        self._bar.update(self._bar.task_ids[0], completed=t, shown=self._shown_as(t))
        if self._bar.live.is_started:
            self._bar.refresh()
        else:
            self._bar.start()

    def hide(self) -> None:
        """Remove the line until the next call shows it again."""
        if self._bar is not None and self._bar.live.is_started:
            self._bar.stop()

    def say(self, text: str) -> None:
        """Print a line on stderr in place of the progress line."""
        self.hide()
        print(text, file=sys.stderr)

    def __exit__(self, *_error: object) -> None:
        self.hide()


def reading_progress(path: str) -> RunProgress:
    """Return a progress line for reading a file; call it with the fraction that was read, from 0 to 1."""
    return RunProgress(f"reading {path}", 1.0, shown_as=lambda share: f"{share:.0%}")


def _progress(what: str, total: float | None) -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("{task.fields[shown]}"),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        auto_refresh=False,
        transient=True,
        redirect_stdout=False,
        redirect_stderr=False,
    )
    bar.add_task(what, total=total, shown="")
    return bar
