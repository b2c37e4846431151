"""Test kinds of expressions that are known before a program runs."""

from __future__ import annotations

import pytest

from vrs_cli.language.analysis.names import kind_of, own_variables
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_file
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


@pytest.mark.parametrize(
    ("declared", "used", "array"),
    [("AUTO a[]", "", True), ("AUTO a", "a[1] = 2", True), ("AUTO a", "a = 2", False), ("LOCAL a", "x = a[3]", True)],
)
def test_a_variable_of_a_program_is_an_array_by_its_declaration_or_its_first_use(
    declared: str, used: str, array: bool
) -> None:
    (program,) = parse_file(f".PROGRAM p()\n{declared}\n{used}\n.END\n")[0].parts
    assert isinstance(program, ast.Program)
    assert [(own.variable.name, own.array) for own in own_variables(program)] == [("a", array)]
