"""VAL-II in a notebook: after `%load_ext vrs_cli` a cell that begins with `%%vrs` is typed at the prompt of a robot.

`%%vrs` alone is about the robot `robot`, which it makes where there is none; `%%vrs r` about the Robot `r`. What is
answered and typed stands below the cell, errors too. `%vrs LINE` is one line.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from typing import Any

from vrs_cli.api.answers import Replies, figures, table
from vrs_cli.api.robot import Robot
from vrs_cli.render.blocks import Column, number_columns
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.questions import Amendment, OnScreen, Question

USUAL_NAME = "robot"


def load_ipython_extension(shell: Any) -> None:
    """Add the words to an InteractiveShell of IPython, which calls this for `%load_ext vrs_cli`."""

    def vrs(line: str, cell: str | None = None) -> Replies | None:
        """Type VAL-II: `%vrs LINE`, or a cell that begins with `%%vrs` or `%%vrs NAME_OF_ROBOT`."""
        name, text = (USUAL_NAME, line) if cell is None else (line.strip() or USUAL_NAME, cell)
        return _robot(shell.user_ns, name).prompt(text, _ask) or None

    shell.register_magic_function(vrs, "line_cell", "vrs")
    shell.display_formatter.formatters["text/html"].for_type(Timeline, _timeline_html)


def _ask(question: Question) -> str | None:
    """An answer that is typed below the cell; a location is taken as it is."""
    return None if isinstance(question, Amendment | OnScreen) else input(question.text)


def _robot(names: MutableMapping[str, object], name: str) -> Robot:
    """The robot of a variable. Raises TypeError where that is none."""
    if name == USUAL_NAME and name not in names:
        names[name] = Robot()
    robot = names.get(name)
    if not isinstance(robot, Robot):
        raise TypeError(f"{name} is no Robot: {name} = vrs.Robot() makes it one")
    return robot


def _timeline_html(timeline: Timeline) -> str:
    columns = (Column("motion"), *number_columns("from", "to"), Column("phase"), Column("space"))

    def row(index: int) -> tuple[str, ...]:
        segment = timeline[index]
        times = figures((segment.start, segment.finish))
        return segment.motion.text, *times, segment.phase.value, segment.motion.kind.space

    return table(repr(timeline), columns, len(timeline), row)
