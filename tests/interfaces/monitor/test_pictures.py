"""Pictures of an arm for SHOW, and of explanations; the boundary of the reach."""

from __future__ import annotations

from itertools import pairwise
from math import dist

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.engine.position import position_at
from vrs_cli.interfaces.monitor.explaining import Sight, sketch
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.reach_outline import lines_of, outline
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.transform import position
from vrs_cli.values.acts import Boundary, BoundaryCurves, Sketch, WhyRefused
from vrs_cli.values.replies import ArmPicture, ChainReport

LINES = ("BASE 100, 200, 300", "TOOL TRANS(0,0,150)", "DRIVE 1, 60", "OPENI", "DRIVE 2, 20 AT 5", "DRIVE 3, -20 AT 5.2")


def session(*lines: str, robot: str = "puma560") -> Session:
    made = Session(RecordingTerminal(), load_robot(robot))
    for line in lines:
        made.perform(line)
    return made


def shown(of: Session, line: str) -> ArmPicture:
    terminal = of.terminal
    assert isinstance(terminal, RecordingTerminal)
    of.perform(line)
    picture = terminal.replies[-1]
    assert isinstance(picture, ArmPicture)
    return picture


def test_the_arm_begins_at_its_base_and_ends_at_the_tool_tip() -> None:
    of = session(*LINES)
    picture = shown(of, "SHOW AT 5.3")
    tip = position(position_at(of.engine.arm, of.engine.timeline, 5.3).T_world_tool)
    assert picture.links[-1] == pytest.approx(tip, abs=1e-12)
    assert picture.links[0] == pytest.approx((-0.1, -0.2, -0.3), abs=1e-12)
    assert set(picture.joints) <= set(picture.links)
    assert picture.stamped


def test_the_way_ends_and_begins_where_the_arm_is() -> None:
    of = session(*LINES)
    picture = shown(of, "SHOW AT 5.3")
    assert picture.past[-1][-1] == pytest.approx(picture.links[-1], abs=1e-9)
    assert picture.planned[0][0] == pytest.approx(picture.links[-1], abs=1e-9)
    assert picture.target == pytest.approx(picture.planned[-1][-1], abs=1e-9)


def test_at_rest_there_is_no_target() -> None:
    of = session(*LINES)
    assert shown(of, "SHOW").target is None
    assert shown(of, "SHOW AT 99").target is None
    assert not shown(of, "SHOW AT 99").planned


def test_the_way_has_no_gap_but_where_the_tool_is_changed() -> None:
    of = session("DRIVE 1, 60 AT 1", "DRIVE 2, 20 AT 1.3", "TOOL TRANS(0,0,300)", "DRIVE 1, -60 AT 6")
    lines = shown(of, "SHOW AT 0").planned
    gaps = [dist(a[-1], b[0]) for a, b in pairwise(lines)]
    assert sorted(gaps)[-1] == pytest.approx(0.3)
    assert sorted(gaps)[-2] < 1e-9


def test_in_is_from_now() -> None:
    of = session("DRIVE 1, 60", "DRIVE 1, 30 AT 2")
    assert shown(of, "SHOW IN 0.5").position.time == pytest.approx(of.engine.now + 0.5)


@pytest.mark.parametrize("name", robot_names())
def test_links_are_as_long_as_those_of_the_robot(name: str) -> None:
    """Along the axis of a joint first, and then across; what a joint slides changes a link."""
    of = session(robot=name)
    arm, timeline = of.engine.arm, of.engine.timeline
    links = Sight(arm).picture(timeline, 0.0).links
    drawn = sum(dist(a, b) for a, b in pairwise(links))
    turning = [link for link, turns in zip(arm.model.links, arm.turning, strict=True) if turns]
    slid = sum(q for q, turns in zip(of.engine.position().joints, arm.turning, strict=True) if not turns)
    flange = dist((0.0, 0.0, 0.0), position(arm.model.flange))
    assert drawn == pytest.approx(sum(abs(link.a) + abs(link.d) for link in turning) + slid + flange, rel=0.02)


def test_a_long_past_is_left_out() -> None:
    of = session(*(f"DRIVE 1, {10 if k % 2 else -10} AT {2 * k}" for k in range(200)))
    picture = shown(of, "SHOW AT 400")
    assert 2 <= sum(map(len, picture.past)) < 200


def done(it: Session, act: Boundary | WhyRefused) -> BoundaryCurves | Sketch | None:
    return it.converse(act_on(it, act))


def test_a_refused_motion_has_the_line_as_far_as_it_goes_and_the_rest_of_it() -> None:
    it = session("DO SET far = TRANS(0,900,0)")
    found = done(it, WhyRefused("MOVES far"))
    assert isinstance(found, Sketch)
    ((begin, stop),), ((still, end),) = found.followed, found.refused
    assert stop == still
    assert end == pytest.approx((0.0, 0.9, 0.0))
    assert dist(begin, stop) + dist(stop, end) == pytest.approx(dist(begin, end))
    assert [ball.mood for ball in found.balls] == ["stop"]
    assert found.text.startswith("far: ")


@pytest.mark.parametrize("line", ["DRIVE 1, 500", "nonsense ((", "MOVE 5"])
def test_what_is_no_motion_to_a_place_has_no_picture(line: str) -> None:
    assert done(session(), WhyRefused(line)) is None


def test_a_chain_without_factors_has_no_picture() -> None:
    assert sketch(ChainReport("HERE", ())) is None


@pytest.mark.parametrize("robot", ["puma560", "ur5e", "planar2"])
def test_the_boundary_has_all_pieces_of_the_outline_in_few_lines(robot: str) -> None:
    it = session(robot=robot)
    found = done(it, Boundary())
    assert isinstance(found, BoundaryCurves)
    arm = it.engine.arm
    pieces = outline(arm, arm.configuration(it.engine.position().joints), (0.0, 0.0, 0.0))
    said = {frozenset((a, b)) for line in found.lines for a, b in pairwise(line)}
    assert said == {frozenset(map(tuple, piece)) for piece in pieces.round(9).tolist()}
    assert len(found.lines) <= 12
    assert found.turns == (arm.model.lower[0], arm.model.upper[0])
    assert tuple(lines_of(pieces)) == found.lines
