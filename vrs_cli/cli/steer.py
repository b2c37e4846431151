"""Carry out `vrs lab steer`: let the robot follow a stream of targets from a file or another program."""

from __future__ import annotations

import gc
import itertools
import json
import sys
from abc import ABC, abstractmethod
from argparse import Namespace
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from itertools import chain, pairwise
from math import degrees
from queue import Empty, Queue
from threading import Thread
from time import monotonic
from typing import Any, TextIO

from vrs_cli.api.control import CHUNK_S, ChunkSteering
from vrs_cli.cli import main, remote, sources
from vrs_cli.cli.command_line import CommandLineError, chosen_robot, clock_of, refuse
from vrs_cli.cli.commands import STANDARD_STREAM
from vrs_cli.cli.outputs import Outputs, journal
from vrs_cli.engine.clock import RobotClock, VirtualClock
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import FileDamaged, FileError, MotionError, NonexistentFile, VrsError
from vrs_cli.files.timed_lines import TimedTarget, read_targets
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.joints import JointKind, joints_outside
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.render.progress import RunProgress
from vrs_cli.repl.interrupt import Stoppable
from vrs_cli.values.acts import ListBranches
from vrs_cli.values.commands import SetParameter
from vrs_cli.values.numbers import count

KEPT = 1000  # number of targets between two calls of gc.freeze, which exempts existing objects from collection
MAX_COMPLAINTS = 5  # maximum number of bad lines (no target, or a target out of reach) that are reported
MAX_LINE_CHARS = 1 << 16  # maximum length of a line in characters; a longer one is cut and is not a target

LOCAL = ("save", "csv", "rate", "plot", "report", "report_at", "profile", "realtime", "robot", "base", "tip", "task")
ADDRESSES = ("ws://", "wss://")
# lines of the results
BEYOND = "went beyond the range of a joint, which stopped at its end"
UNREAD = "could not be read"
ALLOWANCE = 0.1  # [s] added to the measured round trip, for varying delays and for planning


def steer(options: Namespace) -> int:
    """Follow a stream to its end. Return 1 if some lines contained no target or a target out of reach."""
    outputs = Outputs.of(options)
    run = _LocalRun if _takes_address(options) is None else _ServedRun
    return run(options, outputs, RunProgress(options.file)).run()


def _takes_address(options: Namespace) -> str | None:
    """Find the address of a served robot among the arguments, put it into `options.url`, and return it.

    Raises CommandLineError if another argument stands where the address belongs, or if an option is not supported by a
    served robot.
    """
    if options.file.startswith(ADDRESSES):
        options.url, options.file = options.file, options.url or STANDARD_STREAM
    if options.url is None:
        if options.lead is not None:
            raise CommandLineError("--lead is for a robot that is served", "give its address, ws://HOST:PORT")
        return None
    file_is_address, url_is_address = options.file.startswith(ADDRESSES), options.url.startswith(ADDRESSES)
    local = next((name.replace("_", "-") for name in LOCAL if getattr(options, name) is not None), "")
    refuse(
        (
            file_is_address or not url_is_address,
            f"one argument too many: {options.file if file_is_address else options.url}",
            "vrs lab steer ws://HOST:PORT FILE.csv",
        ),
        (
            local,
            f"--{local} is for a robot of this process",
            f"leave it out: {options.url} has its own robot and clock",
        ),
    )
    return str(options.url)


@contextmanager
def _lines(path: str) -> Iterator[Iterable[str]]:
    """Yield the lines of a file, or of standard input as they arrive. Raises NonexistentFile."""
    try:
        stdin = path == STANDARD_STREAM
        opened = nullcontext(sys.stdin) if stdin else open(path, encoding="utf-8", errors="replace")  # noqa: SIM115
    except OSError as error:
        raise NonexistentFile(f"{path} cannot be read: {error.strerror}") from None
    with opened as stream:
        yield _read(stream)


def _read(stream: TextIO) -> Iterator[str]:
    """Yield the lines of a stream until its end, or until the terminal is closed."""
    with suppress(OSError):
        yield from iter(partial(stream.readline, MAX_LINE_CHARS), "")


def _errors(
    kinds: Collection[JointKind], turning: tuple[float, float], sliding: tuple[float, float]
) -> list[tuple[str, float, float]]:
    """Return the unit, the mean and the maximum of the errors [deg, mm], for each kind of joint that the robot has.
    `turning`, `sliding`: the mean and the maximum [rad, m]."""
    rows = ((JointKind.REVOLUTE, "deg", degrees(1.0), turning), (JointKind.PRISMATIC, "mm", 1e3, sliding))
    return [(unit, scale * mean, scale * worst) for kind, unit, scale, (mean, worst) in rows if kind in kinds]


