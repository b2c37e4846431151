"""Arms of six joints whose wrist is not one point, in the lengths that their makers publish (data sheets, manuals)."""

from __future__ import annotations

from math import cos, radians, sin

from tests.kinematics.random_arms import DrawnArm, Joint, Vector

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
BACK_X, BACK_Y = (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)
BENT = radians(55.0)


def arm(hand: Vector, *rows: tuple[Vector, Vector, float, float]) -> DrawnArm:
    """Rows: offset [m], axis, limits [deg]."""
    joints = [Joint(offset, axis, False, radians(low), radians(high)) for offset, axis, low, high in rows]
    return DrawnArm(tuple(joints), hand)


CRX = arm(  # Fanuc CRX-10iA/L
    (0.0, 0.0, 0.0),
    ((0.0, 0.0, 0.245), Z, -180, 180),
    ((0.0, 0.0, 0.0), Y, -180, 180),
    ((0.0, 0.0, 0.71), BACK_Y, -270, 270),
    ((0.0, 0.0, 0.0), BACK_X, -190, 190),
    ((0.54, -0.15, 0.0), BACK_Y, -180, 180),
    ((0.16, 0.0, 0.0), BACK_X, -190, 190),
)
GOFA = arm(  # ABB CRB 15000-5/0.95
    (0.0, 0.0, 0.0),
    ((0.0, 0.0, 0.265), Z, -180, 180),
    ((0.0, 0.0, 0.0), Y, -180, 180),
    ((0.0, 0.0, 0.444), Y, -225, 85),
    ((0.0, 0.0, 0.11), X, -180, 180),
    ((0.47, 0.0, 0.0), Y, -180, 180),
    ((0.101, 0.0, 0.08), X, -270, 270),
)
XARM = arm(  # UFACTORY xArm 6
    (0.0, 0.0, -0.097),
    ((0.0, 0.0, 0.267), Z, -360, 360),
    ((0.0, 0.0, 0.0), Y, -118, 120),
    ((0.053, 0.0, 0.2845), Y, -225, 11),
    ((0.0775, 0.0, -0.3425), (0.0, 0.0, -1.0), -360, 360),
    ((0.0, 0.0, 0.0), Y, -97, 180),
    ((0.076, 0.0, 0.0), (0.0, 0.0, -1.0), -360, 360),
)
JACO = arm(  # Kinova Jaco 2 with 6 joints and a bent wrist, as to the directions of its axes, at the zeros of our own
    (0.16 * sin(2.0 * BENT), 0.0, 0.16 * cos(2.0 * BENT)),
    ((0.0, 0.0, 0.2755), (0.0, 0.0, -1.0), -360, 360),
    ((0.0, 0.0, 0.0), Y, -133, 133),
    ((0.0, 0.0098, 0.41), BACK_Y, -161, 161),
    ((0.0, 0.0, 0.2073), Z, -360, 360),
    ((0.0, 0.0, 0.0), (sin(BENT), 0.0, cos(BENT)), -360, 360),
    ((0.0741 * sin(BENT), 0.0, 0.0741 * cos(BENT)), (sin(2.0 * BENT), 0.0, cos(2.0 * BENT)), -360, 360),
)
BESIDE = GOFA._replace(joints=(GOFA.joints[0], GOFA.joints[1]._replace(offset=(0.0, -0.12, 0.0)), *GOFA.joints[2:]))
BEFORE = GOFA._replace(joints=(GOFA.joints[0], GOFA.joints[1]._replace(offset=(0.15, 0.0, 0.0)), *GOFA.joints[2:]))
OFFSET_ARMS = {"crx": CRX, "gofa": GOFA, "xarm": XARM, "jaco": JACO, "beside": BESIDE, "before": BEFORE}
