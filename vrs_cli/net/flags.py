"""Which of the positions that somebody was shown were wrong, because a command that changes them was not known yet.

A viewer that has the timeline, or a part of it, shows g at the time of its look, or `ahead` of it. A change of the
timeline that is applied at the robot, and arrives a while later, makes wrong what was shown meanwhile of the times
after its cut. Pure: in the robot's times [s].
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable
from operator import attrgetter
from typing import NamedTuple


class FlagWindow(NamedTuple):
    """Times from `begin` on, up to `end` [s]."""

    begin: float
    end: float


class Flags:
    """What was shown of these times was wrong. `ahead`: a viewer shows so much more than the present [s]."""

    def __init__(self, ahead: float = 0.0) -> None:
        self.ahead = ahead
        self.windows: tuple[FlagWindow, ...] = ()  # all of them, in order, and none that touches another

    def arrived(self, cut: float, applied: float, at: float) -> FlagWindow | None:
        """A change of what is after `cut`, `applied` at the robot, is known at a viewer: the times of which something
        wrong was shown, None where nothing was.
        """
        window = FlagWindow(max(cut, applied), at + self.ahead)
        if window.end <= window.begin:
            return None
        self._put(window)
        return window

    def _put(self, window: FlagWindow) -> None:
        """As a rule it comes last: what is behind it is looked at, however many there are."""
        windows, first = self.windows, len(self.windows)
        while first and windows[first - 1].end >= window.begin:
            first -= 1
        self.windows = windows[:first] + merged([*windows[first:], window])

    def forget(self, before: float) -> None:
        """What ended before that time is of no interest any more."""
        gone = bisect_left(self.windows, before, key=attrgetter("end"))
        self.windows = self.windows[gone:] if gone else self.windows


def merged(windows: Iterable[FlagWindow]) -> tuple[FlagWindow, ...]:
    """The same times, in order, in windows that do not touch each other."""
    found: list[FlagWindow] = []
    for window in sorted(windows):
        if found and window.begin <= found[-1].end:
            found[-1] = FlagWindow(found[-1].begin, max(found[-1].end, window.end))
        else:
            found.append(window)
    return tuple(found)
