"""Tests of straight lines as cubic pieces of joints: they are within the tolerance of g at any time."""

from __future__ import annotations

from itertools import pairwise
from math import inf, nan, radians
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from tests.examples import examples
from tests.kinematics.pointing import FIVE, SEVEN
from tests.kinematics.seven_joints import seven_joints
from tests.laws.sessions import Session
from vrs_cli.engine import approximation as pieces
from vrs_cli.engine.approximation import JointPiece, joint_pieces, known_tolerance
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.problem import segment_joints
from vrs_cli.errors import IllegalValue, VrsError
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import at_position
from vrs_cli.trajectory.polynomial import derivative, value
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Segment
from vrs_cli.values.commands import JointTarget, Move, PoseTarget, SetParameter

MODELS = [load_robot(name) for name in ("puma560", "cobra600", "planar2", "irb120", "so100")]
MODELS += [FIVE, SEVEN, seven_joints("panda")]
DENSE = 37  # places of a piece, others than those that it was tried at
COMMANDS = 8


def lines_of(engine: Engine) -> list[Segment]:
    return [segment for segment in engine.timeline if isinstance(segment.path, CartesianPath)]


def farthest(engine: Engine, segment: Segment, found: tuple[JointPiece, ...]) -> float:
    """Return the greatest distance of a joint from g, at the ends of the pieces and densely between them."""
    begin, worst = 0.0, 0.0
    for piece in found:
        for k in range(DENSE + 1):
            s = piece.duration * k / DENSE
            q = segment_joints(engine.arm, segment, min(begin + s, segment.duration))
            worst = max(worst, *(abs(value(a, s) - joint) for a, joint in zip(piece.joints, q, strict=True)))
        begin += piece.duration
    assert begin == pytest.approx(segment.duration, abs=1e-9)
    return worst


@examples(60)
@given(st.sampled_from(MODELS), st.sampled_from(pieces.TOLERANCES), st.integers(0, 10**6))
def test_no_joint_leaves_its_pieces_by_more_than_the_tolerance(model: RobotModel, tolerance: float, seed: int) -> None:
    session = Session(seed, model)
    for _ in range(COMMANDS):
        try:
            session.engine.perform(session.request(), program=session.random.random() < 0.5)
        except VrsError:
            continue
    for segment in Random(seed).sample(lines := lines_of(session.engine), min(len(lines), 3)):
        assert farthest(session.engine, segment, joint_pieces(session.engine.arm, segment, tolerance)) <= tolerance


def plain_line(profile: str = "LSPB") -> Engine:
    """Plan a line of 400 mm of the PUMA 560, from rest to rest."""
    engine = Engine(MODELS[0])
    engine.perform(SetParameter("PROFILE", profile))
    engine.perform(Move(JointTarget(tuple(map(radians, (0.0, -45.0, 180.0, 0.0, 45.0, 0.0)))), straight=False))
    engine.perform(
        Move(PoseTarget(at_position(engine.position(engine.end).T_world_tool, 0.5, 0.4, 0.1)), straight=True)
    )
    return engine


@pytest.mark.parametrize(("profile", "most"), [("LSPB", 6), ("SCURVE", 10), ("QUINTIC", 7)])
def test_a_line_takes_few_pieces(profile: str, most: int) -> None:
    engine = plain_line(profile)
    found = [joint_pieces(engine.arm, segment, 1e-3) for segment in lines_of(engine)]
    assert all(found)
    assert sum(map(len, found)) <= most


def test_pieces_join_smoothly_and_have_the_velocity_of_the_line() -> None:
    engine = plain_line()
    for segment in lines_of(engine):
        found = joint_pieces(engine.arm, segment, 1e-4)
        for piece, after in pairwise(found):
            for a, b in zip(piece.joints, after.joints, strict=True):
                assert value(a, piece.duration) == pytest.approx(b[0], abs=1e-12)
                assert value(derivative(a), piece.duration) == pytest.approx(b[1], abs=1e-9)


def test_a_path_without_joints_has_no_pieces() -> None:
    """A damaged file may have such a path."""
    engine = plain_line()
    first = lines_of(engine)[0]
    path = first.path
    assert isinstance(path, CartesianPath)
    away = structs.replace(path, position=((9.0,), (9.0,), (9.0,)))
    damaged = Segment(first.start, first.finish, away, first.phase, first.motion)
    assert joint_pieces(engine.arm, damaged, 1e-3) == ()


def test_no_pieces_of_what_has_joints() -> None:
    engine = Engine(MODELS[0])
    (rest,) = engine.timeline
    assert isinstance(rest.path, JointPath)
    assert joint_pieces(engine.arm, rest, 1e-3) == ()


@pytest.mark.parametrize(("wanted", "taken"), [(0.1, 0.1), (0.05, 0.01), (1e-3, 1e-3), (9.9e-4, 1e-4), (1e-5, 1e-5)])
def test_a_tolerance_is_rounded_down(wanted: float, taken: float) -> None:
    assert known_tolerance(wanted) == taken


@pytest.mark.parametrize("wanted", [0.0, -1e-3, 9e-6, 0.11, nan, inf])
def test_nonsense_is_refused_with_what_would_be_right(wanted: float) -> None:
    with pytest.raises(IllegalValue, match=r"joints within .* rad.*from 1e-05 to 0.1 rad"):
        known_tolerance(wanted)
