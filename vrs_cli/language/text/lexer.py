"""Split a line of VAL-II into tokens.

The type of a token depends on the first word of the statement and on the word tables. The patterns of the terminals are
read from grammar/val2.lark; the comment at the top of the grammar explains the token types.
"""

from __future__ import annotations

import re
from collections.abc import Container, Mapping
from math import inf

from msgspec import Struct

from vrs_cli.errors import (
    CannotInterpret,
    InvalidName,
    InvalidNumber,
    MissingQuote,
    NotAvailable,
    UnknownInstruction,
    UsageError,
    VrsError,
    did_you_mean,
)
from vrs_cli.language.words.foreign import (
    FOREIGN_COMMENT,
    FOREIGN_FUNCTIONS,
    FOREIGN_SIGNS,
    LABELS,
    LINE_COMMENT,
    NO_UNIT,
    OWN_COMMENT,
    PERCENT,
    POWER,
    QUOTES,
    QUOTIENT,
    UNITS,
    WHOLE,
    first_hint,
    only_reads,
    own_word,
    way,
)
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import (
    INSTRUCTIONS,
    OPERATOR_WORDS,
    PROGRAM_WORDS,
    RELATIONS_OF_VAL,
    why_reserved,
)
from vrs_cli.language.words.monitor import COMMANDS, EXPLAINED
from vrs_cli.language.words.values import NAME_LENGTH
from vrs_cli.language.words.word import SORT_WORDS, Control, Shape, State, Word, argument_at, rows_for, usable_names
from vrs_cli.values.diagnostics import LineRefused, Span, refusal

LABEL_HIGH = 65535
MAX_TOKENS = 400  # lines with more tokens are refused; useful VAL-II lines have far fewer


class Token(Struct, eq=False):
    """A token of a line. `type`: the terminal of the grammar; `value`: the unabbreviated word, or the standard spelling
    of an operator; `text`: the token as typed; `row`: for a WORD, its row in the word tables."""

    type: str
    value: str
    text: str
    span: Span
    row: Word | None = None


def label_value(text: str, span: Span) -> int:
    """Return the number of a label. Raises LineRefused."""
    value = float(text) if text.isdigit() else inf  # float() has no limit on the number of digits, as int() has
    if value > LABEL_HIGH:
        raise refusal(InvalidNumber, span, text, f"labels are 0 to {LABEL_HIGH}")
    return int(value)


# Words that may follow an expression (THEN, TO, AT), with their token types.
_LINKS = {
    **{word: word for word in ("THEN", "GOTO", "TO", "STEP", "DO", "OF", "BY", "AT", "IN", "ALWAYS")},
    **dict.fromkeys(("MMPS", "IPS", "MONITOR"), "UNIT"),
}
# the name of the modifier in the word tables, by token type
_MODIFIERS = {"AT": "AT", "IN": "AT", "ALWAYS": "ALWAYS", "UNIT": "UNIT"}
_SPELLINGS = {"=<": "<=", "=>": ">="}
_PREFIXES = frozenset({"NOT", "COM"})
# types of tokens that can end an expression
_ENDS = frozenset({"NAME", "PROGRAM", "NUMBER", "STRING", "FORMAT", "RPAR", "RSQB", "ALWAYS", "UNIT"})
_DEPTH = {"LPAR": 1, "LGROUP": 1, "LSQB": 1, "RPAR": -1, "RGROUP": -1, "RSQB": -1}
_BEFORE_ARGUMENT = frozenset({"WORD", "COMMA", "RGROUP"})  # RGROUP follows the task number in EXECUTE 2 pick

