"""Judges the text of a submission and the lines that it typed."""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Iterator, Mapping

from msgspec.structs import replace

from vrs_cli.interfaces.tasks.performing import TypedLine
from vrs_cli.language.analysis.lineage import beyond
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement
from vrs_cli.language.text.printer import statement_text
from vrs_cli.teach.checks import DialectCheck, TypedCheck, TypedText, WordsCheck
from vrs_cli.teach.judging.basis import HALF, JudgedRun
from vrs_cli.teach.verdict import Verdict, exceeds, falls_short, written
from vrs_cli.trajectory.instant import LATEST
from vrs_cli.values.numbers import count

MAX_SHOWN_CHARS = 60

# --- words ---------------------------------------------------------------------------------------------------------


def judge_words(check: WordsCheck, run: JudgedRun) -> Verdict:
    """Judge which words a submission uses, in programs that may run."""
    used = frozenset(word for program in run.evidence.programs for one in program.statements for word in words_of(one))
    missing = [word for word in check.use if not _uses(run.evidence.programs, used, word)]
    wrong = [word for word in check.avoid if _uses(run.evidence.programs, used, word)]
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


def _uses(programs: Iterable[Program], used: Container[str], word: str) -> bool:
    """Return whether programs use a word, or an instruction that begins so: `ENABLE CP`."""
    wanted = " ".join(word.upper().split())
    if " " not in wanted:
        return wanted in used
    statements = (one for program in programs for one in program.statements if not isinstance(one, ast.BadLine))
    return any(f"{statement_text(one).upper()} ".startswith(f"{wanted} ") for one in statements)


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


def judge_dialect(check: DialectCheck, run: JudgedRun) -> Verdict:
    """Judge whether a submission has only what a dialect has."""
    for program in run.evidence.programs:
        for found in beyond(replace(program, dialect=check.dialect)):
            return Verdict(0.0, f"line {found.span.line}: {found.detail}{f' ({found.hint})' if found.hint else ''}")
    return Verdict(1.0, f"all words are of {check.dialect.title}")


# --- typed lines ---------------------------------------------------------------------------------------------------


def judge_typed(check: TypedCheck, run: JudgedRun) -> Verdict:
    """Judge which lines were typed, in which order and when."""
    started, step, place = run.evidence.started, run.s, 0
    typed = tuple(line._replace(t=line.t - started) for line in run.evidence.typed)
    used, lines = set[int](), _wanted_lines(check, run)
    for found, wanted in enumerate(lines):
        place, early = _next_match(typed, place, wanted, step)
        if place < 0:
            share = found / len(lines)
            return Verdict(share, _missing(wanted, found, len(lines), early, step), run.evidence.end)
        used.add(place - 1)
    more = [line for number, line in enumerate(typed) if number not in used] if check.only else []
    if more:
        when = f"at {written(more[0].t, step)} s"
        return Verdict(HALF, f"{shown(more[0].text)} was typed {when}, which is not wanted", started + more[0].t)
    return Verdict(1.0, f"{count(len(lines), 'wanted line')} typed{' in order' if len(lines) > 1 else ''}")


def _wanted_lines(check: TypedCheck, run: JudgedRun) -> list[TypedText]:
    """Return the lines that are wanted. Raises ValueError where those of the model's run are, and are not known."""
    if not check.needs_model:
        return [one for one in check.lines if isinstance(one, TypedText)]
    if run.basis.model is None:
        raise ValueError("the model's run is not known")
    return [TypedText(line.text) for line in run.basis.model.typed]


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
        return f"{shown(other.text)} was typed at {written(other.t, step)} s, it is wanted {' and '.join(bounds)}"
    what = f"a line that fits {shown(wanted.text)}" if wanted.pattern else shown(wanted.text)
    after = "" if not found else f" after the {count(found, 'line')} before it"
    return f"{what} was not typed{after} ({found} of {count(total, 'wanted line')})"


def shown(text: str) -> str:
    """Return a text in quotes, cut where it is long."""
    cut = text.strip() if len(text.strip()) <= MAX_SHOWN_CHARS else f"{text.strip()[: MAX_SHOWN_CHARS - 3]}..."
    return f'"{cut}"'
