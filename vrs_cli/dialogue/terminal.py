"""What runs, sessions and commands ask of a terminal."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from vrs_cli.dialogue.questions import Amendment, Confirmation, LineWanted, Parting
from vrs_cli.dialogue.replies import Reply
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.timeline import Timeline


class Console(Protocol):
    """What a running program needs of a terminal."""

    def type(self, text: str, newline: bool) -> None:
        """TYPE output."""

    def ask(self, question: LineWanted) -> str:
        """One line. Raises VrsError when there is no more input."""


class Terminal(Console, Protocol):
    """How a session talks to whoever drives it."""

    def show(self, reply: Reply) -> None:
        """An answer to a command."""

    def confirm(self, question: Confirmation) -> bool:
        """Yes or no. Where nobody can answer, the answer is no."""


@runtime_checkable
class Dialogue(Protocol):
    """A terminal with somebody at it, who can be asked and may watch a program run. A pipe is none."""

    def change(self, question: Amendment) -> str | None:
        """An answer; None when the question is left (Ctrl-C)."""

    def leave(self, question: Parting) -> bool:
        """Whether the user leaves: Y, EXIT or Ctrl-D once more."""

    def begin_progress(self) -> None:
        """A program starts."""

    def progress(self, clock: float) -> None:
        """It has come to that time of the robot's clock [s]."""

    def end_progress(self) -> None:
        """It has ended."""


@runtime_checkable
class Player(Protocol):
    """A terminal on which a trajectory can be animated."""

    def play(self, arm: RobotArm, timeline: Timeline) -> None:
        """Play it until the user leaves."""


@runtime_checkable
class Watched(Protocol):
    """A terminal where somebody may watch how a long file is read."""

    def begin_progress(self) -> None:
        """The file is opened."""

    def reading(self, path: str, share: float) -> None:
        """So much of it has been read, from 0 to 1."""

    def end_progress(self) -> None:
        """It has been read."""
