"""Dated events of the timeline: a channel (the hand, a signal) takes a value at a time, or a program observed one."""

from __future__ import annotations

from typing import NamedTuple

HAND = 0  # the channel of the hand; those of outputs are 1 to 512
FIRST_INPUT = 1001  # the channels of inputs are 1001 to 1512


class Event(NamedTuple):
    """A channel takes a value.

    `time` [s]: on the time grid. `channel`: HAND (its value is from 0, closed, to 1, open), or the number of a signal
    (0 or 1). `number`: of the command that caused the event, as `Motion.number`. `tied`: after an edit the event
    follows its motion; otherwise it keeps its own time. `duration` [s]: how long the fingers take; they arrive at
    `time + duration`. `observed`: nothing changes; a program read this value at that time.
    """

    time: float
    channel: int
    value: float
    number: int = 0
    tied: bool = False
    duration: float = 0.0
    observed: bool = False

    def shift_by(self, shift: float) -> Event:
        """Return the event so many seconds later."""
        return self._replace(time=self.time + shift) if shift else self


class EventEdit(NamedTuple):
    """The events' part of a timeline delta.

    The first `keep` events stay and the next `drop` go. `events` come in their place. All events after them are
    shifted by `shift` [s].
    """

    keep: int
    drop: int = 0
    shift: float = 0.0
    events: tuple[Event, ...] = ()

    @property
    def adds(self) -> bool:
        """Return whether all events of before stay as they are."""
        return not self.drop and not self.shift
