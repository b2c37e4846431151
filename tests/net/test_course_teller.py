"""Parts, sensors and contacts as clients are told of them; `python -m tests.net.course_sessions` tries many."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import inf
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.net.course_sessions import DrawnWorld, contacts_of, red, told_session
from tests.net.serving import Caller, serving
from tests.world.cells import BOX, TABLE, Arm
from vrs_cli.contacts.checker import LOOK
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.net import course_teller
from vrs_cli.net.client import hello_of
from vrs_cli.net.course_teller import CourseTeller, Heard, whole_course
from vrs_cli.net.messages import Course, Done, Refused, ServerMessage, Subscribe
from vrs_cli.net.page_data import recorded_page
from vrs_cli.values.world import PartBegin, SpanKind
from vrs_cli.wire.codec import to_json
from vrs_cli.world.course import World

CELL = f"{TABLE}{BOX}"


@settings(max_examples=4, deadline=None)
@given(st.integers(0, 10**6))
def test_a_client_draws_parts_sensors_and_contacts_as_the_world_has_them(seed: int) -> None:
    it = told_session(seed, 12)
    again = contacts_of(it.world, it.followed, it.engine.now)
    assert it.drawn.looked == again.looked
    for _ in range(20):
        t = it.random.uniform(0.0, it.followed.last + 1.0)
        assert red(it.drawn, t, t) <= red(again, t - LOOK, t + LOOK)
        assert red(again, t, t) <= red(it.drawn, t - LOOK, t + LOOK)


def test_what_touches_for_ever_is_said_so() -> None:
    arm = Arm("MOVE part", "DO SET low = TRANS(0,550,-285,90,90,0)", "MOVES low")
    drawn = contacts_of(World(arm.engine.arm, parse_cell(CELL)), arm.engine.timeline, 0.0)
    touch = next(one for one in drawn.touches if one.second == "table")
    assert touch.end is None
    assert 0.0 < touch.begin < arm.engine.end


def test_a_long_course_comes_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(course_teller, "MAX_ROWS", 2)
    arm = Arm("MOVE part")
    for _ in range(3):
        arm.session.perform("CLOSEI")
        arm.session.perform("MOVE place")
        arm.session.perform("OPENI")
        arm.session.perform("MOVE part")
    world, timeline = World(arm.engine.arm, parse_cell(CELL)), arm.engine.timeline
    teller, heard, drawn = CourseTeller(world, lambda: 0.0), Heard(), DrawnWorld()
    teller.begin(timeline)
    while teller.step():
        pass
    told, parts = [], 0
    while True:
        told, heard = teller.after(heard)
        for message in told:
            drawn.hear(message)
            parts += isinstance(message, Course)
        if not told:
            break
    assert parts > 2
    rows = drawn.tracks["part", "box"]
    assert [row.begin for row in rows] == [span.begin for span in world.course(timeline).spans("box")]


def test_a_saved_trajectory_has_the_same_course() -> None:
    arm = Arm("OPENI", "MOVE part", "CLOSEI", "MOVE place")
    whole = whole_course(World(arm.engine.arm, parse_cell(CELL)), arm.engine.timeline)
    told = json.loads(to_json(whole))
    assert [row[1] for row in told["rows"]["parts"]["box"]] == ["rests", "held"]
    assert told["until"] is None
    recorded = recorded_page(arm.engine.arm, arm.engine.timeline, cell=parse_cell(CELL))
    assert json.loads(json.dumps(recorded["world"])) == told


def test_contacts_of_a_long_recording_are_not_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(course_teller, "MAX_LOOKED", 0.1)
    arm = Arm("MOVE part")
    assert whole_course(World(arm.engine.arm, parse_cell(CELL)), arm.engine.timeline).touches is None


def test_a_served_robot_tells_its_course_to_those_who_ask(tmp_path: Path) -> None:
    """It is told anew from the change on after UNDO, and a second client that comes late draws the same."""
    with serving(tmp_path, journal=False, cell=parse_cell(CELL)) as it, Caller(it.address, hello_of()) as first:
        assert first.ask(lambda id: Subscribe(id, deltas=True, world=True)) == Done(1, seq=1)
        first.lines("DO SET part = TRANS(0,550,-250,90,90,0)", "OPENI", "MOVE part", "CLOSEI", "DEPART 100")
        drawn = drawn_at_rest(first, lambda row: row.kind is SpanKind.HELD)
        taken = drawn.row("part", "box", inf).begin
        first.lines("UNDO 2")
        undone = drawn_at_rest(first, lambda row: row.kind is SpanKind.RESTS)
        assert any(isinstance(one, Course) and one.since is not None for one in first.heard)
        assert undone.row("part", "box", taken).kind is SpanKind.RESTS
        with Caller(it.address, hello_of()) as late:
            late.ask(lambda id: Subscribe(id, deltas=True, world=True))
            again = drawn_at_rest(late, lambda row: row.kind is SpanKind.RESTS)
        assert again.tracks["part", "box"] == undone.tracks["part", "box"]


def drawn_at_rest(caller: Caller, wanted: Callable[[PartBegin], bool]) -> DrawnWorld:
    """What a client draws when it knows for ever what the box does, and that this is what is wanted."""

    def draw() -> DrawnWorld:
        drawn = DrawnWorld()
        for message in caller.heard:
            drawn.hear(message)
        return drawn

    def known(_message: ServerMessage | None = None) -> bool:
        drawn = draw()
        return drawn.until == inf and wanted(drawn.row("part", "box", inf))

    if not known():
        caller.until(known)
    return draw()


def test_a_course_without_changes_is_refused(tmp_path: Path) -> None:
    with serving(tmp_path, journal=False, cell=parse_cell(CELL)) as it, Caller(it.address, hello_of()) as caller:
        refused = caller.ask(lambda id: Subscribe(id, world=True))
        assert isinstance(refused, Refused)
        assert "deltas" in refused.refusal.message
