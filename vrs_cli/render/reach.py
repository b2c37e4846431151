"""WHY as blocks: the configurations of a location, what MOVE would choose, and the straight line from here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import zip_longest

from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.words.values import numbers_of
from vrs_cli.render.blocks import Block, Column, Grid, Page, joint_names, number_columns, told
from vrs_cli.render.colours import Ink
from vrs_cli.values.numbers import fixed, seconds
from vrs_cli.values.replies import ReachReport
from vrs_cli.values.results import LineCheck, Option, Overrun, WayOut


def reach_report(reply: ReachReport, page: Page) -> Iterator[Block]:
    reach = reply.reach
    options = reach.options or ((reach.goal,) if reach.goal else ())
    joints = max((len(option.joints) for option in options if option.joints), default=0)
    columns = (
        Column("Configuration", Ink.NAME),
        Column("Reach", width=8),
        *number_columns(*joint_names(joints), width=9),
    )
    rows = tuple(
        (
            str(option.configuration) or "-",
            verdict(option, reply.units),
            *(map(fixed, numbers_of(option.joints, reply.units)) if option.joints else ("",) * joints),
        )
        for option in options
    )
    yield Grid(columns, rows, boxed=True, keys=1)
    if reach.chosen is not None:
        yield from told(f"MOVE: {'; '.join(filter(None, (str(reach.chosen), reach.reason)))}", Ink.NOTE, page)
    elif reach.line.trouble == reach.reason:
        yield from told(f"MOVE, MOVES: {reach.reason}", Ink.ERROR, page)
        return
    else:
        yield from told(f"MOVE: {reach.reason}", Ink.ERROR, page)
    yield from _line_check(reach.line, page)
    for word, contact in (("MOVE", reply.move_contact), ("MOVES", reply.line_contact)):
        if contact is not None:
            yield from told(f"{word}: {contact.said('after')}", Ink.ERROR, page)


def verdict(option: Option, units: JointUnits) -> str:
    """Say that a location is in reach, which joints leave their range by how much, or how far away it is."""
    if option.usable:
        return "in reach"
    if option.joints is not None:
        return _overruns(option.overruns, units)
    if option.too_far is None:
        return "out of reach"
    return f"{1e3 * abs(option.too_far):.1f} mm too {'far' if option.too_far > 0.0 else 'close'}"


def _overruns(overruns: Sequence[Overrun], units: JointUnits) -> str:
    """By how much joints leave their range; the unit stands once for joints that follow one another."""
    told = []
    for this, after in zip_longest(overruns, overruns[1:]):
        unit = units.unit(this.joint)
        last = after is None or units.unit(after.joint) != unit
        told.append(f"JT{this.joint} {units.one_shown(this.joint, this.by):+.1f}" + (f" {unit}" if last else ""))
    return ", ".join(told)


def _line_check(check: LineCheck, page: Page) -> Iterator[Block]:
    way = f"{1e3 * check.length:.1f} mm"
    if check.duration is not None:
        stops = " and ".join(f"{1e3 * stop:.1f} mm" for stop in check.stops)
        rests = f"; it stops after {stops}, where joints turn back at once, and goes on" if stops else ""
        yield from told(f"MOVES: {way} in {seconds(check.duration)}{rests}", Ink.NOTE, page)
        return
    at = ""
    if check.at is not None and check.length > 0.0:
        at = f" after {1e3 * check.at:.1f} of {way} ({100.0 * check.at / check.length:.0f} %)"
    yield from told(f"MOVES: stops{at}: {check.trouble}" if at else f"MOVES: {check.trouble}", Ink.ERROR, page)
    for out in check.ways_out:
        yield from told(_way_out(out), Ink.NOTE, page)


def _way_out(out: WayOut) -> str:
    if out.words:
        words = " ".join(out.words)
        return f"Instead: the same line {words}; say {words} and MOVE to where it starts first"
    if out.via is not None:
        numbers = ", ".join(f"{round(number, 1):g}" for number in numbers_of(out.via))
        return f"Instead: MOVES TRANS({numbers}) first"
    return "Instead: MOVE, on another path"
