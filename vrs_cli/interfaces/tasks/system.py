"""What programs may ask of the system that runs them: their task, other tasks, the units they have attached."""

from __future__ import annotations

import re

from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.tasks.devices import Devices
from vrs_cli.interfaces.tasks.tasks import Tasks
from vrs_cli.language.run.effects import TaskState
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.operations import ABORTED, COMPLETED, EXECUTING, FAILED, IDLE, PAUSED
from vrs_cli.language.run.robot import System
from vrs_cli.language.words.kind import key_of
from vrs_cli.version import __version__

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

    def character(self, unit: int, wait: bool) -> int:
        return self._devices.character(self._tasks.current, unit, wait)
