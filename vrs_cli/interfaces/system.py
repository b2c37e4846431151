"""What programs may ask of the system that runs them: their task, other tasks, the units they have attached."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from vrs_cli import __version__
from vrs_cli.errors import IllegalValue
from vrs_cli.language.environment import key_of
from vrs_cli.language.events import TaskState
from vrs_cli.language.operations import ABORTED, COMPLETED, EXECUTING, FAILED, IDLE, PAUSED

if TYPE_CHECKING:
    from vrs_cli.interfaces.driver import Driver

RUN_STATES = {
    TaskState.RUNNING: EXECUTING,
    TaskState.PAUSED: PAUSED,
    TaskState.FAILED: FAILED,
    TaskState.HALTED: COMPLETED,
    TaskState.ABORTED: ABORTED,
    TaskState.COMPLETED: COMPLETED,
}
NOT_IN_MEMORY, NOT_EXECUTABLE, NOT_EXECUTING, RUNS, STOPPED = -1, -2, 0, 1, 2  # STATUS


class SystemReadings:
    """`language.environment.System` for a driver."""

    def __init__(self, driver: Driver) -> None:
        self.driver = driver

    def task(self) -> int:
        return self.driver.current

    def priority(self) -> int:
        track = self.driver.tasks.get(self.driver.current)
        return 0 if track is None else track.task.reactions.priority

    def run_state(self, task: int) -> int:
        track = self.driver.tasks.get(task)
        return IDLE if track is None else RUN_STATES[track.task.state]

    def program_status(self, name: str) -> int:
        stored = self.driver.environment.programs.get(key_of(name.strip()))
        if stored is None:
            return NOT_IN_MEMORY
        if not stored.analysis.executable:
            return NOT_EXECUTABLE
        track = self.driver.uses(stored.name)
        if track is None:
            return NOT_EXECUTING
        return RUNS if track.running else STOPPED

    def identity(self, component: int) -> float:
        digits = re.search(r"\d+", self.driver.engine.model.name)
        major, minor, *_ = __version__.split(".")
        parts = {1: float(digits[0]) if digits else 0.0, 2: 0.0, 3: float(major) + float(minor) / 100.0}
        if component not in parts:
            raise IllegalValue(f"ID({component})", "1 model of the robot, 2 serial number, 3 version of the system")
        return parts[component]

    def unit_status(self, unit: int) -> int:
        return self.driver.devices.status(self.driver.current, unit)

    def record_length(self, unit: int) -> int:
        return self.driver.devices.length(self.driver.current, unit)

    def character(self, unit: int, wait: bool) -> int:
        return self.driver.devices.character(self.driver.current, unit, wait)
