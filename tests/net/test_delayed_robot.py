"""A served robot behind `vrs lab delay`'s line: real sockets, real time."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Iterator
from contextlib import aclosing, contextmanager, suppress
from itertools import pairwise
from math import inf
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

import vrs_cli as vrs
from tests.live import PATIENCE, until
from tests.net.serving import Caller, Serving, serving
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import TooLate
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.interfaces.users import USUAL_ALLOWED
from vrs_cli.net.client import Client, hello_of
from vrs_cli.net.delay_line import Constant, DelayProxy, Delays, DelayWays, Endpoint, Gamma
from vrs_cli.net.far_end import Ahead
from vrs_cli.net.messages import Delta, Done, Hello, Line, Ping, Pong, Sample, Subscribe
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.net.timesync import TimeSync
from vrs_cli.trajectory.instant import on_grid
from vrs_cli.values.acts import Go, Goal

SLOW = 60.0  # [s] that a busy machine takes for anything
READY = "MOVE #PPOINT({}, -90, 90, 0, 0, 0) AT {}"


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Serving]:
    with serving(tmp_path, realtime=1.0, journal=False) as it:
        yield it


@contextmanager
def behind(it: Serving, forward: float, backward: float | Delays) -> Iterator[Serving]:
    """The same server, over a line."""
    ways = DelayWays(Constant(forward), Constant(backward) if isinstance(backward, float) else backward)
    where, there = urlsplit(it.address), it.address
    assert where.hostname is not None
    assert where.port is not None
    target, listens, stop = Endpoint(where.hostname, where.port), threading.Event(), threading.Event()

    async def run() -> None:
        proxy = DelayProxy(target, ways, lambda _text: None)
        it.address = f"ws://{await proxy.listen(Endpoint('127.0.0.1', 0))}"
        listens.set()
        await asyncio.get_running_loop().run_in_executor(None, stop.wait)
        await proxy.close()

    thread = threading.Thread(target=lambda: asyncio.run(run()))
    thread.start()
    assert listens.wait(PATIENCE)
    try:
        yield it
    finally:
        it.address = there
        stop.set()
        thread.join(PATIENCE)


@pytest.mark.long
def test_a_robot_is_entered_over_a_round_trip_of_nearly_the_whole_wait(
    robot: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The socket takes one round trip, hello another one."""
    monkeypatch.setattr("vrs_cli.net.client.OPENING", 2.0)
    with behind(robot, 0.6, 0.6) as far, vrs.connect(far.address) as r:
        assert r.model.name == "puma560"


def first_change(caller: Caller) -> Delta:
    """Of what has come, or comes."""
    there = [one for one in caller.heard if isinstance(one, Delta)]
    change = there[0] if there else caller.until(lambda message: isinstance(message, Delta))
    assert isinstance(change, Delta)
    return change


@pytest.mark.parametrize("claim", [-1e6, 0.0, 1e6, None])
def test_no_claim_changes_the_past(robot: Serving, claim: float | None) -> None:
    """A delta is issued within what is allowed, and cuts nothing that was before it arrived."""
    with robot.call(hello=Hello((1,), delay=0.25)) as caller:
        caller.ask(lambda id: Subscribe(id, deltas=True))
        done = caller.ask(lambda id: Line(id, "MOVE #PPOINT(5, -90, 90, 0, 0, 0) IN 0.125", claim))
        assert isinstance(done, Done)
        assert done.ok
        change = first_change(caller)
        arrived = change.delta.cut - 0.125  # t_c: the motion begins IN 0.125
        assert change.delta.issued <= arrived <= change.applied
        assert change.delta.issued >= arrived - 0.25 - SLOW
        if claim == -1e6:
            assert change.delta.issued <= arrived - 0.25


def test_the_longest_delay_is_the_servers_to_allow(robot: Serving) -> None:
    with robot.call(hello=Hello((1,), delay=1e9)) as caller:
        caller.ask(lambda id: Subscribe(id, deltas=True))
        caller.ask(lambda id: Line(id, "MOVE #PPOINT(5, -90, 90, 0, 0, 0) IN 0.1", -1e9))
        change = first_change(caller)
        assert change.delta.issued >= change.applied - USUAL_ALLOWED - SLOW


