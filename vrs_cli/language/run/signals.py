"""Read and set digital signals: outputs 1.., inputs 1001.., internal (software) signals 2001... A negative number means
the inverse.

This module also defines the data that drives input signals: changes at known times, and the rules of a cell, by which
inputs change some time after outputs (sensors, feeders, a camera with results in a table).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from math import inf
from typing import TYPE_CHECKING

from msgspec import Struct, structs

from vrs_cli.errors import IllegalSignal
from vrs_cli.language.run.variables import Variables
from vrs_cli.language.words.values import INPUTS, INTERNAL, ON_AND_OFF, OUTPUTS, integer_between, plain
from vrs_cli.trajectory.instant import TICK, on_grid
from vrs_cli.values.commands import HAND, SetChannels, Stamp
from vrs_cli.values.numbers import Value
from vrs_cli.values.world import NO_SCENE, CellScene

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine
    from vrs_cli.trajectory.timeline import Timeline

MAX_BITS = 32
HALF_TICK = 0.5 * TICK  # [s] tolerance between the clock and the time grid of events


class ComputedSignals(Struct, frozen=True):
    """Input signals that the cell's sensors and rules derive from a timeline.

    `numbers`: the numbers of all these signals; `sensed`: the numbers of the signals that only sensors set. `state`
    returns whether a signal is on at a time [s]. `next_change` returns the time of the first change between two times.
    `changes` returns the signals that change at a time, with their new states.
    """

    numbers: frozenset[int]
    sensed: frozenset[int]
    state: Callable[[Timeline, int, float], bool]
    next_change: Callable[[Timeline, float, float], float]
    changes: Callable[[Timeline, float], Mapping[int, bool]]


class Signals:
    """Digital signals: outputs 1.., inputs 1001.., internal (software) signals 2001... A negative number means the
    inverse.

    Outputs and inputs of a robot are on the timeline of its `engine`: reading returns the state at the present time of
    the clock, and setting adds an event. Internal signals are variables, and so are all signals without a robot.

    `listeners` are called with the number and the new state of each signal that changes as time passes, but not for
    changes by UNDO or by another timeline. `names`: the names of signals, by number. `observer` is called with each
    state that `observe` reads. `place`: the operation of the running program that is reading signals, if known.
    """

    def __init__(self) -> None:
        self.names: Mapping[int, str] = {}
        self.listeners: list[Callable[[int, bool], None]] = []
        self.observer: Callable[[int, bool], None] | None = None
        self.engine: Engine | None = None
        self._computed: ComputedSignals | None = None
        self.place: int | None = None
        self._on: set[int] = set()
        self._changed: dict[int, float] = {}
        # `_on` is valid on this timeline, from `_since` until just before `_until` [s]
        self._timeline: Timeline | None = None
        self._book: object = None
        self._since, self._until = 0.0, -inf

    @property
    def cell_inputs(self) -> ComputedSignals | None:
        """Return the inputs that the cell sets."""
        return self._computed

    @cell_inputs.setter
    def cell_inputs(self, computed: ComputedSignals | None) -> None:
        self._computed, self._timeline = computed, None  # None makes `follow_clock` read the states again

    # --- reading ---

    def read(self, number: float) -> bool:
        """Return whether a signal is on. Raises IllegalSignal."""
        signal = self._check_number(number)
        self.follow_clock()
        return (abs(signal) in self._on) is (signal > 0)

    def observe(self, number: float) -> bool:
        """Read a signal for a program. Raises IllegalSignal."""
        state = self.read(number)
        if self.observer is not None:
            signal = round(number)
            self.observer(abs(signal), state is (signal > 0))
        return state

    def changes_now(self, signal: int) -> bool:
        """Return whether a signal of the robot changed exactly at the present time."""
        return self.engine is not None and self._changed.get(signal) == self.engine.now

    def exists(self, number: float) -> bool:
        signal = abs(round(number))
        return signal in OUTPUTS or signal in INPUTS or signal in INTERNAL

    def read_bits(self, first: float, count: float = 1.0) -> int:
        """Read `count` signals for a program as a binary number; `first` is the lowest bit. Raises IllegalSignal,
        IllegalValue."""
        return sum(self.observe(number) << bit for bit, number in enumerate(self._group(first, count)))

    def with_names(self, text: str) -> str:
        """Return a text with the names of the signals whose numbers it contains: `SIG(1003) (1003 is part.there)`."""
        numbers = dict.fromkeys(int(digits) for digits in re.findall(r"\b[0-9]{1,4}\b", text)) if self.names else ()
        named = ", ".join(f"{number} is {self.names[number]}" for number in numbers if number in self.names)
        return f"{text} ({named})" if named else text

    @property
    def on(self) -> tuple[int, ...]:
        """Return the numbers of all signals that are on, sorted."""
        self.follow_clock()
        return tuple(sorted(self._on))

    # --- setting ---

    def write(self, *numbers: float, text: str = "", inputs: bool = False, stamp: Stamp | None = None) -> None:
        """Switch signals on, or off for negative numbers. `inputs`: also allow input signals. `text`: the instruction.
        `stamp`: the present time, for a change from outside that belongs to no command. Raises IllegalSignal,
        FileError."""
        signals = [self._check_number(number) if inputs else self.writable(number) for number in numbers]
        self.follow_clock()
        after, changes = set(self._on), list[int]()
        for signal in signals:
            if (abs(signal) in after) is not (signal > 0):
                after ^= {abs(signal)}
                changes.append(signal)
        dated = _values([signal for signal in changes if abs(signal) not in INTERNAL])
        if self.engine is not None and dated:
            self.engine.perform(SetChannels(dated, stamp, text))
            self._timeline = self.engine.timeline
        computed = None if self.engine is None else self.cell_inputs
        for signal in changes:
            if computed is None or abs(signal) not in computed.numbers:
                self._put(abs(signal), signal > 0)
        if computed is not None and self._timeline is not None:
            self._change_at(self._timeline, self._since)
            self._until = self._next_after(self._timeline, self._since, inf)

    def request(self, numbers: Iterable[float], stamp: Stamp, text: str, *, inputs: bool = False) -> SetChannels:
        """Return the request that makes the robot set signals at a time. Raises IllegalSignal."""
        signals = [self._check_number(number) if inputs else self.writable(number) for number in numbers]
        for signal in signals:
            if abs(signal) in INTERNAL:
                hint = f"internal signals are variables and have no times: SIGNAL {signal} sets it now"
                raise IllegalSignal(str(signal), hint)
        return SetChannels(_values(signals), stamp, text)

    def writable(self, number: float) -> int:
        """Return the number of a signal that a program may set. Raises IllegalSignal for other signals."""
        signal = self._check_number(number)
        if abs(signal) in INPUTS:
            raise IllegalSignal(str(signal), "an input cannot be set by a program")
        return signal

    def reset(self, text: str = "") -> None:
        self.write(*(-number for number in self.on if number in OUTPUTS), text=text)

    def reset_request(self, stamp: Stamp, text: str) -> SetChannels:
        """Return the request that makes the robot switch off, at a time, all outputs that are ever on."""
        numbers = self._on if self.engine is None else self.engine.timeline.channels
        return self.request([-number for number in sorted(numbers) if number in OUTPUTS], stamp, text)

    def write_bits(self, first: float, count: float, value: int, text: str = "") -> None:
        """Set `count` signals to the lowest bits of `value`. Raises IllegalSignal, IllegalValue."""
        group = enumerate(self._group(first, count))
        self.write(*(number if value >> bit & 1 else -number for bit, number in group), text=text)

    # --- the timeline ---

    def follow_clock(self) -> float:
        """Read the states at the present time from the timeline. Return the time of the next event or computed change
        [s], infinity if there is none."""
        engine = self.engine
        if engine is None:
            return inf
        timeline, now = engine.book.timeline, engine.clock.now
        if timeline is self._timeline and self._since - HALF_TICK <= now < self._until - HALF_TICK:
            return self._until
        now = on_grid(now)
        jumped = now < self._since or engine.book is not self._book
        if jumped:
            self._since = now
        if jumped or self.cell_inputs or self._timeline is None or not timeline.same_events(self._timeline):
            inside = {number for number in self._on if number in INTERNAL}
            self._on = inside.union(self.at(self._since))
        self._timeline, self._book, since, self._since = timeline, engine.book, self._since, now
        self._until = self._next_after(timeline, now, inf)
        while since < now and (since := self._next_after(timeline, since, now)) <= now:
            self._change_at(timeline, since)
        return self._until

    def _next_after(self, timeline: Timeline, t: float, until: float) -> float:
        """Return the time of the next event or computed change after `t` [s], infinity if there is none."""
        event = timeline.event_after(t)
        first = inf if event is None else event.time
        return (
            first
            if self.cell_inputs is None
            else min(first, self.cell_inputs.next_change(timeline, t, min(first, until)))
        )

    def _change_at(self, timeline: Timeline, t: float) -> None:
        """Set the signals to their states on the timeline at a time: first signals with events, then computed
        signals."""
        computed = self.cell_inputs
        for event in timeline.events_between(t, t):
            follows = computed is not None and event.channel in computed.numbers
            if event.channel != HAND and not event.observed and not follows:
                self._put(event.channel, event.value > 0.0)
        for number, on in sorted(computed.changes(timeline, t).items()) if computed is not None else ():
            self._put(number, on)

    def keep_states(self) -> None:
        """Keep the present states although the timeline is new, because it differs from the old one only by an
        observation."""
        if self.engine is not None:
            self._timeline = self.engine.timeline

    def at(self, t: float) -> tuple[int, ...]:
        """Return the outputs and inputs that are on at a time [s], sorted."""
        assert self.engine is not None
        numbers = {*self.engine.timeline.channels} - {HAND}
        if self.cell_inputs is not None:
            numbers |= self.cell_inputs.numbers
        return tuple(one for one in sorted(numbers) if self.on_at(one, t))

    def computed_states(self) -> tuple[int, ...]:
        """Return the numbers of the inputs that the cell sets; a number is negative if the input is off."""
        self.follow_clock()
        numbers = () if self.cell_inputs is None else sorted(self.cell_inputs.numbers)
        return tuple(number if number in self._on else -number for number in numbers)

    def on_at(self, signal: int, t: float) -> bool:
        """Return whether an output or an input is on at a time [s]."""
        assert self.engine is not None
        timeline, computed = self.engine.timeline, self.cell_inputs
        if computed is not None and signal in computed.numbers:
            return computed.state(timeline, signal, t)
        return timeline.value_at(signal, t) > 0.0

    def check_not_sensed(self, numbers: Iterable[float]) -> None:
        """Raise IllegalSignal for an input that a sensor of the cell sets."""
        for number in numbers:
            if self.cell_inputs is not None and abs(round(number)) in self.cell_inputs.sensed:
                raise IllegalSignal(plain(number), "a sensor of the cell sets it")

    def _put(self, signal: int, on: bool) -> None:
        """Set the state of a signal, and call the listeners if the state changes."""
        if (signal in self._on) is on:
            return
        self._on ^= {signal}
        if self.engine is not None:
            self._changed[signal] = self.engine.now
        for listener in self.listeners:
            listener(signal, on)

    # --- numbers ---

    def _group(self, first: float, count: float) -> range:
        start = self._check_number(first)
        if start < 0:
            raise IllegalSignal(str(start), "a group of bits begins with a positive signal number")
        size = integer_between(count, 1, MAX_BITS, "a number of bits of")
        self._check_number(start + size - 1)
        return range(start, start + size)

    def _check_number(self, number: float) -> int:
        if round(number) == 0:
            raise IllegalSignal("0 is no number of a signal", ON_AND_OFF)
        if not self.exists(number):
            banks = ", ".join(f"{bank[0]}-{bank[-1]}" for bank in (OUTPUTS, INPUTS, INTERNAL))
            raise IllegalSignal(plain(number), f"signals are {banks}")
        return round(number)


def _values(signals: Iterable[int]) -> tuple[tuple[int, float], ...]:
    """Return the channel number and the value of each signal; a negative signal number switches the signal off."""
    return tuple((abs(signal), float(signal > 0)) for signal in signals)


# --- input signals that change at known times ----------------------------------------------------------------


class InputChange(Struct, frozen=True):
    """A change at `time` [s] of the robot's clock: a signal goes on or off (0 for no signal), and variables get
    `values`."""

    time: float
    signal: int
    on: bool
    values: Mapping[str, Value] = {}


class Inputs(Struct, frozen=True):
    """Future changes of input signals, sorted by time."""

    changes: tuple[InputChange, ...] = ()
    done: int = 0

    @classmethod
    def of(cls, changes: Iterable[InputChange]) -> Inputs:
        """Sort changes by time; changes at the same time keep their order."""
        return cls(tuple(sorted(changes, key=lambda change: change.time)))

    @property
    def next_time(self) -> float:
        """Return the time of the next change [s], infinity if there is none."""
        return self.changes[self.done].time if self.done < len(self.changes) else inf

    @property
    def left(self) -> tuple[InputChange, ...]:
        return self.changes[self.done :]

    def later(self, seconds: float) -> Inputs:
        return Inputs(tuple(structs.replace(change, time=change.time + seconds) for change in self.left))

    def take_until(self, now: float) -> tuple[tuple[InputChange, ...], Inputs]:
        """Return the changes up to `now`, and the remaining ones."""
        done = self.done
        while done < len(self.changes) and self.changes[done].time <= now:
            done += 1
        return self.changes[self.done : done], Inputs(self.changes, done)

    def with_more(self, changes: Iterable[InputChange]) -> Inputs:
        """Add changes. Changes at the same time as known ones come after them."""
        return Inputs.of((*self.left, *changes))


NO_INPUTS = Inputs()


class Follow(Struct, frozen=True):
    """A rule of a cell: when one signal gets a state, another signal gets a state `after` seconds later, and the
    opposite state `lasting` seconds after that.

    Negative signal numbers mean off. `rows`: each time, the `variables` get the values of the next row. After the last
    row the rule does nothing more, or (with `again`) starts again with the first row.
    """

    when: int
    sets: int | None
    after: float
    lasting: float | None = None
    variables: tuple[str, ...] = ()
    rows: tuple[tuple[float | str, ...], ...] = ()
    again: bool = False


class Cell(Struct, frozen=True):
    """The environment of a robot. `names`: the names of signals, by number. `scene`: the bodies and sensors."""

    names: Mapping[int, str] = {}
    follows: tuple[Follow, ...] = ()
    scene: CellScene = NO_SCENE

    def fill(self, variables: Variables) -> None:
        """Assign the first row of each table of the cell to the table's variables that have no value."""
        for follow in self.follows:
            for name, value in zip(follow.variables, *follow.rows[:1], strict=True):
                one = variables.reference(name)
                if not one.has_value():
                    one.assign(value)


NO_CELL = Cell()


class LivingCell:
    """A cell while programs run, with the number of rows used so far in each table."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self._used = [0] * len(cell.follows)

    def answers(self, signal: int, on: bool, now: float) -> Iterator[InputChange]:
        """Yield the changes that the rules of the cell cause after a change of a signal."""
        number = signal if on else -signal
        for place, follow in enumerate(self.cell.follows):
            used, values = self._used[place], dict[str, Value]()
            if follow.when != number or (used and used == len(follow.rows) and not follow.again):
                continue
            if follow.rows:
                values = dict(zip(follow.variables, follow.rows[used % len(follow.rows)], strict=True))
                self._used[place] = used + 1
            first = now + follow.after
            yield InputChange(first, abs(follow.sets or 0), (follow.sets or 0) > 0, values)
            if follow.sets is not None and follow.lasting is not None:
                yield InputChange(first + follow.lasting, abs(follow.sets), follow.sets < 0)
