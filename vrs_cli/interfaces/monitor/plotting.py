"""PLOT: curves over the time of a timeline. This module knows no terminal."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.engine.position import PositionArrays, positions_at
from vrs_cli.errors import IllegalJoint, UsageError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.language.words.monitor import QUANTITIES
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.replies import Curve, Plot

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Floats


SAMPLES = 481  # more than the dots of the widest drawing need


PICTURES = (".svg", ".png", ".pdf")  # how the name of a file ends that a plot is drawn into
SYNTAX = f"PLOT {', '.join(QUANTITIES)}; joints by number: PLOT 1, 2 or PLOT VELOCITY, 1; into a file: PLOT 1, arm.svg"


IN_PYTHON = f'plot(1, 2), plot("velocity", 1), plot("X", "Z"); quantities: {", ".join(QUANTITIES).lower()}'
_JOINT = re.compile(r"[0-9]{1,3}")


class Selection(Struct, frozen=True):
    """The names of quantities on one scale, and joints from 1 (none for quantities of the tool)."""

    names: tuple[str, ...]
    joints: tuple[int, ...]


def in_file(words: Sequence[str]) -> tuple[Sequence[str], str]:
    """Separate the words for what is plotted from the file that is named last; "" where there is none."""
    named = bool(words) and words[-1].lower().endswith(PICTURES)
    return (words[:-1], words[-1]) if named else (words, "")


def selected(arm: RobotArm, words: Sequence[str]) -> Selection:
    """`PLOT`, `PLOT 1,2`, `PLOT VELOCITY,3`, `PLOT X,Z`. Raises UsageError, IllegalJoint."""
    numbers = [int(word) for word in words if _JOINT.fullmatch(word)]
    names = _chosen([word for word in words if not _JOINT.fullmatch(word)])
    first = QUANTITIES[names[0]]
    if first.joints:
        return Selection(tuple(names), tuple(_joints(arm, numbers)))
    if numbers:
        raise UsageError(f"{first.title.lower()} has no joint {numbers[0]}", SYNTAX, in_python=IN_PYTHON)
    return Selection(tuple(names), ())


def plotted(arm: RobotArm, timeline: Timeline, asked: Selection) -> Plot:
    """The curves that are asked for, over a timeline with motions."""
    import numpy as np

    first = QUANTITIES[asked.names[0]]
    times = np.linspace(timeline.start, timeline.end, SAMPLES)
    positions = positions_at(arm, timeline, times)
    if first.joints:
        units, columns = arm.model.units, getattr(positions, first.joints).T.tolist()
        curves = tuple(
            Curve(f"JT{joint}", str(joint), tuple(units.one_shown(joint, x) for x in columns[joint - 1]))
            for joint in asked.joints
        )
        unit = ", ".join(dict.fromkeys(first.unit.replace("deg", units.unit(joint)) for joint in asked.joints))
        return Plot(first.title, unit, tuple(times.tolist()), curves)
    rows, names = _tool_values(positions), (curve for name in asked.names for curve in QUANTITIES[name].curves)
    curves = tuple(Curve(name, name[0], tuple(rows[name].tolist())) for name in dict.fromkeys(names))
    return Plot(first.title, first.unit, tuple(times.tolist()), curves)


def _chosen(words: Sequence[str]) -> list[str]:
    """The quantities in full. Raises UsageError for an unknown one, and for two that do not go on one scale."""
    names = [_full_name(word.upper()) for word in words] or ["POSITION"]
    units = {QUANTITIES[name].unit for name in names}
    if len(units) > 1 or (QUANTITIES[names[0]].joints and len(set(names)) > 1):
        raise UsageError(f"{' and '.join(names)} do not go on one scale", SYNTAX, in_python=IN_PYTHON)
    return list(dict.fromkeys(names))


def _full_name(word: str) -> str:
    if word in QUANTITIES:
        return word
    found = [name for name in QUANTITIES if name.startswith(word)]
    if len(found) != 1:
        raise UsageError(f"{word} is no curve", SYNTAX, in_python=IN_PYTHON)
    return found[0]


def _joints(arm: RobotArm, numbers: Sequence[int]) -> Sequence[int]:
    count = arm.model.joint_count
    for number in numbers:
        if not 1 <= number <= count:
            raise IllegalJoint(f"joint {number}", f"this robot has joints 1 to {count}")
    return list(dict.fromkeys(numbers)) or range(1, count + 1)


def _tool_values(positions: PositionArrays) -> Mapping[str, Floats]:
    """Every curve of the tool [mm, mm/s]. The speed is that between neighbouring samples."""
    import numpy as np

    xyz = positions.T_world_tool[:, :, 3] * 1000.0
    speed = np.linalg.norm(np.gradient(xyz, positions.times, axis=0), axis=1)
    return {"X": xyz[:, 0], "Y": xyz[:, 1], "Z": xyz[:, 2], "SPEED": speed, "HAND": positions.hand}
