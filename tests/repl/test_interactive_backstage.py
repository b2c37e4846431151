"""What is made behind the first prompt."""

from threading import Event

import pytest

from tests.live import PATIENCE
from vrs_cli.repl.interactive import Backstage


def test_nothing_is_made_before_it_is_begun() -> None:
    made: list[int] = []
    backstage = Backstage(lambda: made.append(1) or "robot")
    assert (backstage.ready, made) == (None, [])


def test_it_is_made_once_and_waited_for() -> None:
    made: list[int] = []
    gate, told = Event(), Event()

    def make() -> str:
        gate.wait(PATIENCE)
        made.append(1)
        return "robot"

    backstage = Backstage(make, told.set)
    backstage.begin()
    backstage.begin()
    assert backstage.ready is None
    gate.set()
    assert (backstage.wait(), backstage.wait()) == ("robot", "robot")
    assert (told.wait(PATIENCE), made, backstage.ready) == (True, [1], "robot")


def test_whoever_waits_gets_the_error() -> None:
    def make() -> str:
        raise FileNotFoundError("no robot")

    backstage = Backstage(make)
    with pytest.raises(FileNotFoundError, match="no robot"):
        backstage.wait()
