"""Where names stand in a part of a file (programs, labels, variables), and the colour of each piece of its text."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.interfaces.conversation.complete import blanked
from vrs_cli.language.analysis.names import own_variables
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Section
from vrs_cli.language.text.meaning import FUNCTION_NAMES
from vrs_cli.language.text.parser import Part
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.word import Shape
from vrs_cli.render.colours import Ink, scan
from vrs_cli.values.diagnostics import Span, in_order

_GOTO = re.compile(r"\bGOTO\s+(\d+)", re.IGNORECASE)
_DIGITS = re.compile(r"\d*")


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

    def is_same(self, other: Occurrence) -> bool:
        """Whether both name the same thing."""
        return (self.kind, self.key) == (other.kind, other.key)


@lru_cache(maxsize=4096)  # parts: most of a file that is being changed stay what they are
def occurrences(part: Part) -> tuple[Occurrence, ...]:
    """All of a part, in the order of the text."""
    node = part.node
    entries = node.entries if isinstance(node, Section) else ()
    found = _of_program(part, node) if isinstance(node, Program) else (_variable(part, one.variable) for one in entries)
    return in_order(found)


def locals_of(part: Part) -> frozenset[str]:
    """The keys of the variables that are a program's own."""
    node = part.node
    if not isinstance(node, Program):
        return frozenset()
    return frozenset({parameter.key for parameter in node.parameters} | {own.key for own in own_variables(node)})


# --- programs ------------------------------------------------------------------------------------------------------


def _of_program(part: Part, program: Program) -> Iterator[Occurrence]:
    yield Occurrence(SymbolKind.PROGRAM, program.key, heading_span(program))
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
    elif isinstance(statement, ast.Instruction) and statement.word in INSTRUCTIONS:
        for argument, given in zip(INSTRUCTIONS[statement.word].arguments, statement.arguments, strict=False):
            if argument.shape is Shape.PROGRAM and isinstance(given, ast.ProgramCall):
                yield Occurrence(SymbolKind.PROGRAM, given.key, _as_written(part, given.name, given.span))
    yield from (_variable(part, node) for node in ast.nodes(statement) if isinstance(node, ast.Variable))


# --- places --------------------------------------------------------------------------------------------------------


def _variable(part: Part, variable: ast.Variable) -> Occurrence:
    name = variable.sigil + variable.name
    return Occurrence(SymbolKind.VARIABLE, variable.key, _as_written(part, name, variable.span))


def _as_written(part: Part, name: str, span: Span) -> Span:
    """The name alone, where the span of its tree holds parentheses or indexes too."""
    at = part.lines[span.line - 1].lower().find(name.lower(), span.column - 1)
    begin = at + 1 if at >= 0 else span.column
    return Span(span.line, begin, begin + len(name))


def heading_span(node: Program | Section) -> Span:
    """The name in a heading."""
    return Span(node.span.line, node.span.column, node.span.column + len(node.name))


def label_span(part: Part, step: ast.Step) -> Span:
    """The label before a statement."""
    line, begin = step.span.line, step.span.column
    digits = _DIGITS.match(part.lines[line - 1], begin - 1)
    return Span(line, begin, digits.end() + 1 if digits is not None else begin)


class Colour(Enum):
    """The kinds of pieces, by the names of the Language Server Protocol."""

    KEYWORD = "keyword"
    FUNCTION = "function"
    VARIABLE = "variable"
    PARAMETER = "parameter"
    NUMBER = "number"
    STRING = "string"
    COMMENT = "comment"
    OPERATOR = "operator"
    LABEL = "label"


class Modifier(Enum):
    """What is true of a piece too. `OWN`: of AUTO, LOCAL, or a parameter; `BUILT_IN`: a function of VAL-II."""

    OWN = "static"
    BUILT_IN = "defaultLibrary"


class Piece(NamedTuple):
    """Lines and columns count from 1, lines within the part."""

    line: int
    column: int
    length: int
    colour: Colour
    modifier: Modifier | None = None


_OF_INK: Mapping[Ink, Colour] = {
    Ink.NUMBER: Colour.NUMBER,
    Ink.STRING: Colour.STRING,
    Ink.COMMENT: Colour.COMMENT,
    Ink.COMMAND: Colour.KEYWORD,
    Ink.INSTRUCTION: Colour.KEYWORD,
    Ink.CONTROL: Colour.KEYWORD,
    Ink.FUNCTION: Colour.FUNCTION,
    Ink.OPERATOR: Colour.OPERATOR,
}


@lru_cache(maxsize=4096)  # parts: most of a file that is being changed stay what they are
def pieces(part: Part) -> tuple[Piece, ...]:
    """All of a part, in the order of the text."""
    own, named, found = locals_of(part), dict[tuple[int, int], Piece](), list[Piece]()
    parameters = {one.key for one in part.node.parameters} if isinstance(part.node, Program) else set[str]()
    for one in occurrences(part):
        line, column, colour = one.span.line, one.span.column, _OF_SYMBOL[one.kind]
        if one.key in parameters and colour is Colour.VARIABLE:
            colour = Colour.PARAMETER
        modifier = Modifier.OWN if colour is not Colour.FUNCTION and one.key in own else None
        named[line, column] = Piece(line, column, one.span.end - column, colour, modifier)
    taken = FUNCTION_NAMES.keys() & {one.key for one in occurrences(part) if one.kind is SymbolKind.VARIABLE}
    for line, text in enumerate(part.lines, 1):
        at = 1
        for piece, ink in scan(text, taken):
            known = named.get((line, at))
            if known is not None:
                found.append(known)
            elif ink in _OF_INK:
                modifier = Modifier.BUILT_IN if ink is Ink.FUNCTION else None
                found.append(Piece(line, at, len(piece), _OF_INK[ink], modifier))
            at += len(piece)
    return tuple(found)


_OF_SYMBOL: Mapping[SymbolKind, Colour] = {
    SymbolKind.PROGRAM: Colour.FUNCTION,
    SymbolKind.SECTION: Colour.KEYWORD,
    SymbolKind.LABEL: Colour.LABEL,
    SymbolKind.VARIABLE: Colour.VARIABLE,
}
