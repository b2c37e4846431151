"""A program file as an editor sees it: what is where, what may come next, what a word means. Pure: text in, values out.

Lines and columns count from 1, as everywhere in the language (`Span`); the server turns them into those of the editor.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property

from vrs_cli.engine.parameters import PARAMETERS, SWITCHES
from vrs_cli.errors import UsageError
from vrs_cli.interfaces.help import page
from vrs_cli.interfaces.inspection import inspect
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language import ast
from vrs_cli.language.analyzer import DEFINING, argument_at
from vrs_cli.language.ast import NAME_LENGTH, Kind, Program, Section, Span, Statement
from vrs_cli.language.diagnostics import Diagnostic, Severity
from vrs_cli.language.instructions import INSTRUCTIONS
from vrs_cli.language.parser import parse_file
from vrs_cli.language.printer import print_file, statement_text
from vrs_cli.language.source import END, PROGRAM, SECTIONS, lines_of
from vrs_cli.language.words import Shape
from vrs_cli.repl.complete import Names, Suggestion, suggestions

_WORD = re.compile(r"[#$]?[A-Za-z][\w.]*|\d+")
_GOTO = re.compile(r"\bGOTO\s+\d*$", re.IGNORECASE)
_LABEL = re.compile(r"\s*(\d+)(?![\w.])")
_QUOTED_OR_COMMENT = re.compile(r'"[^"]*"?|;.*')
_KINDS = {"#": Kind.PRECISION, "$": Kind.STRING}
_SECTION_KINDS = {".LOCATIONS": Kind.LOCATION, ".REALS": Kind.REAL, ".STRINGS": Kind.STRING}


class SymbolKind(Enum):
    PROGRAM = "program"
    SECTION = "section"
    LABEL = "label"
    VARIABLE = "variable"


@dataclass(frozen=True, slots=True)
class Symbol:
    """`span`: its name; it reaches from the line of its name to `last`."""

    name: str
    kind: SymbolKind
    span: Span
    last: int
    detail: str = ""
    children: tuple[Symbol, ...] = field(default=())


@dataclass(frozen=True, slots=True)
class Meaning:
    """What stands under the cursor, explained, as Markdown."""

    text: str
    span: Span


@dataclass(frozen=True)
class _Part:
    """A program or a section with the lines from its heading to its `.END`."""

    node: Program | Section
    first: int
    last: int


class Document:
    """A text, read once. `model`: the robot whose reach is checked."""

    def __init__(self, text: str, model: RobotModel) -> None:
        self.text = text
        self._model = model
        self._source = lines_of(text)
        self.lines = [line.text for line in self._source]

    # --- what is wrong ---

    @cached_property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """What `vrs check` finds."""
        return inspect(self.text, self._model)

    def formatted(self) -> str | None:
        """The canonical text; None where lines cannot be read: nothing of them may be lost."""
        file, found = self._read
        return None if any(one.severity is Severity.ERROR for one in found) else print_file(file)

    # --- what is where ---

    @cached_property
    def _read(self) -> tuple[ast.File, tuple[Diagnostic, ...]]:
        return parse_file(self.text)

    @cached_property
    def _parts(self) -> tuple[_Part, ...]:
        nodes = [part for part in self._read[0].parts if isinstance(part, Program | Section)]
        return tuple(_Part(node, node.span.line, self._last_line(node.span.line)) for node in nodes)

    def _last_line(self, first: int) -> int:
        """The `.END` of a part; the line before the next heading, or the last one, where that is missing."""
        for index in range(first, len(self._source)):
            directive = self._source[index].directive
            if directive == END:
                return index + 1
            if directive == PROGRAM or directive in SECTIONS:
                return index
        return len(self._source)

    def _programs(self) -> Iterator[Program]:
        return (part.node for part in self._parts if isinstance(part.node, Program))

    def _sections(self) -> Iterator[Section]:
        return (part.node for part in self._parts if isinstance(part.node, Section))

    def _program_at(self, line: int) -> Program | None:
        nodes = (part.node for part in self._parts if part.first <= line <= part.last)
        return next((node for node in nodes if isinstance(node, Program)), None)

    @cached_property
    def symbols(self) -> tuple[Symbol, ...]:
        """Programs with their labels, sections with their variables."""
        return tuple(_symbol(part, self.lines) for part in self._parts)

    # --- what could come next ---

    def completions(self, line: int, column: int) -> list[Suggestion]:
        """What may be typed at a place."""
        before = self.lines[line - 1][: column - 1] if line <= len(self.lines) else ""
        program = self._program_at(line)
        if program is None:
            return _headings(before)
        if _GOTO.search(_blanked(before)):
            return list(_labels(program, before))
        return suggestions(before, self._names, in_program=True)

    @cached_property
    def _names(self) -> Names:
        variables: dict[Kind, dict[str, str]] = {kind: {} for kind in Kind}
        for kind, name, note in self._defined():
            variables[kind].setdefault(name, note)
        return Names(
            programs={program.name: _signature(program) for program in self._programs()},
            variables=variables,
            switches={row.name: row.summary for row in SWITCHES.values()},
            parameters={row.name: row.summary for row in PARAMETERS.values()},
        )

    def _defined(self) -> Iterator[tuple[Kind, str, str]]:
        """Every name that the file gives a value, with its kind and where."""
        for section in self._sections():
            for entry in section.entries:
                kind = _KINDS.get(entry.variable.sigil, _SECTION_KINDS[section.name])
                yield kind, entry.variable.sigil + entry.variable.name, section.name
        for program in self._programs():
            for variable, statement in _definitions(program):
                kind = _KINDS.get(variable.sigil) or _bare_kind(statement)
                yield kind, variable.sigil + variable.name, program.name

    # --- what a word means, and where it comes from ---

    def hover(self, line: int, column: int) -> Meaning | None:
        """Help on a word of the language, or what a name of the file is."""
        word = self._word(line, column)
        if word is None:
            return None
        text, span = word
        if not text[0].isdigit():
            found = self._own_meaning(text, line) or _help(text)
            return Meaning(found, span) if found else None
        return None

    def definition(self, line: int, column: int) -> Span | None:
        """Where a program, a label or a variable is defined: a section first, then its first assignment."""
        word = self._word(line, column)
        if word is None:
            return None
        text, _ = word
        if text[0].isdigit():
            return self._label(text, line, column)
        if self._is_called(line, column):
            program = self._program_named(text)
            return None if program is None else self._heading(program)
        return self._variable(text, line) or self._called(text)

    def _word(self, line: int, column: int) -> tuple[str, Span] | None:
        """The word at or right before a place, outside texts and comments."""
        if not 1 <= line <= len(self.lines):
            return None
        for found in _WORD.finditer(_blanked(self.lines[line - 1])):
            if found.start() < column <= found.end() + 1:
                return found[0], Span(line, found.start() + 1, found.end() + 1)
        return None

    def _own_meaning(self, word: str, line: int) -> str:
        span = self._variable(word, line)
        if span is not None:
            shown = self.lines[span.line - 1].strip()
            return f"```val2\n{shown}\n```\n`{word}` is first given a value in line {span.line}"
        program = self._program_named(word)
        if program is None:
            return ""
        comment = f"\n\n{program.comment.strip()}" if program.comment else ""
        return f"```val2\n.PROGRAM {_signature(program)}\n```{comment}"

    def _program_named(self, name: str) -> Program | None:
        key = name.lower()[:NAME_LENGTH]
        return next((program for program in self._programs() if program.key == key), None)

    def _called(self, name: str) -> Span | None:
        program = self._program_named(name)
        return None if program is None else self._heading(program)

    def _heading(self, program: Program) -> Span:
        return _name_span(program.span.line, program.name, self.lines)

    def _is_called(self, line: int, column: int) -> bool:
        """Whether a place is on the program that an instruction names."""
        statement = self._statement(line)
        row = INSTRUCTIONS.get(statement.word) if isinstance(statement, ast.Instruction) else None
        if row is None or not isinstance(statement, ast.Instruction):
            return False
        pairs = zip(row.arguments, statement.arguments, strict=False)
        programs = (given for argument, given in pairs if argument.shape is Shape.PROGRAM and given is not None)
        return any(
            given.span.column <= column <= given.span.column + len(getattr(given, "name", "")) for given in programs
        )

    def _statement(self, line: int) -> Statement | None:
        program = self._program_at(line)
        steps = program.steps if program is not None else ()
        return next((step.statement for step in steps if step.span.line == line), None)

    def _label(self, text: str, line: int, column: int) -> Span | None:
        """The step of the label that a GOTO names."""
        program = self._program_at(line)
        if program is None or not _GOTO.search(_blanked(self.lines[line - 1])[: column - 1].rstrip("0123456789") + " "):
            return None
        number = int(text)
        return next((_label_span(step, self.lines) for step in program.steps if step.label == number), None)

    def _variable(self, name: str, line: int) -> Span | None:
        """A parameter of the program round the place; a section's entry; the first assignment here, then elsewhere."""
        sigil = name[0] if name[0] in _KINDS else ""
        key = sigil + name[len(sigil) :].lower()[:NAME_LENGTH]
        here = self._program_at(line)
        if here is not None:
            for parameter in here.parameters:
                if parameter.key == key:
                    return parameter.span
        for section in self._sections():
            for entry in section.entries:
                if entry.variable.key == key:
                    return entry.variable.span
        programs = sorted(self._programs(), key=lambda program: program is not here)
        found = (variable.span for program in programs for variable, _ in _definitions(program) if variable.key == key)
        return next(found, None)


