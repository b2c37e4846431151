"""A robot that is served, without sockets: who drives as time passes, what programs may take, who hears what."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.live import until
from tests.net.serving import said_in
from vrs_cli.errors import DeviceNotReady, FileError
from vrs_cli.interfaces.dialogue import quietly
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.words.word import Role
from vrs_cli.net.client_session import MAX_PENDING_QUESTIONS, ClientSession
from vrs_cli.net.durable_log import Audit
from vrs_cli.net.limits import Allowance
from vrs_cli.net.messages import (
    Abort,
    Answer,
    Asked,
    At,
    Check,
    ClientMessage,
    Complete,
    Completed,
    Done,
    Drag,
    Drive,
    FromServer,
    Hello,
    LeaseAct,
    Line,
    Located,
    Positions,
    Pulled,
    Refused,
    ServerMessage,
    Shown,
    Status,
    Told,
    Who,
    Window,
)
from vrs_cli.net.protocol import ServerConnection
from vrs_cli.net.room import Room
from vrs_cli.net.served_robot import Plan, WhenGone
from vrs_cli.net.stream import MessageForm, Packet
from vrs_cli.net.tokens import OPEN, Grant
from vrs_cli.values.acts import Go, Goal, StopProgram
from vrs_cli.values.hand import Axis, Frame, Press, StopJog
from vrs_cli.wire.codec import Encoding, Reader, encode

_reader: Reader[FromServer] = Reader(FromServer)


class Wire:
    """A socket that keeps what is sent. `alive`: it answers pings."""

    deflates, address, waiting = False, "10.0.0.7:1", 0

    def __init__(
        self,
        room: Room,
        name: str,
        wall: Callable[[], float],
        *,
        attended: bool = False,
        answers: bool = False,
        grant: Grant = OPEN,
    ) -> None:
        self.connection = ServerConnection(wall())
        self.heard: list[ServerMessage] = []
        self.pings, self.alive = 0, True
        self.room, self.ids = room, 0
        hello = Hello((1,), name=name, attended=attended, answers=answers)
        self.connection.receive(encode(hello, Encoding.JSON), wall())
        self.client: ClientSession = room.enter(grant, hello, self)

    @property
    def sink(self) -> Wire:
        return self

    def send(self, *packets: Packet) -> None:
        """What all hear."""

    def flush(self) -> None:
        self.heard += [_reader.read(frame) for frame in self.connection.frames()]

    def ping(self) -> None:
        self.pings += 1
        if self.alive:
            self.client.beat()

    def command(self, text: str, until: float | None = None) -> int:
        self.ids += 1
        (line,) = self.connection.receive(encode(Line(self.ids, text, until=until), Encoding.JSON), 0.0)
        self.client.receive(line)
        return self.ids

    def line(self, text: str, until: float | None = None) -> Done:
        id = self.command(text, until)
        self.until(lambda: any(isinstance(one, Done) and one.id == id for one in self.heard))
        return next(one for one in self.heard if isinstance(one, Done) and one.id == id)

    def until(self, there: Callable[[], object]) -> None:
        def pumped() -> object:
            self.room.pump()
            self.flush()  # as a server does after each message
            return there()

        until(pumped)

    @property
    def said(self) -> list[str]:
        return said_in(self.heard)


class Feed:
    """Somebody who takes whatever is broadcast."""

    waiting = 0

    def send(self, *packets: Packet) -> None:
        """It is gone."""


class Served:
    def __init__(self, folder: Path, plan: dict[str, Any]) -> None:
        self.now = 100.0
        self.told: list[str] = []
        audit = Audit(None, time.time, self.told.append)
        full = Plan(load_robot("puma560"), folder / "files", folder / "cell1.vrst", **plan)
        self.room = Room("cell1", full, lambda: None, audit, self.told.append, lambda _: ("cell1",), lambda: self.now)

    def call(self, name: str, **options: Any) -> Wire:
        return Wire(self.room, name, lambda: self.now, **options)

    @property
    def version(self) -> int:
        return self.room.session.engine.timeline.version

    def goes_on(self) -> None:
        """Wait until the robot has done more."""
        before = self.version

        def more() -> bool:
            self.room.tick()
            return self.version > before + 10

        until(more)

    @property
    def paused(self) -> bool:
        """Whether nothing happens while the robot takes many requests, each in a step of its own."""
        engine, room = self.room.session.engine, self.room
        seen = {
            room._self.put(quietly(lambda: (engine.timeline.version, engine.clock.reached))).result() for _ in range(20)
        }
        return len(seen) == 1

    def pass_time(self, seconds: float) -> None:
        for _ in range(int(seconds / 0.5)):
            self.now += 0.5
            self.room.tick()
            self.room.pump()


@contextmanager
def served(folder: Path, **plan: Any) -> Iterator[Served]:
    it = Served(folder, plan)
    try:
        yield it
    finally:
        it.room.close()
        assert it.told == []


def waits(wire: Wire, message: ClientMessage | None = None) -> float:
    """How long a request of its is to wait [s]."""
    return wire.client.wait(message or Who(1))


# --- what is refused, and to whom what is said belongs ---


def test_every_line_of_a_program_that_was_refused_is_refused(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, bob = it.call("ada"), it.call("bob")
        assert ada.line("x = 1").ok
        for line in (".PROGRAM zz()", "x = 2", "TYPE x", ".END"):
            assert not bob.line(line).ok
        assert any("1 line of zz dropped" in said for said in bob.said)
        assert bob.line("WHERE").ok, ".END has ended it"
        assert not it.room.session.programs
        for line in (".PROGRAM mine()", "x = 2", ".END"):
            assert ada.line(line).ok


def test_what_is_said_while_a_line_is_carried_out_bears_its_id(tmp_path: Path) -> None:
    with served(tmp_path, realtime=1.0, causality="POSTPONE") as it:
        ada = it.call("ada")
        assert ada.line("DRIVE 1, 90, 10").ok
        for line in ("DRIVE 1, 5, 100 AT 0", "SPEED 50"):
            ada.line(line)
        (late,) = (one for one in ada.heard if isinstance(one, Told) and "postponed" in str(one.reply))
        assert late.id == ada.ids - 1
        ada.client.receive(At(90, Go(Goal(joint=1, change=0.1), executed=0.0)))
        ada.until(lambda: any(isinstance(one, Done) and one.id == 90 for one in ada.heard))
        assert [one.id for one in ada.heard if isinstance(one, Told) and "postponed" in str(one.reply)][1:] == [90]


def test_letting_go_of_a_key_is_for_who_drives(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, bob = it.call("ada"), it.call("bob")
        assert ada.line("x = 1").ok
        bob.client.receive(At(1, StopJog()))
        bob.until(lambda: any(isinstance(one, Done) for one in bob.heard))
        (done,) = (one for one in bob.heard if isinstance(one, Done))
        assert not done.ok
        assert done.refusal is not None
        assert "ada" in done.refusal.message


STEP = Press(Axis(Frame.JOINT, 0), 5.0, 20.0)


def ask(wire: Wire, act: Press | StopJog) -> Done:
    """Carry out the act of a button, and return how it has ended."""
    wire.ids += 1
    wire.client.receive(At(wire.ids, act))
    wire.until(lambda: any(isinstance(one, Done) and one.id == wire.ids for one in wire.heard))
    return next(one for one in wire.heard if isinstance(one, Done) and one.id == wire.ids)


def test_a_button_held_through_a_stop_and_a_change_of_the_lease_moves_nothing(tmp_path: Path) -> None:
    with served(tmp_path, realtime=1.0) as it:
        ada, bob = it.call("ada"), it.call("bob")
        assert ada.line("x = 1").ok
        assert not ask(bob, STEP).ok
        assert ada.line("ABORT").ok
        ada.client.receive(Drive(1, LeaseAct.RELEASE))
        before = it.version
        assert not ask(bob, STEP).ok
        assert it.version == before
        ask(bob, StopJog())
        assert ask(bob, STEP).ok
        assert it.version > before


def test_a_button_pressed_while_the_disk_is_full_moves_nothing_until_it_is_pressed_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with served(tmp_path, realtime=1.0) as it:
        ada = it.call("ada")

        def fail() -> None:
            raise FileError("the disk is full")

        with monkeypatch.context() as patch:
            patch.setattr(it.room.durable_log, "check", fail)
            refused = ask(ada, STEP).refusal
            assert refused is not None
            assert "the disk is full" in refused.message
        for _ in range(2):
            assert not ask(ada, STEP).ok
        assert it.version == 0
        assert ask(ada, StopJog()).ok
        assert ask(ada, STEP).ok


def test_a_button_held_through_a_cut_moves_nothing_until_it_is_pressed_anew(tmp_path: Path) -> None:
    with served(tmp_path, realtime=1.0) as it:
        ada = it.call("ada")
        assert ask(ada, STEP).ok
        before = it.version
        ada.client.attach(ada, Hello((1,)))  # the client has connected again
        refused = ask(ada, STEP).refusal
        assert refused is not None
        assert "the connection was lost" in refused.message
        assert it.version == before
        ask(ada, StopJog())
        assert ask(ada, STEP).ok


def test_each_stop_is_told_though_the_arm_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A page drops what its user has not sent yet."""
    with served(tmp_path) as it:
        ada = it.call("ada")
        told: list[object] = []
        monkeypatch.setattr(it.room.broadcast, "announce", told.append)
        for number in (1, 2):
            assert ada.line("ABORT").ok
            ada.until(lambda number=number: sum(isinstance(one, Pulled) for one in told) == number)
            (*_, pulled) = (one for one in told if isinstance(one, Pulled))
            assert pulled.state.why


