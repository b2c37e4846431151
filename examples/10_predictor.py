"""A viewer for `vrs lab experiment --viewer examples/10_predictor.py:DoubleExponential`: double exponential smoothing.

J. J. LaViola, Double exponential smoothing: an alternative to Kalman filter-based predictive tracking, Eurographics
Workshop on Virtual Environments, 2003, pp. 199-206. It is as good as a Kalman filter for tracking, and much faster."""

import numpy as np

import vrs_cli as vrs

ALPHA = 0.6  # weight of a new frame


class DoubleExponential(vrs.Predictor):
    once = twice = None  # the frames, smoothed once and twice

    def receive(self, t, joints):  # a frame: the robot was at joints (n,) [rad; m] at t [s]
        if self.once is None:
            self.once = self.twice = joints
            self.period = 0.04
        else:
            self.period = t - self.last
            self.once = ALPHA * joints + (1 - ALPHA) * self.once
            self.twice = ALPHA * self.once + (1 - ALPHA) * self.twice
        self.last = t

    def predict(self, t):  # the position at t, from the smoothed position and velocity
        ahead = ALPHA / (1 - ALPHA) * (t - self.last) / self.period
        place = (2 + ahead) * self.once - (1 + ahead) * self.twice
        return np.clip(place, self.robot.lower, self.robot.upper)


if __name__ == "__main__":  # one joint swings; 25 frames a second arrive 0.2 s late
    robot = vrs.Robot("puma560").held.arm.model
    viewer, times = DoubleExponential(robot, 0.2), np.arange(0, 20, 0.04)
    places = np.outer(np.sin(times), [1, 0, 0, 0, 0, 0])
    seen = [viewer.receive(t, q) or viewer.predict(t + 0.2)[0] for t, q in zip(times[5:], places[5:], strict=True)]
    for name, shown in (("last frame", places[5:-5, 0]), ("smoothed", seen[:-5])):
        print(f"{name:10} {np.degrees(np.abs(shown - places[10:, 0]).mean()):.2f} deg")

# It prints:
#
#   last frame 7.34 deg
#   smoothed   1.32 deg
