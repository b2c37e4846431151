"""Read and set digital signals: outputs from 1, inputs from 1001, internal (software) signals from 2001. A negative
number means the inverse: to test that the signal is off, or to turn it off.

This module also defines the data from which input signals change: changes at given times, and the rules of a cell (the
robot's surroundings), by which inputs change some time after other signals, to imitate sensors, feeders, or a camera
with results in a table.
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
from vrs_cli.values.scene import NO_SCENE, CellScene

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine
    from vrs_cli.trajectory.timeline import Timeline

MAX_BITS = 32  # maximum number of signals that BITS reads or sets at once
HALF_TICK = 0.5 * TICK  # [s] tolerance for comparing the clock with the times of events, which are rounded to ticks


class ComputedSignals(Struct, frozen=True):
    """Input signals that are computed from a timeline by the sensors and rules of the cell (the robot's surroundings).

    `numbers`: the numbers of all these signals; `sensed`: the numbers of those that only sensors set.
    `state(timeline, signal, t)`: whether a signal is on at time t [s]. `next_change(timeline, t, until)`: the time of
    the first change between two times [s]. `changes(timeline, t)`: the signals that change at time t, with their new
    states.
    """

    numbers: frozenset[int]
    sensed: frozenset[int]
    state: Callable[[Timeline, int, float], bool]
    next_change: Callable[[Timeline, float, float], float]
    changes: Callable[[Timeline, float], Mapping[int, bool]]


class Signals:
    """The digital signals of a robot: outputs from 1, inputs from 1001, internal (software) signals from 2001. In
    arguments a negative number means the inverse.

    If there is an `engine`, outputs and inputs are on its timeline: reading returns the state at the current time of
    the clock, and setting adds an event. Internal signals, and without an engine all signals, only have a current
    state.

    `listeners`: functions called with the number and the new state of each signal that changes as time passes, but not
    for differences after UNDO or on another timeline. `names`: the names of signals, by number. `observer`: a function
    called with the number and the state of each signal that `observe` reads. `place`: the number of the operation that
    is reading signals, if known.
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
        # the signals in `_on` are on in this timeline, for times from `_since` until just before `_until` [s]
        self._timeline: Timeline | None = None
        self._book: object = None
        self._since, self._until = 0.0, -inf

    @property
    def cell_inputs(self) -> ComputedSignals | None:
        """Return the inputs that sensors and rules of the cell set, or None if there are none."""
        return self._computed

    @cell_inputs.setter
    def cell_inputs(self, computed: ComputedSignals | None) -> None:
        self._computed, self._timeline = computed, None  # None makes `follow_clock` compute all states again

    # --- reading ---

    def read(self, number: float) -> bool:
        """Return whether a signal is on (for a negative number: off). Raises IllegalSignal."""
        signal = self._check_number(number)
        self.follow_clock()
        return (abs(signal) in self._on) is (signal > 0)

    def observe(self, number: float) -> bool:
        """Return whether a signal is on, like `read`, for a program, and report this to the observer. Raises
        IllegalSignal."""
        state = self.read(number)
        if self.observer is not None:
            signal = round(number)
            self.observer(abs(signal), state is (signal > 0))
        return state

    def changes_now(self, signal: int) -> bool:
        """Return whether a signal of the robot last changed exactly at the current time of the clock."""
        return self.engine is not None and self._changed.get(signal) == self.engine.now

    def exists(self, number: float) -> bool:
        signal = abs(round(number))
        return signal in OUTPUTS or signal in INPUTS or signal in INTERNAL

    def read_bits(self, first: float, count: float = 1.0) -> int:
        """Return the states of `count` consecutive signals as a binary number, for a program. `first`: the number of
        the signal for the lowest bit. Raises IllegalSignal, IllegalValue."""
        return sum(self.observe(number) << bit for bit, number in enumerate(self._group(first, count)))

    def with_names(self, text: str) -> str:
        """Return a string, followed by the names of the signals whose numbers it contains: `SIG(1003) (1003 is
        part.there)`."""
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
        """Turn signals on, or off for negative numbers. `text`: the text of the instruction; `inputs`: also allow
        input signals; `stamp`: the current time, for a change from outside, which is not part of a command. Raises
        IllegalSignal, FileError."""
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
        """Return the request to the robot that sets signals at the time `stamp`. `text`: the text of the instruction;
        `inputs`: also allow input signals. Raises IllegalSignal."""
        signals = [self._check_number(number) if inputs else self.writable(number) for number in numbers]
        for signal in signals:
            if abs(signal) in INTERNAL:
                hint = f"internal signals are variables and have no times: SIGNAL {signal} sets it now"
                raise IllegalSignal(str(signal), hint)
        return SetChannels(_values(signals), stamp, text)

    def writable(self, number: float) -> int:
        """Return the number of a signal that a program may set, as an integer. Raises IllegalSignal for inputs and
        unknown signals."""
        signal = self._check_number(number)
        if abs(signal) in INPUTS:
            raise IllegalSignal(str(signal), "an input cannot be set by a program")
        return signal

    def reset(self, text: str = "") -> None:
        self.write(*(-number for number in self.on if number in OUTPUTS), text=text)

    def reset_request(self, stamp: Stamp, text: str) -> SetChannels:
        """Return the request to the robot that turns off, at the time `stamp`, all outputs that the timeline contains.
        `text`: the text of the instruction."""
        numbers = self._on if self.engine is None else self.engine.timeline.channels
        return self.request([-number for number in sorted(numbers) if number in OUTPUTS], stamp, text)

    def write_bits(self, first: float, count: float, value: int, text: str = "") -> None:
        """Set `count` consecutive signals to the lowest bits of `value`. `first`: the number of the signal for the
        lowest bit; `text`: the text of the instruction. Raises IllegalSignal, IllegalValue."""
        group = enumerate(self._group(first, count))
        self.write(*(number if value >> bit & 1 else -number for bit, number in group), text=text)

    # --- the timeline ---

    def follow_clock(self) -> float:
        """Update the states to the current time of the clock. Return the time of the next event or computed change [s],
        infinity if there is none."""
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
        """Return the time of the first event or computed change after `t` [s], infinity if there is none. `until`: the
        time up to which computed changes matter [s]."""
        event = timeline.event_after(t)
        first = inf if event is None else event.time
        return (
            first
            if self.cell_inputs is None
            else min(first, self.cell_inputs.next_change(timeline, t, min(first, until)))
        )

    def _change_at(self, timeline: Timeline, t: float) -> None:
        """Set all signals that change on the timeline at time `t` [s] to their new states: first those with events,
        then the computed ones."""
        computed = self.cell_inputs
        for event in timeline.events_between(t, t):
            follows = computed is not None and event.channel in computed.numbers
            if event.channel != HAND and not event.observed and not follows:
                self._put(event.channel, event.value > 0.0)
        for number, on in sorted(computed.changes(timeline, t).items()) if computed is not None else ():
            self._put(number, on)

    def keep_states(self) -> None:
        """Keep the current states although the timeline is new, because it only differs from the old one by a record
        that a program has read a value."""
        if self.engine is not None:
            self._timeline = self.engine.timeline

    def at(self, t: float) -> tuple[int, ...]:
        """Return the numbers of the outputs and inputs that are on at the time t [s], sorted."""
        assert self.engine is not None
        numbers = {*self.engine.timeline.channels} - {HAND}
        if self.cell_inputs is not None:
            numbers |= self.cell_inputs.numbers
        return tuple(one for one in sorted(numbers) if self.on_at(one, t))

    def computed_states(self) -> tuple[int, ...]:
        """Return the numbers of the inputs that sensors and rules of the cell set; negative for inputs that are now
        off."""
        self.follow_clock()
        numbers = () if self.cell_inputs is None else sorted(self.cell_inputs.numbers)
        return tuple(number if number in self._on else -number for number in numbers)

    def on_at(self, signal: int, t: float) -> bool:
        """Return whether an output or input is on at the time t [s]."""
        assert self.engine is not None
        timeline, computed = self.engine.timeline, self.cell_inputs
        if computed is not None and signal in computed.numbers:
            return computed.state(timeline, signal, t)
        return timeline.value_at(signal, t) > 0.0

    def check_not_sensed(self, numbers: Iterable[float]) -> None:
        """Raise IllegalSignal if one of the numbers is an input that a sensor of the cell sets."""
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
    """Return (channel, value) pairs for the timeline: value 1.0 for a positive signal number, 0.0 for a negative
    one."""
    return tuple((abs(signal), float(signal > 0)) for signal in signals)


# --- input signals that change at known times ----------------------------------------------------------------


class InputChange(Struct, frozen=True):
    """A change of an input signal, of variables, or of both, from outside. `time`: the time of the robot's clock [s];
    `signal`: the number of the signal, 0 for none; `on`: its new state; `values`: the new values of variables, by
    name."""

    time: float
    signal: int
    on: bool
    values: Mapping[str, Value] = {}


class Inputs(Struct, frozen=True):
    """Changes of input signals at known times. `changes`: all changes, sorted by time; `done`: how many have
    happened."""

    changes: tuple[InputChange, ...] = ()
    done: int = 0

    @classmethod
    def of(cls, changes: Iterable[InputChange]) -> Inputs:
        """Return an Inputs with the changes sorted by time; changes at the same time keep their order."""
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
        """Return the changes up to the time `now` [s], and the Inputs that remain."""
        done = self.done
        while done < len(self.changes) and self.changes[done].time <= now:
            done += 1
        return self.changes[self.done : done], Inputs(self.changes, done)

    def with_more(self, changes: Iterable[InputChange]) -> Inputs:
        """Return an Inputs with further changes. A new change comes after older ones of the same time."""
        return Inputs.of((*self.left, *changes))


NO_INPUTS = Inputs()


class Follow(Struct, frozen=True):
    """A rule of a cell: when the signal `when` turns on, the signal `sets` (None: no signal) is turned on `after`
    seconds later, and off `lasting` seconds after that (None: it stays on).

    Negative signal numbers exchange on and off. `variables`: names of variables that get the values of the next row in
    `rows` each time. After the last row the rule does nothing more, or if `again`, it starts again with the first row.
    """

    when: int
    sets: int | None
    after: float
    lasting: float | None = None
    variables: tuple[str, ...] = ()
    rows: tuple[tuple[float | str, ...], ...] = ()
    again: bool = False


class Cell(Struct, frozen=True):
    """The surroundings of a robot. `names`: the names of signals, by number; `follows`: the rules between signals;
    `scene`: the parts, fixtures and sensors."""

    names: Mapping[int, str] = {}
    follows: tuple[Follow, ...] = ()
    scene: CellScene = NO_SCENE

    def fill(self, variables: Variables) -> None:
        """Assign the first row of each rule's table to the variables of the rule that have no value."""
        for follow in self.follows:
            for name, value in zip(follow.variables, *follow.rows[:1], strict=True):
                one = variables.reference(name)
                if not one.has_value():
                    one.assign(value)


NO_CELL = Cell()


class LivingCell:
    """A cell while programs run. It counts the rows that each rule has used."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self._used = [0] * len(cell.follows)

    def answers(self, signal: int, on: bool, now: float) -> Iterator[InputChange]:
        """Yield the changes that the rules of the cell cause when a signal changes. `on`: its new state; `now`: the
        time of the change [s]."""
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
