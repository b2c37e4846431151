"""A body at a served robot, over real sockets: who may be it, what it is told, and what becomes of it after a cut."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from math import nan
from pathlib import Path
from random import Random

import pytest

from tests.live import PATIENCE, until
from tests.net.cable import cable
from tests.net.serving import serving
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import RequestRefused, RoleWanted
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.net.body_client import BodyClient
from vrs_cli.net.client import Client, hello_of
from vrs_cli.net.messages import (
    Alarm,
    BodyOrder,
    BodyReleased,
    BodyStatus,
    Embodied,
    Embody,
    Hello,
    Line,
    Measured,
    MeasuredWindow,
    Measurements,
    Refused,
    ShownMeasured,
    Subscribe,
)
from vrs_cli.net.served_robot import MEASURED_SECONDS
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.net.stream import MAX_REMEMBERED, MeasuredTeller
from vrs_cli.net.tokens import add_tokens
from vrs_cli.trajectory.reports import CHUNK_REPORTS
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.measured import BodyMode, Report, ReportCounts
from vrs_cli.wire.codec import Encoding, encode

HELD = Hello((1,), name="arm")


async def so(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.005)


def run(story: Callable[[], Awaitable[None]]) -> None:
    async def told() -> None:
        await story()

    asyncio.run(told())


def test_a_body_follows_and_reports_and_others_see_it(tmp_path: Path) -> None:
    with serving(tmp_path, realtime=1.0) as it, it.call(hello=Hello((1,), name="eve")) as eve:
        eve.ask(lambda id: Subscribe(id, measured=True))
        eve.lines("SPEED 5")
        eve.send(lambda id: Line(id, "DO DRIVE 1, 90, 100"))

        async def story() -> None:
            async with BodyClient(it.address, rate=200.0) as body:
                n = 0
                await so(lambda: body.timeline.end > body.now() + 1.0)
                async for t in body.ticks():
                    joints, velocity, _ = body.setpoint(t)
                    body.report(t, joints, velocity)
                    n += 1
                    if n == 60:
                        break

        run(story)
        first = eve.until(lambda message: isinstance(message, Measurements))
        assert isinstance(first, Measurements)
        assert first.first == 0
        assert first.velocity is not None
        status = eve.until(lambda it: isinstance(it, BodyStatus) and it.body and not it.body.name)
        assert isinstance(status, BodyStatus)
        assert status.body is not None
        assert status.body.counts == ReportCounts(received=60)
        assert status.unknown == status.body.last
        shown = eve.ask(lambda id: MeasuredWindow(id, -1.0))
        assert isinstance(shown, ShownMeasured)
        assert sum(len(part.times) for part in shown.parts) == shown.told == 60
        body = it.hub.rooms["cell1"].session.body
        body_arm = it.hub.rooms["cell1"].session.engine.arm
        timeline = it.hub.rooms["cell1"].session.engine.timeline
        assert all(one.joints == joints_at(body_arm, timeline, one.t) for one in body.record.view)
        assert body.record.view[-1].joints != body.record.view[0].joints


def test_a_second_body_is_refused_with_the_name_of_the_first(tmp_path: Path) -> None:
    async def story() -> None:
        async with BodyClient(address, name="left"):
            with pytest.raises(RequestRefused, match="left is the body"):
                async with BodyClient(address, name="right"):
                    raise AssertionError
        async with BodyClient(address, name="right"):
            pass

    with serving(tmp_path, realtime=1.0) as it:
        address = it.address
        run(story)


def test_a_token_of_another_role_may_not_be_the_body(tmp_path: Path) -> None:
    tokens = tmp_path / "tokens.toml"
    body, other = (add_tokens(tokens, [role], role)[role] for role in ("body", "supervisor"))
    with serving(tmp_path, tokens=tokens, realtime=1.0) as it:
        address = it.address

        async def story() -> None:
            with pytest.raises(RoleWanted, match="role body"):
                async with BodyClient(address, other):
                    raise AssertionError
            async with BodyClient(address, body) as held:
                assert held.far.welcome is not None
                assert held.far.welcome.role == "body"

        run(story)
        with it.call(hello=Hello((1,), token=body)) as caller:
            assert not caller.line("DO MOVE #PPOINT(0)").ok


def test_what_is_measured_during_a_cut_comes_after_it_once(tmp_path: Path) -> None:
    with serving(tmp_path, realtime=1.0) as it, cable(it.address) as line:
        record = it.hub.rooms["cell1"].session.body.record

        async def story() -> None:
            async with BodyClient(line.url, rate=100.0) as body:
                n = 0

                def report() -> None:
                    nonlocal n
                    body.report(body.now() + n * 1e-4, body.setpoint(body.now()).joints)
                    n += 1

                for _ in range(3):
                    for _ in range(5):
                        report()
                    await so(lambda: len(record) == n)
                    line.shut()
                    await so(lambda: not body.far.open)
                    for _ in range(5):
                        report()
                    line.open()
                await so(lambda: len(record) == n)
                seen = it.hub.rooms["cell1"].session.body.view
                assert seen is not None
                assert (seen.counts.lost, seen.counts.late) == (0, 0)
                assert len(record) == n == 30

        run(story)


def test_an_order_and_a_change_come_to_the_body(tmp_path: Path) -> None:
    with serving(tmp_path, realtime=1.0) as it, it.call(hello=Hello((1,), name="eve")) as eve:
        held = it.hub.rooms["cell1"].session.body

        async def story() -> None:
            async with BodyClient(it.address) as body:
                changes = body.changes()
                await anext(changes)
                await asyncio.to_thread(eve.line, "DO DRIVE 1, 10, 100")
                while not isinstance(await anext(changes), TimelineDelta):
                    pass
                held.command(BodyMode.HOLDS, 7.0)
                while not isinstance(change := await anext(changes), BodyOrder):
                    pass
                assert (change.mode, change.at) == (BodyMode.HOLDS, 7.0)
                assert body.order == change
                held.leave("body")
                with pytest.raises(RequestRefused, match="the body no longer"):
                    async for _ in body.ticks():
                        pass

        run(story)


def test_a_process_that_begins_anew_is_the_body_again(tmp_path: Path) -> None:
    """Its old connection is gone, and may be resumed for a minute; the same client does not wait for that."""
    with serving(tmp_path, realtime=1.0) as it:
        arm = it.call(hello=HELD)
        assert isinstance(arm.ask(Embody), Embodied)
        with it.call(hello=HELD) as other:
            assert isinstance(other.ask(Embody), Refused)
            arm.cut()
            while not isinstance(answer := other.ask(Embody), Embodied):
                assert isinstance(answer, Refused)
        with it.call(hello=hello_of("", "third")) as third:
            assert isinstance(third.ask(Embody), Embodied)


def test_wrong_reports_are_refused_and_the_body_goes_on(tmp_path: Path) -> None:
    with serving(tmp_path, realtime=1.0) as it, it.call(hello=HELD) as arm:
        arm.ask(Embody)
        good = (0.0,) * 6

        def refused(times: tuple[float, ...], joints: tuple[tuple[float, ...], ...]) -> str:
            it.hub.rooms["cell1"].served_body._refused_at = -1e9  # a refusal is told once a second
            arm.protocol.send(Measured(first=0, times=times, joints=joints, sent=0.0))
            arm.flush()
            answer = arm.until(lambda message: isinstance(message, Refused))
            assert isinstance(answer, Refused)
            return str(answer.refusal.error())

        assert "a row of 6 numbers" in refused((0.0,), ((0.0,) * 5,))
        assert "for each of 2 times" in refused((0.0, 0.1), (good,))
        assert "times must rise, but 0.1 s comes after 0.2 s" in refused((0.2, 0.1), (good, good))
        assert "a report of 1e+06 s" in refused((1e6,), (good,))
        arm.socket.send(encode(Measured(first=0, times=(nan,), joints=(good,), sent=0.0), Encoding.MSGPACK))
        told = arm.until(lambda message: isinstance(message, Refused))
        assert isinstance(told, Refused)
        assert "$.times[0]" in str(told.refusal.error())
        arm.socket.send(f'{{"type":"measured","first":0,"times":{[0] * 5000},"joints":[],"sent":0}}')
        told = arm.until(lambda message: isinstance(message, Refused))
        assert isinstance(told, Refused)
        assert "length <= 2000" in str(told.refusal.error())
        assert len(it.hub.rooms["cell1"].session.body.record) == 0
        arm.protocol.send(Measured(first=0, times=(0.0,), joints=(good,), sent=0.0))
        arm.flush()
        answer = arm.ask(lambda id: MeasuredWindow(id, -1.0))
        assert isinstance(answer, ShownMeasured)
        assert answer.parts[0].times == (0.0,)


def test_a_mirror_has_what_was_measured_also_during_a_cut(tmp_path: Path) -> None:
    with serving(tmp_path, realtime=1.0) as it, cable(it.address) as line, it.call(hello=HELD) as arm:
        record = it.hub.rooms["cell1"].session.engine.measured
        arm.ask(Embody)

        def report(*times: float) -> None:
            rows = tuple((t, 0.0, 0.0, 0.0, 0.0, 0.0) for t in times)
            arm.protocol.send(Measured(first=arm.sent, times=times, joints=rows, sent=times[-1]))  # type: ignore[attr-defined]
            arm.sent += len(times)  # type: ignore[attr-defined]
            arm.flush()
            until(lambda: len(record) == arm.sent)  # type: ignore[attr-defined]

        arm.sent = 0  # type: ignore[attr-defined]
        report(0.1, 0.2)
        port = SocketPort.connect(line.url, hello_of())
        try:
            mirror = port.follow()
            assert [one.t for one in mirror.measured] == [0.1, 0.2]
            report(0.3, 0.4)
            until(lambda: mirror.measured == record.view)
            line.shut()
            until(lambda: not port.open)
            report(*(0.5 + 0.001 * n for n in range(1500)))
            report(*(2.5 + 0.001 * n for n in range(1500)))
            line.open()
            until(lambda: mirror.measured == record.view)
            report(4.5)
            until(lambda: mirror.measured == record.view)
            assert len(mirror.measured) == 3005
        finally:
            port.close()


def test_the_first_look_has_all_that_was_measured_before(tmp_path: Path) -> None:
    """News of the body that come while the client asks for it make it ask once more by itself."""
    with serving(tmp_path, realtime=1.0) as it:
        record, address = it.hub.rooms["cell1"].session.engine.measured, it.address

        async def story() -> None:
            async with BodyClient(address, rate=500.0) as body:
                for n in range(5000):
                    body.report(0.001 * n, body.setpoint(0.0).joints)
                await so(lambda: len(record) == 5000)
            client = Client(address, hello_of())
            await client.open()
            mirror = await client.follow()
            looking = asyncio.create_task(client.measure())
            await asyncio.sleep(0.0)
            for hear in client.far.news:
                hear(BodyStatus())
            await looking
            assert mirror.record.view == record.view
            await client.close()

        run(story)


def test_a_server_that_begins_anew_has_what_was_measured(tmp_path: Path) -> None:
    with serving(tmp_path, realtime=1.0) as it, it.call(hello=HELD) as arm:
        arm.ask(Embody)
        arm.protocol.send(Measured(first=0, times=(7.5, 8.5), joints=((0.5,) * 6,) * 2, sent=8.5))
        arm.flush()
        until(lambda: len(it.hub.rooms["cell1"].session.engine.measured) == 2)
    with serving(tmp_path, realtime=1.0) as it:
        engine = it.hub.rooms["cell1"].session.engine
        assert [one.t for one in engine.measured.view] == [7.5, 8.5]
        assert engine.clock.reached >= 8.5


def test_body_tells_who_is_the_body_and_a_supervisor_releases_it(tmp_path: Path) -> None:
    with serving(tmp_path, realtime=1.0) as it, it.call(hello=HELD) as arm, it.call() as eve:
        arm.ask(Embody)
        eve.lines("BODY", "BODY RELEASE")
        arm.until(lambda message: isinstance(message, BodyReleased))
        assert "arm is the body no longer" in eve.said[-1]
        assert not eve.line("BODY RELEASE").ok
        assert isinstance(eve.ask(Embody), Embodied)


def test_a_slow_viewer_is_told_no_old_reports_and_holds_nobody() -> None:
    teller = MeasuredTeller()
    for number in range(100_000):
        teller.take([Report(number * 0.01, (0.0,))], heard=True)
        if number % 50 == 49:
            teller.gather()
    batches = teller.after(0)
    assert sum(len(batch.message.times) for batch in batches) <= MAX_REMEMBERED + 50
    assert batches[-1].end == teller.count == 100_000
    assert batches[-1].message.first == 99_950


def test_who_comes_later_hears_of_an_alarm_that_lasts(tmp_path: Path) -> None:
    random = Random(1)
    with serving(tmp_path) as it, it.call(hello=HELD) as arm:
        engine = it.hub.rooms["cell1"].session.engine
        arm.ask(Embody)
        for first, off in ((0, 0.0), (300, 0.1)):
            times = tuple(0.02 * (first + k + 1) for k in range(100 if off else 300))
            joints = tuple(tuple(q + off + random.gauss(0.0, 1e-4) for q in engine.position().joints) for _ in times)
            arm.protocol.send(Measured(first=first, times=times, joints=joints, sent=times[-1]))
            arm.flush()
        told = arm.until(lambda message: isinstance(message, Alarm))
        with it.call() as late:
            heard = late.until(lambda message: isinstance(message, Alarm))
            assert isinstance(heard, Alarm)
            assert isinstance(told, Alarm)
            assert heard.alarm == told.alarm
            late.lines("WHERE")
            assert "the body is not where the timeline says" in late.said[0]


def test_a_server_keeps_the_last_hour_in_memory_and_all_in_the_journal(tmp_path: Path) -> None:
    with serving(tmp_path, realtime=1.0) as it:
        record = it.hub.rooms["cell1"].session.engine.measured
        for begin in range(0, 8000, 100):
            record.add([Report(float(t), (0.1,) * 6) for t in range(begin, begin + 100)])
        seen = record.view
        assert seen.start is not None
        assert 8000 - MEASURED_SECONDS - CHUNK_REPORTS <= seen.start <= 8000 - MEASURED_SECONDS
        assert seen.end == 7999.0
    (journal,) = (tmp_path / "journal").glob("*.vrst")
    kept = read_trajectory(journal).measured
    assert (len(kept), kept.start, kept.end) == (8000, 0.0, 7999.0)
    with serving(tmp_path, realtime=1.0) as it:
        again = it.hub.rooms["cell1"].session.engine.measured.view
        assert (again.start, again.end) == (seen.start, seen.end)
