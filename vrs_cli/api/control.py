"""Control a robot from Python: conditions of its programs (limits, folder, cell, inputs), and streams of targets."""

from __future__ import annotations

import time
from collections.abc import Iterable
from math import degrees, inf
from pathlib import Path
from typing import TypeAlias

from msgspec import Struct, field, structs

from vrs_cli.api.location import Units
from vrs_cli.engine.clock import RobotClock
from vrs_cli.errors import FileError
from vrs_cli.files.cell_file import read_cell
from vrs_cli.files.opening import Folder
from vrs_cli.files.timed_lines import listed_signals, read_signals
from vrs_cli.interfaces.dragging import DRAG, TICK
from vrs_cli.interfaces.port.local import LocalPort
from vrs_cli.interfaces.port.port import Console
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.station import Conditions
from vrs_cli.interfaces.steering import LONGEST, STEER
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.joints import Joints, largest_change
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.signals import NO_INPUTS, Cell
from vrs_cli.values.acts import DragTool, Steer
from vrs_cli.values.hand import Shortfall

Signals: TypeAlias = str | Path | Iterable[tuple[float, int, bool]]
CURRENT_FOLDER = Folder(closed=True, disclosed=True)


def conditions_of(
    limits: Limits | None, folder: str | Path | None, cell: str | Path | Cell | None, signals: Signals | None
) -> Conditions | None:
    """Return the conditions of a call; None if nothing is given. Raises TypeError, NonexistentFile, FileError,
    FileDamaged.
    """
    if limits is None and folder is None and cell is None and signals is None:
        return None
    if not isinstance(limits, Limits | None):
        raise TypeError(f"limits: a Limits is wanted, as vrs.Limits(max_steps=1000) makes one, not {limits!r}")
    if signals is None:
        inputs = NO_INPUTS
    else:
        inputs = read_signals(str(signals)) if isinstance(signals, str | Path) else listed_signals(signals)
    return Conditions(
        limits=limits,
        folder=None if folder is None else _folder(Path(folder)),
        cell=read_cell(str(cell)) if isinstance(cell, str | Path) else cell,
        inputs=inputs,
    )


def _folder(path: Path) -> Folder:
    """Return a folder as the root of a program's files. Raises FileError if the path is no folder."""
    if not path.is_dir():
        raise FileError(f"{path} is no folder", "folder= names a folder that is there")
    return structs.replace(CURRENT_FOLDER, root=path.resolve())


def local_port(
    model: RobotModel,
    conditions: Conditions | None,
    start: Joints | None = None,
    clock: RobotClock | None = None,
) -> LocalPort:
    """Make a robot in this process. Its programs have finite limits and the files of the current folder, unless
    conditions say otherwise. `start`: joints [rad, m].
    """
    given = conditions or Conditions()
    console = Console()
    session = Session(
        console,
        model,
        start=start,
        clock=clock,
        limits=given.limits or Limits(),
        folder=given.folder or CURRENT_FOLDER,
        advice=_advice,
    )
    if given.cell is not None:
        session.driver.surround(given.cell)
    session.driver.inputs = given.inputs
    return LocalPort(session, console)


def _advice(option: str) -> str:
    """Return the hint of the message for a limit that a program has reached."""
    if option == "signals":
        return "signals= says when inputs change"
    return f"limits=Limits({option}=...) gives it more"


class ProgramFolders(Struct):
    """The folder of the file that each program is from. `fixed`: all programs have the folder of the robot instead."""

    fixed: bool
    _folders: dict[str, Folder] = field(default_factory=dict)

    def put(self, programs: Iterable[str], folder: Path | None) -> None:
        """Note the folder of the file that these programs are from; None: they are from no file. Raises FileError."""
        for name in programs:
            self._folders.pop(name.lower(), None)
            if folder is not None:
                self._folders[name.lower()] = _folder(folder)

    def conditions(self, program: str, given: Conditions | None) -> Conditions | None:
        """Return the conditions for the run of a program: those of the call, and the folder of its file."""
        own = self._folders.get(program.lower())
        if self.fixed or own is None or (given is not None and given.folder is not None):
            return given
        return structs.replace(given or Conditions(), folder=own)


