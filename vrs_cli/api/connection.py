"""Connect robots in Python: `connect` to a server, `%%vrs` in a notebook, `LeRobotArm` for policies of LeRobot.

After `%load_ext vrs_cli` a notebook cell that begins with `%%vrs` goes to the prompt of the Robot `robot`, which is
created if it does not exist. `%%vrs r` is for the Robot `r`, `%vrs LINE` for one line. The replies appear below the
cell.

LeRobot itself is not imported. Names and units are LeRobot's (https://huggingface.co/docs/lerobot). The value of a
motor ranges from -100 to 100 over its range, or is in degrees from the middle of the range (`use_degrees` of an
SO-100). The gripper's value ranges from 0 (closed) to 100. Action k of a chunk is due k / rate seconds after the
observation from which the policy computed the chunk.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from vrs_cli.api.answers import Replies, figures, table
from vrs_cli.api.location import Floats, Units, numbers
from vrs_cli.api.robot import Robot
from vrs_cli.errors import NotPossible, TooLate, hints_for_python
from vrs_cli.net.client import hello_of
from vrs_cli.net.mirror import WINDOW
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.render.blocks import Column, number_columns
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.questions import Amendment, OnScreen, Question
from vrs_cli.values.results import FollowReport

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
    """Connect to the robot at an address: `ws://HOST:PORT`, `ws://HOST:PORT/robots/NAME` for one of several robots, or
    `wss://...`.

    `token`: identifies you to the server; if it is left out, the environment variable VRS_TOKEN is used. `name`: your
    name as other users see it, if the server has no tokens. `ca`: a file with the certificate of the server, or of the
    authority that signed it. `behind`: a motion with `at=t` begins this many seconds after t, so that a command that
    takes at most this long to arrive is never too late. `window`: how many seconds of the robot's past are kept in this
    process (`math.inf`: all); older times are requested from the server. A lost connection is restored, and the logger
    "vrs_cli" reports this; requests in between are refused. Raises NotPossible if `url` is not an address,
    RequestRefused if no robot answers, and the errors of the server.
    """
    with hints_for_python():
        hello = hello_of(os.environ.get("VRS_TOKEN", "") if token is None else token, name=name, behind=behind)
        path = None if ca is None else Path(ca)
        return Robot.of(SocketPort.connect(url, hello, ca=path, window=window, notify=log.warning), units)


USUAL_NAME = "robot"


def load_ipython_extension(shell: Any) -> None:
    """Add `%vrs` and `%%vrs` to an InteractiveShell of IPython, which calls this for `%load_ext vrs_cli`."""

    def vrs(line: str, cell: str | None = None) -> Replies | None:
        """Execute VAL-II as if typed at the prompt: `%vrs LINE`, or a cell that begins with `%%vrs` or `%%vrs
        NAME_OF_ROBOT`."""
        name, text = (USUAL_NAME, line) if cell is None else (line.strip() or USUAL_NAME, cell)
        if name == USUAL_NAME and name not in shell.user_ns:
            shell.user_ns[name] = Robot()
        robot = shell.user_ns.get(name)
        if not isinstance(robot, Robot):
            raise TypeError(f"{name} is no Robot: {name} = vrs.Robot() makes it one")
        return robot.prompt(text, ask) or None

    def ask(question: Question) -> str | None:
        """Let the user type an answer below the notebook cell. Accept a proposed location unchanged, without asking."""
        return None if isinstance(question, Amendment | OnScreen) else input(question.text)

    shell.register_magic_function(vrs, "line_cell", "vrs")
    shell.display_formatter.formatters["text/html"].for_type(Timeline, _timeline_html)


def _timeline_html(timeline: Timeline) -> str:
    columns = (Column("motion"), *number_columns("from", "to"), Column("phase"), Column("space"))

    def row(index: int) -> tuple[str, ...]:
        segment = timeline[index]
        times = figures((segment.start, segment.finish))
        return segment.motion.text, *times, segment.phase.value, segment.motion.kind.space

    return table(repr(timeline), columns, len(timeline), row)


MOTORS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")  # motors of an SO-100
GRIPPER = "gripper"
FULL_RANGE = 100.0  # the value of a motor at the upper end of its range, and of an open gripper
RATE = 30.0  # [1/s] actions per second, as LeRobot's own clients send them
HAND_LEAD_S = 0.05  # [s] minimum delay of hand commands after the start of a chunk, so that they are in time


class LeRobotArm:
    """A robot with the names and units of a LeRobot arm; the Robot `robot` itself is not changed.

    `motors`: a name for each joint, from base to hand; `degrees`: values are in degrees, as with `use_degrees` of
    LeRobot; `reversed_motors`: motors that turn opposite to the joint in the robot's file; `rate`: actions per second.
    Raises UsageError if the numbers of motors and joints differ, or if a reversed motor is not among the motors.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        motors: Sequence[str] = MOTORS,
        degrees: bool = False,
        reversed_motors: Sequence[str] = (),
        rate: float = RATE,
    ) -> None:
        self.robot, self.motors, self.rate = robot.in_units(Units.SI), tuple(motors), rate
        model = robot.held.arm.model
        if len(self.motors) != model.joint_count:
            raise NotPossible(
                f"{len(self.motors)} motors for the {model.joint_count} joints of {model.name}",
                "name one motor for each joint: motors=(...)",
            )
        if unknown := [name for name in reversed_motors if name not in self.motors]:
            raise NotPossible(f"there is no motor {unknown[0]}", f"the motors are {', '.join(self.motors)}")
        low, high = np.array(model.lower), np.array(model.upper)
        scale = np.full(len(low), np.radians(1.0)) if degrees else 0.5 * (high - low) / FULL_RANGE
        self._middle: Floats = 0.5 * (low + high)
        self._scale: Floats = scale * np.where([name in reversed_motors for name in self.motors], -1.0, 1.0)

    def observation(self, t: float | None = None) -> dict[str, float]:
        """Return what a policy observes of the arm at a time [s], or now: the values of the motors and of the
        gripper."""
        posture = self.robot.where(t)
        values = ((posture.joints - self._middle) / self._scale).tolist()
        hand = FULL_RANGE if bool(posture.hand) else 0.0
        return {f"{name}.pos": value for name, value in zip((*self.motors, GRIPPER), (*values, hand), strict=True)}

    def follow(
        self, actions: ArrayLike | Sequence[Mapping[str, float]], observed: float, *, arrival: float | None = None
    ) -> FollowReport:
        """Follow a chunk: `actions` are (N, motors), (N, motors + gripper), or N mappings of names to values.

        `observed`: the time of the observation by the robot's clock [s]. Actions whose time has passed are left out. In
        virtual time the robot does not wait for a policy: give the time at which the chunk arrives as `arrival` [s].
        The gripper opens or closes when its value crosses 50. The errors in the report are in radians (metres).

        Raises UsageError if a motor is missing, ValueError, TypeError, and the errors of `Robot.follow`.
        """
        rows = self._rows(actions)
        times = observed + np.arange(len(rows)) / self.rate
        if arrival is not None:
            late = int(np.searchsorted(times, arrival))
            if late == len(times):
                raise TooLate(f"all {late} actions have passed", f"the chunk arrives at {arrival:.3f} s")
            times, rows = times[late:], rows[late:]
        count = len(self.motors)
        report = self.robot.follow(times, self._middle + self._scale * rows[:, :count])
        if rows.shape[1] > count:
            coming = slice(report.late, None)
            self._move_hand(np.maximum(times[coming], report.begin + HAND_LEAD_S), rows[coming, count])
        return report

    def _rows(self, actions: ArrayLike | Sequence[Mapping[str, float]]) -> Floats:
        """Return the values of N actions: (N, motors), or (N, motors + 1) if they have a gripper."""
        given = list(actions) if isinstance(actions, Sequence) else None
        if given and isinstance(given[0], Mapping):
            names = (*self.motors, GRIPPER) if f"{GRIPPER}.pos" in given[0] else self.motors
            try:
                actions = [[action[f"{name}.pos"] for name in names] for action in given]
            except KeyError as error:
                raise NotPossible(
                    f"an action without {error.args[0]}", f"it has {', '.join(map(str, given[0]))}"
                ) from None
        rows = numbers(cast("ArrayLike", actions), "actions")
        count = len(self.motors)
        if rows.ndim != 2 or rows.shape[1] not in (count, count + 1):
            raise ValueError(f"actions (N, {count}) or (N, {count + 1}) are wanted, not {rows.shape}")
        return rows

    def _move_hand(self, times: Floats, values: Floats) -> None:
        """Open or close the hand at the times at which the gripper's values (N,) cross half of their range."""
        before = bool(self.robot.where(float(times[0])).hand)
        for t, value in zip(times.tolist(), values.tolist(), strict=True):
            state = value >= 0.5 * FULL_RANGE
            if state != before:
                self.robot.do(f"{'OPENI' if state else 'CLOSEI'} AT {t:.6f}")
            before = state
