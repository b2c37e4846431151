"""What stands around a prompt, as a robot far away told it last. The time of the day is an argument."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from msgspec.structs import replace

from vrs_cli.values.prompt import PromptStatus


class LastStatus:
    """The last status, and the robot's clock since. A clock that was shown does not go back while time passes."""

    def __init__(self, wall: Callable[[], float]) -> None:
        self._wall = wall
        self._status, self._told_at = PromptStatus(), 0.0
        self._floor = -inf  # [s] of the clock that was shown

    def see(self, status: PromptStatus) -> None:
        """A status was told. It was some time on its way: it tells of the clock only that it is not earlier."""
        now, before = self._wall(), self._status
        goes_on = before.pace is not None and status.pace is not None and not (before.pace.paused or status.pace.paused)
        self._floor = self.now().clock if goes_on else -inf
        if goes_on and status.pace == before.pace:
            status = replace(status, clock=max(status.clock, self._extrapolated(now)))
        self._status, self._told_at = status, now

    def forget_pace(self) -> None:
        """The robot may be another one, with a clock of its own."""
        self._status = replace(self._status, pace=None)

    def now(self) -> PromptStatus:
        """The status with the clock as it is now."""
        return replace(self._status, clock=max(self._floor, self._extrapolated(self._wall())))

    def _extrapolated(self, now: float) -> float:
        pace, clock = self._status.pace, self._status.clock
        return clock if pace is None or pace.paused else clock + pace.rate * (now - self._told_at)
