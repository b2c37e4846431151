"""Tests of f: how commands edit the timeline, case by case."""

from __future__ import annotations

import contextlib
from math import radians

import pytest
from msgspec import structs

from tests.laws.motion_laws import check_continuous, check_limits
from vrs_cli.engine import planner
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.planner import plan
from vrs_cli.engine.position import joints_at, position_at
from vrs_cli.engine.problem import NoRoomToStop, Problem
from vrs_cli.errors import JointOutOfRange, LocationOutOfRange, MotionError, StraightLineSingular
from vrs_cli.kinematics.joints import Profile, largest_change
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import compose, distance, from_oat, translation
from vrs_cli.trajectory.instant import on_grid
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.segment import Phase, Segment
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import (
    Break,
    Delay,
    JointTarget,
    Motion,
    MotionKind,
    Move,
    NamedTarget,
    PoseTarget,
    SetParameter,
    SetTool,
    Stamp,
    Start,
)

MODEL = load_robot("puma560")


def joints(*degrees: float) -> JointTarget:
    return JointTarget(tuple(map(radians, degrees)))


A = joints(20, -60, 150, 10, 30, -40)
B = joints(-20, -40, 170, 0, 60, 0)
C = joints(0, -90, 120, 0, 40, 0)
TABLE = joints(0, -45, 180, 0, 45, 0)


@pytest.fixture
def engine() -> Engine:
    return Engine(MODEL)


def go(
    engine: Engine, target: object, *, straight: bool = False, at: float | None = None, program: bool = False
) -> None:
    stamp = None if at is None else Stamp(at)
    engine.perform(Move(target, straight, stamp=stamp, text="MOVE"), program=program)  # type: ignore[arg-type]


def phases(engine: Engine) -> list[tuple[int, str]]:
    return [(s.motion.number, s.phase.value) for s in engine.timeline if s.duration]


def test_a_motion_from_rest_is_accelerate_cruise_decelerate(engine: Engine) -> None:
    go(engine, A)
    assert phases(engine) == [(1, "accelerate"), (1, "cruise"), (1, "decelerate")]
    assert engine.now == engine.end
    assert largest_change(engine.position().joints, A.joints) < 1e-12


def test_interrupting_the_cruise_gives_the_five_segments_of_the_paper(engine: Engine) -> None:
    go(engine, A)
    first, cruise = engine.timeline[1], engine.timeline[2]
    go(engine, C, at=0.4)
    assert phases(engine) == [(1, "accelerate"), (1, "cruise"), (2, "blend"), (2, "cruise"), (2, "decelerate")]
    assert engine.timeline[1] == first
    assert engine.timeline[2].start == cruise.start
    assert engine.timeline[2].finish == engine.timeline[3].start == pytest.approx(0.4)
    assert engine.timeline[2].path is cruise.path


@pytest.mark.parametrize("at", [0.1, 0.3, 0.4, 0.6, 0.84])
def test_a_splice_into_a_splice_works_from_every_phase(engine: Engine, at: float) -> None:
    go(engine, A)
    go(engine, C, at=at)
    go(engine, B, at=at + 0.05)
    assert largest_change(joints_at(engine.arm, engine.timeline, engine.end), B.joints) < 1e-9


@pytest.mark.parametrize(("first", "second"), [(False, True), (True, False), (True, True), (False, False)])
def test_both_kinds_of_motion_interrupt_each_other(engine: Engine, first: bool, second: bool) -> None:
    go(engine, TABLE)
    start = engine.end
    pose = engine.position().T_world_tool
    aside = PoseTarget(pose._replace(py=pose.py + 0.2))
    below = PoseTarget(pose._replace(pz=pose.pz - 0.1, py=pose.py + 0.1))
    go(engine, aside, straight=first, at=start)
    go(engine, below, straight=second, at=start + 0.35)
    end = position_at(engine.arm, engine.timeline, engine.end)
    assert distance(end.T_world_tool, below.T_world_tool) < 1e-9
    assert any(phase == "blend" for _, phase in phases(engine))


