"""Contacts as users meet them: refused, or told; explained by WHY; stopped before by JOG and by a dragged tool."""

from __future__ import annotations

from math import radians

import pytest

pytest.importorskip("mujoco")

from tests.engine.wall import ManualWall
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.contacts import watch
from vrs_cli.errors import CollisionAhead
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.interfaces.dragging import Dragging
from vrs_cli.interfaces.jog.jogger import Jogger
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.streams import DRAG_TICK
from vrs_cli.kinematics.transform import at_position
from vrs_cli.values.dragging import Limit
from vrs_cli.values.hand import Axis, Frame
from vrs_cli.values.replies import MotionReport, ReachReport
from vrs_cli.values.results import Message

WALL = """
[[fixture]]
name = "wall"
shape = "box"
size = [50, 600, 800]
at = [450, 300, 0]
"""
PART = """
[[part]]
name = "block"
shape = "box"
size = [40, 40, 40]
at = [0, 550, -400]
"""
INTO = "DRIVE 2, 60, 100"


def session_of(cell: str = WALL) -> Session:
    session = Session(RecordingTerminal())
    session.driver.surround(parse_cell(cell))
    return session


def told(session: Session) -> list[str]:
    terminal = session.terminal
    assert isinstance(terminal, RecordingTerminal)
    return [reply.text for reply in terminal.replies if isinstance(reply, Message)]


def test_a_contact_is_told_once_a_motion() -> None:
    session = session_of()
    session.perform(f"DO {INTO}")
    (line,) = [line for line in told(session) if "touches wall" in line]
    assert line.startswith(f"{INTO}: ")
    assert session.engine.end > 0.5
    ((text, contact),) = session.contacts.contacts
    assert text == INTO
    assert contact.second == "wall"
    assert 0.425 - 0.01 < contact.place[0] < 0.475
    assert contact.depth == contact.needed > 0.05


def test_with_enable_collision_the_motion_does_not_begin() -> None:
    session = session_of()
    session.perform("ENABLE COLLISION")
    with pytest.raises(CollisionAhead, match="touches wall at") as refused:
        session.perform(f"DO {INTO}")
    assert session.engine.end == 0.0
    assert refused.value.place is not None
    assert refused.value.value == refused.value.lower
    assert not session.contacts.contacts
    session.perform("DISABLE COLLISION")
    session.perform(f"DO {INTO}")
    assert session.engine.end > 0.0


def test_clearance_refuses_what_comes_near() -> None:
    session = session_of()
    session.perform("ENABLE COLLISION")
    session.perform("DO DRIVE 2, 20, 100")
    session.perform("DO DRIVE 2, -20, 100")
    session.perform("PARAMETER CLEARANCE = 200")
    with pytest.raises(CollisionAhead, match="too near to wall"):
        session.perform("DO DRIVE 2, 20, 100")


def test_the_arm_may_touch_itself_nowhere() -> None:
    session = Session(RecordingTerminal())
    session.perform("ENABLE COLLISION")
    with pytest.raises(CollisionAhead, match="touches"):
        session.perform("DO MOVE #PPOINT(0, 45, 165, 0, 0, 0)")


def test_stopping_is_never_refused() -> None:
    wall = ManualWall()
    session = Session(RecordingTerminal(), clock=wall.clock())
    session.driver.surround(parse_cell(WALL))
    session.perform(f"DO {INTO}")
    wall.seconds += 0.5
    session.perform("ENABLE COLLISION")
    session.perform("PARAMETER CLEARANCE = 500")
    session.stop()
    assert session.engine.end < 1.0


