"""Files in the language of another maker: named at their first tell-tale line, before all that is wrong with them."""

from __future__ import annotations

import re
from functools import cache
from typing import NamedTuple

from vrs_cli.errors import CannotInterpret
from vrs_cli.values.diagnostics import Diagnostic, Span, error

WAY = "MOVE, MOVES, APPRO, WAIT SIG(n), SIGNAL and TYPE do it in VAL-II; a program begins with .PROGRAM name"


class Maker(NamedTuple):
    """A language: `sure`: lines that no VAL-II has; `likely`: lines of which a file in that language has many."""

    title: str
    sure: str
    likely: str


_MAKERS: tuple[Maker, ...] = (
    Maker(
        "Kawasaki AS",
        r"\.(?:TRANS|JOINTS|INTER_PANEL_D|INTER_PANEL_TITLE|NETCONF)\b",
        r"(?:JMOVE(?![^;\n]*,[^;\n]*,)|LMOVE|HMOVE|XMOVE|JAPPRO|LAPPRO|JDEPART|LDEPART|TWAIT|SWAIT|C1MOVE|C2MOVE)\b",
    ),
    Maker(
        "KRL (KUKA)",
        r"&(?:ACCESS|REL|PARAM|COMMENT)\b|;FOLD\b|BAS[ \t]*\([ \t]*#"
        r"|(?:GLOBAL[ \t]+)?DEF(?:FCT|DAT)?[ \t]+\w+[ \t]*\([^)]*\)[ \t]*$",
        r"(?:PTP|LIN|CIRC|SLIN|SPTP)[ \t]+(?:\{|X?\w+|\$)|ENDFOLD|DECL[ \t]+\w+|\$(?:VEL|ACC|BASE|TOOL|OUT)\b",
    ),
    Maker(
        "RAPID (ABB)",
        r"MODULE[ \t]+\w+(?:[ \t]*\(.*\))?[ \t]*$|PROC[ \t]+\w+[ \t]*\("
        r"|(?:PERS|VAR|CONST|LOCAL PERS)[ \t]+(?:robtarget|jointtarget|tooldata|wobjdata|num|bool|speeddata)\b",
        r"Move(?:J|L|C|AbsJ)[ \t]+|ENDPROC|ENDMODULE|(?:Set|Reset)[ \t]+\w+[ \t]*;|WaitTime[ \t]|TPWrite[ \t]",
    ),
    Maker(
        "URScript (Universal Robots)",
        r"(?:movej|movel|movep|movec|servoj|speedl)[ \t]*\(|set_(?:digital|standard_digital|tool_digital)_out[ \t]*\(",
        r"def[ \t]+\w+[ \t]*\(.*\)[ \t]*:[ \t]*$|textmsg[ \t]*\(|sleep[ \t]*\(|set_tcp[ \t]*\(",
    ),
    Maker(
        "Karel, or a teach pendant program (FANUC)",
        r"/(?:PROG|MN|POS|ATTR|APPL)\b|[ \t]*\d*:[ \t]*[JLC][ \t]+P[ \t]*R?\[",
        r"PROGRAM[ \t]+\w+[ \t]*$|BEGIN[ \t]*$|END[ \t]+\w+[ \t]*$|ROUTINE[ \t]+\w+|--"
        r"|%(?:NOLOCKGROUP|COMMENT|ENVIRONMENT)",
    ),
)
_WORD = "[A-Z][A-Z0-9_]+"
_KAWASAKI = (*(f".{word}" for word in re.findall(_WORD, _MAKERS[0].sure)), *re.findall(_WORD, _MAKERS[0].likely))
ENOUGH, SHARE = 2, 0.1  # likely lines: as many at least, and as large a part of all steps
# lines that are no steps: blank ones, comments, headings, and values of variables
_NO_STEP = r"(?im)^[ \t]*(?:;.*|\.[A-Z].*|#?[A-Z][\w.]*(?:\[[\d, ]*\])?(?:[ \t]+[-+.\d][\d.E+-]*)+[ \t]*)?\r?$"
_OURS = r"(?im)^[ \t]*(?:\d+[ \t]+)?(?:MOVES?T?|APPROS?|DEPARTS?)[ \t]+(?!TO\b)[#\w]"  # motions that no other maker has


def foreign_file(text: str) -> Diagnostic | None:
    """Tell of a file that is in another language, judged by all of it, at its first tell-tale line; None for one that
    may be VAL-II.

    Kawasaki's programs begin with .PROGRAM as ours do, others do not.
    """
    makers = _MAKERS
    if has_program(text):  # theirs alone, and it has one of these words
        capitals = text.upper()
        makers = _MAKERS[:1] if any(word in capitals for word in _KAWASAKI) else ()
    for maker in makers:
        sure, likely = _patterns(maker)
        found = [match.start(1) for match in likely.finditer(text)]
        proof = [match.start(1) for match in sure.finditer(text)]
        if (proof or len(found) >= ENOUGH) and _prevails(text, len(found), len(proof)):
            begin = min(found + proof)
            line_begin, end = text.rfind("\n", 0, begin) + 1, text.find("\n", begin)
            line = text[begin : len(text) if end < 0 else end].rstrip()
            column = begin - line_begin + 1
            span = Span(text.count("\n", 0, begin) + 1, column, column + max(len(line), 1))
            return error(CannotInterpret, span, f"this file is in {maker.title}, not in VAL-II", WAY)
    return None


def has_program(text: str) -> bool:
    """Whether a program begins with .PROGRAM."""
    return _program().search(text) is not None


def _prevails(text: str, likely: int, sure: int) -> bool:
    """Whether so many lines of another language make out the file: our own motions are fewer, and of all steps such
    lines are a part that shows, unless it has lines that prove it.
    """
    if len(re.findall(_OURS, text)) > likely + sure:
        return False
    steps = text.count("\n") + 1 - len(re.findall(_NO_STEP, text))
    return sure > 0 or likely >= SHARE * steps


@cache
def _patterns(maker: Maker) -> tuple[re.Pattern[str], re.Pattern[str]]:
    sure, likely = (re.compile(rf"(?im)^[ \t]*(?:\d+[ \t]+)?({one})") for one in (maker.sure, maker.likely))
    return sure, likely


@cache
def _program() -> re.Pattern[str]:
    return re.compile(r"(?im)^[ \t]*\.PROGRAM\b")
