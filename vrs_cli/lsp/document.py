"""Analyse a program file for an editor: find the positions of names, suggest completions, explain words, and find the
colours of the text.

The functions take text and return plain values. Lines and columns count from 1, as in `Span`; `server` converts them to
the editor's positions.
"""

from __future__ import annotations

import re
from collections import ChainMap
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from functools import cached_property, lru_cache
from itertools import chain, pairwise
from typing import NamedTuple

from msgspec import Struct, field, structs

from vrs_cli.engine.settings import PARAMETERS, SWITCHES
from vrs_cli.errors import InvalidName, UsageError
from vrs_cli.interfaces.conversation.complete import DefinedNames, Signature, blank_out, signature, suggestions
from vrs_cli.interfaces.inspection import ALONE, Beside, Inspector
from vrs_cli.interfaces.monitor.help import page
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.analysis.names import BlockKind, own_variables
from vrs_cli.language.analysis.structure import canonical_text, structure_of
from vrs_cli.language.text import ast, lexer, printer
from vrs_cli.language.text.parser import PROGRAM, SECTIONS, Part, Placed, parts_of, programs_of
from vrs_cli.language.words.instructions import INSTRUCTIONS, RESERVED, why_reserved
from vrs_cli.language.words.values import NAME_LENGTH, SIGIL_KINDS, Kind, key_of
from vrs_cli.language.words.word import Shape
from vrs_cli.render.colours import Ink, scan
from vrs_cli.values.diagnostics import Diagnostic, Span, in_order
from vrs_cli.values.questions import Suggestion

_GOTO_LABEL = re.compile(r"\bGOTO\s+(\d+)", re.IGNORECASE)
_DIGITS = re.compile(r"\d*")


class SymbolKind(Enum):
    PROGRAM = "program"
    SECTION = "section"
    LABEL = "label"
    VARIABLE = "variable"


class Occurrence(Struct, frozen=True):
    """An occurrence of a name in the text. `key`: the key of the variable, program or label, equal for all its
    occurrences; `span`: the position, with lines counted from the start of the part (a program or a section of the
    file)."""

    kind: SymbolKind
    key: str
    span: Span

    def is_same(self, other: Occurrence) -> bool:
        """Return whether both are occurrences of the same variable, program or label."""
        return (self.kind, self.key) == (other.kind, other.key)


@lru_cache(maxsize=4096)  # keep the results for this many parts, because an edit changes only few parts of a file
def occurrences(part: Part) -> tuple[Occurrence, ...]:
    """Return all occurrences of names in one part, in the order of the text."""
    node = part.node
    entries = node.entries if isinstance(node, ast.Section) else ()
    found = (
        _of_program(part, node) if isinstance(node, ast.Program) else (_variable(part, one.variable) for one in entries)
    )
    return in_order(found)


def locals_of(part: Part) -> frozenset[str]:
    """Return the keys of a program's parameters and private variables; none for a section."""
    node = part.node
    parameters, own = (node.parameters, own_variables(node)) if isinstance(node, ast.Program) else ((), ())
    return frozenset({parameter.key for parameter in parameters} | {variable.key for variable in own})


# --- programs ------------------------------------------------------------------------------------------------------


def _of_program(part: Part, program: ast.Program) -> Iterator[Occurrence]:
    yield Occurrence(SymbolKind.PROGRAM, program.key, heading_span(program))
    yield from (_variable(part, parameter) for parameter in program.parameters)
    for step in program.steps:
        if step.label is not None:
            yield Occurrence(SymbolKind.LABEL, str(step.label), label_span(part, step))
        if step.statement is not None:
            if isinstance(step.statement, ast.Goto | ast.IfGoto):
                if target := _GOTO_LABEL.search(blank_out(part.lines[step.statement.span.line - 1])):
                    span = Span(step.statement.span.line, target.start(1) + 1, target.end(1) + 1)
                    yield Occurrence(SymbolKind.LABEL, str(step.statement.label), span)
            elif isinstance(step.statement, ast.Instruction) and step.statement.word in INSTRUCTIONS:
                for argument, given in zip(
                    INSTRUCTIONS[step.statement.word].arguments, step.statement.arguments, strict=False
                ):
                    if argument.shape is Shape.PROGRAM and isinstance(given, ast.ProgramCall):
                        yield Occurrence(SymbolKind.PROGRAM, given.key, _as_written(part, given.name, given.span))
            yield from (_variable(part, node) for node in ast.nodes(step.statement) if isinstance(node, ast.Variable))


