"""What a motion may ask of the joints, and of the tool."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from vrs_cli.kinematics.joints import Joints

# A blend of two straight lines has the deceleration of the first and the acceleration of the second at once, as in VAL:
# so the corner is rounded on its inside. What the joints can follow is checked after.
CORNER = 2.0


class JointLimits(NamedTuple):
    """What each joint may do in a motion [rad/s, rad/s2, rad/s3], and its range [rad]. `peak`: the velocity that it may
    never exceed.
    """

    velocity: Joints
    acceleration: Joints
    jerk: Joints = ()
    peak: Joints = ()
    lower: Joints = ()
    upper: Joints = ()


class ToolLimits(NamedTuple):
    """What the tool tip may do in a motion [m/s, m/s2, rad/s, rad/s2, m/s3, rad/s3].

    `blending`, `blending_jerk`: how many times these accelerations and jerks a blend out of a motion may have. `guide`,
    `guide_acceleration`, `guide_jerk`: of what joints that are too many follow, from rest [rad/s, rad/s2, rad/s3].
    """

    speed: float
    acceleration: float
    spin: float
    spin_acceleration: float
    jerk: float = inf
    spin_jerk: float = inf
    blending: float = CORNER
    blending_jerk: float = CORNER
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

    def slowed(self, velocity: float, acceleration: float, jerk: float = 1.0) -> ToolLimits:
        """Velocities divided by the first factor, accelerations by the second, jerks by the third."""
        return self._replace(
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

    def blended(self, acceleration: float, jerk: float) -> ToolLimits:
        """The acceleration of a blend divided by the first factor, its jerk by the second."""
        return self._replace(blending=self.blending / acceleration, blending_jerk=self.blending_jerk / jerk)
