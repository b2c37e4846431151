"""A robot that is served is the robot that `vrs.Robot` is: over real sockets, with cuts."""

from __future__ import annotations

import asyncio
import gc
import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from random import Random
from threading import Timer

import numpy as np
import pytest

import vrs_cli as vrs
from tests.interfaces.holders.holder import Holder
from tests.live import PATIENCE, until
from tests.net.cable import Cable, cable
from tests.net.serving import Serving, serving
from vrs_cli.errors import RequestRefused
from vrs_cli.net.messages import LeaseAct
from vrs_cli.net.socket_port import Loop, SocketPort
from vrs_cli.net.stream import SEGMENTS
from vrs_cli.values.commands import JointOffsetTarget, Move

DOWN = (0, -45, 180, 0, 45, 0)
PART = vrs.trans(300, 450, -200, 90, 90, 0)
TILTED = PART @ vrs.trans(1.1, 2.2, -33.3)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Serving]:
    with serving(tmp_path_factory.mktemp("served"), tuple(f"cell{k}" for k in range(20))) as it:
        yield it


@pytest.fixture
def robot(served: Serving, request: pytest.FixtureRequest) -> Iterator[vrs.Robot]:
    """One that nobody has moved yet."""
    left = request.config.stash.setdefault(CELLS, list(range(20)))
    with vrs.connect(f"{served.address}/robots/cell{left.pop()}") as it:
        yield it


CELLS = pytest.StashKey[list[int]]()


def port_of(robot: vrs.Robot) -> SocketPort:
    port = robot.held.port
    assert isinstance(port, SocketPort)
    return port


def both(robot: vrs.Robot) -> tuple[vrs.Robot, vrs.Robot]:
    return robot, vrs.Robot()


def test_motions_are_those_of_a_robot_here_to_the_bit(robot: vrs.Robot) -> None:
    for one in both(robot):
        one.move(*DOWN).moves(PART, at=1.0).move(TILTED, speed=37).undo().redo()
        one.wait()
    here = vrs.Robot().move(*DOWN).moves(PART, at=1.0).move(TILTED, speed=37)
    assert list(robot.timeline) == list(here.timeline)
    assert repr(robot) == repr(here.wait())
    assert robot.commands == here.commands
    assert np.array_equal(robot.sample(50).joints, here.sample(50).joints)
    assert repr(robot.fk()) == repr(here.fk())
    assert repr(robot.ik(PART)) == repr(here.ik(PART))


def test_a_past_that_is_not_kept_here_is_asked_for(robot: vrs.Robot) -> None:
    robot.move(*DOWN)
    for _ in range(20):
        robot.move(TILTED).moves(PART)
    robot.wait()
    where = port_of(robot).client.url
    times = np.array([robot.end, 0.3, robot.end - 0.5, -1.0, 7.25])
    with vrs.connect(where, window=2.0) as short:
        assert 0.0 < robot.end - 7.0 < short.timeline.start < robot.end - 2.0
        assert short.end == robot.end
        for one in ("joints", "velocity", "acceleration", "location", "hand"):
            assert repr(getattr(short.where(times), one)) == repr(getattr(robot.where(times), one))
        assert repr(short.where(0.3)) == repr(robot.where(0.3))
        robot.undo(40)
        until(lambda: short.now == robot.now)
        assert repr(short.where()) == repr(robot.where()), "its clock is where it was before them"


def test_lines_are_answered_as_here(robot: vrs.Robot) -> None:
    here = vrs.Robot()
    for line in ("SPEED 50", "WHERE", "MOVE #PPOINT(0,-45,180,0,45,0)", "TIMELINE", "WHERE AT 0.3", "x = 3", "x + 1"):
        far, near = robot.do(line), here.do(line)
        assert far == near, line
        assert repr(far) == repr(near)


def test_a_text_at_the_prompt(robot: vrs.Robot) -> None:
    text = ".PROGRAM three()\n  TYPE 3\n.END\nEXECUTE three\nMOVEE a\n.PROGRAM open()\n"
    replies = [one.prompt(text).text for one in both(robot)]
    assert replies[0] == replies[1]
    assert robot.prompt("WHERE").ok, "the program that was left is forgotten"


