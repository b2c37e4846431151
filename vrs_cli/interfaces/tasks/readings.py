"""What programs may ask of the robot, the observer's side of the engine at the present instant; and of the system that
runs them: their task, other tasks, the units they have attached."""

from __future__ import annotations

import re

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.targets import check_joint_limits
from vrs_cli.errors import IllegalValue, JointOutOfRange, LocationTooClose, MotionError
from vrs_cli.interfaces.tasks.devices import Devices
from vrs_cli.interfaces.tasks.tasks import Tasks
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.effects import TaskState
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.operations import ABORTED, COMPLETED, EXECUTING, FAILED, IDLE, PAUSED
from vrs_cli.language.run.robot import System
from vrs_cli.language.words.values import key_of
from vrs_cli.version import __version__

# INRANGE: why a location is out of reach, as bits: joints 1 to 6, then too close and too far, then joints 7 and on
# (V+ Keyword Reference, INRANGE, names such bits; the numbers are ours)
TOO_CLOSE_BIT, TOO_FAR_BIT = 1 << 6, 1 << 7
JOINTS_BELOW, BITS_BETWEEN = 6, 2

NO_POWER, PROGRAM_CONTROL = 2, 7  # STATE(1)
NEVER_MOVED, MOVING, AT_REST = 0, 1, 2  # STATE(2)
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
            return float(AT_REST if len(self.engine.timeline) > 1 else NEVER_MOVED)
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

    def __init__(self, robot: str, environment: Environment, tasks: Tasks, devices: Devices) -> None:
        self._robot, self._environment, self._tasks, self._devices = robot, environment, tasks, devices

    def task(self) -> int:
        return self._tasks.current

    def priority(self) -> int:
        track = self._tasks.get(self._tasks.current)
        return 0 if track is None else track.task.reactions.priority

    def run_state(self, task: int) -> int:
        track = self._tasks.get(task)
        return IDLE if track is None else RUN_STATES[track.task.state]

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

    def begin_reading(self) -> None:
        self._devices.begin_reading()

    def put_back(self) -> None:
        self._devices.put_back()

    def character(self, unit: int, wait: bool) -> int:
        return self._devices.character(self._tasks.current, unit, wait)
