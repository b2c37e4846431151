"""What programs may ask of the robot (the engine at the present instant), and of the system that runs the programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from vrs_cli.engine.parameters import FULL_SPEED
from vrs_cli.engine.targets import check_joint_limits
from vrs_cli.errors import IllegalValue, JointOutOfRange, LocationTooClose, MotionError, UnitNotAttached
from vrs_cli.kinematics.joints import Configuration, Joints, put_inside
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.trajectory.instant import on_grid

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine

ROBOT_NUMBER = 1  # of SELECT ROBOT: there is one
TICK = on_grid(0.028)  # [s] a WAIT is tested, and a busy loop seen to be one, every trajectory tick of VAL-II

# INRANGE: why a location is out of reach, as bits: joints 1 to 6, then too close and too far, then joints 7 and on
# (V+ Keyword Reference, INRANGE, names such bits; the numbers are ours)
TOO_CLOSE_BIT, TOO_FAR_BIT = 1 << 6, 1 << 7
JOINTS_BELOW, BITS_BETWEEN = 6, 2

NO_POWER, PROGRAM_CONTROL = 2, 7  # STATE(1)
NEVER_MOVED, MOVING, AT_REST = 0, 1, 2  # STATE(2)
COMPUTER_CONTROL = 5  # STATE(3): the last of the modes that the V+ 12.4 release notes list
NO_FLAGS, AUTOMATIC = 0, 1  # STATE(4), whose bit 3 is the emergency stop, and STATE(5), as drivers for ROS read them


class RobotReadings:
    """What a program may ask of the robot, always at the present instant of the task. Metres, radians, seconds."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine

    @property
    def dof(self) -> int:
        return self.engine.model.joint_count

    def here(self) -> Transform:
        """T_world_tool now."""
        return self.engine.position().T_world_tool

    def destination(self) -> Transform:
        """T_world_tool where the last motion ends."""
        return self.engine.destination(self.engine.end).T_world_tool

    def joints(self) -> Joints:
        return self.engine.position().joints

    def destination_joints(self) -> Joints:
        return self.engine.destination(self.engine.end).joints

    def tool(self) -> Transform:
        """T_flange_tool."""
        return self.engine.frames.tool

    def base(self) -> Transform:
        """T_robot_world."""
        return self.engine.frames.base

    def hand(self) -> float:
        """1 open, 0 closed."""
        return self.engine.position().hand

    def time(self) -> float:
        """The robot clock [s]."""
        return self.engine.now

    def speed(self, number: int) -> float:
        settings = self.engine.settings
        speeds = (settings.monitor_speed, settings.speed.always.value, settings.speed.present.value)
        if not 1 <= number <= len(speeds):
            raise IllegalValue(f"SPEED({number})", "1 monitor speed, 2 program speed, 3 speed of the next motion")
        return speeds[number - 1]

    def acceleration(self) -> float:
        """In percent of the usual one."""
        return self.engine.settings.acceleration * FULL_SPEED

    def configuration(self, joints: Joints) -> Configuration:
        return self.engine.arm.configuration(joints)

    def state(self, number: int) -> float:
        tell = STATES.get(number)
        if tell is None:
            raise IllegalValue(f"STATE({number})", f"it tells {', '.join(map(str, STATES))}")
        return float(tell(self))

    def motion_span(self) -> tuple[float, float] | None:
        """When the present motion begins and ends [s]; None where the robot stands."""
        if not self.moving():
            return None
        timeline = self.engine.timeline
        first = last = timeline.index_at(self.engine.now)
        number = timeline[first].motion.number
        while first and timeline[first - 1].motion.number == number:
            first -= 1
        while last + 1 < len(timeline) and timeline[last + 1].motion.number == number:
            last += 1
        return timeline[first].start, timeline[last].finish

    def moving(self) -> bool:
        return self.engine.position().moving

    def switch(self, name: str) -> bool:
        """Raises UsageError for a switch that does not exist."""
        return self.engine.settings.switch(name)

    def parameter(self, name: str) -> float | str:
        """Raises UsageError for a parameter that does not exist."""
        return self.engine.settings.parameter(name)

    def in_range(self, place: Transform | Joints) -> int:
        """0 where the place can be reached, otherwise the reasons as bits."""
        try:
            if isinstance(place, Transform):
                self.engine.joints_for(place)
            else:
                check_joint_limits(self.engine.model, place)
        except MotionError as error:
            return _reason(error)
        return 0

    def place(self, joints: Joints) -> Transform:
        """T_world_tool of joints."""
        return self.engine.world_pose(joints)

    def solve(self, T_world_tool: Transform, near: Joints, asked: Configuration | None) -> tuple[Joints, int]:
        """Return the joints of a place in a configuration (that of `near` where none is asked), each within its range,
        and 0 or the reasons why the joints do not reach the place, as bits.
        """
        engine = self.engine
        way = engine.arm.configuration(near) if asked is None else asked
        try:
            return engine.joints_for(T_world_tool, near, way), 0
        except JointOutOfRange as error:
            T_robot_flange = compose(compose(engine.frames.base, T_world_tool), inverse(engine.frames.tool))
            found = engine.arm.branch_joints(T_robot_flange, way, near) or near
            return put_inside(found, engine.model.lower, engine.model.upper), _reason(error)
        except MotionError as error:
            return near, _reason(error)