@pytest.mark.parametrize("profile", list(Profile))
def test_a_motion_that_interrupts_another_does_so_also_when_that_begins_elsewhere(profile: Profile) -> None:
    """The order of commands does not matter if they do not touch each other."""
    ends = []
    for order in (((A, 3.0), (B, 3.4), (C, 0.0)), ((C, 0.0), (A, 3.0), (B, 3.4))):
        engine = Engine(MODEL)
        engine.perform(SetParameter("PROFILE", profile.name))
        for target, at in order:
            go(engine, target, at=at)
        check_continuous(engine, engine.timeline)
        check_limits(engine, engine.timeline)
        ends.append([(s.start, s.finish, s.path) for s in engine.timeline])
    assert ends[0] == ends[1]


def test_an_interruption_that_has_come_too_early_waits(engine: Engine) -> None:
    go(engine, A, at=3.0)
    go(engine, B, at=3.4)
    go(engine, joints(150, 20, 0, 0, 30, 0), at=2.0)
    begins = {s.motion.number: s.start for s in reversed(list(engine.timeline))}
    assert begins[3] < 3.4 < begins[1] < begins[2]
    check_continuous(engine, engine.timeline)


def test_motions_scheduled_later_stay_and_the_next_is_planned_again(engine: Engine) -> None:
    for target in (A, B, C):
        go(engine, target)
    before = engine.timeline
    go(engine, joints(0, -90, 90, 0, 40, 0), at=0.4)
    delta = engine.book.deltas[-1]
    kept = list(before)[delta.keep + delta.drop :]
    assert [s.motion.number for s in kept] == [3, 3, 3]
    assert all(a.path is b.path for a, b in zip(kept, list(engine.timeline)[-3:], strict=True))
    assert {s.motion.number for s in delta.segments} == {4, 2}


def test_a_motion_at_its_own_time_keeps_it(engine: Engine) -> None:
    go(engine, A, at=0.0)
    go(engine, B, at=10.0)
    go(engine, C, at=4.0)
    assert [r.executed for r in engine.book.records()] == [0.0, 10.0, 4.0]
    starts = {s.motion.number: s.start for s in reversed(list(engine.timeline))}
    assert starts[2] == 10.0


def test_a_motion_is_pushed_when_the_inserted_one_lasts_longer(engine: Engine) -> None:
    go(engine, A, at=0.0)
    go(engine, B, at=1.0)
    go(engine, C, at=0.9)
    starts = {s.motion.number: s.start for s in reversed(list(engine.timeline))}
    ends = {s.motion.number: s.finish for s in engine.timeline}
    assert starts[2] == ends[3] > 1.0


def test_override_drops_what_was_scheduled(engine: Engine) -> None:
    for target in (A, B, C):
        go(engine, target)
    engine.perform(SetParameter("INSERT", "OFF"))
    go(engine, joints(0, -90, 90, 0, 40, 0), at=0.4)
    assert {s.motion.number for s in engine.timeline} == {0, 1, 4}


def test_at_the_beginning_of_a_motion_the_later_command_takes_its_place(engine: Engine) -> None:
    go(engine, A)
    boundary = engine.end
    go(engine, B)
    go(engine, A)
    go(engine, C, at=boundary)
    order = list(dict.fromkeys(s.motion.number for s in engine.timeline))
    assert order == [0, 1, 4, 3]
    assert [record.end is None for record in engine.book.records()] == [False, True, False, False]


def test_two_commands_for_one_time(engine: Engine) -> None:
    go(engine, A, at=1.0)
    go(engine, B, at=1.0)
    assert largest_change(joints_at(engine.arm, engine.timeline, engine.end), B.joints) < 1e-9


def test_a_command_that_has_nothing_to_do_keeps_its_place(engine: Engine) -> None:
    go(engine, NamedTarget("ready"), at=3.0)
    go(engine, A, at=1.0)
    assert largest_change(joints_at(engine.arm, engine.timeline, engine.end), MODEL.poses["ready"]) < 1e-9


def test_a_corner_of_straight_lines_is_rounded_on_its_inside(engine: Engine) -> None:
    go(engine, PoseTarget(from_oat(-0.15, 0.45, -0.2, radians(90), radians(90), 0.0)))
    corner = PoseTarget(from_oat(0.15, 0.45, -0.2, radians(90), radians(90), 0.0))
    finish = PoseTarget(from_oat(0.15, 0.65, -0.2, radians(90), radians(90), 0.0))
    begin = engine.end
    go(engine, corner, straight=True, program=True)
    go(engine, finish, straight=True, program=True)
    for k in range(500):
        tip = position_at(engine.arm, engine.timeline, begin + (engine.end - begin) * k / 499).T_world_tool
        assert tip.px <= 0.15 + 1e-3
        assert tip.py >= 0.45 - 1e-3


