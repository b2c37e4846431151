"""A robot out of a URDF file: the serial chain of its joints from a base link to a tip link, and usual figures beside.

Read are joints with their origins, axes and limits, and what links look like (`urdf_visuals`). Collision bodies,
inertias and transmissions are left aside, nothing is fetched. Metres, radians, seconds, as URDF has them.
Format: http://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import accumulate
from math import pi, sqrt
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.axes import Chain, Line, Link, chain_of, link_transform
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import NEEDED_POSES, TOOL_KEYS, ModelReader
from vrs_cli.kinematics.shapes import Shape
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    at_position,
    compose,
    inverse,
    position,
    rotate,
    rotation_x,
    rotation_y,
    rotation_z,
)
from vrs_cli.kinematics.urdf_visuals import Place, Visuals

LARGEST = 20_000_000  # characters: no arm is described by more
HUGE = 1e6  # [m, rad] no figure of an arm; keeps infinity and NaN out as well
MOST_JOINTS = 1000  # of a file, and of the way from base to tip
WHOLE_TURNS = 2 * pi  # [rad] a continuous joint, which has no limits, is given one turn each way
TIPS = ("tool0", "tcp", "flange", "ee_link")  # names of a tip, the most likely first

# what a URDF file need not say
USUAL_VELOCITY = {JointKind.REVOLUTE: pi / 2, JointKind.PRISMATIC: 0.25}  # [rad/s, m/s] where none is given
FULL_SPEED_IN = 0.3  # [s] accelerations: full velocity in this time
FULL_ACCELERATION_IN = 0.1  # [s] jerks: full acceleration in this time
USUAL_TOOL_SPEEDS = {"linear_speed": 500.0, "angular_speed": 90.0}  # [mm/s, deg/s]

STEP, ROUNDED = pi / 12, 1e-5  # [rad] files say 1.5708 for a right angle: so near to a multiple of 15 deg it is one

_MOVING = {"revolute": JointKind.REVOLUTE, "continuous": JointKind.REVOLUTE, "prismatic": JointKind.PRISMATIC}
_CHAIN = "an arm is a chain without loops"
_FIXED = "fixed"


class UrdfJoint(NamedTuple):
    """A joint that moves; limits [rad, m], velocity [rad/s, m/s]."""

    name: str
    kind: JointKind
    lower: float
    upper: float
    velocity: float


class UrdfArm(NamedTuple):
    """The moving joints from base to tip, and the links that have their axes: T_base_tip = base . links . flange.

    `shapes`: the looks of all that hangs on them, in their frames.
    """

    name: str
    joints: tuple[UrdfJoint, ...]
    base: Transform
    links: tuple[Link, ...]
    flange: Transform
    shapes: tuple[Shape, ...]


def read(file: str, text: str, base: str | None = None, tip: str | None = None) -> UrdfArm:
    """The arm of a URDF file, from the link `base` (else the root) to `tip` (else the end of the longest chain).

    Raises FileDamaged, with the file and the element.
    """
    return _File(file, _parsed(file, text)).arm(base, tip)


def _parsed(file: str, text: str) -> ElementTree.Element:
    if len(text) > LARGEST:
        raise FileDamaged(f"{file}: {len(text)} characters", f"at most {LARGEST} are read")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise FileDamaged(f"{file}: it defines a document type or entities", "a URDF file needs neither: remove them")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise FileDamaged(f"{file}: {error}", "a robot description is an XML file") from None
    if root.tag != "robot":
        raise FileDamaged(f"{file}: its root is <{root.tag}>", "a URDF file is one <robot> element")
    if any("/wiki/xacro}" in str(element.tag) for element in root.iter()):
        raise FileDamaged(f"{file}: it holds xacro macros", f"expand it first: xacro {file} > arm.urdf")
    return root


class _File:
    """The joints of a file by their child link, which has one parent."""

    def __init__(self, file: str, root: ElementTree.Element) -> None:
        self.file, self.root = file, root
        self.name = root.get("name") or "robot"
        self.by_child: dict[str, ElementTree.Element] = {}
        self.parents: dict[str, str] = {}
        for joint in root.findall("joint")[: MOST_JOINTS + 1]:
            parent, child = self._end(joint, "parent"), self._end(joint, "child")
            if child in self.by_child:
                raise self.wrong(joint, f"link {child!r} has two parents", _CHAIN)
            if child == parent:
                raise self.wrong(joint, f"leads from link {parent!r} to itself", _CHAIN)
            self.by_child[child], self.parents[child] = joint, parent
        if not self.by_child or len(self.by_child) > MOST_JOINTS:
            raise FileDamaged(
                f"{file}: {len(self.by_child)} joints", f"1 to {MOST_JOINTS} <joint> elements make an arm"
            )

    def _end(self, joint: ElementTree.Element, which: str) -> str:
        element = joint.find(which)
        link = None if element is None else element.get("link")
        if not link:
            raise self.wrong(joint, f"has no {which} link", f'give <{which} link="..."/>')
        return link

    def arm(self, base: str | None, tip: str | None) -> UrdfArm:
        base = self._root() if base is None else self._known(base)
        way = self._way(base, self._tip(base) if tip is None else self._known(tip))
        joints, axes, T = [], [], IDENTITY
        for element in way:
            T = compose(T, self._origin(element))
            if element.get("type") != _FIXED:
                joints.append(self._joint(element))
                axes.append(Line(position(T), rotate(T, self._axis(element))))
        if not joints:
            raise FileDamaged(
                f"{self.file}: no joint moves between base and tip", "give urdf_base and urdf_tip in a TOML"
            )
        chain = chain_of(axes, [joint.kind for joint in joints], T)
        assert chain is not None  # without angles to meet every chain has links
        visuals = Visuals(Path(self.file).absolute().parent, self.root, self._numbers, self._origin)
        shapes = visuals.shapes(self._places(base, way, chain))
        return UrdfArm(self.name, tuple(joints), chain.base, chain.links, chain.flange, shapes)

    def _places(self, base: str, way: Sequence[ElementTree.Element], chain: Chain) -> dict[str, Place]:
        """Where the links are that hang on the base, in the frames of the chain.

        T_body_link = T_base_body^-1 T_base_link while all joints are 0, and ever after.
        """
        steps = [link_transform(link, 0.0) for link in chain.links]
        steps[-1] = compose(steps[-1], chain.flange)
        bodies = [inverse(T) for T in accumulate(steps, compose, initial=chain.base)]
        moving = [joint for joint in way if joint.get("type") != _FIXED]
        found, left = {base: Place(0, bodies[0])}, [(base, IDENTITY)]
        while left:
            parent, T_base_parent = left.pop()
            for child, T_parent_child in self._below(parent):
                body = found[parent].body
                body += self.by_child[child] in moving[body : body + 1]
                T = compose(T_base_parent, T_parent_child)
                if child not in found:
                    found[child] = Place(body, compose(bodies[body], T))
                    left.append((child, T))
        return found

    def _below(self, parent: str) -> Iterator[tuple[str, Transform]]:
        """The links that hang on a link, and T_parent_child while their joint is 0; without those whose place is not
        to be understood, for the arm itself does without."""
        for child in [child for child, link in self.parents.items() if link == parent]:
            with suppress(FileDamaged):
                yield child, self._origin(self.by_child[child])

    # --- which joints ---

    def _known(self, link: str) -> str:
        links = {*self.parents, *self.parents.values()}
        if link not in links:
            raise FileDamaged(
                f"{self.file}: no joint has a link {link!r}", f"links are {', '.join(sorted(links)[:20])}"
            )
        return link

    def _root(self) -> str:
        roots = [link for link in dict.fromkeys(self.parents.values()) if link not in self.parents]
        if len(roots) != 1:
            what = "no link is without a parent" if not roots else f"{', '.join(roots)} are without a parent"
            raise FileDamaged(f"{self.file}: {what}", "a chain has one root; a TOML file can name it: urdf_base")
        return roots[0]

    def _tip(self, base: str) -> str:
        """The end of the chain with the most joints that move; of its ends the one with the most usual name."""
        ends = [link for link in self.parents if link not in self.parents.values()]
        ways = {end: [joint for joint in self._way(base, end) if joint.get("type") != _FIXED] for end in ends}
        most = max(len(way) for way in ways.values())
        longest = {end: way for end, way in ways.items() if len(way) == most}
        first = next(iter(longest.values()))
        if any(way != first for way in longest.values()):
            ends_said = ", ".join(list(longest)[:10])
            raise FileDamaged(
                f"{self.file}: it has several arms, with the ends {ends_said}", "choose by urdf_tip in a TOML"
            )
        return min(longest, key=lambda end: TIPS.index(end) if end in TIPS else len(TIPS))

    def _way(self, base: str, tip: str) -> list[ElementTree.Element]:
        """The joints from base to tip."""
        way: list[ElementTree.Element] = []
        link = tip
        while link != base:
            if link not in self.by_child or len(way) > MOST_JOINTS:
                raise FileDamaged(
                    f"{self.file}: no chain of joints leads from {base} to {tip}", "name two links of one arm"
                )
            way.append(self.by_child[link])
            link = self.parents[link]
        return way[::-1]

    # --- what they say ---

    def _joint(self, element: ElementTree.Element) -> UrdfJoint:
        kind = _MOVING.get(element.get("type", ""))
        if kind is None:
            right = f"an arm has joints of the types {', '.join(_MOVING)} and {_FIXED}"
            raise self.wrong(element, f"is of type {element.get('type')!r}", right)
        if element.find("mimic") is not None:
            raise self.wrong(element, "mimics another joint", "every joint of an arm moves by itself")
        limit = element.find("limit")
        values: Mapping[str, str] = {} if limit is None else limit.attrib
        if element.get("type") == "continuous":
            lower, upper = -WHOLE_TURNS, WHOLE_TURNS
        else:
            lower, upper = (self._limit(element, values, key) for key in ("lower", "upper"))
        if not lower < upper:
            raise self.wrong(
                element, f"limit: lower {lower:g} is not below upper {upper:g}", "swap or mend the two limits"
            )
        velocity = self._limit(element, values, "velocity") if "velocity" in values else 0.0
        if velocity < 0.0:
            raise self.wrong(element, f"limit: velocity {velocity:g} is below zero", "give it without a sign")
        name = element.get("name") or "joint"
        return UrdfJoint(name, kind, lower, upper, velocity if velocity > 0.0 else USUAL_VELOCITY[kind])

    def _limit(self, element: ElementTree.Element, values: Mapping[str, str], key: str) -> float:
        if key not in values:
            raise self.wrong(element, f"limit has no {key}", 'give <limit lower="..." upper="..." velocity="..."/>')
        return self._numbers(element, f"limit {key}", values[key], 1)[0]

    def _origin(self, element: ElementTree.Element) -> Transform:
        """T_parent_child while the joint is 0: fixed axes, roll about x first (URDF)."""
        origin = element.find("origin")
        values: Mapping[str, str] = {} if origin is None else origin.attrib
        x, y, z = self._numbers(element, "origin xyz", values.get("xyz", "0 0 0"), 3)
        angles = self._numbers(element, "origin rpy", values.get("rpy", "0 0 0"), 3)
        roll, pitch, yaw = map(_exact, angles)
        turned = compose(compose(rotation_z(yaw), rotation_y(pitch)), rotation_x(roll))
        return at_position(turned, x, y, z)

    def _axis(self, element: ElementTree.Element) -> Vector:
        axis = element.find("axis")
        x, y, z = self._numbers(element, "axis xyz", "1 0 0" if axis is None else axis.get("xyz", "1 0 0"), 3)
        length = sqrt(x * x + y * y + z * z)
        if not length > 0.0:
            raise self.wrong(element, "axis xyz is 0 0 0", "give its direction")
        return x / length, y / length, z / length

    def _numbers(self, element: ElementTree.Element, what: str, text: str, count: int) -> tuple[float, ...]:
        try:
            values = tuple(map(float, text.split()))
        except ValueError:
            values = ()
        if len(values) != count or not all(abs(value) < HUGE for value in values):
            right = f"give a number below {HUGE:g}" if count == 1 else f"give {count} numbers with blanks between them"
            raise self.wrong(element, f"{what} is {text!r}", right)
        return values

    def wrong(self, joint: ElementTree.Element, what: str, right: str) -> FileDamaged:
        return FileDamaged(f"{self.file}: joint {joint.get('name') or '?'}: {what}", right)


def _exact(angle: float) -> float:
    steps = round(angle / STEP)
    return steps * STEP if abs(angle - steps * STEP) < ROUNDED else angle


# --- the robot of an arm ------------------------------------------------------------------------------------------


def model_of(arm: UrdfArm, reader: ModelReader, table: Mapping[str, object]) -> RobotModel:
    """The robot of an arm, with the figures that a URDF file has not: those of a TOML file's table, else usual ones."""
    more = reader.own_joints(table.get("joints", []), [joint.name for joint in arm.joints])
    joints = [
        _with_rates({**link._asdict(), "lower": joint.lower, "upper": joint.upper, "max_velocity": joint.velocity}, own)
        for joint, link, own in zip(arm.joints, arm.links, more, strict=True)
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
    model = ModelReader(reader.file, human=False).model({**data, **options})
    own = reader.shapes(table.get("shapes"), model.joint_count)
    return replace(model, shapes=own or arm.shapes)


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
