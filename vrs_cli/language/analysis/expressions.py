"""Check expressions: whether each value has a kind (real, string, ...) that is allowed at its position, and whether
VAL-II would group the operators differently from V+."""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from functools import partial
from math import pi
from operator import eq, ge, gt, le, lt, ne
from typing import Any

from msgspec.structs import replace

from vrs_cli.errors import (
    AmbiguousGrouping,
    AngleUnit,
    CannotInterpret,
    FixedCondition,
    IllegalArrayIndex,
    IllegalAssignment,
    IllegalExpression,
    IllegalSignal,
    NotAvailable,
    TypeMismatch,
    UnknownKeyword,
    WithoutEffect,
    did_you_mean,
)
from vrs_cli.language.analysis.names import (
    ANY_KIND,
    CERTAIN,
    LOCATION,
    PLACE,
    PRINTED,
    REAL,
    STRING,
    VARIABLES,
    Kinds,
    NameFindings,
    kind_of,
)
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import FUNCTION_NAMES, Expression
from vrs_cli.language.text.builder import Grouping
from vrs_cli.language.text.lexer import Token
from vrs_cli.language.text.printer import expression_text
from vrs_cli.language.words.foreign import first_hint, form_of, own_function
from vrs_cli.language.words.functions import FUNCTIONS, LOGICAL, ORDER, RELATIONS, VAL_ORDER
from vrs_cli.language.words.values import INPUTS, INTERNAL, NAME_LENGTH, ON_AND_OFF, Kind
from vrs_cli.language.words.word import Shape, State, WordRow, argument_at, usable_names
from vrs_cli.values.diagnostics import Span

# matches conversions and escapes of C and Python strings, which TYPE would print as they are: %d, \n, {x}
_SIGNS = frozenset("%\\{")  # each match of _PRINTF has one of them
_PRINTF = r"(?<![\d%])%[-+]?\d*(?:\.\d+)?[dfsgiu](?![A-Za-z])|\\[nt]$|^[^\\:]*\\n|\{[A-Za-z]\w*\}"
FORMAT_CODES = "BCDEFGHINOSUX"
_STATES = ("ON", "OFF", "TRUE", "FALSE")
# functions with a value that is always TRUE or FALSE
_LOGICAL_FUNCTIONS = (*_STATES, "DEFINED", "IDENTICAL", "LATCHED", "OUTSIDE", "SIG", "SIG.INS", "SWITCH")