def test_continuous_path_begins_at_the_deceleration(engine: Engine) -> None:
    go(engine, A, program=True)
    slowing = engine.timeline[3]
    assert slowing.phase is Phase.DECELERATE
    go(engine, B, program=True)
    assert engine.now == slowing.start
    assert (2, "blend") in phases(engine)
    assert (1, "decelerate") not in phases(engine)


def test_insertion_plans_a_blended_chain_again_up_to_rest(engine: Engine) -> None:
    for target in (A, B, C):
        go(engine, target, program=True)
    engine.perform(Break())
    go(engine, A)
    last = list(engine.timeline)[-3:]
    go(engine, joints(0, -90, 90, 0, 40, 0), at=0.2)
    numbers = [s.motion.number for s in engine.timeline]
    assert list(dict.fromkeys(numbers)) == [0, 1, 5, 2, 3, 4]
    assert all(a.path is b.path for a, b in zip(last, list(engine.timeline)[-3:], strict=True))


def test_a_delay_holds_where_the_robot_then_is(engine: Engine) -> None:
    go(engine, A)
    engine.perform(Delay(1.5))
    go(engine, B)
    go(engine, C, at=0.2)  # the delay now stands at C
    (standing,) = [s for s in engine.timeline if s.phase is Phase.REST and s.duration]
    assert standing.duration == 1.5
    assert largest_change(joints_at(engine.arm, engine.timeline, standing.start), C.joints) < 1e-9


def test_a_blend_that_would_leave_the_joint_range_brakes_first(engine: Engine) -> None:
    go(engine, joints(100, -90, 90, 0, 0, 0))
    begin = engine.end
    go(engine, joints(159.9, -90, 90, 0, 0, 0))
    late = engine.end - 0.31
    go(engine, joints(159.9, 0, 90, 0, 0, 0), at=late)
    for k in range(400):
        t = begin + (engine.end - begin) * k / 399
        q = joints_at(engine.arm, engine.timeline, t)
        assert q[0] <= MODEL.upper[0] + 1e-9


def test_out_of_reach_names_the_distance_and_changes_nothing(engine: Engine) -> None:
    before = engine.timeline
    with pytest.raises(LocationOutOfRange, match="mm"):
        go(engine, PoseTarget(translation(3.0, 0.0, 0.0)))
    assert engine.timeline is before
    assert engine.now == 0.0


def test_joint_targets_keep_their_limits(engine: Engine) -> None:
    with pytest.raises(JointOutOfRange, match="Joint 1 out of range"):
        go(engine, joints(170, 0, 0, 0, 0, 0))


def test_a_line_from_the_stretched_arm_is_refused_before_it_moves(engine: Engine) -> None:
    go(engine, NamedTarget("ready"))
    pose = engine.position().T_world_tool
    with pytest.raises((StraightLineSingular, LocationOutOfRange)):
        go(engine, PoseTarget(pose._replace(px=pose.px + 0.3, py=pose.py - 0.1, pz=pose.pz - 0.3)), straight=True)
    assert engine.end == 0.0


def test_a_scheduled_motion_that_becomes_impossible_refuses_the_new_one(engine: Engine) -> None:
    go(engine, TABLE)
    pose = engine.position().T_world_tool
    go(engine, PoseTarget(pose._replace(py=pose.py + 0.2)), straight=True)
    before = engine.timeline
    with pytest.raises(MotionError, match="planned again"):
        go(engine, NamedTarget("ready"), at=1.0)  # no straight line leads from the stretched arm
    assert engine.timeline is before


