"""Tests of forgotten commands: they count, but cannot be undone; the others stay as they are."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.engine import MODEL, wander, wandering
from benchmarks.program import moved
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.history import History, HistoryStep
from vrs_cli.errors import UsageError
from vrs_cli.trajectory.segment import PackedMotion
from vrs_cli.trajectory.timeline import PART, Cause, DeltaColumns, PackedSegments, TimelineDelta
from vrs_cli.values.commands import Motion, MotionKind, Start

VERSIONS = st.lists(st.integers(0, 40), unique=True, min_size=1, max_size=12).map(sorted)


def steps(versions: Sequence[int]) -> list[HistoryStep]:
    deltas = [
        TimelineDelta(version, Cause.COMMAND, Motion(number, MotionKind.JOINT, Start.AT), 0.0, 0.0, 0.0, 1, 0, 0.0, ())
        for number, version in enumerate(versions)
    ]
    return [HistoryStep(delta, delta, 0.0) for delta in deltas]


@given(VERSIONS, st.integers(0, 41))
def test_forgetting_keeps_the_later_steps_and_the_number_of_commands(versions: list[int], first: int) -> None:
    history = History(steps(versions))
    history.forget(first)
    assert [step.delta.version for step in history.done] == [version for version in versions if version >= first]
    assert history.commands == len(versions)


@given(VERSIONS, st.integers(0, 41), st.integers(1, 12))
def test_what_is_taken_back_is_done_again_also_where_it_is_forgotten(
    versions: list[int], first: int, count: int
) -> None:
    history = History(steps(versions))
    history.forget(first)
    done, forgotten, back = list(history.done), history.forgotten, min(count, len(versions))
    for _ in range(back):
        history.take_back(1.0)
    assert history.commands == len(versions) - back
    for _ in range(back):
        history.do_again()
    assert (history.done, history.forgotten) == (done, forgotten)
    with pytest.raises(UsageError):
        history.do_again()


@given(VERSIONS)
def test_undone_steps_are_forgotten_with_all_that_was_undone_before_them(versions: list[int]) -> None:
    history = History(steps(versions))
    for _ in versions:
        history.take_back(1.0)
    history.forget(versions[0])
    assert len(history.undone) == len(versions)
    history.forget(versions[-1] + 1)
    assert history.undone == []


def test_a_new_command_ends_what_can_be_done_again() -> None:
    first, second = steps([0, 1])
    history = History([first])
    history.take_back(1.0)
    history.add(second)
    assert (history.done, history.undone) == ([second], [])


@pytest.mark.parametrize("count", [0, 3])
def test_as_many_steps_are_taken_back_as_there_are(count: int) -> None:
    done = steps([0, 1])
    history = History(done)
    assert list(history.last_done(2)) == done[::-1]
    with pytest.raises(UsageError):
        history.last_done(count)


def test_old_deltas_and_motions_are_small_and_as_they_were_committed() -> None:
    engine, source, told = Engine(MODEL), Random(3), list[TimelineDelta]()
    engine.book.notify = told.extend
    for _ in range(4 * PART):
        wander(engine, source)
    row = next(engine.timeline.parts())[2].row
    assert isinstance(engine.book.deltas._parts[0], DeltaColumns)
    assert engine.book.deltas._parts[0]._segments is row  # it is in memory once
    assert isinstance(row.motions[1], PackedMotion)
    assert repr(list(engine.book.deltas)) == repr(told)  # to the sign of a zero
    assert repr(list(row)[1:]) == repr([segment for delta in told for segment in delta.segments])
    assert repr(row[1]) == repr(told[0].segments[0])
    assert [step.number for step in engine.book.history.done] == [delta.motion.number for delta in told]
    assert [step.version for step in engine.book.history.done] == [delta.version for delta in told]


def test_old_inverses_are_small_and_as_they_were_made() -> None:
    """Each motion begins while the previous one slows down, so its delta replaces the end of the previous one."""
    engine = moved(4 * PART).engine
    steps, end, timeline = list(engine.book.history.done), engine.timeline, engine.book.initial
    assert isinstance(steps[1]._back, DeltaColumns)
    assert isinstance(next(end.parts())[2].row.motions[1], PackedMotion)
    for step, delta in zip(steps, engine.book.deltas, strict=True):
        inverse = timeline.inverse(delta)
        timeline = timeline.apply(delta)
        assert repr(step.taking_back(timeline.version)) == repr(inverse)  # to the sign of a zero
    engine.undo(len(steps))
    assert engine.timeline == engine.book.initial
    engine.redo(len(steps))
    assert engine.timeline == end


def test_old_steps_share_their_segments_with_the_log_and_can_be_undone_and_done_again() -> None:
    engine = wandering(3 * PART)
    before, steps = engine.timeline, list(engine.book.history.done)
    assert isinstance(steps[0].delta.segments, PackedSegments)
    assert isinstance(steps[-1].delta.segments, tuple)
    assert all(step.delta == delta for step, delta in zip(steps, engine.book.deltas, strict=True))
    assert all(a is b for a, b in zip(steps, engine.book.history.done, strict=True))
    engine.undo(len(steps))
    assert engine.timeline == engine.book.initial
    engine.redo(len(steps))
    assert engine.timeline == before
