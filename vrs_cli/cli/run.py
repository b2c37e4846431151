"""`vrs run`: load a program file, execute a program of it, and write what was asked for."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct, structs

from vrs_cli.cli.command_line import (
    CELL,
    DIALECT,
    REALTIME,
    ROBOT,
    STANDARD_STREAM,
    CommandLineError,
    chosen_dialect,
    chosen_robot,
    clock_of,
    command,
    group,
    option,
    positive,
    size,
    whole,
)
from vrs_cli.cli.fence import Alone, Enough, memory, wall
from vrs_cli.cli.main import FAILED, OK
from vrs_cli.cli.outputs import OUTPUT_OPTIONS, Outputs, journal
from vrs_cli.cli.outside import OUTSIDE, PATIENCE, chosen_outside
from vrs_cli.cli.sources import Source, has_errors, is_program, program_files, read_source, robot_of
from vrs_cli.errors import FileError, LimitReached, UndefinedName

if TYPE_CHECKING:
    from vrs_cli.cli.batch import BatchTerminal, Heard, Object
    from vrs_cli.files.bounds import Folder
    from vrs_cli.interfaces.station.station import Station
    from vrs_cli.interfaces.tasks.limits import Limits
    from vrs_cli.render.progress import RunProgress
    from vrs_cli.repl.interrupt import Stoppable
    from vrs_cli.values.diagnostics import Diagnostic
    from vrs_cli.values.results import RunResult, StoppedTask

COUNTED = ("max_time", "max_steps", "max_elements", "max_output", "max_disk")  # options, and fields of Limits
FENCE: Mapping[str, float] = {  # round a program that nobody watches, where the system has such
    "max_wall": 300.0,  # what is counted ends a program first, but on a very slow machine
    "max_memory": 4_000_000_000,  # of address space, of which numpy takes some for each core
}
MOST_TOLD = 20  # diagnostics of a file that is not executed


def run(options: Namespace) -> int:
    """Load, check and execute; returns 1 when the file has errors or the program stopped with one."""
    named = _files(options)
    files = program_files(named)
    options.apart = len(files) > 1 or set(files) != set(named)  # a folder run: each file by itself
    options.common = os.path.commonpath([os.path.dirname(os.path.abspath(path)) for path in files])
    if options.keep is not None and not options.apart:
        raise CommandLineError("--keep is for several files or a folder", "one file has the files beside it")
    if options.sandbox is not None or options.apart:
        _fence_in(options)
    if len(files) > 1:
        from vrs_cli.cli.batch import run_many

        return run_many(options, files, _run)
    return _run(options, files[0])


def _files(options: Namespace) -> list[str]:
    """The files that are named. The last of several words is the name of a program, unless it is a program file, a
    folder or a pattern. Raises CommandLineError.
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


def _run(options: Namespace, path: str, heard: Heard | None = None) -> int:
    """Execute one file."""
    options.file = path
    return _Batch(options, Outputs.of(options), read_source(path), heard).run()


def _cycles(text: str) -> int:
    """Read the number of cycles."""
    from vrs_cli.language.run.runtime import MOST_CYCLES

    value = whole(text)
    if value == 0 or value > MOST_CYCLES:
        raise argparse.ArgumentTypeError(f"{text} cycles (1 to {MOST_CYCLES}, or -1 for ever)")
    return value


LIMITS = group(  # of a run, and the fence of the system round it
    "limits",
    option(
        "--max-time",
        metavar="S",
        type=positive,
        help="seconds of the robot's time (default: a day, 86400; or an hour, 3600)",
    ),
    option(
        "--max-steps",
        metavar="N",
        type=size,
        help="steps of all programs together (default: 100M, in real time any number; or 10M)",
    ),
    option(
        "--max-elements",
        metavar="N",
        type=size,
        help="what arrays and strings hold: elements and characters (default: 10M)",
    ),
    option("--max-output", metavar="BYTES", type=size, help="what is typed (default: 100M; or 1M)"),
    option("--max-disk", metavar="BYTES", type=size, help="what is written to files (default: 1G; or 10M)"),
    option(
        "--max-wall",
        metavar="SECONDS",
        type=positive,
        help="time on the wall; the machine decides where that ends a run (default: any; or 300)",
    ),
    option(
        "--max-memory",
        metavar="BYTES",
        type=size,
        help="memory of the process, where the system has such a limit (default: any; or 4G)",
    ),
    about="Where one is reached the program is stopped with an error. The first default is for one file; the second "
    "is for each file of a folder, a pattern or a list, and with --sandbox. K, M and G are 1000, 1000K and 1000M.",
)


