"""Trajectory files as subcommands take them, and positions as they tell them."""

from __future__ import annotations

import os
import sys
from math import degrees
from typing import TYPE_CHECKING

from vrs_cli.cli.sources import is_program
from vrs_cli.kinematics.transform import to_oat

if TYPE_CHECKING:
    from vrs_cli.cli.command_line import Parser
    from vrs_cli.files.trajectory_file import Recording
    from vrs_cli.kinematics.joints import JointUnits
    from vrs_cli.values.results import Position

DIGITS = 12  # decimals of degrees and millimetres in JSON: noise goes, nothing that can be measured


def add_lenient_option(parser: Parser) -> None:
    parser.add_argument("--lenient", action="store_true", help="read what can be read of a damaged file, with warnings")


def is_recording(name: str) -> bool:
    """Whether a trajectory file is meant, and no address."""
    return name.endswith(".vrst") or (os.path.exists(name) and not is_program(name))


def read_recording(prog: str, path: str, *, lenient: bool = False, told: bool = True) -> Recording:
    """The trajectory of a file, with a bar on a terminal; where it is `told`, stderr hears what is wrong with it.

    Raises FileError.
    """
    from vrs_cli.files.trajectory_file import read_trajectory
    from vrs_cli.render.progress import reading

    with reading(path) as progress:
        recording = read_trajectory(path, progress, lenient=lenient)
    if recording.dropped_tail:
        print(f"{prog}: warning: the last line of {path} is incomplete and left out", file=sys.stderr)
    for warning in recording.warnings if told else ():
        print(f"{prog}: warning: {path}, {warning}", file=sys.stderr)
    return recording


def position_object(position: Position, units: JointUnits) -> dict[str, list[float] | list[str]]:
    """A position as JSON objects tell it: `joints_deg`, `xyz_mm`, `oat_deg`; `joint_units` where a joint slides."""
    T = position.T_world_tool
    return {
        "joints_deg": [tidy(number) for number in units.shown(position.joints)],
        **units.told(len(position.joints)),
        "xyz_mm": [tidy(1000.0 * x) for x in (T.px, T.py, T.pz)],
        "oat_deg": [tidy(degrees(angle)) for angle in to_oat(T)],
    }


def tidy(value: float) -> float:
    """Without the noise of the last bits, and never -0.0."""
    return round(value, DIGITS) + 0.0
