"""Parse one line of VAL-II with grammar/val2.lark, or explain why the line does not fit and suggest a correction.

The tokens are parsed by the LALR(1) algorithm (Aho, Sethi, Ullman: Compilers, 4.7). Lark makes the parse table of the
grammar. The table is stored in the user's cache, so that vrs rarely loads Lark; and `TableParser`, which uses the
table, is twice as fast as Lark.

Lark keeps the table in a private attribute. If a release of Lark has a different table format, `LarkParser` parses
through Lark's public interface and gives the same trees.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Container, Sequence
from functools import lru_cache, partial
from typing import Any, Protocol, cast

from msgspec import Struct
from msgspec.structs import astuple, replace

from vrs_cli.errors import CannotInterpret, IllegalExpression, MissingParenthesis, ProgramError, did_you_mean
from vrs_cli.extras import cached, shipped_folder
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Entry, Expression, Number, ProgramHeader, Statement, Step, Variable, resolve_line
from vrs_cli.language.text.builder import Builder, signed_number
from vrs_cli.language.text.lexer import Lexer, Token, label_value, patterns_of
from vrs_cli.language.words.foreign import NO_UNIT, PERCENT, SIDES, TIMED, UNITS, first_hint, form_of, only_reads, way
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS, OPERATOR_WORDS, RELATIONS_OF_VAL, RESERVED
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import MODIFIERS, Shape, Word
from vrs_cli.values.diagnostics import Diagnostic, LineRefused, Span, error

END = "$END"  # Lark's name of the terminal after the last token
FORM = "table 1"  # version of the cached table's format; a change makes vrs ignore older cached tables


class DoesNotFit(Exception):
    """Raised when the tokens do not fit the grammar. `token`: the first one that does not fit (None for the end of the
    line); `accepted`: the terminals that would fit in its place."""

    def __init__(self, token: Token | None, accepted: frozenset[str]) -> None:
        self.token, self.accepted = token, accepted


class TokenParser(Protocol):
    """A parser of tokens. `terminals`: the regular expression of each terminal of the grammar, by its name."""

    terminals: dict[str, str]

    def parse(self, tokens: Sequence[Token], start: str) -> Any:
        """Return the tree that the builder makes from the tokens. `start`: the start symbol of the grammar. Raises
        DoesNotFit; the builder raises LineRefused."""


def token_parser(grammar: str, starts: tuple[str, ...], builder: object) -> TokenParser:
    """Return a parser for a grammar. `starts`: the start symbols; `builder`: an object with a method for each rule,
    which takes the list of the rule's children and returns the result of the rule."""
    table = table_of(grammar, starts)
    return LarkParser(grammar, starts, builder) if table is None else TableParser(table, builder)


# --- the table -----------------------------------------------------------------------------------------------------


class Rule(Struct, frozen=True):
    """A rule of the grammar. `name`: the name of the builder's method; `origin`: the symbol on the left side of the
    rule; `helpers`: for each child, whether it is the result of a helper rule: a list, which is replaced by its items;
    `alone`: whether a single child is itself the result, so that the method is not called."""

    name: str
    origin: str
    helpers: tuple[bool, ...]
    alone: bool


class Table(Struct, frozen=True):
    """A parse table. `states`: by state and symbol, the next state (shift), or ~i where i is the index of the complete
    rule (reduce); `starts` and `ends`: the first and last state, by start symbol; `terminals`: the regular expression
    of each terminal, by its name."""

    states: dict[int, dict[str, int]]
    rules: list[Rule]
    starts: dict[str, int]
    ends: dict[str, int]
    terminals: dict[str, str]


def table_of(grammar: str, starts: tuple[str, ...]) -> Table | None:
    """Return the parse table of a grammar, from the cache or from Lark; None if this release of Lark has a different
    table format."""
    if (kept := cached("grammar.table", f"{FORM}\n{grammar}", partial(_sound_table, grammar, starts))) is None:
        return None
    states, rules, *rest = kept
    return Table(states, [Rule(*rule) for rule in rules], *rest)


def _sound_table(grammar: str, starts: tuple[str, ...]) -> tuple[Any, ...] | None:
    """Return the parse table that Lark makes from a grammar, as lists and dictionaries for the cache; None if the table
    has a different format or is not consistent."""
    try:
        table = _table(_lark(grammar, starts))
    except (AttributeError, KeyError, TypeError, ValueError):
        return None
    rules = list(map(astuple, table.rules))
    return (table.states, rules, table.starts, table.ends, table.terminals) if _is_sound(table, starts) else None


