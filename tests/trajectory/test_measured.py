"""Tests of the measured timeline with random reports, against a plain list of them."""

from __future__ import annotations

from itertools import pairwise
from math import cos, nan, sin
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.errors import IllegalValue
from vrs_cli.trajectory.measured import GAP, MeasuredRecord, MeasuredTimeline
from vrs_cli.trajectory.reports import CHUNK_REPORTS, ReportColumns
from vrs_cli.values.measured import MAX_LATENESS_S, BodyMode, Report, ReportCounts

JOINTS = 2
TICK = 1.0 / 64.0  # [s]: exact, and its halves too


def _single(x: float) -> float:
    return float(np.float32(x))


numbers = st.floats(-3.0, 3.0, width=32)
rows = st.tuples(numbers, numbers)


@st.composite
def report_lists(draw: st.DrawFn) -> list[Report]:
    """Make reports of different times, with gaps; their velocities are rounded as records keep them."""
    steps = draw(st.lists(st.sampled_from([1, 1, 1, 2, 5, 31, 32, 33, 200]), min_size=1, max_size=25))
    reports, ticks = [], draw(st.integers(-5, 5))
    for step in steps:
        ticks += step
        velocity, effort = draw(st.none() | rows), draw(st.none() | rows)
        reports.append(Report(ticks * TICK, draw(rows), velocity, effort, draw(st.sampled_from(BodyMode))))
    return reports


def _record(reports: list[Report]) -> MeasuredRecord:
    record = MeasuredRecord(JOINTS)
    record.add(reports)
    return record


@given(report_lists())
def test_a_record_gives_back_its_reports(reports: list[Report]) -> None:
    seen = _record(reports).view
    assert list(seen) == reports
    assert [seen[i] for i in range(-len(seen), 0)] == reports
    assert (seen.start, seen.end, seen.last) == (reports[0].t, reports[-1].t, reports[-1])
    begin, end = reports[0].t + TICK, reports[-1].t - TICK
    assert list(seen.between(begin, end)) == [one for one in reports if begin <= one.t <= end]


