"""Carry out `vrs convert`: execute a program in virtual time, and write its steps in the language of another robot."""

from __future__ import annotations

from argparse import Namespace
from pathlib import PurePath

from vrs_cli.cli import batch, commands, main, outputs, system_limits
from vrs_cli.cli.command_line import CommandLineError, Parser, errors_of_options, teller
from vrs_cli.cli.sources import sources_of
from vrs_cli.convert import as_written, steps, writers
from vrs_cli.errors import UsageError, did_you_mean
from vrs_cli.files import atomic, opening
from vrs_cli.interfaces.station.station import Station
from vrs_cli.render.progress import RunProgress
from vrs_cli.repl.interrupt import Stoppable
from vrs_cli.values.results import RunResult


class Conversion(batch.Batch, frozen=True):
    """A run whose executed steps are written in the language that `--to` names."""

    @property
    def aside(self) -> bool:
        """Return whether standard output contains only the converted program, so that messages go to standard error."""
        return bool(self.options.output == commands.STANDARD_STREAM)

    def _station(self, terminal: batch.BatchTerminal, folder: opening.Folder) -> Station:
        """Return the station (the robot with its programs and clock). Raises CommandLineError for a robot that the
        target language does not support."""
        station = super()._station(terminal, folder)
        with errors_of_options(UsageError):
            writers.TARGETS[self.options.to].check(station.engine.model)
        return station

    def _execute(
        self, station: Station, progress: RunProgress, stop: Stoppable, guard: system_limits.MemoryGuard
    ) -> tuple[RunResult, bool]:
        self.options.given = station.environment.copy()  # copied before the program changes the variables
        return super()._execute(station, progress, stop, guard)

    def _finish(self, station: Station, terminal: batch.BatchTerminal, result: RunResult) -> int:
        """Report how the run ended, and write the steps that were executed."""
        status, options, engine = super()._finish(station, terminal, result), self.options, station.engine
        run, path = steps.executed_run(engine.arm, engine.timeline), PurePath(self.source.path)
        tell, text = teller(options.prog), ""
        if options.as_written:
            first = station.environment.program(result.program).analysis
            programs = sorted((one.analysis for one in station.programs.values()), key=lambda one: one is not first)
            rapid = as_written.RapidTranslator(station.environment, programs, run, options.given, path.stem)
            translated = rapid.translate()
            for line, what in translated.unsaid:
                tell(f"{path.name}:{line}: no counterpart: {what}")
            text, status = translated.text, main.FAILED if translated.unsaid else status
        else:
            writer = writers.TARGETS[options.to](run, path.stem, path.name)
            written = writer.write("" if result.fault is None else result.fault.message)
            for note in written.notes:
                tell(f"note: {note}")
            text = written.text
        outputs.write_text(options.output, text)
        return status


def convert(options: Namespace) -> int:
    """Execute a program and write it in another language; return 1 if the file has errors or the program stopped with
    one."""
    if options.to not in writers.TARGETS:
        known = f"known: {', '.join(writers.TARGETS)}"
        raise CommandLineError(f"unknown target {options.to}", did_you_mean(options.to, writers.TARGETS, known))
    if options.as_written and options.to != "rapid":
        raise CommandLineError("--as-written is for --to rapid", "leave it out for what was executed")
    if options.output != commands.STANDARD_STREAM:
        outputs.check_distinct((options.file, options.output))
        atomic.check_writable(options.output)
    usual = vars(Parser("run", options.prog).parse([options.file]))  # the default values of the options of vrs run
    usual |= {"program": None, "apart": False, "quiet": True}
    options = Namespace(**usual | vars(options))
    return Conversion(options, outputs.Outputs(None, 0.0, None, None), sources_of((options.file,))).run()
