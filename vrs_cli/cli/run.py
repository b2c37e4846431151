"""`vrs run`: load a program file, execute a program of it, and write what was asked for."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.cli.command_line import (
    CommandLineError,
    Parser,
    add_realtime_option,
    chosen_dialect,
    chosen_robot,
    clock_of,
    positive,
    size,
    whole,
)
from vrs_cli.cli.fence import Alone, Enough, memory, wall
from vrs_cli.cli.main import FAILED, OK
from vrs_cli.cli.outputs import Outputs, add_output_options, journal
from vrs_cli.cli.outside import PATIENCE, add_outside_options, chosen_outside
from vrs_cli.cli.sources import Source, has_errors, is_program, program_files, read_source, robot_of
from vrs_cli.errors import FileError, LimitReached, UndefinedName

if TYPE_CHECKING:
    from vrs_cli.cli.batch import BatchTerminal, Object
    from vrs_cli.cli.run_many import Heard
    from vrs_cli.dialogue.runs import Beside, RunResult
    from vrs_cli.interfaces.station.station import Station
    from vrs_cli.interfaces.tasks.limits import Limits
    from vrs_cli.language.text.diagnostics import Diagnostic
    from vrs_cli.render.progress import RunProgress
    from vrs_cli.repl.interrupt import Stoppable

COUNTED = ("max_time", "max_steps", "max_elements", "max_output", "max_disk")  # options and limits
SANDBOX: Mapping[str, float] = {  # its limits, where no others are given; the last two where the system has such
    "max_steps": 100_000_000,
    "max_output": 10_000_000,
    "max_disk": 100_000_000,
    "max_wall": 60.0,
    "max_memory": 4_000_000_000,  # of address space, of which numpy takes some for each core
}
MOST_TOLD = 20  # diagnostics of a file that is not executed

EPILOG = """\
What a program TYPEs goes to standard output as it happens, errors go to standard error; PROMPT reads
standard input. With --json, or --csv -, the result stands alone on standard output and all else goes to
standard error. Time is the robot's and passes as fast as it computes, unless --realtime is given.

  vrs run pick.v2
  vrs run cell --max-time 60        all program files in a folder, and a summary
  vrs run cell.v2 load.part --cycles 5 --save cell.vrst
  vrs run cell.v2 --signals cell.csv --max-time 60
  vrs run pick.v2 --csv pick.csv --rate 50 --plot pick.svg
  vrs run pick.v2 --report pick.html
  vrs run pick.v2 --json | jq .duration_s
  vrs run theirs.v2 --sandbox box
  vrs run driver.v2 --allow-net --record-units peers.jsonl
