"""A robot out of a URDF file: the serial chain of its joints from a base link to a tip link, and usual figures beside.

Read are joints with their origins, axes and limits, the masses of links, and their looks: boxes, cylinders, spheres and
files of meshes, each fixed in a body. Transmissions are left aside, nothing is fetched. Metres, radians, seconds,
kilograms, as URDF has them.

A body is what one joint of the arm moves: all links that hang on it by fixed joints, those that the joints of its hand
move, as they are while it is closed, and those that other joints move, as they are at zero. Looks that cannot be
understood are left out, for an arm moves without them. Format: http://wiki.ros.org/urdf/XML/link.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import accumulate
from math import copysign, pi
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple, cast
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.axes import PARALLEL, AxisLine, Chain, chain_of, link_transform
from vrs_cli.kinematics.data_reader import TINY
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import FEWEST, Origin, RobotModel
from vrs_cli.kinematics.model_data import NEEDED_POSES, TOOL_KEYS, ModelReader
from vrs_cli.kinematics.shapes import MOST_SHAPES, Body, Box, Capsule, Cylinder, LinkShape, MeshFile, Opening
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    compose,
    dot,
    inverse,
    position,
    rotate,
    scaled,
    translation,
)
from vrs_cli.kinematics.urdf.chain import Choice, choice
from vrs_cli.kinematics.urdf.hand import Fingers, Z, fingers_of, moved, other_than_z, pointing_note
from vrs_cli.kinematics.urdf.inertial import completed, masses_of_bodies
from vrs_cli.kinematics.urdf.macros import expanded, has_macros
from vrs_cli.kinematics.urdf.ready import better_ready
from vrs_cli.kinematics.urdf.tree import ENDLESS, HUGE, MOVING, Joint, Mimic, Tree, named, robot_element

WHOLE_TURNS = 2 * pi  # [rad] a joint that turns without end is given one turn each way

# what a URDF file need not say
USUAL_VELOCITY = {JointKind.REVOLUTE: pi / 2, JointKind.PRISMATIC: 0.25}  # [rad/s, m/s] where none is given
FULL_SPEED_IN = 0.3  # [s] accelerations: full velocity in this time
FULL_ACCELERATION_IN = 0.1  # [s] jerks: full acceleration in this time
USUAL_COLOUR = "grey"
USUAL_TOOL_SPEEDS = {"linear_speed": 500.0, "angular_speed": 90.0}  # [mm/s, deg/s]


class LinkPlace(NamedTuple):
    """Where a link is: in which body (0 is the base), T_body_link, and how it moves as the hand opens."""

    body: int
    T: Transform
    opens: tuple[Opening, ...] = ()


class UrdfArm(NamedTuple):
    """What is chosen of a file: the joints that move, how far each moves for one of its own (a telescope more than
    1), the links that have their axes (T_base_tip(q) = base . links . flange), and all that hangs on them."""

    choice: Choice
    joints: tuple[Joint, ...]
    scales: tuple[float, ...]
    chain: Chain
    fingers: Fingers
    places: Mapping[str, LinkPlace]


def robot_of(
    file: str, text: str, reader: ModelReader, table: Mapping[str, object], base: str | None, tip: str | None
) -> RobotModel:
    """The robot of a URDF file between two links, with the figures that such a file has not: those of a TOML file's
    table, else usual ones.

    Raises FileDamaged, with the file and the element.
    """
    robot = robot_element(file, text)
    if has_macros(file, robot):
        robot = robot_element(file, expanded(file, reader.words(table.get("xacro", {}), "xacro")))
        if robot.find("joint") is None:
            what = "it defines macros, and makes no joint of them"
            raise FileDamaged(f"{file}: {what}", "give the file that includes it")
    tree = Tree(file, robot)
    width, closed = reader.hand(table.get("hand", {}))
    flange = reader.frame(table["flange"], "flange") if "flange" in table else IDENTITY
    arm = arm_of(tree, choice(tree, base, tip), closed, flange)
    own = reader.own_joints(table.get("joints", []), {joint.name: tree.kind(joint) for joint in arm.joints})
    figures = [_figures(tree, *row) for row in zip(arm.joints, arm.scales, own, strict=True)]
    model = _model(tree.name, arm.chain, figures, reader, table)
    notes, way = list(arm.choice.notes), arm.choice.way
    if telescoped := [joint.name for joint in way if joint.moves and not joint.mimics and joint not in arm.joints]:
        notes.append(f"{', '.join(telescoped)} slide as the joint before them does: a telescope, which is one joint")
    at = {link: position(place.T) for link, place in arm.places.items()}
    last, turned = at.get(arm.joints[-1].child), None
    if last is not None and len(arm.joints) >= FEWEST:  # an arm of fewer joints could not go along another axis
        turned = other_than_z(last, [at[link] for link in arm.fingers.tips if link in at])
    if turned is not None:
        notes.append(pointing_note(arm.choice.tip, turned))
    ahead = Z if turned is None else turned.direction
    if (
        "ready" not in cast(Mapping[str, object], table.get("poses", {}))
        and (ready := better_ready(model, ahead)) is not None
    ):
        model = replace(model, poses={**model.poses, "ready": ready.joints})
        notes.append(ready.note)
    folder = Path(file).absolute().parent
    return replace(
        model,
        shapes=reader.shapes(table.get("shapes"), model.joint_count) or link_shapes(folder, tree, arm.places),
        collision=reader.shapes(table.get("collision"), model.joint_count, "collision")
        or link_shapes(folder, tree, arm.places, collision=True),
        hand_width=arm.fingers.width if width is None else width,
        masses=completed(
            masses_of_bodies(tree, arm.joints, {name: (place.body, place.T) for name, place in arm.places.items()}),
            reader.masses(table.get("masses"), model.joint_count),
        ),
        origin=Origin(
            arm.choice.base,
            arm.choice.tip,
            joints=tuple(joint.name for joint in arm.joints),
            types=tuple(joint.type for joint in arm.joints),
            fingers=tuple(joint.name for joint in arm.choice.fingers),
            notes=tuple(notes),
        ),
    )


# --- its geometry --------------------------------------------------------------------------------------------------


def arm_of(tree: Tree, chosen: Choice, closed: str | None = None, flange: Transform = IDENTITY) -> UrdfArm:
    """The links of a chain, `flange` (T_tip_flange) behind it. Raises FileDamaged for a joint that no arm has."""
    joints, axes, scales, T = list[Joint](), list[AxisLine](), list[float](), IDENTITY
    for joint in chosen.way:
        T = compose(T, tree.origin(joint.element))
        if not joint.moves:
            continue
        axis = AxisLine(position(T), rotate(T, tree.axis(joint)))
        follows = _follows(tree, joint, axis, joints[-1:], axes[-1:])
        if follows is not None:
            scales[-1] += follows.factor
            T = compose(T, translation(*scaled(tree.axis(joint), follows.offset)))
            continue
        joints.append(joint)
        axes.append(axis)
        scales.append(1.0)
    chain = chain_of(axes, [tree.kind(joint) for joint in joints], compose(T, flange))
    assert chain is not None  # without angles to meet every chain has links
    fingers = fingers_of(tree, joints[-1].child, chosen.fingers, closed)
    places = _places(tree, chosen.base, joints, chain, fingers)
    return UrdfArm(chosen, tuple(joints), tuple(scales), chain, fingers, places)


def _follows(
    tree: Tree, joint: Joint, axis: AxisLine, before: Sequence[Joint], axes: Sequence[AxisLine]
) -> Mimic | None:
    """How a joint of a telescope goes with the one before it, of which it makes a longer one: as the file says, or like
    that one where it slides along it, as far and as fast. None of a joint that moves by itself.
    """
    slides = before and tree.kind(joint) is tree.kind(before[0]) is JointKind.PRISMATIC
    along = dot(axis.direction, axes[0].direction) if slides else 0.0
    if not joint.mimics:
        alike = along > 1.0 - PARALLEL and tree.range(joint) == tree.range(before[0])
        return Mimic(before[0].name, along, 0.0) if alike else None
    mimic = tree.mimic(joint)
    if abs(along) > 1.0 - PARALLEL and mimic.leader == before[0].name:
        return mimic._replace(factor=mimic.factor * along)
    raise tree.wrong(joint.element, "mimics another joint", "every joint of an arm moves by itself")


def _places(tree: Tree, base: str, joints: Sequence[Joint], chain: Chain, fingers: Fingers) -> dict[str, LinkPlace]:
    """Where the links are that hang on the base, in the frames of the chain.

    T_body_link = T_base_body^-1 T_base_link while all joints are 0 and the hand is closed, and ever after.
    """
    steps = [link_transform(link, 0.0) for link in chain.links]
    steps[-1] = compose(steps[-1], chain.flange)
    bodies = [inverse(T) for T in accumulate(steps, compose, initial=chain.base)]
    found, left = {base: LinkPlace(0, bodies[0])}, [(base, IDENTITY)]
    while left:
        parent, T_base_parent = left.pop()
        for joint in tree.below.get(parent, ()):
            try:
                before, T_base_joint = found[parent], compose(T_base_parent, tree.origin(joint.element))
            except FileDamaged:  # the arm itself does without
                continue
            body = before.body + (joint in joints[before.body : before.body + 1])
            opens = before.opens
            T = T_base_joint
            if (travel := fingers.travels.get(joint.name)) is not None and joint.moves:
                T_body_joint = compose(bodies[body], T_base_joint)
                way = scaled(rotate(T_body_joint, tree.axis(joint)), travel.open - travel.closed)
                slides = MOVING[joint.type] is JointKind.PRISMATIC
                opens += (Opening(slide=way) if slides else Opening(turn=way, point=position(T_body_joint)),)
                T = compose(T_base_joint, moved(tree, joint, travel.closed))
            found[joint.child] = LinkPlace(body, compose(bodies[body], T), opens)
            left.append((joint.child, T))
    return found


# --- its figures ---------------------------------------------------------------------------------------------------


def _figures(tree: Tree, joint: Joint, scale: float, own: Mapping[str, float]) -> dict[str, float]:
    """Limits and rates: what a TOML file says of a joint (`own`) goes before what the URDF file does."""
    kind = tree.kind(joint)
    *ends, rate = (None if x is None else scale * x for x in tree.range(joint))
    if kind is JointKind.REVOLUTE:
        ends = [copysign(WHOLE_TURNS, x) if x is not None and abs(x) >= ENDLESS else x for x in ends]
    limits = dict[str, float]()
    for key, said in zip(("lower", "upper"), ends, strict=True):
        end = own.get(key, said)
        if end is None or not abs(end) < ENDLESS:
            what = f"limit has no {key}" if end is None else f"limit {key} is {end:g}"
            hint = f'give <limit lower="..." upper="..." velocity="..."/>, or {key} in a TOML file beside it'
            raise tree.wrong(joint.element, what, hint)
        limits[key] = end
    if not limits["lower"] < limits["upper"]:
        what = f"limit: lower {limits['lower']:g} is not below upper {limits['upper']:g}"
        raise tree.wrong(joint.element, what, "swap or mend the two limits")
    velocity = own.get("max_velocity", rate or 0.0)
    if velocity < 0.0:
        raise tree.wrong(joint.element, f"limit: velocity {velocity:g} is below zero", "give it without a sign")
    if "max_velocity" not in own and not 0.0 < velocity < HUGE:
        velocity = USUAL_VELOCITY[kind]
    acceleration = own.get("max_acceleration", velocity / FULL_SPEED_IN)
    jerk = own.get("max_jerk", acceleration / FULL_ACCELERATION_IN)
    return {**limits, "max_velocity": velocity, "max_acceleration": acceleration, "max_jerk": jerk}


def _model(
    name: str, chain: Chain, joints: Sequence[Mapping[str, float]], reader: ModelReader, table: Mapping[str, object]
) -> RobotModel:
    rows = [{**link._asdict(), **joint} for link, joint in zip(chain.links, joints, strict=True)]
    ends = [(joint["lower"], joint["upper"]) for joint in joints]
    rest = [0.0 if lower <= 0.0 <= upper else (lower + upper) / 2 for lower, upper in ends]
    tool: dict[str, float] = {}
    for key, human in USUAL_TOOL_SPEEDS.items():
        speed, word = TOOL_KEYS[key].to_si(human), key.removesuffix("speed")
        acceleration = speed / FULL_SPEED_IN
        tool |= {key: speed, f"{word}acceleration": acceleration, f"{word}jerk": acceleration / FULL_ACCELERATION_IN}
    data: dict[str, Any] = {
        "name": table.get("name", name),
        "title": table.get("title", name),
        "base": list(chain.base),
        "flange": list(chain.flange),
        "joints": [{**row, "kind": row["kind"].value} for row in rows],
        "tool": {**tool, **reader.numbers(table.get("tool", {}), "tool", TOOL_KEYS)},
        "poses": {**dict.fromkeys(NEEDED_POSES, rest), **reader.poses(table.get("poses", {}), rows, ())},
    }
    options = {key: table[key] for key in ("task", "profile") if key in table}
    return ModelReader(reader.file, human=False).model({**data, **options})


# --- its looks -----------------------------------------------------------------------------------------------------


def link_shapes(
    folder: Path, tree: Tree, places: Mapping[str, LinkPlace], *, collision: bool = False
) -> tuple[LinkShape, ...]:
    """Return the looks of the links that have a place; files of meshes are seen from `folder`. `collision`: what stands
    for the links when contacts are looked for instead, which is the looks of a link that has nothing else; empty if no
    link has.
    """
    said = ((material.get("name", ""), _colour(tree, material)) for material in tree.robot.iter("material"))
    colours = {name: colour for name, colour in said if colour is not None}  # wherever they stand
    found, other = list[LinkShape](), not collision
    for link in tree.robot.findall("link"):
        for tag in ("collision", "visual") if collision else ("visual",):
            place = places.get(named(link))
            rows = [] if place is None else [_shape(folder, tree, one, place, colours) for one in link.findall(tag)]
            if shapes := [shape for shape in rows if shape is not None]:
                found += shapes
                other = other or tag == "collision"
                break
    return tuple(found[:MOST_SHAPES]) if other else ()


def _shape(folder: Path, tree: Tree, visual: Element, place: LinkPlace, colours: Mapping[str, str]) -> LinkShape | None:
    try:
        body = _body(folder, tree, visual, compose(place.T, tree.origin(visual)))
    except FileDamaged:
        return None
    material = visual.find("material")
    own = None if material is None else _colour(tree, material) or colours.get(material.get("name", ""))
    return None if body is None else LinkShape(place.body, body, own or USUAL_COLOUR, place.opens)


def _body(folder: Path, tree: Tree, visual: Element, T: Transform) -> Body | None:
    for form in visual.iterfind("geometry/*"):
        if form.tag == "box":
            x, y, z = _sizes(tree, form, "size", 3)
            return Box((x, y, z), T)
        if form.tag == "cylinder":
            (r,), (high,) = _sizes(tree, form, "radius", 1), _sizes(tree, form, "length", 1)
            ends = (position(compose(T, translation(0.0, 0.0, z))) for z in (-0.5 * high, 0.5 * high))
            return Cylinder(next(ends), next(ends), (r, r))
        if form.tag == "sphere":
            (r,) = _sizes(tree, form, "radius", 1)
            return Capsule(position(T), position(T), (r, r))
        if form.tag == "mesh":
            x, y, z = tree.numbers(visual, "mesh scale", form.get("scale", "1 1 1"), 3)
            if min(abs(x), abs(y), abs(z)) < TINY:
                return None
            return MeshFile(str(found(folder, form.get("filename", ""))), T, (x, y, z))
    return None


def _sizes(tree: Tree, form: Element, key: str, count: int) -> tuple[float, ...]:
    values = tree.numbers(form, f"{form.tag} {key}", form.get(key, ""), count)
    if min(values) < TINY:
        raise FileDamaged(f"{form.tag} {key} is {form.get(key)}", "give what is above zero")
    return values


def _colour(tree: Tree, material: Element) -> str | None:
    colour = material.find("color")
    try:
        parts = () if colour is None else tree.numbers(material, "color rgba", colour.get("rgba", ""), 4)[:3]
    except FileDamaged:
        return None
    return "#" + "".join(f"{round(255 * min(max(part, 0.0), 1.0)):02x}" for part in parts) if parts else None


def found(folder: Path, name: str) -> Path:
    """The file of a mesh: beside the URDF file, or of a package in a folder above it. Where none is, the likeliest."""
    try:
        address = urlsplit(name)
    except ValueError:
        return folder / name
    if address.scheme == "file":
        return Path(unquote(address.path))
    if address.scheme != "package":
        return folder / name
    inside = PurePosixPath(address.netloc + unquote(address.path))
    above: Sequence[Path] = (folder, *folder.parents)
    tries = [base / part for base in above for part in (inside, PurePosixPath(*inside.parts[1:]))]
    return next((path for path in tries if path.is_file()), folder / inside)
