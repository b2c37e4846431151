"""Text to syntax trees, by the one grammar of the language (grammar/val2.lark).

What cannot be read is a diagnostic, never another exception: of a line (`LineRefused`), or of a file, where every line
is read for itself and all findings come together.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable
from contextlib import suppress
from copy import copy
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, cast

from msgspec.structs import replace

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Entry, Expression, Number, ProgramHeader, Statement, Step, Variable
from vrs_cli.language.text.builder import Builder, ValBuilder, signed_number
from vrs_cli.language.text.complaints import complaint
from vrs_cli.language.text.lalr import DoesNotFit, token_parser
from vrs_cli.language.text.lexer import Lexer, Token, label_value, patterns_of
from vrs_cli.language.text.makers import foreign_file, has_program
from vrs_cli.language.text.meaning import FUNCTION_NAMES, resolve_line, variables_named_like_functions
from vrs_cli.language.text.source import FileReader, dialect_in, header_end
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
    file, found = FileReader(_parser(own) if remembered else _forgetful(own), own).read(text)
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
        self.step: Callable[[str, int], Step] = lru_cache(maxsize=REMEMBERED)(self._step)

    def _step(self, text: str, line: int) -> Step:
        """Raises LineRefused."""
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
        if isinstance(statement, ast.DoInstruction | ast.Show):
            return statement
        if row is not None and COMMANDS.get(row.name) is row:
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
            raise LineRefused(complaint(tokens, error.token, error.accepted, start)) from None


def _pop_comment(tokens: list[Token]) -> Token | None:
    return tokens.pop() if tokens and tokens[-1].type == "COMMENT" else None


def _text(comment: Token | None) -> str | None:
    return None if comment is None else comment.value[1:]


def _parser(dialect: Dialect) -> LineParser:
    return _parsers(dialect is Dialect.VPLUS)


@cache
def _forgetful(dialect: Dialect) -> LineParser:
    """A parser that remembers no steps."""
    parser = copy(_parser(dialect))
    parser.step = parser._step
    return parser


@cache
def _parsers(ours: bool) -> LineParser:
    """Whether expressions group by our order of operators, or by that of VAL-II."""
    return LineParser(None if ours else ValBuilder())


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
    variable = Variable(match["name"], match["sigil"], _index(match, line), span=Span(line, first, named))
    return Entry(
        variable, tuple(number for number in numbers if number is not None), None, span=Span(line, first, last)
    )


def _index(match: re.Match[str], line: int) -> tuple[Expression, ...] | None:
    digits = match["index"]
    if digits is None:
        return None
    return (Number(float(digits), digits, span=Span(line, match.start("index") + 1, match.end("index") + 1)),)


@cache
def _numbers() -> re.Pattern[str]:
    return re.compile(rf"[ \t]*{_NUMBER}(?:(?:[ \t]+|[ \t]*,[ \t]*){_NUMBER})*[ \t]*")


@cache
def _usual() -> re.Pattern[str]:
    return re.compile(_USUAL)
