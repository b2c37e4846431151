"""Small changes of a source file, each of which some test should notice.

Left alone: annotations, docstrings and other texts, decorators, `assert`, what stands inside `raise` (its words), and
statements outside functions, which make names that nothing would run without.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass

COMPARISONS: dict[type, tuple[type, ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
OPERATORS: dict[type, type] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Div,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
}
OTHER_EXTREME = {"min": "max", "max": "min"}
TEXTS = (ast.Constant, ast.JoinedStr)  # and numbers, which are changed themselves
UNTOUCHED = (ast.Assert, ast.Raise, ast.JoinedStr, ast.Import, ast.ImportFrom)
FIELDS_UNTOUCHED = {"annotation", "returns", "decorator_list", "type_comment"}


@dataclass(frozen=True)
class Mutant:
    """The `choice`-th change of the node at `place` in the order of `walk`; `within` a function."""

    file: str
    line: int
    place: int
    choice: int
    within: bool
    before: str
    after: str

    @property
    def text(self) -> str:
        return f"{self.file}:{self.line}: {self.before}  ->  {self.after}"


def mutants(file: str, source: str) -> Iterator[Mutant]:
    """All mutants of a source text, in its order."""
    for place, (node, within) in enumerate(walk(ast.parse(source))):
        for choice, other in enumerate(changes(node, within)):
            before, after = (ast.unparse(one).splitlines()[0] for one in (node, other))
            yield Mutant(file, getattr(node, "lineno", 0), place, choice, within, before, after)


def mutated(source: str, mutant: Mutant) -> ast.Module:
    """The tree of a source text with one mutant in it."""
    tree = ast.parse(source)
    node, within = list(walk(tree))[mutant.place]
    new = ast.copy_location(changes(node, within)[mutant.choice], node)
    return ast.fix_missing_locations(_Put(node, new).visit(tree))


class _Put(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else self.generic_visit(node)


def walk(node: ast.AST, within: bool = False) -> Iterator[tuple[ast.AST, bool]]:
    """Every node that may be changed, and whether it is inside a function."""
    yield node, within
    if isinstance(node, UNTOUCHED) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
        return
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    if isinstance(node, ast.keyword) and node.arg == "strict":  # of zip: says what is so
        return
    within = within or isinstance(node, ast.FunctionDef | ast.Lambda)
    for name, field in ast.iter_fields(node):
        if name not in FIELDS_UNTOUCHED:
            for child in field if isinstance(field, list) else [field]:
                if isinstance(child, ast.AST):
                    yield from walk(child, within)


def changes(node: ast.AST, within: bool) -> list[ast.AST]:
    """What may stand in place of a node; `within` a function also nothing, or other arguments."""
    match node:
        case ast.Compare(ops=[operator]):
            return [_with(node, ops=[other()]) for other in COMPARISONS[type(operator)]]
        case ast.BinOp(left=left, op=operator) if type(operator) in OPERATORS and not isinstance(left, TEXTS):
            return [_with(node, op=OPERATORS[type(operator)]())]
        case ast.AugAssign(op=operator) if type(operator) in OPERATORS:
            return [_with(node, op=OPERATORS[type(operator)]()), ast.Pass()]
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
            return [operand]
        case ast.BoolOp(op=operator):
            return [_with(node, op=ast.Or() if isinstance(operator, ast.And) else ast.And())]
        case ast.Constant(value=bool(value)):
            return [_with(node, value=not value)]
        case ast.Constant(value=int(value) | float(value)):
            return [_with(node, value=other) for other in _numbers(value)]
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            return [_with(node, test=ast.UnaryOp(ast.Not(), test))]
        case ast.Return(value=ast.expr() as value) if ast.unparse(value) != "None":
            return [_with(node, value=ast.Constant(None))]
        case ast.Assign() | ast.Expr(value=ast.Call()) if within:
            return [ast.Pass()]
        case ast.Call(func=ast.Name(id=name)) if name in OTHER_EXTREME:
            return [_with(node, func=ast.Name(OTHER_EXTREME[name], ast.Load()))]
        case ast.Call(args=[first, second, *others]) if within and ast.Starred not in (type(first), type(second)):
            return [_with(node, args=[second, first, *others])]
    return []


def _with(node: ast.AST, **fields: object) -> ast.AST:
    """A copy of a node, but for these fields."""
    other = copy.copy(node)
    for name, value in fields.items():
        setattr(other, name, value)
    return other


def _numbers(value: float) -> list[float]:
    """Ten times as much, a tenth, one more, nothing."""
    found = [value * 10, value / 10 if isinstance(value, float) else value * 10, value + 1, value * 0]
    return [x for x in dict.fromkeys(found) if x != value]
