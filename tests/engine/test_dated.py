"""Tests of dated events after edits, one rule at a time, and of the engine's commands that make them."""

from __future__ import annotations

import pytest

from vrs_cli.engine.book import displacement
from vrs_cli.engine.branches import MAIN, Branches
from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.comparison import compare
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import IllegalValue, TooLate, UsageError
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import (
    HAND,
    Delay,
    Event,
    JointOffsetTarget,
    JointTarget,
    MotionKind,
    Move,
    OperateHand,
    SetChannels,
    SetParameter,
    Stamp,
)

SIGNAL, INPUT = 1, 1001


@pytest.fixture
def engine() -> Engine:
    return Engine(load_robot("puma560"))


def drive(engine: Engine, at: float | None = None, degrees: float = 20.0, joint: int = 1) -> None:
    target = JointOffsetTarget(joint, degrees * 0.0174)
    engine.perform(Move(target, False, stamp=None if at is None else Stamp(at), text=f"DRIVE {joint}"))


def signal(engine: Engine, at: float | None = None, on: bool = True, channel: int = SIGNAL) -> None:
    engine.perform(SetChannels(((channel, float(on)),), None if at is None else Stamp(at), f"SIGNAL {channel}"))


def there_and_back(engine: Engine) -> None:
    """Make two motions to absolute places. After an edit before both, the second is only shifted."""
    ready = engine.model.poses["ready"]
    for at, joints in ((2.0, (1.5, *ready[1:])), (4.0, ready)):
        engine.perform(Move(JointTarget(joints), False, stamp=Stamp(at), text=f"MOVE AT {at}"))


def outside(engine: Engine, on: bool = True) -> None:
    engine.perform(SetChannels(((INPUT, float(on)),), Stamp(engine.now)))


def times(engine: Engine, channel: int = SIGNAL) -> list[float]:
    return [event.time for event in engine.timeline.events if event.channel == channel]


# --- making them ---------------------------------------------------------------------------------------------------


def test_a_signal_takes_its_value_now_or_at_its_time(engine: Engine) -> None:
    drive(engine)
    signal(engine)
    signal(engine, 0.25, on=False)
    assert times(engine) == [0.25, engine.end]
    assert [event.tied for event in engine.timeline.events] == [False, True]
    assert (engine.timeline.value_at(SIGNAL, 0.3), engine.timeline.value_at(SIGNAL, engine.end)) == (0.0, 1.0)
    with pytest.raises(IllegalValue):
        signal(engine, -1.0)


def test_undo_takes_a_signal_back(engine: Engine) -> None:
    signal(engine)
    drive(engine)
    signal(engine, on=False)
    assert engine.undo() == ("SIGNAL 1",)
    assert engine.timeline.value_at(SIGNAL, engine.now) == 1.0
    engine.undo(2)
    assert engine.timeline.event_count == 0
    engine.redo(3)
    assert engine.timeline.value_at(SIGNAL, engine.now) == 0.0


def test_the_hand_is_a_channel(engine: Engine) -> None:
    engine.perform(OperateHand(1.0, True, "OPENI"))
    begun, ended = 0.0, engine.now
    (event,) = engine.timeline.events
    assert event == Event(begun, HAND, 1.0, 1, tied=True, duration=ended - begun)
    engine.perform(OperateHand(0.0, False, "CLOSE"))
    assert engine.timeline.event_count == 1
    drive(engine)
    assert list(engine.timeline.changes(HAND)) == [(begun, 1.0), (ended, 0.0)]
    assert (engine.position(0.01).hand, engine.position().hand) == (1.0, 0.0)
    assert all(segment.motion.hand == 0.0 for segment in engine.timeline)


def test_the_hand_operates_at_a_time_while_the_arm_moves(engine: Engine) -> None:
    drive(engine)
    before = tuple(engine.timeline)
    engine.perform(OperateHand(1.0, True, "OPENI AT 0.3", stamp=Stamp(0.3)))
    assert tuple(engine.timeline) == before
    (event,) = engine.timeline.events
    assert (event.time, event.value, event.tied, event.duration) == (
        pytest.approx(0.3),
        1.0,
        False,
        pytest.approx(0.05),
    )


