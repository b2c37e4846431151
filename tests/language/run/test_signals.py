"""Digital signals, and groups of them as binary numbers."""

from __future__ import annotations

import pytest

from vrs_cli.errors import (
    IllegalSignal,
)
from vrs_cli.language.run.signals import Signals
from vrs_cli.language.words.values import INPUTS, INTERNAL, OUTPUTS


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
    assert [sum(signals.state(bank)) for bank in (OUTPUTS, INPUTS, INTERNAL)] == [0, 1, 0]


@pytest.mark.parametrize("number", [0, 513, -513, 1000, 1513, 2000, 2513, 1e20])
def test_signals_that_do_not_exist(number: float) -> None:
    with pytest.raises(IllegalSignal, match="1-512, 1001-1512, 2001-2512"):
        Signals().read(number)


def test_bits_are_signals_from_the_lowest() -> None:
    signals = Signals()
    signals.write_bits(3, 4, 0b1010)
    assert [signals.read(number) for number in range(3, 7)] == [False, True, False, True]
    assert signals.read_bits(3, 4) == 10
    assert signals.read_bits(4) == 1
