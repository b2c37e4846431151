"""Detect that the measured robot differs from its timeline by more than healthy noise explains, and name the cause.

Each report is compared with g, the commanded position, at the time of the report. Residuals are averaged over 50 ms,
and the residual of a healthy arm is subtracted; then they are divided by its standard deviation (`twin/healthy.py`).
For each joint, and for the position of the tool, their squares minus an allowance are summed: Page's cumulative sum
(Continuous inspection schemes, Biometrika 41, 1954). The sum never falls below zero, and raises an alarm when it
exceeds a threshold h. For normal noise, an excursion that begins at a given block reaches h with a probability of at
most exp(-lambda h), where lambda > 0 solves E exp(lambda x) = 1 for an increment x (Wald's bound). `threshold` computes
h for a stated rate of false alarms.

A payload that the controller does not know deflects several joints a little, in changing directions during the motion,
so that the sum of no single joint grows large. But the torques of a payload on the joints are known: a generalised
likelihood ratio (Willsky and Jones, IEEE Transactions on Automatic Control 21, 1976) tests whether the joints have
yielded to such torques for the last 0.05 to 0.4 s.

The healthy model does not learn from data around an alarm: it learns from a second of data three seconds later, if no
divergence was found until then.

Each possible cause predicts the measured joints. If a command was lost, they follow the timeline without this command;
with a delay, they follow the timeline later; a blocked joint stands still while others move; a payload deflects all
joints by its weight and inertia (tested by a regression over all joints). A cause is named if it explains enough of the
squared residuals, each in units of its joint's noise.
"""

from __future__ import annotations

from collections import deque
from math import degrees, dist, floor, inf, log, log1p
from typing import NamedTuple

import numpy as np

from vrs_cli.engine.position import PositionArrays, joints_at, position_at, positions_at, world_pose
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Flags, Floats
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import position
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.twin.healthy import Blocks, HealthyResidual, load_torque
from vrs_cli.values.measured import BodyMode, DivergenceAlarm, DivergenceCause, Report

EXPLAINED = 0.9  # fraction of the squared residuals that a cause must explain
KICKED = 0.6  # the same fraction for a joint that blocks in full motion, which disturbs the other joints
WAY = 10.0  # minimum displacement that counts as motion [standard deviations of the noise]
LATELY = 0.15  # [s] samples of this last interval show the current errors
MAX_DELAY = 1.5  # [s] maximum delay of the arm that is tested as a cause
MAX_GROWTH = 0.5  # [s/s] maximum growth of the arm's delay
SETTLING = (12.0, 24.0, 48.0, 96.0)  # [1/s] rates at which the deflection by a load may settle; each is tried
OTHER_SPEED = 0.02  # [rad/s, m/s] minimum growth rate of a residual if another commander moves the arm
Likely = tuple[DivergenceCause, str]


class Sample(NamedTuple):
    """A report from the arm, used as evidence: its joint positions at time `t` [s], and its mode (whether it follows
    the timeline)."""

    t: float
    joints: Joints
    mode: BodyMode


class Evidence(NamedTuple):
    """The samples from which the cause is inferred. They begin shortly before `since` [s], the onset of the divergence.

    `measured` (N, n): the joints. `g`: the commanded positions at the same times. `healthy` (N, n): the residuals of a
    healthy arm, with their standard deviations by joint (n,): `noise` includes the errors of a healthy model that has
    learned little, `pure_noise` does not. `befores`: the timelines that the last changes replaced, the newest first.
    """

    arm: RobotArm
    timeline: Timeline
    befores: tuple[Timeline, ...]
    since: float
    measured: Floats
    g: PositionArrays
    healthy: Floats
    noise: Floats
    pure_noise: Floats
    mode: BodyMode

    @property
    def times(self) -> Floats:
        return self.g.times

    @property
    def error(self) -> Floats:
        """Return the residuals to be explained (N, n) [rad, m]."""
        return np.asarray(self.measured - self.g.joints - self.healthy)

    @property
    def late(self) -> Flags:
        """Return which samples (N,) are in the last LATELY seconds."""
        return np.asarray(self.times >= self.times[-1] - LATELY)

    @property
    def worst(self) -> int:
        """Return the joint, counted from 0, with the greatest residual in units of its noise."""
        return int(np.argmax(np.abs(self.error[self.late]).mean(axis=0) / self.noise))

    def share(self, error: Floats) -> float:
        """Return the explained fraction of the squared residuals if `error` (N, n) remains unexplained."""
        left, all_of_it = ((((one / self.noise) ** 2).sum()) for one in (error, self.error))
        return float(1.0 - left / max(all_of_it, 1e-30))


