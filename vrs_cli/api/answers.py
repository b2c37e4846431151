"""Define the values that the methods of `Robot` return. They print as text; a notebook shows tables, pictures and
scenes."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from html import escape
from itertools import chain
from pathlib import Path
from tempfile import mkdtemp
from threading import Thread
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import MissedEvents, Subscription
from vrs_cli.errors import VrsError
from vrs_cli.files.atomic import write_atomically
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.render.blocks import PIPE, Column, Grid, line
from vrs_cli.render.colours import Ink
from vrs_cli.render.documents import blocks_html, html, latex_document, markdown, picture
from vrs_cli.render.layout import blocks
from vrs_cli.render.text import plain_text
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.numbers import decimal
from vrs_cli.values.replies import Plot, Reply, is_error
from vrs_cli.values.results import RunOutcome, RunResult

if TYPE_CHECKING:
    from vrs_cli.world.course import World


class Replies(tuple[Reply, ...]):
    """The replies to a line, in order: values of `vrs_cli.values.replies`, in metres, radians and seconds.

    `text` is their text in the shell; `ok` is False if one of them is an error.
    """

    __slots__ = ()

    @property
    def text(self) -> str:
        """Return the replies as the shell shows them."""
        return "".join(map(plain_text, self))

    @property
    def ok(self) -> bool:
        """Return True if none of the replies is an error."""
        return not any(map(is_error, self))

    def __repr__(self) -> str:
        return self.text.rstrip("\n") or "<no replies>"

    def _repr_html_(self) -> str:
        return html(self)

    def _ipython_display_(self) -> None:
        """Show nothing in a notebook if there are no replies; otherwise let the notebook show them as usual."""
        if self:
            raise NotImplementedError


class Explanation(Replies):
    """The answer to EXPLAIN: values of `vrs_cli.values.results`. A notebook shows tables as Markdown, formulas and
    matrices as LaTeX.
    """

    __slots__ = ()
    _repr_html_ = None  # type: ignore[assignment]  # so that a notebook shows the Markdown with its formulas

    def _repr_markdown_(self) -> str:
        return markdown(chain.from_iterable(blocks(reply, PIPE) for reply in self))

    def _repr_latex_(self) -> str:
        return latex_document(chain.from_iterable(blocks(reply, PIPE) for reply in self))


class Picture(Replies):
    """A plot: `times` [s], and `curves`, the values of each curve by its label. A notebook draws the plot."""

    __slots__ = ()

    @property
    def plot(self) -> Plot:
        """Return the plot as a value: title, unit, times and curves."""
        (plot,) = self
        assert isinstance(plot, Plot)
        return plot

    @property
    def times(self) -> Sequence[float]:
        """Return the times of all curves [s]."""
        return self.plot.times

    @property
    def curves(self) -> dict[str, Sequence[float]]:
        """Return the values of each curve by its label, in the units of the shell (mm, degrees)."""
        return {curve.label: curve.values for curve in self.plot.curves}

    def _repr_svg_(self) -> str:
        return picture(self.plot)


class Run(RunResult, frozen=True):
    """The result of a program run. `typed`: the lines that the program printed with TYPE; `started`, `ended`: times
    [s]; `fault`: the error that stopped the program, or None."""

    @property
    def ok(self) -> bool:
        """Return True if the program reached its end without an error."""
        return self.outcome is RunOutcome.COMPLETED

    @property
    def seconds(self) -> float:
        """Return the duration of the program on the robot's clock [s]."""
        return self.ended - self.started

    def __repr__(self) -> str:
        return "\n".join((*self.typed, f"{self.program}: {self.outcome.value}, {self.seconds:.3f} s"))


class ProgramFailed(VrsError):
    """The error raised when a program stops with an error. `result`: the Run up to this error."""

    def __init__(self, result: Run) -> None:
        fault = result.fault
        assert fault is not None
        super().__init__(f"{fault.program} step {fault.step}, {fault.source}: {fault.in_python or fault.message}")
        self.result = result

    def __str__(self) -> str:
        return self.detail


class Scene:
    """An arm that follows a timeline, in a cell or alone, as a page for the browser. `html`: the page, which plays
    offline; `height`: its height in a notebook [px].

    Raises UsageError if the page is not built.
    """

    def __init__(self, arm: RobotArm, timeline: Timeline, height: int, world: World | None = None) -> None:
        from vrs_cli.render.pictures import check_page

        check_page()
        self._arm, self._timeline, self._height, self._world = arm, timeline, height, world

    @cached_property
    def html(self) -> str:
        """Return the whole page. It plays without a server and without the Internet."""
        from vrs_cli.net.page_data import recorded_page
        from vrs_cli.render.pictures import page

        return page(recorded_page(self._arm, self._timeline, cell=None if self._world is None else self._world.cell))

    def save(self, path: str | Path) -> None:
        """Write the page to a file. Raises FileError."""
        write_atomically(path, self.html)

    def open(self) -> Path:
        """Write the page to a new file, show it in the browser of this machine, and return the path of the file."""
        path = Path(mkdtemp(prefix="vrs-")) / f"{self._arm.model.name}.html"
        self.save(path)
        webbrowser.open(path.as_uri())
        return path

    def __repr__(self) -> str:
        span = f"{self._timeline.start:.3f} to {self._timeline.end:.3f} s"
        return f"<Scene of {self._arm.model.name}: {span}; .open() shows it in a browser>"

    def _repr_html_(self) -> str:
        """Return a frame that contains the whole page, so that the notebook needs no server."""
        return f'<iframe srcdoc="{escape(self.html)}" height="{self._height}" style="border:0;width:100%"></iframe>'


def table(title: str, columns: Sequence[Column], count: int, row: Callable[[int], tuple[str, ...]]) -> str:
    """Return the HTML of a title and a table of `count` rows. A long table shows its first and last five rows."""
    if count <= 11:
        rows = tuple(map(row, range(count)))
    else:
        first, last = map(row, range(5)), map(row, range(count - 5, count))
        rows = (*first, ("...",) * len(columns), *last)
    return blocks_html((line(title, Ink.NOTE), Grid(tuple(columns), rows)))


def figures(numbers: Iterable[float]) -> tuple[str, ...]:
    return tuple(map(decimal, numbers))


class Change(Struct, frozen=True):
    """A change of the timeline: the new `timeline`, its `version`, and the `delta` that made it. `delta` is None if
    another timeline has replaced the old one.
    """

    version: int
    timeline: Timeline
    delta: TimelineDelta | None = None

    def __repr__(self) -> str:
        what = "another timeline" if self.delta is None else self.delta.motion.text or "a motion"
        return f"<Change to version {self.version}: {what}, to {self.timeline.end:.3f} s>"


def hear(subscription: Subscription[TimelineChange], callback: Callable[[Change], object]) -> Callable[[], None]:
    """Call `callback` for every change, in a new thread. Return a function that stops the calls; it first waits until
    the changes so far are handled.

    If the callback raises an error, the thread reports the error and ends.
    """

    def listen() -> None:
        timeline: Timeline | None = None
        while (event := subscription.take()) is not None:  # `take` returns queued events even after `end`
            if isinstance(event, MissedEvents):
                continue  # the next event replaces the missed ones: it has the whole timeline
            if isinstance(event, TimelineDelta):
                assert timeline is not None
                timeline = timeline.apply(event)
                callback(Change(timeline.version, timeline, event))
            else:
                timeline = event.timeline
                callback(Change(timeline.version, timeline))

    thread = Thread(target=listen, name="vrs subscriber", daemon=True)
    thread.start()

    def end() -> None:
        subscription.end()
        thread.join()

    return end
