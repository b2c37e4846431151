"""Tests of the engine: time stamps, speeds, continuous path, configuration, undo, settings."""

from __future__ import annotations

from math import radians

import pytest
from msgspec import structs

from vrs_cli.engine.book import Book
from vrs_cli.engine.engine import Bookmark, Engine
from vrs_cli.engine.history import WIDE_DROP
from vrs_cli.errors import (
    IllegalJoint,
    IllegalValue,
    JointOutOfRange,
    LocationTooFar,
    MotionError,
    PowerOff,
    StraightLineConfiguration,
    UsageError,
    VrsError,
)
from vrs_cli.kinematics.joints import Arm, Wrist
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, distance, from_oat, translation
from vrs_cli.trajectory.timeline import Cause
from vrs_cli.values.commands import (
    Break,
    Delay,
    JointOffsetTarget,
    JointTarget,
    Mode,
    Move,
    NamedTarget,
    OperateHand,
    PoseTarget,
    Request,
    SetAcceleration,
    SetBase,
    SetConfiguration,
    SetDuration,
    SetMode,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    SetSwitch,
    SetTool,
    SpeedUnit,
    Stamp,
    Start,
    ToolOffsetTarget,
)

MODEL = load_robot("puma560")


def joints(*degrees: float) -> JointTarget:
    return JointTarget(tuple(map(radians, degrees)))


A, B = joints(20, -60, 150, 10, 30, -40), joints(-20, -40, 170, 0, 60, 0)
TABLE = joints(0, -45, 180, 0, 45, 0)


@pytest.fixture
def engine() -> Engine:
    return Engine(MODEL)


def seconds_of(engine: Engine, target: object, straight: bool = False) -> float:
    begin = engine.end
    engine.perform(Move(target, straight))  # type: ignore[arg-type]
    return engine.end - begin


# --- time ---


def test_at_the_prompt_the_clock_goes_to_the_end_of_the_motion(engine: Engine) -> None:
    engine.perform(Move(A, straight=False))
    assert engine.now == engine.end > 0.0


def test_a_time_stamp_leaves_the_clock_alone(engine: Engine) -> None:
    engine.perform(Move(A, straight=False, stamp=Stamp(2.5)))
    assert engine.now == 0.0
    assert engine.timeline[1].start == 2.5


def test_in_counts_from_now(engine: Engine) -> None:
    engine.perform(Move(A, straight=False))
    now = engine.now
    engine.perform(Move(B, straight=False, stamp=Stamp(1.0, relative=True)))
    assert engine.book.records()[-1].executed == pytest.approx(now + 1.0, abs=1e-8)


@pytest.mark.parametrize("when", [-1.0, float("nan"), float("inf"), 1e9])
def test_times_that_are_none_are_refused(engine: Engine, when: float) -> None:
    with pytest.raises(IllegalValue, match="AT"):
        engine.perform(Move(A, straight=False, stamp=Stamp(when)))


def test_a_program_goes_on_while_the_arm_moves(engine: Engine) -> None:
    engine.perform(Move(A, straight=False), program=True)
    assert engine.now == 0.0 < engine.end
    engine.perform(Break())
    assert engine.now == engine.end


def test_records_tell_issue_execution_and_end(engine: Engine) -> None:
    engine.perform(Move(A, straight=False, text="MOVE a"))
    engine.perform(Move(B, straight=False, stamp=Stamp(0.25), text="MOVE b AT 0.25"))
    first, second = engine.book.records()
    assert (first.text, first.issued, first.executed) == ("MOVE a", 0.0, 0.0)
    assert first.end == second.executed == 0.25
    assert second.end == pytest.approx(engine.end, abs=1e-9)


# --- speed ---


def test_speed_is_monitor_times_program(engine: Engine) -> None:
    engine.perform(SetMonitorSpeed(50.0))
    engine.perform(SetSpeed(40.0, always=True))
    engine.perform(Move(A, straight=False))
    assert engine.timeline[1].motion.speed == pytest.approx(0.2)


