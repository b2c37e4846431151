"""Write the output files of a trajectory: `--save T.vrst`, `--csv OUT --rate HZ`, `--plot OUT` and `--report OUT`."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from io import BytesIO
from itertools import combinations, groupby
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.cli.command_line import DEFAULT_RATE, CommandLineError, refuse
from vrs_cli.cli.commands import STANDARD_STREAM
from vrs_cli.errors import FileError, UsageError, VrsError

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine
    from vrs_cli.files.exports import Exporter
    from vrs_cli.kinematics.arm import RobotArm
    from vrs_cli.trajectory.timeline import Timeline
    from vrs_cli.world.course import World


MAX_COMMANDS = 1000  # maximum number of rows in the table of a report
STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}"
    "img,svg{max-width:100%;height:auto}table{border-collapse:collapse}td,th{padding:.1rem .8rem;text-align:left}"
    "td:nth-child(n+3),th:nth-child(n+3){text-align:right;font-variant-numeric:tabular-nums}"
)


class Outputs(Struct, frozen=True):
    """The output files of a trajectory, each a path or None. `rate`: rows per second of the table [Hz]. `report_at`:
    the time that the picture of the report shows [s]; None: the end."""

    csv: str | None
    rate: float
    plot: str | None
    save: str | None
    report: str | None = None
    report_at: float | None = None

    @staticmethod
    def of(options: argparse.Namespace) -> Outputs:
        """Read the options, and check now that `write` will work later. Raises CommandLineError for options that
        exclude each other, or for one file named for two outputs; FileError, UsageError.
        """
        rate = DEFAULT_RATE if options.rate is None else options.rate
        save = getattr(options, "save", None)
        outputs = Outputs(options.csv, rate, options.plot, save, options.report, options.report_at)
        both = getattr(options, "json", False) and outputs.takes_standard_output
        without_page = options.report_at is not None and options.report is None
        refuse(
            (options.rate is not None and options.csv is None, "--rate is the rate of a table", "give --csv OUT, too"),
            (without_page, "--report-at is a moment of a report", "give --report OUT.html, too"),
            (both, "--json and --csv - both want standard output", "write the table to a file"),
            (outputs.save == STANDARD_STREAM, "--save - has no file", "name a file: --save T.vrst"),
        )
        files = (outputs.csv, outputs.plot, outputs.report, outputs.save, options.file)
        check_distinct(path for path in files if path is not None and path != STANDARD_STREAM)
        if outputs.csv is not None and not outputs.takes_standard_output:
            _check_writable(outputs.csv)
        if outputs.plot is not None:
            from vrs_cli.render.plots import check_plot

            check_plot(outputs.plot)
        if outputs.report is not None:
            if os.path.splitext(outputs.report)[1].lower() not in (".html", ".htm"):
                raise UsageError(f"{outputs.report} is no page", "its name ends in .html")
            _check_writable(outputs.report)
        if outputs.save is not None:
            _check_writable(outputs.save)
        return outputs

    @property
    def takes_standard_output(self) -> bool:
        return self.csv == STANDARD_STREAM

    @property
    def any(self) -> bool:
        return any(path is not None for path in (self.csv, self.plot, self.report))

    def write(self, arm: RobotArm, timeline: Timeline, title: str, world: World | None = None) -> None:
        """Write all files. `world`: the cell that the picture of a report shows. Raises FileError."""
        if self.csv is not None:
            from vrs_cli.files.exports import EXPORTERS

            write_export(EXPORTERS["csv"], self.csv, arm, timeline, self.rate)
        if self.plot is not None:
            from vrs_cli.render.plots import plot_trajectory

            plot_trajectory(self.plot, arm, timeline, title)
        if self.report is not None:
            _write_report(self.report, arm, timeline, title, self.report_at, world)


def _check_writable(path: str) -> None:
    from vrs_cli.files.atomic import check_writable  # imported here because most runs write no files

    check_writable(path)


def write_export(exporter: Exporter, path: str, arm: RobotArm, timeline: Timeline, number: float) -> None:
    """Write a trajectory in a format of `exports` or `pictures`. `number`: the samples per second [Hz], or the time of
    a single picture [s]. Raises FileError."""
    from vrs_cli.files.exports import export

    sys.stdout.flush()
    export(exporter, path, sys.stdout.buffer, arm, timeline, number)
    sys.stdout.buffer.flush()


def check_moment(option: str, t: float, timeline: Timeline) -> None:
    """Raise CommandLineError if a time [s] is outside a trajectory."""
    # allow half a millisecond: messages show the end rounded to 1 ms, and users copy it
    if not timeline.start <= t <= timeline.end + 0.0005:
        span = f"{timeline.start:.3f} to {timeline.end:.3f} s"
        raise CommandLineError(f"{option} {t:g} is not in the trajectory", f"give a moment from {span}")


def make_folder(folder: str, named: str, hint: str, error: type[VrsError] = FileError) -> str:
    """Make a folder if it does not exist, and return its full path. Raises `error` if that fails or the name is empty;
    its message calls the folder `named`."""
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as reason:
        raise error(f"{named}: {reason.strerror}", hint) from None
    return os.path.realpath(folder)


def write_text(path: str, text: str) -> None:
    """Write a string to a file, or to standard output if the path is `-`. Raises FileError."""
    from vrs_cli.files.atomic import write_atomically

    if path == STANDARD_STREAM:
        sys.stdout.write(text)
    else:
        write_atomically(path, text)


def check_distinct(paths: Iterable[str]) -> None:
    """Raise CommandLineError if two paths name the same file. A device (such as /dev/null) may be named twice."""
    for one, other in combinations(paths, 2):
        path = os.path.realpath(one)
        if path == os.path.realpath(other) and (os.path.isfile(path) or not os.path.exists(path)):
            raise CommandLineError(f"{other} is named twice", "give every file a name of its own")


@contextmanager
def journal(
    path: str | None, engine: Engine, tell: Callable[[str], None], *, durable: bool
) -> Iterator[Callable[[], bool]]:
    """Write every change of the timeline to the file `path`; None: to no file.

    `durable`: each change is on the disk before it takes effect. Yield a function that returns whether the file is
    complete. Raises FileError if the file cannot be started.
    """
    if path is None:
        yield lambda: True
        return
    from vrs_cli.files.journal import keep_journal, take

    file = keep_journal(take(path), engine, tell, durable=durable)
    try:
        yield lambda: file.sound
    finally:
        try:
            file.close()
        except FileError as error:
            tell(str(error))


# --- `--report OUT.html`: a page about a trajectory -------------------------------------------------------------------


def _write_report(
    path: str, arm: RobotArm, timeline: Timeline, title: str, t: float | None, world: World | None
) -> None:
    """Write a page with figures, a picture of the arm, curves and commands.

    A browser takes some seconds to draw the picture; if the machine has no browser, the page says so. `t`: the time [s]
    that the picture shows; None: the end. Raises FileError.
    """
    from html import escape

    from vrs_cli.files.atomic import write_atomically
    from vrs_cli.render.plots import TIME, curves_svg, trajectory_panels

    rows = list(_commands(timeline))
    moment = timeline.end if t is None else min(max(t, timeline.start), timeline.end)
    cells = "".join(
        f"<tr><td>{place}</td><td>{escape(text)}</td><td>{begin:.3f}</td><td>{end:.3f}</td></tr>"
        for place, text, begin, end in rows[:MAX_COMMANDS]
    )
    more = f"<p>{len(rows) - MAX_COMMANDS} more are not shown.</p>" if len(rows) > MAX_COMMANDS else ""
    parts = (
        f"<h1>{escape(title)}</h1><p>{escape(arm.model.title)}: {len(rows)} commands, {timeline.end:.3f} s</p>",
        _picture(arm, timeline, moment, world),
        curves_svg(trajectory_panels(arm, timeline), TIME),
        f"<table><tr><th>No.</th><th>Command</th><th>from s</th><th>to s</th></tr>{cells}</table>{more}",
    )
    page = (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{STYLE}</style></head><body>{''.join(parts)}</body></html>\n"
    )
    write_atomically(path, page)


def _picture(arm: RobotArm, timeline: Timeline, t: float, world: World | None) -> str:
    """Return a picture of the arm as HTML, or a sentence that says why this machine cannot make a picture."""
    from base64 import b64encode
    from html import escape

    from vrs_cli.render.pictures import check_still, write_still

    stream = BytesIO()
    try:
        check_still()
        write_still(stream, arm, timeline, t, world)
    except UsageError as error:
        return f"<p>No picture of the arm: {escape(error.detail)} ({escape(error.hint)}).</p>"
    data = b64encode(stream.getvalue()).decode()
    return f'<p><img alt="The arm at {t:.3f} s" src="data:image/png;base64,{data}"></p>'


def _commands(timeline: Timeline) -> Iterator[tuple[int, str, float, float]]:
    """Yield the number and the text of each command, and the start and the end of its motion [s]."""
    for place, segments in groupby(timeline, lambda segment: segment.motion.number):
        first, *others = segments
        if first.motion.text:
            yield place, first.motion.text, first.start, (others or [first])[-1].finish
