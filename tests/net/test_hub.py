"""Which robots a token may hold, and those that are its own."""

from __future__ import annotations

import time
from collections.abc import Iterator
from math import inf
from pathlib import Path

import pytest

from vrs_cli.errors import RequestRefused
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.words.word import Role
from vrs_cli.net.durable_log import Audit
from vrs_cli.net.room import Hub, RobotFolders
from vrs_cli.net.served_robot import Plan
from vrs_cli.net.tokens import OPEN, Grant

ADA, BOB = Grant("ada", Role.SUPERVISOR), Grant("bob", Role.SUPERVISOR, robots=frozenset({"cell2"}))
TOM = Grant("tom", Role.SUPERVISOR, teacher=True)


@pytest.fixture
def hub(tmp_path: Path) -> Iterator[Hub]:
    model = load_robot("puma560")
    audit = Audit(None, time.time, print)
    places, usual = RobotFolders(None, tmp_path), Plan(model, tmp_path)
    robots = {"cell1": model, "cell2": load_robot("cobra600")}
    it = Hub(robots, places, usual, audit, lambda _: None, print, own=2, grants=lambda: (ADA, BOB, TOM), own_idle=9.0)
    yield it
    it.close()


def test_names(hub: Hub) -> None:
    assert hub.names(OPEN) == ("cell1", "cell2", "ada", "ada-2", "bob", "bob-2", "tom", "tom-2")
    assert hub.names(ADA) == ("ada", "ada-2", "cell1", "cell2")
    assert hub.names(BOB) == ("bob", "bob-2", "cell2")
    assert hub.names(TOM)[:4] == ("tom", "tom-2", "cell1", "cell2")
    assert set(hub.names(TOM)) >= {"ada", "bob-2"}


def test_the_robot_that_is_meant(hub: Hub) -> None:
    assert hub.choose(ADA, "") == "ada"
    assert hub.choose(ADA, "cell1") == "cell1"
    assert hub.choose(TOM, "ada") == "ada"
    for grant, wanted in ((BOB, "cell1"), (BOB, "ada"), (ADA, "ada-3"), (ADA, "../ada"), (OPEN, "")):
        with pytest.raises(RequestRefused):
            hub.choose(grant, wanted)


def test_a_robot_is_made_when_it_is_first_used_and_once(hub: Hub, tmp_path: Path) -> None:
    assert not hub.rooms
    ada = hub.open("ada")
    assert hub.open("ada") is ada
    assert ada.plan.model.name == "puma560"
    assert ada.folder.root == tmp_path / "ada"
    assert hub.open("cell2").plan.model.name == "cobra600"
    assert set(hub.rooms) == {"ada", "cell2"}
    assert (ada.plan.idle, hub.open("cell2").plan.idle) == (9.0, inf)
