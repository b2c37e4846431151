"""Try viewers and controllers on a robot with a delayed connection, in virtual time.

A controller makes the robot follow a moving goal: it sends set points, which arrive after the forward delay D_f, and
the robot follows them within its limits. The robot sends frames with its joint positions, and each change of its
timeline; both arrive after the backward delay D_b. A viewer estimates the robot's current position from the frames.
"""

from __future__ import annotations

from bisect import bisect_right
from functools import partial
from math import pi, tau
from random import Random

import numpy as np
from msgspec import Struct

from vrs_cli.engine.position import joints_at, joints_over
from vrs_cli.errors import TooLate
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.lab.delays import PLACES, Simulation, random_place
from vrs_cli.lab.methods import Guarded, Predictor, RemoteController
from vrs_cli.net.delay_line import DelayWays
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import JointTarget, Move, Stamp

LEAD = 0.4  # [s] in scenario "moves", each motion is commanded this long before it starts
BETWEEN = 2.0  # [s] time between two motions in "moves", and between two goals in "steps"
SWING = 0.12  # maximum amplitude of the goal in "waves", as a fraction of a joint's range
SPEED = 0.3  # maximum speed of the goal in "waves", as a fraction of a joint's maximum velocity
PERIODS = (3.0, 7.0)  # [s] range of the random periods of the goal in "waves"
RUN, PAUSE = (0.8, 2.5), (0.5, 1.5)  # [s] ranges of the random durations of motions and pauses in "stops"

SCENARIOS = {
    "moves": f"motions to random places, each commanded {LEAD:g} s before it begins",
    "steps": f"a goal that jumps to a random place every {BETWEEN:g} s",
    "waves": "a goal that swings, each joint with two frequencies of its own",
    "stops": "the same goal, which stops at once now and then",
}
FOLLOWED = tuple(name for name in SCENARIOS if name != "moves")  # scenarios in which a controller follows a goal


class MethodTrial(Struct, frozen=True):
    """The description of one trial. `ways`: the delays of the line; `scenario`: a key of SCENARIOS; `controller`,
    `viewers`: names of built-in ones, or `module:Class`; `seconds`: the duration; `rate`: the number of set points,
    frames and samples per second."""

    robot: RobotModel
    ways: DelayWays
    scenario: str
    controller: str
    viewers: tuple[str, ...]
    seconds: float
    rate: float


class ViewerScore(Struct, frozen=True):
    """The error of a viewer: the distance between the displayed and the true robot at the same time.

    `mean`, `p95`, `most`: mean, 95th percentile and maximum for the joint with the largest error [deg]. `mean_mm`: mean
    for the tool [mm]. `jump`: the largest difference between the displayed and the true change of a joint from one
    sample to the next [deg]. `call_time`: the mean duration of a call of the viewer [s].
    """

    mean: float
    p95: float
    most: float
    mean_mm: float
    jump: float
    call_time: float = 0.0


class ControllerScore(Struct, frozen=True):
    """The error of a controller: the distance between the robot and the goal at the same time.

    `rms`, `most`: root mean square and maximum for the joint with the largest error [deg]. `lag`: the time shift
    between goal and robot for which the error is smallest [s]. `effort`: the root mean square of the joint
    accelerations, as a fraction of their limits. `held`: the fraction of set points that were outside the joint range.
    `call_time`: the mean duration of a call of the controller [s].
    """

    rms: float
    most: float
    lag: float
    effort: float
    held: float
    call_time: float = 0.0


class MethodOutcome(Struct, frozen=True):
    """The results of a trial. `viewers`: the score of each viewer, by name; `controller`: the score of the controller,
    None in the scenario "moves"."""

    viewers: dict[str, ViewerScore]
    controller: ControllerScore | None


def method_outcome(trial: MethodTrial) -> MethodOutcome:
    """Run a trial and return its results. Equal trials give equal results, except for `call_time`. Raises
    MethodError."""
    bench = _Bench(trial)
    bench.run()
    return MethodOutcome(bench.viewer_scores(), bench.controller_score())


