"""Playback of a trajectory, and viewers that each sample a robot at their own rate. The functions are pure: the wall
clock is an argument. A `Playback` maps a time of day to the time of the trajectory that is shown. Each `Viewer` has a
playback. The owner of an `Audience` asks when the next sample is due (`peek`), and takes it then (`step`). All samples
of one rate are taken at the same instants, so viewers that show the same time share one evaluation of g."""

from __future__ import annotations

from collections.abc import Callable
from math import floor, inf, isfinite
from typing import NamedTuple

from msgspec import Struct, structs

from vrs_cli.engine.position import Watched, position_at
from vrs_cli.errors import IllegalValue
from vrs_cli.values.results import Position

RATES = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0)  # playback rates that `faster` and `slower` step through
LIVE = 0.1  # [s] maximum delay behind the robot that counts as live


class Playback(Struct, frozen=True):
    """The state of a player of a trajectory, from `start` to `end` [s], at `rate` seconds of trajectory per second. At
    the wall time `since` [s] it showed the time `shown` [s]. `follows`: playback stops at `now`, the robot's time, and
    continues at its own rate when `now` advances, however far `now` jumps. Methods return a new playback, or a value of
    this one."""

    start: float
    end: float
    rate: float = 1.0
    playing: bool = True
    shown: float = 0.0
    since: float = 0.0
    follows: bool = False
    now: float = inf

    @staticmethod
    def of(start: float, end: float, rate: float, wall: float) -> Playback:
        """Return a playback that begins at `start` now."""
        return Playback(start, end, rate, shown=start, since=wall)

    @staticmethod
    def following(start: float, end: float, now: float, wall: float) -> Playback:
        """Return a playback that begins at the robot's time, and follows the robot."""
        return Playback.of(start, end, 1.0, wall).look(wall, start, end, now).follow(wall)

    # --- reading ---

    def at(self, wall: float) -> float:
        """Return the time of the trajectory that is shown [s]."""
        return self._within(self.shown + (self.rate * max(wall - self.since, 0.0) if self.playing else 0.0))

    def is_over(self, wall: float) -> bool:
        return self.at(wall) >= self._last

    def doing(self, wall: float) -> str:
        """Describe the state in a few words: live, playing, paused, ended."""
        if self.follows and self.playing:
            behind = self.behind(wall)
            return "live" if behind < LIVE else f"{behind:.1f} s behind"
        return "ended" if self.is_over(wall) else "playing" if self.playing else "paused"

    def behind(self, wall: float) -> float:
        """Return how far the shown time is behind the robot's time [s], at a given wall time."""
        return max(min(self.now, self.end) - self.at(wall), 0.0)

    @property
    def _last(self) -> float:
        return min(self.now, self.end) if self.follows else self.end

    def _within(self, t: float) -> float:
        return max(min(t, self._last), self.start)

    # --- changing: a new value ---

    def look(self, wall: float, start: float, end: float, now: float) -> Playback:
        """Update the range of the trajectory to `start` ... `end`, and the robot's time to `now` [s]."""
        grown = structs.replace(self, start=start, end=max(end, now), now=now)
        return grown._anchor(grown.at(wall), wall)

    def play(self, wall: float) -> Playback:
        return structs.replace(self._anchor(self.at(wall), wall), playing=True)

    def pause(self, wall: float) -> Playback:
        return structs.replace(self._anchor(self.at(wall), wall), playing=False)

    def toggle(self, wall: float) -> Playback:
        """Play or pause. A playback that has ended starts again."""
        if self.is_over(wall) and not self.follows:
            return self.rewind(wall).play(wall)
        return self.pause(wall) if self.playing else self.play(wall)

    def seek(self, t: float, wall: float) -> Playback:
        """Go to time t, limited to the trajectory. The playback then no longer follows the robot."""
        free = structs.replace(self, follows=False)
        return free._anchor(free._within(t), wall)

    def rewind(self, wall: float) -> Playback:
        return self.seek(self.start, wall)

    def skip(self, seconds: float, wall: float) -> Playback:
        """Go forward by `seconds`; a negative number goes back."""
        return self.seek(self.at(wall) + seconds, wall)

    def follow(self, wall: float) -> Playback:
        """Go to the robot's time, and follow the robot."""
        return structs.replace(self.seek(min(self.now, self.end), wall), follows=True, playing=True)

    def faster(self, wall: float) -> Playback:
        """Play at the next higher rate in RATES."""
        return self.at_rate(min((r for r in RATES if r > self.rate), default=self.rate), wall)

    def slower(self, wall: float) -> Playback:
        """Play at the next lower rate in RATES."""
        return self.at_rate(max((r for r in RATES if r < self.rate), default=self.rate), wall)

    def at_rate(self, rate: float, wall: float) -> Playback:
        """Play at `rate` seconds of trajectory per second from the current time on."""
        return structs.replace(self._anchor(self.at(wall), wall), rate=rate)

    def _anchor(self, t: float, wall: float) -> Playback:
        return structs.replace(self, shown=t, since=max(wall, self.since))


