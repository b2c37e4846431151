"""A class at a real server: help, hand-ins, what the teacher says, freezing, and a student who is removed."""

from __future__ import annotations

import time
import zipfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import pytest

from tests.live import until
from tests.net.serving import Caller, Serving, serving
from vrs_cli.errors import LimitReached, UsageError
from vrs_cli.net import tokens
from vrs_cli.net.class_board import ClassBoard
from vrs_cli.net.messages import (
    Abort,
    Announce,
    Announced,
    AskHelp,
    At,
    ClassState,
    Closing,
    Collect,
    Done,
    Drag,
    Drive,
    Embodied,
    Embody,
    Fetched,
    Freeze,
    HandIn,
    Hello,
    LeaseAct,
    Measured,
    Measurements,
    Put,
    Refused,
    StudentState,
    Subscribe,
    WatchClass,
)
from vrs_cli.net.tokens import OWN_ROBOTS, ClassFolder, add_tokens
from vrs_cli.values.acts import Survey
from vrs_cli.values.hand import Axis, Frame, Press, StopJog


class Class:
    """A served class."""

    def __init__(self, it: Serving, folder: ClassFolder) -> None:
        self.it, self.folder = it, folder

    def call(self, who: str, robot: str = "") -> Caller:
        token = {**self.folder.students(), **self.folder.teachers()}[who]
        return self.it.call(f"/robots/{robot or who}", Hello((1,), token=token))


@pytest.fixture
def room(tmp_path: Path) -> Iterator[Class]:
    folder = ClassFolder(tmp_path)
    folder.make(["ada", "bob"])
    with serving(tmp_path, (), tokens=folder.tokens, own=OWN_ROBOTS) as it:
        it.server.board = ClassBoard(folder, it.hub.clients, it.server.grants, it.hub.own_names, lambda: 1e9)
        yield Class(it, folder)


def states(caller: Caller) -> list[ClassState]:
    return [one for one in caller.heard if isinstance(one, ClassState)]


def done(answer: object) -> Done:
    assert isinstance(answer, Done)
    return answer


def state_of(caller: Caller, name: str) -> StudentState:
    """What a caller was told last of a student."""
    return next(one for one in states(caller)[-1].students if one.name == name)


def test_the_teacher_sees_who_wants_help(room: Class) -> None:
    with room.call("teacher", "ada") as tom, room.call("bob") as bob:
        assert done(tom.ask(WatchClass)).ok
        assert done(bob.ask(AskHelp)).ok
        tom.until(lambda one: isinstance(one, ClassState) and one.students[1].help == 1e9)
        assert state_of(tom, "bob") == StudentState("bob", ("bob", "bob-2"), 1, "bob", 1e9)
        bob.line("WHERE")
        assert [one.name for one in states(bob)[-1].students] == ["bob"]  # nothing of others
        assert done(tom.ask(lambda id: AskHelp(id, wanted=False, student="bob"))).ok
        bob.until(lambda one: isinstance(one, ClassState) and one.students[0].help is None)
        assert not done(tom.ask(lambda id: AskHelp(id, wanted=False, student="bob"))).ok
        assert not done(bob.ask(lambda id: AskHelp(id, student="ada"))).ok


def test_a_wall_that_is_opened_later_knows_where_a_student_was_last(room: Class) -> None:
    with room.call("bob", "bob-2") as bob:
        assert bob.line("WHERE").ok
        assert done(bob.ask(AskHelp)).ok
    until(lambda: all(one.link is None for one in room.it.hub.clients()), "the server knows that bob is gone")
    with room.call("teacher", "ada") as tom:
        assert done(tom.ask(WatchClass)).ok
        assert state_of(tom, "bob").here == 0
        assert (state_of(tom, "bob").at, state_of(tom, "ada").at) == ("bob-2", "")