class Expressions(NameFindings):
    """A checker of single expressions."""

    _program_keys: Container[str] = ()  # keys of the programs in memory
    # variables that are compared with a number, with the relation, if TRUE and FALSE would give the same result
    compared: list[tuple[ast.Variable, ast.Binary]]
    _logical = False  # whether the part of the expression checked so far contains NOT, AND, OR or XOR

    # --- arguments: one method for each shape (form of argument in the word tables) ---

    def _item(self, expression: Expression) -> None:
        if isinstance(expression, ast.Variable):
            self.typed.add(expression.key)
        if not isinstance(expression, ast.Format):
            self.value(expression, ANY_KIND)
            if (
                isinstance(expression, ast.StringConstant)
                and not _SIGNS.isdisjoint(expression.value)
                and (found := re.search(_PRINTF, expression.value))
            ):
                sign, ends = "\\n" if found[0].endswith("\\n") else found[0], "every TYPE ends its line"
                hint = f"{ends}, TYPE alone types an empty one" if sign[0] == "\\" else 'TYPE "x =", x types a value'
                self.warn(WithoutEffect, expression.span, f"{sign} is typed as it stands", hint)
        elif expression.code not in FORMAT_CODES:
            self.fault(
                IllegalExpression,
                expression.span,
                f"/{expression.code}",
                "the format codes are /" + " /".join(FORMAT_CODES),
            )

    def _signal(self, expression: Expression) -> None:
        """Check the number of a signal. SIGNAL 1, ON is a mistake: ON is the number -1, which would turn signal 1
        off."""
        if isinstance(expression, ast.Call) and expression.name in _STATES:
            self.fault(IllegalSignal, expression.span, f"{expression.name} is no number of a signal", ON_AND_OFF)
        self.value(expression, REAL)

    def _unit(self, expression: Expression) -> None:
        """Check the number of a logical unit. A variable is allowed to have no value, because ATTACH can choose a unit
        and store its number there."""
        if isinstance(expression, ast.Variable):
            self._define(expression, REAL)
        else:
            self.value(expression, REAL)

    def _location_variable(self, expression: Expression) -> None:
        """Check a location that an instruction defines. In a compound (a:b:c) only the last name is defined; the others
        are read."""
        if isinstance(expression, ast.Binary) and expression.operator == ":":
            self.value(expression.left, LOCATION)
            self._define(expression.right, LOCATION)
        else:
            self._define(expression, PLACE)

    def _define(self, expression: Expression, wanted: Kinds) -> None:
        if (variable := self._checked_variable(expression)) is not None:
            self.define(variable, wanted)

    def _checked_variable(self, expression: Expression) -> ast.Variable | None:
        """Return the expression if it is a variable; otherwise report that a variable is required, and return None."""
        if isinstance(expression, ast.Variable):
            self.reference(expression)
            return expression
        self.fault(
            IllegalAssignment,
            expression.span,
            "a variable is wanted here",
            "SET p = TRANS(x, y, z) gives a place the name p" if self.kind_of(expression) in PLACE else "",
        )
        return None

    def reference(self, variable: ast.Variable) -> None:
        """Check the name and the indexes of a variable."""
        self.check(variable)
        for index in variable.indexes or ():
            self.value(index, REAL)

    def _elements(self, expression: Expression) -> None:
        """Check an argument that is an array of reals: the whole array (`a[]`), or the first element to use."""
        if (variable := self._checked_variable(expression)) is not None:
            if variable.indexes is None:
                self.fault(
                    IllegalArrayIndex,
                    variable.span,
                    f"{variable.name} is no array",
                    f"{variable.name}[1], or {variable.name}[]",
                )
            self.read(variable, REAL)

    def _only(self, expression: Expression, *, kind: type, rule: str) -> None:
        """Check an argument that must be a label or a single word. `kind`: the required class of node; `rule`: the
        message if the argument is something else."""
        if not isinstance(expression, kind):
            self.fault(CannotInterpret, expression.span, rule)

    def _setting(self, expression: Expression) -> None:
        """Check the value of a robot parameter. A bare name is not checked, because it may be a keyword of the
        parameter (SCURVE has keywords)."""
        bare = isinstance(expression, ast.Variable) and expression.indexes is None and not expression.sigil
        if not bare and not isinstance(expression, ast.BareWord):
            self.value(expression, PRINTED)

    def _part(self, expression: Expression) -> None:
        if not isinstance(expression, ast.BareWord | ast.StringConstant):
            self.value(expression, REAL)

    # --- values ---

    def value(self, expression: Expression, wanted: Kinds) -> None:
        """Check the kind of a whole expression, and warn if VAL-II would group its operators differently. `wanted`: the
        allowed kinds."""
        outer, self._logical = self._logical, False
        self._kind(expression, wanted)
        if self._logical:
            for ours, theirs, span in val_grouping(expression):
                self.warn(
                    AmbiguousGrouping, span, f"it is taken as {ours}, VAL-II takes {theirs}", "add parentheses", ours
                )
        self._logical = outer

    def _kind(self, expression: Expression, wanted: Kinds) -> Kind | None:
        if isinstance(expression, ast.Variable):
            return self._variable(expression, wanted)
        check = _KINDS.get(type(expression))
        kind = CERTAIN[type(expression)] if check is None else check(self, expression)
        if kind is not None and kind not in wanted:
            self.mismatch(expression, kind, wanted)
        return kind

    def _variable(self, variable: ast.Variable, wanted: Kinds) -> Kind | None:
        self.check(variable)
        for index in variable.indexes or ():
            if variable.sigil == "$" and isinstance(index, ast.Binary) and index.operator == ":":
                self.fault(
                    IllegalExpression, index.span, ": is no range", f"$MID(${variable.name}, 1, 2) is a part of a text"
                )
            else:
                self._kind(index, REAL)
        if variable.many:
            self.fault(IllegalExpression, variable.span, f"{variable.name}[] is an array", "give an index")
        return self.read(variable, wanted)

    def _no_value(self, expression: ast.Format | ast.Applied) -> None:
        detail, hint = "a value with arguments", "CALLS $name(a, b) has them"
        if isinstance(expression, ast.Format):
            detail, hint = f"/{expression.code} is no value", "format codes are items of TYPE and $ENCODE"
        elif isinstance(expression.text, ast.StringConstant):
            detail, hint = "( behind a text", "an operator or a comma is missing before ("
        self.fault(IllegalExpression, expression.span, detail, hint)

    def _unary(self, expression: ast.Unary) -> Kind:
        self._logical |= expression.operator in LOGICAL
        self._kind(expression.operand, REAL)
        return Kind.REAL

    def _binary(self, expression: ast.Binary) -> Kind | None:
        operator = expression.operator
        self._logical |= operator in LOGICAL
        if operator == ":" and isinstance(expression.left, ast.Number) and isinstance(expression.right, ast.Number):
            self.fault(IllegalExpression, expression.span, ": joins places, no numbers", "a time is in seconds: 90")
            return None
        if operator == ":":
            return self._operands(expression, LOCATION, Kind.LOCATION)
        if operator in RELATIONS and isinstance(expression.right, ast.Call):
            self.signal_number(expression.left)
        if operator in RELATIONS:
            left = expression.left
            if not (isinstance(left, ast.Binary) and not left.grouped and self._warn_of_chain(left, expression)):
                self._check_comparison(expression)
            sides = self.kind_of(left), self.kind_of(expression.right)
            if not PLACE.isdisjoint(sides) and PLACE.issuperset(sides):
                texts = expression_text(left), expression_text(expression.right)
                hint = f"DISTANCE({', '.join(texts)}) < 1 is TRUE if they are near"
                self.fault(TypeMismatch, expression.span, f"places are not compared with {operator}", hint)
                return self._operands(expression, PLACE, Kind.REAL)
            return self._operands(expression, self._of_both(expression), Kind.REAL)
        if operator == "+":
            wanted = self._of_both(expression)
            return self._operands(expression, wanted, next(iter(wanted)))
        left = expression.left
        if operator == "**" and isinstance(left, ast.Unary) and left.operator == "-" and not left.grouped:
            detail, clear = "the sign binds before **", replace(expression, left=replace(left, grouped=True))
            self.warn(AmbiguousGrouping, expression.span, detail, "add parentheses", expression_text(clear))
        return self._operands(expression, REAL, Kind.REAL)

    def _warn_of_chain(self, left: ast.Binary, whole: ast.Binary) -> bool:
        """Warn about 1 < x < 5, which compares the truth value of 1 < x with 5. Return whether `left`, the left operand
        of the relation `whole`, is a relation."""
        if left.operator in RELATIONS:
            first, middle, last = map(expression_text, (left.left, left.right, whole.right))
            hint = f"{first} {left.operator} {middle} AND {middle} {whole.operator} {last}"
            self.warn(
                AmbiguousGrouping, whole.span, f"it is taken as ({expression_text(left)}) {whole.operator} {last}", hint
            )
        return left.operator in RELATIONS

    def _check_comparison(self, relation: ast.Binary) -> None:
        """Warn about SIG(1) == 1 and SIG(1) > 0, whose results are the same for TRUE (-1) and FALSE (0). For a variable
        in place of SIG(1), record the relation: after the last step `_Steps.finish` warns if the variable has only
        truth values."""
        left, right = ast.plain_number(relation.left), ast.plain_number(relation.right)
        if (left is None) is (right is None):
            return
        value = relation.left if left is None else relation.right
        results = {_COMPARE[relation.operator](*(it if n is None else n for n in (left, right))) for it in (-1.0, 0.0)}
        if len(results) == 1 and isinstance(value, ast.Variable):
            self.compared.append((value, relation))
        elif len(results) == 1 and isinstance(value, ast.Call) and is_truth(value):
            self.truth_compared(value, relation)

    def truth_compared(self, value: Expression, relation: ast.Binary) -> None:
        """Warn if a truth value is compared with a number and the result is the same for TRUE and FALSE."""
        text, other = expression_text(value), relation.right if value is relation.left else relation.left
        never = "" if ast.plain_number(other) in (-1.0, 0.0) else f", never {expression_text(other)}"
        self.warn(
            FixedCondition,
            relation.span,
            f"{text} is TRUE (-1) or FALSE (0){never}",
            f"write {'NOT ' if relation.operator in ('<>', '<', '<=') else ''}{text}",
        )

    def signal_number(self, condition: Expression) -> None:
        """Warn about IF 1001 THEN and IF 1001 == TRUE THEN, which do not read the signal 1001."""
        if isinstance(condition, ast.Number) and condition.value in (*INPUTS, *INTERNAL):
            self.warn(
                FixedCondition,
                condition.span,
                f"{condition.text} is a number here",
                f"SIG({condition.text}) reads the signal",
            )

    def _operands(self, expression: ast.Binary, wanted: Kinds, result: Kind) -> Kind | None:
        """Check both operands of an operator. Return `result`, the kind of the operation's value, or None if an operand
        is wrong."""
        found = len(self.diagnostics)
        self._kind(expression.left, wanted)
        self._kind(expression.right, wanted)
        return result if len(self.diagnostics) == found else None

    def _of_both(self, expression: ast.Binary) -> Kinds:
        """Return the kind that both operands of + or of a relation must have: string if one of them is a string,
        otherwise real."""
        return STRING if Kind.STRING in (self.kind_of(expression.left), self.kind_of(expression.right)) else REAL

    # --- functions ---

    def _call(self, call: ast.Call) -> Kind | None:
        if (function := FUNCTIONS.get(call.name)) is None:
            hint = own_function(call.name) or did_you_mean(call.name, usable_names(FUNCTIONS))
            if call.name.lower()[:NAME_LENGTH] in self._program_keys:
                hint = f"CALL {call.name}(...) runs the program, which gives values back by its parameters"
            elif not hint and len(call.arguments) == 1:
                hint = f"an element of an array is {call.name}[index]"
            self.fault(UnknownKeyword, call.span, f"there is no function {call.name}", hint)
            return None
        if function.state is not State.SUPPORTED:
            self.fault(NotAvailable, call.span, f"{function.name}: {function.summary}", function.note)
            return function.result
        if not call.parenthesised and call.name.lower() in FUNCTION_NAMES:
            self.functions.setdefault(call.name.lower(), call)
        end = Span(call.span.line, call.span.end - 1, call.span.end)
        for span, detail in count_mistakes(call.name, call.arguments, function, end, call.span)[:1]:
            self.fault(IllegalExpression, span, detail, form_of(function))
        if call.name in _ANGLES:
            self.angles(call.name, call.arguments[_ANGLES[call.name] :])
        for place, expression in enumerate(call.arguments):
            if expression is not None and function.arguments:
                shape = function.arguments[min(place, len(function.arguments) - 1)].shape
                if shape is not Shape.VARIABLE:
                    SHAPES[shape](self, expression)
                elif (variable := self._checked_variable(expression)) is not None:
                    # DEFINED and LAST do not need a value, so do not report a missing one
                    self.given.add(variable.key)
        return function.result

    def angles(self, word: str, given: Sequence[Expression | None]) -> None:
        """Warn about each angle that is probably in radians, because it contains PI. `word`: the instruction or
        function."""
        for angle in given:
            if angle is not None and turns_of_pi(angle) > 0:
                self.warn(
                    AngleUnit, angle.span, f"{word} takes degrees", "half a turn is 180; x * 180 / PI converts radians"
                )

    # --- the kind of an expression ---

    def kind_of(self, expression: Expression) -> Kind | None:
        """Return the kind of an expression, or None if it is not known yet. Unlike `value`, this neither decides the
        kinds of names nor reports mistakes."""
        return kind_of(expression, lambda it: (decided := self._decision(it)) and decided.kind)


