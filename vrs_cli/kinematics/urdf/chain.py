"""Find the arm, its tip and the fingers of its hand in the link tree of a URDF file, and measure the fingers.

An arm extends from the root of the tree to the link where its fingers branch off, or to the end of the tree. Two long
branches are two arms. `notes` tell the user about choices that the file does not determine; users can choose
differently by naming base and tip.

The module measures at which end of its range each finger joint is closed, how wide the open hand is, and along which
axis the fingers point. The axis matters because APPRO and DEPART move along the tip's Z, but in the files of many
manufacturers the fingers point along another axis.
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

TIPS = ("tool0", "tcp", "flange", "ee_link")  # usual link names of an arm's tip, the most likely first
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
# minimum number of joints of an arm that may carry fingers, and maximum number of joints in a finger
ARM, FINGER = 4, 4

_FINGER_LINK = re.compile(r"finger|fngr|thumb|knuckle|jaw|claw", re.IGNORECASE)
_FINGER_JOINT = re.compile(rf"{_FINGER_LINK.pattern}|grip", re.IGNORECASE)
# such a name means a wrist joint, even if it contains "grip", as gripper_roll does
_WRIST_JOINT = re.compile(r"rotat|(?<!t)roll|yaw|pitch|wrist|twist", re.IGNORECASE)


@dataclass(frozen=True)
class Choice:
    """The arm that was chosen in a file. `way`: all joints from base to tip, including fixed joints. `fingers`: all
    moving joints of the hand. `notes`: messages for the user about the choice.
    """

    base: str
    tip: str
    way: tuple[Joint, ...]
    fingers: tuple[Joint, ...]
    notes: tuple[str, ...] = ()


def choice(tree: Tree, base: str | None, tip: str | None) -> Choice:
    """Choose the arm of a file between the links `base` and `tip`. If one is None, it is found in the link tree.

    Raises FileDamaged if there are several arms.
    """
    start = tree.root() if base is None else tree.check_link(base)
    notes: list[str] = []
    if tip is None:
        arm, *others = _arms(tree, start, 0)
        if others:
            tips = [end for end, *_ in (arm, *others)][:10]  # 10: maximum number of tips that the message names
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
    """Return for each arm below a link its tip, followed by notes for the user. `joints`: the number of joints between
    the base and the link.
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
        # among the links fixed together, prefer one whose name means the point between the fingers
        tip = min(tree.together(parting), key=lambda end: _rank(end, GRASPS))
        if len(nexts) > 1:
            return [(tip,)]
        note = (
            f"joint {nexts[0].name} at the end of the chain moves the hand and is no joint of the arm: "
            f"the tip is {tip}, which it does not move (--tip {nexts[0].child} takes it for one)"
        )
        return [(tip, note)]
    depths = [_depth(tree, joint) for joint in nexts]
    if not any(depths):  # all following joints mimic others: the arm ends here
        return [(_end(tree, link),)]
    long = [joint for joint, depth in zip(nexts, depths, strict=True) if 2 * depth > max(depths)]
    return [arm for joint in long for arm in _arms(tree, joint.child, joints + _counts(joint))]


def _counts(joint: Joint) -> bool:
    return not joint.mimics and joint.type not in LOOSE


def _depth(tree: Tree, joint: Joint) -> int:
    """Return the number of joints in the longest chain of the tree that begins with `joint`; joints that mimic others
    do not count.
    """
    deepest, left = 0, [(joint, 0)]
    while left:
        joint, above = left.pop()
        depth = above + _counts(joint)
        deepest = max(deepest, depth)
        left += [(after, depth) for after in tree.nearest(joint.child)]
    return deepest


def _is_hand(tree: Tree, link: str, joints: int) -> bool:
    """Return whether the branches that begin at a link are fingers. `joints`: the number of joints between the base and
    the link.

    Branches are fingers if their names say so, if at most one of them does not mimic another joint, or if they are
    short and the arm before them is long enough.
    """
    if not joints:
        return False
    nexts = tree.nearest(link)
    if len(nexts) == 1:
        # A single branch is a jaw if its names say so, but not if the joint before it is a finger too: then the file
        # describes one finger. It is also a jaw if a link named as the point between the fingers does not move with it.
        (last,) = nexts
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
    """Return whether the names of a joint and its link say that it moves a finger. A wrist joint whose link has a
    finger's name is not a finger: a fixed jaw is part of the wrist.
    """
    if _FINGER_LINK.search(joint.name):
        return True
    named = _FINGER_JOINT.search(joint.name) or _FINGER_LINK.search(joint.child)
    return bool(named) and not _WRIST_JOINT.search(joint.name)


