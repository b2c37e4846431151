"""From a checked program to a Python generator function, built as a tree of Python's own `ast`.

The operations of `lowering` become basic blocks; the blocks are dispatched by a binary tree of `if pc < k` inside
`while True`, so GOTO in and out of blocks is a number. Each counted operation yields its number before it is done, each
request or effect is yielded as it is; Python suspends the program there, at no other cost.

    def program(X, R, L, S, P, F, pc, ...):      context; cells of reals, locations, strings, precision points;
        l0, s0 = F                               frame: limits of FOR and subjects of CASE; ... arrays and arguments
        try:
            while True:
                if pc < 4:
                    ...
        except BaseException:
            F[:] = (l0, s0)
            raise

A block that jumps to itself is a `while True` of its own, so a straight loop never meets the tree. With `everywhere`
each operation begins a block: that variant, made on demand, can be entered at any step.
"""

from __future__ import annotations

import ast as py
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NoReturn, cast

from vrs_cli.engine.commands import Break
from vrs_cli.errors import ArithmeticOverflow, IllegalValue, ProgramNotExecutable, UndefinedValue
from vrs_cli.kinematics.transform import compose
from vrs_cli.language import ast
from vrs_cli.language.analyzer import Analysis
from vrs_cli.language.ast import Kind
from vrs_cli.language.effects import (
    HANDLERS,
    CallProgram,
    Definable,
    Operands,
    Return,
    Wait,
    Yielded,
    stamp_of,
)
from vrs_cli.language.environment import NO_CELLS, SIGIL_KINDS, Cells, Context, Reference
from vrs_cli.language.functions import FUNCTIONS, Function, modulo, power
from vrs_cli.language.instructions import INSTRUCTIONS
from vrs_cli.language.lowering import (
    Branch,
    CaseBegin,
    CaseTest,
    Finish,
    ForBegin,
    ForNext,
    Jump,
    Lowered,
    Mark,
    Op,
    Perform,
    lower,
)
from vrs_cli.language.values import LIMIT, Value, integer, kind_of_value, storable, whole, within_range, wrapped
from vrs_cli.language.words import Argument, Shape

Steps = Generator[int | Yielded, str | None, None]


# --- what compiled programs call ---------------------------------------------------------------------------------


def _complement(x: float) -> float:
    return wrapped(~integer(x))


def _bit_and(a: float, b: float) -> float:
    return wrapped(integer(a) & integer(b))


def _bit_or(a: float, b: float) -> float:
    return wrapped(integer(a) | integer(b))


def _bit_xor(a: float, b: float) -> float:
    return wrapped(integer(a) ^ integer(b))


def _for_step(step: float) -> float:
    if step == 0.0:
        raise IllegalValue("a STEP of 0", "the loop would never end")
    return step


def _setting(name: str, variable: Reference) -> Value:
    """`PARAMETER p = word`: the variable of that name if it has a value, otherwise the word itself."""
    return variable.value() if variable.defined() else name.upper()


def by_value(context: Context, value: Value) -> Reference:
    """An expression as the argument of a CALL: a variable that nobody else can see."""
    kind = kind_of_value(value)
    environment = context.environment
    cells = Cells(environment, Kind.REAL if kind is Kind.LOCATION else kind)
    locations = Cells(environment, Kind.LOCATION) if kind in (Kind.REAL, Kind.LOCATION) else NO_CELLS
    reference = Reference(cells, locations, "the argument")
    (locations if kind is Kind.LOCATION else cells)["the argument"] = value
    return reference


def overflow(error: ArithmeticError) -> ArithmeticOverflow:
    """What Python says of a calculation, as the language says it."""
    if isinstance(error, ZeroDivisionError):
        return ArithmeticOverflow("division by zero")
    return ArithmeticOverflow("the result is too large for a real")


def _guarded(condition: Callable[[], float | bool]) -> Callable[[], bool]:
    """The condition of a WAIT, asked by the driver: raises nothing but VrsError."""

    def ask() -> bool:
        try:
            return bool(condition())
        except ArithmeticError as error:
            raise overflow(error) from None

    return ask


def _at_once() -> bool:
    return True


class _Unset:
    """The limit of a FOR that was entered without its FOR: comparing with it, or adding it, says so."""

    def _say(self, _other: object) -> NoReturn:
        raise UndefinedValue("the limit of FOR", "the loop was entered by a jump past its FOR")

    __lt__ = __le__ = __gt__ = __ge__ = __radd__ = _say


UNSET = _Unset()

