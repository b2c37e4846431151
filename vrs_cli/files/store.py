"""Write the programs and variables in memory as the content of a program file (STORE, STOREP, STOREL, STORER, STORES),
with the comments and blank lines of the loaded files at their old positions (`layout`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from enum import Enum

from msgspec import Struct

from vrs_cli.files.layout import Layout
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.analysis.names import own_variables
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.run.variables import Item, NamedValue, item_of
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Entry, File, Program, Section
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.values import SIGIL_KINDS, Kind, key_of, kind_of_value, numbers_of
from vrs_cli.language.words.word import Shape
from vrs_cli.values.diagnostics import Span
from vrs_cli.values.numbers import Value

NO_LAYOUT = Layout()
NOWHERE = Span(0, 0, 0)  # stands for a position in a file, which stored parts do not have


class MemoryPart(Enum):
    """A part of the memory that can be stored alone. `value`: the extension of a file that contains only this part."""

    PROGRAMS = ".pg"
    LOCATIONS = ".lc"
    REALS = ".rv"
    STRINGS = ".st"


EVERYTHING = frozenset(MemoryPart)


class _SectionRow(Struct, frozen=True):
    part: MemoryPart
    name: str
    kinds: tuple[Kind, ...]


_SECTIONS = (
    _SectionRow(MemoryPart.LOCATIONS, ".LOCATIONS", (Kind.LOCATION, Kind.PRECISION)),
    _SectionRow(MemoryPart.REALS, ".REALS", (Kind.REAL,)),
    _SectionRow(MemoryPart.STRINGS, ".STRINGS", (Kind.STRING,)),
)


def store(
    environment: Memory,
    what: Collection[MemoryPart] = EVERYTHING,
    programs: Sequence[str] = (),
    layout: Layout = NO_LAYOUT,
) -> str:
    """Return the content of a file from which LOAD restores the parts `what` of the memory. `programs`: see
    `choose_parts`.
    """
    everything = not programs and set(what) >= EVERYTHING
    return text_of(choose_parts(environment, what, programs), layout, everything=everything)


def choose_parts(
    environment: Memory, what: Collection[MemoryPart] = EVERYTHING, programs: Sequence[str] = ()
) -> list[Program | Section]:
    """Return the programs and sections of the parts `what` of the memory. If `programs` are named, return only these,
    the programs that they call, and the variables that all of them use. Raises UndefinedName.
    """
    found = with_called(environment, programs) if programs else tuple(_programs(environment).values())
    used = variables_used(found) if programs else None
    parts: list[Program | Section] = list(found) if MemoryPart.PROGRAMS in what else []
    return parts + [section for row in _SECTIONS if row.part in what for section in _section(environment, row, used)]


def text_of(parts: Sequence[Program | Section], layout: Layout = NO_LAYOUT, *, everything: bool) -> str:
    """Return programs and sections as a string, with the comments of `layout`. `everything`: whether the whole memory
    is written; the comments at the end of files are then included.
    """
    from vrs_cli.language.text.printer import print_file

    return print_file(File((*layout.laid_out(parts), *(layout.tail if parts and everything else ()))))


def values_of(environment: Memory, parts: Iterable[Program | Section]) -> dict[Item, Value]:
    """Return the values of the variables that are in the sections of `parts`."""
    items = (item_of(entry) for part in parts if isinstance(part, Section) for entry in part.entries)
    return {item: value for item in items if (value := environment.value(item)) is not None}


# --- sections ---------------------------------------------------------------------------------------------------


def _section(environment: Memory, row: _SectionRow, used: Collection[str] | None) -> Iterator[Section]:
    """Yield the section of variables that `row` describes, if it would not be empty. `used`: the keys of the variables
    to include; None for all.
    """
    named = (
        one
        for kind in row.kinds
        for one in environment.variables(kind)
        if used is None or key_of(one.name.partition("[")[0]) in used
    )
    return _of_kinds(row, named, environment.units)


def sections_of(environment: Memory, items: Iterable[Item]) -> File:
    """Return a file whose sections contain only these variables; variables without a value are left out."""
    there = [(item, value) for item in items if (value := environment.value(item)) is not None]
    named = [NamedValue(environment.name_of(item), value) for item, value in there]
    return File(tuple(section for row in _SECTIONS for section in _of_kinds(row, named, environment.units)))


def _of_kinds(row: _SectionRow, named: Iterable[NamedValue], units: JointUnits) -> Iterator[Section]:
    entries = tuple(_entry(one, units) for one in named if kind_of_value(one.value) in row.kinds)
    if entries:
        yield Section(row.name, entries, span=NOWHERE)


def _entry(stored: NamedValue, units: JointUnits) -> Entry:
    value = stored.value
    if isinstance(value, str):
        return Entry(_variable(stored.name), (), value, span=NOWHERE)
    numbers = (value,) if isinstance(value, float) else numbers_of(value, units)
    return Entry(_variable(stored.name), numbers, None, span=NOWHERE)


def _variable(name: str) -> ast.Variable:
    """Parse the name of a variable, such as `#place[1,2]`, and return a syntax tree node with constant indexes."""
    sigil = name[:1] if name[:1] in SIGIL_KINDS else ""
    bare, bracket, indexes = name[len(sigil) :].partition("[")
    if not bracket:
        return ast.Variable(bare, sigil, None, span=NOWHERE)
    numbers = tuple(ast.Number(float(text), text, span=NOWHERE) for text in indexes.rstrip("]").split(","))
    return ast.Variable(bare, sigil, numbers, span=NOWHERE)


# --- programs and variables that programs use ---------------------------------------------------------------------


def _programs(environment: Memory) -> Mapping[str, Program]:
    return {key: stored.program for key, stored in environment.programs.items()}


def with_called(environment: Memory, names: Iterable[str]) -> tuple[Program, ...]:
    """Return the programs with these names and all programs that they call, each once, callers first. Raises
    UndefinedName.
    """
    return called_from([environment.program(name).program for name in names], _programs(environment))


def called_from(programs: Iterable[Program], known: Mapping[str, Program]) -> tuple[Program, ...]:
    """Return programs and all `known` programs that they call directly or indirectly, each once, callers first."""
    found: dict[str, Program] = {}
    waiting = list(programs)
    while waiting:
        program = waiting.pop(0)
        if program.key not in found:
            found[program.key] = program
            waiting += [known[key] for key in _called_keys(program) if key in known]
    return tuple(found.values())


def may_be_called(programs: Iterable[Program], known: Mapping[str, Program]) -> tuple[Program, ...]:
    """Return programs and the `known` programs that they may call. If one of them has CALLS, which takes the name of a
    program from a string, return all known programs.
    """
    found = called_from(programs, known)
    statements = (step.statement for program in found for step in program.steps)
    by_text = any(isinstance(one, ast.Instruction) and one.word == "CALLS" for one in statements)
    return (*found, *known.values()) if by_text else found


def _called_keys(program: Program) -> Iterator[str]:
    """Yield the keys of the programs that a program calls by name (not by a string)."""
    for node in ast.nodes(program):
        if isinstance(node, ast.Instruction) and node.word in INSTRUCTIONS:
            shapes = (argument.shape for argument in INSTRUCTIONS[node.word].arguments)
            for shape, argument in zip(shapes, node.arguments, strict=False):
                if shape is Shape.PROGRAM and isinstance(argument, ast.ProgramCall):
                    yield argument.key
                elif shape is Shape.PROGRAM and isinstance(argument, ast.BareWord):
                    yield key_of(argument.text)


def variables_used(programs: Iterable[Program]) -> frozenset[str]:
    """Return the keys of all global variables that the programs use. A key without a sigil ($ or #) may belong to a
    real or to a location.
    """
    keys = set[str]()
    for program in programs:
        own = {own.key for own in own_variables(program)}  # AUTO and LOCAL variables are not global
        keys |= {node.key for node in ast.nodes(program) if isinstance(node, ast.Variable)} - own
    return frozenset(keys)