# --- the tip -----------------------------------------------------------------------------------------------------


def _end(tree: Tree, link: str) -> str:
    """Return the tip of an arm whose last moving link is `link`: the link fixed to it at an end of the tree that has
    the most usual name.
    """
    ends = [held for held in tree.together(link) if not tree.below.get(held)] or [link]
    return min(ends, key=lambda end: _rank(end, TIPS))


def _rank(link: str, names: Sequence[str]) -> int:
    """Return the index of a link's name in `names` (0: the most usual name), ignoring a prefix. Return len(names) if
    the name is not in the list.
    """
    return next(
        (i for i, name in enumerate(names) if link == name or link.endswith((f"_{name}", f"/{name}"))), len(names)
    )


# --- vehicles that carry an arm ----------------------------------------------------------------------------------


def _without_vehicle(tree: Tree, way: Sequence[Joint]) -> tuple[list[Joint], list[Joint]]:
    """Split a chain of joints into the arm and the joints before it that belong to a vehicle: they drive or float.

    A vehicle has a joint that slides without limits, or floats; unlimited turning joints directly before and after it
    belong to the vehicle too.
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


NEARER = 1e-4  # [m] smaller changes of the distance between fingertips are ignored


class Travel(NamedTuple):
    """The values of a finger joint when the hand is closed and when it is open [rad, m]."""

    closed: float
    open: float


class Fingers(NamedTuple):
    """The fingers of a hand.

    `travels`: the travel of each joint, by the joint's name. `width`: how much farther apart the fingertips are when
    the hand is open than when it is closed [m]; 0 if unknown. `tips`: the links at the ends of the fingers.
    """

    travels: Mapping[str, Travel]
    width: float
    tips: tuple[str, ...]


def fingers_of(tree: Tree, link: str, joints: Sequence[Joint], closed: str | None = None) -> Fingers:
    """Measure the fingers that these joints move. `link`: the link that carries them.

    A joint is closed at the end of its range where the fingertips are nearer to each other, or, if the distance is the
    same at both ends, at the end nearer to zero. `closed` ("lower" or "upper"): the end at which all joints are closed,
    if it is known.
    """
    own = {joint.name: ends for joint in joints if not joint.mimics and (ends := _ends(tree, joint)) is not None}
    gauge = _Gauge(tree, link, joints)
    values = {name: min(ends, key=abs) for name, ends in own.items()}
    for name, ends in own.items():
        lower, upper = ({**values, name: end} for end in ends)
        parts = gauge.distance_change(lower, upper)
        if closed is not None:
            values[name] = ends[closed == "upper"]
        elif abs(parts) > NEARER:
            values[name] = ends[parts < 0.0]
    opposite = {name: ends[ends[0] == values[name]] for name, ends in own.items()}
    shut, apart = gauge.all_values(values), gauge.all_values(opposite)
    travels = {name: Travel(shut[name], apart[name]) for name in shut}
    width = gauge.distance_change(values, opposite)
    return Fingers(travels, width if width > NEARER else 0.0, tuple(gauge.tips))


def _ends(tree: Tree, joint: Joint) -> tuple[float, float] | None:
    """Return the limits of a joint; None for a joint without limits, which stays at zero."""
    found = tree.range(joint)
    if joint.type not in MOVING or found.lower is None or found.upper is None or found.endless:
        return None
    return (found.lower, found.upper) if found.lower < found.upper else None


def joint_motion(tree: Tree, joint: Joint, value: float) -> Transform:
    """Return the transform that a joint at `value` [rad, m] adds after its origin, which moves its child link."""
    if not value:
        return IDENTITY
    if MOVING[joint.type] is JointKind.PRISMATIC:
        return transform.translation(*transform.scaled_vector(tree.axis(joint), value))
    return transform.rotation_about(tree.axis(joint), value)


class _Gauge:
    """Measures the distances between fingertips for given values of the finger joints."""

    def __init__(self, tree: Tree, link: str, joints: Sequence[Joint]) -> None:
        self.tree, self.link, self.joints = tree, link, joints
        carrying = {step.child for joint in joints for step in tree.way(link, joint.parent)}
        self.tips = [self._tip(joint) for joint in joints if joint.child not in carrying]

    def _tip(self, joint: Joint) -> str:
        """Return the link farthest from the joint, among those fixed to its child; URDF files often have an extra link
        at the fingertip.
        """
        held = self.tree.together(joint.child)
        return max(held, key=lambda link: dist(transform.position(self._step(joint.child, link, {})), (0.0, 0.0, 0.0)))

    def all_values(self, own: Mapping[str, float]) -> dict[str, float]:
        """Return the values of all finger joints, including those that mimic others. `own`: the values of the
        independent joints.
        """
        values, left = dict(own), [joint for joint in self.joints if joint.mimics and joint.type in MOVING]
        for _ in self.joints:  # repeat, because a joint that mimics another may itself be mimicked
            left = [joint for joint in left if joint.name not in values]
            for joint in left:
                with suppress(FileDamaged):  # ignore errors in this finger, because the arm can move without it
                    mimic = self.tree.mimic(joint)
                    if mimic.leader in values:
                        values[joint.name] = mimic.factor * values[mimic.leader] + mimic.offset
        return values

    def distance_change(self, before: Mapping[str, float], after: Mapping[str, float]) -> float:
        """Return the greatest change of the distance between two fingertips from `before` to `after` [m], positive if
        they move apart; 0 if there is only one tip.

        The greatest change counts, because the hand may have other links, such as those of a gear, that move less.
        """
        rows = zip(self._distances(before), self._distances(after), strict=False)
        return max((b - a for a, b in rows), key=abs, default=0.0)

    def _distances(self, own: Mapping[str, float]) -> list[float]:
        """Return the distance between the fingertips of each pair [m]."""
        values = self.all_values(own)
        try:
            places: list[Vector] = [transform.position(self._step(self.link, tip, values)) for tip in self.tips]
        except FileDamaged:  # ignore errors in the fingers, because the arm can move without them
            return []
        return [dist(a, b) for a, b in combinations(places, 2)]

    def _step(self, link: str, below: str, values: Mapping[str, float]) -> Transform:
        T = IDENTITY
        for joint in self.tree.way(link, below):
            T = transform.compose(T, self.tree.origin(joint.element))
            if joint.moves:
                T = transform.compose(T, joint_motion(self.tree, joint, values.get(joint.name, 0.0)))
        return T


CLEAR = 0.7  # minimum cosine of the angle between the fingers and an axis along which they clearly point


class Turned(NamedTuple):
    """The axis of the tip along which the fingers point: its name, its direction, and the rotation that turns Z to this
    direction.
    """

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
    """Return the axis of the tip along which the fingers point, if it is clearly another axis than Z; else None.

    The fingers point in the direction from the arm's last joint to the ends of the fingers. `last`: a point of the last
    joint; `fingers`: the ends of the fingers, both in the frame of the tip [m].
    """
    ends = [transform.vector_difference(end, last) for end in fingers]
    if not ends:
        return None
    mean = transform.scaled_vector(
        (sum(x for x, _, _ in ends), sum(y for _, y, _ in ends), sum(z for _, _, z in ends)), 1.0 / len(ends)
    )
    ahead = transform.vector_sum(mean, transform.scaled_vector(last, -1.0))
    far = transform.length(ahead)
    if far < 1e-3:  # [m] vectors shorter than 1e-3 give no reliable direction
        return None
    return next((one for one in _OTHERS if sum(map(float.__mul__, one.direction, ahead)) > CLEAR * far), None)


def pointing_note(tip: str, turned: Turned) -> str:
    """Return a note for the user, for a tip whose fingers point along another axis than Z."""
    angles = ", ".join(f"{round(degrees(angle), 3) + 0.0:g}" for angle in transform.to_oat(turned.turn))
    return (
        f"the fingers point along {turned.name} of {tip}, but APPRO and DEPART go along its Z: "
        f"TOOL TRANS(0, 0, 0, {angles}) turns it, or flange = [0, 0, 0, {angles}] in a TOML file"
    )