@given(report_lists(), st.randoms(use_true_random=False))
def test_any_order_of_arrival_with_duplicates_gives_the_same_record(reports: list[Report], random: Random) -> None:
    reports = [one for one in reports if one.t >= reports[-1].t - MAX_LATENESS_S]
    arriving = reports + random.sample(reports, len(reports) // 2)
    random.shuffle(arriving)
    record = MeasuredRecord(JOINTS)
    counts = ReportCounts()
    for one in arriving:
        counts += record.add([one])
    assert record.view == MeasuredTimeline(JOINTS, tuple(_record(reports)._chunks))
    assert (counts.received, counts.duplicate, counts.late) == (len(arriving), len(reports) // 2, 0)


@given(report_lists(), st.randoms(use_true_random=False))
def test_what_a_reader_has_never_changes(reports: list[Report], random: Random) -> None:
    record = MeasuredRecord(JOINTS)
    taken = []
    arriving = sorted(reports, key=lambda one: one.t + random.uniform(0.0, MAX_LATENESS_S))
    for one in arriving:
        record.add([one])
        taken.append((record.view, list(record.view)))
        if random.random() < 0.2:
            record.forget_before(one.t - MAX_LATENESS_S)
    for seen, was in taken:
        assert list(seen) == was


@given(report_lists())
def test_joints_and_velocities_at_reports_are_those_of_the_reports(reports: list[Report]) -> None:
    seen = _record(reports).view
    for one in reports:
        assert seen.joints_at(one.t) == one.joints
        assert seen.mode_at(one.t) == one.mode
        if one.velocity is not None:
            assert seen.velocity_at(one.t) == one.velocity


@given(report_lists())
def test_joints_are_unknown_outside_and_in_gaps_and_between_neighbours_elsewhere(reports: list[Report]) -> None:
    seen = _record(reports).view
    assert seen.joints_at(reports[0].t - 1e-9) is None
    assert seen.joints_at(reports[-1].t + 1e-9) is None
    assert seen.velocity_at(reports[-1].t + 1.0) is seen.mode_at(reports[-1].t + 1.0) is None
    for a, b in pairwise(reports):
        middle = seen.joints_at((a.t + b.t) / 2.0)
        if b.t - a.t > GAP:
            assert middle is None
        else:
            assert middle is not None
            v, w = (a.velocity, b.velocity) if a.velocity and b.velocity else ((0.0, 0.0), (0.0, 0.0))
            expected = [
                (p + q) / 2.0 + (b.t - a.t) / 8.0 * (x - y) for p, q, x, y in zip(a.joints, b.joints, v, w, strict=True)
            ]
            assert middle == pytest.approx(expected, abs=1e-12)


@given(report_lists(), st.lists(st.integers(-40, 4000), max_size=20))
def test_many_times_at_once_are_as_each_alone(reports: list[Report], ticks: list[int]) -> None:
    seen = _record(reports).view
    times = [one.t for one in reports] + [tick * TICK / 4.0 for tick in ticks]
    alone = [seen.joints_at(t) or (nan,) * JOINTS for t in times]
    np.testing.assert_allclose(seen.joints_over(np.array(times)), np.array(alone), rtol=0.0, atol=1e-14)


@given(report_lists(), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=5))
def test_the_timeline_of_segments_goes_where_the_measured_one_goes(reports: list[Report], shares: list[float]) -> None:
    seen = _record(reports).view
    made = seen.as_timeline(reports[0].t, reports[-1].t)
    assert made is not None
    times = [one.t for one in reports]
    times += [a.t + share * (b.t - a.t) for a, b in pairwise(reports) for share in shares]
    for t in times:
        expected = seen.joints_at(t)
        path, s = made.path_at(t)
        if expected is None:  # in a gap: where the robot was last
            expected = next(one for one in reversed(reports) if one.t <= t).joints
        assert path.joints(s) == pytest.approx(expected, abs=1e-9)  # type: ignore[union-attr]
    assert (made.start, made.end) == (reports[0].t, reports[-1].t)


@given(report_lists(), st.randoms(use_true_random=False))
def test_columns_are_put_in_their_places(reports: list[Report], random: Random) -> None:
    record = MeasuredRecord(JOINTS)
    blocks = [reports[place : place + 4] for place in range(0, len(reports), 4)]
    random.shuffle(blocks)
    for block in blocks:
        columns = ReportColumns(JOINTS, len(block))
        for one in block:
            columns.put(one)
        record.add_columns(columns)
        record.add_columns(columns)  # duplicates
    assert list(record.view) == reports


def test_a_derivative_is_that_of_the_joints() -> None:
    record = MeasuredRecord(1)
    record.add(Report(k * 0.02, (sin(k * 0.02),), (cos(k * 0.02),)) for k in range(100))
    for t in np.linspace(0.0, 1.9, 77).tolist():
        q, v = record.view.joints_at(t), record.view.velocity_at(t)
        assert q is not None
        assert v is not None
        assert q[0] == pytest.approx(sin(t), abs=1e-8)
        assert v[0] == pytest.approx(cos(t), abs=1e-6)


def test_long_records_are_in_chunks_and_a_window_of_them_is_enough() -> None:
    record = MeasuredRecord(1)
    record.add(Report(0.01 * k, (0.001 * k,)) for k in range(3 * CHUNK_REPORTS + 5))
    record.add([Report(0.01 * (3 * CHUNK_REPORTS) - 0.005, (7.0,))])  # into a full chunk
    seen = record.view
    assert len(seen) == 3 * CHUNK_REPORTS + 6
    assert seen.joints_at(0.01 * (3 * CHUNK_REPORTS) - 0.005) == (7.0,)
    assert seen.joints_at(0.01 * (CHUNK_REPORTS - 0.5)) == pytest.approx(
        (0.001 * (CHUNK_REPORTS - 0.5),)
    )  # from one to the next
    record.forget_before(0.01 * 2 * CHUNK_REPORTS)
    assert record.view.start == 0.01 * 2 * CHUNK_REPORTS
    assert seen.start == 0.0
    arrays = seen.arrays(4.995, 5.025)
    assert arrays.times.tolist() == pytest.approx([5.0, 5.01, 5.02])
    assert np.isnan(arrays.velocity).all()


def test_reports_that_are_too_late_are_dropped_and_counted() -> None:
    record = MeasuredRecord(1)
    record.add([Report(10.0, (1.0,))])
    later = [
        Report(10.0 - MAX_LATENESS_S, (2.0,)),
        Report(10.0 - MAX_LATENESS_S - 0.01, (3.0,)),
        Report(10.0, (4.0,)),
        Report(10.5, (5.0,)),
    ]
    assert record.add(later) == ReportCounts(received=4, late=1, duplicate=1, reordered=1)
    assert [one.joints for one in record.view] == [(2.0,), (1.0,), (5.0,)]


@pytest.mark.parametrize(
    ("report", "said"),
    [
        (Report(nan, (0.0, 0.0)), "time nan s"),
        (Report(1e9, (0.0, 0.0)), "time 1e\\+09 s"),
        (Report(0.0, (0.0,)), "1 values of joints"),
        (Report(0.0, (0.0, nan)), "joints of joint 2 in a report is nan"),
        (Report(0.0, (0.0, 0.0), (1e9, 0.0)), "velocity of joint 1"),
        (Report(0.0, (0.0, 0.0), None, (0.0, 1e300)), "effort of joint 2"),
    ],
)
def test_what_is_no_report_is_refused_and_nothing_is_added(report: Report, said: str) -> None:
    record = MeasuredRecord(JOINTS)
    with pytest.raises(IllegalValue, match=said):
        record.add([Report(0.5, (0.0, 0.0)), report])
    assert not len(record)
    assert (
        record.view.last is record.view.end is record.view.joints_at(0.5) is record.view.as_timeline(0.0, 1.0) is None
    )


def test_an_empty_record_knows_nothing() -> None:
    seen = MeasuredRecord(3).view
    assert not seen
    assert np.isnan(seen.joints_over(np.array([0.0, 1.0]))).all()
    assert seen.arrays().joints.shape == (0, 3)
    assert repr(seen) == "<MeasuredTimeline: no report>"
