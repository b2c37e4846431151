"""Viewers: observers that look at their own rate, each with a playback of its own. Pure: the wall clock is an argument.

Whoever drives them asks when the next look is due (`peek`), and has it then (`step`). The instants of looks lie on one
grid for each rate: viewers of one rate that show the same time share one evaluation of g.
"""

from __future__ import annotations

from collections.abc import Callable
from math import floor, inf, isfinite
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.engine.position import Position, position_at
from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.roles.observer import Watched
from vrs_cli.interfaces.roles.playback import Playback

USUAL_RATE, HIGHEST_RATE = 25.0, 1000.0  # looks a second


class Frame(Struct, frozen=True):
    """One look: the robot at a time of timeline `version`, and how far that lies behind its present [s]."""

    version: int
    position: Position
    behind: float


class Viewer:
    """Looks `rate` times a second, and follows the robot until it is told to do something else: it sees what is now, or
    what will be `ahead` [s] later.
    """

    def __init__(self, rate: float, ahead: float, playback: Playback, wall: Callable[[], float]) -> None:
        self.rate, self.ahead, self.playback, self._wall = rate, ahead, playback, wall
        self._last = floor(playback.since * rate)  # the number of the last look

    @property
    def due(self) -> float:
        """When its next look is due, on the wall [s]."""
        return (self._last + 1) / self.rate

    def look(self, watched: Watched) -> None:
        """The look that is due now; those that were missed are left out."""
        self._last = max(floor(self._wall() * self.rate), self._last + 1)
        timeline = watched.timeline
        now = watched.now + self.ahead
        self.playback = self.playback.look(self._last / self.rate, timeline.start, timeline.end, now)

    def play(self) -> None:
        self.playback = self.playback.play(self._wall())

    def pause(self) -> None:
        self.playback = self.playback.pause(self._wall())

    def rewind(self) -> None:
        """Go to the start of the timeline."""
        self.playback = self.playback.rewind(self._wall())

    def seek(self, t: float) -> None:
        """Go to a time [s], also one that is still to come, as far as there is a timeline."""
        self.playback = self.playback.seek(t, self._wall())

    def follow(self) -> None:
        """Go to where the robot is, and on with it."""
        self.playback = self.playback.follow(self._wall())

    def play_at(self, rate: float) -> None:
        """So many seconds of the timeline in one second. Raises IllegalValue for a rate that is none."""
        self.playback = self.playback.at_rate(checked_rate(rate, "times as fast", inf), self._wall())


class Look(NamedTuple):
    viewer: Viewer
    frame: Frame


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
        self._viewers.append(Viewer(rate, ahead, playback, self._wall))
        return self._viewers[-1]

    def leave(self, viewer: Viewer) -> None:
        self._viewers.remove(viewer)

    def peek(self) -> float:
        """When the next look is due, on the wall [s]; infinity where nobody looks."""
        return min((viewer.due for viewer in self._viewers), default=inf)

    def step(self) -> list[Look]:
        """All looks that are due."""
        arm, timeline, wall = self._watched.arm, self._watched.timeline, self._wall()
        shared, looks = dict[float, Position](), list[Look]()
        for viewer in self._viewers:
            if viewer.due <= wall:
                viewer.look(self._watched)
                playback = viewer.playback
                t = playback.shown
                if t not in shared:
                    shared[t] = position_at(arm, timeline, t)
                looks.append(Look(viewer, Frame(timeline.version, shared[t], playback.behind(playback.since))))
        return looks


def checked_rate(rate: float, what: str, highest: float) -> float:
    """The rate itself. Raises IllegalValue for one that is none."""
    if not (isfinite(rate) and 0.0 < rate <= highest):
        bound = "" if highest == inf else f", at most {highest:g}"
        raise IllegalValue(f"{rate:g} {what}", f"more than 0{bound}", value=rate, lower=0.0, upper=highest)
    return rate
