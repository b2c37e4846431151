"""Why a line does not fit the grammar: which of VAL-II's texts it deserves, and what would be right."""

from __future__ import annotations

from collections.abc import Sequence

from vrs_cli.errors import (
    CannotInterpret,
    IllegalExpression,
    MissingParenthesis,
    ProgramError,
)
from vrs_cli.language.text.lalr import END
from vrs_cli.language.text.lexer import Token
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS, RELATIONS_OF_VAL
from vrs_cli.language.words.word import MODIFIERS
from vrs_cli.values.diagnostics import Diagnostic, Span, did_you_mean, error

_PAIRS = {"RPAR": "LPAR", "RGROUP": "LGROUP", "RSQB": "LSQB"}
_OPENING = {"LPAR": ")", "LGROUP": ")", "LSQB": "]"}
_VALUES = frozenset({"NAME", "PROGRAM", "NUMBER", "STRING", "FORMAT", "RAW"})
_BEGINS_VALUE = _VALUES | {"PREFIX", "LPAR", "LGROUP", "LSQB"}
_ENDS_VALUE = _VALUES | {"RPAR", "RGROUP", "RSQB"}
_CONDITIONS = frozenset({"IF", "WHILE", "UNTIL", "CASE"})


def complaint(tokens: Sequence[Token], token: Token | None, accepted: frozenset[str], start: str) -> Diagnostic:
    """The diagnostic for the token that does not fit; None is the end of the line. `accepted`: the terminals that would
    fit in its place.
    """
    before = tokens[: tokens.index(token)] if token is not None else list(tokens)
    return _Complaint(before, token, accepted, start).diagnostic()