def _lark(grammar: str, starts: tuple[str, ...], builder: object = None) -> Any:
    from lark import Lark

    return Lark(grammar, start=list(starts), parser="lalr", lexer="basic", keep_all_tokens=True, transformer=builder)


def _table(lark: Any) -> Table:
    """Read the parse table that Lark has made. Raises AttributeError, KeyError, TypeError or ValueError if its format
    is different."""
    made = lark.parser.parser._parse_table
    rules = {rule: number for number, rule in enumerate(lark.rules)}
    states = {
        state: {str(symbol): ~rules[to] if to in rules else to for symbol, (_, to) in actions.items()}
        for state, actions in made.states.items()
    }
    shapes = [
        Rule(
            str(rule.alias or rule.origin.name),
            str(rule.origin.name),
            tuple(not symbol.is_term and symbol.name.startswith("_") for symbol in rule.expansion),
            bool(rule.options.expand1 and not rule.alias),
        )
        for rule in lark.rules
    ]
    return Table(states, shapes, dict(made.start_states), dict(made.end_states), _terminals(lark))


def _is_sound(table: Table, starts: tuple[str, ...]) -> bool:
    """Return whether each start symbol has a first and a last state, and each entry is an existing state or rule."""
    entries = [to for row in table.states.values() for to in row.values()]
    bounds = (*table.starts.values(), *table.ends.values())
    return (
        set(table.starts) == set(table.ends) == set(starts)
        and all(type(to) is int and (to in table.states or 0 <= ~to < len(table.rules)) for to in entries)
        and all(state in table.states for state in bounds)
        and any(to < 0 for to in entries)
    )


def _terminals(lark: Any) -> dict[str, str]:
    return {str(terminal.name): terminal.pattern.to_regexp() for terminal in lark.terminals}


# --- parsing with the table ----------------------------------------------------------------------------------------


class TableParser:
    """A parser of tokens that follows the parse table."""

    def __init__(self, table: Table, builder: object) -> None:
        self.table, self.terminals = table, table.terminals
        self._reductions = [_reduction(rule, builder) for rule in table.rules]

    def parse(self, tokens: Sequence[Token], start: str) -> Any:
        states, reductions, done = self.table.states, self._reductions, self.table.ends[start]
        at, values = [self.table.starts[start]], list[Any]()
        for token in (*tokens, None):
            terminal, stand = END if token is None else token.type, at.copy()
            while (to := states[at[-1]].get(terminal)) is not None and to < 0:
                origin, size, build = reductions[~to]
                children = values[len(values) - size :]
                del at[len(at) - size :], values[len(values) - size :]
                values.append(build(children))
                at.append(states[at[-1]][origin])
                if token is None and at[-1] == done:
                    return values[-1]
            if to is None:
                raise DoesNotFit(token, self._accepted_terminals(stand, start))
            at.append(to)
            values.append(token)
        raise AssertionError("the end of a line is never shifted")

    def _accepted_terminals(self, at: list[int], start: str) -> frozenset[str]:
        """Return the terminals that may follow the stack of states `at`. A terminal in the table row of the last state
        may still be impossible: the parser would refuse it after a reduction; such terminals are left out."""
        return frozenset(
            symbol for symbol in self.table.states[at[-1]] if symbol.isupper() and self._fits(at.copy(), symbol, start)
        )

    def _fits(self, at: list[int], symbol: str, start: str) -> bool:
        states = self.table.states
        while (to := states[at[-1]].get(symbol)) is not None and to < 0:
            origin, size, _ = self._reductions[~to]
            del at[len(at) - size :]
            at.append(states[at[-1]][origin])
            if at[-1] == self.table.ends[start]:
                return symbol == END
        return to is not None


# A complete rule: the symbol on its left side (origin), the number of its children, and the function that builds its
# result from them.
_Reduction = tuple[str, int, Callable[[list[Any]], Any]]


def _reduction(rule: Rule, builder: object) -> _Reduction:
    # the builder has no method for a helper rule, whose result is the list of its children
    build: Callable[[list[Any]], Any] = getattr(builder, rule.name, list)
    if rule.alone:
        build = partial(_only_child_or, build)
    if any(rule.helpers):
        build = partial(_with_children_of_helpers, build, rule.helpers)
    return rule.origin, len(rule.helpers), build