def test_a_body_of_a_student_s_robot_is_no_student(room: Class) -> None:
    tokens = add_tokens(room.folder.tokens, ["arm"], "body", ["ada"])
    until(lambda: any(grant.body for grant in room.it.server.grants()))
    with room.call("teacher", "ada") as tom, room.call("ada") as ada:
        assert done(tom.ask(WatchClass)).ok
        with room.it.call("", Hello((1,), token=tokens["arm"])) as arm:
            ada.ask(lambda id: Subscribe(id, measured=True))
            assert isinstance(arm.ask(Embody), Embodied)
            arm.protocol.send(Measured(first=0, times=(0.0,), joints=((0.5,) * 6,), sent=0.0))
            arm.flush()
            ada.until(lambda it: isinstance(it, Measurements))
            assert [one.name for one in states(tom)[-1].students] == ["ada", "bob"]
            assert "arm" not in room.folder.students()
        with room.it.call("/robots/bob", Hello((1,), token=tokens["arm"])) as refused:
            closing = refused.heard[-1]
            assert isinstance(closing, Closing)
            assert "no robot bob for you" in closing.why


def test_a_message_goes_to_all_students_or_to_one(room: Class) -> None:
    with room.call("teacher", "ada") as tom, room.call("ada") as ada, room.call("bob", "bob-2") as bob:
        assert done(tom.ask(lambda id: Announce(id, "<b>look</b>"))).ok
        for student in (ada, bob):
            said = student.until(lambda one: isinstance(one, Announced))
            assert (said.by, said.text) == ("teacher", "<b>look</b>")  # type: ignore[attr-defined]
        assert done(tom.ask(lambda id: Announce(id, "you", student="bob"))).ok
        bob.until(lambda one: isinstance(one, Announced) and one.text == "you")
        ada.line("WHERE")
        assert sum(isinstance(one, Announced) for one in ada.heard) == 1
        assert not done(tom.ask(lambda id: Announce(id, "x", student="eve"))).ok
        assert not done(tom.ask(lambda id: Announce(id, "x" * 5000))).ok


@pytest.mark.parametrize("make", [WatchClass, lambda id: Announce(id, "x"), Freeze, Collect], ids=range(4))
def test_what_is_for_the_teacher_is_refused_to_students(room: Class, make: type) -> None:
    with room.call("ada") as ada:
        answer = ada.ask(make)
        assert isinstance(answer, Done | Refused)
        assert answer.refusal is not None
        assert "teacher" in answer.refusal.hint


def test_a_frozen_class_looks_and_stops_and_does_nothing_else(room: Class) -> None:
    with room.call("teacher", "ada") as tom, room.call("ada") as ada:
        assert ada.line("DRIVE 1, 10").ok
        assert done(tom.ask(Freeze)).ok
        ada.until(lambda one: isinstance(one, ClassState) and one.frozen)
        refused = ada.line("DRIVE 1, 10")
        assert refused.refusal is not None
        assert "teacher has stopped the class" in str(refused.refusal.error())
        assert not done(ada.ask(lambda id: Put(id, "a.v2", b"x"))).ok
        assert not done(ada.ask(lambda id: Drive(id, LeaseAct.ACQUIRE))).ok
        ada.protocol.send(Drag((1.0, 0.0, 0.0, 0.5) * 3))
        ada.flush()
        assert isinstance(ada.until(lambda one: isinstance(one, Refused)), Refused)
        assert done(ada.ask(lambda id: At(id, Survey()))).ok
        assert done(ada.ask(Abort)).ok
        assert ada.line("ABORT").ok
        assert done(ada.ask(AskHelp)).ok
        assert tom.line("ABORT").ok
        assert done(tom.ask(lambda id: Freeze(id, frozen=False))).ok
        assert ada.line("DRIVE 1, 10").ok


def test_a_button_pressed_while_the_class_is_frozen_moves_nothing_until_it_is_pressed_anew(room: Class) -> None:
    step = Press(Axis(Frame.JOINT, 0), 5.0, 20.0)
    with room.call("teacher", "ada") as tom, room.call("ada") as ada:
        assert done(tom.ask(Freeze)).ok
        assert not done(ada.ask(lambda id: At(id, step))).ok
        assert done(tom.ask(lambda id: Freeze(id, frozen=False))).ok
        refused = done(ada.ask(lambda id: At(id, step)))
        assert refused.refusal is not None
        assert "let the button go" in refused.refusal.hint
        assert done(ada.ask(lambda id: At(id, StopJog()))).ok
        assert done(ada.ask(lambda id: At(id, step))).ok


