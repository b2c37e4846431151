"""Text to syntax trees, by the one grammar of the language (grammar/val2.lark): lines, files, and the parts of a file.

What cannot be read is a diagnostic, never another exception: of a line (`LineRefused`), or of a file, where every line
is read for itself and all findings come together.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache, cached_property, lru_cache
from pathlib import Path
from typing import Any, cast

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import (
    Entry,
    Expression,
    File,
    Number,
    Program,
    ProgramHeader,
    Section,
    Statement,
    Step,
    Variable,
)
from vrs_cli.language.text.builder import Builder, ValBuilder, signed_number
from vrs_cli.language.text.complaints import Complaint
from vrs_cli.language.text.lalr import DoesNotFit, token_parser
from vrs_cli.language.text.lexer import Lexer, Token, label_value, patterns_of
from vrs_cli.language.text.meaning import FUNCTION_NAMES, resolve_line, variables_named_like_functions
from vrs_cli.language.text.source import (
    FileReader,
    cut,
    dialect_in,
    end_of,
    foreign_file,
    has_program,
    header_end,
    lines_of,
)
from vrs_cli.language.words.instructions import OPERATOR_WORDS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.values.diagnostics import Diagnostic, LineRefused, Span
from vrs_cli.values.dialect import Dialect

GRAMMAR = "val2.lark"
REMEMBERED = 20_000  # steps, about 3 kB each: a text that is being changed is read again and again
STARTS = ("step", "prompt", "header", "entry")


def parse_file(
    text: str, dialect: Dialect = Dialect.VPLUS, *, whole: bool = True, remembered: bool = True
) -> tuple[ast.File, tuple[Diagnostic, ...]]:
    """The programs and sections of a file, and everything that cannot be read in it.

    A bad line of a program is kept as BadLine. Line ends may be LF, CR LF or CR. `dialect`: where the file says none.
    Where it is a `whole` file, one in another maker's language is told of as such, and not read if it has no program.
    `remembered`: its steps stay in memory for the next time, as for a text that is being changed.
    """
    foreign = foreign_file(text) if whole else None
    if foreign is not None and not has_program(text):
        return ast.File(()), (foreign,)
    own, wrong = dialect_in(text, dialect)
    file, found = FileReader(_parser(own), own, remembered=remembered).read(text)
    told = () if foreign is None else (foreign,)
    return file, (*told, *wrong, *found)


def parse_step(text: str, line: int = 1, dialect: Dialect = Dialect.VPLUS) -> Step:
    """A program line: label, statement and comment, each or none. Raises LineRefused."""
    return _parser(dialect).step(text, line)


def parse_prompt(
    text: str, names: Container[str] = (), dialect: Dialect = Dialect.VPLUS
) -> Statement | ProgramHeader | None:
    """A line of the prompt; None for a blank or a comment. `names`: the keys of what has a value. Raises LineRefused.

    A monitor command is an Instruction, an expression alone is Show, everything else that can be done a DoInstruction.
    """
    at, parser = header_end(text), _parser(dialect)
    return parser.prompt(text, names) if at is None else parser.header(text, 1, at)


def variables_in(lines: Iterable[str]) -> set[str]:
    """The keys of the variables that bear the name of a function, in lines of a program, its heading among them."""
    parameters: list[ast.Variable] = []
    statements: list[Statement | None] = []
    for line in lines:
        if re.search(_NAME_OF_FUNCTION, line):
            with suppress(LineRefused):
                header = parse_prompt(line) if header_end(line) is not None else None
                parameters += header.parameters if isinstance(header, ProgramHeader) else ()
                statements.append(parse_step(line).statement)
    return variables_named_like_functions(parameters, statements)


_NAME_OF_FUNCTION = "(?i)" + "|".join(map(re.escape, FUNCTION_NAMES))


def grammar_dir() -> Path:
    """The folder of the grammar: that of a checkout, else the one that travels in the package."""
    package = Path(__file__).resolve().parents[2]
    checkout = package.parent / "grammar"
    return checkout if (checkout / GRAMMAR).is_file() else package / "grammar"


class LineParser:
    """The grammar, ready to parse lines. `builder`: makes their trees; without one, by our order of operators."""

    def __init__(self, builder: Builder | None = None) -> None:
        grammar = (grammar_dir() / GRAMMAR).read_text(encoding="utf-8")
        self._parser = token_parser(grammar, STARTS, builder or Builder())
        self._patterns = patterns_of(self._parser.terminals)
        self.step: Callable[[str, int], Step] = lru_cache(maxsize=REMEMBERED)(self.new_step)

    def new_step(self, text: str, line: int) -> Step:
        """Read a step, and do not remember it. Raises LineRefused."""
        tokens = Lexer(self._patterns, text, line).step()
        label = tokens.pop(0) if tokens and tokens[0].type == "LABEL" else None
        comment = _pop_comment(tokens)
        statement: Statement | None = self._parse(tokens, "step") if tokens else None
        spans = [part.span for part in (label, statement, comment) if part is not None]
        span = Span(line, spans[0].column, spans[-1].end) if spans else Span(line, 1, 1)
        return Step(label_value(label.text, label.span) if label else None, statement, _text(comment), span=span)

    def prompt(self, text: str, names: Container[str]) -> Statement | None:
        """Raises LineRefused."""
        tokens = Lexer(self._patterns, text, 1).prompt(names)
        _pop_comment(tokens)
        if not tokens:
            return None
        row = tokens[0].row
        statement: Statement = resolve_line(self._parse(tokens, "prompt"), names)
        is_command = row is not None and COMMANDS.get(row.name) is row
        if is_command or isinstance(statement, ast.DoInstruction | ast.Show):
            return statement
        return ast.DoInstruction(statement, span=statement.span)

    def header(self, text: str, line: int, at: int) -> ProgramHeader:
        """`at`: the index after `.PROGRAM`. Raises LineRefused."""
        tokens = Lexer(self._patterns, text, line, at).header()
        comment = _pop_comment(tokens)
        header: ProgramHeader = self._parse(tokens, "header")
        if comment is None:
            return header
        return replace(header, comment=_text(comment), span=Span(line, header.span.column, comment.span.end))

    def entry(self, text: str, line: int) -> ast.Entry | str | None:
        """A variable with its value, the text of a comment line, or None for a blank one. Raises LineRefused."""
        usual = usual_entry(text, line)
        if usual is not None:
            return usual
        tokens = Lexer(self._patterns, text, line).entry()
        comment = _text(_pop_comment(tokens))
        if not tokens:
            return comment
        return replace(cast(ast.Entry, self._parse(tokens, "entry")), comment=comment)

    def numbers(self, text: str) -> tuple[tuple[float, ...], str | None] | None:
        """Numbers alone, and the text of a comment behind them. None for another line."""
        line, semicolon, comment = text.partition(";")
        if _numbers().fullmatch(line) is None:
            return None
        found = [signed_number(number) for number in line.replace(",", " ").split()]
        numbers = tuple(number for number in found if number is not None)
        return (numbers, comment if semicolon else None) if len(numbers) == len(found) else None

    def _parse(self, tokens: list[Token], start: str) -> Any:
        """The tree of a line. Raises LineRefused."""
        try:
            return self._parser.parse(tokens, start)
        except DoesNotFit as error:
            raise LineRefused(Complaint(tokens, error.token, error.accepted, start).diagnostic()) from None


def _pop_comment(tokens: list[Token]) -> Token | None:
    return tokens.pop() if tokens and tokens[-1].type == "COMMENT" else None


def _text(comment: Token | None) -> str | None:
    return None if comment is None else comment.value[1:]


@cache
def _parser(dialect: Dialect) -> LineParser:
    """A parser by our order of operators for V+, by that of VAL-II for VAL-II and VAL."""
    return LineParser() if dialect is Dialect.VPLUS else _val_parser()


@cache
def _val_parser() -> LineParser:
    return LineParser(ValBuilder())


# --- usual lines of a section of variables -------------------------------------------------------------------


_NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[Ee][-+]?[0-9]+)?(?![^ \t,])"
_USUAL = (
    rf"[ \t]*(?P<sigil>#?)(?P<name>[A-Za-z][A-Za-z0-9._]*)(?:\[(?P<index>[0-9]{{1,9}})\])?"
    rf"[ \t]+(?P<numbers>{_NUMBER}(?:[ \t]+{_NUMBER})*)[ \t]*"
)


def usual_entry(text: str, line: int) -> Entry | None:
    """Read a usual line. Return None if the grammar has to read it."""
    match = _usual().fullmatch(text)
    if match is None or match["name"].upper() in OPERATOR_WORDS:
        return None
    numbers = [signed_number(number) for number in match["numbers"].split()]
    if None in numbers:
        return None
    first, last = match.start("sigil") + 1, match.end("numbers") + 1
    named = match.end("name") + 1 if match["index"] is None else match.end("index") + 2
    index: tuple[Expression, ...] | None = None
    if (digits := match["index"]) is not None:
        place = Span(line, match.start("index") + 1, match.end("index") + 1)
        index = (Number(float(digits), digits, span=place),)
    variable = Variable(match["name"], match["sigil"], index, span=Span(line, first, named))
    return Entry(
        variable, tuple(number for number in numbers if number is not None), None, span=Span(line, first, last)
    )


@cache
def _numbers() -> re.Pattern[str]:
    return re.compile(rf"[ \t]*{_NUMBER}(?:(?:[ \t]+|[ \t]*,[ \t]*){_NUMBER})*[ \t]*")


@cache
def _usual() -> re.Pattern[str]:
    return re.compile(_USUAL)


# --- the parts of a file -----------------------------------------------------------------------------------------


class Part(Struct, frozen=True, eq=False, dict=True):
    """A program or a section with all lines up to the next heading; or the lines before the first heading.

    An editor changes one line, so few parts of a file: a part is read once. Its lines count from 1, so that a part
    stays what it is when lines come or go above it. `last`: its `.END`, or the last line where that is missing.
    """

    lines: tuple[str, ...]
    last: int
    dialect: Dialect

    @cached_property
    def _read(self) -> tuple[File, tuple[Diagnostic, ...]]:
        return parse_file("\n".join(self.lines), self.dialect, whole=False)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The lines that cannot be read."""
        return self._read[1]

    @cached_property
    def node(self) -> Program | Section | None:
        """None where there is no heading, or one that cannot be read."""
        return next((part for part in self._read[0].parts if isinstance(part, Program | Section)), None)


