"""Compile expressions to Python expressions (`compiler` compiles statements and jumps).

A variable becomes a subscript of its cells (a dictionary with all values of one kind, or of one array). A simple
variable has a constant key. A condition becomes a Python condition where it is only tested, and -1 or 0 where it is
used as a number.
"""

from __future__ import annotations

import ast as py
from collections.abc import Callable, Mapping
from itertools import zip_longest
from types import MappingProxyType
from typing import Any

from msgspec import Struct

from vrs_cli.errors import ProgramNotExecutable
from vrs_cli.language.analysis.names import VARIABLES, kind_of
from vrs_cli.language.compile import python_tree as tree
from vrs_cli.language.text import ast
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.values import SIGIL_KINDS, Kind, whole
from vrs_cli.language.words.word import Argument, Shape, argument_at

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
# Python's bit operators, because AND, OR and XOR always evaluate both operands
_LOGICAL: dict[str, type[py.operator]] = {"AND": py.BitAnd, "OR": py.BitOr, "XOR": py.BitXor}
ARGUMENT = "the argument"  # key under which a value that CALL passes (not a variable) is stored in its cells
KEYS = {
    "R": "KR",
    "L": "KL",
}  # Python variables that hold the key views of the cells R and L, because a test for a key is then faster
CELLS = {Kind.REAL: "R", Kind.LOCATION: "L", Kind.STRING: "S", Kind.PRECISION: "P"}


class Library(Struct, frozen=True):
    """The names that compiled programs use; `language.run` supplies them.

    `names`: the Python globals of every program. `of_values`: functions of VAL-II by name, called with the values of
    their arguments; `in_context`: those that also need the program's context, as their first argument. `handlers`:
    functions that carry out instructions, by the instruction's word. `waits_for_signals`: returns whether WAIT 3 in a
    program waits for a signal, as it does in programs without words of V+.
    """

    names: Mapping[str, object]
    of_values: Mapping[str, Callable[..., Any]]
    in_context: Mapping[str, Callable[..., Any]]
    handlers: Mapping[str, Callable[..., Any]]
    waits_for_signals: Callable[[ast.Program], bool]


Array = tuple[Kind, str]  # the kind and the key of an array in the robot's memory


