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

from vrs_cli.api.answers import Explanation, Picture, ProgramFailed, Replies, Run, Scene
from vrs_cli.api.changes import Change, hear
from vrs_cli.api.conditions import ProgramFolders, Signals, conditions_of, local_port
from vrs_cli.api.location import Floats, Location, Units, number, numbers
from vrs_cli.api.measured import Measured
from vrs_cli.api.model import Model
from vrs_cli.api.posture import CellPart, PartPlace, Posture, Preview, Ways, forward, jacobian, place_text, ways
from vrs_cli.api.streams import RATES, Dragged, Streams
from vrs_cli.engine.clock import FASTEST_RATE, SLOWEST_RATE, RobotClock, VirtualClock, WallClock
from vrs_cli.engine.targets import check_joint_limits
from vrs_cli.errors import IllegalValue, JointOutOfRange, NotPossible, told_in_python
from vrs_cli.files.atomic import atomically
from vrs_cli.files.cell_file import read_cell
from vrs_cli.files.exports import EXPORTERS
from vrs_cli.files.journal import bookmark_of
from vrs_cli.files.opening import Folder
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
from vrs_cli.values.acts import (
    Assign,
    Compare,
    Evaluate,
    Explain,
    FollowChunk,
    Goal,
    ListBranches,
    ListCommands,
    ListMotions,
    LookAtParts,
    Redo,
    ResyncBody,
    Undo,
    Valued,
)
from vrs_cli.values.commands import JointTarget, NamedTarget, PoseTarget, Target
from vrs_cli.values.measured import BodyMode, Report, ResyncReport
from vrs_cli.values.numbers import Value
from vrs_cli.values.results import CommandRecord, FollowReport
from vrs_cli.wire.messages import LeaseAct

SLOWEST, FASTEST = 0.01, 327.0  # percent of the speed of all motions
LEASE_ACTS = ("acquire", "ask", "give", "release")
BRANCH_NAME = re.compile(r"[a-z][a-z0-9._]*", re.IGNORECASE)
SCENE_HEIGHT = 420  # [px] below a cell
MAX_METRES = 3.0  # [mm] of a target from the origin: no arm is there, and whoever writes it means metres
NEAR = 10.0  # [degrees] that joints change by: so small ones may be meant
MOST_SAMPLES = 5_000_000  # of 256 bytes each


