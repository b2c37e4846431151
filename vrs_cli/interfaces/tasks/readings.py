"""What programs may ask of the robot: the observer's side of the engine, at the present instant."""

from __future__ import annotations

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.targets import check_joint_limits
from vrs_cli.errors import IllegalValue, JointOutOfRange, LocationTooClose, MotionError
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform

# INRANGE: why a location is out of reach, as bits: joints 1 to 6, then too close and too far, then joints 7 and on
# (V+ Keyword Reference, INRANGE, names such bits; the numbers are ours)
TOO_CLOSE_BIT, TOO_FAR_BIT = 1 << 6, 1 << 7
JOINTS_BELOW, BITS_BETWEEN = 6, 2

NO_POWER, PROGRAM_CONTROL = 2, 7  # STATE(1)
NEVER_MOVED, MOVING, STOPPED = 0, 1, 2  # STATE(2)
MONITOR_SPEED, PROGRAM_SPEED, MOTION_SPEED = 1, 2, 3  # SPEED(n)


class Readings:
    """`RobotReadings` of an engine."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine

    @property
    def dof(self) -> int:
        return self.engine.model.joint_count

    def here(self) -> Transform:
        return self.engine.position().T_world_tool

    def destination(self) -> Transform:
        return self.engine.destination(self.engine.end).T_world_tool

    def joints(self) -> Joints:
        return self.engine.position().joints

    def destination_joints(self) -> Joints:
        return self.engine.destination(self.engine.end).joints

    def tool(self) -> Transform:
        return self.engine.frames.tool

    def base(self) -> Transform:
        return self.engine.frames.base

    def hand(self) -> float:
        return self.engine.position().hand

    def time(self) -> float:
        return self.engine.now

    def speed(self, number: int) -> float:
        settings = self.engine.settings
        if number == MONITOR_SPEED:
            return settings.monitor_speed
        if number == PROGRAM_SPEED:
            return settings.speed.always.value
        if number == MOTION_SPEED:
            return settings.speed.present.value
        raise IllegalValue(f"SPEED({number})", "1 monitor speed, 2 program speed, 3 speed of the next motion")

    def state(self, number: int) -> float:
        if number == 1:
            return float(PROGRAM_CONTROL if self.engine.settings.switch("POWER") else NO_POWER)
        if number == 2:
            if self.moving():
                return float(MOVING)
            return float(STOPPED if len(self.engine.timeline) > 1 else NEVER_MOVED)
        raise IllegalValue(f"STATE({number})", "1 how the robot is controlled, 2 whether it moves")

    def moving(self) -> bool:
        return self.engine.position().moving

    def switch(self, name: str) -> bool:
        return self.engine.settings.switch(name)

    def parameter(self, name: str) -> float | str:
        return self.engine.settings.parameter(name)

    def in_range(self, place: Transform | Joints) -> int:
        try:
            if isinstance(place, Transform):
                self.engine.joints_for(place)
            else:
                check_joint_limits(self.engine.model, place)
        except JointOutOfRange as error:
            return 1 << (error.joint - 1 + (BITS_BETWEEN if error.joint > JOINTS_BELOW else 0))
        except LocationTooClose:
            return TOO_CLOSE_BIT
        except MotionError:
            return TOO_FAR_BIT
        return 0
