"""Learn the healthy residual of a robot: the difference between a correctly working arm and its timeline.

Even a healthy arm lags, sags and sticks. So the healthy residual of a joint (measured minus commanded value) is
modelled as noise plus a sum of known functions of the commanded motion with unknown coefficients: an offset, terms
proportional to velocity (lag) and acceleration, dry friction, and the joint torque of a mass at the flange.
Coefficients are learned by Bayesian linear regression with exponential forgetting (Bishop, Pattern Recognition and
Machine Learning, 2006, 3.3): motions unlike the learned ones have a wide prediction interval, so that an arm can be
monitored from its first report. The noise is learned for each joint in classes of activity, because errors are larger
at high speed than at rest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats, Rows
from vrs_cli.kinematics.joints import Joints

# prior standard deviations of the coefficients of `features`: offset; velocity, acceleration and dry friction in this
# block, and the same three in the block before; load. Units: rad or m, s, s2
PRIOR = (0.01, 0.05, 0.005, 0.003, 0.05, 0.005, 0.003, 0.02)
BEGUN = 1e-3  # [rad/s, m/s] speed above which the dry friction of a joint has its full size
ACTIVITY = (0.01, 0.1, 0.4)  # bounds between classes of activity, as fractions of the velocity and acceleration limits
START = 2e-3  # [rad, m] noise assumed before anything is learned
LEAST_NOISE = 2e-4  # [rad, m] minimum noise (0.011 deg), for backlash and for errors too small to matter to an operator
STICK = 2e-3  # [rad, m] deviation from the set point at which dry friction may hold a nearly resting joint
SLOW = 5e-3  # [rad/s, m/s] speed below which a joint hardly moves
FEW = 100  # number of blocks after which the learned noise of a class limits outliers; START then counts half or less
GRAVITY = 9.81  # [m/s2] acceleration of gravity
MEMORY = 12_000.0  # number of blocks (10 minutes of motion) after which learned data have a third of their weight
OUTLIER = 4.0  # limit of a residual [standard deviations]; larger ones are reduced to it
TAIL = 1.5  # maximum ratio of the largest healthy error so far to the standard deviation of the noise
RELATIVE = 0.1  # assumed standard error of a predicted residual, as a fraction of this residual
CORRELATED = 4.0  # number of successive blocks that count as one, because their errors are correlated


class Blocks(NamedTuple):
    """Averages of reports over B short blocks of time, at times (B,) [s]: the residual (B, n); the commanded velocity
    and acceleration in this block and in the block before (B, 2, n); and the torque of a load divided by its usual size
    (B, n)."""

    times: Floats
    residual: Floats
    velocity: Floats
    acceleration: Floats
    torque: Floats


class HealthyError(NamedTuple):
    """The healthy residual of blocks (B, n), its standard deviation, and the standard deviation of the noise alone
    [rad, m]."""

    mean: Floats
    deviation: Floats
    noise: Floats


class HealthyResidual:
    """A model of the healthy residual of one arm. `noise`: the standard deviation of the noise [rad, m], by class of
    activity and joint; `learned`: the number of blocks from which it has learned."""

    def __init__(self, arm: RobotArm) -> None:
        self._arm, model = arm, arm.model
        self._most_velocity = np.array(model.max_velocity)
        self._most_acceleration = np.array(model.max_acceleration)
        n, prior = model.joint_count, np.array(PRIOR)
        k, classes = len(prior), len(ACTIVITY) + 1
        self._prior: Floats = np.diag(prior**-2)
        self._precision: Floats = np.zeros((n, k, k))
        self._product: Floats = np.zeros((n, k))
        self._coefficients: Floats = np.zeros((n, k))
        self._covariance: Floats = np.tile(np.diag(prior**2), (n, 1, 1))
        self._weight, self._squares = np.zeros((classes, n)), np.zeros((classes, n))
        self._peak = np.zeros((classes, n))
        self.noise: Floats = np.full((classes, n), START)
        self.learned = 0

        low, high = np.maximum(model.lower, -np.pi), np.minimum(model.upper, np.pi)
        poses = np.random.default_rng(0).uniform(low, high, (64, n))
        loads = np.array([load_torque(arm, tuple(q)) for q in poses.tolist()])
        usual: Floats = np.sqrt((loads**2).mean(axis=0))
        self._usual_load: Floats = np.maximum(usual, 1e-2 * usual.max())

    def load(self, joints: Floats, velocity: Floats, acceleration: Floats) -> Floats:
        """Return the torques (n,) of a load at joints, velocity and acceleration (n,), divided by their usual size."""
        q, qd, qdd = (tuple(row.tolist()) for row in (joints, velocity, acceleration))
        return load_torque(self._arm, q, qd, qdd) / self._usual_load

    def features(self, blocks: Blocks) -> Floats:
        """Return the features (B, n, k) of the linear model of the healthy residual, in the order of PRIOR."""
        rows = [np.ones_like(blocks.residual)]
        for place in (0, 1):
            v, a = blocks.velocity[:, place], blocks.acceleration[:, place]
            rows += [v, a, np.tanh(v / BEGUN)]
        return np.stack([*rows, blocks.torque], axis=-1)

    def _classes(self, blocks: Blocks) -> Rows:
        """Return the class of activity of each block (B,): the class of the most active joint, because this joint
        shakes the other joints."""
        speed = np.abs(blocks.velocity) / self._most_velocity
        change = np.abs(blocks.acceleration) / self._most_acceleration
        return np.asarray(np.searchsorted(ACTIVITY, np.maximum(speed, change).max(axis=(1, 2))))

    def predict(self, blocks: Blocks) -> HealthyError:
        """Return the healthy residual of blocks."""
        features = self.features(blocks)
        mean = np.einsum("bnk,nk->bn", features, self._coefficients)
        unknown = np.einsum("bnk,nkl,bnl->bn", features, self._covariance, features)
        noise = self.noise[self._classes(blocks)]
        moving = mean - self._coefficients[:, 0]  # the predicted residual without its offset, to which RELATIVE applies
        slow = STICK * np.exp(-((np.abs(blocks.velocity).min(axis=1) / SLOW) ** 2))
        return HealthyError(mean, np.sqrt(noise**2 + unknown + (RELATIVE * moving) ** 2 + slow**2), noise)

    def learn(self, blocks: Blocks) -> None:
        """Learn from blocks in which the arm was healthy."""
        predicted, features, classes = self.predict(blocks), self.features(blocks), self._classes(blocks)
        # scale errors to the noise alone: errors from unlearned coefficients are not noise
        errors = np.abs(blocks.residual - predicted.mean) * predicted.noise / predicted.deviation
        decay = 1.0 - len(blocks.times) / MEMORY
        weights = 1.0 / (CORRELATED * predicted.noise**2)
        self._precision = self._precision * decay + np.einsum("bnk,bn,bnl->nkl", features, weights, features)
        residual = np.clip(
            blocks.residual,
            predicted.mean - OUTLIER * predicted.deviation,
            predicted.mean + OUTLIER * predicted.deviation,
        )
        self._product = self._product * decay + np.einsum("bnk,bn,bn->nk", features, weights, residual)
        self._covariance = np.asarray(np.linalg.inv(self._precision + self._prior), dtype=np.float64)
        self._coefficients = np.einsum("nkl,nl->nk", self._covariance, self._product)
        for number in np.unique(classes):
            rows = classes == number
            known = self._weight[number] >= FEW
            these = np.where(known, np.minimum(errors[rows], OUTLIER * self.noise[number]), errors[rows])
            self._weight[number] = self._weight[number] * decay + len(these)
            self._squares[number] = self._squares[number] * decay + (these**2).sum(axis=0)
            self._peak[number] = np.maximum(self._peak[number] * decay, these.max(axis=0))
        # the noise must be large enough for the largest error so far
        own = np.maximum(np.sqrt(self._squares / np.maximum(self._weight, 1.0)), self._peak / TAIL)
        # assume more noise while only a few blocks have been learned
        noise = np.maximum(own, LEAST_NOISE) + START * FEW / (FEW + self._weight)
        self.noise[:] = np.minimum.accumulate(noise[::-1])[::-1]  # the noise must not decrease with activity
        self.learned += len(blocks.times)


def load_torque(arm: RobotArm, q: Joints, qd: Joints | None = None, qdd: Joints | None = None) -> Floats:
    """Return the joint torques (n,) for a mass of 1 kg at the flange [N m, N]: J^T (a - g), with the acceleration a of
    the flange (Siciliano et al., Robotics, 2009, 7.1). Z of the robot's base points up.
    """
    jacobian, force = np.array(arm.jacobian(q))[:3], np.array([0.0, 0.0, GRAVITY])
    if qd is not None and qdd is not None:
        force += jacobian @ np.array(qdd) + arm.acceleration_bias(q, qd)[:3]
    return np.asarray(jacobian.T @ force)
