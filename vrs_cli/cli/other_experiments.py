"""Carry out `vrs lab experiment methods`, `twin` and `study`: try viewers and controllers written by users, disturb a
simulated body, and let people drive under delays."""

from __future__ import annotations

import json
import os
import signal
import sys
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from itertools import product
from math import isnan
from pathlib import Path
from subprocess import PIPE, Popen
from time import sleep
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from msgspec import structs

import vrs_cli as vrs
from vrs_cli.bodies.scenario import Disturbance, load_scenario
from vrs_cli.cli import commands, main
from vrs_cli.cli.command_line import CommandLineError, chosen_robot
from vrs_cli.errors import RequestRefused, did_you_mean
from vrs_cli.extras import BUILT_PAGE
from vrs_cli.files.atomic import check_writable, write_atomically
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.lab import bench, methods, twin
from vrs_cli.lab.bench import SCENARIOS, ControllerScore, MethodOutcome, MethodTrial, ViewerScore, method_outcome
from vrs_cli.lab.delays import Trial, mean_score
from vrs_cli.lab.twin import TwinCurves, TwinRow, TwinTrial, twin_outcome, twin_row
from vrs_cli.net.delay_line import Constant, Delays, DelayWays, Gamma, with_loss
from vrs_cli.render.blocks import Block, Column, Grid, line, number_column, number_columns, text_of
from vrs_cli.render.plots import Curves, curves_svg

if TYPE_CHECKING:
    from vrs_cli.lab.study import Condition, Study, StudyResult, StudyTrial


class MethodRows(NamedTuple):
    """The scores for one setting of the delays and one scenario. `delays`: the delays as text. `viewers`,
    `controllers`: the scores by name."""

    delays: str
    scenario: str
    viewers: dict[str, ViewerScore]
    controllers: dict[str, ControllerScore]


def run_methods(options: Namespace) -> int:
    """Try all viewers and controllers, and print tables. Raises MethodError for a user's class that fails, or
    CommandLineError."""
    for name in options.viewer:
        methods.load_method(name, methods.Predictor)
    for name in options.controller:
        methods.load_method(name, methods.RemoteController)
    print_rows(options, list(_rows_methods(options)), _row_object_methods, _report_methods)
    return main.OK


def _rows_methods(options: Namespace) -> Iterator[MethodRows]:
    cases = list(_cases_methods(options))
    found = outcomes(method_outcome, [trial for _, trial in cases], options)
    parts: dict[tuple[str, str], list[tuple[MethodTrial, Sequence[MethodOutcome]]]] = {}
    for (name, trial), some in zip(cases, found, strict=True):
        parts.setdefault((name, trial.scenario), []).append((trial, some))
    for (name, scenario), tried in parts.items():
        viewed = tried[0][1]
        names = (*methods.VIEWERS, *viewed[0].viewers)
        seen = {one: [it.viewers[one] for it in viewed if one in it.viewers] for one in dict.fromkeys(names)}
        scores = {
            trial.controller: [it.controller for it in some if it.controller is not None] for trial, some in tried
        }
        yield MethodRows(
            name,
            scenario,
            {one: mean_score(rows) for one, rows in seen.items() if rows},
            {one: mean_score(rows) for one, rows in scores.items() if rows},
        )


def _cases_methods(options: Namespace) -> Iterator[tuple[str, MethodTrial]]:
    """Yield each case: its delays as text, and its trial for the first seed. Viewers are tried only with the first
    controller."""
    robot = chosen_robot(options)
    for scenario in options.scenario or ():
        if scenario not in SCENARIOS:
            hint = did_you_mean(scenario, SCENARIOS, f"see {options.prog} --help")
            raise CommandLineError(f"--scenario: no scenario is {scenario}", hint)
    viewers = (*methods.VIEWERS, *options.viewer)
    controllers = (*methods.CONTROLLERS, *options.controller)
    for name, forward, backward in lines_of(options):
        ways = DelayWays(forward, backward, options.seed)
        for scenario in options.scenario or SCENARIOS:
            for number, one in enumerate(controllers if scenario in bench.FOLLOWED else controllers[:1]):
                seen = viewers if number == 0 else ()
                yield name, MethodTrial(robot, ways, scenario, one, seen, options.seconds, options.rate)