def _only_child_or(build: Callable[[list[Any]], Any], children: list[Any]) -> Any:
    return children[0] if len(children) == 1 else build(children)


def _with_children_of_helpers(build: Callable[[list[Any]], Any], helpers: tuple[bool, ...], children: list[Any]) -> Any:
    pairs = zip(helpers, children, strict=True)
    return build([one for helper, child in pairs for one in (child if helper else (child,))])


# --- parsing through Lark's public interface -----------------------------------------------------------------------


class LarkParser:
    """A parser of tokens that uses `Lark.parse_interactive`, with the builder as Lark's transformer."""

    def __init__(self, grammar: str, starts: tuple[str, ...], builder: object) -> None:
        self._lark = _lark(grammar, starts, builder)
        self.terminals = _terminals(self._lark)

    def parse(self, tokens: Sequence[Token], start: str) -> Any:
        from lark import UnexpectedToken

        fed, parser = 0, self._lark.parse_interactive(start=start)
        try:
            for token in tokens:
                parser.feed_token(token)
                fed += 1
            return parser.feed_eof()
        except UnexpectedToken:
            refused = tokens[fed] if fed < len(tokens) else None
            raise DoesNotFit(refused, self._accepted_terminals(tokens[:fed], start)) from None

    def _accepted_terminals(self, tokens: Sequence[Token], start: str) -> frozenset[str]:
        """Return the terminals that may follow these tokens. A new parser reads the tokens again, because the first one
        has already reduced rules before it refused the next token."""
        parser = self._lark.parse_interactive(start=start)
        for token in tokens:
            parser.feed_token(token)
        return frozenset(parser.accepts())


GRAMMAR = "val2.lark"
# keep at most this many parsed steps (about 3 kB each) for reuse, because an editor parses the same lines repeatedly
REMEMBERED = 20_000
STARTS = ("step", "prompt", "header", "entry")


def grammar_text() -> str:
    """Return the grammar of VAL-II."""
    with open(os.path.join(shipped_folder("grammar"), GRAMMAR), encoding="utf-8") as stream:
        return stream.read()


class LineParser:
    """A parser of lines. `builder`: makes the trees of lines, by default with the operator precedence of V+."""

    def __init__(self, builder: Builder | None = None) -> None:
        self._parser = token_parser(grammar_text(), STARTS, builder or Builder())
        self._patterns = patterns_of(self._parser.terminals)
        self.step: Callable[[str, int], Step] = lru_cache(maxsize=REMEMBERED)(self.new_step)

    def new_step(self, text: str, line: int) -> Step:
        """Parse a step, without keeping the result for reuse as `step` does. Raises LineRefused."""
        tokens = Lexer(self._patterns, text, line).step()
        label = tokens.pop(0) if tokens and tokens[0].type == "LABEL" else None
        comment = _pop_comment(tokens)
        statement: Statement | None = self._parse(tokens, "step") if tokens else None
        spans = [part.span for part in (label, statement, comment) if part is not None]
        span = Span(line, spans[0].column, spans[-1].end) if spans else Span(line, 1, 1)
        return Step(label_value(label.text, label.span) if label else None, statement, _text(comment), span=span)

    def prompt(self, text: str, names: Container[str]) -> Statement | None:
        """Parse a line typed at the prompt; return None for a blank line. `names`: the keys of variables that have a
        value. Raises LineRefused."""
        tokens = Lexer(self._patterns, text, 1).prompt(names)
        _pop_comment(tokens)
        if not tokens:
            return None
        row = tokens[0].row
        statement: Statement = resolve_line(self._parse(tokens, "prompt"), names)
        if (row is not None and COMMANDS.get(row.name) is row) or isinstance(statement, ast.DoInstruction | ast.Show):
            return statement
        return ast.DoInstruction(statement, span=statement.span)

    def header(self, text: str, line: int, at: int) -> ProgramHeader:
        """Parse the heading of a program. `at`: the index after `.PROGRAM`. Raises LineRefused."""
        tokens = Lexer(self._patterns, text, line, at).header()
        comment = _pop_comment(tokens)
        header: ProgramHeader = self._parse(tokens, "header")
        if comment is None:
            return header
        return replace(header, comment=_text(comment), span=Span(line, header.span.column, comment.span.end))

    def entry(self, text: str, line: int) -> ast.Entry | str | None:
        """Parse a line of a section. Return the variable with its value, the text of a comment line, or None for a
        blank line. Raises LineRefused."""
        if (usual := usual_entry(text, line)) is not None:
            return usual
        tokens = Lexer(self._patterns, text, line).entry()
        comment = _text(_pop_comment(tokens))
        if not tokens:
            return comment
        return replace(cast(ast.Entry, self._parse(tokens, "entry")), comment=comment)

    def numbers(self, text: str) -> tuple[tuple[float, ...], str | None] | None:
        """Return the numbers and the comment of a line that contains only numbers; None for any other line."""
        line, semicolon, comment = text.partition(";")
        if re.fullmatch(_NUMBERS, line) is None:
            return None
        found = [signed_number(number) for number in line.replace(",", " ").split()]
        numbers = tuple(number for number in found if number is not None)
        return (numbers, comment if semicolon else None) if len(numbers) == len(found) else None

    def _parse(self, tokens: list[Token], start: str) -> Any:
        """Return the tree of a line. Raises LineRefused."""
        try:
            return self._parser.parse(tokens, start)
        except DoesNotFit as error:
            raise LineRefused(Complaint(tokens, error.token, error.accepted, start).diagnostic()) from None


