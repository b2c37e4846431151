"""Robots from files: a TOML file (`robots/puma560.toml`), a URDF file, or a TOML file that names one and adds to it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import URDF_OPTIONS, ModelReader

ROBOTS = Path(__file__).parent / "robots"


def load_robot(name_or_path: str | Path) -> RobotModel:
    """The built-in robot of that name, or the one in a .toml or .urdf file.

    Raises NonexistentFile, FileError (unreadable) or FileDamaged (with file, key and what would be right).
    """
    text = str(name_or_path)
    if text.lower() in robot_names():
        return _built_in(text.lower())
    read = _READERS.get(Path(text).suffix.lower())
    if read is None:
        raise NonexistentFile(
            f"no robot is called {text!r}",
            f"there is {', '.join(robot_names())}; or give a path that ends in .toml or .urdf",
        )
    return read(Path(text))


def robot_names() -> tuple[str, ...]:
    """The robots that are built in."""
    return tuple(sorted(path.stem for path in ROBOTS.glob("*.toml")))


@lru_cache
def _built_in(name: str) -> RobotModel:
    return _read_toml(ROBOTS / f"{name}.toml")


def _read_toml(path: Path) -> RobotModel:
    try:
        data = tomllib.loads(_text(path, "TOML"))
    except tomllib.TOMLDecodeError as error:
        raise FileDamaged(f"{path}: {error}", "a robot is a TOML file") from None
    except RecursionError:
        raise FileDamaged(f"{path}: lists or tables in one another without end", "a robot is a TOML file") from None
    if "urdf" not in data:
        return ModelReader(str(path), human=True).model(data)
    reader = ModelReader(str(path), human=True)
    file = path.parent / reader.word(data.pop("urdf"), "urdf")
    table = reader.table(data, "the file", (), URDF_OPTIONS)
    ends = (reader.word(table[key], key) if key in table else None for key in ("urdf_base", "urdf_tip"))
    return _from_urdf(reader, file, table, *ends)


def _read_urdf(path: Path) -> RobotModel:
    return _from_urdf(ModelReader(str(path), human=True), path, {})


def _from_urdf(
    reader: ModelReader, path: Path, table: Mapping[str, object], base: str | None = None, tip: str | None = None
) -> RobotModel:
    from vrs_cli.kinematics.urdf import model_of, read  # here: it brings an XML parser, which few robots need

    return model_of(read(str(path), _text(path, "URDF"), base, tip), reader, table)


_READERS = {".toml": _read_toml, ".urdf": _read_urdf, ".xml": _read_urdf, ".xacro": _read_urdf}


def _text(path: Path, kind: str) -> str:
    right = f"a robot is a {kind} file"
    try:
        if path.exists() and not path.is_file():
            raise FileError(f"{path} is a folder, a pipe or a device", right)
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise NonexistentFile(str(path)) from None
    except UnicodeDecodeError:
        raise FileDamaged(str(path), f"{right} in UTF-8") from None
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from error
    except ValueError:
        raise FileError(f"{str(path)!r} is no name of a file", right) from None
