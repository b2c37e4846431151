"""Find out about the names in a program: whether each is a real or a transformation, whether it is read or set, and
whether it is private to the program.

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
    """A control structure. `opener`: the index (from 0) of its first step; `middles`: the indexes of its ELSE, or VALUE
    and ANY steps; `closer`: the index of its END or UNTIL step."""

    kind: BlockKind
    opener: int
    middles: tuple[int, ...]
    closer: int


LABELLED: Mapping[str, int] = {
    row.name: len(row.arguments) for row in INSTRUCTIONS.values() if row.form.endswith(" label")
}  # instructions whose last argument is a label, with the number of their arguments
LOOPS = frozenset({BlockKind.WHILE, BlockKind.DO, BlockKind.FOR})


def loops_of(statement: ast.Instruction) -> int:
    """Return the number after EXIT or NEXT, which counts loops outward: 1 if it is omitted, 0 if it is not a whole
    number above 0."""
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
    """A private variable of a program. `automatic`: AUTO declares it (otherwise LOCAL); `array`: it is declared as an
    array, or the first step that uses it gives it an index."""

    variable: ast.Variable
    automatic: bool
    array: bool

    @cached_property
    def key(self) -> str:
        return self.variable.key


class Analysis(Struct, frozen=True):
    """The result of analyzing a program.

    `kinds`: REAL or LOCATION for each bare name (`Variable.key`), parameters included, whose kind follows from its use.
    `labels`: the step index of each label. `own`: the variables declared by AUTO and LOCAL. The `diagnostics` also
    depend on the memory around the program; these fields give the keys of the variables and programs that matter.
    `needs`: variables that get their values outside the program. `calls`: the programs that it calls. `functions`:
    functions that it uses and that may be variables in other programs. `alone`: variables with a warning that is
    dropped if other programs use them.
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

# The kinds that a variable may have as an argument that an instruction sets, by the argument's shape in the tables.
VARIABLES: Mapping[Shape, Kinds] = {
    Shape.VARIABLE: PRINTED,
    Shape.REAL_VARIABLE: REAL,
    Shape.STRING_VARIABLE: STRING,
}
CERTAIN: Mapping[type, Kind] = {ast.Number: Kind.REAL, ast.StringConstant: Kind.STRING, ast.Unary: Kind.REAL}


def kind_of(expression: Expression, of_variable: Callable[[ast.Variable], Kind | None]) -> Kind | None:
    """Return the kind of an expression, or None if it is unknown. `of_variable`: returns the kind of a variable, or
    None."""
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
_EXAMPLES: Mapping[tuple[Kind, Kinds], str] = {  # hints, by the kind of an expression and the kinds required there
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
    """Return the names of kinds with their articles, for a message: `a transformation or a precision point`."""
    return " or ".join(_ARTICLES[kind] for kind in Kind if kind in kinds)


# --- private variables (declared by AUTO and LOCAL) --------------------------------------------------------------

SORTS: Mapping[str, Kind] = {"REAL": Kind.REAL, "DOUBLE": Kind.REAL, "LOC": Kind.LOCATION}


def declares(statement: ast.Statement | None) -> TypeGuard[ast.Instruction]:
    """Return whether a statement is AUTO, LOCAL or GLOBAL."""
    return isinstance(statement, ast.Instruction) and statement.word in DECLARATIONS


def own_variables(program: Program) -> tuple[Own, ...]:
    """Return the variables that AUTO and LOCAL declare, in the order of the program; parameters are left out."""
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

MAX_SHOWN_CHARS = 40  # a message shows an expression up to this length; a longer one is called "this"


class Decision(NamedTuple):
    """The kind of a name, and the number of the step that decides it (None if the sigil or the current value does)."""

    kind: Kind
    step: int | None


class NameFindings(DiagnosticCollector):
    """A collector of facts about the names in a program. `step`: the number of the step being checked, from 1.

    `known`: the kinds of the variables that have a value, by key. A use as another kind is an error at the prompt, but
    only a warning in a program, which may later run with other values. `kinds`: the kinds of bare names, decided by
    their use. Sets of keys are `given` (variables that are assigned), `passed` (variables that are passed to a
    program), `own` (AUTO and LOCAL variables) and `declared` (GLOBAL variables too). By key: `first_read` (the first
    use of a variable as a value), `assigned` (the target of the first assignment to a simple bare name) and `functions`
    (the first call of a function whose name could be a variable).
    """

    def __init__(self, known: Mapping[str, Kind], parameters: Iterable[ast.Variable], *, at_prompt: bool) -> None:
        super().__init__()
        self.step = 0
        self.kinds: dict[str, Decision] = {}
        self.given: set[str] = set()
        self.passed: set[str] = set()
        self.own: set[str] = set()
        self._arrays: dict[str, bool] = {}  # whether a private variable is an array, by key, once this is known
        self.first_read: dict[str, ast.Variable] = {}
        self.assigned: dict[str, ast.Variable] = {}
        self.functions: dict[str, ast.Call] = {}
        self.typed: set[str] = set()  # keys of the variables that TYPE shows
        self.parameters = {parameter.key for parameter in parameters}
        self.declared: set[str] = set()
        self._declared_by: dict[str, str] = {}  # keyword of the first declaration of a name, even if it has a mistake
        self._declarations_over = False
        self._known = known
        self._at_prompt = at_prompt
        self._spellings: dict[str, str] = {}

    def without_value(self) -> list[ast.Variable]:
        """Return the first use of each variable that is read but never assigned here, and is neither a parameter nor a
        global variable that has a value."""
        return [
            variable
            for key, variable in self.first_read.items()
            if key not in self.given and (key not in self._known or key in self.own) and key not in self.parameters
        ]

    def check(self, variable: ast.Variable) -> None:
        """Report a variable with a reserved name, two long names that count as the same, and a private variable used
        both as an array and as a simple variable."""
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
            if variable.sigil and kind not in (None, Kind.LOCATION):  # LOC may precede a name with a sigil: LOC #p
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
        """Record that a variable is read where only the kinds `wanted` are allowed. Return its kind, or None if it is
        still undecided."""
        self.first_read.setdefault(variable.key, variable)
        return self._decide(variable, wanted)

    def define(self, variable: ast.Variable, wanted: Kinds) -> None:
        """Record that a variable is assigned a value that has one of the kinds `wanted`."""
        self.given.add(variable.key)
        self._decide(variable, wanted, is_read=False)

    def _decide(self, variable: ast.Variable, wanted: Kinds, *, is_read: bool = True) -> Kind | None:
        """Return the kind of a variable, or None if it is still undecided. A use that allows only one kind decides it.
        Report a use that does not allow the kind, and warn if the variable's current value has the other kind."""
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
        """Return the kind of a variable, decided by its sigil, by an earlier use or (at the prompt) by its current
        value; None if it is undecided."""
        if variable.key in self.kinds:
            return self.kinds[variable.key]
        kind = SIGIL_KINDS.get(variable.sigil) or (self._known.get(variable.key) if self._at_prompt else None)
        return None if kind is None else Decision(kind, None)

    def mismatch(
        self, expression: Expression, kind: Kind, wanted: Kinds, step: int | None = None, *, is_read: bool = True
    ) -> None:
        """Report an expression whose kind is not one of `wanted`. `step`: the number of the step that decided the kind;
        `is_read`: the expression is read, not assigned, so that the hint can give an example."""
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