_NAMES: dict[str, object] = {
    "compose": compose,
    "modulo": modulo,
    "power": power,
    "complement": _complement,
    "bit_and": _bit_and,
    "bit_or": _bit_or,
    "bit_xor": _bit_xor,
    "for_step": _for_step,
    "setting": _setting,
    "by_value": by_value,
    "guarded": _guarded,
    "at_once": _at_once,
    "stamp_of": stamp_of,
    "storable": storable,
    "whole": whole,
    "within_range": within_range,
    "CallProgram": CallProgram,
    "Definable": Definable,
    "Operands": Operands,
    "Reference": Reference,
    "Wait": Wait,
    "NO_CELLS": NO_CELLS,
    "BREAK": Break(),
    "RETURN": Return(),
}


# --- small pieces of Python --------------------------------------------------------------------------------------


def _name(name: str) -> py.Name:
    return py.Name(name, py.Load())


def _constant(value: float | str | bool | None) -> py.Constant:
    return py.Constant(value)


def _call(function: py.expr | str, *arguments: py.expr) -> py.Call:
    return py.Call(_name(function) if isinstance(function, str) else function, list(arguments), [])


def _method(owner: py.expr, name: str, *arguments: py.expr) -> py.Call:
    return py.Call(py.Attribute(owner, name, py.Load()), list(arguments), [])


def _item(owner: str, key: py.expr) -> py.Subscript:
    return py.Subscript(_name(owner), key, py.Load())


def _tuple(items: Iterable[py.expr]) -> py.Tuple:
    return py.Tuple(list(items), py.Load())


def _compare(left: py.expr, operator: py.cmpop, right: py.expr) -> py.Compare:
    return py.Compare(left, [operator], [right])


def _assign(name: str, value: py.expr) -> py.Assign:
    return py.Assign([py.Name(name, py.Store())], value)


def _parameters(names: Sequence[str], defaults: bool = False) -> py.arguments:
    """`defaults`: each has the variable of its own name."""
    values: list[py.expr] = [_name(name) for name in names] if defaults else []
    return py.arguments([], [py.arg(name) for name in names], None, [], [], None, values)


def _made(function: py.FunctionDef, namespace: dict[str, object]) -> Callable[..., Any]:
    """The Python function of a tree."""
    module = py.fix_missing_locations(py.Module([function], []))
    exec(compile(module, "<program>", "exec"), namespace)
    return cast("Callable[..., Any]", namespace[function.name])


def _yield(value: py.expr) -> py.Expr:
    return py.Expr(py.Yield(value))


_ARITHMETIC: dict[str, type[py.operator]] = {"+": py.Add, "-": py.Sub, "*": py.Mult, "/": py.Div}
_FUNCTIONS = {
    "MOD": "modulo",
    "**": "power",
    "BAND": "bit_and",
    "BOR": "bit_or",
    "BXOR": "bit_xor",
    ":": "compose",
}
_RELATIONS: dict[str, type[py.cmpop]] = {
    "==": py.Eq,
    "<>": py.NotEq,
    "<": py.Lt,
    ">": py.Gt,
    "<=": py.LtE,
    ">=": py.GtE,
}
_LOGICAL: dict[str, type[py.operator]] = {"AND": py.BitAnd, "OR": py.BitOr, "XOR": py.BitXor}  # both sides, always
_CELLS = {Kind.REAL: "R", Kind.LOCATION: "L", Kind.STRING: "S", Kind.PRECISION: "P"}


# --- expressions -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Place:
    """Where a variable is: the names of the Python variables with its cells, and those of the other kind a bare name
    can have; its key in both, None for a whole array."""

    cells: str
    other: str | None
    key: py.expr | None


@dataclass(frozen=True, slots=True)
class Array:
    """A Python variable that holds the cells of an array of the environment."""

    key: str
    kind: Kind


