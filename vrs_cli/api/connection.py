"""Get a Robot in other ways than by its class: `connect` for one that is served, `%%vrs` in a notebook.

After `%load_ext vrs_cli` the text of a cell that begins with `%%vrs` goes to the prompt of the robot `robot`, which is
made if there is none. `%%vrs r` is for the Robot `r`, `%vrs LINE` for one line. The replies stand below the cell.
"""

from __future__ import annotations

import logging
import os
from collections.abc import MutableMapping
from pathlib import Path
from typing import Any

from vrs_cli.api.answers import Replies, figures, table
from vrs_cli.api.location import Units
from vrs_cli.api.robot import Robot
from vrs_cli.errors import hints_for_python
from vrs_cli.net.client import hello_of
from vrs_cli.net.mirror import WINDOW
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.render.blocks import Column, number_columns
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.questions import Amendment, OnScreen, Question

log = logging.getLogger("vrs_cli")


def connect(
    url: str,
    *,
    token: str | None = None,
    name: str = "",
    units: str | Units = Units.VAL,
    ca: str | Path | None = None,
    behind: float = 0.0,
    window: float = WINDOW,
) -> Robot:
    """Connect to the robot at an address: `ws://HOST:PORT`, `ws://HOST:PORT/robots/NAME` for one of several, `wss://`.

    `token`: identifies you to the server; if it is left out, the environment variable VRS_TOKEN is used. `name`: your
    name as other users see it, if the server has no tokens. `ca`: a file with the certificate of the server, or of the
    authority that signed it. `behind`: a motion with `at=t` begins this many seconds after t, so that a command which
    takes no longer on its way is never too late. `window`: how many seconds of the robot's past are kept here
    (`math.inf`: all of it); the server is asked for older times.

    After a break the connection is made again, and the logger "vrs_cli" tells of it; requests in between are refused.
    Raises NotPossible if `url` is no address, RequestRefused if no robot answers, and the errors of the server.
    """
    with hints_for_python():
        hello = hello_of(os.environ.get("VRS_TOKEN", "") if token is None else token, name=name, behind=behind)
        path = None if ca is None else Path(ca)
        return Robot.of(SocketPort.connect(url, hello, ca=path, window=window, told=log.warning), units)


USUAL_NAME = "robot"


def load_ipython_extension(shell: Any) -> None:
    """Add `%vrs` and `%%vrs` to an InteractiveShell of IPython, which calls this for `%load_ext vrs_cli`."""

    def vrs(line: str, cell: str | None = None) -> Replies | None:
        """Type VAL-II: `%vrs LINE`, or a cell that begins with `%%vrs` or `%%vrs NAME_OF_ROBOT`."""
        name, text = (USUAL_NAME, line) if cell is None else (line.strip() or USUAL_NAME, cell)
        return _robot(shell.user_ns, name).prompt(text, ask) or None

    def ask(question: Question) -> str | None:
        """Let the user type an answer below the cell. Leave a proposed location unchanged."""
        return None if isinstance(question, Amendment | OnScreen) else input(question.text)

    shell.register_magic_function(vrs, "line_cell", "vrs")
    shell.display_formatter.formatters["text/html"].for_type(Timeline, _timeline_html)


def _robot(names: MutableMapping[str, object], name: str) -> Robot:
    """Return the robot of a variable; make the usual one. Raises TypeError if the variable is no Robot."""
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
