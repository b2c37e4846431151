"""Choose the arm, the fingers of its hand and its tip in a tree of links, and measure the fingers.

An arm extends from the root to the link where its fingers branch off, or to the end of the tree. Two long branches are
two arms. `notes` report choices that the file does not determine; a user determines them by naming base and tip.

The module measures at which end of its range each finger's joint is closed, how wide the open hand is, and the axis
along which the fingers point: APPRO and DEPART go along the tip's Z, and in the files of many makers fingers point
along another axis.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations, takewhile
from math import degrees, dist, pi
from typing import NamedTuple

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics import transform
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.transform import IDENTITY, Transform, Vector
from vrs_cli.kinematics.urdf.tree import LOOSE, MOVING, Joint, Tree

TIPS = ("tool0", "tcp", "flange", "ee_link")  # names of a tip, the most likely first
GRASPS = (
    "tcp",
    "tool_frame",
    "gripper_frame_link",
    "grasp_center_link",
    "grasping_frame",
    "ee_gripper_link",
    "ee_link",
    "tool0",
)
ARM, FINGER = 4, 4  # minimum number of joints of an arm before fingers, and maximum number of joints of a finger

_FINGER_LINK = re.compile(r"finger|fngr|thumb|knuckle|jaw|claw", re.IGNORECASE)
_FINGER_JOINT = re.compile(rf"{_FINGER_LINK.pattern}|grip", re.IGNORECASE)
_WRIST_JOINT = re.compile(r"rotat|(?<!t)roll|yaw|pitch|wrist|twist", re.IGNORECASE)  # for example gripper_roll


@dataclass(frozen=True)
class Choice:
    """The joints from base to tip, including the fixed ones, and all joints that move the hand."""

    base: str
    tip: str
    way: tuple[Joint, ...]
    fingers: tuple[Joint, ...]
    notes: tuple[str, ...] = ()


def choice(tree: Tree, base: str | None, tip: str | None) -> Choice:
    """Return the arm of a file between two links. A link that is not named follows from the tree of links.

    Raises FileDamaged if there are several arms.
    """
    start = tree.root() if base is None else tree.check_link(base)
    notes: list[str] = []
    if tip is None:
        arm, *others = _arms(tree, start, 0)
        if others:
            tips = [end for end, *_ in (arm, *others)][:10]  # maximum number of ends that a message names
            raise FileDamaged(
                f"{tree.file}: it has several arms, with the ends {', '.join(tips)}",
                f"choose one: --tip {tips[0]}, or urdf_tip in a TOML",
            )
        tip, *notes = arm
    way = tree.way(start, tree.check_link(tip))
    if base is None:
        way, left = _without_vehicle(tree, way)
        if left:
            start = left[-1].child
            names = ", ".join(joint.name for joint in left if joint.moves)
            notes.insert(0, f"left out, as what has no end is no joint of an arm: {names}; the base is {start}")
    moving = [joint for joint in way if joint.moves]
    if not moving:
        raise FileDamaged(
            f"{tree.file}: no joint moves between base and tip",
            "give --base and --tip, or urdf_base and urdf_tip in a TOML",
        )
    last = moving[-1].child
    nexts = tree.nearest(last) if _is_hand(tree, last, len(moving)) else []
    fingers = tuple(joint for first in nexts for joint in tree.moving_below(first))
    return Choice(start, tip, tuple(way), fingers, tuple(notes))


# --- one arm or several ------------------------------------------------------------------------------------------


def _arms(tree: Tree, link: str, joints: int) -> list[tuple[str, ...]]:
    """Return the tips of all arms below a link, each with its notes. `joints`: the number of joints that move the
    link.
    """
    nexts = tree.nearest(link)
    while len(nexts) == 1 and not _is_hand(tree, link, joints):
        link, joints = nexts[0].child, joints + _counts(nexts[0])
        nexts = tree.nearest(link)
    if not nexts:
        return [(_end(tree, link),)]
    if _is_hand(tree, link, joints):
        ways = [[link, *(joint.child for joint in tree.way(link, finger.parent))] for finger in nexts]
        parting = [links[0] for links in zip(*ways, strict=False) if len(set(links)) == 1][-1]
        # prefer a fixed link that is named as the point between the fingers
        tip = min(tree.together(parting), key=lambda end: _rank(end, GRASPS))
        if len(nexts) > 1:
            return [(tip,)]
        note = (
            f"joint {nexts[0].name} at the end of the chain moves the hand and is no joint of the arm: "
            f"the tip is {tip}, which it does not move (--tip {nexts[0].child} takes it for one)"
        )
        return [(tip, note)]
    depths = [_depth(tree, joint) for joint in nexts]
    if not any(depths):  # all joints mimic others
        return [(_end(tree, link),)]
    long = [joint for joint, depth in zip(nexts, depths, strict=True) if 2 * depth > max(depths)]
    return [arm for joint in long for arm in _arms(tree, joint.child, joints + _counts(joint))]


def _counts(joint: Joint) -> bool:
    return not joint.mimics and joint.type not in LOOSE


def _depth(tree: Tree, joint: Joint) -> int:
    """Return the number of joints in the longest chain that begins with this one."""
    deepest, left = 0, [(joint, 0)]
    while left:
        joint, above = left.pop()
        depth = above + _counts(joint)
        deepest = max(deepest, depth)
        left += [(after, depth) for after in tree.nearest(joint.child)]
    return deepest


def _is_hand(tree: Tree, link: str, joints: int) -> bool:
    """Return whether the branches on a link are fingers. `joints`: the number of joints of the arm before the link.

    Branches are fingers if their names say so, if all but one mimic that one, or if they are short and at the end of an
    arm.
    """
    if not joints:
        return False
    nexts = tree.nearest(link)
    if (
        len(nexts) == 1
    ):  # a single branch is a jaw if its names say so, but not if the joint before it is a finger too (a file of one
        (last,) = nexts  # finger); it is also a jaw if the point between the fingers does not move with it
        if any(_counts(after) for after in tree.moving_below(last) if after is not last):
            return False
        if _is_finger(last):
            return not _is_finger(tree.by_child[link])
        return any(_rank(held, GRASPS) < len(GRASPS) for held in tree.together(link))
    if all(map(_is_finger, nexts)) or sum(map(_counts, nexts)) < 2:
        return True
    return joints >= ARM and (
        all("hand" in joint.name.lower() for joint in nexts) or max(_depth(tree, joint) for joint in nexts) <= FINGER
    )


def _is_finger(joint: Joint) -> bool:
    """Return whether a joint moves a finger, by its names; a wrist may carry a jaw that is fixed to it."""
    if _FINGER_LINK.search(joint.name):
        return True
    named = _FINGER_JOINT.search(joint.name) or _FINGER_LINK.search(joint.child)
    return bool(named) and not _WRIST_JOINT.search(joint.name)


# --- where the tip is --------------------------------------------------------------------------------------------


def _end(tree: Tree, link: str) -> str:
    """Return the end of the last moving body with the most usual name."""
    ends = [held for held in tree.together(link) if not tree.below.get(held)] or [link]
    return min(ends, key=lambda end: _rank(end, TIPS))


def _rank(link: str, names: Sequence[str]) -> int:
    """Return the rank of a tip's name (0: the most usual name); a name may have a prefix."""
    return next(
        (i for i, name in enumerate(names) if link == name or link.endswith((f"_{name}", f"/{name}"))), len(names)
    )


