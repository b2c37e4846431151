"""A session: one robot with its programs, variables and clock, driven line by line. It prints nothing itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from vrs_cli.engine.clock import Clock
from vrs_cli.engine.commands import Break
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import NoProgramSpecified, UsageError
from vrs_cli.interfaces.driver import Bounds, Console, Driver, Outcome, RunResult
from vrs_cli.interfaces.readings import Readings
from vrs_cli.interfaces.replies import Diagnosed, DiagnosticsReport, Reply
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, load_robot
from vrs_cli.language.ast import Assignment, DoInstruction, Instruction, Program, Section, Statement
from vrs_cli.language.diagnostics import Diagnostic
from vrs_cli.language.environment import Environment
from vrs_cli.language.runtime import Task


class Terminal(Console, Protocol):
    """How a session talks to whoever drives it."""

    def show(self, reply: Reply) -> None:
        """An answer to a command."""

    def confirm(self, question: str) -> bool:
        """Are you sure (Y/N)? Where nobody can answer, the answer is no."""