def test_speed_without_always_is_for_one_motion(engine: Engine) -> None:
    engine.perform(SetSpeed(10.0))
    slow, fast = seconds_of(engine, A), seconds_of(engine, NamedTarget("ready"))
    assert slow > 2 * fast
    assert engine.settings.speed.present.value == 100.0


def test_tip_speed_in_millimetres_and_inches(engine: Engine) -> None:
    engine.perform(Move(TABLE, straight=False))
    pose = engine.position().T_world_tool
    engine.perform(SetSpeed(100.0, unit=SpeedUnit.MMPS, always=True))
    aside = pose._replace(py=pose.py + 0.2)
    assert seconds_of(engine, PoseTarget(aside), straight=True) == pytest.approx(0.2 / 0.1, rel=0.1)
    engine.perform(SetSpeed(2.0, unit=SpeedUnit.IPS, always=True))
    assert seconds_of(engine, PoseTarget(pose), straight=True) == pytest.approx(0.2 / 0.0508, rel=0.1)


def test_the_monitor_speed_counts_for_the_turn_of_a_tool_too(engine: Engine) -> None:
    engine.perform(Move(TABLE, straight=False))
    engine.perform(SetMonitorSpeed(50.0))
    for unit in (SpeedUnit.MMPS, SpeedUnit.PERCENT):
        engine.perform(SetSpeed(40.0, rotation=60.0, unit=unit))
        engine.perform(Move(PoseTarget(engine.position().T_world_tool), straight=True))
        assert engine.book.deltas[-1].motion.rotation == pytest.approx(0.3)


def test_duration_is_the_least_time(engine: Engine) -> None:
    engine.perform(SetDuration(5.0))
    assert seconds_of(engine, A) == pytest.approx(5.0, abs=1e-3)
    assert seconds_of(engine, B) < 4.0


def test_drive_has_its_own_speed(engine: Engine) -> None:
    engine.perform(Move(JointOffsetTarget(1, radians(40)), straight=False, speed=0.1))
    assert engine.timeline[1].motion.speed == pytest.approx(0.1)
    assert engine.position().joints[0] == pytest.approx(radians(40))


@pytest.mark.parametrize(
    "request_", [SetSpeed(0.0), SetSpeed(-5.0), SetMonitorSpeed(0.0), SetMonitorSpeed(400.0), SetDuration(-1.0),
                 SetAcceleration(0.0), Delay(-1.0), Delay(float("nan"))]
)  # fmt: skip
def test_settings_that_make_no_sense_are_refused(engine: Engine, request_: object) -> None:
    with pytest.raises(IllegalValue):
        engine.perform(request_)  # type: ignore[arg-type]


# --- continuous path ---


def blends(engine: Engine) -> list[bool]:
    engine.perform(Move(A, straight=False), program=True)
    engine.perform(Move(B, straight=False), program=True)
    return [s.motion.start is Start.BLEND for s in engine.timeline if s.motion.number == 2]


def test_motions_of_a_program_blend(engine: Engine) -> None:
    assert all(blends(engine))


def test_break_and_the_cp_switch_end_continuous_path(engine: Engine) -> None:
    engine.perform(SetSwitch("CP", on=False))
    assert not any(blends(engine))


def test_cpoff_holds_for_one_motion(engine: Engine) -> None:
    engine.perform(Move(A, straight=False), program=True)
    engine.perform(SetMode(Mode.CONTINUOUS_PATH, on=False))
    for target in (B, A):
        engine.perform(Move(target, straight=False), program=True)
    starts = {s.motion.number: s.motion.start for s in engine.timeline}
    assert starts[2] is Start.AFTER
    assert starts[3] is Start.BLEND


def test_a_late_program_blends_no_more(engine: Engine) -> None:
    engine.perform(Move(A, straight=False), program=True)
    engine.clock.advance(engine.end + 1.0)
    engine.perform(Move(B, straight=False), program=True)
    assert engine.timeline[4].start == engine.now


