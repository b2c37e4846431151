"""Bodies with faults raise an alarm that names the cause; healthy ones do not."""

from __future__ import annotations

import pytest

from tests.laws.divergence import CAUSES, IN_TIME, Course, outcome


@pytest.mark.parametrize("name", CAUSES)
def test_an_alarm_comes_in_time_and_names_the_cause(name: str) -> None:
    found = outcome(name, 1, learned=20.0)
    assert found.alarm is not None
    assert found.alarm.cause is CAUSES[name]
    assert found.after is not None
    assert found.after <= IN_TIME


def test_a_healthy_body_raises_no_alarm() -> None:
    assert Course(100).healthy(60.0) == []
