"""The command analyzer: is a program, or a line, one that can be carried out? All findings at once, none raised.

It decides from its use whether a bare name is a real or a transformation, and checks every instruction against its row
of the tables.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

from vrs_cli.errors import (
    AmbiguousGrouping,
    ArgumentMismatch,
    CannotInterpret,
    IllegalAssignment,
    IllegalExpression,
    InvalidName,
    NotAvailable,
    TypeMismatch,
    UndefinedName,
    UndefinedValue,
    UnknownKeyword,
    VrsError,
)
from vrs_cli.language import ast
from vrs_cli.language.ast import NAME_LENGTH, BadLine, Expression, Kind, Program, Span, Statement
from vrs_cli.language.diagnostics import Diagnostic, Severity, did_you_mean, error, warning
from vrs_cli.language.functions import FUNCTIONS
from vrs_cli.language.grouping import val_grouping
from vrs_cli.language.instructions import CONNECTIVES, INSTRUCTIONS, OPERATOR_WORDS, PROGRAM_WORDS
from vrs_cli.language.monitor import COMMANDS
from vrs_cli.language.precedence import LOGICAL, RELATIONS
from vrs_cli.language.structure import Block, BlockKind, structure_of
from vrs_cli.language.words import Argument, Shape, State, Word

__all__ = ["Analysis", "Block", "BlockKind", "analyze", "check_line", "is_reserved"]


@dataclass(frozen=True)
class Analysis:
    """A program with what its text decides.

    `kinds`: REAL or LOCATION for each bare name (`Variable.key`) whose use decides it, parameters included.
    `labels`: step index of each label.
    """

    program: Program
    kinds: Mapping[str, Kind]
    blocks: tuple[Block, ...]
    labels: Mapping[int, int]
    diagnostics: tuple[Diagnostic, ...]

    @property
    def executable(self) -> bool:
        unread = any(isinstance(step.statement, BadLine) for step in self.program.steps)
        return not unread and all(found.severity is not Severity.ERROR for found in self.diagnostics)


def analyze(
    program: Program, known: Mapping[str, Kind] | None = None, programs: Mapping[str, Program] | None = None
) -> Analysis:
    """A whole program. `known`: the kinds of the variables that have a value; `programs`: those in memory, by key."""
    structure = structure_of(program)
    checker = _Checker(known or {}, programs or {}, program)
    for index, step in enumerate(program.steps):
        if step.statement is not None:
            checker.statement(index + 1, step.statement)
    checker.finish()
    diagnostics = sorted(
        (*structure.diagnostics, *checker.diagnostics), key=lambda one: (one.span.line, one.span.column)
    )
    return Analysis(program, checker.decided(), structure.blocks, structure.labels, tuple(diagnostics))


def check_line(
    statement: Statement | ast.ProgramHeader, known: Mapping[str, Kind] | None = None, *, in_program: bool = False
) -> tuple[Diagnostic, ...]:
    """A line of the prompt, or (`in_program`) a step by itself, whose block and labels cannot be seen."""
    checker = _Checker(known or {}, None, None)
    if isinstance(statement, ast.ProgramHeader):
        checker.header(statement.parameters)
    elif in_program:
        checker.statement(1, statement)
    else:
        checker.command(statement)
    return tuple(checker.diagnostics)


def is_reserved(name: str) -> bool:
    """Whether a bare name is a word of the language. Words that only the first VAL had are free."""
    return name.upper() in _RESERVED


def _reserved() -> Iterator[str]:
    yield from CONNECTIVES | OPERATOR_WORDS
    yield from (name for name, row in PROGRAM_WORDS.items() if "2" in row.where or "+" in row.where)
    yield from (name for name in FUNCTIONS if name[0] not in "#$")


_RESERVED = frozenset(_reserved())

_ANY_KIND = frozenset(Kind)
_REAL = frozenset({Kind.REAL})
_STRING = frozenset({Kind.STRING})
_LOCATION = frozenset({Kind.LOCATION})
_PLACE = frozenset({Kind.LOCATION, Kind.PRECISION})
_PRINTED = frozenset({Kind.REAL, Kind.STRING})
_BARE = frozenset({Kind.REAL, Kind.LOCATION})
_SIGIL_KINDS = {"#": Kind.PRECISION, "$": Kind.STRING}
_ARTICLES = {
    Kind.REAL: "a real",
    Kind.STRING: "a string",
    Kind.LOCATION: "a transformation",
    Kind.PRECISION: "a precision point",
}


class _Decided(NamedTuple):
    """The kind of a bare name, and the step that decides it (None: it has a value of that kind)."""

    kind: Kind
    step: int | None


def _kinds_text(kinds: Collection[Kind]) -> str:
    return " or ".join(_ARTICLES[kind] for kind in Kind if kind in kinds)


class _Checker:
    """One pass over the steps. `programs` and `program` are None for a line of the prompt."""

    def __init__(
        self, known: Mapping[str, Kind], programs: Mapping[str, Program] | None, program: Program | None
    ) -> None:
        self.diagnostics: list[Diagnostic] = []
        self._known = known
        self._programs = programs
        self._program = program
        self._step = 0
        self._kinds: dict[str, _Decided] = {}
        self._names: dict[str, str] = {}
        self._read: dict[str, ast.Variable] = {}
        self._given: set[str] = set()
        self._logical = False
        self._parameters = {variable.key for variable in program.parameters} if program else set()
        if program is not None:
            self.header(program.parameters)

    def decided(self) -> Mapping[str, Kind]:
        """REAL or LOCATION by key, of the bare names of this program."""
        return {key: decided.kind for key, decided in self._kinds.items() if decided.step is not None}

    def finish(self) -> None:
        """What only the end of the program shows: names that are given a value nowhere."""
        unknown = [key for key in self._read if key not in self._given and key not in self._known]
        unknown = [key for key in unknown if key not in self._parameters]
        if not unknown:
            return
        elsewhere = frozenset[str]().union(*(_given_in(_Same(program)) for program in self._others()))
        candidates = [*self._given, *self._known, *elsewhere]
        for key in unknown:
            if key not in elsewhere:
                variable = self._read[key]
                hint = did_you_mean(key, (name for name in candidates if name[:1] == key[:1] or name.isalnum()))
                detail = f"{variable.sigil}{variable.name} is given a value nowhere"
                self._warn(UndefinedValue, variable.span, detail, hint)

    def _others(self) -> Iterable[Program]:
        own = self._program.key if self._program is not None else ""
        return (program for key, program in (self._programs or {}).items() if key != own)

    # --- findings ---

    def _fault(self, kind: type[VrsError], span: Span, detail: str, hint: str = "") -> None:
        self.diagnostics.append(error(kind, span, detail, hint))

    def _warn(self, kind: type[VrsError], span: Span, detail: str, hint: str = "") -> None:
        self.diagnostics.append(warning(kind, span, detail, hint))

    # --- lines ---

    def header(self, parameters: Sequence[ast.Variable]) -> None:
        """The parameters of a program."""
        for parameter in parameters:
            self._check_name(parameter)
            if parameter.indexes:
                self._fault(CannotInterpret, parameter.span, "a parameter has no index", "write name, or name[]")
        keys = [parameter.key for parameter in parameters]
        for place, parameter in enumerate(parameters):
            if parameter.key in keys[:place]:
                self._fault(ArgumentMismatch, parameter.span, f"{parameter.name} is there twice")

    def statement(self, step: int, statement: Statement) -> None:
        """A step of a program."""
        self._step = step
        check = _STATEMENTS.get(type(statement))
        if check is not None:
            check(self, statement)

    def command(self, statement: Statement) -> None:
        """A line of the prompt."""
        inner = statement.statement if isinstance(statement, ast.DoInstruction) else statement
        if inner is None:
            return
        if isinstance(inner, ast.Instruction):
            table = COMMANDS if inner is statement and inner.word in COMMANDS else INSTRUCTIONS
            self._instruction(inner, table)
        elif isinstance(inner, ast.Assignment):
            self._assignment(inner)
        else:
            hint = ".PROGRAM name begins one"
            self._fault(CannotInterpret, statement.span, "this works in programs only", hint)

    def _assignment(self, statement: ast.Assignment) -> None:
        target, value = statement.target, statement.value
        self._check_name(target)
        self._indexes(target)
        if target.indexes == ():
            self._fault(IllegalAssignment, target.span, f"{target.name}[] is a whole array", "assign its elements")
        wanted = _STRING if target.sigil == "$" else _REAL
        if target.sigil == "#" or (not target.sigil and self._peek(value) in _PLACE):
            name = target.sigil + target.name
            self._fault(IllegalAssignment, target.span, "a location is assigned by SET", f"SET {name} = ...")
            wanted = _PLACE
        self._root(value, wanted)
        self._define(target, Kind.REAL if wanted is _REAL else None)

    def _condition(self, statement: ast.If | ast.IfGoto | ast.While | ast.Until) -> None:
        self._root(statement.condition, _REAL)

    def _for(self, statement: ast.For) -> None:
        self._check_name(statement.variable)
        self._indexes(statement.variable)
        for limit in (statement.first, statement.last, statement.step):
            if limit is not None:
                self._root(limit, _REAL)
        if statement.variable.sigil:
            self._mismatch(statement.variable, _SIGIL_KINDS[statement.variable.sigil], _REAL)
        self._define(statement.variable, Kind.REAL)

    def _case(self, statement: ast.Case) -> None:
        self._root(statement.subject, _REAL)

    def _value(self, statement: ast.Value) -> None:
        for test in statement.tests:
            self._root(test, _REAL)

    def _any_instruction(self, statement: ast.Instruction) -> None:
        self._instruction(statement, INSTRUCTIONS)

    def _instruction(self, statement: ast.Instruction, table: Mapping[str, Word]) -> None:
        row = table.get(statement.word)
        if row is None:
            self._fault(CannotInterpret, statement.span, f"{statement.word} is no instruction")
        elif row.state is not State.SUPPORTED:
            self._refused(statement.span, row.name, row.state, row.summary, row.note)
        else:
            self._count(statement, row)
            self._operands(statement, row)

    def _refused(self, span: Span, name: str, state: State, summary: str, note: str = "") -> None:
        what = f"{name} is {state.value}" if state is State.PLANNED else f"{name}: {summary}"
        self._fault(NotAvailable, span, what, note or ("" if what.endswith(summary) else summary))

    def _count(self, statement: ast.Instruction, row: Word) -> None:
        """Whether every argument that is needed is there, and none too many."""
        hint = f"the form is {row.form}"
        given = statement.arguments
        end = Span(statement.span.line, statement.span.end, statement.span.end + 1)
        for place, argument in enumerate(row.arguments):
            if not argument.optional and (place >= len(given) or given[place] is None):
                self._fault(CannotInterpret, end, f"{row.name}: {argument.name} is missing", hint)
                break
        last = row.value if row.value is not None and row.value.repeated else None
        if len(given) > len(row.arguments) and not row.repeats and last is None:
            extra = given[len(row.arguments)]
            span = extra.span if extra is not None else end
            self._fault(CannotInterpret, span, f"{row.name}: too many arguments", hint)
        if row.value is not None and not row.value.optional and statement.value is None:
            self._fault(CannotInterpret, end, f"{row.name}: = {row.value.name} is missing", hint)

    def _operands(self, statement: ast.Instruction, row: Word) -> None:
        """The value is read before what it defines."""
        if statement.value is not None and row.value is not None:
            self._shaped(statement.value, row.value)
        modifiers = statement.modifiers
        for stamp in (modifiers.at, modifiers.within):
            if stamp is not None:
                self._root(stamp, _REAL)
        for place, expression in enumerate(statement.arguments):
            argument = _argument_at(row, place)
            if expression is not None and argument is not None:
                self._shaped(expression, argument)

    # --- arguments, by their shape ---

    def _shaped(self, expression: Expression, argument: Argument) -> None:
        wanted = _VALUES.get(argument.shape)
        if wanted is not None:
            self._root(expression, wanted)
        else:
            _SHAPES[argument.shape](self, expression)

    def _item(self, expression: Expression) -> None:
        if isinstance(expression, ast.Format):
            self._format(expression)
        else:
            self._root(expression, _ANY_KIND)

    def _format(self, format_code: ast.Format) -> None:
        if format_code.code not in FORMAT_CODES:
            shown = f"/{format_code.code}"
            self._fault(IllegalExpression, format_code.span, shown, "the format codes are /" + " /".join(FORMAT_CODES))

    def _variable(self, expression: Expression) -> None:
        """A variable that is read into."""
        if self._is_variable(expression):
            self._define_as(expression, _PRINTED)

    def _real_variable(self, expression: Expression) -> None:
        if self._is_variable(expression):
            self._define_as(expression, _REAL)

    def _string_variable(self, expression: Expression) -> None:
        if self._is_variable(expression):
            self._define_as(expression, _STRING)

    def _location_variable(self, expression: Expression) -> None:
        if isinstance(expression, ast.Binary) and expression.operator == ":":
            self._root(expression.left, _LOCATION)
            if self._is_variable(expression.right):
                self._define_as(expression.right, _LOCATION)
        elif self._is_variable(expression):
            self._define_as(expression, _PLACE)

    def _is_variable(self, expression: Expression) -> bool:
        if isinstance(expression, ast.Variable):
            self._check_name(expression)
            self._indexes(expression)
            return True
        self._fault(IllegalAssignment, expression.span, "a variable is wanted here")
        return False

    def _define_as(self, variable: Expression, wanted: frozenset[Kind]) -> None:
        assert isinstance(variable, ast.Variable)
        kind = _SIGIL_KINDS.get(variable.sigil)
        if kind is not None and kind not in wanted:
            self._mismatch(variable, kind, wanted)
        bare = wanted & _BARE
        self._define(variable, next(iter(bare)) if bare and kind is None else None)
        if not bare and kind is None:
            self._mismatch(variable, Kind.REAL, wanted)

    def _called(self, expression: Expression) -> None:
        """A program with its arguments; they go by reference, so that the program may give them a value."""
        if isinstance(expression, ast.Word):
            return
        if not isinstance(expression, ast.Call):
            self._fault(InvalidName, expression.span, "a program name is wanted here")
            return
        for argument in expression.arguments:
            if isinstance(argument, ast.Variable) and not argument.grouped:
                self._check_name(argument)
                self._indexes(argument)
                self._given.add(argument.key)
            elif argument is not None:
                self._root(argument, _ANY_KIND)
        self._check_call(expression)

    def _check_call(self, call: ast.Call) -> None:
        """The number and sorts of the arguments, where the program is known."""
        if self._programs is None or self._program is None:
            return
        key = call.name.lower()[:NAME_LENGTH]
        target = self._program if key == self._program.key else self._programs.get(key)
        if target is None:
            names = (program.name for program in self._programs.values())
            self._warn(UndefinedName, call.span, f"{call.name} is not in memory", did_you_mean(call.name, names))
            return
        if len(call.arguments) > len(target.parameters):
            detail = f"{len(call.arguments)} arguments, {target.name} has {len(target.parameters)} parameters"
            self._fault(ArgumentMismatch, call.span, detail)
        for argument, parameter in zip(call.arguments, target.parameters, strict=False):
            if argument is not None:
                self._check_argument(argument, parameter)

    def _check_argument(self, argument: Expression, parameter: ast.Variable) -> None:
        kind = self._peek(argument)
        wanted = frozenset({_SIGIL_KINDS[parameter.sigil]}) if parameter.sigil else _BARE
        if kind is not None and kind not in wanted:
            name = parameter.sigil + parameter.name
            self._fault(ArgumentMismatch, argument.span, f"{_ARTICLES[kind]} for the parameter {name}")

    def _label(self, expression: Expression) -> None:
        if not isinstance(expression, ast.Number):
            self._fault(CannotInterpret, expression.span, "a label is a number")

    def _word(self, expression: Expression) -> None:
        if not isinstance(expression, ast.Word):
            self._fault(CannotInterpret, expression.span, "a name is wanted here")

    def _setting(self, expression: Expression) -> None:
        """A bare name may be a word of the parameter (SCURVE)."""
        if not isinstance(expression, ast.Variable) or expression.indexes is not None or expression.sigil:
            self._root(expression, _PRINTED)

    # --- names ---

    def _check_name(self, variable: ast.Variable) -> None:
        name = variable.sigil + variable.name
        if variable.name.upper() in _RESERVED and not variable.sigil:
            self._fault(
                InvalidName, variable.span, f"{variable.name.upper()} is a word of the language", _form_of(name)
            )
        key = variable.key
        before = self._names.setdefault(key, variable.name.lower())
        if before != variable.name.lower():
            detail = f"{variable.name} and {before} are the same name"
            self._warn(InvalidName, variable.span, detail, f"the first {NAME_LENGTH} characters count")
            self._names[key] = variable.name.lower()

    def _indexes(self, variable: ast.Variable) -> None:
        for index in variable.indexes or ():
            self._root(index, _REAL)

    def _define(self, variable: ast.Variable, kind: Kind | None) -> None:
        self._given.add(variable.key)
        if kind is not None and not variable.sigil:
            self._decide(variable, frozenset({kind}))

    def _decide(self, variable: ast.Variable, wanted: frozenset[Kind]) -> Kind | None:
        """The kind of a bare name; where nothing has decided it, its use here does if it leaves one choice."""
        key = variable.key
        decided = self._kinds.get(key) or self._held(key)
        if decided is None:
            bare = wanted & _BARE
            if not bare:
                self._fault(TypeMismatch, variable.span, f"{variable.name} is no string", f"${variable.name} is one")
            if len(bare) != 1:
                return None
            decided = self._kinds[key] = _Decided(next(iter(bare)), self._step)
            self._check_known(variable, decided.kind)
        if decided.kind not in wanted:
            self._mismatch(variable, decided.kind, wanted, decided.step)
        return decided.kind

    def _check_known(self, variable: ast.Variable, kind: Kind) -> None:
        """A variable of that name, but of the other kind, has a value now."""
        now = self._known.get(variable.key, kind)
        if now is not kind and variable.key not in self._parameters:
            detail = f"{variable.name} is used as {_ARTICLES[kind]}, and has the value of {_ARTICLES[now]} now"
            self._warn(TypeMismatch, variable.span, detail)

    def _mismatch(self, expression: Expression, kind: Kind, wanted: Collection[Kind], step: int | None = None) -> None:
        from vrs_cli.language.printer import expression_text

        text = expression_text(expression)
        shown = text if len(text) <= LONGEST_SHOWN else "this"
        since = f" since step {step}" if step is not None and step != self._step else ""
        self._fault(
            TypeMismatch, expression.span, f"{shown} is {_ARTICLES[kind]}{since}", f"{_kinds_text(wanted)} is wanted"
        )

    # --- expressions ---

    def _root(self, expression: Expression, wanted: frozenset[Kind]) -> Kind | None:
        """A whole expression: its kind, and whether VAL-II would group it otherwise."""
        self._logical = False
        kind = self._checked(expression, wanted)
        if self._logical:
            self._logical = False
            for other in val_grouping(expression):
                detail = f"it is taken as {other.ours}, VAL-II takes {other.theirs}"
                self._warn(AmbiguousGrouping, other.span, detail, "add parentheses")
        return kind

    def _checked(self, expression: Expression, wanted: frozenset[Kind]) -> Kind | None:
        if isinstance(expression, ast.Variable):
            return self._read_variable(expression, wanted)
        kind = _KINDS[type(expression)](self, expression)
        if kind is not None and kind not in wanted:
            self._mismatch(expression, kind, wanted)
        return kind

    def _read_variable(self, variable: ast.Variable, wanted: frozenset[Kind]) -> Kind | None:
        self._check_name(variable)
        self._indexes(variable)
        if variable.indexes == ():
            self._fault(IllegalExpression, variable.span, f"{variable.name}[] is a whole array", "give an index")
        self._read.setdefault(variable.key, variable)
        if not variable.sigil:
            return self._decide(variable, wanted)
        kind = _SIGIL_KINDS[variable.sigil]
        if kind not in wanted:
            self._mismatch(variable, kind, wanted)
        return kind

    def _number_kind(self, _expression: ast.Number) -> Kind:
        return Kind.REAL

    def _text_kind(self, _expression: ast.Text) -> Kind:
        return Kind.STRING

    def _format_kind(self, expression: ast.Format) -> None:
        hint = "format codes are items of TYPE and $ENCODE"
        self._fault(IllegalExpression, expression.span, f"/{expression.code} is no value", hint)

    def _word_kind(self, expression: ast.Word) -> None:
        self._fault(IllegalExpression, expression.span, f"{expression.text} is no value")

    def _unary_kind(self, expression: ast.Unary) -> Kind:
        self._logical |= expression.operator in LOGICAL
        self._checked(expression.operand, _REAL)
        return Kind.REAL

    def _binary_kind(self, expression: ast.Binary) -> Kind | None:
        operator = expression.operator
        self._logical |= operator in LOGICAL
        if operator == ":":
            self._checked(expression.left, _LOCATION)
            self._checked(expression.right, _LOCATION)
            return Kind.LOCATION
        if operator == "+" or operator in RELATIONS:
            kind = self._both(expression)
            return Kind.REAL if operator in RELATIONS else kind
        if operator == "**":
            self._check_power(expression)
        found = len(self.diagnostics)
        self._checked(expression.left, _REAL)
        self._checked(expression.right, _REAL)
        return Kind.REAL if len(self.diagnostics) == found else None

    def _both(self, expression: ast.Binary) -> Kind | None:
        """Two reals or two strings."""
        strings = Kind.STRING in (self._peek(expression.left), self._peek(expression.right))
        wanted = _STRING if strings else _REAL
        self._checked(expression.left, wanted)
        self._checked(expression.right, wanted)
        return Kind.STRING if strings else Kind.REAL

    def _check_power(self, expression: ast.Binary) -> None:
        left = expression.left
        if isinstance(left, ast.Unary) and left.operator == "-" and not left.grouped:
            self._warn(AmbiguousGrouping, expression.span, "the sign binds before **", "add parentheses")

    def _call_kind(self, call: ast.Call) -> Kind | None:
        function = FUNCTIONS.get(call.name)
        if function is None:
            self._unknown_function(call)
            return None
        if function.state is not State.SUPPORTED:
            self._refused(call.span, function.name, function.state, function.summary)
            return function.result
        self._count_call(call, function.arguments, function.form)
        for place, expression in enumerate(call.arguments):
            if expression is not None and function.arguments:
                self._function_argument(expression, function.arguments[min(place, len(function.arguments) - 1)])
        return function.result

    def _unknown_function(self, call: ast.Call) -> None:
        hint = did_you_mean(call.name, FUNCTIONS)
        if not hint and len(call.arguments) == 1:
            hint = f"an element of an array is {call.name}[index]"
        self._fault(UnknownKeyword, call.span, f"there is no function {call.name}", hint)
        for expression in call.arguments:
            if expression is not None and not isinstance(expression, ast.Format):
                self._checked(expression, _ANY_KIND)

    def _count_call(self, call: ast.Call, arguments: Sequence[Argument], form: str) -> None:
        hint = f"the form is {form}"
        given = len(call.arguments)
        for place, argument in enumerate(arguments):
            if not argument.optional and (place >= given or call.arguments[place] is None):
                end = Span(call.span.line, call.span.end - 1, call.span.end)
                self._fault(IllegalExpression, end, f"{call.name}: {argument.name} is missing", hint)
                return
        if given > len(arguments) and not (arguments and arguments[-1].repeated):
            extra = call.arguments[len(arguments)]
            span = extra.span if extra is not None else call.span
            self._fault(IllegalExpression, span, f"{call.name}: too many arguments", hint)

    def _function_argument(self, expression: Expression, argument: Argument) -> None:
        """As an argument of an instruction, but a variable is only looked at, or changed where it has a value."""
        if argument.shape is Shape.VARIABLE:
            if self._is_variable(expression):
                self._given.add(_key_of(expression))
        elif argument.shape in _VALUES:
            self._checked(expression, _VALUES[argument.shape])
        else:
            logical = self._logical
            _SHAPES[argument.shape](self, expression)
            self._logical = logical

    def _peek(self, expression: Expression) -> Kind | None:
        """The kind of an expression as far as it is certain, with nothing decided and nothing said."""
        if isinstance(expression, ast.Variable):
            return _SIGIL_KINDS.get(expression.sigil) or self._kind_now(expression.key)
        if isinstance(expression, ast.Call):
            function = FUNCTIONS.get(expression.name)
            return function.result if function is not None else None
        if isinstance(expression, ast.Binary):
            return self._peek_binary(expression)
        return _CONSTANT_KINDS.get(type(expression))

    def _peek_binary(self, expression: ast.Binary) -> Kind:
        if expression.operator == ":":
            return Kind.LOCATION
        if expression.operator == "+":
            return Kind.STRING if Kind.STRING in map(self._peek, (expression.left, expression.right)) else Kind.REAL
        return Kind.REAL

    def _kind_now(self, key: str) -> Kind | None:
        decided = self._kinds.get(key) or self._held(key)
        return decided.kind if decided is not None else None

    def _held(self, key: str) -> _Decided | None:
        """What the value of a variable decides: at the prompt alone, a program may run when it has another."""
        if self._program is not None or key not in self._known:
            return None
        return _Decided(self._known[key], None)


FORMAT_CODES = "BCDEFGHIOSUX"
LONGEST_SHOWN = 40  # characters of an expression in a message

_CONSTANT_KINDS = {ast.Number: Kind.REAL, ast.Text: Kind.STRING, ast.Unary: Kind.REAL}

_STATEMENTS: Mapping[type, Callable[[_Checker, Any], None]] = {
    ast.Assignment: _Checker._assignment,
    ast.Instruction: _Checker._any_instruction,
    ast.If: _Checker._condition,
    ast.IfGoto: _Checker._condition,
    ast.While: _Checker._condition,
    ast.Until: _Checker._condition,
    ast.For: _Checker._for,
    ast.Case: _Checker._case,
    ast.Value: _Checker._value,
}

_KINDS: Mapping[type, Callable[[_Checker, Any], Kind | None]] = {
    ast.Number: _Checker._number_kind,
    ast.Text: _Checker._text_kind,
    ast.Unary: _Checker._unary_kind,
    ast.Binary: _Checker._binary_kind,
    ast.Call: _Checker._call_kind,
    ast.Format: _Checker._format_kind,
    ast.Word: _Checker._word_kind,
}

_VALUES: Mapping[Shape, frozenset[Kind]] = {
    Shape.REAL: _REAL,
    Shape.SIGNALS: _REAL,
    Shape.GROUP: _REAL,
    Shape.STRING: _STRING,
    Shape.LOCATION: _LOCATION,
    Shape.TRANSFORMATION: _LOCATION,
    Shape.PLACE: _PLACE,
}

_SHAPES: Mapping[Shape, Callable[[_Checker, Expression], None]] = {
    Shape.ITEM: _Checker._item,
    Shape.VARIABLE: _Checker._variable,
    Shape.REAL_VARIABLE: _Checker._real_variable,
    Shape.STRING_VARIABLE: _Checker._string_variable,
    Shape.LOCATION_VARIABLE: _Checker._location_variable,
    Shape.PROGRAM: _Checker._called,
    Shape.LABEL: _Checker._label,
    Shape.FILE: _Checker._word,
    Shape.WORD: _Checker._word,
    Shape.SWITCH: _Checker._word,
    Shape.PARAMETER_NAME: _Checker._word,
    Shape.SETTING: _Checker._setting,
    Shape.INSTRUCTION: _Checker._word,
}


def _argument_at(row: Word, place: int) -> Argument | None:
    """The row's argument of that place; those beyond belong to a repeated one, or to a repeated value."""
    if place < len(row.arguments):
        return row.arguments[place]
    if row.repeats:
        return row.arguments[-1]
    return row.value if row.value is not None and row.value.repeated else None


