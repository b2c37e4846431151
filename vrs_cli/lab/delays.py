"""Simulate how delays affect a remote operator and viewers, in virtual time.

An operator commands joint-interpolated motions over a connection with delays in both directions; each command is issued
a time `lead` before its motion starts. The simulation uses the code of a real connection: the line, the mirror (the
viewer's copy of the timeline), the preview of commands that have not arrived, the flags (times at which the viewer's
copy was wrong), and the measured delays. D_f is the delay from operator to robot (forward), D_b from robot to viewer
(backward).
"""

from __future__ import annotations

import heapq
from bisect import bisect_right
from collections.abc import Callable, Sequence
from enum import Enum
from functools import partial
from itertools import count, pairwise
from math import ceil, inf
from random import Random
from statistics import fmean
from typing import NamedTuple, TypeVar

import numpy as np
from msgspec import Struct

from vrs_cli.engine.clock import WallClock
from vrs_cli.engine.engine import Engine, Postponement
from vrs_cli.engine.feed import Snapshot
from vrs_cli.engine.position import joints_at, joints_over
from vrs_cli.errors import TooLate
from vrs_cli.interfaces.users import HolderTimes
from vrs_cli.kinematics.arrays import Flags as Flagged
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.net import messages, preview
from vrs_cli.net.delay_line import DelayWays
from vrs_cli.net.mirror import Mirror
from vrs_cli.net.timesync import Playout, TimeSync
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import JointTarget, Move, SetParameter, Stamp
from vrs_cli.wire.codec import Encoding, Frame, Reader, encode
from vrs_cli.wire.records import Form, Motions, delta_of, delta_record

FIRST = 1.0  # [s] time at which the operator issues the first command
SHORTEST_PAUSE, LONGEST_PAUSE = 0.3, 1.5  # [s] range of the random time between two commands
PLACES = 4  # number of targets, which the arm visits again and again in the same order
REACH = 0.15  # maximum distance of a target from the pose READY, as a fraction of each joint's range
MEASURED = 1000  # compute the size of the playout buffer from this many frames
READER = Reader[messages.Delta](messages.Delta)
PINGS = 100  # number of messages sent before the trial to measure the delays


Score = TypeVar("Score", bound=Struct)  # a struct of numbers that measure the result of a trial


class Strategy(Enum):
    """The sources of the joint positions that a remote viewer can show."""

    FRAMES = "frames"  # the last frame that has arrived: the robot when the frame was sent
    PREDICTED = "predicted"  # a frame that was sent with the position planned for the time when it is shown
    DELTAS = "deltas"  # the viewer's copy of the timeline at the current time
    AHEAD = "ahead"  # the viewer's copy at the time D_f later, when a command issued now arrives
    PREVIEW = "preview"  # like AHEAD, but with the effect of commands that have not arrived yet


class Trial(Struct, frozen=True):
    """The description of one trial. `ways`: the network delays in both directions; `lead`: the time from a command to
    the start of its motion [s]; `policy`: the value of the parameter CAUSALITY, which says what the robot does with
    late commands; `seconds`: the duration; `rate`: how often the viewer samples per second."""

    robot: RobotModel
    ways: DelayWays
    lead: float
    policy: str
    seconds: float
    rate: float


class Error(Struct, frozen=True):
    """The distance between the displayed and the true robot: mean and maximum for the joint with the largest error
    [deg], and for the tool [mm]."""

    degrees: float
    most_degrees: float
    mm: float
    most_mm: float


class TrialOutcome(Struct, frozen=True):
    """The results of a trial.

    `commands`, `aborted`, `postponed`: the numbers of commands that were issued, refused as too late, and postponed.
    `flagged`: the fraction of samples at which DELTAS was wrong because of a command that the viewer did not know yet.
    `unconfirmed`: the fraction of samples at which PREVIEW depended on commands that the robot had not confirmed yet.
    `round_trip`: the median and the 95th percentile of D_f + D_b [s]. `errors`: the error of each strategy. `agreed`:
    whether the flagged time windows equal those computed afterwards from the logs of both sides. `outside`: the error
    of DELTAS outside flagged time windows.
    """

    commands: int
    aborted: int
    postponed: int
    flagged: float
    unconfirmed: float
    round_trip: tuple[float, float]
    errors: dict[Strategy, Error]
    agreed: bool
    outside: Error


def outcome_of(trial: Trial) -> TrialOutcome:
    """Run a trial and return its results. Equal trials give bit-identical results."""
    course = DelayCourse(trial)
    course.run()
    return course.outcome()


