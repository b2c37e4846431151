"""Tests of straight lines that ask too much of a joint: between samples, at their start, or with a least duration."""

from __future__ import annotations

from math import radians
from pathlib import Path
from random import Random

import numpy as np
import pytest
from msgspec import structs

from tests.laws.motion_laws import check_continuous, check_limits, off_line
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.following import Follower
from vrs_cli.engine.position import joints_over
from vrs_cli.engine.problem import Here, Problem
from vrs_cli.engine.single_motion import plan_motion
from vrs_cli.engine.straight import straight_segments
from vrs_cli.errors import JointOutOfRange, LocationOutOfRange, LocationTooFar, MotionError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Configuration, Joints, Profile
from vrs_cli.kinematics.model import PROFILES
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    angle_between,
    at_position,
    from_oat,
    position,
    rotation_z,
    translation,
)
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.segment import JointPath, Phase
from vrs_cli.trajectory.state import JointState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import (
    Frames,
    JointOffsetTarget,
    JointTarget,
    Motion,
    MotionKind,
    Move,
    PoseTarget,
    SetDuration,
    SetParameter,
    Stamp,
    Start,
)

MODEL = load_robot("puma560")
ALONG = radians(90), radians(90), 0.0  # the tool along Y
URDF = Path(__file__).parent.parent / "kinematics" / "urdf"


def test_a_line_out_of_a_spinning_straight_wrist_brakes_first() -> None:
    """At READY joints 4 and 6 turn about one axis, so a line that starts there cannot tell which of them is turning."""
    engine = Engine(MODEL)
    engine.perform(Move(JointOffsetTarget(4, radians(-32.0)), straight=False))
    engine.perform(Move(JointOffsetTarget(4, radians(-45.0)), straight=True, stamp=Stamp(0.2)))
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


@pytest.mark.parametrize(("wrist", "up"), [(0.0, 0.05), (30.0, 0.5)])
def test_a_line_to_a_place_out_of_reach_is_refused_as_moves_are(wrist: float, up: float) -> None:
    """No MOVE and no via point would help, whether the line starts in a singular pose or not."""
    engine = Engine(MODEL)
    engine.perform(Move(JointTarget(tuple(map(radians, (0.0, -60.0, 120.0, 0.0, wrist, 0.0)))), straight=False))
    there = at_position(end := engine.position(engine.end).T_world_tool, end[3], end[7], end[11] + up)
    words = set()
    for straight in (False, True):
        with pytest.raises(LocationTooFar) as refused:
            engine.perform(Move(PoseTarget(there), straight))
        words.add(str(refused.value))
    assert len(words) == 1


def test_a_line_with_a_least_duration_is_slowed_down_as_any_other() -> None:
    engine = Engine(MODEL, start=(-1.6501519, -2.8466530, -0.2748186, 0.8366720, 0.5139521, -3.0634252))
    engine.perform(SetDuration(2.6268))
    below = Transform(-1.0, 0.0, 0.0, -0.060947, 0.0, 1.0, 0.0, 0.14909, 0.0, 0.0, -1.0, -0.446873)
    engine.perform(Move(PoseTarget(below), straight=True))
    assert engine.end > 2.7, "the least duration is too short for a joint"
    check_limits(engine, engine.timeline)


def test_a_line_out_of_motion_with_a_least_duration_is_slowed_down_without_braking_first() -> None:
    """The least duration grows with the slowing; otherwise it alone would keep the line as fast as it is."""
    engine = Engine(MODEL)
    joints = tuple(map(radians, (-1.38, -93.34, 140.83, 90.42, -22.58, 16.76)))
    velocity = tuple(map(radians, (44.3, 15.82, 54.75, 44.68, -68.3, -58.6)))
    pose = from_oat(-0.1792, 0.1374, 0.8884, *map(radians, (-30.3, -80.5, -117.2)))
    motion = Motion(1, MotionKind.STRAIGHT, Start.AT, pose=pose, duration=3.93)
    segments = plan_motion(Problem(engine.arm, Here(JointState(joints, velocity)), motion, 0.0))
    assert segments[0].phase is Phase.BLEND
    engine.book.timeline = Timeline(segments)
    check_limits(engine, segments)


