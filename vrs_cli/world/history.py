"""A state that is computed forward in time and can be taken back to any time before."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Hashable, Sequence
from math import inf
from typing import Any, NamedTuple

from vrs_cli.values.world import Happening

CHANGES, GRIPS, MOVES, NOTES, SEES = "changes", "grips", "moves", "notes", "sees"  # keys of rows


class Due(NamedTuple):
    """Something that happens at a time; of one instant by rank, of one rank in the order in which it was planned."""

    time: float
    rank: int
    order: int
    what: Happening


class WorldHistory:
    """Values by key, what is due, and rows by key that only grow, of tuples that begin with their time. `back_to` takes
    back what was set and added.
    """

    def __init__(self) -> None:
        self.now = -inf
        self._values: dict[Hashable, Any] = {}
        self._trail: list[tuple[float, Hashable, Any]] = []
        self._rows: dict[Hashable, list[Any]] = {}

    def copy(self) -> WorldHistory:
        again = WorldHistory()
        again.now = self.now
        again._values, again._trail = dict(self._values), list(self._trail)
        again._rows = {key: list(rows) for key, rows in self._rows.items()}
        return again

    def get(self, key: Hashable, default: Any = None) -> Any:
        return self._values.get(key, default)

    def items(self, kind: str) -> dict[Any, Any]:
        """Return the values whose keys are pairs of a kind and something else, by that."""
        return {key[1]: value for key, value in self._values.items() if isinstance(key, tuple) and key[0] == kind}

    def set(self, key: Hashable, value: Any) -> None:
        self._trail.append((self.now, key, self._values.get(key, _MISSING)))
        self._values[key] = value

    def rows(self, key: Hashable) -> Sequence[Any]:
        return self._rows.get(key, ())

    def add(self, key: Hashable, row: tuple[Any, ...]) -> None:
        """Add a row that begins with the present time."""
        self._rows.setdefault(key, []).append(row)

    def back_to(self, t: float) -> None:
        """Take back all that happened at t [s] and later."""
        while self._trail and self._trail[-1][0] >= t:
            _, key, before = self._trail.pop()
            if before is _MISSING:
                del self._values[key]
            else:
                self._values[key] = before
        for rows in self._rows.values():
            del rows[bisect_left(rows, (t,)) :]
        self.now = min(self.now, t)

    # --- what is due ---

    @property
    def due(self) -> tuple[Due, ...]:
        """All that is due, the first first."""
        found: tuple[Due, ...] = self._values.get("due", ())
        return found

    def plan(self, t: float, what: Happening) -> None:
        order = self._values.get("order", 0)
        self.set("order", order + 1)
        one, due = Due(t, what.rank, order, what), self.due
        place = bisect_left(due, one)
        self.set("due", (*due[:place], one, *due[place:]))

    def take(self) -> Due:
        """The first that is due, which is so no longer."""
        first, *later = self.due
        self.set("due", tuple(later))
        return first

    def drop(self, is_dropped: Callable[[Happening], bool]) -> None:
        """Let some of what is due not happen."""
        left = tuple(one for one in self.due if not is_dropped(one.what))
        if len(left) < len(self.due):
            self.set("due", left)


_MISSING = object()
