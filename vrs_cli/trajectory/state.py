"""Define the states of joints and tool in which motions begin, the moving targets of steering, and the limits of a
motion.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from msgspec import Struct, structs

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, Vector, axis_angle, compose, inverse, length

NEGLIGIBLE = 1e-12  # a smaller displacement or velocity counts as 0 [rad, m, rad/s, m/s]
STEADY = 1e-9  # a smaller acceleration counts as 0 [rad/s2, m/s2]
# Factor by which the tool may exceed its acceleration limit in a blend of two straight lines: it decelerates along the
# first line while it accelerates along the second, as in VAL, so the path cuts the corner. Later code checks whether
# the joints can follow.
BLEND_FACTOR = 2.0


class FrozenValue(Struct, frozen=True):
    """The base class of values in modules that the optional build compiles to C. The compiler ignores arguments of
    classes, so that only a base class can make them immutable.
    """


class JointState(NamedTuple):
    """The positions, velocities and accelerations of the joints [rad, rad/s, rad/s2].

    `acceleration` is empty if it is 0 or may jump (LSPB).
    """

    joints: Joints
    velocity: Joints
    acceleration: Joints = ()

    @property
    def at_rest(self) -> bool:
        """True if the joints are at rest: they have neither a velocity nor an acceleration from which a motion must
        continue.
        """
        return max(map(abs, self.velocity), default=0.0) <= NEGLIGIBLE and not self.accelerating

    @property
    def accelerating(self) -> bool:
        """True if the joints have an acceleration from which a motion must continue."""
        return max(map(abs, self.acceleration), default=0.0) > STEADY

    @property
    def present_acceleration(self) -> Joints:
        """The acceleration from which a motion must continue [rad/s2]; zeros if there is none."""
        return self.acceleration if self.accelerating else (0.0,) * len(self.joints)


class GuideState(Struct, frozen=True):
    """The state of a guide (`segment.Guide`: a weighted sum of joints that determines how redundant joints move): its
    value, its rate and acceleration, and `end`, its value at the end of the motion.
    """

    weights: Joints
    value: float
    end: float
    rate: float = 0.0
    acceleration: float = 0.0


class ToolState(Struct, frozen=True, dict=True):
    """T_robot_tool with the velocity of the tool tip [m/s] and its angular velocity in the robot's frame [rad/s].

    `acceleration` [m/s2] and `spin_rate` [rad/s2]: the derivatives of the two velocities; zero if they may jump (LSPB).
    `guides`: the states of the guides of redundant joints, which move with the tool.
    """

    pose: Transform
    velocity: Vector
    spin: Vector
    acceleration: Vector = (0.0, 0.0, 0.0)
    spin_rate: Vector = (0.0, 0.0, 0.0)
    guides: tuple[GuideState, ...] = ()

    @property
    def at_rest(self) -> bool:
        """True if the tool is at rest: it has neither a velocity nor an acceleration from which a motion must
        continue.
        """
        return length(self.velocity) <= NEGLIGIBLE and length(self.spin) <= NEGLIGIBLE and not self.accelerating

    @property
    def accelerating(self) -> bool:
        """True if the tool has an acceleration from which a motion must continue."""
        return length(self.acceleration) > STEADY or length(self.spin_rate) > STEADY

    def turn_to(self, target: Transform) -> tuple[Vector, float]:
        """Return axis and angle [rad] of the turn to T_robot_tool `target`. The last result is kept, since a line is
        often planned again with other limits.
        """
        known: tuple[Transform, tuple[Vector, float]] | None = self.__dict__.get("turn")
        if known is None or known[0] is not target:
            known = self.__dict__["turn"] = target, axis_angle(compose(inverse(self.pose), target))
        return known[1]


class Target(Struct, frozen=True):
    """The desired joint positions at this instant [rad] and their velocities [rad/s]. `lower` and `upper`: the part of
    their ranges in which the joints must stay; empty for the whole ranges.
    """

    joints: Joints
    velocity: Joints
    lower: Joints = ()
    upper: Joints = ()


class JointLimits(Struct, frozen=True):
    """The velocity, acceleration and jerk limits of each joint in a motion [rad/s, rad/s2, rad/s3], and its range from
    `lower` to `upper` [rad]. `peak`: the velocity that the joint may never exceed.
    """

    velocity: Joints
    acceleration: Joints
    jerk: Joints = ()
    peak: Joints = ()
    lower: Joints = ()
    upper: Joints = ()


class ToolLimits(Struct, frozen=True):
    """The limits of the tool tip in a motion [m/s, m/s2, rad/s, rad/s2, m/s3, rad/s3].

    `blending`, `blending_jerk`: the factors by which a blend that starts in motion may exceed acceleration and jerk.
    `guide`, `guide_acceleration`, `guide_jerk`: the limits of the guides of redundant joints [rad/s, rad/s2, rad/s3];
    they hold for motions that start at rest.
    """

    speed: float
    acceleration: float
    spin: float
    spin_acceleration: float
    jerk: float = inf
    spin_jerk: float = inf
    blending: float = BLEND_FACTOR
    blending_jerk: float = BLEND_FACTOR
    guide: float = inf
    guide_acceleration: float = inf
    guide_jerk: float = inf

    @property
    def blend_acceleration(self) -> float:
        return self.blending * self.acceleration

    @property
    def blend_spin_acceleration(self) -> float:
        return self.blending * self.spin_acceleration

    @property
    def blend_jerk(self) -> float:
        return self.blending_jerk * self.jerk

    @property
    def blend_spin_jerk(self) -> float:
        return self.blending_jerk * self.spin_jerk

    def slow_down(self, velocity: float, acceleration: float, jerk: float = 1.0) -> ToolLimits:
        """Return limits with the velocities divided by the first factor, the accelerations by the second, the jerks by
        the third.
        """
        return structs.replace(
            self,
            speed=self.speed / velocity,
            acceleration=self.acceleration / acceleration,
            spin=self.spin / velocity,
            spin_acceleration=self.spin_acceleration / acceleration,
            jerk=self.jerk / jerk,
            spin_jerk=self.spin_jerk / jerk,
            guide=self.guide / velocity,
            guide_acceleration=self.guide_acceleration / acceleration,
            guide_jerk=self.guide_jerk / jerk,
        )

    def ease_blend(self, acceleration: float, jerk: float) -> ToolLimits:
        """Return limits with the acceleration of a blend divided by the first factor, its jerk by the second."""
        return structs.replace(self, blending=self.blending / acceleration, blending_jerk=self.blending_jerk / jerk)