def is_truth(expression: Expression) -> bool:
    """Return whether the value of an expression is always TRUE or FALSE."""
    if isinstance(expression, ast.Call):
        return expression.name in _LOGICAL_FUNCTIONS
    return isinstance(expression, ast.Binary | ast.Unary) and expression.operator in RELATIONS | LOGICAL


def count_mistakes(
    name: str, given: Sequence[Expression | None], row: WordRow, end: Span, whole: Span
) -> list[tuple[Span, str]]:
    """Return a span and a message for the first missing argument and for the first extra argument. `row`: the row of
    the word `name` in the tables; `end`, `whole`: the spans after and of the whole call or instruction."""
    found = []
    for at, argument in enumerate(row.arguments):
        if not argument.optional and (at >= len(given) or given[at] is None):
            found.append((end, f"{name}: {argument.name} is missing"))
            break
    if row.repeats and not row.arguments[0].optional and None in given[max(len(row.arguments) - 1, 1) :]:
        found.append((whole, f"{name}: a value is missing between two commas"))
    if len(given) > len(row.arguments) and argument_at(row, len(given) - 1) is None:
        extra = given[len(row.arguments)]
        found.append((whole if extra is None else extra.span, f"{name}: too many arguments"))
    return found


def numbers_meant(row: WordRow, given: Sequence[Expression | None]) -> str:
    """Return a hint at what the user probably meant by bare numbers, as in MOVE 100, 200, 300 or DELAY 0,5; "" if no
    hint applies."""
    numbers = [one for one in given if one is not None and ast.plain_number(one) is not None]
    texts, shape = [expression_text(number) for number in numbers], row.arguments[0].shape if row.arguments else None
    places = f"a place is TRANS({', '.join(texts)}) or a name, joints are #PPOINT"
    # True if there are too many arguments and all of them are numbers
    beyond = 0 < len(row.arguments) < len(given) == len(numbers)
    place = beyond and shape in (Shape.PLACE, Shape.LOCATION)
    glued = len(numbers) == 2 and numbers[1].span.column == numbers[0].span.end + 1
    speed = len(given) == 2 and len(row.arguments) == 1 and shape is Shape.PLACE and numbers == [*given[1:]]
    return first_hint(
        (speed, f"the form is {row.form}; SPEED {''.join(texts)} before it sets the speed"),
        (place and len(numbers) == 6, f"{places}({', '.join(texts)})"),
        (place and len(numbers) >= 3, f"{places}(...)"),
        (beyond and shape is Shape.REAL and glued, f"a decimal number has a point: {'.'.join(texts)}"),
    )