def test_a_designer_stops_drags_and_slows_his_own_motions(tmp_path: Path) -> None:
    designer = Grant("", Role.DESIGNER)
    with served(tmp_path, realtime=1.0) as it:
        ada, bob = it.call("ada", grant=designer), it.call("bob", grant=designer)
        for line in ("SPEED 50", "DO SPEED 30 ALWAYS", "DRIVE 1, 90", "ABORT", "DRIVE 1, 90"):
            assert ada.line(line).ok, line
        pose = it.room.session.engine.position().T_world_tool
        ada.client.receive(Drag(pose))
        ada.until(lambda: it.room.session.pulled.by == "ada")
        ada.client.receive(Drag())
        assert ada.line("DRIVE 2, -40, 1").ok
        for line in ("ABORT", "SPEED 50"):
            assert not bob.line(line).ok, "ada drives"
        for message in (Abort(90), At(91, StopProgram())):
            bob.client.receive(message)
        bob.until(lambda: {90, 91} <= {one.id for one in bob.heard if isinstance(one, Done)})
        assert not any(one.ok for one in bob.heard if isinstance(one, Done))
        assert it.room.session.engine.end > it.room.session.engine.now, "her motion goes on"
        ada.client.receive(Abort(90))
        ada.until(lambda: any(isinstance(one, Done) and one.id == 90 for one in ada.heard))


