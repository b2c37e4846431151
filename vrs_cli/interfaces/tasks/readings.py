"""What programs may ask of the robot, the observer's side of the engine at the present instant; and of the system that
runs them: their task, other tasks, the units they have attached."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from vrs_cli.engine.parameters import FULL_SPEED
from vrs_cli.engine.targets import check_joint_limits
from vrs_cli.errors import IllegalValue, JointOutOfRange, LocationTooClose, MotionError
from vrs_cli.interfaces.tasks.devices import Devices
from vrs_cli.interfaces.tasks.tasks import Tasks
from vrs_cli.kinematics.configuration import Configuration
from vrs_cli.kinematics.joints import Joints, put_inside
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.language.run.effects import TaskState
from vrs_cli.language.run.operations import ABORTED, COMPLETED, EXECUTING, FAILED, IDLE, PAUSED
from vrs_cli.language.run.robot import ROBOT_NUMBER, System
from vrs_cli.language.words.values import key_of
from vrs_cli.version import __version__

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine
    from vrs_cli.language.run.environment import Environment

# INRANGE: why a location is out of reach, as bits: joints 1 to 6, then too close and too far, then joints 7 and on
# (V+ Keyword Reference, INRANGE, names such bits; the numbers are ours)
TOO_CLOSE_BIT, TOO_FAR_BIT = 1 << 6, 1 << 7
JOINTS_BELOW, BITS_BETWEEN = 6, 2

NO_POWER, PROGRAM_CONTROL = 2, 7  # STATE(1)
NEVER_MOVED, MOVING, AT_REST = 0, 1, 2  # STATE(2)
COMPUTER_CONTROL = 5  # STATE(3): the last of the modes that the V+ 12.4 release notes list
NO_FLAGS, AUTOMATIC = 0, 1  # STATE(4), whose bit 3 is the emergency stop, and STATE(5), as drivers for ROS read them
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

    def acceleration(self) -> float:
        return self.engine.settings.acceleration * FULL_SPEED

    def configuration(self, joints: Joints) -> Configuration:
        return self.engine.arm.configuration(joints)

    def state(self, number: int) -> float:
        tell = STATES.get(number)
        if tell is None:
            raise IllegalValue(f"STATE({number})", f"it tells {', '.join(map(str, STATES))}")
        return float(tell(self))

    def _motion_state(self) -> int:
        if self.moving():
            return MOVING
        return AT_REST if len(self.engine.timeline) > 1 else NEVER_MOVED

    def _motion_span(self) -> tuple[float, float] | None:
        """When the motion that is under way begins and ends [s]; None where the robot stands."""
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

    def _time_left(self) -> float:
        """Until the motion under way ends [s]."""
        span = self._motion_span()
        return 0.0 if span is None else span[1] - self.engine.now

    def _done(self) -> float:
        """How much of the motion under way is done [%]; all of it where the robot stands."""
        span = self._motion_span()
        return 100.0 if span is None else 100.0 * (self.engine.now - span[0]) / (span[1] - span[0])

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
        except MotionError as error:
            return _reason(error)
        return 0

    def place(self, joints: Joints) -> Transform:
        return self.engine.world_pose(joints)

    def solve(self, T_world_tool: Transform, near: Joints, asked: Configuration | None) -> tuple[Joints, int]:
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


# What STATE tells, by its argument. 1 to 3: V+ 12.4 release notes. 9 is above 0 in motion, as drivers for ROS expect;
# that it counts seconds, and what 10 is, is from memory of the eV+ reference.
STATES: Mapping[int, Callable[[Readings], float]] = {
    1: lambda it: PROGRAM_CONTROL if it.engine.settings.switch("POWER") else NO_POWER,
    2: Readings._motion_state,
    3: lambda _it: COMPUTER_CONTROL,
    4: lambda _it: NO_FLAGS,
    5: lambda _it: AUTOMATIC,
    9: Readings._time_left,
    10: Readings._done,
}


# --- the system --------------------------------------------------------------------------------------------------

RUN_STATES = {
    TaskState.RUNNING: EXECUTING,
    TaskState.PAUSED: PAUSED,
    TaskState.FAILED: FAILED,
    TaskState.HALTED: COMPLETED,
    TaskState.ABORTED: ABORTED,
    TaskState.COMPLETED: COMPLETED,
}
NOT_IN_MEMORY, NOT_EXECUTABLE, NOT_EXECUTING, RUNS, STOPPED = -1, -2, 0, 1, 2  # STATUS


class SystemReadings(System):
    """The system of the tasks of a robot."""

    def __init__(self, engine: Engine, environment: Environment, tasks: Tasks, devices: Devices) -> None:
        self._robot, self._environment, self._tasks, self._devices = engine.model.name, environment, tasks, devices
        self._engine = engine
        self._latch: tuple[Transform, Joints] | None = None
        self._latched = False
        environment.signals.listeners.append(self._signal_changed)

    def _signal_changed(self, signal: int, on: bool) -> None:
        if on and signal == self._engine.settings.parameters["LATCH.SIGNAL"]:
            position = self._engine.position()
            self._latch, self._latched = (position.T_world_tool, position.joints), True

    def latched(self) -> bool:
        came, self._latched = self._latched, False
        return came

    def latch(self) -> tuple[Transform, Joints] | None:
        return self._latch

    def task(self) -> int:
        return self._tasks.current

    def priority(self) -> int:
        track = self._tasks.get(self._tasks.current)
        return 0 if track is None else track.task.reactions.priority

    def run_state(self, task: int) -> int:
        track = self._tasks.get(task)
        return IDLE if track is None else RUN_STATES[track.task.state]

    def event(self, task: int) -> bool:
        track = self._tasks.get(task)
        return track is not None and track.event

    def robot_of(self, task: int) -> int:
        track = self._tasks.get(task)
        return ROBOT_NUMBER if track is not None and self._tasks.owns(track) else 0

    def program_status(self, name: str) -> int:
        stored = self._environment.programs.get(key_of(name.strip()))
        if stored is None:
            return NOT_IN_MEMORY
        if not stored.analysis.executable:
            return NOT_EXECUTABLE
        track = self._tasks.uses(stored.name)
        if track is None:
            return NOT_EXECUTING
        return RUNS if track.running else STOPPED

    def identity(self, component: int) -> float:
        digits = re.search(r"\d+", self._robot)
        major, minor, *_ = __version__.split(".")
        parts = {1: float(digits[0]) if digits else 0.0, 2: 0.0, 3: float(major) + float(minor) / 100.0}
        if component not in parts:
            raise IllegalValue(f"ID({component})", "1 model of the robot, 2 serial number, 3 version of the system")
        return parts[component]

    def unit_status(self, unit: int) -> int:
        return self._devices.status(self._tasks.current, unit)

    def record_length(self, unit: int) -> int:
        return self._devices.length(self._tasks.current, unit)

    def connection(self, unit: int) -> int | None:
        return self._devices.connection(self._tasks.current, unit)

    def begin_reading(self) -> None:
        self._devices.begin_reading()

    def put_back(self) -> None:
        self._devices.put_back()

    def character(self, unit: int, wait: bool) -> int:
        return self._devices.character(self._tasks.current, unit, wait)