def _report_methods(options: Namespace, rows: Sequence[MethodRows]) -> Iterator[Block]:
    for delays in dict.fromkeys(row.delays for row in rows):
        some = [row for row in rows if row.delays == delays]
        yield line(f"{delays}; {options.seeds} x {options.seconds:g} s, {options.rate:g} Hz")
        for scenario in (row.scenario for row in some):
            yield line(f"  {scenario:<8}{SCENARIOS[scenario]}")
        yield line()
        yield line("What is seen, beside the robot")
        columns = number_columns("mean deg", "95 % deg", "max deg", "mean mm", "jump deg")
        viewed = (
            (row.scenario, name.rpartition(":")[2], *map(_three, (it.mean, it.p95, it.most, it.mean_mm, it.jump)))
            for row in some
            for name, it in row.viewers.items()
        )
        yield Grid((Column("scenario"), Column("viewer"), *columns), tuple(viewed))
        followed = tuple(
            (row.scenario, name.rpartition(":")[2], *map(_three, (it.rms, it.most, it.lag, it.effort, 100 * it.held)))
            for row in some
            for name, it in row.controllers.items()
        )
        if followed:
            yield line()
            yield line("The robot, beside its goal")
            columns = number_columns("rms deg", "max deg", "lag s", "effort", "held %")
            yield Grid((Column("scenario"), Column("controller"), *columns), followed)
        yield line()


def _three(value: float) -> str:
    return f"{value:.3f}"


def _row_object_methods(row: MethodRows) -> dict[str, object]:
    return {
        "delays": row.delays,
        "scenario": row.scenario,
        "viewers": {name: structs.asdict(it) for name, it in row.viewers.items()},
        "controllers": {name: structs.asdict(it) for name, it in row.controllers.items()},
    }


MAX_PARTICIPANTS = 1000
ENDS_WITH_PARENT = """\
import os, sys, threading

def wait_for_parent():  # the pipe closes however the parent ends
    while os.read(0, 1024):
        pass
    os._exit(0)

threading.Thread(target=wait_for_parent, daemon=True).start()
from vrs_cli.cli.main import run
sys.exit(run(sys.argv[1:]))
"""


def run_study(options: Namespace) -> int:
    """Let one participant do all remaining trials. Raises CommandLineError, FileError, FileDamaged."""
    from vrs_cli.lab.study import DryRun, Results, load_study, pseudonym, study_trials

    if options.file is None:
        raise CommandLineError("which study?", f"{options.prog} study FILE.toml")
    study = load_study(Path(options.file))
    path = Path(options.out or Path(options.file).with_suffix(".dry.csv" if options.dry_run else ".csv"))
    results = Results(path, study)
    total = study.trials * len(study.conditions)
    participant = options.participant or results.next_participant(total)
    if participant > MAX_PARTICIPANTS:
        raise CommandLineError(f"--participant: {participant} is above {MAX_PARTICIPANTS}", "a number from 1 on")
    done = results.finished_trials(participant)
    tell: Callable[[str], None] = (lambda _text: None) if options.json else lambda text: print(text, flush=True)
    left = [trial for trial in study_trials(study, participant) if trial.number not in done]
    tell(f"{pseudonym(participant)}: {len(left)} of {total} trials to do; results: {path}")
    with ExitStack() as stack:
        if left:
            do = DryRun(study, participant).do if options.dry_run else _People(study, total, tell, stack).do
            for trial in left:
                results.add(participant, trial, do(trial))
    _tell_results(path, as_json=options.json)
    return main.OK


def _tell_results(path: Path, *, as_json: bool) -> None:
    """Print a row for each condition, with results over all participants."""
    from vrs_cli.lab.study import results_summary

    rows = list(results_summary(path))
    if as_json:
        names = ("condition", "trials", "reached", "mean_s", "mean_error_mm")
        print(
            json.dumps({"results": str(path), "rows": [dict(zip(names, row, strict=True)) for row in rows]}, indent=2)
        )
        return

    columns = (Column("condition"), *number_columns("trials", "reached %", "time s", "error mm"))
    cells = (
        (name, str(count), f"{100 * reached:.0f}", "-" if time is None else f"{time:.2f}", f"{error:.1f}")
        for name, count, reached, time, error in rows
    )
    print(text_of([Grid(columns, tuple(cells))]), end="")


