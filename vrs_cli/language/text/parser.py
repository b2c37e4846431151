"""Text to syntax trees, by the one grammar of the language (grammar/val2.lark). The only module that imports lark.

What cannot be read is a diagnostic, never another exception: of a line (`LineRefused`), or of a file, where every line
is read for itself and all findings come together.
"""

from __future__ import annotations

import os
import re
from collections.abc import Container, Iterable, Iterator
from contextlib import suppress
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any, cast

from lark import Lark, UnexpectedToken
from lark.lexer import Lexer as LarkLexer
from msgspec.structs import replace

from vrs_cli.errors import InvalidName
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import ProgramHeader, Span, Statement, Step
from vrs_cli.language.text.builder import Builder
from vrs_cli.language.text.complaints import complaint
from vrs_cli.language.text.diagnostics import Diagnostic, LineRefused, error
from vrs_cli.language.text.entries import usual_entry
from vrs_cli.language.text.lexer import Lexer, Token
from vrs_cli.language.text.meaning import FUNCTION_NAMES, resolve_line, variables_named_like_functions
from vrs_cli.language.text.source import FileReader, header_end
from vrs_cli.language.words.monitor import COMMANDS

GRAMMAR = "val2.lark"
STARTS = ("step", "prompt", "header", "entry")


def parse_file(text: str) -> tuple[ast.File, tuple[Diagnostic, ...]]:
    """The programs and sections of a file, and everything that cannot be read in it.

    A bad line of a program is kept as BadLine. Line ends may be LF, CR LF or CR.
    """
    return FileReader(_parser()).read(text)


def parse_part(text: str) -> tuple[ast.File, tuple[Diagnostic, ...]]:
    """As `parse_file`, for the versions of a text that is being changed: lines that were read before at the same place
    are not read again.
    """
    return FileReader(_remembering()).read(text)


def parse_step(text: str, line: int = 1) -> Step:
    """A program line: label, statement and comment, each or none. Raises LineRefused."""
    return _parser().step(text, line)


def parse_prompt(text: str, names: Container[str] = ()) -> Statement | ProgramHeader | None:
    """A line of the prompt; None for a blank or a comment. `names`: the keys of what has a value. Raises LineRefused.

    A monitor command is an Instruction, an expression alone is Show, everything else that can be done a DoInstruction.
    """
    at = header_end(text)
    return _parser().prompt(text, names) if at is None else _parser().header(text, 1, at)


def variables_in(lines: Iterable[str]) -> set[str]:
    """The keys of the variables that bear the name of a function, in lines of a program, its heading among them."""
    parameters: list[ast.Variable] = []
    statements: list[Statement | None] = []
    for line in lines:
        if _NAME_OF_FUNCTION.search(line):
            with suppress(LineRefused):
                header = parse_prompt(line) if header_end(line) is not None else None
                parameters += header.parameters if isinstance(header, ProgramHeader) else ()
                statements.append(parse_step(line).statement)
    return variables_named_like_functions(parameters, statements)


_NAME_OF_FUNCTION = re.compile("|".join(map(re.escape, FUNCTION_NAMES)), re.IGNORECASE)


def grammar_dir() -> Path:
    """The folder of the grammar: that of a checkout, else the one that travels in the package."""
    package = Path(__file__).resolve().parents[2]
    checkout = package.parent / "grammar"
    return checkout if (checkout / GRAMMAR).is_file() else package / "grammar"