# --- symbols -------------------------------------------------------------------------------------------------------


def _symbol(part: _Part, lines: Sequence[str]) -> Symbol:
    node = part.node
    if isinstance(node, Section):
        entries = tuple(
            Symbol(_entry_name(entry.variable), SymbolKind.VARIABLE, entry.span, entry.span.line)
            for entry in node.entries
        )
        return Symbol(node.name, SymbolKind.SECTION, _name_span(part.first, node.name, lines), part.last, "", entries)
    labels = tuple(
        Symbol(str(step.label), SymbolKind.LABEL, _label_span(step, lines), step.span.line, _step_text(step))
        for step in node.steps
        if step.label is not None
    )
    span = _name_span(part.first, node.name, lines)
    return Symbol(node.name, SymbolKind.PROGRAM, span, part.last, _signature(node), labels)


def _entry_name(variable: ast.Variable) -> str:
    indexes = ",".join(index.text for index in variable.indexes or () if isinstance(index, ast.Number))
    return f"{variable.sigil}{variable.name}" + (f"[{indexes}]" if indexes else "")


def _step_text(step: ast.Step) -> str:
    return "" if step.statement is None else statement_text(step.statement)


def _name_span(line: int, name: str, lines: Sequence[str]) -> Span:
    """A name in its heading; the search begins behind the directive unless that is the name."""
    text = lines[line - 1]
    after = 0 if name.startswith(".") else len(PROGRAM) + text.upper().find(PROGRAM)
    at = max(text.lower().find(name.lower(), after), 0)
    return Span(line, at + 1, at + 1 + len(name))


