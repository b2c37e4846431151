"""What is changed in a source text, and what is left alone."""

from __future__ import annotations

import ast

import pytest

from tests.mutation.mutants import mutants, mutated


@pytest.mark.parametrize(
    ("source", "changed"),
    [
        ("a < b", ["a <= b", "a >= b"]),
        ("a == b", ["a != b"]),
        ("a - b", ["a + b"]),
        ("not a", ["a"]),
        ("a and b", ["a or b"]),
        ("x = 2.0", ["x = 20.0", "x = 0.2", "x = 3.0", "x = 0.0"]),
        ("x = True", ["x = False"]),
        ("min(a)", ["max(a)"]),
        ("def f():\n    g(a, b)", ["def f():\n    pass", "def f():\n    g(b, a)"]),
        ("def f():\n    return a", ["def f():\n    return None"]),
        ("if a:\n    b", ["if not a:\n    b"]),
        ("assert a < b", []),
        ("raise E(1 + 2)", []),
        ("x: int | None\n'text 1 < 2'", []),
        ("zip(a, b, strict=True)", []),
    ],
)
def test_changes(source: str, changed: list[str]) -> None:
    assert [ast.unparse(mutated(source, one)) for one in mutants("file.py", source)] == changed


def test_a_mutant_says_its_place() -> None:
    (one,) = mutants("file.py", "a\nb + c\n")
    assert one.text == "file.py:2: b + c  ->  b - c"
