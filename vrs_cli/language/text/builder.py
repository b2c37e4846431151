"""Grammar rules to syntax trees: one method a rule of grammar/val2.lark, which the parser calls as it reduces.

A rule has its children in their order, tokens among them, so that every span is exact. What the tables say of a word
(which modifiers it takes, whether `=` may follow) is applied here, where the token still is; counts and kinds of
arguments are the analyzer's affair.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from msgspec.structs import replace

from vrs_cli.engine.parameters import PARAMETERS
from vrs_cli.errors import CannotInterpret, IllegalExpression, InvalidName, InvalidNumber, NotAvailable
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Expression, Span
from vrs_cli.language.text.diagnostics import LineRefused, error
from vrs_cli.language.text.lexer import LABEL_HIGH, Token
from vrs_cli.language.text.precedence import ORDER, RELATIONS, Grouping
from vrs_cli.language.words.functions import FUNCTIONS, WITH_BY, Function
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.word import Argument, Shape, Word

Children = list[Any]  # tokens, nodes and lists of them, as the rule has them

LARGEST = 3.4e38  # the largest single-precision real
BINARY_DIGITS = 8
FORMAT_DIGITS = 3  # of a width, or of a number of decimals or lines
INDEXES = 3
LAST_CHARACTER = 255  # of $CHR


def _end(child: Any) -> int:
    """The column after a token or a node."""
    end: int = child.end if type(child) is Token else child.span.end
    return end


def _from(first: Token | Expression, last: Any) -> Span:
    start = first if type(first) is Token else first.span
    return Span(start.line, start.column, _end(last))


def _all(children: Children) -> Span:
    return _from(children[0], children[-1])


# --- numbers and variables -----------------------------------------------------------------------------------------


def number_value(text: str) -> float | None:
    """The value of a constant of the language, or None where it is none: `5`, `1E-3`, `^HFF`, `^B101`, `^17`, `'A`."""
    try:
        if text[0] == "'":
            return float(ord(text[1]))
        value = _based(text[1:]) if text[0] == "^" else float(text)
    except (ValueError, OverflowError):
        return None
    return value if value <= LARGEST else None


def _based(text: str) -> float:
    """Raises ValueError, OverflowError."""
    base = _BASES.get(text[0].upper())
    digits = text if base is None else text[1:]
    if base == 2 and len(digits) > BINARY_DIGITS:
        raise ValueError(text)
    return float(int(digits, base or 8))


_BASES = {"B": 2, "H": 16, "D": 10}


def _number(token: Token) -> ast.Number:
    value = number_value(token.text)
    if value is None:
        hint = "write ^HFF, ^B101 (8 digits), ^17 or 'A" if token.text[0] in "^'" else "reals go to about 3E38"
        raise LineRefused(error(InvalidNumber, token.span, token.text, hint))
    return ast.Number(value, token.text.upper() if token.text[0] != "'" else token.text, token.span)


def _variable(name: Token, indexes: tuple[Expression, ...] | None, span: Span) -> ast.Variable:
    text = name.text
    if text[0] == "%":
        raise LineRefused(error(NotAvailable, name.span, f"{text} is a belt", "there is no conveyor at this robot"))
    if text[0] in "#$":
        return ast.Variable(text[1:], text[0], indexes, span)
    return ast.Variable(text, "", indexes, span)


def _as_variable(name: Expression) -> ast.Variable:
    """What stands where only a variable can: there the name of a constant is a name like others."""
    if isinstance(name, ast.Call):
        return name.variable
    assert isinstance(name, ast.Variable)
    return name


def _label(token: Token) -> int:
    value = number_value(token.text)
    if value is None or not token.text.isdigit() or value > LABEL_HIGH:
        raise LineRefused(error(InvalidNumber, token.span, token.text, f"labels are 0 to {LABEL_HIGH}"))
    return int(value)


def _listed(children: Sequence[Any]) -> list[Expression | None]:
    """Expressions between commas, None for an omitted one, none after the last."""
    items: list[Expression | None] = [None]
    for child in children:
        if type(child) is Token:
            items.append(None)
        else:
            items[-1] = child
    while items and items[-1] is None:
        items.pop()
    return items


def _refuse_last_comma(children: Sequence[Any], places: int | None, row: Word | Function) -> None:
    """A comma at the end leaves a place out: there must be one (`places`; None: the last repeats, none is left out)."""
    last = children[-1]
    if places is None or sum(type(child) is Token for child in children) >= places:
        detail = f"{row.name}: nothing stands behind {last.text}"
        raise LineRefused(error(CannotInterpret, last.span, detail, f"the form is {row.form}"))


# --- arguments as the table wants them -----------------------------------------------------------------------------


def _to_word(expression: Expression) -> Expression:
    if isinstance(expression, ast.Variable) and expression.indexes is None:
        return ast.Word(expression.sigil + expression.name, expression.span)
    if isinstance(expression, ast.Call) and not expression.parenthesised:
        return ast.Word(expression.name, expression.span)
    return expression


def _to_setting(expression: Expression) -> Expression:
    """A word that some parameter takes is not the variable of that name."""
    word = _to_word(expression) if isinstance(expression, ast.Variable) else expression
    return word if isinstance(word, ast.Word) and word.text.upper() in _SETTINGS else expression


_SETTINGS = frozenset(word for row in PARAMETERS.values() for word in row.words)


def _to_applied(expression: Expression) -> Expression:
    """`$name(a)` looks like a function."""
    if isinstance(expression, ast.Call) and expression.name[0] == "$" and expression.name not in FUNCTIONS:
        text = ast.Variable(expression.name[1:], "$", None, expression.span)
        return ast.Applied(text, expression.arguments, expression.span)
    return expression


def _to_variable(expression: Expression) -> Expression:
    """Where a name is defined, also that of a constant is one."""
    if isinstance(expression, ast.Call) and not expression.parenthesised:
        return expression.variable
    if isinstance(expression, ast.Binary) and expression.operator == ":":
        return replace(expression, right=_to_variable(expression.right))
    return expression


_SHAPED: Mapping[Shape, Callable[[Expression], Expression]] = {
    Shape.SWITCH: _to_word,
    Shape.PARAMETER_NAME: _to_word,
    Shape.WORD: _to_word,
    Shape.BRANCH: _to_word,
    Shape.PROGRAM_TEXT: _to_applied,
    Shape.VARIABLE: _to_variable,
    Shape.REAL_VARIABLE: _to_variable,
    Shape.LOCATION_VARIABLE: _to_variable,
    Shape.STRING_VARIABLE: _to_variable,
    Shape.UNIT: _to_variable,
    Shape.SETTING: _to_setting,
}


def _shaped(items: list[Expression | None], places: tuple[Argument, ...]) -> tuple[Expression | None, ...]:
    if not places:
        return tuple(items)
    last = len(places) - 1
    return tuple(
        item if item is None or (shape := _SHAPED.get(places[min(at, last)].shape)) is None else shape(item)
        for at, item in enumerate(items)
    )


def text_omitted(items: Sequence[Expression | None]) -> bool:
    """Whether the arguments of PROMPT begin with a variable to read, not with its text.

    A string variable alone is read; before others it is the text.
    """
    first = _to_variable(items[0]) if items and items[0] is not None else None
    return isinstance(first, ast.Variable) and (first.sigil != "$" or len(items) == 1)


def _placed(row: Word, items: list[Expression | None]) -> tuple[Expression | None, ...]:
    first = row.arguments[0] if row.arguments else None
    if first is not None and first.shape is Shape.STRING and first.optional and text_omitted(items):
        items = [None, *items]
    return _shaped(items, row.arguments)


# --- the rules -----------------------------------------------------------------------------------------------------


class _Given:
    """What stands after the word of an instruction, put together piece by piece."""

    def __init__(self, word: Token) -> None:
        assert word.row is not None
        self.row = word.row
        self.arguments: list[Expression | None] = []
        self.value: list[Expression | None] | None = None
        self.led: dict[str, Expression] = {}
        self.at: Expression | None = None
        self.within: Expression | None = None
        self.always = False
        self.unit: str | None = None
        self.sort: str | None = None
        self.task: Expression | None = None

    def refuse(self, token: Token) -> LineRefused:
        hint = f"the form is {self.row.form}"
        instruction = INSTRUCTIONS.get(self.row.name, self.row)
        if _SORTS.get(token.type) in instruction.modifiers - self.row.modifiers:
            hint = f"DO {self.row.name} takes it: {instruction.form}"
        return LineRefused(error(CannotInterpret, token.span, f"{self.row.name} takes no {token.value} here", hint))

    def equals(self, sign: Token) -> None:
        if self.row.value is None:
            raise self.refuse(sign)
        self.value = []

    def items(self, items: list[Expression | None]) -> None:
        if self.value is None:
            self.arguments += items
            return
        self.value = items
        beyond = items[1] if len(items) > 1 else None
        if beyond is not None and self.row.value is not None and not self.row.value.repeated:
            hint = f"the form is {self.row.form}"
            raise LineRefused(error(CannotInterpret, beyond.span, f"{self.row.name}: too many values", hint))

    def group(self, items: list[Expression | None]) -> None:
        """What stands in parentheses: as many places as the table has, so that those after them keep theirs."""
        most = self.row.grouped
        beyond = next((item for item in items[most:] if item is not None), None)
        if beyond is not None:
            hint = f"the form is {self.row.form}"
            raise LineRefused(error(CannotInterpret, beyond.span, f"{self.row.name}: too many in parentheses", hint))
        self.arguments += (*items[:most], *(None,) * (most - len(items)))

    def modifier(self, token: Token, expression: Expression | None) -> None:
        sort = _SORTS[token.type]
        if sort not in self.row.modifiers or self._has(sort):
            raise self.refuse(token)
        _KEEP[token.type](self, token, expression)

    def _has(self, sort: str) -> bool:
        held = {"AT": self.at or self.within, "ALWAYS": self.always or None, "UNIT": self.unit, "SORT": self.sort}
        return held[sort] is not None

    def lead(self, token: Token, expression: Expression) -> None:
        if token.value in self.led:
            raise self.refuse(token)
        self.led[token.value] = expression

    def _at(self, _token: Token, expression: Expression | None) -> None:
        self.at = expression

    def _within(self, _token: Token, expression: Expression | None) -> None:
        self.within = expression

    def _always(self, _token: Token, _expression: Expression | None) -> None:
        self.always = True

    def _unit(self, token: Token, _expression: Expression | None) -> None:
        self.unit = token.value

    def _sort(self, token: Token, _expression: Expression | None) -> None:
        self.sort = token.value

    def placed(self) -> tuple[Expression | None, ...]:
        """All arguments in the order of the table: those in order, those with a leading word, a repeated value."""
        row = self.row
        items = self.arguments
        if self.led:
            plain = [argument for argument in row.arguments if not argument.lead]
            items = items + [None] * (len(plain) - len(items))
            items += [self.led.get(argument.lead) for argument in row.arguments if argument.lead]
            items = items[: len(items) - next(i for i, item in enumerate(reversed(items)) if item is not None)]
        if self.task is not None:
            items = [*items, *[None] * (len(row.arguments) - 1 - len(items)), self.task]
        elif row.tasked and len(items) >= len(row.arguments):
            items.insert(len(row.arguments) - 1, None)
        placed = _placed(row, items)
        if self.value and row.value is not None and row.value.repeated:
            placed += _shaped(self.value, (row.value,))
        return placed

    def valued(self) -> Expression | None:
        row = self.row
        if not self.value or row.value is None or row.value.repeated:
            return None
        return _shaped(self.value, (row.value,))[0]

    def modifiers(self) -> ast.Modifiers:
        if (self.at or self.within or self.unit or self.sort) is None and not self.always:
            return ast.NO_MODIFIERS
        return ast.Modifiers(self.at, self.within, self.always, self.unit, self.sort)


_SORTS = {"AT": "AT", "IN": "AT", "ALWAYS": "ALWAYS", "UNIT": "UNIT", "SORT": "SORT"}
_KEEP: Mapping[str, Callable[[_Given, Token, Expression | None], None]] = {
    "AT": _Given._at,
    "IN": _Given._within,
    "ALWAYS": _Given._always,
    "UNIT": _Given._unit,
    "SORT": _Given._sort,
}


class Builder:
    """The methods bear the names of the rules."""

    def __init__(self) -> None:
        self._grouping: Grouping[Expression] = Grouping(ORDER, _unary, _binary)

    # --- lines ---

    def step(self, children: Children) -> ast.Step:
        label, statement, comment = None, None, None
        for child in children:
            if type(child) is not Token:
                statement = child
            elif child.type == "LABEL":
                label = int(child.text)
            else:
                comment = child.value[1:]
        span = _all(children) if children else Span(0, 1, 1)
        return ast.Step(label, statement, comment, span)

    def prompt(self, children: Children) -> ast.Statement | None:
        """A statement that no monitor command is, is one for DO."""
        if not children or type(children[0]) is Token:
            return None
        statement: ast.Statement = children[0]
        return statement

    def do_command(self, children: Children) -> ast.DoInstruction:
        return ast.DoInstruction(children[1] if len(children) > 1 else None, _all(children))

    def show(self, children: Children) -> ast.Show:
        return ast.Show(children[0], _all(children))

    def header(self, children: Children) -> ast.ProgramHeader:
        name: Token = children[0]
        if name.text[0] in "#$%":
            raise LineRefused(error(InvalidName, name.span, name.text, "a program name begins with a letter"))
        comment = children[-1].value[1:] if _is(children[-1], "COMMENT") else None
        parameters = tuple(_as_variable(child) for child in children if type(child) is not Token)
        return ast.ProgramHeader(name.text, parameters, comment, _all(children))

    def entry(self, children: Children) -> ast.Entry:
        variable = _as_variable(children[0])
        comment = children.pop().value[1:] if _is(children[-1], "COMMENT") else None
        pieces = [child.value for child in children[1:] if isinstance(child, ast.Text)]
        numbers = tuple(_signed(child) for child in children[1:] if _is(child, "NUMBER"))
        return ast.Entry(variable, numbers, "".join(pieces) if pieces else None, _all(children), comment)

    def piece(self, children: Children) -> ast.Text:
        """A part of a string in a section: text, or `$CHR(34)` for what cannot stand in quotes."""
        if len(children) == 1:
            return ast.Text(children[0].value, children[0].span)
        name, _, number, _ = children
        code = number_value(number.text)
        if name.value.upper() != "$CHR" or code is None or not 0 <= code <= LAST_CHARACTER or not code.is_integer():
            hint = 'strings here are made of "text" and $CHR(0) to $CHR(255)'
            raise LineRefused(error(IllegalExpression, _all(children), name.text, hint))
        return ast.Text(chr(int(code)), _all(children))

    # --- statements ---

    def assignment(self, children: Children) -> ast.Assignment:
        return ast.Assignment(_as_variable(children[0]), children[2], _all(children))

    def goto(self, children: Children) -> ast.Goto:
        return ast.Goto(_label(children[1]), _all(children))

    def if_goto(self, children: Children) -> ast.IfGoto:
        return ast.IfGoto(children[1], _label(children[3]), _all(children))

    def if_then(self, children: Children) -> ast.If:
        return ast.If(children[1], _all(children))

    def if_then_label(self, children: Children) -> ast.IfGoto:
        condition = children[1]
        if not isinstance(condition, ast.Binary) or condition.grouped or condition.operator not in RELATIONS:
            hint = "write IF condition GOTO label"
            raise LineRefused(error(IllegalExpression, condition.span, "IF ... THEN label compares two values", hint))
        return ast.IfGoto(condition, _label(children[3]), _all(children), then=True)

    def else_(self, children: Children) -> ast.Else:
        return ast.Else(_all(children))

    def while_do(self, children: Children) -> ast.While:
        return ast.While(children[1], _all(children))

    def do(self, children: Children) -> ast.Do:
        return ast.Do(_all(children))

    def until(self, children: Children) -> ast.Until:
        return ast.Until(children[1], _all(children))

    def for_to(self, children: Children) -> ast.For:
        step = children[7] if len(children) > 6 else None
        return ast.For(_as_variable(children[1]), children[3], children[5], step, _all(children))

    def case_of(self, children: Children) -> ast.Case:
        return ast.Case(children[1], _all(children))

    def value(self, children: Children) -> ast.Value:
        return ast.Value(tuple(child for child in children if type(child) is not Token), _all(children))

    def any(self, children: Children) -> ast.Any:
        return ast.Any(_all(children))

    def end(self, children: Children) -> ast.End:
        return ast.End(_all(children))

    def instruction(self, children: Children) -> ast.Instruction:
        given = _Given(children[0])
        end = children[0]
        for child in children[1:]:
            end = _GIVE[child[0]](given, child[1]) if type(child) is tuple else self._token(given, child)
        span = _from(children[0], end)
        return ast.Instruction(given.row.name, given.placed(), span, given.valued(), given.modifiers())

    def _token(self, given: _Given, token: Token) -> Token:
        if token.type == "EQUAL":
            given.equals(token)
        else:
            given.modifier(token, None)
        return token

    def unread(self, children: Children) -> ast.Instruction:
        word, rest = children
        return ast.Instruction(word.value, (ast.Word(rest.text, rest.span),), _all(children))

    def arguments(self, children: Children) -> tuple[str, Children]:
        return ("arguments", children)

    def group(self, children: Children) -> tuple[str, Children]:
        return ("group", children)

    def lead(self, children: Children) -> tuple[str, Children]:
        return ("lead", children)

    def modifier(self, children: Children) -> tuple[str, Children]:
        return ("modifier", children)

    def format(self, children: Children) -> ast.Format:
        token: Token = children[0]
        width, _, decimals = token.text[2:].partition(".")
        if max(len(width), len(decimals)) > FORMAT_DIGITS:
            detail, hint = token.text, f"the numbers of a format code have up to {FORMAT_DIGITS} digits"
            raise LineRefused(error(InvalidNumber, token.span, detail, hint))
        return ast.Format(token.text[1].upper(), _digits(width), _digits(decimals), token.span)

    def raw(self, children: Children) -> ast.Word:
        return ast.Word(children[0].value, children[0].span)

    # --- expressions ---

    def expression(self, children: Children) -> Expression:
        return self._grouping.tree(children)

    def number(self, children: Children) -> ast.Number:
        return _number(children[0])

    def text(self, children: Children) -> ast.Text:
        return ast.Text(children[0].value, children[0].span)

    def name(self, children: Children) -> Expression:
        token: Token = children[0]
        known = FUNCTIONS.get(token.text.upper())
        if known is not None and known.constant:
            return ast.Call(known.name, (), token.span)
        return _variable(token, None, token.span)

    def element(self, children: Children) -> ast.Variable:
        indexes = tuple(child for child in children if type(child) is not Token)
        commas = sum(_is(child, "COMMA") for child in children)
        if max(len(indexes), commas + 1) > INDEXES:
            at = indexes[INDEXES].span if len(indexes) > INDEXES else children[-1].span
            raise LineRefused(error(IllegalExpression, at, "too many indexes", f"an array has up to {INDEXES}"))
        rest = commas - max(len(indexes) - 1, 0)
        return replace(_variable(children[0], indexes, _all(children)), rest=rest)

    def applied(self, children: Children) -> ast.Applied:
        return ast.Applied(children[0], tuple(_listed(children[2:-1])), _all(children))

    def call(self, children: Children) -> ast.Call:
        name: Token = children[0]
        upper = name.text.upper()
        self._check_by(upper, children)
        arguments = tuple(_listed(children[2:-1]))
        known = FUNCTIONS.get(upper)
        if known is not None:
            if _is(children[-2], "COMMA"):
                repeats = bool(known.arguments) and known.arguments[-1].repeated
                _refuse_last_comma(children[2:-1], None if repeats else len(known.arguments), known)
            arguments = _shaped(list(arguments), known.arguments)
        return ast.Call(upper if known else name.text, arguments, _all(children), True)

    def program(self, children: Children) -> ast.ProgramCall:
        name: Token = children[0]
        self._check_by("", children)
        return ast.ProgramCall(name.text, tuple(_listed(children[2:-1])), _all(children), len(children) > 1)

    def _check_by(self, name: str, children: Children) -> None:
        """BY stands after the first argument of the functions that have it, and nowhere else."""
        signs = [child for child in children[2:-1] if type(child) is Token]
        for place, sign in enumerate(signs):
            if (sign.type == "BY") != (place == 0 and name in WITH_BY):
                hint = f"the form is {FUNCTIONS[name].form}" if name in FUNCTIONS else ""
                raise LineRefused(error(IllegalExpression, sign.span, f"{sign.text} does not belong here", hint))

    def grouped(self, children: Children) -> Expression:
        inner: Expression = children[1]
        if isinstance(inner, ast.Binary | ast.Unary | ast.Variable) or (
            isinstance(inner, ast.Call) and not inner.parenthesised
        ):
            return replace(inner, span=_all(children), grouped=True)
        return inner


def _is(child: Any, type_: str) -> bool:
    return type(child) is Token and child.type == type_


def _digits(text: str) -> int | None:
    return int(text) if text else None


def _signed(token: Token) -> float:
    text = token.text
    value = number_value(text.lstrip("+-"))
    if value is None:
        raise LineRefused(error(InvalidNumber, token.span, text))
    return -value if text[0] == "-" else value


def _unary(sign: Token, operand: Expression) -> Expression:
    return ast.Unary(sign.value, operand, _from(sign, operand))


def _binary(sign: Token, left: Expression, right: Expression) -> Expression:
    return ast.Binary(sign.value, left, right, _from(left, right))


# --- pieces of an instruction, by the rule they come from; each gives its last child -------------------------------


def _give_arguments(given: _Given, children: Children) -> Any:
    row = given.row
    if type(children[-1]) is Token:
        _refuse_last_comma(children, _places(given), row)
    given.items(_listed(children))
    return children[-1]


def _places(given: _Given) -> int | None:
    """How many expressions may stand there; None where the last is repeated."""
    if given.value is None:
        return given.row.plain
    return None if given.row.value is not None and given.row.value.repeated else 1


def _give_group(given: _Given, children: Children) -> Any:
    if given.row.tasked:
        given.task = children[1][1][0]
    else:
        given.group(_listed(children[1][1]))
    return children[-1]


def _give_lead(given: _Given, children: Children) -> Any:
    given.lead(children[0], children[1])
    return children[1]


def _give_modifier(given: _Given, children: Children) -> Any:
    given.modifier(children[0], children[1])
    return children[1]


_GIVE: Mapping[str, Callable[[_Given, Children], Any]] = {
    "arguments": _give_arguments,
    "group": _give_group,
    "lead": _give_lead,
    "modifier": _give_modifier,
}