def test_a_client_that_answers_nothing_is_refused_what_asks(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada = it.call("ada")
        assert ada.line("x = 1").ok
        done = ada.line("DELETER x")
        assert not done.ok
        assert any("Are you sure (Y/N)? is asked" in said for said in ada.said)
        assert not any(isinstance(one, Asked) for one in ada.heard)
        assert ada.line("TYPE x").ok


def test_a_part_of_a_long_timeline_says_where_it_begins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.net.stream.SEGMENTS", 5)
    with served(tmp_path) as it:
        ada = it.call("ada")
        for k in range(5):
            assert ada.line(f"DRIVE 1, {(-1) ** k}").ok
        for begin in (0.0, 1e6):
            ada.client.receive(Window(90, begin))
            ada.flush()
            (shown,) = (one for one in ada.heard if isinstance(one, Shown))
            ada.heard.remove(shown)
            assert shown.begin == it.room.session.engine.timeline[shown.snapshot.first].start
            assert begin > 0.0 or shown.begin > 0.0


# --- who drives ---


def test_who_is_there_keeps_the_lease_and_who_is_cut_loses_it(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, bob = it.call("ada"), it.call("bob")
        assert ada.line("x = 1").ok
        it.pass_time(60.0)
        assert ada.pings > 5
        assert it.room.driving.lease.holder == "ada"
        it.room.cut(ada.client, ada)
        it.pass_time(5.0)
        assert not bob.line("x = 2").ok
        it.pass_time(8.0)
        assert bob.line("x = 2").ok
        assert it.room.driving.lease.holder == "bob"
        it.pass_time(60.0)
        assert list(it.room.clients) == ["bob"], "nobody resumes ada's connection any more"


def test_who_gives_the_lease_back_drives_no_more_and_another_drives_at_once(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, bob = it.call("ada"), it.call("bob")
        assert ada.line("x = 1").ok
        assert not bob.line("x = 2").ok
        ada.client.receive(Drive(1000, LeaseAct.RELEASE))
        assert it.room.driving.lease.holder == ""
        assert bob.line("x = 2").ok
        assert it.room.driving.lease.holder == "bob"


def test_where_all_are_one_user_a_command_takes_no_lease_and_who_asks_has_it(tmp_path: Path) -> None:
    with served(tmp_path, one_user=True) as it:
        browser, shell = it.call("browser"), it.call("shell")
        for wire in (browser, shell, browser):
            assert wire.line("DRIVE 1, 1").ok
        assert it.room.driving.lease.holder == ""
        it.room.driving.change(lambda lease, now: lease.ask("browser", now))
        assert not shell.line("DRIVE 1, 1").ok
        assert browser.line("DRIVE 1, 1").ok
        it.room.driving.change(lambda lease, now: lease.give("browser", "", now))
        assert shell.line("DRIVE 1, 1").ok


def test_many_who_look_have_one_share_together_and_who_drives_does_not_wait(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, lookers = it.call("ada"), [it.call(f"eve{k}") for k in range(30)]
        assert ada.line("x = 1").ok
        assert lookers[0].line("WHERE").ok
        ada.client.spend(9.0)
        assert all(waits(wire) == 0.0 for wire in (ada, *lookers))
        for wire in lookers[1:]:
            wire.client.spend(0.05)  # [s] of CPU: less than each may have
        assert all(waits(wire) > 1.0 for wire in lookers[1:]), "1.5 s, at 0.4 of a core, of which 0.8 at once"
        assert waits(ada) == waits(lookers[0]) == 0.0, "who has asked for little does not wait for those who have"
        it.now += 2.0
        assert all(waits(wire) == 0.0 for wire in lookers)


def test_who_looks_at_an_idle_robot_does_not_wait_nor_for_what_was_asked_while_he_typed(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, eve = it.call("ada"), it.call("eve")
        assert ada.line("x = 1").ok
        it.now += 5.0
        eve.client.spend(9.0)
        assert waits(eve) == 0.0, "ada asks for nothing"
        it.now += 200.0
        assert ada.line("x = 1").ok
        eve.client.spend(9.0, typing=True)
        assert waits(eve, Complete(1, "MO")) > 10.0
        assert waits(eve) == 0.0


def test_the_newest_completion_alone_waits_and_abort_never(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, eve = it.call("ada"), it.call("eve")
        assert ada.line("x = 1").ok
        eve.client.spend(9.0, typing=True)
        assert eve.client.park(Complete(1, "MO"), 50)
        assert eve.client.park(Check(2, "MO"), 50)
        assert eve.client.park(Complete(3, "MOV"), 50)
        assert eve.client.parked_bytes == 100
        eve.flush()
        assert Completed(1) in eve.heard
        assert not eve.client.park(Abort(4), 20)
        assert not eve.client.park(Line(5, "abort"), 20)
        assert eve.client.park(Line(6, "WHERE"), 20), "in the order in which they came"
        assert (eve.client.unpark() or 0.0) > 1.0
        it.now += 100.0
        assert eve.client.unpark() is None
        eve.until(lambda: any(isinstance(one, Completed) and one.id == 3 for one in eve.heard))
        assert not any(isinstance(one, Completed) and one.id == 1 and one.choices for one in eve.heard)


def test_who_asks_has_a_turn_between_the_lines_of_a_paste(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, eve = it.call("ada"), it.call("eve")
        ada.command("x = 1\n" * 3000)
        assert eve.line("WHERE").ok
        assert not any(isinstance(one, Done) for one in ada.heard), "the paste is not over"
        ada.until(lambda: any(isinstance(one, Done) for one in ada.heard))


def test_a_connection_that_is_half_open_does_not_keep_the_lease(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, bob = it.call("ada"), it.call("bob")
        assert ada.line("x = 1").ok
        ada.alive = False
        it.pass_time(11.0)
        assert ada.pings
        assert bob.line("x = 2").ok


def test_a_program_is_stored_by_who_drives_when_it_ends(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, bob = it.call("ada"), it.call("bob")
        for line in (".PROGRAM p", "a = 1"):
            assert ada.line(line).ok
        it.room.driving.change(lambda lease, now: lease.give("ada", "bob", now))
        assert bob.line("x = 1").ok
        assert not ada.line(".END").ok
        assert not it.room.session.programs
        assert ada.line("WHERE").ok, "what comes from a pipe after its program is done"
        ada.client.user_state.attended = True
        it.room.driving.change(lambda lease, now: lease.give("bob", "ada", now))
        for line in (".PROGRAM p", "a = 1"):
            assert ada.line(line).ok
        it.room.driving.change(lambda lease, now: lease.give("ada", "bob", now))
        assert not ada.line(".END").ok
        it.room.driving.change(lambda lease, now: lease.give("bob", "ada", now))
        assert ada.line(".END").ok, "who is there has not typed it for nothing"
        assert list(it.room.session.programs) == ["p"]


GONE = ((WhenGone.GO_ON, True, ""), (WhenGone.PAUSE, False, "(PAUSED)"), (WhenGone.ABORT, False, "(ABORTED)"))


@pytest.mark.parametrize(("when", "runs", "status"), GONE, ids=lambda one: getattr(one, "value", None))
def test_what_becomes_of_a_program_when_its_driver_goes(
    tmp_path: Path, when: WhenGone, runs: bool, status: str
) -> None:
    with served(tmp_path, realtime=1000.0, when_gone=when) as it:
        ada, bob = it.call("ada"), it.call("bob")
        for line in (".PROGRAM ever", "10 DELAY 1", "GOTO 10", ".END"):
            assert ada.line(line).ok
        ada.command("EXECUTE ever")
        bob.until(lambda: it.room.session.running)
        it.room.leave(ada.client)
        if runs:
            bob.line("WHERE")
            assert it.room.session.running
        else:
            bob.until(lambda: not it.room.session.running)
            bob.until(lambda: any("drove, and has gone" in text for text in bob.said))
            task = it.room.session.tasks.get(0)
            assert task is not None
            assert task.outcome is not None
            assert task.outcome.value == status
            bob.command("PROCEED")
            bob.until(lambda: it.room.session.running)
        bob.line("ABORT")
        assert not it.room.session.running


@pytest.mark.parametrize("realtime", [None, 1000.0])
def test_a_robot_that_nobody_holds_or_watches_is_paused_and_goes_on_for_who_comes(
    tmp_path: Path, realtime: float | None
) -> None:
    with served(tmp_path, realtime=realtime, idle=60.0) as it:
        ada = it.call("ada")
        for line in (".PROGRAM ever", "10 DRIVE 1, 1", "DRIVE 1, -1", "DELAY 0.1", "GOTO 10", ".END"):
            assert ada.line(line).ok
        ada.command("EXECUTE ever")
        it.pass_time(100.0)
        it.goes_on()  # somebody is connected
        it.room.cut(ada.client, ada)
        it.pass_time(59.0)
        it.goes_on()
        watching = Feed()
        listener = it.room.broadcast.join(watching, MessageForm(text=True))
        it.pass_time(100.0)
        it.goes_on()  # somebody watches
        it.room.broadcast.leave(listener)
        it.pass_time(61.0)
        assert it.paused
        it.pass_time(5000.0)
        assert it.paused, "and stays so"
        bob = it.call("bob")
        bob.until(lambda: any("the robot stood still for 5001 s" in text for text in bob.said))
        it.goes_on()
        assert bob.line("ABORT").ok
        bob.until(lambda: not it.room.session.running)  # in real time it ends when the arm has come to rest


def test_a_robot_that_does_nothing_is_not_paused_and_a_clock_that_was_stopped_stays_so(tmp_path: Path) -> None:
    with served(tmp_path, realtime=1000.0, idle=60.0) as it:
        ada = it.call("ada")
        assert ada.line("WHERE").ok
        it.room.cut(ada.client, ada)
        it.pass_time(100.0)
        assert not it.room.clock().paused
        bob = it.call("bob")
        it.pass_time(10.0)
        for line in ("DRIVE 1, 100, 1", "CLOCK PAUSE"):
            assert bob.line(line).ok
        it.room.cut(bob.client, bob)
        it.pass_time(100.0)
        eve = it.call("eve")
        assert eve.line("WHERE").ok
        assert it.room.clock().paused


@pytest.mark.parametrize("one_user", [False, True])
def test_a_program_of_who_has_gone_goes_on_in_virtual_time_and_asks_who_drives_next(
    tmp_path: Path, one_user: bool
) -> None:
    with served(tmp_path, one_user=one_user) as it:
        ada, bob = it.call("ada"), it.call("bob")
        for line in (".PROGRAM ask", 'PROMPT "how many?", n', "DELAY 1", "DRIVE 1, n, 50", ".END"):
            assert ada.line(line).ok
        ada.command("EXECUTE ask")
        ada.until(lambda: any(isinstance(one, Asked) for one in ada.heard))
        it.room.leave(ada.client)
        bob.command("x = 1")
        bob.until(lambda: any(isinstance(one, Asked) for one in bob.heard))
        (asked,) = (one for one in bob.heard if isinstance(one, Asked))
        bob.client.receive(Answer(asked.number, "5"))

        def over() -> bool:
            it.room.tick()
            return not it.room.session.running

        bob.until(over)
        task = it.room.session.tasks.get(0)
        assert task is not None
        assert task.outcome is not None
        assert (task.outcome.value, task.fault) == ("Program completed", None)
        assert bob.line("WHERE").version == 2, "a delay, and a motion"


def test_an_error_of_vrs_itself_that_nobody_waits_for_is_raised_by_a_tick(tmp_path: Path) -> None:
    def broken() -> float:
        raise ZeroDivisionError("as if there were a fault")

    with served(tmp_path) as it:
        actor = it.room.session.actor
        actor.call(lambda: actor.repeat(broken))
        until(lambda: actor.internal_errors)
        with pytest.raises(ZeroDivisionError):
            it.room.tick()
        it.room.tick()


def test_what_stands_around_a_prompt_is_told_beside_the_end_of_a_request(tmp_path: Path) -> None:
    """Who sits there may be another part of the same page than who asked."""
    with served(tmp_path) as it:
        ada = it.call("ada", attended=True)
        assert ada.line("SPEED 50").status == ada.line("WHERE").status

        def told() -> bool:
            it.room.tick()
            return any(isinstance(one, Status) and one.around.monitor_speed == 50.0 for one in ada.heard)

        ada.until(told)


# --- what programs may take, and say ---


def test_a_program_that_takes_too_much_is_stopped(tmp_path: Path) -> None:
    with served(tmp_path, allowance=Allowance(cpu=0.01, cpu_window=1.0)) as it:
        ada = it.call("ada")
        for line in (".PROGRAM ever", "10 GOTO 10", ".END"):
            assert ada.line(line).ok
        id = ada.command("EXECUTE ever")

        def over() -> bool:
            it.room.tick()
            return any(isinstance(one, Done) and one.id == id for one in ada.heard)

        ada.until(over)
        assert any("of a core" in text for text in ada.said)
        assert ada.line("WHERE").ok


def test_who_drives_a_program_hears_it(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada, bob = it.call("ada"), it.call("bob")
        for line in (".PROGRAM say", 'TYPE "one"', 'TYPE "two"', ".END"):
            assert ada.line(line).ok
        ada.line("EXECUTE say")
        assert ada.said[-3:] == ["one", "two", "Program completed"]
        assert bob.said == []


def test_a_robot_with_too_many_names_takes_no_more_and_gives_some_back(tmp_path: Path) -> None:
    with served(tmp_path, allowance=Allowance(names=20)) as it:
        ada = it.call("ada", answers=True)
        done = []
        for n in range(30):
            it.now += 1.0
            done.append(ada.line(f"x{n} = 1"))
        assert [one.ok for one in done].index(False) == 21
        refused = done[-1].refusal
        assert refused is not None
        assert "21 variables and programs, 20 at most" in refused.message
        assert ada.line("WHERE").ok
        assert ada.line("DISABLE INTERACTIVE").ok is False
        id = ada.command("DELETER x1, x2")
        ada.until(lambda: any(isinstance(one, Asked) for one in ada.heard))
        (asked,) = (one for one in ada.heard if isinstance(one, Asked))
        ada.client.receive(Answer(asked.number, True))
        ada.until(lambda: any(isinstance(one, Done) and one.id == id for one in ada.heard))
        it.now += 1.0
        assert ada.line("y = 1").ok


def test_a_disk_that_takes_nothing_refuses_commands_and_lets_all_look(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from vrs_cli.files.past import GrowingFile

    def full(*_data: object, **_how: object) -> None:
        raise OSError(28, "No space left on device")

    with served(tmp_path) as it:
        ada = it.call("ada")
        assert ada.line("DRIVE 1, 5, 50").ok
        with monkeypatch.context() as broken:
            broken.setattr(GrowingFile, "add", full)
            broken.setattr("vrs_cli.files.atomic.create_beside", full)
            assert not ada.line("DRIVE 1, 5, 50").ok
            assert "no space left" in ada.said[-1]
            assert not ada.line("x = 1").ok
            refused = ada.line("x = 2").refusal
            assert refused is not None
            assert "no space left" in refused.message
            for line in ("WHERE", "TIMELINE", "ABORT"):
                assert ada.line(line).ok
            assert it.room.session.engine.book.history.commands == 1
        assert ada.line("x = 3").ok
        assert ada.line("DRIVE 1, 5, 50").ok


def test_who_stops_the_robot_is_told_to_the_others(tmp_path: Path) -> None:
    with served(tmp_path, realtime=1.0) as it:
        ada, bob = it.call("ada"), it.call("bob")
        ada.command("DRIVE 1, 90, 10")
        ada.until(lambda: it.room.session.engine.timeline.version)
        assert bob.line("ABORT").ok
        assert "bob stops the robot" in ada.said
        assert "bob stops the robot" not in bob.said


def test_programs_have_no_network_at_a_robot_that_is_served(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada = it.call("ada")
        for line in ('ATTACH (lun, 4) "TCP"', 'FOPEN (lun, 16) "/LOCAL_PORT 0"', "TYPE IOSTAT(lun)"):
            assert ada.line(line).ok
        assert ada.said[-1].strip() == str(DeviceNotReady.code)


def test_names_are_unlike(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        names = [it.call(name).client.name for name in ("ada", "ada", "", "", "a\x1b[2J" + "b" * 100)]
        assert names[:4] == ["ada", "ada-2", "guest", "guest-2"]
        assert len(names[4]) == 40
        assert names[4].isprintable()


def test_positions_are_computed_beside_the_connections(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada = it.call("ada")
        ada.client.receive(Positions(1, (0.0,) * 2000))
        ada.flush()
        assert not any(isinstance(one, Located) for one in ada.heard)
        ada.until(lambda: any(isinstance(one, Located) for one in ada.heard))


def test_so_many_questions_wait_and_no_more(tmp_path: Path) -> None:
    with served(tmp_path) as it:
        ada = it.call("ada")
        for id in range(1, MAX_PENDING_QUESTIONS + 2):
            ada.client.receive(Complete(id, "MO", True))
        ada.flush()
        (refused,) = (one for one in ada.heard if isinstance(one, Refused))
        assert refused.id == MAX_PENDING_QUESTIONS + 1
        ada.until(lambda: sum(isinstance(one, Completed) for one in ada.heard) == MAX_PENDING_QUESTIONS)
        ada.client.receive(Complete(999, "MO", True))
        ada.until(lambda: sum(isinstance(one, Completed) for one in ada.heard) == MAX_PENDING_QUESTIONS + 1)


def test_what_was_held_up_on_the_way_is_not_done_unless_it_stops_the_robot(tmp_path: Path) -> None:
    with served(tmp_path, realtime=1.0) as it:
        ada = it.call("ada")
        assert ada.line("a = 1", until=it.now).ok
        late = ada.line("a = 2", until=it.now - 6.5)
        assert (late.ok, late.refusal and late.refusal.detail) == (
            False,
            "it was held up on the way, and arrived 6.5 s too late: it was not done",
        )
        assert ada.line("abort", until=it.now - 6.5).ok
        ada.line("TYPE a")
        assert ada.said[-1].split() == ["1"]
