"""A robot afar as a predictive viewer sees it: as it will be, with the commands that are on their way; and what is to
be said of that: flags, and what is not confirmed. Pure.
"""

from __future__ import annotations

from collections.abc import Iterator

from vrs_cli.dialogue.numbers import seconds
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.net.far_end import Ahead, FarEnd
from vrs_cli.trajectory.timeline import Timeline

FRESH = 3.0  # [s] that a flag is told of after the times that it is about


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

    def lines(self, t: float) -> Iterator[str]:
        """What is to be said of time t [s]."""
        far = self._far
        if far.ahead is not Ahead.PRESENT and far.mirror is not None and far.mirror.clock.rate is not None:
            yield f"{seconds(far.shown - far.heard)} ahead of what is heard, D_f + D_b is {seconds(far.round_trip)}"
        flagged = far.flags.at(t, FRESH)
        if flagged is not None:
            yield f"flagged: {flagged.begin:.3f} to {seconds(flagged.end)} was shown before a command changed it"
        if t >= far.unconfirmed:
            yield f"unconfirmed from {seconds(far.unconfirmed)} on: {self._under_way()}"

    def _under_way(self) -> str:
        """What has made it so."""
        if not self._far.open:
            return "the robot is not heard"
        assert self._far.preview is not None, "what is under way is previewed"
        return ", ".join(it.text or "a command" for it in self._far.preview.expected)