def test_programs_are_handed_in_and_collected(room: Class) -> None:
    with room.call("teacher", "ada") as tom, room.call("ada") as ada, room.call("bob") as bob:
        for text in ("one", "two"):
            assert done(ada.ask(lambda id, text=text: HandIn(id, "../../pick <b>.v2", text))).ok
        assert done(bob.ask(lambda id: HandIn(id, "", "three\n"))).ok
        assert not done(bob.ask(lambda id: HandIn(id, "x", "x" * 1_000_001))).ok
        assert len(state_of(ada, "ada").handed_in) == 2
        answer = tom.ask(Collect)
        assert isinstance(answer, Fetched)
        with zipfile.ZipFile(BytesIO(answer.data)) as file:
            assert {name: file.read(name) for name in file.namelist()} == {"ada.v2": b"two", "bob.v2": b"three\n"}
    names = sorted(path.name for path in room.folder.hand_ins.glob("*/*"))
    assert names == [
        "20010909-014640-______pick__b_.v2",
        "20010909-014640-______pick__b__.v2",
        "20010909-014640-program.v2",
    ]


def test_all_that_a_robot_knows_is_handed_in(room: Class) -> None:
    with room.call("ada") as ada:
        assert not done(ada.ask(HandIn)).ok
        ada.lines(".PROGRAM pick", "DRIVE 1, 10", ".END", "SET p = HERE", "n = 3")
        assert done(ada.ask(HandIn)).ok
        text = room.folder.latest()["ada"].read_text()
    assert ".PROGRAM pick" in text
    assert ".LOCATIONS" in text
    assert "n                3" in text


def test_a_student_is_removed_with_all_files_while_the_server_runs(room: Class) -> None:
    with room.call("ada") as ada, room.call("bob") as bob:
        assert ada.line("DRIVE 1, 10").ok
        assert bob.line("DRIVE 1, 10").ok
        assert done(ada.ask(lambda id: Put(id, "a.v2", b"x"))).ok
        assert done(ada.ask(lambda id: HandIn(id, "x", "x"))).ok
        room.folder.forget("ada")
        assert isinstance(ada.until(lambda one: isinstance(one, Closing)), Closing)
        assert bob.line("DRIVE 1, 10").ok
    until(lambda: "ada" not in room.it.hub.rooms)
    left = [path for path in room.folder.root.rglob("*") if "ada" in path.name]
    assert left == []
    assert '"ada"' not in room.folder.tokens.read_text()
    assert "bob" in (room.folder.root / "audit.jsonl").read_text()


def test_a_student_who_is_not_there_cannot_be_removed(tmp_path: Path) -> None:
    folder = ClassFolder(tmp_path)
    folder.make(["ada"])
    (tmp_path / "files").mkdir()
    (tmp_path / "files" / "x").write_text("")
    for name in ("bob", "teacher", "..", "../files", "", "."):
        with pytest.raises(UsageError):
            folder.forget(name)
    assert (tmp_path / "files" / "x").exists()


def test_the_audit_forgets_a_student_and_no_other(tmp_path: Path) -> None:
    folder = ClassFolder(tmp_path)
    folder.make(["ada", "ada-lee"])
    folder.journal.mkdir()
    lines = [
        f'{{"robot": "{robot}", "who": "{who}"}}\n' for robot, who in (("ada", "x"), ("x", "ada-3"), ("ada-lee", "bo"))
    ]
    (folder.journal / "audit.jsonl").write_text("".join(lines))
    folder.forget("ada")
    assert (folder.journal / "audit.jsonl").read_text() == lines[2]


def test_only_so_much_is_handed_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tokens, "MAX_HAND_INS", 2)
    folder = ClassFolder(tmp_path)
    for _ in range(2):
        folder.hand_in("ada", "x", "x", time.time())
    with pytest.raises(LimitReached):
        folder.hand_in("ada", "x", "x", time.time())


def test_a_server_without_a_class_says_so(tmp_path: Path) -> None:
    with serving(tmp_path) as it, it.call("/robots/cell1") as ada:
        refused = done(ada.ask(AskHelp)).refusal
        assert refused is not None
        assert "no class" in str(refused.error())
