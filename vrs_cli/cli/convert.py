"""`vrs convert`: execute a program in virtual time, and write its steps in the language of another robot."""

from __future__ import annotations

from argparse import Namespace
from pathlib import PurePath

from vrs_cli.cli.batch import Batch, BatchTerminal
from vrs_cli.cli.command_line import CommandLineError, Parser, teller
from vrs_cli.cli.commands import STANDARD_STREAM
from vrs_cli.cli.fence import Enough
from vrs_cli.cli.main import FAILED
from vrs_cli.cli.outputs import Outputs, check_distinct
from vrs_cli.cli.sources import sources_of
from vrs_cli.convert.as_written import RapidTranslator
from vrs_cli.convert.steps import executed_run
from vrs_cli.convert.writers import TARGETS
from vrs_cli.errors import UsageError, did_you_mean
from vrs_cli.files.atomic import check_writable, write_atomically
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.station.station import Station
from vrs_cli.render.progress import RunProgress
from vrs_cli.repl.interrupt import Stoppable
from vrs_cli.values.results import RunResult


class Conversion(Batch, frozen=True):
    """A run whose steps are written in the language of `--to`."""

    @property
    def aside(self) -> bool:
        """Whether standard output has only the converted program, so that messages go to standard error."""
        return bool(self.options.output == STANDARD_STREAM)

    def _station(self, terminal: BatchTerminal, folder: Folder) -> Station:
        """Return the station. Raises CommandLineError for a robot that the target cannot have."""
        station = super()._station(terminal, folder)
        try:
            TARGETS[self.options.to].check(station.engine.model)
        except UsageError as error:
            raise CommandLineError(error.detail, error.hint) from None
        return station

    def _execute(
        self, station: Station, progress: RunProgress, stop: Stoppable, enough: Enough
    ) -> tuple[RunResult, bool]:
        self.options.given = station.environment.copy()  # before the program changes it
        return super()._execute(station, progress, stop, enough)

    def _finish(self, station: Station, terminal: BatchTerminal, result: RunResult) -> int:
        """Report how the run ended, and write its steps until then."""
        status, options, engine = super()._finish(station, terminal, result), self.options, station.engine
        run, path = executed_run(engine.arm, engine.timeline), PurePath(self.source.path)
        tell, text = teller(options.prog), ""
        if options.as_written:
            first = station.environment.program(result.program).analysis
            programs = sorted((one.analysis for one in station.programs.values()), key=lambda one: one is not first)
            translated = RapidTranslator(station.environment, programs, run, options.given, path.stem).translate()
            for line, what in translated.unsaid:
                tell(f"{path.name}:{line}: no counterpart: {what}")
            text, status = translated.text, FAILED if translated.unsaid else status
        else:
            writer = TARGETS[options.to](run, path.stem, path.name)
            written = writer.write("" if result.fault is None else result.fault.message)
            for note in written.notes:
                tell(f"note: {note}")
            text = written.text
        if options.output == STANDARD_STREAM:
            print(text, end="")
        else:
            write_atomically(options.output, text)
        return status


def convert(options: Namespace) -> int:
    """Execute and write; return 1 if the file has errors or the program stopped with one."""
    if options.to not in TARGETS:
        known = f"known: {', '.join(TARGETS)}"
        raise CommandLineError(f"unknown target {options.to}", did_you_mean(options.to, TARGETS, known))
    if options.as_written and options.to != "rapid":
        raise CommandLineError("--as-written is for --to rapid", "leave it out for what was executed")
    if options.output != STANDARD_STREAM:
        check_distinct((options.file, options.output))
        check_writable(options.output)
    usual = vars(Parser("run", options.prog).parse([options.file]))  # the default values of the options of vrs run
    usual |= {"program": None, "apart": False, "quiet": True}
    sources = sources_of((options.file,))
    return Conversion(Namespace(**usual | vars(options)), Outputs(None, 0.0, None, None), sources).run()