def test_a_motion_that_changes_the_configuration_does_not_blend(engine: Engine) -> None:
    here = engine.world_pose(A.joints)
    starts = []
    for word in (None, Arm.RIGHTY):
        engine.take_up(Bookmark(Book.at(MODEL.poses["ready"]), engine.settings, 0.0))
        engine.perform(Move(B, straight=False), program=True)
        if word is not None:
            engine.perform(SetConfiguration(word))
        engine.perform(Move(PoseTarget(here), straight=False), program=True)
        starts.append(engine.timeline[len(engine.timeline) - 1].motion.start)
    assert starts == [Start.BLEND, Start.AFTER]


# --- configuration ---


PLACE = PoseTarget(from_oat(0.0, 0.5, -0.2, radians(90), radians(90), 0.0))


def test_configuration_words_choose_the_arm(engine: Engine) -> None:
    for arm in (Arm.LEFTY, Arm.RIGHTY):
        engine.perform(SetConfiguration(arm))
        engine.perform(Move(PLACE, straight=False))
        assert engine.arm.configuration(engine.position().joints).arm is arm
        assert distance(engine.position().T_world_tool, PLACE.T_world_tool) < 1e-9


def test_a_straight_line_cannot_change_the_configuration(engine: Engine) -> None:
    engine.perform(Move(PLACE, straight=False))
    engine.perform(SetConfiguration(Arm.LEFTY))
    with pytest.raises(StraightLineConfiguration, match="LEFTY"):
        engine.perform(Move(PLACE, straight=True))


def test_a_precision_point_ends_what_was_asked(engine: Engine) -> None:
    engine.perform(SetConfiguration(Arm.LEFTY))
    engine.perform(SetConfiguration(Wrist.FLIP))
    engine.perform(Move(NamedTarget("ready"), straight=False))
    engine.perform(Move(PLACE, straight=False))
    assert engine.arm.configuration(engine.position().joints).arm is Arm.RIGHTY


def test_nooverlap_refuses_more_than_half_a_turn(engine: Engine) -> None:
    engine.perform(Move(joints(0, -90, 90, 0, 0, 200), straight=False))
    engine.perform(SetMode(Mode.OVERLAP, on=False))
    with pytest.raises(JointOutOfRange, match="NOOVERLAP"):
        engine.perform(Move(joints(0, -90, 90, 0, 0, -100), straight=False))


def test_nooverlap_is_for_joints_that_turn() -> None:
    cobra = load_robot("cobra600")
    engine = Engine(structs.replace(cobra, lower=(-4.0, -4.0, 0.0, -4.0), upper=(4.0, 4.0, 8.0, 4.0)))
    engine.perform(Move(JointTarget((0.0, 1.0, 0.0, 0.0)), straight=False))
    engine.perform(SetMode(Mode.OVERLAP, on=False, always=True))
    engine.perform(Move(JointTarget((0.0, 1.0, 7.0, 0.0)), straight=False))
    assert engine.position().joints[2] == pytest.approx(7.0), "joint 3 slides: 7 m are no turns"
    with pytest.raises(JointOutOfRange, match="NOOVERLAP"):
        engine.perform(Move(JointTarget((0.0, 1.0, 7.0, 3.5)), straight=False))


def test_single_keeps_the_wrist_within_one_turn(engine: Engine) -> None:
    turned = PoseTarget(from_oat(0.0, 0.5, -0.2, radians(90), radians(90), radians(270)))
    reached = []
    for single in (False, True):
        engine.perform(Move(joints(0, -90, 90, 0, 0, 240), straight=False))
        engine.perform(SetMode(Mode.SINGLE, on=single))
        engine.perform(Move(turned, straight=False))
        reached.append(engine.position().joints[5])
    assert abs(reached[0]) > radians(180)
    assert abs(reached[1]) <= radians(180)


# --- targets ---


def test_depart_backs_off_from_the_destination(engine: Engine) -> None:
    engine.perform(Move(PLACE, straight=False), program=True)
    engine.perform(Move(ToolOffsetTarget(translation(0.0, 0.0, -0.1)), straight=False), program=True)
    engine.perform(Break())
    assert engine.position().T_world_tool.pz == pytest.approx(-0.1)


