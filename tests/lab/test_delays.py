"""Test the experiment with delays: flags equal both logs, nothing else is wrong, and figures are as expected."""

from __future__ import annotations

from math import radians
from random import Random

import pytest
from msgspec.structs import astuple

from tests.examples import some
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.lab.delays import (
    Change,
    DelayCourse,
    Error,
    Strategy,
    Trial,
    TrialOutcome,
    outcome_of,
    together,
    windows_of_logs,
)
from vrs_cli.net.delay_line import Bursty, Constant, Delays, DelayWays, Gamma, Lossy, Normal, Trace
from vrs_cli.net.preview import Flags, FlagWindow

NOTHING = Error(0.0, 0.0, 0.0, 0.0)
USUAL = Gamma(0.2, 0.08)
KINDS = (
    Constant(0.2),
    Normal(0.2, 0.1),
    USUAL,
    Bursty(0.05, 0.6, 3.0, 0.5),
    Trace((0.1, 0.5, 0.2)),
    Lossy(USUAL, 0.1),
)


def tried(
    lead: float, policy: str = "ABORT", forward: Delays = USUAL, backward: Delays = USUAL, robot: str = "puma560"
) -> TrialOutcome:
    return outcome_of(Trial(load_robot(robot), DelayWays(forward, backward, 7), lead, policy, seconds=40.0, rate=25.0))


@pytest.mark.parametrize("policy", ["ABORT", "POSTPONE"])
@pytest.mark.parametrize("kind", KINDS[: some(24)], ids=lambda kind: type(kind).__name__)
def test_nothing_is_wrong_where_nothing_is_flagged(kind: Delays, policy: str) -> None:
    found = tried(0.3, policy, kind, kind)
    assert found.agreed
    assert found.outside == NOTHING
    assert found.errors[Strategy.DELTAS].most_degrees > 1.0, "and a lot is wrong where something is"
    assert 0.0 < found.flagged < 0.3


@pytest.mark.parametrize("robot", ["cobra600", "ur5e"])
def test_other_robots_too(robot: str) -> None:
    found = tried(0.3, "POSTPONE", robot=robot)
    assert found.agreed
    assert found.outside == NOTHING
    assert found.errors[Strategy.DELTAS].most_mm > 1.0


def test_without_flags_what_is_wrong_would_be_found() -> None:
    course = DelayCourse(Trial(load_robot("puma560"), DelayWays(USUAL, USUAL, 7), 0.3, "POSTPONE", 40.0, 25.0))
    course.run()
    right, course.flags = course.flags, Flags()
    for window in right.windows[1:]:
        course.flags.add_change(window.begin, window.begin, window.end)
    found = course.outcome()
    assert not found.agreed
    assert found.outside.most_degrees > 0.0


def test_who_leads_by_more_than_the_delays_sees_all_as_it_is() -> None:
    found = tried(0.5, forward=Constant(0.2), backward=Constant(0.25))
    assert (found.aborted, found.flagged) == (0, 0.0)
    assert found.round_trip == (pytest.approx(0.45), pytest.approx(0.45))
    assert found.errors[Strategy.DELTAS] == found.errors[Strategy.PREVIEW] == NOTHING
    assert found.errors[Strategy.PREDICTED].most_degrees < 1e-9, "it reckons its times in another way"
    assert found.errors[Strategy.FRAMES].degrees > 1.0


def test_who_leads_by_the_way_there_once_more_sees_ahead_what_will_be() -> None:
    found = tried(0.7, forward=Constant(0.2), backward=Constant(0.25))
    assert found.errors[Strategy.AHEAD] == NOTHING
    assert found.unconfirmed == 0.0


def test_who_leads_by_more_than_the_way_there_is_in_time_and_previews_it_all() -> None:
    found = tried(0.3, forward=Constant(0.2), backward=Constant(0.2))
    assert found.aborted == 0
    assert found.flagged > 0.0
    assert found.unconfirmed > 0.0
    assert found.errors[Strategy.PREVIEW] == NOTHING, "it plans what the robot will"
    assert found.errors[Strategy.DELTAS].degrees > 0.0
    assert found.errors[Strategy.AHEAD].degrees > found.errors[Strategy.DELTAS].degrees


def test_who_does_not_lead_is_always_late() -> None:
    aborted, postponed = tried(0.0, "ABORT"), tried(0.0, "POSTPONE")
    assert aborted.aborted == aborted.commands == postponed.postponed
    assert aborted.errors[Strategy.FRAMES] == NOTHING, "it never moved"
    assert postponed.errors[Strategy.FRAMES].degrees > 1.0


def test_without_delays_all_is_seen_as_it_is() -> None:
    found = tried(0.0, forward=Constant(0.0), backward=Constant(0.0))
    assert (found.aborted, found.flagged, found.unconfirmed) == (0, 0.0, 0.0)
    assert all(error == NOTHING for error in found.errors.values())


def test_nothing_is_seen_of_a_robot_that_is_an_hour_away() -> None:
    found = tried(0.2, "POSTPONE", Constant(3600.0), Constant(3600.0))
    assert found.errors[Strategy.FRAMES] == found.errors[Strategy.PREDICTED] == NOTHING, "none has come"
    assert found.agreed
    assert found.outside == NOTHING


