"""What no file holds: programs and variables that were typed or changed since they were loaded or stored."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager

from vrs_cli.interfaces.station.sections import item_of
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.programs import StoredProgram
from vrs_cli.language.run.variables import Item
from vrs_cli.language.text.ast import Program, Section
from vrs_cli.language.text.printer import print_program
from vrs_cli.language.words.values import Value

Memory = tuple[Mapping[str, Program], Mapping[Item, Value]]


class Unstored:
    """Compares what is in memory with what files have of it. What programs compute is theirs to compute again: it does
    not count, unless somebody has changed it before.
    """

    def __init__(self, environment: Environment) -> None:
        self._environment = environment
        self._programs: dict[str, Program] = {}
        self._values: dict[Item, Value] = {}

    # --- what is told of ---

    def memory(self) -> Memory:
        """All programs and values as they are now: equal as long as nothing is changed."""
        programs = {key: stored.program for key, stored in self._environment.programs.items()}
        return programs, self._environment.values()

    def programs(self) -> list[str]:
        """The names of the programs that are not stored."""
        stored = self._environment.programs.items()
        return [one.name for key, one in stored if not _same(self._programs.get(key), one)]

    def items(self) -> list[Item]:
        """The variables that are not stored."""
        return [item for item, value in self._environment.values().items() if self._values.get(item) != value]

    def locations(self) -> list[Item]:
        """The transformations and precision points among them."""
        values = self._environment.values()
        return [item for item in self.items() if isinstance(values[item], tuple)]

    # --- what is noted ---

    def stored(self, parts: Iterable[object]) -> None:
        """A file has these programs and sections."""
        values = self._environment.values()
        for part in parts:
            if isinstance(part, Program):
                self._programs[part.key] = part
            elif isinstance(part, Section):
                items = map(item_of, part.entries)
                self._values.update((item, values[item]) for item in items if item in values)

    @contextmanager
    def running(self) -> Iterator[None]:
        """A program runs: what it changes needs no storing, where it did not before."""
        before = self._environment.values()
        try:
            yield
        finally:
            for item, value in self._environment.values().items():
                old = before.get(item)
                if old is not value and old == self._values.get(item):
                    self._values[item] = value


def _same(program: Program | None, stored: StoredProgram) -> bool:
    """Whether a program is in memory as it is in a file."""
    if program is None or program is stored.program:
        return program is not None
    return print_program(program) == print_program(stored.program)
