"""Viewers: observers that look at their own rate, each with a playback of its own. Pure: the wall clock is an argument.

Whoever drives them asks when the next look is due (`peek`), and has it then (`step`). The instants of looks lie on one
grid for each rate: viewers of one rate that show the same time share one evaluation of g.
"""

from __future__ import annotations

from collections.abc import Callable
from math import floor, inf, isfinite
from typing import NamedTuple

from vrs_cli.engine.position import position_at
from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.roles.observer import Watched
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.values.results import Position

USUAL_RATE, HIGHEST_RATE = 25.0, 1000.0  # looks a second


class Viewer:
    """Looks `rate` times a second at what its `playback` shows, which follows the robot until another is put in its
    place: at what is now, or at what will be `ahead` [s] later.
    """

    def __init__(self, rate: float, ahead: float, playback: Playback) -> None:
        self.rate, self.ahead, self.playback = rate, ahead, playback
        self._last = floor(playback.since * rate)  # the number of the last look

    @property
    def due(self) -> float:
        """When its next look is due, on the wall [s]."""
        return (self._last + 1) / self.rate

    def look(self, watched: Watched, wall: float) -> None:
        """The look that is due now; those that were missed are left out."""
        self._last = max(floor(wall * self.rate), self._last + 1)
        timeline = watched.timeline
        now = watched.now + self.ahead
        self.playback = self.playback.look(self._last / self.rate, timeline.start, timeline.end, now)


class ViewerLook(NamedTuple):
    """What a viewer sees: the robot, at a time of timeline `version`."""

    viewer: Viewer
    version: int
    position: Position


class Audience:
    """The viewers of one robot; `wall` tells the time of the day [s]."""

    def __init__(self, watched: Watched, wall: Callable[[], float]) -> None:
        self._watched, self._wall = watched, wall
        self._viewers: list[Viewer] = []

    def join(self, rate: float = USUAL_RATE, ahead: float = 0.0) -> Viewer:
        """One more viewer, which follows the robot. Raises IllegalValue for a rate [1/s] that is none."""
        checked_rate(rate, "looks a second", HIGHEST_RATE)
        wall = floor(self._wall() * rate) / rate  # on the grid, as those of its rate that are here
        timeline = self._watched.timeline
        playback = Playback.following(timeline.start, timeline.end, self._watched.now + ahead, wall)
        self._viewers.append(Viewer(rate, ahead, playback))
        return self._viewers[-1]

    def leave(self, viewer: Viewer) -> None:
        self._viewers.remove(viewer)

    def peek(self) -> float:
        """When the next look is due, on the wall [s]; infinity where nobody looks."""
        return min((viewer.due for viewer in self._viewers), default=inf)

    def step(self) -> list[ViewerLook]:
        """All looks that are due."""
        arm, timeline, wall = self._watched.arm, self._watched.timeline, self._wall()
        shared, looks = dict[float, Position](), list[ViewerLook]()
        for viewer in self._viewers:
            if viewer.due <= wall:
                viewer.look(self._watched, wall)
                t = viewer.playback.shown
                if t not in shared:
                    shared[t] = position_at(arm, timeline, t)
                looks.append(ViewerLook(viewer, timeline.version, shared[t]))
        return looks


def checked_rate(rate: float, what: str, highest: float) -> float:
    """The rate itself. Raises IllegalValue for one that is none."""
    if not (isfinite(rate) and 0.0 < rate <= highest):
        bound = "" if highest == inf else f", at most {highest:g}"
        raise IllegalValue(f"{rate:g} {what}", f"more than 0{bound}", value=rate, lower=0.0, upper=highest)
    return rate
