"""Robots over NATS: with a real nats-server (Debian's package of that name), or the tests say that there is none."""

from __future__ import annotations

import asyncio
import json
import shutil
import socket
import subprocess
import sys
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import vrs_cli as vrs
from tests.examples import some
from tests.interfaces.holders.holder import Holder
from tests.live import PATIENCE, until
from tests.net.edits import Edits
from tests.net.serving import Serving, serving
from tests.net.test_mirror import bits
from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces.roles.supervisor import Observer
from vrs_cli.net.nats import TAIL, PublishedRobot, Publisher

SERVER = shutil.which("nats-server") or "/usr/sbin/nats-server"

pytestmark = pytest.mark.skipif(not Path(SERVER).exists(), reason="no nats-server: apt-get install nats-server")


@contextmanager
def nats_server(folder: Path, port: int = -1) -> Iterator[str]:
    """A nats-server of our own, at any port that is free."""
    folder.mkdir(exist_ok=True)
    command = [SERVER, "-a", "127.0.0.1", "-p", str(port), "-js", "-sd", str(folder), "--ports_file_dir", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as running:
        told = folder / f"nats-server_{running.pid}.ports"
        until(lambda: told.exists() and told.read_bytes().endswith(b"}"))
        yield json.loads(told.read_text())["nats"][0]
        running.terminate()


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with nats_server(tmp_path_factory.mktemp("nats")) as it:
        yield it


@pytest.fixture
def published(url: str, tmp_path: Path) -> Iterator[Serving]:
    with serving(tmp_path, journal=False) as served:
        loop, told = served.loop, list[str]()
        assert loop is not None

        async def publish() -> Publisher:
            publisher = Publisher(url, told.append)
            await publisher.open()
            publisher.add(served.hub.rooms["cell1"])
            return publisher

        publisher = asyncio.run_coroutine_threadsafe(publish(), loop).result(PATIENCE)
        yield served
        asyncio.run_coroutine_threadsafe(publisher.close(), loop).result(PATIENCE)
        assert not told


async def caught_up(watching: PublishedRobot, served: Serving) -> None:
    stream = served.hub.rooms["cell1"].broadcast.stream
    async with asyncio.timeout(PATIENCE):
        while watching.mirror.seq != stream.number or watching.mirror.timeline.version != stream.timeline.version:
            await asyncio.sleep(0.01)


async def soon(opened: Coroutine[Any, Any, object]) -> None:
    async with asyncio.timeout(PATIENCE):
        await opened


def edit(served: Serving, edits: Edits, times: int) -> None:
    room = served.hub.rooms["cell1"]
    Holder(room.session).call(lambda _session: [edits.edit() for _ in range(times)]).result(PATIENCE)
    until(lambda: room.broadcast.stream.timeline == room.session.engine.timeline)


def test_who_comes_early_or_late_sees_the_robot_to_the_bit(url: str, published: Serving) -> None:
    session = published.hub.rooms["cell1"].session
    edits = Edits(4, session.engine, session.branches)

    async def watch() -> None:
        early = await PublishedRobot.open(url, "cell1")
        await asyncio.to_thread(edit, published, edits, some(200))
        late = await PublishedRobot.open(url, "cell1")
        await asyncio.to_thread(edit, published, edits, some(100))
        for watching in (early, late):
            await caught_up(watching, published)
            assert bits(watching.mirror.timeline) == bits(session.engine.timeline)
            assert watching.mirror.now == session.engine.now
            await watching.close()

    asyncio.run(watch())


@pytest.mark.long
def test_a_beginning_is_kept_however_long_it_goes_on(url: str, published: Serving) -> None:
    """The stream keeps the end of what was said, with a snapshot in it."""
    session = published.hub.rooms["cell1"].session
    edits = Edits(5, session.engine, session.branches)

    async def watch() -> None:
        number = published.hub.rooms["cell1"].broadcast.stream
        while number.number < 2 * TAIL:
            await asyncio.to_thread(edit, published, edits, 100)
        late = await PublishedRobot.open(url, "cell1")
        await caught_up(late, published)
        assert bits(late.mirror.timeline) == bits(session.engine.timeline)
        await late.close()

    asyncio.run(watch())


def test_what_is_not_there_is_told(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.net.nats.OPENING", 1.0)
    with pytest.raises(RequestRefused, match="no robot none is published there"):
        asyncio.run(PublishedRobot.open(url, "none"))


@pytest.mark.parametrize(
    ("address", "why"),
    [
        ("nats://127.0.0.1:1", "connection refused"),
        ("nats://nats.invalid:4222", ""),
        ("nats://[::", "nats: invalid connect url option"),
    ],
)
def test_an_address_that_refuses_is_told_at_once(address: str, why: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.net.nats.OPENING", 1e6)
    for opened in (Publisher(address, print).open, partial(PublishedRobot.open, address, "cell1")):
        with pytest.raises(RequestRefused, match=f"NATS does not answer: {why}"):
            asyncio.run(soon(opened()))


def test_who_answers_nothing_is_waited_for_no_longer_than_that(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.net.nats.OPENING", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"nats://127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(RequestRefused, match="NATS does not answer: nothing came"):
            asyncio.run(Publisher(address, print).open())


def test_a_server_publishes_what_it_serves(url: str) -> None:
    command = [sys.executable, "-m", "vrs_cli", "serve", "--port", "0", "--robot", "a=puma560", "--nats", url]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        address = running.stdout.readline().split()[2].rstrip(",")

        async def watch() -> str:
            watching = await PublishedRobot.open(url, "a")
            await asyncio.to_thread(lambda: vrs.connect(address).move(0, -45, 180, 0, 45, 0))
            async with asyncio.timeout(PATIENCE):
                while watching.mirror.timeline.version < 1:
                    await asyncio.sleep(0.01)
            shown = repr(Observer(watching.mirror).at(0.5))
            await watching.close()
            return shown

        assert asyncio.run(watch()) == repr(Observer(vrs.Robot().move(0, -45, 180, 0, 45, 0).held).at(0.5))
        running.terminate()
        assert running.wait(PATIENCE) == 0
        assert running.stderr is not None
        assert running.stderr.read() == "vrs serve: ended\n"


@pytest.mark.long
def test_a_server_without_its_nats_does_not_start() -> None:
    command = [sys.executable, "-m", "vrs_cli", "serve", "--port", "0", "--nats", "nats://127.0.0.1:1"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert ended.returncode != 0
    assert ended.stderr.startswith("vrs serve: *Request refused* nats://127.0.0.1:1: NATS does not answer")
    assert ended.stderr.count("\n") == 1


def test_it_goes_on_when_nats_is_there_again(tmp_path: Path) -> None:
    """Nothing that it kept is left, and all is right again."""
    told = list[str]()

    async def watch(served: Serving) -> None:
        room = served.hub.rooms["cell1"]
        edits = Edits(6, room.session.engine, room.session.branches)
        loop = served.loop
        assert loop is not None
        with nats_server(tmp_path / "one") as url:
            publisher = Publisher(url, told.append)
            await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(publisher.open(), loop))
            loop.call_soon_threadsafe(publisher.add, room)
            watching = await PublishedRobot.open(url, "cell1")
            await asyncio.to_thread(edit, served, edits, 20)
            await caught_up(watching, served)
        await asyncio.to_thread(edit, served, edits, 20)
        with nats_server(tmp_path / "two", int(url.rpartition(":")[2])):
            await caught_up(watching, served)
            await asyncio.to_thread(edit, served, edits, 20)
            await caught_up(watching, served)
            assert bits(watching.mirror.timeline) == bits(room.session.engine.timeline)
            await watching.close()
            await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(publisher.close(), loop))

    with serving(tmp_path, journal=False) as served:
        asyncio.run(watch(served))
    assert ["; it is tried again" in text for text in told] == [True, False]
