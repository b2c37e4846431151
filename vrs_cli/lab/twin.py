"""Try what an operator sees of a real arm: a body follows the robot's timeline, and disturbances befall it.

Commands, line and mirror are those of `lab.delays`. The body, which is where the robot really is, follows the robot's
own timeline; its reports go back over the line. The operator sees it by its last report (frames), by reports that are
extrapolated (predicted), or by the timeline at the present (timeline).
"""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from statistics import fmean

import numpy as np
from msgspec import Struct

from vrs_cli.bodies.scenario import BlockedJoint, ClockDrift, Disturbance, EmergencyStop, Payload, Push, ServoArm
from vrs_cli.engine.position import joints_over, position_at
from vrs_cli.errors import NotAvailable
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.lab.delays import DelayCourse, Strategy, Trial
from vrs_cli.lab.methods import Extrapolated, LastFrame, Predictor
from vrs_cli.twin.divergence import DivergenceWatch
from vrs_cli.values.measured import DivergenceAlarm, Report

try:
    from vrs_cli.bodies.mujoco_arm import MujocoArm
except ImportError:  # mujoco is an extra
    MujocoArm = None  # type: ignore[assignment,misc]

RATE = 25.0  # looks a second: 40 ms are five steps of each body
BEGINS = 0.4  # of the trial, when the disturbance begins
MISLED = 1.0  # [deg] that an operator should know of
EVERY = 3  # a report in so many goes over the line as a frame: about 40 a second
SCENARIOS: dict[str, tuple[Disturbance, ...]] = {  # without their begins
    "healthy": (),
    "push": (Push(lasting=0.5, force=(0.0, 150.0, 0.0)),),
    "payload": (Payload(mass=2.0),),
    "blocked": (BlockedJoint(joint=1),),
    "stop": (EmergencyStop(),),
    "drift": (ClockDrift(jump=0.1, rate=0.002),),
}


class TwinTrial(Struct, frozen=True):
    """One trial: commands over a line, and what befalls the body, by the robot's clock."""

    trial: Trial
    disturbances: tuple[Disturbance, ...]


class TwinCurves(Struct, frozen=True):
    """The distances of the farthest joint [deg] at `times` [s]: of what is seen from where the body is, and of the body
    from the robot's own timeline (`tracking`). `flagged`: something unknown had made the timeline wrong.
    """

    times: tuple[float, ...]
    frames: tuple[float, ...]
    predicted: tuple[float, ...]
    timeline: tuple[float, ...]
    tracking: tuple[float, ...]
    flagged: tuple[bool, ...]


class TwinOutcome(Struct, frozen=True):
    """The results of a trial.

    `body`: the kind of body. `excess` [deg]: the greatest difference, at looks that are not flagged, between the error
    of timeline and that of tracking. `alarm` [s]: from the begin of the disturbance until the operator hears of it
    (nan: never); `cause`: what the alarm says. `false_alarms`: those before. `misled`: the share of looks at which
    timeline is off by more than MISLED, nothing is flagged, and no alarm was heard.
    """

    body: str
    curves: TwinCurves
    excess: float
    alarm: float
    cause: str
    false_alarms: int
    misled: float


def twin_outcome(it: TwinTrial) -> TwinOutcome:
    """Run a trial. Equal trials give equal results. Raises NotAvailable for what a body cannot suffer."""
    course = DelayCourse(it.trial)
    course.run()
    true, reports, kind = _followed(course, it)
    looks, n = course.looks, it.trial.robot.joint_count
    backward = it.trial.ways.lines("reports")[1]
    period = float(looks[-1]) / len(reports)  # its clock may be wrong, its rate is even
    arrivals = [backward.arrival((k + 1) * period) for k in range(len(reports))]
    g = joints_over(course.robot.arm, course.robot.timeline, looks)
    scale = np.degrees([1.0 if kind is JointKind.REVOLUTE else 0.0 for kind in it.trial.robot.units.kinds])

    def apart(seen: Floats) -> Floats:
        found: Floats = (np.abs(seen - true) * scale).max(axis=1)
        return found

    frames, predicted = (
        apart(_shown(viewer(it.trial.robot, 0.0), looks, reports, arrivals, n)) for viewer in (LastFrame, Extrapolated)
    )
    timeline, tracking = apart(course.seen[Strategy.DELTAS]), apart(g)
    flagged = course.flagged()
    begin = min((one.at or 0.0 for one in it.disturbances), default=nan)
    alarms = [(alarm, arrivals[k]) for k, alarm in _alarms(course, reports)]
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


def _followed(course: DelayCourse, it: TwinTrial) -> tuple[Floats, list[Report], str]:
    """Let a body follow the robot's timeline. Return its joints at each look (N, n), its reports, and its kind."""
    arm, timeline = course.robot.arm, course.robot.timeline
    body, kind = _body(arm, it)

    def setpoint(t: float) -> tuple[Joints, Joints, Joints]:
        here = position_at(arm, timeline, max(t, 0.0))
        return here.joints, here.velocity, here.acceleration

    true, reports = [], list[Report]()
    for look in course.looks.tolist():
        reports += body.advance(look, setpoint)
        true.append(body.joints)
    return np.array(true), reports, kind


def _body(arm: RobotArm, it: TwinTrial) -> tuple[MujocoArm | ServoArm, str]:
    """Return an arm of MuJoCo; a servo arm without that package, and for a robot whose masses nobody says."""
    seed = it.trial.ways.seed
    if MujocoArm is not None:
        try:
            return MujocoArm(arm.model, seed=seed, disturbances=it.disturbances), "MuJoCo"
        except NotAvailable:
            pass
    return ServoArm(arm, seed=seed, disturbances=it.disturbances), "servos"


def _shown(viewer: Predictor, looks: Floats, reports: Sequence[Report], arrivals: Sequence[float], n: int) -> Floats:
    """Return what a viewer shows at each look, (N, n): before the first report has come, where the body began."""
    seen, received, last = np.zeros((len(looks), n)), 0, -1.0
    viewer.receive(last, np.array(reports[0].joints))
    for k, t in enumerate(looks.tolist()):
        while received < len(reports) and arrivals[received] <= t:
            if reports[received].t > last:  # its clock may have been put back
                last = reports[received].t
                viewer.receive(last, np.array(reports[received].joints))
            received += EVERY
        seen[k] = viewer.predict(t)
    return seen


def _alarms(course: DelayCourse, reports: Sequence[Report]) -> list[tuple[int, DivergenceAlarm]]:
    """Return the alarms that the server raises, with the numbers of the reports that raise them."""
    watch = DivergenceWatch(course.robot.arm)
    alarms = ((k, watch.take(course.robot.timeline, report)) for k, report in enumerate(reports))
    return [(k, alarm) for k, alarm in alarms if alarm is not None]


class TwinRow(Struct, frozen=True):
    """The means over several trials: of errors [deg] by name (frames, predicted, timeline, tracking), and their
    greatest; for the rest see TwinOutcome. `alarm`: the mean of those that were heard, of `alarms` of `trials`.
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


SEEN = ("frames", "predicted", "timeline", "tracking")


def twin_row(outcomes: Sequence[TwinOutcome]) -> TwinRow:
    """Return what several trials have in common."""
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