def test_others_see_it_move(robot: vrs.Robot) -> None:
    heard: list[vrs.Change] = []
    came = threading.Event()

    def hear(change: vrs.Change) -> None:
        heard.append(change)
        if len(heard) == 3:
            came.set()

    with vrs.connect(port_of(robot).client.url, name="viewer") as viewer:
        end = viewer.subscribe(hear)
        robot.move(*DOWN).move(PART)
        assert came.wait(PATIENCE)
        end()
        assert [change.version for change in heard] == [0, 1, 2]
        assert viewer.timeline == robot.timeline
        assert viewer.now == robot.now
        assert viewer.commands == robot.commands
        with vrs.connect(port_of(robot).client.url) as late:
            assert late.now == robot.now
        with pytest.raises(vrs.VrsError, match="drives"):
            viewer.move(*DOWN)
        viewer.held.drive(LeaseAct.ASK)
        with pytest.raises(vrs.VrsError, match="drives"):
            viewer.held.drive(LeaseAct.ACQUIRE)
        robot.held.drive(LeaseAct.GIVE, "viewer")
        viewer.move(*DOWN)
        with pytest.raises(vrs.VrsError, match="viewer drives"):
            robot.move(*DOWN)
        viewer.held.drive(LeaseAct.RELEASE)
        robot.undo()
        viewer.abort()
        looks = viewer.watch(rate=500.0)
        assert repr(next(looks).xyz) == repr(robot.where().xyz)


def connected(robot: vrs.Robot) -> None:
    until(lambda: port_of(robot).open)


def test_it_comes_back_after_a_cut(robot: vrs.Robot, caplog: pytest.LogCaptureFixture) -> None:
    with cable(port_of(robot).client.url) as to_it, vrs.connect(to_it.url) as afar:
        for k in range(8):
            to_it.pull()
            robot.move(10.0 * k, *DOWN[1:])
            with suppress(RequestRefused):
                afar.commands  # noqa: B018
            connected(afar)
            assert len(afar.commands) == k + 1
            assert afar.timeline == robot.timeline
        assert to_it.carried == 9
    assert "it is tried again" in caplog.text


def test_what_a_cut_interrupts_is_done_once_or_not_at_all(robot: vrs.Robot) -> None:
    """Whoever is told that it was not done may do it again."""
    done, refused, chance = 0, 0, Random(1)
    with cable(port_of(robot).client.url) as to_it, vrs.connect(to_it.url) as afar:
        robot.leave()
        with pytest.raises(RequestRefused, match="it was let go"):
            robot.move(*DOWN)
        while done < 40 or not refused:
            if chance.random() < 0.3:
                Timer(chance.uniform(0.0, 0.003), to_it.pull).start()  # some come in the middle of a motion
            try:
                afar.move(float(done % 90), *DOWN[1:])
                done += 1
            except RequestRefused:
                refused += 1
                connected(afar)
        connected(afar)
        assert len(afar.commands) == done


def test_a_request_behind_another_is_not_sent_after_a_cut(tmp_path: Path) -> None:
    """Both are told: the first what became of it, the second that it was not done."""
    with serving(tmp_path, realtime=1.0) as served, cable(served.address) as to_it:
        session = served.hub.rooms["cell1"].session
        robot = vrs.connect(to_it.url)
        ends: list[object] = []

        def ask(line: str) -> None:
            try:
                ends.append(robot.do(line))
            except RequestRefused as refused:
                ends.append(refused.detail)

        robot.define(".PROGRAM slow()\n  WAIT SIG(1001)\n.END\n")
        first, second = (threading.Thread(target=ask, args=(line,)) for line in ("EXECUTE slow", "a = 2"))
        first.start()
        until(lambda: session.running)
        talking = robot.held._conversation.lock
        second.start()
        until(lambda: talking.locked() and second.is_alive())
        to_it.pull()
        until(lambda: to_it.carried == 2)
        with vrs.connect(served.address) as other:
            other.abort()
        first.join(PATIENCE)
        second.join(PATIENCE)
        assert ends[1] == "the connection was cut before its turn came: it was not sent"
        robot.leave()


def of_vrs() -> Iterator[threading.Thread]:
    """Its threads: the server, which is in this process too, may begin some of asyncio's."""
    return (thread for thread in threading.enumerate() if thread.name.startswith("vrs "))


