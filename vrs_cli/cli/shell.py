"""`vrs` and `vrs shell`: the interactive shell."""

from __future__ import annotations

from collections.abc import Sequence

from vrs_cli.cli.command_line import Parser, add_realtime_option, clock_of, with_rate

EPILOG = """\
Without a terminal on standard input its lines are executed one after another:

  echo WHERE | vrs

With --realtime the arm moves while you type:

  vrs --realtime
  vrs --realtime 0.25 pick.v2

All subcommands: vrs --help
"""


def main(prog: str, arguments: Sequence[str]) -> int:
    """Hand over to the shell; returns its exit status."""
    parser = Parser(prog, "The interactive VAL-II shell of a virtual robot.", EPILOG)
    parser.add_argument("file", metavar="FILE.v2", nargs="?", help="a program file to load first")
    parser.add_argument(
        "--save", metavar="T.vrst", help="record every motion in a file; go on with it if it is there already"
    )
    parser.add_robot(default=None)
    add_realtime_option(parser)
    options = parser.parse(list(with_rate(arguments)))
    from vrs_cli.repl.shell import main as shell

    return shell(robot=options.robot, file=options.file, save=options.save, clock=clock_of(options.realtime))