class _Complaint:
    """`before`: the tokens that did fit, `token`: the first that did not."""

    def __init__(self, before: Sequence[Token], token: Token | None, accepted: frozenset[str], start: str) -> None:
        self._before = before
        self._token = token
        self._accepted = accepted
        self._start = start
        self._last = before[-1] if before else None
        self._type, self._text = (token.type, token.text) if token is not None else ("", "")
        self._head = next((one for one in before if one.type != "DO_COMMAND"), None)

    def diagnostic(self) -> Diagnostic:
        """The first explanation that applies."""
        found = (
            self._label()
            or self._no_operand()
            or self._parenthesis()
            or self._section_value()
            or self._equals()
            or self._missing_link()
            or self._instruction_in_place_of_value()
            or self._neighbours()
        )
        return found or self._say(CannotInterpret, *self._other())

    def _say(
        self, kind: type[ProgramError], detail: str, hint: str = "", at: Token | None = None, mend: str = ""
    ) -> Diagnostic:
        return error(kind, at.span if at is not None else self._place(), detail, hint, mend)

    def _place(self) -> Span:
        """The token, or the end of the line."""
        if self._token is not None:
            return self._token.span
        last = self._before[-1].span
        return Span(last.line, last.end, last.end + 1)

    # --- explanations, each a diagnostic or None ---

    def _no_operand(self) -> Diagnostic | None:
        """An operator, a comma or a linking word with nothing after it."""
        last = self._last
        if last is None or self._type in _BEGINS_VALUE or last.type in _ENDS_VALUE:
            return None
        if self._accepted.isdisjoint({"NAME", "NUMBER"}):
            return None
        if last.type in CONTROL:
            return self._say(CannotInterpret, f"a value is missing after {last.text.upper()}", CONTROL[last.type].form)
        if last.type != "COMMA" and END in self._accepted:
            return None  # nothing need follow
        if last.type == "LGROUP" or (last.type == "COMMA" and self._token is None):
            return None
        if self._type == "EQUAL" and last.text in "<>=":
            return self._say(IllegalExpression, f"{last.text}=", "the relations are == <> < > <= >=", last)
        closed = self._type == "RPAR" and last.type == "LPAR"
        detail = "nothing stands in the parentheses" if closed else f"a value is missing after {last.text.upper()}"
        return self._say(IllegalExpression, detail)

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
            return self._say(MissingParenthesis, f"{opened[-1].text} is not closed", "", opened[-1])
        return None

    def _section_value(self) -> Diagnostic | None:
        if self._start != "entry":
            return None
        hint = "write a name, a blank and the value: count 12"
        return self._say(CannotInterpret, f"{self._token_or_end()} in a section of variables", hint)

    def _equals(self) -> Diagnostic | None:
        if self._type != "EQUAL" or self._head is None:
            return None
        condition = self._head.type in _CONDITIONS or self._head.value == "WAIT"
        hint = "= assigns, == compares" if condition or self._head.type == "NAME" else ""
        return self._say(IllegalExpression, "= has no place here", hint)

    def _label(self) -> Diagnostic | None:
        if self._last is None or self._last.type != "GOTO":
            return None
        return self._say(CannotInterpret, "GOTO wants a label", "a label is a number before a statement: GOTO 10")

    def _missing_link(self) -> Diagnostic | None:
        """IF without THEN, and its like."""
        head, last = self._head, self._last
        if head is None or last is None or head is last or head.type not in CONTROL:
            return None
        row = CONTROL[head.type]
        links = [word for word in row.links if f"[{word}" not in row.form]  # without STEP of FOR, which is optional
        relation = RELATIONS_OF_VAL.get(self._text.upper())
        if relation is not None:
            return self._say(IllegalExpression, self._token_or_end(), f"write {relation}", mend=relation)
        if "EQUAL" in self._accepted and head.type == "FOR":
            return self._say(CannotInterpret, "= is missing", f"the form is {CONTROL['FOR'].form}")
        if self._type in _VALUES or self._accepted.isdisjoint(links):
            return None
        detail = f"{' or '.join(links)} is missing"
        if len(self._before) > 1 and self._before[-2] is head and last.text.upper() in links:
            detail = f"a value is missing between {head.type} and {last.text.upper()}"
        return self._say(CannotInterpret, detail, f"the form is {CONTROL[head.type].form}")

    def _instruction_in_place_of_value(self) -> Diagnostic | None:
        """WHY DRIVE 1, 500."""
        head, last = self._head, self._last
        if head is None or head.row is None or last is None or self._before[-2:-1] != [head]:
            return None
        word = last.text.upper()
        if word not in INSTRUCTIONS or self._type not in _BEGINS_VALUE:
            return None
        return self._say(
            CannotInterpret, f"{head.value}: {word} is an instruction", f"the form is {head.row.form}", last
        )

    def _neighbours(self) -> Diagnostic | None:
        """Two values with nothing between them."""
        last = self._last
        if last is None or last.type not in _ENDS_VALUE or self._type not in _VALUES | set(_OPENING):
            return None
        if last.type == "RAW" and self._head is not None and self._head.row is not None and self._head.row.repeats:
            return self._say(CannotInterpret, self._token_or_end(), f"a comma is missing before {self._text}")
        if last.type == "RAW":
            return self._say(CannotInterpret, self._token_or_end(), 'a name with blanks stands in quotes: "my file.v2"')
        if last.text.upper() in ("AT", "IN") and self._before[-2:-1] and self._before[-2].type == "WORD":
            return self._say(CannotInterpret, f"{self._before[-2].value} takes no {last.text.upper()}", "", last)
        if relation := RELATIONS_OF_VAL.get(self._text.upper()):
            return self._say(IllegalExpression, self._token_or_end(), f"write {relation}", mend=relation)
        hint = self._nearest_modifier() or f"an operator or a comma is missing before {self._text}"
        return self._say(IllegalExpression, self._token_or_end(), hint)

    def _nearest_modifier(self) -> str:
        """Whether a word after the arguments is nearly one that may follow them: SPEED 30 ALWYS."""
        row = self._head.row if self._head is not None else None
        if row is None or self._type != "NAME":
            return ""
        modifiers = row.modifiers | INSTRUCTIONS.get(row.name, row).modifiers
        words = [*row.leads, *(word for name in sorted(modifiers) for word in MODIFIERS.get(name, ()))]
        return did_you_mean(self._text, words)

    def _other(self) -> tuple[str, str]:
        head, last = self._head, self._last
        if head is None or last is None:
            return self._token_or_end(), ""
        if last.type == "THEN":
            return f"{self._token_or_end()} after THEN", "THEN ends the line; what is done stands on the next ones"
        if head.type in CONTROL and (head is last or last.type in ("DO", "OF", "COLON")):
            hint = (
                f"the form is {CONTROL[head.type].form}"
                if CONTROL[head.type].arguments
                else f"{head.type} stands alone"
            )
            return f"{self._token_or_end()} after {last.text.upper()}", hint
        if head.type == "NAME" and self._start in ("step", "prompt"):
            return self._token_or_end(), "a variable is followed by = and its value"
        row = CONTROL.get(head.type, head.row)
        return self._token_or_end(), f"the form is {row.form}" if row is not None else ""

    def _token_or_end(self) -> str:
        return self._text or "the end of the line"