@dataclass
class _Expressions:
    """Expressions as Python's. Remembers what else the Python function has to be given: `arrays` of the environment,
    with the names of their Python variables, and `namespace`, its globals. `parameters`: their numbers, by key."""

    kinds: Mapping[str, Kind]
    parameters: Mapping[str, int] = field(default_factory=dict)
    arrays: dict[Array, str] = field(default_factory=dict)
    namespace: dict[str, object] = field(default_factory=lambda: dict(_NAMES))
    spelling: dict[str, str] = field(default_factory=dict)
    array_parameters: set[str] = field(default_factory=set)

    def bound(self, prefix: str, value: object) -> py.expr:
        """A value of the compiler as a global of the program."""
        name = f"{prefix}_{len(self.namespace)}"
        self.namespace[name] = value
        return _name(name)

    # kinds

    def kind_of(self, expression: ast.Expression) -> Kind | None:
        """None: a bare name of which nothing is known."""
        if isinstance(expression, ast.Variable):
            return SIGIL_KINDS.get(expression.sigil) or self.kinds.get(expression.key)
        if isinstance(expression, ast.Text):
            return Kind.STRING
        if isinstance(expression, ast.Call):
            return FUNCTIONS[expression.name].result
        if isinstance(expression, ast.Binary):
            return self._kind_of_binary(expression)
        return Kind.REAL

    def _kind_of_binary(self, expression: ast.Binary) -> Kind:
        if expression.operator == ":":
            return Kind.LOCATION
        if expression.operator == "+" and self.kind_of(expression.left) is Kind.STRING:
            return Kind.STRING
        return Kind.REAL

    # variables

    def place(self, variable: ast.Variable, kind: Kind | None = None) -> _Place:
        """The cells for the kind given, or that the program has decided; reals for a bare name otherwise."""
        self.spelling.setdefault(variable.key, variable.sigil + variable.name)
        wanted = SIGIL_KINDS.get(variable.sigil) or self.kinds.get(variable.key) or kind or Kind.REAL
        real, location = self._cells(variable, Kind.REAL), self._cells(variable, Kind.LOCATION)
        key = self._key(variable)
        if wanted is Kind.REAL:
            return _Place(real, location, key)
        if wanted is Kind.LOCATION:
            return _Place(location, real, key)
        return _Place(self._cells(variable, wanted), None, key)

    def _cells(self, variable: ast.Variable, kind: Kind) -> str:
        if variable.key in self.parameters:
            if variable.indexes is not None:
                self.array_parameters.add(variable.key)
            return f"{'q' if kind is Kind.LOCATION else 'p'}{self.parameters[variable.key]}"
        if variable.indexes is None or SIGIL_KINDS.get(variable.sigil, kind) is not kind:
            return _CELLS[kind]
        return self.arrays.setdefault(Array(variable.key, kind), f"{_CELLS[kind]}{len(self.arrays)}")

    def _key(self, variable: ast.Variable) -> py.expr | None:
        if variable.indexes is None:
            number = self.parameters.get(variable.key)
            return _constant(variable.key) if number is None else _name(f"k{number}")
        if not variable.indexes:
            return None
        indexes = [self._index(index) for index in variable.indexes]
        return indexes[0] if len(indexes) == 1 else _tuple(indexes)

    def _index(self, index: ast.Expression) -> py.expr:
        if isinstance(index, ast.Number):
            return _constant(whole(index.value))
        return _call("whole", self.value(index))

    def read(self, variable: ast.Variable, kind: Kind | None = None) -> py.expr:
        """Its value; for a bare name of which nothing is known and nothing wanted, of the kind that it has."""
        if kind is None and self.kind_of(variable) is None:
            return _method(self.reference(variable), "value")
        place = self.place(variable, kind)
        if place.key is None:
            return _method(self.reference(variable), "value")
        return _item(place.cells, place.key)

    def reference(self, variable: ast.Variable) -> py.expr:
        """The variable itself."""
        self.spelling.setdefault(variable.key, variable.sigil + variable.name)
        kind = SIGIL_KINDS.get(variable.sigil)
        cells = self._cells(variable, kind or Kind.REAL)
        locations = "NO_CELLS" if kind else self._cells(variable, Kind.LOCATION)
        key = self._key(variable) or _constant(None)
        return _call("Reference", _name(cells), _name(locations), key)

    # values

    def value(self, expression: ast.Expression, wanted: Kind = Kind.REAL) -> py.expr:
        """An expression that gives the value: a float, a str, a Transform or a tuple of joints."""
        if isinstance(expression, ast.Number | ast.Text):
            return _constant(expression.value)
        if isinstance(expression, ast.Variable):
            return self.read(expression, wanted)
        if isinstance(expression, ast.Unary):
            return self._unary(expression)
        if isinstance(expression, ast.Binary):
            return self._binary(expression)
        if isinstance(expression, ast.Call):
            return self._function(expression)
        raise ProgramNotExecutable(f"{expression} has no value")

    def truth(self, expression: ast.Expression) -> py.expr:
        """An expression that Python takes for true where the value is not 0."""
        if isinstance(expression, ast.Unary) and expression.operator == "NOT":
            return py.UnaryOp(py.Not(), self.truth(expression.operand))
        if isinstance(expression, ast.Binary) and expression.operator in _LOGICAL:
            operator = _LOGICAL[expression.operator]()
            return py.BinOp(self.truth(expression.left), operator, self.truth(expression.right))
        if isinstance(expression, ast.Binary) and expression.operator in _RELATIONS:
            return self._relation(expression)
        return _compare(self.value(expression), py.NotEq(), _constant(0.0))

    def _unary(self, expression: ast.Unary) -> py.expr:
        if expression.operator == "NOT":
            return self._as_value(self.truth(expression))
        operand = self.value(expression.operand)
        if expression.operator == "COM":
            return _call("complement", operand)
        return py.UnaryOp(py.USub(), operand) if expression.operator == "-" else operand

    def _binary(self, expression: ast.Binary) -> py.expr:
        operator = expression.operator
        if operator in _RELATIONS or operator in _LOGICAL:
            return self._as_value(self.truth(expression))
        kind = self.kind_of(expression) or Kind.REAL
        left, right = self.value(expression.left, kind), self.value(expression.right, kind)
        if operator in _ARITHMETIC:
            return py.BinOp(left, _ARITHMETIC[operator](), right)
        return _call(_FUNCTIONS[operator], left, right)

    def _as_value(self, truth: py.expr) -> py.expr:
        return py.IfExp(truth, _constant(-1.0), _constant(0.0))

    def _relation(self, expression: ast.Binary) -> py.expr:
        left, right = self.value(expression.left), self.value(expression.right)
        return self.related(left, expression.operator, right, self.kind_of(expression.left))

    def related(self, left: py.expr, operator: str, right: py.expr, kind: Kind | None) -> py.expr:
        """Strings are compared as the switch UPPER says."""
        if kind is Kind.STRING:
            left, right = (_method(_name("X"), "folded", side) for side in (left, right))
        return _compare(left, _RELATIONS[operator](), right)

    # functions

    def _function(self, call: ast.Call) -> py.expr:
        function = FUNCTIONS[call.name]
        if function.evaluate is None:
            raise ProgramNotExecutable(f"{function.name} is not available")
        if not function.arguments and not function.contextual:
            constant = function.evaluate()
            return _constant(constant) if isinstance(constant, float) else self.bound("k", constant)
        arguments = self._arguments(function, call.arguments)
        if function.contextual:
            arguments.insert(0, _name("X"))
        self.namespace[_python_name(function)] = function.evaluate
        return _call(_python_name(function), *arguments)

    def _arguments(self, function: Function, given: Sequence[ast.Expression | None]) -> list[py.expr]:
        """One for each argument of the table, None for what is left out; as many as given where the last repeats."""
        rows = function.arguments
        if rows and rows[-1].repeated:
            rows = (*rows[: len(given)], *(rows[-1],) * (len(given) - len(rows)))
        padded = (*given, *(None,) * (len(rows) - len(given)))
        return [self.operand(item, row) for item, row in zip(padded, rows, strict=False)]

    # operands

    def operand(self, expression: ast.Expression | None, argument: Argument) -> py.expr:
        """What an argument is given as: a value, the variable itself, or a word."""
        if expression is None:
            return _constant(None)
        if argument.shape in _WORDS:
            return _constant(word_of(expression))
        if argument.shape is Shape.LOCATION_VARIABLE:
            return self._definable(expression)
        if argument.shape in _VARIABLES and isinstance(expression, ast.Variable):
            return self.reference(expression)
        if argument.shape is Shape.ITEM:
            return self._item_of_list(expression)
        if argument.shape is Shape.SETTING:
            return self._setting(expression)
        return self.checked(expression, _WANTED.get(argument.shape, Kind.REAL))

    def checked(self, expression: ast.Expression, wanted: Kind = Kind.REAL) -> py.expr:
        """A value that is within the range of reals."""
        value = self.value(expression, wanted)
        return _call("within_range", value) if self.may_overflow(expression) else value

    def may_overflow(self, expression: ast.Expression) -> bool:
        if isinstance(expression, ast.Unary):
            return expression.operator in "+-" and self.may_overflow(expression.operand)
        if isinstance(expression, ast.Call):
            return expression.name == "SQR"
        if not isinstance(expression, ast.Binary) or expression.operator not in (*_ARITHMETIC, "**"):
            return False
        return self.kind_of(expression) is Kind.REAL

    def _item_of_list(self, expression: ast.Expression) -> py.expr:
        if isinstance(expression, ast.Format):
            return self.bound("k", expression)
        if isinstance(expression, ast.Variable):
            return self.read(expression)
        return self.checked(expression)

    def _setting(self, expression: ast.Expression) -> py.expr:
        """The value of a parameter: a real, or a word (a name that has no value)."""
        if isinstance(expression, ast.Word):
            return _constant(expression.text.upper())
        if isinstance(expression, ast.Variable):
            return _call("setting", _constant(expression.name), self.reference(expression))
        return self.checked(expression)

    def _definable(self, expression: ast.Expression) -> py.expr:
        """`a:b:c`: the variable c, and the product a:b."""
        if isinstance(expression, ast.Binary):
            variable, before = expression.right, self.value(expression.left, Kind.LOCATION)
        else:
            variable, before = expression, _constant(None)
        if not isinstance(variable, ast.Variable):
            raise ProgramNotExecutable("the last name of a compound must be a variable")
        return _call("Definable", self.reference(variable), before)

    def argument_of_call(self, expression: ast.Expression | None) -> py.expr:
        """By reference a variable, by value any other expression."""
        if expression is None:
            return _constant(None)
        if isinstance(expression, ast.Variable):
            return self.reference(expression)
        return _call("by_value", _name("X"), self.checked(expression))


