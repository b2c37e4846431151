"""A batch run whose steps are written in the language of another robot (`vrs convert`)."""

from __future__ import annotations

from pathlib import PurePath

from vrs_cli.cli.batch import Batch, BatchTerminal
from vrs_cli.cli.command_line import STANDARD_STREAM, CommandLineError, teller
from vrs_cli.convert.steps import executed_run
from vrs_cli.convert.writers import TARGETS
from vrs_cli.errors import UsageError
from vrs_cli.files.atomic import write_atomically
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.station.station import Station
from vrs_cli.values.results import RunResult


class Conversion(Batch, frozen=True):
    """A run of which `--to` says how it is written."""

    @property
    def aside(self) -> bool:
        """Return whether what is written stands alone on standard output."""
        return bool(self.options.output == STANDARD_STREAM)

    def _station(self, terminal: BatchTerminal, folder: Folder) -> Station:
        """Raises CommandLineError for a robot that cannot be written so."""
        station = super()._station(terminal, folder)
        try:
            TARGETS[self.options.to].check(station.engine.model)
        except UsageError as error:
            raise CommandLineError(error.detail, error.hint) from None
        return station

    def _ended(self, station: Station, terminal: BatchTerminal, result: RunResult) -> int:
        """Tell how the run ended, and write what it did until then."""
        status, options, engine = super()._ended(station, terminal, result), self.options, station.engine
        run, path = executed_run(engine.arm, engine.timeline), PurePath(self.source.path)
        writer = TARGETS[options.to](run, path.stem, path.name)
        written = writer.write("" if result.fault is None else result.fault.message)
        tell = teller(options.prog)
        for note in written.notes:
            tell(f"note: {note}")
        if options.output == STANDARD_STREAM:
            print(written.text, end="")
        else:
            write_atomically(options.output, written.text)
        return status
