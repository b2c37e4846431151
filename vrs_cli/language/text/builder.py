"""Build the syntax tree. The builder has one method for each rule of grammar/val2.lark; the parser calls the method
when the rule is complete.

The parameters of a method are the children of its rule in their order. They include the tokens, so that the span of
each node can be computed exactly. The builder checks a line against the word tables (which modifiers are allowed,
whether `=` may follow); the analyzer checks the number and the kinds of arguments.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.engine.settings import PARAMETERS
from vrs_cli.errors import CannotInterpret, IllegalExpression, InvalidName, InvalidNumber, NotAvailable
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Expression
from vrs_cli.language.text.lexer import Token, label_value
from vrs_cli.language.words.functions import FUNCTIONS, LOGICAL, ORDER, RELATIONS, VAL_ORDER, WITH_BY, Order
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.word import Argument, Shape, Word, WordRow
from vrs_cli.values.diagnostics import LineRefused, Span, refusal

Children = list[Any]  # the tokens, nodes and pieces (parts of an instruction) that a rule consists of, in their order
Items = list[Expression | None]  # expressions between commas, None for an omitted one

MAX_REAL = 3.4e38  # highest numeric constant: about the largest single-precision number
BINARY_DIGITS = 8  # maximum number of digits in ^B101
FORMAT_DIGITS = 3  # maximum number of digits in the width, and in the number of decimals, of a format code
INDEXES = 3  # maximum number of indexes of an array
LAST_CHARACTER = 255  # highest character code for $CHR


def _span(children: Sequence[Any]) -> Span:
    """Return the span from the first to the last of the tokens, nodes and pieces."""
    first, last = children[0].span, children[-1].span
    return Span(first.line, first.column, last.end)


# --- numbers and variables -----------------------------------------------------------------------------------------


def number_value(text: str) -> float | None:
    """Return the value of a constant (`5`, `1E-3`, `^HFF`, `^B101`, `^17`, `'A`), or None if the text is not a
    constant."""
    try:
        if text[0] == "'":
            return float(ord(text[1]))
        if text[0] != "^":
            value = float(text)
        else:
            base = _BASES.get(text[1].upper())
            digits = text[1 + (base is not None) :]
            if base == 2 and len(digits) > BINARY_DIGITS:
                return None
            value = float(int(digits, base or 8))
    except (ValueError, OverflowError):
        return None
    return value if value <= MAX_REAL else None


def signed_number(text: str) -> float | None:
    """Return the value of a constant that may have a sign before it, or None for any other text."""
    value = number_value(text.lstrip("+-"))
    return -value if value is not None and text[0] == "-" else value


_BASES = {"B": 2, "H": 16, "D": 10}


def _variable(name: Token, indexes: tuple[Expression, ...] | None, span: Span) -> ast.Variable:
    text = name.text
    if text[0] == "%":
        raise refusal(NotAvailable, name.span, f"{text} is a belt", "this robot has no conveyor")
    sigil = text[0] if text[0] in "#$" else ""
    return ast.Variable(text[len(sigil) :], sigil, indexes, span=span)


def _items(children: Sequence[Any], row: WordRow | None = None, places: int | None = None) -> Items:
    """Return the expressions between commas, without the omitted ones at the end.

    `row`: the table row of the word or function; None skips the check of a final comma. A final comma means that the
    next argument is omitted, so the row must have more arguments than there are commas. `places`: the number of
    arguments of the row, or None if its last argument repeats and so may not be omitted. Raises LineRefused.
    """
    signs = [child for child in children if type(child) is Token]
    if row is not None and signs and signs[-1] is children[-1] and (places is None or len(signs) >= places):
        raise refusal(
            CannotInterpret,
            signs[-1].span,
            f"{row.name}: nothing stands behind {signs[-1].text}",
            f"the form is {row.form}",
        )
    items: Items = [None]
    for child in children:
        if type(child) is Token:
            items.append(None)
        else:
            items[-1] = child
    return ast.trim(items)


# --- arguments in the form that the tables require -----------------------------------------------------------------


def _to_word(expression: Expression) -> Expression:
    if isinstance(expression, ast.Variable) and expression.indexes is None:
        return ast.BareWord(expression.sigil + expression.name, span=expression.span)
    if isinstance(expression, ast.Call) and not expression.parenthesised:
        return ast.BareWord(expression.name, span=expression.span)
    return expression


def _to_indexed_word(expression: Expression) -> Expression:
    """Convert the name of a switch or parameter to a BareWord. The name may have an index, for example the number of a
    robot: SCALE.ACCEL[1]."""
    if isinstance(expression, ast.Variable) and expression.indexes and not expression.sigil and not expression.rest:
        shown = [_index_text(index) for index in expression.indexes]
        if all(shown):
            return ast.BareWord(f"{expression.name}[{','.join(shown)}]", span=expression.span)
    return _to_word(expression)


def _index_text(index: Expression) -> str:
    """Return an index as text if it is a number or a name; "" for a longer expression."""
    if isinstance(index, ast.Variable):
        return index.name if index.indexes is None and not index.sigil else ""
    return index.text if isinstance(index, ast.Number) else ""


def _to_setting(expression: Expression) -> Expression:
    """Convert an expression to a BareWord if it is a keyword that a parameter accepts as its value."""
    word = _to_word(expression) if isinstance(expression, ast.Variable) else expression
    return word if isinstance(word, ast.BareWord) and word.text.upper() in _SETTINGS else expression


_SETTINGS = frozenset(word for row in PARAMETERS.values() for word in row.words)


def _to_applied(expression: Expression) -> Expression:
    """Convert the argument of CALLS to an Applied. The parser has read `$name(a)` as a call of a function; in a sum,
    `$kind+$name(a)`, the arguments of the program are those of the last operand."""
    if isinstance(expression, ast.Binary) and not expression.grouped:
        last = _to_applied(expression.right)
        if isinstance(last, ast.Applied):
            return ast.Applied(replace(expression, right=last.text), last.arguments, span=expression.span)
    if isinstance(expression, ast.Call) and expression.name[0] == "$" and expression.name not in FUNCTIONS:
        text = ast.Variable(expression.name[1:], "$", None, span=expression.span)
        return ast.Applied(text, expression.arguments, span=expression.span)
    return expression


_FIT: Mapping[Shape, Callable[[Expression], Expression]] = {
    Shape.SWITCH: _to_indexed_word,
    Shape.PARAMETER_NAME: _to_indexed_word,
    Shape.WORD: _to_word,
    Shape.BRANCH: _to_word,
    Shape.PART: _to_word,
    Shape.PROGRAM_TEXT: _to_applied,
    Shape.VARIABLE: ast.to_variable,
    Shape.REAL_VARIABLE: ast.to_variable,
    Shape.LOCATION_VARIABLE: ast.to_variable,
    Shape.STRING_VARIABLE: ast.to_variable,
    Shape.UNIT: ast.to_variable,
    Shape.SETTING: _to_setting,
}


def _fit(items: Sequence[Expression | None], places: tuple[Argument, ...]) -> tuple[Expression | None, ...]:
    """Convert each expression to the kind of node that its argument in the table requires. Expressions beyond the last
    argument of the table are treated like the last argument."""
    if not places:
        return tuple(items)
    last = len(places) - 1
    return tuple(
        item if item is None or (fit := _FIT.get(places[min(at, last)].shape)) is None else fit(item)
        for at, item in enumerate(items)
    )


# --- the parts of an instruction after its word --------------------------------------------------------------------


class _Piece(Struct, frozen=True):
    """A part of an instruction, such as its arguments or a modifier. `put`: the method of _Given that adds the
    children of the part to the instruction."""

    put: Callable[..., None]
    children: Children
    span: Span


def _piece(put: Callable[..., None]) -> Callable[[Builder, Children], _Piece]:
    """Return the builder method for a rule whose result is a part of an instruction."""
    return lambda _builder, children: _Piece(put, children, _span(children))


_FIELDS = {  # by token type: the modifier's name in the word tables, and its field in ast.Modifiers
    "AT": ("AT", "at"),
    "IN": ("AT", "within"),
    "ALWAYS": ("ALWAYS", "always"),
    "UNIT": ("UNIT", "unit"),
    "SORT": ("SORT", "sort"),
}


class _Given(Struct):
    """The parts of an instruction after its word, collected one by one. `row`: the word's table row; `grouped`: whether
    parentheses follow the word; `values`: the expressions after `=`; `led`: arguments with a leading word, by this
    word."""

    row: Word
    arguments: Items = []
    grouped: bool = False
    values: Items = []
    led: dict[str, Expression] = {}
    task: Expression | None = None
    modifiers: dict[str, tuple[str, Any]] = {}  # (field of ast.Modifiers, value), by the modifier's name in the tables

    def put_arguments(self, *children: Any) -> None:
        items = _items(children, self.row, self.row.plain)
        if self.row.leads:
            self._refuse_beyond(items, self.row.plain or 0, "arguments")
        self.arguments += items

    def put_value(self, sign: Token, given: _Piece) -> None:
        if (wanted := self.row.value) is None:
            raise self._refusal(sign)
        self.values = _items(given.children, self.row, None if wanted.repeated else 1)
        if not wanted.repeated:
            hint, first = "", next(iter(self.arguments), None)
            if wanted.shape is Shape.PLACE and len(self.values) > 2 and isinstance(first, ast.Variable):
                hint = f"{self.row.name} {first.sigil}{first.name} = TRANS(x, y, z, o, a, t)"  # for POINT p = 0, 500, 0
            self._refuse_beyond(self.values, 1, "values", hint)

    def put_group(self, _open: Token, *given: _Piece | Token) -> None:
        """Add the arguments in parentheses. None is added for each omitted argument, so that the arguments after the
        parentheses keep their positions."""
        self.grouped = True
        items, most = (_items(given[0].children) if isinstance(given[0], _Piece) else []), self.row.group_size
        if self.row.takes_task:
            self.task = items[0]
        else:
            self._refuse_beyond(items, most, "in parentheses")
            self.arguments += (*items[:most], *(None,) * (most - len(items)))

    def put_lead(self, word: Token, value: Expression) -> None:
        if word.value in self.led:
            raise self._refusal(word)
        self.led[word.value] = value

    def put_modifier(self, word: Token, value: Expression | None = None) -> None:
        sort, field = _FIELDS[word.type]
        if sort not in self.row.modifiers or sort in self.modifiers:
            raise self._refusal(word)
        self.modifiers[sort] = field, word.type == "ALWAYS" or value or word.value

    def instruction(self, span: Span) -> ast.Instruction:
        row, value = self.row, None
        arguments = _fit(self._in_order(), row.arguments)
        if self.values and row.value is not None:
            given = _fit(self.values, (row.value,))
            arguments, value = (arguments + given, None) if row.value.repeated else (arguments, given[0])
        modifiers = ast.Modifiers(**dict(self.modifiers.values())) if self.modifiers else ast.NO_MODIFIERS
        if (
            row.name == "JMOVE" and len(arguments) == 1 and not isinstance(arguments[0], ast.Number)
        ):  # Kawasaki's JMOVE moves to a location, so a user may expect the same here
            raise refusal(CannotInterpret, span, "JMOVE takes the values of all joints", "MOVE goes to a location")
        empty = self.grouped and self.task is None and not any(self.arguments[: row.group_size])
        return ast.Instruction(row.name, arguments, value, modifiers, empty, span=span)

    def _in_order(self) -> Items:
        """Return the arguments in the order of the table row, with the task number as the last argument, and None for
        omitted arguments."""
        row, items = self.row, self.arguments
        # the group in parentheses may be omitted: ACCEL 50 has None in place of the 1 in ACCEL (1) 50
        if 0 < row.group_size < len(row.arguments) and not self.grouped and items:
            items = [*[None] * row.group_size, *items]
        if self.led:
            plain = sum(not argument.lead for argument in row.arguments)
            led = [self.led.get(argument.lead) for argument in row.arguments if argument.lead]
            items = [*items, *[None] * (plain - len(items)), *ast.trim(led)]
        if row.takes_task and (self.task is not None or len(items) >= len(row.arguments)):
            place = len(row.arguments) - 1
            items = [*items[:place], *[None] * (place - len(items)), self.task, *items[place:]]
        first = row.arguments[0] if row.arguments else None
        if first is not None and first.shape is Shape.STRING and first.optional and ast.begins_with_variable(items):
            items = [None, *items]
        return items

    def _refuse_beyond(self, items: Items, most: int, what: str, hint: str = "") -> None:
        if (beyond := next((item for item in items[most:] if item is not None), None)) is not None:
            hint = hint or f"the form is {self.row.form}"
            raise refusal(CannotInterpret, beyond.span, f"{self.row.name}: too many {what}", hint)

    def _refusal(self, token: Token) -> LineRefused:
        row, form = self.row, f"the form is {self.row.form}"
        equals = dict.fromkeys(("WAIT", "TYPE"), f"= assigns, == compares; {form}")
        equals["SIGNAL"] = "SIGNAL 1 turns a signal on, SIGNAL -1 turns it off"
        hint = equals.get(row.name, form) if token.text == "=" else form
        instruction = INSTRUCTIONS.get(row.name, row)
        if token.type in _FIELDS and _FIELDS[token.type][0] in instruction.modifiers - row.modifiers:
            hint = f"DO {row.name} takes it: {instruction.form}"
        return refusal(CannotInterpret, token.span, f"{row.name} takes no {token.value} here", hint)


N = TypeVar("N")


class Grouping(Struct, Generic[N]):
    """A converter of flat expressions `PREFIX* value (INFIX PREFIX* value)*` to trees, by precedence climbing.

    `order`: the ranks of the operators; `unary`, `binary`: make the node of an operation from its sign and operands.
    """

    order: Order
    unary: Callable[[Token, N], N]
    binary: Callable[[Token, N, N], N]

    def tree(self, items: Sequence[Token | N]) -> N:
        root, _ = self._climb(items, 0, 0)
        return root

    def _climb(self, items: Sequence[Token | N], at: int, rank: int) -> tuple[N, int]:
        """Return the tree that begins at index `at` and extends to the next operator whose rank is `rank` or lower, and
        the index of this operator (or of the end)."""
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


# --- the rules -----------------------------------------------------------------------------------------------------

T = TypeVar("T")


def _by_name(rule: Callable[..., T]) -> Callable[[Builder, Children], T]:
    """Decorate a method so that it takes the span of its rule, then each child of the rule as an argument."""
    return lambda builder, children: rule(builder, _span(children), *children)


def _node(kind: Callable[..., T], places: int = 0) -> Callable[[Builder, Children], T]:
    """Return the builder method for a rule whose result is a node of class `kind`, with the rule's child nodes as
    fields. `places`: the number of these fields; fields without a child are None."""

    def build(_builder: Builder, children: Children) -> T:
        nodes = [child for child in children if type(child) is not Token]
        return kind(*nodes, *(None,) * (places - len(nodes)), span=_span(children))

    return build


class Builder:
    """A builder of tree nodes; its methods have the names of the grammar's rules."""

    def __init__(self) -> None:
        self._grouping: Grouping[Expression] = Grouping(ORDER, _unary, _binary)

    # --- lines ---

    do_command = _node(ast.DoInstruction, 1)
    show = _node(ast.Show)

    @_by_name
    def explain_command(self, span: Span, _command: Token, *rest: Any) -> ast.ExplainCommand:
        topic = next((one.value for one in rest if type(one) is Token), "")
        return ast.ExplainCommand(topic, next((one for one in rest if type(one) is not Token), None), span=span)

    @_by_name
    def header(self, span: Span, name: Token, *rest: Any) -> ast.ProgramHeader:
        if name.text[0] in "#$%":
            raise refusal(InvalidName, name.span, name.text, "a program name begins with a letter")
        return ast.ProgramHeader(name.text, tuple(child for child in rest if type(child) is not Token), None, span=span)

    @_by_name
    def entry(self, span: Span, variable: ast.Variable, *rest: Any) -> ast.Entry:
        pieces = [child.value for child in rest if isinstance(child, ast.StringConstant)]
        tokens = [child for child in rest if _is(child, "NUMBER")]
        numbers = tuple(value for token in tokens if (value := signed_number(token.text)) is not None)
        if len(numbers) < len(tokens):
            wrong = next(token for token in tokens if signed_number(token.text) is None)
            raise refusal(InvalidNumber, wrong.span, wrong.text)
        return ast.Entry(variable, numbers, "".join(pieces) if pieces else None, span=span)

    def string(self, children: Children) -> ast.StringConstant:
        return ast.StringConstant(children[0].value, span=children[0].span)

    @_by_name
    def character(self, span: Span, name: Token, _open: Token, number: Token, _close: Token) -> ast.StringConstant:
        """Return the string that `$CHR(34)` stands for in a section: one character that cannot be written in quotes.
        Raises LineRefused."""
        code = number_value(number.text)
        if name.value.upper() != "$CHR" or code is None or not 0 <= code <= LAST_CHARACTER or not code.is_integer():
            raise refusal(
                IllegalExpression, span, name.text, 'strings here are made of "text" and $CHR(0) to $CHR(255)'
            )
        return ast.StringConstant(chr(int(code)), span=span)

    # --- statements ---

    assignment = _node(ast.Assignment)
    if_then = _node(ast.If)
    else_ = _node(ast.Else)
    while_do = _node(ast.While)
    do = _node(ast.Do)
    until = _node(ast.Until)
    for_to = _node(ast.For, 4)
    case_of = _node(ast.Case)
    any = _node(ast.Any)
    end = _node(ast.End)

    @_by_name
    def goto(self, span: Span, _goto: Token, label: Token) -> ast.Goto:
        return ast.Goto(label_value(label.text, label.span), span=span)

    @_by_name
    def if_goto(self, span: Span, _if: Token, condition: Expression, link: Token, label: Token) -> ast.IfGoto:
        compares = isinstance(condition, ast.Binary) and not condition.grouped and condition.operator in RELATIONS
        then = link.type == "THEN_LABEL"
        if then and not compares:
            raise refusal(
                IllegalExpression,
                condition.span,
                "IF ... THEN label compares two values",
                "write IF condition GOTO label",
            )
        return ast.IfGoto(condition, label_value(label.text, label.span), then, span=span)

    @_by_name
    def value(self, span: Span, *children: Any) -> ast.Value:
        return ast.Value(tuple(child for child in children if type(child) is not Token), span=span)

    @_by_name
    def instruction(self, span: Span, word: Token, *pieces: _Piece) -> ast.Instruction:
        assert word.row is not None
        given = _Given(word.row)
        for piece in pieces:
            piece.put(given, *piece.children)
        return given.instruction(span)

    group = _piece(_Given.put_group)
    arguments = _piece(_Given.put_arguments)
    valued = _piece(_Given.put_value)
    lead = _piece(_Given.put_lead)
    modifier = _piece(_Given.put_modifier)

    @_by_name
    def unread(self, span: Span, word: Token, rest: Token) -> ast.Instruction:
        return ast.Instruction(word.value, (ast.BareWord(rest.text, span=rest.span),), span=span)

    # --- expressions ---

    def expression(self, children: Children) -> Expression:
        return self._grouping.tree(children)

    def number(self, children: Children) -> ast.Number:
        token: Token = children[0]
        if (value := number_value(token.text)) is None:
            hint = "write ^HFF, ^B101 (8 digits), ^17 or 'A" if token.text[0] in "^'" else "reals go to about 3E38"
            raise refusal(InvalidNumber, token.span, token.text, hint)
        return ast.Number(value, token.text.upper() if token.text[0] != "'" else token.text, span=token.span)

    def format(self, children: Children) -> ast.Format:
        token: Token = children[0]
        width, _, decimals = token.text[2:].partition(".")
        if max(len(width), len(decimals)) > FORMAT_DIGITS:
            raise refusal(
                InvalidNumber, token.span, token.text, f"the numbers of a format code have up to {FORMAT_DIGITS} digits"
            )
        most, after_point = (int(digits) if digits else None for digits in (width, decimals))
        return ast.Format(token.text[1].upper(), most, after_point, span=token.span)

    def raw(self, children: Children) -> ast.BareWord:
        return ast.BareWord(children[0].value, span=children[0].span)

    def name(self, children: Children) -> ast.Call | ast.Variable:
        """Return a Call if the name is a constant (PI, HERE), otherwise a Variable."""
        token: Token = children[0]
        if (known := FUNCTIONS.get(token.text.upper())) is not None and known.constant:
            return ast.Call(known.name, (), span=token.span)
        return _variable(token, None, token.span)

    def variable(self, children: Children) -> ast.Variable:
        """Return a Variable even for the name of a constant, because the rule allows only variables."""
        name = self.name(children)
        return name.variable if isinstance(name, ast.Call) else name

    @_by_name
    def element(self, span: Span, name: Token, _open: Token, *inner: Any) -> ast.Variable:
        indexes = tuple(child for child in inner if type(child) is not Token)
        commas = sum(_is(child, "COMMA") for child in inner)
        if max(len(indexes), commas + 1) > INDEXES:
            at = indexes[INDEXES].span if len(indexes) > INDEXES else inner[-1].span
            raise refusal(IllegalExpression, at, "too many indexes", f"an array has up to {INDEXES}")
        return replace(_variable(name, indexes, span), rest=commas - max(len(indexes) - 1, 0))

    @_by_name
    def applied(self, span: Span, text: ast.Variable | Token, _open: Token, *inner: Any) -> ast.Applied:
        return ast.Applied(
            self.string([text]) if isinstance(text, Token) else text, tuple(_items(inner[:-1])), span=span
        )

    @_by_name
    def call(self, span: Span, name: Token, _open: Token, *inner: Any) -> ast.Call:
        upper, given = name.text.upper(), inner[:-1]
        known = FUNCTIONS.get(upper)
        _check_by(upper, given)
        arguments = tuple(_items(given, known, None if known is None or known.repeats else len(known.arguments)))
        if known is not None:
            arguments = _fit(arguments, known.arguments)
        return ast.Call(upper if known else name.text, arguments, True, span=span)

    @_by_name
    def program(self, span: Span, name: Token, *inner: Any) -> ast.ProgramCall:
        given = inner[1:-1]
        _check_by("", given)
        return ast.ProgramCall(name.text, tuple(_items(given)), bool(inner), span=span)

    @_by_name
    def grouped(self, span: Span, _open: Token, inner: Expression, _close: Token) -> Expression:
        if isinstance(inner, ast.Binary | ast.Unary | ast.Variable) or (
            isinstance(inner, ast.Call) and not inner.parenthesised
        ):
            return replace(inner, span=span, grouped=True)
        return inner


