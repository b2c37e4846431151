"""Who drives a robot: the first who commands it, unless driving has to be asked for."""

from __future__ import annotations

import pytest

from vrs_cli.errors import LeaseHeld
from vrs_cli.net.served_robot import Driving

LONG = 1000.0  # [s] longer than a lease lasts


class Robot:
    """The lease of a robot, the time of the day, and the drivers of whom was told."""

    def __init__(self, by_asking: bool) -> None:
        self.now, self.drivers = 0.0, list[str]()
        self.driving = Driving(
            lambda: self.now, lambda lease, _: self.drivers.append(lease.holder), by_asking=by_asking
        )

    @property
    def driver(self) -> str:
        return self.driving.lease.holder


@pytest.mark.parametrize(("by_asking", "driver"), [(False, "ada"), (True, "")])
def test_who_commands_drives_unless_that_has_to_be_asked_for(by_asking: bool, driver: str) -> None:
    robot = Robot(by_asking)
    robot.driving.may("ada")
    assert (robot.driver, robot.drivers) == (driver, [driver] if driver else [])
    robot.driving.change(lambda lease, now: lease.ask("ada", now))
    robot.driving.change(lambda lease, now: lease.leave("ada", now))
    robot.driving.may("ada")
    assert robot.driver == driver


@pytest.mark.parametrize("by_asking", [False, True])
def test_nobody_commands_while_another_drives(by_asking: bool) -> None:
    robot = Robot(by_asking)
    robot.driving.change(lambda lease, now: lease.acquire("ada", now))
    with pytest.raises(LeaseHeld):
        robot.driving.may("bob")
    robot.driving.change(lambda lease, now: lease.ask("bob", now))
    robot.driving.change(lambda lease, now: lease.leave("ada", now))
    robot.driving.may("bob")
    assert robot.drivers[-1] == robot.driver == "bob"


@pytest.mark.parametrize("by_asking", [False, True])
def test_who_was_not_heard_of_for_long_drives_until_another_takes_it(by_asking: bool) -> None:
    robot = Robot(by_asking)
    robot.driving.change(lambda lease, now: lease.acquire("ada", now))
    robot.now = LONG
    robot.driving.may("ada")  # and that is a heartbeat
    assert (robot.driving.take_lapsed(), robot.driver) == ("", "ada")
    robot.now = 2.0 * LONG
    robot.driving.may("bob")
    assert (robot.driver, robot.drivers[-1]) == ("bob", "bob")
    robot.now = 3.0 * LONG
    assert (robot.driving.take_lapsed(), robot.driver) == ("bob", "")
