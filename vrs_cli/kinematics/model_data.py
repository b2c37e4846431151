"""Convert a robot model to plain data and back; check each key of the data.

The dictionaries of `to_dict` and `from_dict` have metres and radians, so that numbers come back exactly. A TOML file
has the same keys in millimetres and degrees. If the data names no task, the model gets the task that fits: the part of
a pose that its joints can change, measured on sample poses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice
from math import hypot
from reprlib import repr as brief
from typing import TYPE_CHECKING, Any

from msgspec import structs

from vrs_cli.kinematics.compiled import formulas, volume
from vrs_cli.kinematics.data_reader import ANGLE, LENGTH, TINY, DataReader, Quantity
from vrs_cli.kinematics.joints import JointKind, Joints, JointUnits
from vrs_cli.kinematics.model import (
    ALL_PARTS,
    FEWEST,
    MEASURED,
    PROFILES,
    ArmTask,
    Link,
    RobotModel,
    flange_steady,
    joint_axes,
    levers,
    plane_normal,
    some_joints,
)
from vrs_cli.kinematics.transform import IDENTITY, Vector, cross, dot

if TYPE_CHECKING:
    from vrs_cli.kinematics.link_data import LinkMasses, LinkShape

NOTHING = 1e-6  # a mean volume (see `_mean`; 1 for perpendicular rows) below this means that the arm lacks a motion
# minimum mean volume at which an arm of five joints gets the task POINTING: its joints make these motions well
WELL = 0.1

SAID = {  # the part of a location that counts for each task, explained to users
    ArmTask.STEADY: "its place counts, and the tool is turned as nearly as they can",
    ArmTask.POINTING: "its place counts and where the tool points, not how it is turned about that",
    ArmTask.UPRIGHT: "its place counts and the turn about the tool's axis, which keeps its direction",
    ArmTask.POSE: "all of it counts, and what they cannot do is refused",
}

Rows = list[tuple[float, ...]]


# --- the task that fits an arm --------------------------------------------------------------------------------------


def fitting_task(model: RobotModel) -> ArmTask | None:
    """Return the task that fits an arm; None if the arm has too few joints, so that its file must name the task.

    For four or five joints the whole pose counts only if no smaller task fits, because the joints cannot reach every
    position or some joints have the same effect.
    """
    count = model.joint_count
    if count >= ALL_PARTS:
        return ArmTask.POSE
    if count < FEWEST:
        if JointKind.PRISMATIC not in model.units.kinds and plane_normal(model) is not None:
            return {2: ArmTask.POINT, 3: ArmTask.PLANE}.get(count)
        return ArmTask.POSITION if count == sum(ArmTask.POSITION.counts) else None
    if flange_steady(model):
        return ArmTask.UPRIGHT if model.joint_count == ArmTask.UPRIGHT.size else ArmTask.POSE
    if model.joint_count == ArmTask.POINTING.size:
        second, third, fourth = (axis.direction for axis in joint_axes(model)[1:4])
        # true if joints 2 to 4 have parallel axes: they tilt the tool only in the plane of the arm, never out of it
        keeps_plane = model.units.kinds[1:4] == (JointKind.REVOLUTE,) * 3 and all(
            max(map(abs, cross(second, other))) < 1e-6
            for other in (third, fourth)  # maximum sine of the angle between parallel axes
        )
        if not keeps_plane and _mean(model, ArmTask.POINTING) > WELL:
            return ArmTask.POINTING
    places, all_parts = _mean(model, ArmTask.POSITION), _mean(model, ArmTask.POSE)
    return ArmTask.STEADY if min(places, all_parts) > NOTHING else ArmTask.POSE


def misfit_of(task: ArmTask, model: RobotModel) -> tuple[str, str] | None:
    """Return the reason why an arm cannot have a task, and a hint for the user; None if it can have the task."""
    if not task.suits(model.joint_count):
        joints = f"{FEWEST} or {ALL_PARTS - 1}" if task is ArmTask.STEADY else str(task.size)
        return f"{task.value!r} takes {joints} joints", f"the robot has {model.joint_count}"
    if task is ArmTask.PLANE and plane_normal(model) is None:
        return f"{task.value!r} is for arms that move in one plane", f"give {ArmTask.POSITION.value!r}"
    if task is ArmTask.UPRIGHT and not flange_steady(model):
        what = f"{task.value!r} is for arms whose flange keeps its direction, and this one tilts it"
        return what, f"give {ArmTask.POSITION.value!r}"
    return None


def task_notes(model: RobotModel) -> tuple[str, ...]:
    """Return notes for the user on the chosen task of an arm that cannot reach every pose; empty for other arms. Call
    this only if the file does not name the task.
    """
    if not FEWEST <= model.joint_count < ALL_PARTS or model.task not in SAID:
        return ()
    return (f"{model.joint_count} joints: the task is {model.task.value}, {SAID[model.task]}; --task names another",)


def _mean(model: RobotModel, task: ArmTask) -> float:
    """Return how well the joints can change the part of a pose that counts for a task: 0 to 1, as a mean over sample
    poses.

    The measure in one pose is the volume that the counting rows of the Jacobian span (or its columns, if there are
    fewer), each scaled to length one.
    """
    functions, (_, (reach, *_)) = formulas(model.links, model.base, model.flange), levers(model)
    total = 0.0
    for q in islice(some_joints(model), MEASURED):
        T, J = functions.forward(q), functions.jacobian(q)
        axes: Sequence[Vector] = [(T[i], T[4 + i], T[8 + i]) for i in range(3)]
        turns = [tuple(dot(axis, column) for column in zip(*J[3:], strict=True)) for axis in axes]
        rows: Rows = [tuple(x / reach for x in row) for row in J[:3]] + turns
        counted = [row for row, counts in zip(rows, task.counts, strict=True) if counts]
        vectors = counted if len(counted) <= model.joint_count else list(zip(*counted, strict=True))
        sizes = [hypot(*row) for row in vectors]
        if all(sizes):
            total += volume([[x / size for x in row] for row, size in zip(vectors, sizes, strict=True)])
    return total / MEASURED


NEEDED_POSES = ("ready", "nest")

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
HAND_KEYS: Mapping[str, Quantity] = {"width": Quantity("mm", positive=True)}
MODEL_OPTIONS = ("task", "base", "flange", "profile", "shapes", "collision", "hand", "masses")
URDF_OPTIONS = (
    *("name", "title", "urdf_base", "urdf_tip", "joints", "tool", "poses", "task", "profile", "shapes"),
    *("collision", "hand", "masses", "xacro", "flange"),
)
CLOSED = ("lower", "upper")  # accepted words for the end of the joint ranges at which a hand is closed
TURN, SLIDE = (kind.value for kind in JointKind)


# --- plain data --------------------------------------------------------------------------------------------------


def to_dict(model: RobotModel) -> dict[str, Any]:
    """Convert a model to plain data in metres and radians, as in the header of a trajectory file. `from_dict` reads it
    back.
    """
    data: dict[str, Any] = {"name": model.name, "title": model.title}
    data |= {key: list(T) for key in ("base", "flange") if (T := getattr(model, key)) != IDENTITY}
    if model.task is not ArmTask.POSE or model.joint_count < ALL_PARTS:
        data["task"] = model.task.value
    links = ({**structs.asdict(link), "kind": link.kind.value} for link in model.links)
    usual = {"theta": 0.0, "kind": TURN}.items()
    data["joints"] = [
        {
            **{key: value for key, value in link.items() if (key, value) not in usual},
            **{key: getattr(model, key)[i] for key in JOINT_KEYS},
        }
        for i, link in enumerate(links)
    ]
    data["tool"] = {key: getattr(model, key) for key in TOOL_KEYS}
    data["poses"] = {name: list(q) for name, q in model.poses.items()}
    if model.profile != PROFILES[0]:
        data["profile"] = model.profile
    if model.hand_width:
        data["hand"] = {"width": model.hand_width}
    if model.masses:
        # imported here because few robots have masses in their files
        from vrs_cli.kinematics.link_data import mass_tables

        data["masses"] = mass_tables(model.masses)
    for key, shapes in (("shapes", model.shapes), ("collision", model.collision)):
        if shapes:
            # imported here because few robots have shapes in their files
            from vrs_cli.kinematics.link_data import shape_tables

            data[key] = shape_tables(shapes)
    return data


def from_dict(data: object, where: str = "robot model") -> RobotModel:
    """Make a model from plain data in metres and radians. `where`: the source of the data, for errors. Raises
    FileDamaged with `where` and the key.
    """
    return ModelReader(where, human=False).model(data)


class ModelReader(DataReader, frozen=True):
    """Checks plain data of a robot, and makes a model from it."""

    def model(self, data: object) -> RobotModel:
        table = self.table(data, "the file", MODEL_KEYS, MODEL_OPTIONS)
        joints = self.joints(table["joints"])
        tool = self.table(table["tool"], "tool", TOOL_KEYS)
        figures: dict[str, Any] = {key: tuple(joint[key] for joint in joints) for key in JOINT_KEYS}
        figures |= {key: self.number(tool[key], f"tool.{key}", quantity) for key, quantity in TOOL_KEYS.items()}
        figures |= {key: self.frame(table[key], key) for key in ("base", "flange") if key in table}
        profile = table.get("profile", PROFILES[0])
        if profile not in PROFILES:
            raise self.wrong("profile", f"{brief(profile)} is no profile", f"write one of {', '.join(PROFILES)}")
        model = RobotModel(
            name=self.word(table["name"], "name"),
            title=self.word(table["title"], "title"),
            links=tuple(Link(**{key: joint[key] for key in Link.__struct_fields__}) for joint in joints),
            poses=self.poses(table["poses"], joints),
            **figures,
            profile=str(profile),
            shapes=self.shapes(table.get("shapes"), len(joints)),
            collision=self.shapes(table.get("collision"), len(joints), "collision"),
            hand_width=self.numbers(table.get("hand", {}), "hand", HAND_KEYS).get("width", 0.0),
            masses=self.masses(table.get("masses"), len(joints)),
        )
        if len(joints) > 1 and levers(model)[1][0] < TINY:
            raise self.wrong(
                "joints", "their axes all meet in the flange, which they do not move", "give links a length"
            )
        return structs.replace(model, task=self.task(table.get("task"), model), names_task="task" in table)

    def shapes(self, data: object, joints: int, key: str = "shapes") -> tuple[LinkShape, ...]:
        if data is None:
            return ()
        # imported here because few robots have shapes in their files
        from vrs_cli.kinematics.link_data import ShapeReader

        return ShapeReader(self.file, self.human).shapes(data, joints, key)

    def masses(self, data: object, joints: int) -> tuple[LinkMasses, ...]:
        if data is None:
            return ()
        # imported here because few robots have masses in their files
        from vrs_cli.kinematics.link_data import MassReader

        return MassReader(self.file, self.human).masses(data, joints)

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
        return self.number(value, key, quantity.for_prismatic() if kind is JointKind.PRISMATIC else quantity)

    def kind(self, value: object, key: str) -> JointKind:
        if value not in (TURN, SLIDE):
            raise self.wrong(key, f"kind is {brief(value)}", f'write "{TURN}" or "{SLIDE}"')
        return JointKind(value)

    def hand(self, data: object) -> tuple[float | None, str | None]:
        """Check the table `hand` of a TOML file that extends a URDF file. Return the width of the open hand [m], and
        the end of the joint ranges, "lower" or "upper", at which it is closed; None for values that are not given.
        """
        table = self.table(data, "hand", (), (*HAND_KEYS, "closed"))
        closed = table.get("closed")
        if closed is not None and closed not in CLOSED:
            raise self.wrong("hand.closed", f"{brief(closed)} is none", f"give one of {', '.join(CLOSED)}")
        width = {key: value for key, value in table.items() if key in HAND_KEYS}
        return self.numbers(width, "hand", HAND_KEYS).get("width"), None if closed is None else str(closed)

    def own_joints(self, data: object, kinds: Mapping[str, JointKind]) -> list[dict[str, float]]:
        """Check the joint values in a TOML file that replace those of a URDF file. Return them for each joint, in the
        order of the URDF file. `kinds`: the joints of the URDF file.
        """
        tables = data if isinstance(data, list) else [data]
        own: dict[str, dict[str, float]] = {name: {} for name in kinds}
        for i, table in enumerate(tables, 1):
            key = f"joint {i}"
            checked = self.table(table, key, ("name",), (*JOINT_KEYS, "kind"))
            name = self.word(checked["name"], f"{key}: name")
            if name not in own:
                raise self.wrong(
                    key, f"the URDF file has no joint {brief(name)} that moves", f"it has {', '.join(kinds)}"
                )
            kind = kinds[name]
            if self.kind(checked.get("kind", kind.value), key) is not kind:
                raise self.wrong(key, f"joint {name} is {kind.value} in the URDF file", "leave out its kind")
            own[name] = {k: self.of_joint(checked[k], f"{key}: {k}", k, kind) for k in JOINT_KEYS if k in checked}
        return list(own.values())

    def numbers(self, data: object, key: str, quantities: Mapping[str, Quantity]) -> dict[str, float]:
        """Check a table of numbers whose keys are all in `quantities`, and return the numbers in SI units."""
        table = self.table(data, key, (), tuple(quantities))
        return {name: self.number(value, f"{key}.{name}", quantities[name]) for name, value in table.items()}

    def words(self, data: object, key: str) -> dict[str, str]:
        """Check a table whose values are strings, numbers or booleans, and return the values as strings."""
        if not isinstance(data, Mapping) or not all(isinstance(value, str | int | float) for value in data.values()):
            raise self.wrong(key, "is not a table of words and numbers", 'write it as xacro = { prefix = "left_" }')
        return {
            str(name): str(value).lower() if isinstance(value, bool) else str(value) for name, value in data.items()
        }

    def task(self, value: object, model: RobotModel) -> ArmTask:
        if value is None:
            found = fitting_task(model)
            if found is None:
                words = ", ".join(f'"{task.value}"' for task in ArmTask if task.suits(model.joint_count))
                if not words:
                    raise self.wrong("joints", "there is one joint", "an arm has two at least")
                what = f"{model.joint_count} such joints do not tell what counts of a location"
                raise self.wrong("task", what, f"give one of {words}")
            return found
        task = next((task for task in ArmTask if task.value == value), None)
        if task is None:
            raise self.wrong(
                "task", f"{brief(value)} is none", f"give one of {', '.join(task.value for task in ArmTask)}"
            )
        if (misfit := misfit_of(task, model)) is not None:
            raise self.wrong("task", *misfit)
        return task

    def poses(
        self, data: object, joints: Sequence[Mapping[str, Any]], needed: Sequence[str] = NEEDED_POSES
    ) -> dict[str, Joints]:
        if not isinstance(data, Mapping):
            named = f" with at least {' and '.join(needed)}" if needed else ""
            raise self.wrong("poses", "is not a table", f"write [poses]{named}, each with its joint values")
        for name in needed:
            if name not in data:
                raise self.wrong(f"poses.{name}", "is missing", f"give its {len(joints)} joint values")
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
