"""Starts of searches for any arm: those of many joints in their ranges that bring the tip nearest to a place."""

from __future__ import annotations

from itertools import islice

import numpy as np

from vrs_cli.kinematics.arrays import Floats, Rows
from vrs_cli.kinematics.numeric.search import some_joints
from vrs_cli.kinematics.serial_batch import SerialBatch

SAMPLES = 512
FIRST, OTHERS = 16, 32  # starts of one pose
TURN_COUNTS = 0.1  # [lengths of the arm/rad] of a turn that is missing, beside the way


class SampledStarts:
    """Starts for one arm and the tip of one tool (3,), in the frame of the flange."""

    def __init__(self, batch: SerialBatch, tip: Floats) -> None:
        self.tip, self.joints = tip, np.array(list(islice(some_joints(batch.model), SAMPLES)))
        self.poses = batch.forward(self.joints)
        self.tips = self.poses[:, :, :3] @ tip + self.poses[:, :, 3]
        self.length = np.ptp(self.tips, axis=0).max() / 2.0

    def first(self, T: Floats) -> Floats:
        """(FIRST, n) for a pose (3, 4)."""
        return np.asarray(self.joints[self._order(T)[:FIRST]])

    def others(self, T: Floats) -> Floats:
        """(OTHERS, n): the next ones."""
        return np.asarray(self.joints[self._order(T)[FIRST : FIRST + OTHERS]])

    def _order(self, T: Floats) -> Rows:
        """The numbers of the samples, those first that miss a pose least."""
        away = np.linalg.norm(self.tips - (T[:, :3] @ self.tip + T[:, 3]), axis=1)
        cosine = 0.5 * (np.einsum("nij,ij->n", self.poses[:, :, :3], T[:, :3]) - 1.0)
        missed = away / self.length + TURN_COUNTS * np.arccos(np.clip(cosine, -1.0, 1.0))
        return np.asarray(np.argsort(missed), dtype=np.intp)
