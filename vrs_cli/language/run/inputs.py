"""Input signals that change at times that are known before: the world outside, written down. Data, nothing runs."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf

from msgspec import Struct

from vrs_cli.language.run.signals import Signals


class InputChange(Struct, frozen=True):
    """At `time` [s] of the robot's clock a signal goes on or off."""

    time: float
    signal: int
    on: bool


class Inputs(Struct, frozen=True):
    """Changes to come, the earliest first."""

    changes: tuple[InputChange, ...] = ()
    done: int = 0

    @classmethod
    def of(cls, changes: Iterable[InputChange]) -> Inputs:
        """In the order of their times; of equal times in the order given."""
        return cls(tuple(sorted(changes, key=lambda change: change.time)))

    @property
    def next_time(self) -> float:
        """The time of the next change [s]; infinity if there is none."""
        return self.changes[self.done].time if self.done < len(self.changes) else inf

    def applied(self, now: float, signals: Signals) -> Inputs:
        """Make all changes up to `now`. Return those that are left."""
        done = self.done
        while done < len(self.changes) and self.changes[done].time <= now:
            change = self.changes[done]
            signals.write(change.signal if change.on else -change.signal, inputs=True)
            done += 1
        return Inputs(self.changes, done)


NO_INPUTS = Inputs()
