"""Control a robot from Python: the conditions of program runs (limits, folder, cell, inputs), and streams
of targets.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from math import degrees, inf
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import TypeAlias

from msgspec import Struct, field, structs

from vrs_cli.api.location import Units
from vrs_cli.engine.clock import RobotClock
from vrs_cli.engine.settings import Settings
from vrs_cli.engine.targets import select
from vrs_cli.errors import FileError, RequestRefused, TooLate, VrsError
from vrs_cli.files.cell_file import read_cell
from vrs_cli.files.opening import Folder
from vrs_cli.files.timed_lines import listed_signals, read_signals
from vrs_cli.interfaces.port.local import LocalPort
from vrs_cli.interfaces.port.port import Console
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.station import Conditions
from vrs_cli.interfaces.streams import DRAG_TICK, DRAGGING, STEERING, Following, velocity_between
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.joints import Joints, largest_change
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform, compose
from vrs_cli.language.run.signals import NO_INPUTS, Cell
from vrs_cli.values.acts import DragTool, FollowChunk, Steer
from vrs_cli.values.dragging import Shortfall
from vrs_cli.values.results import FollowReport

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
    """Return a folder as the root of a program's files. Raises FileError if the path is not a folder."""
    if not path.is_dir():
        raise FileError(f"{path} is no folder", "folder= names a folder that is there")
    return structs.replace(CURRENT_FOLDER, root=path.resolve())


def local_port(
    model: RobotModel,
    conditions: Conditions | None,
    start: Joints | None = None,
    clock: RobotClock | None = None,
) -> LocalPort:
    """Create a robot in this process. By default its programs have finite limits, and use files in the current folder.
    `start`: joints [rad, m]."""
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
    session.driver.add_inputs(given.inputs)
    return LocalPort(session, console)


def _advice(option: str) -> str:
    """Return the hint for a limit that a program has reached."""
    return "signals= says when inputs change" if option == "signals" else f"limits=Limits({option}=...) gives it more"


class ProgramFolders(Struct):
    """Remembers for each program the folder of the file from which it was loaded. `fixed`: all programs use the folder
    of the robot instead."""

    fixed: bool
    _folders: dict[str, Folder] = field(default_factory=dict)

    def put(self, programs: Iterable[str], folder: Path | None) -> None:
        """Record the folder of the file from which these programs were loaded; None: they were not loaded from a file.
        Raises FileError."""
        for name in programs:
            self._folders.pop(name.lower(), None)
            if folder is not None:
                self._folders[name.lower()] = _folder(folder)

    def conditions(self, program: str, given: Conditions | None) -> Conditions | None:
        """Return the conditions for the run of a program: the conditions of the call, and the folder of the program's
        file.
        """
        own = self._folders.get(program.lower())
        if self.fixed or own is None or (given is not None and given.folder is not None):
            return given
        return structs.replace(given or Conditions(), folder=own)


RATES = 1.0 / STEERING.longest, 1000.0  # [1/s] minimum and maximum number of targets per second
MAX_RATE_AT_REST = 1e-6  # maximum motion per step [rad, m] and maximum speed [rad/s, m/s] of a joint that is at rest
MAX_ARRIVAL_S = 10.0  # [s] maximum time of the robot's clock for a dragged tool to reach its last target


class Dragged(Struct, frozen=True):
    """The distance of a dragged tool from its target, and the limits that hold the tool back.

    `distance`: [mm], or [m] in SI; `angle`: [degrees], or [rad]; `limits`: a sentence for each limit that holds the
    tool: the end of a joint's range, the reach, a singularity, the speed of a joint, a contact. If `limits` is empty,
    the tool is at its target, or moving to it.
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

    In virtual time each target advances the clock; in real time each target waits for its time. Times are those of the
    robot's clock [s].
    """

    def __init__(self) -> None:
        self._last: tuple[float, Joints] | None = None  # time and joints of the last target
        self._moves = False  # whether more than one target of joints was sent
        self._wish: Transform | None = None  # the target of the dragged tool
        self._wish_time = -inf  # [s] the time at which that target was sent

    def steer(self, robot: Supervisor, joints: Joints, rate: float, speed: float | None) -> None:
        """Send joints [rad, m] as a target, at least 1 / `rate` [s] after the previous target. `speed`: 0 to 1."""
        step = 1.0 / rate
        if self._last is not None:
            self._pace(robot, self._last[0] + step)
        now, last = robot.now, self._last
        since = STEERING.longest + 1.0 if last is None else max(now - last[0], step)
        self._moves, self._wish = since <= STEERING.longest, None
        velocity = velocity_between(last[1], joints, since) if last is not None and self._moves else None
        self._last = None  # stays None if the robot refuses the target, so that the stream ends
        robot.send(Steer(joints, velocity, step, speed))
        self._last = now, joints

    def drag(self, robot: Supervisor, T_world_tool: Transform) -> Shortfall:
        """Send a target for the tool, at least DRAG_TICK [s] after the previous one."""
        self._pace(robot, self._wish_time + DRAG_TICK)
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
        if last is not None and text == STEERING.text and self._moves:
            robot.act(Steer(last[1]))
        elif wish is not None and text == DRAGGING.text:
            until, moves = robot.now + MAX_ARRIVAL_S, True
            while moves and robot.now < until:
                self.drag(robot, wish)
                here, end = robot.at(), robot.at(robot.timeline.end)
                moves = max(*map(abs, here.velocity), largest_change(here.joints, end.joints)) >= MAX_RATE_AT_REST
            self.release(robot)

    def release(self, robot: Supervisor) -> None:
        """End both streams, of joints and of the tool."""
        self._last = None
        if self._wish is not None:
            self._wish = None
            robot.act(DragTool())

    @staticmethod
    def _pace(robot: Supervisor, due: float) -> None:
        """Wait until the robot's clock shows the time `due` [s], if this clock runs in real time."""
        rate = robot.followed.rate
        if rate is not None and (left := due - robot.now) > 0.0:
            time.sleep(left / rate)