_VARIABLES = {Shape.VARIABLE, Shape.REAL_VARIABLE, Shape.STRING_VARIABLE}
_WORDS = {Shape.SWITCH, Shape.PARAMETER_NAME, Shape.WORD, Shape.FILE}
_WANTED = {
    Shape.STRING: Kind.STRING,
    Shape.LOCATION: Kind.LOCATION,
    Shape.TRANSFORMATION: Kind.LOCATION,
    Shape.PLACE: Kind.LOCATION,
}


def word_of(expression: ast.Expression) -> str:
    """A bare word where the table asks for one, in upper case: a switch, a parameter."""
    text = expression.text if isinstance(expression, ast.Word) else getattr(expression, "name", "")
    return str(text).upper()


def _python_name(function: Function) -> str:
    return f"f_{function.name.replace('$', 's_').replace('#', 'p_').replace('.', '__')}"


def text_of(statement: ast.Statement) -> str:
    """The canonical text of a step."""
    from vrs_cli.language.printer import statement_text

    return statement_text(statement)


# --- programs ----------------------------------------------------------------------------------------------------


@dataclass
class _Jumps:
    """How to get from one block to another: with `inner`, the block `number` is a `while True` of its own."""

    numbers: Mapping[int, int]
    number: int = 0
    inner: bool = False

    def to(self, op: int) -> list[py.stmt]:
        target = self.numbers[op]
        if self.inner and target == self.number:
            return [py.Continue()]
        away = py.Break() if self.inner else py.Continue()
        return [_assign("pc", _constant(target)), away]


