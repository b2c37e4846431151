"""`--report OUT.html`: a trajectory in one page to read: its figures, a picture of the arm, curves, and its commands.

The picture takes a browser some seconds, the curves need matplotlib. The page says so where they are not there.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterator
from html import escape
from io import BytesIO
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.errors import UsageError
from vrs_cli.files.atomic import atomically, check_writable

if TYPE_CHECKING:
    from vrs_cli.kinematics.arm import RobotArm
    from vrs_cli.trajectory.timeline import Timeline

SUFFIXES = (".html", ".htm")
MOST_COMMANDS = 1000  # in the table
STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}"
    "img,svg{max-width:100%;height:auto}table{border-collapse:collapse}td,th{padding:.1rem .8rem;text-align:left}"
    "td:nth-child(n+3),th:nth-child(n+3){text-align:right;font-variant-numeric:tabular-nums}"
)


def check_report(path: str) -> None:
    """Raise now what would make `write_report` fail later: UsageError or FileError."""
    if Path(path).suffix.lower() not in SUFFIXES:
        raise UsageError(f"{path} is no page", f"its name ends in {SUFFIXES[0]}")
    check_writable(path)


def write_report(path: str, arm: RobotArm, timeline: Timeline, title: str, t: float | None) -> None:
    """`t`: the moment of the picture [s]; None for the end. Raises FileError."""
    rows = list(_rows(timeline))
    moment = timeline.end if t is None else min(max(t, timeline.start), timeline.end)
    cells = "".join(
        f"<tr><td>{row.number}</td><td>{escape(row.text)}</td><td>{row.begin:.3f}</td><td>{row.end:.3f}</td></tr>"
        for row in rows[:MOST_COMMANDS]
    )
    more = f"<p>{len(rows) - MOST_COMMANDS} more are not shown.</p>" if len(rows) > MOST_COMMANDS else ""
    parts = (
        f"<h1>{escape(title)}</h1><p>{escape(arm.model.title)}: {len(rows)} commands, {timeline.end:.3f} s</p>",
        _or_why("picture of the arm", lambda: _picture(arm, timeline, moment)),
        _or_why("curves", lambda: _curves(arm, timeline)),
        f"<table><tr><th>No.</th><th>Command</th><th>from s</th><th>to s</th></tr>{cells}</table>{more}",
    )
    page = (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{STYLE}</style></head><body>{''.join(parts)}</body></html>\n"
    )
    with atomically(path) as stream:
        stream.write(page.encode())


def _or_why(what: str, make: Callable[[], str]) -> str:
    """A part of the page; a sentence in its place where this machine lacks what it takes."""
    try:
        return make()
    except UsageError as error:
        return f"<p>No {what}: {escape(error.detail)} ({escape(error.hint)}).</p>"


def _picture(arm: RobotArm, timeline: Timeline, t: float) -> str:
    """Raises PictureError."""
    from vrs_cli.view3d.needs import check_still

    check_still()
    from vrs_cli.view3d.still import write_still

    stream = BytesIO()
    write_still(stream, arm, timeline, t)
    data = b64encode(stream.getvalue()).decode()
    return f'<p><img alt="The arm at {t:.3f} s" src="data:image/png;base64,{data}"></p>'


def _curves(arm: RobotArm, timeline: Timeline) -> str:
    """Raises PlotError."""
    from vrs_cli.render.plots import drawn_trajectory

    drawn = drawn_trajectory(arm, timeline, "", "svg").decode()
    return drawn[drawn.index("<svg") :]


class ReportRow(NamedTuple):
    """A command of the timeline: its number, and from when to when it is under way [s]."""

    number: int
    text: str
    begin: float
    end: float


def _rows(timeline: Timeline) -> Iterator[ReportRow]:
    for number, segments in groupby(timeline, lambda segment: segment.motion.number):
        first, *others = segments
        if first.motion.text:
            yield ReportRow(number, first.motion.text, first.start, (others or [first])[-1].finish)