# --- what an arm stands on ---------------------------------------------------------------------------------------


def _without_vehicle(tree: Tree, way: Sequence[Joint]) -> tuple[list[Joint], list[Joint]]:
    """Split a chain into the arm and the joints before it that drive or float.

    A vehicle that slides without end may turn without end before and after that.
    """
    moving = [joint for joint in way if joint.moves]
    leading = list(
        takewhile(
            lambda joint: _drives(tree, joint) or (joint.type == "revolute" and tree.range(joint).endless), moving
        )
    )
    while leading and not _drives(tree, leading[-1]):
        leading.pop()
    behind = moving[len(leading) :]
    if leading and leading[-1].type not in LOOSE and behind and tree.range(behind[0]).endless:
        leading.append(behind[0])
    cut = way.index(leading[-1]) + 1 if leading else 0
    return list(way[cut:]), list(way[:cut])


def _drives(tree: Tree, joint: Joint) -> bool:
    return joint.type in LOOSE or (MOVING.get(joint.type) is JointKind.PRISMATIC and tree.range(joint).endless)


NEARER = 1e-4  # [m] smaller changes of the distance between fingers do not count


class Travel(NamedTuple):
    """The value of a joint of the hand when closed and when open [rad, m]."""

    closed: float
    open: float


class Fingers(NamedTuple):
    """The fingers of a hand.

    `travels`: joints by name. `width`: how much farther apart the tips are when open [m], 0 if unknown. `tips`: the
    links at their ends.
    """

    travels: Mapping[str, Travel]
    width: float
    tips: tuple[str, ...]


