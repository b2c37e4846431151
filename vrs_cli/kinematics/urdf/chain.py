"""Which joints of a tree of links are the arm, which are the fingers of its hand, and where its tip is.

An arm goes from the root to where its fingers part, or to the end. Two long branches are two arms. What is decided here
though the file does not say it is told in `notes`: whoever names base and tip decides for himself.
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
ARM, FINGER = 4, 4  # an arm that fingers may hang on has so many joints at least, a finger so many at most
MAX_NAMED_ENDS = 10  # ends that a message names

_FINGER_LINK = re.compile(r"finger|fngr|thumb|knuckle|jaw|claw", re.IGNORECASE)
_FINGER_JOINT = re.compile(rf"{_FINGER_LINK.pattern}|grip", re.IGNORECASE)
_WRIST_JOINT = re.compile(r"rotat|(?<!t)roll|yaw|pitch|wrist|twist", re.IGNORECASE)  # as gripper_roll is one


@dataclass(frozen=True)
class Choice:
    """The joints from base to tip, those that are fixed too, and all joints that move the hand."""

    base: str
    tip: str
    way: tuple[Joint, ...]
    fingers: tuple[Joint, ...]
    notes: tuple[str, ...] = ()


def choice(tree: Tree, base: str | None, tip: str | None) -> Choice:
    """The arm of a file between two links; where one is not named, the one that the tree of links suggests.

    Raises FileDamaged where there are several.
    """
    start = tree.root() if base is None else tree.check_link(base)
    notes: list[str] = []
    if tip is None:
        arm, *others = _arms(tree, start, 0)
        if others:
            tips = [end for end, *_ in (arm, *others)][:MAX_NAMED_ENDS]
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
    """The tips of all arms below a link that is moved by so many joints, each with what is to be said of it."""
    nexts = tree.nearest(link)
    while len(nexts) == 1 and not _is_hand(tree, link, joints):
        link, joints = nexts[0].child, joints + _counts(nexts[0])
        nexts = tree.nearest(link)
    if not nexts:
        return [(_end(tree, link),)]
    if _is_hand(tree, link, joints):
        ways = [[link, *(joint.child for joint in tree.way(link, finger.parent))] for finger in nexts]
        parting = [links[0] for links in zip(*ways, strict=False) if len(set(links)) == 1][-1]
        # where that link holds one that is named as the place between the fingers, that
        tip = min(tree.together(parting), key=lambda end: _rank(end, GRASPS))
        if len(nexts) > 1:
            return [(tip,)]
        note = (
            f"joint {nexts[0].name} at the end of the chain moves the hand and is no joint of the arm: "
            f"the tip is {tip}, which it does not move (--tip {nexts[0].child} takes it for one)"
        )
        return [(tip, note)]
    depths = [_depth(tree, joint) for joint in nexts]
    if not any(depths):  # they all mimic others
        return [(_end(tree, link),)]
    long = [joint for joint, depth in zip(nexts, depths, strict=True) if 2 * depth > max(depths)]
    return [arm for joint in long for arm in _arms(tree, joint.child, joints + _counts(joint))]


def _counts(joint: Joint) -> bool:
    return not joint.mimics and joint.type not in LOOSE


def _depth(tree: Tree, joint: Joint) -> int:
    """How many joints the longest chain has that begins with this one."""
    deepest, left = 0, [(joint, 0)]
    while left:
        joint, above = left.pop()
        depth = above + _counts(joint)
        deepest = max(deepest, depth)
        left += [(after, depth) for after in tree.nearest(joint.child)]
    return deepest


def _is_hand(tree: Tree, link: str, joints: int) -> bool:
    """Whether the branches on a link are fingers, `joints` of an arm before it: by their names, as all but one mimic
    it, or as short ones at the end of an arm."""
    if not joints:
        return False
    nexts = tree.nearest(link)
    if (
        len(nexts) == 1
    ):  # a jaw: by its names, unless the one before is a finger's too (in a file of one finger alone), or
        (last,) = nexts  # as it does not move the place between the fingers
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
    """By its names; a wrist may carry a jaw that is fixed to it."""
    if _FINGER_LINK.search(joint.name):
        return True
    named = _FINGER_JOINT.search(joint.name) or _FINGER_LINK.search(joint.child)
    return bool(named) and not _WRIST_JOINT.search(joint.name)


# --- where the tip is --------------------------------------------------------------------------------------------


def _end(tree: Tree, link: str) -> str:
    """Of the ends of what a chain moves last the one with the most usual name."""
    ends = [held for held in tree.together(link) if not tree.below.get(held)] or [link]
    return min(ends, key=lambda end: _rank(end, TIPS))


def _rank(link: str, names: Sequence[str]) -> int:
    """How usual the name of a tip is; a name may have something before it."""
    return next(
        (i for i, name in enumerate(names) if link == name or link.endswith((f"_{name}", f"/{name}"))), len(names)
    )


# --- what an arm stands on ---------------------------------------------------------------------------------------


def _without_vehicle(tree: Tree, way: Sequence[Joint]) -> tuple[list[Joint], list[Joint]]:
    """A chain without the joints that it begins with and that drive or float, and these. What slides without end may
    turn without end before and after that."""
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


NEARER = 1e-4  # [m] fingers that come nearer to each other by less do not


class Travel(NamedTuple):
    """A joint of the hand, closed and open [rad, m]."""

    closed: float
    open: float


class Fingers(NamedTuple):
    """The joints of a hand by their names; how much farther apart its tips are while it is open [m], 0 where the file
    does not tell; the links that are its tips."""

    travels: Mapping[str, Travel]
    width: float
    tips: tuple[str, ...]


def fingers_of(tree: Tree, link: str, joints: Sequence[Joint], closed: str | None = None) -> Fingers:
    """The fingers that these joints move, as seen from the link that carries them.

    A joint is closed at the end where the tips are nearer to each other; where that makes no difference, at the end
    nearer to zero. `closed`, "lower" or "upper", says it for all.
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
    """The limits of a joint; None for one that has no such ends, which stays at zero."""
    found = tree.range(joint)
    if joint.type not in MOVING or found.lower is None or found.upper is None or found.endless:
        return None
    return (found.lower, found.upper) if found.lower < found.upper else None


