"""Answers of a robot as values, which show themselves as text, and in a notebook as tables, pictures and scenes."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from html import escape
from itertools import chain
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING

from vrs_cli.errors import VrsError
from vrs_cli.files.atomic import write_atomically
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.render.blocks import PIPE, Column, Grid, line
from vrs_cli.render.colours import Ink
from vrs_cli.render.documents import blocks_html, html, latex_document, markdown, picture
from vrs_cli.render.layout import blocks
from vrs_cli.render.text import plain_text
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.numbers import decimal
from vrs_cli.values.replies import Plot, Reply, is_error
from vrs_cli.values.results import RunOutcome, RunResult

if TYPE_CHECKING:
    from vrs_cli.world.course import World


class Replies(tuple[Reply, ...]):
    """The replies to a line, in order: values of `vrs_cli.values.replies`, in metres, radians and seconds.

    `text` is what the shell prints of them; `ok`: none says that something could not be done.
    """

    __slots__ = ()

    @property
    def text(self) -> str:
        """The replies as the shell shows them."""
        return "".join(map(plain_text, self))

    @property
    def ok(self) -> bool:
        """False where a reply says that something could not be done."""
        return not any(map(is_error, self))

    def __repr__(self) -> str:
        return self.text.rstrip("\n") or "<no replies>"

    def _repr_html_(self) -> str:
        return html(self)

    def _ipython_display_(self) -> None:
        """Show nothing in a notebook where there are no replies; else leave it to the notebook's usual way."""
        if self:
            raise NotImplementedError


class Explanation(Replies):
    """What EXPLAIN answers: tables as Markdown, formulas and matrices as LaTeX in a notebook. Its values are those of
    `vrs_cli.values.results`.
    """

    __slots__ = ()
    _repr_html_ = None  # type: ignore[assignment]  # a notebook takes the Markdown, which has formulas

    def _repr_markdown_(self) -> str:
        return markdown(chain.from_iterable(blocks(reply, PIPE) for reply in self))

    def _repr_latex_(self) -> str:
        return latex_document(chain.from_iterable(blocks(reply, PIPE) for reply in self))


class Picture(Replies):
    """A plot: `times` [s] and `curves`, each with its label and values; a notebook draws it."""

    __slots__ = ()

    @property
    def plot(self) -> Plot:
        """The plot as a value: title, unit, times and curves."""
        (plot,) = self
        assert isinstance(plot, Plot)
        return plot

    @property
    def times(self) -> Sequence[float]:
        """The times of all curves [s]."""
        return self.plot.times

    @property
    def curves(self) -> dict[str, Sequence[float]]:
        """The values of each curve, by its label, in the units of the shell (mm, degrees)."""
        return {curve.label: curve.values for curve in self.plot.curves}

    def _repr_svg_(self) -> str:
        return picture(self.plot)


class Run(RunResult, frozen=True):
    """A run of a program: `typed` is a tuple of lines; `started` and `ended` [s]; `fault`, if it went wrong."""

    @property
    def ok(self) -> bool:
        """True where the program came to its end without an error."""
        return self.outcome is RunOutcome.COMPLETED

    @property
    def seconds(self) -> float:
        """How long it took, by the robot's clock [s]."""
        return self.ended - self.started

    def __repr__(self) -> str:
        said = f"{self.program}: {self.outcome.value}, {self.seconds:.3f} s"
        return "\n".join((*self.typed, said))


class ProgramFailed(VrsError):
    """A program that was run has stopped with an error; `result` says how far it came."""

    def __init__(self, result: Run) -> None:
        fault = result.fault
        assert fault is not None
        super().__init__(f"{fault.program} step {fault.step}, {fault.source}: {fault.in_python or fault.message}")
        self.result = result

    def __str__(self) -> str:
        return self.detail


class Scene:
    """An arm that follows a timeline, in a cell or alone. `html`: the page, which plays offline; `height` [px] of what
    a notebook shows.

    Raises UsageError where the page is not built.
    """

    def __init__(self, arm: RobotArm, timeline: Timeline, height: int, world: World | None = None) -> None:
        from vrs_cli.render.pictures import check_page

        check_page()
        self._arm, self._timeline, self._height, self._world = arm, timeline, height, world

    @cached_property
    def html(self) -> str:
        """The whole page, which plays without a server and without the Internet."""
        from vrs_cli.net.page_data import recorded_page
        from vrs_cli.render.pictures import page

        cell = None if self._world is None else self._world.cell
        return page(recorded_page(self._arm, self._timeline, cell=cell))

    def save(self, path: str | Path) -> None:
        """Write the page to a file. Raises FileError."""
        write_atomically(path, self.html)

    def open(self) -> Path:
        """Show it in the browser of this machine: for a script, which has no cell to show it below. The page is in the
        file that is returned, which stays.
        """
        path = Path(mkdtemp(prefix="vrs-")) / f"{self._arm.model.name}.html"
        self.save(path)
        webbrowser.open(path.as_uri())
        return path

    def __repr__(self) -> str:
        span = f"{self._timeline.start:.3f} to {self._timeline.end:.3f} s"
        return f"<Scene of {self._arm.model.name}: {span}; .open() shows it in a browser>"

    def _repr_html_(self) -> str:
        """A frame that has the whole page in it: a notebook that is opened elsewhere needs no server either."""
        style = "border:0;width:100%"
        return f'<iframe srcdoc="{escape(self.html)}" height="{self._height}" style="{style}"></iframe>'


ROWS = 5  # at the beginning and at the end of a long table


def table(title: str, columns: Sequence[Column], count: int, row: Callable[[int], tuple[str, ...]]) -> str:
    """A title and a table of so many rows, of which a long one shows the first and the last."""
    if count <= 2 * ROWS + 1:
        rows = tuple(map(row, range(count)))
    else:
        first, last = map(row, range(ROWS)), map(row, range(count - ROWS, count))
        rows = (*first, ("...",) * len(columns), *last)
    return blocks_html((line(title, Ink.NOTE), Grid(tuple(columns), rows)))


def figures(numbers: Iterable[float]) -> tuple[str, ...]:
    return tuple(map(decimal, numbers))