class Robot:
    """One robot, by name ("puma560") or from a .toml or .urdf file. It stands at READY unless `start` says otherwise.

    Joints are in degrees (mm where a joint slides), locations in mm and degrees; with `units="SI"` all is in radians
    and metres. Times are seconds, speeds percent of nominal. `realtime`: motions take their time; True, or how many
    seconds of the robot pass in one. `base`, `tip`: the links of a URDF file that the arm is between.

    `limits`: how much a run of programs, or a line, may take. `folder`: where programs and lines have their files, and
    in no other folder; a program usually has those of the folder of its own file, a line those of the current folder.
    `cell`: a file of what stands around the robot; `signals`: when inputs change, a file or a list of (time [s],
    signal, state). `run`, `execute` and `do` take the same four for one call.

    What is no number, or has another shape than a method says, raises TypeError or ValueError; what the robot refuses
    raises VrsError, with VAL-II's message. (N, ...) means: also for arrays, with any number of rows.
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
        """The robot behind a port."""
        robot = cls.__new__(cls)
        robot._robot = Supervisor(port)
        robot.units, robot._model = Units.of(units), robot._robot.arm.model
        robot._folders, robot._streams = ProgramFolders(fixed=True), Streams()
        return robot

    def in_units(self, units: str | Units) -> Robot:
        """Return the same robot, spoken to in other units: "VAL" or "SI"."""
        other = copy(self)
        other.units = Units.of(units)
        return other

    # --- motions ---

    def move(self, *to: ArrayLike | Location, at: float | None = None, speed: float | None = None) -> Robot:
        """Go to joints, or to a Location, joint-interpolated: `move(0, -45, 180, 0, 45, 0)`, `move(trans(...))`. A
        matrix (4, 4) [m] is a Location. Warns where degrees and radians, or mm and metres, seem to be mixed up.

        It begins after the last motion, or `at` a time [s], in the middle of another if need be. `speed`: percent of
        nominal, up to 100, for this motion alone. Raises MotionError, IllegalValue, ValueError, TypeError.
        """
        return self._go("MOVE", to, at, speed)

    def moves(self, *to: ArrayLike | Location, at: float | None = None, speed: float | None = None) -> Robot:
        """Go there on a straight line of the tool tip. As `move` otherwise."""
        return self._go("MOVES", to, at, speed)

    def ready(self, *, at: float | None = None, speed: float | None = None) -> Robot:
        """Go to the ready position. As `move` otherwise."""
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
        fraction = _fraction(speed)
        text += "" if executed is None else f" AT {plain(executed)}"
        self._robot.move(target, straight=straight, executed=executed, speed=fraction, text=text)
        return self

    def _target(self, to: tuple[ArrayLike | Location, ...]) -> tuple[PoseTarget | JointTarget, str]:
        """Return the target of a motion, and its text in VAL-II."""
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
        """A matrix (4, 4) [m], or (N, 4, 4), as the Location that it is; all else as it is."""
        if isinstance(given, np.ndarray) and given.ndim > 1 and given.shape[-2:] == (4, 4):
            return Location.from_matrix(given, self.units)
        return given

    def _one_location(self, given: object, what: str) -> Location:
        """Raises TypeError for what is no Location, and no matrix."""
        found = self._location(given)
        if not isinstance(found, Location):
            raise TypeError(f"{what}: a Location is wanted, as trans(x, y, z, o, a, t) makes one, not {given!r}")
        return found

    def _looks_like_radians(self, row: Floats) -> bool:
        """Whether joints were computed (more than three decimals), are at most a turn in radians, and far from here."""
        if self.units is Units.SI or not row.any() or np.abs(row).max() > 2.0 * np.pi:
            return False
        here = np.array(self._robot.at().joints) * self._scales
        return bool((np.abs(np.round(row, 3) - row) > 1e-9).any() and np.abs(row - here).max() > NEAR)

    def follow(self, times: ArrayLike, joints: ArrayLike, *, speed: float | None = None) -> FollowReport:
        """Follow a chunk of joints (N, n) at increasing `times` (N,) [s of the robot's clock], such as a policy sends.

        It takes the place of everything from `times[0]` on, out of whatever motion is under way then, and ends at rest
        at the last sample. Velocity, acceleration and jerk stay inside the limits: what cannot be met is approached. In
        real time samples that come too late are passed over. `speed`: percent of full speed, up to 100. The errors in
        what is returned are in the units of this robot. Raises MotionError, IllegalValue, ValueError, TypeError.
        """
        instants, rows = numbers(times, "times"), numbers(joints, "joints", self._model.joint_count) / self._scales
        if instants.ndim != 1 or rows.ndim != 2:
            raise ValueError(f"times (N,) and joints (N, n) are wanted, not {instants.shape} and {rows.shape}")
        chunk = FollowChunk(tuple(instants.tolist()), tuple(map(tuple, rows.tolist())), _fraction(speed))
        found = self._robot.act(chunk)
        mean, worst = (tuple((np.array(errors) * self._scales).tolist()) for errors in (found.mean, found.worst))
        return structs.replace(found, mean=mean, worst=worst)

    def steer(self, *joints: ArrayLike, rate: float = 50.0, speed: float | None = None) -> Robot:
        """Go to joints (n,) from now on, out of any motion, as one target of many: a joystick, a leader arm, a policy.
        Each call takes the place of the one before; `wait()` ends at the last target.

        The robot follows the line through the last two targets, within its limits of velocity, acceleration and jerk.
        `rate`: targets a second, 2 to 1000. In virtual time each call lets 1 / rate s pass; in real time it waits until
        1 / rate s after the call before. After 0.5 s without a target the next one begins a new stream; without more
        targets the robot brakes. `speed`: percent of nominal, up to 100, at most.

        Raises JointOutOfRange for joints outside the range, and RequestRefused once where something else has stopped
        the robot since the target before; LeaseHeld, IllegalValue, ValueError, TypeError. Then the stream has ended.
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
        """Pull the tool towards a Location, or a matrix (4, 4) [m], from now on, as one target of many: a hand in a
        picture, a 3D mouse. Each call takes the place of the one before; `wait()` ends as near to the last as the arm
        comes.

        Any location may be given: where the arm cannot go, or cannot go so fast, the tool stays as near as it comes,
        and what is returned says what holds it. The arm keeps RIGHTY or LEFTY, ABOVE or BELOW. In virtual time each
        call lets 0.02 s pass; in real time it waits until 0.02 s after the call before. A served robot follows by
        itself for 0.6 s after the last call; one of this process takes a step with each call.

        Raises RequestRefused once where something else has stopped the robot since the call before; LeaseHeld,
        TypeError.
        """
        found = self._one_location(location, "location")
        return Dragged.of(self._streams.drag(self._robot, found.transform), self._model, self.units)

    @contextmanager
    def without_waiting(self) -> Iterator[Robot]:
        """Send motions, and targets of `steer`, one after the other, and wait for no answer but at the end, for all:
        `with r.without_waiting(): r.move(...).moves(...)`. Raises what the robot refused first.
        """
        with self._robot.without_waiting():
            yield self

    def open(self) -> Robot:
        """Open the hand, when the robot has come to rest."""
        return self._do("OPENI")

    def close(self) -> Robot:
        """Close the hand, when the robot has come to rest."""
        return self._do("CLOSEI")

    def _do(self, line: str) -> Robot:
        with told_in_python():
            self._robot.say(line, no_answer)
        return self

    def wait(self) -> Robot:
        """Wait until the robot stands: in real time as long as that takes, in virtual time not at all. A robot that
        steers or is dragged stands at its last target, or as near to it as the tool comes.
        """
        self._streams.arrive(self._robot)
        self._robot.wait()
        return self

    def abort(self) -> Robot:
        """Stop the program and the motion now; what was scheduled is dropped."""
        self._robot.abort()
        self._streams.release(self._robot)
        return self

    def lease(self, act: str, to: str = "") -> Robot:
        """Say who drives a robot that several hold: "acquire" or "ask" for the lease, "give" it `to` another user by
        name, "release" it. Who commands a motion first has it without asking. Raises LeaseHeld where another user
        drives, ValueError.
        """
        if act not in LEASE_ACTS:
            raise ValueError(f"act: {', '.join(LEASE_ACTS)} are known, not {act!r}")
        self._robot.drive(LeaseAct(act), to)
        return self

    @property
    def held(self) -> Supervisor:
        """The supervisor of the robot, in metres, radians and seconds: for `Observer` and viewers too."""
        return self._robot

    # --- positions ---

    @property
    def now(self) -> float:
        """The robot's clock [s]."""
        return self._robot.now

    @property
    def end(self) -> float:
        """Return when the robot comes to rest for good [s]."""
        return self._robot.timeline.end

    @property
    def timeline(self) -> Timeline:
        """All segments, in metres and radians: a value, which later commands do not change."""
        return self._robot.timeline

    def where(self, t: ArrayLike | None = None) -> Posture:
        """Return where the robot is at a time [s], past or future, or at times (N,); now where none is given."""
        if t is None:
            return Posture.of(self._robot.at(), self._model, self.units)
        return Posture.seen(self._robot, t, self._model, self.units)

    def preview(self) -> Preview:
        """Return what the robot will do with the commands that are on their way to it, as that is known now. At a robot
        of this process nothing is on its way.
        """
        return Preview.of(self._robot.previewed(), self._robot.arm, self.units)

    def sample(self, rate: float = 100.0, start: float | None = None, end: float | None = None) -> Posture:
        """Return where it is `rate` times a second, from the first motion to the exact end of the last, or between two
        times.

        Raises ValueError for a rate that is none, or one that gives more rows than memory holds, and for an end before
        the start.
        """
        timeline, asked = self.timeline, number(rate, "rate")
        begin = timeline.start if start is None else number(start, "start")
        last = timeline.end if end is None else number(end, "end")
        if last < begin:
            raise ValueError(f"end: {last:g} s is before the start, {begin:g} s")
        if not asked > 0.0 or not (last - begin) * asked < MOST_SAMPLES:
            raise ValueError(f"rate: more than 0 and at most {MOST_SAMPLES} samples in all, not {rate}")
        times = begin + np.arange(max(np.ceil((last - begin) * asked), 0.0)) / asked
        return self.where(np.append(times[times < last], last))

    def watch(self, rate: float = 25.0) -> Iterator[Posture]:
        """Return where it is now, `rate` times a second, for as long as somebody asks. Raises IllegalValue for a rate
        that is none.
        """
        audience = Audience(self._robot, time.monotonic)
        audience.join(number(rate, "rate"))
        while True:
            time.sleep(max(audience.peek() - time.monotonic(), 0.0))
            for look in audience.step():
                yield Posture.of(look.position, self._model, self.units)

    # --- what was measured ---

    @property
    def measured(self) -> Measured:
        """What a body, which is the robot or stands for it, has reported up to now: `measured.at(2.5)`, `.joints`,
        `.unknown_since`.
        """
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
        """Put a report of a body into the record of this robot: joints (n,), velocity (n,) and effort (n,) [N m, N] at
        a time [s]. `mode`: "follows", "holds" or "stopped". UNDO and branches leave the record as it is.

        Raises NotPossible for a robot that is served: its body is a client (`vrs body`). IllegalValue, ValueError,
        TypeError for what is no report.
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
        """Bring the body and the timeline together: the body holds, the robot goes to the measured joints inside its
        limits and on to where it was going (with `stop` it stays there), and the body follows again. The distances in
        what is returned are in the units of this robot. Raises RequestRefused where nothing is measured, MotionError.
        """
        found = self._robot.act(ResyncBody(stop))
        return structs.replace(found, distances=tuple((np.array(found.distances) * self._scales).tolist()))

    # --- the cell ---

    @property
    def parts(self) -> dict[str, PartPlace]:
        """The parts of the cell as they are now, by name; none where there is no cell with parts."""
        return {row.name: PartPlace.of(row, self.units) for row in self._robot.act(LookAtParts()).rows}

    def part(self, name: str) -> CellPart:
        """A part of the cell: `part("box").at(2.5).location`. Raises KeyError where there is none of that name."""

        def look(t: float | None) -> PartPlace:
            return next(
                PartPlace.of(row, self.units) for row in self._robot.act(LookAtParts(t)).rows if row.name == name
            )

        known = [row.name for row in self._robot.act(LookAtParts()).rows]
        if name not in known:
            raise KeyError(f"there is no part {name!r}; there are {', '.join(known) or 'none'}")
        return CellPart(name, look)

    # --- kinematics ---

    @property
    def model(self) -> Model:
        """What the robot is: `model.limits` (n, 2), `.dof`, `.names`, `.poses`, in the units of this robot."""
        return Model.of(self._model, self.units)

    @property
    def joints(self) -> Floats:
        """(n,): the joints now."""
        return self.where().joints

    @property
    def tool(self) -> Location:
        """The tool tip as the flange sees it. Give it another, a Location or (4, 4) [m], to change tools: the robot
        does that in turn, after the motions that are commanded.
        """
        return Location.of(self._robot.frames.tool, self.units)

    @tool.setter
    def tool(self, location: Location | ArrayLike) -> None:
        found = self._one_location(location, "tool")
        self._do(f"TOOL TRANS({', '.join(map(plain, numbers_of(found.transform)))})")

    @property
    def speed(self) -> float:
        """The speed of all motions [% of full], as the dial of a controller: each motion has its own speed on top. Give
        it another, 0.01 to 327; motions that are commanded already keep theirs. Raises IllegalValue.
        """
        return float(str(self["SPEED(1)"]))

    @speed.setter
    def speed(self, percent: float) -> None:
        if not SLOWEST <= percent <= FASTEST:
            raise IllegalValue(f"speed {percent}", f"it is a number of percent, from {SLOWEST} to {FASTEST:g}")
        self._do(f"SPEED {plain(float(percent))}")

    def fk(self, joints: ArrayLike | None = None, *, link: int | None = None) -> Location:
        """The tool tip in the world: of joints (n,) or (N, n), or where the robot is now. `link`: the frame of that
        link instead, 0 (the base) to n (the flange); joint i turns about z of frame i - 1. Raises ValueError.
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
        """Return all ways to reach a location, or N of them, in each configuration: joints (k, n) or (N, k, n). A
        location may be a matrix (4, 4) or (N, 4, 4) [m].
        """
        return ways(self._robot.arm, self._robot.frames, self._one_location(location, "location"), self.units)

    def jacobian(self, joints: ArrayLike | None = None) -> Floats:
        """(6, n) or (N, 6, n), of joints (n,) or (N, n), or of now: what joint rates make of the tool's velocity
        (vx, vy, vz, wx, wy, wz) in the robot's frame; in mm and degrees, or SI.
        """
        return jacobian(self._robot.arm, self._robot.frames, self._any_joints(joints), self.units)

    def why(self, *to: ArrayLike | Location) -> Replies:
        """Why a location, or joints, can be reached from here or not, and what MOVE and MOVES would do.

        A ReachReport: `reach.options`, `reach.chosen`, `reach.reason`, `reach.line`, in metres and radians.
        """
        target, shown = self._target(to)
        return Replies((self._robot.act(Explain(Goal.of(target), shown)),))

    def explain(self, what: str = "") -> Explanation:
        """Explain with numbers, and change nothing: `explain("MOVES part AT 2")`, "table:part", "OAT part", "IK part",
        "SPLICE"; all that there is where nothing is named. A notebook shows formulas and matrices.

        Its values are those of `vrs_cli.values.results`, in metres, radians and seconds. A motion that the robot
        would refuse is explained too. Raises VrsError for what cannot be read, or has no value.
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
        """A line as at the prompt of the shell: `do("SPEED 50")`. `answers`: to what it asks. `limits` and the others:
        for this line, times of `signals` from its beginning. Raises VrsError.
        """
        if not isinstance(line, str):
            raise TypeError(f"line: a text is wanted, not {line!r}")
        if "\n" in line.strip() or line.lstrip().upper().startswith(".PROGRAM"):
            raise ValueError("line: one line is wanted; `define` takes the text of programs")
        robot = self._under(conditions_of(limits, folder, cell, signals))
        return Replies(robot.say(line.strip(), _in_order(answers)))

    def prompt(self, text: str, answer: Answers = no_answer) -> Replies:
        """Several lines as if they were typed at the prompt, programs among them. Mistakes are among the replies."""
        return Replies(self._robot.type(text, answer))

    def define(self, text: str) -> tuple[str, ...]:
        """Put programs and variables in memory, from the text of a file (.PROGRAM to .END); the names of the programs.

        Raises ProgramNotExecutable for a text with mistakes.
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
        """Load a file of programs and execute one of them, the first unless it is named. As `execute` otherwise.
        Where neither the robot nor the call has a cell, it is that which the file names (`; cell: FILE`), or NAME.toml
        beside NAME.v2.

        Raises NonexistentFile, FileError, and ProgramNotExecutable for a file with mistakes.
        """
        conditions = conditions_of(limits, folder, self._cell_of(file) if cell is None else cell, signals)
        names = self._under(conditions).load(file)
        self._folders.put(names, find_program_file(Path(file)).parent)
        if program is None and not names:
            raise NotPossible(f"{file} holds no program", "a program begins with .PROGRAM name")
        return self._execute(program or names[0], cycles, answers, check, conditions)

    def _cell_of(self, file: str | Path) -> Path | None:
        """The cell that a program file names, for a robot of this process that has none."""
        port, path = self._robot.port, find_program_file(Path(file))
        if not isinstance(port, LocalPort) or port.session.driver.cell is not NO_CELL:
            return None
        found = cell_of_program(read_program_file(path), path, Folder(path.parent))
        return None if found is None else found[0]

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
        """Execute a program that is in memory, and wait for its end. `answers`: to its PROMPTs. `limits` and the
        others: for this run, times of `signals` from its beginning.

        Raises UndefinedName, and ProgramFailed where it stops with an error, unless `check` is false: then the result
        tells of it.
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
        """The robot, with conditions of its own for one call. Raises NotPossible for a robot that is served."""
        if conditions is None:
            return self._robot
        port = self._robot.port
        if not isinstance(port, LocalPort):
            what = "limits, folder, cell and signals are for a robot of this process"
            raise NotPossible(what, "a robot that is served has those of its server")
        return self._robot.on(port.under(conditions))

    def __getitem__(self, expression: str) -> float | str | Location | Floats:
        """The value of a variable or an expression of VAL-II: a number, a text, a Location, or joints (n,)."""
        return self._shown(self._robot.act(Evaluate(expression)).value)

    def __setitem__(self, variable: str, value: float | str | Location | ArrayLike) -> None:
        """Give a variable a value; `#name` has joints, `$name` a text."""
        self._robot.act(Assign(variable, Valued.of(self._value(variable, value))))

    # --- the past, and other courses of events ---

    @property
    def commands(self) -> tuple[CommandRecord, ...]:
        """All motion commands that hold: number, text, when they were issued, begin and end [s]."""
        return self._robot.act(ListCommands()).commands

    def undo(self, count: int = 1) -> Robot:
        """Take the last motion commands back. Raises NotPossible where there are not so many."""
        self._robot.act(Undo(count))
        return self

    def redo(self, count: int = 1) -> Robot:
        """Do again what `undo` took back."""
        self._robot.act(Redo(count))
        return self

    @property
    def branches(self) -> tuple[str, ...]:
        """The names of all branches, main first."""
        return tuple(row.name for row in self._robot.act(ListBranches()).rows)

    @property
    def branch(self) -> str:
        """The name of the present branch."""
        return next(row.name for row in self._robot.act(ListBranches()).rows if row.present)

    @contextmanager
    def what_if(self, name: str) -> Iterator[Robot]:
        """Try something else: `with r.what_if("fast"): r.move(...)` is on a branch of that name, made where there is
        none, and the robot comes back as it was. Raises ValueError for a name that no branch can have, NotPossible in
        real time and while a program runs.
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
        """Two branches side by side: `comparison.a.duration`, `comparison.tool.distance`, ... [s, m, rad]."""
        return Replies((self._robot.act(Compare(a, b)),))

    def merge(self, name: str) -> Robot:
        """Make what a branch has become the main timeline."""
        return self._do(f"MERGE {name}")

    # --- files, events, pictures ---

    def save(self, path: str | Path) -> None:
        """Write the trajectory to a .vrst file. Raises FileError."""
        self._robot.save(Path(path))

    def export(self, path: str | Path, rate: float = 100.0) -> None:
        """Write `rate` samples a second to a file, as `vrs export` does: .csv, .json, .npz, or .mcap with the frames of
        all links; in mm and degrees, .npz and .mcap in metres and radians. Raises ValueError for another ending or
        rate, NotPossible where a package is missing, FileError.
        """
        ends = [one.suffix for one in EXPORTERS.values()]
        exporter = next((one for one in EXPORTERS.values() if one.suffix == Path(path).suffix.lower()), None)
        if exporter is None:
            raise ValueError(f"path: it ends in {', '.join(dict.fromkeys(ends))}, not {path}")
        if not number(rate, "rate") > 0.0:
            raise ValueError(f"rate: more than 0 samples a second are wanted, not {rate}")
        world = self._robot.port.world if exporter.shows_cell else None
        with told_in_python():
            exporter.check()
            with atomically(path) as stream:
                write = exporter.write if world is None else partial(exporter.write, world=world)
                write(stream, self._robot.arm, self.timeline, float(rate))

    def subscribe(self, callback: Callable[[Change], object]) -> Callable[[], None]:
        """Have every change of the timeline told to a callback, in a thread of its own; what is returned ends that.

        The first Change is the timeline as it is. Each has `version` and `timeline`, and a `delta` where it is one.
        """
        return hear(self._robot.subscribe(), callback)

    def plot(self, *what: str | int) -> Picture:
        """Curves over the whole time: joints (by number), "velocity", "acceleration", "X", "tool", "speed", "hand".

        Raises NotPossible where there is no motion yet, and for what cannot be drawn together.
        """
        with told_in_python():
            asked = select_curves(self._robot.arm, [str(word) for word in what])
        if self.end <= self.timeline.start:
            raise NotPossible("there is no motion yet", "move the robot first")
        return Picture((plot_curves(self._robot.arm, self.timeline, asked),))

    def view(
        self, timeline: Timeline | None = None, *, height: int = SCENE_HEIGHT, cell: str | Path | Cell | None = None
    ) -> Scene:
        """The arm as it moves: a notebook plays it below the cell, `.open()` in a browser, and
        `.save("a.html")` writes the page.

        It follows its own timeline, or another one for this robot. The parts, fixtures and sensors of a cell file are
        around it; without one, those of the cell in which the robot stands. Raises NotPossible where the page is not
        built, FileError for a cell that cannot be read.
        """
        world = self._robot.port.world
        if cell is not None:
            from vrs_cli.world.course import World

            world = World(self._robot.arm, cell if isinstance(cell, Cell) else read_cell(str(cell)))
        return Scene(self._robot.arm, timeline or self.timeline, height, world)

    def leave(self) -> None:
        """Let it go. A served robot stays as it is for others, and refuses what is asked of it here from now on; one of
        this process writes what its programs left in their files.
        """
        self._robot.close()

    def __enter__(self) -> Robot:
        return self

    def __exit__(self, *_error: object) -> None:
        self.leave()

    def __repr__(self) -> str:
        motions, here = len(self.commands), place_text(self.where().location)
        return f"<Robot {self._model.name}: {motions} motions to {self.end:.3f} s, now {self.now:.3f} s, {here}>"

    def _repr_html_(self) -> str:
        return f"<p>{self._model.title}</p>{Replies((self._robot.act(ListMotions()),))._repr_html_()}"

    # --- the edge: numbers in, numbers out ---

    @property
    def _scales(self) -> Floats:
        return self.units.scales(self._model.units, self._model.joint_count)

    def _joints(self, given: object, what: str) -> Joints:
        """One set of joints [rad, m], checked; of degrees with the very bits that VAL-II makes of them."""
        row = numbers(given, what, self._model.joint_count)  # type: ignore[arg-type]
        if row.ndim != 1:
            raise ValueError(f"{what}: one set of joints is wanted, not {row.shape}")
        joints = tuple(row.tolist())
        return joints if self.units is Units.SI else self._model.units.read(joints)

    def _any_joints(self, given: ArrayLike | None) -> Floats:
        """Joints (..., n) [rad, m]; those of now where none are given."""
        if given is None:
            return np.array(self._robot.at().joints)
        return numbers(given, "joints", self._model.joint_count) / self._scales

    def _shown(self, value: Value) -> float | str | Location | Floats:
        if isinstance(value, Transform):
            return Location.of(value, self.units)
        return np.array(value) * self._scales if isinstance(value, tuple) else value

    def _value(self, name: str, given: float | str | Location | ArrayLike) -> Value:
        given = self._location(given)  # type: ignore[assignment]
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
    """The robot of a trajectory file (.vrst), at the end of its timeline: to look at it, or to go on with it. `limits`
    and the others: as for `Robot`.

    Raises NonexistentFile, FileDamaged, FileError. Warns of what a file of before has in it that a robot cannot do, and
    of a last line that was not written to its end.
    """
    with told_in_python():
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
    """Return percent of nominal speed as a fraction. Raises ValueError."""
    fraction = None if speed is None else number(speed, "speed") / 100.0
    if fraction is not None and not 0.0 < fraction <= 1.0:
        raise ValueError(f"speed: percent of nominal are wanted, more than 0 and up to 100, not {speed}")
    return fraction


def _in_order(answers: Iterable[str]) -> Answers:
    """Answers that are there already."""
    left = iter(answers)
    return lambda _question: next(left, None)


def _clock(realtime: bool | float) -> RobotClock:
    if realtime is False:
        return VirtualClock()
    rate = 1.0 if realtime is True else number(realtime, "realtime")
    if not SLOWEST_RATE <= rate <= FASTEST_RATE:
        raise ValueError(f"realtime: {SLOWEST_RATE:g} to {FASTEST_RATE:g} seconds of the robot in one, not {rate:g}")
    return WallClock(time.monotonic, time.sleep, rate)
