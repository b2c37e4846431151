"""Clocks: virtual, and paced by a clock on the wall."""

from __future__ import annotations

from vrs_cli.engine.clock import PacedClock, VirtualClock


def test_virtual_time_jumps_and_never_goes_back_by_itself() -> None:
    clock = VirtualClock()
    clock.advance(5.0)
    clock.advance(3.0)
    assert clock.now == 5.0
    clock.set(1.0)
    assert clock.now == 1.0


def test_paced_time_sleeps_what_is_left() -> None:
    wall = [100.0]
    slept: list[float] = []

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        wall[0] += seconds

    clock = PacedClock(2.0, lambda: wall[0], sleep)
    clock.advance(4.0)
    wall[0] += 1.0  # the program takes a second of real time: two of the robot
    clock.advance(5.0)
    clock.advance(8.0)
    assert slept == [2.0, 1.0]
    assert clock.now == 8.0
