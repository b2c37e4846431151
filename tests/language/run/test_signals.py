"""Digital signals, and groups of them as binary numbers."""

from __future__ import annotations

from math import inf

import pytest

from vrs_cli.engine.engine import Engine
from vrs_cli.errors import IllegalSignal
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.run.signals import ComputedSignals, Signals
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Stamp


def test_signals_are_on_off_and_inverted() -> None:
    signals = Signals()
    assert not signals.read(5)
    assert signals.read(-5)
    signals.write(5)
    assert signals.read(5)
    assert not signals.read(-5)
    signals.write(-5)
    assert not signals.read(5)


def test_reset_leaves_internal_signals() -> None:
    signals = Signals()
    signals.write(1)
    signals.write(2001)
    signals.reset()
    assert not signals.read(1)
    assert signals.read(2001)


def test_only_the_world_outside_sets_inputs() -> None:
    signals = Signals()
    with pytest.raises(IllegalSignal, match="1001"):
        signals.write(1001)
    signals.write(1001, inputs=True)
    assert signals.read(1001)
    assert signals.on == (1001,)


@pytest.mark.parametrize("number", [513, -513, 1000, 1513, 2000, 2513, 1e20])
def test_signals_that_do_not_exist(number: float) -> None:
    with pytest.raises(IllegalSignal, match="1-512, 1001-1512, 2001-2512"):
        Signals().read(number)

    with pytest.raises(IllegalSignal, match="0 is no number of a signal"):
        Signals().read(0)


def test_bits_are_signals_from_the_lowest() -> None:
    signals = Signals()
    signals.write_bits(3, 4, 0b1010)
    assert [signals.read(number) for number in range(3, 7)] == [False, True, False, True]
    assert signals.read_bits(3, 4) == 10
    assert signals.read_bits(4) == 1


# --- on the timeline of a robot ------------------------------------------------------------------------------------


@pytest.fixture
def signals() -> Signals:
    made = Signals()
    made.engine = Engine(load_robot("puma560"))
    return made


def test_what_is_read_is_the_state_at_the_clock(signals: Signals) -> None:
    engine = signals.engine
    assert engine is not None
    engine.perform(signals.request((1, 3), Stamp(0.5), "SIGNAL 1, 3 AT 0.5"))
    engine.perform(signals.request((-1,), Stamp(1.0, relative=True), "SIGNAL -1 IN 1"))
    seen = []
    for t in (0.0, 0.25, 0.5, 0.75, 1.0, 1.5):
        engine.clock.set(t)
        seen.append(signals.on)
    assert seen == [(), (), (1, 3), (1, 3), (3,), (3,)]
    assert [signals.at(t) for t in (0.0, 0.5, 1.0)] == [(), (1, 3), (3,)]
    engine.clock.set(0.0)
    assert (signals.on, signals.follow_clock()) == ((), pytest.approx(0.5, abs=1e-9))


def test_listeners_hear_what_changes_while_time_goes_on_and_nothing_of_undo(signals: Signals) -> None:
    engine, heard = signals.engine, list[tuple[int, bool]]()
    assert engine is not None
    signals.listeners.append(lambda signal, on: heard.append((signal, on)))
    signals.write(1, text="SIGNAL 1")
    engine.perform(signals.request((2, -1), Stamp(0.5), "SIGNAL 2, -1 AT 0.5"))
    assert heard == [(1, True)]
    engine.clock.set(0.7)
    assert signals.on == (2,)
    assert sorted(heard[1:]) == [(1, False), (2, True)]
    signals.write(-2, text="SIGNAL -2")
    assert heard[3:] == [(2, False)]
    engine.undo()
    assert (signals.on, len(heard)) == ((2,), 4)
    engine.undo(2)
    assert (signals.on, len(heard)) == ((), 4)


def test_internal_signals_are_variables_without_times(signals: Signals) -> None:
    engine = signals.engine
    assert engine is not None
    signals.write(2001, 2, text="SIGNAL 2001, 2")
    assert engine.timeline.channels == (2,)
    with pytest.raises(IllegalSignal, match="internal signals are variables and have no times: SIGNAL 2001 sets it"):
        signals.request((2001,), Stamp(1.0), "SIGNAL 2001 AT 1")
    engine.undo()
    assert signals.on == (2001,)


def test_a_state_that_is_there_already_is_no_event(signals: Signals) -> None:
    engine = signals.engine
    assert engine is not None
    for _ in range(3):
        signals.write(1, 4, -4, text="SIGNAL 1, 4, -4")
    assert [(event.channel, event.value) for event in engine.timeline.events] == [(1, 1.0), (4, 1.0), (4, 0.0)] + [
        (4, 1.0),
        (4, 0.0),
    ] * 2


def test_the_cell_computes_inputs(signals: Signals) -> None:
    engine, heard = signals.engine, list[tuple[int, bool]]()
    assert engine is not None

    def state(timeline: Timeline, _signal: int, t: float) -> bool:
        """0.25 s after output 1."""
        return timeline.value_at(1, t - 0.25) > 0.0

    def next_change(timeline: Timeline, t: float, until: float) -> float:
        return next((time + 0.25 for time, _ in timeline.changes(1) if t < time + 0.25 <= until), inf)

    def changes(timeline: Timeline, t: float) -> dict[int, bool]:
        return {1001: state(timeline, 1001, t)} if next_change(timeline, t - TICK, t) == t else {}

    signals.cell_inputs = ComputedSignals(frozenset({1001}), frozenset({1001}), state, next_change, changes)
    signals.listeners.append(lambda signal, on: heard.append((signal, on)))
    signals.write(1, text="SIGNAL 1")
    assert (signals.on, signals.follow_clock()) == ((1,), 0.25)
    engine.clock.set(1.0)
    assert (signals.on, heard) == ((1, 1001), [(1, True), (1001, True)])
    assert signals.at(0.2) == (1,)
    assert signals.at(0.25) == (1, 1001)
    with pytest.raises(IllegalSignal, match="a sensor of the cell sets it"):
        signals.check_not_sensed((1001,))
    engine.clock.set(0.1)
    assert (signals.on, len(heard)) == ((1,), 2)
