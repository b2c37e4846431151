"""Judges the text of a submission and the lines that it typed."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from vrs_cli.interfaces.tasks.performing import TypedLine
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement
from vrs_cli.language.text.printer import statement_text
from vrs_cli.teach.checks import TypedCheck, TypedText, WordsCheck
from vrs_cli.teach.evidence import Evidence
from vrs_cli.teach.judging.basis import Basis
from vrs_cli.teach.verdict import Verdict, exceeds, falls_short, written
from vrs_cli.trajectory.instant import LATEST
from vrs_cli.values.numbers import count

MAX_SHOWN_CHARS = 60

# --- words ---------------------------------------------------------------------------------------------------------


def judge_words(check: WordsCheck, evidence: Evidence, _basis: Basis) -> Verdict:
    """Judge which words a submission uses, in programs that may run."""
    missing = [word for word in check.use if not any(uses(one, word) for one in evidence.programs)]
    wrong = [word for word in check.avoid if any(uses(one, word) for one in evidence.programs)]
    reasons = []
    if missing:
        reasons.append(f"the program does not use {_listed(missing)}")
    if wrong:
        reasons.append(f"the program uses {_listed(wrong)}, which it must not use")
    total = len(check.use) + len(check.avoid)
    share = 1.0 - (len(missing) + len(wrong)) / total
    return Verdict(share, "; ".join(reasons) or "the program uses the words that it should")


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def uses(program: Program, word: str) -> bool:
    """Return whether a program uses a word, or an instruction that begins so: `ENABLE CP`."""
    wanted = " ".join(word.upper().split())
    if " " in wanted:
        texts = (statement_text(one).upper() for one in program.statements if not isinstance(one, ast.BadLine))
        return any(text == wanted or text.startswith(f"{wanted} ") for text in texts)
    return any(wanted in words_of(one) for one in program.statements)


_CONTROL: Mapping[type, str] = {
    ast.Goto: "GOTO",
    ast.If: "IF",
    ast.Else: "ELSE",
    ast.While: "WHILE",
    ast.Do: "DO",
    ast.Until: "UNTIL",
    ast.For: "FOR",
    ast.Case: "CASE",
    ast.Value: "VALUE",
    ast.Any: "ANY",
    ast.End: "END",
}


def words_of(statement: Statement) -> Iterator[str]:
    """Yield the words of the language in a statement, in capitals."""
    for node in ast.nodes(statement):
        if isinstance(node, ast.Instruction):
            yield node.word
        elif isinstance(node, ast.Call | ast.BareWord):
            yield (node.name if isinstance(node, ast.Call) else node.text).upper()
        elif isinstance(node, ast.Unary | ast.Binary):
            yield node.operator
        elif isinstance(node, ast.IfGoto):
            yield from ("IF", "THEN" if node.then else "GOTO")
        elif isinstance(node, ast.Modifiers):
            yield from (word for word, given in (("AT", node.at), ("IN", node.within)) if given is not None)
            yield from ("ALWAYS",) if node.always else ()
            yield from (node.unit,) if node.unit else ()
        elif type(node) in _CONTROL:
            yield _CONTROL[type(node)]


# --- typed lines ---------------------------------------------------------------------------------------------------


def judge_typed(check: TypedCheck, evidence: Evidence, basis: Basis) -> Verdict:
    """Judge which lines were typed, in which order and when."""
    step, place, late = basis.rounding.s, 0, None
    for found, wanted in enumerate(check.lines):
        place, early = _next_match(evidence.typed, place, wanted, step)
        if place < 0:
            share = found / len(check.lines)
            return Verdict(share, _missing(wanted, found, len(check.lines), early, step), evidence.clock)
        late = evidence.typed[place - 1].t
    if check.only and len(evidence.typed) > len(check.lines):
        matched = set[int]()
        at = 0
        for wanted in check.lines:
            at, _ = _next_match(evidence.typed, at, wanted, step)
            matched.add(at - 1)
        other = next(line for number, line in enumerate(evidence.typed) if number not in matched)
        when = written(other.t, step)
        return Verdict(0.5, f"{_shown(other.text)} was typed at {when} s, which is not wanted", other.t)
    return Verdict(1.0, f"{count(len(check.lines), 'wanted line')} typed in order", late)


def _next_match(
    typed: tuple[TypedLine, ...], first: int, wanted: TypedText, step: float
) -> tuple[int, TypedLine | None]:
    """Return the number of the line after the next one that is wanted, -1 for none; and a line that would be right at
    another time.
    """
    other: TypedLine | None = None
    for number in range(first, len(typed)):
        line = typed[number]
        if not _matches(line.text, wanted):
            continue
        if not falls_short(line.t, wanted.after, step) and not exceeds(line.t, wanted.before, step):
            return number + 1, None
        other = other or line
    return -1, other


def _matches(text: str, wanted: TypedText) -> bool:
    """Return whether a line is the wanted text, blanks at both ends aside, or fits the pattern as a whole."""
    if wanted.pattern:
        return re.fullmatch(wanted.text, text.strip()) is not None
    return text.strip() == wanted.text.strip()


def _missing(wanted: TypedText, found: int, total: int, other: TypedLine | None, step: float) -> str:
    """Return the reason for a line that was not found."""
    if other is not None:
        bounds = [f"at {written(wanted.after, step)} s or later"] if wanted.after > 0.0 else []
        bounds += [f"by {written(wanted.before, step)} s"] if wanted.before < LATEST else []
        return f"{_shown(other.text)} was typed at {written(other.t, step)} s, it is wanted {' and '.join(bounds)}"
    what = f"a line that fits {_shown(wanted.text)}" if wanted.pattern else _shown(wanted.text)
    after = "" if not found else f" after the {count(found, 'line')} before it"
    return f"{what} was not typed{after} ({found} of {total} wanted lines)"


def _shown(text: str) -> str:
    """Return a text in quotes, cut where it is long."""
    cut = text.strip() if len(text.strip()) <= MAX_SHOWN_CHARS else f"{text.strip()[: MAX_SHOWN_CHARS - 3]}..."
    return f'"{cut}"'