# --- spans of names ------------------------------------------------------------------------------------------------


def _variable(part: Part, variable: ast.Variable) -> Occurrence:
    name = variable.sigil + variable.name
    return Occurrence(SymbolKind.VARIABLE, variable.key, _as_written(part, name, variable.span))


def _as_written(part: Part, name: str, span: Span) -> Span:
    """Return the span of a name without the parentheses and indexes that its span in the syntax tree may include."""
    at = part.lines[span.line - 1].lower().find(name.lower(), span.column - 1)
    begin = at + 1 if at >= 0 else span.column
    return Span(span.line, begin, begin + len(name))


def heading_span(node: ast.Program | ast.Section) -> Span:
    return Span(node.span.line, node.span.column, node.span.column + len(node.name))


def label_span(part: Part, step: ast.Step) -> Span:
    line, begin = step.span.line, step.span.column
    digits = _DIGITS.match(part.lines[line - 1], begin - 1)
    return Span(line, begin, digits.end() + 1 if digits is not None else begin)


class Colour(Enum):
    """The kind of a coloured piece of text. The values are the token types of the Language Server Protocol."""

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
    """An additional property of a coloured piece. `OWN`: it is a parameter or a private variable (AUTO, LOCAL);
    `BUILT_IN`: it is a function of VAL-II. The values are the token modifiers of the Language Server Protocol."""

    OWN = "static"
    BUILT_IN = "defaultLibrary"


class Piece(NamedTuple):
    """A coloured piece of text. `line`, `column`: its position, counted from 1 and lines from the start of the part;
    `length`: the number of its characters."""

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


@lru_cache(maxsize=4096)  # keep the results for this many parts, because an edit changes only few parts of a file
def pieces(part: Part) -> tuple[Piece, ...]:
    own, named, found = locals_of(part), dict[tuple[int, int], Piece](), list[Piece]()
    parameters = {one.key for one in part.node.parameters} if isinstance(part.node, ast.Program) else set[str]()
    for one in occurrences(part):
        line, column, colour = one.span.line, one.span.column, _OF_SYMBOL[one.kind]
        if one.key in parameters and colour is Colour.VARIABLE:
            colour = Colour.PARAMETER
        modifier = Modifier.OWN if colour is not Colour.FUNCTION and one.key in own else None
        named[line, column] = Piece(line, column, one.span.end - column, colour, modifier)
    taken = ast.FUNCTION_NAMES.keys() & {one.key for one in occurrences(part) if one.kind is SymbolKind.VARIABLE}
    for line, text in enumerate(part.lines, 1):
        at = 1
        for piece, ink in scan(text, taken):
            if (known := named.get((line, at))) is not None:
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


_WORD = re.compile(r"[#$]?[A-Za-z][\w.]*|\d+")
_MEANT = re.compile(r"did you mean ([#$]?[A-Za-z][\w.]*)\?")
_GOTO = re.compile(r"\bGOTO\s+\d*$", re.IGNORECASE)
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.]*")
_SECTION_KINDS = {".LOCATIONS": Kind.LOCATION, ".REALS": Kind.REAL, ".DOUBLES": Kind.REAL, ".STRINGS": Kind.STRING}


class Symbol(Struct, frozen=True):
    """A program, section, label or variable in the outline of a file. `span`: the position of its name; `last`: the
    number of its last line; `detail`: a note that the editor shows beside its name; `children`: the labels or variables
    in it."""

    name: str
    kind: SymbolKind
    span: Span
    last: int
    detail: str = ""
    children: tuple[Symbol, ...] = field(default=())


class Mend(NamedTuple):
    """A correction of a mistake. `finding`: the diagnostic that reports the mistake; `text`: the characters to write in
    place of `span`; `sure`: whether the correction is certain to be right, so that the editor may apply it without
    asking."""

    finding: Diagnostic
    span: Span
    text: str
    sure: bool