def test_a_joint_that_turns_back_outside_its_range_is_seen_between_samples() -> None:
    """On a line across the front of the robot joint 3 bends most where the line is nearest to the shoulder."""
    start = tuple(map(radians, (-35.0, -20.0, 200.0, 0.0, -60.0, 0.0)))
    free = Engine(MODEL, start=start)
    here = free.position().T_world_tool
    across = Move(PoseTarget(here._replace(py=here.py + 0.43)), straight=True)
    free.perform(across)
    times = [free.end * k / 5000 for k in range(5001)]
    farthest = max(free.position(t).joints[2] for t in times)
    assert farthest > max(start[2], free.position(free.end).joints[2]) + 0.01, "it turns back on the way"
    upper = (*MODEL.upper[:2], farthest - 1e-6, *MODEL.upper[3:])
    narrow = Engine(structs.replace(MODEL, upper=upper), start=start)
    with pytest.raises(JointOutOfRange, match="Joint 3"):
        narrow.perform(across)


@pytest.mark.parametrize("robot", ["puma560", "ur5e", "cobra600"])
def test_a_joint_that_is_farthest_between_samples_is_known_to_a_ten_millionth(robot: str) -> None:
    """Try random lines, and a range that ends just beyond or before the farthest place of a joint."""
    model, random, tried = load_robot(robot), Random(4), 0
    while tried < 4:
        rows = list(zip(model.lower, model.upper, strict=True))
        start = tuple(low + random.uniform(0.3, 0.7) * (high - low) for low, high in rows)
        goal = tuple(q + random.gauss(0.0, 0.12) for q in start)
        motion = Motion(1, MotionKind.STRAIGHT, Start.AT, pose=arm_for(model).forward(goal))
        still = Here(JointState(start, (0.0,) * len(start)))
        try:
            timeline = Timeline(plan_motion(Problem(arm_for(model), still, motion, 0.0)))
        except MotionError:
            continue
        joints = joints_over(arm_for(model), timeline, np.linspace(0.0, timeline.end, 20001))
        beyond = joints.max(axis=0) - np.maximum(joints[0], joints[-1])
        joint = int(beyond.argmax())
        if beyond[joint] < 1e-4:
            continue
        tried += 1
        for hair, possible in ((2e-7, True), (-2e-7, False)):
            upper = [*model.upper]
            upper[joint] = float(joints[:, joint].max()) + hair
            arm = arm_for(structs.replace(model, upper=tuple(upper)))
            if possible:
                plan_motion(Problem(arm, still, motion, 0.0))
            else:
                with pytest.raises(JointOutOfRange, match=f"Joint {joint + 1}"):
                    plan_motion(Problem(arm, still, motion, 0.0))


def test_an_acceleration_that_peaks_between_two_samples_is_seen() -> None:
    """In a blend out of a turning wrist joint 6 accelerates most a third of the way through."""
    engine = Engine(MODEL)
    joints = (-1.3172524861869788, -2.6366331336394713, -0.48808332804914956)
    wrist = (-0.7295468965578575, -0.10832118629093608, 0.6089386835015633)
    velocity = (-0.07555095, 0.58118274, -0.23310806, 1.96178389, -0.2550953, -2.25853576)
    pose = from_oat(0.08675773, 0.36073906, -0.23482681, radians(44.477), radians(37.4547), radians(22.4346))
    motion = Motion(1, MotionKind.STRAIGHT, Start.BLEND, pose=pose, acceleration=0.83)
    segments = plan_motion(Problem(engine.arm, Here(JointState((*joints, *wrist), velocity)), motion, 0.0))
    engine.book.timeline = Timeline(segments)
    check_limits(engine, segments)


STARTS_OF_TOO_MUCH_JERK = [  # joints, velocities, accelerations [deg ...], X, Y, Z, O, A, T, speed and acceleration
    (
        "puma560",
        (-42.44, -129.39, 13.21, 55.21, -0.7, 4.57),
        (-17.46, -20.85, -19.71, -88.7, -53.93, -87.41),
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (57.8, 594.7, -256.4, 63.4, 58.0, -36.8),
        (0.915, 0.953),
    ),
    (
        "puma560",
        (-5.7, -91.64, 83.33, -0.19, -3.27, -4.55),
        (-44.85, -12.89, -52.5, -1.46, -25.78, -35.8),
        (-23.73, -6.82, -27.78, -0.78, -13.64, -18.94),
        (138.7, 514.6, -4.6, 101.7, 87.7, 27.7),
        (0.548, 0.921),
    ),
    (
        "ur5e",
        (251.35, 165.68, -185.88, 151.17, -201.99, -128.69),
        (-34.64, 31.34, -85.07, 39.44, -37.65, 46.47),
        (),
        (-16.8, -297.4, 174.5, -45.6, 51.8, 103.7),
        (0.545, 0.738),
    ),
]


