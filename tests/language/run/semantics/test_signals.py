"""Signals, timers, and waits for them."""

from __future__ import annotations

import pytest

from tests.language.running import TICK, StillRobot, run_lines
from vrs_cli.errors import ArithmeticOverflow, UndefinedValue, VrsError
from vrs_cli.language.run.effects import Wait


def test_signals_and_bits() -> None:
    run = run_lines("SIGNAL 1, 3, -3, 2001", "BITS 5, 4 = 9")
    assert [run.environment.signals.read(n) for n in (1, 3, 2001, 5, 6, 7, 8)] == [
        True,
        False,
        True,
        True,
        False,
        False,
        True,
    ]
    assert not run_lines("SIGNAL 1", "RESET").environment.signals.read(1)
    assert run_lines("BITS 5 = 1").environment.signals.read(5)


def test_a_wait_is_asked_again_until_it_is_true() -> None:
    robot = StillRobot()
    run = run_lines("TIMER 1 = 0", "WAIT TIMER(1) > 0.1", "x = TIMER(1)", robot=robot)
    assert [type(event) for event in run.requests] == [Wait]
    assert run.value("x") == pytest.approx(4 * TICK)


def test_a_bare_wait_is_one_tick() -> None:
    robot = StillRobot()
    run = run_lines("WAIT", robot=robot)
    assert [event.ticks for event in run.requests if isinstance(event, Wait)] == [1]
    assert robot.now == TICK


@pytest.mark.parametrize(
    ("line", "error"), [("WAIT 1/(y-y) > 2", ArithmeticOverflow), ("WAIT SIG(flag)", UndefinedValue)]
)
def test_a_condition_that_cannot_be_evaluated_is_an_error_of_its_step(line: str, error: type[VrsError]) -> None:
    run = run_lines("y = 1", line)
    assert type(run.error) is error
    assert run.task.fault is not None
    assert run.task.fault.source == line
