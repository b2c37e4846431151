"""The server over real sockets: who gets in, what is answered, who drives, and what is there afterwards."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from tests.live import PATIENCE
from tests.net.serving import Serving, serving
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.net.limits import Allowance
from vrs_cli.net.messages import (
    Abort,
    Answer,
    Asked,
    At,
    Check,
    Checked,
    Closing,
    Complete,
    Completed,
    Delta,
    Done,
    Drive,
    Fetched,
    Get,
    Hello,
    Interrupt,
    Lease,
    LeaseAct,
    Line,
    Listed,
    Located,
    Names,
    Positions,
    Present,
    Put,
    Refused,
    Replaced,
    Sample,
    Shown,
    Subscribe,
    Typed,
    Welcome,
    Who,
    Window,
)
from vrs_cli.net.tokens import add_tokens
from vrs_cli.wire.messages import How


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Serving]:
    with serving(tmp_path_factory.mktemp("server"), ("cell1", "cell2")) as it:
        yield it


# --- who gets in, and where ---


def test_a_line_is_answered(server: Serving) -> None:
    with server.call("/robots/cell1") as ada:
        done = ada.line("x = 1 + 2")
        assert done.ok
        assert done.status is not None
        ada.line("TYPE x")
        assert ada.said == [" 3"]


def test_the_address_names_the_robot(server: Serving) -> None:
    with server.call("/robots/cell2") as ada:
        (welcome,) = ada.heard
        assert isinstance(welcome, Welcome)
        assert (welcome.robot, welcome.robots, welcome.role) == ("cell2", ("cell1", "cell2"), "supervisor")
        assert welcome.model["name"] == "puma560"


@pytest.mark.parametrize(("path", "said"), [("", "which robot"), ("/robots/cell9", "no robot cell9")])
def test_a_robot_that_is_not_there(server: Serving, path: str, said: str) -> None:
    with server.call(path) as ada:
        (closing,) = ada.heard
        assert isinstance(closing, Closing)
        assert said in closing.why
        assert closing.refusal is not None
        assert "cell1, cell2" in closing.refusal.hint


def test_another_place_is_none(server: Serving) -> None:
    with pytest.raises(InvalidStatus) as refused:
        server.call("/other")
    assert refused.value.response.status_code == 404


def test_a_page_of_another_site_stays_outside(server: Serving) -> None:
    with pytest.raises(InvalidStatus) as refused:
        server.call("/robots/cell1", origin="https://elsewhere.example")
    assert refused.value.response.status_code == 403


GARBAGE: tuple[str | bytes, ...] = (
    "",
    "{",
    "null",
    "[" * 10_000,
    '{"type":"line","id":1,"text":"WHERE"}',
    b"\xc1\xff",
    "x" * 40_000,
)


@pytest.mark.parametrize("frame", GARBAGE, ids=range(len(GARBAGE)))
def test_garbage_in_place_of_a_hello_ends_the_connection(server: Serving, frame: str | bytes) -> None:
    with connect(f"{server.address}/robots/cell1", compression=None) as socket:
        socket.send(frame)
        assert '"closing"' in str(socket.recv(timeout=PATIENCE))
        with pytest.raises(ConnectionClosed):
            socket.recv(timeout=PATIENCE)


def test_garbage_after_a_hello_is_refused(server: Serving) -> None:
    with server.call("/robots/cell1") as ada:
        ada.socket.send('{"type":"dance","id":7}')
        refused = ada.until(lambda one: isinstance(one, Refused))
        assert isinstance(refused, Refused)
        assert refused.id == 7
        assert ada.line("WHERE").ok


# --- requests ---


def test_questions_are_answered(server: Serving) -> None:
    with server.call("/robots/cell2", Hello((1,), attended=True)) as ada:
        ada.lines(".PROGRAM ask", 'PROMPT "how many?", n', "TYPE n", ".END")
        id = ada.send(lambda id: Line(id, "EXECUTE ask"))
        asked = ada.until(lambda one: isinstance(one, Asked))
        assert isinstance(asked, Asked)
        assert asked.question.text == "how many?"
        ada.protocol.send(Answer(asked.number, "7"))
        ada.flush()
        assert ada.until(lambda one: isinstance(one, Done) and one.id == id)
        assert " 7" in ada.said
        id = ada.send(lambda id: Line(id, "EXECUTE ask"))
        asked = ada.until(lambda one: isinstance(one, Asked))
        assert isinstance(asked, Asked)
        ada.protocol.send(Answer(asked.number, how=How.INTERRUPTED))
        ada.flush()
        ada.until(lambda one: isinstance(one, Done) and one.id == id)
        assert any("ABORTED" in text for text in ada.said)


def test_ctrl_c_stops_what_one_waits_for(server: Serving) -> None:
    with server.call("/robots/cell1") as ada:
        ada.lines(".PROGRAM ever", "TYPE 1", "10 GOTO 10", ".END")
        id = ada.send(lambda id: Line(id, "EXECUTE ever"))
        ada.until(lambda one: isinstance(one, Typed))
        ada.protocol.send(Interrupt())
        ada.flush()
        ada.until(lambda one: isinstance(one, Done) and one.id == id)
        assert any("ABORTED" in text for text in ada.said)


def test_an_observer_s_requests(server: Serving) -> None:
    with server.call("/robots/cell1") as ada:
        located = ada.ask(lambda id: Positions(id, (0.0, 1.0)))
        assert isinstance(located, Located)
        assert len(located.positions) == 2
        assert isinstance(ada.ask(lambda id: Window(id, 0.0)), Shown)
        completed = ada.ask(lambda id: Complete(id, "WHE"))
        assert isinstance(completed, Completed)
        assert completed.choices[0].text == "WHERE"
        checked = ada.ask(lambda id: Check(id, "MOVEE"))
        assert isinstance(checked, Checked)
        assert checked.mistake is not None
        present = ada.ask(Who)
        assert isinstance(present, Present)
        assert present.robots == ("cell1", "cell2")
        assert isinstance(ada.ask(lambda id: Positions(id, (0.0,) * 5000)), Refused)


def test_who_subscribes_hears_samples_and_changes(server: Serving) -> None:
    with server.call("/robots/cell1") as ada, server.call("/robots/cell1") as bob:
        assert isinstance(bob.ask(lambda id: Subscribe(id, deltas=True, rate=100.0)), Done)
        assert any(isinstance(one, Replaced) for one in bob.heard)
        ada.lines("MOVE #PPOINT(10, -80, 80, 5, 5, 5)")
        bob.until(lambda one: isinstance(one, Delta))
        bob.until(lambda one: isinstance(one, Sample))
        ada.line("ABORT")


def test_files_of_the_robot(server: Serving) -> None:
    text = b".PROGRAM fetched\nTYPE 1\n.END\n"
    with server.call("/robots/cell1") as ada:
        assert ada.ask(lambda id: Put(id, "own.v2", text)).ok  # type: ignore[attr-defined]
        refused = ada.ask(lambda id: Put(id, "own.v2", b""))
        assert isinstance(refused, Done)
        assert refused.refusal is not None
        assert not refused.ok
        ada.lines("LOAD own", "STORE other")
        fetched = ada.ask(lambda id: Get(id, "other.v2"))
        assert isinstance(fetched, Fetched)
        assert b"fetched" in fetched.data
        listed = ada.ask(Names)
        assert isinstance(listed, Listed)
        assert {"own.v2", "other.v2"} <= {one.name for one in listed.files}
        for name in ("../x", "/etc/passwd", "a/../../x", "nul"):
            assert isinstance(ada.ask(lambda id, name=name: Get(id, name)), Refused)
            done = ada.ask(lambda id, name=name: Put(id, name, b""))
            assert isinstance(done, Done)
            assert not done.ok


# --- who drives ---


def test_one_drives_the_others_look_and_may_stop(tmp_path: Path) -> None:
    with serving(tmp_path) as server, server.call() as ada, server.call() as bob:
        ada.lines("x = 1")
        refused = bob.line("MOVE #PPOINT(10, -80, 80, 5, 5, 5)")
        assert not refused.ok
        assert "guest drives" in bob.said[-1]
        bob.lines("WHERE", "ABORT")
        assert isinstance(bob.ask(Abort), Done)
        bob.ask(lambda id: Drive(id, LeaseAct.ASK))
        asked = ada.until(lambda one: isinstance(one, Lease) and one.notice is not None and one.holder == "guest")
        assert asked
        assert ada.ask(lambda id: Drive(id, LeaseAct.GIVE, "guest-2")).ok  # type: ignore[attr-defined]
        bob.lines("x = 2")
        assert not ada.line("x = 3").ok


def test_who_leaves_lets_the_next_one_drive(tmp_path: Path) -> None:
    with serving(tmp_path) as server, server.call() as bob:
        with server.call() as ada:
            ada.lines("x = 1")
            assert not bob.line("x = 2").ok
        bob.until(lambda one: isinstance(one, Lease) and not one.holder)
        bob.lines("x = 2")


def test_a_program_is_no_more_changed_by_who_does_not_drive_than_a_variable(tmp_path: Path) -> None:
    with serving(tmp_path) as server, server.call() as ada, server.call() as bob:
        ada.lines("x = 1")
        assert not bob.line(".PROGRAM p").ok


# --- tokens ---


def test_tokens_give_robots_and_roles(tmp_path: Path) -> None:
    path = tmp_path / "tokens.toml"
    made = add_tokens(path, ["ada", "bob"]) | add_tokens(path, ["tom"], "teacher")
    made |= add_tokens(path, ["eve"], "observer", ("cell1",))
    with serving(tmp_path, tokens=path, own=1) as server:
        with server.call(hello=Hello((1,), token=made["ada"])) as ada:
            welcome = ada.heard[0]
            assert isinstance(welcome, Welcome)
            assert welcome.robot == "ada"
            assert welcome.name == "ada"
            ada.lines("x = 1")
            with server.call("/robots/ada", Hello((1,), token=made["bob"])) as bob:
                assert isinstance(bob.heard[0], Closing)
                assert "no robot ada" in bob.heard[0].why
            with server.call("/robots/ada", Hello((1,), token=made["tom"])) as teacher:
                assert isinstance(teacher.heard[0], Welcome)
                assert teacher.heard[0].role == "teacher"
                assert {"cell1", "ada"} <= set(teacher.heard[0].robots)
                teacher.lines("WHERE", "ABORT")
        with server.call("/robots/cell1", Hello((1,), token=made["eve"])) as client:
            assert client.line("WHERE").ok
            assert not client.line("MOVE #PPOINT(10, -80, 80, 5, 5, 5)").ok
            assert not client.ask(Abort).ok  # type: ignore[attr-defined]
        for token in ("", "x" * 40):
            with server.call(hello=Hello((1,), token=token)) as nobody:
                assert isinstance(nobody.heard[0], Closing)


def test_a_robot_whose_journal_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "tokens.toml"
    made = add_tokens(path, ["ada"])
    (tmp_path / "journal").mkdir()
    (tmp_path / "journal" / "ada.vrst").write_text("no trajectory\n")
    with serving(tmp_path, tokens=path, own=1) as server:
        with server.call(hello=Hello((1,), token=made["ada"])) as ada:
            (closing,) = ada.heard
            assert isinstance(closing, Closing)
            assert closing.why == "ada cannot be served now"
        assert "ada.vrst" in server.told[0]
        with server.call("/robots/cell1", Hello((1,), token=made["ada"])) as ada:
            assert ada.line("WHERE").ok


def test_a_token_that_is_taken_out_ends_its_connections(tmp_path: Path) -> None:
    path = tmp_path / "tokens.toml"
    made = add_tokens(path, ["ada", "bob"])
    with serving(tmp_path, tokens=path) as server:
        ada, bob = (server.call(hello=Hello((1,), token=made[name])) for name in ("ada", "bob"))
        text = path.read_text()
        path.write_text(text[text.index('[[token]]\nname = "bob"') :])
        closing = ada.until(lambda one: isinstance(one, Closing))
        assert isinstance(closing, Closing)
        assert "revoked" in closing.why
        assert bob.line("WHERE").ok
        with server.call(hello=Hello((1,), token=made["ada"])) as again:
            assert isinstance(again.heard[0], Closing)
        bob.close()


def test_who_guesses_tokens_is_not_listened_to(tmp_path: Path) -> None:
    path = tmp_path / "tokens.toml"
    made = add_tokens(path, ["ada"])
    with serving(tmp_path, tokens=path) as server:
        for _ in range(11):
            with server.call(hello=Hello((1,), token="guess" * 5)) as nobody:
                last = nobody.heard[0]
        assert isinstance(last, Closing)
        assert "too many" in last.why
        with server.call(hello=Hello((1,), token=made["ada"])) as ada:
            assert isinstance(ada.heard[0], Welcome), "others at this address have to get in"


# --- limits ---


def test_too_many_messages_are_refused_and_the_robot_can_be_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vrs_cli.net.server.CLOSE_TIMEOUT_S", 0.1)
    with serving(tmp_path, allowance=Allowance(rate=1.0, burst=20)) as server, server.call() as ada:
        done = [ada.line("WHERE") for _ in range(25)]
        assert [one.ok for one in done[:19]] == [True] * 19
        assert done[-1].refusal is not None
        assert "messages a second" in done[-1].refusal.message
        assert ada.ask(Abort).ok  # type: ignore[attr-defined]
        with suppress(ConnectionClosed):  # it is closed before all have been sent
            for _ in range(20):
                ada.socket.send('{"type":"dance","id":7}')
        closing = ada.until(lambda one: isinstance(one, Closing))
        assert isinstance(closing, Closing)
        assert "messages a second" in closing.why


def test_a_message_that_is_too_long(tmp_path: Path) -> None:
    with serving(tmp_path, allowance=Allowance(message=10_000)) as server:
        with server.call() as ada:
            ada.send(lambda id: Line(id, "x" * 20_000))
            with pytest.raises(Exception, match=r"too big|closed|1009"):
                ada.until(lambda _: False)
        with server.call() as ada:
            assert ada.line("WHERE").ok


def test_a_line_that_is_too_long_is_not_read(server: Serving) -> None:
    long = 'TYPE "' + "a" * 99_000 + '"'
    with server.call("/robots/cell1") as ada:
        for text in (long, f"WHERE\n{long}"):
            refused = ada.line(text).refusal
            assert refused is not None
            assert "a line of 99007 characters" in refused.message
        for answer in (ada.ask(lambda id: Complete(id, long)), ada.ask(lambda id: Check(id, long))):
            assert isinstance(answer, Refused)
        assert ada.line("\n".join(["WHERE"] * 100)).ok


def test_a_folder_that_is_full(tmp_path: Path) -> None:
    with serving(tmp_path, allowance=Allowance(folder=10_000)) as server, server.call() as ada:
        assert not ada.ask(lambda id: Put(id, "big.v2", b" " * 20_000)).ok  # type: ignore[attr-defined]
        assert ada.ask(lambda id: Put(id, "small.v2", b" " * 9000)).ok  # type: ignore[attr-defined]
        assert not ada.ask(lambda id: Put(id, "other.v2", b" " * 2000)).ok  # type: ignore[attr-defined]


def test_a_file_that_is_empty_takes_room_too(tmp_path: Path) -> None:
    for allowance in (Allowance(folder=10_000), Allowance(files=2)):
        place = tmp_path / str(allowance.files)
        place.mkdir()
        with serving(place, allowance=allowance) as server, server.call() as ada:
            done = [ada.ask(lambda id, n=n: Put(id, f"{n}.v2", b"")) for n in range(3)]
            assert [isinstance(one, Done) and one.ok for one in done] == [True, True, False]
            (server.hub.rooms["cell1"].folder.root / "by hand.txt").write_text("x")
            assert not ada.line("x = 1").ok


def test_a_program_makes_so_many_empty_files_and_no_more(tmp_path: Path) -> None:
    with serving(tmp_path, allowance=Allowance(folder=10_000)) as server, server.call() as ada:
        ada.lines(".PROGRAM many", 'ATTACH (lun, 4) "DISK"', "FOR i = 1 TO 9", 'FOPENW (lun) $ENCODE(/I0,i)+".txt"')
        ada.lines("FCLOSE (lun)", 'FOPENW (lun) "1.txt"', "FCLOSE (lun)", "END", ".END")
        ada.line("EXECUTE many")
        assert {one.name for one in server.hub.rooms["cell1"].folder.root.iterdir()} == {"1.txt", "2.txt"}
        assert "FDELETE makes room" in str(ada.heard)


def test_a_robot_that_is_full_is_emptied_as_it_says(tmp_path: Path) -> None:
    with serving(tmp_path, allowance=Allowance(elements=1000)) as server, server.call() as ada:
        ada.lines("DISABLE INTERACTIVE", "i = 0", ".PROGRAM p", "10 i = i+1", "a[i] = i", "GOTO 10", ".END")
        assert not ada.line("EXECUTE p").ok
        assert "KILL, then ZERO" in ada.said[-1]
        assert not ada.line("TYPE 1").ok
        ada.lines("KILL", "DELETER a", "TYPE 1")


# --- what is there afterwards ---


def test_what_was_answered_is_in_the_journal_and_in_the_audit(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        with server.call() as ada:
            ada.lines("x = 1", "MOVE #PPOINT(10, -80, 80, 5, 5, 5)", "TYPE x")
            journal = tmp_path / "journal" / "cell1.vrst"
            assert len(read_trajectory(journal).deltas) == 1
            assert not ada.line("MOVEE").ok
        timeline = server.hub.rooms["cell1"].session.engine.timeline
    rows = [json.loads(line) for line in (tmp_path / "audit.jsonl").read_text().splitlines()]
    assert "MOVEE" in rows[4]["result"]
    assert [(row["what"], row["result"][:7]) for row in rows] == [
        ("(enter)", "done"),
        ("x = 1", "done"),
        ("MOVE #PPOINT(10, -80, 80, 5, 5, 5)", "done"),
        ("TYPE x", "done"),
        ("MOVEE", "refused"),
        ("(leave)", "left"),
    ]
    with serving(tmp_path) as again, again.call() as ada:
        assert list(again.hub.rooms["cell1"].session.engine.timeline) == list(timeline)
        ada.lines("TYPE x", "UNDO")
        assert ada.said[0] == " 1"


def test_files_that_are_fetched_are_in_the_audit(tmp_path: Path) -> None:
    with serving(tmp_path) as server, server.call() as ada:
        assert ada.ask(lambda id: Put(id, "own.v2", b"")).ok  # type: ignore[attr-defined]
        for name in ("own.v2", "none.v2"):
            ada.ask(lambda id, name=name: Get(id, name))
        ada.line("WHERE")
        rows = [json.loads(line) for line in (tmp_path / "audit.jsonl").read_text().splitlines()]
    assert [(row["what"], row["result"][:7]) for row in rows[1:4]] == [
        ("(put own.v2, 0 bytes)", "done"),
        ("(get own.v2)", "done"),
        ("(get none.v2)", "refused"),
    ]


def test_files_that_are_refused_to_an_observer_are_in_the_audit(tmp_path: Path) -> None:
    path = tmp_path / "tokens.toml"
    made = add_tokens(path, ["eve"], "observer")
    with serving(tmp_path, tokens=path) as server, server.call(hello=Hello((1,), token=made["eve"])) as eve:
        assert not eve.ask(lambda id: Put(id, "own.v2", b"")).ok  # type: ignore[attr-defined]
        assert isinstance(eve.ask(lambda id: Get(id, "own.v2")), Refused)
        rows = [json.loads(line) for line in (tmp_path / "audit.jsonl").read_text().splitlines()]
    assert [row["what"] for row in rows[1:3]] == ["(put own.v2, 0 bytes)", "(get own.v2)"]
    assert all(row["result"].startswith("refused: *Not in your role*") for row in rows[1:3])


def test_what_is_refused_to_a_role_or_by_the_lease_is_in_the_audit(tmp_path: Path) -> None:
    path = tmp_path / "tokens.toml"
    made = add_tokens(path, ["eve"], "observer") | add_tokens(path, ["ada", "bob"])
    with serving(tmp_path, tokens=path) as server:
        eve, ada, bob = (server.call(hello=Hello((1,), token=made[name])) for name in ("eve", "ada", "bob"))
        assert not eve.ask(Abort).ok  # type: ignore[attr-defined]
        assert not eve.ask(lambda id: Drive(id, LeaseAct.ACQUIRE)).ok  # type: ignore[attr-defined]
        assert not eve.line("x" * 5000).ok
        assert ada.ask(lambda id: Drive(id, LeaseAct.ACQUIRE)).ok  # type: ignore[attr-defined]
        assert not bob.ask(lambda id: Drive(id, LeaseAct.ACQUIRE)).ok  # type: ignore[attr-defined]
        assert not bob.ask(lambda id: Drive(id, LeaseAct.GIVE, "ada")).ok  # type: ignore[attr-defined]
        rows = [json.loads(line) for line in (tmp_path / "audit.jsonl").read_text().splitlines()]
        for one in (eve, ada, bob):
            one.leave()
    done = [(row["who"], row["what"][:30], row["result"][:7]) for row in rows if row["what"] != "(enter)"]
    assert done == [
        ("eve", "(emergency stop)", "refused"),
        ("eve", "(acquire the lease)", "refused"),
        ("eve", 30 * "x", "refused"),
        ("ada", "(acquire the lease)", "done"),
        ("bob", "(acquire the lease)", "refused"),
        ("bob", "(give the lease to ada)", "refused"),
    ]


def test_an_error_of_vrs_itself_tells_nothing_of_the_server_s_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrong(*_arguments: object) -> None:
        raise ZeroDivisionError("by chance")

    with serving(tmp_path) as server, server.call() as ada:
        monkeypatch.setattr("vrs_cli.interfaces.session.session.Session.answers", wrong)
        monkeypatch.setattr("vrs_cli.net.durable_log.RobotFiles.fetch", wrong)
        ada.line("WHERE")
        refused = ada.ask(lambda id: Get(id, "own.v2"))
    assert isinstance(refused, Refused)
    for said in (ada.said[-1], refused.refusal.message):
        assert "ZeroDivisionError: by chance; please tell whoever runs the server: vrs-" in said
        assert "/" not in said


def test_two_servers_do_not_write_one_journal(tmp_path: Path) -> None:
    from vrs_cli.errors import FileOpened

    with serving(tmp_path), pytest.raises(FileOpened), serving(tmp_path):
        pass


def test_who_comes_again_goes_on(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        ada = server.call()
        ada.lines("x = 1")
        ada.cut()
        ada.connect()
        welcome = ada.until(lambda one: isinstance(one, Welcome))
        assert isinstance(welcome, Welcome)
        assert welcome.resumed
        assert welcome.name == "guest"
        ada.lines("x = x + 1", "TYPE x")
        assert ada.said == [" 2"]
        ada.close()


def test_an_act_is_done_once_by_value(tmp_path: Path) -> None:
    from vrs_cli.values.acts import Evaluate, Go, Goal, Valued

    with serving(tmp_path) as server, server.call() as ada:
        done = ada.ask(lambda id: At(id, Go(Goal(joints=(0.1, -1.5, 1.5, 0.0, 0.0, 0.0)))))
        assert isinstance(done, Done)
        assert done.ok
        assert done.version == 1
        done = ada.ask(lambda id: At(id, Evaluate("1 + 2")))
        assert isinstance(done, Done)
        assert done.found == Valued(real=3.0)


def test_the_end_of_the_server_is_told(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        ada = server.call()
        ada.lines("x = 1")
        server.stop()
        closing = ada.until(lambda one: isinstance(one, Closing))
        assert isinstance(closing, Closing)
        assert "ends" in closing.why


def test_nothing_was_told_that_nobody_expected(server: Serving) -> None:
    assert server.told == []
    assert all(not room.session.actor.internal_errors for room in server.hub.rooms.values())