def turns_of_pi(expression: Expression) -> int:
    """Return the exponent of PI as a factor of an angle: 1 for PI / 2 and 1.5708 (an angle in radians), -1 for
    x * 180 / PI (a conversion to degrees), otherwise 0.
    """
    match expression:
        case ast.Call(name="PI"):
            return 1
        case ast.Number(value=value, text=text):
            return int(text in ("3.14", "1.57", "6.28") or (len(text) > len("1.57") and _part_of_pi(value, text)))
        case ast.Unary(operand=operand):
            return turns_of_pi(operand)
        case ast.Binary(operator="*", left=left, right=right):
            return turns_of_pi(left) + turns_of_pi(right)
        case ast.Binary(operator="/", left=left, right=right):
            return turns_of_pi(left) - turns_of_pi(right)
        case ast.Binary(operator="+" | "-", left=left, right=right):
            return max(turns_of_pi(left), turns_of_pi(right))
    return 0


def _part_of_pi(value: float, text: str) -> bool:
    """Return whether a decimal number is a common fraction or multiple of PI (such as 1.5708), within one unit of its
    last digit."""
    decimals = len(text.partition(".")[2])
    return decimals > 2 and any(
        abs(value - pi * part) < 10.0**-decimals for part in (1 / 6, 1 / 4, 1 / 3, 1 / 2, 2 / 3, 3 / 4, 1, 3 / 2, 2)
    )


