"""Files in which every motion says how far the hand is open, as it was before the hand became a channel."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest
from msgspec import structs

from tests.files.trajectories import initial, motion, puma
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.planner import plan
from vrs_cli.files.journal import keep_journal, take_up
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.trajectory.instant import on_grid
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import HAND, Delay, Motion, MotionKind, OperateHand, Start


def older(seed: int, count: int) -> tuple[list[Timeline], list[TimelineDelta]]:
    """Timelines in which motions open and close the hand, also in the middle and for no time; some are undone."""
    rng, arm = Random(seed), arm_for(puma())
    timeline = Timeline([initial()])
    timelines, deltas = [timeline], list[TimelineDelta]()
    for number in range(1, count + 1):
        executed = on_grid(rng.uniform(0.0, timeline.end) if rng.random() < 0.4 else timeline.end)
        one = structs.replace(motion(rng, number), hand=rng.choice((0.0, 0.0, 1.0, 0.5)))
        if rng.random() < 0.2:
            one = Motion(number, MotionKind.REST, Start.AFTER, hand=one.hand)  # TOOL, and OPENI with HAND.TIME = 0
        delta = plan(arm, timeline, one, executed, executed, insert=rng.random() < 0.8)
        before, timeline = timeline, timeline.apply(delta)
        deltas.append(delta)
        timelines.append(timeline)
        if rng.random() < 0.25:
            deltas.append(before.inverse(delta))
            timeline = timeline.apply(deltas[-1])
            timelines.append(timeline)
    return timelines, deltas


def hand_of(timeline: Timeline, t: float) -> float:
    """What the hand was when each motion said it."""
    return timeline.locate(t)[0].motion.hand


@pytest.mark.parametrize("seed", range(8))
def test_the_hand_is_as_it_was_after_every_change(tmp_path: Path, seed: int) -> None:
    timelines, deltas = older(seed, 25)
    path, rng = tmp_path / "older.vrst", Random(seed)
    write_trajectory(path, puma(), timelines[0], deltas)
    recording = read_trajectory(path)
    assert recording.older_hand == any(delta.motion.hand for delta in deltas)
    timeline = recording.initial
    for known, delta in zip(timelines, (*recording.deltas, None), strict=True):
        times = [rng.uniform(-0.1, known.end + 0.1) for _ in range(20)] + [segment.start for segment in known]
        assert [timeline.value_at(HAND, t) for t in times] == [hand_of(known, t) for t in times]
        timeline = timeline if delta is None else timeline.apply(delta)
    write_trajectory(path, puma(), recording.initial, recording.deltas)
    again = read_trajectory(path)
    assert (again.deltas, again.timeline) == (recording.deltas, recording.timeline)


def test_a_journal_of_before_goes_on_with_events(tmp_path: Path) -> None:
    timelines, deltas = older(3, 12)
    path = tmp_path / "older.vrst"
    write_trajectory(path, puma(), timelines[0], deltas)
    opened = hand_of(timelines[-1], timelines[-1].end)
    for hand in (None, None, 1.0, None):
        engine = Engine(puma())
        journal = keep_journal(take_up(path), engine)
        assert engine.position().hand == opened
        engine.perform(Delay(0.5) if hand is None else OperateHand(hand, True, "OPENI"))
        opened = opened if hand is None else hand
        events = tuple(engine.timeline.events)
        journal.close()
        assert tuple(read_trajectory(path).timeline.events) == events


def test_a_file_without_a_hand_has_no_events(tmp_path: Path) -> None:
    engine, path = Engine(puma()), tmp_path / "plain.vrst"
    engine.perform(Delay(0.5))
    write_trajectory(path, puma(), engine.book.initial, engine.book.deltas)
    assert b'"events"' not in path.read_bytes()
    assert b'"hand":' not in path.read_bytes().split(b"\n", 1)[1]
