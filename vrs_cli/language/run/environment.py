"""What programs share and keep between runs: variables, programs, signals, timers, the random numbers.

Every variable of the language is global, unless a program declares it its own. The four kinds live in four stores of
`Cells`, plain dictionaries for the speed of compiled programs, which read and write them directly. Two rules hold at
all times: a bare name is a real or a transformation, never both, and a cell that is not there is undefined, so that
reading it says so by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from random import Random
from typing import TYPE_CHECKING, NamedTuple, NoReturn, Protocol

from vrs_cli.errors import (
    IllegalArrayIndex,
    IllegalSignal,
    IllegalValue,
    ProgramNotExecutable,
    TypeMismatch,
    UndefinedName,
    UndefinedValue,
    UnitNotAttached,
)
from vrs_cli.kinematics.joints import TURNING, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.text.ast import Entry, Number, Program
from vrs_cli.language.words.kind import SIGIL_KINDS, Kind, key_of
from vrs_cli.language.words.signals import INPUTS, INTERNAL, OUTPUTS
from vrs_cli.language.words.values import (
    Value,
    integer_between,
    kind_of_value,
    plain,
    precision_point,
    storable,
    transformation,
    whole,
)
from vrs_cli.trajectory.instant import LATEST

if TYPE_CHECKING:
    from vrs_cli.language.analysis.analyzer import Analysis
    from vrs_cli.language.compile.compiler import Compiled
    from vrs_cli.language.text.diagnostics import Diagnostic

Index = int | tuple[int, ...]
Item = tuple[str, Index | None]  # a variable by its key, an element of an array by its index, too

OTHER_KIND = {Kind.REAL: Kind.LOCATION, Kind.LOCATION: Kind.REAL}


def closest(key: str, names: Mapping[str, str]) -> str:
    """`did you mean X?` for a key that is not there, or nothing. `names`: key to spelling."""
    near = get_close_matches(key, names, n=1, cutoff=0.7)
    return f"did you mean {names[near[0]]}?" if near else ""


def subscript(index: Index) -> str:
    """`3` or `1,2`."""
    return ",".join(map(str, index)) if isinstance(index, tuple) else str(index)


# --- variables ---------------------------------------------------------------------------------------------------


class Cells(dict[str | Index, Value]):
    """Values of one kind: all simple variables of that kind by key, or the elements of one `array` by index.

    Reading what is not there raises UndefinedValue, TypeMismatch or IllegalArrayIndex. `omitted` names the
    parameter whose argument a CALL left out, in the cells made to stand for it. `own`: they belong to a program, and
    `others` are those of the other kind that a bare name of that program can have.
    """

    __slots__ = ("array", "environment", "kind", "omitted", "others", "own")

    def __init__(
        self,
        environment: Environment,
        kind: Kind,
        array: str | None = None,
        omitted: str | None = None,
        *,
        own: bool = False,
    ) -> None:
        super().__init__()
        self.own = own
        self.others: Cells | None = None
        self.environment = environment
        self.kind = kind
        self.array = array
        self.omitted = omitted

    def __missing__(self, key: str | Index) -> Value:
        if self.omitted is not None:
            raise UndefinedValue(self.omitted, "its argument was left out of the CALL")
        if self.array is not None and key.__class__ is not str:
            lowest = min(key) if isinstance(key, tuple) else key
            if isinstance(lowest, int) and lowest < 0:
                raise IllegalArrayIndex(self.name(key), "indexes begin at 0")
        if self._is_other(key):
            raise self.clash(key)
        raise UndefinedValue(self.name(key), self._hint(key))

    def _is_other(self, key: str | Index) -> bool:
        """Whether the name has a value of the other kind that it can have."""
        if self.own:
            return self.others is not None and key in self.others
        other = OTHER_KIND.get(self.kind)
        return other is not None and key in self.environment.cells(other, self.array)

    def size(self) -> int:
        """Elements of an array, and characters of strings."""
        elements = 0 if self.array is None else len(self)
        if self.kind is not Kind.STRING:
            return elements
        return elements + sum(len(value) for value in self.values() if isinstance(value, str))

    def name(self, key: str | Index) -> str:
        """The variable as a listing shows it: `part`, `#safe`, `row[3]`."""
        if self.array is None:
            return self.environment.spelling.get(str(key), str(key))
        spelling = self.environment.spelling.get(self.array, self.array)
        return f"{spelling}[{'' if isinstance(key, str) else subscript(key)}]"

    def clash(self, key: str | Index) -> TypeMismatch:
        """The error for a bare name that exists as the other kind."""
        other = OTHER_KIND[self.kind]
        return TypeMismatch(f"{self.name(key)} is a {other.value}", f"a {self.kind.value} is wanted here")

    def deny(self, key: str | Index) -> NoReturn:
        """Raise `clash`: a compiled program found the name among the other kind."""
        raise self.clash(key)

    def at(self, *indexes: float) -> Index:
        """The index of an element to be assigned, rounded. Raises IllegalArrayIndex below 0."""
        rounded = tuple(map(whole, indexes))
        if min(rounded) < 0:
            raise IllegalArrayIndex(self.name(rounded), "indexes begin at 0")
        return rounded if len(rounded) > 1 else rounded[0]

    def _hint(self, key: str | Index) -> str:
        if self.array is not None or not isinstance(key, str):
            return ""
        spelling = self.environment.spelling
        return closest(key, {str(name): spelling.get(str(name), str(name)) for name in self})


class Part(Cells):
    """A part of an array: the elements whose indexes begin with `before`, under the indexes that follow."""

    __slots__ = ("_before", "_whole")

    def __init__(self, whole_array: Cells, before: tuple[int, ...]) -> None:
        super().__init__(whole_array.environment, whole_array.kind, whole_array.array, whole_array.omitted)
        self._whole, self._before = whole_array, before

    def _index(self, key: str | Index) -> str | Index:
        return key if isinstance(key, str) else self._before + (key if isinstance(key, tuple) else (key,))

    def __getitem__(self, key: str | Index) -> Value:
        return self._whole[self._index(key)]

    def __setitem__(self, key: str | Index, value: Value) -> None:
        self._whole[self._index(key)] = value

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str | int | tuple) and self._index(key) in self._whole

    def __iter__(self) -> Iterator[str | Index]:
        size = len(self._before)
        for index in list(self._whole):
            if isinstance(index, tuple) and len(index) > size and index[:size] == self._before:
                yield index[size] if len(index) == size + 1 else index[size:]

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def name(self, key: str | Index) -> str:
        """The element as the whole array names it."""
        if isinstance(key, str):
            return self._whole.name(self._before).replace("]", ",]")
        return self._whole.name(self._index(key))


class Reference(NamedTuple):
    """Where a variable lives, so that it can be passed on and assigned: an argument of CALL, HERE, PROMPT ...

    `cells` are those of its kind. A bare name may still be of two kinds: `cells` are the reals, `locations` the
    transformations; for `#` and `$` names `locations` is empty. `key` is None for a whole array.
    """

    cells: Cells
    locations: Cells
    key: str | Index | None

    @property
    def name(self) -> str:
        return self.cells.name("" if self.key is None else self.key)

    def defined(self) -> bool:
        """Whether the variable, or any element of the array, has a value."""
        if self.key is None:
            return bool(self.cells or self.locations)
        return self.key in self.cells or self.key in self.locations

    def value(self) -> Value:
        """The value, whichever kind it is. Raises UndefinedValue."""
        key = self._cell()
        return self.locations[key] if key in self.locations else self.cells[key]

    def assign(self, value: Value) -> None:
        """Raises TypeMismatch where the name exists as another kind, IllegalArrayIndex for an index below 0."""
        key = self._cell()
        kind = kind_of_value(value)
        to_location = kind is Kind.LOCATION and self.cells.kind is Kind.REAL
        mine, other = (self.locations, self.cells) if to_location else (self.cells, self.locations)
        if mine.kind is not kind:
            wanted = "real or a transformation" if self.cells.kind is Kind.REAL else self.cells.kind.value
            raise TypeMismatch(f"{self.name} cannot hold a {kind.value}", f"a {wanted} is wanted")
        if key in other:
            raise mine.clash(key)
        if not isinstance(key, str) and min(key if isinstance(key, tuple) else (key,)) < 0:
            raise IllegalArrayIndex(self.name, "indexes begin at 0")
        mine[key] = storable(value) if isinstance(value, str) else value

    def row(self, *indexes: float) -> Reference:
        """Of a whole array, the part whose indexes begin with these: `a[i,]`. Raises IllegalArrayIndex."""
        before = tuple(map(whole, indexes))
        if min(before) < 0:
            raise IllegalArrayIndex(self.cells.name(before), "indexes begin at 0")
        locations = self.locations if self.locations is NO_CELLS else Part(self.locations, before)
        return Reference(Part(self.cells, before), locations, None)

    def _cell(self) -> str | Index:
        if self.key is None:
            raise IllegalArrayIndex(self.name, "one element is wanted, not the whole array")
        return self.key


def own_references(
    environment: Environment, names: Sequence[tuple[str, bool]], *, spelled: Mapping[str, str]
) -> tuple[Reference, ...]:
    """Variables of a program's own, each without a value. `names`: keys, and whether they are arrays."""
    made: list[Reference] = []
    for key, is_array in names:
        environment.spell(key, spelled.get(key, key))
        array = key if is_array else None
        kind = SIGIL_KINDS.get(key[:1], Kind.REAL)
        cells, locations = Cells(environment, kind, array, own=True), NO_CELLS
        if kind is Kind.REAL:
            locations = Cells(environment, Kind.LOCATION, array, own=True)
            cells.others, locations.others = locations, cells
        made.append(Reference(cells, locations, None if is_array else key))
    return tuple(made)