USUAL_RATE, HIGHEST_RATE = 25.0, 1000.0  # allowed sample rates [1/s]


class Viewer:
    """A viewer that samples the robot `rate` times a second, at the time that its `playback` shows. By default the
    playback follows the robot, `ahead` [s] later than the robot's time."""

    def __init__(self, rate: float, ahead: float, playback: Playback) -> None:
        self.rate, self.ahead, self.playback = rate, ahead, playback
        self._last = floor(playback.since * rate)  # number of the last sample taken

    @property
    def due(self) -> float:
        """Return when the next sample is due, by the wall clock [s]."""
        return (self._last + 1) / self.rate

    def look(self, watched: Watched, wall: float) -> None:
        """Take the sample that is due now, skipping missed samples."""
        self._last = max(floor(wall * self.rate), self._last + 1)
        timeline = watched.timeline
        self.playback = self.playback.look(
            self._last / self.rate, timeline.start, timeline.end, watched.now + self.ahead
        )


class ViewerLook(NamedTuple):
    """A sample for a viewer: the position of the robot, at a time of the timeline with this `version`."""

    viewer: Viewer
    version: int
    position: Position


class Audience:
    """The viewers of one robot. `wall` returns the time of day [s]."""

    def __init__(self, watched: Watched, wall: Callable[[], float]) -> None:
        self._watched, self._wall = watched, wall
        self._viewers: list[Viewer] = []

    def join(self, rate: float = USUAL_RATE, ahead: float = 0.0) -> Viewer:
        """Add a viewer that follows the robot. Raises IllegalValue for an invalid rate [1/s]."""
        checked_rate(rate, "looks a second", HIGHEST_RATE)
        wall = floor(self._wall() * rate) / rate  # on the time grid that all viewers of this rate share
        timeline = self._watched.timeline
        playback = Playback.following(timeline.start, timeline.end, self._watched.now + ahead, wall)
        self._viewers.append(Viewer(rate, ahead, playback))
        return self._viewers[-1]

    def leave(self, viewer: Viewer) -> None:
        self._viewers.remove(viewer)

    def peek(self) -> float:
        """Return when the next sample is due, by the wall clock [s]; infinity if there are no viewers."""
        return min((viewer.due for viewer in self._viewers), default=inf)

    def step(self) -> list[ViewerLook]:
        arm, timeline, wall = self._watched.arm, self._watched.timeline, self._wall()
        due = [viewer for viewer in self._viewers if viewer.due <= wall]
        for viewer in due:
            viewer.look(self._watched, wall)
        shared = {t: position_at(arm, timeline, t) for t in {viewer.playback.shown for viewer in due}}
        return [ViewerLook(viewer, timeline.version, shared[viewer.playback.shown]) for viewer in due]


def checked_rate(rate: float, what: str, highest: float) -> float:
    """Return the rate. Raises IllegalValue if it is not positive or is too high."""
    if not (isfinite(rate) and 0.0 < rate <= highest):
        bound = "" if highest == inf else f", at most {highest:g}"
        raise IllegalValue(f"{rate:g} {what}", f"more than 0{bound}", value=rate, lower=0.0, upper=highest)
    return rate
