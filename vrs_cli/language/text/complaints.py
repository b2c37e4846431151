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


class Complaint:
    """Explains why a line does not fit the grammar. `token`: the first that does not fit (None: the end of the line);
    `accepted`: the terminals that would fit in its place.
    """

    def __init__(self, tokens: Sequence[Token], token: Token | None, accepted: frozenset[str], start: str) -> None:
        self._before = before = tokens if token is None else tokens[: tokens.index(token)]
        self._accepted = accepted
        self._start = start
        self._last = before[-1] if before else None
        self._type, self._text = (token.type, token.text) if token is not None else ("", "")
        end = before[-1].span.end if before else 0
        self._place = Span(tokens[0].span.line, end, end + 1) if token is None else token.span
        self._said = self._text or "the end of the line"
        self._head = next((one for one in before if one.type != "DO_COMMAND"), None)

    def diagnostic(self) -> Diagnostic:
        """Return the first explanation that applies."""
        if self._last is not None and self._last.type == "GOTO":
            return self._say(CannotInterpret, "GOTO wants a label", "a label is a number before a statement: GOTO 10")
        found = self._no_operand() or self._parenthesis()
        if found is None and self._start == "entry":
            hint = "write a name, a blank and the value: count 12"
            return self._say(CannotInterpret, f"{self._said} in a section of variables", hint)
        found = found or self._equals() or self._missing_link() or self._instruction_in_place_of_value()
        return found or self._neighbours() or self._other()

    def _say(
        self, kind: type[ProgramError], detail: str, hint: str = "", at: Token | None = None, mend: str = ""
    ) -> Diagnostic:
        return error(kind, self._place if at is None else at.span, detail, hint, mend)

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
        if last.type == "LGROUP" or (last.type == "COMMA" and not self._type):
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

    def _equals(self) -> Diagnostic | None:
        if self._type != "EQUAL" or self._head is None:
            return None
        condition = self._head.type in _CONDITIONS or self._head.value == "WAIT"
        hint = "= assigns, == compares" if condition or self._head.type == "NAME" else ""
        return self._say(IllegalExpression, "= has no place here", hint)

    def _missing_link(self) -> Diagnostic | None:
        """IF without THEN, and its like."""
        head, last = self._head, self._last
        if head is None or last is None or head is last or head.type not in CONTROL:
            return None
        row = CONTROL[head.type]
        links = [word for word in row.links if f"[{word}" not in row.form]  # without STEP of FOR, which is optional
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
        hint, row = "", self._head.row if self._head is not None else None
        if last.type == "RAW":
            quoted = 'a name with blanks stands in quotes: "my file.v2"'
            hint = f"a comma is missing before {self._text}" if row is not None and row.repeats else quoted
            return self._say(CannotInterpret, self._said, hint)
        if last.text.upper() in ("AT", "IN") and self._before[-2:-1] and self._before[-2].type == "WORD":
            return self._say(CannotInterpret, f"{self._before[-2].value} takes no {last.text.upper()}", "", last)
        if relation := RELATIONS_OF_VAL.get(self._text.upper()):
            return self._say(IllegalExpression, self._said, f"write {relation}", mend=relation)
        if row is not None and self._type == "NAME":  # nearly a word that may follow: SPEED 30 ALWYS
            modifiers = row.modifiers | INSTRUCTIONS.get(row.name, row).modifiers
            words = [*row.leads, *(word for name in sorted(modifiers) for word in MODIFIERS.get(name, ()))]
            hint = did_you_mean(self._text, words)
        return self._say(
            IllegalExpression, self._said, hint or f"an operator or a comma is missing before {self._text}"
        )

    def _other(self) -> Diagnostic:
        head, last = self._head, self._last
        if head is None or last is None:
            return self._say(CannotInterpret, self._said)
        if last.type == "THEN":
            hint = "THEN ends the line; what is done stands on the next ones"
            return self._say(CannotInterpret, f"{self._said} after THEN", hint)
        row = CONTROL.get(head.type, head.row)
        form = f"the form is {row.form}" if row is not None else ""
        if head.type in CONTROL and (head is last or last.type in ("DO", "OF", "COLON")):
            hint = form if CONTROL[head.type].arguments else f"{head.type} stands alone"
            return self._say(CannotInterpret, f"{self._said} after {last.text.upper()}", hint)
        if head.type == "NAME" and self._start in ("step", "prompt"):
            form = "a variable is followed by = and its value"
        return self._say(CannotInterpret, self._said, form)