class ExpressionCompiler:
    """A compiler of VAL-II expressions to Python expressions. `kinds`: the decided kinds of bare names, by key;
    `parameters`: the number of each parameter or private variable, by key.

    The compiler collects what the Python function needs: `arrays` (the Python variable for each array in memory) and
    `namespace` (its globals); and the first `spelling` of each name, by key. It sets `reads` if an expression contains
    GETC, and `observes` if it reads signals.
    """

    def __init__(
        self, library: Library, kinds: Mapping[str, Kind], parameters: Mapping[str, int] = MappingProxyType({})
    ) -> None:
        self.library, self.kinds, self.parameters = library, kinds, parameters
        self.arrays: dict[Array, str] = {}
        self.array_parameters: set[str] = set()
        self.spelling: dict[str, str] = {}
        self.namespace = dict(library.names)
        self.reads = self.observes = False

    def global_of(self, prefix: str, value: object) -> py.expr:
        """Add a value to the program's globals, and return the Python name that refers to it."""
        name = f"{prefix}_{len(self.namespace)}"
        self.namespace[name] = value
        return tree.name(name)

    def parameter_fields(self) -> list[str]:
        """Return the names of the Python variables for the parameters: three for each, the fields of its reference
        (real cells, location cells, key)."""
        return [f"{letter}{number}" for number in range(len(self.parameters)) for letter in "pqk"]

    # kinds

    def kind_of(self, expression: ast.Expression) -> Kind | None:
        """Return the kind of an expression, or None for a bare name whose kind is not decided."""
        return kind_of(expression, lambda it: SIGIL_KINDS.get(it.sigil) or self.kinds.get(it.key))

    # variables

    def place(self, variable: ast.Variable, kind: Kind | None = None) -> tuple[str, str | None, py.expr | None]:
        """Return where a variable is stored, as three items: the Python variable with its cells (stored values); for a
        bare name, the Python variable with the cells of the other possible kind (real or location), otherwise None; and
        the code of its key (None for a whole array).

        The variable's kind is the one that its sigil or the analysis decides, otherwise `kind`, otherwise REAL.
        """
        self.spelling.setdefault(variable.key, variable.sigil + variable.name)
        wanted = SIGIL_KINDS.get(variable.sigil) or self.kinds.get(variable.key) or kind or Kind.REAL
        real, location = self._cells(variable, Kind.REAL), self._cells(variable, Kind.LOCATION)
        key = self._key(variable)
        if wanted in (Kind.REAL, Kind.LOCATION):
            return (real, location, key) if wanted is Kind.REAL else (location, real, key)
        return self._cells(variable, wanted), None, key

    def _cells(self, variable: ast.Variable, kind: Kind) -> str:
        if variable.key in self.parameters:
            if variable.indexes is not None:
                self.array_parameters.add(variable.key)
            return f"{'q' if kind is Kind.LOCATION else 'p'}{self.parameters[variable.key]}"
        if variable.indexes is None or SIGIL_KINDS.get(variable.sigil, kind) is not kind:
            return CELLS[kind]
        return self.arrays.setdefault((kind, variable.key), f"{CELLS[kind]}{len(self.arrays)}")

    def _key(self, variable: ast.Variable) -> py.expr | None:
        if variable.indexes is None:
            number = self.parameters.get(variable.key)
            return tree.constant(variable.key) if number is None else tree.name(f"k{number}")
        if variable.many:
            return None
        indexes = [
            tree.constant(whole(index.value))
            if isinstance(index, ast.Number)
            else tree.call("whole", self.value(index))
            for index in variable.indexes
        ]
        return indexes[0] if len(indexes) == 1 else tree.tuple_of(indexes)

    def read(self, variable: ast.Variable, kind: Kind | None = None) -> py.expr:
        """Return the code that reads a variable. If its kind is unknown, the code finds it at run time. `kind`: the
        kind that the position in the program requires, or None."""
        if kind is not None or self.kind_of(variable) is not None:
            cells, _, key = self.place(variable, kind)
            # do not round the indexes: 3.0 and 3 are equal as keys, and the cells themselves round other indexes
            if variable.indexes and not variable.many:
                indexes = [constant_index(index) or self.value(index) for index in variable.indexes]
                key = indexes[0] if len(indexes) == 1 else tree.tuple_of(indexes)
            if key is not None:
                return tree.item(cells, key)
        return tree.method(self.reference(variable), "value")

    def reference(self, variable: ast.Variable) -> py.expr:
        """Return the code that makes a Reference to a variable, through which a called program or an instruction can
        read and assign it."""
        reference = tree.call("Reference", *self._fields(variable))
        if variable.many and variable.indexes:
            return tree.method(reference, "row", *map(self.value, variable.indexes))
        return reference

    def _fields(self, variable: ast.Variable) -> tuple[py.expr, ...]:
        """Return the code for the three fields of a Reference to a variable or a whole array: (1) the cells (stored
        values) for reals, or for the variable's kind if only one is possible; (2) the cells for locations, if it may
        hold either; (3) the key under which the value is stored."""
        self.spelling.setdefault(variable.key, variable.sigil + variable.name)
        kind = SIGIL_KINDS.get(variable.sigil)
        cells = self._cells(variable, kind or Kind.REAL)
        locations = "NO_CELLS" if kind else self._cells(variable, Kind.LOCATION)
        return tree.name(cells), tree.name(locations), self._key(variable) or tree.constant(None)

    # values

    def value(self, expression: ast.Expression, wanted: Kind = Kind.REAL) -> py.expr:
        """Return the code of an expression; its value is a float, a str, a Transform or a tuple of joints. `wanted`:
        the kind of a bare name that is otherwise unknown."""
        match expression:
            case ast.Number() | ast.StringConstant():
                return tree.constant(expression.value)
            case ast.Variable():
                return self.read(expression, wanted)
            case ast.Binary():
                return self._binary(expression)
            case ast.Call():
                return self._call(expression)
            case ast.Unary(operator="NOT"):
                return self._truth_value(expression)
            case ast.Unary(operator="COM"):
                return tree.call("complement", self.value(expression.operand))
            case ast.Unary(operator="-"):
                return py.UnaryOp(py.USub(), self.value(expression.operand))
            case ast.Unary():
                return self.value(expression.operand)
        raise ProgramNotExecutable(f"{expression} has no value")

    def truth(self, expression: ast.Expression) -> py.expr:
        """Return the code of a condition: a Python expression that is true if the value of the VAL-II expression is not
        0."""
        match expression:
            case ast.Unary(operator="NOT"):
                return tree.not_(self.truth(expression.operand))
            case ast.Binary() if expression.operator in _LOGICAL:
                operator = _LOGICAL[expression.operator]()
                return py.BinOp(self.truth(expression.left), operator, self.truth(expression.right))
            case ast.Binary() if expression.operator in _RELATIONS:
                left, right = self.value(expression.left), self.value(expression.right)
                return self.comparison(left, expression.operator, right, self.kind_of(expression.left))
        return tree.compare(self.value(expression), py.NotEq(), tree.constant(0.0))

    def _binary(self, expression: ast.Binary) -> py.expr:
        operator = expression.operator
        if operator in _RELATIONS or operator in _LOGICAL:
            return self._truth_value(expression)
        kind = self.kind_of(expression) or Kind.REAL
        left, right = self.value(expression.left, kind), self.value(expression.right, kind)
        if operator in _ARITHMETIC:
            return py.BinOp(left, _ARITHMETIC[operator](), right)
        return tree.call(_FUNCTIONS[operator], left, right)

    def _truth_value(self, expression: ast.Expression) -> py.expr:
        return py.IfExp(self.truth(expression), tree.constant(-1.0), tree.constant(0.0))

    def comparison(self, left: py.expr, operator: str, right: py.expr, kind: Kind | None) -> py.expr:
        """Return the code that compares two values. For strings, the code reads the switch UPPER, which decides whether
        case is ignored."""
        if kind is Kind.STRING:
            left, right = (tree.method(tree.name("X"), "fold_case", side) for side in (left, right))
        return tree.compare(left, _RELATIONS[operator](), right)

    # functions

    def _call(self, call: ast.Call) -> py.expr:
        function = FUNCTIONS[call.name]
        contextual = self.library.in_context.get(call.name)
        evaluate = contextual or self.library.of_values.get(call.name)
        if evaluate is None:
            raise ProgramNotExecutable(f"{function.name} is not available")
        if not function.arguments and contextual is None:
            constant = evaluate()
            return tree.constant(constant) if isinstance(constant, float) else self.global_of("k", constant)
        # pair each argument with its row in the table; if the last row repeats, it is used for all further arguments
        given, rows = call.arguments, function.arguments
        places = (argument_at(function, place) for place in range(len(given))) if function.repeats else iter(rows)
        arguments = [self.operand(item, row) for item, row in zip_longest(given, places) if row is not None]
        if contextual is not None:
            arguments.insert(0, tree.name("X"))
        name = f"f_{call.name.replace('$', 's_').replace('#', 'p_').replace('.', '__')}"
        self.namespace[name] = evaluate
        self.reads = self.reads or call.name == "GETC"
        self.observes = self.observes or call.name in ("SIG", "BITS")
        return tree.call(name, *arguments)

    # operands

    def operand(self, expression: ast.Expression | None, argument: Argument) -> py.expr:
        """Return the code of an argument in the form that its row in the table requires: a value, a reference to a
        variable, or a keyword."""
        if expression is None:
            return tree.constant(None)
        if argument.shape in WORDS:
            return tree.constant(word_of(expression))
        if argument.shape is Shape.LOCATION_VARIABLE:
            return self.definable(expression)
        if argument.shape in _BY_REFERENCE and isinstance(expression, ast.Variable):
            return self.reference(expression)
        if argument.shape is Shape.ITEM:
            return self.item(expression)
        if argument.shape is Shape.SETTING and isinstance(expression, ast.BareWord):
            return tree.constant(expression.text.upper())
        if argument.shape is Shape.SETTING and isinstance(expression, ast.Variable):
            return tree.call("setting", tree.constant(expression.name), self.reference(expression))
        return self.in_range(expression, _WANTED.get(argument.shape, Kind.REAL))

    def in_range(self, expression: ast.Expression, wanted: Kind = Kind.REAL) -> py.expr:
        """Return the code of an expression. If its value can exceed the range of reals, the code checks it and raises
        an error."""
        value = self.value(expression, wanted)
        return tree.call("within_range", value) if self.may_overflow(expression) else value

    def may_overflow(self, expression: ast.Expression) -> bool:
        match expression:
            case ast.Unary():
                return expression.operator in "+-" and self.may_overflow(expression.operand)
            case ast.Call():
                return expression.name == "SQR"
            case ast.Binary() if expression.operator in (*_ARITHMETIC, "**"):
                return self.kind_of(expression) is Kind.REAL
        return False

    def item(self, expression: ast.Expression) -> py.expr:
        """Return the code of an item of TYPE: a value of any kind, or a format code."""
        if isinstance(expression, ast.Format):
            return self.global_of("k", expression)
        if isinstance(expression, ast.Variable):
            return self.read(expression)
        return self.in_range(expression)

    def definable(self, expression: ast.Expression) -> py.expr:
        """Return the code that makes a Definable, the target of an instruction that defines a location. For `a:b:c` it
        holds a reference to c and the value of a:b."""
        if isinstance(expression, ast.Binary):
            variable, before = expression.right, self.value(expression.left, Kind.LOCATION)
        else:
            variable, before = expression, tree.constant(None)
        if not isinstance(variable, ast.Variable):
            raise ProgramNotExecutable("the last name of a compound must be a variable")
        return tree.call("Definable", self.reference(variable), before)

    def given_to_call(self, expression: ast.Expression | None) -> py.expr:
        """Return the code of an argument of CALL. A variable is passed by reference, as a tuple of the fields, because
        making a tuple is faster than making a Reference. Other expressions, and a variable in parentheses, are passed
        by value."""
        if expression is None:
            return tree.constant(None)
        if isinstance(expression, ast.Variable) and not expression.grouped:
            part = expression.many and expression.indexes  # true for a row of an array: a[1,]
            return self.reference(expression) if part else tree.tuple_of(self._fields(expression))
        if self.kind_of(expression) is Kind.REAL:
            key = tree.constant(ARGUMENT)
            cells = tree.call("RealArgument", py.Dict([key], [self.in_range(expression)]))
            return tree.tuple_of((cells, tree.name("NO_LOCATION"), key))
        value = self.read(expression) if isinstance(expression, ast.Variable) else self.in_range(expression)
        return tree.call("by_value", tree.name("X"), value)