_COMPARE = {"==": eq, "<>": ne, "<": lt, ">": gt, "<=": le, ">=": ge}
_ANGLES = {
    **dict.fromkeys(("SIN", "COS", "TAN", "RX", "RY", "RZ", "#PPOINT"), 0),
    "TRANS": 3,
}  # index of the first argument that is an angle, by function


_KINDS: Mapping[type, Callable[[Expressions, Any], Kind | None]] = {
    ast.Unary: Expressions._unary,
    ast.Binary: Expressions._binary,
    ast.Call: Expressions._call,
    ast.Applied: Expressions._no_value,
    ast.Format: Expressions._no_value,
}

SHAPES: Mapping[Shape, Callable[[Expressions, Expression], None]] = {
    **dict.fromkeys((Shape.REAL, Shape.GROUP, Shape.TASK), partial(Expressions.value, wanted=REAL)),
    Shape.STRING: partial(Expressions.value, wanted=STRING),
    Shape.VALUE: partial(Expressions.value, wanted=ANY_KIND),
    Shape.LOCATION: partial(Expressions.value, wanted=LOCATION),
    Shape.PLACE: partial(Expressions.value, wanted=PLACE),
    **{shape: partial(Expressions._define, wanted=kinds) for shape, kinds in VARIABLES.items()},
    Shape.ITEM: Expressions._item,
    Shape.SIGNALS: Expressions._signal,
    Shape.UNIT: Expressions._unit,
    Shape.LOCATION_VARIABLE: Expressions._location_variable,
    Shape.ELEMENTS: Expressions._elements,
    Shape.LABEL: partial(Expressions._only, kind=ast.Number, rule="a label is a number"),
    Shape.SETTING: Expressions._setting,
    Shape.PART: Expressions._part,
    **dict.fromkeys(
        (Shape.FILE, Shape.WORD, Shape.BRANCH, Shape.SWITCH, Shape.PARAMETER_NAME, Shape.INSTRUCTION),
        partial(Expressions._only, kind=ast.BareWord, rule="a name is wanted here"),
    ),
}