class _ProgramCompiler(_Expressions):
    """The operations of one program as the body of its Python function."""

    def __init__(self, analysis: Analysis, lowered: Lowered) -> None:
        parameters = {variable.key: number for number, variable in enumerate(analysis.program.parameters)}
        super().__init__(analysis.kinds, parameters)
        declared = analysis.program.parameters
        self.array_parameters.update(variable.key for variable in declared if variable.indexes is not None)
        self._lowered = lowered
        self._jumps = _Jumps({})

    def variant(self, everywhere: bool) -> _Variant:
        leaders = self._leaders(everywhere)
        self._jumps = _Jumps({op: number for number, op in enumerate(leaders)})
        blocks = [self._block(number, leaders) for number in range(len(leaders))]
        loop: list[py.stmt] = [py.While(_constant(True), self._tree(blocks, 0), [])]
        body = self._kept(loop) if self._lowered.slots else loop
        bound = [f"{letter}{number}" for number in range(len(self.parameters)) for letter in "pqk"]
        names = ["X", *_CELLS.values(), "F", "pc", *bound, *self.arrays.values()]
        function = py.FunctionDef("program", _parameters(names), body, [], None)
        return _Variant(_made(function, self.namespace), tuple(self.arrays), self._jumps.numbers)

    def _leaders(self, everywhere: bool) -> list[int]:
        ops = self._lowered.ops
        if everywhere:
            return list(range(len(ops)))
        return sorted({0, *(op.target for op in ops if not isinstance(op, Perform | Mark | Finish))})

    def _tree(self, blocks: list[list[py.stmt]], first: int) -> list[py.stmt]:
        if len(blocks) == 1:
            return blocks[0]
        half = len(blocks) // 2
        test = _compare(_name("pc"), py.Lt(), _constant(first + half))
        return [py.If(test, self._tree(blocks[:half], first), self._tree(blocks[half:], first + half))]

    def _kept(self, loop: list[py.stmt]) -> list[py.stmt]:
        """Take the slots from the frame, and put them back when the program is left in any way."""
        slots = [f"{letter}{number}" for number in range(self._lowered.slots) for letter in "ls"]
        taken = py.Tuple([py.Name(slot, py.Store()) for slot in slots], py.Store())
        frame = py.Subscript(_name("F"), py.Slice(), py.Store())
        kept = py.Assign([frame], _tuple(map(_name, slots)))
        handler = py.ExceptHandler(_name("BaseException"), None, [kept, py.Raise()])
        return [py.Assign([taken], _name("F")), py.Try(loop, [handler], [], [])]

    # blocks

    def _block(self, number: int, leaders: list[int]) -> list[py.stmt]:
        first = leaders[number]
        end = leaders[number + 1] if number + 1 < len(leaders) else len(self._lowered.ops)
        ops = self._lowered.ops[first:end]
        inner = any(getattr(op, "target", None) == first for op in ops)
        self._jumps = _Jumps(self._jumps.numbers, number, inner)
        statements: list[py.stmt] = []
        for place, op in enumerate(ops, first):
            statements += self._operation(place, op)
            if isinstance(op, Jump | CaseBegin):
                break
        else:
            if end < len(self._lowered.ops):
                statements += self._jumps.to(end)
        return [py.While(_constant(True), statements, [])] if inner else statements

    def _operation(self, place: int, op: Op) -> list[py.stmt]:
        silent = isinstance(op, Mark | Finish) or (isinstance(op, Jump) and not op.counted)
        statements = _OPERATIONS[type(op)](self, op)
        return statements if silent else [_yield(_constant(place)), *statements]

    def _mark(self, _op: Mark) -> list[py.stmt]:
        return [py.Pass()]

    def _finish(self, _op: Finish) -> list[py.stmt]:
        return [_yield(_name("RETURN")), py.Return(None)]

    def _jump(self, op: Jump) -> list[py.stmt]:
        return self._jumps.to(op.target)

    def _branch(self, op: Branch) -> list[py.stmt]:
        truth = self.truth(op.condition)
        test = truth if op.when else py.UnaryOp(py.Not(), truth)
        return [py.If(test, self._jumps.to(op.target), [])]

    # loops and cases

    def _for_begin(self, op: ForBegin) -> list[py.stmt]:
        statement = op.statement
        limit, step = f"l{op.slot}", f"s{op.slot}"
        taken: list[py.stmt] = [
            _assign("v", self.checked(statement.first)),
            _assign(limit, self.checked(statement.last)),
        ]
        if _constant_step(statement) is None:
            assert statement.step is not None
            taken.append(_assign(step, _call("for_step", self.checked(statement.step))))
        past = py.UnaryOp(py.Not(), self._another_pass(statement, limit, step))
        return [
            *taken,
            *self._store(statement.variable, _name("v")),
            py.If(past, self._jumps.to(op.target), []),
        ]

    def _for_next(self, op: ForNext) -> list[py.stmt]:
        statement = op.statement
        limit, step = f"l{op.slot}", f"s{op.slot}"
        known = _constant_step(statement)
        addend = _name(step) if known is None else _constant(known)
        sum_ = py.BinOp(self.value(statement.variable), py.Add(), addend)
        place = self.place(statement.variable, Kind.REAL)
        assert place.key is not None
        target = py.Subscript(_name(place.cells), place.key, py.Store())
        return [
            py.Assign([py.Name("v", py.Store()), target], sum_),
            py.If(self._another_pass(statement, limit, step), self._jumps.to(op.target), []),
        ]

    def _another_pass(self, statement: ast.For, limit: str, step: str) -> py.expr:
        up = _compare(_name("v"), py.LtE(), _name(limit))
        down = _compare(_name("v"), py.GtE(), _name(limit))
        known = _constant_step(statement)
        if known is None:
            return py.IfExp(_compare(_name(step), py.Gt(), _constant(0.0)), up, down)
        return up if known > 0.0 else down

    def _case_begin(self, op: CaseBegin) -> list[py.stmt]:
        return [_assign(f"l{op.slot}", self.value(op.subject)), *self._jumps.to(op.target)]

    def _case_test(self, op: CaseTest) -> list[py.stmt]:
        kind = self.kind_of(op.subject)
        subject = _name(f"l{op.slot}")
        tests = [self.related(subject, "==", self.value(value), kind) for value in op.values]
        matched = tests[0] if len(tests) == 1 else py.BoolOp(py.Or(), tests)
        return [py.If(py.UnaryOp(py.Not(), matched), self._jumps.to(op.target), [])]

    # statements

    def _perform(self, op: Perform) -> list[py.stmt]:
        if isinstance(op.statement, ast.Assignment):
            return self._assignment(op.statement)
        special = _SPECIAL.get(op.statement.word)
        statements = special(self, op.statement) if special else self._instruction(op.statement)
        if INSTRUCTIONS[op.statement.word].breaks:
            statements.insert(0, _yield(_name("BREAK")))
        return statements

    def _assignment(self, statement: ast.Assignment) -> list[py.stmt]:
        target, value = statement.target, statement.value
        if target.sigil == "$":
            return self._store(target, _call("storable", self.value(value, Kind.STRING)))
        if not self.may_overflow(value):
            return self._store(target, self.value(value))
        inside = py.Compare(_constant(-LIMIT), [py.LtE(), py.LtE()], [_name("v"), _constant(LIMIT)])
        check = py.If(py.UnaryOp(py.Not(), inside), [py.Expr(_call("within_range", _name("v")))], [])
        return [_assign("v", self.value(value)), check, *self._store(target, _name("v"))]

    def _store(self, variable: ast.Variable, value: py.expr) -> list[py.stmt]:
        """Assign, unless the bare name exists as a location."""
        place = self.place(variable, Kind.REAL)
        if variable.indexes:
            return self._store_element(place, variable.indexes, value)
        assert place.key is not None
        stored: list[py.stmt] = [py.Assign([py.Subscript(_name(place.cells), place.key, py.Store())], value)]
        return self._denied(place, place.key) + stored

    def _store_element(self, place: _Place, indexes: tuple[ast.Expression, ...], value: py.expr) -> list[py.stmt]:
        at = _method(_name(place.cells), "at", *map(self.value, indexes))
        target = py.Subscript(_name(place.cells), _name("i"), py.Store())
        return [_assign("i", at), *self._denied(place, _name("i")), py.Assign([target], value)]

    def _denied(self, place: _Place, key: py.expr) -> list[py.stmt]:
        if place.other is None:
            return []
        clash = py.Expr(_method(_name(place.cells), "deny", key))
        return [py.If(_compare(key, py.In(), _name(place.other)), [clash], [])]

    def _instruction(self, statement: ast.Instruction) -> list[py.stmt]:
        word = INSTRUCTIONS[statement.word]
        rows = list(word.arguments)
        if rows and rows[-1].repeated:
            rows += [rows[-1]] * (len(statement.arguments) - len(rows))
        arguments = [
            self._operand(statement.word, expression, row)
            for expression, row in zip(statement.arguments, rows, strict=False)
        ]
        value: py.expr = _constant(None)
        if statement.value is not None and word.value is not None:
            value = self.operand(statement.value, word.value)
        operands = _call(
            "Operands",
            _constant(text_of(statement)),
            _tuple(arguments),
            value,
            self._stamp(statement.modifiers),
            _constant(statement.modifiers.always),
            _constant(statement.modifiers.unit),
        )
        return [py.Expr(py.YieldFrom(_call(self._handler(statement.word), _name("X"), operands)))]

    def _handler(self, word: str) -> str:
        if word not in HANDLERS:
            raise ProgramNotExecutable(f"{word} is not available in a program")
        name = f"h_{word.replace('.', '__')}"
        self.namespace[name] = HANDLERS[word]
        return name

    def _operand(self, word: str, expression: ast.Expression | None, row: Argument) -> py.expr:
        if word == "PROMPT" and isinstance(expression, ast.Variable):
            return self.reference(expression)
        return self.operand(expression, row)

    def _stamp(self, modifiers: ast.Modifiers) -> py.expr:
        if modifiers.at is None and modifiers.within is None:
            return _constant(None)
        times = (modifiers.at, modifiers.within)
        return _call("stamp_of", *(_constant(None) if time is None else self.checked(time) for time in times))

    def _wait(self, statement: ast.Instruction) -> list[py.stmt]:
        if not statement.arguments or statement.arguments[0] is None:
            return [_yield(_call("Wait", _name("at_once"), _constant(1)))]
        condition = self._closed(self.truth(statement.arguments[0]))
        return [_yield(_call("Wait", _call("guarded", condition)))]

    def _closed(self, expression: py.expr) -> py.Lambda:
        """A function of no arguments. It takes the program's variables as defaults: cells of a closure are slower for
        the whole program."""
        names = {node.id for node in py.walk(expression) if isinstance(node, py.Name)}
        local = sorted(names - self.namespace.keys())
        return py.Lambda(_parameters(local, defaults=True), expression)

    def _call_program(self, statement: ast.Instruction) -> list[py.stmt]:
        program = statement.arguments[0]
        given = program.arguments if isinstance(program, ast.Call) else ()
        name = program.text if isinstance(program, ast.Word) else str(getattr(program, "name", ""))
        arguments = _tuple(map(self.argument_of_call, given))
        return [_yield(_call("CallProgram", _constant(name), arguments))]


