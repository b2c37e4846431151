"""`vrs steer`: the robot follows a stream of targets, from a file or from another program."""

from __future__ import annotations

import argparse
import gc
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from math import degrees
from typing import TYPE_CHECKING

from vrs_cli.cli.clocks import add_realtime_option, clock_of, with_rate
from vrs_cli.cli.command_line import STANDARD_STREAM, CommandLineError, Parser, positive
from vrs_cli.cli.outputs import Outputs, add_output_options
from vrs_cli.errors import MotionError, NonexistentFile

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from vrs_cli.engine.engine import Engine
    from vrs_cli.files.target_file import TimedTarget
    from vrs_cli.interfaces.steering import Following, Steering
    from vrs_cli.kinematics.joints import JointKind, Joints
    from vrs_cli.kinematics.model import RobotModel

OK, FAILED = 0, 1
KEPT = 1000  # targets after which what they left is not looked through for garbage any more
MOST_TOLD = 5  # targets out of reach that are named

EPILOG = """\
A line is a time and the joints [s, deg; mm where a joint slides]; or the first line names the columns:
t,jt1,...,jt6 or t,x,y,z,o,a,t_angle [s, mm, deg], as vrs run --csv writes them. Each target is followed from
its time on, within all limits, until the next one; at the end, or after Ctrl-C, the robot stops at the last one.

  vrs steer taught.csv --csv followed.csv
  vrs steer taught.csv --save followed.vrst --json
  robot_logger | vrs steer - --realtime
"""


def main(prog: str, arguments: Sequence[str]) -> int:
    """Follow a stream to its end; returns 1 when some of its targets were out of reach."""
    options = _parser(prog).parse(list(with_rate(arguments)))
    outputs = Outputs.of(options)
    _check_outputs(options, outputs)
    return _Run(prog, options, outputs).run()


