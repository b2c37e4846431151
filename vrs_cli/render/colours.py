"""Define the kinds of text and their colours in one table for the input line, listings, tables and bars.

Text has the background of the terminal, dark or light. Each colour has a contrast of at least 4.5 to 1 to black and to
white (WCAG 2.2, success criterion 1.4.3), so its relative luminance is 0.175 to 0.183. The sixteen terminal colours do
not reach this: bright black on black has 2.4 to 1 in common palettes, yellow on white 1.1. Bars have their own
background.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Mapping
from enum import Enum
from functools import cache


class Ink(Enum):
    """The kind of a piece of text (name, number, warning, ...), which decides its colour."""

    TEXT = "text"
    HEADING = "heading"
    NAME = "name"
    NUMBER = "number"
    STRING = "string"
    COMMAND = "command"
    INSTRUCTION = "instruction"
    CONTROL = "control"
    FUNCTION = "function"
    OPERATOR = "operator"
    COMMENT = "comment"
    NOTE = "note"
    WARNING = "warning"
    ERROR = "error"
    CURVE_1 = "curve1"
    CURVE_2 = "curve2"
    CURVE_3 = "curve3"
    CURVE_4 = "curve4"
    CURVE_5 = "curve5"
    CURVE_6 = "curve6"


CURVES = (Ink.CURVE_1, Ink.CURVE_2, Ink.CURVE_3, Ink.CURVE_4, Ink.CURVE_5, Ink.CURVE_6)

MAGENTA = "#d700af"
GREEN = "#008900"
CYAN = "#008484"
YELLOW = "#b06000"
BLUE = "#5f5fff"
GREY = "#767676"
RED = "#eb0000"

Palette = Mapping[Ink, tuple[str, bool]]  # the colour ("" is the terminal's default), and whether the text is bold

COLOURS: Palette = {
    Ink.TEXT: ("", False),
    Ink.HEADING: ("", True),
    Ink.NAME: ("", False),
    Ink.NUMBER: (MAGENTA, False),
    Ink.STRING: (GREEN, False),
    Ink.COMMAND: (CYAN, True),
    Ink.INSTRUCTION: (CYAN, False),
    Ink.CONTROL: (YELLOW, False),
    Ink.FUNCTION: (BLUE, True),
    Ink.OPERATOR: ("", False),
    Ink.COMMENT: (GREY, False),
    Ink.NOTE: (GREY, False),
    Ink.WARNING: (YELLOW, False),
    Ink.ERROR: (RED, False),
    Ink.CURVE_1: (RED, False),
    Ink.CURVE_2: (GREEN, False),
    Ink.CURVE_3: (BLUE, True),
    Ink.CURVE_4: (YELLOW, False),
    Ink.CURVE_5: (MAGENTA, False),
    Ink.CURVE_6: (CYAN, False),
}


class Bar(Enum):
    """The kind of a bar: a row of the screen, such as the status line, with its own background."""

    STATUS = "status"
    TITLE = "title"
    MISTAKE = "mistake"
    CHOSEN = "chosen"
    ARGUMENT = "argument"


# (colour of the text, colour of the background) of each bar
BARS: Mapping[Bar, tuple[str, str]] = {
    Bar.STATUS: ("#d0d0d0", "#303030"),
    Bar.TITLE: ("#ffffff", "#005f87"),
    Bar.MISTAKE: ("#ffffff", "#af0000"),
    Bar.CHOSEN: ("#ffffff", "#005f87"),
    Bar.ARGUMENT: ("#ffffff", "#303030"),
}


def ink_style(ink: Ink, palette: Palette = COLOURS) -> str:
    """Return a style in the notation that both rich and prompt-toolkit read."""
    colour, bold = palette[ink]
    return " ".join(("bold",) * bold + (colour,) * bool(colour))


def bar_style(bar: Bar) -> str:
    """Return the style of a bar in prompt-toolkit's notation."""
    text, background = BARS[bar]
    return f"noreverse fg:{text} bg:{background}"


_TOKEN = re.compile(
    r"""(?P<comment>;.*)
      | (?P<string>"[^"]*"?)
      | (?P<number>\^[BHD]?[0-9A-F]+ | '. | (?:\d+\.?\d*|\.\d+)(?:E[+-]?\d+)?)
      | (?P<word>[#$%.]?[A-Z][\w.]*)
      | (?P<space>\s+)
      | (?P<operator>.)
    """,
    re.VERBOSE | re.IGNORECASE | re.DOTALL,
)
# matches the text between an assigned name and its value: indexes, if any, and the equals sign
_TARGET = re.compile(r"\s*(?:\[[^\]]*\]\s*)?=(?!=)")

# the first word of a line, after an optional numeric label
_FIRST = re.compile(r"\s*(?:\d+\s+)?([A-Z][\w.]*)", re.IGNORECASE)

