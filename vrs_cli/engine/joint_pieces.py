"""Straight lines as cubic pieces of joints, for those who have no inverse kinematics.

Each piece is the cubic that has the joints and the joint velocities of g at both its ends (Hermite), so neighbours join
without a jump of place or velocity. A piece that leaves g by more than a tolerance is halved.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

from vrs_cli.engine.problem import joint_velocity, segment_joints
from vrs_cli.errors import IllegalValue, PathWithoutJoints, StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.trajectory.polynomial import Polynomial, value
from vrs_cli.trajectory.segment import JointPath, Segment

LOOKS = 8  # parts of a piece between which it is compared with g; even, so that halves share the places
MARGIN = 0.9  # of the tolerance, kept at the places that are compared: between them a piece may be a little farther off
SHORTEST = 2.0**-20  # [s] a piece that is halved no more, about 1 us
TOLERANCES = (0.1, 1e-2, 1e-3, 1e-4, 1e-5)  # [rad, m]


class JointPiece(NamedTuple):
    """A cubic of each joint [rad, m] in the time since the piece begins, for `duration` [s]."""

    duration: float
    joints: tuple[Polynomial, ...]


class _State(NamedTuple):
    """The joints and their velocities."""

    q: Joints
    qd: Joints


def known_tolerance(wanted: float) -> float:
    """Return the greatest of TOLERANCES that is not above the wanted one [rad, m]: so few that pieces serve many.

    Raises IllegalValue for one that is smaller than all of them, or greater.
    """
    most, least = TOLERANCES[0], TOLERANCES[-1]
    if not least <= wanted <= most:
        hint = f"a tolerance from {least:g} to {most:g} rad (of prismatic joints: m)"
        raise IllegalValue(f"joints within {wanted:g} rad", hint, value=wanted, lower=least, upper=most)
    return next(one for one in TOLERANCES if one <= wanted)


def joint_pieces(arm: RobotArm, segment: Segment, tolerance: float) -> tuple[JointPiece, ...]:
    """Return pieces, one after the other, from the begin of a segment of a straight line to its end.

    No joint is farther than `tolerance` [rad, m] from g. There are none for a segment that has joints by itself, or
    lasts no time, or has a pose that no joints lead to (a damaged file).
    """
    path = segment.path
    if isinstance(path, JointPath) or not segment.duration > 0.0:
        return ()
    states: dict[float, _State] = {}
    places: dict[float, Joints] = {}

    def joints(s: float) -> Joints:
        if s not in places:
            places[s] = segment_joints(arm, segment, s)
        return places[s]

    def velocity(s: float) -> Joints:
        twist, still = path.twist(s), (0.0,) * arm.model.joint_count
        try:
            return joint_velocity(arm, path, s, joints(s), twist, segment.motion.frames.tool) if any(twist) else still
        except StraightLineSingular:  # pieces next to a singular pose join without a jump, if not smoothly
            return still

    def state(s: float) -> _State:
        if s not in states:
            states[s] = _State(joints(s), velocity(s))
        return states[s]

    def close(piece: JointPiece, begin: float) -> bool:
        looks = max(LOOKS, ceil(0.5 * piece.duration / path.seed_interval) * 2) if path.seed_interval > 0.0 else LOOKS
        for k in range(1, looks):
            s = piece.duration * k / looks
            for a, q in zip(piece.joints, joints(begin + s), strict=True):
                if abs(value(a, s) - q) > MARGIN * tolerance:
                    return False
        return True

    def between(begin: float, end: float) -> list[JointPiece]:
        piece = _hermite(end - begin, state(begin), state(end))
        if end - begin < SHORTEST or close(piece, begin):
            return [piece]
        middle = 0.5 * (begin + end)
        return between(begin, middle) + between(middle, end)

    try:
        return tuple(between(0.0, segment.duration))
    except PathWithoutJoints:
        return ()


def _hermite(h: float, begin: _State, end: _State) -> JointPiece:
    """Return the cubics with these places and velocities at 0 and `h` [s]."""
    rows = []
    for p, v, q, w in zip(begin.q, begin.qd, end.q, end.qd, strict=True):
        slope = (q - p) / h
        rows.append((p, v, (3.0 * slope - 2.0 * v - w) / h, (v + w - 2.0 * slope) / (h * h)))
    return JointPiece(h, tuple(rows))
