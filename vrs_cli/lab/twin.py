"""Simulate what an operator sees of a real arm (a "body") that follows the robot's timeline, while disturbances act on
the arm.

Commands and the line with delays are simulated by `lab.delays`. The body is a simulated arm with the disturbances. It
follows the robot's own timeline, and its reports (measured joint positions) go back over the line. The operator sees
the last report ("frames"), extrapolated reports ("predicted"), or the copy of the timeline at the current time
("timeline").
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from math import nan
from statistics import fmean

import numpy as np
from msgspec import Struct

from vrs_cli.bodies.scenario import BlockedJoint, ClockDrift, Disturbance, EmergencyStop, Payload, Push, ServoArm
from vrs_cli.engine.position import joints_over, position_at
from vrs_cli.errors import NotAvailable
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import Joints
from vrs_cli.lab.delays import DelayCourse, Strategy, Trial
from vrs_cli.lab.methods import Extrapolated, LastFrame, Predictor
from vrs_cli.twin.divergence import DivergenceWatch
from vrs_cli.values.measured import Report

try:
    from vrs_cli.bodies.mujoco_arm import MujocoArm
except ImportError:  # raised if the optional package mujoco is not installed
    MujocoArm = None  # type: ignore[assignment,misc]

RATE = 25.0  # samples per second, so that the time between two samples is exactly five control steps of a body
BEGINS = 0.4  # the disturbance begins after this fraction of the trial
MISLED = 1.0  # [deg] if the displayed timeline has a larger error, the operator should have been warned
EVERY = 3  # only every third report is shown as a frame: about 40 per second
SCENARIOS: dict[str, tuple[Disturbance, ...]] = {  # the disturbances of each scenario, without their start times
    "healthy": (),
    "push": (Push(lasting=0.5, force=(0.0, 150.0, 0.0)),),
    "payload": (Payload(mass=2.0),),
    "blocked": (BlockedJoint(joint=1),),
    "stop": (EmergencyStop(),),
    "drift": (ClockDrift(jump=0.1, rate=0.002),),
}


class TwinTrial(Struct, frozen=True):
    """The description of one trial. `trial`: the commands and the delays; `disturbances`: what disturbs the body, at
    times of the robot's clock."""

    trial: Trial
    disturbances: tuple[Disturbance, ...]


class TwinCurves(Struct, frozen=True):
    """The error of the joint with the largest error [deg], at each of the `times` [s]. `frames`, `predicted`,
    `timeline`: the error of each display, compared with the body; `tracking`: the error of the body, compared with the
    robot's own timeline; `flagged`: whether the operator's timeline was wrong because of a command that had not arrived
    there yet."""

    times: tuple[float, ...]
    frames: tuple[float, ...]
    predicted: tuple[float, ...]
    timeline: tuple[float, ...]
    tracking: tuple[float, ...]
    flagged: tuple[bool, ...]


class TwinOutcome(Struct, frozen=True):
    """The results of a trial.

    `body`: the kind of body, "MuJoCo" or "servos". `excess` [deg]: the maximum difference between the errors `timeline`
    and `tracking` at samples that are not flagged. `alarm` [s]: the time from the start of the disturbance until the
    operator gets an alarm (nan: never). `cause`: the cause stated in this alarm. `false_alarms`: the number of alarms
    before the disturbance. `misled`: the fraction of samples at which the error `timeline` was above MISLED although
    the operator had neither a flag nor an alarm.
    """

    body: str
    curves: TwinCurves
    excess: float
    alarm: float
    cause: str
    false_alarms: int
    misled: float