# words that link the parts of a statement and are not in the language's tables
LINKING = frozenset({"AT", "IN", "DO", "GOTO", "MONITOR"})

_INKS: Mapping[str, Ink] = {
    "comment": Ink.COMMENT,
    "string": Ink.STRING,
    "number": Ink.NUMBER,
    "space": Ink.TEXT,
    "operator": Ink.OPERATOR,
}


@cache
def _first_ink(word: str) -> Ink | None:
    """Return the ink of the first word of a line, which may be abbreviated; None if the word begins no statement."""
    from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS
    from vrs_cli.language.words.monitor import COMMANDS
    from vrs_cli.language.words.word import rows_for

    tables = {Ink.COMMAND: COMMANDS, Ink.INSTRUCTION: INSTRUCTIONS, Ink.CONTROL: CONTROL}
    rows = rows_for(word, *tables.values())
    if not rows or (word in _inner_words() and not any(word in table for table in tables.values())):
        return None
    return next(ink for ink, table in tables.items() if table.get(rows[0].name) is rows[0])


@cache
def _inner_words() -> Mapping[str, Ink]:
    """Return the ink of each word that has a meaning inside a statement."""
    from vrs_cli.language.words.functions import FUNCTIONS
    from vrs_cli.language.words.instructions import CONNECTIVES, OPERATOR_WORDS
    from vrs_cli.language.words.monitor import COMMANDS

    leads = {lead for word in COMMANDS.values() for lead in word.leads}
    inks = dict.fromkeys(FUNCTIONS, Ink.FUNCTION) | dict.fromkeys(CONNECTIVES | leads | LINKING, Ink.CONTROL)
    return inks | dict.fromkeys(OPERATOR_WORDS, Ink.OPERATOR)


@cache
def _with_links() -> frozenset[str]:
    """Return the first words of lines that a linking word (AT, FROM) may follow directly, as in READY AT 5 and WHERE
    FROM 1."""
    from vrs_cli.language.words.instructions import INSTRUCTIONS
    from vrs_cli.language.words.monitor import COMMANDS

    rows = (*COMMANDS.values(), *INSTRUCTIONS.values())
    return frozenset(row.name for row in rows if (row.modifiers or row.leads) and not row.required_count)


def _words_of(line: str) -> frozenset[str]:
    """Return the linking words that are valid only in this kind of line: the relations (EQ, ...) in an IF of VAL, and
    the type in a declaration."""
    from vrs_cli.language.text.lexer import SORT, VAL_IF
    from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS, RELATIONS_OF_VAL
    from vrs_cli.language.words.word import rows_for

    first = _FIRST.match(line)
    rows = rows_for(first[1], INSTRUCTIONS, CONTROL) if first is not None else ()
    if first is None or len(rows) != 1:
        return frozenset()
    rest = line[first.end() :].partition(";")[0]
    if rows[0].name == "IF" and re.search(VAL_IF, rest):
        return frozenset(RELATIONS_OF_VAL)
    sort = re.match(SORT, rest) if "SORT" in rows[0].modifiers else None
    return frozenset({sort[1].upper()}) if sort is not None else frozenset()


def scan(line: str, variables: Container[str] = ()) -> Iterator[tuple[str, Ink]]:
    """Yield the pieces of a VAL-II line with their inks, without parsing the line. Joined, the pieces give the line.

    `variables`: the keys of variables that have the name of a function.
    """
    first, linking = True, _words_of(line)
    # whether the text before this word is a complete value or first word, which a linking word may follow
    ended = False
    for token in _TOKEN.finditer(line):
        text, sort = token.group(), token.lastgroup or "operator"
        if sort != "word":
            yield text, _INKS[sort]
            if sort in ("number", "string", "operator"):
                ended = sort != "operator" or text in ")]"
            continue
        rest = line[token.end() :]
        starts = first and not _TARGET.match(rest)
        ink = _first_ink(text.upper()) if starts else None
        if ink is None:
            linked = text.upper() in linking and not first
            ink = Ink.CONTROL if linked else _ink(text, rest, ended, variables)
        ended = text.upper() in _with_links() if starts else ink in (Ink.NAME, Ink.FUNCTION)
        first = first and text.upper() in ("DO", "EXPLAIN")
        yield text, ink


def _ink(text: str, rest: str, ended: bool, variables: Container[str]) -> Ink:
    """Return the ink of a word that does not start a statement."""
    from vrs_cli.language.words.functions import FUNCTIONS

    word = text.upper()
    if word.startswith("."):
        return Ink.CONTROL
    ink = _inner_words().get(word, Ink.NAME)
    if ink is Ink.OPERATOR or (ink is Ink.CONTROL and ended):
        return Ink.CONTROL
    function = FUNCTIONS.get(word)
    is_function = function is not None and (
        rest.startswith("(") or (function.constant and word.lower() not in variables)
    )
    return Ink.FUNCTION if is_function else Ink.NAME