class Placed(Struct, frozen=True):
    """A part in a file, below so many lines (`above`)."""

    part: Part
    above: int

    def span(self, span: Span) -> Span:
        """Translate a span of the part into one of the file."""
        return Span(span.line + self.above, span.column, span.end)

    def found(self, diagnostics: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
        """Translate findings in the part into findings in the file."""
        return (replace(one, span=self.span(one.span)) for one in diagnostics)


Known = Mapping[tuple[str, ...], Part]


def parts_of(text: str, known: Known, dialect: Dialect = Dialect.VPLUS) -> tuple[Placed, ...]:
    """Cut a file into its parts. Parts that are `known` by their lines are taken from there. `dialect`: where the file
    says none.
    """
    placed, above = list[Placed](), 0
    own, _ = dialect_in(text, dialect)
    for lines in cut(lines_of(text)):
        texts, end = tuple(line.text for line in lines), end_of(lines)
        part = known.get(texts)
        if part is None or part.dialect is not own:
            part = Part(texts, len(lines) if end is None else end + 1, own)
        placed.append(Placed(part, above))
        above += len(lines)
    return tuple(placed)


def programs_of(parts: Iterable[Placed]) -> Iterator[tuple[Placed, Program]]:
    """The programs with their places."""
    return ((placed, placed.part.node) for placed in parts if isinstance(placed.part.node, Program))