def twin_outcome(it: TwinTrial) -> TwinOutcome:
    """Run a trial and return its results. Equal trials give equal results. Raises NotAvailable if the available kind of
    body cannot simulate a disturbance."""
    course = DelayCourse(it.trial)
    course.run()
    true, reports, kind = _follow(course, it)
    looks, n = course.looks, it.trial.robot.joint_count
    backward = it.trial.ways.lines("reports")[1]
    # compute the sending times from the even rate of the reports, because their own time stamps may be disturbed
    period = float(looks[-1]) / len(reports)
    arrivals = [backward.arrival((k + 1) * period) for k in range(len(reports))]
    g = joints_over(course.robot.arm, course.robot.timeline, looks)

    def apart(seen: Floats) -> Floats:
        found: Floats = (np.abs(seen - true) * course.degrees).max(axis=1)
        return found

    frames, predicted = (
        apart(_view(viewer(it.trial.robot, 0.0), looks, reports, arrivals, n)) for viewer in (LastFrame, Extrapolated)
    )
    timeline, tracking = apart(course.seen[Strategy.DELTAS]), apart(g)
    flagged = course.wrong_looks()
    begin = min((one.at or 0.0 for one in it.disturbances), default=nan)
    watch = DivergenceWatch(course.robot.arm)
    watched = ((watch.take(course.robot.timeline, report), t) for report, t in zip(reports, arrivals, strict=True))
    alarms = [(alarm, t) for alarm, t in watched if alarm is not None]
    heard = [(alarm, t) for alarm, t in alarms if alarm.t >= begin]
    since = heard[0][1] if heard else np.inf
    unwarned = (timeline > MISLED) & ~flagged & (looks < since)
    curves = TwinCurves(*(tuple(row.tolist()) for row in (looks, frames, predicted, timeline, tracking, flagged)))
    return TwinOutcome(
        kind,
        curves,
        float(np.abs(timeline - tracking)[~flagged].max(initial=0.0)),
        heard[0][1] - begin if heard else nan,
        heard[0][0].cause.value if heard else "",
        len(alarms) - len(heard),
        float(unwarned.mean()),
    )


def _follow(course: DelayCourse, it: TwinTrial) -> tuple[Floats, list[Report], str]:
    """Let a body follow the robot's timeline. Return its joint positions at each sample (N, n) [rad; m], its reports,
    and its kind: "MuJoCo", or "servos" if MuJoCo is not installed or the masses of the robot are unknown."""
    arm, timeline = course.robot.arm, course.robot.timeline
    body: MujocoArm | ServoArm | None = None
    if MujocoArm is not None:
        with suppress(NotAvailable):  # raised if the masses of the robot are unknown
            body = MujocoArm(arm.model, seed=it.trial.ways.seed, disturbances=it.disturbances)
    body = body or ServoArm(arm, seed=it.trial.ways.seed, disturbances=it.disturbances)

    def setpoint(t: float) -> tuple[Joints, Joints, Joints]:
        here = position_at(arm, timeline, max(t, 0.0))
        return here.joints, here.velocity, here.acceleration

    true, reports = [], list[Report]()
    for look in course.looks.tolist():
        reports += body.advance(look, setpoint)
        true.append(body.joints)
    return np.array(true), reports, "servos" if isinstance(body, ServoArm) else "MuJoCo"


def _view(viewer: Predictor, looks: Floats, reports: Sequence[Report], arrivals: Sequence[float], n: int) -> Floats:
    """Return the joint positions that a viewer shows at each sample, (N, n) [rad; m]. Before the first report has
    arrived, the viewer gets the positions of this report. `n`: the number of joints."""
    seen, received, last = np.zeros((len(looks), n)), 0, -1.0
    viewer.receive(last, np.array(reports[0].joints))
    for k, t in enumerate(looks.tolist()):
        while received < len(reports) and arrivals[received] <= t:
            if reports[received].t > last:  # skip reports with earlier times, after the body's clock was set back
                last = reports[received].t
                viewer.receive(last, np.array(reports[received].joints))
            received += EVERY
        seen[k] = viewer.predict(t)
    return seen


class TwinRow(Struct, frozen=True):
    """The combined results of several trials.

    `mean`, `most`: mean and maximum of each error in SEEN, by its name [deg]. `flagged`: the fraction of flagged
    samples. `alarms`: how many of the `trials` had an alarm; `alarm`: the mean of their times [s]; `cause`: the most
    frequent cause. `excess` is the maximum, `misled` the mean, and `false_alarms` the sum of the fields of TwinOutcome.
    """

    body: str
    mean: dict[str, float]
    most: dict[str, float]
    flagged: float
    excess: float
    alarm: float
    alarms: int
    cause: str
    false_alarms: int
    misled: float
    trials: int


SEEN = ("frames", "predicted", "timeline", "tracking")  # names of the error curves in TwinCurves


def twin_row(outcomes: Sequence[TwinOutcome]) -> TwinRow:
    heard = [it for it in outcomes if it.cause]
    causes = [it.cause for it in heard]
    return TwinRow(
        outcomes[0].body,
        {name: fmean(fmean(getattr(it.curves, name)) for it in outcomes) for name in SEEN},
        {name: max(max(getattr(it.curves, name)) for it in outcomes) for name in SEEN},
        fmean(fmean(it.curves.flagged) for it in outcomes),
        max(it.excess for it in outcomes),
        fmean(it.alarm for it in heard) if heard else nan,
        len(heard),
        max(dict.fromkeys(causes), key=causes.count) if causes else "",
        sum(it.false_alarms for it in outcomes),
        fmean(it.misled for it in outcomes),
        len(outcomes),
    )
