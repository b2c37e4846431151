"""A robot in Python: motions, positions, kinematics, programs and branches, in the units of VAL-II or in SI."""

from __future__ import annotations

import re
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from copy import copy
from functools import partial
from pathlib import Path

import numpy as np
from msgspec import structs
from numpy.typing import ArrayLike

from vrs_cli.api.answers import Change, Explanation, Picture, ProgramFailed, Replies, Run, Scene, hear
from vrs_cli.api.control import RATES, Dragged, ProgramFolders, Signals, Streams, conditions_of, local_port
from vrs_cli.api.location import Floats, Location, Units, number, numbers
from vrs_cli.api.posture import (
    CellPart,
    Measured,
    Model,
    PartPlace,
    Posture,
    Preview,
    Ways,
    forward,
    jacobian,
    place_text,
    posture_at,
    ways,
)
from vrs_cli.engine.clock import FASTEST_RATE, SLOWEST_RATE, RobotClock, VirtualClock, WallClock
from vrs_cli.engine.targets import check_joint_limits
from vrs_cli.errors import IllegalValue, JointOutOfRange, NotPossible, hints_for_python
from vrs_cli.files.atomic import atomically
from vrs_cli.files.cell_file import read_cell
from vrs_cli.files.exports import EXPORTERS
from vrs_cli.files.journal import bookmark_of
from vrs_cli.files.opening import Folder, parent_of
from vrs_cli.files.program_file import cell_of_program, find_program_file, read_program_file
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.interfaces.dialogue import Answers, no_answer
from vrs_cli.interfaces.monitor.files import TORN
from vrs_cli.interfaces.monitor.timeline import plot_curves, select_curves
from vrs_cli.interfaces.port.local import LocalPort
from vrs_cli.interfaces.port.port import Port
from vrs_cli.interfaces.roles.playback import Audience
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.interfaces.station.station import Conditions
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.robot_file import Ends, load_robot
from vrs_cli.kinematics.transform import Transform, compose
from vrs_cli.kinematics.transform import inverse as invert
from vrs_cli.language.run.signals import NO_CELL, Cell
from vrs_cli.language.words.values import numbers_of, plain
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import acts
from vrs_cli.values.commands import JointTarget, NamedTarget, PoseTarget, Target
from vrs_cli.values.measured import BodyMode, Report
from vrs_cli.values.numbers import Value
from vrs_cli.values.results import CommandRecord, FollowReport, ResyncReport
from vrs_cli.wire.messages import LeaseAct

MIN_SPEED, MAX_SPEED = 0.01, 327.0  # [%] limits of the speed of all motions (`speed`)
LEASE_ACTS = ("acquire", "ask", "give", "release")
BRANCH_NAME = re.compile(r"[a-z][a-z0-9._]*", re.IGNORECASE)
MAX_METRES = 3.0  # [mm] warn about metres if a target is this close to the origin
MAX_SMALL_TURN = 10.0  # [degrees] warn about radians only if a joint would turn by more than this
MAX_SAMPLES = 5_000_000  # maximum number of samples; each needs 256 bytes


