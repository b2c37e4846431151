"""Digital signals: outputs 1.., inputs 1001.., internal (software) 2001... A negative number is the inverse.

Also what drives input signals: changes at times that are known before, and the cell, in which inputs follow outputs
after a time (sensors, feeders, a camera whose findings stand in a table). Data: nothing runs here.
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
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import HAND, SetChannels, Stamp
from vrs_cli.values.numbers import Value
from vrs_cli.values.world import NO_SCENE, CellScene

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine

MAX_BITS = 32
HALF_TICK = 0.5 * TICK  # [s] the clock may be so far from the time grid, on which events stand


class ComputedSignals(Struct, frozen=True):
    """Inputs that follow from all else on a timeline: from sensors of the cell, and from its rules.

    `numbers`: of all of them, `sensed`: of those that sensors alone set. `state` tells whether one is on at a time [s];
    `next_change` the first time after one, up to another, at which one of them changes; `changes` which change at a
    time, and what they are then.
    """

    numbers: frozenset[int]
    sensed: frozenset[int]
    state: Callable[[Timeline, int, float], bool]
    next_change: Callable[[Timeline, float, float], float]
    changes: Callable[[Timeline, float], Mapping[int, bool]]


class Signals:
    """Digital signals: outputs 1.., inputs 1001.., internal (software) 2001... A negative number is the inverse.

    Outputs and inputs of a robot stand on the timeline of its `engine`: reading one tells its state at the clock, and
    setting one is an event there. Internal signals are variables, and so are all signals where there is no robot.

    `listeners` are told the number and the new state of each signal that changes while time goes on; what UNDO or
    another timeline restores is not told. `names`: of signals, by number. `observer`: told of each state that is read
    by `observe`. `place`: the operation of the running program that reads
    signals now, where that is known.
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
        # `_on` holds on this timeline, from `_since` until before `_until` [s]
        self._timeline: Timeline | None = None
        self._book: object = None
        self._since, self._until = 0.0, -inf

    @property
    def cell_inputs(self) -> ComputedSignals | None:
        """The inputs that the cell sets."""
        return self._computed

    @cell_inputs.setter
    def cell_inputs(self, computed: ComputedSignals | None) -> None:
        self._computed, self._timeline = computed, None  # the states are read again

    # --- reading ---

    def read(self, number: float) -> bool:
        """Raises IllegalSignal."""
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
        """Return whether a signal of the robot has become what it is at this very instant."""
        return self.engine is not None and self._changed.get(signal) == self.engine.now

    def exists(self, number: float) -> bool:
        signal = abs(round(number))
        return signal in OUTPUTS or signal in INPUTS or signal in INTERNAL

    def read_bits(self, first: float, count: float = 1.0) -> int:
        """Read `count` signals for a program as a binary number, `first` the lowest bit. Raises IllegalSignal,
        IllegalValue.
        """
        return sum(self.observe(number) << bit for bit, number in enumerate(self._group(first, count)))

    def with_names(self, text: str) -> str:
        """A text, with the names of the signals whose numbers are in it: `SIG(1003) (1003 is part.there)`."""
        numbers = dict.fromkeys(int(digits) for digits in re.findall(r"\b[0-9]{1,4}\b", text)) if self.names else ()
        named = ", ".join(f"{number} is {self.names[number]}" for number in numbers if number in self.names)
        return f"{text} ({named})" if named else text

    @property
    def on(self) -> tuple[int, ...]:
        """The numbers of those that are on, in order."""
        self.follow_clock()
        return tuple(sorted(self._on))

    # --- setting ---

    def write(self, *numbers: float, text: str = "", inputs: bool = False, stamp: Stamp | None = None) -> None:
        """Switch signals on, or off for negative numbers. `inputs`: also those that only the world outside drives.
        `text`: the instruction; `stamp`: the present time, of changes that come from outside and are nobody's command.

        Raises IllegalSignal, FileError.
        """
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
        """Return the request to the robot that sets signals at a time. Raises IllegalSignal."""
        signals = [self._check_number(number) if inputs else self.writable(number) for number in numbers]
        for signal in signals:
            if abs(signal) in INTERNAL:
                hint = f"internal signals are variables and have no times: SIGNAL {signal} sets it now"
                raise IllegalSignal(str(signal), hint)
        return SetChannels(_values(signals), stamp, text)

    def writable(self, number: float) -> int:
        """A signal that a program may set. Raises IllegalSignal."""
        signal = self._check_number(number)
        if abs(signal) in INPUTS:
            raise IllegalSignal(str(signal), "an input cannot be set by a program")
        return signal

    def reset(self, text: str = "") -> None:
        """Switch all outputs off."""
        self.write(*(-number for number in self.on if number in OUTPUTS), text=text)

    def reset_request(self, stamp: Stamp, text: str) -> SetChannels:
        """Return the request to the robot that switches off, at a time, all outputs that are ever on."""
        numbers = self._on if self.engine is None else self.engine.timeline.channels
        return self.request([-number for number in sorted(numbers) if number in OUTPUTS], stamp, text)

    def write_bits(self, first: float, count: float, value: int, text: str = "") -> None:
        """Set the lowest `count` bits of `value`. Raises IllegalSignal, IllegalValue."""
        group = enumerate(self._group(first, count))
        self.write(*(number if value >> bit & 1 else -number for bit, number in group), text=text)

    # --- the timeline ---

    def follow_clock(self) -> float:
        """Take the states of the present time from the timeline. Return when the next event or computed change comes
        [s]; infinity where none does.
        """
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
        """Return when the next event or computed change comes [s]; infinity where none does."""
        event = timeline.event_after(t)
        first = inf if event is None else event.time
        return (
            first
            if self.cell_inputs is None
            else min(first, self.cell_inputs.next_change(timeline, t, min(first, until)))
        )

    def _change_at(self, timeline: Timeline, t: float) -> None:
        """Let signals change as the timeline says of a time: first those of events, then those that are computed."""
        computed = self.cell_inputs
        for event in timeline.events_between(t, t):
            follows = computed is not None and event.channel in computed.numbers
            if event.channel != HAND and not event.observed and not follows:
                self._put(event.channel, event.value > 0.0)
        for number, on in sorted(computed.changes(timeline, t).items()) if computed is not None else ():
            self._put(number, on)

    def keep_states(self) -> None:
        """Keep the present states on the present timeline, which has just been given an observation."""
        if self.engine is not None:
            self._timeline = self.engine.timeline

    def at(self, t: float) -> tuple[int, ...]:
        """The outputs and inputs that are on at a time [s], in order."""
        assert self.engine is not None
        numbers = {*self.engine.timeline.channels} - {HAND}
        if self.cell_inputs is not None:
            numbers |= self.cell_inputs.numbers
        return tuple(one for one in sorted(numbers) if self.on_at(one, t))

    def computed_states(self) -> tuple[int, ...]:
        """The inputs that the cell sets, negative where they are off."""
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
        """Raises IllegalSignal for an input that a sensor of the cell sets."""
        for number in numbers:
            if self.cell_inputs is not None and abs(round(number)) in self.cell_inputs.sensed:
                raise IllegalSignal(plain(number), "a sensor of the cell sets it")

    def _put(self, signal: int, on: bool) -> None:
        """Let a signal have a state from now on; the listeners are told where that is another one."""
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
    """Channels with the values that signals give them."""
    return tuple((abs(signal), float(signal > 0)) for signal in signals)


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

    def take_until(self, now: float) -> tuple[tuple[InputChange, ...], Inputs]:
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
                if not one.has_value():
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