_WORD = re.compile(r"[#$%]?[A-Za-z][A-Za-z0-9._]*")
_GLUED = r"[\w.^']+"
# Patterns that are rarely used are strings, compiled on first use, so that vrs starts faster.
VAL_IF = rf"(?i)\b({'|'.join(RELATIONS_OF_VAL)})\b.*\bTHEN[ \t]+\d+[ \t]*$"
_LABEL = re.compile(r"[ \t]*([0-9]+)(?![\w.])")
SORT = rf"(?i)[ \t]*({'|'.join(SORT_WORDS)})(?=[ \t]+[#$A-Z])"
_ASSIGNS = re.compile(r"[ \t]*(?:=(?![=<>])|\[)")
_FOREIGN_ASSIGNMENT = r"[ \t]*(?:\[.*\][ \t]*)?(:=|[-+*/]=(?!=)|(?:\+\+|--)(?=[ \t]*(?:;|$)))"
_VALUE = r"[-+]?[ \t]*(?:\.?[0-9]|[\"('^#$]|[A-Za-z])"  # matches the start of an expression
# matches an operator after a name that makes the name an operand, because no argument can begin with this operator
_OPERATED = r"[ \t]*(?:\*|:|<|>|==|/(?![A-Za-z]))"
_NO_ARGUMENT = rf"(?i)[ \t]*(?:$|;|[-+*/:<>=)^%]|(?:{'|'.join(sorted(OPERATOR_WORDS))})\b)"
_BEFORE_COMMENT = r'(?:"[^"]*"?|[^";])*'
_ELEMENT = r"\(.*\)[ \t]*=(?!=)"
_ENTRY_NUMBER = r"[ \t]*([-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[Ee][-+]?[0-9]+)?)(?![\w.])"


class Patterns(Struct, frozen=True):
    """The regular expressions of the lexer. `next`: blanks and the next token, by groups named like the token types;
    `format`: a format code such as /F6.2 (compiled on first use, because few programs have one)."""

    next: re.Pattern[str]
    format: str


def patterns_of(terminals: Mapping[str, str]) -> Patterns:
    """Compile the lexer's patterns. `terminals`: the regular expression of each terminal of the grammar, by its
    name."""
    names = ("STRING", "NUMBER", "NAME", "INFIX", "COMMA", "LPAR", "RPAR", "LSQB", "RSQB", "EQUAL")
    choices = "|".join(("(?P<COMMENT>;.*)", *(f"(?P<{name}>{terminals[name]})" for name in names)))
    return Patterns(re.compile(f"[ \t]*(?:{choices})"), terminals["FORMAT"])


