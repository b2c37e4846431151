"""Tests of a single motion: one that was planned before is the same motion later."""

from __future__ import annotations

from math import inf

import pytest
from msgspec import structs

from vrs_cli.engine import single_motion
from vrs_cli.engine.problem import Here, NotInTime, NoWay, Problem, rest_after, state_at
from vrs_cli.engine.single_motion import plan_corner, plan_directly, plan_motion
from vrs_cli.engine.straight import straight_segments
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, at_position
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.commands import Motion, MotionKind, Start

BEGIN = (0.1, -0.7, 2.9, 0.0, 0.8, 0.0)


def line(number: int, begin: float, zero: float = 0.0) -> Problem:
    arm = arm_for(load_robot("puma560"))
    pose = arm.forward(BEGIN)
    goal = at_position(pose, pose.px + 0.05, pose.py, pose.pz)
    motion = Motion(number, MotionKind.STRAIGHT, Start.AFTER, pose=goal, text=f"line {number}", hand=0.5 * (number % 2))
    joints = (*BEGIN[:3], zero, *BEGIN[4:])
    return Problem(arm, Here(JointState(joints, (0.0,) * 6)), motion, begin)


def test_a_line_that_was_planned_before_is_the_same_later_with_its_own_motion() -> None:
    first, later = plan_motion(line(1, 2.0)), plan_motion(line(2, 64.25))
    assert [s.path is t.path for s, t in zip(first, later, strict=True)] == [True] * len(first)
    assert later == straight_segments(line(2, 64.25))
    assert {s.motion.text for s in later} == {"line 2"}


def test_zeros_with_another_sign_are_another_state() -> None:
    single_motion._remembered_plan.cache_clear()
    for zero in (0.0, -0.0, 0.0):
        plan_motion(line(1, 0.0, zero))
    assert single_motion._remembered_plan.cache_info()[:2] == (1, 2)  # hits, misses


def test_a_line_that_was_refused_before_is_refused_again_at_once() -> None:
    single_motion._remembered_plan.cache_clear()
    far, late = (
        at_position(line(1, 0.0).motion.pose or IDENTITY, 5000.0, 0.0, 0.0),
        structs.replace(line(1, 0.0), latest=0.01),
    )
    beyond = structs.replace(late, motion=structs.replace(late.motion, pose=far), latest=inf)
    refusals = []
    for begin in (0.0, 8.0):
        with pytest.raises(NotInTime):
            plan_motion(structs.replace(late, begin=begin, latest=begin + 0.25))
        with pytest.raises(MotionError) as refused:
            plan_motion(structs.replace(beyond, begin=begin))
        refusals.append(refused.value)
    assert single_motion._remembered_plan.cache_info()[:2] == (2, 2)  # hits, misses
    first, second = refusals
    assert str(first) == str(second)
    assert first is not second  # each has a traceback of its own
    assert first.place == second.place


def test_a_line_is_of_no_use_when_it_is_too_late_wherever_it_was_planned_before() -> None:
    plan_motion(line(1, 8.0))
    with pytest.raises(NotInTime):
        plan_motion(structs.replace(line(1, 8.0), latest=8.01))


def test_a_line_out_of_motion_is_of_no_use_when_it_is_too_late() -> None:
    resting = line(1, 0.0)
    first = plan_motion(resting)[0]
    place = state_at(resting.arm, first, 0.5 * first.duration)
    moving = structs.replace(resting, here=place, begin=0.5 * first.duration)
    end = plan_directly(moving)[-1].finish
    assert plan_directly(structs.replace(moving, latest=end))[-1].finish == end
    with pytest.raises(NotInTime):
        plan_directly(structs.replace(moving, latest=0.5 * (moving.begin + end)))


@pytest.mark.parametrize(("way", "rest_is_planned"), [(0.05, False), (-0.004, True)])
def test_a_corner_plans_its_line_from_rest_only_if_rounding_may_be_slower(way: float, rest_is_planned: bool) -> None:
    """The line before it ends at the corner; a short line back gains nothing by rounding."""
    before = line(1, 0.0)
    segments = plan_motion(before)
    corner, last = rest_after(before.arm, segments[-1]), segments[-1]
    there = before.motion.pose or IDENTITY
    goal = at_position(there, there.px + way, there.py, there.pz)
    motion = structs.replace(before.motion, number=2, start=Start.BLEND, pose=goal)
    resting = structs.replace(before, here=corner, motion=motion, begin=last.finish)
    moving = structs.replace(resting, here=state_at(before.arm, last, 0.0), begin=last.start)
    single_motion._remembered_plan.cache_clear()
    planned = plan_corner(moving, resting)
    assert (single_motion._remembered_plan.cache_info().misses > 1) is rest_is_planned
    try:
        rounded = plan_directly(moving)
    except NoWay:
        assert planned == plan_motion(resting)
    else:
        from_rest = plan_motion(resting)
        assert planned == (rounded if rounded[-1].finish <= from_rest[-1].finish + 1e-3 else from_rest)


@pytest.mark.parametrize("profile", Profile)
def test_a_joint_motion_out_of_motion_is_the_same_later_as_if_it_were_planned_anew(profile: Profile) -> None:
    resting = line(1, 0.0)
    goal = tuple(q + 0.3 for q in BEGIN)
    motion = Motion(1, MotionKind.JOINT, Start.AFTER, goal=goal, profile=profile)
    first = plan_motion(structs.replace(resting, motion=motion))[0]
    here = state_at(resting.arm, first, 0.6 * first.duration)
    moving = structs.replace(resting, here=here, motion=structs.replace(motion, goal=BEGIN))
    planned = plan_motion(moving)
    later = plan_motion(structs.replace(moving, begin=32.5, motion=structs.replace(moving.motion, number=7)))
    assert [segment.path is other.path for segment, other in zip(planned, later, strict=True)] == [True] * len(later)
    assert {segment.motion.number for segment in later} == {7}
    single_motion._remembered_plan.cache_clear()
    assert plan_motion(structs.replace(moving, begin=32.5, motion=later[0].motion)) == later


def test_a_state_is_remembered_by_tool_and_profile() -> None:
    """A path may serve motions with another tool or profile."""
    arm, segment = line(1, 0.0).arm, plan_motion(line(1, 0.0))[0]
    middle = 0.5 * segment.duration
    plain = state_at(arm, segment, middle)
    smooth = structs.replace(segment, motion=structs.replace(segment.motion, profile=Profile.SCURVE))
    assert state_at(arm, segment, middle) is plain
    assert any(state_at(arm, smooth, middle).joints.acceleration)
    assert not plain.joints.acceleration
