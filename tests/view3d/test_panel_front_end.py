"""Who sits at a panel, on a robot that is served: what is typed, asked, refused, who drives."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from tests.live import until
from tests.net.cable import cable
from tests.net.serving import Serving, serving
from vrs_cli.net.client import hello_of
from vrs_cli.net.messages import Abort, LeaseAct
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.view3d.panel_front_end import PanelFrontEnd
from vrs_cli.view3d.window import Surveying

ASK = '.PROGRAM ask()\n  PROMPT "How many? ", n\n  TYPE "got", n\n.END\n'


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Serving]:
    with serving(tmp_path) as it:
        yield it


@contextmanager
def sitting(url: str, name: str = "ada") -> Iterator[PanelFrontEnd]:
    robot = SocketPort.connect(url, hello_of(name=name, attended=True))
    try:
        yield PanelFrontEnd(robot)
    finally:
        robot.close()


def idle(front_end: PanelFrontEnd) -> bool:
    return not front_end.waiting


def said(front_end: PanelFrontEnd) -> str:
    return front_end.transcript.html()


def test_a_line_moves_the_arm_and_is_answered(served: Serving) -> None:
    with sitting(served.address) as front_end:
        front_end.type("MOVE #PPOINT(0,-45,180)")
        until(lambda: idle(front_end))
        assert len(front_end.robot.follow().timeline) > 1
        front_end.type("LISTL")
        until(lambda: "No locations defined" in said(front_end))
        assert front_end.history == ["MOVE #PPOINT(0,-45,180)", "LISTL"]
        assert front_end.lease.driver == front_end.robot.name == "ada"


def test_what_is_wrong_is_shown_with_its_caret(served: Serving) -> None:
    with sitting(served.address) as front_end:
        found = []
        front_end.check("MOVEE a", found.append)
        until(lambda: found)
        assert "Illegal monitor command" in found[0].message
        front_end.type("MOVEE a")
        until(lambda: "^" in said(front_end))
        front_end.type("MOVE nowhere")
        until(lambda: "Undefined value" in said(front_end))


def test_nothing_that_is_typed_is_markup(served: Serving) -> None:
    evil = "<img src=x onerror=alert(1)>"
    with sitting(served.address) as front_end:
        front_end.type(f'TYPE "{evil}"')
        front_end.type(evil)
        until(lambda: idle(front_end) and said(front_end).count("onerror") >= 3)
        assert "<img" not in said(front_end)


def test_a_question_is_answered(served: Serving) -> None:
    with sitting(served.address) as front_end:
        front_end.type(ASK)
        front_end.type("EXECUTE ask")
        until(lambda: front_end.question is not None)
        assert front_end.question is not None
        front_end.answer(front_end.question, "4")
        until(lambda: "got 4" in said(front_end))
        assert front_end.question is None
        front_end.type("DELETEP ask")
        until(lambda: front_end.question is not None)
        assert front_end.question is not None
        front_end.answer(front_end.question, True)
        until(lambda: idle(front_end))
        front_end.type("DIRECTORY")
        until(lambda: "No programs in memory" in said(front_end))


def test_what_fills_a_screen_is_refused(served: Serving) -> None:
    with sitting(served.address) as front_end:
        front_end.type("JOG")
        until(lambda: "JOG alone needs a terminal with keys" in said(front_end))
        assert front_end.question is None


def test_stop_overtakes_what_is_under_way(tmp_path: Path) -> None:
    with serving(tmp_path, realtime=1.0) as it, sitting(it.address) as front_end:
        front_end.type(".PROGRAM long()\n  DELAY 1000\n.END\nEXECUTE long")
        until(lambda: front_end.running == ("long",))
        front_end.robot.ask(Abort)
        until(lambda: front_end.running == ())
        until(lambda: "Program stopped at long" in said(front_end))
        assert front_end.robot.follow().now < 20.0


def test_a_question_that_nobody_answers_is_withdrawn_by_stop(tmp_path: Path) -> None:
    with serving(tmp_path, realtime=1.0) as it, sitting(it.address) as front_end:
        front_end.type(ASK)
        front_end.type("EXECUTE ask")
        until(lambda: front_end.question is not None)
        front_end.robot.ask(Abort)
        until(lambda: front_end.question is None and front_end.running == ())


def test_two_who_share_a_robot(served: Serving) -> None:
    with sitting(served.address, "ada") as ada, sitting(served.address, "bo") as bo:
        ada.type("x = 1")
        until(lambda: bo.lease.driver == "ada")
        assert not bo.may_drive
        bo.type("x = 2")
        until(lambda: "ada drives" in said(bo))
        bo.drive(LeaseAct.ASK)
        until(lambda: ada.lease.asking == "bo")
        assert "bo would like to drive" in said(ada)
        ada.drive(LeaseAct.GIVE, "bo")
        until(lambda: bo.lease.driver == "bo")
        until(lambda: ada.lease == ("bo", ""))
        assert "You drive" in said(bo)
        assert "bo drives" in said(ada)
        bo.type("x = 3")
        until(lambda: idle(bo))
        bo.robot.ask(Abort)
        until(lambda: "bo stops" in said(ada) or idle(bo))


def test_a_file_is_put_in_memory(served: Serving) -> None:
    with sitting(served.address) as front_end:
        surveying = Surveying(front_end.robot)
        front_end.load("pick.v2", b".PROGRAM pick()\n  MOVE part\n.END\n.LOCATIONS\npart 300 450 -200 90 90 0\n.END\n")
        until(lambda: "In memory: pick" in said(front_end))
        until(lambda: surveyed(surveying) and surveying.found and surveying.found.programs.rows)  # type: ignore[union-attr]
        surveying.program = "pick"
        until(lambda: surveyed(surveying) and surveying.found and surveying.found.text)
        front_end.load("bad.v2", b".PROGRAM bad()\n  MOVEE part\n.END\n")
        until(lambda: "bad.v2:2:" in said(front_end))
        front_end.load("bad.v2", b"\xff\xfe")
        assert "bad.v2 is no text" in said(front_end)


def surveyed(surveying: Surveying) -> bool:
    surveying.look(time.monotonic())
    return surveying.found is not None


def test_steps_are_looked_at_while_a_program_runs(tmp_path: Path) -> None:
    text = ".PROGRAM count()\n" + "  TYPE 1\n" * 150 + "  WAIT SIG(1001)\n  TYPE 2\n.END\nEXECUTE count"
    with serving(tmp_path, realtime=1.0) as it, sitting(it.address) as front_end:
        surveying = Surveying(front_end.robot)
        front_end.type(text)
        until(lambda: surveyed(surveying) and surveying.task and surveying.task.step == 151)
        until(
            lambda: (
                surveyed(surveying)
                and surveying.found
                and surveying.found.text
                and 151 in [row.number for row in surveying.found.text.rows]
            )
        )
        asked, post = [], front_end.robot.post
        front_end.robot.post = lambda make, outlet: asked.append(1) or post(make, outlet)  # type: ignore[method-assign]
        for tick in range(100):  # two seconds at 50 Hz
            surveying.look(1e6 + tick * 0.02)
            until(lambda: not surveying._under_way)
        assert 7 <= len(asked) <= 9, "four times a second"


def test_a_connection_that_is_cut(served: Serving) -> None:
    with ExitStack() as stack:
        with cable(served.address) as wire:
            front_end = stack.enter_context(sitting(wire.url))
            until(lambda: idle(front_end))
            wire.pull()
            until(lambda: "connected again" in said(front_end))
        until(lambda: not front_end.robot.open)
        found: list[object] = []
        front_end.check("WHERE", found.append)
        until(lambda: found == [None])
        front_end.type("WHERE")
        assert "there is no connection" in said(front_end)
        assert "WHERE" not in front_end.waiting.values()
