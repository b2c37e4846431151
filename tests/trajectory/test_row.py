"""Tests of rows as columns: what is read is what was put in, however old it is."""

from __future__ import annotations

from random import Random

import pytest
from msgspec import structs

from tests.examples import first
from vrs_cli.trajectory.row import UNPACKED_SEGMENTS, EventRow, Row
from vrs_cli.trajectory.segment import JointPath, PackedMotion, Phase, Segment, rest
from vrs_cli.trajectory.timeline import PART, Cause, DeltaLog, Timeline, TimelineDelta
from vrs_cli.values.commands import HAND, Event, EventEdit, Motion, MotionKind, Start

MOTIONS = [Motion(number, MotionKind.JOINT, Start.AFTER) for number in range(3)]
PATHS = [((0.1, -0.0), (2.0, 3.0)), ((0.1, 0.2, 0.3), (1.0, -0.0, 2.0)), ((0.5,), (0.25,)), ((1.0, 2.0, 3.0, 4.0),) * 2]


def segments(count: int) -> list[Segment]:
    return [
        Segment(float(k), k + 0.5, JointPath(PATHS[k % 4]), [Phase.REST, Phase.CRUISE][k % 2], MOTIONS[k % 3])
        for k in range(count)
    ]


def test_gives_what_was_put_in() -> None:
    some = segments(4 * UNPACKED_SEGMENTS)
    row = Row(some[:5])
    row.grow(some[5:])
    assert repr(list(row)) == repr(segments(4 * UNPACKED_SEGMENTS))  # to the sign of a zero
    assert list(row) == some
    assert row[-1] == some[-1]
    assert row[7:9] == some[7:9]
    assert all(a.motion is b.motion for a, b in zip(row, some, strict=True))


def test_what_is_far_from_the_end_is_shared_and_small() -> None:
    some = segments(4 * UNPACKED_SEGMENTS)
    row = Row(some)
    assert row.paths[0] is some[0].path
    assert isinstance(row.paths[0], JointPath)
    assert isinstance(row.paths[0]._rows, bytes)
    assert isinstance(row.paths[-1], JointPath)
    assert row.paths[-1]._rows is PATHS[-1]


def test_a_path_is_packed_once_however_a_row_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    row, packed = Row(), list[JointPath]()

    def pack(path: JointPath) -> None:
        packed.append(path)

    monkeypatch.setattr(JointPath, "pack", pack)
    for segment in segments(8 * UNPACKED_SEGMENTS):
        row.grow([segment])
    assert 6 * UNPACKED_SEGMENTS <= len(packed) == len({id(path) for path in packed})


def test_packed_motions_are_the_same_to_the_bit() -> None:
    like = Motion(1, MotionKind.JOINT, Start.AT, (0.0, -0.0), speed=0.5, text="MOVE a")
    moved = structs.replace(like, number=2, goal=(1.0, 2.0), text="MOVE b", speed=float("0.5"))
    others = [moved, structs.replace(like, hand=-0.0), Motion(4, MotionKind.REST, Start.AT)]
    motions = [like, like, *others]
    row = Row([rest((0.0, 0.0), 1.0, float(k), motion) for k, motion in enumerate(motions)])
    packed: dict[int, PackedMotion] = {}
    row.pack_motions(0, len(row), packed)
    assert repr([segment.motion for segment in row]) == repr([row[k].motion for k in range(5)]) == repr(motions)
    assert len(packed) == 3  # motions without a goal stay as they are
    assert packed[id(others[0])].like is like
    assert packed[id(others[1])].like is others[1]


def test_takes_a_part_of_another_row_later() -> None:
    row, other = Row(segments(2)), Row(segments(9))
    row.take(other, 4, 6, 10.0)
    assert list(row) == [*segments(2), *(one.shift_by(10.0) for one in segments(9)[4:6])]