def sizes(references: Iterable[Reference]) -> int:
    """What variables hold: elements of arrays, and characters of strings."""
    return sum(one.cells.size() + one.locations.size() for one in references)


class Variable(NamedTuple):
    """A row of a listing: the name as it was first typed, with its indexes, and the value."""

    name: str
    value: Value


# --- signals and timers --------------------------------------------------------------------------------------------

LAST_TIMER = 15
MOST_BITS = 32


class Signals:
    """Digital signals: outputs 1.., inputs 1001.., internal (software) 2001... A negative number is the inverse.

    `listeners` are told the number and the new state of each signal that changes.
    """

    def __init__(self) -> None:
        self._on: set[int] = set()
        self.listeners: list[Callable[[int, bool], None]] = []

    def read(self, number: float) -> bool:
        """Raises IllegalSignal."""
        signal = self._known(number)
        return (abs(signal) in self._on) is (signal > 0)

    def write(self, number: float, *, inputs: bool = False) -> None:
        """On, or off for a negative number. `inputs`: also those that only the world outside drives.

        Raises IllegalSignal.
        """
        signal = self._known(number) if inputs else self.writable(number)
        if self.read(signal):
            return
        self._on.symmetric_difference_update({abs(signal)})
        for listener in self.listeners:
            listener(abs(signal), signal > 0)

    def writable(self, number: float) -> int:
        """A signal that a program may set. Raises IllegalSignal."""
        signal = self._known(number)
        if abs(signal) in INPUTS:
            raise IllegalSignal(str(signal), "an input cannot be set by a program")
        return signal

    def reset(self) -> None:
        """All outputs off."""
        for number in sorted(self._on.intersection(OUTPUTS)):
            self.write(-number)

    def exists(self, number: float) -> bool:
        signal = abs(round(number))
        return any(signal in bank for bank in (OUTPUTS, INPUTS, INTERNAL))

    def read_bits(self, first: float, count: float = 1.0) -> int:
        """`count` signals as a binary number, `first` the lowest bit. Raises IllegalSignal, IllegalValue."""
        return sum(self.read(number) << bit for bit, number in enumerate(self._group(first, count)))

    def write_bits(self, first: float, count: float, value: int) -> None:
        """The lowest `count` bits of `value`. Raises IllegalSignal, IllegalValue."""
        for bit, number in enumerate(self._group(first, count)):
            self.write(number if value >> bit & 1 else -number)

    def state(self, bank: range) -> tuple[bool, ...]:
        """Every signal of a bank (OUTPUTS, INPUTS, INTERNAL) in order."""
        return tuple(number in self._on for number in bank)

    def _group(self, first: float, count: float) -> range:
        start = self._known(first)
        if start < 0:
            raise IllegalSignal(str(start), "a group of bits begins with a positive signal number")
        size = integer_between(count, 1, MOST_BITS, "a number of bits of")
        self._known(start + size - 1)
        return range(start, start + size)

    def _known(self, number: float) -> int:
        if not self.exists(number):
            banks = ", ".join(f"{bank[0]}-{bank[-1]}" for bank in (OUTPUTS, INPUTS, INTERNAL))
            raise IllegalSignal(plain(number), f"signals are {banks}")
        return round(number)


