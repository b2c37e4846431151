"""The wishes of one who drags a tool from afar, from their sending until the robot tells that they count. Pure: times
are those of the robot's clock [s].
"""

from __future__ import annotations

from collections import deque
from threading import Lock

from vrs_cli.kinematics.transform import Transform

PASSED_OVER = 1.0  # [s] and a round trip, after which nothing is told of a wish any more


class Wishes:
    """A wish that is said again is none: the robot is after it already. Any thread may call any method."""

    def __init__(self) -> None:
        self._last: Transform | None = None
        self._under_way: deque[float] = deque()  # when they were issued
        self._lock = Lock()

    def sent(self, pose: Transform | None, issued: float) -> None:
        """The tool is wished there, or let go, which changes nothing that the robot does."""
        with self._lock:
            if pose is not None and pose != self._last:
                self._under_way.append(issued)
            self._last = pose

    def counted(self, issued: float) -> None:
        """The robot goes after what was wished then, or does not any more."""
        with self._lock:
            self._forget(issued)

    def _forget(self, issued: float) -> None:
        while self._under_way and self._under_way[0] <= issued:
            self._under_way.popleft()

    def oldest(self, now: float, round_trip: float) -> float | None:
        """When the first of them was issued that the robot has not told of; None where there is none."""
        with self._lock:
            self._forget(now - round_trip - PASSED_OVER)
            return self._under_way[0] if self._under_way else None