RATES = 1.0 / LONGEST, 1000.0  # lowest and highest number of targets a second
MAX_RATE_AT_REST = 1e-6  # a joint that moves by less in a step [rad, m], and is slower [1/s], is at rest
MAX_ARRIVAL_S = 10.0  # of the robot's clock, for a dragged tool to come to its last target


class Dragged(Struct, frozen=True):
    """The distance of a dragged tool from its target, and the limits that hold the tool back.

    `distance`: [mm], or [m] in SI; `angle`: [degrees], or [rad]; `limits`: a sentence for each limit that holds the
    tool: the end of a joint's range, the reach, a singularity, the speed of a joint, a contact. Without limits the tool
    is at its target, or on its way there.
    """

    distance: float
    angle: float
    limits: tuple[str, ...]
    units: Units

    @classmethod
    def of(cls, held: Shortfall, model: RobotModel, units: Units) -> Dragged:
        """Return the distance of a tool from its target in these units."""
        val = units is Units.VAL
        limits = tuple(hold.describe(model) for hold in held.holds)
        return cls(
            1000.0 * held.away if val else held.away, degrees(held.turned) if val else held.turned, limits, units
        )

    @property
    def held(self) -> bool:
        """Return True if a limit holds the tool away from its target."""
        return bool(self.limits)

    def __repr__(self) -> str:
        if not self.limits:
            return "<Dragged: nothing holds the tool>"
        digits = 2 if self.units is Units.VAL else 5
        off = f"{self.distance:.{digits}f} {self.units.length} and {self.angle:.{digits}f} {self.units.angle} away"
        return f"<Dragged: {off}: {'; '.join(self.limits)}>"


class Streams:
    """Sends one robot a stream of targets: joints to steer to, or locations to drag the tool to.

    In virtual time each target lets the clock go on; in real time each waits for its time. Times are those of the
    robot's clock [s].
    """

    def __init__(self) -> None:
        self._last: tuple[float, Joints] | None = None  # time and joints of the last target
        self._moves = False  # more than one target of joints was sent
        self._wish: Transform | None = None  # the target of the dragged tool
        self._wish_time = -inf  # when that was sent

    def steer(self, robot: Supervisor, joints: Joints, rate: float, speed: float | None) -> None:
        """Send joints [rad, m], at the earliest 1 / `rate` [s] after the target before. `speed`: 0 to 1."""
        step = 1.0 / rate
        if self._last is not None:
            self._pace(robot, self._last[0] + step)
        now, last = robot.now, self._last
        since = LONGEST + 1.0 if last is None else max(now - last[0], step)
        self._moves, self._wish = since <= LONGEST, None
        velocity = None
        if last is not None and self._moves:
            velocity = tuple([(b - a) / since for a, b in zip(last[1], joints, strict=True)])
        self._last = None  # if the robot refuses the target, the stream has ended
        robot.send(Steer(joints, velocity, step, speed))
        self._last = now, joints

    def drag(self, robot: Supervisor, T_world_tool: Transform) -> Shortfall:
        """Send a target for the tool, at the earliest a TICK after the one before."""
        self._pace(robot, self._wish_time + TICK)
        self._last, self._wish = None, None
        self._wish_time = robot.now
        held = robot.act(DragTool(T_world_tool))
        self._wish = T_world_tool
        return held

    def arrive(self, robot: Supervisor) -> None:
        """Come to rest at the last target, if the robot still follows the stream."""
        last, wish, timeline = self._last, self._wish, robot.timeline
        self._last = self._wish = None
        text = timeline[len(timeline) - 1].motion.text
        if last is not None and text == STEER and self._moves:
            robot.act(Steer(last[1]))
        elif wish is not None and text == DRAG:
            until, moves = robot.now + MAX_ARRIVAL_S, True
            while moves and robot.now < until:
                self.drag(robot, wish)
                here, end = robot.at(), robot.at(robot.timeline.end)
                moves = max(*map(abs, here.velocity), largest_change(here.joints, end.joints)) >= MAX_RATE_AT_REST
            self.release(robot)

    def release(self, robot: Supervisor) -> None:
        """End the streams."""
        self._last = None
        if self._wish is not None:
            self._wish = None
            robot.act(DragTool())

    @staticmethod
    def _pace(robot: Supervisor, due: float) -> None:
        """Wait until the robot's clock shows a time [s], if it is in real time."""
        rate = robot.followed.rate
        if rate is not None and (left := due - robot.now) > 0.0:
            time.sleep(left / rate)
