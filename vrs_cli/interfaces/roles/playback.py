"""Playback of a trajectory, and viewers that sample a robot, each at its own rate. The functions are pure: the wall
clock is an argument. A `Playback` computes which time of the trajectory is shown at a given wall time. Each `Viewer`
has one. The owner of an `Audience` (all viewers of a robot) asks for the time of the next sample (`peek`) and takes the
sample at that time (`step`). All viewers of the same rate are sampled at the same instants, so those that show the same
time share one evaluation of g (position from timeline and time)."""

from __future__ import annotations

from collections.abc import Callable
from math import floor, inf, isfinite
from typing import NamedTuple

from msgspec import Struct, structs

from vrs_cli.engine.position import Watched, position_at
from vrs_cli.errors import IllegalValue
from vrs_cli.values.results import Position

# rates that `faster` and `slower` select: seconds of trajectory per second
RATES = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0)
LIVE = 0.1  # [s] a playback that lags the robot by less than this counts as live


class Playback(Struct, frozen=True):
    """The state of a player of a trajectory from `start` to `end` [s]. `rate`: seconds of trajectory per second;
    `playing`: not paused. At the wall time `since` [s] the time `shown` [s] was displayed. `follows`: playback stops at
    the robot's time `now` [s], and continues at its own rate when `now` advances, even if `now` jumps far. Methods
    return a new playback, or a value computed from this one."""

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
        """Return a playback that begins at time `start` of the trajectory at the wall time `wall` [s]."""
        return Playback(start, end, rate, shown=start, since=wall)

    @staticmethod
    def begin_live(start: float, end: float, now: float, wall: float) -> Playback:
        """Return a playback that begins at the robot's time `now` [s] and follows the robot."""
        return Playback.of(start, end, 1.0, wall).look(wall, start, end, now).follow(wall)

    # --- reading ---

    def at(self, wall: float) -> float:
        """Return the time of the trajectory that is displayed at the wall time `wall` [s]."""
        return self._within(self.shown + (self.rate * max(wall - self.since, 0.0) if self.playing else 0.0))

    def is_over(self, wall: float) -> bool:
        return self.at(wall) >= self._last

    def state_text(self, wall: float) -> str:
        """Describe the state in a few words: live, 2.0 s behind, playing, paused or ended."""
        if self.follows and self.playing:
            behind = self.behind(wall)
            return "live" if behind < LIVE else f"{behind:.1f} s behind"
        return "ended" if self.is_over(wall) else "playing" if self.playing else "paused"

    def behind(self, wall: float) -> float:
        """Return how far the displayed time is behind the robot's time at the wall time `wall` [s]."""
        return max(min(self.now, self.end) - self.at(wall), 0.0)

    @property
    def _last(self) -> float:
        return min(self.now, self.end) if self.follows else self.end

    def _within(self, t: float) -> float:
        return max(min(t, self._last), self.start)

    # --- changing: a new value ---

    def look(self, wall: float, start: float, end: float, now: float) -> Playback:
        """Return a playback for a trajectory that now extends from `start` to `end`, with the robot's time `now`
        [s]."""
        grown = structs.replace(self, start=start, end=max(end, now), now=now)
        return grown._anchor(grown.at(wall), wall)

    def play(self, wall: float) -> Playback:
        return structs.replace(self._anchor(self.at(wall), wall), playing=True)

    def pause(self, wall: float) -> Playback:
        return structs.replace(self._anchor(self.at(wall), wall), playing=False)

    def toggle(self, wall: float) -> Playback:
        """Pause a playback that plays, and play one that is paused. A playback that has ended starts again."""
        if self.is_over(wall) and not self.follows:
            return self.rewind(wall).play(wall)
        return self.pause(wall) if self.playing else self.play(wall)

    def seek(self, t: float, wall: float) -> Playback:
        """Go to time t [s], limited to the trajectory, and stop following the robot."""
        free = structs.replace(self, follows=False)
        return free._anchor(free._within(t), wall)

    def rewind(self, wall: float) -> Playback:
        return self.seek(self.start, wall)

    def skip(self, seconds: float, wall: float) -> Playback:
        """Go forward by `seconds`; go back if the number is negative."""
        return self.seek(self.at(wall) + seconds, wall)

    def follow(self, wall: float) -> Playback:
        """Go to the robot's time, and follow the robot from then on."""
        return structs.replace(self.seek(min(self.now, self.end), wall), follows=True, playing=True)

    def faster(self, wall: float) -> Playback:
        """Continue at the next higher rate in RATES."""
        return self.at_rate(min((r for r in RATES if r > self.rate), default=self.rate), wall)

    def slower(self, wall: float) -> Playback:
        """Continue at the next lower rate in RATES."""
        return self.at_rate(max((r for r in RATES if r < self.rate), default=self.rate), wall)

    def at_rate(self, rate: float, wall: float) -> Playback:
        """Continue at `rate` seconds of trajectory per second."""
        return structs.replace(self._anchor(self.at(wall), wall), rate=rate)

    def _anchor(self, t: float, wall: float) -> Playback:
        return structs.replace(self, shown=t, since=max(wall, self.since))


