"""The contents of program files compared with the memory: the programs of a loaded file, analysed together with those
in memory, its variables, and the programs and variables in memory that are in no file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from operator import itemgetter
from types import MappingProxyType
from typing import Self
from weakref import WeakSet, ref

from msgspec import Struct

from vrs_cli.errors import FileDamaged, IllegalValue, VrsError
from vrs_cli.files.layout import Layout
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.analysis import analyzer, structure
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.memory import Memory, StoredProgram
from vrs_cli.language.run.variables import Item, Variables
from vrs_cli.language.text import ast, collector, parser, printer
from vrs_cli.language.words.values import Kind, kind_of_value, rounding
from vrs_cli.values.diagnostics import Diagnostic, error, first_error, warning
from vrs_cli.values.numbers import Value

NO_PROGRAMS: Mapping[str, ast.Program] = MappingProxyType({})
LONG_TEXT = 1000  # [characters] let another thread parse files longer than this
LONG_PROGRAM = 100  # let another thread compile or edit programs with more steps
# warn if the axes of a transformation are rounded by more than this; rounding to single precision is smaller
LEAST_TOLD = 1e-6


class LoadedFile(Struct, frozen=True):
    """The contents of a program file. `file`: the parsed file; `layout`: its comments and blank lines; `variables`: the
    variables of sections without mistakes; `programs`: the analysed programs; `diagnostics`: the mistakes that the
    analysis found."""

    file: ast.File
    layout: Layout
    variables: Variables
    programs: tuple[StoredProgram, ...]
    diagnostics: tuple[Diagnostic, ...]

    @classmethod
    def of(
        cls, file: ast.File, text: str, memory: Memory, *, vplus: bool, beside: Mapping[str, ast.Program] = NO_PROGRAMS
    ) -> Self:
        """Analyse a file. `memory`: a copy of the memory; the file's variables are added to it. `vplus`: whether words
        of V+ are allowed. `beside`: the programs, by key, of files that are loaded together with this one."""
        programs = {part.key: part for part in file.parts if isinstance(part, ast.Program)}
        variables, diagnostics = Variables(memory.units), list[Diagnostic]()
        for section in file.parts:
            if isinstance(section, ast.Section):
                its, found = variables_of(section, memory.units)
                diagnostics += found
                # define variables of sections with mistakes, too, so that their uses are not reported as undefined
                memory.take(its)
                if section.whole and first_error(found) is None:
                    variables.take(its)
        everything = {key: stored.program for key, stored in memory.programs.items()} | {**beside, **programs}
        surroundings = analyzer.Surroundings(memory.kinds, everything)
        lines = tuple(text.split("\n"))
        stored = tuple(
            StoredProgram(analyzer.analyze_among(surroundings, program), lines) for program in programs.values()
        )
        for one in stored:
            collector.free_in_parts(one.program, one.program.steps, lines)
            diagnostics += one.analysis.diagnostics
            diagnostics += () if vplus else structure.beyond(one.program, vplus=False)
        return cls(file, Layout.of(file), variables, stored, parser.drop_suppressed(lines, diagnostics))


def variables_of(section: ast.Section, units: JointUnits) -> tuple[Variables, tuple[Diagnostic, ...]]:
    """Return the variables of a section with their values, and diagnostics: for wrong values, and for the
    transformation whose axes were rounded most."""
    variables, found = Variables(units), list[Diagnostic]()
    rounded = list[tuple[float, ast.Entry]]()
    for entry in section.entries:
        name = entry.variable.sigil + entry.variable.name
        try:
            variables.define(entry)
        except VrsError as wrong:
            found.append(error(type(wrong), entry.span, f"{name}: {wrong.detail}", wrong.hint))
            continue
        if len(entry.numbers) == ast.AXES and not entry.variable.sigil and (by := rounding(entry.numbers)) > LEAST_TOLD:
            rounded.append((by, entry))
    if rounded:
        by, worst = max(rounded, key=itemgetter(0))
        others = f", and those of {len(rounded) - 1} more in this section by less" if len(rounded) > 1 else ""
        what = f"{worst.variable.name}: its axes are rounded by {by:.1G}{others}"
        found.append(warning(IllegalValue, worst.span, what, "the nearest rotation is taken"))
    if not section.whole or first_error(found):
        found.append(
            warning(FileDamaged, section.span, f"nothing of {section.name} is loaded", "a line of it is wrong")
        )
    return variables, tuple(found)


State = tuple[int, Mapping[str, ast.Program]]
MAX_COMPARED_STEPS = 1000  # keep the file version of a program for comparison only if it has at most this many steps


def _keep_reference(program: ast.Program) -> Callable[[], ast.Program | None]:
    """Return a function that returns the program, or None if it is long and no longer in memory: only a weak reference
    to a long program is kept, to save memory."""
    return ref(program) if len(program.steps) > MAX_COMPARED_STEPS else lambda: program


class Unstored:
    """The programs and variables in memory that are in no file. Variables that only programs have changed are ignored,
    because the programs can compute them again. Variables are compared with files only after `watch` was called.
    `asked_about`: whether a user who leaves is asked about unsaved programs and variables."""

    asked_about = True

    def __init__(self, environment: Environment) -> None:
        self._environment = environment
        self._programs: dict[str, Callable[[], ast.Program | None]] = {}  # programs as they are in their files
        self._different: WeakSet[StoredProgram] = WeakSet()  # programs that differ from those in their files
        self._values: dict[Item, Value] = {}  # values of variables in their files
        self._items: set[Item] = set()
        self._changed: set[Item] = set()  # variables that have changed since they were last compared with files
        # values when the running program began; None if no program is running
        self._before: Mapping[Item, Value] | None = None
        self._version = 0
        self._news: set[Item] = set()

    def watch(self) -> None:
        """Start to record which variables change, to compare them with files later."""
        self._environment.note_changes(self._changed)

    # --- questions about unsaved work ---

    def state(self) -> State:
        """Return a value that stays equal until a variable or a program changes."""
        self._look()
        return self._version, {key: stored.program for key, stored in self._environment.programs.items()}

    def programs(self) -> list[str]:
        """Return the names of the programs that are in no file, or differ from their files."""
        return [one.name for key, one in self._environment.programs.items() if self._differs(key, one)]

    def items(self, *kinds: Kind) -> list[Item]:
        """Return the variables that are in no file, or have other values there. `kinds`: only variables of these kinds;
        default: all."""
        self._look()
        values = ((item, self._environment.value(item)) for item in self._items)
        return [item for item, value in values if value is not None and (not kinds or kind_of_value(value) in kinds)]

    @property
    def fresh(self) -> bool:
        """Return whether `news` may return variables."""
        return bool(self._news or self._changed)

    def news(self) -> set[Item]:
        """Return the variables that users have changed or deleted since the previous call."""
        self._look()
        news, self._news = self._news, set()
        return news

    def _look(self) -> None:
        """Compare the variables that have changed with their values in files."""
        self._version += bool(self._changed)
        self._news |= self._changed
        for item in self._changed:
            value = self._environment.value(item)
            same = value is None or value == self._values.get(item)
            self._items.discard(item) if same else self._items.add(item)
        self._changed.clear()

    def _differs(self, key: str, stored: StoredProgram) -> bool:
        if stored in self._different:
            return True
        of_file, now = self._programs.get(key, lambda: None)(), stored.program
        if of_file is not now and (of_file is None or printer.print_program(of_file) != printer.print_program(now)):
            self._different.add(stored)
            return True
        self._programs[key] = _keep_reference(now)
        return False

    # --- notes about files and changes ---

    def programs_stored(self, programs: Iterable[ast.Program]) -> None:
        """Record that a file now contains these programs."""
        there = self._environment.programs
        for program in programs:
            self._programs[program.key] = _keep_reference(program)
            if program.key in there:
                self._different.discard(there[program.key])

    def programs_deleted(self) -> None:
        """Forget the file versions of programs that are no longer in memory."""
        self._programs = {key: of_file for key, of_file in self._programs.items() if key in self._environment.programs}

    def values_loaded(self, values: Mapping[Item, Value]) -> None:
        """Record that these variables have just received these values from a file."""
        noted = self._changed.intersection(values)
        self._version += bool(noted)
        self._news |= noted
        self._changed -= noted
        self._items.difference_update(values)
        self._values |= values

    def values_stored(self, values: Mapping[Item, Value]) -> None:
        """Record that a file now contains these variables with these values."""
        self._changed.update(item for item, value in values.items() if self._values.get(item) != value)
        self._changed |= self._items & values.keys()
        self._values |= values

    @property
    def of_program(self) -> bool:
        """Return whether changes made now count as changes by a running program, not by a user."""
        return self._before is not None

    def begin_run(self) -> None:
        """Record that a program starts to run. The variables that it changes do not count as unsaved work."""
        self._look()
        self._environment.note_changes(None)
        self._before = self._environment.values()

    def end_run(self) -> None:
        """Record that the program has stopped, or that changes now come from a user while the program runs."""
        if self._before is None:
            return
        before, after, self._before = self._before, self._environment.values(), None
        self.watch()
        for item, value in after.items():
            old = before.get(item)
            if old is not value and old != value:
                self._changed.add(item)
                if old == self._values.get(item):
                    self._values[item] = value
        self._changed.update(before.keys() - after.keys())