def test_the_way_there_and_back_is_measured(robot: Serving) -> None:
    with behind(robot, 0.06, 0.02) as it, it.call() as caller:
        sync = TimeSync()
        while sync.estimate is None or sync.estimate.round_trip > 0.5:  # until one exchange was not held up
            begin = time.monotonic()
            caller.protocol.send(Ping(begin))
            caller.flush()
            pong = caller.until(lambda message: isinstance(message, Pong))
            assert isinstance(pong, Pong)
            sync.hear(begin, pong.came, pong.left, time.monotonic())
        found = sync.estimate
        assert found is not None
        assert found.round_trip >= 0.08
        assert abs(found.offset) <= found.round_trip / 2.0, "server and client have one clock here"
        assert found.offset == pytest.approx(0.02, abs=found.round_trip - 0.08 + 0.001), "half of the asymmetry"


def go(far: Supervisor, where: Go, late: list[TooLate]) -> None:
    try:
        far.act(where)
    except TooLate as error:
        late.append(error)


@pytest.mark.long
def test_what_is_on_its_way_is_previewed_and_then_confirmed(robot: Serving) -> None:
    """Over 0.3 s each way: a motion for 0.5 s later is seen at once, and what was wrong until it came is known."""
    with behind(robot, 0.3, 0.3) as it:
        far = Supervisor(SocketPort.connect(it.address, hello_of()))
        try:
            while far.port.far.sync.estimate is None:
                time.sleep(0.01)
            for turn in (0.3, -0.3) * 4:  # until none of the three threads is held up
                issued, late = far.now, list[TooLate]()
                begin = on_grid(issued + 0.5)
                goal = Goal(joints=(turn, *joints_at(far.arm, far.timeline, 0.0)[1:]))
                going = threading.Thread(target=go, args=(far, Go(goal, executed=begin), late))
                going.start()
                while (seen := far.preview_now()).unconfirmed == inf and going.is_alive():
                    time.sleep(0.01)
                only_previewed = far.timeline.end < begin
                going.join(PATIENCE)
                if only_previewed and not late:
                    break
            assert seen.unconfirmed == begin
            assert only_previewed
            after = far.preview_now()
            assert after.unconfirmed == inf
            assert after.timeline is far.timeline
            paths = [[(one.start, one.finish, one.path) for one in line][-3:] for line in (seen.timeline, far.timeline)]
            assert paths[0] == paths[1], "and it is what the robot does"
            *_, (first, last) = after.flagged
            assert first == begin
            assert first < last < issued + 0.6 + SLOW
        finally:
            far.close()


def test_who_looks_ahead_is_shown_where_a_command_of_now_finds_the_robot(robot: Serving) -> None:
    """Whatever the ways there and back differ in: D_f after its clock."""
    engine = robot.hub.rooms["cell1"].session.engine
    with behind(robot, 0.15, 0.05) as it:
        far = SocketPort.connect(it.address, hello_of())
        try:
            end = far.far
            while not end.round_trip:
                time.sleep(0.01)
            for end.ahead, after in ((Ahead.AUTO, 0.15), (0.0, -0.05), (0.05, 0.0)):
                before, shown, later = engine.clock.reached, end.shown_time, engine.clock.reached
                slack = end.sync.round_trip(1.0) - 0.2 + 0.005  # what held up the slowest exchange until now
                assert before - slack <= shown - after <= later + slack, end.ahead
        finally:
            far.close()