def _parser(prog: str) -> Parser:
    from vrs_cli.kinematics.model import PROFILES

    parser = Parser(prog, "Let the virtual robot follow a stream of targets.", EPILOG)
    parser.add_argument("file", metavar="FILE.csv", help="the targets (- is standard input, line by line)")
    parser.add_argument("--robot", metavar="NAME|FILE", default="puma560", help="a robot's name, or its TOML file")
    parser.add_argument("--speed", metavar="PCT", type=_percent, default=100.0, help="at most so much of full speed")
    told = "SCURVE: with limits of jerk; LSPB: without (default: as the robot's file says)"
    parser.add_argument("--profile", type=str.upper, choices=PROFILES, help=told)
    parser.add_argument("--relative", action="store_true", help="times count from the first one (in real time, always)")
    add_realtime_option(parser)
    parser.add_argument("--save", metavar="T.vrst", help="save the trajectory, target by target")
    add_output_options(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    return parser


def _percent(text: str) -> float:
    value = positive(text)
    if value > 100.0:
        raise argparse.ArgumentTypeError(f"{text} % is more than full speed")
    return value


def _check_outputs(options: argparse.Namespace, outputs: Outputs) -> None:
    """Raise before anything moves what would go wrong after it."""
    from vrs_cli.files.atomic import check_writable

    if options.json and outputs.takes_standard_output:
        raise CommandLineError("--json and --csv - both want standard output", "write the table to a file")
    if options.save == STANDARD_STREAM:
        raise CommandLineError("--save - has no file", "name a file: --save T.vrst")
    outputs.check(also=(options.save, None if options.file == STANDARD_STREAM else options.file))
    if options.save is not None:
        check_writable(options.save)


@contextmanager
def _lines(path: str) -> Iterator[Iterable[str]]:
    """The lines of a file, or of standard input as they come. Raises NonexistentFile."""
    if path == STANDARD_STREAM:
        yield sys.stdin
        return
    try:
        stream = open(path, encoding="utf-8-sig", errors="replace")  # noqa: SIM115 (closed below)
    except OSError as error:
        raise NonexistentFile(f"{path} cannot be read: {error.strerror}") from None
    with stream:
        yield stream


def _start(model: RobotModel, first: TimedTarget) -> Joints | None:
    """Where a recording begins, if that is joints at time 0; READY otherwise."""
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


@dataclass(frozen=True, slots=True)
class _Run:
    prog: str
    options: argparse.Namespace
    outputs: Outputs

    @property
    def source(self) -> str:
        """Where the targets come from, for messages."""
        return "standard input" if self.options.file == STANDARD_STREAM else str(self.options.file)

    def run(self) -> int:
        """Follow, and tell how it went; the exit status."""
        from vrs_cli.cli.journal import journal
        from vrs_cli.engine.engine import Engine
        from vrs_cli.files.target_file import read_targets
        from vrs_cli.interfaces.steering import Steering
        from vrs_cli.kinematics.robot_file import load_robot

        options = self.options
        model = load_robot(options.robot)
        with _lines(options.file) as lines:
            relative = options.relative or options.realtime is not None
            targets = read_targets(lines, model.joint_count, self.source, relative=relative, units=model.units)
            first = next(targets, None)
            if first is None:
                raise CommandLineError(f"{self.source} holds no target", "a line is a time and the joints")
            engine = Engine(model, start=_start(model, first), clock=clock_of(options.realtime))
            if options.profile is not None:
                engine.parameters.set_parameter("PROFILE", options.profile)
            steering = Steering(engine, speed=options.speed / 100.0)
            with journal(options.save, engine, durable=options.realtime is not None):
                unreached = self._follow(steering, first, targets)
        self._tell(engine, steering, unreached)
        self.outputs.write(engine.arm, engine.timeline, options.file)
        return FAILED if unreached else OK

    def _follow(self, steering: Steering, first: TimedTarget, others: Iterator[TimedTarget]) -> int:
        """How many targets were out of reach."""
        from itertools import chain

        from vrs_cli.render.progress import RunProgress

        unreached = 0
        with RunProgress(self.options.file) as progress, suppress(KeyboardInterrupt):  # Ctrl-C ends a stream
            for count, it in enumerate(chain((first,), others)):
                if count % KEPT == 0:
                    gc.freeze()  # the timeline only grows: its garbage collection would cost ever longer pauses
                try:
                    steering.to(it.target, it.t)
                except MotionError as error:
                    unreached += 1
                    progress.hide()
                    self._complain(unreached, f"{self.source}:{it.line}: {error}")
                progress(steering.engine.now)
        steering.finish()
        return unreached

    def _complain(self, count: int, what: str) -> None:
        if count <= MOST_TOLD:
            print(f"{self.prog}: {what}", file=sys.stderr)
        elif count == MOST_TOLD + 1:
            print(f"{self.prog}: and others", file=sys.stderr)

    def _tell(self, engine: Engine, steering: Steering, unreached: int) -> None:
        following = steering.following
        errors = _errors(following, engine.model.units.kinds)
        if self.options.json:
            from vrs_cli.cli.recordings import position_object

            told = {
                "targets": following.targets,
                "held": following.held,
                "out_of_reach": unreached,
                "duration_s": round(engine.end, 9),
                **{f"error_{unit}": {"rms": round(rms, 6), "max": round(worst, 6)} for unit, rms, worst in errors},
                "final": position_object(engine.position(engine.end), engine.model.units),
            }
            print(json.dumps(told, indent=2))
            return
        from vrs_cli.render.numbers import count

        said = "; ".join(f"{rms:.2f} {unit} rms, {worst:.2f} at most" for unit, rms, worst in errors)
        print(f"{count(following.targets, 'target')} in {engine.end:.3f} s, followed to {said}")
        if following.held:
            were = "was" if following.held == 1 else "were"
            print(f"{count(following.held, 'target')} {were} beyond the range of a joint, which stopped at its end")