def fingers_of(tree: Tree, link: str, joints: Sequence[Joint], closed: str | None = None) -> Fingers:
    """Return the fingers that these joints move, seen from the link that carries them.

    A joint is closed at the end of its range where the tips are nearer to each other. If both ends have the same
    distance, it is closed at the end nearer to zero. If `closed` is given ("lower" or "upper"), it holds for all
    joints.
    """
    own = {joint.name: ends for joint in joints if not joint.mimics and (ends := _ends(tree, joint)) is not None}
    gauge = _Gauge(tree, link, joints)
    values = {name: min(ends, key=abs) for name, ends in own.items()}
    for name, ends in own.items():
        lower, upper = ({**values, name: end} for end in ends)
        parts = gauge.parting(lower, upper)
        if closed is not None:
            values[name] = ends[closed == "upper"]
        elif abs(parts) > NEARER:
            values[name] = ends[parts < 0.0]
    opposite = {name: ends[ends[0] == values[name]] for name, ends in own.items()}
    shut, apart = gauge.all_values(values), gauge.all_values(opposite)
    travels = {name: Travel(shut[name], apart[name]) for name in shut}
    width = gauge.parting(values, opposite)
    return Fingers(travels, width if width > NEARER else 0.0, tuple(gauge.tips))


def _ends(tree: Tree, joint: Joint) -> tuple[float, float] | None:
    """Return the limits of a joint; None for a joint without ends, which stays at zero."""
    found = tree.range(joint)
    if joint.type not in MOVING or found.lower is None or found.upper is None or found.endless:
        return None
    return (found.lower, found.upper) if found.lower < found.upper else None


def joint_motion(tree: Tree, joint: Joint, value: float) -> Transform:
    """Return the motion of a joint at a value, applied to its child link after the origin."""
    if not value:
        return IDENTITY
    if MOVING[joint.type] is JointKind.PRISMATIC:
        return transform.translation(*transform.scaled_vector(tree.axis(joint), value))
    return transform.rotation_about(tree.axis(joint), value)


