"""What programs may ask of the system that runs them: their task, other tasks, the units that they have attached."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.tasks.devices import Devices
from vrs_cli.interfaces.tasks.tasks import Tasks
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.effects import TaskState
from vrs_cli.language.run.operations import ABORTED, COMPLETED, EXECUTING, FAILED, IDLE, PAUSED
from vrs_cli.language.run.robot import ROBOT_NUMBER, System
from vrs_cli.language.words.values import key_of
from vrs_cli.version import __version__

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine
    from vrs_cli.language.run.environment import Environment

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
