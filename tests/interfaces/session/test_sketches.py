"""Explanations as pictures, and the boundary of the reach, as clients get them."""

from __future__ import annotations

from itertools import pairwise
from math import dist

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.session.sketches import sketch
from vrs_cli.kinematics.reach_outline import lines_of, outline
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.acts import Boundary, BoundaryCurves, Sketch, WhyRefused
from vrs_cli.values.results import ChainReport


def session(*lines: str, robot: str = "puma560") -> Session:
    it = Session(RecordingTerminal(), load_robot(robot))
    for line in lines:
        it.perform(line)
    return it


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
