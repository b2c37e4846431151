"""Bodies with faults raise an alarm that names the cause; healthy ones do not."""

from __future__ import annotations

import pytest

from tests.examples import first
from tests.laws.divergence import CAUSES, IN_TIME, Course, outcome


@pytest.mark.parametrize("name", first(3, CAUSES))
def test_alarms_come_in_time_and_name_the_cause(name: str) -> None:
    """Nine in ten causes are to be right: the long run counts 60 seeds of each."""
    found = [outcome(name, seed, learned=20.0) for seed in (1, 2, 3)]
    assert all(one.alarm is not None for one in found)
    right = [one for one in found if one.alarm is not None and one.alarm.cause is CAUSES[name]]
    assert len(right) >= 2
    assert all((one.after or 0.0) <= IN_TIME for one in right)


@pytest.mark.long
def test_the_alarm_of_a_payload_comes_in_time_where_joints_come_back() -> None:
    """Joints 3 and 5 of the simulated arm give way, and are back where they belong 0.3 s later."""
    late = outcome("payload", 38, kind="mujoco")
    assert late.false == 0
    assert late.after is not None
    assert late.after <= IN_TIME


def test_a_healthy_body_raises_no_alarm() -> None:
    assert Course(100).healthy(60.0) == []