def test_what_comes_from_outside_or_was_observed_is_no_command(engine: Engine) -> None:
    drive(engine)
    outside(engine)
    engine.perform(SetChannels(((INPUT, 1.0),), text="step 3", observed=True, duration=0.5))
    kinds = [delta.motion.kind for delta in engine.book.deltas]
    assert kinds == [MotionKind.JOINT, MotionKind.RECORDED, MotionKind.RECORDED]
    assert engine.book.history.commands == len(engine.book.records()) == 1
    observed = list(engine.timeline.events)[-1]
    assert (observed.observed, observed.duration) == (True, 0.5)
    assert engine.undo() == ("DRIVE 1",)
    assert (engine.timeline.event_count, engine.now) == (0, 0.0)
    with pytest.raises(UsageError, match="there is no motion to undo"):
        engine.undo()
    assert engine.redo() == ("DRIVE 1",)
    assert engine.timeline.event_count == 2


# --- after a cut ---------------------------------------------------------------------------------------------------


def test_a_tied_event_follows_the_end_of_an_interrupted_motion(engine: Engine) -> None:
    drive(engine, degrees=60.0)
    end = engine.end
    signal(engine)
    drive(engine, at=0.1, degrees=5.0, joint=2)
    assert times(engine) == [engine.end] != [end]


def test_a_tied_event_shifts_with_the_motion_that_is_planned_again(engine: Engine) -> None:
    drive(engine)
    engine.perform(Delay(1.0))
    drive(engine, degrees=-20.0)
    third = engine.book.records()[-1]
    signal(engine)
    since = times(engine)[0] - third.executed
    drive(engine, at=0.1, degrees=40.0, joint=2)
    assert times(engine)[0] - engine.book.records()[2].executed == pytest.approx(since, abs=1e-9)


def test_an_event_with_a_time_of_its_own_keeps_it(engine: Engine) -> None:
    drive(engine, degrees=60.0)
    signal(engine, at=0.5)
    signal(engine, at=9.0, on=False)
    drive(engine, at=0.1, joint=2)
    assert times(engine) == [0.5, 9.0]


def test_the_tail_shifts_with_its_events_but_inputs_from_outside_stay(engine: Engine) -> None:
    there_and_back(engine)
    signal(engine, at=4.125)
    engine.clock.set(4.25)
    outside(engine)
    drive(engine, at=1.9, degrees=-120.0, joint=2)
    moved = next(one.executed for one in engine.book.records() if one.asked == 4.0) - 4.0
    assert moved > 0.25
    assert times(engine) == [pytest.approx(4.125 + moved)]
    assert times(engine, INPUT) == [4.25]
    assert [event.time for event in engine.timeline.events] == sorted(event.time for event in engine.timeline.events)
    engine.undo()
    assert (times(engine), times(engine, INPUT)) == ([4.125], [4.25])


@pytest.mark.parametrize("how", ["INSERT", "BRAKE", "JOG"])
def test_what_comes_later_is_dropped(engine: Engine, how: str) -> None:
    drive(engine, degrees=60.0)
    signal(engine, at=0.1)
    signal(engine, at=0.5, on=False)
    engine.clock.set(0.25)
    if how == "INSERT":
        engine.perform(SetParameter("INSERT", "OFF"))
        drive(engine, at=0.25, joint=2)
    elif how == "BRAKE":
        engine.stop()
    else:
        engine.redirect(engine.model.poses["ready"])
    assert times(engine) == [pytest.approx(0.1)]
    engine.undo()
    assert times(engine) == [pytest.approx(0.1), 0.5]


# --- real time -----------------------------------------------------------------------------------------------------


def real(rate: float = 1.0) -> tuple[Engine, list[float]]:
    wall = [0.0]

    def sleep(seconds: float) -> None:
        wall[0] += seconds

    return Engine(load_robot("puma560"), clock=WallClock(lambda: wall[0], sleep, rate)), wall