def likely_cause(it: Evidence) -> Likely:
    """Return the likely cause, and a sentence with the evidence for it."""
    if it.mode is BodyMode.STOPPED:
        return DivergenceCause.STOPPED, "the body says that it has stopped"
    if it.mode is BodyMode.HOLDS:
        return DivergenceCause.STOPPED, "the body says that it holds, and nobody ordered that"
    for judge in (_lost_or_late, _blocked_joints, _payload, _other_commander_or_push):
        if (found := judge(it)) is not None:
            return found
    return DivergenceCause.UNKNOWN, f"joint {it.worst + 1} differs most, and no simple cause explains all joints"


def _lost_or_late(it: Evidence) -> Likely | None:
    """Test for a command that never reached the arm, and for a delay, which may grow."""
    delay, growth, late_share = _delay(it)
    now = it.times[-1]
    for before in it.befores:
        begins = before.same_until(it.timeline)
        if begins > it.times[-1] or begins < it.since - 1.0:
            continue
        share = it.share(it.measured - positions_at(it.arm, before, it.times).joints - it.healthy)
        # an arm that has rested since the command began might also be late by this whole time, but real delays do
        # not grow so suddenly
        if share >= EXPLAINED and not (late_share > share and delay < 0.7 * (now - begins)):
            number = it.timeline.locate(now)[0].motion
            said = f"the joints follow the timeline as it was before {number.text or 'the last command'}"
            return DivergenceCause.LOST_COMMAND, f"{said}, which was to begin at {begins:.2f} s"
    if late_share >= EXPLAINED and delay > 0.0 and growth < MAX_GROWTH:
        grows = f", and {1e3 * growth:.0f} ms later each second" if growth > 1e-3 else ""
        return DivergenceCause.DELAY, f"all joints are where they should have been {1e3 * delay:.0f} ms before{grows}"
    return None


def _delay(it: Evidence) -> tuple[float, float, float]:
    """Fit one delay, which may grow linearly, to all joints by Gauss-Newton steps. Return the delay at the end [s], its
    growth [s/s], and the explained share."""
    since, a, b = it.times - it.times[-1], 0.0, 0.0
    best = (0.0, 0.0, it.share(it.error))
    for _ in range(8):
        place = positions_at(it.arm, it.timeline, it.times - np.clip(a + b * since, 0.0, MAX_DELAY))
        left = (it.measured - place.joints - it.healthy) / it.noise
        share = it.share(left * it.noise)
        if share > best[2]:
            best = (a, b, share)
        slope = -place.velocity / it.noise
        columns = np.stack([slope, slope * since[:, None]], axis=-1).reshape(-1, 2)
        step = np.linalg.lstsq(columns, left.reshape(-1), rcond=1e-6)[0]
        a, b = float(np.clip(a + step[0], 0.0, MAX_DELAY)), float(np.clip(b + step[1], 0.0, MAX_GROWTH))
    return best