@pytest.mark.parametrize("straight", [False, True])
def test_a_depart_too_far_names_the_greatest_distance(engine: Engine, straight: bool) -> None:
    engine.perform(Move(NamedTarget("ready"), False), program=False)

    def depart(millimetres: float) -> None:
        target = ToolOffsetTarget(translation(0.0, 0.0, -millimetres / 1000.0))
        engine.perform(Move(target, straight), program=False)

    with pytest.raises(LocationTooFar) as refused:
        depart(2000.0)
    assert refused.value.hint == "at most 553 mm in this direction"
    with pytest.raises(MotionError):
        depart(554.0)
    depart(553.0)


@pytest.mark.parametrize("joint", [0, 7])
def test_joints_that_are_not_there(engine: Engine, joint: int) -> None:
    with pytest.raises(IllegalJoint, match="1 to 6"):
        engine.perform(Move(JointOffsetTarget(joint, 0.1), straight=False))


def test_drive_keeps_the_joint_range(engine: Engine) -> None:
    with pytest.raises(JointOutOfRange):
        engine.perform(Move(JointOffsetTarget(1, radians(170)), straight=False))


def test_a_point_of_too_few_joints(engine: Engine) -> None:
    with pytest.raises(IllegalValue, match="6"):
        engine.perform(Move(JointTarget((0.0, 0.0)), straight=False))


# --- hand, delay, tool ---


def test_the_hand_works_at_once_or_with_the_next_motion(engine: Engine) -> None:
    engine.perform(OperateHand(1.0, immediate=True))
    assert engine.position().hand == 1.0
    assert engine.now == pytest.approx(0.05)
    engine.perform(OperateHand(0.0, immediate=False))
    assert engine.position().hand == 1.0
    engine.perform(Move(A, straight=False))
    assert engine.position(0.05).hand == 0.0


def test_a_hand_of_a_known_width_opens_as_wide_as_it_is_told() -> None:
    engine = Engine(structs.replace(load_robot("puma560"), hand_width=0.08))
    for width, opening in ((0.02, 0.25), (0.08, 1.0), (0.0, 0.0), (None, 1.0)):
        engine.perform(OperateHand(1.0, immediate=True, width=width))
        assert engine.position().hand == pytest.approx(opening)
    engine.perform(OperateHand(0.0, immediate=False, width=0.04))
    engine.perform(Move(A, straight=False))
    assert engine.position().hand == pytest.approx(0.5)
    for width in (0.081, -0.001):
        with pytest.raises(IllegalValue, match=r"a hand .* mm wide \(it opens from 0 to 80 mm"):
            engine.perform(OperateHand(1.0, immediate=True, width=width))


def test_a_hand_of_a_known_width_closes_on_what_is_in_it() -> None:
    engine = Engine(structs.replace(load_robot("puma560"), hand_width=0.08))
    engine.perform(SetParameter("GRASP.WIDTH", 30.0))
    for closing in (OperateHand(0.0, True), OperateHand(None, True), OperateHand(0.0, True, width=0.01)):
        engine.perform(closing)
        assert engine.position().hand == pytest.approx(30.0 / 80.0)
    engine.perform(Move(A, straight=False, hand=0.0))
    assert engine.position().hand == pytest.approx(30.0 / 80.0)
    engine.perform(SetParameter("GRASP.WIDTH", 900.0))
    engine.perform(OperateHand(0.0, True))
    assert engine.position().hand == 1.0


def test_hand_time_is_a_parameter(engine: Engine) -> None:
    engine.perform(SetParameter("HAND.TIME", 0.5))
    engine.perform(OperateHand(1.0, immediate=True))
    assert engine.now == pytest.approx(0.5)


def test_delay_is_a_null_motion(engine: Engine) -> None:
    engine.perform(Move(A, straight=False), program=True)
    engine.perform(Delay(2.0), program=True)
    begun = engine.now
    engine.perform(Move(B, straight=False), program=True)
    assert engine.now == begun + 2.0