class Robot:
    """One robot, given by its name ("puma560") or by a .toml or .urdf file. It starts at READY, or at the joints
    `start`.

    Joints are in degrees (mm for prismatic joints), locations in mm and degrees; with `units="SI"` all are in radians
    and metres. Times are in seconds, speeds in percent of nominal. `realtime`: False for virtual time, True for real
    time, or the number of seconds by which the robot's clock advances per second. `base`, `tip`: the first and last
    link of the arm in a URDF file.

    `limits`: the maximum time, steps and memory that a program or a line may use. `folder`: the only folder in which
    programs and lines may read and write files; by default this is the folder of the program's own file, and the
    current folder for a line. `cell`: a file with the surroundings of the robot. `signals`: the changes of inputs, as a
    file or a list of (time [s], signal, state). `run`, `execute` and `do` take these four options for one call.

    Methods raise TypeError or ValueError for values that are not numbers or have a wrong shape. They raise VrsError,
    with the message of VAL-II, if the robot refuses a command. A shape (N, ...) means that arrays of N rows are also
    accepted.
    """

    def __init__(
        self,
        robot: str | Path | RobotModel = "puma560",
        *,
        start: ArrayLike | None = None,
        units: str | Units = Units.VAL,
        realtime: bool | float = False,
        base: str | None = None,
        tip: str | None = None,
        limits: Limits | None = None,
        folder: str | Path | None = None,
        cell: str | Path | Cell | None = None,
        signals: Signals | None = None,
    ) -> None:
        self.units = Units.of(units)
        self._model = robot if isinstance(robot, RobotModel) else load_robot(robot, Ends(base, tip))
        joints = None if start is None else self._joints(start, "start")
        if joints is not None:
            check_joint_limits(self._model, joints)
        conditions = conditions_of(limits, folder, cell, signals)
        self._robot = Supervisor(local_port(self._model, conditions, joints, _clock(realtime)))
        self._folders, self._streams = ProgramFolders(fixed=folder is not None), Streams()

    @classmethod
    def of(cls, port: Port, units: str | Units = Units.VAL) -> Robot:
        """Return the robot that a port is connected to, in this process or on a server."""
        robot = cls.__new__(cls)
        robot._robot = Supervisor(port)
        robot.units, robot._model = Units.of(units), robot._robot.arm.model
        robot._folders, robot._streams = ProgramFolders(fixed=True), Streams()
        return robot

    def in_units(self, units: str | Units) -> Robot:
        """Return the same robot, whose methods use other units: "VAL" or "SI"."""
        other = copy(self)
        other.units = Units.of(units)
        return other

    # --- motions ---

    def move(self, *to: ArrayLike | Location, at: float | None = None, speed: float | None = None) -> Robot:
        """Move to joints or to a Location, joint-interpolated: `move(0, -45, 180, 0, 45, 0)`, `move(trans(...))`. A
        matrix (4, 4) [m] can be given instead of a Location. Warns if numbers seem to be in radians or metres instead
        of degrees or mm.

        The motion begins after the last one, or `at` a time [s], even in the middle of another motion. `speed`: percent
        of nominal, up to 100, for this motion only. Raises MotionError, IllegalValue, ValueError, TypeError.
        """
        return self._go("MOVE", to, at, speed)

    def moves(self, *to: ArrayLike | Location, at: float | None = None, speed: float | None = None) -> Robot:
        """Move the tool tip on a straight line to joints or to a Location. Otherwise like `move`."""
        return self._go("MOVES", to, at, speed)

    def ready(self, *, at: float | None = None, speed: float | None = None) -> Robot:
        """Move to the ready position. Otherwise like `move`."""
        return self._command(NamedTarget("ready"), "READY", at, speed)

    def _go(self, word: str, to: tuple[ArrayLike | Location, ...], at: float | None, speed: float | None) -> Robot:
        target, shown = self._target(to)
        try:
            return self._command(target, f"{word} {shown}", at, speed, straight=word == "MOVES")
        except JointOutOfRange as error:
            if error.hint or isinstance(target, PoseTarget):
                raise
            raise error.reworded(hint="these are joints; trans(x, y, z, o, a, t) makes a location") from None

    def _command(
        self, target: Target, text: str, at: float | None, speed: float | None, *, straight: bool = False
    ) -> Robot:
        executed = None if at is None else number(at, "at")
        if executed is not None and executed < 0.0:
            raise IllegalValue(f"at {executed:g} s", "times are 0 or more seconds", value=executed, lower=0.0)
        text += "" if executed is None else f" AT {plain(executed)}"
        self._robot.move(target, straight=straight, executed=executed, speed=_fraction(speed), text=text)
        return self

    def _target(self, to: tuple[ArrayLike | Location, ...]) -> tuple[PoseTarget | JointTarget, str]:
        """Return the target of a motion, and the VAL-II expression for this target."""
        given = self._location(to[0] if len(to) == 1 else to)
        if isinstance(given, Location):
            T = given.transform
            if self.units is Units.VAL and 0.0 < max(map(abs, (T.px, T.py, T.pz))) <= MAX_METRES / 1000.0:
                warnings.warn(f'{given} is in mm: trans(..., units="SI") takes metres', stacklevel=4)
            return PoseTarget(T), f"TRANS({', '.join(map(plain, numbers_of(T)))})"
        joints = self._joints(given, "joints")
        if self._looks_like_radians(np.array(joints) * self._scales):
            warnings.warn('joints are in degrees: Robot(units="SI") takes radians', stacklevel=4)
        shown = ", ".join(plain(x) for x in numbers_of(joints, self._model.units))
        return JointTarget(joints), f"#PPOINT({shown})"

    def _location(self, given: object) -> object:
        """Return a matrix (4, 4) or (N, 4, 4) [m] as a Location; return anything else unchanged."""
        if isinstance(given, np.ndarray) and given.ndim > 1 and given.shape[-2:] == (4, 4):
            return Location.from_matrix(given, self.units)
        return given

    def _one_location(self, given: object, what: str) -> Location:
        """Return a Location or a matrix as one Location. `what`: its name in the message. Raises TypeError for anything
        else."""
        found = self._location(given)
        if not isinstance(found, Location):
            raise TypeError(f"{what}: a Location is wanted, as trans(x, y, z, o, a, t) makes one, not {given!r}")
        return found

    def _looks_like_radians(self, row: Floats) -> bool:
        """Return whether joints seem to be given in radians: they were computed (more than three decimals), no joint
        exceeds one turn in radians, and they are far from the current joints."""
        if self.units is Units.SI or not row.any() or np.abs(row).max() > 2.0 * np.pi:
            return False
        here = np.array(self._robot.at().joints) * self._scales
        return bool((np.abs(np.round(row, 3) - row) > 1e-9).any() and np.abs(row - here).max() > MAX_SMALL_TURN)

    def follow(self, times: ArrayLike, joints: ArrayLike, *, speed: float | None = None) -> FollowReport:
        """Follow a chunk of joints (N, n) at increasing `times` (N,) of the robot's clock [s], for example from a
        policy.

        The chunk replaces all motions after `times[0]`. It continues smoothly from the motion at that time, and ends at
        rest at the last sample. Velocity, acceleration and jerk stay within their limits; if the limits do not allow a
        sample, the robot comes as near as they allow. In real time, samples that arrive too late are left out. `speed`:
        percent of nominal, up to 100. The errors in the report are in the units of this robot. Raises MotionError,
        IllegalValue, ValueError, TypeError.
        """
        instants, rows = numbers(times, "times"), numbers(joints, "joints", self._model.joint_count) / self._scales
        if instants.ndim != 1 or rows.ndim != 2:
            raise ValueError(f"times (N,) and joints (N, n) are wanted, not {instants.shape} and {rows.shape}")
        found = self._robot.act(
            acts.FollowChunk(tuple(instants.tolist()), tuple(map(tuple, rows.tolist())), _fraction(speed))
        )
        mean, worst = (tuple((np.array(errors) * self._scales).tolist()) for errors in (found.mean, found.worst))
        return structs.replace(found, mean=mean, worst=worst)

    def steer(self, *joints: ArrayLike, rate: float = 50.0, speed: float | None = None) -> Robot:
        """Send joints (n,) as one target of a stream, from a joystick, a leader arm or a policy. The robot moves there
        at once, even from the middle of a motion. Each target replaces the previous one; `wait()` ends at the last
        target.

        The robot follows the line through the last two targets, within its limits of velocity, acceleration and jerk.
        `rate`: targets per second, 2 to 1000. In virtual time each call advances the clock by 1 / rate s; in real time
        it waits until 1 / rate s after the previous call. Without further targets the robot brakes; after 0.5 s without
        a target the next one begins a new stream. `speed`: percent of nominal, up to 100.

        Raises JointOutOfRange, LeaseHeld, IllegalValue, ValueError, TypeError; and RequestRefused once if something
        else has stopped the robot, or the connection was cut, since the last target. An error ends the stream.
        """
        lowest, highest = RATES
        if not lowest <= (asked := number(rate, "rate")) <= highest:
            raise ValueError(f"rate: {lowest:g} to {highest:g} targets a second are wanted, not {rate}")
        given = self._location(joints[0] if len(joints) == 1 else joints)
        if isinstance(given, Location):
            raise TypeError(f"joints: joints are wanted, not {given!r}: drag takes a location, ik gives joints")
        self._streams.steer(self._robot, self._joints(given, "joints"), asked, _fraction(speed))
        return self

    def drag(self, location: Location | ArrayLike) -> Dragged:
        """Pull the tool towards a Location, or a matrix (4, 4) [m], as one target of a stream, for example from a
        mouse. Each target replaces the previous one; `wait()` ends as near to the last target as the arm can come.

        Any location may be given. If the arm cannot reach it, or cannot reach it so fast, the tool stays as near as
        possible, and the result names the limits. The arm keeps RIGHTY or LEFTY, ABOVE or BELOW. In virtual time each
        call advances the clock by 0.02 s; in real time it waits until 0.02 s after the previous call. A served robot
        continues to follow for 0.6 s after the last call; a robot in this process moves one step per call.

        Raises LeaseHeld, TypeError; RequestRefused once if something else has stopped the robot, or the connection was
        cut, since the last call.
        """
        found = self._one_location(location, "location")
        return Dragged.of(self._streams.drag(self._robot, found.transform), self._model, self.units)

    @contextmanager
    def without_waiting(self) -> Iterator[Robot]:
        """Send motions, and targets of `steer`, without waiting for the answer to each: `with r.without_waiting():
        r.move(...).moves(...)`. At the end of the block, wait for all answers. Raises the first error."""
        with self._robot.without_waiting():
            yield self

    def open(self) -> Robot:
        """Open the hand after the last motion."""
        return self._do("OPENI")

    def close(self) -> Robot:
        """Close the hand after the last motion."""
        return self._do("CLOSEI")

    def _do(self, line: str) -> Robot:
        with hints_for_python():
            self._robot.say(line, no_answer)
        return self

    def wait(self) -> Robot:
        """Wait until the robot is at rest; in virtual time this returns immediately. Targets streamed with `steer` end
        exactly at the last one; with `drag`, as near to it as the tool can get.
        """
        self._streams.arrive(self._robot)
        self._robot.wait()
        return self

    def abort(self) -> Robot:
        """Stop the program and the motion now, and drop all scheduled motions."""
        self._robot.abort()
        self._streams.release(self._robot)
        return self

    def lease(self, act: str, to: str = "") -> Robot:
        """Change the driver of a robot to which several users are connected: "acquire" the lease or "ask" for it,
        "give" it `to` another user by name, "release" it. The first user who commands a motion gets the lease without
        asking. Raises LeaseHeld if another user drives, ValueError."""
        if act not in LEASE_ACTS:
            raise ValueError(f"act: {', '.join(LEASE_ACTS)} are known, not {act!r}")
        self._robot.drive(LeaseAct(act), to)
        return self

    @property
    def held(self) -> Supervisor:
        """Return the Supervisor of the robot, which works in metres, radians and seconds, for use with `Observer` and
        viewers."""
        return self._robot

    # --- positions ---

    @property
    def now(self) -> float:
        """Return the time of the robot's clock [s]."""
        return self._robot.now

    @property
    def end(self) -> float:
        """Return the time at which the last motion ends [s]."""
        return self._robot.timeline.end

    @property
    def timeline(self) -> Timeline:
        """Return all segments, in metres and radians. Later commands do not change this value."""
        return self._robot.timeline

    def where(self, t: ArrayLike | None = None) -> Posture:
        """Return the posture of the robot at a time [s], past or future, at times (N,), or now."""
        if t is None:
            return Posture.of(self._robot.at(), self._model, self.units)
        return posture_at(self._robot, t, self._model, self.units)

    def preview(self) -> Preview:
        """Return a preview of the robot's motion, including the commands that have not arrived yet. A robot in this
        process has no such commands."""
        return Preview.of(self._robot.preview_now(), self._robot.arm, self.units)

    def sample(self, rate: float = 100.0, start: float | None = None, end: float | None = None) -> Posture:
        """Return the posture of the robot `rate` times per second, from the first motion to the exact end of the last,
        or between two times [s].

        Raises ValueError if the rate is not positive or gives too many samples, or if the end is before the start.
        """
        timeline, asked = self.timeline, number(rate, "rate")
        begin = timeline.start if start is None else number(start, "start")
        last = timeline.end if end is None else number(end, "end")
        if last < begin:
            raise ValueError(f"end: {last:g} s is before the start, {begin:g} s")
        if not asked > 0.0 or not (last - begin) * asked < MAX_SAMPLES:
            raise ValueError(f"rate: more than 0 and at most {MAX_SAMPLES} samples in all, not {rate}")
        times = begin + np.arange(max(np.ceil((last - begin) * asked), 0.0)) / asked
        return self.where(np.append(times[times < last], last))

    def watch(self, rate: float = 25.0) -> Iterator[Posture]:
        """Yield the current posture of the robot `rate` times per second, without end. Raises IllegalValue for a bad
        rate."""
        audience = Audience(self._robot, time.monotonic)
        audience.join(number(rate, "rate"))
        while True:
            time.sleep(max(audience.peek() - time.monotonic(), 0.0))
            for look in audience.step():
                yield Posture.of(look.position, self._model, self.units)

    # --- measured joints ---

    @property
    def measured(self) -> Measured:
        """Return the joints that the real or simulated arm has reported up to now: `measured.at(2.5)`, `.joints`,
        `.unknown_since`."""
        return Measured(self._robot.followed.measured, self._model, self.units)

    def report(
        self,
        t: float,
        joints: ArrayLike,
        velocity: ArrayLike | None = None,
        effort: ArrayLike | None = None,
        *,
        mode: str = "follows",
    ) -> Robot:
        """Add a measurement of the arm to the record of this robot: joints (n,), velocity (n,) and effort (n,) [N m, N]
        at a time [s]. `mode`: "follows", "holds" or "stopped". UNDO and branches do not change the record.

        Raises NotPossible for a served robot, whose measurements come from a client (`vrs body`). Raises IllegalValue,
        ValueError, TypeError for an invalid measurement.
        """
        port = self._robot.port
        if not isinstance(port, LocalPort):
            raise NotPossible("a robot that is served has a body that reports", "vrs body URL")
        if mode not in [one.value for one in BodyMode]:
            raise ValueError(f"mode: {', '.join(one.value for one in BodyMode)} are known, not {mode!r}")

        def row(given: ArrayLike | None, what: str, scales: Floats) -> Joints | None:
            if given is None:
                return None
            found = numbers(given, what, self._model.joint_count) / scales
            if found.ndim != 1:
                raise ValueError(f"{what}: one row (n,) is wanted, not {found.shape}")
            return tuple(found.tolist())

        rates = row(velocity, "velocity", self._scales), row(effort, "effort", np.ones(self._model.joint_count))
        port.report([Report(number(t, "t"), self._joints(joints, "joints"), *rates, BodyMode(mode))])
        return self

    def resync(self, *, stop: bool = False) -> ResyncReport:
        """Resynchronise the timeline with the measured arm. The arm holds still, the timeline moves within its limits
        to the measured joints and then on to the target (with `stop` it ends at the measured joints), and the arm
        follows again.

        The distances in the report are in the units of this robot. Raises MotionError, RequestRefused if there are no
        measured joints.
        """
        found = self._robot.act(acts.ResyncBody(stop))
        return structs.replace(found, distances=tuple((np.array(found.distances) * self._scales).tolist()))

    # --- the cell ---

    @property
    def parts(self) -> dict[str, PartPlace]:
        """Return the parts of the cell as they are now, by name."""
        return {row.name: PartPlace.of(row, self.units) for row in self._robot.act(acts.LookAtParts()).rows}

    def part(self, name: str) -> CellPart:
        """Return a part of the cell: `part("box").at(2.5).location`. Raises KeyError if no part has that name."""

        def look(t: float | None) -> PartPlace:
            return next(
                PartPlace.of(row, self.units) for row in self._robot.act(acts.LookAtParts(t)).rows if row.name == name
            )

        known = [row.name for row in self._robot.act(acts.LookAtParts()).rows]
        if name not in known:
            raise KeyError(f"there is no part {name!r}; there are {', '.join(known) or 'none'}")
        return CellPart(name, look)

    # --- kinematics ---

    @property
    def model(self) -> Model:
        """Return the data of the robot, in its units: `model.limits` (n, 2), `.dof`, `.names`, `.poses`."""
        return Model.of(self._model, self.units)

    @property
    def joints(self) -> Floats:
        """Return the current joints (n,)."""
        return self.where().joints

    @property
    def tool(self) -> Location:
        """Return the tool tip in the frame of the flange. Assign a Location or a matrix (4, 4) [m] to change the tool
        after all motions commanded so far."""
        return Location.of(self._robot.frames.tool, self.units)

    @tool.setter
    def tool(self, location: Location | ArrayLike) -> None:
        found = self._one_location(location, "tool")
        self._do(f"TOOL TRANS({', '.join(map(plain, numbers_of(found.transform)))})")

    @property
    def speed(self) -> float:
        """Return the speed of all motions [% of nominal], like the dial of a controller; the speed of a single motion
        is a fraction of this speed. Assign 0.01 to 327 to change the speed of later motions. Raises IllegalValue."""
        return float(str(self["SPEED(1)"]))

    @speed.setter
    def speed(self, percent: float) -> None:
        if not MIN_SPEED <= percent <= MAX_SPEED:
            raise IllegalValue(f"speed {percent}", f"it is a number of percent, from {MIN_SPEED} to {MAX_SPEED:g}")
        self._do(f"SPEED {plain(float(percent))}")

    def fk(self, joints: ArrayLike | None = None, *, link: int | None = None) -> Location:
        """Return the tool tip in the world for joints (n,) or (N, n), or for the current joints. `link`: return the
        frame of this link instead, 0 (the base) to n (the flange); joint i turns about z of frame i - 1. Raises
        ValueError.
        """
        q = self._any_joints(joints)
        if link is None:
            return forward(self._robot.arm, self._robot.frames, q, self.units)
        if link not in range(self._model.joint_count + 1):
            raise ValueError(f"link: 0 (the base) to {self._model.joint_count} (the flange) is wanted, not {link!r}")
        T_world_robot = invert(self._robot.frames.base)
        rows = [
            compose(T_world_robot, link_frames(self._model, tuple(row))[link])
            for row in q.reshape(-1, q.shape[-1]).tolist()
        ]
        return Location(np.array(rows).reshape(*q.shape[:-1], 3, 4), self.units)

    def ik(self, location: Location | ArrayLike) -> Ways:
        """Return all joint solutions for a location, or for N locations, in each configuration: joints (k, n) or (N, k,
        n). A location may be a matrix (4, 4) or (N, 4, 4) [m].
        """
        return ways(self._robot.arm, self._robot.frames, self._one_location(location, "location"), self.units)

    def jacobian(self, joints: ArrayLike | None = None) -> Floats:
        """Return the Jacobian (6, n) or (N, 6, n) at joints (n,) or (N, n), or at the current joints. It maps joint
        rates to the tool's velocity (vx, vy, vz, wx, wy, wz) in the robot's frame, in mm and degrees, or in SI.
        """
        return jacobian(self._robot.arm, self._robot.frames, self._any_joints(joints), self.units)

    def why(self, *to: ArrayLike | Location) -> Replies:
        """Explain whether a location, or joints, can be reached from the current position, and what MOVE and MOVES
        would do.

        The reply is a ReachReport with `options`, `chosen`, `reason` and `line`, in metres and radians.
        """
        target, shown = self._target(to)
        return Replies((self._robot.act(acts.Explain(acts.Goal.of(target), shown)),))

    def explain(self, what: str = "") -> Explanation:
        """Explain a motion or a location with numbers, without moving: `explain("MOVES part AT 2")`, "table:part",
        "OAT part", "IK part", "SPLICE"; without `what` list all topics. A notebook shows formulas and matrices.

        The answer has values of `vrs_cli.values.results`, in metres, radians and seconds. A motion that the robot would
        refuse is explained too. Raises VrsError if `what` cannot be read or has no value.
        """
        return Explanation(self.do(f"EXPLAIN {what}"))

    # --- programs and words ---

    def do(
        self,
        line: str,
        answers: Iterable[str] = (),
        *,
        limits: Limits | None = None,
        folder: str | Path | None = None,
        cell: str | Path | Cell | None = None,
        signals: Signals | None = None,
    ) -> Replies:
        """Execute one line of the shell: `do("SPEED 50")`. `answers`: the answers to its questions. `limits`, `folder`,
        `cell`, `signals`: for this line only; times of `signals` count from the start of the line. Raises VrsError."""
        if not isinstance(line, str):
            raise TypeError(f"line: a text is wanted, not {line!r}")
        if "\n" in line.strip() or line.lstrip().upper().startswith(".PROGRAM"):
            raise ValueError("line: one line is wanted; `define` takes the text of programs")
        return Replies(self._under(conditions_of(limits, folder, cell, signals)).say(line.strip(), _in_order(answers)))

    def prompt(self, text: str, answer: Answers = no_answer) -> Replies:
        """Execute several lines of the shell, including lines of programs. Errors are among the replies."""
        return Replies(self._robot.type(text, answer))

    def define(self, text: str) -> tuple[str, ...]:
        """Store in memory the programs and variables of a string with the contents of a program file (.PROGRAM to
        .END). Return the names of the programs.

        Raises ProgramNotExecutable if the string contains mistakes.
        """
        names = self._robot.define(text)
        self._folders.put(names, None)
        return names

    def run(
        self,
        file: str | Path,
        program: str | None = None,
        *,
        cycles: int = 1,
        answers: Iterable[str] = (),
        check: bool = True,
        limits: Limits | None = None,
        folder: str | Path | None = None,
        cell: str | Path | Cell | None = None,
        signals: Signals | None = None,
    ) -> Run:
        """Load a file of programs and execute one of them, by default the first. Otherwise like `execute`. If neither
        the robot nor the call has a cell, the file may name one (`; cell: FILE`), or be accompanied by NAME.toml beside
        NAME.v2.

        Raises NonexistentFile, FileError, and ProgramNotExecutable for a file with mistakes.
        """
        conditions = conditions_of(limits, folder, self._cell_of(file) if cell is None else cell, signals)
        names = self._under(conditions).load(file)
        self._folders.put(names, Path(find_program_file(file)).parent)
        if program is None and not names:
            raise NotPossible(f"{file} holds no program", "a program begins with .PROGRAM name")
        return self._execute(program or names[0], cycles, answers, check, conditions)

    def _cell_of(self, file: str | Path) -> Path | None:
        """Return the cell that a program file names, if the robot is in this process and has no cell."""
        port, path = self._robot.port, find_program_file(file)
        if not isinstance(port, LocalPort) or port.session.driver.cell is not NO_CELL:
            return None
        found = cell_of_program(read_program_file(path), path, Folder(parent_of(path)))
        return None if found is None else Path(found[0])

    def execute(
        self,
        program: str,
        *,
        cycles: int = 1,
        answers: Iterable[str] = (),
        check: bool = True,
        limits: Limits | None = None,
        folder: str | Path | None = None,
        cell: str | Path | Cell | None = None,
        signals: Signals | None = None,
    ) -> Run:
        """Execute a program in memory, and wait for its end. `answers`: the answers to its PROMPTs. `limits`, `folder`,
        `cell`, `signals`: for this run only; times of `signals` count from the start of the run.

        Raises UndefinedName; ProgramFailed if the program stops with an error. With `check=False` the error is the
        `fault` of the Run instead.
        """
        return self._execute(program, cycles, answers, check, conditions_of(limits, folder, cell, signals))

    def _execute(
        self, program: str, cycles: int, answers: Iterable[str], check: bool, conditions: Conditions | None
    ) -> Run:
        robot = self._under(self._folders.conditions(program, conditions))
        run = Run(*structs.astuple(robot.execute(program, cycles, _in_order(answers))))
        if check and run.fault is not None:
            raise ProgramFailed(run)
        return run

    def _under(self, conditions: Conditions | None) -> Supervisor:
        """Return the robot with the conditions (limits, folder, cell, signals) of one call applied. Raises NotPossible
        for a served robot."""
        if conditions is None:
            return self._robot
        port = self._robot.port
        if not isinstance(port, LocalPort):
            raise NotPossible(
                "limits, folder, cell and signals are for a robot of this process",
                "a robot that is served has those of its server",
            )
        return self._robot.on(port.under(conditions))

    def __getitem__(self, expression: str) -> float | str | Location | Floats:
        """Return the value of a VAL-II variable or expression: a number, a string, a Location, or joints (n,)."""
        value = self._robot.act(acts.Evaluate(expression)).value
        if isinstance(value, Transform):
            return Location.of(value, self.units)
        return np.array(value) * self._scales if isinstance(value, tuple) else value

    def __setitem__(self, variable: str, value: float | str | Location | ArrayLike) -> None:
        """Set a VAL-II variable. `#name` takes joints, `$name` takes a string, and any other name takes a number or a
        Location."""
        self._robot.act(acts.Assign(variable, acts.Valued.of(self._value(variable, value))))

    # --- UNDO and branches ---

    @property
    def commands(self) -> tuple[CommandRecord, ...]:
        """Return all motion commands that have not been undone: number, text, and the times of issue, begin and end
        [s].
        """
        return self._robot.act(acts.ListCommands()).commands

    def undo(self, count: int = 1) -> Robot:
        """Undo the last `count` motion commands. Raises NotPossible if there are fewer."""
        self._robot.act(acts.Undo(count))
        return self

    def redo(self, count: int = 1) -> Robot:
        """Redo the last `count` undone commands."""
        self._robot.act(acts.Redo(count))
        return self

    @property
    def branches(self) -> tuple[str, ...]:
        """Return the names of all branches, main first."""
        return tuple(row.name for row in self._robot.act(acts.ListBranches()).rows)

    @property
    def branch(self) -> str:
        """Return the name of the current branch."""
        return next(row.name for row in self._robot.act(acts.ListBranches()).rows if row.present)

    @contextmanager
    def what_if(self, name: str) -> Iterator[Robot]:
        """Try commands on a branch: `with r.what_if("fast"): r.move(...)`. The branch is created if it does not exist.
        After the block the robot is on the previous branch again.

        Raises ValueError for an invalid name, NotPossible in real time and while a program runs.
        """
        if not isinstance(name, str) or not BRANCH_NAME.fullmatch(name):
            raise ValueError(f"name: a letter, and then letters, digits, points and underscores, not {name!r}")
        before = self.branch
        self._do(f"BRANCH {name}")
        try:
            yield self
        finally:
            self._do(f"BRANCH {before}")

    def compare(self, a: str, b: str) -> Replies:
        """Compare two branches: the reply has `a.duration`, `b.duration`, `tool.distance`, ... [s, m, rad]."""
        return Replies((self._robot.act(acts.Compare(a, b)),))

    def merge(self, name: str) -> Robot:
        """Make the timeline of a branch the main timeline."""
        return self._do(f"MERGE {name}")

    # --- files, events, pictures ---

    def save(self, path: str | Path) -> None:
        """Write the trajectory to a .vrst file. Raises FileError."""
        self._robot.save(Path(path))

    def export(self, path: str | Path, rate: float = 100.0) -> None:
        """Write `rate` samples per second to a file, as `vrs export` does: .csv or .json in mm and degrees, .npz or
        .mcap in metres and radians; .mcap has the frames of all links.

        Raises ValueError for an unknown file extension and for an impossible rate, NotPossible if a package is missing,
        FileError.
        """
        ends = [one.suffix for one in EXPORTERS.values()]
        exporter = next((one for one in EXPORTERS.values() if one.suffix == Path(path).suffix.lower()), None)
        if exporter is None:
            raise ValueError(f"path: it ends in {', '.join(dict.fromkeys(ends))}, not {path}")
        if not number(rate, "rate") > 0.0:
            raise ValueError(f"rate: more than 0 samples a second are wanted, not {rate}")
        world = self._robot.port.world if exporter.shows_cell else None
        with hints_for_python():
            exporter.check()
            with atomically(path) as stream:
                write = exporter.write if world is None else partial(exporter.write, world=world)
                write(stream, self._robot.arm, self.timeline, float(rate))

    def subscribe(self, callback: Callable[[Change], object]) -> Callable[[], None]:
        """Call `callback` for every change of the timeline, in a new thread. Return a function that ends the calls. The
        first Change has the current timeline. Each Change has `version`, `timeline`, and usually a `delta`.
        """
        return hear(self._robot.subscribe(), callback)

    def plot(self, *what: str | int) -> Picture:
        """Plot curves over all motions: joints (by number), "velocity", "acceleration", "X", "tool", "speed", "hand".

        Raises NotPossible if there is no motion yet, and for curves that cannot be drawn together.
        """
        with hints_for_python():
            asked = select_curves(self._robot.arm, [str(word) for word in what])
        if self.end <= self.timeline.start:
            raise NotPossible("there is no motion yet", "move the robot first")
        return Picture((plot_curves(self._robot.arm, self.timeline, asked),))

    def view(
        self, timeline: Timeline | None = None, *, height: int = 420, cell: str | Path | Cell | None = None
    ) -> Scene:
        """Return the moving arm as a page: a notebook plays it below the cell, `.open()` shows it in a browser, and
        `.save("a.html")` writes it. `timeline`: shown instead of the robot's own timeline; `height`: the height of the
        page in a notebook [px]; `cell`: a file with surroundings, shown instead of the robot's own.

        Raises NotPossible if the page is not built, FileError if the cell cannot be read.
        """
        world = self._robot.port.world
        if cell is not None:
            from vrs_cli.world.course import World

            world = World(self._robot.arm, cell if isinstance(cell, Cell) else read_cell(str(cell)))
        return Scene(self._robot.arm, timeline or self.timeline, height, world)

    def leave(self) -> None:
        """End the use of the robot; all later calls are refused. A served robot stays unchanged for other users. A
        robot in this process closes the files of its programs."""
        self._robot.close()

    def __enter__(self) -> Robot:
        return self

    def __exit__(self, *_error: object) -> None:
        self.leave()

    def __repr__(self) -> str:
        motions, here = len(self.commands), place_text(self.where().location)
        return f"<Robot {self._model.name}: {motions} motions to {self.end:.3f} s, now {self.now:.3f} s, {here}>"

    def _repr_html_(self) -> str:
        return f"<p>{self._model.title}</p>{Replies((self._robot.act(acts.ListMotions()),))._repr_html_()}"

    # --- numbers in and out ---

    @property
    def _scales(self) -> Floats:
        return self.units.scales(self._model.units, self._model.joint_count)

    def _joints(self, given: object, what: str) -> Joints:
        """Check one set of joints, and return it in [rad, m]. Degrees are converted as in VAL-II, to exactly the same
        bits."""
        row = numbers(given, what, self._model.joint_count)  # type: ignore[arg-type]
        if row.ndim != 1:
            raise ValueError(f"{what}: one set of joints is wanted, not {row.shape}")
        joints = tuple(row.tolist())
        return joints if self.units is Units.SI else self._model.units.read(joints)

    def _any_joints(self, given: ArrayLike | None) -> Floats:
        """Return joints (..., n) in [rad, m]; the current joints if none are given."""
        if given is None:
            return np.array(self._robot.at().joints)
        return numbers(given, "joints", self._model.joint_count) / self._scales

    def _value(self, name: str, given: float | str | Location | ArrayLike) -> Value:
        given = self._location(given)  # type: ignore[assignment]  # may become a Location
        if isinstance(given, Location):
            return given.transform
        if isinstance(given, str):
            return given
        return self._joints(given, name) if name.startswith("#") else number(given, name)  # type: ignore[arg-type]


