"""What a command, an instruction or a function takes, and which argument is being typed."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator

from msgspec import Struct

from vrs_cli.interfaces.conversation.complete import open_bracket, top_level
from vrs_cli.language.text.ast import Program
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.values import key_of
from vrs_cli.language.words.word import rows_for

_QUOTED_OR_COMMENT = re.compile(r'"[^"]*"?|;.*')
_FIRST = re.compile(r"\s*(?:\d+\s+)?(?:DO\s+(?=[A-Za-z]))?([A-Za-z][\w.]*)(\s|$)", re.IGNORECASE)
_SEPARATOR = re.compile(r",|\bBY\b", re.IGNORECASE)  # BY stands for a comma
_BEFORE_PARENTHESIS = re.compile(r"([#$]?[A-Za-z][\w.]*)\s*$")


class Signature(Struct, frozen=True):
    """`form` with the places of its arguments (begin and end index), and the number of the one that is `active`."""

    form: str
    summary: str
    arguments: tuple[tuple[int, int], ...]
    active: int


Programs = Callable[[str], Program | None]  # by key


def signature(before: str, programs: Programs, *, at_prompt: bool = False) -> Signature | None:
    """The signature of the innermost function or program call that is open at the end of the text, else of the text's
    first word."""
    text = blanked(before)
    at = open_bracket(text, "(")
    if at is not None:
        found = _BEFORE_PARENTHESIS.search(text[:at])
        return _called(found[1], text[at + 1 :], programs) if found else None
    found = _FIRST.match(text)
    tables = (COMMANDS, INSTRUCTIONS, CONTROL) if at_prompt else (INSTRUCTIONS, CONTROL)
    rows = rows_for(found[1], *tables) if found else ()
    if found is None or len(rows) != 1 or not rows[0].arguments:
        return None
    if not found[2] and rows[0].name != found[1].upper():
        return None  # the word is not complete
    row = rows[0]
    names = (argument.name for argument in row.arguments)
    return _signature(row.form, row.summary, names, text[found.end() :])


def blanked(line: str) -> str:
    """The line with blanks for texts and comments, every column where it was."""
    return _QUOTED_OR_COMMENT.sub(lambda found: " " * len(found[0]), line)


def _called(name: str, rest: str, programs: Programs) -> Signature | None:
    if (row := FUNCTIONS.get(name.upper())) is not None:
        return _signature(row.form, row.summary, (argument.name for argument in row.arguments), rest)
    program = programs(key_of(name))
    if program is None:
        return None
    names = [parameter.sigil + parameter.name for parameter in program.parameters]
    return _signature(f"{program.name}({', '.join(names)})", (program.comment or "").strip(), names, rest)


def _signature(form: str, summary: str, names: Iterable[str], rest: str) -> Signature | None:
    arguments = tuple(_places(form, names))
    if not arguments:
        return None
    complete = len(_SEPARATOR.findall(top_level(rest)))
    return Signature(form, summary, arguments, min(complete, len(arguments) - 1))


def _places(form: str, names: Iterable[str]) -> Iterator[tuple[int, int]]:
    """Each name in the form, behind the word itself and the names before it."""
    found = re.match(r"[#$]?[\w.]+", form)
    at = found.end() if found else 0
    for name in names:
        begin = form.find(name, at)
        if begin >= 0:
            at = begin + len(name)
            yield begin, at
