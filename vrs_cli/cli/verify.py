"""`vrs verify`: whether a saved trajectory is whole and keeps the laws of motion, its straight lines all along."""

from __future__ import annotations

import json
from argparse import Namespace
from itertools import islice

from vrs_cli.cli.command_line import Parser, option
from vrs_cli.cli.main import FAILED, OK
from vrs_cli.cli.sources import read_recording

EPILOG = """\
Reading a file checks its form, checksums, continuity, the ranges of the joints, and their limits in joint space;
this follows every straight line too, with its accelerations and jerks, and tells all that is wrong.
Exit status 1 when something is.

  vrs verify pick.vrst
  vrs verify day.vrst --json
"""


def main(options: Namespace) -> int:
    """Tell what is wrong in a file, line by line, or that nothing is."""
    recording = read_recording(options.prog, options.file, lenient=True, told=False)
    from vrs_cli.engine.breaches import on_lines
    from vrs_cli.files.soundness import in_lines
    from vrs_cli.files.trajectory_file import MOST_FAULTS

    along = in_lines(on_lines(recording.arm, recording.timeline), recording.timeline, recording.deltas, recording.lines)
    wrong = [*recording.warnings, *map(str, islice(along, MOST_FAULTS))]
    checksums = recording.checksum is not None
    if options.json:
        print(json.dumps({"sound": not wrong, "checksums": checksums, "faults": wrong}, indent=2))
    else:
        for what in wrong:
            print(f"{options.file}, {what}")
        held = f"{len(recording.deltas)} changes, {len(recording.timeline)} segments, {recording.timeline.end:.3f} s"
        print(f"{held}{'' if checksums else ', no checksums'}: {'sound' if not wrong else 'not sound'}")
    return FAILED if wrong else OK


def parser(prog: str) -> Parser:
    return Parser(
        prog,
        "Whether a saved trajectory is whole, and one that the robot can do.",
        EPILOG,
        option("file", metavar="T.vrst", help="a saved trajectory"),
        option("--json", action="store_true", help="print one JSON object: sound, checksums, faults"),
    )
