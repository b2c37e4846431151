"""Judge the end of a run, how long it took, its errors, and what the arm touched."""

from __future__ import annotations

from functools import lru_cache
from math import degrees, inf
from typing import TYPE_CHECKING

from vrs_cli.engine.position import position_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform, angle_between, at_position, distance, position, vector_sum
from vrs_cli.teach import checks
from vrs_cli.teach.judging import basis
from vrs_cli.teach.judging.ways import PASSED_MM, did_not_go, windows
from vrs_cli.values.results import RunOutcome
from vrs_cli.values.world import CellScene, Contact
from vrs_cli.world.course import PartState

if TYPE_CHECKING:
    from vrs_cli.contacts.checker import Checker


def judge_tool_at(check: checks.ToolAtCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge where the tool is at the end."""
    model = run.basis.model
    wanted = run.basis.place(check.at, None if model is None else _final_tool(model))
    return _nearness("the tool", _final_tool(run.evidence), wanted, check, run)


def _final_tool(evidence: basis.Evidence) -> Transform:
    return position_at(evidence.arm, evidence.timeline, evidence.end).T_world_tool


def judge_part_at(check: checks.PartAtCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge where a part is at the end. A falling part counts where it comes to rest."""
    evidence, model = run.evidence, run.basis.model
    in_model = None if model is None else final_part(model, check.part)
    wanted = run.basis.place(check.at, None if in_model is None else in_model.pose)
    state = final_part(evidence, check.part)
    if state is None or not state.exists:
        return basis.Verdict(0.0, f"the {check.part} was not there at the end", evidence.end)
    verdict = _nearness(f"the {check.part}", state.pose, wanted, check, run)
    if state.held and verdict.share < 1.0:
        return basis.Verdict(verdict.share, f"{verdict.reason}; the hand still holds it", verdict.at)
    return verdict


def final_part(evidence: basis.Evidence, name: str) -> PartState | None:
    """Return the state of a part at the end of a run; None if the cell has no such part."""
    course = evidence.course
    if course is None or name not in course.parts():
        return None
    last = course.spans(name, evidence.end)[-1]
    return course.state(name, max(evidence.end, last.end) if last.end < inf else evidence.end)


def _nearness(
    what: str, found: Transform, place: Transform, check: checks.ToolAtCheck | checks.PartAtCheck, run: basis.JudgedRun
) -> basis.Verdict:
    """Compare a pose with the required one."""
    wanted = at_position(place, *vector_sum(position(place), check.offset))
    step, turn_step = run.mm, run.basis.rounding.deg
    far, share = 1000.0 * distance(found, wanted), 1.0
    if basis.exceeds(far, check.mm, step):
        share = basis.HALF if not basis.exceeds(far, basis.NEAR * check.mm, step) else 0.0
    text = f"{what} ended {basis.figure(far, step)} mm from the place, {basis.figure(check.mm, step)} mm allowed"
    if check.deg is not None:
        off = degrees(angle_between(found, wanted))
        text += f", turned by {basis.figure(off, turn_step)} deg, {basis.figure(check.deg, turn_step)} deg allowed"
        if basis.exceeds(off, check.deg, turn_step):
            share = min(share, basis.HALF if not basis.exceeds(off, basis.NEAR * check.deg, turn_step) else 0.0)
    return basis.Verdict(share, f"{text}; at {run.place_text(position(found))}", run.evidence.end)


def judge_held(check: checks.HeldCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge what the hand holds at the end."""
    course, end = run.evidence.course, run.evidence.end
    held = "" if course is None else course.held_part(end) or ""
    text = f"the hand holds the {held} at the end" if held else "the hand holds nothing at the end"
    if held == check.part:
        return basis.Verdict(1.0, text, end)
    return basis.Verdict(0.0, f"{text}, {f'the {check.part}' if check.part else 'nothing'} is wanted", end)


ENDED = (RunOutcome.ABORTED, RunOutcome.PAUSED, RunOutcome.HALTED)  # outcomes of programs that did not reach their end


def judge_no_error(_check: checks.NoErrorCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge whether the program ended without an error; a running program has none so far."""
    evidence = run.evidence
    if (wrong := stopped_early(evidence, run.s)) is not None:
        return basis.Verdict(0.0, wrong, evidence.clock)
    return basis.Verdict(1.0, "the program had no error")


def stopped_early(evidence: basis.Evidence, step: float) -> str | None:
    """Describe why a program did not reach its end; return None if it did."""
    fault = evidence.fault
    if fault is not None:
        line = f"in line {fault.line}, {fault.source.strip()}" if fault.line else f"at step {fault.step}"
        return f"the program stopped {line}: {fault.message}"
    if evidence.outcome in ENDED:
        return f"the program did not come to its end: it stopped at {basis.figure(evidence.clock, step)} s"
    return None


def judge_cycle_time(check: checks.CycleTimeCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge how long a run took until the arm stood, or the fastest way from one place to another."""
    if check.begin is not None and check.end is not None:
        a, b = run.basis.point(check.begin), run.basis.point(check.end)
        if not (found := windows(run, a, b, PASSED_MM)):
            return did_not_go(run, a, b, PASSED_MM)
        begin, end = min(found, key=lambda one: one[1] - one[0])
        what = f"the way from {run.place_text(a)} to {run.place_text(b)}"
        return _time_verdict(what, end - begin, begin, check, run.s)
    evidence, step = run.evidence, run.s
    if (wrong := stopped_early(evidence, step)) is not None:
        return basis.Verdict(0.0, wrong, evidence.clock)
    seconds = max(evidence.clock, evidence.timeline.end) - evidence.started
    return _time_verdict("the run", seconds, evidence.started, check, step)


def _time_verdict(
    what: str, seconds: float, started: float, check: checks.CycleTimeCheck, step: float
) -> basis.Verdict:
    took = f"{what} took {basis.figure(seconds, step)} s"
    text = f"{took}, {basis.figure(check.most, step)} s allowed"
    if basis.falls_short(seconds, check.least, step):
        return basis.Verdict(0.0, f"{took}, at least {basis.figure(check.least, step)} s is wanted")
    if not basis.exceeds(seconds, check.most, step):
        return basis.Verdict(1.0, text)
    return basis.Verdict(
        basis.HALF if not basis.exceeds(seconds, basis.MORE * check.most, step) else 0.0, text, started + check.most
    )


@lru_cache(32)
def _checker(arm: RobotArm, scene: CellScene, clearance: float, allow: tuple[checks.Pair, ...]) -> Checker:
    from vrs_cli.contacts.checker import Checker

    return Checker(arm, scene, clearance, allow)


def first_contact(run: basis.JudgedRun, clearance: float, allow: tuple[checks.Pair, ...]) -> Contact | None:
    """Return the first contact in the whole run. `clearance` [m]: closer approaches count as contacts."""
    from vrs_cli.contacts.sweep import stages

    it = run.evidence
    if it.end <= it.started:
        return None
    checker = _checker(it.arm, it.cell.scene, clearance, allow)
    return checker.first_in(it.timeline, stages(it.timeline, it.course, it.started, it.end))


def judge_contact(check: checks.ContactCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge whether anything touched that should not.

    Each motion was checked when it was commanded. If no contact was reported and no motion was inserted before
    another, there was none. Otherwise the final run is checked again.
    """
    it = run.evidence
    found = None
    if it.contacts or any(record.asked is not None for record in it.commands):
        found = first_contact(run, 0.0, check.allow)
    if found is None:
        return basis.Verdict(1.0, "nothing touched that should not")
    return basis.Verdict(0.0, _contact_text(found, run), found.t)


def judge_clearance(check: checks.ClearanceCheck, run: basis.JudgedRun) -> basis.Verdict:
    """Judge how close things came to the arm."""
    wanted = basis.figure(check.mm, run.mm)
    found = first_contact(run, 1e-3 * max(basis.smallest(check.mm, run.mm), 0.0), check.allow)
    if found is None:
        return basis.Verdict(1.0, f"{wanted} mm were kept from everything")
    half = first_contact(run, 1e-3 * basis.HALF * check.mm, check.allow) if not found.depth else found
    reason = f"{_contact_text(found, run)}; {wanted} mm are to be kept"
    return basis.Verdict(0.0 if half is not None else basis.HALF, reason, found.t)


def _contact_text(contact: Contact, run: basis.JudgedRun) -> str:
    """Describe a contact. Two touching faces have many contact points, so the text names the position of the tip."""
    it = run.evidence
    tip = position(position_at(it.arm, it.timeline, contact.t).T_world_tool)
    when = f"at {basis.figure(contact.t, run.s)} s with the tool at {run.place_text(tip)}"
    names = f"{_article(contact.first)} touched {_article(contact.second)}"
    if contact.depth > 0.0:
        return f"{names} {when}, {basis.figure(1000.0 * contact.depth, run.mm)} mm deep"
    return f"{_article(contact.first)} came too near to {_article(contact.second)} {when}"


def _article(name: str) -> str:
    return name if name.startswith("link ") else f"the {name}"