def test_tool_moves_the_tip_not_the_arm(engine: Engine) -> None:
    go(engine, TABLE)
    flange = engine.position().T_world_tool
    engine.perform(SetTool(translation(0.0, 0.0, 0.1)))
    tip = engine.position().T_world_tool
    assert distance(tip, compose(flange, translation(0.0, 0.0, 0.1))) < 1e-12
    go(engine, PoseTarget(from_oat(0.5, 0.15, -0.2, radians(90), radians(90), 0.0)))
    assert distance(engine.position().T_world_tool, translation(0.5, 0.15, -0.2)) < 1e-9


# --- no room to stop -------------------------------------------------------------------------------------------------


def to_the_limit(profile: str) -> Engine:
    """Move joint 4 to the very end of its range, with the given profile."""
    engine = Engine(load_robot("puma560"))
    engine.perform(SetParameter("PROFILE", profile))
    ready = engine.model.poses["ready"]
    engine.perform(Move(JointTarget((*ready[:3], engine.model.upper[3], *ready[4:])), False, stamp=Stamp(0.0)))
    return engine


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("straight", [False, True])
def test_a_jerk_limited_motion_out_of_one_that_brakes_at_the_end_of_a_range_stays_inside(
    part: float, straight: bool
) -> None:
    engine = to_the_limit("LSPB")
    engine.perform(SetParameter("PROFILE", "SCURVE"))
    last = engine.timeline[len(engine.timeline) - 1]
    assert last.phase is Phase.DECELERATE
    at = last.start + part * last.duration
    target = PoseTarget(from_oat(0.3, 0.4, -0.1, radians(80.0), radians(70.0), 0.0))
    with contextlib.suppress(MotionError):  # a line may be impossible
        engine.perform(Move(target, straight, stamp=Stamp(at)))
    check_limits(engine, engine.timeline)
    check_continuous(engine, engine.timeline)


def test_where_there_is_no_room_to_stop_the_motion_under_way_is_finished_first(monkeypatch: pytest.MonkeyPatch) -> None:
    engine = to_the_limit("SCURVE")
    end = engine.end
    law = LAWS[Profile.SCURVE]
    monkeypatch.setitem(LAWS, Profile.SCURVE, structs.replace(law, joint_stops=lambda *_: iter(())))
    line = PoseTarget(engine.position().T_world_tool)  # READY is singular: no line leads there out of motion
    before = [engine.position(end * k / 50).joints for k in range(51)]
    delta = plan(engine.arm, engine.timeline, straight_to(line), 0.0, on_grid(0.5 * end))
    assert delta.executed == on_grid(0.5 * end)
    assert delta.cut == end
    after = engine.timeline.apply(delta)
    assert [joints_at(engine.arm, after, end * k / 50) for k in range(50)] == before[:50]


def straight_to(target: PoseTarget) -> Motion:
    return Motion(2, MotionKind.STRAIGHT, Start.AT, pose=target.T_world_tool, profile=Profile.SCURVE)


def test_a_motion_that_first_braked_at_constant_acceleration_keeps_its_profile_when_it_is_planned_again(
    engine: Engine,
) -> None:
    """The motion starts out of one that slows down to the end of a range, where a jerk-limited stop has no room."""
    go(engine, joints(160, -90, 90, 0, 0, 0), at=5.0)
    end = engine.end
    engine.perform(SetParameter("PROFILE", "SCURVE"))
    go(engine, joints(-57, -90, 90, 0, 0, 0), at=end - 0.1)
    assert {s.motion.profile for s in engine.timeline if s.motion.number == 2} == {Profile.LSPB, Profile.SCURVE}
    go(engine, joints(28, -90, 90, 0, 0, 0), at=1.0)
    go(engine, joints(57, -90, 90, 0, 0, 0), at=5.5)
    assert {s.motion.profile for s in engine.timeline if s.motion.number == 2} == {Profile.SCURVE}


# --- the order of things, where it shows only at an edge ---


def begins(engine: Engine) -> dict[int, float]:
    return {s.motion.number: s.start for s in reversed(list(engine.timeline))}


def ends(engine: Engine) -> dict[int, float]:
    return {s.motion.number: s.finish for s in engine.timeline}


def test_behind_a_pushed_motion_every_pause_stays(engine: Engine) -> None:
    go(engine, A)
    for target in (B, C):
        engine.clock.advance(engine.end + 3.0)
        go(engine, target)
    assert begins(engine)[3] - ends(engine)[2] == 3.0
    go(engine, joints(60, 0, 60, 0, 60, 0), at=ends(engine)[1] + 2.9)
    assert begins(engine)[2] == ends(engine)[4]
    assert begins(engine)[3] - ends(engine)[2] == 3.0


