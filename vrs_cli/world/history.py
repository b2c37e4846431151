"""A state that is computed forward in time and can be taken back to any time before."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Hashable
from math import inf
from typing import Any, NamedTuple


class Due(NamedTuple):
    """Something that happens at a time; of one instant, in the order in which it was planned. `carried`: it follows
    from how the arm moves then.
    """

    time: float
    order: int
    what: str
    data: tuple[Any, ...]
    carried: bool = False


class WorldHistory:
    """Values by key, what is due, and lists that only grow: `changes`, `moves`, `notes`, `grips`, each of tuples that
    begin with their time. What was set is taken back by `back_to`.
    """

    def __init__(self) -> None:
        self.now = -inf
        self._values: dict[Hashable, Any] = {}
        self._trail: list[tuple[float, Hashable, Any]] = []
        self.changes: list[tuple[float, int, bool]] = []
        self.moves: list[tuple[float, str]] = []
        self.notes: list[tuple[float, str, str]] = []
        self.grips: list[tuple[float, str | None]] = []

    def copy(self) -> WorldHistory:
        again = WorldHistory()
        again.now = self.now
        again._values, again._trail = dict(self._values), list(self._trail)
        again.changes, again.moves = list(self.changes), list(self.moves)
        again.notes, again.grips = list(self.notes), list(self.grips)
        return again

    def get(self, key: Hashable, default: Any = None) -> Any:
        return self._values.get(key, default)

    def set(self, key: Hashable, value: Any) -> None:
        self._trail.append((self.now, key, self._values.get(key, _MISSING)))
        self._values[key] = value

    def back_to(self, t: float) -> None:
        """Take back all that happened at t [s] and later."""
        while self._trail and self._trail[-1][0] >= t:
            _, key, before = self._trail.pop()
            if before is _MISSING:
                del self._values[key]
            else:
                self._values[key] = before
        for rows in (self.changes, self.moves, self.notes, self.grips):
            del rows[bisect_left(rows, (t,)) :]
        self.now = min(self.now, t)

    # --- what is due ---

    @property
    def due(self) -> tuple[Due, ...]:
        """All that is due, the first first."""
        found: tuple[Due, ...] = self._values.get("due", ())
        return found

    def plan(self, t: float, what: str, *data: Any, carried: bool = False) -> None:
        order = self._values.get("order", 0)
        self.set("order", order + 1)
        one, due = Due(t, order, what, data, carried), self.due
        place = bisect_left(due, one)
        self.set("due", (*due[:place], one, *due[place:]))

    def take(self) -> Due:
        """The first that is due, which is so no longer."""
        first, *later = self.due
        self.set("due", tuple(later))
        return first

    def drop(self, *, carried: bool = False, what: str = "", body: str | None = None) -> None:
        """Let no longer be due what follows from the arm's motion (`carried`), or what is called so, of one body."""
        self.set(
            "due",
            tuple(
                one
                for one in self.due
                if not (one.carried if carried else one.what == what and (body is None or one.data[0] == body))
            ),
        )


_MISSING = object()
