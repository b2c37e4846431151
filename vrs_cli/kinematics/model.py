"""The robot model theta: link parameters, limits, nominal speeds and named poses. Data, never code.

A robot is a TOML file in millimetres and degrees (`robots/puma560.toml`), or a URDF file, or a TOML file that names one
and adds to it. The model holds metres and radians, and so do the plain dictionaries of `to_dict` and `from_dict`, which
give every bit back and have the keys of the TOML file.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import accumulate
from math import dist, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.kinematics.axes import EXACT, Line, Link, axis_of, cross, link_transform
from vrs_cli.kinematics.joints import JointKind, Joints, JointUnits
from vrs_cli.kinematics.task import ALL_PARTS, Task, usual_task
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, from_oat

if TYPE_CHECKING:
    from vrs_cli.kinematics.urdf import UrdfArm

ROBOTS = Path(__file__).parent / "robots"
NEEDED_POSES = ("ready", "nest")
PROFILES = ("LSPB", "SCURVE")  # the first is that of a robot that names none
SAMPLES = (0.05, 0.3, 0.45, 0.7, 0.9)  # of a joint's range: poses that show what an arm cannot change


@dataclass(frozen=True)
class RobotModel:
    """One robot. Joint by joint: limits [rad, m], velocity [rad/s, m/s], acceleration and jerk likewise.

    T_base_flange = base . links . flange; `task` is the part of a pose that counts. The tool's linear [m/s, m/s2,
    m/s3] and angular [rad/s, rad/s2, rad/s3] figures are those of a straight line at SPEED 100. `profile`: what
    PARAMETER PROFILE is at the start.
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
    base: Transform = IDENTITY
    flange: Transform = IDENTITY
    task: Task = Task.POSE
    profile: str = PROFILES[0]

    @property
    def joint_count(self) -> int:
        return len(self.links)

    @cached_property
    def units(self) -> JointUnits:
        """How people see the joints: degrees and millimetres."""
        return JointUnits(tuple(link.kind for link in self.links))

    def said(self, joint: int, x: float, decimals: int = 2) -> str:
        """A value of a joint, counted from 1, for a message."""
        return f"{self.units.one_shown(joint, x):.{decimals}f} {self.units.unit(joint)}"

    def range_of(self, joint: int, decimals: int = 2) -> str:
        """The range of a joint, counted from 1, for a message."""
        low = self.units.one_shown(joint, self.lower[joint - 1])
        return f"{low:.{decimals}f} to {self.said(joint, self.upper[joint - 1], decimals)}"


def joint_axes(model: RobotModel) -> tuple[Line, ...]:
    """The axes of the joints while all of them are 0, in the base frame."""
    return tuple(map(axis_of, link_frames(model, (0.0,) * model.joint_count)[:-1]))


def axes_parallel(model: RobotModel) -> bool:
    """Whether all axes are, as those of a SCARA are."""
    first, *others = joint_axes(model)
    return all(max(map(abs, cross(first.direction, other.direction))) < EXACT for other in others)


def _steady(model: RobotModel) -> bool:
    """Whether the flange keeps its direction, as that of a SCARA and of a gantry does."""
    ranges = list(zip(model.lower, model.upper, strict=True))
    poses = (tuple(low + part * (high - low) for low, high in ranges) for part in SAMPLES)
    first, *others = (axis_of(link_frames(model, q)[-1]).direction for q in poses)
    return all(dist(first, other) < EXACT for other in others)


def link_frames(model: RobotModel, q: Joints) -> tuple[Transform, ...]:
    """T_base_0, T_base_1, ... T_base_flange: one frame more than joints; joint i turns about z of frame i - 1."""
    steps = [link_transform(link, x) for link, x in zip(model.links, q, strict=True)]
    steps[-1] = compose(steps[-1], model.flange)
    return tuple(accumulate(steps, compose, initial=model.base))


# --- the table of keys: what each number is, for the reader, the writer and the messages -----------------