# --- streams in chunks, over delays -----------------------------------------------------------------------------------

CHUNK_S = 0.25  # [s] targets are sent in chunks of this duration


class ChunkSteering:
    """Sends targets to a served robot, in chunks of time-stamped joints. The robot reaches a target `lead` [s] after
    the target's time in the stream, so that the target arrives in time despite delays. A thread waits for the answers;
    `refused` is the first error that ends the stream."""

    def __init__(self, robot: Supervisor, lead: float, *, speed: float = 1.0) -> None:
        self.robot, self.lead, self.speed = robot, lead, speed
        self.followed = Following()
        self._shift: float | None = None  # [s] the robot's clock minus the time of the stream
        self._times: list[float] = []
        self._joints: list[Joints] = []
        self._new = 0  # number of targets that were not sent yet
        self.refused: VrsError | None = None
        self._sent: SimpleQueue[tuple[int, int, Callable[[], FollowReport]] | None] = SimpleQueue()
        self._hearing = Thread(target=self._hear, name="vrs lab steer", daemon=True)
        self._hearing.start()

    def to(self, target: Joints | Transform, t: float) -> None:
        """Add a target for time t [s] of the stream. Raises LocationOutOfRange or another error for a pose that no
        configuration reaches."""
        robot = self.robot
        if self._shift is None:
            self._shift = (robot.timeline.end if robot.followed.rate is None else robot.now) + self.lead - t
        joints = self._joints_for(target) if isinstance(target, Transform) else target
        due = t + self._shift
        if self._times and due <= self._times[-1]:
            due = self._times[-1] + STEERING.shortest
        if self._times and due - self._times[-1] > STEERING.longest:  # the stream would end first: begin a new chunk
            self.send()
            self._times, self._joints = [], []
        self._times.append(due)
        self._joints.append(joints)
        self._new += 1
        self.followed.targets += 1
        if due - self._times[0] >= CHUNK_S:
            self.send()

    def _joints_for(self, T_world_tool: Transform) -> Joints:
        frames = self.robot.frames
        near = self._joints[-1] if self._joints else self.robot.at().joints
        return select(self.robot.arm, Settings(), compose(frames.base, T_world_tool), frames, near)

    def send(self) -> None:
        """Send the targets so far. The last target is also the first of the next chunk, so the robot passes it without
        stopping.
        """
        if not self._new:
            return
        chunk, count = FollowChunk(tuple(self._times), tuple(self._joints), self.speed), self._new
        sent_before = len(self._times) - count
        self._times, self._joints, self._new = self._times[-1:], self._joints[-1:], 0
        self.followed.chunks += 1
        try:
            self._sent.put((count, sent_before, self.robot.start(chunk)))
        except RequestRefused:
            self.followed.lost += count

    def finish(self) -> None:
        """Send the remaining targets, and wait for all answers. The robot stops at the last target. Raises the first
        error.
        """
        self.send()
        self._sent.put(None)
        self._hearing.join()
        if self.refused is not None:
            raise self.refused

    def _hear(self) -> None:
        while (sent := self._sent.get()) is not None:
            count, sent_before, wait = sent
            try:
                report = wait()
                self.followed.late += max(report.late - sent_before, 0)
                self.followed.held += report.held
                self.followed.add_errors(report.mean, report.worst, self.robot.arm.model.units, count)
            except TooLate:
                self.followed.late += count
            except RequestRefused:
                self.followed.lost += count
            except VrsError as error:
                self.refused = self.refused or error