class ValBuilder(Builder):
    """A builder of trees with the operator precedence of VAL-II.

    If V+ would group an expression differently, the builder marks the operations as parenthesized, so that the printed
    text has the same meaning in every dialect.
    """

    def __init__(self) -> None:
        super().__init__()
        self._theirs: Grouping[Expression] = Grouping(VAL_ORDER, _unary, _binary)

    def expression(self, children: Children) -> Expression:
        ours = self._grouping.tree(children)
        if not any(type(child) is Token and child.value in LOGICAL for child in children):
            return ours
        theirs = self._theirs.tree(children)
        return ours if theirs == ours else _with_parentheses(theirs, grouped=False)


def _with_parentheses(expression: Expression, *, grouped: bool = True) -> Expression:
    """Return an expression with parentheses around each operation; around the outermost operation only if `grouped`."""
    if isinstance(expression, ast.Binary) and not expression.grouped:
        left, right = map(_with_parentheses, (expression.left, expression.right))
        return replace(expression, left=left, right=right, grouped=grouped)
    if isinstance(expression, ast.Unary) and not expression.grouped:
        return replace(expression, operand=_with_parentheses(expression.operand), grouped=grouped)
    return expression


def _check_by(name: str, given: Sequence[Any]) -> None:
    """Check that BY stands only after the first argument of a function that takes BY (SHIFT). Raises LineRefused."""
    signs = [child for child in given if type(child) is Token]
    for place, sign in enumerate(signs):
        if (sign.type == "BY") != (place == 0 and name in WITH_BY):
            hint = f"the form is {FUNCTIONS[name].form}" if name in FUNCTIONS else ""
            raise refusal(IllegalExpression, sign.span, f"{sign.text} does not belong here", hint)


def _is(child: Any, type_: str) -> bool:
    return type(child) is Token and child.type == type_


def _unary(sign: Token, operand: Expression) -> Expression:
    return ast.Unary(sign.value, operand, span=_span((sign, operand)))


def _binary(sign: Token, left: Expression, right: Expression) -> Expression:
    return ast.Binary(sign.value, left, right, span=_span((left, right)))
