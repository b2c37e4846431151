"""Kinds of expressions that are known before a program runs."""

from __future__ import annotations

from vrs_cli.language.analysis.names import kind_of
from vrs_cli.language.text import ast
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.values import Kind
from vrs_cli.values.diagnostics import Span

SPAN = Span(1, 1, 2)


def call(name: str) -> ast.Call:
    return ast.Call(name, (), span=SPAN)


def test_functions_whose_names_begin_with_a_dollar_sign_give_strings_and_no_others() -> None:
    kinds = {name: kind_of(call(name), lambda _: None) for name in FUNCTIONS}
    assert None not in kinds.values()
    assert {name for name, kind in kinds.items() if kind is Kind.STRING} == {n for n in FUNCTIONS if n.startswith("$")}


def test_a_function_that_nobody_knows_has_no_kind() -> None:
    assert kind_of(call("NOSUCH"), lambda _: None) is None