def _blocked_joints(it: Evidence) -> Likely | None:
    """Test for blocked joints, that is, joints that are at rest although the timeline moves them, while the other
    joints follow it."""
    # a joint at rest has no errors of motion, so the uncertainty of the healthy model does not count
    it = it._replace(noise=it.pure_noise)
    back = it.measured[::-1]
    still = np.maximum.accumulate(back, axis=0) - np.minimum.accumulate(back, axis=0) < 3.0 * it.noise
    samples = np.minimum.accumulate(still, axis=0).sum(axis=0)  # number of samples since each joint last moved
    ways = np.array([np.ptp(it.g.joints[len(back) - count :, joint]) for joint, count in enumerate(samples)])
    blocked = (ways > WAY * it.noise) & (samples > 0.5 * it.late.sum())
    if not blocked.any() or it.share(np.where(blocked, 0.0, it.error)) < KICKED:
        return None
    joints = [int(joint) + 1 for joint in np.flatnonzero(blocked)]
    moving = blocked | (np.ptp(it.g.joints[it.times >= it.since], axis=0) > WAY * it.noise)
    if blocked.sum() == moving.sum() > 1:
        return DivergenceCause.STOPPED, "all joints stand still, and the timeline moves"
    if len(joints) == 1:
        here = it.arm.model.joint_text(joints[0], float(it.measured[-1, joints[0] - 1]), 1)
        rest = "the others move" if moving.sum() > 1 else "it alone is to move"
        return DivergenceCause.BLOCKED, f"joint {joints[0]} stands still at {here}, and {rest}"
    return DivergenceCause.BLOCKED, f"joints {', '.join(map(str, joints))} stand still, and the others move"


def _payload(it: Evidence) -> Likely | None:
    """Test for a mass at the flange: fit all residuals by the torques of this mass on the joints. The deflection of a
    joint is torque times compliance. The compliance is unknown but not negative; all joints settle at the same rate."""
    rows = zip(it.g.joints.tolist(), it.g.velocity.tolist(), it.g.acceleration.tolist(), strict=True)
    torque = np.array([load_torque(it.arm, *map(tuple, row)) for row in rows])
    after = np.maximum(it.times - it.since, 0.0)[:, None]
    best, sags = 0.0, np.zeros_like(it.error)
    for rate in SETTLING:
        column = -torque * (1.0 - (1.0 + rate * after) * np.exp(-rate * after))
        compliance = np.maximum((column * it.error).sum(axis=0) / np.maximum((column**2).sum(axis=0), 1e-12), 0.0)
        share = it.share(it.error - column * compliance)
        if share > best:
            best, sags = share, column * compliance
    if best < max(EXPLAINED, _growth_share(it)):
        return None
    moved = np.array(it.arm.jacobian(tuple(it.g.joints[-1].tolist())))[:3] @ sags[-1]
    return (
        DivergenceCause.PAYLOAD,
        f"all joints give way as a mass at the flange asks of them: the tool sags by {1e3 * -moved[2]:.1f} mm",
    )


def _growth_share(it: Evidence) -> float:
    """Return the fraction of the squared residuals explained by residuals that grow with the square of time, as they do
    if two commanders move the arm."""
    best = 0.0
    for begin in np.linspace(it.times[0], it.since, 4):
        square = np.maximum(it.times - begin, 0.0)[:, None] ** 2
        gains = (square * it.error).sum(axis=0) / max(float((square**2).sum()), 1e-12)
        best = max(best, it.share(it.error - square * gains))
    return best


def _other_commander_or_push(it: Evidence) -> Likely | None:
    """Test for another commander, which moves the arm away smoothly, and for a push, after which the arm comes back."""
    size = np.abs(it.error / it.noise).max(axis=1)
    late = it.late
    rate = (it.error[late][-1] - it.error[late][0]) / max(float(np.ptp(it.times[late])), 1e-6)
    if size[-3:].mean() < 0.6 * size.max():
        return DivergenceCause.PUSH, f"joint {it.worst + 1} was kicked, and comes back"
    fastest = int(np.argmax(np.abs(rate)))
    if abs(rate[fastest]) < OTHER_SPEED or size[-3:].mean() < 0.9 * size.max():
        return None
    speed = degrees(abs(rate[fastest])) if it.arm.turning[fastest] else 1e3 * abs(rate[fastest])
    unit = "deg/s" if it.arm.turning[fastest] else "mm/s"
    return (
        DivergenceCause.OTHER_COMMANDER,
        f"the arm goes another way: joint {fastest + 1} departs from the timeline by {speed:.1f} {unit}",
    )