def test_a_new_tool_is_on_the_timeline(engine: Engine) -> None:
    engine.perform(Move(TABLE, straight=False))
    engine.perform(SetTool(translation(0.0, 0.0, 0.1)))
    engine.perform(SetTool(translation(0.0, 0.0, 0.1)))
    assert engine.timeline[0].motion.frames.tool == translation(0.0, 0.0, 0.0)
    assert engine.position().T_world_tool.pz == pytest.approx(-0.14278, abs=1e-4)
    assert len(engine.book.records()) == 2


# --- switches and undo ---


def test_no_power_no_motion(engine: Engine) -> None:
    engine.perform(SetSwitch("power", on=False))
    with pytest.raises(PowerOff, match="ENABLE POWER"):
        engine.perform(Move(A, straight=False))


def test_dry_run_moves_nothing(engine: Engine) -> None:
    engine.perform(SetSwitch("DRY.RUN", on=True))
    engine.perform(Move(A, straight=False))
    assert engine.end == 0.0


def test_names_may_be_short_and_mistakes_are_named(engine: Engine) -> None:
    engine.perform(SetSwitch("dry", on=True))
    assert engine.settings.switch("DRY.RUN")
    with pytest.raises(UsageError, match=r"did you mean POWER\?"):
        engine.perform(SetSwitch("POWR", on=True))
    with pytest.raises(UsageError, match="parameter"):
        engine.perform(SetParameter("HANDY", 1.0))
    with pytest.raises(IllegalValue, match="ON, OFF"):
        engine.perform(SetParameter("INSERT", "MAYBE"))
    with pytest.raises(IllegalValue, match="0 to 60 s"):
        engine.perform(SetParameter("HAND.TIME", -1.0))


def test_undo_takes_back_motion_and_clock(engine: Engine) -> None:
    engine.perform(Move(A, straight=False))
    first, clock = engine.timeline, engine.now
    engine.perform(Move(B, straight=False))
    engine.undo()
    assert engine.timeline == first
    assert engine.now == clock
    assert [record.number for record in engine.book.records()] == [1]
    engine.undo()
    with pytest.raises(UsageError, match="no motion to undo"):
        engine.undo()


def test_redo_does_again_what_was_undone_with_its_clock(engine: Engine) -> None:
    engine.perform(Move(A, straight=False))
    engine.perform(Move(B, straight=False))
    whole, clock = engine.timeline, engine.now
    engine.undo()
    engine.undo()
    engine.redo()
    assert [record.number for record in engine.book.records()] == [1]
    engine.redo()
    assert engine.timeline == whole
    assert engine.now == clock
    assert [delta.cause for delta in engine.book.deltas[-2:]] == [Cause.REDO, Cause.REDO]
    with pytest.raises(UsageError, match="no motion to redo"):
        engine.redo()


def test_a_new_command_ends_what_could_be_redone(engine: Engine) -> None:
    engine.perform(Move(A, straight=False))
    engine.undo()
    engine.perform(Move(B, straight=False))
    with pytest.raises(UsageError, match="a new motion ends it"):
        engine.redo()


def test_a_command_that_is_refused_leaves_what_can_be_redone(engine: Engine) -> None:
    engine.perform(Move(A, straight=False))
    engine.undo()
    with pytest.raises(IllegalValue):
        engine.perform(Move(B, straight=False, stamp=Stamp(-1.0)))
    engine.redo()
    assert len(engine.book.records()) == 1


def test_a_command_that_drops_a_long_tail_is_undone_too(engine: Engine) -> None:
    for _ in range(WIDE_DROP):
        engine.perform(Move(B, straight=False))
        engine.perform(Move(A, straight=False))
    before = engine.timeline
    engine.perform(SetParameter("INSERT", "OFF"))
    engine.perform(Move(B, straight=False, stamp=Stamp(0.1)))
    assert len(engine.timeline) < 10
    engine.undo()
    assert engine.timeline == before


def test_all_deltas_replayed_give_the_timeline(engine: Engine) -> None:
    engine.perform(Move(A, straight=False))
    engine.perform(Move(B, straight=False, stamp=Stamp(0.3)))
    engine.undo()
    engine.perform(Move(B, straight=False))
    replayed = engine.book.initial
    for delta in engine.book.deltas:
        replayed = replayed.apply(delta)
    assert replayed == engine.timeline