def _constant_step(statement: ast.For) -> float | None:
    """The STEP of a FOR where it is a number that is known and not 0; 1 where there is none."""
    step = statement.step
    if step is None:
        return 1.0
    if isinstance(step, ast.Unary) and step.operator == "-" and isinstance(step.operand, ast.Number):
        return -step.operand.value or None
    return (step.value or None) if isinstance(step, ast.Number) else None


_OPERATIONS: dict[type, Callable[..., list[py.stmt]]] = {
    Perform: _ProgramCompiler._perform,
    Jump: _ProgramCompiler._jump,
    Branch: _ProgramCompiler._branch,
    ForBegin: _ProgramCompiler._for_begin,
    ForNext: _ProgramCompiler._for_next,
    CaseBegin: _ProgramCompiler._case_begin,
    CaseTest: _ProgramCompiler._case_test,
    Mark: _ProgramCompiler._mark,
    Finish: _ProgramCompiler._finish,
}

_SPECIAL: dict[str, Callable[[_ProgramCompiler, ast.Instruction], list[py.stmt]]] = {
    "BREAK": lambda _compiler, _statement: [],  # the table says that it breaks
    "WAIT": _ProgramCompiler._wait,
    "CALL": _ProgramCompiler._call_program,
}


# --- the result --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Variant:
    """The Python function, the arrays it takes after its fixed arguments, and the block that begins at an operation."""

    function: Callable[..., Steps]
    arrays: tuple[Array, ...]
    numbers: Mapping[int, int]