def together(outcomes: Sequence[TrialOutcome]) -> TrialOutcome:
    """Combine the results of several trials: add counts, average fractions and mean errors, and take the largest of the
    maximum errors."""
    return TrialOutcome(
        sum(one.commands for one in outcomes),
        sum(one.aborted for one in outcomes),
        sum(one.postponed for one in outcomes),
        fmean(one.flagged for one in outcomes),
        fmean(one.unconfirmed for one in outcomes),
        (fmean(one.round_trip[0] for one in outcomes), fmean(one.round_trip[1] for one in outcomes)),
        {strategy: mean_score([one.errors[strategy] for one in outcomes]) for strategy in Strategy},
        all(one.agreed for one in outcomes),
        mean_score([one.outside for one in outcomes]),
    )


def mean_score(scores: Sequence[Score]) -> Score:
    """Combine scores field by field: take the mean, or the maximum for `jump` and fields whose name begins with
    `most`."""
    names = type(scores[0]).__struct_fields__
    how = {name: max if name.startswith(("most", "jump")) else fmean for name in names}
    return type(scores[0])(*(how[name](getattr(one, name) for one in scores) for name in names))


# --- the simulation ----------------------------------------------------------------------------------------------


class Change(NamedTuple):
    """A line in the robot's log: at the time `applied` [s], a command has replaced the timeline from the time `cut`
    on [s]."""

    applied: float
    cut: float


class Simulation:
    """A robot with a delayed connection, in virtual time, with a queue of scheduled events.

    `_now`: the virtual wall clock of both sides [s]. `delay`: half of the measured median round trip [s]. `looks`: the
    times of the samples [s]. `arrived`: the arrival times of frames sent at the times of the samples [s]. `degrees`:
    factors that convert joint errors to degrees, (n,); 0 for sliding joints, which are left out.
    """

    def __init__(self, robot: RobotModel, ways: DelayWays, seconds: float, rate: float) -> None:
        self._now = 0.0
        self._queue: list[tuple[float, int, Callable[[], None]]] = []
        self._order = count()
        self._forward, self._backward = ways.lines("commands")
        self.sync = measure_delays(ways)
        self.delay = self.sync.round_trip(0.5) / 2.0
        self.robot = Engine(robot, clock=WallClock(lambda: self._now, lambda _seconds: None))
        self.looks = np.arange(0.0, seconds, 1.0 / rate)
        self.arrived = np.array([*map(ways.lines("frames")[1].arrival, self.looks.tolist())])
        self.degrees = np.degrees([1.0 if kind is JointKind.REVOLUTE else 0.0 for kind in robot.units.kinds])

    def _at(self, t: float, act: Callable[[], None]) -> None:
        heapq.heappush(self._queue, (t, next(self._order), act))

    def _run_events(self, until: float = inf) -> None:
        """Run all events before the time `until` [s] in order, including events that they schedule."""
        while self._queue and self._queue[0][0] < until:
            self._now, _, act = heapq.heappop(self._queue)
            act()

    def with_tool(self, joints: Floats) -> Floats:
        """Return joint positions (N, n) [rad; m] with three more columns: the position of the tool [m]."""
        return np.hstack([joints, self.robot.arm.batch.forward(joints)[:, :, 3]])


