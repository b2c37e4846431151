"""Tests of reading and editing timelines, also of many blocks."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.trajectory.instant import LATEST, TICK
from vrs_cli.trajectory.rope import BLOCK_LENGTH, SMALL_LEAF
from vrs_cli.trajectory.segment import JointPath, Phase, Segment, rest
from vrs_cli.trajectory.timeline import PART, Cause, DeltaLog, Timeline, TimelineDelta
from vrs_cli.values.commands import Motion, MotionKind, Start

MOTIONS = [Motion(number, MotionKind.JOINT, Start.AFTER) for number in range(5)]


def motion(number: int) -> Motion:
    return Motion(number, MotionKind.JOINT, Start.AFTER)


def ramp(number: int, start: float, finish: float) -> Segment:
    return Segment(start, finish, JointPath(((float(number), 1.0),)), Phase.CRUISE, motion(number))


def timeline_of(count: int) -> Timeline:
    """Make a timeline of s_0 and `count` segments of one second each."""
    return Timeline([rest((0.0,), 0.0, 0.0, motion(0)), *(ramp(k, k, k + 1.0) for k in range(count))])


def delta(timeline: Timeline, cut: float, keep: int, drop: int, shift: float, *segments: Segment) -> TimelineDelta:
    return TimelineDelta(timeline.version, Cause.COMMAND, motion(9), cut, cut, cut, keep, drop, shift, tuple(segments))


@pytest.mark.parametrize("count", [1, 5, SMALL_LEAF, 3 * SMALL_LEAF + 7])
def test_reads_as_the_list_of_its_segments(count: int) -> None:
    timeline = timeline_of(count)
    segments = list(timeline)
    assert len(timeline) == count + 1
    assert [timeline[k] for k in range(count + 1)] == segments
    assert timeline[-1] == segments[-1]
    assert (timeline.start, timeline.end) == (0.0, float(count))
    with pytest.raises(IndexError):
        timeline[count + 1]


@given(st.floats(-2.0, 1300.0))
def test_locate_finds_the_segment_in_force(t: float) -> None:
    timeline = timeline_of(2 * SMALL_LEAF)
    segment, since = timeline.locate(t)
    expected = min(max(int(t), 0), 2 * SMALL_LEAF - 1)
    if t < 0.0:
        assert (segment.motion.number, since) == (0, 0.0)
    else:
        assert segment.motion.number == expected
        assert since == min(t - expected, 1.0)


def test_stands_still_in_a_gap_and_after_the_end() -> None:
    timeline = Timeline([rest((0.0,), 0.0, 0.0, motion(0)), ramp(1, 1.0, 2.0), ramp(2, 5.0, 6.0)])
    assert timeline.locate(3.0) == (timeline[1], 1.0)
    assert timeline.locate(99.0) == (timeline[2], 1.0)
    assert timeline.locate(0.5) == (timeline[0], 0.0)


def test_edit_in_the_middle_cuts_drops_and_shifts() -> None:
    before = timeline_of(768)
    new = ramp(9999, 700.5, 703.0)
    after = before.apply(delta(before, 700.5, 702, 1, 1.0, new))
    assert after[701].finish == 700.5
    assert after[701].path is before[701].path
    assert after[702] == new
    assert after[703].start == 703.0
    assert after[703].path is before[703].path
    assert len(after) == len(before)
    assert after.version == before.version + 1
    assert list(before) == list(timeline_of(768)), "a reader of the old version is not disturbed"


@given(st.integers(1, 3 * SMALL_LEAF), st.integers(0, 40), st.integers(-20, 20), st.booleans())
def test_inverse_gives_back_what_was(keep: int, drop: int, shift: int, inside: bool) -> None:
    before = timeline_of(3 * SMALL_LEAF)
    drop = min(drop, len(before) - keep)
    last = before[keep - 1]
    cut = 0.5 * (last.start + last.finish) if inside else last.finish
    edit = delta(before, cut, keep, drop, float(shift), ramp(5, cut, cut + 0.25))
    after = before.apply(edit)
    assert after.apply(before.inverse(edit)) == before


def test_many_edits_in_one_place_leave_no_crumbs() -> None:
    timeline = timeline_of(SMALL_LEAF)
    for k in range(300):
        end = timeline.end
        timeline = timeline.apply(delta(timeline, end, len(timeline), 0, 0.0, ramp(k, end, end + 1.0)))
    assert len(list(timeline.blocks(0.0, timeline.end))) <= len(timeline) / BLOCK_LENGTH + 2
    assert [s.start for s in timeline] == [0.0, *map(float, range(SMALL_LEAF + 300))]


def test_shifts_are_exact_however_many_there_are() -> None:
    """Times are multiples of a tick of 2**-30 s (0.93 ns); even next to large times not one tick is lost."""
    source, timeline, second = Random(7), timeline_of(4 * SMALL_LEAF), round(1.0 / TICK)
    timeline = timeline.apply(delta(timeline, LATEST, 1, 0, LATEST / 2))  # where a tick is all that a float can tell
    ticks = [round(s.start / TICK) for s in timeline]
    for _ in range(4000):
        keep = source.randrange(2, len(timeline))
        gap = ticks[keep] - ticks[keep - 1] - second
        shift = source.randint(-gap, second // 10)
        timeline = timeline.apply(delta(timeline, LATEST, keep, 0, shift * TICK))
        ticks[keep:] = [t + shift for t in ticks[keep:]]
    assert [s.start for s in timeline] == [t * TICK for t in ticks]
    assert [s.duration for s in timeline] == [0.0, *[1.0] * (len(timeline) - 1)]
    assert timeline.end == (ticks[-1] + second) * TICK


@given(st.floats(0.0, 40.0), st.integers(0, 2**20), st.integers(1, 20))
def test_where_a_time_falls_does_not_depend_on_how_a_timeline_was_made(t: float, shift: int, keep: int) -> None:
    """Neither the offsets nor the leaves of its rope show from outside, to the last bit of any time."""
    plain = timeline_of(30)
    there = plain.apply(delta(plain, LATEST, keep, 0, shift * TICK))
    back = there.apply(delta(there, LATEST, keep, 0, -shift * TICK))
    for timeline in (back, Timeline(list(there))):
        other = plain if timeline is back else there
        (a, s), (b, r) = timeline.locate(t), other.locate(t)
        assert (a.path, s) == (b.path, r)


def test_a_delta_fits_one_version_only() -> None:
    timeline = timeline_of(3)
    edit = delta(timeline, 3.0, 4, 0, 0.0, ramp(7, 3.0, 4.0))
    with pytest.raises(ValueError, match="does not fit"):
        timeline.apply(edit).apply(edit)


def numbered(version: int) -> TimelineDelta:
    motion, t = MOTIONS[version % 5], float(version)
    segments = tuple(Segment(t, t + 1.0, JointPath(((t, 0.5),)), Phase.CRUISE, motion) for _ in range(version % 4))
    cause = [Cause.COMMAND, Cause.UNDO][version % 7 == 0]
    return TimelineDelta(
        version, cause, motion, t, t + 0.25, t, version + 1, version % 3, 0.5 * (version % 2), segments
    )


def steered(version: int) -> TimelineDelta:
    t = float(version)
    tick = Segment(t, t + 1.0, JointPath(((t, 0.5),)), Phase.BLEND, MOTIONS[1])
    return TimelineDelta(version, Cause.COMMAND, MOTIONS[1], t, t, t, version, 0, 0.0, (tick,))


@pytest.mark.parametrize("make", [numbered, steered])
def test_reads_as_a_list(make: Callable[[int], TimelineDelta]) -> None:
    plain = [make(version) for version in range(5 * PART + 3)]
    log = DeltaLog(plain)
    assert len(log) == len(plain)
    assert repr(list(log)) == repr(plain)
    assert (log[0], log[-1], log[3]) == (plain[0], plain[-1], plain[3])
    assert log[PART - 2 : 2 * PART + 2] == plain[PART - 2 : 2 * PART + 2]
    assert all(a.motion is b.motion for a, b in zip(log, plain, strict=True))
    with pytest.raises(IndexError):
        log[len(plain)]


@pytest.mark.parametrize("count", [2, PART + 1, 3 * PART, 3 * PART + 1])
def test_the_last_two_may_be_replaced(count: int) -> None:
    log = DeltaLog(map(numbered, range(count)))
    log[-2], log[-1] = steered(count - 2), steered(count - 1)
    assert list(log) == [*map(numbered, range(count - 2)), steered(count - 2), steered(count - 1)]


def test_a_copy_goes_on_apart() -> None:
    count = 3 * PART + 5
    log = DeltaLog(map(numbered, range(count)))
    copy = log.copy()
    copy.extend(map(numbered, range(count, 6 * PART)))
    log.extend([steered(count)])
    assert list(copy) == [*map(numbered, range(6 * PART))]
    assert list(log) == [*map(numbered, range(count)), steered(count)]