@pytest.mark.parametrize("profile", list(Profile))
def test_a_motion_that_began_at_speed_is_planned_again_where_the_arm_now_stands_there(profile: Profile) -> None:
    engine = Engine(MODEL)
    engine.perform(SetParameter("PROFILE", profile.name))
    go(engine, A, at=3.0)
    go(engine, B, at=3.4)
    place = joints_at(engine.arm, engine.timeline, 3.4)
    go(engine, JointTarget(place), at=3.0)
    assert begins(engine)[2] == ends(engine)[3]
    check_continuous(engine, engine.timeline)


def test_an_interruption_without_room_to_stop_waits_when_it_is_planned_again(
    engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    go(engine, A, at=3.0)
    go(engine, B, at=3.4)
    planned = planner.plan_motion

    def plan_motion(problem: Problem) -> tuple[Segment, ...]:
        if problem.motion.number == 2 and not problem.here.joints.at_rest:
            raise NoRoomToStop
        return planned(problem)

    monkeypatch.setattr(planner, "plan_motion", plan_motion)
    go(engine, C, at=0.0)
    assert begins(engine)[2] == ends(engine)[1]
    assert largest_change(joints_at(engine.arm, engine.timeline, ends(engine)[1]), A.joints) <= 1e-9
    check_continuous(engine, engine.timeline)


@pytest.mark.parametrize("profile", [Profile.LSPB, Profile.SCURVE])  # QUINTIC stops here, which is quicker
def test_no_segment_of_a_rounded_corner_is_empty_when_it_is_planned_again(profile: Profile) -> None:
    engine = Engine(MODEL)
    engine.perform(SetParameter("PROFILE", profile.name))
    for target in (A, B, joints(-60, -20, 190, -10, 90, 40)):
        go(engine, target, program=True)
    go(engine, joints(0, -90, 90, 0, 40, 0), at=0.2)
    assert any(phase == "blend" for number, phase in phases(engine) if number == 3)
    assert all(segment.duration for segment in engine.timeline if segment.phase is not Phase.REST)
    check_continuous(engine, engine.timeline)


def test_what_takes_no_time_has_happened_before_a_motion_at_that_time(engine: Engine) -> None:
    go(engine, A)
    engine.perform(SetTool(translation(0.0, 0.0, 0.1)))
    go(engine, B, at=engine.end)
    tool = engine.book.records()[1]
    assert (tool.executed, tool.end) == (engine.book.records()[0].end, engine.book.records()[0].end)
    assert engine.timeline[len(engine.timeline) - 1].motion.frames.tool.pz == 0.1


def test_rounding_begins_as_soon_as_the_tip_is_that_near(engine: Engine) -> None:
    go(engine, TABLE)
    engine.perform(SetParameter("ROUNDING", 20.0))
    here = engine.position().T_world_tool
    corner = here._replace(pz=here.pz - 0.2)
    go(engine, PoseTarget(corner), straight=True, program=True)
    go(engine, PoseTarget(corner._replace(px=corner.px + 0.2)), straight=True, program=True)
    begin = begins(engine)[3]
    assert 0.0199 < distance(engine.position(begin).T_world_tool, corner) <= 0.02
    assert distance(engine.position(begin - 1e-3).T_world_tool, corner) > 0.02


def test_an_insertion_reads_what_it_plans_again_once(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    """It reads three more segments, to see where the next motion begins."""
    for goal in (A, B, C, TABLE) * 10:
        go(engine, goal, program=True)
    timeline, read, reads = engine.timeline, Timeline.__getitem__, list[int]()
    motion = structs.replace(timeline[-1].motion, number=99, start=Start.AT)

    def counted(self: Timeline, index: int) -> Segment:
        reads.append(index)
        return read(self, index)

    monkeypatch.setattr(Timeline, "__getitem__", counted)
    delta = plan(engine.arm, timeline, motion, 0.0, on_grid(0.5 * timeline.end))
    assert delta.drop > 3
    assert len(reads) <= delta.drop + 4