class Timers:
    """Timers 0 to 15, in seconds of the robot clock; one never set counts from the start of the clock."""

    def __init__(self) -> None:
        self._zero: dict[int, float] = {}

    def set(self, number: float, seconds: float, now: float) -> None:
        """Let it show `seconds` now. Raises IllegalValue for a timer that does not exist, or cannot show that."""
        if not abs(seconds) <= LATEST:
            raise IllegalValue(f"a timer at {plain(seconds)} s", f"it is from {-LATEST:g} to {LATEST:g} s")
        self._zero[self._known(number)] = now - seconds

    def read(self, number: float, now: float) -> float:
        """Raises IllegalValue for a timer that does not exist."""
        return now - self._zero.get(self._known(number), 0.0)

    def _known(self, number: float) -> int:
        return integer_between(number, 0, LAST_TIMER, "timer")


# --- programs ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class StoredProgram:
    """A program in memory: analysed when it was stored, compiled when it is first run. `lines`: its source file."""

    environment: Environment
    analysis: Analysis
    lines: tuple[str, ...] = ()

    @property
    def program(self) -> Program:
        return self.analysis.program

    @property
    def name(self) -> str:
        return self.program.name

    @cached_property
    def compiled(self) -> Compiled:
        """Raises ProgramNotExecutable for one that has errors."""
        from vrs_cli.language.compile.compiler import compile_program

        compiled = compile_program(self.analysis)
        for key, name in compiled.spelling.items():
            self.environment.spell(key, name)
        return compiled

    @cached_property
    def beyond_val2(self) -> tuple[Diagnostic, ...]:
        """What of it V+ alone has."""
        from vrs_cli.language.analysis.lineage import program_beyond_val2

        return tuple(program_beyond_val2(self.program))

    def check_lineage(self, *, vplus: bool) -> None:
        """Raises ProgramNotExecutable for a program with anything of V+ while the switch VPLUS is off."""
        if not vplus and self.beyond_val2:
            first = self.beyond_val2[0]
            lines = [step.span.line for step in self.program.steps]
            raise ProgramNotExecutable(
                f"{self.name}, step {lines.index(first.span.line) + 1}: {first.detail}", first.hint
            )

    def own(self) -> tuple[Reference, ...]:
        """The variables that an activation has beside its arguments: those of AUTO, new, and those of LOCAL."""
        declared = self.analysis.own
        if not declared:
            return ()
        names = [(one.key, one.array) for one in declared if one.automatic]
        fresh = iter(own_references(self.environment, names, spelled=self.compiled.spelling))
        kept = iter(self._local)
        return tuple(next(fresh) if one.automatic else next(kept) for one in declared)

    @cached_property
    def _local(self) -> tuple[Reference, ...]:
        """The variables of LOCAL, which keep their values between calls."""
        names = [(one.key, one.array) for one in self.analysis.own if not one.automatic]
        return own_references(self.environment, names, spelled=self.compiled.spelling)

    @property
    def kept(self) -> tuple[Reference, ...]:
        """The variables of LOCAL, where the program has run."""
        made: tuple[Reference, ...] = self.__dict__.get("_local", ())
        return made

    def source(self, step: int) -> str:
        """The text of a step (counted from 0) as it was read, or in canonical form where it was not."""
        line = self.program.steps[step].span.line
        if 1 <= line <= len(self.lines):
            return self.lines[line - 1].strip()
        from vrs_cli.language.text.printer import statement_text

        statement = self.program.steps[step].statement
        return "" if statement is None else statement_text(statement)


