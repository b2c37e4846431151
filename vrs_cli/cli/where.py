"""`vrs where`: the current position function g on a saved trajectory."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Sequence
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import Parser, number, option
from vrs_cli.cli.sources import LENIENT, position_object, read_recording

if TYPE_CHECKING:
    from vrs_cli.kinematics.joints import JointUnits
    from vrs_cli.values.results import Position

EPILOG = """\
Before the first motion, after the last and between motions the robot stands still.

  vrs where pick.vrst --at 1.0 2.5
  vrs where pick.vrst --at 2.5 --json
"""


def main(options: Namespace) -> int:
    """Print where the robot is at the times asked for."""
    recording = read_recording(options.prog, options.file, lenient=options.lenient)
    from vrs_cli.engine.position import position_at

    arm = recording.arm
    positions = [position_at(arm, recording.timeline, t) for t in options.at]
    form = _json if options.json else _text
    print(form(positions, arm.model.units), end="")
    return 0


def parser(prog: str) -> Parser:
    return Parser(
        prog,
        "Where the robot of a saved trajectory is at any time: joints, tool and hand.",
        EPILOG,
        option("file", metavar="T.vrst", help="a saved trajectory"),
        option(
            "--at", metavar="TIME", type=number, nargs="+", action="extend", required=True, help="times [s], any number"
        ),
        option("--json", action="store_true", help="a JSON list with an object for every time"),
        LENIENT,
    )


def _json(positions: Sequence[Position], units: JointUnits) -> str:
    objects = [{"time": p.time, **position_object(p, units), "hand": p.hand, "moving": p.moving} for p in positions]
    return "[\n" + ",\n".join(f"  {json.dumps(one)}" for one in objects) + "\n]\n"


def _text(positions: Sequence[Position], units: JointUnits) -> str:
    from vrs_cli.render.text import plain_text
    from vrs_cli.values.replies import Whereabouts

    return "\n".join(plain_text(Whereabouts(position, stamped=True, units=units)) for position in positions)
