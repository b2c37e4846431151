"""The robot model theta: link parameters, limits, nominal speeds and named poses. Data, never code.

A robot is a TOML file in millimetres and degrees (`robots/puma560.toml`); the model holds metres and radians,
and so do the plain dictionaries of `to_dict` and `from_dict`, which give every bit back. Both forms have the
same keys.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from math import degrees, radians
from pathlib import Path
from typing import Any, NamedTuple

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.kinematics.joints import Joints

ROBOTS = Path(__file__).parent / "robots"
NEEDED_POSES = ("ready", "nest")
PROFILES = ("LSPB", "SCURVE")  # the first is that of a robot that names none


class Link(NamedTuple):
    """Standard Denavit-Hartenberg: Rz(q) Tz(d) Tx(a) Rx(alpha). a, d [m], alpha [rad]."""

    a: float
    d: float
    alpha: float


@dataclass(frozen=True)
class RobotModel:
    """One robot. Joint by joint: limits [rad], velocity [rad/s], acceleration [rad/s2], jerk [rad/s3].

    The tool's linear [m/s, m/s2, m/s3] and angular [rad/s, rad/s2, rad/s3] figures are those of a straight
    line at SPEED 100. `profile`: what PARAMETER PROFILE is at the start.
    """

    name: str
    title: str
    links: tuple[Link, ...]
    lower: Joints
    upper: Joints
    max_velocity: Joints
    max_acceleration: Joints
    max_jerk: Joints
    linear_speed: float
    linear_acceleration: float
    linear_jerk: float
    angular_speed: float
    angular_acceleration: float
    angular_jerk: float
    poses: Mapping[str, Joints] = field(hash=False)  # a dictionary has no hash; the rest tells models apart
    profile: str = PROFILES[0]

    @property
    def joint_count(self) -> int:
        return len(self.links)


# --- the table of keys: what each number is, for the reader, the writer and the messages -----------------


class Quantity(NamedTuple):
    """A kind of number: its unit in a TOML file, and whether it must be above zero."""

    unit: str
    positive: bool = False

    def to_si(self, value: float) -> float:
        if self.unit.startswith("mm"):
            return value / 1000.0
        return radians(value)


JOINT_KEYS: Mapping[str, Quantity] = {
    "a": Quantity("mm"),
    "d": Quantity("mm"),
    "alpha": Quantity("deg"),
    "lower": Quantity("deg"),
    "upper": Quantity("deg"),
    "max_velocity": Quantity("deg/s", positive=True),
    "max_acceleration": Quantity("deg/s2", positive=True),
    "max_jerk": Quantity("deg/s3", positive=True),
}
TOOL_KEYS: Mapping[str, Quantity] = {
    "linear_speed": Quantity("mm/s", positive=True),
    "linear_acceleration": Quantity("mm/s2", positive=True),
    "linear_jerk": Quantity("mm/s3", positive=True),
    "angular_speed": Quantity("deg/s", positive=True),
    "angular_acceleration": Quantity("deg/s2", positive=True),
    "angular_jerk": Quantity("deg/s3", positive=True),
}
MODEL_KEYS = ("name", "title", "joints", "tool", "poses")
MODEL_OPTIONS = ("profile",)
ANGLE = Quantity("deg")
HUGE = 1e9  # no length, angle or rate of a robot; keeps infinity and NaN out as well

Limits = tuple[tuple[float, float], ...]


# --- to and from plain data ------------------------------------------------------------------------------


def to_dict(model: RobotModel) -> dict[str, Any]:
    """Plain data in metres and radians, as in the header of a trajectory file; `from_dict` takes it back."""
    return {
        "name": model.name,
        "title": model.title,
        "joints": [
            {
                **link._asdict(),
                **{key: getattr(model, key)[i] for key in JOINT_KEYS if key not in Link._fields},
            }
            for i, link in enumerate(model.links)
        ],
        "tool": {key: getattr(model, key) for key in TOOL_KEYS},
        "poses": {name: list(q) for name, q in model.poses.items()},
        **({} if model.profile == PROFILES[0] else {"profile": model.profile}),
    }


def from_dict(data: object, where: str = "robot model") -> RobotModel:
    """The model of a dictionary in metres and radians. Raises FileDamaged, naming `where` and the key."""
    return _Reader(where, human=False).model(data)


def load_robot(name_or_path: str | Path) -> RobotModel:
    """The built-in robot of that name, or the one in a .toml file.

    Raises NonexistentFile, FileError (unreadable) or FileDamaged (with file, key and what would be right).
    """
    text = str(name_or_path)
    if text.lower() in robot_names():
        return _built_in(text.lower())
    if not text.endswith(".toml"):
        raise NonexistentFile(
            f"no robot is called {text!r}",
            f"there is {', '.join(robot_names())}; or give a path that ends in .toml",
        )
    return _with_known_geometry(_read_file(Path(text)), text)


def _with_known_geometry(model: RobotModel, path: str) -> RobotModel:
    """The model itself. Raises FileDamaged, naming the file, for links that no arm of ours has."""
    from vrs_cli.kinematics.arm import arm_for

    try:
        arm_for(model)
    except FileDamaged as unknown:
        raise FileDamaged(f"{path}: {unknown.detail}", unknown.hint) from None
    return model


def robot_names() -> tuple[str, ...]:
    """The robots that are built in."""
    return tuple(sorted(path.stem for path in ROBOTS.glob("*.toml")))


@lru_cache
def _built_in(name: str) -> RobotModel:
    return _read_file(ROBOTS / f"{name}.toml")


def _read_file(path: Path) -> RobotModel:
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise NonexistentFile(str(path)) from None
    except UnicodeDecodeError:
        raise FileDamaged(str(path), "a robot is a TOML file in UTF-8") from None
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from error
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FileDamaged(f"{path}: {error}", "a robot is a TOML file") from None
    return _Reader(str(path), human=True).model(data)


@dataclass(frozen=True)
class _Reader:
    """Checks plain data and makes the model; `human` data is in millimetres and degrees."""

    file: str
    human: bool

    def model(self, data: object) -> RobotModel:
        table = self.table(data, "the file", MODEL_KEYS, MODEL_OPTIONS)
        joints = self.joints(table["joints"])
        tool = self.table(table["tool"], "tool", TOOL_KEYS)
        per_joint: dict[str, Joints] = {key: tuple(joint[key] for joint in joints) for key in JOINT_KEYS}
        return RobotModel(
            name=self.word(table["name"], "name"),
            title=self.word(table["title"], "title"),
            links=tuple(Link(joint["a"], joint["d"], joint["alpha"]) for joint in joints),
            lower=per_joint["lower"],
            upper=per_joint["upper"],
            max_velocity=per_joint["max_velocity"],
            max_acceleration=per_joint["max_acceleration"],
            max_jerk=per_joint["max_jerk"],
            **{key: self.number(tool[key], f"tool.{key}", quantity) for key, quantity in TOOL_KEYS.items()},
            poses=self.poses(table["poses"], tuple(zip(per_joint["lower"], per_joint["upper"], strict=True))),
            profile=self.profile(table.get("profile", PROFILES[0])),
        )

    def profile(self, value: object) -> str:
        if value not in PROFILES:
            raise self.wrong("profile", f"{value!r} is no profile", f"write one of {', '.join(PROFILES)}")
        return str(value)

    def joints(self, data: object) -> list[dict[str, float]]:
        if not isinstance(data, list) or not data:
            raise self.wrong("joints", "is not a list of joints", "write one [[joints]] table for each joint")
        return [self.joint(joint, f"joint {i}") for i, joint in enumerate(data, 1)]

    def joint(self, data: object, key: str) -> dict[str, float]:
        table = self.table(data, key, JOINT_KEYS)
        joint = {name: self.number(table[name], f"{key}: {name}", kind) for name, kind in JOINT_KEYS.items()}
        if not joint["lower"] < joint["upper"]:
            what = f"lower {table['lower']} is not below upper {table['upper']}"
            raise self.wrong(key, what, "swap or mend the two limits")
        return joint

    def poses(self, data: object, limits: Limits) -> dict[str, Joints]:
        if not isinstance(data, Mapping):
            raise self.wrong("poses", "is not a table", f"write [poses] with at least {' and '.join(NEEDED_POSES)}")
        for name in NEEDED_POSES:
            if name not in data:
                raise self.wrong(f"poses.{name}", "is missing", f"give its {len(limits)} joint values")
        return {str(name): self.pose(q, f"poses.{name}", limits) for name, q in data.items()}

    def pose(self, data: object, key: str, limits: Limits) -> Joints:
        count = len(limits)
        if not isinstance(data, list | tuple) or len(data) != count:
            hint = f"give the {count} joint values in {self.unit(ANGLE)}"
            raise self.wrong(key, f"is not a list of {count} numbers", hint)
        q = tuple(self.number(value, f"{key}, joint {i}", ANGLE) for i, value in enumerate(data, 1))
        for i, (angle, (low, high)) in enumerate(zip(q, limits, strict=True), 1):
            if not low <= angle <= high:
                hint = f"its range is {degrees(low):g} to {degrees(high):g} deg"
                raise self.wrong(key, f"puts joint {i} at {degrees(angle):g} deg", hint)
        return q

    def table(self, data: object, key: str, keys: Iterable[str], options: Iterable[str] = ()) -> Mapping[str, object]:
        """A table with all of these keys and some of the options."""
        needed, known = tuple(keys), (*keys, *options)
        if not isinstance(data, Mapping):
            raise self.wrong(key, "is not a table", f"give {', '.join(known)}")
        for name in data:
            if name not in known:
                near = difflib.get_close_matches(str(name), known, n=1)
                hint = f"did you mean {near[0]}?" if near else f"known here: {', '.join(known)}"
                raise self.wrong(key, f"has an unknown key {name!r}", hint)
        for name in needed:
            if name not in data:
                raise self.wrong(key, f"has no {name}", f"give {', '.join(needed)}")
        return data

    def number(self, value: object, key: str, quantity: Quantity) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or value != value:  # NaN
            raise self.wrong(key, f"{value!r} is not a number", f"give a number in {self.unit(quantity)}")
        if not abs(value) < HUGE:
            raise self.wrong(key, f"{value!r} is too large", f"give less than {HUGE:g} {self.unit(quantity)}")
        if quantity.positive and not value > 0:
            raise self.wrong(key, f"{value!r} is not above zero", f"give a number above 0 in {self.unit(quantity)}")
        return quantity.to_si(value) if self.human else float(value)

    def word(self, value: object, key: str) -> str:
        if not isinstance(value, str) or not value.strip():
            raise self.wrong(key, f"{value!r} is not a text", 'write it in quotes, as name = "puma560"')
        return value

    def unit(self, quantity: Quantity) -> str:
        return quantity.unit if self.human else quantity.unit.replace("mm", "m").replace("deg", "rad")

    def wrong(self, key: str, what: str, right: str) -> FileDamaged:
        return FileDamaged(f"{self.file}: {key}: {what}", right)