def test_the_same_trial_comes_out_the_same() -> None:
    assert tried(0.3) == tried(0.3)


def test_the_usual_table_is_what_a_prototype_found() -> None:
    """Shares of commands aborted 43, 1.3 and 0 %, flagged 8.9, 4.1 and 0.3 %, at leads of 0.2, 0.4 and 0.6 s."""
    robot = load_robot("puma560")
    for lead, aborted, flagged in ((0.2, 0.43, 0.089), (0.4, 0.013, 0.041), (0.6, 0.0, 0.003)):
        trials = (Trial(robot, DelayWays(USUAL, USUAL, seed), lead, "ABORT", 100.0, 25.0) for seed in range(1, 4))
        found = together([outcome_of(trial) for trial in trials])
        assert found.aborted / found.commands == pytest.approx(aborted, abs=0.05)
        assert found.flagged == pytest.approx(flagged, abs=0.015)


# --- the flags, another way --------------------------------------------------------------------------------------


def test_logs_and_flags_say_the_same_of_any_events() -> None:
    random = Random(1)
    for _ in range(some(400)):
        flags, changes, arrivals, applied, arrived = Flags(), [], [], 0.0, 0.0
        for _ in range(random.randint(0, 8)):
            applied += random.choice((0.0, 0.25, 1.0))
            arrived = max(arrived, applied + random.choice((0.0, 0.5, 2.0)))
            cut = applied + random.choice((0.0, 0.5, 1.0, 3.0))
            changes.append(Change(applied, cut))
            arrivals.append(arrived)
            flags.add_change(cut, applied, arrived)
        assert windows_of_logs(changes, arrivals) == flags.windows


def test_windows_of_logs() -> None:
    changes = [Change(1.0, 1.5), Change(1.25, 4.0)]
    assert windows_of_logs(changes, [2.0, 2.0]) == (FlagWindow(1.5, 2.0),)
    assert windows_of_logs([], []) == ()


def test_outcomes_together_are_sums_means_and_the_greatest() -> None:
    one, other = tried(0.2), tried(0.4)
    both = together([one, other])
    assert both.commands == one.commands + other.commands
    assert both.flagged == pytest.approx((one.flagged + other.flagged) / 2)
    errors = [it.errors[Strategy.AHEAD] for it in (one, other, both)]
    assert errors[2].degrees == pytest.approx((errors[0].degrees + errors[1].degrees) / 2)
    assert errors[2].most_mm == max(errors[0].most_mm, errors[1].most_mm)


# --- every figure, as it was recorded ------------------------------------------------------------------------------

RECORDED = {  # counts; shares, round trips [s]; errors by strategy: mean and most [deg], mean and most [mm]
    "ABORT": (
        (16, 1, 0),
        (0.17, 0.42, 0.38542, 0.637515),
        (25.627315, 135.40097, 40.959056, 168.306416),
        (15.429977, 135.40097, 22.490806, 168.306416),
        (5.928809, 134.341794, 6.971049, 152.071999),
        (18.941381, 135.423145, 26.924223, 168.315572),
        (2.123937, 76.162922, 4.085795, 145.756595),
    ),
    "POSTPONE": (
        (16, 0, 1),
        (0.193333, 0.42, 0.38542, 0.637515),
        (27.592898, 135.40097, 40.743772, 153.302854),
        (17.405597, 135.40097, 24.370846, 153.302854),
        (6.835254, 134.341794, 8.564114, 152.071999),
        (21.370031, 135.423145, 29.310393, 155.294245),
        (0.019996, 1.642177, 0.038768, 3.193735),
    ),
}


@pytest.mark.parametrize("policy", ["ABORT", "POSTPONE"])
def test_the_figures_of_a_short_trial_are_those_that_were_recorded(policy: str) -> None:
    ways = DelayWays(USUAL, Normal(0.2, 0.1), 7)
    found = outcome_of(Trial(load_robot("cobra600"), ways, 0.3, policy, seconds=12.0, rate=25.0))
    counts = found.commands, found.aborted, found.postponed
    shares = found.flagged, found.unconfirmed, *found.round_trip
    errors = [astuple(found.errors[strategy]) for strategy in Strategy]
    known, *rows = RECORDED[policy]
    assert counts == known
    assert [shares, *errors] == [pytest.approx(row, abs=2e-6) for row in rows]


def test_the_looks_of_a_trial_begin_with_it_and_errors_are_in_degrees_and_millimetres() -> None:
    course = DelayCourse(Trial(load_robot("cobra600"), DelayWays(USUAL, USUAL, 1), 0.3, "ABORT", seconds=2.0, rate=4.0))
    assert course.looks.tolist() == [k / 4.0 for k in range(8)]
    was = course.with_tool(course._joints(course.robot.timeline, course.looks))
    seen = was.copy()
    seen[:, 2] += 0.5  # it slides: no angle
    seen[0, 1] += radians(8.0)
    seen[:, -1] += 0.016
    assert astuple(course.error(seen, was)) == pytest.approx((1.0, 8.0, 16.0, 16.0))
    assert course.error(was[:0], was[:0]) == NOTHING
