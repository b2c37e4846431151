"""Test that the parse table is cached whole or made anew, and that our parser and Lark's public one agree on every
line.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from random import Random
from typing import Any

import pytest

from tests.examples import some
from tests.fuzz.lines import line as random_line
from vrs_cli.language.text import line_parser
from vrs_cli.language.text.builder import Builder, ValBuilder
from vrs_cli.language.text.lexer import Lexer, Token
from vrs_cli.language.text.line_parser import STARTS as VAL_STARTS
from vrs_cli.language.text.line_parser import (
    DoesNotFit,
    LarkParser,
    LineParser,
    Table,
    TableParser,
    grammar_text,
    table_of,
    token_parser,
)
from vrs_cli.values.diagnostics import LineRefused

GRAMMAR = """
%declare A B
list: A (B A)*
?one: list
"""
STARTS = ("list", "one")


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "vrs" / "grammar.table"


def test_what_is_kept_is_what_was_made(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = table_of(GRAMMAR, STARTS)
    assert [path.name for path in kept.parent.iterdir()] == [kept.name]
    monkeypatch.setattr(line_parser, "_table", lambda *_: pytest.fail("it is kept"))
    again = table_of(GRAMMAR, STARTS)
    assert again == made
    assert isinstance(again, Table)
    assert {rule.alone for rule in again.rules if rule.name == "one"} == {True}
    assert any(any(rule.helpers) for rule in again.rules if rule.name == "list")


@pytest.mark.parametrize("spoil", [lambda data: data[:0], lambda data: data[:-9], bytes.upper])
def test_a_table_that_is_broken_is_made_anew(kept: Path, spoil: object) -> None:
    made = table_of(GRAMMAR, STARTS)
    whole = kept.read_bytes()
    kept.write_bytes(spoil(whole))  # type: ignore[operator]
    again = table_of(GRAMMAR, STARTS)
    assert made is not None
    assert again is not None
    assert again.rules == made.rules
    assert len(kept.read_bytes()) == len(whole)


def test_a_table_of_another_grammar_is_not_taken(kept: Path) -> None:
    first = table_of(GRAMMAR, STARTS)
    assert kept.exists()
    assert table_of(GRAMMAR.replace("(B A)*", "(B A)?"), STARTS) != first


def spoilt(table: Table, how: str) -> Table:
    """Return a table in a form that another release of Lark might have."""
    if how == "a missing state":
        return table._replace(states=dict(list(table.states.items())[:-1]))
    if how == "no rule":
        return table._replace(rules=[])
    if how == "no end":
        return table._replace(ends={})
    return table._replace(states={state: {s: str(to) for s, to in row.items()} for state, row in table.states.items()})  # type: ignore[misc]


@pytest.mark.parametrize("how", ["a missing state", "no rule", "no end", "other entries"])
def test_another_form_of_table_is_not_followed(how: str, kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = line_parser._table
    monkeypatch.setattr(line_parser, "_table", lambda lark: spoilt(made(lark), how))
    assert table_of(GRAMMAR, STARTS) is None
    assert isinstance(token_parser(GRAMMAR, STARTS, Builder()), LarkParser)
    assert not kept.exists()


@pytest.mark.parametrize("error", [AttributeError, KeyError, TypeError, ValueError])
def test_a_lark_without_its_table_is_used_in_public(
    error: type[Exception], kept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def hidden(_lark: object) -> Table:
        raise error("_parse_table")

    monkeypatch.setattr(line_parser, "_table", hidden)
    assert LineParser().step("10 MOVE a  ; go", 1) == PARSERS[Builder][0].step("10 MOVE a  ; go", 1)
    assert not kept.exists()


# --- both parsers on the lines of the language ---------------------------------------------------------------------

ROOT = Path(__file__).parents[3]
VAL2 = grammar_text()


def _both(builder: type[Builder]) -> tuple[LineParser, LarkParser]:
    parser = LineParser(builder())
    assert isinstance(parser._parser, TableParser)
    return parser, LarkParser(VAL2, VAL_STARTS, builder())


PARSERS = {builder: _both(builder) for builder in (Builder, ValBuilder)}


def test_every_rule_that_makes_something_has_a_method_that_makes_it() -> None:
    table = table_of(VAL2, VAL_STARTS)
    assert table is not None
    for rule in table.rules:
        assert hasattr(Builder, rule.name) or rule.alone or rule.name.startswith("_"), rule


def lines() -> Iterator[str]:
    """Yield lines of all sample programs, right and wrong, and random ones; and some of them with a part left out."""
    files = sorted((*ROOT.glob("programs/*.v2"), *ROOT.glob("tests/conformance/**/*.v2*")))
    found = {line for file in files for line in file.read_text(encoding="utf-8").splitlines()}
    random = Random(20)
    found |= {random_line(random) for _ in range(some(2000))}
    yield from sorted(found)
    for line in random.sample(sorted(found), min(len(found), some(2000))):
        words = line.split()
        if words:
            words.pop(random.randrange(len(words)))
            yield " ".join(words)


def read(parser: LineParser, line: str, start: str) -> list[Token]:
    lexer = Lexer(parser._patterns, line, 1)
    tokens = {"step": lexer.step, "prompt": lambda: lexer.prompt(()), "entry": lexer.entry}[start]()
    return [token for token in tokens if token.type not in ("COMMENT", "LABEL")]


def outcome(parser: Any, tokens: list[Token], start: str) -> object:
    """Return the tree; or the place of a mistake and what would fit there; or the refusal of the builder."""
    try:
        return parser.parse(tokens, start)
    except DoesNotFit as error:
        return error.token, error.accepted
    except LineRefused as refused:
        return refused.diagnostic


def test_both_parsers_read_every_line_alike() -> None:
    seen = {"tree": 0, "refused": 0}
    for (ours, larks), line, start in product(PARSERS.values(), lines(), ("step", "prompt", "entry")):
        try:
            tokens = read(ours, line, start)
        except LineRefused:
            continue
        if not tokens:
            continue
        result = outcome(ours._parser, tokens, start)
        assert outcome(larks, tokens, start) == result, (line, start)
        seen["refused" if isinstance(result, tuple) else "tree"] += 1
    assert min(seen.values()) > 2000, seen