run_parser = command(
    "Load a VAL-II file and execute a program of it on the virtual robot.",
    """\
What a program TYPEs goes to standard output as it happens, errors go to standard error; PROMPT reads
standard input. With --json, or --csv -, the result stands alone on standard output and all else goes to
standard error. Time is the robot's and passes as fast as it computes, unless --realtime is given.

  vrs run pick.v2
  vrs run cell                      all program files in a folder, each within limits, and a summary
  vrs run cell --keep written       the same; what each wrote is in written/NAME
  vrs run cell.v2 load.part --cycles 5 --save cell.vrst
  vrs run cell.v2 --signals cell.csv --max-time 60
  vrs run pick.v2 --csv pick.csv --rate 50 --plot pick.svg
  vrs run pick.v2 --report pick.html
  vrs run pick.v2 --json | jq .duration_s
  vrs run theirs.v2 --sandbox box
  vrs run driver.v2 --allow-net --record-units peers.jsonl
""",
    option(
        "files",
        metavar="FILE.v2",
        nargs="+",
        help="a program file (- is standard input), and the name of its program (default: the first); "
        "or files, folders",
    ),
    option("--cycles", metavar="N", type=_cycles, default=1, help="how often; negative: without end"),
    *ROBOT,
    DIALECT,
    CELL,
    LIMITS,
    option(
        "--sandbox",
        metavar="FOLDER",
        help="for programs of somebody else: their files are here alone (of several files: each in FOLDER/NAME)",
    ),
    option(
        "--keep",
        metavar="FOLDER",
        help="keep what each of several files wrote, in FOLDER/NAME (else it is removed)",
    ),
    option("--signals", metavar="FILE", help="when input signals change: lines of time, signal, state"),
    REALTIME,
    OUTSIDE,
    option("--save", metavar="T.vrst", help="save the trajectory, motion by motion"),
    *OUTPUT_OPTIONS,
    option("--json", action="store_true", help="print one JSON object"),
    option("--quiet", action="store_true", help="print only what the program TYPEs"),
)


def _fence_in(options: Namespace) -> None:
    """The folder, and the fence where none is given. Raises CommandLineError."""
    missing = {
        "max_wall": options.realtime is not None or not hasattr(signal, "setitimer"),
        "max_memory": find_spec("resource") is None,
    }
    for name, most in FENCE.items():
        if getattr(options, name) is None and not missing[name]:
            setattr(options, name, most)
    if options.sandbox is None:
        return
    try:
        os.makedirs(options.sandbox, exist_ok=True)
    except OSError as error:
        raise CommandLineError(f"--sandbox {options.sandbox}: {error.strerror}", "name a folder") from None


