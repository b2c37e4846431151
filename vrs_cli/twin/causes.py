"""The likely cause of a divergence: which simple story explains what was measured since it began.

Each cause says where the measured joints would be. After a lost command they follow the timeline as it was before the
command; with a delay they follow it later; a blocked joint stands while others go on; a payload bends all joints as its
weight and inertia ask of each of them, which is a regression over all joints and not the largest residual. A cause is
named if it explains enough of the squared residuals, each in units of its joint's noise.
"""

from __future__ import annotations

from math import degrees
from typing import NamedTuple

import numpy as np

from vrs_cli.engine.position import PositionArrays, positions_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Flags, Floats
from vrs_cli.kinematics.joints import Joints
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.twin.healthy import load_torque
from vrs_cli.values.measured import BodyMode, DivergenceCause

EXPLAINED = 0.9  # of the squared residuals
KICKED = 0.6  # of them, where a joint is blocked in full motion: that kicks the others
WAY = 10.0  # times the noise: a joint is moved that goes so far
LATELY = 0.15  # [s] in which it is looked whether joints stand still
MAX_DELAY = 1.5  # [s]
MAX_GROWTH = 0.5  # [s/s] of a delay
SETTLING = (12.0, 24.0, 48.0, 96.0)  # [1/s] how fast a controller gives way to a load, tried one by one
OTHER_SPEED = 0.02  # [rad/s, m/s] and more of a residual that grows on and on: somebody else moves the arm
Likely = tuple[DivergenceCause, str]


class Sample(NamedTuple):
    """What a body reported at time t [s]."""

    t: float
    joints: Joints
    mode: BodyMode


class Evidence(NamedTuple):
    """What a cause is sought in, since shortly before the onset `since` [s]: `measured` joints (N, n), g at their
    times, the residuals that a `healthy` body has (N, n), and the standard deviation of the `noise` of each joint (n,).
    `befores`: timelines before the last changes, the newest first.
    """

    arm: RobotArm
    timeline: Timeline
    befores: tuple[Timeline, ...]
    since: float
    measured: Floats
    g: PositionArrays
    healthy: Floats
    noise: Floats
    mode: BodyMode

    @property
    def times(self) -> Floats:
        return self.g.times

    @property
    def error(self) -> Floats:
        """The residuals that are to be explained (N, n) [rad, m]."""
        error: Floats = self.measured - self.g.joints - self.healthy
        return error

    @property
    def late(self) -> Flags:
        """Which samples (N,) are of the last moments."""
        late: Flags = self.times >= self.times[-1] - LATELY
        return late

    @property
    def worst(self) -> int:
        """The joint, from 0, that differs most for its noise."""
        return int(np.argmax(np.abs(self.error[self.late]).mean(axis=0) / self.noise))

    def share(self, error: Floats) -> float:
        """Return which share of the squared residuals is explained if `error` (N, n) is left of them."""
        left, all_of_it = ((((one / self.noise) ** 2).sum()) for one in (error, self.error))
        return float(1.0 - left / max(all_of_it, 1e-30))


def likely_cause(it: Evidence) -> Likely:
    """Return the likely cause, and a sentence that says what it is concluded from."""
    if it.mode is BodyMode.STOPPED:
        return DivergenceCause.STOPPED, "the body says that it has stopped"
    if it.mode is BodyMode.HOLDS:
        return DivergenceCause.STOPPED, "the body says that it holds, and nobody ordered that"
    for judge in (_lost_or_late, _standing, _payload, _moved):
        found = judge(it)
        if found is not None:
            return found
    return DivergenceCause.UNKNOWN, f"joint {it.worst + 1} differs most, and no simple cause explains all joints"


def _lost_or_late(it: Evidence) -> Likely | None:
    """A command that the body never got, or a timeline that it follows later and later."""
    delay, growth, late_share = _delay(it)
    now = it.times[-1]
    for before in it.befores:
        begins = before.same_until(it.timeline)
        if begins > it.times[-1] or begins < it.since - 1.0:
            continue
        joints = positions_at(it.arm, before, it.times).joints
        share = it.share(it.measured - joints - it.healthy)
        # a body that stands since the command began may be late by all of that time: but delays do not jump so far
        if share >= EXPLAINED and not (late_share > share and delay < 0.7 * (now - begins)):
            number = it.timeline.locate(now)[0].motion
            said = f"the joints follow the timeline as it was before {number.text or 'the last command'}"
            return DivergenceCause.LOST_COMMAND, f"{said}, which was to begin at {begins:.2f} s"
    if late_share >= EXPLAINED and delay > 0.0 and growth < MAX_GROWTH:
        grows = f", and {1e3 * growth:.0f} ms later each second" if growth > 1e-3 else ""
        return DivergenceCause.DELAY, f"all joints are where they should have been {1e3 * delay:.0f} ms before{grows}"
    return None