class Lexer:
    """A lexer, which finds the tokens of one line from left to right. Its methods raise LineRefused.

    `_at`: the index of the next unread character; `_ends`: the types of tokens that can end an expression; `_row`: the
    table row of the instruction whose arguments are being read, or None.
    """

    def __init__(self, patterns: Patterns, text: str, line: int, at: int = 0) -> None:
        self.tokens: list[Token] = []
        self._patterns = patterns
        self._text = text.rstrip()
        self._line = line
        self._at = at
        self._ends = _ENDS
        self._row: Word | None = None
        self._val_if = False  # whether the line is VAL's IF a EQ b THEN label
        self._has_foreign_sign = "=" in text or "++" in text or "--" in text
        self._defined: Container[str] = ()  # at the prompt: the keys of the variables that have a value

    @property
    def _operand(self) -> bool:
        """Return whether the last token ends an operand, so that an operator must follow rather than a value."""
        return bool(self.tokens) and self.tokens[-1].type in self._ends

    # --- one method for each kind of line ---

    def step(self) -> list[Token]:
        """Return the tokens of a program line: `[label] [statement] [;comment]`."""
        if (match := _LABEL.match(self._text)) is not None:
            self._add("LABEL", match[1], *match.span(1))
            label_value(match[1], self.tokens[0].span)
        if not self._at_end():
            self._statement()
        return self.tokens

    def prompt(self, names: Container[str]) -> list[Token]:
        """Return the tokens of a line typed at the prompt: a monitor command, a statement, or an expression whose value
        is shown. `names`: the keys of variables that have a value."""
        self._defined = names
        if not self._at_end():
            if self._shows(names):
                self._rest()
            else:
                self._statement(at_prompt=True)
        return self.tokens

    def header(self) -> list[Token]:
        """Return the tokens after `.PROGRAM`: the program's name and parameters."""
        at, example = self._at, ".PROGRAM pick.place(part)"
        if self._at_end():
            raise self._refusal(InvalidName, at, at + 1, "a program name is missing", example)
        name = self._first_word(InvalidName, "a program name begins with a letter", example)
        self._add("PROGRAM", name[0], *name.span())
        self._rest()
        return self.tokens

    def entry(self) -> list[Token]:
        """Return the tokens of a line in a section of variables: the variable and its value. A number and its sign are
        one token."""
        self._ends = frozenset()
        while not self._at_end():
            if (number := re.compile(_ENTRY_NUMBER).match(self._text, self._at)) is not None:
                self._add("NUMBER", number[1], *number.span(1))
            else:
                self._token()
        return self.tokens

    # --- the start of a statement ---

    def _shows(self, names: Container[str]) -> bool:
        """Return whether a line typed at the prompt is an expression whose value is shown. The full name of a command
        or instruction has precedence over a variable, and a variable over an abbreviated name."""
        word = _WORD.match(self._text, self._at)
        if word is None:
            label = _LABEL.match(self._text, self._at)
            return self._follows(_NO_ARGUMENT if label else _VALUE, label.end() if label else self._at)
        name, at = word[0].upper(), word.end()
        if self._has_foreign_sign and self._follows(_FOREIGN_ASSIGNMENT, at):
            return False
        if name[0] in "#$" or name in _PREFIXES:
            return True
        defined, function = word[0].lower()[:NAME_LENGTH] in names, FUNCTIONS.get(name)
        operated, constant = self._follows(_OPERATED, at), function is not None and function.constant
        if name in COMMANDS or name in PROGRAM_WORDS:
            return operated and (defined or constant)
        if constant or (function is not None and self._text[at : at + 1] == "("):
            return True
        if defined:
            return self._follows(_NO_ARGUMENT, at)
        return operated and not rows_for(name, COMMANDS, PROGRAM_WORDS)

    def _follows(self, pattern: str, at: int) -> bool:
        return re.compile(pattern).match(self._text, at) is not None

    def _statement(self, *, at_prompt: bool = False) -> None:
        kind: type[VrsError] = UsageError if at_prompt else CannotInterpret
        hint = "LISTR 5+3 shows a value, HELP the commands" if at_prompt else ""
        word = self._first_word(kind, "a line begins with a word or the variable that is assigned", hint)
        foreign = re.compile(_FOREIGN_ASSIGNMENT).match(self._text, word.end()) if self._has_foreign_sign else None
        if foreign is not None:
            sign, target = foreign[1], self._text[word.start() : foreign.start(1)].rstrip()
            hint = f"{target} = 5 assigns, {target} == 5 compares"
            if sign != ":=":
                hint = f"write {target} = {target} {sign[0]} {'1' if sign in ('++', '--') else '...'}"
            raise self._refusal(CannotInterpret, *foreign.span(1), f"{sign} is no sign of VAL-II", hint)
        if _ASSIGNS.match(self._text, word.end()):
            if word[0].upper() in OPERATOR_WORDS:  # AND = 5 would be read as an operator and its operand
                raise self._refusal(InvalidName, *word.span(), *why_reserved(word[0].upper()))
            self._refuse_list(word)
            self._rest()
        elif word[0][0] in "#$%":
            raise self._refusal(CannotInterpret, *word.span(), word[0], "a variable is followed by = and its value")
        else:
            self._operation(self._row_of(word, at_prompt), word, at_prompt)

    def _refuse_list(self, word: re.Match[str]) -> None:
        """Raise LineRefused for MOVE [100, 200, 300], which would be read as an assignment to an element of an array
        named MOVE."""
        row = INSTRUCTIONS.get(word[0].upper())
        given = re.compile(r"[ \t]+(\[[^\]]*\])[ \t]*(?:;|$)").match(self._text, word.end())
        if row is None or given is None or word[0].lower()[:NAME_LENGTH] in self._defined:
            return
        numbers, moves = given[1][1:-1], any(argument.shape is Shape.PLACE for argument in row.arguments)
        both = f"joints in degrees: {row.name} #PPOINT({numbers}); a place in mm: {row.name} TRANS(...)"
        hint = first_hint(
            (moves and numbers.count(",") == 5, both),
            (moves, f"write {row.name} TRANS({numbers})"),
            (True, f"the form is {row.form}"),
        )
        raise self._refusal(CannotInterpret, *given.span(1), f"{given[1]} is no value", hint)

    def _first_word(self, kind: type[VrsError], detail: str, hint: str) -> re.Match[str]:
        self._skip_blanks()
        if (match := _WORD.match(self._text, self._at)) is None:
            self._refuse_foreign_comment(self._at, LINE_COMMENT)
            if kind is not UsageError and self._patterns.next.match(self._text, self._at) is None:
                raise self._unreadable()
            sign = self._text[self._at : self._at + 1]
            hint = first_hint(
                (self.tokens and sign == ":", "a label has no colon: 10 TYPE; VALUE 1: begins what a CASE does for 1"),
                (sign == '"', 'TYPE "hello" types a text, ; begins a comment'),
                (True, hint),
            )
            raise self._refusal(kind, self._at, max(self._end_of_run(self._at), self._at + 1), detail, hint)
        if self._text[match.end() : match.end() + 1].isalnum():
            # report a non-ASCII letter as a mistake in the name, rather than end the name before it
            end = max(self._end_of_run(match.end()), match.end() + 1)
            hint = "letters a to z, digits, . and _"
            raise self._refusal(InvalidName, match.start(), end, self._text[match.start() : end], hint)
        return match

    def _row_of(self, word: re.Match[str], at_prompt: bool) -> Word:
        found = rows_for(word[0], *((COMMANDS, PROGRAM_WORDS) if at_prompt else (PROGRAM_WORDS,)))
        if len(found) == 1 and found[0].name == word[0].upper():
            return found[0]
        function = FUNCTIONS.get(word[0].upper())
        if function is not None and function.arguments and self._follows(rf"[ \t]*{_ELEMENT}", word.end()):
            raise self._refusal(CannotInterpret, *word.span(), *only_reads(function))
        # a word with a hint is refused even if it abbreviates one word: RUN is not RUNSIG, CLEAR is not CLEAR.EVENT
        detail, hint = word[0], way(word[0], at_prompt=at_prompt)
        if self._follows(r"[ \t]*:(?!=)", word.end()) and (own_word(word[0]) or not (found or hint)):
            hint = LABELS  # the user has written a label as in C: `start:`
        if len(found) == 1 and not hint:
            return found[0]
        if len(found) > 1 and not hint:
            detail, hint = f"{word[0]} is short for several words", ", ".join(row.name for row in found[:8])
        unknown = UsageError if at_prompt else UnknownInstruction
        raise self._refusal(unknown, *word.span(), detail, hint or self._other_form(word[0], word.end(), at_prompt))

    def _other_form(self, word: str, end: int, at_prompt: bool) -> str:
        """Return a hint at what the user probably meant by an unknown first word. `end`: the index after the word."""
        rest = self._before_comment(end).strip()
        known = usable_names(COMMANDS, INSTRUCTIONS) if at_prompt else usable_names(PROGRAM_WORDS)
        # parentheses suggest a call of a program, so propose only words that take parentheses, such as READ (lun)
        called = rest.startswith("(")
        near = did_you_mean(
            word, (name for name in known if not called or (name in PROGRAM_WORDS and PROGRAM_WORDS[name].group_size))
        )
        begun = max((name for name in INSTRUCTIONS if word.upper().startswith(name)), key=len, default="")
        glued = re.match(r"[- ]?[ \t]*([A-Za-z0-9_]\w*)[ \t]*=(?!=)", rest)
        return first_hint(
            (word.upper() in COMMANDS, "a monitor command, typed at the prompt"),
            (rest.startswith("=="), "= assigns; == compares, in IF, WHILE and the like"),
            (rest.startswith("^"), POWER),
            (re.match(_ELEMENT, rest), f"an element of an array is {word}[index]"),
            (rest.startswith("$"), f"${word} is a text"),
            (len(begun) > 3 and len(word) > len(begun) + 2, f"a blank is missing: {begun} {word[len(begun) :]}"),
            (near and len(word) > 1, near),
            (re.match(r",[^=]*=(?!=)", rest), f"a line assigns one variable: {word} = ..."),
            (glued, f"a name has letters, digits, . and _: {word}_{glued and glued[1]} = ..."),
            (rest and not called and len(word) == 1, "an abbreviation has two letters at least"),
            (rest and not called, ""),
            (at_prompt, f"EXECUTE {word} runs a program, {word} = 5 makes a variable"),
            (True, f"CALL {word} runs a program"),
        )

    def _operation(self, row: Word, word: re.Match[str], at_prompt: bool) -> None:
        if row.name == "REMARK":
            self._add("COMMENT", f";{self._text[word.end() :]}", word.start(), len(self._text))
        elif at_prompt and row.name == "DO":
            self._add("DO_COMMAND", "DO", *word.span())
            if not self._at_end():
                self._statement()
        elif at_prompt and row.name == "EXPLAIN":
            self._add("EXPLAIN_COMMAND", "EXPLAIN", *word.span(), row)
            if not self._at_end():
                self._read_explain()
        elif type(row) is Control:
            self._add(row.name, row.name, *word.span())
            self._val_if = row.name == "IF" and re.search(VAL_IF, self._before_comment(self._at)) is not None
            self._rest()
            last = self.tokens[-2 if self.tokens[-1].type == "COMMENT" else -1]
            if row.name in ("VALUE", "ANY") and last.text == ":":
                last.type = "COLON"  # in VALUE 1, 2: the colon only ends the line; elsewhere it is an operator
        else:
            self._add("WORD", row.name, *word.span(), row)
            self._arguments(row)

    def _read_explain(self) -> None:
        """Read the argument of EXPLAIN: a topic with its location, an instruction, or an expression."""
        word = _WORD.match(self._text, self._at)
        name, at = ("", self._at) if word is None else (word[0].upper(), word.end())
        rows, function = rows_for(name, PROGRAM_WORDS) if name else (), FUNCTIONS.get(name)
        operated = self._follows(_OPERATED, at) or self._text[at : at + 1] == "["
        defined = name.lower()[:NAME_LENGTH] in self._defined and self._follows(_NO_ARGUMENT, at)
        constant = function is not None and function.constant
        if name in EXPLAINED and not operated and not defined:
            self._add("TOPIC", name, self._at, at)
            if not self._at_end():
                self._rest()
        elif len(rows) == 1 and not (operated or defined or (constant and name == rows[0].name)):
            self._statement()
        else:
            self._rest()

    def _arguments(self, row: Word) -> None:
        if row.state is not State.SUPPORTED:
            self._skip_blanks()
            rest = self._before_comment(self._at).rstrip()
            if rest:
                self._add("REST", rest, self._at, self._at + len(rest))
        elif row.raw:
            # read words as typed; for commands that take no =, also accept a relation as a word (HELP ==)
            while not self._at_end():
                relation = re.compile(r"[=<>]{1,2}").match(self._text, self._at) if row.value is None else None
                raw = relation or re.compile(r'"[^"]*"|[^\s;,="]+').match(self._text, self._at)
                if raw is None:
                    self._token()
                else:
                    self._add("RAW", raw[0].strip('"'), *raw.span())
        else:
            self._row = row
            if row.group_size:
                self._group()
            if row.takes_task:
                self._task()
            sort = re.compile(SORT).match(self._text, self._at) if "SORT" in row.modifiers else None
            if sort is not None:
                self._add("SORT", sort[1].upper(), *sort.span(1))
        self._rest()

    # --- the rest of a statement after its first word ---

    def _group(self) -> None:
        """Read a group in parentheses after the first word: (lun) in READ (lun) $s. The closing parenthesis becomes an
        RGROUP token, because a value may follow it without an operator."""
        self._skip_blanks()
        if not self._text.startswith("(", self._at):
            return
        self._add("LGROUP", "(", self._at, self._at + 1)
        depth = 1
        while depth and self._at < len(self._text):
            self._token()
            depth += _DEPTH.get(self.tokens[-1].type, 0)
        if self.tokens[-1].type == "RPAR" and not depth:
            self.tokens[-1].type = "RGROUP"

    def _task(self) -> None:
        """Read a task number without parentheses, as in EXECUTE 2 pick, and emit the tokens of EXECUTE (2) pick."""
        if (qualifier := re.compile(r"[ \t]*(/[A-Za-z])\b").match(self._text, self._at)) is not None:
            raise self._refusal(
                NotAvailable,
                *qualifier.span(1),
                f"{qualifier[1]}: only where the task does not run yet",
                "IF TASK(1, 2) <> 4 THEN asks that",
            )
        if (match := re.compile(r"\s*(\d+)(?=\s*[A-Za-z])").match(self._text, self._at)) is not None:
            start, end = match.span(1)
            self._add("LGROUP", "(", start, start)
            self._add("NUMBER", match[1], start, end)
            self._add("RGROUP", ")", end, end)

    def _rest(self) -> None:
        """Read everything up to the end of the line."""
        size = len(self._text)
        while self._at < size:
            self._token()
        if len(self.tokens) > MAX_TOKENS:
            raise self._refusal(CannotInterpret, self.tokens[MAX_TOKENS].span.column - 1, size, "the line is too long")

    def _token(self) -> None:
        if (match := self._patterns.next.match(self._text, self._at)) is None:
            raise self._unreadable()
        kind = match.lastgroup
        assert kind is not None
        text, (start, end) = match[kind], match.span(kind)
        match kind:
            case "NAME":
                self._add(*self._type_of_name(text, end), start, end)
            case "INFIX":
                self._refuse_foreign_comment(start)
                wanted = not self._operand  # True where a value must begin, so that + and - are signs of the value
                code = re.compile(self._patterns.format).match(self._text, start) if wanted and text == "/" else None
                if code is not None:
                    self._add("FORMAT", code[0], *code.span())
                else:
                    sign = _SPELLINGS.get(text, text)
                    self._add("PREFIX" if wanted and text in "+-" else "INFIX", sign, start, end)
            case "NUMBER":
                if (glued := self._end_of_run(end)) > end:
                    raise self._refusal(InvalidNumber, start, glued, self._text[start:glued], self._number_hint(start))
                self._add(kind, text, start, end)
            case "STRING":
                self._add(kind, text[1:-1], start, end)
            case _:
                row = self._row
                comma = row is not None and row.comma == text and self._place() == row.before_comma - 1
                self._add("COMMA" if comma else kind, text, start, end)

    def _number_hint(self, start: int) -> str:
        """Return a hint for a number that is directly followed by letters or signs, such as 2^3, 1..3 or 30deg."""
        text = self._text[start : self._end_of_run(start)]
        return first_hint(
            ("^" in text, POWER),
            (".." in text, "FOR i = 1 TO 3 counts from 1 to 3"),
            (text[0] == "'", QUOTES),
            (text.lstrip("0123456789.").upper() in UNITS, NO_UNIT),
            (text[0].isdigit() and re.search("[A-Za-z]", text), "a name begins with a letter"),
        )

    def _type_of_name(self, text: str, end: int) -> tuple[str, str]:
        """Return the token type and the value of a word that is not the first word of the line. `end`: the index after
        the word."""
        row, word, operand = self._row, text.upper(), self._operand
        if (
            row is not None
            and Shape.PROGRAM in row.operand_shapes
            and not operand
            and self._names_program(row, text, end)
        ):
            return "PROGRAM", text
        if word in OPERATOR_WORDS:
            return "PREFIX" if word in _PREFIXES else "INFIX", word
        if self._val_if and operand and word in RELATIONS_OF_VAL:
            return "INFIX", RELATIONS_OF_VAL[word]
        link = self._link(row, word, operand) if operand or row is not None else None
        return (link, word) if link else ("NAME", text)

    def _link(self, row: Word | None, word: str, operand: bool) -> str | None:
        """Return the token type of a linking word (THEN, TO, AT), or None for other words."""
        if operand:
            if row is not None and (word in row.leads or (word == row.comma and self._place() is not None)):
                return "LEAD" if word in row.leads else "COMMA"
            return "THEN_LABEL" if self._val_if and word == "THEN" else _LINKS.get(word)
        assert row is not None
        before = self.tokens[-1].type
        if word in row.leads and before == "COMMA":
            return "LEAD"  # omitted arguments may precede the leading word: IFSIG 1,,, THEN 10
        if row.required_count or before != "WORD":
            return None
        link = _LINKS.get(word, "")
        return "LEAD" if word in row.leads else link if _MODIFIERS.get(link) in row.modifiers else None

    def _names_program(self, row: Word, text: str, end: int) -> bool:
        """Return whether a word is the name of a program, because the word table has a program as the argument at this
        position. `end`: the index after the word."""
        if text[0] in "#$%" or self._text[end : end + 1] == "[":
            return False
        before, place = self.tokens[-1].type, self._place()
        if before == "EQUAL":
            return row.value is not None and row.value.shape is Shape.PROGRAM
        argument = argument_at(row, place) if place is not None and before in _BEFORE_ARGUMENT else None
        return argument is not None and argument.shape is Shape.PROGRAM

    def _place(self) -> int | None:
        """Return the index of the current argument (the number of commas so far); None inside parentheses or
        brackets."""
        depth = commas = 0
        for token in self.tokens:
            depth += _DEPTH.get(token.type, 0)
            commas += token.type == "COMMA" and not depth
        return None if depth else commas

    # --- characters ---

    def _add(self, type: str, value: str, start: int, end: int, row: Word | None = None) -> None:
        self._at = end
        self.tokens.append(Token(type, value, self._text[start:end], Span(self._line, start + 1, end + 1), row))

    def _end_of_run(self, at: int) -> int:
        """Return the index after the letters, digits and characters of numbers (_ . ^ ') that begin at `at`."""
        match = re.compile(_GLUED).match(self._text, at)
        return at if match is None else match.end()

    def _skip_blanks(self) -> None:
        self._at = len(self._text) - len(self._text[self._at :].lstrip(" \t"))

    def _before_comment(self, at: int) -> str:
        """Return the text from an index up to the next `;` that is not in quotes."""
        match = re.compile(_BEFORE_COMMENT).match(self._text, at)
        return match[0] if match is not None else ""

    def _at_end(self) -> bool:
        """Skip blanks, read a comment if one follows, and return whether the end of the line is reached."""
        self._skip_blanks()
        if self._text.startswith(";", self._at):
            self._token()
        return self._at >= len(self._text)

    def _refusal(self, kind: type[VrsError], start: int, end: int, detail: str, hint: str = "") -> LineRefused:
        return refusal(kind, Span(self._line, start + 1, end + 1), detail, hint)

    def _refuse_foreign_comment(self, at: int, signs: str = FOREIGN_COMMENT) -> None:
        """Raise LineRefused if a comment in the style of another language (`//`) begins at index `at`. `signs`: the
        pattern of such comments."""
        sign = re.compile(signs).match(self._text, at)
        if self._text.startswith("#(", at):
            raise self._refusal(CannotInterpret, at, at + 1, "#", FOREIGN_FUNCTIONS["PPOINT"])
        if sign is not None:
            divides = self._operand and re.compile(QUOTIENT).match(self._text, at)  # true for TYPE 7 // 2
            hint = WHOLE if divides else OWN_COMMENT
            raise self._refusal(CannotInterpret, *sign.span(), f"{sign[0]} begins no comment", hint)

    def _unreadable(self) -> LineRefused:
        """Return the error for text at the current position that matches no token."""
        self._skip_blanks()
        at, character = self._at, self._text[self._at]
        self._refuse_foreign_comment(at)
        glued = self._end_of_run(at)
        if character == '"':
            return self._refusal(MissingQuote, at, len(self._text), "the text is not closed", 'a text ends in "')
        if character in "^'" and glued > at:
            hint = first_hint(
                (character == "^" and self._operand, POWER),
                (character == "'" and glued > at + 2, QUOTES),
                (True, "write ^HFF, ^B101, ^17 or 'A"),
            )
            return self._refusal(InvalidNumber, at, glued, self._text[at:glued], hint)
        sign = next((sign for sign in FOREIGN_SIGNS if self._text.startswith(sign, at)), "")
        if sign and (sign != "%" or self._operand):  # % before a name is reported below as a bad name
            hint = FOREIGN_SIGNS[sign]
            if sign == "%" and not self._text[at + 1 :].partition(";")[0].strip(" ,"):
                hint = PERCENT if self._row is not None and self._row.name == "SPEED" else NO_UNIT
            return self._refusal(CannotInterpret, at, at + len(sign), f"{sign} is no sign of VAL-II", hint)
        if character in "_#$%" or character.isalpha():
            end = max(glued, at + 1)
            return self._refusal(InvalidName, at, end, self._text[at:end], "a name begins with a letter a to z")
        if character in "°′″":
            return self._refusal(CannotInterpret, at, at + 1, f"{character} is no sign of VAL-II", NO_UNIT)
        if directive := re.compile(r"\.\S*").match(self._text, at) if not self.tokens else None:
            hint = did_you_mean(directive[0], (".PROGRAM", ".END", ".LOCATIONS", ".REALS", ".STRINGS"))
            return self._refusal(CannotInterpret, *directive.span(), directive[0], hint)
        shown = character if character.isprintable() else f"character {ord(character)}"
        return self._refusal(CannotInterpret, at, at + 1, f"{shown} has no meaning here")