def _key_of(expression: Expression) -> str:
    assert isinstance(expression, ast.Variable)
    return expression.key


def _form_of(name: str) -> str:
    row = FUNCTIONS.get(name.upper()) or PROGRAM_WORDS.get(name.upper())
    return f"its form is {row.form}" if row is not None else ""


class _Same:
    """A program by its identity: comparing trees would cost more than walking one."""

    def __init__(self, program: Program) -> None:
        self.program = program

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.program is self.program

    def __hash__(self) -> int:
        return id(self.program)


@lru_cache(maxsize=1024)
def _given_in(same: _Same) -> frozenset[str]:
    """The keys of all variables that a program gives a value to."""
    return frozenset(key for step in same.program.steps for key in _given_by(step.statement))


def _given_by(statement: Statement | None) -> Iterator[str]:
    if isinstance(statement, ast.Assignment):
        yield statement.target.key
    elif isinstance(statement, ast.For):
        yield statement.variable.key
    elif isinstance(statement, ast.Instruction):
        row = INSTRUCTIONS.get(statement.word)
        for place, expression in enumerate(statement.arguments):
            argument = _argument_at(row, place) if row is not None else None
            if argument is not None and expression is not None:
                yield from _given_at(expression, argument.shape)


def _given_at(expression: Expression, shape: Shape) -> Iterator[str]:
    if shape is Shape.PROGRAM and isinstance(expression, ast.Call):
        yield from (argument.key for argument in expression.arguments if isinstance(argument, ast.Variable))
    elif shape in _DEFINING:
        if isinstance(expression, ast.Binary):
            expression = expression.right
        if isinstance(expression, ast.Variable):
            yield expression.key


_DEFINING = frozenset({Shape.VARIABLE, Shape.REAL_VARIABLE, Shape.STRING_VARIABLE, Shape.LOCATION_VARIABLE})
