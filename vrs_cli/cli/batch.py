"""Carry out batch runs (`vrs run`): the terminal of a run, the run, its reports (a JSON object, or a program's error
as text), and the runs of several files."""

from __future__ import annotations

import os
import signal
import sys
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from math import inf
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TextIO

from msgspec import Struct, field, structs

from vrs_cli.cli import commands, system_limits
from vrs_cli.cli.command_line import CommandLineError, chosen_dialect, chosen_outside, chosen_robot, clock_of, teller
from vrs_cli.cli.main import FAILED, OK, status_of
from vrs_cli.cli.outputs import Outputs, journal
from vrs_cli.cli.sources import Source, cell_file, has_errors, pose_object, position_object, robot_of, sources_of, tidy
from vrs_cli.engine.book import displacement_of
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import EndOfInput, FileError, IllegalSignal, LimitReached, UndefinedName, VrsError, did_you_mean
from vrs_cli.files import opening, program_file
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.tasks.limits import ATTENDED, OWN, Isolation, Limits
from vrs_cli.interfaces.tasks.observations import untrue
from vrs_cli.language.words.values import key_of
from vrs_cli.render.plain import for_stream, sentences, untrue_sentence
from vrs_cli.render.progress import RunProgress
from vrs_cli.repl import interrupt
from vrs_cli.trajectory.instant import round_to_ns
from vrs_cli.values import questions, results
from vrs_cli.values.diagnostics import Diagnostic, Severity
from vrs_cli.values.numbers import count

if TYPE_CHECKING:
    from vrs_cli.repl.piped import PipedLines
    from vrs_cli.values.replies import Reply
    from vrs_cli.world.course import WorldCourse


COUNTED = ("max_time", "max_steps", "max_elements", "max_output", "max_disk")  # options that are also fields of Limits
MAX_DIAGNOSTICS = 20  # maximum number of diagnostics that are printed for a file
Object = dict[str, Any]
ALONE = ("save", "csv", "plot", "report", "record_units")  # options that name one output file: allowed only for one run
MAIN = "main"  # name of the program that is executed in a project
BROKEN = "not executed"


class BatchTerminal(Struct, frozen=True):
    """The terminal of a run without a user. It writes to `output`; with `quiet` it writes only the output of programs.
    `alive`: shows the progress on standard error. `lines`: the answers to PROMPT. Other questions get no answer."""

    output: TextIO
    alive: RunProgress
    lines: Iterator[str]
    quiet: bool = False
    attended: bool = False

    def progress(self, doing: Running | Reading) -> None:
        """Show the time of the run on standard error."""
        if isinstance(doing, Running):
            self.alive(doing.clock)

    def type(self, text: str, newline: bool) -> None:
        """Write the output of TYPE at once."""
        self._write(f"{text}\n" if newline else text)

    def show(self, reply: Reply) -> None:
        """Write a reply of the session."""
        from vrs_cli.render.text import plain_text

        if not self.quiet:
            self._write(plain_text(reply))

    def ask(self, question: questions.Question) -> questions.Answer:
        """Return one line of standard input as the answer to PROMPT; leave other questions without an answer. Raises
        EndOfInput if there is no further line."""
        if not isinstance(question, questions.LineWanted) or (question.wrong and not sys.stdin.isatty()):
            return None
        self._write(f"{question.wrong}\n{question.text}" if question.wrong else question.text)
        line = next(self.lines, "")
        if not sys.stdin.isatty():
            self._write("\n")  # end the line: no terminal has echoed the Enter key
        if not line:
            raise EndOfInput(f"PROMPT {question.text!r} has nothing more to read", "give its answers on standard input")
        return line.rstrip("\r\n")

    def _write(self, text: str) -> None:
        self.alive.hide()
        self.output.write(for_stream(text, self.output))
        self.output.flush()


# --- one run ---