def test_a_robot_that_nobody_holds_leaves_nothing_behind(served: Serving) -> None:
    before = set(of_vrs())
    robot = vrs.connect(f"{served.address}/robots/cell0")
    robot.subscribe(lambda _change: None)
    threads = set(of_vrs()) - before
    assert len(threads) == 2
    del robot
    gc.collect()
    for thread in threads:
        thread.join(PATIENCE)
        assert not thread.is_alive()


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("ws://127.0.0.1:1", "does not answer: connection refused"),
        ("ws://robot.invalid", "does not answer: "),
        ("http://127.0.0.1", "is no address of a robot"),
    ],
)
def test_what_cannot_be_reached_is_told(url: str, said: str) -> None:
    with pytest.raises(vrs.VrsError, match=said):
        vrs.connect(url)


def test_an_address_of_many_places_is_told_in_one_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """As localhost, which is ::1 and 127.0.0.1."""
    places = [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (f"127.0.0.{k}", 1)) for k in (1, 2)]
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_args, **_options: places)
    assert why_not("ws://localhost:1") == (
        "ws://localhost:1 does not answer: connection refused",
        "is the server running? vrs serve",
    )


def why_not(url: str, ca: Path | None = None) -> tuple[str, str]:
    with pytest.raises(RequestRefused) as told:
        vrs.connect(url, ca=ca)
    return told.value.detail, told.value.hint


HTTP_1 = "HTTP/1.1 {}\r\nContent-Length: {}\r\n\r\n{}"


@pytest.mark.parametrize(
    ("said", "why", "hint"),
    [
        (b"220 mail ready\r\n", "does not answer: no HTTP comes from there", "is it a server with TLS? wss:"),
        (b"", "does not answer: no HTTP comes from there", "is it a server with TLS? wss:"),
        (HTTP_1.format("401 Unauthorized", 0, "").encode(), "answers 401 Unauthorized", "is it a robot?"),
        (HTTP_1.format("403 Forbidden", 8, "<html/>\n").encode(), "answers 403 Forbidden", "is it a robot?"),
        (HTTP_1.format("503 Full", 8, "no room\n").encode(), "answers 503 Full", "no room"),
        (b"HTTP/1.1 101 Switching Protocols\r\n\r\n", "missing Connection header", "is it a robot?"),
    ],
)
def test_another_server_is_told(said: bytes, why: str, hint: str) -> None:
    with talker(said) as port:
        told = why_not(f"ws://127.0.0.1:{port}")
    assert why in told[0]
    assert told[1].startswith(hint)


@contextmanager
def talker(said: bytes) -> Iterator[int]:
    """A server that says this once, whatever it hears, and hangs up."""
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def dialogue() -> None:
            caller, _ = listening.accept()
            with caller:
                caller.recv(4096)
                caller.sendall(said)

        talking = threading.Thread(target=dialogue)
        talking.start()
        yield listening.getsockname()[1]
        talking.join()


def test_tls_where_there_is_none_is_told(served: Serving) -> None:
    safe = served.address.replace("ws:", "wss:")
    why, hint = why_not(safe)
    assert why.startswith(f"{safe} does not answer: ")
    assert hint == f"is it a server without TLS? {served.address}"
    with talker(b"220 mail ready\r\n") as port:
        assert why_not(f"wss://127.0.0.1:{port}") == (
            f"wss://127.0.0.1:{port} does not answer: no TLS (wrong version number)",
            f"is it a server without TLS? ws://127.0.0.1:{port}",
        )


def test_a_place_that_the_server_has_not_is_told(served: Serving) -> None:
    url = f"{served.address}/cell0"
    assert why_not(url) == (f"{url} answers 404 Not Found", "/robots/NAME is the address of a robot")


def test_a_name_that_cannot_be_one_is_told() -> None:
    why, hint = why_not(f"ws://{'a' * 70}:1")
    assert why.startswith(f"ws://{'a' * 70}:1 does not answer: ")
    assert hint == "ws://HOST:PORT"


@pytest.mark.skipif(find_spec("python_socks") is not None, reason="a SOCKS proxy can be used here")
def test_a_proxy_that_cannot_be_used_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("socks_proxy", "socks5://127.0.0.1:1")
    monkeypatch.delenv("no_proxy", raising=False)
    why, hint = why_not("ws://robot.invalid:1")
    assert "python-socks" in why
    assert hint == "a proxy of the environment wants it"


def test_a_robot_that_is_not_there_is_told(served: Serving) -> None:
    with pytest.raises(RequestRefused, match="there is no robot none"):
        vrs.connect(f"{served.address}/robots/none")


