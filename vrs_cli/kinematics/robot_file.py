"""Load robots from files: TOML (`kinematics/robots/puma560.toml`), URDF, or TOML that extends a URDF file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from msgspec import Struct, structs

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile, NotAvailable
from vrs_cli.extras import cached
from vrs_cli.kinematics.model import ArmTask, RobotModel
from vrs_cli.kinematics.model_data import URDF_OPTIONS, ModelReader, misfit_of

if TYPE_CHECKING:
    from pathlib import Path

ROBOTS = os.path.join(os.path.dirname(__file__), "robots")


class Ends(Struct, frozen=True):
    """The names of the links at both ends of the arm in a URDF file; None if a TOML file that extends it, or the
    reader, chooses the link.
    """

    base: str | None = None
    tip: str | None = None


NO_ENDS = Ends()


def load_robot(name_or_path: str | Path, ends: Ends = NO_ENDS, task: str | None = None) -> RobotModel:
    """Load the built-in robot of this name, or the robot in a .toml or .urdf file. `task` replaces the task of the
    file.

    Raises NonexistentFile; FileError if the file cannot be read; FileDamaged with file, key and the correct form;
    NotAvailable if `ends` are given for a robot whose links have no names, or the robot cannot have the task.
    """
    text = str(name_or_path)
    if text.lower() in robot_names():
        model = _without_ends(_built_in(text.lower()), ends)
    elif (read := _READERS.get(os.path.splitext(text)[1].lower())) is not None:
        model = read(text, ends)
    else:
        raise NonexistentFile(
            f"no robot is called {text!r}",
            f"there is {', '.join(robot_names())}; or give a path that ends in .toml or .urdf",
        )
    if task is None:
        return model
    wanted = ArmTask(task)
    if (misfit := misfit_of(wanted, model)) is not None:
        raise NotAvailable(*misfit)
    return structs.replace(model, task=wanted)


def _without_ends(model: RobotModel, ends: Ends) -> RobotModel:
    if ends != NO_ENDS:
        raise NotAvailable(f"the links of {model.name} have no names", "a base and a tip are chosen of a URDF file")
    return model


def robot_names() -> tuple[str, ...]:
    """Return the names of the built-in robots."""
    return tuple(sorted(name.removesuffix(".toml") for name in os.listdir(ROBOTS) if name.endswith(".toml")))


@lru_cache
def _built_in(name: str) -> RobotModel:
    path = os.path.join(ROBOTS, f"{name}.toml")
    text = _text(path, "TOML")
    return _from_toml(path, cached(f"{name}.robot", text, lambda: _parse(path, text)), NO_ENDS)


def _read_toml(path: str, ends: Ends) -> RobotModel:
    return _from_toml(path, _parse(path, _text(path, "TOML")), ends)


def _parse(path: str, text: str) -> dict[str, Any]:
    # imported here because tomllib compiles long expressions, and built-in robots come from a cache without it
    import tomllib

    try:
        return tomllib.loads(text)
    except ValueError as error:
        raise FileDamaged(f"{path}: {error}", "a robot is a TOML file") from None
    except RecursionError:
        raise FileDamaged(f"{path}: lists or tables in one another without end", "a robot is a TOML file") from None


def _from_toml(path: str, data: dict[str, Any], ends: Ends) -> RobotModel:
    if "urdf" not in data:
        return _without_ends(ModelReader(path, human=True).model(data), ends)
    reader = ModelReader(path, human=True)
    file = os.path.join(os.path.dirname(path), reader.word(data.pop("urdf"), "urdf"))
    table = reader.table(data, "the file", (), URDF_OPTIONS)
    own = Ends(*(reader.word(table[key], key) if key in table else None for key in ("urdf_base", "urdf_tip")))
    try:
        return _from_urdf(reader, file, table, Ends(ends.base or own.base, ends.tip or own.tip))
    except FileError as error:
        raise FileDamaged(f"{path}: urdf: {error.detail}", error.hint) from None


def _read_urdf(path: str, ends: Ends) -> RobotModel:
    return _from_urdf(ModelReader(path, human=True), path, {}, ends)


def _from_urdf(reader: ModelReader, path: str, table: Mapping[str, object], ends: Ends) -> RobotModel:
    # imported here because it loads an XML parser, which few robots need
    from vrs_cli.kinematics.urdf.robot import robot_of

    return robot_of(path, _text(path, "URDF"), reader, table, ends.base, ends.tip)


_READERS = {".toml": _read_toml, ".urdf": _read_urdf, ".xml": _read_urdf, ".xacro": _read_urdf}


def _text(path: str, kind: str) -> str:
    right = f"a robot is a {kind} file"
    try:
        if os.path.exists(path) and not os.path.isfile(path):
            raise FileError(f"{path} is a folder, a pipe or a device", right)
        with open(path, encoding="utf-8") as stream:
            return stream.read()
    except FileNotFoundError:
        raise NonexistentFile(path) from None
    except UnicodeDecodeError:
        raise FileDamaged(path, f"{right} in UTF-8") from None
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from error
    except ValueError:
        raise FileError(f"{path!r} is no name of a file", right) from None