class Batch(Struct, frozen=True):
    """One batch run of a program.

    `options`: the command line's options. `outputs`: the files to write. `sources`: the files to load, which share one
    name space. `ended`, `printed`: called with the result and with the object of --json, if the run is one of several.
    `owners`: the file that contains each program, by the program's key.
    """

    options: Namespace
    outputs: Outputs
    sources: tuple[Source, ...]
    ended: Callable[[results.RunResult], None] | None = None
    printed: Callable[[Object], None] | None = None
    owners: dict[str, Source] = field(default_factory=dict)

    @property
    def source(self) -> Source:
        """Return the first file."""
        return self.sources[0]

    @property
    def aside(self) -> bool:
        """Return whether standard output contains only the run's JSON object or CSV table, so that messages go to
        standard error."""
        return self.options.json or self.outputs.takes_standard_output

    def run(self) -> int:
        """Load the files and execute; return the exit status."""
        options = self.options
        running = RunProgress(self.source.path, options.max_time)
        # whether the clock runs in real time
        live = options.realtime is not None or options.allow_net or options.serial
        with system_limits.limited_memory(options.max_memory) as guard, running as progress, self._folder() as folder:
            lines = _lines_of_pipe() if live else None
            output = sys.stderr if self.aside else sys.stdout  # the stream for the output of TYPE and PROMPT
            terminal = BatchTerminal(output, progress, lines or iter(sys.stdin.readline, ""), options.quiet)
            station = self._station(terminal, folder)
            end_by = station.driver.end_by
            if lines is not None:
                lines.robot = station.actor
            try:
                with self._isolation(station), guard(end_by), system_limits.limited_time(options.max_wall, end_by):
                    found = self._load(station)
                    if any(map(has_errors, found.values())):
                        return self._refuse(station, found)
                    for source, diagnostics in () if options.quiet else found.items():
                        print(source.diagnostics_text(diagnostics, most=MAX_DIAGNOSTICS), end="", file=sys.stderr)
                    stop = interrupt.Stoppable(station.interrupt)
                    result, sound = self._execute(station, progress, stop, guard)
            except LimitReached as error:  # raised before the program started
                if options.json:
                    self._print_json(
                        station, None, [_object(Severity.ERROR, error.code, str(error), numbers=error.numbers)]
                    )
                raise
            finally:
                station.close()
        status = max(self._finish(station, terminal, result), OK if sound else FAILED)
        stop.end(signal.SIGINT)
        return status

    def _load(self, station: Station) -> dict[Source, tuple[Diagnostic, ...]]:
        """Load the files and return the diagnostics of each. If no file has an error, add warnings about steps that
        the run itself will not report."""
        found: dict[Source, tuple[Diagnostic, ...]] = {}
        loaded = station.load_texts([(source.text, source.name) for source in self.sources])
        for source, one in zip(self.sources, loaded, strict=True):
            found[source] = tuple(_with_files_beside(source, one.diagnostics))
            self.owners.update(dict.fromkeys((stored.program.key for stored in one.programs), source))
        if not (self.options.quiet or any(map(has_errors, found.values()))):
            from vrs_cli.interfaces.inspection import warnings_before_run

            for source, one in zip(self.sources, loaded, strict=True):
                found[source] += warnings_before_run(one.programs, station.engine.model)
        return found

    def _isolation(self, station: Station) -> AbstractContextManager[object]:
        """Return a context in which programs cannot reach a network or start a process, if --sandbox is given."""
        if self.options.sandbox is None:
            return nullcontext()
        station.contacts.prepare()
        return Isolation()

    def _execute(
        self, station: Station, progress: RunProgress, stop: interrupt.Stoppable, guard: system_limits.MemoryGuard
    ) -> tuple[results.RunResult, bool]:
        """Execute a program. Return its result, and whether the file written by `--save` is complete. The program also
        ends if a single step exceeds a limit, such as memory."""
        program, engine = self._program(station), station.engine
        engine.clock.set(0.0)
        durable = self.options.realtime is not None
        with (
            journal(self.options.save, engine, lambda text: progress.say(f"vrs run: {text}"), durable=durable) as sound,
            stop,
        ):
            try:
                with guard(station.driver.end_by):
                    result = station.execute(program, cycles=self.options.cycles, all_tasks=True)
            except LimitReached as error:
                result = station.driver.broken_off(error)
        return result, sound()

    @contextmanager
    def _folder(self) -> Iterator[opening.Folder]:
        """Yield the folder in which programs read and write files: the folder of the program file, the sandbox, or a
        working folder of this run."""
        options, given = self.options, self.options.file == commands.STANDARD_STREAM
        # the current folder for a sample program, whose name has no folder
        beside, box = opening.parent_of(options.file), options.sandbox
        if not options.apart:
            yield opening.Folder(beside) if box is None else opening.Folder(box, closed=True)
            return
        from vrs_cli.files.disk import working_folder

        own = os.path.join(beside, os.path.basename(self.source.path))
        name = "standard input" if given else os.path.relpath(own, options.common)
        source, kept = (beside, options.keep) if box is None else (box, options.keep or box)
        with working_folder(source, None if kept is None else os.path.join(kept, name), below=box is None) as folder:
            yield folder

    def _station(self, terminal: BatchTerminal, folder: opening.Folder) -> Station:
        options = self.options
        model = chosen_robot(options, robot_of(options.prog, self.source))
        outside = chosen_outside(options)  # must come first: it may set options.realtime
        clock = clock_of(options.realtime)
        own = OWN if clock is None else ATTENDED
        if options.allow_net or options.serial:
            own = structs.replace(own, max_time=None)  # a program with devices runs until it is stopped
        usual = Limits() if options.apart or options.sandbox is not None else own
        given = {name: most for name in COUNTED if (most := getattr(options, name)) is not None}
        station = Station(
            terminal,
            model,
            clock=clock,
            limits=structs.replace(usual, **given),
            folder=folder,
            outside=outside,
            advice=_advice,
        )
        station.dialect = chosen_dialect(options)
        station.tasks.notify = partial(self._tell_beside, terminal)
        if (cell := cell_file(options, self.source)) is not None:
            from vrs_cli.files.cell_file import read_cell

            station.driver.surround(read_cell(cell[0]))
            if not options.quiet:
                teller(options.prog)("the cell is {} ({})".format(*cell))
        if options.signals is not None:
            from vrs_cli.files.timed_lines import read_signals

            try:
                station.driver.add_inputs(read_signals(options.signals))
            except IllegalSignal as error:
                raise IllegalSignal(f"{error.detail} of {options.signals}", error.hint) from None
        return station

    def _program(self, station: Station) -> str:
        """Return the program that the options name, or the first program of the file. For a project return `main`, or
        else the only program that no other program calls. Raises CommandLineError."""
        environment = station.environment
        if not environment.programs:
            raise CommandLineError(f"{self.source.path} holds no program", "a program begins with .PROGRAM name")
        programs = environment.programs
        if self.options.program is None and self.options.project:
            called = frozenset[str]().union(*(one.analysis.calls - {key} for key, one in programs.items()))
            # the programs that no other program calls
            free = [one.name for key, one in programs.items() if key not in called]
            if MAIN in programs or len(free) == 1:
                return programs[MAIN].name if MAIN in programs else free[0]
            listed = ", ".join(free[:MAX_DIAGNOSTICS])
            raise CommandLineError("which program of the project?", f"name one behind the folder: {listed}")
        if self.options.program is None:
            return next(iter(programs.values())).name
        try:
            return environment.program(self.options.program).name
        except UndefinedName as error:
            known = [program.name for program in programs.values()]
            what = f"{self.source.path} holds no {error.detail}"
            hint = did_you_mean(self.options.program, known) or f"it holds {', '.join(known)}"
            raise CommandLineError(what, hint) from None

    # --- messages ---------------------------------------------------------------------------------------

    def _refuse(self, station: Station, found: Mapping[Source, Sequence[Diagnostic]]) -> int:
        """Report the errors of files that cannot be executed; return the exit status."""
        if self.options.json:
            objects = [
                _object(one.severity, one.code, one.message, line=one.span.line) | self._file(source)
                for source, diagnostics in found.items()
                for one in diagnostics
            ]
            self._print_json(station, None, objects)
        for source, diagnostics in found.items():
            print(source.diagnostics_text(diagnostics, most=MAX_DIAGNOSTICS), end="", file=sys.stderr)
        return FAILED

    def _file(self, source: Source) -> Object:
        """Return an object for `--json` that names the file of an error; return an empty object if the run loads only
        one file."""
        return {"file": source.path} if len(self.sources) > 1 else {}

    def _owner(self, program: str) -> Source:
        return self.owners.get(key_of(program), self.source)

    def _finish(self, station: Station, terminal: BatchTerminal, result: results.RunResult) -> int:
        """Report how the run ended, and write the files. After an error the files contain the trajectory up to the
        error."""
        if self.ended is not None:
            self.ended(result)
        faults = [one.fault for one in result.beside] + ([result.fault] if result.fault else [])
        wrong = tuple(untrue(station.engine.book, station.environment.signals))
        if self.options.json:
            objects = [
                _object(Severity.ERROR, it.code, it.message, it.program, it.step, it.line, it.numbers)
                | self._file(self._owner(it.program))
                for it in faults
            ]
            self._print_json(station, result, objects, wrong)
        if result.fault is None:
            terminal.show(results.Message(result.outcome.value))
        else:
            print(for_stream(self._fault_text(result.fault), sys.stderr), file=sys.stderr)
        if not self.options.quiet:
            if (displaced := displacement_of(station.engine.book.records())) is not None:
                for sentence in sentences(displaced):  # name the motions that begin at other times than requested
                    print(sentence, file=sys.stderr)
            events = () if station.driver.course is None else station.driver.course.notes
            around = (f"at {t:.3f} s {text}" for t, _, text in events)
            # also name signals that a program has read and that later edits have changed
            for text in (*around, *map(untrue_sentence, wrong)):
                print(for_stream(text, sys.stderr), file=sys.stderr)
        try:
            self.outputs.write(station.engine.arm, station.engine.timeline, self.source.path, station.driver.world)
        except FileError as error:  # probably the disk is full: the path was checked at the start
            print(f"vrs run: {error}", file=sys.stderr)
            return FAILED
        return FAILED if faults else OK

    def _fault_text(self, fault: results.ProgramFault) -> str:
        """Describe where and why a program stopped, with the line and a caret that marks the step."""
        place = f"{self._owner(fault.program).path}:{fault.line}: " if fault.line else ""
        source = fault.source.strip()
        lines = [f"{place}{fault.message}"]
        if source:
            lines += [f"    {source}", f"    {'^' * len(source)}"]
        return "\n".join([*lines, f"Program {fault.program} stopped at step {fault.step}"])

    def _tell_beside(self, terminal: BatchTerminal, one: results.StoppedTask) -> None:
        """Report that a task other than the main program stopped with an error."""
        said = f"{self._fault_text(one.fault)} ({one.where})"
        terminal.alive.say(for_stream(said, sys.stderr))

    def _print_json(
        self,
        station: Station,
        result: results.RunResult | None,
        errors: list[Object],
        wrong: Sequence[results.Untrue] = (),
    ) -> None:
        import json

        found = run_object(station.engine, result, errors) | world_object(station, wrong)
        if self.printed is None:
            print(json.dumps(found, indent=2))
        else:
            self.printed(found)