def test_stop_brakes_and_drops_the_rest(engine: Engine) -> None:
    engine.perform(Move(A, straight=False), program=True)
    engine.perform(Move(B, straight=False, stamp=Stamp(5.0)), program=True)
    engine.clock.advance(0.4)
    engine.stop()
    assert 0.4 < engine.end < 1.0
    assert set(engine.position(engine.end).velocity) == {0.0}


def test_every_mistake_leaves_the_engine_as_it_was(engine: Engine) -> None:
    engine.perform(Move(A, straight=False))
    timeline, deltas, now = engine.timeline, list(engine.book.deltas), engine.now
    for move in (
        Move(joints(200, 0, 0, 0, 0, 0), straight=False),
        Move(PoseTarget(translation(5.0, 0.0, 0.0)), straight=True),
        Move(A, straight=False, stamp=Stamp(-3.0)),
        Move(NamedTarget("sleep"), straight=False),
    ):
        with pytest.raises(VrsError):
            engine.perform(move)
    assert (engine.timeline, list(engine.book.deltas), engine.now) == (timeline, deltas, now)


@pytest.mark.parametrize("request_", [Break(), SetTool(IDENTITY), SetBase(IDENTITY)])
def test_tool_and_base_wait_for_rest_also_where_they_are_no_others(request_: Request) -> None:
    engine = Engine(MODEL)
    engine.perform(Move(TABLE, straight=False), program=True)
    assert engine.now < engine.end
    engine.perform(request_)
    assert engine.now == engine.end


FAR = translation(0.0, 0.0, 200.0)


@pytest.mark.parametrize(
    ("request_", "told"),
    [
        (SetTool(FAR), "*Illegal value* TOOL 200000 mm away (at most 100000 mm)"),
        (SetBase(FAR), "*Illegal value* BASE 200000 mm away (at most 100000 mm)"),
        (Move(PoseTarget(FAR), straight=True), "*Location too far* 200000 mm from the robot (at most 100000 mm)"),
        (Delay(-1.0), "*Illegal value* DELAY -1 (it is a time from 0 to 4.1943e+06 s)"),
        (SetDuration(float("inf")), "*Illegal value* DURATION inf (it is a time from 0 to 4.1943e+06 s)"),
        (
            Move(A, straight=False, stamp=Stamp(-9.0, relative=True)),
            "*Illegal value* IN -9 (the time of a motion is from 0 to 4.1943e+06 s)",
        ),
    ],
)
def test_what_is_too_far_or_too_late_is_told_with_its_bound(engine: Engine, request_: Request, told: str) -> None:
    with pytest.raises(VrsError) as refused:
        engine.perform(request_)
    assert str(refused.value) == told


def test_no_motion_ends_later_than_times_are_exact(engine: Engine) -> None:
    latest = 2.0**22
    engine.perform(SetDuration(latest, always=True))
    engine.perform(Move(A, straight=False, stamp=Stamp(latest - 1.0)))
    end = engine.end
    assert 2.0 * latest - 2.0 < end < 2.0 * latest
    with pytest.raises(IllegalValue, match="would end at"):
        engine.perform(Move(B, straight=False))
    assert engine.end == end


def test_a_record_says_which_time_was_asked_for_and_when_a_motion_begins_and_ends(engine: Engine) -> None:
    engine.perform(scheduled_move(A, 0.5))
    engine.perform(Move(B, False, text="MOVE b"))
    engine.perform(scheduled_move(TABLE, 60.0))
    first, second, third = engine.book.records()
    assert [one.asked for one in (first, second, third)] == [0.5, None, 60.0]
    assert [one.is_displaced for one in (first, second, third)] == [False, False, False]
    assert first.executed == 0.5
    assert second.executed == first.end
    assert third.executed == 60.0
    assert third.end == pytest.approx(engine.end)
    assert [one.text for one in (first, second, third)] == ["MOVE a", "MOVE b", "MOVE a"]


def scheduled_move(target: JointTarget, at: float) -> Move:
    return Move(target, False, stamp=Stamp(at), text="MOVE a")
