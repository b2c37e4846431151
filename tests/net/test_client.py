"""Addresses of robots, and when it is tried again."""

from __future__ import annotations

from random import Random

import pytest

from vrs_cli.cli.serve import USUAL_PORT
from vrs_cli.errors import UsageError
from vrs_cli.net.client import LATEST, SOONEST, address_of, waits
from vrs_cli.net.messages import PORT


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("ws://127.0.0.1:9000", "ws://127.0.0.1:9000"),
        ("wss://robots.example/robots/cell1", f"wss://robots.example:{PORT}/robots/cell1"),
        ("localhost", f"ws://localhost:{PORT}"),
        ("cell:9000/robots/a", "ws://cell:9000/robots/a"),
        ("[::1]:9000", "ws://[::1]:9000"),
    ],
)
def test_what_is_typed_is_an_address(typed: str, meant: str) -> None:
    assert address_of(typed) == meant


@pytest.mark.parametrize(
    "typed", ["", "http://a", "ws://", "ws://a:b", "ws://a:99999", "ws://ada:secret@a", "ws://a?x=1"]
)
def test_what_is_no_address_is_said_to_be_none(typed: str) -> None:
    with pytest.raises(UsageError, match="is no address"):
        address_of(typed)


def test_attempts_come_later_and_later_and_never_together() -> None:
    random = Random(1)
    for attempt in range(1, 50):
        most = min(LATEST, SOONEST * 2.0**attempt)
        found = [waits(attempt, random) for _ in range(200)]
        assert 0.0 <= min(found) < 0.2 * most
        assert 0.8 * most < max(found) <= most


def test_the_usual_port_is_that_of_the_server() -> None:
    assert PORT == USUAL_PORT