def test_why_tells_what_motions_would_touch() -> None:
    session = session_of()
    session.perform("DO MOVE #PPOINT(0, -45, 180, 20, 45, 0)")
    far = session.engine.position().T_world_tool
    session.perform("DO DRIVE 1, 90, 100")
    x, y, z = far.px, far.py, far.pz
    (report,) = [
        r
        for r in session.answers(f"WHY TRANS({1000 * x + 200:.0f}, {1000 * y:.0f}, {1000 * z:.0f}, 90, 90, 0)")
        if isinstance(r, ReachReport)
    ]
    contact = report.move_contact or report.line_contact
    assert contact is not None
    assert "wall" in (contact.first, contact.second)
    assert session.engine.end == session.engine.now


def test_explain_tells_what_a_motion_would_touch_and_touches_nothing() -> None:
    session = session_of()
    terminal = session.terminal
    assert isinstance(terminal, RecordingTerminal)
    session.perform(f"EXPLAIN {INTO}")
    report = terminal.replies[-1]
    assert isinstance(report, MotionReport)
    assert report.plan is not None
    assert report.plan.contact is not None
    assert "wall" in (report.plan.contact.first, report.plan.contact.second)
    assert not session.contacts.contacts
    session.perform("ENABLE COLLISION")
    session.perform(f"EXPLAIN {INTO}")
    refused = terminal.replies[-1]
    assert isinstance(refused, MotionReport)
    assert refused.plan is None
    with pytest.raises(CollisionAhead) as error:
        session.perform(f"DO {INTO}")
    assert refused.refusal == str(error.value)


def test_jog_stops_before_a_contact() -> None:
    session = session_of()
    session.perform("ENABLE COLLISION")
    jogger = Jogger(session)
    said = jogger.step(Axis(Frame.JOINT, 1), 60.0)
    assert said.startswith("The arm stops before a contact: ")
    moved = session.engine.position().joints[1] - session.engine.model.poses["ready"][1]
    assert radians(5.0) < moved < radians(60.0)


def test_a_dragged_tool_stops_before_a_contact() -> None:
    session = session_of()
    session.perform("DO MOVE TRANS(200, 400, 0, 90, 90, 0)")
    session.perform("ENABLE COLLISION")
    engine = session.engine
    here = engine.position().T_world_tool
    begun, dragging, holds = engine.now, Dragging(engine), set()
    for k in range(100):
        shortfall = dragging.to(at_position(here, here.px + min(0.004 * k, 0.25), here.py, here.pz))
        holds |= {hold.limit for hold in shortfall.holds}
        engine.clock.advance(engine.now + DRAG_TICK)
    assert Limit.CONTACT in holds
    assert engine.position().T_world_tool.px > here.px + 0.05
    assert session.contacts.first_contact(engine.timeline, begun, engine.end, engine.settings) is None


@pytest.mark.parametrize("asked", ["ENABLE COLLISION", "PARTS"])
def test_without_the_package_one_line_says_so_where_contacts_or_parts_are_asked_for(
    monkeypatch: pytest.MonkeyPatch, asked: str
) -> None:
    monkeypatch.setattr(watch, "find_spec", lambda _: None)
    session = session_of(WALL + PART)
    session.perform(f"DO {INTO}")
    assert not [line for line in told(session) if "contacts" in line]
    for line in (asked, "DO DRIVE 1, 10, 100", asked, "DO DRIVE 1, 10, 100"):
        session.perform(line)
    assert [line.partition(":")[0] for line in told(session) if "contacts" in line] == ["contacts are not checked"]


def test_without_scene_and_switch_nothing_is_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "find_spec", lambda _: pytest.fail("asked"))
    Session(RecordingTerminal()).perform(f"DO {INTO}")


def test_a_steered_motion_is_told_once() -> None:
    session = session_of()
    engine = session.engine
    session.perform("DO MOVE TRANS(200, 400, 0, 90, 90, 0)")
    here = engine.position().T_world_tool
    dragging = Dragging(engine)
    for k in range(80):
        dragging.to(at_position(here, here.px + min(0.004 * k, 0.25), here.py, here.pz))
        engine.clock.advance(engine.now + DRAG_TICK)
    assert [text for text, _ in session.contacts.contacts] == ["DRAG"]