def test_a_late_event_is_postponed_or_refused() -> None:
    engine, wall = real()
    wall[0] = 6.0
    engine.clock.advance(6.0)
    told = list[str]()
    engine.postponed.append(lambda it: told.append(it.text))
    engine.perform(SetParameter("CAUSALITY", "POSTPONE"))
    signal(engine, at=2.0)
    assert (times(engine), told) == ([6.0], ["SIGNAL 1"])
    engine.perform(SetParameter("CAUSALITY", "ABORT"))
    with pytest.raises(TooLate):
        signal(engine, at=2.0)


def test_undo_in_real_time_leaves_what_was_recorded() -> None:
    engine, wall = real()
    drive(engine, at=100.0)
    signal(engine, at=120.0)
    for second in (6.0, 6.5):
        wall[0] = second
        engine.clock.advance(second)
        outside(engine, on=second < 6.2)
    assert engine.undo(2) == ("SIGNAL 1", "DRIVE 1")
    assert (times(engine), times(engine, INPUT), len(engine.timeline)) == ([], [6.0, 6.5], 1)
    wall[0] = 7.0
    engine.clock.advance(7.0)
    outside(engine)
    assert engine.redo(2) == ("DRIVE 1", "SIGNAL 1")
    assert (times(engine), times(engine, INPUT)) == ([120.0], [6.0, 6.5, 7.0])
    assert len(engine.timeline) > 1
    replayed = engine.book.initial
    for delta in engine.book.deltas:
        replayed = replayed.apply(delta)
    assert replayed == engine.timeline


def test_a_signal_that_has_been_set_cannot_be_taken_back_in_real_time() -> None:
    engine, wall = real()
    signal(engine)
    wall[0] = 1.0
    engine.clock.advance(1.0)
    with pytest.raises(TooLate):
        engine.undo()


# --- branches, checks ----------------------------------------------------------------------------------------------


def test_a_branch_with_events_is_merged(engine: Engine) -> None:
    drive(engine)
    branches = Branches(engine)
    branches.make("trial")
    signal(engine)
    drive(engine, joint=2)
    engine.perform(OperateHand(1.0, True, "OPENI"))
    signal(engine, at=0.25, channel=2)
    outside(engine)
    branches.change_over(MAIN)
    drive(engine, joint=3, degrees=40.0)
    assert branches.merge("trial") == 4
    assert times(engine, 2) == [0.25]
    assert engine.position(engine.end).hand == 1.0
    assert times(engine) == [pytest.approx(engine.book.records()[0].end)]  # when the motion ends after which it was set


def test_a_check_may_refuse_an_event(engine: Engine) -> None:
    def refuse(_timeline: Timeline, delta: TimelineDelta, _settings: Settings) -> None:
        if delta.events is not None:
            raise IllegalValue("touches", "no")

    engine.checks.append(refuse)
    drive(engine)
    with pytest.raises(IllegalValue):
        signal(engine)
    outside(engine)  # it has happened
    engine.checks.clear()
    signal(engine)
    assert engine.timeline.event_count == 2


def test_what_an_edit_does_to_events_is_told(engine: Engine) -> None:
    there_and_back(engine)
    signal(engine, at=4.25)
    before = engine.timeline
    drive(engine, at=1.9, degrees=-120.0, joint=2)
    told = displacement(engine.book, before)
    assert told is not None
    assert [one.text for one in told.later] == ["MOVE AT 2.0", "MOVE AT 4.0", "SIGNAL 1"]


def test_branches_differ_from_the_first_other_event_on(engine: Engine) -> None:
    drive(engine)
    branches = Branches(engine)
    branches.make("trial")
    signal(engine, at=0.25)
    found = compare(engine.arm, branches.book(MAIN), branches.book("trial"))
    assert (found.since, found.tool.distance, len(found.commands)) == (0.25, 0.0, 2)
