"""Digital signals: outputs 1.., inputs 1001.., internal (software) 2001... A negative number is the inverse.

Also what drives input signals: changes at times that are known before, and the cell, in which inputs follow outputs
after a time (sensors, feeders, a camera whose findings stand in a table). Data: nothing runs here.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from math import inf

from msgspec import Struct, structs

from vrs_cli.errors import IllegalSignal
from vrs_cli.language.run.variables import Variables
from vrs_cli.language.words.values import INPUTS, INTERNAL, OUTPUTS, integer_between, plain
from vrs_cli.values.numbers import Value
from vrs_cli.values.scene import NO_SCENE, CellScene

MOST_BITS = 32


class Signals:
    """Digital signals: outputs 1.., inputs 1001.., internal (software) 2001... A negative number is the inverse.

    `listeners` are told the number and the new state of each signal that changes. `names`: of signals, by number.
    """

    def __init__(self) -> None:
        self.names: Mapping[int, str] = {}
        self._on: set[int] = set()
        self.listeners: list[Callable[[int, bool], None]] = []

    def read(self, number: float) -> bool:
        """Raises IllegalSignal."""
        signal = self._known(number)
        return (abs(signal) in self._on) is (signal > 0)

    def write(self, number: float, *, inputs: bool = False) -> None:
        """Switch a signal on, or off for a negative number. `inputs`: also those that only the world outside drives.

        Raises IllegalSignal.
        """
        signal = self._known(number) if inputs else self.writable(number)
        if self.read(signal):
            return
        self._on.symmetric_difference_update({abs(signal)})
        for listener in self.listeners:
            listener(abs(signal), signal > 0)

    def writable(self, number: float) -> int:
        """A signal that a program may set. Raises IllegalSignal."""
        signal = self._known(number)
        if abs(signal) in INPUTS:
            raise IllegalSignal(str(signal), "an input cannot be set by a program")
        return signal

    def reset(self) -> None:
        """Switch all outputs off."""
        for number in sorted(self._on.intersection(OUTPUTS)):
            self.write(-number)

    def exists(self, number: float) -> bool:
        signal = abs(round(number))
        return any(signal in bank for bank in (OUTPUTS, INPUTS, INTERNAL))

    def read_bits(self, first: float, count: float = 1.0) -> int:
        """`count` signals as a binary number, `first` the lowest bit. Raises IllegalSignal, IllegalValue."""
        return sum(self.read(number) << bit for bit, number in enumerate(self._group(first, count)))

    def write_bits(self, first: float, count: float, value: int) -> None:
        """The lowest `count` bits of `value`. Raises IllegalSignal, IllegalValue."""
        for bit, number in enumerate(self._group(first, count)):
            self.write(number if value >> bit & 1 else -number)

    def said(self, text: str) -> str:
        """A text, with the names of the signals whose numbers are in it: `SIG(1003) (1003 is part.there)`."""
        numbers = dict.fromkeys(int(digits) for digits in re.findall(r"\b[0-9]{1,4}\b", text)) if self.names else ()
        named = ", ".join(f"{number} is {self.names[number]}" for number in numbers if number in self.names)
        return f"{text} ({named})" if named else text

    @property
    def on(self) -> tuple[int, ...]:
        """The numbers of those that are on, in order."""
        return tuple(sorted(self._on))

    def state(self, bank: range) -> tuple[bool, ...]:
        """Every signal of a bank (OUTPUTS, INPUTS, INTERNAL) in order."""
        return tuple(number in self._on for number in bank)

    def _group(self, first: float, count: float) -> range:
        start = self._known(first)
        if start < 0:
            raise IllegalSignal(str(start), "a group of bits begins with a positive signal number")
        size = integer_between(count, 1, MOST_BITS, "a number of bits of")
        self._known(start + size - 1)
        return range(start, start + size)

    def _known(self, number: float) -> int:
        if not self.exists(number):
            banks = ", ".join(f"{bank[0]}-{bank[-1]}" for bank in (OUTPUTS, INPUTS, INTERNAL))
            raise IllegalSignal(plain(number), f"signals are {banks}")
        return round(number)


# --- input signals that change at times that are known before ------------------------------------------------


class InputChange(Struct, frozen=True):
    """At `time` [s] of the robot's clock a signal goes on or off (0: none does), and variables get `values`."""

    time: float
    signal: int
    on: bool
    values: Mapping[str, Value] = {}


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

    @property
    def left(self) -> tuple[InputChange, ...]:
        """The changes that are still to come."""
        return self.changes[self.done :]

    def later(self, seconds: float) -> Inputs:
        """Return the same changes, so many seconds later."""
        return Inputs(tuple(structs.replace(change, time=change.time + seconds) for change in self.left))

    def taken(self, now: float) -> tuple[tuple[InputChange, ...], Inputs]:
        """The changes up to `now`, and those that are left."""
        done = self.done
        while done < len(self.changes) and self.changes[done].time <= now:
            done += 1
        return self.changes[self.done : done], Inputs(self.changes, done)

    def with_more(self, changes: Iterable[InputChange]) -> Inputs:
        """With others that come; of equal times those that were known before come first."""
        return Inputs.of((*self.left, *changes))


NO_INPUTS = Inputs()


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
    """`names`: of signals, by number. `scene`: what is around the robot."""

    names: Mapping[int, str] = {}
    follows: tuple[Follow, ...] = ()
    scene: CellScene = NO_SCENE

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