class Quantity(NamedTuple):
    """A kind of number: its unit in a TOML file, and whether it must be above zero."""

    unit: str
    positive: bool = False

    def to_si(self, value: float) -> float:
        if self.unit.startswith("mm"):
            return value / 1000.0
        return radians(value)

    def sliding(self) -> Quantity:
        """The same of a joint that slides."""
        return Quantity(self.unit.replace("deg", "mm"), self.positive)


LINK_KEYS: Mapping[str, Quantity] = {
    "a": Quantity("mm"),
    "d": Quantity("mm"),
    "alpha": Quantity("deg"),
    "theta": Quantity("deg"),
}
JOINT_KEYS: Mapping[str, Quantity] = {
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
NEEDED_LINK_KEYS = ("a", "d", "alpha")
MODEL_KEYS = ("name", "title", "joints", "tool", "poses")
MODEL_OPTIONS = ("task", "base", "flange", "profile")
URDF_OPTIONS = ("name", "title", "urdf_base", "urdf_tip", "joints", "tool", "poses", "task", "profile")
LENGTH, ANGLE = Quantity("mm"), Quantity("deg")
TURN, SLIDE = (kind.value for kind in JointKind)
HUGE = 1e9  # no length, angle or rate of a robot; keeps infinity and NaN out as well


# --- to and from plain data ------------------------------------------------------------------------------


def to_dict(model: RobotModel) -> dict[str, Any]:
    """Plain data in metres and radians, as in the header of a trajectory file; `from_dict` takes it back."""
    return {
        "name": model.name,
        "title": model.title,
        **_unless_usual(model),
        "joints": [
            {**_link_to_dict(link), **{key: getattr(model, key)[i] for key in JOINT_KEYS}}
            for i, link in enumerate(model.links)
        ],
        "tool": {key: getattr(model, key) for key in TOOL_KEYS},
        "poses": {name: list(q) for name, q in model.poses.items()},
        **({} if model.profile == PROFILES[0] else {"profile": model.profile}),
    }


def _link_to_dict(link: Link) -> dict[str, Any]:
    data: dict[str, Any] = link._asdict()
    data["kind"] = link.kind.value
    usual = {"theta": 0.0, "kind": TURN}
    return {key: value for key, value in data.items() if key not in usual or value != usual[key]}


def _unless_usual(model: RobotModel) -> dict[str, Any]:
    frames = {key: list(T) for key in ("base", "flange") if (T := getattr(model, key)) != IDENTITY}
    usual = model.task is Task.POSE and model.joint_count >= ALL_PARTS
    return frames if usual else {**frames, "task": model.task.value}


def from_dict(data: object, where: str = "robot model") -> RobotModel:
    """The model of a dictionary in metres and radians. Raises FileDamaged, naming `where` and the key."""
    return _Reader(where, human=False).model(data)


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
    if "urdf" not in data:
        return _Reader(str(path), human=True).model(data)
    reader = _Reader(str(path), human=True)
    file = path.parent / reader.word(data.pop("urdf"), "urdf")
    table = reader.table(data, "the file", (), URDF_OPTIONS)
    ends = (reader.word(table[key], key) if key in table else None for key in ("urdf_base", "urdf_tip"))
    return _from_urdf(reader, _urdf_arm(file, *ends), table)


def _read_urdf(path: Path) -> RobotModel:
    return _from_urdf(_Reader(str(path), human=True), _urdf_arm(path), {})


def _urdf_arm(path: Path, base: str | None = None, tip: str | None = None) -> UrdfArm:
    from vrs_cli.kinematics.urdf import read  # here: it brings an XML parser, which few robots need

    return read(str(path), _text(path, "URDF"), base, tip)


_READERS = {".toml": _read_toml, ".urdf": _read_urdf, ".xml": _read_urdf, ".xacro": _read_urdf}


def _text(path: Path, kind: str) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise NonexistentFile(str(path)) from None
    except UnicodeDecodeError:
        raise FileDamaged(str(path), f"a robot is a {kind} file in UTF-8") from None
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from error


# --- what a URDF file does not say -------------------------------------------------------------------------------

FULL_SPEED_IN = 0.3  # [s] accelerations: full velocity in this time
FULL_ACCELERATION_IN = 0.1  # [s] jerks: full acceleration in this time
USUAL_TOOL_SPEEDS = {"linear_speed": 500.0, "angular_speed": 90.0}  # [mm/s, deg/s]


def _from_urdf(reader: _Reader, arm: UrdfArm, table: Mapping[str, object]) -> RobotModel:
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
    task = {"task": table["task"]} if "task" in table else {}
    return _Reader(reader.file, human=False).model({**data, **task})


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


# --- the reader --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Reader:
    """Checks plain data and makes the model; `human` data is in millimetres and degrees."""

    file: str
    human: bool

    def model(self, data: object) -> RobotModel:
        table = self.table(data, "the file", MODEL_KEYS, MODEL_OPTIONS)
        joints = self.joints(table["joints"])
        tool = self.table(table["tool"], "tool", TOOL_KEYS)
        figures: dict[str, Any] = {key: tuple(joint[key] for joint in joints) for key in JOINT_KEYS}
        figures |= {key: self.number(tool[key], f"tool.{key}", quantity) for key, quantity in TOOL_KEYS.items()}
        figures |= {key: self.frame(table[key], key) for key in ("base", "flange") if key in table}
        model = RobotModel(
            name=self.word(table["name"], "name"),
            title=self.word(table["title"], "title"),
            links=tuple(Link(**{key: joint[key] for key in Link._fields}) for joint in joints),
            poses=self.poses(table["poses"], joints),
            **figures,
            profile=self.profile(table.get("profile", PROFILES[0])),
        )
        return replace(model, task=self.task(table.get("task"), model))

    def profile(self, value: object) -> str:
        if value not in PROFILES:
            raise self.wrong("profile", f"{value!r} is no profile", f"write one of {', '.join(PROFILES)}")
        return str(value)

    def joints(self, data: object) -> list[dict[str, Any]]:
        if not isinstance(data, list) or not data:
            raise self.wrong("joints", "is not a list of joints", "write one [[joints]] table for each joint")
        return [self.joint(joint, f"joint {i}") for i, joint in enumerate(data, 1)]

    def joint(self, data: object, key: str) -> dict[str, Any]:
        table = self.table(data, key, (*NEEDED_LINK_KEYS, *JOINT_KEYS), ("theta", "kind"))
        kind = self.kind(table.get("kind", TURN), key)
        joint: dict[str, Any] = {"theta": 0.0, "kind": kind}
        for name, quantity in LINK_KEYS.items():
            if name in table:
                joint[name] = self.number(table[name], f"{key}: {name}", quantity)
        for name in JOINT_KEYS:
            joint[name] = self.of_joint(table[name], f"{key}: {name}", name, kind)
        self.check_range(joint, key, table)
        return joint

    def of_joint(self, value: object, key: str, name: str, kind: JointKind) -> float:
        quantity = JOINT_KEYS[name]
        return self.number(value, key, quantity.sliding() if kind is JointKind.PRISMATIC else quantity)

    def check_range(self, joint: Mapping[str, Any], key: str, told: Mapping[str, object]) -> None:
        if not joint["lower"] < joint["upper"]:
            lower, upper = (told.get(end, joint[end]) for end in ("lower", "upper"))
            raise self.wrong(key, f"lower {lower} is not below upper {upper}", "swap or mend the two limits")

    def kind(self, value: object, key: str) -> JointKind:
        if value not in (TURN, SLIDE):
            raise self.wrong(key, f"kind is {value!r}", f'write "{TURN}" or "{SLIDE}"')
        return JointKind(value)

    def own_joints(self, data: object, names: Sequence[str]) -> list[dict[str, float]]:
        """For each joint of a URDF file, in its order, what a TOML file says beside it."""
        tables = data if isinstance(data, list) else [data]
        own: dict[str, dict[str, float]] = {name: {} for name in names}
        for i, table in enumerate(tables, 1):
            key = f"joint {i}"
            checked = self.table(table, key, ("name",), (*JOINT_KEYS, "kind"))
            name = checked["name"]
            if name not in own:
                raise self.wrong(key, f"the URDF file has no joint {name!r} that moves", f"it has {', '.join(names)}")
            kind = self.kind(checked.get("kind", TURN), key)
            own[str(name)] = {k: self.of_joint(checked[k], f"{key}: {k}", k, kind) for k in JOINT_KEYS if k in checked}
        return [own[name] for name in names]

    def numbers(self, data: object, key: str, quantities: Mapping[str, Quantity]) -> dict[str, float]:
        """Some of these numbers."""
        table = self.table(data, key, (), tuple(quantities))
        return {name: self.number(value, f"{key}.{name}", quantities[name]) for name, value in table.items()}

    def task(self, value: object, model: RobotModel) -> Task:
        if value is None:
            found = usual_task(model.units.kinds, parallel=axes_parallel(model), steady=_steady(model))
            if found is None:
                words = ", ".join(f'"{task.value}"' for task in Task if task.suits(model.joint_count))
                if not words:
                    raise self.wrong("joints", "there is one joint", "an arm has two at least")
                raise self.wrong("task", f"{model.joint_count} joints do not say it", f"give one of {words}")
            return found
        task = next((task for task in Task if task.value == value), None)
        if task is None:
            raise self.wrong("task", f"{value!r} is none", f"give one of {', '.join(task.value for task in Task)}")
        if not task.suits(model.joint_count):
            what = f"{task.value!r} takes {task.size} joints"
            raise self.wrong("task", what, f"the robot has {model.joint_count}")
        return task

    def frame(self, data: object, key: str) -> Transform:
        count, form = (6, "X, Y, Z, O, A, T in mm and deg") if self.human else (12, "the rows of a matrix")
        if not isinstance(data, list | tuple) or len(data) != count:
            raise self.wrong(key, f"is not a list of {count} numbers", f"give {form}")
        if self.human:
            units = [LENGTH] * 3 + [ANGLE] * 3
            return from_oat(*(self.number(x, key, quantity) for x, quantity in zip(data, units, strict=True)))
        return Transform(*(self.number(x, key, LENGTH) for x in data))

    def poses(self, data: object, joints: Sequence[Mapping[str, Any]]) -> dict[str, Joints]:
        if not isinstance(data, Mapping):
            raise self.wrong("poses", "is not a table", f"write [poses] with at least {' and '.join(NEEDED_POSES)}")
        for name in NEEDED_POSES:
            if name not in data:
                raise self.wrong(f"poses.{name}", "is missing", f"give its {len(joints)} joint values")
        return self.some_poses(data, joints)

    def some_poses(self, data: object, joints: Sequence[Mapping[str, Any]]) -> dict[str, Joints]:
        if not isinstance(data, Mapping):
            raise self.wrong("poses", "is not a table", "write [poses] with names of poses and their joint values")
        return {str(name): self.pose(q, f"poses.{name}", joints) for name, q in data.items()}

    def pose(self, data: object, key: str, joints: Sequence[Mapping[str, Any]]) -> Joints:
        count, units = len(joints), JointUnits(tuple(joint["kind"] for joint in joints))
        if not isinstance(data, list | tuple) or len(data) != count:
            said = " and ".join(dict.fromkeys(units.unit(i) for i in range(1, count + 1)))
            hint = f"give the {count} joint values in {said if self.human else self.si(said)}"
            raise self.wrong(key, f"is not a list of {count} numbers", hint)
        quantities = [LENGTH if units.slides(i) else ANGLE for i in range(1, count + 1)]
        values = enumerate(zip(data, quantities, strict=True), 1)
        q = tuple(self.number(value, f"{key}, joint {i}", quantity) for i, (value, quantity) in values)
        for i, (x, joint) in enumerate(zip(q, joints, strict=True), 1):
            if not joint["lower"] <= x <= joint["upper"]:
                low, high, at = (units.one_shown(i, y) for y in (joint["lower"], joint["upper"], x))
                hint = f"its range is {low:g} to {high:g} {units.unit(i)}"
                raise self.wrong(key, f"puts joint {i} at {at:g} {units.unit(i)}", hint)
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
        return quantity.unit if self.human else self.si(quantity.unit)

    def si(self, unit: str) -> str:
        return unit.replace("mm", "m").replace("deg", "rad")

    def wrong(self, key: str, what: str, right: str) -> FileDamaged:
        return FileDamaged(f"{self.file}: {key}: {what}", right)
