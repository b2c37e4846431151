"""The measured robot in Python: what a body reported, in the units of a robot."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike

from vrs_cli.api.location import Floats, Units, freeze, numbers
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.trajectory.measured import MeasuredTimeline
from vrs_cli.trajectory.reports import MODES


class Measured(Struct, frozen=True, eq=False):
    """What a body has reported up to now; later reports do not change it. Joints are in degrees (mm where a joint
    slides), or SI; times are seconds. `timeline`: the same in radians and metres.
    """

    timeline: MeasuredTimeline
    model: RobotModel
    units: Units

    def __len__(self) -> int:
        return len(self.timeline)

    @property
    def unknown_since(self) -> float | None:
        """The time of the last report, after which the robot is unknown; None if there is no report."""
        return self.timeline.end

    def at(self, t: ArrayLike) -> Floats | None:
        """The joints (n,) at a time, None where they are unknown; or at times (N,): (N, n), with rows of NaN there.

        Raises ValueError, TypeError.
        """
        times = numbers(t, "t")
        if times.ndim > 1:
            raise ValueError(f"t: one time or an array (N,) is wanted, not {times.shape}")
        if times.ndim:
            return freeze(self.timeline.joints_over(times) * self._scales)
        joints = self.timeline.joints_at(float(times))
        return None if joints is None else freeze(np.array(joints) * self._scales)

    @property
    def times(self) -> Floats:
        """(N,): the times of all reports."""
        return freeze(self.timeline.arrays().times)

    @property
    def joints(self) -> Floats:
        """(N, n): the joints of all reports."""
        return freeze(self.timeline.arrays().joints * self._scales)

    @property
    def velocity(self) -> Floats:
        """(N, n): the velocities of all reports, NaN where a report had none."""
        return freeze(self.timeline.arrays().velocity * self._scales)

    @property
    def effort(self) -> Floats:
        """(N, n): the efforts of all reports [N m, N], NaN where a report had none."""
        return freeze(self.timeline.arrays().effort.astype(float))

    @property
    def modes(self) -> tuple[str, ...]:
        """Of each report: "follows", "holds" or "stopped"."""
        return tuple([MODES[place].value for place in self.timeline.arrays().modes.tolist()])

    @property
    def _scales(self) -> Floats:
        return self.units.scales(self.model.units, self.model.joint_count)

    def __repr__(self) -> str:
        return repr(self.timeline).replace("MeasuredTimeline", "Measured")