def _delay(it: Evidence) -> tuple[float, float, float]:
    """Fit a delay that grows evenly to all joints by Gauss-Newton steps. Return it at the end [s], its growth [s/s],
    and which share it explains.
    """
    since, a, b = it.times - it.times[-1], 0.0, 0.0
    best = (0.0, 0.0, it.share(it.error))
    for _ in range(8):
        shift = np.clip(a + b * since, 0.0, MAX_DELAY)
        place = positions_at(it.arm, it.timeline, it.times - shift)
        left = (it.measured - place.joints - it.healthy) / it.noise
        share = it.share(left * it.noise)
        if share > best[2]:
            best = (a, b, share)
        slope = -place.velocity / it.noise
        columns = np.stack([slope, slope * since[:, None]], axis=-1).reshape(-1, 2)
        step = np.linalg.lstsq(columns, left.reshape(-1), rcond=1e-6)[0]
        a, b = float(np.clip(a + step[0], 0.0, MAX_DELAY)), float(np.clip(b + step[1], 0.0, MAX_GROWTH))
    return best


def _standing(it: Evidence) -> Likely | None:
    """Joints that stand still though the timeline moves them, while the others are where they should be."""
    back = it.measured[::-1]
    still = np.maximum.accumulate(back, axis=0) - np.minimum.accumulate(back, axis=0) < 3.0 * it.noise
    samples = np.minimum.accumulate(still, axis=0).sum(axis=0)  # for how long each joint has stood, up to now
    ways = np.array([np.ptp(it.g.joints[len(back) - count :, joint]) for joint, count in enumerate(samples)])
    lately = it.times >= it.times[-1] - LATELY
    stands = (ways > WAY * it.noise) & (samples > 0.5 * lately.sum())
    moving = stands | (np.ptp(it.g.joints[it.times >= it.since], axis=0) > WAY * it.noise)
    if not stands.any():
        return None
    joints = [int(joint) + 1 for joint in np.flatnonzero(stands)]
    if it.share(np.where(stands, 0.0, it.error)) < KICKED:
        return None
    if stands.sum() == moving.sum() > 1:
        return DivergenceCause.STOPPED, "all joints stand still, and the timeline moves"
    if len(joints) == 1:
        here = it.arm.model.said(joints[0], float(it.measured[-1, joints[0] - 1]), 1)
        return DivergenceCause.BLOCKED, f"joint {joints[0]} stands still at {here}, and the others move"
    return DivergenceCause.BLOCKED, f"joints {', '.join(map(str, joints))} stand still, and the others move"


def _payload(it: Evidence) -> Likely | None:
    """A mass at the flange: regress all residuals on the torques that it asks of the joints.

    A joint gives way by its torque times its compliance, which is not known but never negative, and all joints come to
    that in the same time.
    """
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
    if best < max(EXPLAINED, _growing(it)):
        return None
    jacobian = np.array(it.arm.jacobian(tuple(it.g.joints[-1].tolist())))[:3]
    moved = jacobian @ sags[-1]
    said = f"all joints give way as a mass at the flange asks of them: the tool sags by {1e3 * -moved[2]:.1f} mm"
    return DivergenceCause.PAYLOAD, said


def _growing(it: Evidence) -> float:
    """Return which share residuals explain that grow with the square of time: two commanders accelerate apart."""
    best = 0.0
    for begin in np.linspace(it.times[0], it.since, 4):
        square = np.maximum(it.times - begin, 0.0)[:, None] ** 2
        gains = (square * it.error).sum(axis=0) / max(float((square**2).sum()), 1e-12)
        best = max(best, it.share(it.error - square * gains))
    return best


def _moved(it: Evidence) -> Likely | None:
    """An arm that goes elsewhere, smoothly and on and on, or was kicked and comes back."""
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
    said = f"the arm goes another way: joint {fastest + 1} departs from the timeline by {speed:.1f} {unit}"
    return DivergenceCause.OTHER_COMMANDER, said
