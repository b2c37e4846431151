"""One line of VAL-II as tokens, with the decisions that only the start of the statement and the tables allow.

The patterns of the terminals stand in grammar/val2.lark and come in as an argument; its head names the decisions.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Mapping

from msgspec import Struct

from vrs_cli.errors import (
    CannotInterpret,
    InvalidName,
    InvalidNumber,
    MissingQuote,
    UnknownInstruction,
    UsageError,
    VrsError,
)
from vrs_cli.language.text.ast import Span
from vrs_cli.language.text.diagnostics import LineRefused, did_you_mean, error
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import (
    INSTRUCTIONS,
    OPERATOR_WORDS,
    PROGRAM_WORDS,
    RELATIONS_OF_VAL,
    why_reserved,
)
from vrs_cli.language.words.kind import NAME_LENGTH
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import SORT_WORDS, Control, Shape, State, Word, argument_at, rows_for, usable_names

LABEL_HIGH = 65535
LONGEST = 400  # tokens of a line; a VAL-II line holds far fewer


class Token(Struct, eq=False):
    """A terminal: `value` is the word in full or the sign in its one spelling; `text` is as typed.

    `row`: what the tables say of a WORD.
    """

    type: str
    value: str
    text: str
    line: int
    column: int
    end: int
    row: Word | None = None

    @property
    def span(self) -> Span:
        return Span(self.line, self.column, self.end)


# Words that link, where an expression has just ended.
_LINKS = {
    **{word: word for word in ("THEN", "GOTO", "TO", "STEP", "DO", "OF", "BY", "AT", "IN", "ALWAYS")},
    **dict.fromkeys(("MMPS", "IPS", "MONITOR"), "UNIT"),
}
_MODIFIERS = {"AT": "AT", "IN": "AT", "ALWAYS": "ALWAYS", "UNIT": "UNIT"}  # what a row allows, by type of token
_SPELLINGS = {"=<": "<=", "=>": ">="}
_PREFIXES = frozenset({"NOT", "COM"})
_SYMBOLS = ("COMMA", "LPAR", "RPAR", "LSQB", "RSQB", "EQUAL")
_CLOSING = frozenset({"RPAR", "RSQB"})
_DEPTH = {"LPAR": 1, "LGROUP": 1, "LSQB": 1, "RPAR": -1, "RSQB": -1}
_BEFORE_ARGUMENT = frozenset({"WORD", "COMMA", "RPAR"})  # RPAR: of the number of a task

_BLANKS = re.compile(r"[ \t]*")
_WORD = re.compile(r"[#$%]?[A-Za-z][A-Za-z0-9._]*")
_GLUED = re.compile(r"[\w.^']+")
VAL_IF = re.compile(rf"\b({'|'.join(RELATIONS_OF_VAL)})\b.*\bTHEN[ \t]+\d+[ \t]*$", re.IGNORECASE)
_TASK = re.compile(r"\s*(\d+)(?=\s*[A-Za-z])")
_LABEL = re.compile(r"[ \t]*([0-9]+)(?![\w.])")
SORT = re.compile(rf"[ \t]*({'|'.join(SORT_WORDS)})(?=[ \t]+[#$A-Z])", re.IGNORECASE)
_ASSIGNS = re.compile(r"[ \t]*(?:=(?![=<>])|\[)")
_COLON_EQUAL = re.compile(r"[ \t]*(?:\[.*\][ \t]*)?(:=)")
_VALUE = re.compile(r"[-+]?[ \t]*(?:\.?[0-9]|[\"('^#$]|[A-Za-z])")  # what begins an expression, where no word stands
_OPERATED = re.compile(r"[ \t]*(?:\*|:|<|>|==|/(?![A-Za-z]))")  # a sign after a name that begins no argument
_NO_ARGUMENT = re.compile(rf"[ \t]*(?:$|;|[-+*/:<>=)]|(?:{'|'.join(sorted(OPERATOR_WORDS))})\b)", re.IGNORECASE)
_ELEMENT = re.compile(r"\(.*\)[ \t]*=(?!=)")
_RAW = re.compile(r'"[^"]*"|[^\s;,="]+')
_RELATION = re.compile(r"[=<>]{1,2}")
_ENTRY_NUMBER = re.compile(r"[ \t]*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[Ee][-+]?[0-9]+)?)(?![\w.])")


class Lexer:
    """`terminals`: the pattern of each terminal that has one, by name. Its methods raise LineRefused."""

    def __init__(self, terminals: Mapping[str, str]) -> None:
        names = ("STRING", "NUMBER", "NAME", "INFIX", *_SYMBOLS)
        choices = "|".join(("(?P<COMMENT>;.*)", *(f"(?P<{name}>{terminals[name]})" for name in names)))
        self.next = re.compile(f"[ \t]*(?:{choices})").match  # blanks and a token
        self.format = re.compile(terminals["FORMAT"]).match

    def step(self, text: str, line: int) -> list[Token]:
        """A program line: `[label] [statement] [;comment]`."""
        return _Scan(self, text, line).step()

    def prompt(self, text: str, names: Container[str] = ()) -> list[Token]:
        """A line of the prompt. `names`: the keys of what is defined."""
        return _Scan(self, text, 1).command(names)

    def header(self, text: str, line: int, at: int) -> list[Token]:
        """What follows `.PROGRAM`, which ends at index `at`."""
        return _Scan(self, text, line, at).heading()

    def entry(self, text: str, line: int) -> list[Token]:
        """A line of a section of variables: numbers have their signs."""
        return _Scan(self, text, line).entry()


Tables = tuple[Mapping[str, Word], ...]


class _Scan:
    """The tokens of one line, found from left to right.

    `_at`: the index of what is not yet read; `_operand`: whether an expression has just ended; `_row`: the row of the
    word at the start, while its arguments are read.
    """

    def __init__(self, lexer: Lexer, text: str, line: int, at: int = 0) -> None:
        self.tokens: list[Token] = []
        self._lexer = lexer
        self._text = text.rstrip()
        self._line = line
        self._at = at
        self._operand = False
        self._row: Word | None = None
        self._val_if = False  # IF a EQ b THEN label

    # --- the parts of a line ---

    def step(self) -> list[Token]:
        """Read a label, if there is one, and a statement."""
        match = _LABEL.match(self._text)
        if match is not None:
            if int(match[1][:9]) > LABEL_HIGH:
                raise self._refusal(InvalidNumber, *match.span(1), match[1], f"labels are 0 to {LABEL_HIGH}")
            self._add("LABEL", match[1], *match.span(1))
        if not self._at_end():
            self._statement((PROGRAM_WORDS,), UnknownInstruction)
        return self.tokens

    def command(self, names: Container[str]) -> list[Token]:
        """Read a monitor command, a statement, or an expression whose value is shown."""
        if not self._at_end():
            if self._shows(names):
                self._rest()
            else:
                self._statement((COMMANDS, PROGRAM_WORDS), UsageError)
        return self.tokens

    def heading(self) -> list[Token]:
        """Read a program's name and parameters."""
        if not self._at_end():
            name = self._first_word(InvalidName, "a program name begins with a letter", ".PROGRAM pick.place(part)")
            self._add("PROGRAM", name[0], *name.span())
        self._rest()
        return self.tokens

    def entry(self) -> list[Token]:
        """Read a variable and its value."""
        while not self._at_end():
            number = _ENTRY_NUMBER.match(self._text, self._at)
            if number is not None:
                self._add("NUMBER", number[1], *number.span(1))
            else:
                self._operand = False
                self._token()
        return self.tokens

    # --- the start of a statement ---

    def _shows(self, names: Container[str]) -> bool:
        """Whether a line of the prompt is an expression. A full word of a command or an instruction comes before a name
        that is defined, and that before a word cut short.
        """
        word = _WORD.match(self._text, self._at)
        if word is None:
            label = _LABEL.match(self._text, self._at)
            return (_NO_ARGUMENT if label else _VALUE).match(self._text, label.end() if label else self._at) is not None
        name, at = word[0].upper(), word.end()
        if _COLON_EQUAL.match(self._text, at):
            return False
        if name[0] in "#$" or name in _PREFIXES:
            return True
        defined, function = word[0].lower()[:NAME_LENGTH] in names, FUNCTIONS.get(name)
        operated, constant = _OPERATED.match(self._text, at) is not None, function is not None and function.constant
        if name in COMMANDS or name in PROGRAM_WORDS:
            return operated and (defined or constant)
        if constant or (function is not None and self._text[at : at + 1] == "("):
            return True
        if defined:
            return _NO_ARGUMENT.match(self._text, at) is not None
        return operated and not rows_for(name, COMMANDS, PROGRAM_WORDS)

    def _statement(self, tables: Tables, unknown: type[VrsError]) -> None:
        hint = "LISTR 5+3 shows a value, HELP the commands" if unknown is UsageError else ""
        kind = UsageError if unknown is UsageError else CannotInterpret
        word = self._first_word(kind, "a line begins with a word or the variable that is assigned", hint)
        colon_equal = _COLON_EQUAL.match(self._text, word.end())
        if colon_equal:
            hint = f"{word[0]} = 5 assigns, {word[0]} == 5 compares"
            raise self._refusal(CannotInterpret, *colon_equal.span(1), ":= is no sign of VAL-II", hint)
        if _ASSIGNS.match(self._text, word.end()):
            self._refuse_operator(word)
            self._rest()
        elif word[0][0] in "#$%":
            raise self._refusal(CannotInterpret, *word.span(), word[0], "a variable is followed by = and its value")
        else:
            self._operation(self._row_of(word, tables, unknown), word, tables)

    def _first_word(self, kind: type[VrsError], detail: str, hint: str) -> re.Match[str]:
        self._skip_blanks()
        match = _WORD.match(self._text, self._at)
        if match is None:
            if kind is not UsageError and self._lexer.next(self._text, self._at) is None:
                raise self._unreadable()
            glued = _GLUED.match(self._text, self._at)
            raise self._refusal(kind, self._at, glued.end() if glued else self._at + 1, detail, hint)
        self._refuse_other_letters(match)
        return match

    def _refuse_other_letters(self, word: re.Match[str]) -> None:
        """A letter of another alphabet does not end a word: it is a mistake in it."""
        if self._text[word.end() : word.end() + 1].isalnum():
            glued = _GLUED.match(self._text, word.end())
            end = glued.end() if glued else word.end() + 1
            hint = "letters a to z, digits, . and _"
            raise self._refusal(InvalidName, word.start(), end, self._text[word.start() : end], hint)

    def _refuse_operator(self, word: re.Match[str]) -> None:
        """AND = 5: what follows would be read as its operand."""
        name = word[0].upper()
        if name in OPERATOR_WORDS:
            raise self._refusal(InvalidName, *word.span(), *why_reserved(name))

    def _row_of(self, word: re.Match[str], tables: Tables, unknown: type[VrsError]) -> Word:
        found = rows_for(word[0], *tables)
        if len(found) == 1:
            return found[0]
        detail, hint = word[0], ", ".join(row.name for row in found[:8])
        if found:
            detail = f"{word[0]} is short for several words"
        raise self._refusal(unknown, *word.span(), detail, hint or self._other_form(word[0], word.end(), tables))

    def _other_form(self, word: str, end: int, tables: Tables) -> str:
        """What an unknown first word may have been meant as."""
        rest = _before_comment(self._text[end:]).strip()
        if word.upper() in COMMANDS:
            return "a monitor command, typed at the prompt"
        if rest.startswith("=="):
            return "= assigns; == compares, in IF, WHILE and the like"
        if _ELEMENT.match(rest):
            return f"an element of an array is {word}[index]"
        at_prompt = COMMANDS in tables
        near = did_you_mean(word, usable_names(COMMANDS, INSTRUCTIONS) if at_prompt else usable_names(PROGRAM_WORDS))
        if near:
            return near
        if rest and rest[0] != "(":
            return "an abbreviation has two letters at least" if len(word) == 1 else ""
        if at_prompt:
            return f"EXECUTE {word} runs a program, {word} = 5 makes a variable"
        return f"CALL {word} runs a program"

    def _operation(self, row: Word, word: re.Match[str], tables: Tables) -> None:
        if row.name == "REMARK":
            self._add("COMMENT", f";{self._text[word.end() :]}", word.start(), len(self._text))
        elif row is COMMANDS["DO"] and COMMANDS in tables:
            self._add("DO_COMMAND", "DO", *word.span())
            if not self._at_end():
                self._statement((PROGRAM_WORDS,), UnknownInstruction)
        elif type(row) is Control:
            self._add(row.name, row.name, *word.span())
            self._val_if = row.name == "IF" and VAL_IF.search(_before_comment(self._text[self._at :])) is not None
            self._rest()
            self._mark_colon(row)
        else:
            self._add("WORD", row.name, *word.span(), row)
            self._arguments(row)

    def _mark_colon(self, row: Word) -> None:
        """The colon that ends VALUE 1, 2: is no operator."""
        last = self.tokens[-2 if self.tokens[-1].type == "COMMENT" else -1]
        if row.name in ("VALUE", "ANY") and last.text == ":":
            last.type = "COLON"

    def _arguments(self, row: Word) -> None:
        if row.state is not State.SUPPORTED:
            self._unread_rest()
        elif row.raw:
            self._raw_words(row)
        else:
            self._row = row
            self._before_arguments(row)
            self._rest()

    def _unread_rest(self) -> None:
        self._skip_blanks()
        rest = _before_comment(self._text[self._at :]).rstrip()
        if rest:
            self._add("REST", rest, self._at, self._at + len(rest))
        self._rest()

    def _raw_words(self, row: Word) -> None:
        """Read words as they stand; where no value follows, a relation is one too (HELP ==)."""
        while not self._at_end():
            relation = _RELATION.match(self._text, self._at) if row.value is None else None
            raw = relation or _RAW.match(self._text, self._at)
            if raw is None:
                self._token()
            else:
                self._add("RAW", raw[0].strip('"'), *raw.span())

    # --- what follows ---

    def _before_arguments(self, row: Word) -> None:
        """Read what stands before the arguments: a parenthesis, the number of a task, the sort of variables."""
        if row.grouped:
            self._group()
        if row.tasked:
            self._task()
        if "SORT" in row.modifiers:
            match = SORT.match(self._text, self._at)
            if match is not None:
                self._add("SORT", match[1].upper(), *match.span(1))

    def _group(self) -> None:
        """Read the parenthesis of READ (lun) $s, after which a value may begin."""
        depth = 0
        while self._at < len(self._text):
            self._token()
            depth += _DEPTH.get(self.tokens[-1].type, 0)
            if depth <= 0:
                break
        self._operand = False

    def _task(self) -> None:
        """Read the number in EXECUTE 2 pick: a group without its parentheses."""
        match = _TASK.match(self._text, self._at)
        if match is not None:
            start, end = match.span(1)
            self._add("LGROUP", "(", start, start)
            self._add("NUMBER", match[1], start, end)
            self._add("RPAR", ")", end, end)

    def _rest(self) -> None:
        """Read everything up to the end of the line."""
        size = len(self._text)
        while self._at < size:
            self._token()
        if len(self.tokens) > LONGEST:
            beyond = self.tokens[LONGEST]
            raise self._refusal(CannotInterpret, beyond.column - 1, size, "the line is too long")

    def _token(self) -> None:
        """Read one token."""
        match = self._lexer.next(self._text, self._at)
        if match is None:
            raise self._unreadable()
        kind = match.lastgroup
        assert kind is not None
        start, end = match.span(kind)
        self._operand = _READERS[kind](self, match[kind], start, end)

    # The readers of a token: each says whether an expression ends with it.

    def _name(self, text: str, start: int, end: int) -> bool:
        row = self._row
        if row is not None and row.programs and not self._operand and self._names_program(row, text, end):
            self._add("PROGRAM", text, start, end)
            return True
        word = text.upper()
        if word in OPERATOR_WORDS:
            self._add("PREFIX" if word in _PREFIXES else "INFIX", word, start, end)
            return False
        if self._val_if and self._operand and word in RELATIONS_OF_VAL:
            self._add("INFIX", RELATIONS_OF_VAL[word], start, end)
            return False
        link = self._link(row, word) if self._operand or row is not None else None
        self._add(link or "NAME", word if link else text, start, end)
        return link is None or link in ("ALWAYS", "UNIT")

    def _link(self, row: Word | None, word: str) -> str | None:
        """The type of a word that links, where it does."""
        if self._operand:
            if row is not None and (word in row.leads or (word == row.comma and self._place() is not None)):
                return "LEAD" if word in row.leads else "COMMA"
            return "THEN_LABEL" if self._val_if and word == "THEN" else _LINKS.get(word)
        assert row is not None
        before = self.tokens[-1].type
        if word in row.leads and before == "COMMA":
            return "LEAD"  # what stood before it is left out: IFSIG 1,,, THEN 10
        if row.required or before != "WORD":
            return None
        link = _LINKS.get(word, "")
        return "LEAD" if word in row.leads else link if _MODIFIERS.get(link) in row.modifiers else None

    def _names_program(self, row: Word, text: str, end: int) -> bool:
        """Whether a word, where a value is wanted, is the name of a program by the table."""
        if text[0] in "#$%" or self._text[end : end + 1] == "[":
            return False
        before, place = self.tokens[-1].type, self._place()
        if before == "EQUAL":
            return row.value is not None and row.value.shape is Shape.PROGRAM
        argument = argument_at(row, place) if place is not None and before in _BEFORE_ARGUMENT else None
        return argument is not None and argument.shape is Shape.PROGRAM

    def _place(self) -> int | None:
        """How many commas stand before; None inside parentheses or brackets."""
        depth = commas = 0
        for token in self.tokens:
            depth += _DEPTH.get(token.type, 0)
            commas += token.type == "COMMA" and not depth
        return None if depth else commas

    def _number(self, text: str, start: int, end: int) -> bool:
        glued = _GLUED.match(self._text, end)
        if glued is not None:
            raise self._refusal(InvalidNumber, start, glued.end(), self._text[start : glued.end()])
        self._add("NUMBER", text, start, end)
        return True

    def _string(self, text: str, start: int, end: int) -> bool:
        self._add("STRING", text[1:-1], start, end)
        return True

    def _infix(self, text: str, start: int, end: int) -> bool:
        if self._operand:
            self._add("INFIX", _SPELLINGS.get(text, text), start, end)
            return False
        format_code = self._lexer.format(self._text, start) if text == "/" else None
        if format_code is not None:
            self._add("FORMAT", format_code[0], *format_code.span())
            return True
        self._add("PREFIX" if text in "+-" else "INFIX", _SPELLINGS.get(text, text), start, end)
        return False

    def _parenthesis(self, _text: str, start: int, end: int) -> bool:
        group = self._row is not None and self._row.grouped > 0 and self.tokens[-1].type == "WORD"
        self._add("LGROUP" if group else "LPAR", "(", start, end)
        return False

    def _comment(self, text: str, start: int, end: int) -> bool:
        self._add("COMMENT", text, start, end)
        return False

    # --- characters ---

    def _add(self, type: str, value: str, start: int, end: int, row: Word | None = None) -> None:
        """Keep what stands there as a token, and go on behind it."""
        self._at = end
        self.tokens.append(Token(type, value, self._text[start:end], self._line, start + 1, end + 1, row))

    def _skip_blanks(self) -> None:
        match = _BLANKS.match(self._text, self._at)
        self._at = match.end() if match else self._at

    def _at_end(self) -> bool:
        """Whether only a comment is left; it is read."""
        self._skip_blanks()
        if self._text.startswith(";", self._at):
            self._token()
        return self._at >= len(self._text)

    def _refusal(self, kind: type[VrsError], start: int, end: int, detail: str, hint: str = "") -> LineRefused:
        return LineRefused(error(kind, Span(self._line, start + 1, end + 1), detail, hint))

    def _unreadable(self) -> LineRefused:
        """What is wrong where no token begins."""
        self._skip_blanks()
        at, character = self._at, self._text[self._at]
        glued = _GLUED.match(self._text, at)
        if character == '"':
            return self._refusal(MissingQuote, at, len(self._text), "the text is not closed", 'a text ends in "')
        if character in "^'" and glued is not None:
            hint = "write ^HFF, ^B101, ^17 or 'A"
            return self._refusal(InvalidNumber, at, glued.end(), glued[0], hint)
        if character in "_#$%" or character.isalpha():
            end = glued.end() if glued else at + 1
            return self._refusal(InvalidName, at, end, self._text[at:end], "a name begins with a letter a to z")
        shown = character if character.isprintable() else f"character {ord(character)}"
        return self._refusal(CannotInterpret, at, at + 1, f"{shown} has no meaning here")


def _symbol(kind: str) -> _Reader:
    closes = kind in _CLOSING

    def read(scan: _Scan, text: str, start: int, end: int) -> bool:
        comma = scan._row is not None and scan._row.comma == text
        scan._add("COMMA" if comma else kind, text, start, end)
        return closes

    return read


_Reader = Callable[[_Scan, str, int, int], bool]
_READERS: Mapping[str, _Reader] = {
    **{kind: _symbol(kind) for kind in _SYMBOLS},
    "NAME": _Scan._name,
    "NUMBER": _Scan._number,
    "STRING": _Scan._string,
    "INFIX": _Scan._infix,
    "LPAR": _Scan._parenthesis,
    "COMMENT": _Scan._comment,
}


def _before_comment(text: str) -> str:
    """What stands before a `;` outside quotes."""
    quoted = False
    for index, character in enumerate(text):
        quoted ^= character == '"'
        if character == ";" and not quoted:
            return text[:index]
    return text
