"""A robot afar as a predictive viewer sees it: as it will be, with the commands that are on their way. Pure."""

from __future__ import annotations

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.net.far_end import FarEnd
from vrs_cli.trajectory.timeline import Timeline


class Predicted:
    """Looked at as the robot itself is; its present is what `far` shows."""

    def __init__(self, far: FarEnd) -> None:
        self._far = far

    @property
    def arm(self) -> RobotArm:
        assert self._far.mirror is not None, "it is followed"
        return self._far.mirror.arm

    @property
    def timeline(self) -> Timeline:
        assert self._far.preview is not None, "it comes with the mirror"
        return self._far.preview.timeline

    @property
    def now(self) -> float:
        return self._far.shown
