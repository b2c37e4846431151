"""`vrs export`: a saved trajectory in a format of other programs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import DEFAULT_RATE, STANDARD_STREAM, CommandLineError, Parser
from vrs_cli.cli.outputs import add_rate_option, check_distinct, write_table
from vrs_cli.cli.recordings import add_lenient_option, read_recording

if TYPE_CHECKING:
    from vrs_cli.files.exports import Exporter

EPILOG = """\
{formats}

Columns of csv: t [s], jt1 ... jtn [deg; mm where a joint slides], x, y, z [mm], o, a, t_angle [deg].

  vrs export pick.vrst --to csv -o pick.csv --rate 50
  vrs export pick.vrst --to csv | head
  vrs export day.vrst -o day.npz --rate 10
"""


def main(prog: str, arguments: Sequence[str]) -> int:
    """Write a saved trajectory as a table."""
    from vrs_cli.files.atomic import check_writable
    from vrs_cli.files.exports import EXPORTERS

    options = _parser(prog, EXPORTERS).parse(arguments)
    form = _format(options.to, options.output)
    if options.output != STANDARD_STREAM:
        check_distinct((options.file, options.output))
        check_writable(options.output)
    EXPORTERS[form].check()
    recording = read_recording(prog, options.file, lenient=options.lenient)
    from vrs_cli.kinematics.forms import arm_for

    write_table(form, options.output, arm_for(recording.model), recording.timeline, options.rate or DEFAULT_RATE)
    return 0


def _parser(prog: str, formats: Mapping[str, Exporter]) -> Parser:
    rows = "\n".join(f"  {one.name:5} {one.summary}" for one in formats.values())
    parser = Parser(prog, "Write a saved trajectory in a format of other programs.", EPILOG.format(formats=rows))
    parser.add_argument("file", metavar="T.vrst", help="a saved trajectory")
    parser.add_argument(
        "--to",
        metavar="FORMAT",
        help="one of these; default: by the ending of OUT",
    )
    parser.add_argument(
        "-o", "--output", metavar="OUT", default=STANDARD_STREAM, help="the file to write; default: standard output"
    )
    add_rate_option(parser)
    add_lenient_option(parser)
    return parser


def _format(asked: str | None, output: str) -> str:
    """The format asked for, or the one that the file's ending says."""
    from vrs_cli.files.exports import EXPORTERS

    if asked is not None:
        if asked not in EXPORTERS:
            raise CommandLineError(f"unknown format {asked}", f"known: {', '.join(EXPORTERS)}")
        return asked
    suffix = os.path.splitext(output)[1].lower()
    for exporter in EXPORTERS.values():
        if exporter.suffix == suffix:
            return exporter.name
    raise CommandLineError("which format?", f"give --to {' or '.join(EXPORTERS)}")