def test_a_packed_path_is_the_same() -> None:
    eight = tuple([(0.1 * k, 0.2, -0.3) for k in range(8)])
    for rows in (*PATHS, eight, eight[:6], tuple([a[:2] for a in eight[:6]])):
        path, kept = JointPath(rows), JointPath(rows)
        path.pack()
        path.pack()
        assert path == kept
        assert not path != kept  # noqa: SIM202 (both are asked)
        assert not path == JointPath((*rows[1:], (9.0,)))  # noqa: SIM201
        assert hash(path) == hash(kept)
        assert repr(path) == repr(kept)
        assert path.coefficients == rows
        for s in (0.0, 0.125, 0.7):
            assert path.joints(s) == kept.joints(s)
    assert JointPath(((0.0,),)) == JointPath(((-0.0,),))


@pytest.mark.parametrize("joint_count", range(1, 9))
def test_a_path_of_lists_is_packed_as_one_of_tuples(joint_count: int) -> None:
    for length in range(1, 7):
        rows = [[10.0 * joint + power for power in range(length)] for joint in range(joint_count)]
        path, kept = JointPath.make_packed(rows), JointPath(tuple(map(tuple, rows)))
        assert path.doubles() == kept.doubles()
        assert (path, path.packed_length, path.joint_count, path.degree) == (kept, length, joint_count, length - 1)


@pytest.mark.parametrize("joint_count", [2, 6, 7])
def test_polynomials_of_different_degrees_are_not_packed(joint_count: int) -> None:
    for longer in range(joint_count):
        for shorter in {*range(joint_count)} - {longer}:  # together as many coefficients as of one degree
            lengths = [2 + (joint == longer) - (joint == shorter) for joint in range(joint_count)]
            with pytest.raises(ValueError, match="polynomials of 1 and of 3 coefficients in one segment"):
                JointPath.make_packed([[0.5] * length for length in lengths])


NOTHING = Motion(0, MotionKind.REST, Start.AT)


def standing(*events: Event) -> Timeline:
    return Timeline([rest((0.0,) * 6, 0.0, 0.0, NOTHING)], events=events)


def delta(timeline: Timeline, edit: EventEdit | None) -> TimelineDelta:
    end = timeline.end
    return TimelineDelta(timeline.version, Cause.COMMAND, NOTHING, 0.0, 0.0, end, len(timeline), 0, 0.0, (), edit)


def plain(events: list[Event], edit: EventEdit) -> list[Event]:
    behind = [event.shift_by(edit.shift) for event in events[edit.keep + edit.drop :]]
    return [*events[: edit.keep], *edit.events, *behind]


def value(events: list[Event], channel: int, t: float) -> float:
    found = [event.value for event in events if event.channel == channel and event.time <= t and not event.observed]
    return found[-1] if found else 0.0


def random_edit(source: Random, events: list[Event]) -> EventEdit:
    keep = len(events) if source.random() < 0.6 else source.randint(0, len(events))
    drop = 0 if source.random() < 0.6 else source.randint(0, min(len(events) - keep, 40))
    begin = events[keep - 1].time if keep else 0.0
    times = sorted(begin + source.randint(0, 64) / 64 for _ in range(source.choice([0, 1, 1, 2, 30])))
    new = tuple(
        Event(
            t, source.choice([0, 0, 1, 2, 1001]), float(source.randint(0, 2)), source.randint(1, 9), t > 3.0, 0.5, t < 1
        )
        for t in times
    )
    behind = events[keep + drop].time if keep + drop < len(events) else 0.0
    last = new[-1].time if new else begin
    return EventEdit(keep, drop, max(last - behind, 0.0) + source.randint(0, 64) / 64, new)