"""


def main(prog: str, arguments: Sequence[str]) -> int:
    """Load, check and execute; returns 1 when the file has errors or the program stopped with one."""
    options = parser(prog).parse(arguments)
    files = program_files(_files(options))
    if options.sandbox is not None:
        _fence_in(options)
    if len(files) > 1:
        from vrs_cli.cli.run_many import run_many

        return run_many(prog, options, files, _run)
    return _run(options, files[0])


def _files(options: argparse.Namespace) -> list[str]:
    """What is named beside a program: the last of several words is one, unless it is a program file, a folder or a
    pattern. Raises CommandLineError.
    """
    files: list[str] = options.files[:-1]
    last: str = options.files[-1]
    options.program = None
    if not files or is_program(last) or os.path.isdir(last) or set(last) & set("*?["):
        return [*files, last]
    options.program = last
    if len(files) > 1:
        raise CommandLineError(f"{last} is no program file", "of several files the first program of each is executed")
    return files


def _run(options: argparse.Namespace, path: str, heard: Heard | None = None) -> int:
    """Execute one file."""
    options.file = path
    return _Batch(options, Outputs.of(options), read_source(path), heard).run()


def parser(prog: str) -> Parser:
    parser = Parser(prog, "Load a VAL-II file and execute a program of it on the virtual robot.", EPILOG)
    told = "a program file (- is standard input), and the name of its program (default: the first); or files, folders"
    parser.add_argument("files", metavar="FILE.v2", nargs="+", help=told)
    parser.add_argument("--cycles", metavar="N", type=_cycles, default=1, help="how often; negative: without end")
    parser.add_robot()
    parser.add_dialect()
    parser.add_cell()
    _add_limits(parser)
    parser.add_argument(
        "--sandbox", metavar="FOLDER", help="for a program of somebody else: its files are in this folder alone"
    )
    parser.add_argument("--signals", metavar="FILE", help="when input signals change: lines of time, signal, state")
    add_realtime_option(parser)
    add_outside_options(parser)
    parser.add_argument("--save", metavar="T.vrst", help="save the trajectory, motion by motion")
    add_output_options(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--quiet", action="store_true", help="print only what the program TYPEs")
    return parser


def _add_limits(parser: Parser) -> None:
    """The limits of a run, and the fence of the system round it."""
    group = parser.add_argument_group(
        "limits", "Where one is reached the program is stopped with an error. K, M and G are 1000, 1000K and 1000M."
    )
    group.add_argument(
        "--max-time", metavar="S", type=positive, help="seconds of the robot's time (default: a day, 86400)"
    )
    rows = (
        ("--max-steps", "N", size, "steps of all programs together (default: any number)"),
        ("--max-elements", "N", size, "what arrays and strings hold: elements and characters (default: 10M)"),
        ("--max-output", "BYTES", size, "what is typed (default: 100M)"),
        ("--max-disk", "BYTES", size, "what is written to files (default: 1G)"),
        ("--max-wall", "SECONDS", positive, "time on the wall; where a run ends then depends on the machine"),
        ("--max-memory", "BYTES", size, "memory of the process (systems that have such a limit)"),
    )
    for name, metavar, kind, what in rows:
        group.add_argument(name, metavar=metavar, type=kind, help=what)


def _fence_in(options: argparse.Namespace) -> None:
    """The folder, and the limits that are not given. Raises CommandLineError."""
    missing = {"max_wall": not hasattr(signal, "setitimer"), "max_memory": find_spec("resource") is None}
    for name, most in SANDBOX.items():
        if getattr(options, name) is None and not missing.get(name):
            setattr(options, name, most)
    try:
        os.makedirs(options.sandbox, exist_ok=True)
    except OSError as error:
        raise CommandLineError(f"--sandbox {options.sandbox}: {error.strerror}", "name a folder") from None


def _cycles(text: str) -> int:
    """How often a program is executed."""
    from vrs_cli.language.run.runtime import MOST_CYCLES

    value = whole(text)
    if value == 0 or value > MOST_CYCLES:
        raise argparse.ArgumentTypeError(f"{text} cycles (1 to {MOST_CYCLES}, or -1 for ever)")
    return value


class _Batch(Struct, frozen=True):
    """One run: the options, the text to load, and who hears how it goes where there are several."""

    options: argparse.Namespace
    outputs: Outputs
    source: Source
    heard: Heard | None = None

    def run(self) -> int:
        """Load and execute; the exit status."""
        from vrs_cli.cli.batch import BatchTerminal, error_object
        from vrs_cli.render.progress import RunProgress
        from vrs_cli.repl.interrupt import Stoppable

        options = self.options
        alone = Alone() if options.sandbox is not None else nullcontext()
        running = RunProgress(self.source.path, options.max_time)
        aside = options.json or self.outputs.takes_standard_output  # where TYPE and PROMPT write
        with memory(options.max_memory) as enough, running as progress, alone:
            terminal = BatchTerminal(sys.stderr if aside else sys.stdout, progress, options.quiet)
            station = self._station(terminal)
            try:
                with enough(), wall(options.max_wall, station.driver.end_by):
                    diagnostics = station.load_text(self.source.text)
                    if has_errors(diagnostics):
                        return self._refused(station, diagnostics)
                    print(self.source.shown(diagnostics), end="", file=sys.stderr)
                    stop = Stoppable(station.interrupt)
                    result, sound = self._executed(station, progress, stop, enough)
            except LimitReached as error:  # before the program was executed: there is none to stop
                if options.json:
                    self._print_json(station, None, [error_object(error)])
                raise
        status = max(self._ended(station, terminal, result), OK if sound else FAILED)
        stop.end(signal.SIGINT)
        return status

    def _executed(
        self, station: Station, progress: RunProgress, stop: Stoppable, enough: Enough
    ) -> tuple[RunResult, bool]:
        """Execute a program, and whether all is in the file of --save. A fence that is run against in the middle of a
        step ends it too."""
        program, engine = self._program(station), station.engine
        engine.clock.set(0.0)
        durable = self.options.realtime is not None
        with journal(self.options.save, engine, partial(_say, progress), durable=durable) as sound, stop:
            try:
                with enough():
                    result = station.execute(program, cycles=self.options.cycles)
            except LimitReached as error:
                result = station.driver.broken_off(error)
        return result, sound()

    def _station(self, terminal: BatchTerminal) -> Station:
        from vrs_cli.files.bounds import FREE, Folder
        from vrs_cli.interfaces.station.station import Station

        model = chosen_robot("vrs run", self.options, robot_of("vrs run", self.source))
        outside = chosen_outside(self.options, patience=PATIENCE)
        box, clock = self.options.sandbox, clock_of(self.options.realtime)
        folder = FREE if box is None else Folder(Path(box), closed=True)
        station = Station(terminal, model, clock=clock, limits=self._limits(), folder=folder, outside=outside)
        station.dialect = chosen_dialect(self.options)
        station.tasks.told = partial(self._tell_beside, terminal)
        if self.options.cell is not None:
            from vrs_cli.files.cell_file import read_cell

            station.driver.surround(read_cell(self.options.cell))
        if self.options.signals is not None:
            from vrs_cli.files.signal_file import read_signals

            station.driver.inputs = read_signals(self.options.signals)
        return station

    def _limits(self) -> Limits:
        """Those of the options, and the usual ones of the rest."""
        from vrs_cli.interfaces.tasks.limits import Limits

        given = {name: value for name in COUNTED if (value := getattr(self.options, name)) is not None}
        return Limits(**given, told_by=_help)

    def _program(self, station: Station) -> str:
        """The program asked for, or the first of the file. Raises CommandLineError."""
        environment = station.environment
        if not environment.programs:
            raise CommandLineError(f"{self.source.path} holds no program", "a program begins with .PROGRAM name")
        if self.options.program is None:
            return next(iter(environment.programs.values())).name
        try:
            return environment.program(self.options.program).name
        except UndefinedName as error:
            known = ", ".join(program.name for program in environment.programs.values())
            what = f"{self.source.path} holds no {error.detail}"
            raise CommandLineError(what, error.hint or f"it holds {known}") from None

    # --- what is told -----------------------------------------------------------------------------------

    def _refused(self, station: Station, diagnostics: Sequence[Diagnostic]) -> int:
        """A file with errors is not executed."""
        if self.options.json:
            from vrs_cli.cli.batch import diagnostic_objects

            self._print_json(station, None, diagnostic_objects(diagnostics))
        print(self.source.shown(diagnostics, most=MOST_TOLD), end="", file=sys.stderr)
        return FAILED

    def _ended(self, station: Station, terminal: BatchTerminal, result: RunResult) -> int:
        """Tell how the run ended, and write the files: what there is of the trajectory, also after an error."""
        from vrs_cli.cli.batch import fault_object, fault_text
        from vrs_cli.dialogue.replies import Message
        from vrs_cli.render.control import for_stream

        if self.heard is not None:
            self.heard.ended(result)
        faults = [one.fault for one in result.beside] + ([result.fault] if result.fault else [])
        if self.options.json:
            self._print_json(station, result, [fault_object(fault) for fault in faults])
        if result.fault is None:
            terminal.show(Message(result.outcome.value))
        else:
            print(for_stream(fault_text(self.source.path, result.fault), sys.stderr), file=sys.stderr)
        if not self.options.quiet:
            _tell_displaced(station)
        return max(self._write_files(station), FAILED if faults else OK)

    def _tell_beside(self, terminal: BatchTerminal, one: Beside) -> None:
        """Another task has stopped with an error."""
        from vrs_cli.cli.batch import fault_text
        from vrs_cli.render.control import for_stream

        said = f"{fault_text(self.source.path, one.fault)} ({one.where})"
        terminal.alive.say(for_stream(said, sys.stderr))

    def _write_files(self, station: Station) -> int:
        engine = station.engine
        try:
            self.outputs.write(engine.arm, engine.timeline, self.source.path)
        except FileError as error:  # the command line was right when the run began: the disk is full
            print(f"vrs run: {error}", file=sys.stderr)
            return FAILED
        return OK

    def _print_json(self, station: Station, result: RunResult | None, errors: list[Object]) -> None:
        import json

        from vrs_cli.cli.batch import run_object

        found = run_object(station.engine, result, errors)
        if self.heard is None:
            print(json.dumps(found, indent=2))
        else:
            self.heard.printed(found)


def _say(progress: RunProgress, text: str) -> None:
    """What is wrong with the file of --save."""
    progress.say(f"vrs run: {text}")


def _tell_displaced(station: Station) -> None:
    """Tell which motions begin at other times than the program asked."""
    from vrs_cli.engine.displacement import displacement_of
    from vrs_cli.render.displaced import sentences

    found = displacement_of(station.engine.records())
    for sentence in () if found is None else sentences(found):
        print(sentence, file=sys.stderr)


def _help(option: str) -> str:
    """What helps where the limit of an option stops a program."""
    if option == "signals":
        return "--signals FILE says when inputs change"
    return f"give it more with --{option.replace('_', '-')}"
