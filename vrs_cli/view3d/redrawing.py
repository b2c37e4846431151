"""When a picture of what may change all the time is made anew: at once where it has to be, else not often."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

LEAST = 0.25  # [s] between two pictures
COSTS = 20.0  # times as long as a picture took to be made, no other one is


class Redrawing:
    """One picture. `wall` tells the time of the day [s]."""

    def __init__(self, wall: Callable[[], float]) -> None:
        self._wall = wall
        self._of: object = None
        self._urgent: object = None
        self._due = -inf

    def look(self, of: object, urgent: object, draw: Callable[[], None]) -> None:
        """Draw it if what it shows is another one: later where that is `of`, at once where it is `urgent`."""
        began = self._wall()
        if urgent == self._urgent and (of == self._of or began < self._due):
            return
        self._of, self._urgent = of, urgent
        draw()
        ended = self._wall()
        self._due = ended + max(LEAST, COSTS * (ended - began))
