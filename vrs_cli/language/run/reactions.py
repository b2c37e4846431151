"""What a task does of itself when a signal changes or a step fails: REACT, REACTI, REACTE, IGNORE, LOCK (val2 9.12-13).

A reaction is called when its signal *changes* to the wanted state, between two steps, if its priority is above that of
the program. Until then it waits. While it runs the program has the priority of the reaction; RETURN restores it.
"""

from __future__ import annotations

from vrs_cli.errors import IllegalValue
from vrs_cli.language.run.effects import Effect
from vrs_cli.language.words.values import integer_between

HIGHEST = 127  # of a reaction to a signal, and of LOCK (V+ User's Guide p.46)
OF_ERRORS = 254  # the priority of a REACTE routine (V+ User's Guide p.47)
DEFAULT = 1


class Reaction(Effect, frozen=True):
    """REACT, or REACTI (`immediate`): call `program` when `signal` goes on, or off where it is negative."""

    signal: int
    program: str
    priority: int = DEFAULT
    immediate: bool = False


class Reactions:
    """The reactions of one task, from the start of a cycle to its end."""

    def __init__(self) -> None:
        self.priority = 0
        self.on_error: str | None = None
        self._set: dict[int, Reaction] = {}
        self.waiting: list[Reaction] = []

    def set(self, reaction: Reaction) -> None:
        """Set a reaction from now on, in place of another to the same signal."""
        self.ignore(reaction.signal)
        self._set[abs(reaction.signal)] = reaction

    def ignore(self, signal: int) -> None:
        """End the reaction to a signal, also one that waits."""
        gone = self._set.pop(abs(signal), None)
        if gone in self.waiting:
            self.waiting.remove(gone)

    def changed(self, signal: int, on: bool) -> None:
        """A signal has changed to a state. A reaction that waits already is not called twice."""
        reaction = self._set.get(signal)
        if reaction is not None and (reaction.signal > 0) is on and reaction not in self.waiting:
            self.waiting.append(reaction)

    @property
    def due(self) -> Reaction | None:
        """The reaction to call next: that of the highest priority; of equal ones the first whose signal changed."""
        if not self.waiting:
            return None
        first = max(self.waiting, key=lambda reaction: reaction.priority)
        return first if first.priority > self.priority else None


def checked_priority(priority: float, lowest: int) -> int:
    """A priority of REACT (from 1) or LOCK (from 0). Raises IllegalValue."""
    return integer_between(priority, lowest, HIGHEST, "a priority of")


def checked_signal(number: float) -> int:
    """The signal of a reaction. Raises IllegalValue for 0."""
    if not round(number):
        raise IllegalValue("signal 0", "a signal number; negative: when it goes off")
    return round(number)