@dataclass(slots=True)
class _Run(ABC):
    """The run of one stream of targets. `skipped`: the number of lines that contained no target. `unreached`: the
    number of targets out of reach."""

    options: Namespace
    outputs: Outputs
    progress: RunProgress
    skipped: int = 0
    unreached: int = 0

    @property
    def live(self) -> bool:
        return bool(self.options.file == STANDARD_STREAM)

    @property
    def source(self) -> str:
        """Return the name of the stream in messages."""
        return "standard input" if self.live else str(self.options.file)

    def run(self) -> int:
        """Follow the stream and report; return the exit status."""
        stop = Stoppable(lambda: True)
        with _lines(self.options.file) as lines:
            complete = self.follow_and_tell(lines, stop)
        stop.end()
        return main.OK if complete and not (self.unreached or self.skipped) else main.FAILED

    @abstractmethod
    def follow_and_tell(self, lines: Iterable[str], stop: Stoppable) -> bool:
        """Follow the targets of these lines, until a signal arrives, and report. Return whether nothing is missing."""

    def _targets(
        self, lines: Iterable[str], model: RobotModel, *, relative: bool
    ) -> tuple[TimedTarget, Iterator[TimedTarget]]:
        """Return the first target, and all targets. Raises CommandLineError for an empty stream, FileDamaged if all
        lines are wrong."""
        targets = read_targets(
            lines,
            model.joint_count,
            self.source,
            relative=relative,
            live=self.live,
            units=model.units,
            wrong=self._skip,
        )
        if (first := next(targets, None)) is None:
            kind = FileDamaged if self.skipped else CommandLineError
            raise kind(f"{self.source} holds no target", "a line is a time and the joints")
        return first, chain((first,), targets)

    def _follow(
        self,
        steering: Steering | ChunkSteering,
        take: Callable[[], TimedTarget | None],
        clock: RobotClock,
        stop: Stoppable,
    ) -> None:
        """Follow each target when its time has come, until `take` returns None or a signal arrives."""
        for number in itertools.count():
            it = None
            with stop.broken_off():
                it = take()
                if it is not None:
                    clock.advance(it.t)
            if it is None or stop.number is not None:
                break
            if number % KEPT == 0:
                gc.freeze()  # the timeline only grows, so garbage collection would take longer and longer
            try:
                steering.to(it.target, it.t)
            except MotionError as error:
                self.unreached += 1
                self._complain(f"{self.source}:{it.line}: {error}")
            self.progress(it.t)
        steering.finish()

    # --- messages ---------------------------------------------------------------------------------------

    def _skip(self, wrong: VrsError) -> None:
        self.skipped += 1
        self._complain(str(wrong))

    def _complain(self, what: str) -> None:
        count = self.skipped + self.unreached
        if count <= MAX_COMPLAINTS:
            self._say(what)
        elif count == MAX_COMPLAINTS + 1:
            self._say("and others")

    def _say(self, what: str) -> None:
        self.progress.say(f"{self.options.prog}: {what}")

    def _tell(self, found: Mapping[str, Any], text: str, *rows: tuple[int, str, str]) -> None:
        """Print the results: `found` with --json, else `text` and a line for each number that is not 0."""
        if self.options.json:
            print(json.dumps(found, indent=2))
            return
        for number, noun, what in rows:
            text += f"\n{count(number, noun)} {what}" * bool(number)
        print(text, file=sys.stderr if self.outputs.takes_standard_output else sys.stdout)


