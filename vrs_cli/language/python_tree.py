"""Small pieces of Python's own syntax tree, so that the compiler reads like the code it makes."""

from __future__ import annotations

import ast as py
from collections.abc import Callable, Iterable, Sequence
from typing import Any, cast


def name(identifier: str) -> py.Name:
    return py.Name(identifier, py.Load())


def constant(value: float | str | bool | None) -> py.Constant:
    return py.Constant(value)


def call(function: py.expr | str, *arguments: py.expr) -> py.Call:
    return py.Call(name(function) if isinstance(function, str) else function, list(arguments), [])


def method(owner: py.expr, attribute: str, *arguments: py.expr) -> py.Call:
    return py.Call(py.Attribute(owner, attribute, py.Load()), list(arguments), [])


def item(owner: str, key: py.expr) -> py.Subscript:
    return py.Subscript(name(owner), key, py.Load())


def tuple_of(items: Iterable[py.expr]) -> py.Tuple:
    return py.Tuple(list(items), py.Load())


def compare(left: py.expr, operator: py.cmpop, right: py.expr) -> py.Compare:
    return py.Compare(left, [operator], [right])


def assign(identifier: str, value: py.expr) -> py.Assign:
    return py.Assign([py.Name(identifier, py.Store())], value)


def parameters(names: Sequence[str], defaults: bool = False) -> py.arguments:
    """`defaults`: each has the variable of its own name."""
    values: list[py.expr] = [name(identifier) for identifier in names] if defaults else []
    return py.arguments([], [py.arg(identifier) for identifier in names], None, [], [], None, values)


def made(function: py.FunctionDef, namespace: dict[str, object]) -> Callable[..., Any]:
    """The Python function of a tree."""
    module = py.fix_missing_locations(py.Module([function], []))
    exec(compile(module, "<program>", "exec"), namespace)
    return cast("Callable[..., Any]", namespace[function.name])


def yield_(value: py.expr) -> py.Expr:
    return py.Expr(py.Yield(value))