def _label_span(step: ast.Step, lines: Sequence[str]) -> Span:
    text = lines[step.span.line - 1]
    spans = [found.span() for found in re.finditer(r"\d+", text) if int(found[0]) == step.label]
    start, end = spans[0] if spans else (0, 1)
    return Span(step.span.line, start + 1, end + 1)


def _signature(program: Program) -> str:
    parameters = ", ".join(f"{parameter.sigil}{parameter.name}" for parameter in program.parameters)
    return f"{program.name}({parameters})"


# --- definitions ---------------------------------------------------------------------------------------------------


def _definitions(program: Program) -> Iterator[tuple[ast.Variable, Statement]]:
    """Every variable that a program gives a value to, in the order of its steps."""
    for step in program.steps:
        statement = step.statement
        if isinstance(statement, ast.Assignment):
            yield statement.target, statement
        elif isinstance(statement, ast.For):
            yield statement.variable, statement
        elif isinstance(statement, ast.Instruction):
            yield from ((variable, statement) for variable in _defined_by(statement))


def _defined_by(statement: ast.Instruction) -> Iterator[ast.Variable]:
    row = INSTRUCTIONS.get(statement.word)
    for place, given in enumerate(statement.arguments):
        argument = argument_at(row, place) if row is not None else None
        if argument is not None and argument.shape in DEFINING:
            last = given.right if isinstance(given, ast.Binary) else given  # HERE a:b defines b
            if isinstance(last, ast.Variable):
                yield last


def _bare_kind(statement: Statement) -> Kind:
    """What a name without a sigil becomes: a transformation by SET, HERE and their like, else a real."""
    row = INSTRUCTIONS.get(statement.word) if isinstance(statement, ast.Instruction) else None
    shapes = {argument.shape for argument in row.arguments} if row is not None else set()
    return Kind.LOCATION if Shape.LOCATION_VARIABLE in shapes else Kind.REAL


# --- texts ---------------------------------------------------------------------------------------------------------


def _blanked(line: str) -> str:
    """The line with blanks for texts and comments, every column where it was."""
    return _QUOTED_OR_COMMENT.sub(lambda found: " " * len(found[0]), line)


def _labels(program: Program, before: str) -> Iterator[Suggestion]:
    typed = re.search(r"\d*$", before)
    begun = typed[0] if typed else ""
    for step in program.steps:
        if step.label is not None and str(step.label).startswith(begun):
            yield Suggestion(str(step.label), len(begun), _step_text(step))


def _headings(before: str) -> list[Suggestion]:
    """What may stand outside programs."""
    begun = before.strip().upper()
    rows = ((PROGRAM, "a program, up to .END"), *((name, "a section of variables, up to .END") for name in SECTIONS))
    return [Suggestion(name, len(begun), note) for name, note in rows if name.startswith(begun)]


def _help(word: str) -> str:
    """The page of HELP on a word, as Markdown."""
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
