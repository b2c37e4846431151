"""Kinds of values, and the names of a program: which are reals, which transformations, which are read or assigned."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import NamedTuple

from vrs_cli.errors import IllegalArrayIndex, InvalidName, TypeMismatch
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Expression
from vrs_cli.language.text.printer import expression_text
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import RESERVED, why_reserved
from vrs_cli.language.words.values import NAME_LENGTH, SIGIL_KINDS, Kind
from vrs_cli.language.words.word import Shape
from vrs_cli.values.diagnostics import DiagnosticCollector

Kinds = frozenset[Kind]


ANY_KIND: Kinds = frozenset(Kind)


REAL: Kinds = frozenset({Kind.REAL})


STRING: Kinds = frozenset({Kind.STRING})


LOCATION: Kinds = frozenset({Kind.LOCATION})


PLACE: Kinds = frozenset({Kind.LOCATION, Kind.PRECISION})


PRINTED: Kinds = frozenset({Kind.REAL, Kind.STRING})


BARE: Kinds = frozenset({Kind.REAL, Kind.LOCATION})  # what a name without a sigil can be


# The arguments that are variables to be given a value.
VARIABLES: Mapping[Shape, Kinds] = {
    Shape.VARIABLE: PRINTED,
    Shape.REAL_VARIABLE: REAL,
    Shape.STRING_VARIABLE: STRING,
}


def kind_of(expression: Expression, of_variable: Callable[[ast.Variable], Kind | None]) -> Kind | None:
    """Return the kind of an expression, or None where `of_variable` knows none."""
    if isinstance(expression, ast.Variable):
        return of_variable(expression)
    if isinstance(expression, ast.Call):
        function = FUNCTIONS.get(expression.name)
        return function.result if function is not None else None
    if not isinstance(expression, ast.Binary):
        return CERTAIN.get(type(expression))
    if expression.operator == ":":
        return Kind.LOCATION
    sides = (kind_of(expression.left, of_variable), kind_of(expression.right, of_variable))
    return Kind.STRING if expression.operator == "+" and Kind.STRING in sides else Kind.REAL


CERTAIN: Mapping[type, Kind] = {ast.Number: Kind.REAL, ast.StringConstant: Kind.STRING, ast.Unary: Kind.REAL}


LONGEST_SHOWN = 40  # characters of an expression in a message

_ARTICLES = {
    Kind.REAL: "a real",
    Kind.STRING: "a string",
    Kind.LOCATION: "a transformation",
    Kind.PRECISION: "a precision point",
}


def with_article(kinds: Collection[Kind]) -> str:
    """`a transformation or a precision point`."""
    return " or ".join(_ARTICLES[kind] for kind in Kind if kind in kinds)


class Decided(NamedTuple):
    """The kind of a bare name, and the step that decides it (None: it has a value of that kind)."""

    kind: Kind
    step: int | None


class NameFindings(DiagnosticCollector):
    """The names met so far. `step` is where we are.

    `known`: the kinds of the variables that have a value. At the prompt they decide; a program may run when they have
    others, so there they only give rise to warnings. `kinds`: of the bare names whose use decides it. `given`: the keys
    that are given a value; `own`: those that AUTO or LOCAL declares; `first_read`: the first reading of each name.
    """

    def __init__(self, known: Mapping[str, Kind], parameters: Collection[str], *, at_prompt: bool) -> None:
        super().__init__()
        self.step = 0
        self.kinds: dict[str, Decided] = {}
        self.given: set[str] = set()
        self.own: set[str] = set()
        self._arrays: dict[str, bool] = {}  # of those: whether it is one, once that is known
        self.first_read: dict[str, ast.Variable] = {}
        self.parameters = parameters
        self.declared: dict[str, ast.Variable] = {}
        self._known = known
        self._at_prompt = at_prompt
        self._spellings: dict[str, str] = {}

    def without_value(self) -> list[ast.Variable]:
        """The first reading of each name that is given a value nowhere here."""
        return [
            variable
            for key, variable in self.first_read.items()
            if key not in self.given and (key not in self._known or key in self.own) and key not in self.parameters
        ]

    def declare(self, variable: ast.Variable, kind: Kind | None, *, own: bool) -> None:
        """AUTO, LOCAL (`own`) or GLOBAL; `kind`: of a bare name whose sort is said."""
        self.check(variable)
        self.declared[variable.key] = variable
        if own:
            self.own.add(variable.key)
            if variable.indexes is not None:
                self._arrays[variable.key] = True
        if kind is not None:
            self.kinds[variable.key] = Decided(kind, self.step)

    def met(self) -> set[str]:
        """The keys of all names."""
        return {*self.given, *self.first_read, *self.declared, *self.parameters}

    def check(self, variable: ast.Variable) -> None:
        """Report a name that cannot be used as a name."""
        word = variable.name.upper()
        if word in RESERVED and not variable.sigil:
            self.fault(InvalidName, variable.span, *why_reserved(word))
        if len(variable.name) > NAME_LENGTH:
            self._check_length(variable)
        if variable.key in self.own:
            self._check_declared(variable)

    def _check_declared(self, variable: ast.Variable) -> None:
        """A variable of AUTO or LOCAL is an array where it is declared or first used as one, and nothing else is."""
        array = self._arrays.setdefault(variable.key, variable.indexes is not None)
        if array is not (variable.indexes is not None):
            name = variable.sigil + variable.name
            detail, hint = f"{name} is an array of the program's own", f"give an index: {name}[1]"
            if not array:
                detail, hint = f"{name} is a variable of the program's own, no array", f"declare {name}[]"
            self.fault(IllegalArrayIndex, variable.span, detail, hint)

    def _check_length(self, variable: ast.Variable) -> None:
        name = variable.name.lower()
        before = self._spellings.setdefault(variable.key, name)
        if before != name:
            hint = f"the first {NAME_LENGTH} characters count"
            self.warn(InvalidName, variable.span, f"{variable.name} and {before} are the same name", hint)
            self._spellings[variable.key] = name

    def read(self, variable: ast.Variable, wanted: Kinds) -> Kind | None:
        """Note that a variable is read as one of the kinds. Return its kind if that is decided."""
        self.first_read.setdefault(variable.key, variable)
        return self._meet(variable, wanted)

    def define(self, variable: ast.Variable, wanted: Kinds) -> None:
        """Note that a variable is given a value of one of the kinds."""
        self.given.add(variable.key)
        self._meet(variable, wanted)

    def _meet(self, variable: ast.Variable, wanted: Kinds) -> Kind | None:
        kind = SIGIL_KINDS.get(variable.sigil)
        if kind is None:
            return self._decide(variable, wanted)
        if kind not in wanted:
            self.mismatch(variable, kind, wanted)
        return kind

    def _decide(self, variable: ast.Variable, wanted: Kinds) -> Kind | None:
        """Return the kind of a bare name. If nothing has decided it yet, this use does where it leaves one choice."""
        decided = self._decided(variable.key)
        if decided is None:
            choice = wanted & BARE
            if not choice:
                detail = f"{variable.name} is not {with_article(wanted)}"
                sigil = next((sigil for sigil, kind in SIGIL_KINDS.items() if kind in wanted), "")
                self.fault(TypeMismatch, variable.span, detail, f"{sigil}{variable.name} is one")
            if len(choice) != 1:
                return None
            decided = self.kinds[variable.key] = Decided(next(iter(choice)), self.step)
            self._compare(variable, decided.kind)
        if decided.kind not in wanted:
            self.mismatch(variable, decided.kind, wanted, decided.step)
        return decided.kind

    def _decided(self, key: str) -> Decided | None:
        """What the uses of a name have decided, or (at the prompt) its present value."""
        held = self._at_prompt and key in self._known
        return self.kinds.get(key) or (Decided(self._known[key], None) if held else None)

    def _compare(self, variable: ast.Variable, kind: Kind) -> None:
        """Warn if a variable of that name has a value of the other kind now."""
        now = self._known.get(variable.key, kind)
        if now is not kind and variable.key not in self.parameters and variable.key not in self.own:
            detail = f"{variable.name} is used as {_ARTICLES[kind]}, and has the value of {_ARTICLES[now]} now"
            self.warn(TypeMismatch, variable.span, detail)

    def certain_kind(self, variable: ast.Variable) -> Kind | None:
        """Return the kind of a variable as far as it is certain."""
        decided = self._decided(variable.key)
        return SIGIL_KINDS.get(variable.sigil) or (decided.kind if decided is not None else None)

    def mismatch(self, expression: Expression, kind: Kind, wanted: Kinds, step: int | None = None) -> None:
        """Report an expression of a kind that is not wanted. `step`: the one that decided the kind."""
        text = expression_text(expression)
        shown = text if len(text) <= LONGEST_SHOWN else "this"
        since = f" since step {step}" if step not in (None, self.step) else ""
        detail = f"{shown} is {_ARTICLES[kind]}{since}"
        self.fault(TypeMismatch, expression.span, detail, f"{with_article(wanted)} is wanted")