def test_in_python_motions_are_sent_ahead_and_previewed(robot: Serving) -> None:
    with behind(robot, 0.15, 0.15) as it, vrs.connect(it.address) as far:
        begin = round(4.0 * far.now + 4.0) / 4.0
        with far.without_waiting():
            far.move(30, -90, 90, 0, 0, 0, at=begin)
            far.move(-30, -90, 90, 0, 0, 0)
            seen = far.preview()
            assert (seen.unconfirmed, len(seen.commands)) == (begin, 2), "nobody waited for an answer"
            assert seen.commands[0].text == f"MOVE #PPOINT(30, -90, 90, 0, 0, 0) AT {begin:g}"
            assert 0.3 <= seen.round_trip < 0.3 + SLOW
            assert seen.arrives == pytest.approx(far.now + seen.round_trip / 2.0, abs=SLOW)
            assert far.end < begin < seen.commands[1].begin < seen.timeline.end  # type: ignore[operator]
            assert seen.where().joints[0] == 0.0
        after = far.preview()
        assert (after.unconfirmed, after.commands) == (inf, ())
        times = np.linspace(begin, seen.timeline.end, 20)
        assert np.array_equal(seen.where(times).joints, far.where(times).joints), "it is what the robot does"
        with suppress(TooLate), far.without_waiting():
            far.move(0, -90, 90, 0, 0, 0, at=far.now + 0.1)
            (late,) = far.preview().commands
        assert isinstance(late.refused, TooLate)
        assert late.begin is None


async def sampled(client: Client, count: int) -> list[tuple[float, Sample]]:
    """So many samples at 50 Hz, with the time at which each is to be shown."""
    found: list[tuple[float, Sample]] = []
    async with aclosing(client.samples(50.0)) as samples:
        async for sample in samples:
            found.append((time.monotonic(), sample))
            if len(found) == count:
                break
    return found


@pytest.mark.long
def test_samples_over_a_line_with_jitter_come_in_order_and_no_sooner_than_most(robot: Serving) -> None:
    async def watch(address: str) -> None:
        client, arrived = Client(address, hello_of()), dict[float, float]()
        await client.open()
        client.far.news.append(lambda it: arrived.update({it.t: time.monotonic()}) if isinstance(it, Sample) else None)
        shown = await sampled(client, 30)
        await client.close()
        assert all(a.t < b.t for (_, a), (_, b) in pairwise(shown))
        assert all(at >= arrived[it.t] for at, it in shown)
        held = [at - arrived[it.t] for at, it in shown]
        assert max(held) > 0.05, "what came soon has waited"

    with behind(robot, 0.0, Gamma(0.12, 0.08)) as it:
        asyncio.run(watch(it.address))


def test_samples_of_a_robot_in_virtual_time_come_as_they_are_sent(tmp_path: Path) -> None:
    async def watch(address: str) -> None:
        client = Client(address, hello_of())
        await client.open()
        assert len(await sampled(client, 5)) == 5
        mirror = await client.follow()
        assert mirror.timeline.version == 0, "and then the timeline"
        await client.close()

    with serving(tmp_path, journal=False) as it:
        asyncio.run(watch(it.address))


def test_who_commands_with_the_delay_as_offset_is_never_too_late(robot: Serving) -> None:
    for offset, in_time in ((0.0, False), (-2.0, True)):
        with behind(robot, 0.1, 0.0) as it, it.call(hello=Hello((1,), offset=offset)) as caller:
            caller.protocol.send(Ping(0.0))
            caller.flush()
            pong = caller.until(lambda message: isinstance(message, Pong))
            assert isinstance(pong, Pong)
            assert caller.line(READY.format(5, f"{pong.clock + 0.01:.3f}")).ok is in_time


def test_a_robot_in_python_may_be_commanded_by_a_clock_that_is_behind(robot: Serving) -> None:
    with behind(robot, 0.1, 0.0) as it:
        with vrs.connect(it.address, behind=2.0) as far:
            until(lambda: far.now > 0.6)
            at = far.now - 0.5
            far.move([10, -90, 90, 0, 0, 0], at=at)
            assert far.commands[-1].executed == pytest.approx(at + 2.0)
            assert far.commands[-1].issued <= far.commands[-1].executed
        with vrs.connect(it.address) as near, pytest.raises(TooLate):
            near.move([0, -90, 90, 0, 0, 0], at=near.now - 0.5)
