"""Tests of straight lines near and through singularities: slowed down, or refused with the place, the joint and a way
out.
"""

from __future__ import annotations

from math import hypot, pi, radians

import numpy as np
import pytest

from tests.laws.boundary_lines import check_rates
from tests.laws.motion_laws import check_continuous, check_limits
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joints_over
from vrs_cli.errors import JointOutOfRange, LocationOutOfRange, MotionError, StraightLineSingular
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import angle_between, compose, from_oat, position, rotation_z, translation
from vrs_cli.values.commands import Move, PoseTarget, SetBase, SetParameter

MODEL = load_robot("puma560")
PROFILES = pytest.mark.parametrize("profile", list(Profile.__members__))
BEFORE_THE_WRIST = (
    0.0,
    -45.0,
    150.0,
    0.0,
    10.0,
    0.0,
)  # 250 mm lower joint 5 has come to 0 and would turn the other way
BENT = (0.0, -20.0, 110.0, 0.0, 40.0, 0.0)  # 10.05 mm farther out the arm is stretched
STRETCHED = 0.89197  # [m] x of the tool there
SIDE = 0.149  # [m] the wrist comes no nearer to the axis of joint 1


def at(degrees: tuple[float, ...], profile: str) -> Engine:
    engine = Engine(MODEL, start=tuple(map(radians, degrees)))
    engine.perform(SetParameter("PROFILE", profile))
    return engine


