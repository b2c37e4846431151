"""A stand-in for joint_trajectory_controller of ros2_control, written from its published documentation.

No code of it is used. From "Trajectory Representation": points are joined by cubics where both have velocities, by
quintics where both have accelerations too; before the first point the arm goes by a spline from where it was when the
trajectory came; after the last point it stays there. From "Trajectory Replacement": a trajectory takes the place of the
one before at once; with `allow_trajectory_replacement` one that is stamped in the future waits, one alone, and a newer
one that waits takes its place. From the checks that are described: names, lengths and rising times, an end that has
passed, and a last velocity that is not zero, are refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import isfinite
from typing import Any, NamedTuple

ROUNDING = 1e-6  # [s] of times of ROS in doubles
State = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]


class Refusal(Exception):
    """A trajectory that the controller refuses."""


class Trajectory(NamedTuple):
    """Times of ROS [s], and at each the positions, velocities and accelerations of all joints, in its own order."""

    times: tuple[float, ...]
    positions: tuple[tuple[float, ...], ...]
    velocities: tuple[tuple[float, ...], ...]
    accelerations: tuple[tuple[float, ...], ...]


def seconds(time: Mapping[str, int]) -> float:
    return time["sec"] + time["nanosec"] * 1e-9


def spline(a: State, b: State, h: float, s: float) -> State:
    """The cubic or quintic from state a to state b over h [s], at s."""
    rows = []
    for joint, (p, q) in enumerate(zip(a[0], b[0], strict=True)):
        u, v = a[1][joint], b[1][joint]
        if a[2] and b[2]:
            x, y = a[2][joint], b[2][joint]
            c = (p, u, x / 2)
            d = q - p - u * h - x * h * h / 2
            e, f = v - u - x * h, y - x
            c += ((10 * d - 4 * e * h + f * h * h / 2) / h**3,)
            c += ((-15 * d + 7 * e * h - f * h * h) / h**4,)
            c += ((6 * d - 3 * e * h + f * h * h / 2) / h**5,)
        else:
            c = (p, u, (3 * (q - p) / h - 2 * u - v) / h, (2 * (p - q) / h + u + v) / h**2)
        rows.append(
            (
                sum(one * s**k for k, one in enumerate(c)),
                sum(k * one * s ** (k - 1) for k, one in enumerate(c) if k),
                sum(k * (k - 1) * one * s ** (k - 2) for k, one in enumerate(c) if k > 1),
            )
        )
    position, velocity, acceleration = zip(*rows, strict=True)
    return position, velocity, acceleration


class Controller:
    """The arm that the controller moves is exactly where it says. `received`: all messages, refused ones too."""

    def __init__(self, names: Sequence[str], joints: Sequence[float], *, replaces: bool) -> None:
        self.names, self.replaces = tuple(names), replaces
        still = (0.0,) * len(self.names)
        self._rest: State = (tuple(joints), still, still)
        self._active: tuple[Trajectory, float, State] | None = None
        self._waiting: Trajectory | None = None
        self.received: list[Mapping[str, Any]] = []
        self.stopped = False

    def stop(self, now: float) -> None:
        """Stop in an emergency at a time of ROS [s]: the arm stands, and refuses all trajectories until `release`."""
        joints, still = self.state(now)[0], (0.0,) * len(self.names)
        self._rest, self._active, self._waiting, self.stopped = (joints, still, still), None, None, True

    def release(self) -> None:
        """End the emergency stop: the arm stands, and takes trajectories again."""
        self.stopped = False

    def receive(self, message: Mapping[str, Any], now: float) -> None:
        """Take a trajectory_msgs/msg/JointTrajectory at a time of ROS [s]. Raises Refusal."""
        self.received.append(message)
        self._hand_over(now)
        if self.stopped:
            raise Refusal("Can't accept new action goals. Controller is not running.")
        trajectory = self._check(message, now)
        stamp = seconds(message["header"]["stamp"])
        if self.replaces and stamp > now:
            self._waiting = trajectory
        else:
            self._active = (trajectory, now, self.state(now))

    def _check(self, message: Mapping[str, Any], now: float) -> Trajectory:
        if sorted(message["joint_names"]) != sorted(self.names):
            raise Refusal("Joints on incoming trajectory don't match the controller joints.")
        if not message["points"]:
            raise Refusal("Empty trajectory received.")
        stamp = seconds(message["header"]["stamp"]) or now
        times = tuple(stamp + seconds(point["time_from_start"]) for point in message["points"])
        if any(b <= a for a, b in pairwise(times)):
            raise Refusal("Time between points is not strictly increasing")
        if times[-1] < now:
            raise Refusal("Received trajectory with non-zero start time that ends in the past")
        order = [message["joint_names"].index(name) for name in self.names]
        columns = []
        for key in ("positions", "velocities", "accelerations"):
            column = []
            for point in message["points"]:
                row = point[key]
                if len(row) != len(order) and (row or key != "accelerations"):
                    raise Refusal(f"Mismatch between joint_names and {key}")
                if not all(map(isfinite, row)):
                    raise Refusal(f"{key} is not finite")
                column.append(tuple(row[place] for place in order) if row else ())
            columns.append(tuple(column))
        if any(abs(v) > 1e-9 for v in columns[1][-1]):
            raise Refusal("Velocity of last trajectory point is not zero")
        return Trajectory(times, *columns)

    def _hand_over(self, now: float) -> None:
        waiting = self._waiting
        if waiting is not None and waiting.times[0] <= now:
            self._waiting, self._active = None, (waiting, now, self._sample(waiting.times[0]))

    def state(self, now: float) -> State:
        """Return positions, velocities and accelerations at a time of ROS [s], not before the last one asked for."""
        self._hand_over(now)
        return self._sample(now)

    def _sample(self, now: float) -> State:
        if self._active is None:
            return self._rest
        one, came, before = self._active
        h = one.times[0] - came
        if now < one.times[0] and h > ROUNDING:
            return spline(before, (one.positions[0], one.velocities[0], one.accelerations[0]), h, max(now - came, 0.0))
        place = max(sum(t <= now for t in one.times) - 1, 0)
        if place == len(one.times) - 1:
            still = (0.0,) * len(self.names)
            return one.positions[-1], still, still
        a, b = ((one.positions[i], one.velocities[i], one.accelerations[i]) for i in (place, place + 1))
        return spline(a, b, one.times[place + 1] - one.times[place], now - one.times[place])
