"""`spherical_wrist.inverse` over arrays: same formulas, same order of operations, the same to the last few bits."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats
from vrs_cli.kinematics.clearance import BOUNDARY, ON_BOUNDARY, SINGULAR, Unchanging
from vrs_cli.kinematics.joints import ALL, LIMIT_TOLERANCE, TURN, Configuration
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.serial_batch import SerialBatch, chunks, columns
from vrs_cli.kinematics.spherical_wrist.inverse import Geometry


class SphericalWristBatch(SerialBatch):
    """Documented in `serial_batch`; same formulas and names as in `spherical_wrist.inverse`."""

    def __init__(self, model: RobotModel, geometry: Geometry) -> None:
        super().__init__(model, ALL, Unchanging())
        self.geometry = geometry

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
        arm, elbow, wrist = configuration.signs
        near = np.broadcast_to(near, (len(T), 6))
        q = np.empty((len(T), 6))
        for part in chunks(len(T)):
            poses, there = columns(T[part]), columns(near[part])
            shoulder = self._shoulder(poses, self._wrist_centre(poses), arm, there[0])
            q2, q3, rows = self._elbow(shoulder, -arm * elbow)
            q4, q5, q6, _ = self._wrist(rows, wrist, there[3])
            for i, angle in enumerate((shoulder.q1, q2, q3, q4, q5, q6)):
                q[part, i] = angle + TURN * np.rint((there[i] - angle) / TURN)
        return q

    def _wrist_centre(self, T: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """x, y, down; squared distance from the axis of joint 1, and its outward part (NaN if too close)."""
        d1, _, _, _, _, d6, side, _, _ = self.geometry
        x, y, v = T[3] - d6 * T[2], T[7] - d6 * T[6], d1 + d6 * T[10] - T[11]
        across = x * x + y * y
        u2 = across - side * side
        u2 = np.where(u2 < 0.0, np.where(u2 < -BOUNDARY, np.nan, 0.0), u2)
        return x, y, v, across, np.sqrt(u2)

    def _shoulder(
        self, T: Floats, centre: tuple[Floats, Floats, Floats, Floats, Floats], arm: float, rest: Floats | float
    ) -> Shoulder:
        _, a1, a2, _, _, _, side, forearm, _ = self.geometry
        x, y, v, across, root = centre
        u = -arm * root
        h = u - a1
        rho = h * h + v * v
        k = (rho - (a2 * a2 + forearm * forearm)) / (2.0 * a2 * forearm)
        k = np.where(np.abs(k) < 1.0 + BOUNDARY, np.clip(k, -1.0, 1.0), np.nan)
        rho = np.where(rho == 0.0, np.nan, rho)
        on_axis = across <= SINGULAR * SINGULAR
        if on_axis.any():
            across = np.where(on_axis, 1.0, across)
            c1 = np.where(on_axis, np.cos(rest), (u * x + side * y) / across)
            s1 = np.where(on_axis, np.sin(rest), (u * y - side * x) / across)
        else:
            c1, s1 = (u * x + side * y) / across, (u * y - side * x) / across
        return Shoulder(
            q1=np.where(np.isnan(k + rho), np.nan, np.arctan2(s1, c1)),  # the elbow may reach it on one side alone
            h=h,
            v=v,
            k=k,
            psi=np.arccos(k),
            sine=forearm * np.sqrt((1.0 - k) * (1.0 + k)),
            rho=rho,
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
        singular = s5 <= ON_BOUNDARY
        if wrist < 0.0:
            X, Y, s5 = -X, -Y, -s5
        if singular.any():
            c4, s4 = np.where(singular, np.cos(rest), X), np.where(singular, np.sin(rest), Y)
            s5 = np.where(singular, (c4 * rows[0] + s4 * rows[1]), s5)
            q4 = np.where(singular, rest, np.arctan2(Y, X))
        else:
            c4, s4, q4 = X, Y, np.arctan2(Y, X)
        return q4, np.arctan2(s5, Z), np.arctan2(c4 * nY - s4 * nX, c4 * sY - s4 * sX), singular


class Shoulder(NamedTuple):
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


def opposite(angle: Floats) -> Floats:
    """Half a turn on, within (-pi, pi]."""
    return np.where(angle > 0.0, angle - pi, angle + pi)
