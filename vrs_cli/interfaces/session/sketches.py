"""Explanations as pictures: WHY, EXPLAIN of a motion and of a chain, and why a typed motion was refused."""

from __future__ import annotations

from itertools import pairwise

from vrs_cli.errors import VrsError
from vrs_cli.kinematics.transform import Vector, along, position, subtracted
from vrs_cli.language.text.ast import DoInstruction, Instruction
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.text.printer import expression_text
from vrs_cli.values.acts import Sketch, SketchBall
from vrs_cli.values.replies import ReachReport
from vrs_cli.values.results import ChainReport, MotionReport, Reach

MOTIONS = frozenset({"MOVE", "MOVES", "MOVET", "MOVEST", "APPRO", "APPROS"})

Drawable = ReachReport | MotionReport | ChainReport


def sketch(report: Drawable) -> Sketch | None:
    """Return the picture of an explanation; None where it has none."""
    if isinstance(report, ReachReport):
        return _sketch_of_reach(report)
    if isinstance(report, MotionReport):
        plan = report.plan
        if plan is None or not plan.path:
            return None
        balls = [SketchBall("end", plan.path[-1], "good")]
        balls += [SketchBall("contact", plan.contact.place, "bad")] if plan.contact is not None else []
        text = f"{report.text}: {plan.begin:.3f} to {plan.end:.3f} s, {1e3 * plan.length:.0f} mm"
        return Sketch(text, plan.path[-1], tuple(pairwise(plan.path)), balls=tuple(balls))
    frames = tuple(factor.product for factor in report.factors)
    return Sketch(f"{report.text}, from the world on", position(frames[-1]), frames=frames) if frames else None


def _sketch_of_reach(report: ReachReport) -> Sketch:
    """The straight line as far as the arm can follow it, and what stops it there."""
    reach = report.reach
    stop = stopping_place(reach)
    balls = [SketchBall("stop", stop, "good" if reach.line.duration is not None else "stop")]
    for word, contact in (("move", report.move_contact), ("line", report.line_contact)):
        if contact is not None:
            balls.append(SketchBall(f"{word}_contact", contact.place, "bad"))
    refused = ((stop, reach.end),) if stop != reach.end else ()
    return Sketch(said(report), stop, ((reach.begin, stop),), refused, tuple(balls))


def stopping_place(reach: Reach) -> Vector:
    """The place at which the tool tip stops on the straight line [m]."""
    line = reach.line
    if line.duration is not None or line.length <= 0.0:
        return reach.end if line.duration is not None else reach.begin
    way = subtracted(reach.end, reach.begin)
    return along(reach.begin, way, min((line.at or 0.0) / line.length, 1.0))


def said(report: ReachReport) -> str:
    """The name of the place, and what there is to say of the line to it."""
    line = report.reach.line
    if line.duration is None:
        return f"{report.name}: {line.trouble}"
    contact = report.line_contact or report.move_contact
    if contact is not None:
        return f"{report.name}: {'MOVES' if report.line_contact else 'MOVE'}: {contact.said('after')}"
    way = "MOVE and MOVES" if report.reach.chosen is not None else "MOVES"
    return f"{report.name}: {way} go there, {1e3 * line.length:.0f} mm in {line.duration:.1f} s"


def place_of(text: str) -> str | None:
    """The goal of a typed motion as an expression; None for what is no motion to a place."""
    try:
        statement = parse_prompt(text)
    except VrsError:
        return None
    it = statement.statement if isinstance(statement, DoInstruction) else statement
    if not isinstance(it, Instruction) or it.word not in MOTIONS or not it.arguments:
        return None
    place, *others = it.arguments
    if place is None:
        return None
    if not (it.word.startswith("APPRO") and others):
        return expression_text(place)
    back = "0" if others[0] is None else expression_text(others[0])  # along the tool's axis
    return f"{expression_text(place)}:TRANS(0, 0, -({back}))"
