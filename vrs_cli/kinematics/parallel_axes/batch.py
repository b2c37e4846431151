"""`ParallelAxesArm` over arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vrs_cli.kinematics.arrays import Floats, compose_batch, stack
from vrs_cli.kinematics.clearance import BOUNDARY, SINGULAR, Unchanging
from vrs_cli.kinematics.joints import SIDES, Configuration
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.parallel_axes.bars import Bars
from vrs_cli.kinematics.serial_batch import SerialBatch


class ParallelAxesBatch(SerialBatch):
    """Documented in `serial_batch`; same formulas and names as in `ParallelAxesArm`."""

    def __init__(self, model: RobotModel, unchanging: Unchanging, bars: Bars) -> None:
        super().__init__(model, SIDES, unchanging)
        self.bars = bars

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        bars, (l1, l2) = self.bars, self.bars.lengths
        near = np.broadcast_to(near, (len(T), self.joints))
        wrist, turn, rise = self._wrist(T)
        k = (np.abs(wrist) ** 2 - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
        k = np.where(np.abs(k) < 1.0 + BOUNDARY, np.clip(k, -1.0, 1.0), np.nan)
        psi = np.arccos(k) * configuration.signs[0] * bars.up
        i1, i2, *i3 = bars.turns
        q = near.copy()
        bearing = np.angle(wrist) - np.angle(l1 + l2 * np.exp(1j * psi)) - bars.bearings[0]
        q[:, i1] = np.where(np.abs(wrist) > SINGULAR, bars.signs[i1] * bearing, near[:, i1])
        q[:, i2] = bars.signs[i2] * (psi - bars.bearings[1] + bars.bearings[0])
        for i in i3:
            q[:, i] = bars.signs[i] * (turn - bars.signs[i1] * q[:, i1] - bars.signs[i2] * q[:, i2])
        for i in bars.slides:
            q[:, i] = bars.signs[i] * rise
        q = self.turned_near(q, near)
        q[np.isnan(k) | ~self.in_task(T)] = np.nan
        return q

    def _wrist(self, T: Floats) -> tuple[NDArray[np.complex128], Floats, Floats]:
        bars = self.bars
        seen, zero = compose_batch(stack([bars.T_plane_base]), T), stack([bars.flange])[0]
        turn = np.zeros(len(T))
        if len(bars.turns) > 2:
            M = seen[..., :3] @ zero[:, :3].T
            turn = np.arctan2(M[:, 1, 0] - M[:, 0, 1], M[:, 0, 0] + M[:, 1, 1])
        place = seen[:, 0, 3] + 1j * seen[:, 1, 3]
        return place - bars.hand * np.exp(1j * turn), turn, seen[:, 2, 3] - bars.flange.pz