# --- people ----------------------------------------------------------------------------------------------------------


class _People:
    """Trials in which people drive a served robot at a page or a prompt, with the delays of each condition. The server,
    and the proxy that delays its messages, run until the caller's ExitStack (`stack`) is closed."""

    def __init__(self, study: Study, total: int, tell: Callable[[str], None], stack: ExitStack) -> None:
        self._study, self._total, self._tell = study, total, tell
        pages = ("--pages",) if os.path.exists(BUILT_PAGE) else ()
        server = stack.enter_context(
            _child("serve", "--port", "0", "--realtime", "--robot", f"arm={study.robot}", *pages)
        )
        self._server = _first_line(server).split("ws://")[-1].split(",")[0].split("/")[0].strip()
        self._watched: Any = vrs.connect(f"ws://{self._server}", name="study", units="SI")
        stack.callback(self._watched.leave)
        self._line = stack.enter_context(ExitStack())
        self._at = "0"
        self._condition: Condition | None = None

    def do(self, trial: StudyTrial) -> StudyResult:
        """Let a person do one trial. Raises KeyboardInterrupt for Ctrl-C, and at the end of the input."""
        from vrs_cli.lab.study import Judge

        if trial.condition != self._condition:
            self._connect(trial)
        self._tell(f"\nTrial {trial.number} of {self._total}")
        for number, stage in enumerate(trial.stages, 1):
            location = self._watched.fk(stage.joints)
            x, y, z = (1e3 * location.xyz).tolist()
            o, a, t = (57.29577951308232 * location.oat).tolist()
            hand = f", and {'open' if stage.hand == 'open' else 'close'} the hand there" if stage.hand else ""
            self._tell(f"  {number}. bring the tool to X {x:.1f}, Y {y:.1f}, Z {z:.1f} mm{hand}")
            self._tell(
                f"     (reached with O {o:.0f}, A {a:.0f}, T {t:.0f} deg; within {1e3 * self._study.tolerance:g} mm)"
            )
        try:
            input("Press Enter to begin: ")
        except EOFError:
            raise KeyboardInterrupt from None
        judge = Judge(self._study, trial, self._watched.now)
        while not judge.over:
            here = self._watched.where(self._watched.now)
            x, y, z = here.xyz.tolist()
            judge.take(float(here.t), (x, y, z), float(here.hand))
            sleep(0.05)
        found = judge.result()
        self._tell(f"Reached in {found.time:.1f} s" if found.reached else "Time is over")
        return found

    def _connect(self, trial: StudyTrial) -> None:
        """Start a proxy with the delays of the trial's condition between robot and participant, at the same port as
        before."""
        condition, self._condition = trial.condition, trial.condition
        self._line.close()
        ways = ("--forward", condition.forward, "--backward", condition.backward, "--seed", str(self._study.seed))
        child = self._line.enter_context(
            _child("lab", "delay", self._at, self._server, *ways, "--quiet", end=Popen.kill)
        )
        at = _first_line(child).split()[0]
        if self._at == "0":
            page = f"in a browser, http://{at}/view/arm, or " if os.path.exists(BUILT_PAGE) else ""
            self._tell(f"Drive the robot {page}at a prompt: vrs connect ws://{at}")
            self._at = at
        else:
            self._tell("The next block of trials begins; the page or the prompt connects again by itself")


@contextmanager
def _child(*words: str, end: Callable[[Popen[str]], None] = Popen.terminate) -> Iterator[Popen[str]]:
    """Run vrs as another process; when the block ends, call `end` to stop it."""
    child = Popen([sys.executable, "-c", ENDS_WITH_PARENT, *words], stdin=PIPE, stdout=PIPE, text=True)
    try:
        yield child
    finally:
        end(child)
        child.wait()
        for stream in (child.stdin, child.stdout):
            assert stream is not None  # both are pipes
            stream.close()


def _first_line(child: Popen[str]) -> str:
    """Return the first line that a process prints. Raises RequestRefused if the process has ended; it has then printed
    the reason itself."""
    assert child.stdout is not None
    line = child.stdout.readline()
    if not line:
        raise RequestRefused("the server or the line with delays has not begun", "what it says stands above")
    return line


