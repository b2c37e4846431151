"""What programs may ask of the robot, and of the system that runs them."""

from __future__ import annotations

from typing import Protocol

from vrs_cli.errors import UnitNotAttached
from vrs_cli.kinematics.configuration import Configuration
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform
from vrs_cli.trajectory.instant import on_grid

ROBOT_NUMBER = 1  # of SELECT ROBOT: there is one
TICK = on_grid(0.028)  # [s] a WAIT is tested, and a busy loop seen to be one, every trajectory tick of VAL-II


class RobotReadings(Protocol):
    """What a program may ask of the robot, always at the task's present instant. Metres, radians, seconds."""

    @property
    def dof(self) -> int: ...
    def here(self) -> Transform:
        """T_world_tool now."""

    def destination(self) -> Transform:
        """T_world_tool where the last motion ends."""

    def joints(self) -> Joints: ...
    def destination_joints(self) -> Joints: ...
    def tool(self) -> Transform:
        """T_flange_tool."""

    def base(self) -> Transform:
        """T_robot_world."""

    def hand(self) -> float:
        """1 open, 0 closed."""

    def time(self) -> float:
        """The robot clock [s]."""

    def speed(self, number: int) -> float: ...
    def acceleration(self) -> float:
        """In percent of the usual one."""

    def configuration(self, joints: Joints) -> Configuration: ...
    def place(self, joints: Joints) -> Transform:
        """T_world_tool of joints."""

    def solve(self, T_world_tool: Transform, near: Joints, asked: Configuration | None) -> tuple[Joints, int]:
        """The joints of a place in a configuration (that of `near` where none is asked), each within its range, and
        0 or the reasons why they do not reach it as bits.
        """

    def state(self, number: int) -> float: ...
    def moving(self) -> bool: ...
    def switch(self, name: str) -> bool:
        """Raises UsageError for a switch that does not exist."""

    def parameter(self, name: str) -> float | str:
        """Raises UsageError for a parameter that does not exist."""

    def in_range(self, place: Transform | Joints) -> int:
        """0 where the place can be reached, otherwise the reasons as bits."""


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
