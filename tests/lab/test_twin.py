"""Test the displayed body: without flags, the error is that of the body itself; disturbances raise alarms."""

from __future__ import annotations

from math import isnan

import numpy as np
import pytest
from msgspec.structs import replace

from vrs_cli.bodies.scenario import ClockDrift, Disturbance, SlippingBrake
from vrs_cli.engine.position import joints_over, position_at
from vrs_cli.errors import NotAvailable
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.lab import twin
from vrs_cli.lab.delays import DelayCourse, Strategy, Trial
from vrs_cli.lab.twin import RATE, SCENARIOS, SEEN, TwinOutcome, TwinTrial, twin_outcome, twin_row
from vrs_cli.net.delay_line import Constant, DelayWays, Gamma

USUAL = Gamma(0.2, 0.08)
AT = 8.0  # [s] when a disturbance begins


def of(
    scenario: str | tuple[Disturbance, ...] = "healthy",
    lead: float = 0.3,
    line: Gamma | Constant = USUAL,
    robot: str = "puma260",
    lasting: float = 16.0,
) -> TwinTrial:
    found = SCENARIOS[scenario] if isinstance(scenario, str) else scenario
    disturbances = tuple(replace(one, at=AT) for one in found)
    trial = Trial(load_robot(robot), DelayWays(line, line, 5), lead, "ABORT", lasting, RATE)
    return TwinTrial(trial, disturbances)


def test_what_is_seen_is_wrong_by_the_error_of_the_body_alone_where_nothing_is_flagged() -> None:
    found = twin_outcome(of())
    flagged = np.array(found.curves.flagged)
    assert 0.02 < flagged.mean() < 0.5
    assert found.excess == 0.0
    timeline, tracking = np.array(found.curves.timeline), np.array(found.curves.tracking)
    assert (timeline[~flagged] == tracking[~flagged]).all()
    assert (timeline[flagged] - tracking[flagged]).max() > 1.0, "and a lot is wrong where something is"
    assert 0.01 < tracking.mean() < 0.3


def test_without_flags_the_excess_would_be_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(DelayCourse, "wrong_looks", lambda self: np.zeros(len(self.looks), dtype=bool))
    assert twin_outcome(of()).excess > 1.0


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_disturbances_are_told_and_nothing_else(scenario: str) -> None:
    found = twin_outcome(of(scenario, 0.6, lasting=20.0))
    assert found.excess == 0.0
    assert found.false_alarms == 0
    if scenario in ("healthy", "drift"):  # servos follow their own clock, and stamp reports by it
        assert isnan(found.alarm)
    else:
        assert 0.1 < found.alarm < 4.0
        assert found.cause
    assert (found.misled > 0.1) is (scenario == "drift")


def test_frames_are_the_body_a_delay_ago() -> None:
    it = of(line=Constant(0.2))
    course = DelayCourse(it.trial)
    course.run()
    true, reports, kind = twin._follow(course, it)
    assert kind == "servos"
    assert len(reports) == round(course.looks[-1] / 0.008)
    curves = twin_outcome(it).curves
    apart = np.degrees(np.abs(true[6:] - true[:-6]).max(axis=1))  # of 0.2 s and up to a report more
    nearer = np.degrees(np.abs(true[5:] - true[:-5]).max(axis=1))
    frames = np.array(curves.frames)
    assert nearer.mean() - 0.05 < frames[5:].mean() < apart.mean() + 0.05
    assert np.mean(curves.predicted) < frames.mean()
    assert np.mean(curves.timeline) < np.mean(curves.predicted)


def test_a_clock_that_is_put_back_is_survived() -> None:
    found = twin_outcome(of((ClockDrift(jump=-0.5),)))
    assert found.excess == 0.0
    assert np.isfinite(found.curves.predicted).all()


def test_a_brake_that_slips_needs_mujoco(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(twin, "MujocoArm", None)
    with pytest.raises(NotAvailable, match="needs an arm of MuJoCo"):
        twin_outcome(of((SlippingBrake(joint=2, torque=1.0),), robot="puma560"))


def test_an_arm_of_mujoco_where_masses_are_known() -> None:
    pytest.importorskip("mujoco")
    found = twin_outcome(of("stop", 0.6, robot="puma560", lasting=12.0))
    assert (found.body, found.excess, found.cause) == ("MuJoCo", 0.0, "stopped")
    healthy = np.array(found.curves.tracking)[: int(AT * RATE)]
    assert healthy.mean() < 0.05


def test_without_a_disturbance_the_servos_stay_near_the_timeline() -> None:
    it = of("healthy")
    course = DelayCourse(it.trial)
    course.run()
    arm, timeline = course.robot.arm, course.robot.timeline

    def setpoint(t: float) -> tuple[Joints, Joints, Joints]:
        here = position_at(arm, timeline, t)
        return here.joints, here.velocity, here.acceleration

    body = twin.ServoArm(arm, seed=1)
    reports = body.advance(10.0, setpoint)
    g = joints_over(arm, timeline, np.array([report.t for report in reports]))
    assert 1e-5 < np.abs(np.array([report.joints for report in reports]) - g).max() < 0.01
    assert course.seen[Strategy.DELTAS].shape == (400, 6)


def test_trials_together_are_means_and_the_greatest() -> None:
    one, other = twin_outcome(of("blocked")), twin_outcome(of("healthy"))
    row = twin_row([one, other])
    assert (row.trials, row.alarms, row.cause, row.alarm) == (2, 1, one.cause, one.alarm)
    assert {*row.mean} == {*SEEN}
    for name in SEEN:
        columns = [np.array(getattr(it.curves, name)) for it in (one, other)]
        assert row.mean[name] == pytest.approx(np.mean(columns))
        assert row.most[name] == np.max(columns)
    assert isinstance(one, TwinOutcome)
    assert row.misled == pytest.approx((one.misled + other.misled) / 2)
