"""The meaning of names and operators in expressions; and what a name without a value may have been meant as.

A bare name that a function without arguments has too (HERE, TOOL, HAND) is that function, or a variable. It is the
variable in a program that gives it a value or declares it, and on a line of the prompt while it has a value. The parser
reads one line and takes it for the function; here the whole decides. `HAND()` is the function everywhere.

The order of the operators is ours or that of VAL-II's own table (val2 section 2.2). They differ in NOT, AND, OR and XOR
against the relations; see the head of grammar/val2.lark.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Container, Iterable, Iterator, Mapping, Sequence
from operator import is_
from typing import Any, Generic, TypeVar, cast

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Expression, Program, Statement
from vrs_cli.language.text.lexer import Token
from vrs_cli.language.words.foreign import own_function
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import INSTRUCTIONS, RESERVED
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.values import Kind
from vrs_cli.language.words.word import Shape, argument_at
from vrs_cli.values.diagnostics import Span

Tree = TypeVar("Tree")

# the key of the variable of that name
FUNCTION_NAMES = {name.lower(): name for name, row in FUNCTIONS.items() if row.constant and name not in RESERVED}
DEFINING = frozenset({Shape.VARIABLE, Shape.REAL_VARIABLE, Shape.STRING_VARIABLE, Shape.LOCATION_VARIABLE, Shape.UNIT})
_CALLED = frozenset({Shape.PROGRAM, Shape.PROGRAM_TEXT})


def resolve_program(program: Program) -> Program:
    """Return the program with variables in place of functions that bear the name of one of its own variables."""
    names = variables_named_like_functions(program.parameters, (step.statement for step in program.steps))
    return replace(program, steps=_replace(program.steps, names)) if names else program


def resolve_line(statement: Statement, known: Container[str]) -> Statement:
    """Resolve one line. `known`: the keys of variables; at the prompt those that have a value."""
    inner = statement.statement if isinstance(statement, ast.DoInstruction | ast.ExplainCommand) else statement
    names = variables_named_like_functions((), (inner,)) | {key for key in FUNCTION_NAMES if key in known}
    return _replace(statement, names) if names else statement


def variables_named_like_functions(
    parameters: Iterable[ast.Variable], statements: Iterable[Statement | None]
) -> set[str]:
    """The keys of the variables that bear the name of a function, among those that a program has by these."""
    named = {parameter.key for parameter in parameters}
    for statement in statements:
        named.update(variables_given_by(statement))
    return named & FUNCTION_NAMES.keys()


def variables_given_by(statement: Statement | None) -> Iterator[str]:
    """The keys of the variables that a statement declares or gives a value to, by itself or through a CALL."""
    for variable in definitions(statement):
        yield variable.key
    for called in _arguments(statement, _CALLED):
        if isinstance(called, ast.ProgramCall | ast.Applied):
            yield from (argument.key for argument in called.arguments if isinstance(argument, ast.Variable))


def definitions(statement: Statement | None) -> Iterator[ast.Variable]:
    """The variables that a statement itself declares or gives a value to."""
    if isinstance(statement, ast.Assignment):
        yield statement.target
    elif isinstance(statement, ast.For):
        yield statement.variable
    for given in _arguments(statement, DEFINING):
        last = given.right if isinstance(given, ast.Binary) else given  # HERE a:b defines b
        if isinstance(last, ast.Variable):
            yield last


def _arguments(statement: Statement | None, shapes: frozenset[Shape]) -> Iterator[Expression]:
    """The arguments of an instruction that have one of these shapes."""
    row = INSTRUCTIONS.get(statement.word) if isinstance(statement, ast.Instruction) else None
    if row is not None and isinstance(statement, ast.Instruction) and not row.wanted.isdisjoint(shapes):
        for place, given in enumerate(statement.arguments):
            argument = argument_at(row, place)
            if argument is not None and given is not None and argument.shape in shapes:
                yield given


def _replace(tree: Tree, names: Collection[str]) -> Tree:
    """Return a tree with variables in place of the functions of these names that stand without parentheses."""
    if isinstance(tree, ast.Call) and not tree.parenthesised and tree.name.lower() in names:
        return cast(Tree, tree.variable)
    if isinstance(tree, tuple):
        children = tuple(_replace(child, names) for child in tree)
        return cast(Tree, tree if all(map(is_, children, tree)) else children)
    if not isinstance(tree, Struct) or isinstance(tree, Span):
        return tree
    changed: dict[str, Any] = {}
    for name in tree.__struct_fields__:
        before = getattr(tree, name)
        after = _replace(before, names)
        if after is not before:
            changed[name] = after
    return cast(Tree, replace(cast(Any, tree), **changed)) if changed else tree


# --- operators -------------------------------------------------------------------------------------------------------


_RELATIONS = ("==", "<>", "<", ">", "<=", ">=")
_COMMON = {
    **dict.fromkeys(_RELATIONS, 4),
    **dict.fromkeys(("+", "-", "BOR", "BXOR"), 5),
    **dict.fromkeys(("*", "/", "MOD", "BAND"), 6),
    "**": 7,
    ":": 9,
}
_SIGNS = dict.fromkeys(("-", "+", "COM"), 8)

RELATIONS = frozenset(_RELATIONS)
LOGICAL = frozenset({"AND", "OR", "XOR", "NOT"})


class Order(Struct, frozen=True):
    """A higher rank binds tighter; equal ranks group from the left."""

    infix: Mapping[str, int]
    prefix: Mapping[str, int]


ORDER = Order({"OR": 1, "XOR": 1, "AND": 2, **_COMMON}, {"NOT": 3, **_SIGNS})
VAL_ORDER = Order({**_COMMON, "OR": 5, "XOR": 5, "AND": 6}, {"NOT": 8, **_SIGNS})

N = TypeVar("N")


class Grouping(Struct, Generic[N]):
    """The tree of a flat expression `PREFIX* value (INFIX PREFIX* value)*`, by precedence climbing."""

    order: Order
    unary: Callable[[Token, N], N]
    binary: Callable[[Token, N, N], N]

    def tree(self, items: Sequence[Token | N]) -> N:
        root, _ = self._climb(items, 0, 0)
        return root

    def _climb(self, items: Sequence[Token | N], at: int, rank: int) -> tuple[N, int]:
        """The tree that begins at an item and takes what binds tighter than `rank`, and where it ends."""
        first = items[at]
        if isinstance(first, Token):
            operand, at = self._climb(items, at + 1, self.order.prefix[first.value])
            left = self.unary(first, operand)
        else:
            left, at = first, at + 1
        while at < len(items):
            sign = items[at]
            assert isinstance(sign, Token)
            its_rank = self.order.infix[sign.value]
            if its_rank <= rank:
                break
            right, at = self._climb(items, at + 1, its_rank)
            left = self.binary(sign, left, right)
        return left, at


# --- names without a value ---

_NO_NAMES: Mapping[str, str] = {  # words of other languages that look like names here
    **dict.fromkeys(
        ("NONE", "NIL", "UNDEFINED"), "0 is nothing here, and FALSE; DEFINED(x) tells whether x has a value"
    ),
    **dict.fromkeys(("GRIPPER", "GRIP", "HAND"), "OPENI and CLOSEI work the hand"),
}


def meant_by(name: str) -> str:
    """What J1 and part.z were meant as, as a hint; "" for other names."""
    if re.fullmatch(r"(?i)j(oint)?\d", name):
        return "a joint is a number: DRIVE 1, 30"
    if (part := re.fullmatch(r"(?i)(\w[\w.]*)\.([xyz])", name)) is not None:
        axis = part[2].upper()
        return f"D{axis}({part[1]}) is the {axis} of a place, SHIFT({part[1]} BY dx, dy, dz) is one beside it"
    if re.fullmatch(r"(?i)(out|in|do|di)_?\d+", name):
        return "a signal is a number: SIGNAL 1 turns one on, SIG(1001) reads one"
    return f"/{name} is a format" if re.fullmatch(r"(?i)[efgi]\d+\.\d", name) else ""


def giving(name: str, kind: Kind | None) -> str:
    """Say how a variable without a value gets one, or what its name was meant as, as a hint."""
    base, bracket, _ = name.partition("[")
    function = FUNCTIONS.get(base.upper())
    if kind is Kind.PRECISION:
        return f"HERE {name} defines it"
    if meant := _NO_NAMES.get(base.upper()) or (own_function(base) if bracket else ""):
        return meant
    if function is not None and function.arguments:  # TIMER for TIMER(1)
        return f"the function is {function.form}"
    if kind is Kind.LOCATION:
        return f"HERE {name} or SET {name} = TRANS(x, y, z) defines it"
    if bracket and kind is Kind.STRING:
        return f"{name} = ... defines it; $MID({base}, 1, 2) is a part of a text"
    if bracket and kind is Kind.REAL:
        return f"{name} = ... defines it; DX(p) is the X of a place p"
    if kind is not Kind.REAL:
        return ""
    word = name.upper()
    if word in INSTRUCTIONS or word in COMMANDS:
        return f"{value_given(name)}; the word {word} begins a line of its own"
    return meant_by(name)


def value_given(name: str) -> str:
    """Say how a number gets a value, as a hint."""
    return f"{name} = ... gives it a value"


def text_meant(name: str) -> str:
    """Say what is to be done where TYPE finds a name without a value, as a hint."""
    return f'{value_given(name)}; a text stands in double quotes: "{name}"'
