"""`vrs lab experiment study`: participants drive a robot under several delays; times and errors go to a CSV file."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from subprocess import PIPE, Popen
from typing import TYPE_CHECKING, Any

from vrs_cli.cli.command_line import CommandLineError
from vrs_cli.cli.main import OK
from vrs_cli.errors import RequestRefused
from vrs_cli.extras import BUILT_PAGE

if TYPE_CHECKING:
    from vrs_cli.lab.study import Condition, Study, StudyResult, StudyTrial
    from vrs_cli.render.blocks import Block

LOOK = 0.05  # [s] between two looks at the robot
MAX_PARTICIPANTS = 1000
ENDS_WITH_PARENT = """\
import os, sys, threading

def wait_for_parent():  # its end of the pipe closes, however it ends
    while os.read(0, 1024):
        pass
    os._exit(0)

threading.Thread(target=wait_for_parent, daemon=True).start()
from vrs_cli.cli.main import run
sys.exit(run(sys.argv[1:]))
"""


def run(options: Namespace) -> int:
    """Let one participant do all trials that are not done. Raises CommandLineError, FileError, FileDamaged."""
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
    done = results.done(participant)
    tell: Callable[[str], None] = (lambda _text: None) if options.json else lambda text: print(text, flush=True)
    left = [trial for trial in study_trials(study, participant) if trial.number not in done]
    tell(f"{pseudonym(participant)}: {len(left)} of {total} trials to do; results: {path}")
    with ExitStack() as stack:
        if left:
            do = DryRun(study, participant).do if options.dry_run else stack.enter_context(_live(study, total, tell))
            for trial in left:
                results.add(participant, trial, do(trial))
    _tell_results(path, as_json=options.json)
    return OK


def _tell_results(path: Path, *, as_json: bool) -> None:
    """Print a row for each condition, of all participants."""
    from vrs_cli.lab.study import results_summary

    rows = list(results_summary(path))
    if as_json:
        names = ("condition", "trials", "reached", "mean_s", "mean_error_mm")
        print(
            json.dumps({"results": str(path), "rows": [dict(zip(names, row, strict=True)) for row in rows]}, indent=2)
        )
        return
    from vrs_cli.render.blocks import Column, Grid, number_columns, text_of

    def grid() -> Iterator[Block]:
        columns = (Column("condition"), *number_columns("trials", "reached %", "time s", "error mm"))
        cells = (
            (name, str(count), f"{100 * reached:.0f}", "-" if time is None else f"{time:.2f}", f"{error:.1f}")
            for name, count, reached, time, error in rows
        )
        yield Grid(columns, tuple(cells))

    print(text_of(grid()), end="")


# --- people ----------------------------------------------------------------------------------------------------------


@contextmanager
def _live(study: Study, total: int, tell: Callable[[str], None]) -> Iterator[Callable[[StudyTrial], StudyResult]]:
    """Serve the robot, and yield a function that does one trial with a person. Both sides of the line end with it."""
    import vrs_cli as vrs

    with ExitStack() as stack:
        pages = ("--pages",) if BUILT_PAGE.exists() else ()
        server = stack.enter_context(
            _child("serve", "--port", "0", "--realtime", "--robot", f"arm={study.robot}", *pages)
        )
        address = _first_line(server).split("ws://")[-1].split(",")[0].split("/")[0].strip()
        watched = vrs.connect(f"ws://{address}", name="study", units="SI")
        stack.callback(watched.leave)
        yield _People(study, total, tell, address, watched, stack).do


class _People:
    """Persons who drive at a page or a prompt, one trial after the other, behind the delays of each condition."""

    def __init__(
        self, study: Study, total: int, tell: Callable[[str], None], server: str, watched: object, stack: ExitStack
    ) -> None:
        self._study, self._total, self._tell, self._server = study, total, tell, server
        self._watched: Any = watched
        self._line = stack.enter_context(ExitStack())
        self._at = "0"
        self._condition: Condition | None = None

    def do(self, trial: StudyTrial) -> StudyResult:
        """Do one trial. Raises KeyboardInterrupt, also at the end of the input."""
        from time import sleep

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
            sleep(LOOK)
        found = judge.result()
        self._tell(f"Reached in {found.time:.1f} s" if found.reached else "Time is over")
        return found

    def _connect(self, trial: StudyTrial) -> None:
        """Put the delays of the trial's condition between the robot and the participant, at the same port as before."""
        condition, self._condition = trial.condition, trial.condition
        self._line.close()
        ways = ("--forward", condition.forward, "--backward", condition.backward, "--seed", str(self._study.seed))
        child = self._line.enter_context(
            _child("lab", "delay", self._at, self._server, *ways, "--quiet", end=Popen.kill)
        )
        at = _first_line(child).split()[0]
        if self._at == "0":
            page = f"in a browser, http://{at}/view/arm, or " if BUILT_PAGE.exists() else ""
            self._tell(f"Drive the robot {page}at a prompt: vrs connect ws://{at}")
            self._at = at
        else:
            self._tell("The next block of trials begins; the page or the prompt connects again by itself")


@contextmanager
def _child(*words: str, end: Callable[[Popen[str]], None] = Popen.terminate) -> Iterator[Popen[str]]:
    """Run vrs as another process until the block ends, and then `end` it."""
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
    """Return the first line that a process prints. Raises RequestRefused where it has ended; it has said why."""
    assert child.stdout is not None
    line = child.stdout.readline()
    if not line:
        raise RequestRefused("the server or the line with delays has not begun", "what it says stands above")
    return line
