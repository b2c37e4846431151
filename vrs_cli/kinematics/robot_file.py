"""Robots from files: a TOML file (`robots/puma560.toml`), a URDF file, or a TOML file that names one and adds to it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import NEEDED_POSES, TOOL_KEYS, URDF_OPTIONS, ModelReader

if TYPE_CHECKING:
    from vrs_cli.kinematics.urdf import UrdfArm

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
    return _from_urdf(reader, _urdf_arm(file, *ends), table)


def _read_urdf(path: Path) -> RobotModel:
    return _from_urdf(ModelReader(str(path), human=True), _urdf_arm(path), {})


def _urdf_arm(path: Path, base: str | None = None, tip: str | None = None) -> UrdfArm:
    from vrs_cli.kinematics.urdf import read  # here: it brings an XML parser, which few robots need

    return read(str(path), _text(path, "URDF"), base, tip)


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


# what a URDF file does not say
FULL_SPEED_IN = 0.3  # [s] accelerations: full velocity in this time
FULL_ACCELERATION_IN = 0.1  # [s] jerks: full acceleration in this time
USUAL_TOOL_SPEEDS = {"linear_speed": 500.0, "angular_speed": 90.0}  # [mm/s, deg/s]


def _from_urdf(reader: ModelReader, arm: UrdfArm, table: Mapping[str, object]) -> RobotModel:
    """The arm of a URDF file with the figures that it has not: those of the TOML file, else our usual ones."""
    own = reader.own_joints(table.get("joints", []), [joint.name for joint in arm.joints])
    joints = [
        _with_rates(
            {**link._asdict(), "lower": joint.lower, "upper": joint.upper, "max_velocity": joint.velocity}, more
        )
        for joint, link, more in zip(arm.joints, arm.links, own, strict=True)
    ]
    tool = {**_usual_tool(), **reader.numbers(table.get("tool", {}), "tool", TOOL_KEYS)}
    middle = [_rest(joint["lower"], joint["upper"]) for joint in joints]
    poses = reader.some_poses(table.get("poses", {}), joints)
    data = {
        "name": table.get("name", arm.name),
        "title": table.get("title", arm.name),
        "base": list(arm.base),
        "flange": list(arm.flange),
        "joints": [{**joint, "kind": joint["kind"].value} for joint in joints],
        "tool": tool,
        "poses": {**dict.fromkeys(NEEDED_POSES, middle), **poses},
    }
    options = {key: table[key] for key in ("task", "profile") if key in table}
    return ModelReader(reader.file, human=False).model({**data, **options})


def _with_rates(joint: dict[str, Any], more: Mapping[str, float]) -> dict[str, Any]:
    joint = {**joint, **more}
    joint.setdefault("max_acceleration", joint["max_velocity"] / FULL_SPEED_IN)
    joint.setdefault("max_jerk", joint["max_acceleration"] / FULL_ACCELERATION_IN)
    return joint


def _usual_tool() -> dict[str, float]:
    figures: dict[str, float] = {}
    for key, human in USUAL_TOOL_SPEEDS.items():
        speed = TOOL_KEYS[key].to_si(human)
        word = key.removesuffix("speed")
        figures |= {key: speed, f"{word}acceleration": speed / FULL_SPEED_IN}
        figures[f"{word}jerk"] = speed / FULL_SPEED_IN / FULL_ACCELERATION_IN
    return figures


def _rest(lower: float, upper: float) -> float:
    """Zero where the joint can be there, otherwise the middle of its range."""
    return 0.0 if lower <= 0.0 <= upper else (lower + upper) / 2
