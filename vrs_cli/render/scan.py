"""The colours of a VAL-II line: a quick look at its words by the tables, without parsing it."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Mapping
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
    from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS
    from vrs_cli.language.words.monitor import COMMANDS
    from vrs_cli.language.words.word import rows_for

    tables = {Role.COMMAND: COMMANDS, Role.INSTRUCTION: INSTRUCTIONS, Role.CONTROL: CONTROL}
    rows = rows_for(word, *tables.values())
    if not rows or (word in _inner_words() and not any(word in table for table in tables.values())):
        return None
    return next(role for role, table in tables.items() if table.get(rows[0].name) is rows[0])


@cache
def _inner_words() -> Mapping[str, Role]:
    """The role of every word that stands inside a statement, where it is itself."""
    from vrs_cli.language.words.functions import FUNCTIONS
    from vrs_cli.language.words.instructions import CONNECTIVES, OPERATOR_WORDS
    from vrs_cli.language.words.monitor import COMMANDS

    leads = {lead for word in COMMANDS.values() for lead in word.leads}
    links = CONNECTIVES | leads | {"AT", "IN", "DO", "GOTO", "MONITOR"}
    roles = dict.fromkeys(FUNCTIONS, Role.FUNCTION) | dict.fromkeys(links, Role.CONTROL)
    return roles | dict.fromkeys(OPERATOR_WORDS, Role.OPERATOR)


@cache
def _with_links() -> frozenset[str]:
    """The words that another may follow at once: READY AT 5, WHERE FROM 1."""
    from vrs_cli.language.words.instructions import INSTRUCTIONS
    from vrs_cli.language.words.monitor import COMMANDS

    rows = (*COMMANDS.values(), *INSTRUCTIONS.values())
    return frozenset(row.name for row in rows if (row.modifiers or row.leads) and not row.required)


def _words_of(line: str) -> frozenset[str]:
    """The words that link in such a line alone: the relations in an IF of VAL, the sort of what is declared."""
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


def scan(line: str, variables: Container[str] = ()) -> Iterator[tuple[str, Role]]:
    """The pieces of a line with their roles; together they are the line. `variables`: the keys of those that bear the
    name of a function.
    """
    first, linking = True, _words_of(line)
    ended = False  # whether a value has, or the word that starts the line: another word may link then
    for token in _TOKEN.finditer(line):
        text, sort = token.group(), token.lastgroup or "operator"
        if sort != "word":
            yield text, _ROLES[sort]
            if sort in ("number", "string", "operator"):
                ended = sort != "operator" or text in ")]"
            continue
        rest = line[token.end() :]
        starts = first and not _TARGET.match(rest)
        role = _first_role(text.upper()) if starts else None
        if role is None:
            linked = text.upper() in linking and not first
            role = Role.CONTROL if linked else _role(text, rest, ended, variables)
        ended = text.upper() in _with_links() if starts else role in (Role.NAME, Role.FUNCTION)
        first = first and text.upper() == "DO"
        yield text, role


def _role(text: str, rest: str, ended: bool, variables: Container[str]) -> Role:
    """The role of a word that does not start a statement."""
    from vrs_cli.language.words.functions import FUNCTIONS

    word = text.upper()
    if word.startswith("."):
        return Role.CONTROL
    role = _inner_words().get(word, Role.NAME)
    if role is Role.OPERATOR or (role is Role.CONTROL and ended):
        return Role.CONTROL
    function = FUNCTIONS.get(word)
    is_function = function is not None and (
        rest.startswith("(") or (function.constant and word.lower() not in variables)
    )
    return Role.FUNCTION if is_function else Role.NAME
