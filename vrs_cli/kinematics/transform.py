"""Compute with rigid transformations made of plain floats (for arrays of transformations: `arrays`).

`T_a_b` is the pose of frame b in frame a: `compose(T_base_tool, T_tool_part) = T_base_part`. Metres and radians.

Users describe a rotation by three angles, which VAL-II and V+ define differently (VAL-II manual; V+ Language
Reference):

    V+      yaw, pitch, roll    R = Rz(yaw) Ry(pitch) Rz(roll)
    VAL-II  O, A, T             yaw = O - 90 deg, pitch = A + 90 deg, roll = T
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import atan2, cos, hypot, pi, sin, sqrt
from operator import mul
from typing import NamedTuple

from vrs_cli.errors import IllegalValue

Vector = tuple[float, float, float]

Z: Vector = (0.0, 0.0, 1.0)

RIGHT_ANGLE = pi / 2
TURN = 2 * pi
# [rad] if the tool is closer to vertical, only the sum or difference of yaw and roll is defined: yaw is set to 0
POLE = 1e-10


class Transform(NamedTuple):
    """A homogeneous transformation: the upper three rows of the matrix [n s a p], with x axis n, y axis s, approach (z)
    axis a, and position p [m].
    """

    nx: float
    sx: float
    ax: float
    px: float
    ny: float
    sy: float
    ay: float
    py: float
    nz: float
    sz: float
    az: float
    pz: float


IDENTITY = Transform(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)

_new = tuple.__new__  # Transform(...) takes twice as long as making its tuple directly


def compose(a: Transform, b: Transform) -> Transform:
    """Return T_x_z = T_x_y @ T_y_z for a = T_x_y and b = T_y_z; in VAL-II `a:b`."""
    anx, asx, aax, apx, any_, asy, aay, apy, anz, asz, aaz, apz = a
    bnx, bsx, bax, bpx, bny, bsy, bay, bpy, bnz, bsz, baz, bpz = b
    return _new(
        Transform,
        (
            anx * bnx + asx * bny + aax * bnz,
            anx * bsx + asx * bsy + aax * bsz,
            anx * bax + asx * bay + aax * baz,
            anx * bpx + asx * bpy + aax * bpz + apx,
            any_ * bnx + asy * bny + aay * bnz,
            any_ * bsx + asy * bsy + aay * bsz,
            any_ * bax + asy * bay + aay * baz,
            any_ * bpx + asy * bpy + aay * bpz + apy,
            anz * bnx + asz * bny + aaz * bnz,
            anz * bsx + asz * bsy + aaz * bsz,
            anz * bax + asz * bay + aaz * baz,
            anz * bpx + asz * bpy + aaz * bpz + apz,
        ),
    )


def inverse(a: Transform) -> Transform:
    """Return T_y_x for a = T_x_y."""
    nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = a
    return _new(
        Transform,
        (
            nx,
            ny,
            nz,
            -(nx * px + ny * py + nz * pz),
            sx,
            sy,
            sz,
            -(sx * px + sy * py + sz * pz),
            ax,
            ay,
            az,
            -(ax * px + ay * py + az * pz),
        ),
    )


def position(T: Transform) -> Vector:
    """Return the origin of the frame [m]."""
    return T[3], T[7], T[11]


def at_position(T: Transform, x: float, y: float, z: float) -> Transform:
    """Return a transformation with the rotation of T at another position [m]."""
    nx, sx, ax, _, ny, sy, ay, _, nz, sz, az, _ = T
    return _new(Transform, (nx, sx, ax, x, ny, sy, ay, y, nz, sz, az, z))


def rotate(T: Transform, v: Vector) -> Vector:
    """Return R @ v: a direction given in the inner frame of T, expressed in the outer frame."""
    nx, sx, ax, _, ny, sy, ay, _, nz, sz, az, _ = T
    x, y, z = v
    return nx * x + sx * y + ax * z, ny * x + sy * y + ay * z, nz * x + sz * y + az * z


def moved_point(T: Transform, p: Vector) -> Vector:
    """Return T @ p: a point given in the inner frame of T, expressed in the outer frame [m]."""
    nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = T
    x, y, z = p
    return nx * x + sx * y + ax * z + px, ny * x + sy * y + ay * z + py, nz * x + sz * y + az * z + pz


def translation(x: float, y: float, z: float) -> Transform:
    """Return a pure translation by x, y, z [m]."""
    return Transform(1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z)


def rotation_x(angle: float) -> Transform:
    """Return a rotation about x by an angle [rad]; in V+ RX."""
    c, s = cos(angle), sin(angle)
    return Transform(1.0, 0.0, 0.0, 0.0, 0.0, c, -s, 0.0, 0.0, s, c, 0.0)


def rotation_y(angle: float) -> Transform:
    """Return a rotation about y by an angle [rad]; in V+ RY."""
    c, s = cos(angle), sin(angle)
    return Transform(c, 0.0, s, 0.0, 0.0, 1.0, 0.0, 0.0, -s, 0.0, c, 0.0)


def rotation_z(angle: float) -> Transform:
    """Return a rotation about z by an angle [rad]; in V+ RZ."""
    c, s = cos(angle), sin(angle)
    return Transform(c, -s, 0.0, 0.0, s, c, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def rotation_about(axis: Vector, angle: float) -> Transform:
    """Return a rotation by an angle [rad] about an axis, a vector of any length. Raises IllegalValue if its length is
    zero.
    """
    return turned_about(IDENTITY, axis)(angle)


def turned_about(T: Transform, axis: Vector) -> Callable[..., Transform]:
    """Return a function turn(angle, x, y, z) that returns T rotated by an angle [rad] about an axis given in its own
    frame (Rodrigues' formula), moved to the position x, y, z [m]; by default at the position of T.

    Raises IllegalValue if the axis has length zero.
    """
    length = hypot(*axis)
    if not length > 0.0:
        raise IllegalValue(f"the axis {axis} has no direction", "give a vector that is not zero")
    x, y, z = axis[0] / length, axis[1] / length, axis[2] / length
    xx, yy, zz, xy, yz, zx = x * x, y * y, z * z, x * y, y * z, z * x
    nx, sx, ax, tx, ny, sy, ay, ty, nz, sz, az, tz = T

    def turn(angle: float, px: float = tx, py: float = ty, pz: float = tz) -> Transform:
        s, half = sin(angle), sin(0.5 * angle)
        versine = 2.0 * half * half
        c = 1.0 - versine
        xs, ys, zs, xyv, yzv, zxv = x * s, y * s, z * s, xy * versine, yz * versine, zx * versine
        n1, n2, n3 = xx * versine + c, xyv + zs, zxv - ys
        s1, s2, s3 = xyv - zs, yy * versine + c, yzv + xs
        a1, a2, a3 = zxv + ys, yzv - xs, zz * versine + c
        return _new(
            Transform,
            (
                nx * n1 + sx * n2 + ax * n3,
                nx * s1 + sx * s2 + ax * s3,
                nx * a1 + sx * a2 + ax * a3,
                px,
                ny * n1 + sy * n2 + ay * n3,
                ny * s1 + sy * s2 + ay * s3,
                ny * a1 + sy * a2 + ay * a3,
                py,
                nz * n1 + sz * n2 + az * n3,
                nz * s1 + sz * s2 + az * s3,
                nz * a1 + sz * a2 + az * a3,
                pz,
            ),
        )

    return turn


def distance(a: Transform, b: Transform) -> float:
    """Return the distance between the origins of two frames [m]."""
    return hypot(a[3] - b[3], a[7] - b[7], a[11] - b[11])


# --- angles ----------------------------------------------------------------------------------------------


def from_oat(x: float, y: float, z: float, o: float, a: float, t: float) -> Transform:
    """Return the pose at a position [m] with VAL-II angles O, A, T [rad]: Rz(O - 90 deg) Ry(A + 90 deg) Rz(T)."""
    cy, sy = cos(o - RIGHT_ANGLE), sin(o - RIGHT_ANGLE)
    cp, sp = cos(a + RIGHT_ANGLE), sin(a + RIGHT_ANGLE)
    cr, sr = cos(t), sin(t)
    cycp, sycp = cy * cp, sy * cp
    return _new(
        Transform,
        (
            cycp * cr - sy * sr,
            -cycp * sr - sy * cr,
            cy * sp,
            x,
            sycp * cr + cy * sr,
            -sycp * sr + cy * cr,
            sy * sp,
            y,
            -sp * cr,
            sp * sr,
            cp,
            z,
        ),
    )


def to_oat(T: Transform) -> Vector:
    """Return the VAL-II angles O, A, T of a rotation [rad]: O and T in (-pi, pi], A in [-pi/2, pi/2]; O is pi/2 if the
    tool is vertical.
    """
    nx, sx, ax, _, ny, sy, ay, _, _, _, az, _ = T
    h = hypot(ax, ay)
    if h < POLE:
        return RIGHT_ANGLE, (-RIGHT_ANGLE if az > 0.0 else RIGHT_ANGLE), _half_open(atan2(ny, sy))
    # compute roll relative to the yaw just found, not from the third row: if the tool is nearly vertical, the errors of
    # both angles then cancel
    o = _half_open(atan2(ay, ax)) + RIGHT_ANGLE
    roll = _half_open(atan2(ax * ny - ay * nx, ax * sy - ay * sx))
    return (o - TURN if o > pi else o) + 0.0, (atan2(h, az) - RIGHT_ANGLE) + 0.0, roll


def oat_turns(o: float, a: float, t: float) -> tuple[Transform, Transform, Transform, Transform]:
    """Return the factors of the rotation of `from_oat`: Rz(O), M, Ry(A), Rz(T).

    M = Rz(-90 deg) Ry(90 deg) is the orientation with all angles 0: the tool points along -Y, and its y axis along X.
    """
    M = Transform(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0)
    return rotation_z(o), M, rotation_y(a), rotation_z(t)


def _half_open(angle: float) -> float:
    """Return pi for -pi, 0.0 for -0.0, and other angles unchanged."""
    return pi if angle == -pi else angle + 0.0


# --- rotations as axis and angle -------------------------------------------------------------------------


def axis_angle(T: Transform) -> tuple[Vector, float]:
    """Return the axis (a unit vector) and the angle [rad] in [0, pi] of the rotation of T; the axis is z if the angle
    is 0.

    Both are computed from the quaternion (its largest component first; Shepperd 1978), so they are as precise near 0 as
    near pi.
    """
    w, x, y, z = quaternion(T)
    length = hypot(x, y, z)
    if length < 1e-300:  # the division below would lose digits for smaller numbers
        return (0.0, 0.0, 1.0), 0.0
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    return (x / length + 0.0, y / length + 0.0, z / length + 0.0), 2.0 * atan2(length, w)


def quaternion(T: Transform) -> tuple[float, float, float, float]:
    """Return the quaternion (w, x, y, z) of the rotation of T, multiplied by some number that is not 0."""
    nx, sx, ax, _, ny, sy, ay, _, nz, sz, az, _ = T
    trace = nx + sy + az
    if trace >= nx and trace >= sy and trace >= az:
        return 1.0 + trace, sz - ay, ax - nz, ny - sx
    if nx >= sy and nx >= az:
        return sz - ay, 1.0 + nx - sy - az, ny + sx, ax + nz
    if sy >= az:
        return ax - nz, ny + sx, 1.0 + sy - az - nx, sz + ay
    return ny - sx, ax + nz, sz + ay, 1.0 + az - nx - sy


def unit_quaternion(T: Transform) -> tuple[float, float, float, float]:
    """Return the unit quaternion (w, x, y, z) of the rotation of T."""
    q = quaternion(T)
    # the largest component of q is 4 times the square of the unit quaternion's, so its square root gives the length
    scale = 0.5 / sqrt(max(q))
    w, x, y, z = (scale * value for value in q)
    return w, x, y, z


def angle_between(a: Transform, b: Transform) -> float:
    """Return the angle of the rotation from a to b [rad], in [0, pi]."""
    return axis_angle(compose(inverse(a), b))[1]


# --- rigidity --------------------------------------------------------------------------------------------


def orthonormal_frame(T: Transform) -> Transform:
    """Return T with exactly orthonormal axes: the approach axis keeps its direction, and the y axis changes as little
    as possible; in V+ NORMAL.

    Raises IllegalValue if two axes are parallel, or one has length zero.
    """
    ax, ay, az = _unit((T.ax, T.ay, T.az))
    nx, ny, nz = _unit((T.sy * az - T.sz * ay, T.sz * ax - T.sx * az, T.sx * ay - T.sy * ax))
    sx, sy, sz = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
    return Transform(nx, sx, ax, T.px, ny, sy, ay, T.py, nz, sz, az, T.pz)


def _unit(v: Vector) -> Vector:
    length = hypot(*v)
    if not length > 1e-9:
        raise IllegalValue("the axes of the transformation do not span space", "its axes must not be parallel")
    return v[0] / length, v[1] / length, v[2] / length


# --- vectors -------------------------------------------------------------------------------------------------


def vector_sum(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def vector_difference(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scaled_vector(a: Vector, factor: float) -> Vector:
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def length(a: Vector) -> float:
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def unit(a: Vector) -> Vector:
    size = length(a)
    return (a[0] / size, a[1] / size, a[2] / size)


def along(point: Vector, direction: Vector, way: float) -> Vector:
    return (point[0] + way * direction[0], point[1] + way * direction[1], point[2] + way * direction[2])


def any_normal(z: Vector) -> Vector:
    """Return a unit vector perpendicular to z, as close to X as possible."""
    x: Vector = (1.0, 0.0, 0.0) if abs(z[0]) < 0.9 else (0.0, 1.0, 0.0)
    return unit(along(x, z, -dot(x, z)))


def rotated_back(T: Transform, a: Vector) -> Vector:
    """Return R^T @ a: a direction given in the outer frame of T, expressed in its inner frame."""
    x, y, z = a
    return (
        T.nx * x + T.ny * y + T.nz * z,
        T.sx * x + T.sy * y + T.sz * z,
        T.ax * x + T.ay * y + T.az * z,
    )


ORTHONORMAL = 1e-6  # maximum error of the dot products of a rotation's axes (0, or 1 for an axis with itself)


def is_rotation(rows: Sequence[Sequence[float]]) -> bool:
    """Return whether the rows of a matrix are perpendicular to each other and have length 1. Reflections pass too."""
    pairs = ((a, b) for i, a in enumerate(rows) for b in rows[: i + 1])
    return all(abs(sum(map(mul, a, b)) - (a is b)) <= ORTHONORMAL for a, b in pairs)
