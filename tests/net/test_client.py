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
from vrs_cli.net.client import FIRST_WAIT_S, MAX_WAIT_S, Client, SampleBuffer, address_of, hello_of, open_socket, waits
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
        most = min(MAX_WAIT_S, FIRST_WAIT_S * 2.0**attempt)
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
    even, line = SampleBuffer(far, 95.0, lambda: wall[0]), DelayLine(Gamma(0.2, 0.08), "1")
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


# --- connections, without sockets ------------------------------------------------------------------------------------


class Far:
    """A far end that holds nothing. `begins`: since when its mirror knows the timeline [s]."""

    def __init__(self, begins: float = 0.0, now: float = 0.0, window: float = 0.0) -> None:
        self.mirror = SimpleNamespace(begins=begins, now=now, window=window, lost=False)
        self.connection = SimpleNamespace(closing=False, why="", frames=lambda: [b"frame"], begin=lambda: None)
        self.open, self.refusal, self.due = False, None, 0.0

    def extend(self, part: messages.Shown) -> bool:
        self.mirror.begins = part.begin
        return True

    def look(self) -> None: ...
    def cut(self) -> None: ...


class Socket:
    """`sent` is all that was written; after so many frames `when_full` is called."""

    def __init__(self, full: int, when_full: Any) -> None:
        self.sent, self.closed, self._full, self._when_full = list[bytes](), False, full, when_full

    async def send(self, frame: bytes) -> None:
        self.sent.append(frame)
        if len(self.sent) == self._full:
            self._when_full()

    async def close(self) -> None:
        self.closed = True


def client_of(far: Far) -> Any:
    client: Any = Client("localhost", hello_of())
    client.far = far
    return client


@pytest.mark.parametrize("who", ["client", "connection"])
def test_writing_ends_with_all_that_was_to_be_sent_when_either_side_leaves(who: str) -> None:
    async def written() -> Socket:
        far = Far()
        client = client_of(far)
        leave = (lambda: setattr(client, "_leaves", True)) if who == "client" else far.connection
        socket = Socket(3, leave if callable(leave) else lambda: setattr(leave, "closing", True))
        async with asyncio.timeout(5.0):
            await client._write(socket)
        return socket

    socket = asyncio.run(written())
    assert socket.sent == [b"frame"] * 4
    assert socket.closed


def test_a_client_connects_with_the_times_that_a_line_over_half_the_world_needs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: dict[str, Any] = {}
    monkeypatch.setattr("vrs_cli.net.client.connect", lambda url, **times: asked.update(times, url=url))
    open_socket(client_of(Far()).url, None)
    assert asked["url"] == f"ws://localhost:{PORT}"
    assert (asked["open_timeout"], asked["ping_interval"], asked["ping_timeout"]) == (10.0, 2.0, 10.0)
    assert asked["close_timeout"] == 2.0
    assert asked["proxy"] is None, "none stands between a process and its own machine"


def test_the_first_attempt_after_a_connection_was_open_comes_as_soon_as_the_first_of_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And each that fails after it later."""
    tried, opens = list[int](), iter([False, False, True, False, False])
    monkeypatch.setattr("vrs_cli.net.client.waits", lambda attempt, _random: tried.append(attempt) or 0.0)

    async def run() -> None:
        far = Far()
        client = client_of(far)

        def dial(_url: str, _tls: object) -> None:
            far.open = next(opens)
            raise OSError("no")

        monkeypatch.setattr("vrs_cli.net.client.open_socket", dial)
        client._goes_on = lambda _why, _hint: len(tried) < 4
        await client._run()

    asyncio.run(run())
    assert tried == [1, 2, 1, 2]


@pytest.mark.parametrize(("window", "wanted"), [(3.0, [7.0]), (20.0, [-1.0])])
def test_the_past_is_asked_for_as_far_as_the_window_goes_and_to_before_its_beginning_at_most(
    window: float, wanted: list[float]
) -> None:
    async def recalled() -> list[float]:
        client, asked = client_of(Far(begins=9.0, now=10.0, window=window)), list[float]()

        async def ask(make: Any) -> messages.Shown:
            request = make(1)
            assert request.end == client.far.mirror.begins
            asked.append(request.begin)
            return messages.Shown(1, None, begin=request.begin)  # type: ignore[arg-type]

        client.ask = ask
        async with asyncio.timeout(5.0):
            await client._recall(client.far.mirror)
        assert client._shown.is_set()
        return asked

    assert asyncio.run(recalled()) == wanted