def val_grouping(expression: Expression) -> Iterator[tuple[str, str, Span]]:
    """Yield each part of an expression that VAL-II groups differently from V+, as three items: its text with
    parentheses that show the grouping of V+, its text with parentheses that show the grouping of VAL-II, and its
    span."""
    flat = tuple(_flat(expression))
    if any(isinstance(item, Token) and item.value in LOGICAL for item in flat):
        texts = [item if isinstance(item, Token) else expression_text(item) for item in flat]
        ours, theirs = _OURS.tree(texts), _VAL.tree(texts)
        if theirs != ours:
            yield ours[1:-1], theirs[1:-1], expression.span
    for value in flat:
        if not isinstance(value, Token):
            grouped = isinstance(value, ast.Binary | ast.Unary)
            for inner in (value,) if grouped else ast.children(value):
                yield from val_grouping(inner)


def _flat(expression: Expression, root: bool = True) -> Iterator[Token | Expression]:
    """Yield the operators and operands of an expression in the order of the source. An operand in parentheses is one
    item."""
    if not isinstance(expression, ast.Unary | ast.Binary) or (expression.grouped and not root):
        yield expression
        return
    if isinstance(expression, ast.Binary):
        yield from _flat(expression.left, False)
    yield Token("", expression.operator, expression.operator, expression.span)
    yield from _flat(expression.operand if isinstance(expression, ast.Unary) else expression.right, False)


# These two functions make the text of an operation, for a Grouping that puts parentheses around every operation.


def _unary(sign: Token, operand: str) -> str:
    return f"({sign.value}{' ' * sign.value.isalpha()}{operand})"


def _binary(sign: Token, left: str, right: str) -> str:
    return f"({left} {sign.value} {right})"


_OURS, _VAL = Grouping(ORDER, _unary, _binary), Grouping(VAL_ORDER, _unary, _binary)
