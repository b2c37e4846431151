"""The designer: motion commands, each with its issue time, its execution time and its speed."""

from __future__ import annotations

from collections.abc import Callable

from vrs_cli.values.acts import Go, Goal
from vrs_cli.values.motion import Target

Performs = Callable[[Go, float | None], None]  # a motion, and when it was issued [s] (None: now)


class Designer:
    """Commands motions. `performs`: the robot, which does one thing at a time."""

    def __init__(self, performs: Performs) -> None:
        self.perform = performs

    def move(
        self,
        target: Target,
        *,
        straight: bool = False,
        issued: float | None = None,
        executed: float | None = None,
        speed: float | None = None,
        text: str = "",
    ) -> None:
        """Go to a target: joint-interpolated, or `straight`. `issued` and `executed` are t_iss and t_exec [s], `speed`
        is v, the fraction in (0, 1] of nominal speed. Without `executed` it begins after the last motion.

        Raises MotionError, IllegalValue, FileError.
        """
        self.perform(Go(Goal.of(target), straight, executed, speed, text), issued)
