"""The parse table: what is kept is what was made; what is kept by others, or broken, is made anew."""

from __future__ import annotations

from pathlib import Path

import pytest

from vrs_cli.language.text import table
from vrs_cli.language.text.builder import Builder
from vrs_cli.language.text.table import Table, table_of

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
    monkeypatch.setattr(table, "_made", lambda *_: pytest.fail("it is kept"))
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
    assert table_of(GRAMMAR, STARTS).rules == made.rules
    assert len(kept.read_bytes()) == len(whole)


def test_a_table_of_another_grammar_is_not_taken(kept: Path) -> None:
    first = table_of(GRAMMAR, STARTS)
    assert kept.exists()
    assert table_of(GRAMMAR.replace("(B A)*", "(B A)?"), STARTS) != first


def test_every_rule_that_makes_something_has_a_method_that_makes_it() -> None:
    from vrs_cli.language.text.parser import LineParser

    for rule in LineParser()._table.rules:
        assert hasattr(Builder, rule.name) or rule.alone or rule.name.startswith("_"), rule