class Document:
    """One version of a program file, parsed once. `model`: the robot for which locations are checked; `inspector`: the
    inspector of the file's previous version, which keeps its results for unchanged parts; `name`: the name of the file,
    from which a program without a `.PROGRAM` line gets its name."""

    def __init__(self, text: str, model: RobotModel, inspector: Inspector | None = None, name: str = "") -> None:
        self.text, self.name = text, name
        self._inspector = inspector or Inspector(model)
        self._parts = self._inspector.read(text, name)
        self._programs = tuple(programs_of(self._parts))
        self._found: tuple[Diagnostic, ...] | None = None
        self.lines = [line for placed in self._parts for line in placed.part.lines]

    @cached_property
    def programs(self) -> Mapping[str, ast.Program]:
        return {program.key: program for _, program in self._programs}

    @cached_property
    def sections(self) -> tuple[ast.Section, ...]:
        return tuple(one.part.node for one in self._parts if isinstance(one.part.node, ast.Section))

    # --- mistakes and corrections ---

    def findings(self, beside: Beside = ALONE) -> tuple[Diagnostic, ...]:
        """Check this text as `vrs check` does, and return the diagnostics. `beside`: the programs and variables of
        other files that the check takes into account."""
        self._found = self._inspector.inspect(self._parts, beside)
        return self._found

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        return self.findings() if self._found is None else self._found

    @property
    def mends(self) -> tuple[Mend, ...]:
        """Return a fix for each diagnostic that has one: a definite correction, or a suggested name to replace an
        unknown one."""
        return tuple(mend for one in self.diagnostics if (mend := self._mend(one)) is not None)

    def _mend(self, finding: Diagnostic) -> Mend | None:
        span = finding.span
        if finding.mend:
            return Mend(finding, span, finding.mend, True)
        meant = _MEANT.match(finding.hint)
        word = _WORD.match(self.lines[span.line - 1], span.column - 1) if span.line <= len(self.lines) else None
        if meant is None or word is None:
            return None
        typed, text = word[0], meant[1]
        if typed[0] in "#$" and text[0] not in "#$":
            text = typed[0] + text
        return Mend(finding, Span(span.line, span.column, word.end() + 1), text, False)

    @property
    def colours(self) -> Iterator[Piece]:
        """Yield the coloured pieces of the file in order, with lines counted from the start of the file."""
        for placed in self._parts:
            yield from (piece._replace(line=piece.line + placed.above) for piece in pieces(placed.part))

    def canonical(self) -> str | None:
        """Return the canonical text of the file; None if a line does not parse, or a block has no start or no end."""
        text = canonical_text(self.text)
        return text if isinstance(text, str) else None

    # --- the structure of the text ---

    def _at(self, line: int) -> Placed | None:
        """Return the part (program or section, up to its `.END`) that contains a line, or None."""
        return next((one for one in self._parts if one.above < line <= one.above + one.part.last), None)

    def _program_at(self, line: int) -> ast.Program | None:
        placed = self._at(line)
        return placed.part.node if placed is not None and isinstance(placed.part.node, ast.Program) else None

    @cached_property
    def symbols(self) -> tuple[Symbol, ...]:
        """Return the outline of the file: programs with their labels, and sections with their variables."""
        return tuple(_symbol(placed, placed.part.node) for placed in self._parts if placed.part.node is not None)

    @cached_property
    def folds(self) -> tuple[tuple[int, int], ...]:
        """Return the first and last line of each range that the editor can fold: programs, sections, and blocks."""
        return tuple(
            sorted(
                (placed.above + first, placed.above + last)
                for placed in self._parts
                if placed.part.node is not None
                for first, last in _folds(placed.part)
            )
        )

    # --- names and their positions ---

    def occurrence(self, line: int, column: int) -> Occurrence | None:
        """Return the occurrence of a name at a position (or ending there), with its span in the file; None if there is
        none."""
        if (placed := self._at(line)) is None:
            return None
        in_line = (one for one in occurrences(placed.part) if one.span.line == line - placed.above)
        there = (one for one in in_line if one.span.column <= column <= one.span.end)
        return next((structs.replace(one, span=placed.span(one.span)) for one in there), None)

    def references(self, line: int, column: int) -> tuple[Span, ...]:
        """Return the spans of all occurrences of the name at a position. A label or a private variable is searched only
        in its program, any other name in the whole file."""
        asked, here = self.occurrence(line, column), self._at(line)
        if asked is None or here is None:
            return ()
        return tuple(
            placed.span(one.span)
            for placed in self._scope(asked, here)
            for one in occurrences(placed.part)
            if one.is_same(asked)
        )

    def is_local(self, asked: Occurrence, line: int) -> bool:
        """Return whether a name in this line has a meaning only in its program: a label, a parameter or a private
        variable."""
        here = self._at(line)
        return asked.kind is SymbolKind.LABEL or (here is not None and self._own(asked, here))

    def _own(self, asked: Occurrence, placed: Placed) -> bool:
        return asked.kind is SymbolKind.VARIABLE and asked.key in locals_of(placed.part)

    def places(self, asked: Occurrence) -> tuple[Span, ...]:
        """Return the spans of all occurrences of a program or global variable in this file."""
        return tuple(
            placed.span(one.span)
            for placed in self._parts
            if not self._own(asked, placed)
            for one in occurrences(placed.part)
            if one.is_same(asked)
        )

    def origin(self, asked: Occurrence) -> Span | None:
        """Return the span where a program or global variable is defined in this file (the heading of the program, a
        line in a section, or the first assignment), or None."""
        if asked.kind is SymbolKind.PROGRAM:
            found = next((one for one in self._programs if one[1].key == asked.key), None)
            return None if found is None else found[0].span(heading_span(found[1]))
        given = (one for one in self._definitions() if one[1].key == asked.key and not self._own(asked, one[0]))
        return next((placed.span(variable.span) for placed, variable, *_ in given), None)

    def check_free(self, asked: Occurrence, new: str) -> None:
        """Check that the program or global variable `asked` can get the name `new` in this file: the name must be
        unused, and must not be read as a function. Raises UsageError."""
        wanted = structs.replace(asked, key=key_of(new))
        if wanted != asked and self.places(wanted):
            raise UsageError(f"{new} is there already", "another name")
        self._check_renamed(asked, wanted, self.places(asked), new)

    def rename(self, line: int, column: int, name: str) -> tuple[str, tuple[Span, ...]]:
        """Find what must change in this file to rename the name at a position. Return the new name as it must be
        written (with its sigil), and the spans to replace. Raises UsageError, InvalidName."""
        asked, here = self.occurrence(line, column), self._at(line)
        if asked is None or here is None:
            raise UsageError("there is nothing to rename", "programs, labels and variables have names")
        new = new_name(asked, name)
        wanted = structs.replace(asked, key=key_of(new))
        taken = (one for placed in self._scope(asked, here) for one in occurrences(placed.part))
        if wanted != asked and any(one.is_same(wanted) for one in taken):
            raise UsageError(f"{new} is there already", "another name")
        spans = self.references(line, column)
        self._check_renamed(asked, wanted, spans, new)
        return new, spans

    def _check_renamed(self, asked: Occurrence, wanted: Occurrence, spans: tuple[Span, ...], new: str) -> None:
        """Check that every replaced name would be read as a variable: HAND, for example, is a function in programs that
        do not assign it. `spans`: the replaced names. Raises UsageError."""
        if wanted.key not in ast.FUNCTION_NAMES and asked.key not in ast.FUNCTION_NAMES:
            return
        lines, wanted_places, moved = list(self.lines), set[tuple[int, int]](), 0
        for before, span in pairwise((Span(0, 1, 1), *sorted(spans, key=lambda one: (one.line, one.column)))):
            moved = moved if before.line == span.line else 0
            begin, text = span.column - 1 + moved, lines[span.line - 1]
            lines[span.line - 1] = text[:begin] + new + text[span.end - 1 + moved :]
            wanted_places.add((span.line, begin + 1))
            moved += len(new) - (span.end - span.column)
        parts = parts_of("\n".join(lines), {})
        found = (placed.span(one.span) for placed in parts for one in occurrences(placed.part) if one.is_same(wanted))
        if {(span.line, span.column) for span in found} != wanted_places:
            raise UsageError(f"{new} would be the function in some places, the variable in others", "another name")

    def _scope(self, asked: Occurrence, here: Placed) -> tuple[Placed, ...]:
        """Return the parts of the file in which a name has the same meaning as in the part `here`."""
        if asked.kind is SymbolKind.LABEL or asked.key in locals_of(here.part):
            return (here,)
        if asked.kind is SymbolKind.PROGRAM:
            return self._parts
        return tuple(placed for placed in self._parts if asked.key not in locals_of(placed.part))

    # --- completions ---

    def completions(
        self, line: int, column: int, project: Sequence[Document] = (), near: Sequence[Document] = ()
    ) -> list[Suggestion]:
        """Return suggestions for the word that is being typed at a position. `project`: the other files of the same
        name space, with which variables are shared; `near`: all other files whose programs may be called."""
        before = self.lines[line - 1][: column - 1] if line <= len(self.lines) else ""
        if (program := self._program_at(line)) is None:  # suggest headings outside of programs
            begun, note = before.strip().upper(), "a section of variables, up to .END"
            rows = ((PROGRAM, "a program, up to .END"), *((name, note) for name in SECTIONS))
            return [Suggestion(name, len(begun), note) for name, note in rows if name.startswith(begun)]
        if _GOTO.search(blank_out(before)):
            begun = before[len(before.rstrip("0123456789")) :]
            labelled = (step for step in program.steps if step.label is not None and str(step.label).startswith(begun))
            return [Suggestion(str(step.label), len(begun), _step_text(step)) for step in labelled]
        return suggestions(before, self._names(project, near), in_program=True)

    def signature(self, line: int, column: int, near: Sequence[Document] = ()) -> Signature | None:
        """Return the form of the statement, function or call that is being typed at a position; None outside of
        programs. `near`: the other files whose programs may be called."""
        if self._program_at(line) is None:
            return None
        before = self.lines[line - 1][: column - 1]
        return signature(before, ChainMap(*(dict(one.programs) for one in (self, *near))).get)

    def _names(self, project: Sequence[Document], near: Sequence[Document]) -> DefinedNames:
        variables: dict[Kind, dict[str, str]] = {kind: {} for kind in Kind}
        for document in (self, *project):
            for kind, names in document._given_names.items():
                variables[kind] = names | variables[kind]
        programs: dict[str, str] = {}
        for document in (self, *near):
            for program in document.programs.values():
                programs.setdefault(program.name, _signature(program))
        return DefinedNames(
            programs=programs,
            variables=variables.get,
            switches={row.name: row.summary for row in SWITCHES.values()},
            parameters={row.name: row.summary for row in PARAMETERS.values()},
        )

    @cached_property
    def _given_names(self) -> Mapping[Kind, dict[str, str]]:
        """Return the variables that this file assigns: by kind, then by name, the name of the section or program with
        the first assignment."""
        variables: dict[Kind, dict[str, str]] = {kind: {} for kind in Kind}
        for _, variable, kind, owner in self._definitions():
            variables[kind].setdefault(variable.sigil + variable.name, owner)
        return variables

    def _definitions(self, first: Placed | None = None) -> Iterator[tuple[Placed, ast.Variable, Kind, str]]:
        """Yield each assignment in the file as (part, variable, kind, name), where `name` is the section or program
        with the assignment. Sections come first, then the program in the part `first`, then all other programs."""
        sections = ((placed, node) for placed in self._parts if isinstance(node := placed.part.node, ast.Section))
        for placed, section in sections:
            for entry in section.entries:
                kind = SIGIL_KINDS.get(entry.variable.sigil, _SECTION_KINDS[section.name])
                yield placed, entry.variable, kind, section.name
        for placed, program in sorted(self._programs, key=lambda one: one[0] is not first):
            for statement in program.statements:
                row = INSTRUCTIONS.get(statement.word) if isinstance(statement, ast.Instruction) else None
                located = (
                    row is not None and Shape.LOCATION_VARIABLE in row.operand_shapes
                )  # True for instructions such as SET and HERE, which assign locations
                for variable in ast.definitions(statement):
                    kind = SIGIL_KINDS.get(variable.sigil) or (Kind.LOCATION if located else Kind.REAL)
                    yield placed, variable, kind, program.name

    # --- hover and definitions ---

    def hover(
        self, line: int, column: int, project: Sequence[Document] = (), near: Sequence[Document] = ()
    ) -> tuple[str, Span] | None:
        """Return help on the word at a position as Markdown, with the span of the word: the help page for a word of
        VAL-II, the definition for a name. Return None if there is nothing to show.

        `project`: the other files of the same name space; `near`: all other files whose programs may be called.
        """
        text, span = self._word(line, column) or ("", None)
        if span is None or text[0].isdigit():
            return None
        asked = self.occurrence(line, column)
        if asked is None:  # the text is a word of VAL-II, or a name in a line that does not parse
            unread = (one for placed in self._parts for one in placed.translate(placed.part.diagnostics))
            named = any(one.span.line == line for one in unread)
            own = named and (self._variable_meaning(text, line) or self.program_meaning(key_of(text)))
            found = own or _help(text)
        elif asked.kind is SymbolKind.PROGRAM:
            files = (one.program_meaning(asked.key) for one in (self, *near))
            found = next(filter(None, files), f"`{text}` is a program of no file here")
        else:
            others = () if self.is_local(asked, line) else project
            found = self._variable_meaning(text, line) or next(
                (one.place_meaning(text, asked) for one in others if one.origin(asked) is not None),
                f"`{text}` is given a value nowhere here",
            )
        return (found, span) if found else None

    def definition(self, line: int, column: int) -> Span | None:
        """Return the span where the program, label or variable at a position is defined, or None. The definition of a
        variable is a parameter, a line in a section, or the first assignment."""
        word, asked, here = self._word(line, column), self.occurrence(line, column), self._at(line)
        if word is None:
            return None
        if asked is not None and here is not None and asked.kind is SymbolKind.LABEL:
            steps = here.part.node.steps if isinstance(here.part.node, ast.Program) else ()
            labelled = (step for step in steps if str(step.label) == asked.key)
            return next((here.span(label_span(here.part, step)) for step in labelled), None)
        is_program = asked is not None and asked.kind is SymbolKind.PROGRAM
        variable = None if is_program else self._variable(word[0], line)
        headings = (placed.span(heading_span(one)) for placed, one in self._programs if one.key == key_of(word[0]))
        return variable or next(headings, None)

    def _word(self, line: int, column: int) -> tuple[str, Span] | None:
        """Return the word at a position (or ending there) and its span; None if there is no word, or if the position is
        in a string or a comment."""
        if not 1 <= line <= len(self.lines):
            return None
        words = _WORD.finditer(blank_out(self.lines[line - 1]))
        there = (found for found in words if found.start() < column <= found.end() + 1)
        return next(((found[0], Span(line, found.start() + 1, found.end() + 1)) for found in there), None)

    def _variable_meaning(self, word: str, line: int) -> str:
        if (span := self._variable(word, line)) is None:
            return ""
        shown = self.lines[span.line - 1].strip()
        return f"```val2\n{shown}\n```\n`{word}` is first given a value in line {span.line}"

    def program_meaning(self, key: str) -> str:
        """Return the heading and the comment of a program as Markdown, for a hover; "" if this file does not have the
        program. `key`: the key of the program."""
        if (program := self.programs.get(key)) is None:
            return ""
        comment = f"\n\n{program.comment.strip()}" if program.comment else ""
        return f"```val2\n.PROGRAM {_signature(program)}\n```{comment}"

    def place_meaning(self, word: str, asked: Occurrence) -> str:
        """Return the line in this file that first assigns a global variable, as Markdown for a hover. `word`: the name
        as typed."""
        span = self.origin(asked)
        shown = "" if span is None else self.lines[span.line - 1].strip()
        return f"```val2\n{shown}\n```\n`{word}` is given a value in {self.name}"

    def _variable(self, name: str, line: int) -> Span | None:
        """Return the span that defines a variable used in this line, or None: a parameter of the program, a line in a
        section, or the first assignment."""
        here, program, key = self._at(line), self._program_at(line), key_of(name)
        parameters = program.parameters if program is not None else ()
        own = ((here, parameter) for parameter in parameters if here is not None)
        given = ((placed, variable) for placed, variable, *_ in self._definitions(here))
        return next((placed.span(one.span) for placed, one in chain(own, given) if one.key == key), None)