class _Gauge:
    """Measures the distances of fingertips for values of their joints."""

    def __init__(self, tree: Tree, link: str, joints: Sequence[Joint]) -> None:
        self.tree, self.link, self.joints = tree, link, joints
        carrying = {step.child for joint in joints for step in tree.way(link, joint.parent)}
        self.tips = [self._tip(joint) for joint in joints if joint.child not in carrying]

    def _tip(self, joint: Joint) -> str:
        """Return the farthest link that a joint moves; URDF files often define a link at the fingertip."""
        held = self.tree.together(joint.child)
        return max(held, key=lambda link: dist(transform.position(self._step(joint.child, link, {})), (0.0, 0.0, 0.0)))

    def all_values(self, own: Mapping[str, float]) -> dict[str, float]:
        """Return the values of all joints, also of those that mimic others."""
        values, left = dict(own), [joint for joint in self.joints if joint.mimics and joint.type in MOVING]
        for _ in self.joints:  # a joint that mimics may be mimicked too
            left = [joint for joint in left if joint.name not in values]
            for joint in left:
                with suppress(FileDamaged):  # an arm moves without this finger
                    mimic = self.tree.mimic(joint)
                    if mimic.leader in values:
                        values[joint.name] = mimic.factor * values[mimic.leader] + mimic.offset
        return values

    def parting(self, before: Mapping[str, float], after: Mapping[str, float]) -> float:
        """Return the greatest change of the distance between two tips [m], positive if they move apart; 0 for one tip.

        The greatest change counts because links of a gear beside the fingers move less.
        """
        rows = zip(self._distances(before), self._distances(after), strict=False)
        return max((b - a for a, b in rows), key=abs, default=0.0)

    def _distances(self, own: Mapping[str, float]) -> list[float]:
        """Return the distance of each pair of tips."""
        values = self.all_values(own)
        try:
            places: list[Vector] = [transform.position(self._step(self.link, tip, values)) for tip in self.tips]
        except FileDamaged:  # an arm moves without its fingers
            return []
        return [dist(a, b) for a, b in combinations(places, 2)]

    def _step(self, link: str, below: str, values: Mapping[str, float]) -> Transform:
        T = IDENTITY
        for joint in self.tree.way(link, below):
            T = transform.compose(T, self.tree.origin(joint.element))
            if joint.moves:
                T = transform.compose(T, joint_motion(self.tree, joint, values.get(joint.name, 0.0)))
        return T


CLEAR = 0.7  # minimum cosine of the angle between the fingers and an axis


class Turned(NamedTuple):
    """A direction of the tip, and the turn that moves the Z axis to this direction."""

    name: str
    direction: Vector
    turn: Transform


_OTHERS = (
    Turned("X", (1.0, 0.0, 0.0), transform.rotation_y(pi / 2)),
    Turned("-X", (-1.0, 0.0, 0.0), transform.rotation_y(-pi / 2)),
    Turned("Y", (0.0, 1.0, 0.0), transform.rotation_x(-pi / 2)),
    Turned("-Y", (0.0, -1.0, 0.0), transform.rotation_x(pi / 2)),
    Turned("-Z", (0.0, 0.0, -1.0), transform.rotation_x(pi)),
)


def other_than_z(last: Vector, fingers: Iterable[Vector]) -> Turned | None:
    """Return the axis of the tip along which the fingers point, if that is clearly not Z.

    The fingers point from the last joint to their ends and to the tip. `last`: a point of the last joint; `fingers`:
    the ends of the fingers, both in the frame of the tip.
    """
    ends = [transform.vector_difference(end, last) for end in fingers]
    if not ends:
        return None
    mean = transform.scaled_vector(
        (sum(x for x, _, _ in ends), sum(y for _, y, _ in ends), sum(z for _, _, z in ends)), 1.0 / len(ends)
    )
    ahead = transform.vector_sum(mean, transform.scaled_vector(last, -1.0))
    far = transform.length(ahead)
    if far < 1e-3:  # [m] shorter vectors have no direction
        return None
    return next((one for one in _OTHERS if sum(map(float.__mul__, one.direction, ahead)) > CLEAR * far), None)


def pointing_note(tip: str, turned: Turned) -> str:
    """Return the note for a tip whose fingers point along another axis than Z."""
    angles = ", ".join(f"{round(degrees(angle), 3) + 0.0:g}" for angle in transform.to_oat(turned.turn))
    return (
        f"the fingers point along {turned.name} of {tip}, but APPRO and DEPART go along its Z: "
        f"TOOL TRANS(0, 0, 0, {angles}) turns it, or flange = [0, 0, 0, {angles}] in a TOML file"
    )
