"""`vrs convert`: execute a program in virtual time, and write what it did in the language of another robot."""

from __future__ import annotations

from argparse import Namespace

from vrs_cli.cli.command_line import (
    CELL,
    DIALECT,
    ROBOT,
    STANDARD_STREAM,
    CommandLineError,
    command,
    option,
)
from vrs_cli.cli.outputs import Outputs, check_distinct
from vrs_cli.cli.run import run_parser
from vrs_cli.cli.sources import sources_of
from vrs_cli.errors import did_you_mean


def convert(options: Namespace) -> int:
    """Execute and write; returns 1 when the file has errors or the program stopped with one."""
    from vrs_cli.cli.conversion import Conversion
    from vrs_cli.convert.writers import TARGETS
    from vrs_cli.files.atomic import check_writable

    if options.to not in TARGETS:
        known = f"known: {', '.join(TARGETS)}"
        raise CommandLineError(f"unknown target {options.to}", did_you_mean(options.to, TARGETS, known))
    if options.as_written and options.to != "rapid":
        raise CommandLineError("--as-written is for --to rapid", "leave it out for what was executed")
    if options.output != STANDARD_STREAM:
        check_distinct((options.file, options.output))
        check_writable(options.output)
    usual = vars(run_parser(options.prog).parse([options.file]))  # the other options of a run, none of them given
    usual |= {"program": None, "apart": False, "quiet": True}
    sources = sources_of((options.file,))
    return Conversion(Namespace(**usual | vars(options)), Outputs(None, 0.0, None, None), sources).run()


convert_parser = command(
    "Write what a program does for another robot.",
    """\
  vrs convert pick.v2 --to urscript -o pick.script
\f

What the target cannot say is a comment there and a note on standard error.
""",
    option("file", metavar="FILE.v2", help="a program file"),
    option("--to", metavar="TARGET", required=True, help="urscript, rapid, krl or python"),
    option("--as-written", action="store_true", help="rapid: loops and calls"),
    option("-o", "--output", metavar="OUT", default=STANDARD_STREAM, help="the file to write"),
    *ROBOT,
    DIALECT,
    CELL,
    option("--signals", rare=True, metavar="FILE", help="when input signals change: lines of time, signal, state"),
    option("--replay-units", rare=True, metavar="FILE", help="what comes from devices"),
)
