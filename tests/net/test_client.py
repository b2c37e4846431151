"""Addresses of robots, and when it is tried again."""

from __future__ import annotations

import asyncio
import gc
from collections import deque
from itertools import pairwise
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest

from vrs_cli.errors import UsageError
from vrs_cli.net import messages
from vrs_cli.net.client import LATEST, SOONEST, Client, Even, address_of, hello_of, waits
from vrs_cli.net.delay_line import DelayLine, Gamma
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


def test_who_gives_up_an_opening_leaves_nothing_behind() -> None:
    """As who closes a page that is about to take hold of a robot."""
    complaints = list[object]()

    async def given_up() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _loop, what: complaints.append(what))
        silent = await asyncio.start_server(lambda _reader, writer: writer.close(), "127.0.0.1", 0)
        client = Client(f"ws://127.0.0.1:{silent.sockets[0].getsockname()[1]}", hello_of())
        opening = asyncio.create_task(client.open())
        await asyncio.sleep(0)
        opening.cancel()
        while others := asyncio.all_tasks() - {asyncio.current_task()}:
            await asyncio.wait(others)
        silent.close()
        del client, opening
        gc.collect()

    asyncio.run(given_up())
    assert complaints == []


@pytest.mark.parametrize("rate", [1.0, 2.0])
def test_samples_with_jitter_are_shown_evenly(rate: float) -> None:
    """After a moment nearly every look shows the next sample; as they come it is every other look at most."""
    tick, wall = 0.04, [0.0]
    far: Any = SimpleNamespace(rate=rate)
    even, line = Even(far, 95.0, lambda: wall[0]), DelayLine(Gamma(0.2, 0.08), "1")
    coming = deque((line.arrival(k * tick), k) for k in range(1500))
    shown, plain = list[int](), list[int]()
    last = -1
    for look in range(1500):
        now = look * tick
        while coming and coming[0][0] <= now:
            wall[0], last = coming.popleft()
            even.hear(messages.Sample(float(last), (0.0,), clock=rate * last * tick))
        sample = even.playout.take(now)
        shown.append(-1 if sample is None else int(sample.t))
        plain.append(last)
    steps = [[b - a for a, b in pairwise(row[200:])] for row in (shown, plain)]
    evenly = [sum(step == 1 for step in row) / len(row) for row in steps]
    assert evenly[0] > 0.9 > 0.6 > evenly[1]
    before = even.playout
    even.hear(messages.Clock(0.0, rate=3.0, realtime=True))
    assert even.playout is not before, "another clock is another measure"