class LineParser:
    """The grammar, ready to parse lines."""

    def __init__(self) -> None:
        grammar = (grammar_dir() / GRAMMAR).read_text(encoding="utf-8")
        self._lark = Lark(
            grammar,
            start=list(STARTS),
            parser="lalr",
            lexer=_Ready,
            transformer=Builder(),
            keep_all_tokens=True,
            maybe_placeholders=False,
            cache=_cache_file(),
        )
        terminals = {terminal.name: terminal.pattern.to_regexp() for terminal in self._lark.terminals}
        self._lexer = Lexer(terminals)

    def step(self, text: str, line: int) -> Step:
        """Raises LineRefused."""
        tokens = self._lexer.step(text, line)
        label = tokens.pop(0) if tokens and tokens[0].type == "LABEL" else None
        comment = _pop_comment(tokens)
        statement: Statement | None = self._parse(tokens, "step") if tokens else None
        spans = [part.span for part in (label, statement, comment) if part is not None]
        span = Span(line, spans[0].column, spans[-1].end) if spans else Span(line, 1, 1)
        return Step(int(label.text) if label else None, statement, _text(comment), span)

    def prompt(self, text: str, names: Container[str]) -> Statement | None:
        """Raises LineRefused."""
        tokens = self._lexer.prompt(text, names)
        _pop_comment(tokens)
        if not tokens:
            return None
        row = tokens[0].row
        statement: Statement = resolve_line(self._parse(tokens, "prompt"), names)
        if isinstance(statement, ast.DoInstruction | ast.Show):
            return statement
        if row is not None and COMMANDS.get(row.name) is row:
            return statement
        return ast.DoInstruction(statement, statement.span)

    def header(self, text: str, line: int, at: int) -> ProgramHeader:
        """`at`: the index after `.PROGRAM`. Raises LineRefused."""
        tokens = self._lexer.header(text, line, at)
        if not tokens or tokens[0].type != "PROGRAM":
            span = Span(line, at + 1, at + 2)
            raise LineRefused(error(InvalidName, span, "a program name is missing", ".PROGRAM pick.place(part)"))
        comment = _pop_comment(tokens)
        header: ProgramHeader = self._parse(tokens, "header")
        if comment is None:
            return header
        return replace(header, comment=_text(comment), span=Span(line, header.span.column, comment.end))

    def entry(self, text: str, line: int) -> ast.Entry | str | None:
        """A variable with its value, the text of a comment line, or None for a blank one. Raises LineRefused."""
        usual = usual_entry(text, line)
        if usual is not None:
            return usual
        tokens = self._lexer.entry(text, line)
        comment = _text(_pop_comment(tokens))
        if not tokens:
            return comment
        return replace(cast(ast.Entry, self._parse(tokens, "entry")), comment=comment)

    def _parse(self, tokens: list[Token], start: str) -> Any:
        try:
            return self._lark.parse(cast(str, tokens), start=start)
        except UnexpectedToken as unexpected:
            token = unexpected.token if unexpected.token.type != "$END" else None
            raise LineRefused(complaint(tokens, cast("Token | None", token), start)) from None


def _pop_comment(tokens: list[Token]) -> Token | None:
    return tokens.pop() if tokens and tokens[-1].type == "COMMENT" else None


def _text(comment: Token | None) -> str | None:
    return None if comment is None else comment.value[1:]


class _Remembering:
    """A parser that remembers the steps it has read, and what was wrong with them."""

    def __init__(self, parser: LineParser) -> None:
        self.header, self.entry = parser.header, parser.entry
        self._read = lru_cache(maxsize=50_000)(partial(_step_or_refusal, parser))

    def step(self, text: str, line: int) -> Step:
        """Raises LineRefused."""
        read = self._read(text, line)
        if isinstance(read, LineRefused):
            raise read
        return read


def _step_or_refusal(parser: LineParser, text: str, line: int) -> Step | LineRefused:
    try:
        return parser.step(text, line)
    except LineRefused as refused:
        return LineRefused(refused.diagnostic)


@cache
def _parser() -> LineParser:
    return LineParser()


@cache
def _remembering() -> _Remembering:
    return _Remembering(_parser())


class _Ready(LarkLexer):
    """Hands over the tokens that `Lexer` has found."""

    def __init__(self, _configuration: object) -> None:
        pass

    def lex(self, tokens: Any) -> Iterator[Any]:  # type: ignore[override]
        return iter(tokens)


def _cache_file() -> str | bool:
    """Where the parser's tables are kept between runs: a folder of the user's own, or nowhere."""
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    folder = Path(base) / "vrs" if base else Path.home() / ".cache" / "vrs"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return False
    return str(folder / "grammar.cache") if os.access(folder, os.W_OK) else False