def joint_motion(tree: Tree, joint: Joint, value: float) -> Transform:
    """What a joint at a value does to its child link, before which its origin comes."""
    if not value:
        return IDENTITY
    if MOVING[joint.type] is JointKind.PRISMATIC:
        return transform.translation(*transform.scaled_vector(tree.axis(joint), value))
    return transform.rotation_about(tree.axis(joint), value)


class _Gauge:
    """Where the tips of fingers are, as their joints stand."""

    def __init__(self, tree: Tree, link: str, joints: Sequence[Joint]) -> None:
        self.tree, self.link, self.joints = tree, link, joints
        carrying = {step.child for joint in joints for step in tree.way(link, joint.parent)}
        self.tips = [self._tip(joint) for joint in joints if joint.child not in carrying]

    def _tip(self, joint: Joint) -> str:
        """The farthest link that a joint holds: files often have one at the end of a finger."""
        held = self.tree.together(joint.child)
        return max(held, key=lambda link: dist(transform.position(self._step(joint.child, link, {})), (0.0, 0.0, 0.0)))

    def all_values(self, own: Mapping[str, float]) -> dict[str, float]:
        """Of all joints that have one, those that mimic others too."""
        values, left = dict(own), [joint for joint in self.joints if joint.mimics and joint.type in MOVING]
        for _ in self.joints:  # one that mimics may be mimicked itself
            left = [joint for joint in left if joint.name not in values]
            for joint in left:
                with suppress(FileDamaged):  # an arm moves without this finger
                    mimic = self.tree.mimic(joint)
                    if mimic.leader in values:
                        values[joint.name] = mimic.factor * values[mimic.leader] + mimic.offset
        return values

    def parting(self, before: Mapping[str, float], after: Mapping[str, float]) -> float:
        """How much farther apart the two tips come that move most to each other or from each other [m]; 0 for one tip
        alone. Links of a gear beside the fingers move less."""
        rows = zip(self._distances(before), self._distances(after), strict=False)
        return max((b - a for a, b in rows), key=abs, default=0.0)

    def _distances(self, own: Mapping[str, float]) -> list[float]:
        """Of each two tips."""
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


CLEAR = 0.7  # cosine of the angle between where fingers point and an axis: farther off it is none
SHORT = 1e-3  # [m] no direction

Z = (0.0, 0.0, 1.0)


class Turned(NamedTuple):
    """A direction of the tip, and the turn that brings Z there."""

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
    """The axis of the tip that fingers point along, where it is clearly another than Z; `last`: a point of the last
    joint, and places of the fingers' ends, as the tip sees them.

    They point from the last joint to their ends and to the tip.
    """
    ends = [transform.vector_difference(end, last) for end in fingers]
    if not ends:
        return None
    mean = transform.scaled_vector(
        (sum(x for x, _, _ in ends), sum(y for _, y, _ in ends), sum(z for _, _, z in ends)), 1.0 / len(ends)
    )
    ahead = transform.vector_sum(mean, transform.scaled_vector(last, -1.0))
    far = transform.length(ahead)
    if far < SHORT:
        return None
    return next((one for one in _OTHERS if sum(map(float.__mul__, one.direction, ahead)) > CLEAR * far), None)


def pointing_note(tip: str, turned: Turned) -> str:
    """The note for users whose tip points along another axis than its fingers."""
    angles = ", ".join(f"{round(degrees(angle), 3) + 0.0:g}" for angle in transform.to_oat(turned.turn))
    return (
        f"the fingers point along {turned.name} of {tip}, but APPRO and DEPART go along its Z: "
        f"TOOL TRANS(0, 0, 0, {angles}) turns it, or flange = [0, 0, 0, {angles}] in a TOML file"
    )
