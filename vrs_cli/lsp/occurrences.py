"""Where names stand: every program, label and variable of a part of a file, as written."""

from __future__ import annotations

import re
from collections.abc import Iterator
from enum import Enum

from msgspec import Struct

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Section, Span
from vrs_cli.language.text.parts import Part
from vrs_cli.language.text.source import PROGRAM
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.kind import NAME_LENGTH
from vrs_cli.language.words.word import Shape

LOCALS = frozenset({"AUTO", "LOCAL"})  # instructions whose variables are their program's own

_QUOTED_OR_COMMENT = re.compile(r'"[^"]*"?|;.*')
_GOTO = re.compile(r"\bGOTO\s+(\d+)", re.IGNORECASE)
_NUMBER = re.compile(r"\d+")


class SymbolKind(Enum):
    PROGRAM = "program"
    SECTION = "section"
    LABEL = "label"
    VARIABLE = "variable"


class Occurrence(Struct, frozen=True):
    """A name where it stands; `key` is the same for the same thing. Lines count within the part."""

    kind: SymbolKind
    key: str
    span: Span


def occurrences(part: Part) -> tuple[Occurrence, ...]:
    """All of a part, in the order of the text."""
    node = part.node
    found = _of_program(part, node) if isinstance(node, Program) else _of_section(part, node) if node else ()
    return tuple(sorted(found, key=lambda one: (one.span.line, one.span.column)))


def locals_of(part: Part) -> frozenset[str]:
    """The keys of the variables that are a program's own."""
    node = part.node
    if not isinstance(node, Program):
        return frozenset()
    own = {parameter.key for parameter in node.parameters}
    statements = (step.statement for step in node.steps)
    declared = (one for one in statements if isinstance(one, ast.Instruction) and one.word in LOCALS)
    return frozenset(own | {one.key for statement in declared for one in _variables(statement)})


def blanked(line: str) -> str:
    """The line with blanks for texts and comments, every column where it was."""
    return _QUOTED_OR_COMMENT.sub(lambda found: " " * len(found[0]), line)


def key_of_name(name: str) -> str:
    """What makes two names the same."""
    return name.lower()[:NAME_LENGTH]


# --- programs ------------------------------------------------------------------------------------------------------


def _of_program(part: Part, program: Program) -> Iterator[Occurrence]:
    yield Occurrence(SymbolKind.PROGRAM, program.key, heading_span(part, program.name))
    for parameter in program.parameters:
        yield _variable(part, parameter)
    for step in program.steps:
        if step.label is not None:
            yield Occurrence(SymbolKind.LABEL, str(step.label), label_span(part, step))
        if step.statement is not None:
            yield from _of_statement(part, step.statement)


def _of_statement(part: Part, statement: ast.Statement) -> Iterator[Occurrence]:
    if isinstance(statement, ast.Goto | ast.IfGoto):
        target = _GOTO.search(blanked(part.lines[statement.span.line - 1]))
        if target is not None:
            span = Span(statement.span.line, target.start(1) + 1, target.end(1) + 1)
            yield Occurrence(SymbolKind.LABEL, str(statement.label), span)
    elif isinstance(statement, ast.Instruction):
        yield from (_called(part, given) for given in programs_named(statement))
    yield from (_variable(part, one) for one in _variables(statement))


def programs_named(statement: ast.Instruction) -> Iterator[ast.ProgramCall | ast.Word]:
    """The programs that an instruction names."""
    row = INSTRUCTIONS.get(statement.word)
    for argument, given in zip(row.arguments if row is not None else (), statement.arguments, strict=False):
        if argument.shape is Shape.PROGRAM and isinstance(given, ast.ProgramCall | ast.Word):
            yield given


def _called(part: Part, given: ast.ProgramCall | ast.Word) -> Occurrence:
    name = given.name if isinstance(given, ast.ProgramCall) else given.text.strip()
    return Occurrence(SymbolKind.PROGRAM, key_of_name(name), _as_written(part, name, given.span))


def _variables(node: object) -> Iterator[ast.Variable]:
    """All variables in a tree."""
    if isinstance(node, ast.Variable):
        yield node
    if isinstance(node, tuple):
        for item in node:
            yield from _variables(item)
    elif isinstance(node, Struct):
        for name in node.__struct_fields__:
            yield from _variables(getattr(node, name))


def _of_section(part: Part, section: Section) -> Iterator[Occurrence]:
    return (_variable(part, entry.variable) for entry in section.entries)


# --- places --------------------------------------------------------------------------------------------------------


def _variable(part: Part, variable: ast.Variable) -> Occurrence:
    name = variable.sigil + variable.name
    return Occurrence(SymbolKind.VARIABLE, variable.key, _as_written(part, name, variable.span))


def _as_written(part: Part, name: str, span: Span) -> Span:
    """The name alone, where the span of its tree holds parentheses or indexes too."""
    text = part.lines[span.line - 1]
    at = text.lower().find(name.lower(), span.column - 1)
    begin = at + 1 if at >= 0 else span.column
    return Span(span.line, begin, begin + len(name))


def heading_span(part: Part, name: str) -> Span:
    """The name in the heading; the search begins behind the directive unless that is the name."""
    text = part.lines[0]
    after = 0 if name.startswith(".") else len(PROGRAM) + text.upper().find(PROGRAM)
    at = max(text.lower().find(name.lower(), after), 0)
    return Span(1, at + 1, at + 1 + len(name))


def label_span(part: Part, step: ast.Step) -> Span:
    """The label before a statement."""
    line = step.span.line
    spans = [found.span() for found in _NUMBER.finditer(part.lines[line - 1]) if int(found[0]) == step.label]
    start, end = spans[0] if spans else (0, 1)
    return Span(line, start + 1, end + 1)
