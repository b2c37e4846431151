"""States that motions begin in: of the joints, and of the tool; and targets that move."""

from __future__ import annotations

from typing import NamedTuple

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, Vector, length

NEGLIGIBLE = 1e-12  # a displacement or velocity that is none [rad, m, rad/s, m/s]
STEADY = 1e-9  # an acceleration that is none [rad/s2, m/s2]


class JointState(NamedTuple):
    """Joints, their velocities and accelerations [rad, rad/s, rad/s2].

    `acceleration` empty: none, or one that may jump (LSPB).
    """

    joints: Joints
    velocity: Joints
    acceleration: Joints = ()

    @property
    def at_rest(self) -> bool:
        return all(abs(v) <= NEGLIGIBLE for v in self.velocity) and not self.accelerating

    @property
    def accelerating(self) -> bool:
        """Whether there is an acceleration to carry on with."""
        return any(abs(a) > STEADY for a in self.acceleration)

    @property
    def present_acceleration(self) -> Joints:
        """The acceleration to carry on with; zeros where there is none."""
        return self.acceleration if self.accelerating else (0.0,) * len(self.joints)


class GuideState(NamedTuple):
    """The value of a guide (`segment.Guide`), its rate and acceleration, and the value that it goes to."""

    weights: Joints
    value: float
    end: float
    rate: float = 0.0
    acceleration: float = 0.0


class ToolState(NamedTuple):
    """T_robot_tool with the velocity of the tool tip [m/s] and its angular velocity in the robot's frame [rad/s].

    `acceleration` [m/s2] and `spin_rate` [rad/s2] of both: zero where they may jump (LSPB). `guides`: of joints that
    are too many, which go with the tool.
    """

    pose: Transform
    velocity: Vector
    spin: Vector
    acceleration: Vector = (0.0, 0.0, 0.0)
    spin_rate: Vector = (0.0, 0.0, 0.0)
    guides: tuple[GuideState, ...] = ()

    @property
    def at_rest(self) -> bool:
        return length(self.velocity) <= NEGLIGIBLE and length(self.spin) <= NEGLIGIBLE and not self.accelerating

    @property
    def accelerating(self) -> bool:
        """Whether there is an acceleration to carry on with."""
        return length(self.acceleration) > STEADY or length(self.spin_rate) > STEADY


class Target(NamedTuple):
    """Where the joints are to be now [rad], and how fast that place moves [rad/s]; `lower` and `upper`: the part of
    their ranges in which they stay, all of it where these are empty.
    """

    joints: Joints
    velocity: Joints
    lower: Joints = ()
    upper: Joints = ()
