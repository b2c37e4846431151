"""`vrs robots`: the robots that are built in, and all about one of them or of a file."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import TASKS, chosen_robot, command, option

if TYPE_CHECKING:
    from vrs_cli.kinematics.arm import RobotArm
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.render.blocks import Block


def robots(options: Namespace) -> None:
    """Print the list, or one robot."""
    from vrs_cli.kinematics.forms import arm_for
    from vrs_cli.render.blocks import text_of

    shown = _list() if options.robot is None else _one(arm_for(chosen_robot(options)))
    print(text_of(shown), end="")


robots_parser = command(
    "The robots that are built in, or all about one robot.",
    """\
  vrs robots cobra600
  vrs robots two_arms.urdf --tip left_tool
""",
    option("robot", metavar="NAME|FILE", nargs="?", help="a robot's name, or its TOML or URDF file"),
    option("--base", metavar="LINK", help="of a URDF file: the link that the arm stands on"),
    option("--tip", metavar="LINK", help="of a URDF file: the link that the arm moves, its flange"),
    option("--task", choices=TASKS, help="what counts of a location, whatever the file says"),
)


def _list() -> Iterator[Block]:
    from vrs_cli.kinematics.forms import arm_for
    from vrs_cli.kinematics.robot_file import load_robot, robot_names
    from vrs_cli.render.blocks import Column, Grid

    arms = [arm_for(load_robot(name)) for name in robot_names()]
    headings = ("Name", "Robot", "Joints", "Configurations")
    rows = tuple((arm.model.name, arm.model.title, str(arm.model.joint_count), _words(arm)) for arm in arms)
    yield Grid(tuple(map(Column, headings)), rows)


def _words(arm: RobotArm) -> str:
    return " ".join(flag.name for flag in arm.words) or "none"


def _one(arm: RobotArm) -> Iterator[Block]:
    from vrs_cli.render.blocks import Column, Grid, line, number_column

    model = arm.model
    yield line(f"{model.title} ({model.name}), {model.joint_count} joints")
    yield line(f"Inverse kinematics: {arm.method}")
    yield line(f"Configurations: {_words(arm)}")
    yield line(f"What counts of a location: {model.task.value}")
    if model.origin is not None:
        yield line(f"Chain: from {model.origin.base} to {model.origin.tip}")
    if hand := _hand(model):
        yield line(f"Hand: {hand}")
    yield line()
    headings = ("lower", "upper", "velocity/s", "accel/s2")
    rates = (model.lower, model.upper, model.max_velocity, model.max_acceleration)
    poses = tuple(model.poses)
    columns = tuple(map(number_column, (*headings, *(pose.upper() for pose in poses))))
    table = [model.units.shown(row) for row in (*rates, *model.poses.values())]
    names = () if model.origin is None else tuple(map("{}, {}".format, model.origin.joints, model.origin.types))
    rows = tuple(
        (f"JT{i}", model.units.unit(i), *(f"{row[i - 1]:.2f}" for row in table), *names[i - 1 : i])
        for i in range(1, model.joint_count + 1)
    )
    named = (Column("joint"),) if names else ()
    yield Grid((Column(""), Column("", width=4), *columns, *named), rows)


def _hand(model: RobotModel) -> str:
    """Describe the hand: what moves it, and how wide it opens."""
    moved = "" if model.origin is None else ", ".join(model.origin.fingers)
    if model.hand_width:
        opens = f"opens {1000.0 * model.hand_width:.1f} mm"
        return f"{moved}; {opens}" if moved else opens
    return moved and f"{moved}; how wide it opens is not known ([hand] of a TOML file says it)"