def beside(engine: Engine, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Move:
    """Move straight by these distances [m]."""
    here = engine.position().T_world_tool
    return Move(PoseTarget(here._replace(px=here.px + x, py=here.py + y, pz=here.pz + z)), straight=True)


def across(y: float, profile: str) -> tuple[Engine, Move]:
    """Make a line past the axis of joint 1; its wrist comes within y [m] of the axis."""
    engine = Engine(MODEL)
    engine.perform(SetParameter("PROFILE", profile))
    turned = tuple(map(radians, (90.0, 90.0, 0.0)))
    engine.perform(Move(PoseTarget(from_oat(-0.3, y, -0.45, *turned)), straight=False))
    return engine, Move(PoseTarget(from_oat(0.3, y, -0.45, *turned)), straight=True)


@PROFILES
@pytest.mark.parametrize(
    ("robot", "upright"),
    [
        ("puma260", (0.0, -90.0, 90.0, 0.0, 0.0, 0.0)),
        ("puma560", (0.0, -90.0, 92.686395, 0.0, 30.0, 0.0)),
        ("irb120", (0.0, 0.0, -76.94997, 0.0, 30.0, 0.0)),
    ],
)
def test_an_upright_arm_neither_goes_straight_down_nor_comes_from_there(
    robot: str, upright: tuple[float, ...], profile: str
) -> None:
    """The whole line lies on the boundary of the shoulder. One end is on that of the elbow, perpendicular to it."""
    engine = Engine(load_robot(robot), start=tuple(map(radians, upright)))
    engine.perform(SetParameter("PROFILE", profile))
    above = engine.position().T_world_tool
    for off in (-0.02, -0.1):
        with pytest.raises(MotionError):
            engine.perform(beside(engine, z=off))
    engine.perform(Move(PoseTarget(above._replace(pz=above.pz - 0.02)), straight=False))
    with pytest.raises(MotionError):
        engine.perform(Move(PoseTarget(above), straight=True))


@pytest.mark.parametrize("bent", [3e-10, -7e-10])
def test_a_wrist_within_a_billionth_of_straight_does_not_jitter(bent: float) -> None:
    """The tool turns about itself. Joint 4 would be the direction of a vector of almost no length."""
    engine = Engine(MODEL, start=(0.3, -0.8, 2.4, 0.4, bent, -0.2))
    engine.perform(SetParameter("PROFILE", "SCURVE"))
    here = engine.position().T_world_tool
    engine.perform(Move(PoseTarget(compose(here, rotation_z(0.6))), straight=True))
    q = joints_over(engine.arm, engine.timeline, np.arange(0.0, engine.end, 1e-3))
    assert (np.abs(np.diff(q, n=3, axis=0)) <= 1e-9 * np.array(MODEL.max_jerk)).all()


@PROFILES
def test_a_line_out_of_a_singular_pose_may_not_make_a_joint_jump_by_a_hair(profile: str) -> None:
    """Joint 6 would have to turn by 0.06 deg before the line begins at READY, where joint 5 is 0."""
    engine = Engine(MODEL)
    engine.perform(SetParameter("PROFILE", profile))
    turned = map(radians, (66.4, 110.6, -25.6))
    refusal = refused(engine, Move(PoseTarget(from_oat(-0.0662, 0.386, -0.108, *turned)), straight=True))
    assert "would have to jump by 0.1 deg" in str(refusal)


def refused(engine: Engine, move: Move) -> MotionError:
    before = engine.timeline
    with pytest.raises(MotionError) as caught:
        engine.perform(move)
    assert engine.timeline is before
    assert caught.value.place is not None
    assert caught.value.hint
    return caught.value


def check_slowed(engine: Engine, move: Move, at_least: float) -> None:
    """Check that the line is slower than the tool alone would be, and that every law holds."""
    begin = engine.end
    way = hypot(*(b - a for a, b in zip(*_ends(engine, move), strict=True)))
    engine.perform(move)
    assert engine.end - begin > at_least * (way / MODEL.linear_speed + 0.3)
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


def _ends(engine: Engine, move: Move) -> tuple[tuple[float, ...], tuple[float, ...]]:
    assert isinstance(move.target, PoseTarget)
    return position(engine.position().T_world_tool), position(move.target.T_world_tool)


@PROFILES
def test_past_the_wrist_singularity(profile: str) -> None:
    turned = (*BEFORE_THE_WRIST[:3], 20.0, *BEFORE_THE_WRIST[4:])
    engine = at(turned, profile)
    check_slowed(engine, beside(engine, z=-0.25), at_least=2.0)


@PROFILES
@pytest.mark.parametrize("joint_4", [0.0, 2.0, 5.0])
def test_through_the_wrist_singularity_joint_4_would_have_to_turn_round(profile: str, joint_4: float) -> None:
    engine = at((*BEFORE_THE_WRIST[:3], joint_4, *BEFORE_THE_WRIST[4:]), profile)
    error = refused(engine, beside(engine, z=-0.25))
    assert isinstance(error, JointOutOfRange)
    assert error.joint == 4
    assert "(wrist singularity)" in error.detail
    assert "tilted" in error.hint


@PROFILES
def test_next_to_the_elbow_singularity(profile: str) -> None:
    engine = at(BENT, profile)
    here = engine.position().T_world_tool
    check_slowed(engine, beside(engine, x=STRETCHED - 0.0001 - here.px), at_least=1.5)


@PROFILES
def test_through_the_elbow_singularity_is_out_of_reach(profile: str) -> None:
    engine = at(BENT, profile)
    error = refused(engine, beside(engine, x=0.2))
    assert isinstance(error, LocationOutOfRange)
    assert error.place is not None
    assert error.place[0] == pytest.approx(STRETCHED, abs=1e-4)


@PROFILES
def test_past_the_shoulder_singularity(profile: str) -> None:
    check_slowed(*across(SIDE + 0.021, profile), at_least=2.0)


@PROFILES
def test_nearer_to_the_shoulder_singularity_joint_1_would_be_too_fast(profile: str) -> None:
    engine, line = across(SIDE + 0.0002, profile)
    engine.perform(SetParameter("STRETCH", 4.0))
    error = refused(engine, line)
    assert isinstance(error, StraightLineSingular)
    assert "joint 1" in error.detail
    assert "(shoulder singularity)" in error.detail
    assert "axis of joint 1" in error.hint
    assert error.place is not None
    assert abs(error.place[1] - SIDE) < 0.001


@PROFILES
def test_through_the_shoulder_singularity_is_out_of_reach(profile: str) -> None:
    engine, line = across(0.2, profile)
    through = from_oat(0.3, -0.17, -0.45, *map(radians, (90.0, 90.0, 0.0)))
    assert isinstance(line.target, PoseTarget)
    error = refused(engine, Move(PoseTarget(through), straight=True))
    assert isinstance(error, LocationOutOfRange)


@PROFILES
@pytest.mark.parametrize("joint_1", [0.0, 8.0])
def test_into_the_wrist_singularity_a_line_is_as_fast_as_elsewhere(profile: str, joint_1: float) -> None:
    engine = at((joint_1, -60.0, 140.0, 30.0, 25.0, 10.0), profile)
    straight = tuple(map(radians, (0.0, -60.0, 140.0, 30.0, 0.0, 10.0)))
    engine.perform(Move(PoseTarget(engine.arm.forward(straight)), straight=True))
    assert engine.arm.singularity(engine.position().joints).wrist < 1e-9
    assert engine.end < 1.0
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


@PROFILES
@pytest.mark.parametrize("off", [1e-12, 1e-11, 1e-10, 9e-10])
def test_a_billionth_beside_the_wrist_singularity_a_line_ends_in_it(profile: str, off: float) -> None:
    """Joint 4 would turn by a quarter at the end of the way, where joint 5 is that small."""
    engine = at((8.0, -60.0, 140.0, 30.0, 25.0, 10.0), profile)
    q1, q2, q3, q4, _, q6 = map(radians, (0.0, -60.0, 140.0, 30.0, 0.0, 10.0))
    beside = engine.arm.forward((q1, q2, q3, q4 + 0.5 * pi, off, q6 - 0.5 * pi))
    engine.perform(Move(PoseTarget(beside), straight=True))
    assert engine.end < 1.0
    assert angle_between(engine.arm.forward(engine.position().joints), beside) < 1.1 * off
    check_rates(engine.arm, tuple(engine.timeline))


@PROFILES
def test_out_of_the_wrist_singularity_a_line_that_turns_joint_5_alone_is_as_fast_as_elsewhere(profile: str) -> None:
    straight = (20.0, -60.0, 140.0, 0.0, 0.0, 10.0)
    bent = tuple(map(radians, (20.0, -60.0, 140.0, 0.0, 25.0, 10.0)))
    engine = at(straight, profile)
    engine.perform(Move(PoseTarget(engine.arm.forward(bent)), straight=True))
    assert engine.end < 1.0
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


@PROFILES
def test_where_several_boundaries_meet_a_line_is_a_tangent_of_each(profile: str) -> None:
    """READY of the PUMA 260 is stretched out, and its wrist is as near to the axis of joint 1 as it comes. On a line
    that is a tangent only of that, the elbow folds with the square root of the way.
    """
    engine = Engine(load_robot("puma260"))
    engine.perform(SetParameter("PROFILE", profile))
    assert isinstance(refused(engine, beside(engine, x=0.0153, z=-0.02)), StraightLineSingular)


def test_the_place_is_told_in_the_world_frame() -> None:
    engine = at(BEFORE_THE_WRIST, "LSPB")
    engine.perform(SetBase(translation(0.0, 0.0, 0.1)))
    error = refused(engine, beside(engine, z=-0.25))
    assert error.place is not None
    assert f"Z {1e3 * (error.place[2] - 0.1):.1f} mm" in error.detail


def test_a_line_that_fails_far_from_a_singular_start_does_not_blame_the_start() -> None:
    engine = Engine(MODEL)
    far = PoseTarget(from_oat(1.2, 0.15, -0.1, radians(90.0), radians(90.0), 0.0))
    assert "starts in a singular pose" not in refused(engine, Move(far, straight=True)).hint