@dataclass(frozen=True)
class Compiled:
    """A program ready to run. `spelling`: the names it uses, as it first spells them, by key. `array_parameters`: the
    keys of those that stand for whole arrays."""

    analysis: Analysis
    lowered: Lowered
    spelling: Mapping[str, str]
    array_parameters: frozenset[str]
    ordinary: _Variant

    @cached_property
    def everywhere(self) -> _Variant:
        """The variant that can be entered at every operation."""
        return _ProgramCompiler(self.analysis, self.lowered).variant(everywhere=True)

    def start(self, context: Context, arguments: Sequence[Reference], slots: list[object], op: int = 0) -> Steps:
        """An activation, from an operation on; one argument for each parameter.

        `slots`: `fresh_slots()` to begin with; when the activation has ended in any way they hold what it kept.
        """
        variant = self.ordinary if op in self.ordinary.numbers else self.everywhere
        environment = context.environment
        cells = (environment.cells(kind) for kind in _CELLS)
        bound = (part for reference in arguments for part in reference)
        arrays = (environment.cells(array.kind, array.key) for array in variant.arrays)
        return variant.function(context, *cells, slots, variant.numbers[op], *bound, *arrays)

    def fresh_slots(self) -> list[object]:
        return [UNSET] * (2 * self.lowered.slots)

    def step_of(self, op: int) -> int:
        """The step (from 0) that an operation belongs to."""
        return self.lowered.ops[op].step

    def entry(self, step: int) -> int:
        """The operation at which a step (from 0; one more for the end) is entered."""
        return self.lowered.entries[step]