class _LocalRun(_Run):
    """The run of one stream of targets that a robot of this process follows."""

    def follow_and_tell(self, lines: Iterable[str], stop: Stoppable) -> bool:
        """Follow the targets and report. If the file of --save cannot be written, brake the robot and end the run."""
        options, model, realtime = self.options, chosen_robot(self.options), self.options.realtime is not None
        first, targets = self._targets(lines, model, relative=options.relative or realtime)
        steering, failed = self._begin(model, first), False
        engine = steering.engine
        with self.progress, stop, journal(options.save, engine, self._say, durable=realtime) as sound:
            try:
                self._follow(steering, partial(next, targets, None), engine.clock, stop)
            except FileError as error:
                engine.stop()
                self._say(str(error))
                failed = True
            failed = failed or not sound()
        self._tell_results(steering)
        self.outputs.write(engine.arm, engine.timeline, options.file)
        return not failed

    def _begin(self, model: RobotModel, first: TimedTarget) -> Steering:
        """Return a robot that is ready to follow targets. It starts at the joints of the first target if its time is 0
        and they are within their ranges, else in its READY pose."""
        start = None if first.t > 0.0 or isinstance(first.target, Transform) else first.target
        if start is not None and joints_outside(start, model.lower, model.upper):
            start = None
        engine = Engine(model, start=start, clock=clock_of(self.options.realtime))
        if self.options.profile is not None:
            engine.perform(SetParameter("PROFILE", self.options.profile))
        return Steering(engine, speed=self.options.speed / 100.0)

    def _tell_results(self, steering: Steering) -> None:
        engine, followed, lag = steering.engine, steering.following, steering.following.lag
        errors = _errors(
            engine.model.units.kinds, *((error.rms, error.worst) for error in (followed.turning, followed.sliding))
        )
        found = {
            "targets": followed.targets,
            "held": followed.held,
            "out_of_reach": self.unreached,
            "skipped": self.skipped,
            "duration_s": round(engine.end, 9),
            "lag_s": {"rms": round(lag.rms, 6), "max": round(lag.worst, 6)},
            **{f"error_{unit}": {"rms": round(rms, 6), "max": round(worst, 6)} for unit, rms, worst in errors},
            "final": sources.position_object(engine.position(engine.end), engine.model.units),
        }
        said = "; ".join(f"{rms:.2f} {unit} rms, {worst:.2f} at most" for unit, rms, worst in errors)
        text = f"{count(followed.targets, 'target')} in {engine.end:.3f} s, followed to {said}"
        late = f"\nThey came late by {lag.rms:.3f} s rms, {lag.worst:.3f} at most" if engine.realtime else ""
        self._tell(found, text + late, (followed.held, "target", BEYOND), (self.skipped, "line", UNREAD))


class _ServedRun(_Run):
    """The run of one stream of targets that a served robot follows. If the stream pauses, the robot stops at the last
    target."""

    def follow_and_tell(self, lines: Iterable[str], stop: Stoppable) -> bool:
        with closing(SocketPort(remote.client_of(self.options))) as port:
            robot = Supervisor(port)
            model, clock = robot.arm.model, clock_of(robot.followed.rate) or VirtualClock()
            _, targets = self._targets(lines, model, relative=True)
            steering = ChunkSteering(robot, self._lead(robot), speed=self.options.speed / 100.0)
            read = _read_beside(targets)

            def take() -> TimedTarget | None:
                it: TimedTarget | VrsError | None = None
                while steering.refused is None:
                    with suppress(Empty):
                        it = read.get(timeout=CHUNK_S)
                        break
                    steering.send()
                if isinstance(it, VrsError):
                    raise it
                if it is not None and it.t - clock.now > CHUNK_S:
                    steering.send()
                return it

            with self.progress, stop:
                self._follow(steering, take, clock, stop)
            self._tell_results(steering, model.units.kinds)
        return not (steering.followed.lost or steering.followed.late)

    def _lead(self, robot: Supervisor) -> float:
        """Return --lead, or else the longest of three measured round trips, plus the duration of a chunk (targets that
        are sent together), plus ALLOWANCE [s]."""
        if self.options.lead is not None:
            return float(self.options.lead)
        times = [monotonic()]
        for _ in range(3):
            robot.act(ListBranches())
            times.append(monotonic())
        return max(b - a for a, b in pairwise(times)) + CHUNK_S + ALLOWANCE

    def _tell_results(self, steering: ChunkSteering, kinds: Collection[JointKind]) -> None:
        followed = steering.followed
        errors = _errors(kinds, *((error.mean, error.worst) for error in (followed.turning, followed.sliding)))
        found = {
            "targets": followed.targets,
            "chunks": followed.chunks,
            "lead_s": round(steering.lead, 6),
            "late": followed.late,
            "lost": followed.lost,
            "held": followed.held,
            "out_of_reach": self.unreached,
            "skipped": self.skipped,
            **{f"error_{unit}": {"mean": round(mean, 6), "max": round(worst, 6)} for unit, mean, worst in errors},
        }
        said = "; ".join(f"{mean:.2f} {unit} in the mean, {worst:.2f} at most" for unit, mean, worst in errors)
        self._tell(
            found,
            f"{count(followed.targets, 'target')}, each {steering.lead:.2f} s after its time, followed to {said}",
            (followed.late, "target", "came too late for the robot: give a longer --lead"),
            (followed.lost, "target", "got lost, as there was no connection"),
            (followed.held, "target", BEYOND),
            (self.skipped, "line", UNREAD),
        )


def _read_beside(targets: Iterator[TimedTarget]) -> Queue[TimedTarget | VrsError | None]:
    """Read up to 1000 targets ahead in a thread. Return a queue of the targets; it ends with None or with the error of
    the stream."""
    found: Queue[TimedTarget | VrsError | None] = Queue(1000)

    def read() -> None:
        try:
            for it in targets:
                found.put(it)
            found.put(None)
        except VrsError as error:
            found.put(error)

    Thread(target=read, name="vrs steer reads", daemon=True).start()
    return found