class _Batch(Struct, frozen=True):
    """One run: the options, the text to load, and who hears how it goes where there are several."""

    options: Namespace
    outputs: Outputs
    source: Source
    heard: Heard | None = None

    def run(self) -> int:
        """Load and execute; the exit status."""
        from vrs_cli.cli.batch import BatchTerminal, error_object
        from vrs_cli.render.progress import RunProgress
        from vrs_cli.repl.interrupt import Stoppable
        from vrs_cli.repl.piped import piped

        options = self.options
        alone = Alone() if options.sandbox is not None else nullcontext()
        running = RunProgress(self.source.path, options.max_time)
        aside = options.json or self.outputs.takes_standard_output  # where TYPE and PROMPT write
        with memory(options.max_memory) as enough, running as progress, alone, self._folder() as folder:
            lines = piped(sys.stdin) if options.realtime is not None else None
            output = sys.stderr if aside else sys.stdout
            terminal = BatchTerminal(output, progress, lines or iter(sys.stdin.readline, ""), options.quiet)
            station = self._station(terminal, folder)
            if lines is not None:
                lines.robot = station.actor
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
            finally:
                station.close()
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
        with (
            journal(self.options.save, engine, lambda text: progress.say(f"vrs run: {text}"), durable=durable) as sound,
            stop,
        ):
            try:
                with enough():
                    result = station.execute(program, cycles=self.options.cycles, all_tasks=True)
            except LimitReached as error:
                result = station.driver.broken_off(error)
        return result, sound()

    @contextmanager
    def _folder(self) -> Iterator[Folder]:
        """Return the folder of the programs' files: that of the file, the sandbox, or a working folder of this run."""
        from vrs_cli.files.bounds import Folder
        from vrs_cli.files.working_folder import working_folder

        options, given = self.options, self.options.file == STANDARD_STREAM
        beside, box = Path() if given else Path(self.source.path).parent, options.sandbox
        if not options.apart:
            yield Folder(beside) if box is None else Folder(Path(box), closed=True)
            return
        name = Path("standard input") if given else Path(os.path.relpath(self.source.path, options.common))
        source, kept = (beside, options.keep) if box is None else (Path(box), options.keep or box)
        with working_folder(source, None if kept is None else Path(kept, name), below=box is None) as folder:
            yield folder

    def _station(self, terminal: BatchTerminal, folder: Folder) -> Station:
        from vrs_cli.interfaces.station.station import Station

        model = chosen_robot(self.options, robot_of(self.options.prog, self.source))
        outside = chosen_outside(self.options, patience=PATIENCE)
        clock, limits = clock_of(self.options.realtime), self._limits()
        station = Station(terminal, model, clock=clock, limits=limits, folder=folder, outside=outside, advice=_advice)
        station.dialect = chosen_dialect(self.options)
        station.tasks.told = partial(self._tell_beside, terminal)
        if self.options.cell is not None:
            from vrs_cli.files.cell_file import read_cell

            station.driver.surround(read_cell(self.options.cell))
        if self.options.signals is not None:
            from vrs_cli.files.timed_lines import read_signals

            station.driver.inputs = read_signals(self.options.signals)
        return station

    def _limits(self) -> Limits:
        """The limits of the options; the usual ones where none is given."""
        from vrs_cli.interfaces.tasks.limits import ATTENDED, OWN, Limits

        options = self.options
        own = OWN if options.realtime is None else ATTENDED
        usual = Limits() if options.apart or options.sandbox is not None else own
        return structs.replace(
            usual, **{name: most for name in COUNTED if (most := getattr(options, name)) is not None}
        )

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
        from vrs_cli.engine.book import displacement_of
        from vrs_cli.render.control import for_stream
        from vrs_cli.render.displaced import sentences
        from vrs_cli.values.replies import Message

        if self.heard is not None:
            self.heard.ended(result)
        faults = [one.fault for one in result.beside] + ([result.fault] if result.fault else [])
        if self.options.json:
            self._print_json(station, result, [fault_object(fault) for fault in faults])
        if result.fault is None:
            terminal.show(Message(result.outcome.value))
        else:
            print(for_stream(fault_text(self.source.path, result.fault), sys.stderr), file=sys.stderr)
        if not self.options.quiet and (displaced := displacement_of(station.engine.book.records())) is not None:
            for sentence in sentences(displaced):  # which motions begin at other times than the program asked
                print(sentence, file=sys.stderr)
        try:
            self.outputs.write(station.engine.arm, station.engine.timeline, self.source.path)
        except FileError as error:  # the command line was right when the run began: the disk is full
            print(f"vrs run: {error}", file=sys.stderr)
            return FAILED
        return FAILED if faults else OK

    def _tell_beside(self, terminal: BatchTerminal, one: StoppedTask) -> None:
        """Another task has stopped with an error."""
        from vrs_cli.cli.batch import fault_text
        from vrs_cli.render.control import for_stream

        said = f"{fault_text(self.source.path, one.fault)} ({one.where})"
        terminal.alive.say(for_stream(said, sys.stderr))

    def _print_json(self, station: Station, result: RunResult | None, errors: list[Object]) -> None:
        import json

        from vrs_cli.cli.batch import run_object

        found = run_object(station.engine, result, errors)
        if self.heard is None:
            print(json.dumps(found, indent=2))
        else:
            self.heard.printed(found)


def _advice(option: str) -> str:
    """Say what helps where the limit of an option stops a program."""
    if option == "signals":
        return "--signals FILE says when inputs change"
    return f"give it more with --{option.replace('_', '-')}"