BLOCK = 0.05  # [s] residuals are averaged over blocks of this length
APART = 0.009  # [s] minimum time between two reports; closer ones are skipped, because 100 per second suffice
GAP = 0.5  # [s] maximum gap between reports; after a longer gap all sums start again
FALSE_ALARMS = 1e-6  # [1/h] rate of false alarms for normal noise
JOINT_ALLOWANCE = 9.0  # allowance on a squared residual with one degree of freedom: 3 standard deviations
TOOL_ALLOWANCE = 14.0  # allowance on the squared error of the tool's position, with three degrees of freedom
LOAD_WINDOW = 8  # maximum number of blocks searched for a load: over longer times, healthy errors may look like a load
SAG = 0.1  # [rad, m] assumed maximum displacement of a joint under its usual load
DECIDE = 0.2  # [s] delay from detection to the alarm, to collect more evidence of the cause
SECOND = round(1.0 / BLOCK)  # number of blocks per second
WAITS = 3  # [s] age of a second of data when the healthy model learns from it
CALM = 25.0  # a robot whose squared residuals stay below this for a second has recovered
BEFORE = 0.1  # [s] how much data from before the onset of a divergence is included in the evidence
SAMPLE_NOISE = 2.0  # ratio of the noise of one sample to the noise of a block, which averages five reports
MEMORY = 3.0  # [s] time for which reports are kept as evidence
EDITS = 10.0  # [s] time for which a replaced timeline is kept


def exponent(allowance: float, freedoms: int) -> float:
    """Return lambda > 0 with E exp(lambda (x - allowance)) = 1, where x is chi-square distributed with `freedoms`
    degrees of freedom: the root below 1/2 of -freedoms / 2 log(1 - 2 lambda) = lambda allowance."""
    # `low` is where the two sides differ most, so the search excludes the root at 0
    low, high = 0.5 - 0.5 * freedoms / allowance, 0.5
    for _ in range(100):
        middle = 0.5 * (low + high)
        if middle >= 0.5 or -0.5 * freedoms * log1p(-2.0 * middle) > middle * allowance:
            high = middle
        else:
            low = middle
    return low


def threshold(allowance: float, freedoms: int, an_hour: float) -> float:
    """Return the threshold h at which one cumulative sum raises at most `an_hour` false alarms per hour."""
    return -log(an_hour * BLOCK / 3600.0) / exponent(allowance, freedoms)


def load_threshold(joints: int, an_hour: float) -> float:
    """Return the threshold h at which the likelihood ratio of a load raises at most `an_hour` false alarms per hour.

    In each window the ratio is at most chi-square distributed with a degree of freedom for each joint; h follows from
    Chernoff's bound.
    """
    rarity, h = -log(an_hour * BLOCK / 3600.0 / LOAD_WINDOW), float(joints)
    for _ in range(100):
        h = joints + 2.0 * rarity + joints * log(h / joints)
    return h