@pytest.mark.parametrize(("robot", "joints", "velocity", "acceleration", "place", "fractions"), STARTS_OF_TOO_MUCH_JERK)
def test_a_line_that_would_start_with_too_much_jerk_of_a_joint_brakes_first(
    robot: str,
    joints: tuple[float, ...],
    velocity: tuple[float, ...],
    acceleration: tuple[float, ...],
    place: tuple[float, ...],
    fractions: tuple[float, float],
) -> None:
    """Near a singularity the present rates of the joints give the jerk, however slowly the line goes on."""
    engine = Engine(load_robot(robot))
    state = JointState(*(tuple(map(radians, row)) for row in (joints, velocity, acceleration)))
    pose = from_oat(*(0.001 * part for part in place[:3]), *map(radians, place[3:]))
    speed, rate = fractions
    motion = Motion(
        1,
        MotionKind.STRAIGHT,
        Start.AT,
        pose=pose,
        speed=speed,
        rotation=speed,
        acceleration=rate,
        profile=Profile.SCURVE,
    )
    segments = plan_motion(Problem(engine.arm, Here(state), motion, 0.0))
    engine.book.timeline = Timeline(segments)
    check_continuous(engine, segments)
    check_limits(engine, segments)
    assert isinstance(segments[0].path, JointPath)


@pytest.mark.parametrize("profile", list(Profile.__members__))
def test_a_line_that_crosses_the_straight_wrist_next_to_where_it_starts_is_refused(profile: str) -> None:
    """Out of READY joint 5 moves a little to one side before it moves to the other, so joint 4 would have to turn
    about.
    """
    engine = Engine(MODEL)
    engine.perform(SetParameter("PROFILE", profile))
    with pytest.raises(MotionError, match="MOVE away from it first"):
        engine.perform(Move(JointOffsetTarget(5, -0.773838364504803), straight=True))


@pytest.mark.parametrize("profile", list(Profile.__members__))
def test_a_line_that_crosses_the_straight_wrist_next_to_where_it_ends_is_refused(profile: str) -> None:
    engine = Engine(MODEL)
    engine.perform(SetParameter("PROFILE", profile))
    ready = engine.position().T_world_tool
    engine.perform(Move(JointOffsetTarget(5, -0.773838364504803), straight=False))
    with pytest.raises(MotionError, match="wrist"):
        engine.perform(Move(PoseTarget(ready), straight=True))


def test_a_place_in_a_message_has_no_negative_zero() -> None:
    arm = Engine(MODEL).arm
    follower = Follower(arm, arm.configuration(MODEL.poses["ready"]), IDENTITY)
    assert follower.place_text(translation(-1e-9, 0.0, 0.1)) == "X 0.0 Y 0.0 Z 100.0 mm"


def turning_five_joints() -> tuple[Engine, Move]:
    """Return an arm of five joints, and a line on which it cannot turn the tool as asked."""
    model = load_robot(URDF / "five.urdf", task="pose")
    engine = Engine(model, start=tuple(map(radians, (10.0, -30.0, 60.0, 40.0, 20.0))))
    goal = tuple(map(radians, (60.0, -40.0, 80.0, -30.0, 50.0)))
    return engine, Move(JointTarget(goal), straight=True)


def test_where_five_joints_cannot_turn_the_tool_a_line_says_so() -> None:
    engine, line = turning_five_joints()
    with pytest.raises(LocationOutOfRange, match=r"near X .* for how the tool is turned there \(use MOVE"):
        engine.perform(line)


def test_the_search_for_the_place_where_a_line_fails_explains_only_that_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """On an arm without a closed form an explanation costs a search from many starts."""
    engine, line = turning_five_joints()
    asked, select = [], engine.arm.select
    monkeypatch.setattr(engine.arm, "select", lambda T, near: asked.append(T) or select(T, near))
    with pytest.raises(LocationOutOfRange):
        engine.perform(line)
    assert len(asked) <= 2, "where it is first seen, and where it begins"


