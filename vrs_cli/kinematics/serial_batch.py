"""What `serial_arm` and the classes on it do, over arrays: whole timelines at once.

Forward kinematics and Jacobian are the formulas of `compiled`, with the sine and cosine of numpy. Work goes in chunks
that stay in the processor's cache.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vrs_cli.kinematics.arm_batch import TURN, chunks, columns
from vrs_cli.kinematics.compiled import formulas
from vrs_cli.kinematics.configuration import Configuration
from vrs_cli.kinematics.elimination import LOST
from vrs_cli.kinematics.jacobian import AT_REST
from vrs_cli.kinematics.joints import LIMIT_TOLERANCE
from vrs_cli.kinematics.serial_arm import LEVEL, STRAIGHT, Unchanging
from vrs_cli.kinematics.spherical_wrist import BOUNDARY, SINGULAR
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose
from vrs_cli.kinematics.transform_batch import compose_batch, stack

if TYPE_CHECKING:
    from vrs_cli.kinematics.mapped_arm import MappedArm
    from vrs_cli.kinematics.offset_wrist import OffsetWristArm
    from vrs_cli.kinematics.parallel_axes import ParallelAxesArm
    from vrs_cli.kinematics.serial_arm import SerialArm

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


class SerialBatch:
    """The `_batch` methods of `arm.RobotArm`, for an arm whose class gives `inverse_branch`."""

    def __init__(self, arm: SerialArm) -> None:
        model = arm.model
        self.arm, self.joints = arm, model.joint_count
        self.lower, self.upper = np.array(model.lower), np.array(model.upper)
        self.turning = np.array(arm.turning)
        self.formulas = formulas(model.links, model.base, model.flange, arrays=True)

    def forward(self, q: Floats) -> Floats:
        """(N, n) -> (N, 3, 4)."""
        T = np.empty((len(q), 3, 4))
        for part in chunks(len(q)):
            for i, entry in enumerate(self.formulas.forward(columns(q[part]))):
                T[part, i // 4, i % 4] = entry
        return T

    def jacobian(self, q: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        """(N, n) -> (N, 6, n)."""
        J = np.empty((len(q), 6, self.joints))
        tip = T_flange_tool.px, T_flange_tool.py, T_flange_tool.pz
        for part in chunks(len(q)):
            for r, row in enumerate(self.formulas.jacobian(columns(q[part]), *tip)):
                for c, entry in enumerate(row):
                    J[part, r, c] = entry
        return J

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        """(N, 3, 4) -> joints (N, k, n) of the k ways, NaN where out of reach, and whether inside the limits (N, k)."""
        middle = (self.lower + self.upper) / 2
        q = np.stack([self.inverse_branch(T, way, middle) for way in self.arm.ways], axis=1)
        return q, self.inside(q)

    def inside(self, q: Floats) -> Flags:
        """(..., n) -> (...)."""
        within = (q >= self.lower - LIMIT_TOLERANCE) & (q <= self.upper + LIMIT_TOLERANCE)
        return np.asarray(within.all(axis=-1))

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        """(N, 3, 4), near (N, n) or (n,) -> (N, n) on the turns nearest to `near`, NaN where out of reach."""
        raise NotImplementedError

    def turned_near(self, q: Floats, near: Floats) -> Floats:
        """(N, n): joints that turn on the turn nearest to `near`."""
        return np.where(self.turning, q + TURN * np.rint((near - q) / TURN), q)

    def in_task(self, T: Floats) -> Flags:
        """(N, 3, 4) -> (N,): `SerialArm.in_task` by rows."""
        if self.arm.unchanging == Unchanging((), None):
            return np.ones(len(T), dtype=np.bool_)
        places, approach = self.arm.unchanging
        within = np.ones(len(T), dtype=np.bool_)
        for i, value in places:
            within &= np.abs(T[:, i, 3] - value) <= LEVEL
        if approach is not None:
            cosine, sine = T[:, :, 2] @ approach, np.linalg.norm(np.cross(T[:, :, 2], approach), axis=1)
            within &= np.arctan2(sine, cosine) <= STRAIGHT
        return within

    # --- velocities --------------------------------------------------------------------------------------

    def counted(self, q: Floats, J: Floats, twist: Floats) -> tuple[Floats, Floats]:
        """(N, 6, n) and (N, 6) -> the m rows that count, turns about the axes of the flange: (N, m, n) and (N, m)."""
        counts = np.array(self.arm.model.task.counts)
        if counts.all():
            return J, twist
        R = np.swapaxes(self.forward(q)[..., :3], -1, -2)
        J = np.concatenate((J[:, :3], R @ J[:, 3:]), axis=1)
        twist = np.concatenate((twist[:, :3], np.einsum("nij,nj->ni", R, twist[:, 3:])), axis=1)
        return J[:, counts], twist[:, counts]

    def joint_velocity(self, q: Floats, twist: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        """(N, n) and (N, 6) -> (N, n); NaN in a row whose twist asks for a direction that is lost there."""
        rows, wanted = self.counted(q, self.jacobian(q, T_flange_tool), twist)
        rows = np.where(self.held(), 0.0, rows)
        qd = np.einsum("nij,nj->ni", np.linalg.pinv(rows, rcond=LOST), wanted)
        missed = np.abs(np.einsum("nij,nj->ni", rows, qd) - wanted)
        lost = (missed > AT_REST + 1e-7 * np.abs(wanted).max(axis=1, keepdims=True)).any(axis=1)
        return np.where(lost[:, None], np.nan, qd)

    def held(self) -> Flags:
        """(n,): joints that do not move along a straight line."""
        return np.zeros(self.joints, dtype=np.bool_)


class MappedBatch(SerialBatch):
    """`mapped_arm` over arrays."""

    def __init__(self, arm: MappedArm) -> None:
        super().__init__(arm)
        chain = arm.way.chain
        self.way, self.inner = arm.way, arm.inner._batch
        self.signs, self.zeros = np.array(chain.signs), np.array([link.theta for link in chain.links])
        self.ends = stack([arm.to_inner, arm.from_flange])

    def _seen(self, T: Floats) -> Floats:
        return compose_batch(compose_batch(self.ends[0], T), self.ends[1])

    def _back(self, q: Floats) -> Floats:
        return np.asarray(self.signs * (q - self.zeros))

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        q, inside = self.inner.inverse(self._seen(T))
        return self._back(q), inside

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        return self._back(self.inner.inverse_branch(self._seen(T), configuration, self.signs * near + self.zeros))

    def joint_velocity(self, q: Floats, twist: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        R = self.ends[0][:, :3]
        seen = np.concatenate((twist[:, :3] @ R.T, twist[:, 3:] @ R.T), axis=1)
        tool = compose(self.way.chain.flange, T_flange_tool)
        return np.asarray(self.signs * self.inner.joint_velocity(self.signs * q + self.zeros, seen, tool))


class OffsetWristBatch(SerialBatch):
    """`offset_wrist` over arrays: same formulas, same names."""

    def __init__(self, arm: OffsetWristArm) -> None:
        super().__init__(arm)
        self.offsets = arm.offsets

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        near = np.broadcast_to(near, (len(T), 6))
        q = np.empty((len(T), 6))
        for part in chunks(len(T)):
            self._branch(columns(T[part]), configuration, columns(near[part]), q[part])
        return self.turned_near(q, near)

    def _branch(self, T: Floats, configuration: Configuration, near: Floats, q: Floats) -> None:
        nx, sx, ax, px, ny, sy, ay, py, nz, sz, az, pz = T
        d1, a2, a3, side, d5, d6, right = self.offsets
        arm, elbow, wrist = configuration.signs
        forward = arm * right
        x, y, z = px - d6 * ax, py - d6 * ay, pz - d6 * az
        reach2 = x * x + y * y
        outward2 = reach2 - side * side
        outward = forward * np.sqrt(np.where(outward2 < -BOUNDARY, np.nan, np.maximum(outward2, 0.0)))
        on_axis = reach2 <= SINGULAR * SINGULAR
        across2 = np.where(on_axis, 1.0, reach2)
        c1 = np.where(on_axis, np.cos(near[0]), (outward * x - side * y) / across2)
        s1 = np.where(on_axis, np.sin(near[0]), (outward * y + side * x) / across2)
        na, sa = nx * s1 - ny * c1, sx * s1 - sy * c1
        s5 = np.hypot(na, sa)
        c5 = ax * s1 - ay * c1
        q6 = np.where(s5 > SINGULAR, np.arctan2(-sa * wrist, na * wrist), near[5])
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
            q[:, i] = angle
        q[np.isnan(k)] = np.nan


class ParallelAxesBatch(SerialBatch):
    """`parallel_axes` over arrays: same formulas, same names."""

    def __init__(self, arm: ParallelAxesArm) -> None:
        super().__init__(arm)
        self.scara = arm

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        arm, bars = self.scara, self.scara.bars
        near = np.broadcast_to(near, (len(T), self.joints))
        wrist, turn, rise = self._wrist(T)
        l1, l2 = arm.lengths
        k = (np.abs(wrist) ** 2 - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
        k = np.where(np.abs(k) < 1.0 + BOUNDARY, np.clip(k, -1.0, 1.0), np.nan)
        psi = np.arccos(k) * configuration.signs[0] * bars.up
        i1, i2, *i3 = bars.turns
        q = near.copy()
        bearing = np.angle(wrist) - np.angle(l1 + l2 * np.exp(1j * psi)) - arm.bearings[0]
        q[:, i1] = np.where(np.abs(wrist) > SINGULAR, bars.signs[i1] * bearing, near[:, i1])
        q[:, i2] = bars.signs[i2] * (psi - arm.bearings[1] + arm.bearings[0])
        for i in i3:
            q[:, i] = bars.signs[i] * (turn - bars.signs[i1] * q[:, i1] - bars.signs[i2] * q[:, i2])
        for i in bars.slides:
            q[:, i] = bars.signs[i] * rise
        q = self.turned_near(q, near)
        q[np.isnan(k) | ~self.in_task(T)] = np.nan
        return q

    def _wrist(self, T: Floats) -> tuple[NDArray[np.complex128], Floats, Floats]:
        bars = self.scara.bars
        seen, zero = compose_batch(stack([bars.T_plane_base]), T), stack([bars.flange])[0]
        turn = np.zeros(len(T))
        if len(bars.turns) > 2:
            M = seen[..., :3] @ zero[:, :3].T
            turn = np.arctan2(M[:, 1, 0] - M[:, 0, 1], M[:, 0, 0] + M[:, 1, 1])
        place = seen[:, 0, 3] + 1j * seen[:, 1, 3]
        return place - bars.hand * np.exp(1j * turn), turn, seen[:, 2, 3] - bars.flange.pz
