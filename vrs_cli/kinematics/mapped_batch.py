"""`mapped_arm` over arrays."""

from __future__ import annotations

import numpy as np

from vrs_cli.kinematics.arrays import Flags, Floats
from vrs_cli.kinematics.axes import Chain
from vrs_cli.kinematics.configuration import ALL, Configuration
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.serial_batch import SerialBatch
from vrs_cli.kinematics.transform import inverse
from vrs_cli.kinematics.transform_batch import compose_batch, stack
from vrs_cli.kinematics.unchanging import Unchanging


class MappedBatch(SerialBatch):
    """Asks the batch of the arm that the closed form solves."""

    def __init__(
        self, model: RobotModel, unchanging: Unchanging, chain: Chain, inner: SerialBatch, swapped: int
    ) -> None:
        super().__init__(model, inner.ways, unchanging)
        self.inner, self.swapped = inner, swapped
        self.signs, self.zeros = np.array(chain.signs), np.array([link.theta for link in chain.links])
        self.ends = stack([inverse(chain.base), inverse(chain.flange)])

    def _inner_poses(self, T: Floats) -> Floats:
        return compose_batch(compose_batch(self.ends[0], T), self.ends[1])

    def _own_joints(self, q: Floats) -> Floats:
        return np.asarray(self.signs * (q - self.zeros))

    def inverse(self, T: Floats) -> tuple[Floats, Flags]:
        q, inside = self.inner.inverse(self._inner_poses(T))
        order = np.arange(q.shape[1]) ^ self.swapped
        return self._own_joints(q[:, order]), inside[:, order]

    def inverse_branch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        other = ALL[configuration.index ^ self.swapped]
        return self._own_joints(self.inner.inverse_branch(self._inner_poses(T), other, self.signs * near + self.zeros))
