"""Carry out `vrs tools` (settings of the shell, `completion` of shells, `lsp` for editors) and `vrs robots`."""

from __future__ import annotations

import os
import sys
from argparse import Action, ArgumentParser, Namespace
from collections.abc import Iterator
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from vrs_cli.cli import commands, main
from vrs_cli.cli.command_line import CommandLineError, Parser, chosen_robot
from vrs_cli.extras import how_to_install

if TYPE_CHECKING:
    from vrs_cli.kinematics.arm import RobotArm
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.render.blocks import Block


def config(options: Namespace) -> int:
    """Print the settings of the shell; return the exit status."""
    from vrs_cli.repl.config import config_path, read_config, settings_text

    path = config_path(os.environ)
    if options.path:
        print(path)
        return main.OK
    config = read_config(os.environ)
    print(f"# {path}{'' if path.exists() else ' (not there: these are the defaults)'}")
    print(settings_text(config), end="")
    for what in config.wrong:
        print(f"{options.prog}: {what}", file=sys.stderr)
    return main.FAILED if config.wrong else main.OK


# --- vrs tools completion -------------------------------------------------------------------------------------------


# a placeholder that contains one of these words stands for a file
FILES = ("FILE", "OUT", ".v2", ".vrst", ".csv", ".html", ".svg")
FOLDERS = ("FOLDER", "DIR", "EXERCISE")


def completion(options: Namespace) -> None:
    """Print the script that lets a shell complete vrs. It is made from one parser for all subcommands."""
    import shtab

    whole = ArgumentParser(prog="vrs")
    whole.add_argument("--version", action="store_true", help="the version")
    subcommands = whole.add_subparsers()
    families: dict[str, Any] = {}
    for name, row in commands.SUBCOMMANDS.items():
        first, _, second = name.partition(" ")
        own = Parser(name, f"vrs {name}")
        for action in own.arguments():
            _teach(action, shtab.FILE, shtab.DIRECTORY)
        if second and first in commands.SUBCOMMANDS:  # `class token` is completed as an argument of `class`
            continue
        if second and first not in families:
            rows = ", ".join(name.split()[1] for name in commands.SUBCOMMANDS if name.startswith(f"{first} "))
            families[first] = subcommands.add_parser(first, help=rows).add_subparsers()
        place = families[first] if second else subcommands
        place.add_parser(second or first, help=row.summary, parents=[own], add_help=False)
    print(shtab.complete(whole, options.shell))


def _teach(action: Action, file: object, folder: object) -> None:
    """Set how a shell completes the value of an argument."""
    from vrs_cli.cli.recorded import formats
    from vrs_cli.kinematics.robot_file import robot_names

    placeholder = str(action.metavar)
    if "--robot" in action.option_strings:
        action.choices = robot_names()
    elif "--to" in action.option_strings and placeholder == "FORMAT":
        action.choices = tuple(formats())
    elif any(part in placeholder for part in (*FILES, *FOLDERS)):
        action.complete = folder if any(part in placeholder for part in FOLDERS) else file  # type: ignore[attr-defined]


# --- vrs tools lsp --------------------------------------------------------------------------------------------------


def lsp(options: Namespace) -> None:
    """Serve one editor over standard input and output until the editor ends the session."""
    if find_spec("pygls") is None:
        raise CommandLineError("the language server needs pygls, which is not installed", how_to_install("pygls"))
    from vrs_cli.lsp.server import Val2Server

    output = os.fdopen(os.dup(sys.stdout.fileno()), "wb")  # pygls closes the stream to which it writes
    Val2Server(chosen_robot(options)).start_io(sys.stdin.buffer, output)


def robots(options: Namespace) -> None:
    """Print the list of built-in robots, or the data of one robot."""
    from vrs_cli.kinematics.forms import arm_for
    from vrs_cli.kinematics.robot_file import load_robot, robot_names
    from vrs_cli.render.blocks import Column, Grid, text_of

    if options.robot is not None:
        print(text_of(_one(arm_for(chosen_robot(options)))), end="")
        return
    arms = [arm_for(load_robot(name)) for name in robot_names()]
    headings = ("Name", "Robot", "Joints", "Configurations")
    rows = tuple((arm.model.name, arm.model.title, str(arm.model.joint_count), _words(arm)) for arm in arms)
    print(text_of([Grid(tuple(map(Column, headings)), rows)]), end="")


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
    columns = tuple(map(number_column, (*headings, *(pose.upper() for pose in model.poses))))
    table = [model.units.to_display(row) for row in (*rates, *model.poses.values())]
    names = () if model.origin is None else tuple(map("{}, {}".format, model.origin.joints, model.origin.types))
    rows = tuple(
        (f"JT{i}", model.units.unit(i), *(f"{row[i - 1]:.2f}" for row in table), *names[i - 1 : i])
        for i in range(1, model.joint_count + 1)
    )
    named = (Column("joint"),) if names else ()
    yield Grid((Column(""), Column("", width=4), *columns, *named), rows)


def _hand(model: RobotModel) -> str:
    """Describe the hand of a robot: what moves it, and how wide it opens."""
    moved = "" if model.origin is None else ", ".join(model.origin.fingers)
    if model.hand_width:
        opens = f"opens {1000.0 * model.hand_width:.1f} mm"
        return f"{moved}; {opens}" if moved else opens
    return moved and f"{moved}; how wide it opens is not known ([hand] of a TOML file says it)"
