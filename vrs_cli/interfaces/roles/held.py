"""A robot in somebody's hands, here or afar: what supervisors stand on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol, TypeVar

from vrs_cli.engine.engine import Event
from vrs_cli.engine.feed import Subscription
from vrs_cli.interfaces.dialogue import Answers
from vrs_cli.interfaces.roles.observer import Watched
from vrs_cli.interfaces.roles.preview import Previewed
from vrs_cli.values.replies import Reply
from vrs_cli.values.results import Position
from vrs_cli.values.tagged import Act

T = TypeVar("T")


class Held(Watched, Protocol):
    """Any thread may call any method: one thing is done at a time, in the order in which it was asked for. What the
    robot refuses is raised as VrsError.
    """

    @property
    def rate(self) -> float | None:
        """How many seconds of the robot pass in one; None where time does not pass by itself."""

    @property
    def begins(self) -> float:
        """From when on the timeline is here [s]: of a robot afar only its last part is."""

    def past(self, times: Sequence[float]) -> tuple[Position, ...]:
        """Where the robot was at these times [s], however long ago."""

    def act(self, act: Act[T], answer: Answers | None = None, issued: float | None = None) -> T:
        """Do it; what comes of it. `answer`: to what is asked meanwhile. `issued`: t_iss [s], where not now."""

    def start(self, act: Act[T], issued: float | None = None) -> Callable[[], T]:
        """Send it, and do not wait; what is given back waits, and tells what has come of it."""

    def previewed(self) -> Previewed:
        """What the robot will do, with the commands that are on their way to it."""

    def say(self, line: str, answer: Answers) -> tuple[Reply, ...]:
        """A line of the prompt; what is answered, and typed. Raises LineRefused."""

    def type(self, text: str, answer: Answers) -> tuple[Reply, ...]:
        """Lines as they are typed at a prompt, programs among them; mistakes are among what is answered."""

    def abort(self) -> None:
        """Stop the program and the motion now, before all else that was asked for."""

    def save(self, path: Path) -> None:
        """Write the trajectory to a file here. Raises FileError."""

    def subscribe(self) -> Subscription[Event]:
        """The timeline, and every change of it from then on."""

    def close(self) -> object:
        """Let the robot go: nothing more is asked of it."""
