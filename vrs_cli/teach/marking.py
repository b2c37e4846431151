"""Mark the evidence of a run: one mark per check. This module reads no file, clock or terminal."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from msgspec import Struct, structs

from vrs_cli.errors import VrsError
from vrs_cli.teach import checks
from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.exercise_text import BaseCheck
from vrs_cli.teach.judging import outcomes, ways
from vrs_cli.teach.judging.basis import Basis, Evidence, JudgedRun, Verdict, round_to
from vrs_cli.teach.judging.outputs import judge_dialect, judge_signals, judge_typed, judge_words
from vrs_cli.teach.judging.state import STATE_JUDGES

POINT_STEP = 0.01


class Mark(Struct, frozen=True):
    """The mark of one check: `points` of `of`, and the reason. `at`: the time that shows the reason [s]; None: no
    single time.

    `hint` is empty if all points were earned.
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

    def for_student(self, number: int) -> Mark:
        """Return the mark as students see it, `number` in the list. A hidden check shows only its points."""
        if not self.hidden:
            return self
        return structs.replace(self, name=f"Hidden check {number}", reason="", at=None, hint="")


JUDGES: Mapping[type[BaseCheck], Callable[[Any, JudgedRun], Verdict]] = {
    checks.ToolAtCheck: outcomes.judge_tool_at,
    checks.PartAtCheck: outcomes.judge_part_at,
    checks.HeldCheck: outcomes.judge_held,
    checks.PlacesCheck: ways.judge_places,
    checks.PathCheck: ways.judge_path,
    checks.NoStopCheck: ways.judge_no_stop,
    checks.KeepOutCheck: ways.judge_keep_out,
    checks.ContactCheck: outcomes.judge_contact,
    checks.ClearanceCheck: outcomes.judge_clearance,
    checks.SpeedCheck: ways.judge_speed,
    checks.AccelerationCheck: ways.judge_acceleration,
    checks.LikeModelCheck: ways.judge_like_model,
    checks.CycleTimeCheck: outcomes.judge_cycle_time,
    checks.SignalsCheck: judge_signals,
    checks.TypedCheck: judge_typed,
    checks.WordsCheck: judge_words,
    checks.DialectCheck: judge_dialect,
    checks.NoErrorCheck: outcomes.judge_no_error,
    **STATE_JUDGES,
}


def mark(exercise: Exercise, evidence: Evidence, model: Evidence | None = None) -> tuple[Mark, ...]:
    """Return the marks of a run for an exercise or a variant, in the order of its checks.

    `model`: the evidence of the model solution in the same variant, if `exercise.needs_model`.
    """
    return mark_checks(exercise.checks, evidence, Basis(exercise.rounding, exercise.locations, model))


def mark_checks(wanted: Sequence[checks.AnyCheck], evidence: Evidence, basis: Basis) -> tuple[Mark, ...]:
    """Return the marks of some checks. If the run still goes on, a condition not yet met counts as failed."""
    run = JudgedRun(evidence, basis)
    verdicts = {check.name.lower(): _verdict(check, run) for check in wanted}
    marks = []
    for check in wanted:
        verdict = verdicts[check.name.lower()]
        missing = [name for name in check.needs if name.lower() in verdicts and verdicts[name.lower()].share <= 0.0]
        if missing and verdict.share > 0.0:
            verdict = Verdict(0.0, f"it does not count while {missing[0]!r} earns nothing ({verdict.reason})")
        marks.append(_mark(check, verdict, basis.rounding.s))
    return tuple(marks)


def _verdict(check: checks.AnyCheck, run: JudgedRun) -> Verdict:
    try:
        return JUDGES[type(check)](check, run)
    except (ValueError, VrsError) as error:
        return Verdict(0.0, f"it cannot be checked: {error}")


def _mark(check: checks.AnyCheck, verdict: Verdict, time_step: float) -> Mark:
    share = verdict.share if check.partial or verdict.share >= 1.0 else 0.0
    points = check.points if share >= 1.0 else min(round_to(check.points * share, POINT_STEP), check.points)
    at = None if verdict.at is None else round_to(verdict.at, time_step)
    hint = check.hint if share < 1.0 else ""
    return Mark(check.name, points, check.points, verdict.reason, at, hint, check.hidden)
