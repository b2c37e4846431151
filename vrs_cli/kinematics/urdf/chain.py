"""Which joints of a tree of links are the arm, which are the fingers of its hand, and where its tip is.

An arm goes from the root to where its fingers part, or to the end. Two long branches are two arms. What is decided here
though the file does not say it is told in `notes`: whoever names base and tip decides for himself.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.joints import JointKind
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
MOST_NAMED = 10  # ends that a message names

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
    start = tree.root() if base is None else tree.known(base)
    notes: list[str] = []
    if tip is None:
        arm, *others = _arms(tree, start, 0)
        if others:
            tips = [end for end, *_ in (arm, *others)][:MOST_NAMED]
            raise FileDamaged(
                f"{tree.file}: it has several arms, with the ends {', '.join(tips)}",
                f"choose one: --tip {tips[0]}, or urdf_tip in a TOML",
            )
        tip, *notes = arm
    way = tree.way(start, tree.known(tip))
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
