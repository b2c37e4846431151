"""The colours of a VAL-II line: a quick look at its words by the tables, without parsing it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache

from vrs_cli.render.roles import Role

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
_TARGET = re.compile(r"\s*(?:\[[^\]]*\]\s*)?=(?!=)")  # what follows the name that is assigned

_FIRST = re.compile(r"\s*(?:\d+\s+)?([A-Z][\w.]*)", re.IGNORECASE)  # behind a label

_ROLES: Mapping[str, Role] = {
    "comment": Role.COMMENT,
    "string": Role.STRING,
    "number": Role.NUMBER,
    "space": Role.TEXT,
    "operator": Role.OPERATOR,
}


@cache
def _first_role(word: str) -> Role | None:
    """The role of a first word, also one that is cut short; None where it begins no statement."""
    from vrs_cli.language.instructions import CONTROL, INSTRUCTIONS
    from vrs_cli.language.monitor import COMMANDS
    from vrs_cli.language.words import abbreviated

    tables = {Role.COMMAND: COMMANDS, Role.INSTRUCTION: INSTRUCTIONS, Role.CONTROL: CONTROL}
    rows = abbreviated(word, *tables.values())
    if not rows or (word in inner_words() and not any(word in table for table in tables.values())):
        return None
    return next(role for role, table in tables.items() if table.get(rows[0].name) is rows[0])


@cache
def inner_words() -> Mapping[str, Role]:
    """The role of every word that stands inside a statement."""
    from vrs_cli.language.functions import FUNCTIONS
    from vrs_cli.language.instructions import CONNECTIVES, OPERATOR_WORDS
    from vrs_cli.language.monitor import COMMANDS

    leads = {lead for word in COMMANDS.values() for lead in word.leads}
    words = CONNECTIVES | OPERATOR_WORDS | leads | {"AT", "IN", "DO", "GOTO", "MONITOR"}
    return dict.fromkeys(FUNCTIONS, Role.FUNCTION) | dict.fromkeys(words, Role.CONTROL)


def _words_of(line: str) -> frozenset[str]:
    """The words that link in such a line alone: the relations in an IF of VAL, the sort of what is declared."""
    from vrs_cli.language.instructions import CONTROL, INSTRUCTIONS, RELATIONS_OF_VAL
    from vrs_cli.language.lexer import SORT, VAL_IF
    from vrs_cli.language.words import abbreviated

    first = _FIRST.match(line)
    rows = abbreviated(first[1], INSTRUCTIONS, CONTROL) if first is not None else ()
    if first is None or len(rows) != 1:
        return frozenset()
    rest = line[first.end() :].partition(";")[0]
    if rows[0].name == "IF" and VAL_IF.search(rest):
        return frozenset(RELATIONS_OF_VAL)
    sort = SORT.match(rest) if "SORT" in rows[0].modifiers else None
    return frozenset({sort[1].upper()}) if sort is not None else frozenset()


def scan(line: str) -> Iterator[tuple[str, Role]]:
    """The pieces of a line with their roles; together they are the line."""
    first, linking = True, _words_of(line)
    for token in _TOKEN.finditer(line):
        text, sort = token.group(), token.lastgroup or "operator"
        if sort != "word":
            yield text, _ROLES[sort]
            continue
        linked = not first and text.upper() in linking
        yield text, Role.CONTROL if linked else _role(text, first, line, token.end())
        first = first and text.upper() == "DO"


def _role(text: str, first: bool, line: str, end: int) -> Role:
    word = text.upper()
    if word.startswith("."):
        return Role.CONTROL
    if first and not _TARGET.match(line, end):
        return _first_role(word) or inner_words().get(word, Role.NAME)
    return inner_words().get(word, Role.NAME)
