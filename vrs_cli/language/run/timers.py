"""The timers of programs, which count seconds of the robot clock."""

from __future__ import annotations

from vrs_cli.errors import IllegalValue
from vrs_cli.language.words.values import integer_between, plain
from vrs_cli.trajectory.instant import LATEST

LAST_TIMER = 15


class Timers:
    """Timers 0 to 15, in seconds of the robot clock; one never set counts from the start of the clock."""

    def __init__(self) -> None:
        self._zero: dict[int, float] = {}

    def set(self, number: float, seconds: float, now: float) -> None:
        """Set a timer to `seconds`. Raises IllegalValue for a timer that does not exist, or a time out of range."""
        if not abs(seconds) <= LATEST:
            raise IllegalValue(f"a timer at {plain(seconds)} s", f"it is from {-LATEST:g} to {LATEST:g} s")
        self._zero[self._known(number)] = now - seconds

    def read(self, number: float, now: float) -> float:
        """Raises IllegalValue for a timer that does not exist."""
        return now - self._zero.get(self._known(number), 0.0)

    def _known(self, number: float) -> int:
        return integer_between(number, 0, LAST_TIMER, "timer")