def _pop_comment(tokens: list[Token]) -> Token | None:
    return tokens.pop() if tokens and tokens[-1].type == "COMMENT" else None


def _text(comment: Token | None) -> str | None:
    return None if comment is None else comment.value[1:]


# --- fast reading of the usual lines in a section of variables ------------------------------------------------


_NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[Ee][-+]?[0-9]+)?(?![^ \t,])"
_NUMBERS = rf"[ \t]*{_NUMBER}(?:(?:[ \t]+|[ \t]*,[ \t]*){_NUMBER})*[ \t]*"
_USUAL = (
    rf"[ \t]*(?P<sigil>#?)(?P<name>[A-Za-z][A-Za-z0-9._]*)(?:\[(?P<index>[0-9]{{1,9}})\])?"
    rf"[ \t]+(?P<numbers>{_NUMBER}(?:[ \t]+{_NUMBER})*)[ \t]*"
)


def usual_entry(text: str, line: int) -> Entry | None:
    """Read a line of a section with a regular expression, which is faster than the grammar. Return None if the line is
    not a name and plain numbers."""
    match = re.fullmatch(_USUAL, text)
    if match is None or match["name"].upper() in OPERATOR_WORDS:
        return None
    numbers = [signed_number(number) for number in match["numbers"].split()]
    if None in numbers:
        return None
    first, last = match.start("sigil") + 1, match.end("numbers") + 1
    named = match.end("name") + 1 if match["index"] is None else match.end("index") + 2
    index: tuple[Expression, ...] | None = None
    if (digits := match["index"]) is not None:
        place = Span(line, match.start("index") + 1, match.end("index") + 1)
        index = (Number(float(digits), digits, span=place),)
    variable = Variable(match["name"], match["sigil"], index, span=Span(line, first, named))
    return Entry(
        variable, tuple(number for number in numbers if number is not None), None, span=Span(line, first, last)
    )


# --- why a line does not fit ------------------------------------------------------------------------------------------


_PAIRS = {"RPAR": "LPAR", "RGROUP": "LGROUP", "RSQB": "LSQB"}
_OPENING = {"LPAR": ")", "LGROUP": ")", "LSQB": "]"}
_VALUES = frozenset({"NAME", "PROGRAM", "NUMBER", "STRING", "FORMAT", "RAW"})
_BEGINS_VALUE = _VALUES | {"PREFIX", "LPAR", "LGROUP", "LSQB"}
_ENDS_VALUE = _VALUES | {"RPAR", "RGROUP", "RSQB"}
_PARAMETERS = "a parameter is a name alone: .PROGRAM name(a, $text, #joints)"
_SECONDS = "a time is in seconds: AT 2 is a time of the clock, IN 2 is two seconds from now"


