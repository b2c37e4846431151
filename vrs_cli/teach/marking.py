"""Marks for the evidence of a run: one for each check. Reads no file, clock or terminal."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from msgspec import Struct

from vrs_cli.teach.check_kind import BaseCheck
from vrs_cli.teach.checks import AnyCheck, NoErrorCheck, PartAtCheck, ToolAtCheck, TypedCheck, WordsCheck
from vrs_cli.teach.evidence import Evidence
from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.judging.basis import Basis
from vrs_cli.teach.judging.ends import judge_no_error, judge_part_at, judge_tool_at
from vrs_cli.teach.judging.state import STATE_JUDGES
from vrs_cli.teach.judging.texts import judge_typed, judge_words
from vrs_cli.teach.verdict import Verdict, rounded

POINT_STEP = 0.01


class Mark(Struct, frozen=True):
    """The mark of one check: `points` of `of`, in words why, and `at` the time that shows it [s] (None: no one time).
    `hint` is empty where all points were earned.
    """

    name: str
    points: float
    of: float
    reason: str
    at: float | None = None
    hint: str = ""
    hidden: bool = False

    @property
    def passed(self) -> bool:
        """Return whether all points were earned."""
        return self.points == self.of


JUDGES: Mapping[type[BaseCheck], Callable[[Any, Evidence, Basis], Verdict]] = {
    ToolAtCheck: judge_tool_at,
    PartAtCheck: judge_part_at,
    NoErrorCheck: judge_no_error,
    TypedCheck: judge_typed,
    WordsCheck: judge_words,
    **STATE_JUDGES,
}


def mark(exercise: Exercise, evidence: Evidence, model: Evidence | None = None) -> tuple[Mark, ...]:
    """Return the marks of a run for an exercise, or for a variant of it, in the order of its checks. `model`: the
    evidence of the model solution in the same variant, where `exercise.needs_model`.
    """
    return mark_checks(exercise.checks, evidence, Basis(exercise.rounding, exercise.locations, model))


def mark_checks(checks: Sequence[AnyCheck], evidence: Evidence, basis: Basis) -> tuple[Mark, ...]:
    """Return the marks of some checks. A run may still go on: what has not happened yet fails."""
    return tuple(_mark(check, evidence, basis) for check in checks)


def _mark(check: AnyCheck, evidence: Evidence, basis: Basis) -> Mark:
    try:
        verdict = JUDGES[type(check)](check, evidence, basis)
    except ValueError as error:
        verdict = Verdict(0.0, f"it cannot be checked: {error}")
    share = verdict.share if check.partial or verdict.share >= 1.0 else 0.0
    points = check.points if share >= 1.0 else min(rounded(check.points * share, POINT_STEP), check.points)
    at = None if verdict.at is None else rounded(verdict.at, basis.rounding.s)
    hint = check.hint if share < 1.0 else ""
    return Mark(check.name, points, check.points, verdict.reason, at, hint, check.hidden)