def test_a_long_past_comes_in_parts(served: Serving) -> None:
    """The first snapshot of it is of its end; all of it is there when the robot is."""
    with vrs.connect(f"{served.address}/robots/cell0") as robot:
        room = served.hub.rooms["cell0"]
        engine = room.session.engine

        def many(_session: object) -> None:
            for k in range(800):
                engine.perform(Move(JointOffsetTarget(1, 0.01 if k % 2 else -0.01), False))

        Holder(room.session).call(many).result(PATIENCE)
        with vrs.connect(port_of(robot).client.url) as late:
            assert len(late.timeline) > SEGMENTS
            assert late.timeline == engine.timeline
        assert len(robot.commands) == 800
        assert robot.timeline == engine.timeline


def press_ctrl_c() -> None:
    signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)


def test_ctrl_c_stops_what_is_waited_for_and_a_second_one_waits_no_longer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with serving(tmp_path, realtime=1.0) as served:
        to_it, session, heard = Cable(served.address), served.hub.rooms["cell1"].session, threading.Event()
        robot = vrs.connect(to_it.url)
        port = port_of(robot)
        tell, take, waits = port.tell, port.take, threading.Event()
        monkeypatch.setattr(port, "tell", lambda message: (tell(message), heard.set()))
        monkeypatch.setattr(port, "take", lambda inbox: (waits.set(), take(inbox))[1])
        robot.define(".PROGRAM slow()\n  WAIT SIG(1001)\n.END\n")

        def press_once() -> None:
            until(lambda: session.running and waits.is_set())
            press_ctrl_c()

        def press_twice() -> None:
            until(lambda: session.running and waits.is_set())
            to_it.freeze()
            press_ctrl_c()
            heard.wait(PATIENCE)
            press_ctrl_c()

        def press_without_a_connection() -> None:
            until(lambda: session.running and waits.is_set())
            to_it.close()
            until(lambda: not port.open)
            press_ctrl_c()

        for press in (press_once, press_twice):
            heard.clear()
            waits.clear()
            threading.Thread(target=press).start()
            with pytest.raises(KeyboardInterrupt):
                robot.execute("slow")
            if press is press_once:
                assert robot["1 + 1"] == 2.0
        to_it.pull()
        until(lambda: port.cuts and port.open)
        robot.abort()
        waits.clear()
        threading.Thread(target=press_without_a_connection).start()
        with pytest.raises(KeyboardInterrupt):
            robot.execute("slow")
        robot.leave()


def test_who_runs_another_loop_may_let_it_go(served: Serving) -> None:
    """As a notebook does."""

    async def let_go() -> None:
        vrs.connect(f"{served.address}/robots/cell0").leave()

    before = set(of_vrs())
    asyncio.run(let_go())
    assert set(of_vrs()) <= before


def test_who_asks_while_a_loop_ends_does_not_wait_for_ever() -> None:
    loop, begun, held, done = Loop(), threading.Event(), threading.Event(), list[str]()

    def hold() -> None:
        begun.set()
        held.wait()

    def ask() -> None:
        with suppress(RequestRefused):  # either is right: it has asked while the loop was there
            loop.do(lambda: done.append("done"))

    loop.soon(hold)
    begun.wait()
    there = len(loop._loop._ready)  # type: ignore[attr-defined]
    asking, ending = (threading.Thread(target=act, daemon=True) for act in (ask, loop.close))
    for count, thread in enumerate((asking, ending), there + 1):
        thread.start()
        while len(loop._loop._ready) < count:  # type: ignore[attr-defined]
            time.sleep(0.0)
    held.set()
    asking.join(PATIENCE)
    ending.join(PATIENCE)
    assert (asking.is_alive(), ending.is_alive()) == (False, False)
    with pytest.raises(RequestRefused, match="let go"):
        loop.do(lambda: done.append("too late"))
    assert done in ([], ["done"])


def test_who_looks_waits_for_no_other_thread(robot: vrs.Robot) -> None:
    held, going = robot.held, threading.Event()
    port_of(robot)._loop.soon(going.wait)
    try:
        assert held.preview_now().timeline is held.timeline
    finally:
        going.set()
    robot.leave()
    with pytest.raises(RequestRefused, match="it was let go"):
        held.preview_now()