class TwinRows(NamedTuple):
    """The result of one case. `delays`: its delays as text. `scenario`: the name of its disturbances. `curves`: the
    errors of the first seed over time. `row`: the outcome over all seeds."""

    delays: str
    scenario: str
    trial: TwinTrial
    curves: TwinCurves
    row: TwinRow


def run_twin(options: Namespace) -> int:
    """Try all cases, print tables, and draw curves for --plot. Return 1 if a view shows a wrong position that is not
    flagged as possibly wrong."""
    if options.plot is not None:
        if options.plot == commands.STANDARD_STREAM or Path(options.plot).suffix.lower() != ".svg":
            raise CommandLineError("--plot of twin wants a picture", "--plot OUT.svg")

        check_writable(options.plot)
    cases = list(_cases_twin(options))
    found = outcomes(twin_outcome, [trial for _, _, trial in cases], options)
    rows = [
        TwinRows(delays, scenario, trial, part[0].curves, twin_row(part))
        for (delays, scenario, trial), part in zip(cases, found, strict=True)
    ]
    print_rows(options, rows, _row_object_twin, _report_twin)
    if options.plot is not None:
        panels = [  # the errors of the first eight cases over time, each for its first seed
            Curves(
                "{0}, lead {2} s, {1}: error [deg]".format(*_case_names(it)),
                twin.SEEN,
                [getattr(it.curves, name) for name in twin.SEEN],
                it.curves.times,
            )
            for it in rows[:8]
        ]
        write_atomically(options.plot, curves_svg(panels, "t [s]") + "\n")
    return main.OK if all(it.row.excess == 0.0 for it in rows) else main.FAILED


def _cases_twin(options: Namespace) -> Iterator[tuple[str, str, TwinTrial]]:
    """Yield each case: its delays as text, the name of its scenario, and its trial."""
    robot = chosen_robot(options)
    scenarios = [(name, _scenario(options, robot, name)) for name in options.scenario or twin.SCENARIOS]
    for name, forward, backward in lines_of(options):
        ways = DelayWays(forward, backward, options.seed)
        for (scenario, disturbances), policy, lead in product(scenarios, options.policy, options.lead):
            yield name, scenario, TwinTrial(Trial(robot, ways, lead, policy, options.seconds, twin.RATE), disturbances)


def _scenario(options: Namespace, robot: RobotModel, name: str) -> tuple[Disturbance, ...]:
    """Return the disturbances of a scenario, which is a built-in name or a file. Raises CommandLineError, FileError."""
    if name in twin.SCENARIOS:
        return tuple(structs.replace(one, at=twin.BEGINS * options.seconds) for one in twin.SCENARIOS[name])
    if not name.endswith(".toml"):
        hint = did_you_mean(name, twin.SCENARIOS, f"see {options.prog} --help")
        raise CommandLineError(f"--scenario: no scenario is {name}", hint)
    return load_scenario(Path(name), tuple(link.kind for link in robot.links)).disturbances


def _report_twin(options: Namespace, rows: Sequence[TwinRows]) -> Iterator[Block]:
    columns = (Column("scenario"), Column("policy"), number_column("lead s", 6))
    for delays in dict.fromkeys(it.delays for it in rows):
        some = [it for it in rows if it.delays == delays]
        yield line(f"{delays}; {options.seeds} x {options.seconds:g} s; body: {some[0].row.body}")
        yield line(
            "Mean error [deg] of the farthest joint: what is seen, beside the body; the body, beside its timeline"
        )
        seen = (
            (
                *_case_names(it),
                *(f"{it.row.mean[name]:.3f}" for name in twin.SEEN),
                f"{it.row.excess:g}",
                f"{100 * it.row.flagged:.2f}",
            )
            for it in some
        )
        yield Grid((*columns, *number_columns(*twin.SEEN, "excess", "flagged %")), tuple(seen))
        yield line()
        yield line("What the operator was told")
        rows_of_alarms = (
            (
                *_case_names(it),
                f"{it.row.alarms}/{it.row.trials}",
                "-" if isnan(it.row.alarm) else f"{it.row.alarm:.2f}",
                str(it.row.false_alarms),
                f"{100 * it.row.misled:.2f}",
                it.row.cause or "-",
            )
            for it in some
        )
        yield Grid(
            (*columns, *number_columns("alarms", "after s", "false", "misled %"), Column("cause")),
            tuple(rows_of_alarms),
        )
        yield line()
    worst = max(it.row.excess for it in rows)
    yield line(f"Outside flagged times the error of timeline, minus that of tracking, is at most {worst:g} deg")


