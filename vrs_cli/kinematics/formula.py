"""Generate variants of a closed form of the inverse kinematics from its source code: for arrays, with intermediate
values, and for all configurations at once.

The inverse kinematics of one configuration is written once, as a function of floats. The function may contain only
assignments to new names, conditional expressions (`a if test else b`), `if test: return None` for poses out of reach,
and one final return.
"""

from __future__ import annotations

import ast
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import deepcopy
from functools import cache, reduce
from math import inf, pi
from textwrap import dedent
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any, cast

from vrs_cli.kinematics.joints import ARM, ELBOW, TURN, WRIST, Joints, Steps
from vrs_cli.kinematics.transform import Transform

if TYPE_CHECKING:
    from inspect import ClosureVars


def interpreted(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function in a form whose source code can be read: the function itself, or its interpreted form from the
    source file if its module is compiled to C.
    """
    if isinstance(function, FunctionType):
        return function
    return cast(Callable[..., Any], getattr(_interpreted_module(function.__module__), function.__name__))


@cache
def _interpreted_module(name: str) -> ModuleType:
    """Execute the source file of a module beside its compiled form."""
    path = os.path.join(os.path.dirname(str(sys.modules[name].__file__)), name.rpartition(".")[2] + ".py")
    module = ModuleType(name)
    with open(path, encoding="utf-8") as source:
        exec(compile(source.read(), path, "exec"), module.__dict__)
    return module


class _OverArrays(ast.NodeTransformer):
    """Rewrites the syntax tree of a formula for arrays: a conditional expression becomes a call of `choose`, and
    `return None` marks the rows out of reach (`lost`).
    """

    loses = False  # whether the formula has a `return None`

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        self.generic_visit(node)
        if self.loses:
            node.body = [*ast.parse("lost = False").body, *node.body]
        return node

    def visit_If(self, node: ast.If) -> ast.stmt:
        self.loses = True
        return ast.parse(f"lost = lost | ({ast.unparse(self.visit(node.test))})").body[0]

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        test, body, orelse = (ast.unparse(self.visit(part)) for part in (node.test, node.body, node.orelse))
        return ast.parse(f"choose({test}, lambda: {body}, lambda: {orelse})", mode="eval").body

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        self.generic_visit(node)
        sign = ast.BitOr() if isinstance(node.op, ast.Or) else ast.BitAnd()
        return reduce(lambda a, b: ast.BinOp(a, sign, b), node.values)

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        pairs = zip((node.left, *node.comparators[:-1]), node.ops, node.comparators, strict=True)
        tests: list[ast.expr] = [ast.Compare(a, [op], [b]) for a, op, b in pairs]
        return reduce(lambda a, b: ast.BinOp(a, ast.BitAnd(), b), tests)

    def visit_Return(self, node: ast.Return) -> ast.stmt:
        self.generic_visit(node)
        assert node.value is not None
        return ast.parse(f"return where(lost, nan, {ast.unparse(node.value)})").body[0] if self.loses else node


class _WithSteps(ast.NodeTransformer):
    """Rewrites the syntax tree of a formula so that it returns all of its variables in a dictionary."""

    def visit_Return(self, node: ast.Return) -> ast.stmt:  # noqa: ARG002 (the original return value is dropped)
        return ast.parse("return locals()").body[0]


def over_arrays(formula: Callable[..., Any]) -> Callable[..., Any]:
    """Rewrite a formula for arrays. The new function returns its joints as one array (n, N), with NaN for poses out of
    reach; or, if the formula never returns None, as a tuple of n arrays.

    It does not bring angles near to reference joints. Functions of its module that the formula calls are rewritten too.
    """
    import numpy as np

    def choose(test: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
        """Return yes() in rows where the test is true, no() in others. If the test has the same result for all rows,
        only one of the two functions is called.
        """
        if not np.any(test):
            return no()
        return yes() if np.all(test) else np.where(test, yes(), no())

    names = {name: getattr(np, name) for name in ("sqrt", "cos", "sin", "copysign", "where", "nan")}
    names |= {
        "acos": lambda x: np.arccos(np.clip(x, -1.0, 1.0)),
        "atan2": np.arctan2,
        "choose": choose,
        "complex": lambda x, y: x + 1j * y,
        "hypot": lambda x, y, z: np.sqrt(x * x + y * y + z * z),
    }
    names |= {"nearest_turn": lambda q, _: q, "six_turned_near": lambda q, _: q, "dist": lambda _, __: inf}
    scope, module = _scope(formula), formula.__module__
    called = {**scope.globals, **scope.nonlocals}.items()
    names |= {name: over_arrays(x) for name, x in called if isinstance(x, FunctionType) and x.__module__ == module}
    return _variant(formula, _OverArrays(), names)


def steps_of(formula: Callable[..., Any], names: Sequence[str], *arguments: Any) -> Steps:
    """Compute a formula, and return those of its variables that are in `names`."""
    found = _variant(formula, _WithSteps(), {})(*arguments)
    return {name: found[name] for name in names if name in found}


# names of the signs of a configuration in a formula, and their bits in `Configuration.index`
SIGNS = {"arm": ARM, "elbow": ELBOW, "wrist": WRIST}

# a level: statements that depend on the same signs, and statements that add whole turns to the joints computed in the
# level
Level = tuple[list[ast.stmt], list[ast.stmt]]


def every_branch(
    formula: Callable[..., Any], middle: Joints, near: Joints, flip: Callable[..., Any] | None = None
) -> Callable[[Transform], tuple[Joints | None, ...]]:
    """Generate a function that takes a pose and returns the joints q1 to q6 of all configurations in the order of
    `joints.ALL`; None for those that do not reach the pose.

    Whole turns bring each joint nearest to `middle`. A joint that may have any value takes its value in `near`. The
    first statement of the formula must unpack the signs of a configuration, and the last two must collect the joints.
    In the new function a statement runs once for all configurations that differ only in signs it does not depend on.
    `flip`: a function that computes the joints of FLIP from those of NOFLIP.
    """
    levels, signs = _levels(_tree(formula).body[1:-2], middle)
    flipped = [] if flip is None else _tree(flip).body[1:-1]

    def level_statements(level: int, known: dict[str, float]) -> list[ast.stmt]:
        """Return the statements of a level, followed by those of the deeper levels for both signs. `known`: the numbers
        of names, including the signs chosen in the outer levels.
        """
        index = sum(bit for sign, bit in SIGNS.items() if known.get(sign, 1.0) < 0.0)
        rows, turns = levels[level]
        found = body = list[ast.stmt]()
        for row in flipped if flipped and level == len(signs) and index & WRIST else rows:
            if isinstance(row, ast.If) and isinstance(row.body[0], ast.Return):
                inner = list[ast.stmt]()
                body.append(ast.If(ast.UnaryOp(ast.Not(), row.test), inner, []))
                body = inner
            else:
                body.append(_WithNumbers(known).visit(deepcopy(row)))
        body += turns
        if level == len(signs):
            body += ast.parse(f"w{index} = q1, q2, q3, q4, q5, q6").body
        else:
            body += [row for value in (1.0, -1.0) for row in level_statements(level + 1, known | {signs[level]: value})]
        return found

    results = [f"w{index}" for index in range(2 ** len(signs))]
    tree = _tree(f"def branches(T):\n    {' = '.join(results)} = None\n    return {', '.join(results)}")
    numbers = {name: x for name, x in _scope(formula).nonlocals.items() if isinstance(x, float)}
    tree.body[1:1] = level_statements(0, numbers)
    return _compile_tree(tree, formula, {"near": near})


def _levels(rows: Iterable[ast.stmt], middle: Joints) -> tuple[list[Level], list[str]]:
    """Group statements into levels: those that depend on no sign, on the first sign only, and so on. Return the levels,
    and the names of the signs in the order of their first use.
    """
    # for each joint the statement that adds whole turns to bring it nearest to the middle
    turns_of = dict[str, list[ast.stmt]]()
    for i, x in enumerate(middle, 1):
        turned = f"q{i} -= {TURN} * ((q{i} - {x - pi}) // {TURN})"
        turns_of[f"q{i}"] = ast.parse(f"if not {x - pi} <= q{i} <= {x + pi}: {turned}").body
    needs = {sign: {sign} for sign in SIGNS}
    signs = list[str]()
    levels: list[Level] = [([], []) for _ in range(len(SIGNS) + 1)]
    for row in _single_assignments(rows):
        names = [node for node in ast.walk(row) if isinstance(node, ast.Name)]
        own = {sign for name in names for sign in needs.get(name.id, ())}
        signs += [sign for sign in SIGNS if sign in own and sign not in signs]
        statements, turns = levels[max((signs.index(sign) + 1 for sign in own), default=0)]
        statements.append(row)
        for name in [node.id for node in names if isinstance(node.ctx, ast.Store)]:
            needs[name] = own
            turns += turns_of.get(name, [])
    return levels, signs


def _single_assignments(rows: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield the statements; split an assignment of several values into one assignment for each value."""
    for row in rows:
        match row:
            case ast.Assign([ast.Tuple(targets)], ast.Tuple(values)):
                yield from (ast.Assign([target], value) for target, value in zip(targets, values, strict=True))
            case _:
                yield row


def _variant(formula: Callable[..., Any], rewriter: ast.NodeTransformer, others: dict[str, Any]) -> Callable[..., Any]:
    return _compile_tree(rewriter.visit(_tree(formula)), formula, others)


def _tree(formula: Callable[..., Any] | str) -> ast.FunctionDef:
    from inspect import getsource  # imported here because it loads many modules

    source = formula if isinstance(formula, str) else getsource(formula)
    return cast(ast.FunctionDef, ast.parse(dedent(source)).body[0])


def _scope(formula: Callable[..., Any]) -> ClosureVars:
    """Return the global and nonlocal names that a formula uses, with their values."""
    from inspect import getclosurevars

    return getclosurevars(formula)


class _WithNumbers(ast.NodeTransformer):
    """Rewrites a syntax tree: replaces names by their numbers, and removes factors of 1."""

    def __init__(self, numbers: dict[str, float]) -> None:
        self.numbers = numbers

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return ast.Constant(self.numbers[node.id]) if node.id in self.numbers else node

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        match node:
            case ast.BinOp(ast.Constant(1.0), ast.Mult(), factor):
                return factor
        return node


def _compile_tree(tree: ast.FunctionDef, formula: Callable[..., Any], others: dict[str, Any]) -> Callable[..., Any]:
    """Compile the syntax tree of a function, and return the function. It can use the names that the formula uses, and
    `others`.
    """
    scope = _scope(formula)
    names = {**scope.globals, **scope.nonlocals, **others}
    module = ast.fix_missing_locations(ast.Module([tree], []))
    exec(compile(module, f"<{tree.name}>", "exec"), names)
    return cast(Callable[..., Any], names[tree.name])
