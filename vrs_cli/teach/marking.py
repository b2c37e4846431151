"""Mark the evidence of a run: one mark per check. This module reads no file, clock or terminal."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from msgspec import Struct, structs

from vrs_cli.errors import VrsError
from vrs_cli.teach.checks import (
    AccelerationCheck,
    AnyCheck,
    ClearanceCheck,
    ContactCheck,
    CycleTimeCheck,
    DialectCheck,
    HeldCheck,
    KeepOutCheck,
    LikeModelCheck,
    NoErrorCheck,
    NoStopCheck,
    PartAtCheck,
    PathCheck,
    PlacesCheck,
    SignalsCheck,
    SpeedCheck,
    ToolAtCheck,
    TypedCheck,
    WordsCheck,
)
from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.exercise_text import BaseCheck
from vrs_cli.teach.judging.basis import Basis, Evidence, JudgedRun, Verdict, round_to
from vrs_cli.teach.judging.outcomes import (
    judge_clearance,
    judge_contact,
    judge_cycle_time,
    judge_held,
    judge_no_error,
    judge_part_at,
    judge_tool_at,
)
from vrs_cli.teach.judging.outputs import judge_dialect, judge_signals, judge_typed, judge_words
from vrs_cli.teach.judging.state import STATE_JUDGES
from vrs_cli.teach.judging.ways import (
    judge_acceleration,
    judge_keep_out,
    judge_like_model,
    judge_no_stop,
    judge_path,
    judge_places,
    judge_speed,
)

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
    ToolAtCheck: judge_tool_at,
    PartAtCheck: judge_part_at,
    HeldCheck: judge_held,
    PlacesCheck: judge_places,
    PathCheck: judge_path,
    NoStopCheck: judge_no_stop,
    KeepOutCheck: judge_keep_out,
    ContactCheck: judge_contact,
    ClearanceCheck: judge_clearance,
    SpeedCheck: judge_speed,
    AccelerationCheck: judge_acceleration,
    LikeModelCheck: judge_like_model,
    CycleTimeCheck: judge_cycle_time,
    SignalsCheck: judge_signals,
    TypedCheck: judge_typed,
    WordsCheck: judge_words,
    DialectCheck: judge_dialect,
    NoErrorCheck: judge_no_error,
    **STATE_JUDGES,
}


def mark(exercise: Exercise, evidence: Evidence, model: Evidence | None = None) -> tuple[Mark, ...]:
    """Return the marks of a run for an exercise or a variant, in the order of its checks.

    `model`: the evidence of the model solution in the same variant, if `exercise.needs_model`.
    """
    return mark_checks(exercise.checks, evidence, Basis(exercise.rounding, exercise.locations, model))


def mark_checks(checks: Sequence[AnyCheck], evidence: Evidence, basis: Basis) -> tuple[Mark, ...]:
    """Return the marks of some checks. If the run still goes on, a condition not yet met counts as failed."""
    run = JudgedRun(evidence, basis)
    verdicts = {check.name.lower(): _verdict(check, run) for check in checks}
    marks = []
    for check in checks:
        verdict = verdicts[check.name.lower()]
        missing = [name for name in check.needs if name.lower() in verdicts and verdicts[name.lower()].share <= 0.0]
        if missing and verdict.share > 0.0:
            verdict = Verdict(0.0, f"it does not count while {missing[0]!r} earns nothing ({verdict.reason})")
        marks.append(_mark(check, verdict, basis.rounding.s))
    return tuple(marks)


def _verdict(check: AnyCheck, run: JudgedRun) -> Verdict:
    try:
        return JUDGES[type(check)](check, run)
    except (ValueError, VrsError) as error:
        return Verdict(0.0, f"it cannot be checked: {error}")


def _mark(check: AnyCheck, verdict: Verdict, time_step: float) -> Mark:
    share = verdict.share if check.partial or verdict.share >= 1.0 else 0.0
    points = check.points if share >= 1.0 else min(round_to(check.points * share, POINT_STEP), check.points)
    at = None if verdict.at is None else round_to(verdict.at, time_step)
    hint = check.hint if share < 1.0 else ""
    return Mark(check.name, points, check.points, verdict.reason, at, hint, check.hidden)
