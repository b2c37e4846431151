"""Test the order of the operators, and the differences to VAL-II's own."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.language.analysis.expressions import val_grouping
from vrs_cli.language.text.builder import Grouping
from vrs_cli.language.text.lexer import Token
from vrs_cli.language.text.line_parser import grammar_text
from vrs_cli.language.text.parser import parse_step
from vrs_cli.language.words.functions import ORDER, VAL_ORDER, Order
from vrs_cli.values.diagnostics import Span


def groupings(text: str) -> list[tuple[str, str]]:
    statement: Any = parse_step(f"x = {text}").statement
    return [(ours, theirs) for ours, theirs, _ in val_grouping(statement.value)]


@pytest.mark.parametrize(
    ("text", "ours", "theirs"),
    [
        ("a > 2 AND b < 3", "(a > 2) AND (b < 3)", "(a > (2 AND b)) < 3"),
        ("SIG(1) OR TIMER(1) > 30", "SIG(1) OR (TIMER(1) > 30)", "(SIG(1) OR TIMER(1)) > 30"),
        ("NOT a == b", "NOT (a == b)", "(NOT a) == b"),
        ("NOT a+b", "NOT (a + b)", "(NOT a) + b"),
        ("a XOR b == c", "a XOR (b == c)", "(a XOR b) == c"),
        ("a OR b+c", "a OR (b + c)", "(a OR b) + c"),
        ("ABS(a == b AND c)", "(a == b) AND c", "a == (b AND c)"),
        ("1+(a == b AND c)", "(a == b) AND c", "a == (b AND c)"),
        ("row[a OR b == c]", "a OR (b == c)", "(a OR b) == c"),
    ],
)
def test_lines_that_val_groups_otherwise(text: str, ours: str, theirs: str) -> None:
    assert groupings(text) == [(ours, theirs)]


@pytest.mark.parametrize(
    "text",
    [
        "(a > 2) AND (b < 3)",
        "a AND b",
        "a AND b OR c",
        "NOT SIG(1)",
        "NOT SIG(1) AND NOT SIG(2)",
        "NOT (a == b)",
        "(NOT a) == b",
        "a+b == c*d",
        "a BAND 1 == 1",
        "(a OR b) == c",
        "-a*b",
    ],
)
def test_lines_that_both_group_alike(text: str) -> None:
    assert groupings(text) == []


def ranked(order: Order, items: list[str]) -> Any:
    """Return the tree of a flat expression of infix operators, by splitting at the loosest operator, the last of
    equals.
    """
    if len(items) == 1:
        return items[0]
    ranks = {at: order.infix[items[at]] for at in range(1, len(items), 2)}
    at = max(at for at in ranks if ranks[at] == min(ranks.values()))
    return (items[at], ranked(order, items[:at]), ranked(order, items[at + 1 :]))


@given(st.lists(st.sampled_from([*ORDER.infix]), max_size=8), st.sampled_from([ORDER, VAL_ORDER]))
def test_climbing_finds_the_loosest_operator(signs: list[str], order: Order) -> None:
    values = [f"v{number}" for number in range(len(signs) + 1)]
    items = [values[0]]
    tokens: list[Token | Any] = [values[0]]
    for sign, value in zip(signs, values[1:], strict=True):
        items += [sign, value]
        tokens += [Token("INFIX", sign, sign, Span(1, 1, 2)), value]
    grouping: Grouping[Any] = Grouping(order, lambda sign, a: (sign.value, a), lambda sign, a, b: (sign.value, a, b))
    assert grouping.tree(tokens) == ranked(order, items)


def test_the_grammar_tells_the_order() -> None:
    """The comment at the head of the grammar says the same as the table."""
    text = grammar_text()
    line = next(line for line in text.splitlines() if line.startswith("//     :   -"))
    groups = [
        group.split() for group in line.removeprefix("//").replace("(before a value)", "").split("  ") if group.strip()
    ]
    ranks = [
        {(ORDER.prefix if place == 1 or "NOT" in group else ORDER.infix)[sign] for sign in group}
        for place, group in enumerate(groups)
    ]
    assert all(len(one) == 1 for one in ranks)
    order = [rank for one in ranks for rank in one]
    assert order == sorted(order, reverse=True)
    assert {sign for group in groups for sign in group} == {*ORDER.infix, *ORDER.prefix}