def compile_program(analysis: Analysis) -> Compiled:
    """Raises ProgramNotExecutable for a program with errors."""
    if not analysis.executable:
        raise ProgramNotExecutable(analysis.program.name, "mend its errors first")
    try:
        lowered = lower(analysis)
        compiler = _ProgramCompiler(analysis, lowered)
        variant = compiler.variant(everywhere=False)
    except RecursionError:
        raise ProgramNotExecutable(analysis.program.name, "an expression is nested too deeply") from None
    return Compiled(analysis, lowered, compiler.spelling, frozenset(compiler.array_parameters), variant)


def _with_context(compiler: _Expressions, value: py.expr) -> Callable[[Context], Any]:
    """A function of the context alone."""
    names = ["X", *_CELLS.values(), *compiler.arrays.values()]
    function = _made(py.FunctionDef("value", _parameters(names), [py.Return(value)], [], None), compiler.namespace)
    arrays = tuple(compiler.arrays)

    def evaluate(context: Context) -> Any:
        cells = context.environment.cells
        simple, elements = (cells(kind) for kind in _CELLS), (cells(array.kind, array.key) for array in arrays)
        try:
            return function(context, *simple, *elements)
        except ArithmeticError as error:
            raise overflow(error) from None

    return evaluate


def compile_expression(expression: ast.Expression, kinds: Mapping[str, Kind]) -> Callable[[Context], Value]:
    """One expression at the prompt. `kinds`: those of the bare names that have a value."""
    compiler = _Expressions(kinds)
    if isinstance(expression, ast.Variable):
        return _with_context(compiler, compiler.read(expression))
    return _with_context(compiler, compiler.checked(expression))


def compile_argument(
    expression: ast.Expression | None, kinds: Mapping[str, Kind]
) -> Callable[[Context], Reference | None]:
    """One argument of EXECUTE at the prompt, as CALL passes it."""
    compiler = _Expressions(kinds)
    return _with_context(compiler, compiler.argument_of_call(expression))


def compile_definable(expression: ast.Expression, kinds: Mapping[str, Kind]) -> Callable[[Context], Definable]:
    """What HERE, POINT and TEACH define at the prompt: `a`, `#p`, `a:b`, `row[3]`."""
    compiler = _Expressions(kinds)
    return _with_context(compiler, compiler.operand(expression, Argument("location", Shape.LOCATION_VARIABLE)))