def load(
    path: str | Path,
    *,
    units: str | Units = Units.VAL,
    limits: Limits | None = None,
    folder: str | Path | None = None,
    cell: str | Path | Cell | None = None,
    signals: Signals | None = None,
) -> Robot:
    """Return the robot that a trajectory file (.vrst) describes, at the end of its timeline. `limits`, `folder`, `cell`
    and `signals` mean the same as for `Robot`.

    Raises NonexistentFile, FileDamaged, FileError. Warns if an older file has motions that the robot can no longer do,
    and if the last line is incomplete.
    """
    with hints_for_python():
        recording = read_trajectory(path)
    for warning in (*recording.warnings, *[TORN] * recording.dropped_tail):
        warnings.warn(f"{path}: {warning}", stacklevel=2)
    port = local_port(recording.model, conditions_of(limits, folder, cell, signals))
    port.session.engine.take_up(bookmark_of(path, recording, port.session.engine))
    port.session.engine.measured.take(recording.measured)
    robot = Robot.of(port, units)
    robot._folders.fixed = folder is not None
    return robot


def _fraction(speed: float | None) -> float | None:
    """Return a speed in percent of nominal as a fraction, 0 to 1. Raises ValueError."""
    fraction = None if speed is None else number(speed, "speed") / 100.0
    if fraction is not None and not 0.0 < fraction <= 1.0:
        raise ValueError(f"speed: percent of nominal are wanted, more than 0 and up to 100, not {speed}")
    return fraction


def _in_order(answers: Iterable[str]) -> Answers:
    """Return a function that answers each question with the next of these answers."""
    left = iter(answers)
    return lambda _question: next(left, None)


def _clock(realtime: bool | float) -> RobotClock:
    if realtime is False:
        return VirtualClock()
    rate = 1.0 if realtime is True else number(realtime, "realtime")
    if not SLOWEST_RATE <= rate <= FASTEST_RATE:
        raise ValueError(f"realtime: {SLOWEST_RATE:g} to {FASTEST_RATE:g} seconds of the robot in one, not {rate:g}")
    return WallClock(time.monotonic, time.sleep, rate)
