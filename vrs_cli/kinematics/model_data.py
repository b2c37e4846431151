"""The robot model as plain data: the table of keys, the way out and the checked way back.

The dictionaries of `to_dict` and `from_dict` hold metres and radians, and give every bit back. A TOML file has the same
keys, in millimetres and degrees.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import radians
from reprlib import repr as brief
from typing import Any, NamedTuple

from vrs_cli.errors import FileDamaged, did_you_mean
from vrs_cli.kinematics.axes import Link
from vrs_cli.kinematics.joints import JointKind, Joints, JointUnits
from vrs_cli.kinematics.model import PROFILES, RobotModel, axes_parallel, flange_steady
from vrs_cli.kinematics.task import ALL_PARTS, Task, usual_task
from vrs_cli.kinematics.transform import IDENTITY, Transform, from_oat

NEEDED_POSES = ("ready", "nest")


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
TINY = 1e-9  # of what is above zero: slower is no motion


def to_dict(model: RobotModel) -> dict[str, Any]:
    """Plain data in metres and radians, as in the header of a trajectory file; `from_dict` takes it back."""
    usual = model.task is Task.POSE and model.joint_count >= ALL_PARTS
    return {
        "name": model.name,
        "title": model.title,
        **{key: list(T) for key in ("base", "flange") if (T := getattr(model, key)) != IDENTITY},
        **({} if usual else {"task": model.task.value}),
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


def from_dict(data: object, where: str = "robot model") -> RobotModel:
    """The model of a dictionary in metres and radians. Raises FileDamaged, naming `where` and the key."""
    return ModelReader(where, human=False).model(data)


class ModelReader(NamedTuple):
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
            raise self.wrong("profile", f"{brief(value)} is no profile", f"write one of {', '.join(PROFILES)}")
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
        if not joint["lower"] < joint["upper"]:
            lower, upper = (table.get(end, joint[end]) for end in ("lower", "upper"))
            raise self.wrong(key, f"lower {lower} is not below upper {upper}", "swap or mend the two limits")
        return joint

    def of_joint(self, value: object, key: str, name: str, kind: JointKind) -> float:
        quantity = JOINT_KEYS[name]
        return self.number(value, key, quantity.sliding() if kind is JointKind.PRISMATIC else quantity)

    def kind(self, value: object, key: str) -> JointKind:
        if value not in (TURN, SLIDE):
            raise self.wrong(key, f"kind is {brief(value)}", f'write "{TURN}" or "{SLIDE}"')
        return JointKind(value)

    def own_joints(self, data: object, names: Sequence[str]) -> list[dict[str, float]]:
        """For each joint of a URDF file, in its order, what a TOML file says beside it."""
        tables = data if isinstance(data, list) else [data]
        own: dict[str, dict[str, float]] = {name: {} for name in names}
        for i, table in enumerate(tables, 1):
            key = f"joint {i}"
            checked = self.table(table, key, ("name",), (*JOINT_KEYS, "kind"))
            name = self.word(checked["name"], f"{key}: name")
            if name not in own:
                raise self.wrong(
                    key, f"the URDF file has no joint {brief(name)} that moves", f"it has {', '.join(names)}"
                )
            kind = self.kind(checked.get("kind", TURN), key)
            own[name] = {k: self.of_joint(checked[k], f"{key}: {k}", k, kind) for k in JOINT_KEYS if k in checked}
        return [own[name] for name in names]

    def numbers(self, data: object, key: str, quantities: Mapping[str, Quantity]) -> dict[str, float]:
        """Some of these numbers."""
        table = self.table(data, key, (), tuple(quantities))
        return {name: self.number(value, f"{key}.{name}", quantities[name]) for name, value in table.items()}

    def task(self, value: object, model: RobotModel) -> Task:
        if value is None:
            found = usual_task(model.units.kinds, parallel=axes_parallel(model), steady=flange_steady(model))
            if found is None:
                words = ", ".join(f'"{task.value}"' for task in Task if task.suits(model.joint_count))
                if not words:
                    raise self.wrong("joints", "there is one joint", "an arm has two at least")
                raise self.wrong("task", f"{model.joint_count} joints do not say it", f"give one of {words}")
            return found
        task = next((task for task in Task if task.value == value), None)
        if task is None:
            raise self.wrong("task", f"{brief(value)} is none", f"give one of {', '.join(task.value for task in Task)}")
        if not task.suits(model.joint_count):
            what = f"{task.value!r} takes {task.size} joints"
            raise self.wrong("task", what, f"the robot has {model.joint_count}")
        if task in (Task.UPRIGHT, Task.PLANE) and not flange_steady(model):
            what = f"{task.value!r} is for arms whose flange keeps its direction, and this one tilts it"
            raise self.wrong("task", what, f"give {Task.POSITION.value!r}")
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
                hint = did_you_mean(str(name), known, f"known here: {', '.join(known)}")
                raise self.wrong(key, f"has an unknown key {brief(name)}", hint)
        for name in needed:
            if name not in data:
                raise self.wrong(key, f"has no {name}", f"give {', '.join(needed)}")
        return data

    def number(self, value: object, key: str, quantity: Quantity) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or value != value:  # NaN
            raise self.wrong(key, f"{brief(value)} is not a number", f"give a number in {self.unit(quantity)}")
        if not abs(value) < HUGE:
            raise self.wrong(key, f"{brief(value)} is too large", f"give less than {HUGE:g} {self.unit(quantity)}")
        if quantity.positive and not value > 0:
            raise self.wrong(
                key, f"{brief(value)} is not above zero", f"give a number above 0 in {self.unit(quantity)}"
            )
        if quantity.positive and value < TINY:
            raise self.wrong(key, f"{brief(value)} is too small", f"give at least {TINY:g} {self.unit(quantity)}")
        return quantity.to_si(value) if self.human else float(value)

    def word(self, value: object, key: str) -> str:
        if not isinstance(value, str) or not value.strip():
            raise self.wrong(key, f"{brief(value)} is not a text", 'write it in quotes, as name = "puma560"')
        return value

    def unit(self, quantity: Quantity) -> str:
        return quantity.unit if self.human else self.si(quantity.unit)

    def si(self, unit: str) -> str:
        return unit.replace("mm", "m").replace("deg", "rad")

    def wrong(self, key: str, what: str, right: str) -> FileDamaged:
        return FileDamaged(f"{self.file}: {key}: {what}", right)
