"""The watch of a body: its threshold, what it learns from, when it starts again."""

from __future__ import annotations

from math import exp

import numpy as np
import pytest

from tests.laws.divergence import Course
from tests.twin.servo_arm import STEP
from vrs_cli.engine.engine import Engine
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.twin.divergence import BLOCK, LOAD_WINDOW, DivergenceWatch, exponent, load_threshold, threshold
from vrs_cli.values.commands import JointTarget, Move
from vrs_cli.values.measured import BodyMode, DivergenceCause, Report


@pytest.mark.parametrize(("allowance", "freedoms"), [(9.0, 1), (14.0, 3), (2.0, 1), (4.0, 3)])
def test_the_exponent_solves_its_equation(allowance: float, freedoms: int) -> None:
    root = exponent(allowance, freedoms)
    assert 0.0 < root < 0.5
    assert (1.0 - 2.0 * root) ** (-0.5 * freedoms) * exp(-root * allowance) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(("allowance", "freedoms"), [(2.0, 1), (4.0, 3)])
def test_false_alarms_are_no_more_frequent_than_stated(allowance: float, freedoms: int) -> None:
    """With a rate that is high enough to be counted: 40 hours of normal noise."""
    limit, random = threshold(allowance, freedoms, an_hour=20.0), np.random.default_rng(1)
    steps = round(40.0 * 3600.0 / BLOCK)
    total, alarms = 0.0, 0
    for x in (random.chisquare(freedoms, steps) - allowance).tolist():
        total = max(total + x, 0.0)
        if total > limit:
            total, alarms = 0.0, alarms + 1
    assert 20 < alarms <= 40 * 20


def test_false_alarms_of_a_load_are_no_more_frequent_than_stated() -> None:
    """Normal noise of six joints, whose loads change from block to block, for 10 hours."""
    limit, random = load_threshold(6, an_hour=20.0), np.random.default_rng(1)
    loads, errors = random.normal(0.0, 1.0, (2, round(10.0 * 3600.0 / BLOCK), 6))
    rows = len(loads) - LOAD_WINDOW
    products, squares, over = np.zeros((rows, 6)), np.zeros((rows, 6)), np.zeros(rows, dtype=bool)
    for back in range(LOAD_WINDOW):
        load, error = loads[back : back + rows], errors[back : back + rows]
        products, squares = products + load * error, squares + load**2
        over |= (products**2 / squares).sum(axis=1) > limit
    assert 0 < over.sum() <= 10 * 20


def test_a_joint_that_alone_is_to_move_and_does_not_is_blocked() -> None:
    """In its first motion: nothing was learned of healthy errors so far."""
    engine, watch = standing()
    ready, random = np.array(engine.position().joints), np.random.default_rng(3)
    engine.begin(Move(JointTarget((ready[0] + 0.9, *ready[1:].tolist())), straight=False), program=False)
    alarms = []
    for t in np.arange(0.0, 1.0, 0.01).tolist():
        row = tuple((ready + random.normal(0.0, 3e-5, len(ready))).tolist())
        alarms.append(watch.take(engine.timeline, Report(t, row)))
    (alarm,) = filter(None, alarms)
    assert alarm.cause is DivergenceCause.BLOCKED
    assert alarm.detail == "joint 1 stands still at 0.0 deg, and it alone is to move"


def standing() -> tuple[Engine, DivergenceWatch]:
    engine = Engine(load_robot("puma560"))
    return engine, DivergenceWatch(engine.arm)


def reports(
    engine: Engine, begin: float, count: int, off: float = 0.0, mode: BodyMode = BodyMode.FOLLOWS
) -> list[Report]:
    random, here = np.random.default_rng(7), np.array(engine.position().joints)
    rows = (here + random.normal(0.0, 1e-4, len(here)) + off * (np.arange(len(here)) == 2) for _ in range(count))
    return [Report(begin + STEP * k, tuple(row.tolist()), mode=mode) for k, row in enumerate(rows)]


def test_it_names_joint_size_and_onset() -> None:
    engine, watch = standing()
    assert not [a for one in reports(engine, 0.0, 1000) if (a := watch.take(engine.timeline, one))]
    (alarm,) = [a for one in reports(engine, 10.0, 100, 0.05) if (a := watch.take(engine.timeline, one))]
    assert alarm.joint == 3
    assert alarm.size == pytest.approx(0.05, abs=1e-3)
    assert alarm.since == pytest.approx(10.0, abs=2 * BLOCK)
    assert alarm.t <= 10.4
    assert 0.01 < alarm.tool < 0.05


def test_a_joint_that_dry_friction_holds_beside_its_set_point_is_healthy() -> None:
    engine, watch = standing()
    rows = [*reports(engine, 0.0, 6000), *reports(engine, 60.0, 300, 0.0045)]
    assert not [alarm for one in rows if (alarm := watch.take(engine.timeline, one))]


def test_the_body_says_that_it_has_stopped() -> None:
    course = Course(2)
    course.healthy(5.0)
    engine, watch = course.engine, course.watch
    stands = course.body.report(engine.timeline, course.t + STEP).joints
    found = []
    for k in range(2, 500):
        engine.clock.set(course.t + k * STEP)
        course.commands.until(course.t + k * STEP)
        report = Report(course.t + k * STEP, stands, mode=BodyMode.STOPPED)
        if (alarm := watch.take(engine.timeline, report)) is not None:
            found.append(alarm.cause)
    assert found == [DivergenceCause.STOPPED]


def test_seconds_of_an_alarm_are_never_learned_from() -> None:
    engine, watch = standing()
    for one in reports(engine, 0.0, 1000):
        watch.take(engine.timeline, one)
    learned, noise = watch.healthy.learned, watch.healthy.noise.copy()
    assert learned > 0
    for one in reports(engine, 10.0, 3000, 0.05):
        watch.take(engine.timeline, one)
    assert watch.diverged
    assert watch.healthy.learned <= learned + 4 * round(1.0 / BLOCK)  # seconds before it that had waited
    np.testing.assert_array_less(watch.healthy.noise, noise * 1.5)


def test_one_alarm_until_it_has_recovered() -> None:
    engine, watch = standing()
    alarms = []
    for begin, off in ((0.0, 0.0), (10.0, 0.05), (20.0, 0.0), (30.0, -0.05)):
        alarms += [a for one in reports(engine, begin, 1000, off) if (a := watch.take(engine.timeline, one))]
    assert [round(alarm.since) for alarm in alarms] == [10, 30]


def test_a_body_that_holds_by_an_order_is_not_compared() -> None:
    engine, watch = standing()
    rows = reports(engine, 0.0, 500, 0.5, BodyMode.HOLDS)
    assert not [a for one in rows if (a := watch.take(engine.timeline, one))]


def test_a_body_that_holds_by_itself_raises_an_alarm_once_the_timeline_leaves_it() -> None:
    engine, watch = standing()
    near = reports(engine, 0.0, 500, 0.0, BodyMode.HOLDS)
    assert not [a for one in near if (a := watch.take(engine.timeline, one, ordered=False))]
    rows = reports(engine, 5.0, 500, 0.5, BodyMode.HOLDS)
    (alarm,) = [a for one in rows if (a := watch.take(engine.timeline, one, ordered=False))]
    assert alarm.cause is DivergenceCause.STOPPED
    assert alarm.detail == "the body says that it holds, and nobody ordered that"


def test_older_and_frequent_reports_are_passed_over() -> None:
    engine, watch = standing()
    rows = reports(engine, 0.0, 300)
    assert not [a for one in (*rows, *rows, rows[0]) if (a := watch.take(engine.timeline, one))]
