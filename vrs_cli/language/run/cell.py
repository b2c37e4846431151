"""The cell around a robot, as data: what its signals are called, and how inputs follow outputs after a time. So it has
sensors, feeders, handshakes with a controller, and a camera whose findings stand in a table.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from vrs_cli.language.run.signals import InputChange
from vrs_cli.language.run.variables import Variables
from vrs_cli.values.numbers import Value


class Follow(Struct, frozen=True):
    """When one signal takes a state, `after` seconds later another takes one, and `lasting` seconds after that the
    opposite. Negative numbers stand for off. `rows`: each time the `variables` get the values of the next row;
    after the last, nothing follows, or (`again`) the first comes again.
    """

    when: int
    sets: int | None
    after: float
    lasting: float | None = None
    variables: tuple[str, ...] = ()
    rows: tuple[tuple[Value, ...], ...] = ()
    again: bool = False


class Cell(Struct, frozen=True):
    """`names`: of signals, by number."""

    names: Mapping[int, str] = {}
    follows: tuple[Follow, ...] = ()

    def fill(self, variables: Variables) -> None:
        """Give the variables of its tables, those without a value, the values of the first rows."""
        for follow in self.follows:
            for name, value in zip(follow.variables, *follow.rows[:1], strict=True):
                one = variables.reference(name)
                if not one.defined():
                    one.assign(value)


NO_CELL = Cell()  # in which nothing follows


class LivingCell:
    """A cell while programs run: how many rows of each table were used."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self._used = [0] * len(cell.follows)

    def answers(self, signal: int, on: bool, now: float) -> Iterator[InputChange]:
        """What follows of a signal that has changed."""
        number = signal if on else -signal
        for place, follow in enumerate(self.cell.follows):
            if follow.when == number:
                yield from self._follow(place, follow, now)

    def _follow(self, place: int, follow: Follow, now: float) -> Iterator[InputChange]:
        used, values = self._used[place], dict[str, Value]()
        if follow.rows:
            if used == len(follow.rows) and not follow.again:
                return
            values = dict(zip(follow.variables, follow.rows[used % len(follow.rows)], strict=True))
            self._used[place] = used + 1
        first = now + follow.after
        yield InputChange(first, abs(follow.sets or 0), (follow.sets or 0) > 0, values)
        if follow.sets is not None and follow.lasting is not None:
            yield InputChange(first + follow.lasting, abs(follow.sets), follow.sets < 0)
