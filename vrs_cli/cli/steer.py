"""`vrs steer`: the robot follows a stream of targets, from a file or from another program."""

from __future__ import annotations

import argparse
import gc
import json
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from itertools import chain
from math import degrees
from typing import TYPE_CHECKING, TextIO

from vrs_cli.cli.command_line import (
    REALTIME,
    ROBOT,
    STANDARD_STREAM,
    CommandLineError,
    Parser,
    chosen_robot,
    clock_of,
    option,
    positive,
)
from vrs_cli.cli.main import FAILED, OK
from vrs_cli.cli.outputs import OUTPUT_OPTIONS, Outputs, journal
from vrs_cli.errors import FileDamaged, FileError, MotionError, NonexistentFile, VrsError

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from vrs_cli.engine.clock import RobotClock
    from vrs_cli.files.timed_lines import TimedTarget
    from vrs_cli.interfaces.steering import Following, Steering
    from vrs_cli.kinematics.joints import JointKind, Joints
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.render.progress import RunProgress
    from vrs_cli.repl.interrupt import Stoppable

KEPT = 1000  # targets after which what they left is not looked through for garbage any more
MOST_TOLD = 5  # lines that are no targets, or out of reach, that are named
LONGEST_LINE = 1 << 16  # characters: a longer one is no target, and is not kept whole

EPILOG = """\
A line is a time and the joints [s, deg; mm where a joint slides]; or the first line names the columns:
t,jt1,...,jt6 or t,x,y,z,o,a,t_angle [s, mm, deg], as vrs run --csv writes them. Each target is followed from
its time on, within all limits, until the next one; at the end, or after Ctrl-C, the robot stops at the last one.
A line that is no target is named and left out.

  vrs steer taught.csv --csv followed.csv
  vrs steer taught.csv --save followed.vrst --json
  robot_logger | vrs steer - --realtime
"""


def steer(options: Namespace) -> int:
    """Follow a stream to its end; returns 1 when some of its lines were no targets, or out of reach."""
    outputs = Outputs.of(options)
    from vrs_cli.render.progress import RunProgress

    return _Run(options, outputs, RunProgress(options.file)).run()


def steer_parser(prog: str) -> Parser:
    from vrs_cli.kinematics.model import PROFILES

    return Parser(
        prog,
        "Let the virtual robot follow a stream of targets.",
        EPILOG,
        option("file", metavar="FILE.csv", help="the targets (- is standard input, line by line)"),
        *ROBOT,
        option("--speed", metavar="PCT", type=_percent, default=100.0, help="at most so much of full speed"),
        option(
            "--profile",
            type=str.upper,
            choices=PROFILES,
            help="LSPB: without limits of jerk; the others: with them (default: as the robot's file says)",
        ),
        option("--relative", action="store_true", help="times count from the first one (in real time, always)"),
        REALTIME,
        option("--save", metavar="T.vrst", help="save the trajectory, target by target"),
        *OUTPUT_OPTIONS,
        option("--json", action="store_true", help="print one JSON object and nothing else"),
    )


def _percent(text: str) -> float:
    value = positive(text)
    if value > 100.0:
        raise argparse.ArgumentTypeError(f"{text} % is more than full speed")
    return value


@contextmanager
def _lines(path: str) -> Iterator[Iterable[str]]:
    """The lines of a file, or of standard input as they come. Raises NonexistentFile."""
    try:
        stdin = path == STANDARD_STREAM
        opened = nullcontext(sys.stdin) if stdin else open(path, encoding="utf-8", errors="replace")  # noqa: SIM115
    except OSError as error:
        raise NonexistentFile(f"{path} cannot be read: {error.strerror}") from None
    with opened as stream:
        yield _read(stream)


def _read(stream: TextIO) -> Iterator[str]:
    """Line by line, to the end; a terminal that has gone is one."""
    with suppress(OSError):
        yield from iter(partial(stream.readline, LONGEST_LINE), "")


def _start(model: RobotModel, first: TimedTarget) -> Joints | None:
    """The joints at which a recording begins at time 0; None (READY) where it does not."""
    from vrs_cli.kinematics.joints import joints_outside
    from vrs_cli.kinematics.transform import Transform

    joints = first.target
    if first.t > 0.0 or isinstance(joints, Transform) or joints_outside(joints, model.lower, model.upper):
        return None
    return joints


def _errors(following: Following, kinds: Collection[JointKind]) -> list[tuple[str, float, float]]:
    """Unit, root mean square and maximum of the errors, for each kind of joint that the robot has [deg, mm]."""
    from vrs_cli.kinematics.joints import JointKind

    told = (
        (JointKind.REVOLUTE, "deg", degrees(1.0), following.turning),
        (JointKind.PRISMATIC, "mm", 1e3, following.sliding),
    )
    return [(unit, scale * error.rms, scale * error.worst) for kind, unit, scale, error in told if kind in kinds]