class DivergenceWatch:
    """A detector of divergence for one arm. `diverged`: an alarm was raised, and the arm has not recovered since
    then."""

    def __init__(self, arm: RobotArm) -> None:
        n = arm.model.joint_count
        self.arm, self.healthy = arm, HealthyResidual(arm)
        share = FALSE_ALARMS / (n + 2)
        self._allowances: Floats = np.array([JOINT_ALLOWANCE] * n + [TOOL_ALLOWANCE])
        self._limits: Floats = np.array(
            [threshold(JOINT_ALLOWANCE, 1, share)] * n + [threshold(TOOL_ALLOWANCE, 3, share), load_threshold(n, share)]
        )
        self._samples: deque[Sample] = deque()
        self._befores: deque[tuple[float, Timeline]] = deque()  # times of replacement [s], and replaced timelines
        self._timeline: Timeline | None = None
        self.reset()

    def reset(self) -> None:
        """Start again, for instance after a resynchronisation; keep the learned healthy model."""
        self._sums: Floats = np.zeros(len(self._allowances))
        self._onsets: Floats = np.full(len(self._allowances), inf)
        # sums from which a load is inferred, one item per block, the newest first
        self._loads: deque[Floats] = deque(maxlen=LOAD_WINDOW)
        self._cell: list[tuple[float, Floats]] = []  # times and residuals in the current block
        self._waiting: deque[list[Blocks]] = deque()  # blocks to learn from, by second; the last is incomplete
        self._found: tuple[float, float] | None = None  # [s] times of the divergence's onset and of the alarm to raise
        self._calm = 0
        self._samples.clear()
        self._bounds: dict[int, tuple[Floats, Floats]] = {}
        self.diverged = False

    def take(self, timeline: Timeline, report: Report, *, ordered: bool = True) -> DivergenceAlarm | None:
        """Compare a report with the current timeline of the robot; return an alarm if one is due. Reports older than
        the last one are ignored, and so are reports which say that the arm holds still, if it was `ordered` to hold
        still."""
        last = self._samples[-1].t if self._samples else -inf
        if timeline is not self._timeline:
            if self._timeline is not None:
                self._befores.append((report.t, self._timeline))
            self._timeline = timeline
        if report.t < last + APART:
            return None
        holds = ordered and report.mode is BodyMode.HOLDS
        if holds or report.t > last + GAP > -inf:
            self.reset()
            if holds:
                return None
        ends = self._cell and floor(report.t / BLOCK) != floor(self._cell[0][0] / BLOCK)
        alarm = self._close_block(timeline) if ends else None
        joints = np.array(joints_at(self.arm, timeline, report.t))
        self._samples.append(Sample(report.t, report.joints, report.mode))
        self._cell.append((report.t, np.array(report.joints) - joints))
        while self._samples[0].t < report.t - MEMORY:
            self._samples.popleft()
        while self._befores and self._befores[0][0] < report.t - EDITS:
            self._befores.popleft()
        return alarm

    def _close_block(self, timeline: Timeline) -> DivergenceAlarm | None:
        """Evaluate the block that has ended; return an alarm if one is due."""
        times, residuals = zip(*self._cell, strict=True)
        self._cell, cell = [], floor(times[0] / BLOCK)
        joints, rates = zip(*(self._g_at_begin(timeline, cell + number) for number in (-1, 0, 1)), strict=True)
        velocity = np.array([joints[2] - joints[1], joints[1] - joints[0]]) / BLOCK
        acceleration = np.array([rates[2] - rates[1], rates[1] - rates[0]]) / BLOCK
        load = self.healthy.load(0.5 * (joints[1] + joints[2]), velocity[0], acceleration[0])
        t, residual = sum(times) / len(times), np.mean(residuals, axis=0)
        self._add(Blocks(np.array([t]), residual[None], velocity[None], acceleration[None], load[None]), joints[2])
        # raise the alarm with its cause, if the alarm is due
        if self._found is None:
            return None
        since, due = self._found
        if t < due and self._samples[-1].mode is not BodyMode.STOPPED:
            return None
        self._found, self.diverged = None, True
        self._waiting.clear()
        evidence = self._evidence(timeline, since)
        cause, detail = likely_cause(evidence)
        last, joint = self._samples[-1], evidence.worst + 1
        expected = joints_at(self.arm, timeline, last.t)
        frames = timeline.locate(last.t)[0].motion.frames
        places = (position(world_pose(self.arm, frames, q)) for q in (last.joints, expected))
        size = last.joints[joint - 1] - expected[joint - 1]
        return DivergenceAlarm(t, joint, size, dist(*places), cause, detail, since)

    def _g_at_begin(self, timeline: Timeline, cell: int) -> tuple[Floats, Floats]:
        """Return the commanded joints and velocities at the start of a block. They are cached for the next two
        blocks."""
        if (known := self._bounds.get(cell)) is None:
            here = position_at(self.arm, timeline, cell * BLOCK)
            self._bounds = {k: bound for k, bound in self._bounds.items() if cell - 3 < k < cell + 3}
            known = self._bounds[cell] = np.array(here.joints), np.array(here.velocity)
        return known

    def _add(self, block: Blocks, joints: Floats) -> None:
        """Add a block to all sums; then let the healthy model learn from the oldest waiting second of data."""
        predicted = self.healthy.predict(block)
        error, deviation = (block.residual - predicted.mean)[0], predicted.deviation[0]
        # Squared displacement of the tool, normalised by its covariance: chi-square with three degrees of freedom
        jacobian = np.array(self.arm.jacobian(tuple(joints.tolist())))[:3]
        moved, spread = jacobian @ error, jacobian * deviation
        covariance = spread @ spread.T + np.diag([1e-12] * 3)
        squares = np.append((error / deviation) ** 2, float(moved @ np.linalg.solve(covariance, moved)))
        t = float(block.times[0])
        if self.diverged:
            self._calm = self._calm + 1 if squares.max() < CALM else 0
            if self._calm >= SECOND:
                self.diverged, self._calm = False, 0
                self._sums[:] = 0.0
                self._loads.clear()
            return
        self._onsets[self._sums <= 0.0] = t - 0.5 * BLOCK
        self._sums = np.maximum(self._sums + squares - self._allowances, 0.0)
        ratio, length = self._load_ratio(block.torque[0] / deviation, error / deviation)
        levels = np.append(self._sums, ratio) / self._limits
        if self._found is None and levels.max() > 1.0:
            onsets = np.append(self._onsets, t + (0.5 - length) * BLOCK)
            self._found = float(onsets[levels.argmax()]), t + DECIDE
        if not self._waiting or len(self._waiting[-1]) == SECOND:
            self._waiting.append([])
        self._waiting[-1].append(block)
        if len(self._waiting) > WAITS + 1 and self._found is None and levels.max() < 0.25:
            self.healthy.learn(Blocks(*map(np.concatenate, zip(*self._waiting.popleft(), strict=True))))

    def _load_ratio(self, load: Floats, error: Floats) -> tuple[float, int]:
        """Return twice the log-likelihood ratio of "load" versus "no load", and the number of sample blocks since the
        load's onset. The compliance of each joint is unknown, but not negative. `load` and `error` are in units of the
        standard deviation."""
        self._loads.appendleft(np.stack([-load * error, load**2]))
        products, squares = np.moveaxis(np.cumsum(list(self._loads), axis=0), 1, 0)
        ratios = (np.maximum(products, 0.0) ** 2 / (squares + SAG**-2)).sum(axis=1)
        longest = int(ratios.argmax())
        return float(ratios[longest]), longest + 1

    def _evidence(self, timeline: Timeline, since: float) -> Evidence:
        """Collect the evidence from which the cause is inferred."""
        samples = [sample for sample in self._samples if sample.t >= since - BEFORE]
        times, measured = np.array([one.t for one in samples]), np.array([one.joints for one in samples])
        g, ago = (positions_at(self.arm, timeline, times - back) for back in (0.0, BLOCK))
        velocity, acceleration = (
            np.stack(both, axis=1) for both in ((g.velocity, ago.velocity), (g.acceleration, ago.acceleration))
        )
        load = np.array([*map(self.healthy.load, g.joints, g.velocity, g.acceleration)])
        healthy = self.healthy.predict(Blocks(times, measured, velocity, acceleration, load))
        befores = tuple(before for _, before in reversed(self._befores))
        noise, pure = (SAMPLE_NOISE * one.mean(axis=0) for one in (healthy.deviation, healthy.noise))
        return Evidence(self.arm, timeline, befores, since, measured, g, healthy.mean, noise, pure, samples[-1].mode)
