"""Run policies of LeRobot on a robot of vrs, in this process or served, without importing LeRobot.

Names and units are LeRobot's (https://huggingface.co/docs/lerobot). The value of a motor goes from -100 to 100 over its
range, or is in degrees from the middle of the range (`use_degrees` of an SO-100). The gripper's value goes from 0
(closed) to 100. Action k of a chunk is due k / rate seconds after the observation that the policy has seen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from vrs_cli.api.location import Floats, Units, numbers
from vrs_cli.api.robot import Robot
from vrs_cli.errors import NotPossible, TooLate
from vrs_cli.values.results import FollowReport

MOTORS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")  # of an SO-100, base to hand
GRIPPER = "gripper"
FULL_RANGE = 100.0  # the value of a motor at the upper end of its range, and of an open gripper
RATE = 30.0  # actions a second, as LeRobot's own clients send them
HAND_LEAD_S = 0.05  # from the begin of a chunk to the first command of the hand, so that it is not too late


class LeRobotArm:
    """A robot with the names and units of a LeRobot arm; the Robot `robot` itself is not changed.

    `motors`: a name for each joint, from base to hand; `degrees`: values are in degrees, as with `use_degrees` of
    LeRobot; `reversed_motors`: motors that turn against the joint in the robot's file; `rate`: actions a second. Raises
    UsageError if the number of motors is not that of the joints, or if a reversed motor is not among the motors.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        motors: Sequence[str] = MOTORS,
        degrees: bool = False,
        reversed_motors: Sequence[str] = (),
        rate: float = RATE,
    ) -> None:
        self.robot, self.motors, self.rate = robot.in_units(Units.SI), tuple(motors), rate
        model = robot.held.arm.model
        if len(self.motors) != model.joint_count:
            raise NotPossible(
                f"{len(self.motors)} motors for the {model.joint_count} joints of {model.name}",
                "name one motor for each joint: motors=(...)",
            )
        if unknown := [name for name in reversed_motors if name not in self.motors]:
            raise NotPossible(f"there is no motor {unknown[0]}", f"the motors are {', '.join(self.motors)}")
        low, high = np.array(model.lower), np.array(model.upper)
        scale = np.full(len(low), np.radians(1.0)) if degrees else 0.5 * (high - low) / FULL_RANGE
        self._middle: Floats = 0.5 * (low + high)
        self._scale: Floats = scale * np.where([name in reversed_motors for name in self.motors], -1.0, 1.0)

    def observation(self, t: float | None = None) -> dict[str, float]:
        """Return what a policy sees of the arm at a time [s], or now: the values of the motors and of the gripper."""
        posture = self.robot.where(t)
        values = ((posture.joints - self._middle) / self._scale).tolist()
        hand = FULL_RANGE if bool(posture.hand) else 0.0
        return {f"{name}.pos": value for name, value in zip((*self.motors, GRIPPER), (*values, hand), strict=True)}

    def follow(
        self, actions: ArrayLike | Sequence[Mapping[str, float]], observed: float, *, arrival: float | None = None
    ) -> FollowReport:
        """Follow a chunk: `actions` are (N, motors), (N, motors + gripper), or N mappings of names to values.

        `observed`: the robot's time of the observation [s]. Actions whose time has passed are left out. In virtual time
        the robot does not wait for a policy: give the time at which the chunk comes as `arrival` [s]. The gripper opens
        or closes when its value passes the half. The errors in the report are in radians (metres).

        Raises UsageError if a motor is missing, ValueError, TypeError, and the errors of `Robot.follow`.
        """
        rows = self._rows(actions)
        times = observed + np.arange(len(rows)) / self.rate
        if arrival is not None:
            late = int(np.searchsorted(times, arrival))
            if late == len(times):
                raise TooLate(f"all {late} actions have passed", f"the chunk arrives at {arrival:.3f} s")
            times, rows = times[late:], rows[late:]
        count = len(self.motors)
        report = self.robot.follow(times, self._middle + self._scale * rows[:, :count])
        if rows.shape[1] > count:
            coming = slice(report.late, None)
            self._move_hand(np.maximum(times[coming], report.begin + HAND_LEAD_S), rows[coming, count])
        return report

    def _rows(self, actions: ArrayLike | Sequence[Mapping[str, float]]) -> Floats:
        """Return the values of N actions: (N, motors), or (N, motors + 1) if they have a gripper."""
        given = list(actions) if isinstance(actions, Sequence) else None
        if given and isinstance(given[0], Mapping):
            names = (*self.motors, GRIPPER) if f"{GRIPPER}.pos" in given[0] else self.motors
            try:
                actions = [[action[f"{name}.pos"] for name in names] for action in given]
            except KeyError as error:
                raise NotPossible(
                    f"an action without {error.args[0]}", f"it has {', '.join(map(str, given[0]))}"
                ) from None
        rows = numbers(cast("ArrayLike", actions), "actions")
        count = len(self.motors)
        if rows.ndim != 2 or rows.shape[1] not in (count, count + 1):
            raise ValueError(f"actions (N, {count}) or (N, {count + 1}) are wanted, not {rows.shape}")
        return rows

    def _move_hand(self, times: Floats, values: Floats) -> None:
        """Open and close the hand at the times at which the gripper's values (N,) pass the half."""
        before = bool(self.robot.where(float(times[0])).hand)
        for t, value in zip(times.tolist(), values.tolist(), strict=True):
            state = value >= 0.5 * FULL_RANGE
            if state != before:
                self.robot.do(f"{'OPENI' if state else 'CLOSEI'} AT {t:.6f}")
            before = state