class Complaint:
    """A search for the reason why a line does not fit the grammar. `token`: the first token that does not fit (None for
    the end of the line); `accepted`: the terminals that would fit in its place; `start`: the start symbol."""

    def __init__(self, tokens: Sequence[Token], token: Token | None, accepted: frozenset[str], start: str) -> None:
        self._before = before = tokens if token is None else tokens[: tokens.index(token)]
        self._after = tokens[len(before) :]
        self._accepted = accepted
        self._start = start
        self._last = before[-1] if before else None
        self._type, self._text = (token.type, token.text) if token is not None else ("", "")
        end = before[-1].span.end if before else 0
        self._place = Span(tokens[0].span.line, end, end + 1) if token is None else token.span
        self._said = self._text or "the end of the line"
        self._head = next((one for one in before if one.type != "DO_COMMAND"), None)

    def diagnostic(self) -> Diagnostic:
        """Return the diagnostic of the first explanation that applies."""
        if self._last is not None and self._last.type == "GOTO":
            return self._say(CannotInterpret, "GOTO wants a label", "a label is a number before a statement: GOTO 10")
        found = self._no_operand() or self._parenthesis()
        if found is None and self._start == "entry":
            return self._say(
                CannotInterpret,
                f"{self._said} in a section of variables",
                "write a name, a blank and the value: count 12",
            )
        found = found or self._equals() or self._missing_link() or self._instruction_in_place_of_value()
        return found or self._neighbours() or self._other()

    def _say(
        self, kind: type[ProgramError], detail: str, hint: str = "", at: Token | None = None, mend: str = ""
    ) -> Diagnostic:
        return error(kind, self._place if at is None else at.span, detail, hint, mend)

    # --- possible explanations: each method returns a diagnostic, or None if it does not apply ---

    def _no_operand(self) -> Diagnostic | None:
        """Explain that nothing follows an operator, a comma or a linking word."""
        last = self._last
        behind_value = last is not None and last.type in _ENDS_VALUE
        if last is None or behind_value or self._type in _BEGINS_VALUE or self._accepted.isdisjoint(("NAME", "NUMBER")):
            return None
        word = last.text.upper()
        if last.type in CONTROL:
            return self._say(CannotInterpret, f"a value is missing after {word}", CONTROL[last.type].form)
        if last.text == ":" and not self._type and self._head is not None and self._head.type in CONTROL:
            cases = self._head.type == "CASE"
            hint = "VALUE 1: begins a case" if cases else f"the form is {CONTROL[self._head.type].form}"
            return self._say(CannotInterpret, "a : ends no line", hint, last)
        optional = not self._type if last.type == "COMMA" else END in self._accepted
        if optional or last.type == "LGROUP":
            return None
        if self._type == "EQUAL" and last.text == ":":
            return self._equals()
        if self._type == "EQUAL" and last.text in "<>=":
            return self._say(IllegalExpression, f"{last.text}=", "the relations are == <> < > <= >=", last)
        if word in ("AT", "IN") and not self._type:
            return self._say(IllegalExpression, f"a value is missing after {word}", _SECONDS)
        closed = self._type == "RPAR" and last.type == "LPAR"
        if closed and len(self._before) == 2 and self._before[0].text.upper() in ("EXIT", "QUIT", "BYE"):
            return self._say(CannotInterpret, f"{self._before[0].text}()", "EXIT or Ctrl-D leaves", self._before[0])
        detail = "nothing stands in the parentheses" if closed else f"a value is missing after {word}"
        return self._say(IllegalExpression, detail, _PARAMETERS if self._start == "header" else "")

    def _parenthesis(self) -> Diagnostic | None:
        opened: list[Token] = []
        for one in self._before:
            if one.type in _OPENING:
                opened.append(one)
            elif one.type in _PAIRS and opened:
                opened.pop()
        if self._type in _PAIRS and (not opened or _OPENING[opened[-1].type] != self._text):
            return self._say(MissingParenthesis, f"{self._text} closes nothing")
        in_index = bool(opened) and opened[-1].type == "LSQB"
        if opened and self._type not in _VALUES and (self._type != "EQUAL" or in_index):
            row = self._head.row if self._head is not None else None
            operand = None if row is None else row.value or next(iter(row.arguments), None)
            # true for MOVE p and for SET p = ...: the operand is a location
            moves = operand is not None and operand.shape is Shape.PLACE
            hint = "a place is TRANS(x, y, z) or a name" if moves and self._type == "COMMA" else ""
            closing = _OPENING[opened[-1].type]
            if self._type == "COMMA" and any(one.text == closing for one in self._after):
                if row is not None and self._before[1] is opened[-1]:
                    hint = hint or form_of(row)
                    return self._say(CannotInterpret, f"{row.name} takes no parentheses", hint, opened[-1])
                return self._say(IllegalExpression, "a comma has no place in these parentheses", hint)
            hint = hint or f"every {opened[-1].text} needs its {closing}"
            return self._say(MissingParenthesis, f"{opened[-1].text} is not closed", hint, opened[-1])
        return None

    def _equals(self) -> Diagnostic | None:
        if self._type != "EQUAL" or self._head is None:
            return None
        if self._start == "header":
            return self._say(IllegalExpression, "= has no place here", _PARAMETERS)
        if self._last is not None and self._last.text == ":":
            return self._say(IllegalExpression, ":= is no sign of VAL-II", "= assigns, == compares", self._last)
        if any(one.text == ":" for one in self._before):
            return self._say(IllegalExpression, "= has no place here", "a line holds one statement, : joins places")
        function = FUNCTIONS.get(self._head.text.upper()) if self._start == "prompt" else None
        if function is not None and function.arguments and self._last is not None and self._last.type == "RPAR":
            return self._say(CannotInterpret, *only_reads(function), self._head)
        condition = self._head.type in ("IF", "WHILE", "UNTIL", "CASE") or self._head.value == "WAIT"
        hint = "= assigns, == compares" if condition or self._head.type == "NAME" else ""
        return self._say(IllegalExpression, "= has no place here", hint)

    def _missing_link(self) -> Diagnostic | None:
        """Explain that a linking word is missing, such as THEN after IF."""
        head, last = self._head, self._last
        if head is None or last is None or head is last or head.type not in CONTROL:
            return None
        row = CONTROL[head.type]
        # leave out an optional linking word, such as STEP of FOR
        links = [word for word in row.links if f"[{word}" not in row.form]
        relation = RELATIONS_OF_VAL.get(self._text.upper())
        if relation is not None:
            return self._say(IllegalExpression, self._said, f"write {relation}", mend=relation)
        if "EQUAL" in self._accepted and head.type == "FOR":
            return self._say(CannotInterpret, "= is missing", f"the form is {CONTROL['FOR'].form}")
        if self._type in _VALUES or self._accepted.isdisjoint(links):
            return None
        detail = f"{' or '.join(links)} is missing"
        if len(self._before) > 1 and self._before[-2] is head and last.text.upper() in links:
            detail = f"a value is missing between {head.type} and {last.text.upper()}"
        return self._say(CannotInterpret, detail, f"the form is {CONTROL[head.type].form}")

    def _instruction_in_place_of_value(self) -> Diagnostic | None:
        """Explain that an instruction follows a command that takes no instruction: WHY DRIVE 1, 500."""
        head, last = self._head, self._last
        beside = last is not None and self._before[-2:-1] == [head] and self._type in _BEGINS_VALUE
        if not beside or head is None or head.row is None or last is None or last.text.upper() not in INSTRUCTIONS:
            return None
        detail = f"{head.value}: {last.text.upper()} is an instruction"
        return self._say(CannotInterpret, detail, f"the form is {head.row.form}", last)

    def _neighbours(self) -> Diagnostic | None:
        """Explain that an operator or a comma is missing between two values."""
        last = self._last
        if last is None or last.type not in _ENDS_VALUE or self._type not in _VALUES | set(_OPENING):
            return None
        hint, row = "", self._head.row if self._head is not None else None
        if last.type == "RAW":
            quoted = 'a name with blanks stands in quotes: "my file.v2"'
            hint = f"a comma is missing before {self._text}" if row is not None and row.repeats else quoted
            return self._say(CannotInterpret, self._said, hint)
        if last.type == "NAME" and last.text.upper() in RESERVED and row is not None:  # for example MOVE TO part
            return self._say(CannotInterpret, f"{last.text} has no place here", f"the form is {row.form}", last)
        if last.text.upper() in ("AT", "IN") and self._before[-2:-1] and self._before[-2].type == "WORD":
            return self._say(CannotInterpret, f"{self._before[-2].value} takes no {last.text.upper()}", "", last)
        if relation := RELATIONS_OF_VAL.get(self._text.upper()):
            return self._say(IllegalExpression, self._said, f"write {relation}", mend=relation)
        if meant := self._meant_beside(last, row):
            return self._say(IllegalExpression, self._said, meant)
        if row is not None and self._type == "NAME":  # the name may be a mistyped modifier: SPEED 30 ALWYS
            modifiers = row.modifiers | INSTRUCTIONS.get(row.name, row).modifiers
            words = [*row.leads, *(word for name in sorted(modifiers) for word in MODIFIERS.get(name, ()))]
            hint = did_you_mean(self._text, words)
        assigns = row is not None and row.value is not None and not any(one.type == "EQUAL" for one in self._before)
        missing = f"{'=' if assigns else 'an operator or a comma'} is missing before {self._text}"
        form = f"; {form_of(row)}" if row is not None and row.arguments else ""
        return self._say(IllegalExpression, self._said, hint or missing + form)

    def _meant_beside(self, last: Token, row: Word | None) -> str:
        """Return a hint at what the user probably meant by two values with nothing between them, as in MOVE Z 100,
        30 DEG and f"x={x}"."""
        text, kind, word, name = self._text, self._type, self._text.upper(), last.text.upper()
        header, named = self._start == "header", last.type == "NAME"
        instruction = None if row is None else INSTRUCTIONS.get(row.name, row)
        places = row.arguments[:1] if row is not None and INSTRUCTIONS.get(row.name) is row else ()
        moves = any(argument.shape is Shape.PLACE for argument in places)
        function = FUNCTIONS.get(name)
        form = function.form if function is not None and function.arguments else ""
        shows = row is not None and Shape.ITEM in row.operand_shapes
        timed = instruction is not None and "AT" in instruction.modifiers and word in TIMED
        counts = self._head is not None and self._head.type == "FOR" and word == "DOWNTO"
        measured = last.type == "NUMBER" and word in UNITS
        return first_hint(
            (
                moves and named and kind == "NUMBER" and name in SIDES,
                "DRAW dx, dy, dz moves by millimetres: DRAW 0, 0, 100",
            ),
            (header and len(self._before) == 1, f"a name has letters, digits, . and _: {last.text}_{text}"),
            (header, _PARAMETERS),
            (
                name == "CALL" and kind == "NAME",
                f"CALL {text}(...) stands alone, and gives values back by its parameters",
            ),
            (last.type == "RSQB" and kind == "LSQB", "the indexes stand in one pair: a[1, 2]"),
            (form and kind == "NUMBER", f"the form is {form}"),  # for SIG 1001, which needs parentheses
            (named and kind == "NAME" and shows, f'a text stands in double quotes: "{last.text} {text}"'),
            (last.type == "PROGRAM", f"arguments stand in parentheses: {last.text}({text})"),
            (counts, "a negative STEP counts down: FOR i = 3 TO 1 STEP -1"),
            (timed, _SECONDS),
            (self._before[0].text.upper() in ("AT", "IN") and word in INSTRUCTIONS, way("AT", at_prompt=True)),
            (measured and row is not None and row.name == "SPEED", PERCENT),
            (measured, NO_UNIT),
            (named and kind == "STRING" and len(last.text) == 1, 'commas separate texts and values: TYPE "x =", x'),
        )

    def _other(self) -> Diagnostic:
        head, last = self._head, self._last
        if head is None or last is None:
            return self._say(CannotInterpret, self._said)
        if self._type == "LSQB" and last.type == "EQUAL":
            hint = f"each element is assigned by itself: {head.text}[1] = ..."
            if head.row is not None and head.row.value is not None:
                place = head.row.value.shape is Shape.PLACE  # true for SET p = [100, 200, 300]
                hint = "a place is TRANS(x, y, z) in mm" if place else f"the form is {head.row.form}"
            return self._say(CannotInterpret, "[...] is no value", hint)
        if last.type == "THEN":
            return self._say(
                CannotInterpret, f"{self._said} after THEN", "THEN ends the line; what is done stands on the next ones"
            )
        row = CONTROL.get(head.type, head.row)
        form = f"the form is {row.form}" if row is not None else ""
        if head.type in CONTROL and (head is last or last.type in ("DO", "OF", "COLON")):
            hint = form if CONTROL[head.type].arguments else f"{head.type} stands alone"
            if head.type == "DO" and self._text.upper() == "WHILE":
                hint = f"the form is {CONTROL['WHILE'].form}"
            if head.type == "ELSE" and self._text.upper() == "IF":
                hint = "IF ... THEN stands on the next line and has an END of its own"
            return self._say(CannotInterpret, f"{self._said} after {last.text.upper()}", hint)
        if head.type == "NAME" and self._start in ("step", "prompt"):
            form = "a variable is followed by = and its value"
            if last.type == "NUMBER" and re.fullmatch(r",\d+", "".join(one.text for one in self._after[:2])):
                form = f"a decimal number has a point: {last.text}.{self._after[1].text}"
        return self._say(CannotInterpret, self._said, form)
