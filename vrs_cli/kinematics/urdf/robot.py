"""Make a robot model from a URDF file: from the chain of joints between a base link and a tip link. Default values are
used where the file has no value.

The model gets the joints with their origins, axes and limits, the masses of the links, and their shapes: boxes,
cylinders, spheres and mesh files. The reader ignores transmissions, and downloads no files. Units are metres, radians,
seconds and kilograms, as in URDF.

Each joint of the arm moves one rigid body, which contains the joint's link and all links fixed to it, the links of the
closed hand, and the links moved by joints outside the arm, which stay at zero.

If all joints at zero are singular or at the end of a range, as for most arms, another pose is chosen for READY
(`better_ready`). A pose is nearly singular if the isotropy of its Jacobian is small: the geometric mean of the
eigenvalues of J J^T over their arithmetic mean, 1 if the arm moves equally well in all directions, 0 if it cannot move
in one of them (J. Kim, P. Khosla, "Dexterity measures for design and control of manipulators", IROS 1991). Lengths are
divided by half the reach.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate
from math import copysign, dist, pi, sqrt
from pathlib import Path
from typing import Any, NamedTuple, cast

from msgspec import structs

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics import transform
from vrs_cli.kinematics.compiled import volume
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.kinematics.link_data import Opening
from vrs_cli.kinematics.model import (
    FEWEST,
    PARALLEL,
    AxisLine,
    Chain,
    Origin,
    RobotModel,
    axis_of,
    chain_of,
    levers,
    link_frames,
    link_transform,
)
from vrs_cli.kinematics.model_data import NEEDED_POSES, TOOL_KEYS, ModelReader
from vrs_cli.kinematics.transform import IDENTITY, Transform, Vector, Z
from vrs_cli.kinematics.urdf.bodies import LinkPlace, complete, link_shapes, masses_of_bodies
from vrs_cli.kinematics.urdf.chain import Choice, Fingers, choice, fingers_of, joint_motion, other_than_z, pointing_note
from vrs_cli.kinematics.urdf.tree import (
    ENDLESS,
    HUGE,
    MOVING,
    Joint,
    Mimic,
    Tree,
    expand_macros,
    has_macros,
    robot_element,
)

WHOLE_TURNS = 2 * pi  # [rad] limits +- this for a joint without limits in the file

# default values for data that a URDF file may omit
USUAL_VELOCITY = {JointKind.REVOLUTE: pi / 2, JointKind.PRISMATIC: 0.25}  # [rad/s, m/s] maximum joint velocity
FULL_SPEED_IN = 0.3  # [s] time to reach the maximum velocity; gives the acceleration limits, which URDF does not have
# [s] time to reach the maximum acceleration; gives the jerk limits, which URDF does not have
FULL_ACCELERATION_IN = 0.1
USUAL_TOOL_SPEEDS = {"linear_speed": 500.0, "angular_speed": 90.0}  # [mm/s, deg/s] nominal speeds of the tool


class UrdfArm(NamedTuple):
    """The arm of a URDF file.

    `joints`: the joints that move. `scales`: for each joint the total motion per unit of its value (more than 1 for a
    telescope, whose stages move together). `chain`: links with the axes of the joints, T_base_tip(q) = base . links .
    flange. `fingers`: the fingers of the hand. `places`: the positions of all links that the arm carries.
    """

    choice: Choice
    joints: tuple[Joint, ...]
    scales: tuple[float, ...]
    chain: Chain
    fingers: Fingers
    places: Mapping[str, LinkPlace]


def robot_of(
    file: str, text: str, reader: ModelReader, table: Mapping[str, object], base: str | None, tip: str | None
) -> RobotModel:
    """Return the model of the arm between the links `base` and `tip` of a URDF file. `text`: the content of the file.
    `table`: the table of a TOML file that extends it; its values replace those of the URDF file. Missing values get
    defaults.

    Raises FileDamaged with the file and the element.
    """
    robot = robot_element(file, text)
    if has_macros(file, robot):
        robot = robot_element(file, expand_macros(file, reader.words(table.get("xacro", {}), "xacro")))
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
    at = {link: transform.position(place.T) for link, place in arm.places.items()}
    last, turned = at.get(arm.joints[-1].child), None
    # with fewer joints, APPRO along another axis would be impossible anyway
    if last is not None and len(arm.joints) >= FEWEST:
        turned = other_than_z(last, [at[link] for link in arm.fingers.tips if link in at])
    if turned is not None:
        notes.append(pointing_note(arm.choice.tip, turned))
    ahead = Z if turned is None else turned.direction
    if (
        "ready" not in cast(Mapping[str, object], table.get("poses", {}))
        and (ready := better_ready(model, ahead)) is not None
    ):
        model = structs.replace(model, poses={**model.poses, "ready": ready.joints})
        notes.append(ready.note)
    folder = Path(file).absolute().parent
    return structs.replace(
        model,
        shapes=reader.shapes(table.get("shapes"), model.joint_count) or link_shapes(folder, tree, arm.places),
        collision=reader.shapes(table.get("collision"), model.joint_count, "collision")
        or link_shapes(folder, tree, arm.places, collision=True),
        hand_width=arm.fingers.width if width is None else width,
        masses=complete(
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


# --- geometry ------------------------------------------------------------------------------------------------------


def arm_of(tree: Tree, chosen: Choice, closed: str | None = None, flange: Transform = IDENTITY) -> UrdfArm:
    """Return the arm that was chosen in a file. `closed`: the end of the joint ranges at which the hand is closed.
    `flange`: T_tip_flange. Raises FileDamaged for a type of joint that an arm cannot have.
    """
    joints, axes, scales, T = list[Joint](), list[AxisLine](), list[float](), IDENTITY
    for joint in chosen.way:
        T = transform.compose(T, tree.origin(joint.element))
        if not joint.moves:
            continue
        axis = AxisLine(transform.position(T), transform.rotate(T, tree.axis(joint)))
        follows = _follows(tree, joint, axis, joints[-1:], axes[-1:])
        if follows is not None:
            scales[-1] += follows.factor
            T = transform.compose(T, transform.translation(*transform.scaled_vector(tree.axis(joint), follows.offset)))
            continue
        joints.append(joint)
        axes.append(axis)
        scales.append(1.0)
    chain = chain_of(axes, [tree.kind(joint) for joint in joints], transform.compose(T, flange))
    assert chain is not None  # `chain_of` can only fail if alphas are prescribed
    fingers = fingers_of(tree, joints[-1].child, chosen.fingers, closed)
    places = _places(tree, chosen.base, joints, chain, fingers)
    return UrdfArm(chosen, tuple(joints), tuple(scales), chain, fingers, places)


def _follows(
    tree: Tree, joint: Joint, axis: AxisLine, before: Sequence[Joint], axes: Sequence[AxisLine]
) -> Mimic | None:
    """Return how a joint follows the joint before it, if both are stages of a telescope; None for an independent joint.

    An element `mimic` in the file says how the joint follows. Without this element, it follows and moves equally far if
    it slides along the same axis with the same limits and speed.
    """
    slides = before and tree.kind(joint) is tree.kind(before[0]) is JointKind.PRISMATIC
    along = transform.dot(axis.direction, axes[0].direction) if slides else 0.0
    if not joint.mimics:
        alike = along > 1.0 - PARALLEL and tree.range(joint) == tree.range(before[0])
        return Mimic(before[0].name, along, 0.0) if alike else None
    mimic = tree.mimic(joint)
    if abs(along) > 1.0 - PARALLEL and mimic.leader == before[0].name:
        return mimic._replace(factor=mimic.factor * along)
    raise tree.wrong(joint.element, "mimics another joint", "every joint of an arm moves by itself")


def _places(tree: Tree, base: str, joints: Sequence[Joint], chain: Chain, fingers: Fingers) -> dict[str, LinkPlace]:
    """Return the poses of all links that the base and the arm carry, each in the frame of the body of the chain that
    carries it.

    T_body_link = T_base_body^-1 T_base_link, computed while all joints are 0 and the hand is closed, is the same in all
    poses.
    """
    steps = [link_transform(link, 0.0) for link in chain.links]
    steps[-1] = transform.compose(steps[-1], chain.flange)
    bodies = [transform.inverse(T) for T in accumulate(steps, transform.compose, initial=chain.base)]
    found, left = {base: LinkPlace(0, bodies[0])}, [(base, IDENTITY)]
    while left:
        parent, T_base_parent = left.pop()
        for joint in tree.below.get(parent, ()):
            try:
                before, T_base_joint = found[parent], transform.compose(T_base_parent, tree.origin(joint.element))
            except FileDamaged:  # skip a link with errors: the arm does not need it
                continue
            body = before.body + (joint in joints[before.body : before.body + 1])
            opens = before.opens
            T = T_base_joint
            if (travel := fingers.travels.get(joint.name)) is not None and joint.moves:
                T_body_joint = transform.compose(bodies[body], T_base_joint)
                way = transform.scaled_vector(
                    transform.rotate(T_body_joint, tree.axis(joint)), travel.open - travel.closed
                )
                slides = MOVING[joint.type] is JointKind.PRISMATIC
                opens += (Opening(slide=way) if slides else Opening(turn=way, point=transform.position(T_body_joint)),)
                T = transform.compose(T_base_joint, joint_motion(tree, joint, travel.closed))
            found[joint.child] = LinkPlace(body, transform.compose(bodies[body], T), opens)
            left.append((joint.child, T))
    return found


# --- limits and rates
# ---------------------------------------------------------------------------------------------------


def _figures(tree: Tree, joint: Joint, scale: float, own: Mapping[str, float]) -> dict[str, float]:
    """Return the limits of a joint's value, velocity, acceleration and jerk. `scale`: total motion per unit of the
    joint. `own`: values from a TOML file, which replace those of the URDF file.
    """
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
    rows = [{**structs.asdict(link), **joint} for link, joint in zip(chain.links, joints, strict=True)]
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


SINGULAR = 0.02  # if the isotropy of a pose is smaller, the pose is too singular for READY
END = 0.01  # a joint closer to the end of its range than this fraction of the range counts as at the end
STEP = pi / 12  # [rad] joint values tried for READY are multiples of this step
FAR = 2 * pi / 3  # [rad] maximum distance of a tried joint value from the original READY
# number of poses to begin with, of the best of these that are improved, and of sweeps over all joints
STARTS, TRIED, SWEEPS = 150, 3, 3

# weights in `_Wanted.worth`: a pose is better if few joints are turned, if their angles are small, if the tool points
# down and is in front of the arm, and if the arm is high up
TURNED, TURNS = 0.05, 0.03  # cost of each turned joint, and of each half turn of a joint
DOWN, AHEAD, HIGH = 0.25, 0.1, 0.1
# a tool points straight down if Z of its direction is smaller; the cost of turning it down must be smaller
STRAIGHT_DOWN, LITTLE = -1.0 + 1e-9, 0.1
NEAR = 0.3  # fraction of the reach: a tip nearer to the first axis lowers the worth


class Ready(NamedTuple):
    """Joints for the pose READY, and a note about them for the user."""

    joints: Joints
    note: str


def better_ready(model: RobotModel, ahead: Vector = Z) -> Ready | None:
    """Choose another pose for READY, in whole steps, if the arm is singular at READY or has a joint at the end of its
    range.

    Return None if READY is suitable, or no better pose is found. The result is always the same for the same arm.
    `ahead`: the direction of the tool in the frame of the flange.
    """
    if model.joint_count > 12:  # with more joints than 12 the search would take too long
        return None
    wanted = _Wanted(model, ahead)
    fault = wanted.fault()
    if not fault:
        return None
    starts = sorted(wanted.starts(), key=wanted.worth, reverse=True)
    best = wanted.level_tool(max((wanted.improve(q) for q in starts[:TRIED]), key=wanted.worth))
    if wanted.isotropy(link_frames(model, best)) <= SINGULAR:
        return None
    values = ", ".join(f"{round(x, 3):g}" for x in model.units.to_display(best))
    return Ready(best, f"READY: at its zeros {fault}, ours is {values} ([poses] ready of a TOML file is another)")


class _Wanted:
    """Rates how suitable poses of an arm are for READY, and searches for better ones."""

    def __init__(self, model: RobotModel, ahead: Vector) -> None:
        self.model, self.rest, self.ahead = model, model.poses["ready"], ahead
        _, (self.reach, *_) = levers(model)
        self.rows = 6 if model.task.turns else 3
        self.choices = [self._choices(i) for i in range(model.joint_count)]

    def fault(self) -> str:
        """Return the reason why the original READY is unsuitable; empty if it is suitable."""
        if self.isotropy(link_frames(self.model, self.rest)) <= SINGULAR:
            return "the arm is singular"
        rows = zip(self.model.links, self.model.lower, self.model.upper, self.rest, strict=True)
        at_end = (
            f"joint {i} is at its end"
            for i, (link, lower, upper, x) in enumerate(rows, 1)
            if link.kind is JointKind.REVOLUTE and min(x - lower, upper - x) < END * (upper - lower)
        )
        return next(at_end, "")

    def _choices(self, i: int) -> list[float]:
        lower, upper, rest = self.model.lower[i], self.model.upper[i], self.rest[i]
        margin = 0.05 * (upper - lower)  # 5 % of the joint's range stays free at either end
        if not i and self.model.links[i].kind is JointKind.REVOLUTE:
            return [min(max(rest, lower + margin), upper - margin)]  # keep joint 1, because it only turns the whole arm
        if self.model.links[i].kind is JointKind.PRISMATIC:
            return [rest, 0.5 * (lower + upper)]
        low, high = max(lower + margin, rest - FAR), min(upper - margin, rest + FAR)
        steps = (k * STEP for k in range(round(low / STEP) - 1, round(high / STEP) + 2))
        inside = [x for x in (rest, *steps) if low <= x <= high]
        return list(dict.fromkeys(inside)) or [0.5 * (lower + upper)]

    def starts(self) -> Iterator[Joints]:
        """Yield the original READY rounded to whole steps, then poses in which some joints are turned; a Weyl sequence
        spreads them evenly.
        """
        near = [min(xs, key=lambda x: abs(x - rest)) for xs, rest in zip(self.choices, self.rest, strict=True)]
        yield tuple(near)
        roots = [sqrt(prime) for prime in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29)]
        for k in range(1, STARTS):
            parts = (2.0 * (k * roots[i % len(roots)] % 1.0) - 1.0 for i in range(len(near)))
            rows = zip(self.choices, parts, near, strict=True)
            yield tuple(x if part < 0.0 else xs[int(len(xs) * part)] for xs, part, x in rows)

    def improve(self, q: Joints) -> Joints:
        """Improve a pose: set one joint after the other to its best value, until no joint improves or SWEEPS is
        reached.
        """
        for _ in range(SWEEPS):
            before = q
            for i, xs in enumerate(self.choices):
                q = max(((*q[:i], x, *q[i + 1 :]) for x in (q[i], *xs)), key=self.worth)
            if q == before:
                break
        return q

    def level_tool(self, q: Joints) -> Joints:
        """Return q with one joint turned so that the tool points straight down, if that lowers the worth by less than
        LITTLE; else q.
        """
        turned = [(*q[:i], x, *q[i + 1 :]) for i, xs in enumerate(self.choices) for x in xs]
        down = [
            other
            for other in turned
            if transform.rotate(link_frames(self.model, other)[-1], self.ahead)[2] < STRAIGHT_DOWN
        ]
        best = max(down, key=self.worth, default=q)
        return best if self.worth(best) > self.worth(q) - LITTLE else q

    def worth(self, q: Joints) -> float:
        frames = link_frames(self.model, q)
        base, tip = transform.position(frames[0]), transform.position(frames[-1])
        turned = [abs(x - y) for x, y in zip(q, self.rest, strict=True) if x != y]
        heights = [transform.position(T)[2] for T in frames]
        low = min(*heights, 0.0) - min(base[2], 0.0)
        return (
            self.isotropy(frames)
            - TURNED * len(turned)
            - TURNS * sum(turned) / pi
            - DOWN * transform.rotate(frames[-1], self.ahead)[2]
            + AHEAD * (tip[0] - base[0]) / self.reach
            + HIGH * (sum(heights) / len(heights) - base[2]) / self.reach
            + min(low, 0.0) / self.reach
            - max(0.0, NEAR - dist(tip[:2], base[:2]) / self.reach)
        )

    def isotropy(self, frames: Sequence[Transform]) -> float:
        at, unit = transform.position(frames[-1]), 0.5 * self.reach
        columns = list[list[float]]()  # columns of the flange's Jacobian, with lengths divided by `unit`
        for link, frame in zip(self.model.links, frames, strict=False):
            axis = axis_of(frame)
            if link.kind is JointKind.PRISMATIC:
                columns.append([*axis.direction, 0.0, 0.0, 0.0][: self.rows])
            else:
                x, y, z = transform.cross(axis.direction, transform.vector_difference(at, axis.point))
                columns.append([x / unit, y / unit, z / unit, *axis.direction][: self.rows])
        by_rows = [list(row) for row in zip(*columns, strict=True)]
        vectors = by_rows if len(by_rows) <= len(columns) else columns
        count, mean = len(vectors), sum(x * x for row in vectors for x in row) / len(vectors)
        return float(volume(vectors) ** (2.0 / count) / mean) if mean > 0.0 else 0.0