@dataclass(slots=True)
class _Run:
    """One stream: the options, and how many of its lines were no targets, or out of reach."""

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
        """The name of the stream in messages."""
        return "standard input" if self.live else str(self.options.file)

    def run(self) -> int:
        """Follow, and tell how it went, whatever ended it; the exit status."""
        from vrs_cli.files.timed_lines import read_targets
        from vrs_cli.repl.interrupt import Stoppable

        model, stop = chosen_robot(self.options), Stoppable(lambda: True)
        with _lines(self.options.file) as lines:
            targets = read_targets(
                lines,
                model.joint_count,
                self.source,
                relative=self.options.relative or self.options.realtime is not None,
                live=self.live,
                units=model.units,
                wrong=self._skip,
            )
            steering = self._begin(model, first := self._first(targets))
            with self.progress, stop:
                failed = self._recorded(steering, chain((first,), targets), stop)
        self._tell(steering)
        self.outputs.write(steering.engine.arm, steering.engine.timeline, self.options.file)
        stop.end()
        return FAILED if failed or self.unreached or self.skipped else OK

    def _first(self, targets: Iterator[TimedTarget]) -> TimedTarget:
        """Raises CommandLineError, or FileDamaged for a stream with nothing but wrong lines."""
        first = next(targets, None)
        if first is None:
            kind = FileDamaged if self.skipped else CommandLineError
            raise kind(f"{self.source} holds no target", "a line is a time and the joints")
        return first

    def _begin(self, model: RobotModel, first: TimedTarget) -> Steering:
        from vrs_cli.engine.engine import Engine
        from vrs_cli.interfaces.steering import Steering
        from vrs_cli.values.commands import SetParameter

        engine = Engine(model, start=_start(model, first), clock=clock_of(self.options.realtime))
        if self.options.profile is not None:
            engine.perform(SetParameter("PROFILE", self.options.profile))
        return Steering(engine, speed=self.options.speed / 100.0)

    def _recorded(self, steering: Steering, targets: Iterator[TimedTarget], stop: Stoppable) -> bool:
        """Follow the targets; return whether part of the motion is missing in the file that was asked for: the stream
        ends, and the robot brakes, where it cannot be written.
        """
        failed, durable = False, self.options.realtime is not None
        with journal(self.options.save, steering.engine, self._say, durable=durable) as sound:
            try:
                self._follow(steering, targets, stop)
            except FileError as error:
                steering.engine.stop()
                self._say(str(error))
                failed = True
        return failed or not sound()

    def _follow(self, steering: Steering, targets: Iterator[TimedTarget], stop: Stoppable) -> None:
        """To the end of the stream, or to a signal."""
        for count, it in enumerate(_until_stopped(targets, stop, steering.engine.clock)):
            if count % KEPT == 0:
                gc.freeze()  # the timeline only grows: its garbage collection would cost ever longer pauses
            try:
                steering.to(it.target, it.t)
            except MotionError as error:
                self.unreached += 1
                self._complain(f"{self.source}:{it.line}: {error}")
            self.progress(steering.engine.now)
        steering.finish()

    # --- what is told -----------------------------------------------------------------------------------

    def _skip(self, wrong: VrsError) -> None:
        self.skipped += 1
        self._complain(str(wrong))

    def _complain(self, what: str) -> None:
        count = self.skipped + self.unreached
        if count <= MOST_TOLD:
            self._say(what)
        elif count == MOST_TOLD + 1:
            self._say("and others")

    def _say(self, what: str) -> None:
        self.progress.say(f"{self.options.prog}: {what}")

    def _tell(self, steering: Steering) -> None:
        if self.options.json:
            print(json.dumps(self._object(steering), indent=2))
            return
        from vrs_cli.values.numbers import count

        tell = partial(print, file=sys.stderr if self.outputs.takes_standard_output else sys.stdout)
        engine, following = steering.engine, steering.following
        errors = _errors(following, engine.model.units.kinds)
        said = "; ".join(f"{rms:.2f} {unit} rms, {worst:.2f} at most" for unit, rms, worst in errors)
        tell(f"{count(following.targets, 'target')} in {engine.end:.3f} s, followed to {said}")
        if engine.realtime:
            tell(f"They came late by {following.lag.rms:.3f} s rms, {following.lag.worst:.3f} at most")
        if following.held:
            were = "was" if following.held == 1 else "were"
            tell(f"{count(following.held, 'target')} {were} beyond the range of a joint, which stopped at its end")
        if self.skipped:
            were = "was no target" if self.skipped == 1 else "were no targets"
            tell(f"{count(self.skipped, 'line')} {were}")

    def _object(self, steering: Steering) -> dict[str, object]:
        from vrs_cli.cli.sources import position_object

        engine, following = steering.engine, steering.following
        errors = _errors(following, engine.model.units.kinds)
        return {
            "targets": following.targets,
            "held": following.held,
            "out_of_reach": self.unreached,
            "skipped": self.skipped,
            "duration_s": round(engine.end, 9),
            "lag_s": {"rms": round(following.lag.rms, 6), "max": round(following.lag.worst, 6)},
            **{f"error_{unit}": {"rms": round(rms, 6), "max": round(worst, 6)} for unit, rms, worst in errors},
            "final": position_object(engine.position(engine.end), engine.model.units),
        }


def _until_stopped(targets: Iterator[TimedTarget], stop: Stoppable, clock: RobotClock) -> Iterator[TimedTarget]:
    """Each target when its time has come; no more after a signal."""
    while stop.number is None:
        it = None
        with stop.broken_off():
            it = next(targets, None)
            if it is not None:
                clock.advance(it.t)
        if it is None or stop.number is not None:
            return
        yield it
