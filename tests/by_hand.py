"""The longer runs beside the suite are commands: `python -m tests.oracle.long 500`."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, ArgumentTypeError
from collections.abc import Callable, Sequence
from functools import partial
from inspect import signature
from math import inf
from pathlib import Path
from typing import Any, Literal, NoReturn, get_args, get_origin, get_type_hints

from vrs_cli.errors import VrsError
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot


def command(main: Callable[..., int | None]) -> NoReturn:
    """Run `main` with the arguments of the process, each read as its annotation says, a list from all that are left;
    what is wrong with one is told in a line. The process ends with what `main` returns.
    """
    module, kinds = sys.modules["__main__"], get_type_hints(main)
    assert module.__spec__ is not None
    parser = ArgumentParser(f"python -m {module.__spec__.name}", description=module.__doc__)
    for name, parameter in signature(main).parameters.items():
        kind, needed = kinds[name], parameter.default is parameter.empty
        more = {} if needed else {"nargs": "?", "default": parameter.default}
        if get_origin(kind) is Sequence:
            (kind,), more["nargs"] = get_args(kind), "+" if needed else "*"
        one_of = get_args(kind) if get_origin(kind) is Literal else None
        parser.add_argument(name, type=READERS.get((kind, name), READERS.get(kind, str)), choices=one_of, **more)
    sys.exit(main(**vars(parser.parse_args())))


def _number(text: str, kind: type[float] = int, least: float = 1) -> float:
    try:
        number = kind(text)
    except ValueError:
        raise ArgumentTypeError(f"{text} is not a{' whole' if kind is int else ''} number") from None
    if not least <= number < inf:
        raise ArgumentTypeError(f"{text} is less than {least}, or without end")
    return number


def _robot(text: str) -> RobotModel:
    try:
        return load_robot(text)
    except VrsError as error:
        raise ArgumentTypeError(str(error)) from None


def _path(text: str) -> Path:
    if not (path := Path(text)).exists():
        raise ArgumentTypeError(f"there is no {text}")
    return path


READERS: dict[Any, Callable[[str], object]] = {
    int: _number,  # how much is tried
    (int, "arms"): partial(_number, least=0),
    (int, "first"): partial(_number, least=0),
    (int, "seed"): partial(_number, least=0),
    float: partial(_number, kind=float, least=0.001),
    RobotModel: _robot,
    Path: _path,
}