USUAL_RATE, HIGHEST_RATE = 25.0, 1000.0  # default and maximum sample rate of a viewer [1/s]


class Viewer:
    """A viewer that samples the robot `rate` times a second, at the times that its `playback` displays. At first the
    playback follows the robot, `ahead` seconds later than the robot's time."""

    def __init__(self, rate: float, ahead: float, playback: Playback) -> None:
        self.rate, self.ahead, self.playback = rate, ahead, playback
        self._last = floor(playback.since * rate)  # number of the last sample taken, counted from the wall time 0

    @property
    def due(self) -> float:
        """The wall time of the next sample [s]."""
        return (self._last + 1) / self.rate

    def look(self, watched: Watched, wall: float) -> None:
        """Update the playback to the sample due at the wall time `wall` [s]. Samples that were missed are skipped."""
        self._last = max(floor(wall * self.rate), self._last + 1)
        timeline = watched.timeline
        self.playback = self.playback.look(
            self._last / self.rate, timeline.start, timeline.end, watched.now + self.ahead
        )


class ViewerLook(NamedTuple):
    """A sample for a viewer: the position of the robot at the time that the viewer displays, on the timeline with this
    `version`."""

    viewer: Viewer
    version: int
    position: Position


class Audience:
    """The viewers of one robot. `watched`: the robot; `wall`: returns the wall time [s]."""

    def __init__(self, watched: Watched, wall: Callable[[], float]) -> None:
        self._watched, self._wall = watched, wall
        self._viewers: list[Viewer] = []

    def join(self, rate: float = USUAL_RATE, ahead: float = 0.0) -> Viewer:
        """Add a viewer that follows the robot, `ahead` seconds later than the robot's time. Raises IllegalValue for a
        sample rate [1/s] that is not allowed."""
        checked_rate(rate, "looks a second", HIGHEST_RATE)
        # rounded down, so that all viewers of the same rate are sampled at the same instants
        wall = floor(self._wall() * rate) / rate
        timeline = self._watched.timeline
        playback = Playback.begin_live(timeline.start, timeline.end, self._watched.now + ahead, wall)
        self._viewers.append(Viewer(rate, ahead, playback))
        return self._viewers[-1]

    def leave(self, viewer: Viewer) -> None:
        self._viewers.remove(viewer)

    def peek(self) -> float:
        """Return the wall time of the next sample [s]; infinity if there are no viewers."""
        return min((viewer.due for viewer in self._viewers), default=inf)

    def step(self) -> list[ViewerLook]:
        arm, timeline, wall = self._watched.arm, self._watched.timeline, self._wall()
        due = [viewer for viewer in self._viewers if viewer.due <= wall]
        for viewer in due:
            viewer.look(self._watched, wall)
        shared = {t: position_at(arm, timeline, t) for t in {viewer.playback.shown for viewer in due}}
        return [ViewerLook(viewer, timeline.version, shared[viewer.playback.shown]) for viewer in due]


def checked_rate(rate: float, what: str, highest: float) -> float:
    """Return the rate. Raises IllegalValue if it is not positive, or is above `highest`. `what`: the unit in the
    message."""
    if not (isfinite(rate) and 0.0 < rate <= highest):
        bound = "" if highest == inf else f", at most {highest:g}"
        raise IllegalValue(f"{rate:g} {what}", f"more than 0{bound}", value=rate, lower=0.0, upper=highest)
    return rate
