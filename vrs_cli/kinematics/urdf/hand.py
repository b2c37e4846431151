"""The fingers of an arm: which end of each joint is closed, how wide the hand is open, and the axis they point along.

APPRO and DEPART go along the tip's Z, and in the files of many makers fingers point along another axis.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import combinations
from math import degrees, dist, pi
from typing import NamedTuple

from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    added,
    compose,
    length,
    position,
    rotation_about,
    rotation_x,
    rotation_y,
    scaled,
    subtracted,
    to_oat,
    translation,
)
from vrs_cli.kinematics.urdf.tree import MOVING, Joint, Tree

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


def moved(tree: Tree, joint: Joint, value: float) -> Transform:
    """What a joint at a value does to its child link, before which its origin comes."""
    if not value:
        return IDENTITY
    if MOVING[joint.type] is JointKind.PRISMATIC:
        return translation(*scaled(tree.axis(joint), value))
    return rotation_about(tree.axis(joint), value)


class _Gauge:
    """Where the tips of fingers are, as their joints stand."""

    def __init__(self, tree: Tree, link: str, joints: Sequence[Joint]) -> None:
        self.tree, self.link, self.joints = tree, link, joints
        carrying = {step.child for joint in joints for step in tree.way(link, joint.parent)}
        self.tips = [self._tip(joint) for joint in joints if joint.child not in carrying]

    def _tip(self, joint: Joint) -> str:
        """The farthest link that a joint holds: files often have one at the end of a finger."""
        held = self.tree.together(joint.child)
        return max(held, key=lambda link: dist(position(self._step(joint.child, link, {})), (0.0, 0.0, 0.0)))

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
            places: list[Vector] = [position(self._step(self.link, tip, values)) for tip in self.tips]
        except FileDamaged:  # an arm moves without its fingers
            return []
        return [dist(a, b) for a, b in combinations(places, 2)]

    def _step(self, link: str, below: str, values: Mapping[str, float]) -> Transform:
        T = IDENTITY
        for joint in self.tree.way(link, below):
            T = compose(T, self.tree.origin(joint.element))
            if joint.moves:
                T = compose(T, moved(self.tree, joint, values.get(joint.name, 0.0)))
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
    Turned("X", (1.0, 0.0, 0.0), rotation_y(pi / 2)),
    Turned("-X", (-1.0, 0.0, 0.0), rotation_y(-pi / 2)),
    Turned("Y", (0.0, 1.0, 0.0), rotation_x(-pi / 2)),
    Turned("-Y", (0.0, -1.0, 0.0), rotation_x(pi / 2)),
    Turned("-Z", (0.0, 0.0, -1.0), rotation_x(pi)),
)


def other_than_z(last: Vector, fingers: Iterable[Vector]) -> Turned | None:
    """The axis of the tip that fingers point along, where it is clearly another than Z; `last`: a point of the last
    joint, and places of the fingers' ends, as the tip sees them.

    They point from the last joint to their ends and to the tip.
    """
    ends = [subtracted(end, last) for end in fingers]
    if not ends:
        return None
    mean = scaled((sum(x for x, _, _ in ends), sum(y for _, y, _ in ends), sum(z for _, _, z in ends)), 1.0 / len(ends))
    ahead = added(mean, scaled(last, -1.0))
    far = length(ahead)
    if far < SHORT:
        return None
    return next((one for one in _OTHERS if sum(map(float.__mul__, one.direction, ahead)) > CLEAR * far), None)


def pointing_note(tip: str, turned: Turned) -> str:
    """The note for users whose tip points along another axis than its fingers."""
    angles = ", ".join(f"{round(degrees(angle), 3) + 0.0:g}" for angle in to_oat(turned.turn))
    return (
        f"the fingers point along {turned.name} of {tip}, but APPRO and DEPART go along its Z: "
        f"TOOL TRANS(0, 0, 0, {angles}) turns it, or flange = [0, 0, 0, {angles}] in a TOML file"
    )