# --- goals -----------------------------------------------------------------------------------------------------------


def goals(scenario: str, robot: RobotModel, times: Floats, random: Random) -> Floats:
    """Return the goal joint positions of a scenario at each time, (N, n) [rad; m]. Equal seeds of `random` give equal
    goals."""
    if scenario == "steps":
        places = np.array([random_place(robot, random) for _ in range(PLACES)])
        jumping: Floats = places[(times / BETWEEN).astype(int) % PLACES]
        return jumping
    if scenario == "stops":
        # replace each time by how long the goal has moved until then [s], so that the goal below pauses
        borders, moved = [0.0], [0.0]
        while borders[-1] < times[-1]:
            run, pause = random.uniform(*RUN), random.uniform(*PAUSE)
            borders += [borders[-1] + run, borders[-1] + run + pause]
            moved += [moved[-1] + run, moved[-1] + run]
        times = np.interp(times, borders, moved)
    lower, upper, fastest = (np.array(row) for row in (robot.lower, robot.upper, robot.max_velocity))
    swing = SWING * (upper - lower)
    middle = np.clip(robot.poses["ready"], lower + swing, upper - swing)
    found: Floats = np.tile(middle, (len(times), 1))
    for _ in range(2):
        rates = np.array([tau / random.uniform(*PERIODS) for _ in middle])
        phases = np.array([random.uniform(-pi, pi) for _ in middle])
        size = 0.5 * np.minimum(swing, SPEED * fastest / rates)
        # subtract the phase term, so that the goal starts at the middle
        found += size * (np.sin(np.outer(times, rates) + phases) - np.sin(phases))
    return np.clip(found, lower, upper)


# --- the simulation --------------------------------------------------------------------------------------------------