# --- braking on a line -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("part", [0.01, 0.2, 0.5, 0.85, 0.99])
@pytest.mark.parametrize("pose", [from_oat(0.1, 0.5, 0.0, *ALONG), from_oat(0.0, 0.45, -0.15, 1.0, 1.2, 0.4)])
def test_a_brake_on_a_line_stays_on_it(profile: str, part: float, pose: Transform) -> None:
    """Both the way and the orientations until rest are those of the line."""
    engine = Engine(MODEL)
    engine.perform(SetParameter("PROFILE", profile))
    engine.perform(Move(PoseTarget(from_oat(0.0, 0.45, -0.15, *ALONG)), straight=False))
    engine.perform(Move(PoseTarget(pose), straight=True), program=True)
    begin = engine.position(engine.now).T_world_tool
    engine.clock.advance(engine.now + part * (engine.end - engine.now))
    whole, begun = engine.end, engine.now
    engine.stop()
    assert engine.end < min(whole + 0.1, begun + 0.7)
    for k in range(21):
        seen = engine.position(begun + (engine.end - begun) * k / 20).T_world_tool
        assert off_line(position(seen), position(begin), position(pose)) <= 1e-6
        turned = angle_between(begin, seen) + angle_between(seen, pose)
        assert turned == pytest.approx(angle_between(begin, pose), abs=5e-4)  # late, it may end a hair farther
    assert not engine.position(engine.end).moving
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


def test_a_joint_at_the_end_of_its_range_may_not_swing_out_first() -> None:
    """Joint 4 rests at 170 deg. The line would take it slightly beyond, and back before the first sample."""
    model = load_robot("puma560")
    arm = arm_for(model)
    q = (
        -2.245735942833484,
        -3.072367849793791,
        model.upper[2],
        model.upper[3],
        -0.19905939146012527,
        2.535553589266462,
    )
    pose = Transform(
        *(-0.7869716795481398, 0.22737210147348547, -0.5735656048445645, 0.21022582675259505),
        *(0.20718386781797932, -0.7782547435212686, -0.5927852892090244, -0.014269971478899994),
        *(-0.5811629896209516, -0.5853387751193113, 0.5653566112080606, 0.3812855351697436),
    )
    turned = rotation_z(-0.0016536399)
    frames = Frames(tool=turned._replace(px=-0.031789269261289235))
    motion = Motion(1, MotionKind.STRAIGHT, Start.AT, pose=pose, speed=0.4774, acceleration=0.8264, frames=frames)
    with pytest.raises(JointOutOfRange) as caught:
        plan_motion(Problem(arm, Here(JointState(q, (0.0,) * 6)), motion, 0.0))
    assert caught.value.joint == 4


@pytest.mark.parametrize(("profile", "steps"), [(Profile.LSPB, 8), (Profile.SCURVE, 4)])
def test_a_smooth_line_has_more_stretches_and_fewer_samples_of_each(
    profile: Profile, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm, law = arm_for(MODEL), LAWS[profile]
    start = (0.2, -0.9, 2.6, 0.3, 0.8, 0.1)
    x, y, z = position(arm.forward(start))
    goal = arm.forward(start)._replace(px=x + 0.05, py=y, pz=z + 0.02)
    motion = Motion(1, MotionKind.STRAIGHT, Start.AT, pose=goal, profile=profile)
    problem = Problem(arm, Here(JointState(start, (0.0,) * 6)), motion, 0.0)
    poses, solve = list[Transform](), arm.branch_joints

    def counted(T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        poses.append(T)
        return solve(T, configuration, near)

    straight_segments(problem)  # the search of this line for boundaries is remembered
    monkeypatch.setattr(arm, "branch_joints", counted)
    counts = []
    for samples in (law.samples, 2 * law.samples):
        monkeypatch.setitem(LAWS, profile, structs.replace(law, samples=samples))
        poses.clear()
        stretches = len(straight_segments(problem))
        counts.append(len(poses))
    assert counts[1] - counts[0] == steps * stretches


@pytest.mark.parametrize("aside", [0.0, 3e-10, -3e-10])
def test_a_line_to_a_boundary_ends_on_it_exactly(aside: float) -> None:
    """The wrist's centre moves along a tangent of the cylinder around joint 1 to the touching point."""
    engine = Engine(MODEL)
    nest = engine.arm.forward(MODEL.poses["nest"])
    _, y, z = position(nest)
    engine.perform(Move(PoseTarget(at_position(nest, 0.04, y, z)), straight=False))
    engine.perform(Move(PoseTarget(at_position(nest, 0.0, y + aside, z)), straight=True))
    end = engine.position(engine.end)
    assert end.T_world_tool.py == pytest.approx(y, abs=1e-13)
    assert engine.arm.clearance(end.T_world_tool, engine.arm.configuration(end.joints)).shoulder == 0.0


def test_a_line_of_a_redundant_arm_to_a_place_that_is_too_far_says_so() -> None:
    engine = Engine(load_robot("panda"))
    here = engine.position().T_world_tool
    with pytest.raises(LocationTooFar, match="all links in one line are 9"):
        engine.perform(Move(PoseTarget(here._replace(pz=1.7)), straight=True))