# --- symbols -------------------------------------------------------------------------------------------------------


def _symbol(placed: Placed, node: ast.Program | ast.Section) -> Symbol:
    heading, last = placed.span(heading_span(node)), placed.above + placed.part.last
    if isinstance(node, ast.Section):
        entries = (_line(SymbolKind.VARIABLE, _entry_name(one.variable), placed.span(one.span)) for one in node.entries)
        return Symbol(node.name, SymbolKind.SECTION, heading, last, "", tuple(entries))
    labels = (
        _line(SymbolKind.LABEL, str(step.label), placed.span(label_span(placed.part, step)), _step_text(step))
        for step in node.steps
        if step.label is not None
    )
    return Symbol(node.name, SymbolKind.PROGRAM, heading, last, _signature(node), tuple(labels))


def _line(kind: SymbolKind, name: str, span: Span, detail: str = "") -> Symbol:
    return Symbol(name, kind, span, span.line, detail)


def _folds(part: Part) -> Iterator[tuple[int, int]]:
    """Yield the first and last line of each range in a part that can be folded. The line that ends a block stays
    visible."""
    if part.last > 2:
        yield 1, part.last - 1
    if isinstance(part.node, ast.Program):
        steps = part.node.steps
        for block in structure_of(part.node).blocks:
            marks = (block.opener, *block.middles, block.closer)
            # also fold a CASE as a whole; the other blocks fold only branch by branch
            whole = ((block.opener, block.closer),) if block.kind is BlockKind.CASE else ()
            lines = ((steps[a].span.line, steps[b].span.line) for a, b in (*whole, *pairwise(marks)))
            yield from ((first, after - 1) for first, after in lines if after - first > 1)