class _Bench(Simulation):
    """A simulation of one trial: the robot, its controller, its viewers, and the line with delays between them."""

    def __init__(self, trial: MethodTrial) -> None:
        super().__init__(trial.robot, trial.ways, trial.seconds, trial.rate)
        self.trial = trial
        self._steering = Steering(self.robot)
        # the timelines that the viewers have received, each with its arrival time [s]
        self._known: list[tuple[float, Timeline]] = [(0.0, self.robot.timeline)]
        self.random = Random(f"{trial.ways.seed} {trial.scenario}")
        self.follows = trial.scenario in FOLLOWED
        self.goals = goals(trial.scenario, trial.robot, self.looks, self.random) if self.follows else None
        self._controller = Guarded(trial.controller, RemoteController, trial.robot, self.delay, trial.rate)

    def run(self) -> None:
        if self.follows:
            for k, t in enumerate(self.looks.tolist()):
                self._at(t, partial(self._command, k))
        else:
            places = [random_place(self.trial.robot, self.random) for _ in range(PLACES)]
            for k, t in enumerate(np.arange(0.5, self.trial.seconds, BETWEEN).tolist()):
                move = Move(JointTarget(places[k % PLACES]), False, stamp=Stamp(t + LEAD), text="MOVE")
                self._at(self._forward.arrival(t), partial(self._move, move))
        self._run_events(until=self.trial.seconds)
        self._now = self.trial.seconds

    def _move(self, move: Move) -> None:
        clock = self.robot.clock
        clock.advance(clock.reached)
        try:
            self.robot.begin(move, program=False)
        except TooLate:
            return
        self._tell()

    def _command(self, k: int) -> None:
        """Let the controller send set point number k, and let the robot send a frame with its joint positions."""
        assert self.goals is not None
        t = float(self.looks[k])
        joints = np.array(joints_at(self.robot.arm, self.robot.timeline, t))
        self._at(float(self.arrived[k]), lambda: self._controller.receive(t, joints))
        setpoint = tuple(self._controller.command(t, self.goals[k]).tolist())
        self._at(self._forward.arrival(t), lambda: self._follow(setpoint, t))

    def _follow(self, setpoint: Joints, t: float) -> None:
        self._steering.to(setpoint, t)
        self._tell()

    def _tell(self) -> None:
        """Send the current timeline to the viewers, with the time of its arrival."""
        self._known.append((self._backward.arrival(self._now), self.robot.timeline))

    # --- results ---

    def viewer_scores(self) -> dict[str, ViewerScore]:
        true = joints_over(self.robot.arm, self.robot.timeline, self.looks)
        # index of the first sample after the first frame has arrived; earlier samples are not scored
        counted = int(np.searchsorted(self.looks, self.arrived[0]))
        if counted >= len(self.looks):
            return {}
        place, times = self.with_tool(true), self.looks.tolist()
        found = {}
        for name in self.trial.viewers:
            viewer = Guarded(name, Predictor, self.trial.robot, self.delay, self.trial.rate)
            seen = self._viewer_joints(viewer, true, counted)
            found[name] = self._viewer_score(seen, place[counted:], viewer.call_time)
        since = [t for t, _ in self._known]
        # for each sample, the last timeline that had arrived
        timelines = [self._known[bisect_right(since, t) - 1][1] for t in times]
        seen = np.array([joints_at(self.robot.arm, one, t) for one, t in zip(timelines, times, strict=True)])
        found["timeline"] = self._viewer_score(seen[counted:], place[counted:], 0.0)
        return found

    def _viewer_joints(self, viewer: Guarded, true: Floats, first: int) -> Floats:
        """Return the joint positions that a viewer shows at sample `first` and each later sample, (N, n) [rad; m].
        `true`: the joint positions in the frames."""
        seen, received = np.zeros((len(self.looks) - first, true.shape[1])), 0
        for k in range(first, len(self.looks)):
            t = float(self.looks[k])
            while received <= k and self.arrived[received] <= t:
                viewer.receive(float(self.looks[received]), true[received])
                received += 1
            seen[k - first] = viewer.predict(t)
        return seen

    def _viewer_score(self, seen: Floats, true: Floats, call_time: float) -> ViewerScore:
        """Compare displayed joint positions (N, n) with the true robot (a result of `with_tool`), and return the
        score."""
        n, scale = seen.shape[1], self.degrees
        worst = (np.abs(seen - true[:, :n]) * scale).max(axis=1)
        mm = 1e3 * np.linalg.norm(self.with_tool(seen)[:, n:] - true[:, n:], axis=1)
        steps = np.abs(np.diff(seen, axis=0) - np.diff(true[:, :n], axis=0)) * scale
        return ViewerScore(
            float(worst.mean()),
            float(np.percentile(worst, 95)),
            float(worst.max()),
            float(mm.mean()),
            float(steps.max(initial=0.0)),
            call_time,
        )

    def controller_score(self) -> ControllerScore | None:
        if self.goals is None:
            return None
        arm, timeline, scale = self.robot.arm, self.robot.timeline, self.degrees
        lags = np.linspace(0.0, 2.0, 41)
        rms = []
        for lag in lags:
            rows = self.looks + lag < self.trial.seconds
            apart = np.abs(joints_over(arm, timeline, self.looks[rows] + lag) - self.goals[rows]) * scale
            rms.append(float(np.sqrt((apart**2).sum(axis=1).mean())))
        true = joints_over(arm, timeline, self.looks)
        worst = (np.abs(true - self.goals) * scale).max(axis=1)
        velocity = np.diff(true, axis=0) * self.trial.rate
        effort = np.diff(velocity, axis=0) * self.trial.rate / np.array(self.trial.robot.max_acceleration)
        following = self._steering.following
        return ControllerScore(
            float(np.sqrt((worst**2).mean())),
            float(worst.max()),
            float(lags[int(np.argmin(rms))]),
            float(np.sqrt((effort**2).mean())) if effort.size else 0.0,
            following.held / max(following.targets, 1),
            self._controller.call_time,
        )