# --- the robot as programs see it ----------------------------------------------------------------------------------


class Robot(Protocol):
    """What a program may ask of the robot, always at the task's present instant. Metres, radians, seconds."""

    @property
    def dof(self) -> int: ...
    def here(self) -> Transform:
        """T_world_tool now."""

    def destination(self) -> Transform:
        """T_world_tool where the last motion ends."""

    def joints(self) -> Joints: ...
    def destination_joints(self) -> Joints: ...
    def tool(self) -> Transform:
        """T_flange_tool."""

    def base(self) -> Transform:
        """T_robot_world."""

    def hand(self) -> float:
        """1 open, 0 closed."""

    def time(self) -> float:
        """The robot clock [s]."""

    def speed(self, number: int) -> float: ...
    def state(self, number: int) -> float: ...
    def moving(self) -> bool: ...
    def switch(self, name: str) -> bool:
        """Raises UsageError for a switch that does not exist."""

    def parameter(self, name: str) -> float | str:
        """Raises UsageError for a parameter that does not exist."""

    def in_range(self, place: Transform | Joints) -> int:
        """0 where the place can be reached, otherwise the reasons as bits."""


class System(Protocol):
    """What a program may ask of the system that runs it; always for the task that asks."""

    def task(self) -> int:
        """Its number; -1 for a line of the prompt."""

    def priority(self) -> int: ...
    def run_state(self, task: int) -> int:
        """What a task does (`operations.RUN_STATES`)."""

    def program_status(self, name: str) -> int:
        """What a program does (`STATUS` in the table of functions)."""

    def identity(self, component: int) -> float:
        """Raises IllegalValue for a component that there is not."""

    def unit_status(self, unit: int) -> int:
        """Of the last operation on a logical unit: 1, or a code."""

    def record_length(self, unit: int) -> int:
        """Characters of the last record of a logical unit."""

    def character(self, unit: int, wait: bool) -> int:
        """The code of the next character of a logical unit, or of what went wrong."""


