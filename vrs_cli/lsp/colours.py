"""Semantic tokens: what each piece of a text is, beyond what its letters show. A name is a program, a parameter, a
variable of the program's own, or one of all programs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.meaning import FUNCTION_NAMES
from vrs_cli.language.text.parts import Part
from vrs_cli.lsp.occurrences import SymbolKind, locals_of, occurrences
from vrs_cli.render.colours import Ink
from vrs_cli.render.scan import scan


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
    named = {(one.line, one.column): one for one in _names(part)}
    found: list[Piece] = []
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


def _names(part: Part) -> Iterator[Piece]:
    own = locals_of(part)
    parameters = {one.key for one in part.node.parameters} if isinstance(part.node, Program) else set[str]()
    for one in occurrences(part):
        colour = _OF_SYMBOL[one.kind]
        if one.key in parameters and colour is Colour.VARIABLE:
            colour = Colour.PARAMETER
        modifier = Modifier.OWN if colour is not Colour.FUNCTION and one.key in own else None
        yield Piece(one.span.line, one.span.column, one.span.end - one.span.column, colour, modifier)


_OF_SYMBOL: Mapping[SymbolKind, Colour] = {
    SymbolKind.PROGRAM: Colour.FUNCTION,
    SymbolKind.SECTION: Colour.KEYWORD,
    SymbolKind.LABEL: Colour.LABEL,
    SymbolKind.VARIABLE: Colour.VARIABLE,
}
