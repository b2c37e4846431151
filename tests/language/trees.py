"""Random programs as syntax trees (hypothesis), and trees without their places, for the laws of parser and printer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
from hypothesis import strategies as st

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import FUNCTION_NAMES
from vrs_cli.language.words.functions import FUNCTIONS, ORDER, RELATIONS, WITH_BY
from vrs_cli.language.words.instructions import RESERVED
from vrs_cli.language.words.values import key_of
from vrs_cli.values.diagnostics import Span

T = TypeVar("T")

NOWHERE = Span(1, 1, 1)

names = st.from_regex(r"[a-z][a-z0-9._]{0,11}", fullmatch=True).filter(
    lambda name: name.upper() not in RESERVED and name not in FUNCTION_NAMES
)
program_names = st.from_regex(r"[a-z][a-z0-9._]{0,11}", fullmatch=True) | st.sampled_from(
    [name.lower() for name in RESERVED]
)
sigils = st.sampled_from(["", "#", "$"])
texts = st.text(alphabet=st.characters(min_codepoint=32, max_codepoint=126, exclude_characters='"'), max_size=12)
numbers = st.one_of(
    st.integers(0, 10**6).map(lambda n: ast.Number(float(n), str(n), span=NOWHERE)),
    st.sampled_from(["2.5", ".5", "5.", "1E-3", "^HFF", "^B101", "^17", "'A", "'a"]).map(
        lambda text: ast.Number(VALUES[text], text, span=NOWHERE)
    ),
)
VALUES = {
    "2.5": 2.5,
    ".5": 0.5,
    "5.": 5.0,
    "1E-3": 1e-3,
    "^HFF": 255.0,
    "^B101": 5.0,
    "^17": 15.0,
    "'A": 65.0,
    "'a": 97.0,
}
constants = st.sampled_from([name for name, row in FUNCTIONS.items() if row.constant]).map(
    lambda name: ast.Call(name, (), span=NOWHERE)
)
functions = st.sampled_from([name for name, row in FUNCTIONS.items() if not row.constant and row.arguments])


def _variables(inner: st.SearchStrategy[ast.Expression], grouped: bool = True) -> st.SearchStrategy[ast.Variable]:
    indexes = st.one_of(st.none(), st.lists(inner, min_size=0, max_size=3).map(tuple))
    groups = st.booleans() if grouped else st.just(False)
    whole = st.builds(ast.Variable, names, sigils, indexes, groups, span=st.just(NOWHERE))
    part = st.builds(_part, names, sigils, st.lists(inner, max_size=2), st.integers(1, 2))
    return st.one_of(whole, part)


def _part(name: str, sigil: str, indexes: list[ast.Expression], rest: int) -> ast.Variable:
    """`a[,]`, `a[i,]`, `a[i,,]`, `a[i,j,]`: three indexes at most."""
    rest = min(rest, 3 - len(indexes)) if indexes else rest
    return ast.Variable(name, sigil, tuple(indexes), span=NOWHERE, rest=rest)


def _trimmed(items: list[ast.Expression | None]) -> tuple[ast.Expression | None, ...]:
    while items and items[-1] is None:
        items.pop()
    return tuple(items)


def _arguments(inner: st.SearchStrategy[ast.Expression]) -> st.SearchStrategy[tuple[ast.Expression | None, ...]]:
    return st.lists(st.one_of(inner, st.none()), max_size=4).map(_trimmed)


def _calls(inner: st.SearchStrategy[ast.Expression]) -> st.SearchStrategy[ast.Call]:
    """Calls of functions whose arguments are plain values: those that take words are read otherwise."""
    plain = functions.filter(lambda name: name not in ("SWITCH", "PARAMETER", "DEFINED", "LAST", "TAS", "$DECODE"))
    return st.builds(ast.Call, plain, _arguments(inner), st.just(True), span=st.just(NOWHERE)).filter(
        lambda call: call.name not in WITH_BY or (len(call.arguments) > 0 and call.arguments[0] is not None)
    )


def _deeper(inner: st.SearchStrategy[ast.Expression]) -> st.SearchStrategy[ast.Expression]:
    return st.one_of(
        st.builds(ast.Unary, st.sampled_from([*ORDER.prefix]), inner, st.booleans(), span=st.just(NOWHERE)),
        st.builds(ast.Binary, st.sampled_from([*ORDER.infix]), inner, inner, st.booleans(), span=st.just(NOWHERE)),
        _variables(inner),
        _calls(inner),
    )


_expressions: st.SearchStrategy[ast.Expression] = st.recursive(
    st.one_of(
        numbers,
        texts.map(lambda text: ast.StringConstant(text, span=NOWHERE)),
        constants,
        st.builds(ast.Variable, names, sigils, st.none(), st.booleans(), span=st.just(NOWHERE)),
    ),
    _deeper,
    max_leaves=12,
)


@st.composite
def named(draw: st.DrawFn, inner: Callable[[], st.SearchStrategy[T]]) -> T:
    """A strategy under a short name: hypothesis prints those that others are made of."""
    return draw(inner())


expressions = named(lambda: _expressions)
reals = st.builds(ast.Variable, names, st.just(""), st.none(), span=st.just(NOWHERE))
labels = st.integers(0, 65535)
modifiers = st.one_of(
    st.just(ast.NO_MODIFIERS),
    expressions.map(lambda e: ast.Modifiers(at=e)),
    expressions.map(lambda e: ast.Modifiers(within=e)),
)
units = st.sampled_from([None, "MMPS", "IPS", "MONITOR"])
speeds = st.builds(ast.Modifiers, st.none(), st.none(), st.booleans(), units)
formats = st.builds(
    ast.Format,
    st.sampled_from("BCDEFGHIOSUX"),
    st.one_of(st.none(), st.integers(0, 20)),
    st.none(),
    span=st.just(NOWHERE),
)
items = st.lists(st.one_of(expressions, formats), max_size=4).map(tuple)
calls = st.builds(
    lambda name, arguments: ast.ProgramCall(name, arguments, True, span=NOWHERE), program_names, _arguments(expressions)
) | program_names.map(lambda name: ast.ProgramCall(name, (), span=NOWHERE))
words = st.sampled_from(["CP", "POWER", "DRY.RUN"]).map(lambda text: ast.BareWord(text, span=NOWHERE))

applied = st.builds(
    ast.Applied,
    st.builds(
        ast.Variable,
        names,
        st.just("$"),
        st.lists(expressions, min_size=1, max_size=2).map(tuple),
        span=st.just(NOWHERE),
    ),
    _arguments(expressions),
    span=st.just(NOWHERE),
)
sorts = st.sampled_from([None, "REAL", "DOUBLE", "LOC"]).map(lambda sort: ast.Modifiers(sort=sort))
declared = st.builds(ast.Variable, names, sigils, st.sampled_from([None, ()]), span=st.just(NOWHERE))
relations = st.builds(
    ast.Binary, st.sampled_from(sorted(RELATIONS)), numbers, expressions, st.just(False), span=st.just(NOWHERE)
)
label_numbers = labels.map(lambda n: ast.Number(float(n), str(n), span=NOWHERE))
signals = st.one_of(st.none(), expressions)

X = st.just(NOWHERE)
instructions = st.one_of(
    st.builds(
        ast.Instruction, st.sampled_from(["MOVE", "MOVES"]), st.tuples(expressions), st.none(), modifiers, span=X
    ),
    st.builds(ast.Instruction, st.just("APPRO"), st.tuples(expressions, expressions), st.none(), modifiers, span=X),
    st.builds(ast.Instruction, st.just("BASE"), _arguments(expressions), span=X),
    st.builds(ast.Instruction, st.just("READY"), st.just(()), st.none(), modifiers, span=X),
    st.builds(ast.Instruction, st.just("SPEED"), st.tuples(expressions), st.none(), speeds, span=X),
    st.builds(ast.Instruction, st.just("TYPE"), items, span=X),
    st.builds(ast.Instruction, st.just("SET"), st.tuples(reals), expressions, span=X),
    st.builds(ast.Instruction, st.just("BITS"), st.tuples(expressions, expressions), expressions, span=X),
    st.builds(ast.Instruction, st.just("CALL"), st.tuples(calls), span=X),
    st.builds(ast.Instruction, st.just("CALLS"), st.tuples(applied), span=X),
    st.builds(
        ast.Instruction,
        st.sampled_from(["AUTO", "LOCAL", "GLOBAL"]),
        st.lists(declared, min_size=1, max_size=3).map(tuple),
        st.none(),
        sorts,
        span=X,
    ),
    st.builds(ast.Instruction, st.just("SHIFT"), st.tuples(reals, expressions, expressions), span=X),
    st.builds(ast.Instruction, st.just("FRAME"), st.tuples(reals, expressions, expressions, expressions), span=X),
    st.builds(ast.Instruction, st.just("INVERSE"), st.tuples(reals), expressions, span=X),
    st.builds(
        ast.Instruction, st.just("IFSIG"), st.tuples(expressions, signals, signals, signals, label_numbers), span=X
    ),
    st.builds(ast.Instruction, st.just("ENABLE"), st.lists(words, min_size=1, max_size=3).map(tuple), span=X),
)
_statements = st.one_of(
    st.builds(ast.Assignment, _variables(expressions, grouped=False), expressions, span=X),
    instructions,
    st.builds(ast.Goto, labels, span=X),
    st.builds(ast.IfGoto, expressions, labels, span=X),
    st.builds(ast.IfGoto, relations, labels, st.just(True), span=X),
    st.builds(ast.If, expressions, span=X),
    st.builds(ast.Else, span=X),
    st.builds(ast.While, expressions, span=X),
    st.builds(ast.Do, span=X),
    st.builds(ast.Until, expressions, span=X),
    st.builds(ast.For, reals, expressions, expressions, st.one_of(st.none(), expressions), span=X),
    st.builds(ast.Case, expressions, span=X),
    st.builds(ast.Value, st.lists(expressions, min_size=1, max_size=3).map(tuple), span=X),
    st.builds(ast.Any, span=X),
    st.builds(ast.End, span=X),
)
statements = named(lambda: _statements)
comments = st.one_of(
    st.none(), st.text(alphabet=st.characters(min_codepoint=32, max_codepoint=126), max_size=12).map(str.rstrip)
)
steps = st.builds(ast.Step, st.one_of(st.none(), labels), st.one_of(st.none(), statements), comments, span=X)
parameters = st.lists(st.builds(ast.Variable, names, sigils, st.just(None), span=X), max_size=3).map(tuple)


def _without_blank_end(all_steps: list[ast.Step]) -> tuple[ast.Step, ...]:
    blank = ast.Step(None, None, None, span=NOWHERE)
    while all_steps and all_steps[-1] == blank:
        all_steps.pop()
    return tuple(all_steps)


_programs = st.builds(
    ast.Program, program_names, parameters, st.lists(steps, max_size=8).map(_without_blank_end), comments, span=X
)


programs = named(lambda: _programs)


def without_places(node: Any, groups: bool = True) -> Any:
    """A tree as plain tuples, with no spans in it, names and words as they are compared; without `groups`, wherever
    its source had parentheses.
    """
    if isinstance(node, tuple):
        return tuple(without_places(child, groups) for child in node)
    if not isinstance(node, msgspec.Struct):
        return node
    left_out = ("span",) if groups else ("span", "grouped")
    fields = {name: getattr(node, name) for name in node.__struct_fields__ if name not in left_out}
    if isinstance(fields.get("name"), str):
        fields["name"] = key_of(fields["name"])
    if isinstance(node, ast.BareWord):
        fields["text"] = node.text.upper()
    return (type(node).__name__, *(without_places(field, groups) for field in fields.values()))


def groups_in(node: Any) -> int:
    """How many parentheses the source of a tree has."""
    if isinstance(node, tuple):
        return sum(map(groups_in, node))
    if not isinstance(node, msgspec.Struct):
        return 0
    own = getattr(node, "grouped", False)
    return own + sum(groups_in(getattr(node, name)) for name in node.__struct_fields__)