def _reason(error: MotionError) -> int:
    """Why a place is out of reach, as a bit."""
    if isinstance(error, JointOutOfRange):
        return 1 << (error.joint - 1 + (BITS_BETWEEN if error.joint > JOINTS_BELOW else 0))
    return TOO_CLOSE_BIT if isinstance(error, LocationTooClose) else TOO_FAR_BIT


def _motion_state(it: RobotReadings) -> int:
    if it.moving():
        return MOVING
    return AT_REST if len(it.engine.timeline) > 1 else NEVER_MOVED


def _time_left(it: RobotReadings) -> float:
    """The time until the present motion ends [s]."""
    span = it.motion_span()
    return 0.0 if span is None else span[1] - it.engine.now


def _done(it: RobotReadings) -> float:
    """How much of the present motion is done [%]; all of it where the robot stands."""
    span = it.motion_span()
    return 100.0 if span is None else 100.0 * (it.engine.now - span[0]) / (span[1] - span[0])


# What STATE tells, by its argument. 1 to 3: V+ 12.4 release notes. 9 is above 0 in motion, as drivers for ROS expect;
# that it counts seconds, and what 10 is, is from memory of the eV+ reference.
STATES: Mapping[int, Callable[[RobotReadings], float]] = {
    1: lambda it: PROGRAM_CONTROL if it.engine.settings.switch("POWER") else NO_POWER,
    2: _motion_state,
    3: lambda _it: COMPUTER_CONTROL,
    4: lambda _it: NO_FLAGS,
    5: lambda _it: AUTOMATIC,
    9: _time_left,
    10: _done,
}


# --- the system --------------------------------------------------------------------------------------------------


class System:
    """What a program may ask of the system that runs it; always for the task that asks.

    This one is that of a program that runs by itself: one task, and no devices.
    """

    def task(self) -> int:
        """Its number; -1 for a line of the prompt."""
        return 0

    def priority(self) -> int:
        return 0

    def run_state(self, task: int) -> int:  # noqa: ARG002 (for others to look at, as are those below)
        """What a task does (`operations.IDLE` and the like)."""
        return 0

    def event(self, task: int) -> bool:  # noqa: ARG002
        """Whether the event of a task is set."""
        return False

    def robot_of(self, task: int) -> int:  # noqa: ARG002
        """The number of the robot that a task has attached; 0 where it has none."""
        return ROBOT_NUMBER

    def latched(self) -> bool:
        """Whether the signal that latches the place of the robot has come since this was asked last."""
        return False

    def latch(self) -> tuple[Transform, Joints] | None:
        """T_world_tool and the joints when that signal came last; None where it has not come yet."""
        return None

    def program_status(self, name: str) -> int:  # noqa: ARG002
        """What a program does (`STATUS` in the table of functions)."""
        return 0

    def identity(self, component: int) -> float:  # noqa: ARG002
        """Raises IllegalValue for a component that there is not."""
        return 0.0

    def unit_status(self, unit: int) -> int:  # noqa: ARG002
        """Of the last operation on a logical unit: 1, or a code."""
        return UnitNotAttached.code

    def record_length(self, unit: int) -> int:  # noqa: ARG002
        """Characters of the last record of a logical unit."""
        return 0

    def connection(self, unit: int) -> int | None:  # noqa: ARG002
        """The handle of what the last READ of a logical unit has told of; None where the unit has no connections."""
        return None

    def begin_reading(self) -> None:
        """A step with GETC begins."""

    def put_back(self) -> None:
        """The step is done again when something has come: what it has taken of that is there again."""

    def character(self, unit: int, wait: bool) -> int:  # noqa: ARG002
        """The code of the next character of a logical unit, or of what went wrong. Raises LineMissing."""
        return UnitNotAttached.code