def _entry_name(variable: ast.Variable) -> str:
    indexes = ",".join(index.text for index in variable.indexes or () if isinstance(index, ast.Number))
    return f"{variable.sigil}{variable.name}" + (f"[{indexes}]" if indexes else "")


def _step_text(step: ast.Step) -> str:
    return "" if step.statement is None else printer.statement_text(step.statement)


def _signature(program: ast.Program) -> str:
    parameters = ", ".join(f"{parameter.sigil}{parameter.name}" for parameter in program.parameters)
    return f"{program.name}({parameters})"


# --- texts ---------------------------------------------------------------------------------------------------------


def new_name(asked: Occurrence, name: str) -> str:
    """Check a new name for the program, label or variable `asked`, and return it as it must be written in the file: a
    variable with its sigil, a label without leading zeros. Raises InvalidName."""
    if asked.kind is SymbolKind.LABEL:
        if not name.isascii() or not name.isdigit() or float(name) > lexer.LABEL_HIGH:
            raise InvalidName(name, f"a label is a number from 0 to {lexer.LABEL_HIGH}")
        return name.lstrip("0") or "0"
    sigil = asked.key[0] if asked.kind is SymbolKind.VARIABLE and asked.key[0] in SIGIL_KINDS else ""
    bare = name.removeprefix(sigil)
    if not _NAME.fullmatch(bare) or len(bare) > NAME_LENGTH:
        raise InvalidName(name, f"a letter, then letters, digits, . and _; at most {NAME_LENGTH} characters")
    if asked.kind is SymbolKind.VARIABLE and not sigil and bare.upper() in RESERVED:
        raise InvalidName(*why_reserved(bare.upper()))
    return sigil + bare


def _help(word: str) -> str:
    """Return what HELP shows for a word, as Markdown; "" if there is no help."""
    try:
        entries = page(word.lstrip("#$") if word[0] in "#$" else word).entries
    except UsageError:
        return ""
    return "\n\n---\n\n".join(
        f"```val2\n{entry.form}\n```\n{entry.summary} ({entry.sort})"
        + (f"\n\n{entry.note}" if entry.note else "")
        + (f"\n\nExample: `{entry.example}`" if entry.example else "")
        for entry in entries
    )