def _case_names(it: TwinRows) -> tuple[str, str, str]:
    return Path(it.scenario).name, it.trial.trial.policy, f"{it.trial.trial.lead:g}"


def _row_object_twin(it: TwinRows) -> dict[str, object]:
    row = structs.asdict(it.row)
    alarm = None if isnan(it.row.alarm) else it.row.alarm
    lead = it.trial.trial.lead
    named = {"delays": it.delays, "scenario": it.scenario, "policy": it.trial.trial.policy, "lead_s": lead}
    return {**named, **row, "alarm": alarm}


# --- shared by all experiments ----------------------------------------------------------------------------------------

AnyTrial = TypeVar("AnyTrial", Trial, MethodTrial, TwinTrial)
T = TypeVar("T")
USUAL_DELAY, USUAL_JITTER = 0.2, 0.08  # [s] default mean and standard deviation of the delay in each direction


def lines_of(options: Namespace) -> Iterator[tuple[str, Delays, Delays]]:
    """Yield each setting of the delays: its description, the delays to the robot, and the delays from the robot. Raises
    CommandLineError."""
    lost = f", loss {options.loss:.1%}" if options.loss else ""
    if options.forward or options.backward:
        if options.delay or options.jitter:
            raise CommandLineError("--delay and --jitter are of both ways", "leave out --forward and --backward")
        (there, forward), (back, backward) = (
            way or ("0", Constant(0.0)) for way in (options.forward, options.backward)
        )
        name = f"Forward {there}, backward {back}{lost}"
        yield name, with_loss(forward, options.loss), with_loss(backward, options.loss)
        return
    for mean, deviation in product(options.delay or (USUAL_DELAY,), options.jitter or (USUAL_JITTER,)):
        each = with_loss(Gamma(mean, deviation), options.loss)
        yield f"Gamma {1e3 * mean:g}ms {1e3 * deviation:g}ms each way{lost}", each, each


def outcomes(outcome: Callable[[AnyTrial], T], trials: Sequence[AnyTrial], options: Namespace) -> list[list[T]]:
    """Return the outcomes of each trial, one for each of `--seeds` seeds. They are computed in `--jobs` processes
    (default: one for each core)."""
    seeded = [_with_seed(trial, number) for trial in trials for number in range(options.seeds)]
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    jobs = min(options.jobs or cores, len(seeded))
    if jobs == 1:
        found = list(map(outcome, seeded))
    else:
        with ProcessPoolExecutor(jobs, initializer=_leave_signals) as pool:
            try:
                found = list(pool.map(outcome, seeded))
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
    return [found[first : first + options.seeds] for first in range(0, len(found), options.seeds)]


def _with_seed(it: AnyTrial, number: int) -> AnyTrial:
    """Return the trial with its seed increased by `number`."""
    if isinstance(it, TwinTrial):
        return structs.replace(it, trial=_with_seed(it.trial, number))
    return structs.replace(it, ways=structs.replace(it.ways, seed=it.ways.seed + number))


def print_rows(
    options: Namespace,
    rows: Sequence[T],
    as_object: Callable[[T], dict[str, object]],
    report: Callable[[Namespace, Sequence[T]], Iterable[Block]],
) -> None:
    """Print the results of an experiment as tables, or with `--json` as an object."""
    if options.json:
        tried = {name: getattr(options, name) for name in ("seeds", "seconds", "rate")}
        given = {name: value for name, value in tried.items() if value is not None}  # twin has no --rate
        print(json.dumps({**given, "rows": [*map(as_object, rows)]}, indent=2))
    else:
        print(text_of(report(options, rows)), end="")


def _leave_signals() -> None:
    """Let a worker process ignore Ctrl-C, which the parent process handles, and end at SIGTERM."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
