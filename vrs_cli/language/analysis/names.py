"""Find the kinds of a program's names: which names are reals or transformations, which are read or set, and which are
private to the program.

AUTO creates a set of variables for each activation of a program. LOCAL creates one set for the program, whose values
are kept between calls. All other variables are global; GLOBAL declares this explicitly. Declarations must precede all
other steps (V+ Language User's Guide p.36; val2 section 1).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from enum import Enum
from functools import cached_property
from itertools import takewhile
from typing import NamedTuple, TypeGuard

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.errors import (
    ArgumentMismatch,
    CannotInterpret,
    IllegalArrayIndex,
    InvalidName,
    MisplacedDeclaration,
    TypeMismatch,
)
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Expression, Program
from vrs_cli.language.text.printer import expression_text
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import DECLARATIONS, INSTRUCTIONS, RESERVED, why_reserved
from vrs_cli.language.words.values import NAME_LENGTH, SIGIL_KINDS, Kind
from vrs_cli.language.words.word import Shape
from vrs_cli.values.diagnostics import Diagnostic, DiagnosticCollector, Severity


class BlockKind(Enum):
    IF = "IF"
    WHILE = "WHILE"
    DO = "DO"
    FOR = "FOR"
    CASE = "CASE"


class Block(Struct, frozen=True):
    """A control structure. Its fields are step indexes, counted from 0. `middles`: the steps ELSE, or VALUE and ANY;
    `closer`: the step END or UNTIL."""

    kind: BlockKind
    opener: int
    middles: tuple[int, ...]
    closer: int


LABELLED: Mapping[str, int] = {
    row.name: len(row.arguments) for row in INSTRUCTIONS.values() if row.form.endswith(" label")
}  # number of arguments of each instruction whose last argument is a label
LOOPS = frozenset({BlockKind.WHILE, BlockKind.DO, BlockKind.FOR})


def loops_of(statement: ast.Instruction) -> int:
    """Return the number of loops that EXIT or NEXT leaves: 1 if no number is given, 0 if it is not a whole number above
    0."""
    given = statement.arguments[0] if statement.arguments else None
    number = 1.0 if given is None else given.value if isinstance(given, ast.Number) else 0.0
    return int(number) if number >= 1 and number.is_integer() else 0


def label_of(statement: ast.Statement) -> int | None:
    """Return the label to which a statement may jump: GOTO, IF ... GOTO, and instructions with a label (IFSIG,
    GRASP)."""
    if isinstance(statement, ast.Goto | ast.IfGoto):
        return statement.label
    if not isinstance(statement, ast.Instruction) or statement.word not in LABELLED:
        return None
    last = statement.arguments[-1] if len(statement.arguments) >= LABELLED[statement.word] else None
    return int(last.value) if isinstance(last, ast.Number) else None


class Own(Struct, frozen=True, dict=True):
    """A variable that belongs to the program itself. `automatic`: AUTO declares it; `array`: it is declared as an
    array, or used as one first."""

    variable: ast.Variable
    automatic: bool
    array: bool

    @cached_property
    def key(self) -> str:
        return self.variable.key


class Analysis(Struct, frozen=True):
    """The facts about a program that its text alone determines, and its findings.

    `kinds`: REAL or LOCATION for each bare name (`Variable.key`), parameters included, whose kind follows from its use.
    `labels`: the step index of each label. `own`: the variables of AUTO and LOCAL. The findings also depend on other
    names and programs in memory, which are given by their keys. `needs`: names to which other programs must assign a
    value. `calls`: the programs that are called. `functions`: functions in this program that may be variables in other
    programs. `alone`: variables that are reported unless other programs use them.
    """

    program: Program
    kinds: Mapping[str, Kind]
    blocks: tuple[Block, ...]
    labels: Mapping[int, int]
    diagnostics: tuple[Diagnostic, ...]
    needs: frozenset[str] = frozenset()
    calls: frozenset[str] = frozenset()
    functions: frozenset[str] = frozenset()
    alone: frozenset[str] = frozenset()
    own: tuple[Own, ...] = ()

    @property
    def executable(self) -> bool:
        return not any(diagnostic.severity is Severity.ERROR for diagnostic in self.diagnostics) and not any(
            isinstance(step.statement, ast.BadLine) for step in self.program.steps
        )


# --- kinds -------------------------------------------------------------------------------------------------------

Kinds = frozenset[Kind]

ANY_KIND: Kinds = frozenset(Kind)
REAL: Kinds = frozenset({Kind.REAL})
STRING: Kinds = frozenset({Kind.STRING})
LOCATION: Kinds = frozenset({Kind.LOCATION})
PLACE: Kinds = frozenset({Kind.LOCATION, Kind.PRECISION})
PRINTED: Kinds = frozenset({Kind.REAL, Kind.STRING})
BARE: Kinds = frozenset({Kind.REAL, Kind.LOCATION})  # the kinds of a name without a sigil

# The shapes of arguments that are variables to set, and the kinds that such a variable may have.
VARIABLES: Mapping[Shape, Kinds] = {
    Shape.VARIABLE: PRINTED,
    Shape.REAL_VARIABLE: REAL,
    Shape.STRING_VARIABLE: STRING,
}
CERTAIN: Mapping[type, Kind] = {ast.Number: Kind.REAL, ast.StringConstant: Kind.STRING, ast.Unary: Kind.REAL}


def kind_of(expression: Expression, of_variable: Callable[[ast.Variable], Kind | None]) -> Kind | None:
    """Return the kind of an expression, or None if it depends on a variable whose kind `of_variable` does not know."""
    match expression:
        case ast.Variable():
            return of_variable(expression)
        case ast.Call():
            function = FUNCTIONS.get(expression.name)
            return function.result if function is not None else None
        case ast.Binary(operator=":"):
            return Kind.LOCATION
        case ast.Binary():
            sides = (kind_of(expression.left, of_variable), kind_of(expression.right, of_variable))
            return Kind.STRING if expression.operator == "+" and Kind.STRING in sides else Kind.REAL
    return CERTAIN.get(type(expression))


_ARTICLES = {
    Kind.REAL: "a real",
    Kind.STRING: "a string",
    Kind.LOCATION: "a transformation",
    Kind.PRECISION: "a precision point",
}


_SAMPLES = {Kind.REAL: "x", Kind.STRING: "$s", Kind.LOCATION: "p", Kind.PRECISION: "#p"}
_EXAMPLES: Mapping[tuple[Kind, Kinds], str] = {  # hints, by an expression's kind and the required kinds
    (Kind.REAL, STRING): "$ENCODE(NAME) is one",
    (Kind.REAL, PLACE): "TRANS(x, y, z) is one",
    (Kind.REAL, LOCATION): "TRANS(x, y, z) is one",
    (Kind.STRING, PLACE): "a name stands without quotes",
    (Kind.STRING, LOCATION): "a name stands without quotes",
    (Kind.STRING, REAL): "VAL(NAME) is one",
    (Kind.LOCATION, REAL): "DX(NAME) is one; SHIFT(NAME BY 0, 0, 50) is a place 50 mm higher",
    (Kind.PRECISION, LOCATION): "HERE p keeps the place where the arm stands as one",
    (Kind.PRECISION, REAL): "DECOMPOSE j[1] = NAME gives its joints",
}


def with_article(kinds: Collection[Kind]) -> str:
    """Return kinds in words with their articles: `a transformation or a precision point`."""
    return " or ".join(_ARTICLES[kind] for kind in Kind if kind in kinds)


# --- the variables of AUTO and LOCAL -----------------------------------------------------------------------------

SORTS: Mapping[str, Kind] = {"REAL": Kind.REAL, "DOUBLE": Kind.REAL, "LOC": Kind.LOCATION}


def declares(statement: ast.Statement | None) -> TypeGuard[ast.Instruction]:
    """Return whether a statement is AUTO, LOCAL or GLOBAL."""
    return isinstance(statement, ast.Instruction) and statement.word in DECLARATIONS


def own_variables(program: Program) -> tuple[Own, ...]:
    """Return the variables of AUTO and LOCAL, each name once, in the order of the program.

    A variable that is declared without an index is an array if the first step that uses it gives it an index.
    """
    found: dict[str, Own] = {}
    first = takewhile(lambda one: declares(one) or isinstance(one, ast.BadLine), program.statements)
    for statement in filter(declares, first):
        for argument in statement.arguments:
            if isinstance(argument, ast.Variable) and statement.word != "GLOBAL":
                found.setdefault(argument.key, Own(argument, statement.word == "AUTO", argument.indexes is not None))
    for parameter in program.parameters:
        found.pop(parameter.key, None)
    plain = {key for key, own in found.items() if not own.array}
    for node in ast.nodes(tuple(one for one in program.statements if not declares(one)) if plain else ()):
        if isinstance(node, ast.Variable) and node.key in plain:
            plain.discard(node.key)
            found[node.key] = replace(found[node.key], array=node.indexes is not None)
    return tuple(found.values())


# --- the names of a program --------------------------------------------------------------------------------------

MAX_SHOWN_CHARS = 40  # maximum number of characters of an expression in a message


class Decision(NamedTuple):
    """The kind of a name, and the step that decides it (None if the sigil or the present value decides it)."""

    kind: Kind
    step: int | None


class NameFindings(DiagnosticCollector):
    """A collector of the names of a program. `step`: the index of the present step.

    `known`: the kinds of variables that have a value. At the prompt these kinds are binding. A program may later run
    with other values, so there they only cause warnings. `kinds`: the kinds of bare names that their use decides.
    `given`: the keys of names that are assigned; `passed`: the keys of names that are passed to a program; `own`: the
    keys of AUTO and LOCAL variables; `first_read`: the first use of each name as a value; `assigned`: the first
    assignment to each simple bare name; `functions`: the first call of each function that could be a variable.
    """

    def __init__(self, known: Mapping[str, Kind], parameters: Iterable[ast.Variable], *, at_prompt: bool) -> None:
        super().__init__()
        self.step = 0
        self.kinds: dict[str, Decision] = {}
        self.given: set[str] = set()
        self.passed: set[str] = set()
        self.own: set[str] = set()
        self._arrays: dict[str, bool] = {}  # whether an own variable is an array, if known
        self.first_read: dict[str, ast.Variable] = {}
        self.assigned: dict[str, ast.Variable] = {}
        self.functions: dict[str, ast.Call] = {}
        self.typed: set[str] = set()  # keys of the variables that TYPE shows
        self.parameters = {parameter.key for parameter in parameters}
        self.declared: set[str] = set()
        self._declared_by: dict[str, str] = {}  # keyword of the first declaration of a name, right or wrong
        self._declarations_over = False
        self._known = known
        self._at_prompt = at_prompt
        self._spellings: dict[str, str] = {}

    def without_value(self) -> list[ast.Variable]:
        """Return the first use as a value of each name that this program never assigns."""
        return [
            variable
            for key, variable in self.first_read.items()
            if key not in self.given and (key not in self._known or key in self.own) and key not in self.parameters
        ]

    def check(self, variable: ast.Variable) -> None:
        """Report a name that is not allowed, and an AUTO or LOCAL variable that is used both as an array and as a
        simple variable."""
        word, key, is_array = variable.name.upper(), variable.key, variable.indexes is not None
        if word in RESERVED and not variable.sigil:
            self.fault(InvalidName, variable.span, *why_reserved(word))
        if len(word) > NAME_LENGTH:
            before = self._spellings.get(key, word.lower())
            self._spellings[key] = word.lower()
            if before != word.lower():
                hint = f"the first {NAME_LENGTH} characters count"
                self.warn(InvalidName, variable.span, f"{variable.name} and {before} are the same name", hint)
        if key in self.own and self._arrays.setdefault(key, is_array) is not is_array:
            name = variable.sigil + variable.name
            what = "a variable of the program's own, no array" if is_array else "an array of the program's own"
            hint = f"declare {name}[]" if is_array else f"give an index: {name}[1]"
            self.fault(IllegalArrayIndex, variable.span, f"{name} is {what}", hint)

    # --- declarations ---

    def check_declaration(self, statement: ast.Instruction) -> None:
        """Check AUTO, LOCAL or GLOBAL, and record the variables that it declares."""
        if self._declarations_over:
            self.fault(
                MisplacedDeclaration,
                statement.span,
                f"{statement.word} stands after a step that does something",
                "declarations begin a program",
            )
        for argument in statement.arguments:
            if isinstance(argument, ast.Variable):
                self._check_declared(argument, statement)
                self._declared_by.setdefault(argument.key, statement.word)
            elif argument is not None:
                self.fault(InvalidName, argument.span, "a variable is wanted here")

    def _check_declared(self, variable: ast.Variable, statement: ast.Instruction) -> None:
        name, key, sort = variable.sigil + variable.name, variable.key, statement.modifiers.sort
        kind = None if sort is None else SORTS[sort]
        if key in self.parameters:
            self.fault(ArgumentMismatch, variable.span, f"{name} is a parameter of the program")
        elif key in self._declared_by:
            self.fault(InvalidName, variable.span, f"{name} is in {self._declared_by[key]} too")
        elif not all(isinstance(index, ast.Number) for index in variable.indexes or ()):
            self.fault(
                CannotInterpret,
                variable.span,
                "the size of an array is a number, or left out",
                f"{statement.word} {name}[]",
            )
        else:
            if variable.sigil and kind not in (None, Kind.LOCATION):  # with LOC a sigil is allowed
                self.fault(TypeMismatch, variable.span, f"{name} is a {SIGIL_KINDS[variable.sigil].value}, not {sort}")
            self.check(variable)
            self.declared.add(key)
            if statement.word != "GLOBAL":
                self.own.add(key)
                if variable.indexes is not None:
                    self._arrays[key] = True
            if kind is not None and not variable.sigil:
                self.kinds[key] = Decision(kind, self.step)

    # --- kinds of names ---

    def read(self, variable: ast.Variable, wanted: Kinds) -> Kind | None:
        """Record that a variable is read as one of these kinds. Return its kind if it is decided."""
        self.first_read.setdefault(variable.key, variable)
        return self._decide(variable, wanted)

    def define(self, variable: ast.Variable, wanted: Kinds) -> None:
        """Record that a variable is assigned a value of one of these kinds."""
        self.given.add(variable.key)
        self._decide(variable, wanted, is_read=False)

    def _decide(self, variable: ast.Variable, wanted: Kinds, *, is_read: bool = True) -> Kind | None:
        """Return the kind of a name. A use that allows only one kind decides an undecided name. Warn if the present
        value has the other kind."""
        key, name = variable.key, variable.name
        if (decided := self._decision(variable)) is None:
            choice = wanted & BARE
            if not choice:
                sigil = next((sigil for sigil, kind in SIGIL_KINDS.items() if kind in wanted), "")
                hint = f"{sigil}{name} is one" + (f', "{name}" is a text' if sigil == "$" else "")
                self.fault(TypeMismatch, variable.span, f"{name} is not {with_article(wanted)}", hint)
            if len(choice) != 1:
                return None
            decided = self.kinds[key] = Decision(next(iter(choice)), self.step)
            now = self._known.get(key, decided.kind)
            if now is not decided.kind and key not in self.parameters and key not in self.own:
                self.warn(
                    TypeMismatch,
                    variable.span,
                    f"{name} is used as {_ARTICLES[decided.kind]}, and has the value of {_ARTICLES[now]} now",
                )
        if decided.kind not in wanted:
            self.mismatch(variable, decided.kind, wanted, decided.step, is_read=is_read)
        return decided.kind

    def _decision(self, variable: ast.Variable) -> Decision | None:
        """Return the kind of a name that its sigil, its uses or (at the prompt) its present value decide; None if it is
        undecided."""
        if variable.key in self.kinds:
            return self.kinds[variable.key]
        kind = SIGIL_KINDS.get(variable.sigil) or (self._known.get(variable.key) if self._at_prompt else None)
        return None if kind is None else Decision(kind, None)

    def mismatch(
        self, expression: Expression, kind: Kind, wanted: Kinds, step: int | None = None, *, is_read: bool = True
    ) -> None:
        """Report an expression of a wrong kind. `step`: the step that decided the kind."""
        text = expression_text(expression)
        shown = text if len(text) <= MAX_SHOWN_CHARS else "this"
        since = f" since step {step}" if step not in (None, self.step) else ""
        hint = f"{with_article(wanted)} is wanted"
        example = _EXAMPLES.get((kind, wanted), "") if is_read else ""
        example = example.replace(
            "NAME", shown if isinstance(expression, ast.Variable | ast.Number | ast.StringConstant) else _SAMPLES[kind]
        )
        self.fault(
            TypeMismatch,
            expression.span,
            f"{shown} is {_ARTICLES[kind]}{since}",
            f"{hint}: {example}" if example else hint,
        )