@pytest.mark.parametrize("seed", first(2, range(6)))
def test_the_rope_of_events_is_a_plain_list(seed: int) -> None:
    source, timeline, events = Random(seed), standing(), list[Event]()
    for _ in range(150):
        edit = random_edit(source, events)
        change = delta(timeline, edit)
        before, timeline = timeline, timeline.apply(change)
        assert tuple(timeline.apply(before.inverse(change)).events) == tuple(before.events) == tuple(events)
        events = plain(events, edit)
        assert list(timeline.events) == events
        assert timeline.event_count == len(events)
        end = events[-1].time if events else 0.0
        for _ in range(5):
            t, channel = source.choice([source.uniform(-1.0, end + 1.0), end]), source.choice([0, 1, 2, 1001, 7])
            assert timeline.value_at(channel, t) == value(events, channel, t)
            assert timeline.events_by(t) == sum(event.time <= t for event in events)
            assert timeline.events_by(t, before=True) == sum(event.time < t for event in events)
            assert list(timeline.events_between(t, t + 2.0)) == [one for one in events if t <= one.time <= t + 2.0]
    assert [timeline.event(index) for index in range(len(events))] == events
    assert set(timeline.channels) == {event.channel for event in events if not event.observed}


def test_a_channel_changes_where_it_becomes_another_value() -> None:
    timeline = standing(
        Event(0.5, 1, 0.0),
        Event(1.0, 1, 1.0),
        Event(1.0, 2, 1.0),
        Event(2.0, 1, 1.0),
        Event(3.0, 1, 0.0, observed=True),
    )
    assert list(timeline.changes(1)) == [(1.0, 1.0)]
    assert timeline.value_at(1, 5.0) == 1.0
    assert list(timeline.changes(HAND)) == []


def test_the_last_event_of_an_instant_counts() -> None:
    timeline = standing(Event(1.0, 1, 1.0), Event(1.0, 1, 0.0))
    assert timeline.value_at(1, 1.0) == 0.0
    assert list(timeline.changes(1)) == []


def test_the_next_event_is_later() -> None:
    timeline = standing(Event(1.0, 1, 1.0), Event(2.0, 1, 0.0))
    assert timeline.event_after(0.0) == Event(1.0, 1, 1.0)
    assert timeline.event_after(1.0) == Event(2.0, 1, 0.0)
    assert timeline.event_after(2.0) is None
    with pytest.raises(IndexError):
        timeline.event(2)


def test_timelines_with_other_events_differ() -> None:
    assert standing(Event(1.0, 1, 1.0)) == standing(Event(1.0, 1, 1.0)) != standing(Event(1.0, 1, 0.0))


def test_a_log_keeps_the_events_of_old_deltas() -> None:
    timeline, log, known = standing(), DeltaLog(), list[TimelineDelta]()
    for number in range(4 * PART):
        edit = EventEdit(timeline.event_count, events=(Event(float(number), 1, 1.0, number),)) if number % 3 else None
        known.append(delta(timeline, edit))
        log.extend(known[-1:])
        timeline = timeline.apply(known[-1])
    assert list(log) == known
    assert log[PART - 1 : 3 * PART + 2] == known[PART - 1 : 3 * PART + 2]
    assert log[7:3] == []
    assert log[::-3] == known[::-3]


class CountingDeltas:
    """A place where deltas are written down; `reads`: how often it was read."""

    def __init__(self, deltas: list[TimelineDelta]) -> None:
        self.deltas, self.reads = deltas, 0

    def read_deltas(self, first: int, last: int) -> list[TimelineDelta]:
        self.reads += 1
        return self.deltas[first:last]


def test_a_part_that_is_written_down_is_read_once_for_many_deltas() -> None:
    timeline, known = standing(), list[TimelineDelta]()
    for _ in range(2 * PART):
        known.append(delta(timeline, EventEdit(timeline.event_count, events=(Event(1.0, 1, 1.0),))))
        timeline = timeline.apply(known[-1])
    kept = CountingDeltas(known)
    log = DeltaLog.after(kept, 2, ())
    assert log[5:] == known[5:]
    assert kept.reads == 2


def test_ctrl_c_in_the_middle_of_indexing_leaves_a_sound_row() -> None:
    row = EventRow([Event(1.0, 1, 1.0)])
    assert list(row.places(1)) == [0]
    row._places[1].append(1)  # what is left of an interrupted time
    row.grow([Event(2.0, 1, 0.0)])
    assert list(row) == [Event(1.0, 1, 1.0), Event(2.0, 1, 0.0)]
    assert list(row.places(1)) == [0, 1]
