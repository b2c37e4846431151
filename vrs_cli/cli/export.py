"""`vrs export`: a saved trajectory in a format of other programs."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Mapping
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import DEFAULT_RATE, STANDARD_STREAM, CommandLineError, Parser, number, option
from vrs_cli.cli.outputs import check_distinct, rate_option, write_export
from vrs_cli.cli.sources import LENIENT, read_recording

if TYPE_CHECKING:
    from vrs_cli.files.exports import Exporter

EPILOG = """\
{formats}

Columns of csv: t [s], jt1 ... jtn [deg; mm where a joint slides], x, y, z [mm], o, a, t_angle [deg].
html, png, gif and mp4 show the robot; a picture or a film is taken by the Chromium
or Chrome of this machine.

  vrs export pick.vrst --to csv -o pick.csv --rate 50
  vrs export pick.vrst --to csv | head
  vrs export day.vrst -o day.npz --rate 10
  vrs export pick.vrst -o pick.html
  vrs export pick.vrst -o pick.png --at 2.5
"""


def main(options: Namespace) -> int:
    """Write a saved trajectory in another format."""
    from vrs_cli.files.atomic import check_writable

    exporter = _format(_formats(), options.to, options.output)
    if exporter.of_moment and options.rate is not None:
        raise CommandLineError(f"{exporter.name} is one moment and has no rate", "give --at TIME")
    if options.at is not None and not exporter.of_moment:
        raise CommandLineError(f"{exporter.name} is the whole trajectory", "--at TIME is for --to png")
    if options.output != STANDARD_STREAM:
        check_distinct((options.file, options.output))
        check_writable(options.output)
    exporter.check()
    recording = read_recording(options.prog, options.file, lenient=options.lenient)

    given = options.rate if options.at is None else options.at
    if given is None:
        given = exporter.usual(recording.timeline) if exporter.usual else DEFAULT_RATE
    write_export(exporter, options.output, recording.arm, recording.timeline, given)
    return 0


def _formats() -> Mapping[str, Exporter]:
    from vrs_cli.files.exports import EXPORTERS
    from vrs_cli.view3d.pictures import PICTURES

    return {**EXPORTERS, **PICTURES}


def parser(prog: str) -> Parser:
    rows = "\n".join(f"  {one.name:5} {one.summary}" for one in _formats().values())
    return Parser(
        prog,
        "Write a saved trajectory in a format of other programs.",
        EPILOG.format(formats=rows),
        option("file", metavar="T.vrst", help="a saved trajectory"),
        option("--to", metavar="FORMAT", help="one of these; default: by the ending of OUT"),
        option(
            "-o", "--output", metavar="OUT", default=STANDARD_STREAM, help="the file to write; default: standard output"
        ),
        rate_option(", or frames (html: 30; gif, mp4: 10)"),
        option("--at", metavar="TIME", type=number, help="the moment of a png [s]; default: the end"),
        LENIENT,
    )


def _format(formats: Mapping[str, Exporter], asked: str | None, output: str) -> Exporter:
    """The format asked for, or the one that the file's ending says."""
    if asked is not None:
        if asked not in formats:
            raise CommandLineError(f"unknown format {asked}", f"known: {', '.join(formats)}")
        return formats[asked]
    suffix = os.path.splitext(output)[1].lower()
    for exporter in formats.values():
        if exporter.suffix == suffix:
            return exporter
    raise CommandLineError("which format?", f"give --to {' or '.join(formats)}")