class _Alone:
    """The system of a program that runs by itself: one task, and no devices."""

    def task(self) -> int:
        return 0

    def priority(self) -> int:
        return 0

    def run_state(self, task: int) -> int:  # noqa: ARG002 (of the protocol, as are those below)
        return 0

    def program_status(self, name: str) -> int:  # noqa: ARG002
        return 0

    def identity(self, component: int) -> float:  # noqa: ARG002
        return 0.0

    def unit_status(self, unit: int) -> int:  # noqa: ARG002
        return UnitNotAttached.code

    def record_length(self, unit: int) -> int:  # noqa: ARG002
        return 0

    def character(self, unit: int, wait: bool) -> int:  # noqa: ARG002
        return UnitNotAttached.code


@dataclass(frozen=True, slots=True)
class Context:
    """What functions and instructions work on."""

    environment: Environment
    robot: Robot

    def folded(self, text: str) -> str:
        """A string as comparisons see it: without regard to case while the switch UPPER is on."""
        return text.upper() if self.robot.switch("UPPER") else text


# --- all of it -----------------------------------------------------------------------------------------------------


class Environment:
    """Variables, programs, signals and timers of one robot. The same `seed` gives the same random numbers.

    `system` is who runs the programs. `units`: how the joints of its robot are said.
    """

    def __init__(self, seed: int = 0, units: JointUnits = TURNING) -> None:
        self.units = units
        self.spelling: dict[str, str] = {}
        self.programs: dict[str, StoredProgram] = {}
        self.signals = Signals()
        self.timers = Timers()
        self.random = Random(seed)
        self.last_error = 0
        self.system: System = _Alone()
        self._simple = {kind: Cells(self, kind) for kind in Kind}
        self._arrays: dict[Kind, dict[str, Cells]] = {kind: {} for kind in Kind}

    # variables

    def cells(self, kind: Kind, array: str | None = None) -> Cells:
        """The simple variables of a kind, or the elements of one array (empty where it has none yet)."""
        if array is None:
            return self._simple[kind]
        arrays = self._arrays[kind]
        if array not in arrays:
            arrays[array] = Cells(self, kind, array)
        return arrays[array]

    def reference(self, name: str, index: Index | None = None, *, array: bool = False) -> Reference:
        """The variable of that name (as typed); an element of an array; or, with `array`, the whole of it."""
        key = key_of(name)
        self.spell(key, name)
        kind = SIGIL_KINDS.get(key[:1], Kind.REAL)
        owner = key if array or index is not None else None
        cells = self.cells(kind, owner)
        locations = self.cells(Kind.LOCATION, owner) if kind is Kind.REAL else NO_CELLS
        return Reference(cells, locations, index if owner else key)

    def define(self, entry: Entry) -> None:
        """A line of a .LOCATIONS, .REALS or .STRINGS section, in place of what the name was. Raises IllegalValue."""
        name = entry.variable.sigil + entry.variable.name
        numbers = [number.value for number in entry.variable.indexes or () if isinstance(number, Number)]
        indexes = tuple(map(whole, numbers))
        index = None if not indexes else indexes if len(indexes) > 1 else indexes[0]
        value = _entered(entry, self.units)
        if self.kind_of(name) not in (None, kind_of_value(value)):
            self.delete(name)
        self.reference(name, index).assign(value)

    def spell(self, key: str, name: str) -> None:
        """Keep the spelling of the first use of a name."""
        self.spelling.setdefault(key, name)

    def kind_of(self, name: str) -> Kind | None:
        """The kind of a name that has a value, simple or array; None for one that has none."""
        key = key_of(name)
        for kind in Kind:
            if key in self._simple[kind] or self._arrays[kind].get(key):
                return kind
        return None

    def kinds(self) -> dict[str, Kind]:
        """Every name that has a value, by key, and its kind."""
        known: dict[str, Kind] = {}
        for kind in Kind:
            known.update((key, kind) for key, cells in self._arrays[kind].items() if cells)
            known.update((str(key), kind) for key in self._simple[kind])
        return known

    def variables(self, kind: Kind) -> Iterator[Variable]:
        """Every value of a kind in the order of names and indexes, arrays element by element."""
        rows: list[tuple[str, tuple[int, ...], str, Value]]
        rows = [(str(key), (), self._simple[kind].name(key), value) for key, value in self._simple[kind].items()]
        rows += [
            (array, index if isinstance(index, tuple) else (index,), cells.name(index), value)
            for array, cells in self._arrays[kind].items()
            for index, value in cells.items()
            if not isinstance(index, str)
        ]
        for _, _, name, value in sorted(rows, key=lambda row: (row[0], row[1])):
            yield Variable(name, value)

    def values(self) -> dict[Item, Value]:
        """Every value."""
        found: dict[Item, Value] = {}
        for kind in Kind:
            found.update(((str(key), None), value) for key, value in self._simple[kind].items())
            for array, cells in self._arrays[kind].items():
                found.update(((array, index), value) for index, value in cells.items() if not isinstance(index, str))
        return found

    def put_back(self, item: Item, value: Value) -> None:
        """Give a variable a value that it had, whatever it is now."""
        key, index = item
        if self.kind_of(key) not in (None, kind_of_value(value)):
            self.delete(key)
        self.reference(key, index).assign(value)

    def name_of(self, item: Item) -> str:
        """A variable as a listing shows it."""
        key, index = item
        spelled = self.spelling.get(key, key)
        return spelled if index is None else f"{spelled}[{subscript(index)}]"

    def held(self) -> int:
        """Elements of all arrays, and characters of all strings, those of LOCAL too."""
        arrays = (cells for of_kind in self._arrays.values() for cells in of_kind.values())
        local = (reference for stored in self.programs.values() for reference in stored.kept)
        return self._simple[Kind.STRING].size() + sum(cells.size() for cells in arrays) + sizes(local)

    def delete(self, name: str, index: Index | None = None) -> bool:
        """Forget a variable and the array of that name, or one element. False where there was none."""
        key = key_of(name)
        if self.kind_of(name) is None:
            return False
        if index is not None:
            return any(self.cells(kind, key).pop(index, None) is not None for kind in Kind)
        for kind in Kind:
            self._simple[kind].pop(key, None)
            self.cells(kind, key).clear()
        return True

    def clear_variables(self, *kinds: Kind) -> None:
        """Forget all variables of some kinds, of all kinds when none is named."""
        for kind in kinds or tuple(Kind):
            self._simple[kind].clear()
            for cells in self._arrays[kind].values():
                cells.clear()

    # programs

    def store(self, analysis: Analysis, lines: tuple[str, ...] = ()) -> StoredProgram:
        """Keep a program, in the place of one of the same name. `lines`: those of its whole file, which all of its
        programs share."""
        stored = StoredProgram(self, analysis, lines)
        self.programs[analysis.program.key] = stored
        return stored

    def program(self, name: str) -> StoredProgram:
        """Raises UndefinedName, with a similar name where there is one."""
        key = key_of(name)
        if key not in self.programs:
            names = {other: stored.name for other, stored in self.programs.items()}
            raise UndefinedName(f"program {name}", closest(key, names))
        return self.programs[key]


def _entered(entry: Entry, units: JointUnits) -> Value:
    if entry.text is not None:
        return entry.text
    if entry.variable.sigil == "#":
        return precision_point(entry.numbers, units)
    return entry.numbers[0] if len(entry.numbers) == 1 else transformation(entry.numbers)


class _Nothing(Environment):
    """Owner of the cells that stand where a `#` or `$` name can have no other kind."""


NO_CELLS = Cells(_Nothing(), Kind.LOCATION)
