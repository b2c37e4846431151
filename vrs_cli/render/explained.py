"""Lay out the replies of EXPLAIN and WHY as blocks. Formulas and matrices are text on a terminal, and LaTeX in a
notebook."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import zip_longest
from math import degrees, hypot
from typing import Any

from vrs_cli.kinematics.joints import Configuration, JointUnits
from vrs_cli.kinematics.transform import Transform, compose
from vrs_cli.language.words.values import numbers_of
from vrs_cli.render import blocks, plain
from vrs_cli.render.colours import Ink
from vrs_cli.render.symbols import FAMILIES, SIGN, Family, Stage, Symbol, latex, latex_name
from vrs_cli.values import replies, reports
from vrs_cli.values.numbers import count, decimal, seconds


def reach_report(reply: replies.ReachReport, page: blocks.Page) -> Iterator[blocks.Block]:
    reach = reply.reach
    options = reach.options or ((reach.goal,) if reach.goal else ())
    joints = max((len(option.joints) for option in options if option.joints), default=0)
    yield _options([(option, ()) for option in options], joints, reply.units)
    if reach.chosen is not None:
        yield from blocks.wrap_lines(
            f"MOVE: {'; '.join(filter(None, (str(reach.chosen), reach.reason)))}", Ink.NOTE, page
        )
    elif reach.line.trouble == reach.reason:
        yield from blocks.wrap_lines(f"MOVE, MOVES: {reach.reason}", Ink.ERROR, page)
        return
    else:
        yield from blocks.wrap_lines(f"MOVE: {reach.reason}", Ink.ERROR, page)
    yield from _line_check(reach.line, page)
    for word, contact in (("MOVE", reply.move_contact), ("MOVES", reply.line_contact)):
        if contact is not None:
            yield from blocks.wrap_lines(f"{word}: {contact.describe('after')}", Ink.ERROR, page)


def _options(
    rows: Iterable[tuple[reports.Option, tuple[str, ...]]], joints: int, units: JointUnits, more: Sequence[str] = ()
) -> blocks.Grid:
    """Return a grid with the configurations, their reach and their joints. `more`: the headings of additional columns,
    whose cells are in `rows`."""
    columns = (
        blocks.Column("Configuration", Ink.NAME),
        blocks.Column("Reach", width=8),
        *blocks.number_columns(*more, width=8),
        *blocks.number_columns(*blocks.joint_names(joints), width=9),
    )
    shown = tuple(
        (
            str(option.configuration) or "-",
            verdict(option, units),
            *numbers,
            *(map(decimal, numbers_of(option.joints, units)) if option.joints else ("",) * joints),
        )
        for option, numbers in rows
    )
    return blocks.Grid(columns, shown, boxed=True, keys=1)


def verdict(option: reports.Option, units: JointUnits) -> str:
    """Return "in reach", or which joints leave their ranges and by how much, or how much too far or too close a
    location is."""
    if option.usable:
        return "in reach"
    if option.joints is not None:
        return _overruns(option.overruns, units)
    if option.too_far is None:
        return "out of reach"
    return f"{1e3 * abs(option.too_far):.1f} mm too {'far' if option.too_far > 0.0 else 'close'}"


def _overruns(overruns: Sequence[reports.Overrun], units: JointUnits) -> str:
    """Describe by how much joints leave their ranges. If neighbouring joints have the same unit, only the last of these
    joints shows it."""
    parts = []
    for this, after in zip_longest(overruns, overruns[1:]):
        unit = units.unit(this.joint)
        last = after is None or units.unit(after.joint) != unit
        parts.append(f"JT{this.joint} {units.one_shown(this.joint, this.by):+.1f}" + (f" {unit}" if last else ""))
    return ", ".join(parts)


def _line_check(check: reports.LineCheck, page: blocks.Page) -> Iterator[blocks.Block]:
    way = f"{1e3 * check.length:.1f} mm"
    if check.duration is not None:
        stops = " and ".join(f"{1e3 * stop:.1f} mm" for stop in check.stops)
        rests = f"; it stops after {stops}, where joints turn back at once, and goes on" if stops else ""
        yield from blocks.wrap_lines(f"MOVES: {way} in {seconds(check.duration)}{rests}", Ink.NOTE, page)
        return
    at = ""
    if check.at is not None and check.length > 0.0:
        at = f" after {1e3 * check.at:.1f} of {way} ({100.0 * check.at / check.length:.0f} %)"
    yield from blocks.wrap_lines(
        f"MOVES: stops{at}: {check.trouble}" if at else f"MOVES: {check.trouble}", Ink.ERROR, page
    )
    for out in check.ways_out:
        yield from blocks.wrap_lines(_way_out(out), Ink.NOTE, page)


def _way_out(out: reports.WayOut) -> str:
    if out.words:
        words = " ".join(out.words)
        return f"Instead: the same line {words}; say {words} and MOVE to where it starts first"
    if out.via is not None:
        numbers = ", ".join(f"{round(number, 1):g}" for number in numbers_of(out.via))
        return f"Instead: MOVES TRANS({numbers}) first"
    return "Instead: MOVE, on another path"


# a quantity above this fraction of its limit counts as limited by it, because lines are planned with a margin
BINDS = 0.95
ROUNDING = 1e-9  # [rad] a smaller angle counts as zero
NEAR_END = 1.0  # [deg, mm] a joint that is closer than this to an end of its range counts as at the end
SCALES = {"mm": 1e3, "mm2": 1e6, "deg": degrees(1.0), "": 1.0}
NOTHING = 5e-4  # a load below this fraction of its limit is shown as zero, without a time
ENTRY = 9  # number of characters of a matrix element
PLAIN_WIDTH = 100  # characters per row of matrices if the page does not set a width


def formula(text: str, written: str = "") -> blocks.TextLine:
    """Return a line with a formula. `written`: the formula as LaTeX, which must be given if the formula contains names
    that a user chose."""
    return blocks.TextLine(((f"    {text}", Ink.TEXT),), written or latex(text))


def matrices(
    named: Sequence[tuple[str, Transform]], page: blocks.Page, *, turns: bool = False
) -> Iterator[blocks.Grid]:
    """Yield named matrices side by side, as many as fit; positions are in mm. `turns`: show only the rotations."""
    row = list(named[:1])
    for one in named[1:]:
        if sum(_beside([*row, one], turns).widths()) <= (page.width or PLAIN_WIDTH):
            row.append(one)
        else:
            yield _beside(row, turns)
            row = [one]
    yield _beside(row, turns)


def _beside(named: Sequence[tuple[str, Transform]], turns: bool) -> blocks.Grid:
    columns, formulas = list[blocks.Column](), list[str]()
    rows: tuple[list[str], ...] = ([], [], [])
    for name, T in named:
        columns += [
            blocks.Column("", Ink.NAME, right=True, width=len(name) + 4),
            *blocks.number_columns("", "", "", width=ENTRY),
        ]
        columns += () if turns else blocks.number_columns("", width=ENTRY)
        numbers = [[*T[i : i + 3], *(() if turns else (1e3 * T[i + 3],))] for i in (0, 4, 8)]
        for i, cells in enumerate(numbers):
            rows[i].extend([f"{name} =" if i == 1 else "", *map(decimal, cells)])
        body = [" & ".join(map(decimal, cells)) for cells in numbers] + ([] if turns else ["0 & 0 & 0 & 1"])
        formulas.append(rf"{latex_name(name)} = \begin{{bmatrix}}" + r" \\ ".join(body) + r"\end{bmatrix}")
    return blocks.Grid(tuple(columns), tuple(map(tuple, rows)), tight=True, latex=r" \quad ".join(formulas))


# --- the overview ----------------------------------------------------------------------------------------------------


def _overview(reply: replies.ExplainOverview, _page: blocks.Page) -> Iterator[blocks.Block]:
    rows = tuple((f"EXPLAIN {row.form}", row.summary) for row in reply.rows)
    yield blocks.Grid((blocks.Column("", Ink.COMMAND), blocks.Column("", fold=True)), rows)


# --- a motion --------------------------------------------------------------------------------------------------------


def _motion(reply: replies.MotionReport, page: blocks.Page) -> Iterator[blocks.Block]:
    plan, units = reply.plan, reply.units
    if plan is None:
        yield from blocks.wrap_lines(f"{reply.text}: {reply.refusal}", Ink.ERROR, page)
        return
    yield blocks.line(
        f"{reply.text} begins at {decimal(plan.begin)}, ends at {decimal(plan.end)}: {seconds(plan.end - plan.begin)}"
    )
    yield from blocks.wrap_lines(_how(plan), Ink.NOTE, page)
    rows = tuple(
        (
            stretch.phase,
            decimal(stretch.start),
            decimal(stretch.finish),
            decimal(stretch.finish - stretch.start),
            decimal(1e3 * stretch.speed, 1),
            decimal(degrees(stretch.turn), 1),
            f"JT{stretch.joint} {100.0 * stretch.share:.0f} %" if stretch.joint else "",
        )
        for stretch in plan.stretches
    )
    headings = blocks.number_columns("t_s", "t_f", "lasts", "tip mm/s", "turn deg/s", width=8)
    yield blocks.Grid((blocks.Column("Phase"), *headings, blocks.Column("Fastest joint", right=True)), rows, keys=1)
    if plan.space != "rest":
        yield _loads(plan.loads, units)
        for text in _bindings(plan, units):
            yield from blocks.wrap_lines(text, Ink.NOTE, page)
    yield blocks.line(
        f"The way of the tool tip is {1e3 * plan.length:.1f} mm; it ends {str(plan.configuration) or 'at'}:".strip()
    )
    for names, numbers in (
        (blocks.POSE, numbers_of(plan.T_world_tool)),
        (blocks.joint_names(len(plan.joints)), numbers_of(plan.joints, units)),
    ):
        yield blocks.Grid(blocks.number_columns(*names), (tuple(map(decimal, numbers)),), tight=True)
    if plan.displaced is not None:
        for text in plain.sentences(plan.displaced):
            yield from blocks.wrap_lines(text, Ink.WARNING, page)
    for text in plan.notes:
        yield from blocks.wrap_lines(text, Ink.WARNING, page)


SPACES = {"joint": "joint-interpolated", "straight": "a straight line", "rest": "standing still"}


def _how(plan: replies.MotionPlan) -> str:
    speeds = f"speed {100.0 * plan.speed:g} %, acceleration {100.0 * plan.acceleration:g} %"
    how, cut = f"{SPACES.get(plan.space, plan.space)}, profile {plan.profile}, {speeds}", plan.cut
    if cut is None:
        return f"{how}; from rest"
    since = f"{decimal(plan.begin - cut.since)} s after that has begun"
    return f"{how}; it cuts {cut.number} {cut.text} in {cut.phase}, {since}, the tip at {1e3 * cut.speed:.1f} mm/s"


def _loads(loads: Sequence[replies.JointLoad], units: JointUnits) -> blocks.Grid:
    """Return a grid with the peaks of each joint: value, fraction of the limit, and time."""
    rates = ("velocity", "acceleration", *(("jerk",) if any(load.jerk is not None for load in loads) else ()))
    columns = [blocks.Column("Joint", Ink.NAME)]
    for name in rates:
        columns += blocks.number_columns(name, "of limit", "at", width=8)
    columns += blocks.number_columns("end of range", "room", "at", width=8)
    rows = list[tuple[str, ...]]()
    for load in loads:
        row, unit = [f"JT{load.joint} {units.unit(load.joint)}"], load.joint
        for name in rates:
            peak: replies.Peak = getattr(load, name)
            when = decimal(peak.time) if peak.share >= NOTHING else ""
            row += [decimal(units.one_shown(unit, peak.value), 1), f"{100.0 * peak.share:.1f} %", when]
        nearest = load.nearest
        row += [
            decimal(units.one_shown(unit, nearest.limit), 1),
            decimal(units.one_shown(unit, load.room), 1),
            decimal(nearest.time),
        ]
        rows.append(tuple(row))
    return blocks.Grid(tuple(columns), tuple(rows), keys=1)


def _bindings(plan: replies.MotionPlan, units: JointUnits) -> Iterator[str]:
    """Describe which limits the motion reaches (binding limits), and where on the path."""
    found = list[tuple[str, replies.Peak]]()
    for load in plan.loads:
        for name, peak in (("velocity", load.velocity), ("acceleration", load.acceleration), ("jerk", load.jerk)):
            if peak is not None and peak.share >= BINDS:
                found.append((f"{name} of JT{load.joint}, {100.0 * peak.share:.1f} % of its limit", peak))
        if units.one_shown(load.joint, load.room) < NEAR_END:
            end, unit = units.one_shown(load.joint, load.nearest.limit), units.unit(load.joint)
            found.append((f"range of JT{load.joint}, near its end {end:.1f} {unit}", load.nearest))
    tip = plan.tip
    of_tip = f"speed of the tool tip, {1e3 * tip.value:.1f} of {1e3 * tip.limit:.1f} mm/s"
    if tip.limit and tip.share >= BINDS:
        found.append((of_tip, tip))
    elif tip.limit:
        yield f"Greatest {of_tip}"
    for what, peak in found:
        x, y, z = (1e3 * one for one in peak.place)
        yield f"Binds: {what}, at {seconds(peak.time)}, X {x:z.1f} Y {y:z.1f} Z {z:z.1f} mm"
    if not found:
        yield "No limit binds"


# --- locations -------------------------------------------------------------------------------------------------------


def _chain(reply: replies.ChainReport, page: blocks.Page) -> Iterator[blocks.Block]:
    factors = reply.factors
    if len(factors) > 1:
        yield _product("T", [one.name for one in factors])
    yield _factors(factors)
    if reply.joints:
        numbers = map(decimal, numbers_of(reply.joints, reply.units))
        yield blocks.Grid(blocks.number_columns(*blocks.joint_names(len(reply.joints))), (tuple(numbers),), tight=True)
    shown = [(one.name, one.T) for one in factors]
    yield from matrices([*shown, ("T", factors[-1].product)] if len(factors) > 1 else shown, page)
    if reply.arm:
        yield blocks.line("As a goal of the tool it asks this of the flange:", Ink.NOTE)
        yield _product("T6", [one.name for one in reply.arm])
        yield _factors(reply.arm)
        yield from matrices([("T6", reply.arm[-1].product)], page)


def _product(name: str, names: Sequence[str]) -> blocks.TextLine:
    return formula(f"{name} = {' '.join(names)}", f"{latex(name)} = " + r"\,".join(map(latex_name, names)))


def _factors(factors: Sequence[replies.Factor]) -> blocks.Grid:
    """Return a grid with each factor, and the product of all factors up to this one."""
    rows = list[tuple[str, ...]]()
    for place, factor in enumerate(factors):
        rows.append((factor.name, f"{factor.inner} in {factor.outer}", *map(decimal, numbers_of(factor.T))))
        if place:
            rows.append(
                ("  product", f"{factor.inner} in {factors[0].outer}", *map(decimal, numbers_of(factor.product)))
            )
    return blocks.Grid(
        (blocks.Column("Factor", Ink.NAME), blocks.Column("Frame"), *blocks.number_columns(*blocks.POSE)),
        tuple(rows),
        keys=2,
    )


def _angles(reply: replies.AnglesReport, page: blocks.Page) -> Iterator[blocks.Block]:
    T, (Rz_O, M, Ry_A, Rz_T) = reply.T, reply.turns
    columns = (blocks.Column("", Ink.NAME), *blocks.number_columns(*blocks.POSE))
    yield blocks.Grid(columns, ((reply.text, *map(decimal, numbers_of(T))),), keys=1)
    for text in (
        "O turns about the vertical: it says to which side the tool points, 0 is along -Y",
        "A turns about the new Y of the tool: it says how far the tool points down, 90 is straight down",
        "T turns about Z of the tool, the approach axis",
    ):
        yield blocks.line(text, Ink.NOTE)
    yield formula("R = [n s a] = Rz(O) M Ry(A) Rz(T)")
    yield blocks.line("M is the tool with all angles 0: it points along -Y of the world, with its Y along X.", Ink.NOTE)
    yield from matrices([("Rz(O)", Rz_O), ("M", M), ("Ry(A)", Ry_A), ("Rz(T)", Rz_T)], page, turns=True)
    first = compose(Rz_O, M)
    second = compose(first, Ry_A)
    yield from matrices([("Rz(O) M", first), ("Rz(O) M Ry(A)", second), ("R", compose(second, Rz_T))], page, turns=True)
    yield blocks.line("Back from the matrix:", Ink.NOTE)
    if reply.vertical:
        vertical = "The tool is vertical: O and T turn about one axis, and only their sum or difference counts. "
        yield from blocks.wrap_lines(f"{vertical}O is taken as 90, and T is the rest.", Ink.WARNING, page)
        yield formula("T = atan2(ny, sy)")
    else:
        yield formula(f"O = atan2(ax, -ay) = atan2({decimal(T.ax)}, {decimal(-T.ay)})")
        yield formula(f"A = atan2(-az, sqrt(ax^2 + ay^2)) = atan2({decimal(-T.az)}, {decimal(hypot(T.ax, T.ay))})")
        yield formula(f"T = atan2(sz, -nz) = atan2({decimal(T.sz)}, {decimal(-T.nz)})")
    o, a, t = map(degrees, reply.angles)
    yield blocks.line(
        f"V+ says the same as yaw O - 90 = {decimal(o - 90.0)}, pitch A + 90 = {decimal(a + 90.0)}, "
        f"roll T = {decimal(t)}.",
        Ink.NOTE,
    )


# --- inverse kinematics ----------------------------------------------------------------------------------------------


def _inverse(reply: replies.InverseReport, page: blocks.Page) -> Iterator[blocks.Block]:
    yield _product("T6", ("BASE", reply.text, "TOOL^-1"))
    yield from matrices([("T6", reply.T_robot_flange)], page)
    family = FAMILIES.get(reply.method)
    if family is None:
        yield blocks.line(f"The joints are found by a search, not by formulas: {reply.method}", Ink.NOTE)
    else:
        yield from _formulas(reply, family, page)
    rows = ((one.option, ("" if one.time is None else decimal(one.time),)) for one in reply.solutions)
    yield _options(rows, len(reply.here), reply.units, ("from here s",))
    if reply.chosen is not None:
        way = f"MOVE from here ({str(reply.have) or 'one configuration'}) takes "
        yield from blocks.wrap_lines(way + "; ".join(filter(None, (str(reply.chosen), reply.reason))), Ink.NOTE, page)
    else:
        yield from blocks.wrap_lines(f"MOVE: {reply.reason}", Ink.ERROR, page)


def _formulas(reply: replies.InverseReport, family: Family, page: blocks.Page) -> Iterator[blocks.Block]:
    known = [(family.symbols[name], value) for name, value in reply.constants.items() if name in family.symbols]
    shown = (f"{one.name} = {decimal(SCALES[one.unit] * value)} {one.unit}".rstrip() for one, value in known)
    yield from blocks.wrap_lines(", ".join(shown), Ink.NOTE, page)
    for number, stage in enumerate(family.stages, 1):
        yield from blocks.wrap_lines(f"{number}. {stage.title}", Ink.HEADING, page)
        for text in stage.formulas:
            yield formula(text)
        yield _values(stage, family, reply.solutions)
    if reply.senses:
        said = (_sense(i, sign, zero) for i, (sign, zero) in enumerate(reply.senses, 1))
        yield from blocks.wrap_lines(f"The joints of this robot: {', '.join(said)}, and whole turns.", Ink.NOTE, page)


def _sense(i: int, sign: float, zero: float) -> str:
    """Return the equation that converts joint `i` of the formulas to the joint of the robot."""
    theta = (
        f"theta{i}"
        if abs(zero) < ROUNDING
        else f"theta{i} {'-' if zero > 0.0 else '+'} {decimal(degrees(abs(zero)), 1)}"
    )
    return f"JT{i} = {theta}" if sign > 0.0 else f"JT{i} = -({theta})"


def _values(stage: Stage, family: Family, solutions: Sequence[replies.SolutionSteps]) -> blocks.Grid:
    """Return a grid with the values of a stage, with one row for all configurations that have equal values."""
    symbols = [family.symbols[name] for name in stage.values]
    rows = dict[tuple[str, ...], list[Configuration]]()
    for solution in solutions:
        values = [solution.steps.get(name) for name in stage.values]
        cells = (_value_text(one, x) for one, x in zip(symbols, values, strict=True))
        rows.setdefault(tuple(cells), []).append(solution.option.configuration)
    headings = (one.name if one.unit == SIGN else f"{one.name} {one.unit}".rstrip() for one in symbols)
    every = [solution.option.configuration for solution in solutions]
    shown = tuple((_which(ways, every), *cells) for cells, ways in rows.items())
    return blocks.Grid(
        (blocks.Column("Configuration", Ink.NAME), *blocks.number_columns(*headings, width=8)), shown, keys=1
    )


def _value_text(symbol: Symbol, value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:+.0f}" if symbol.unit == SIGN else decimal(SCALES[symbol.unit] * value)


def _which(ways: Sequence[Configuration], every: Sequence[Configuration]) -> str:
    """Return the shortest text that distinguishes these configurations from all others in `every`."""
    if len(ways) == len(every):
        return "all"
    found = dict[str, None]()
    for way in ways:
        parts = (way.flags[:1], way.flags[:2], way.flags)
        shortest = next(part for part in parts if all(one in ways for one in every if one.flags[: len(part)] == part))
        found[" ".join(flag.name for flag in shortest if flag is not None)] = None
    return ", ".join(found)


# --- the last change -------------------------------------------------------------------------------------------------


def _splice(reply: replies.SpliceReport, page: blocks.Page) -> Iterator[blocks.Block]:
    what = f"{reply.cause} of {reply.text}" if reply.cause else reply.text
    yield from blocks.wrap_lines(
        f"{what}: issued at {decimal(reply.issued)}, executed at {decimal(reply.executed)}; what was planned after "
        f"{seconds(reply.cut)} gave way",
        Ink.NOTE,
        page,
    )
    if reply.earlier:
        yield blocks.line(f"{count(reply.earlier, 'segment')} before these stay as they are", Ink.NOTE)
    rows = tuple(
        (row.fate.value, *_times(row.before), *_times(row.after), row.phase, f"{row.number} {row.text}")
        for row in reply.rows
    )
    times = blocks.number_columns("t_s before", "t_f before", "t_s after", "t_f after")
    yield blocks.Grid(
        (blocks.Column("", Ink.NAME), *times, blocks.Column("Phase"), blocks.Column("Command", cut=True)), rows, keys=1
    )
    if reply.later:
        moved = f"are shifted by {decimal(reply.shift)} s too" if reply.shift else "stay as they are"
        yield blocks.line(f"{count(reply.later, 'segment')} after these {moved}", Ink.NOTE)
    if reply.shift:
        yield blocks.line(
            f"The shift is {decimal(reply.shift)} s; shifted segments keep their polynomials to the bit.", Ink.NOTE
        )


def _times(times: tuple[float, float] | None) -> tuple[str, str]:
    return ("", "") if times is None else (decimal(times[0]), decimal(times[1]))


EXPLANATIONS: Mapping[type, Callable[[Any, blocks.Page], Iterator[blocks.Block]]] = {
    replies.ExplainOverview: _overview,
    replies.MotionReport: _motion,
    replies.ChainReport: _chain,
    replies.AnglesReport: _angles,
    replies.InverseReport: _inverse,
    replies.SpliceReport: _splice,
}
