"""Make nodes of Python syntax trees with short functions, so that the compiler reads like the code that it makes."""

from __future__ import annotations

import ast as py
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Any, TypeVar, cast

_Tree = TypeVar("_Tree", bound="py.expr | py.stmt")


FILE = "<program>"  # shown as the file name of compiled programs in Python's tracebacks
DIRECT = "direct"  # name of every function that `compile.direct` makes
_LINE, _COLUMN = 1, 0  # position of nodes without a line of their own, because Python's compiler requires a position
_LOAD = py.Load()
_BRANCHES = (py.expr, py.stmt, py.arguments, py.arg, py.excepthandler)


@lru_cache(maxsize=1024)  # several trees can share a node, because it is never changed
def name(identifier: str) -> py.Name:
    return _leaf(py.Name(identifier, _LOAD))


def constant(value: float | str | bool | None) -> py.Constant:
    return _cached_constant(value) if value is None or isinstance(value, str | bool) else _leaf(py.Constant(value))


@lru_cache(maxsize=1024)
def _cached_constant(value: str | bool | None) -> py.Constant:
    return _leaf(py.Constant(value))


def _leaf(node: _Tree) -> _Tree:
    node.lineno, node.col_offset = _LINE, _COLUMN
    return node


def call(function: py.expr | str, *arguments: py.expr) -> py.Call:
    return py.Call(name(function) if isinstance(function, str) else function, list(arguments), [])


def method(owner: py.expr, attribute: str, *arguments: py.expr) -> py.Call:
    return py.Call(py.Attribute(owner, attribute, _LOAD), list(arguments), [])


def item(owner: str, key: py.expr) -> py.Subscript:
    return py.Subscript(name(owner), key, _LOAD)


def tuple_of(items: Iterable[py.expr]) -> py.Tuple:
    return py.Tuple(list(items), _LOAD)


def compare(left: py.expr, operator: py.cmpop, right: py.expr) -> py.Compare:
    return py.Compare(left, [operator], [right])


def not_(truth: py.expr) -> py.UnaryOp:
    return py.UnaryOp(py.Not(), truth)


def assign(identifier: str, value: py.expr) -> py.Assign:
    return py.Assign([py.Name(identifier, py.Store())], value)


def unpack_target(identifiers: Iterable[str]) -> py.Tuple:
    """Return the target of an assignment that unpacks a tuple into variables."""
    return py.Tuple([py.Name(identifier, py.Store()) for identifier in identifiers], py.Store())


def parameters(names: Sequence[str], defaults: bool = False, rest: py.arg | None = None) -> py.arguments:
    """Return the parameters of a function. `defaults`: give each parameter the variable of the same name as its
    default. `rest`: the parameter that takes all further arguments."""
    values: list[py.expr] = [name(identifier) for identifier in names] if defaults else []
    return py.arguments([], [py.arg(identifier) for identifier in names], rest, [], [], None, values)


def make_function(function: py.FunctionDef, namespace: dict[str, object]) -> Callable[..., Any]:
    """Compile a syntax tree to a Python function with `namespace` as its globals. The function itself is removed from
    the namespace, because a server would not free this reference cycle (see `collect_in_small_parts`)."""
    module = py.Module([place(function)], [])
    exec(compile(module, FILE, "exec"), namespace)
    return cast("Callable[..., Any]", namespace.pop(function.name))


def place(root: _Tree, line: int = _LINE) -> _Tree:
    """Give a position to every node of a tree that has none, and return the tree. Names and constants get their
    position when they are made. `line`: the line number."""
    waiting: list[Any] = [root]
    while waiting:
        node = waiting.pop()
        held = node.__dict__
        if "lineno" in held:
            continue
        for value in held.values():
            if value.__class__ is list:
                waiting += value
            elif isinstance(value, _BRANCHES):
                waiting.append(value)
        node.lineno, node.col_offset = line, _COLUMN
    return root


def yield_(value: py.expr) -> py.Expr:
    return py.Expr(py.Yield(value))
