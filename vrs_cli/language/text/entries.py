"""The usual line of a section of variables, `name 12.5` or `name[3] 1 2 3 90 0 0`, read at a glance.

A file may hold a hundred thousand of them; the grammar reads all others, and says what is wrong. A law in the tests has
both read the same.
"""

from __future__ import annotations

import re
from functools import cache

from vrs_cli.language.text.ast import Entry, Expression, Number, Span, Variable
from vrs_cli.language.text.builder import signed_number
from vrs_cli.language.words.instructions import OPERATOR_WORDS

_NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[Ee][-+]?[0-9]+)?(?![^ \t])"
_USUAL = (
    rf"[ \t]*(?P<sigil>#?)(?P<name>[A-Za-z][A-Za-z0-9._]*)(?:\[(?P<index>[0-9]{{1,9}})\])?"
    rf"[ \t]+(?P<numbers>{_NUMBER}(?:[ \t]+{_NUMBER})*)[ \t]*"
)


def usual_entry(text: str, line: int) -> Entry | None:
    """Read a usual line. Return None if the grammar has to read it."""
    match = _usual().fullmatch(text)
    if match is None or match["name"].upper() in OPERATOR_WORDS:
        return None
    numbers = [signed_number(number) for number in match["numbers"].split()]
    if None in numbers:
        return None
    first, last = match.start("sigil") + 1, match.end("numbers") + 1
    named = match.end("name") + 1 if match["index"] is None else match.end("index") + 2
    variable = Variable(match["name"], match["sigil"], _index(match, line), span=Span(line, first, named))
    return Entry(
        variable, tuple(number for number in numbers if number is not None), None, span=Span(line, first, last)
    )


def _index(match: re.Match[str], line: int) -> tuple[Expression, ...] | None:
    digits = match["index"]
    if digits is None:
        return None
    return (Number(float(digits), digits, span=Span(line, match.start("index") + 1, match.end("index") + 1)),)


@cache
def _usual() -> re.Pattern[str]:
    return re.compile(_USUAL)