class DelayCourse(Simulation):
    """A simulation of one trial: the robot, its operator with a viewer, and the line with delays between them."""

    def __init__(self, trial: Trial) -> None:
        super().__init__(trial.robot, trial.ways, trial.seconds, trial.rate)
        self.trial = trial
        self._times = HolderTimes()

        self.robot.perform(SetParameter("CAUSALITY", trial.policy))
        self.postponed: list[Postponement] = []
        self.robot.postponed.append(self.postponed.append)
        self._subscription = self.robot.events.subscribe()
        self._subscription.take()
        self._form = Form.of(self.robot.arm)

        self.mirror = Mirror(
            self.robot.arm, Snapshot.of(self.robot.timeline, self.robot.settings), 0, lambda: self._now
        )
        self.preview = preview.Preview(self.mirror, self.delay)
        self.flags = preview.Flags()
        self.changes: list[Change] = []
        self.arrivals: list[float] = []  # the viewer's log: when each change arrived [s]
        self.commands = self.aborted = 0

        playout = Playout[None](window=MEASURED)
        for t, arrival in zip(self.looks[:MEASURED].tolist(), self.arrived[:MEASURED].tolist(), strict=True):
            playout.put(t, None, arrival)
        self.buffer = ceil(playout.delay * trial.rate)  # delay of the playout buffer, as a number of frames
        seen = Strategy.DELTAS, Strategy.AHEAD, Strategy.PREVIEW
        shape = len(self.looks), trial.robot.joint_count
        self.seen = {strategy: np.zeros(shape) for strategy in (*seen, Strategy.PREDICTED)}
        self._unconfirmed = np.zeros(len(self.looks), dtype=bool)
        self._seen_until = self._sent_until = 0  # how many samples, and how many predicted frames, are recorded

    def run(self) -> None:
        """Run the trial. The operator issues commands at random times, without reacting to the display."""
        random, t = Random(f"{self.trial.ways.seed} operator"), FIRST
        places = [random_place(self.trial.robot, random) for _ in range(PLACES)]
        while t < self.trial.seconds:
            target = JointTarget(places[self.commands % PLACES])
            request = Move(target, False, stamp=Stamp(t + self.trial.lead), text="MOVE")
            self._at(t, partial(self._issue, self.commands, request, t))
            self.commands += 1
            t += random.uniform(SHORTEST_PAUSE, LONGEST_PAUSE)
        self._run_events()
        self._now = self.trial.seconds
        self._look()
        self._predict()

    def _issue(self, number: int, request: Move, t: float) -> None:
        self._look()
        self.preview.send(number, request, t)
        self._at(self._forward.arrival(t), lambda: self._arrive(number, request, t))

    def _arrive(self, number: int, request: Move, t_iss: float) -> None:
        """Handle a command that arrives at the robot: carry it out, and send the answer and the changes of the
        timeline. `t_iss`: the time at which it was issued [s]."""
        self._predict()
        robot = self.robot
        robot.clock.advance(robot.clock.reached)
        issued = self._times.issue_time(t_iss, robot.now)
        try:
            robot.begin(request, program=False, issued=issued)
        except TooLate:
            self.aborted += 1
            self._at(self._backward.arrival(self._now), lambda: self._hear(number, None, ()))
            return
        version, applied = robot.timeline.version, robot.now
        deltas = [event for event in self._subscription.take_all() if isinstance(event, TimelineDelta)]
        self.changes += (Change(applied, delta.cut) for delta in deltas)
        changes = (messages.Delta(delta_record(it, Motions()), applied, number=it.version + 1) for it in deltas)
        frames = [encode(change, Encoding.MSGPACK) for change in changes]
        self._at(self._backward.arrival(self._now), lambda: self._hear(number, version, frames))

    def _hear(self, number: int, version: int | None, frames: Sequence[Frame]) -> None:
        """Handle the answer to a command and its changes of the timeline, which arrive at the viewer. `version`: the
        new version of the timeline; None if the command was refused as too late."""
        self._look()
        if version is None:
            self.preview.refuse(number)
        else:
            self.preview.finish(number, version)
        for frame in frames:
            change = READER.read(frame)
            delta = delta_of(change.delta, Motions(), self._form)
            self.mirror.change(delta, change.number)
            self.flags.add_change(delta.cut, change.applied, self._now)
            self.arrivals.append(self._now)

    # --- samples of the viewer ---

    def _look(self) -> None:
        """Record what the viewer shows at all samples before now that are not recorded yet. This is called before each
        change of the viewer's timeline, so that the timeline is the same for all these samples."""
        rows = slice(self._seen_until, int(self.looks.searchsorted(self._now)))
        self._seen_until = rows.stop
        if rows.start == rows.stop:
            return
        known, planned, now = self.mirror.timeline, self.preview.timeline, self.looks[rows]
        self.seen[Strategy.DELTAS][rows] = self._joints(known, now)
        self.seen[Strategy.AHEAD][rows] = ahead = self._joints(known, now + self.delay)
        self.seen[Strategy.PREVIEW][rows] = ahead if planned is known else self._joints(planned, now + self.delay)
        self._unconfirmed[rows] = now + self.delay >= self.preview.unconfirmed_from

    def _predict(self) -> None:
        """Record the predicted frames that the robot has sent before now and that are not recorded yet."""
        rows = slice(self._sent_until, int(self.looks.searchsorted(self._now)))
        self._sent_until = rows.stop
        if rows.start < rows.stop:
            times = self.looks[rows] + self.buffer / self.trial.rate
            self.seen[Strategy.PREDICTED][rows] = self._joints(self.robot.timeline, times)

    def _joints(self, timeline: Timeline, times: Floats) -> Floats:
        """Return the joint positions (N, n) at times (N,). They are computed one by one, because this is faster than
        array operations for few times."""
        return np.array([joints_at(self.robot.arm, timeline, t) for t in times.tolist()])

    # --- results ---

    def outcome(self) -> TrialOutcome:
        was = partial(
            joints_over, self.robot.arm, self.robot.timeline
        )  # use the final timeline for all times, because changes never alter the past
        now, ahead = self.with_tool(was(self.looks)), self.with_tool(was(self.looks + self.delay))
        deltas = self.with_tool(self.seen[Strategy.DELTAS])
        # for each sample: the index of the last frame that has arrived, and of the frame that the playout buffer shows
        shown = np.searchsorted(self.arrived, self.looks, side="right") - 1
        due = np.minimum(np.arange(len(self.looks)) - self.buffer, shown)
        always = np.ones(len(self.looks), dtype=bool)
        compared = {
            Strategy.FRAMES: (now[shown], now, shown >= 0),
            Strategy.PREDICTED: (self.with_tool(self.seen[Strategy.PREDICTED])[np.maximum(due, 0)], now, due >= 0),
            Strategy.DELTAS: (deltas, now, always),
            Strategy.AHEAD: (self.with_tool(self.seen[Strategy.AHEAD]), ahead, always),
            Strategy.PREVIEW: (self.with_tool(self.seen[Strategy.PREVIEW]), ahead, always),
        }
        errors = {strategy: self.error(seen[rows], true[rows]) for strategy, (seen, true, rows) in compared.items()}
        flagged = self.wrong_looks()
        return TrialOutcome(
            self.commands,
            self.aborted,
            len(self.postponed),
            float(flagged.mean()),
            float(self._unconfirmed.mean()),
            (self.sync.round_trip(0.5), self.sync.round_trip(0.95)),
            errors,
            self.flags.windows == windows_of_logs(self.changes, self.arrivals),
            self.error(deltas[~flagged], now[~flagged]),
        )

    def wrong_looks(self) -> Flagged:
        """Return, for each sample, whether DELTAS was wrong because of a command that the viewer did not know yet,
        (N,)."""
        borders = [border for window in self.flags.windows for border in (window.begin, window.end)]
        found: Flagged = np.searchsorted(borders, self.looks, side="right") % 2 == 1
        return found

    def error(self, seen: Floats, was: Floats) -> Error:
        """Return the error between the displayed robot `seen` and the true robot `was`, both results of `with_tool`;
        zeros if there are no samples."""
        if not len(seen):
            return Error(0.0, 0.0, 0.0, 0.0)
        apart = seen - was
        angles = (np.abs(apart[:, :-3]) * self.degrees).max(axis=1)
        mm = 1e3 * np.linalg.norm(apart[:, -3:], axis=1)
        return Error(float(angles.mean()), float(angles.max()), float(mm.mean()), float(mm.max()))