_BY_REFERENCE = {*VARIABLES, Shape.ELEMENTS}
WORDS = {Shape.SWITCH, Shape.PARAMETER_NAME, Shape.WORD, Shape.BRANCH, Shape.FILE}
_WANTED = {
    Shape.STRING: Kind.STRING,
    Shape.LOCATION: Kind.LOCATION,
    Shape.PLACE: Kind.LOCATION,
}


def constant_index(index: ast.Expression | None) -> py.Constant | None:
    """Return the rounded value of an index if it is a numeric constant of 0 or more; None for any other index."""
    number = whole(index.value) if isinstance(index, ast.Number) else -1
    return py.Constant(number) if number >= 0 else None


def reads(expression: ast.Expression, variable: ast.Variable) -> bool:
    """Return whether an expression reads a variable each time it is evaluated. For an array element, the indexes must
    be the same constants."""
    match expression:
        case ast.Variable():
            if expression.key != variable.key or expression.many or variable.many:
                return False
            ours, theirs = ([*map(constant_index, one.indexes or ())] for one in (variable, expression))
            same = [one.value for one in ours if one] == [one.value for one in theirs if one]
            return same and all([*ours, *theirs]) and (variable.indexes is None) is (expression.indexes is None)
        case ast.Unary():
            return reads(expression.operand, variable)
        case ast.Binary():
            return reads(expression.left, variable) or reads(expression.right, variable)
    return False


def word_of(expression: ast.Expression) -> str:
    """Return the word that an expression consists of, such as the name of a switch or parameter, in upper case."""
    text = expression.text if isinstance(expression, ast.BareWord) else getattr(expression, "name", "")
    return str(text).upper()
