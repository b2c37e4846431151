"""Judges what the arm, and the part that it holds, touches or comes near."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from vrs_cli.engine.position import position_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import position
from vrs_cli.teach.checks import ClearanceCheck, ContactCheck, Pair
from vrs_cli.teach.judging.basis import HALF, JudgedRun
from vrs_cli.teach.verdict import Verdict, smallest, written
from vrs_cli.values.contacts import Contact
from vrs_cli.values.scene import CellScene

if TYPE_CHECKING:
    from vrs_cli.contacts.checker import Checker

KEPT_CHECKERS = 32  # models of physics that are kept: one for each variant and check


@lru_cache(KEPT_CHECKERS)
def _checker(arm: RobotArm, scene: CellScene, clearance: float, allow: tuple[Pair, ...]) -> Checker:
    from vrs_cli.contacts.checker import Checker

    return Checker(arm, scene, clearance, allow)


def first_contact(run: JudgedRun, clearance: float, allow: tuple[Pair, ...]) -> Contact | None:
    """Return the first contact in the whole run; `clearance` [m]: what comes nearer than that counts as well."""
    from vrs_cli.contacts.stages import stages

    it = run.evidence
    if it.end <= it.started:
        return None
    checker = _checker(it.arm, it.cell.scene, clearance, allow)
    return checker.first_in(it.timeline, stages(it.timeline, it.course, it.started, it.end))


def judge_contact(check: ContactCheck, run: JudgedRun) -> Verdict:
    """Judge whether anything touched that should not.

    Where no motion was told to touch and none was inserted before another, nothing did: each motion was looked at when
    it was commanded. Otherwise the whole run is looked at again, as it was in the end.
    """
    it = run.evidence
    found = None
    if it.contacts or any(record.asked is not None for record in it.commands):
        found = first_contact(run, 0.0, check.allow)
    if found is None:
        return Verdict(1.0, "nothing touched that should not")
    return Verdict(0.0, _said(found, run), found.t)


def judge_clearance(check: ClearanceCheck, run: JudgedRun) -> Verdict:
    """Judge how near things came to the arm."""
    wanted = written(check.mm, run.mm)
    found = first_contact(run, 1e-3 * max(smallest(check.mm, run.mm), 0.0), check.allow)
    if found is None:
        return Verdict(1.0, f"{wanted} mm were kept from everything")
    half = first_contact(run, 1e-3 * HALF * check.mm, check.allow) if not found.depth else found
    return Verdict(0.0 if half is not None else HALF, f"{_said(found, run)}; {wanted} mm are to be kept", found.t)


def _said(contact: Contact, run: JudgedRun) -> str:
    """Return a contact as a reason. Where two faces touch, any place of them may be found: the tip's is told."""
    it = run.evidence
    tip = position(position_at(it.arm, it.timeline, contact.t).T_world_tool)
    when = f"at {written(contact.t, run.s)} s with the tool at {run.said(tip)}"
    names = f"{_article(contact.first)} touched {_article(contact.second)}"
    if contact.depth > 0.0:
        return f"{names} {when}, {written(1000.0 * contact.depth, run.mm)} mm deep"
    return f"{_article(contact.first)} came too near to {_article(contact.second)} {when}"


def _article(name: str) -> str:
    return name if name.startswith("link ") else f"the {name}"