def random_place(robot: RobotModel, random: Random) -> Joints:
    """Return random joint positions near the pose READY, within the joint limits [rad; m]."""
    rows = zip(robot.poses["ready"], robot.lower, robot.upper, strict=True)
    return tuple(
        min(max(ready + random.uniform(-REACH, REACH) * (upper - lower), lower), upper) for ready, lower, upper in rows
    )


def measure_delays(ways: DelayWays) -> TimeSync:
    """Measure the delays of a line with PINGS messages, and return the estimator."""
    sync, (forward, backward) = TimeSync(window=float(PINGS)), ways.lines("pings")
    for t0 in map(float, range(PINGS)):
        t1 = forward.arrival(t0)
        sync.hear(t0, t1, t1, backward.arrival(t1))
    return sync


# --- the flagged time windows, computed from the logs of both sides --------------------------------------------------


def windows_of_logs(changes: Sequence[Change], arrived: Sequence[float]) -> tuple[preview.FlagWindow, ...]:
    """Return the time windows in which a viewer's timeline was wrong, computed from the logs of both sides: the robot
    had applied a change that had not arrived at the viewer, and that already affected the current time. `arrived`: the
    times at which the changes arrived at the viewer [s]."""
    applied = [it.applied for it in changes]
    borders = sorted({*applied, *arrived, *(it.cut for it in changes)})
    wrong = []
    for begin, end in pairwise(borders):
        middle = (begin + end) / 2.0
        unknown = changes[bisect_right(arrived, middle) : bisect_right(applied, middle)]
        if any(change.cut <= begin for change in unknown):
            wrong.append(preview.FlagWindow(begin, end))
    return preview.merge_windows(wrong)
