"""Judges the end of a run: where the tool and parts are, and whether the program failed."""

from __future__ import annotations

from math import degrees, inf

from vrs_cli.engine.position import position_at
from vrs_cli.kinematics.transform import Transform, added, angle_between, at_position, distance, position
from vrs_cli.teach.checks import NoErrorCheck, PartAtCheck, ToolAtCheck
from vrs_cli.teach.evidence import Evidence
from vrs_cli.teach.judging.basis import HALF, Basis
from vrs_cli.teach.verdict import Verdict, exceeds, written, written_place
from vrs_cli.values.results import RunOutcome
from vrs_cli.world.course import PartState

NEAR = 5.0  # times what is allowed: half the points


def judge_no_error(_check: NoErrorCheck, evidence: Evidence, basis: Basis) -> Verdict:
    """Judge whether the program ended without an error; one that still runs has had none."""
    fault = evidence.fault
    if fault is not None:
        line = f"line {fault.line}: " if fault.line else ""
        return Verdict(0.0, f"the program stopped: {line}{fault.message}", evidence.clock)
    if evidence.outcome in (RunOutcome.ABORTED, RunOutcome.PAUSED, RunOutcome.HALTED):
        when = written(evidence.clock, basis.rounding.s)
        return Verdict(0.0, f"the program did not come to its end: it stopped at {when} s", evidence.clock)
    return Verdict(1.0, "the program ended without an error")


def judge_tool_at(check: ToolAtCheck, evidence: Evidence, basis: Basis) -> Verdict:
    """Judge where the tool is at the end."""
    wanted = basis.place(check.at, None if basis.model is None else _final_tool(basis.model))
    wanted = at_position(wanted, *added(position(wanted), check.offset))
    return _nearness("the tool", _final_tool(evidence), wanted, check, evidence, basis)


def _final_tool(evidence: Evidence) -> Transform:
    return position_at(evidence.arm, evidence.timeline, evidence.end).T_world_tool


def judge_part_at(check: PartAtCheck, evidence: Evidence, basis: Basis) -> Verdict:
    """Judge where a part is at the end; one that still falls, where it comes to lie."""
    in_model = None if basis.model is None else final_part(basis.model, check.part)
    wanted = basis.place(check.at, None if in_model is None else in_model.pose)
    wanted = at_position(wanted, *added(position(wanted), check.offset))
    state = final_part(evidence, check.part)
    if state is None or not state.exists:
        return Verdict(0.0, f"{check.part} was not there at the end", evidence.end)
    verdict = _nearness(check.part, state.pose, wanted, check, evidence, basis)
    if state.held and verdict.share < 1.0:
        return Verdict(verdict.share, f"{verdict.reason}; the hand still holds it", verdict.at)
    return verdict


def final_part(evidence: Evidence, name: str) -> PartState | None:
    """Return a part at the end of a run; None where the cell has no such part."""
    course = evidence.course
    if course is None or name not in course.parts():
        return None
    last = course.spans(name, evidence.end)[-1]
    return course.state(name, max(evidence.end, last.end) if last.end < inf else evidence.end)


def _nearness(
    what: str, found: Transform, wanted: Transform, check: ToolAtCheck | PartAtCheck, evidence: Evidence, basis: Basis
) -> Verdict:
    """Compare a pose with the one that is wanted."""
    step, turn_step = basis.rounding.mm, basis.rounding.deg
    far = 1000.0 * distance(found, wanted)
    place = f"at {written_place(position(found), step)}"
    text = f"{what} ended {written(far, step)} mm from the place, {written(check.mm, step)} mm allowed; {place}"
    share = 1.0
    if exceeds(far, check.mm, step):
        share = HALF if not exceeds(far, NEAR * check.mm, step) else 0.0
    if check.deg is not None:
        off = degrees(angle_between(found, wanted))
        text += (
            f", turned {written(off, turn_step)} deg from what is wanted, {written(check.deg, turn_step)} deg allowed"
        )
        if exceeds(off, check.deg, turn_step):
            share = min(share, HALF if not exceeds(off, NEAR * check.deg, turn_step) else 0.0)
    return Verdict(share, text, evidence.end)