def _lines_of_pipe() -> PipedLines | None:
    from vrs_cli.repl.piped import lines_of_pipe

    return lines_of_pipe(sys.stdin)


def _with_files_beside(source: Source, found: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """Yield the diagnostics. If a missing program is found in another file of the same folder, the hint names that
    file."""
    beside: Mapping[str, str] | None = None
    for one in found:
        if source.is_file and one.code == UndefinedName.code:
            beside = program_file.programs_beside(source.path) if beside is None else beside
            key = key_of(one.detail.split(" ")[0])
            if key in beside:
                file = beside[key]
                yield structs.replace(one, hint=f"{file} has it: `; with: {file}` above the first program loads it")
                continue
        yield one


def _advice(option: str) -> str:
    """Return the hint for a program that reached the limit of an option."""
    given = f"give it more with --{option.replace('_', '-')}"
    return "--signals FILE says when inputs change" if option == "signals" else given


# --- reports ------------------------------------------------------------------------------------------------------


def run_object(engine: Engine, result: results.RunResult | None, errors: list[Object]) -> Object:
    """Return the JSON object that `--json` prints. `result`: None if nothing could be executed. In the object,
    `segments` is the number of segments (pieces of the path) of all motions, without the initial pose."""
    return {
        "program": result.program if result else None,
        "cycles": result.cycles if result else 0,
        "duration_s": round_to_ns(result.ended - result.started) if result else 0.0,
        "segments": len(engine.timeline) - len(engine.book.initial),
        "commands": [
            {
                "text": record.text,
                "t_iss": record.issued,
                "t_asked": record.asked,  # None for a motion that begins when the previous one ends
                "t_exec": record.executed,
                "t_end": record.end,
            }
            for record in engine.book.records()
        ],
        "final": position_object(engine.position(engine.end), engine.model.units),
        "typed": list(result.typed) if result else [],
        "errors": errors,
    }


def world_object(station: Station, wrong: Sequence[results.Untrue]) -> Object:
    """Return the facts about the cell for `--json`.

    The entries `parts` (the workpieces, at the end) and `notes` (events such as a fall) exist for a cell with parts.
    `no_longer_true` lists the signals that programs have read and that later edits have changed (`wrong`), if there are
    any.
    """
    found, course, engine = Object(), station.driver.course, station.engine
    if course is not None and course.parts():
        end = max(engine.now, engine.end)
        found["parts"] = {name: _part_object(course, name, end) for name in course.parts()}
        found["notes"] = [{"t": round_to_ns(t), "kind": kind, "text": text} for t, kind, text in course.notes]
    if "parts" in found or station.contacts.contacts:
        found["contacts"] = [
            {
                "motion": motion,
                "t": round_to_ns(contact.t),
                "between": [contact.first, contact.second],
                "xyz_mm": [tidy(1000.0 * x) for x in contact.place],
                "depth_mm": tidy(1000.0 * contact.depth),
                "needed_mm": tidy(1000.0 * contact.needed),
            }
            for motion, contact in station.contacts.contacts
        ]
    if wrong:
        found["no_longer_true"] = [
            {
                "signal": one.signal,
                "on": one.on,
                "t": round_to_ns(one.time),
                "place": one.place,
                "command": one.command or None,
                "text": untrue_sentence(one),
            }
            for one in wrong
        ]
    return found


def _part_object(course: WorldCourse, name: str, t: float) -> Object:
    """Return the state of a part (a workpiece) at a time [s] for `--json`. For a falling part, return the place where
    it lands."""
    last = course.spans(name, t)[-1]
    state = course.state(name, max(t, last.end) if last.end < inf else t)
    place = pose_object(state.pose) if state.exists else {"xyz_mm": None, "oat_deg": None}
    return {**place, "held": state.held, "on": state.on or None}


def _object(
    severity: Severity,
    code: int,
    message: str,
    program: str | None = None,
    step: int | None = None,
    line: int | None = None,
    numbers: Mapping[str, object] = MappingProxyType({}),
) -> Object:
    """Return an error or a warning for `--json`, with its numbers [m, rad] if it has any."""
    place = {"program": program, "step": step, "line": line}
    return {"severity": severity.value, "code": code, "message": message, **place, **numbers}


# --- several files: a separate run of each, one after another, and one summary -------------------------------------


class FileSummary(Struct, frozen=True):
    """A row of the summary of several files. `status`: the exit status of the file's run. `said`: the outcome as text.
    `seconds`: the duration on the robot's clock."""

    path: str
    status: int
    said: str
    seconds: float | None = None


def run_many(options: Namespace, files: Sequence[str]) -> int:
    """Execute the first program of each file; return the highest exit status. Raises CommandLineError."""
    for name in ALONE:
        if getattr(options, name) is not None:
            raise CommandLineError(f"--{name.replace('_', '-')} is for one file", "run the files one by one for it")
    rows, objects = list[FileSummary](), list[Object]()
    for path in files:
        if not (options.json or options.quiet):
            print(f"==> {path} <==")
        rows.append(_row(options, path, objects))
        sys.stdout.flush()
    if options.json:
        import json

        print(json.dumps({"files": objects}, indent=2))
    elif not options.quiet:  # print the summary on standard error, separate from the output of programs
        width = max(len(row.path) for row in rows)
        for row in rows:
            seconds = "" if row.seconds is None else f"{row.seconds:.3f} s"
            print(f"{row.path:{width}}  {seconds:>12}  {row.said}", file=sys.stderr)
        wrong = sum(row.status != OK for row in rows)
        print(f"{count(len(rows), 'file')}, {count(wrong, 'failure')}", file=sys.stderr)
    return max(row.status for row in rows)


def _row(options: Namespace, path: str, objects: list[Object]) -> FileSummary:
    ended = list[results.RunResult]()
    try:
        options.file = path
        sources = sources_of((path,), closed=options.sandbox is not None)
        run = Batch(
            options,
            Outputs.of(options),
            sources,
            ended.append,
            lambda found: objects.append({"file": path, **found}),
        )
        status = run.run()
    except VrsError as error:  # the other files are still executed
        print(f"{options.prog}: {error}", file=sys.stderr)
        return FileSummary(path, status_of(error), BROKEN)
    if not ended:
        return FileSummary(path, status, BROKEN)
    result = ended[0]
    fault, where = result.fault, ""
    if fault is None and result.beside:
        fault, where = result.beside[0].fault, f" of task {result.beside[0].number}"
    said = result.outcome.value if fault is None else f"{fault.message} at step {fault.step}{where}"
    return FileSummary(path, status, said, result.ended - result.started)
