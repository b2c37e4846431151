"""`OffsetWristArm` over arrays."""

from __future__ import annotations

import numpy as np

from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.clearance import BOUNDARY, ON_BOUNDARY, SINGULAR, Unchanging
from vrs_cli.kinematics.joints import ALL, Configuration
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.offset_wrist.inverse import Offsets
from vrs_cli.kinematics.serial_batch import SerialBatch, chunks, columns


class OffsetWristBatch(SerialBatch):
    """Documented in `serial_batch`; same formulas and names as in `OffsetWristArm`."""

    def __init__(self, model: RobotModel, offsets: Offsets) -> None:
        super().__init__(model, ALL, Unchanging())
        self.offsets = offsets

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        d1, a2, a3, side, d5, d6, right = self.offsets
        arm, elbow, wrist = configuration.signs
        forward = arm * right
        near = np.broadcast_to(near, (len(T), 6))
        q = np.empty((len(T), 6))
        for part in chunks(len(T)):
            nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = columns(T[part])
            there = columns(near[part])
            x, y, z = px - d6 * ax, py - d6 * ay, pz - d6 * az
            reach2 = x * x + y * y
            outward2 = reach2 - side * side
            outward = forward * np.sqrt(np.where(outward2 < -BOUNDARY, np.nan, np.maximum(outward2, 0.0)))
            on_axis = reach2 <= SINGULAR * SINGULAR
            across2 = np.where(on_axis, 1.0, reach2)
            c1 = np.where(on_axis, np.cos(there[0]), (outward * x - side * y) / across2)
            s1 = np.where(on_axis, np.sin(there[0]), (outward * y + side * x) / across2)
            na, sa = nx * s1 - ny * c1, sx * s1 - sy * c1
            s5 = np.hypot(na, sa)
            c5 = ax * s1 - ay * c1
            q6 = np.where(s5 > ON_BOUNDARY, np.arctan2(-sa * wrist, na * wrist), there[5])
            q5 = np.arctan2(wrist * s5, c5)
            c6, s6, s5 = np.cos(q6), np.sin(q6), wrist * s5
            u, v, w = c5 * c6, -c5 * s6, -s5
            ex, ey, lift = nx * u + sx * v + ax * w, ny * u + sy * v + ay * w, nz * u + sz * v + az * w
            level = c1 * ex + s1 * ey
            h, v = c1 * x + s1 * y - d5 * lift, z - d1 + d5 * level
            k = (h * h + v * v - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
            k = np.where(np.abs(k) < 1.0 + BOUNDARY, np.clip(k, -1.0, 1.0), np.nan)
            fold = -elbow * forward
            q2 = np.arctan2(v, h) - np.arctan2(a3 * fold * np.sqrt((1.0 - k) * (1.0 + k)), a2 + a3 * k)
            q3 = fold * np.arccos(k)
            for i, angle in enumerate((np.arctan2(s1, c1), q2, q3, np.arctan2(lift, level) - q2 - q3, q5, q6)):
                q[part, i] = angle
            q[part][np.isnan(k)] = np.nan
        return self.turned_near(q, near)
