"""A wall clock for tests: time passes only when a test says so."""

from __future__ import annotations

from collections.abc import Callable

from vrs_cli.engine.clock import WallClock


class ManualWall:
    """A clock that shows `seconds`; sleeping moves it on. `each_look`: by how much it moves whenever it is read."""

    def __init__(self, seconds: float = 1000.0, each_look: Callable[[], float] = lambda: 0.0) -> None:
        self.seconds, self.each_look = seconds, each_look
        self.slept: list[float] = []

    def __call__(self) -> float:
        self.seconds += self.each_look()
        return self.seconds

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.slept.append(seconds)
        self.seconds += seconds

    def clock(self, rate: float = 1.0) -> WallClock:
        return WallClock(self, self.sleep, rate)
