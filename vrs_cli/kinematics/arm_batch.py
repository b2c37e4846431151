"""The formulas of `forward`, `inverse` and `jacobian` over arrays, for whole timelines at once.

Same formulas, same order of operations as the scalar ones: they agree to the last few bits. Work goes in
chunks that stay in the processor's cache, one contiguous row for each joint and each matrix element.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from vrs_cli.kinematics.configuration import Configuration
from vrs_cli.kinematics.jacobian import AT_REST
from vrs_cli.kinematics.joints import LIMIT_TOLERANCE
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.spherical_wrist import BOUNDARY, SINGULAR, Geometry
from vrs_cli.kinematics.transform import IDENTITY, Transform

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

TURN = 2 * pi
CHUNK = 2048


def chunks(n: int) -> Iterator[slice]:
    return (slice(start, min(start + CHUNK, n)) for start in range(0, n, CHUNK))


def columns(rows: Floats) -> Floats:
    """(N, ...) -> (k, N), contiguous."""
    return np.ascontiguousarray(rows.reshape(len(rows), -1).T)


@dataclass(frozen=True)
class ArmBatch:
    geometry: Geometry
    model: RobotModel

    # --- forward -----------------------------------------------------------------------------------------

    def forward(self, q: Floats) -> Floats:
        """(N, 6) -> (N, 3, 4)."""
        T = np.empty((len(q), 3, 4))
        for part in chunks(len(q)):
            self._forward(columns(q[part]), T[part])
        return T

    def _forward(self, q: Floats, T: Floats) -> None:
        d1, a1, a2, a3, d4, d6, side, _, _ = self.geometry
        (c1, c2, _, c4, c5, c6), (s1, s2, _, s4, s5, s6) = np.cos(q), np.sin(q)
        q23 = q[1] + q[2]
        c23, s23 = np.cos(q23), np.sin(q23)
        x, y = c4 * s5, s4 * s5
        e = c23 * x + s23 * c5
        ax, ay, az = c1 * e - s1 * y, s1 * e + c1 * y, c23 * c5 - s23 * x
        t = c5 * c6
        x, y = c4 * t - s4 * s6, s4 * t + c4 * s6
        t = s5 * c6
        e = c23 * x - s23 * t
        nx, ny, nz = c1 * e - s1 * y, s1 * e + c1 * y, -c23 * t - s23 * x
        u = a1 + a2 * c2 + a3 * c23 + d4 * s23
        T[:, 0, 0], T[:, 1, 0], T[:, 2, 0] = nx, ny, nz
        T[:, 0, 1], T[:, 1, 1], T[:, 2, 1] = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
        T[:, 0, 2], T[:, 1, 2], T[:, 2, 2] = ax, ay, az
        T[:, 0, 3] = c1 * u - s1 * side + d6 * ax
        T[:, 1, 3] = s1 * u + c1 * side + d6 * ay
        T[:, 2, 3] = d1 - a2 * s2 - a3 * s23 + d4 * c23 + d6 * az

    # --- inverse -----------------------------------------------------------------------------------------

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        """(N, 3, 4) -> joints (N, 8, 6), NaN where out of reach, and whether inside the limits (N, 8)."""
        q = np.empty((len(T), 8, 6))
        inside = np.empty((len(T), 8), dtype=np.bool_)
        for part in chunks(len(T)):
            self._inverse(columns(T[part]), q[part], inside[part])
        return q, inside

    def _inverse(self, T: Floats, q: Floats, inside: Flags) -> None:
        model = self.model
        middles = [(low + high) / 2 for low, high in zip(model.lower, model.upper, strict=True)]
        halves = [(high - low) / 2 + LIMIT_TOLERANCE for low, high in zip(model.lower, model.upper, strict=True)]
        rest = min(max(0.0, model.lower[3]), model.upper[3])

        def place(branch: int | slice, joint: int, angle: Floats) -> Flags:
            """Sets a joint to its turn nearest to the middle of its range; whether that is inside."""
            off = angle - middles[joint]
            angle = np.where(off > pi, angle - TURN, np.where(off < -pi, angle + TURN, angle))
            q[:, branch, joint] = angle if isinstance(branch, int) else angle[:, None]
            within: Flags = np.abs(angle - middles[joint]) <= halves[joint]
            return within

        centre = self._wrist_centre(T)
        for i, arm in enumerate((1.0, -1.0)):
            shoulder = self._shoulder(T, centre, arm, 0.0)
            fine1 = place(slice(4 * i, 4 * i + 4), 0, shoulder.q1)
            for j, elbow in enumerate((1.0, -1.0)):
                first = 4 * i + 2 * j
                pair = slice(first, first + 2)
                q2, q3, rows = self._elbow(shoulder, -arm * elbow)
                fine = fine1 & place(pair, 1, q2) & place(pair, 2, q3)
                q4, q5, q6, singular = self._wrist(rows, 1.0, rest)
                inside[:, first] = fine & place(first, 3, q4) & place(first, 4, q5) & place(first, 5, q6)
                if singular.any():
                    o4, o5, o6 = (
                        np.where(singular, angle, other)
                        for angle, other in ((q4, opposite(q4)), (q5, -q5), (q6, opposite(q6)))
                    )
                else:
                    o4, o5, o6 = opposite(q4), -q5, opposite(q6)
                flip = first + 1
                inside[:, flip] = fine & place(flip, 3, o4) & place(flip, 4, o5) & place(flip, 5, o6)

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        """(N, 3, 4), near (N, 6) or (6,) -> (N, 6) on the turns nearest to `near`, NaN where out of reach."""
        near = np.broadcast_to(near, (len(T), 6))
        q = np.empty((len(T), 6))
        for part in chunks(len(T)):
            self._inverse_branch(columns(T[part]), configuration, columns(near[part]), q[part])
        return q

    def _inverse_branch(self, T: Floats, configuration: Configuration, near: Floats, q: Floats) -> None:
        arm, elbow, wrist = configuration.signs
        shoulder = self._shoulder(T, self._wrist_centre(T), arm, near[0])
        q2, q3, rows = self._elbow(shoulder, -arm * elbow)
        q4, q5, q6, _ = self._wrist(rows, wrist, near[3])
        for i, angle in enumerate((shoulder.q1, q2, q3, q4, q5, q6)):
            q[:, i] = angle + TURN * np.rint((near[i] - angle) / TURN)

    def _wrist_centre(self, T: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """x, y, down; squared distance from the axis of joint 1, and its outward part (NaN if too close)."""
        d1, _, _, _, _, d6, side, _, _ = self.geometry
        x, y, v = T[3] - d6 * T[2], T[7] - d6 * T[6], d1 + d6 * T[10] - T[11]
        across = x * x + y * y
        u2 = across - side * side
        u2 = np.where(u2 < 0.0, np.where(u2 < -BOUNDARY, np.nan, 0.0), u2)
        return x, y, v, across, np.sqrt(u2)

    def _shoulder(
        self,
        T: Floats,
        centre: tuple[Floats, Floats, Floats, Floats, Floats],
        arm: float,
        rest: Floats | float,
    ) -> Shoulder:
        _, a1, a2, _, _, _, side, forearm, _ = self.geometry
        x, y, v, across, root = centre
        u = -arm * root
        h = u - a1
        rho = h * h + v * v
        k = (rho - (a2 * a2 + forearm * forearm)) / (2.0 * a2 * forearm)
        k = np.where(np.abs(k) < 1.0 + BOUNDARY, np.clip(k, -1.0, 1.0), np.nan)
        on_axis = across <= SINGULAR * SINGULAR
        if on_axis.any():
            across = np.where(on_axis, 1.0, across)
            c1 = np.where(on_axis, np.cos(rest), (u * x + side * y) / across)
            s1 = np.where(on_axis, np.sin(rest), (u * y - side * x) / across)
        else:
            c1, s1 = (u * x + side * y) / across, (u * y - side * x) / across
        return Shoulder(
            q1=np.arctan2(s1, c1),
            h=h,
            v=v,
            k=k,
            psi=np.arccos(k),
            sine=forearm * np.sqrt((1.0 - k) * (1.0 + k)),
            rho=np.where(rho == 0.0, np.nan, rho),
            radial=c1 * T[0:3] + s1 * T[4:7],
            across=c1 * T[4:7] - s1 * T[0:3],
            vertical=T[8:11],
        )

    def _elbow(self, arm: Shoulder, fold: float) -> tuple[Floats, Floats, tuple[Floats, ...]]:
        """Joints 2 and 3, and what the wrist needs of the rotation in frame 3: X Y Z, nX nY, sX sY."""
        _, _, a2, a3, d4, _, _, forearm, beta = self.geometry
        m, t = a2 + forearm * arm.k, arm.sine * fold
        c2, s2 = (arm.h * m + arm.v * t) / arm.rho, (arm.v * m - arm.h * t) / arm.rho
        q2, q3 = np.arctan2(s2, c2), beta + arm.psi * fold
        fh, fv = arm.h - a2 * c2, arm.v - a2 * s2
        f3, f4 = a3 / (forearm * forearm), d4 / (forearm * forearm)
        c23, s23 = f3 * fh - f4 * fv, f4 * fh + f3 * fv
        nX, sX, X = c23 * arm.radial - s23 * arm.vertical
        nY, sY, Y = arm.across
        return q2, q3, (X, Y, s23 * arm.radial[2] + c23 * arm.vertical[2], nX, nY, sX, sY)

    def _wrist(
        self, rows: tuple[Floats, ...], wrist: float, rest: Floats | float
    ) -> tuple[Floats, Floats, Floats, Flags]:
        """Joints 4, 5, 6, and where the wrist is singular (joint 4 is `rest` there)."""
        X, Y, Z, nX, nY, sX, sY = rows
        s5 = np.sqrt(X * X + Y * Y)
        singular = s5 <= SINGULAR
        if wrist < 0.0:
            X, Y, s5 = -X, -Y, -s5
        if singular.any():
            c4, s4 = np.where(singular, np.cos(rest), X), np.where(singular, np.sin(rest), Y)
            s5 = np.where(singular, (c4 * rows[0] + s4 * rows[1]), s5)
            q4 = np.where(singular, rest, np.arctan2(Y, X))
        else:
            c4, s4, q4 = X, Y, np.arctan2(Y, X)
        return q4, np.arctan2(s5, Z), np.arctan2(c4 * nY - s4 * nX, c4 * sY - s4 * sX), singular

    # --- velocities --------------------------------------------------------------------------------------

    def jacobian(self, q: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        """(N, 6) -> (N, 6, 6)."""
        J = np.zeros((len(q), 6, 6))
        for part in chunks(len(q)):
            self._jacobian(columns(q[part]), T_flange_tool, J[part])
        return J

    def _jacobian(self, q: Floats, T_flange_tool: Transform, J: Floats) -> None:
        arm = self._arm(q, T_flange_tool)
        c1, s1, c23, s23, c4, s4 = arm.c1, arm.s1, arm.c23, arm.s23, arm.c4, arm.s4
        rx, ry, rz = arm.tool
        a1, side = self.geometry.a1, self.geometry.side
        out = c1 * rx + s1 * ry
        lift2, lift3 = rz - arm.uv - arm.fv, rz - arm.fv
        e = -s4 * c23
        axes = (
            (c1 * s23, s1 * s23, c23),
            (c1 * e - s1 * c4, s1 * e + c1 * c4, s4 * s23),
            arm.approach,
        )
        J[:, 0, 0], J[:, 1, 0], J[:, 5, 0] = -s1 * arm.u - c1 * side - ry, c1 * arm.u - s1 * side + rx, 1.0
        J[:, 0, 1], J[:, 1, 1], J[:, 2, 1] = c1 * lift2, s1 * lift2, -(arm.u - a1 + out)
        J[:, 0, 2], J[:, 1, 2], J[:, 2, 2] = c1 * lift3, s1 * lift3, -(arm.fu + out)
        J[:, 3, 1] = J[:, 3, 2] = -s1
        J[:, 4, 1] = J[:, 4, 2] = c1
        for i, (x, y, z) in enumerate(axes, 3):
            J[:, 0, i], J[:, 1, i], J[:, 2, i] = y * rz - z * ry, z * rx - x * rz, x * ry - y * rx
            J[:, 3, i], J[:, 4, i], J[:, 5, i] = x, y, z

    def joint_velocity(self, q: Floats, twist: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        """(N, 6) and (N, 6) -> (N, 6); NaN in a row whose twist asks for a direction that is lost there."""
        qd = np.empty((len(q), 6))
        for part in chunks(len(q)):
            qd[part] = self._joint_velocity(columns(q[part]), columns(twist[part]), T_flange_tool).T
        return qd

    def _joint_velocity(self, q: Floats, twist: Floats, T_flange_tool: Transform) -> Floats:
        arm = self._arm(q, T_flange_tool)
        vx, vy, vz, wx, wy, wz = twist
        rx, ry, rz = arm.tool
        x, y, down = vx - wy * rz + wz * ry, vy - wz * rx + wx * rz, wx * ry - wy * rx - vz
        qd1 = ratio(arm.c1 * y - arm.s1 * x, arm.u)
        out = arm.c1 * x + arm.s1 * y + self.geometry.side * qd1
        qd2, qd23 = self._bars(arm, out, down)
        x, y, z = arm.c1 * wx + arm.s1 * wy, arm.c1 * wy - arm.s1 * wx - qd23, wz - qd1
        x, z = arm.c23 * x - arm.s23 * z, arm.s23 * x + arm.c23 * z
        qd6 = ratio(arm.c4 * x + arm.s4 * y, arm.s5)
        qd5 = arm.c4 * y - arm.s4 * x
        singular = np.abs(arm.s5) <= SINGULAR
        qd4 = np.where(singular, qd6, z - arm.c5 * qd6)  # 0, or the NaN of a lost direction
        qd6 = np.where(singular, qd6 + z / arm.c5, qd6)
        return np.array((qd1, qd2, qd23 - qd2, qd4, qd5, qd6))

    def _bars(self, arm: PlanarArm, out: Floats, down: Floats) -> tuple[Floats, Floats]:
        """Rates of upper arm and forearm in the arm's plane."""
        bars = self.geometry.a2 * self.geometry.forearm
        stretch = arm.uu * arm.fv - arm.uv * arm.fu
        straight = np.abs(stretch) <= SINGULAR * bars
        if not straight.any():
            return (out * arm.fu + down * arm.fv) / stretch, -(out * arm.uu + down * arm.uv) / stretch
        h, v = arm.uu + arm.fu, arm.uv + arm.fv
        reach = np.hypot(h, v)
        lost = (reach < SINGULAR) | (np.abs(out * h + down * v) > AT_REST * reach)
        as_one = np.where(lost, np.nan, (down * h - out * v) / np.where(reach < SINGULAR, 1.0, reach * reach))
        stretch = np.where(straight, 1.0, stretch)
        return (
            np.where(straight, as_one, (out * arm.fu + down * arm.fv) / stretch),
            np.where(straight, as_one, -(out * arm.uu + down * arm.uv) / stretch),
        )

    def _arm(self, q: Floats, T_flange_tool: Transform) -> PlanarArm:
        _, a1, a2, a3, d4, d6, _, _, _ = self.geometry
        (c1, c2, _, c4, c5, c6), (s1, s2, _, s4, s5, s6) = np.cos(q), np.sin(q)
        c23, s23 = np.cos(q[1] + q[2]), np.sin(q[1] + q[2])
        uu, uv = a2 * c2, a2 * s2
        fu, fv = a3 * c23 + d4 * s23, a3 * s23 - d4 * c23
        tx, ty, tz = T_flange_tool.px, T_flange_tool.py, d6 + T_flange_tool.pz

        def to_base(x: Floats, y: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
            e = c23 * x + s23 * z
            return c1 * e - s1 * y, s1 * e + c1 * y, c23 * z - s23 * x

        ax, ay, az = to_base(c4 * s5, s4 * s5, c5)
        rx, ry, rz = tz * ax, tz * ay, tz * az
        if tx or ty:
            along, across = c6 * tx - s6 * ty, s6 * tx + c6 * ty
            x, y, z = to_base(c4 * c5 * along - s4 * across, s4 * c5 * along + c4 * across, -s5 * along)
            rx, ry, rz = rx + x, ry + y, rz + z
        return PlanarArm(
            c1, s1, c23, s23, c4, s4, c5, s5, uu, uv, fu, fv, a1 + uu + fu, (ax, ay, az), (rx, ry, rz)
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Shoulder:
    """What both elbows share; names as in `inverse`. The rows hold n, s, a: (3, N)."""

    q1: Floats
    h: Floats
    v: Floats
    k: Floats
    psi: Floats
    sine: Floats
    rho: Floats
    radial: Floats
    across: Floats
    vertical: Floats


@dataclass(frozen=True, slots=True)
class PlanarArm:
    """What the velocity formulas share; names as in `jacobian`."""

    c1: Floats
    s1: Floats
    c23: Floats
    s23: Floats
    c4: Floats
    s4: Floats
    c5: Floats
    s5: Floats
    uu: Floats
    uv: Floats
    fu: Floats
    fv: Floats
    u: Floats
    approach: tuple[Floats, Floats, Floats]
    tool: tuple[Floats, Floats, Floats]


def opposite(angle: Floats) -> Floats:
    """Half a turn on, within (-pi, pi]."""
    return np.where(angle > 0.0, angle - pi, angle + pi)


def ratio(value: Floats, lever: Floats) -> Floats:
    """value / lever; where there is no lever 0 for no demand and NaN for any."""
    none = np.abs(lever) <= SINGULAR
    if not none.any():
        return value / lever
    without = np.where(np.abs(value) < AT_REST, 0.0, np.nan)
    return np.where(none, without, value / np.where(none, 1.0, lever))
