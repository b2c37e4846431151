"""`vrs replay`: play a saved trajectory on the terminal; elsewhere, a table of its positions."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import CommandLineError, Parser, option, positive
from vrs_cli.cli.outputs import OUTPUT_OPTIONS, Outputs
from vrs_cli.cli.sources import LENIENT, read_recording
from vrs_cli.repl.shell import on_terminal

if TYPE_CHECKING:
    from vrs_cli.kinematics.arm import RobotArm
    from vrs_cli.trajectory.timeline import Timeline
    from vrs_cli.values.results import Position

DEFAULT_STEP = 0.1  # [s] between the rows of the table
MOST_ROWS = 100_000

EPILOG = """\
Keys: space plays and pauses, left and right seek, r rewinds, + and - change the rate, q leaves.
Without a terminal, or with --step, a table is printed; with --csv, --plot or --report only these are written.

  vrs replay pick.vrst --speed 0.25
  vrs replay pick.vrst --step 0.5
  vrs replay pick.vrst --plot pick.svg
"""


def main(options: Namespace) -> int:
    """Play, print or write a saved trajectory."""
    outputs = Outputs.of(options)
    recording = read_recording(options.prog, options.file, lenient=options.lenient)

    arm, timeline = recording.arm, recording.timeline
    if outputs.any:
        outputs.write(arm, timeline, options.file)
    elif options.step is None and on_terminal():
        from vrs_cli.repl.player import play

        play(arm, timeline, options.speed)
    else:
        _print_table(arm, timeline, options.step or DEFAULT_STEP)
    return 0


def parser(prog: str) -> Parser:
    return Parser(
        prog,
        "Play a saved trajectory on the terminal.",
        EPILOG,
        option("file", metavar="T.vrst", help="a saved trajectory"),
        option(
            "--speed",
            metavar="FACTOR",
            type=positive,
            default=1.0,
            help="seconds of the trajectory in one second (default 1)",
        ),
        option(
            "--step",
            metavar="S",
            type=positive,
            help=f"print a table, a row every S seconds (default {DEFAULT_STEP:g})",
        ),
        *OUTPUT_OPTIONS,
        LENIENT,
    )


def _print_table(arm: RobotArm, timeline: Timeline, step: float) -> None:
    """Raises CommandLineError for a step that is too small for a table to be read."""
    if (timeline.end - timeline.start) / step > MOST_ROWS:
        raise CommandLineError(f"--step {step:g} makes too many rows", f"at most {MOST_ROWS}; --csv writes long tables")
    from vrs_cli.render.text import plain_text
    from vrs_cli.values.replies import WhereaboutsTable

    print(plain_text(WhereaboutsTable(tuple(_rows(arm, timeline, step)), arm.model.units)), end="")


def _rows(arm: RobotArm, timeline: Timeline, step: float) -> Iterator[Position]:
    """From start to the exact end."""
    from vrs_cli.engine.position import position_at
    from vrs_cli.files.samples import sample_times

    for times in sample_times(timeline, 1.0 / step):
        for t in times.tolist():
            yield position_at(arm, timeline, t)
