"""Lay out replies as blocks. LAYOUTS has one function for each type of reply."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import zip_longest
from math import degrees
from textwrap import wrap
from typing import Any

from msgspec.structs import replace

from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.words.values import default_form, numbers_of
from vrs_cli.render import explained, plain
from vrs_cli.render.arm_picture import arm_picture
from vrs_cli.render.blocks import (
    POSE,
    Block,
    Column,
    Grid,
    Page,
    TextLine,
    joint_names,
    line,
    number_column,
    number_columns,
    wrap_lines,
)
from vrs_cli.render.chart import chart
from vrs_cli.render.colours import Ink, scan
from vrs_cli.values import diagnostics, measured, replies, reports, results
from vrs_cli.values.numbers import count, decimal, seconds

TONES: Mapping[results.Tone, Ink] = {
    results.Tone.NOTE: Ink.NOTE,
    results.Tone.WARNING: Ink.WARNING,
    results.Tone.ERROR: Ink.ERROR,
}

PLAIN_WIDTH = 80  # characters per line of wrapped text if the page does not set a width
NAME_COLUMN = 16
SIGNALS_A_ROW = 16
ROWS_ALWAYS = 2  # rows of a bank of signals that are always shown; further rows are shown if one of their signals is on
LINEAGE: Mapping[str, str] = {"1": "VAL", "2": "VAL-II", "+": "V+"}
BODY_MODES: Mapping[measured.BodyMode, str] = {
    measured.BodyMode.FOLLOWS: "follows",
    measured.BodyMode.HOLDS: "holds still",
    measured.BodyMode.STOPPED: "has stopped by itself",
}
NAMES = Column("", Ink.NAME, width=NAME_COLUMN)
NOTHING: Mapping[type, str] = {  # messages in place of tables that have no rows
    replies.LocationTable: "No locations defined",
    replies.RealTable: "No reals defined",
    replies.StringTable: "No strings defined",
    replies.ProgramNames: "No programs in memory",
}


def blocks(reply: replies.Reply, page: Page) -> Iterator[Block]:
    """Yield the blocks of a reply, from top to bottom."""
    none = NOTHING.get(type(reply))
    if none is not None and not reply.rows:  # type: ignore[union-attr]  # every type in NOTHING has rows
        yield line(none, Ink.NOTE)
    else:
        yield from LAYOUTS[type(reply)](reply, page)


# --- messages ------------------------------------------------------------------------------------------------------


def _message(reply: results.Message, _page: Page) -> Iterator[Block]:
    for text in reply.text.split("\n"):
        yield line(text, TONES[reply.tone])


def _diagnostics(reply: replies.DiagnosticsReport, _page: Page) -> Iterator[Block]:
    for item in reply.items:
        ink = Ink.ERROR if item.diagnostic.severity is diagnostics.Severity.ERROR else Ink.WARNING
        first, *others = diagnostics.show(item.diagnostic, item.source_line, item.path).split("\n")
        yield line(first, ink)
        for text in others:
            yield line(text, ink if text.strip(" ^") == "" else Ink.TEXT)


def _program_stopped(reply: results.ProgramStopped, _page: Page) -> Iterator[Block]:
    yield line(reply.what, TONES[reply.tone])
    yield line(f"Program stopped at {reply.program}, step {reply.step}", Ink.NOTE)
    if reply.source:
        yield TextLine((("    ", Ink.TEXT), *scan(reply.source)))


# --- positions and values ------------------------------------------------------------------------------------------


def _whereabouts(reply: replies.Whereabouts, _page: Page) -> Iterator[Block]:
    position = reply.position
    if reply.stamped:
        doing = position.text or "moving" if position.moving else "standing still"
        yield line(f"At {seconds(position.time)}, {doing}", Ink.NOTE)
    joints = numbers_of(position.joints, reply.units)
    tool = (*numbers_of(position.T_world_tool), position.hand)
    for headings, values in (((*POSE, "Hand"), tool), (joint_names(len(joints)), joints)):
        yield Grid(number_columns(*headings), (tuple(map(decimal, values)),), tight=True)


def _whereabouts_table(reply: replies.WhereaboutsTable, _page: Page) -> Iterator[Block]:
    headings = ("t", *POSE, "Hand", *joint_names(len(reply.positions[0].joints) if reply.positions else 0))
    rows = (
        (one.time, *numbers_of(one.T_world_tool), one.hand, *numbers_of(one.joints, reply.units))
        for one in reply.positions
    )
    yield Grid(number_columns(*headings), tuple(tuple(map(decimal, row)) for row in rows), tight=True, keys=1)


def _measured_whereabouts(reply: replies.MeasuredWhereabouts, _page: Page) -> Iterator[Block]:
    at, units = reply.at, reply.units
    title = f"At {seconds(at.measured.time)}, measured: the body {BODY_MODES[at.mode]}"
    yield line(f"{title}; the last report" if reply.is_last else title, Ink.NOTE)
    joints = numbers_of(at.measured.joints, units)
    for headings, values in ((POSE, numbers_of(at.measured.T_world_tool)), (joint_names(len(joints)), joints)):
        yield Grid(number_columns(*headings), (tuple(map(decimal, values)),), tight=True)
    worst = max(range(len(joints)), key=lambda place: abs(at.errors[place]))
    error = f"joint {worst + 1} by {decimal(units.one_shown(worst + 1, at.errors[worst]))} {units.unit(worst + 1)}"
    apart = f"{decimal(1000.0 * at.distance)} mm and {decimal(degrees(at.angle))} deg"
    yield line(f"From the timeline: {apart}; {error}", Ink.NOTE)


def _parts(reply: replies.PartTable, _page: Page) -> Iterator[Block]:
    several = len({row.time for row in reply.rows}) > 1
    if reply.stamped and reply.rows and not several:
        yield line(f"At {seconds(reply.rows[0].time)}", Ink.NOTE)
    columns = (Column("Part", Ink.NAME), *number_columns(*(("t",) if several else ()), *POSE))
    rows = tuple(
        (
            f"{row.name} {_state(row)}",
            *((decimal(row.time),) if several else ()),
            *([""] * len(POSE) if row.T_world_part is None else map(decimal, numbers_of(row.T_world_part))),
        )
        for row in reply.rows
    )
    yield Grid(columns, rows, tight=True, keys=1)


def _state(row: replies.PartRow) -> str:
    if row.T_world_part is None:
        return "not there"
    return "held" if row.held else f"on {row.on}" if row.on else "falls"


def _locations(reply: replies.LocationTable, _page: Page) -> Iterator[Block]:
    rows = [
        (name, *(("undefined",) if value is None else map(decimal, numbers_of(value, reply.units))))
        for name, value in ((row.name, row.pose or row.joints) for row in reply.rows)
    ]
    size = max(len(POSE) + 1, *map(len, rows))
    headings = [f"{POSE[i]}/JT{i + 1}" if i < len(POSE) else f"JT{i + 1}" for i in range(size - 1)]
    filled = tuple(row + ("",) * (size - len(row)) for row in rows)
    yield Grid((NAMES, *number_columns(*headings)), filled, tight=True, keys=1)


def _reals(reply: replies.RealTable, _page: Page) -> Iterator[Block]:
    yield Grid(
        (NAMES, Column("", Ink.NUMBER)),
        tuple((name, default_form(x) + (" (TRUE)" if x else " (FALSE)") * reply.truths) for name, x in reply.rows),
        tight=True,
    )


def _strings(reply: replies.StringTable, _page: Page) -> Iterator[Block]:
    yield Grid((NAMES, Column("", Ink.STRING)), tuple((name, f' "{text}"') for name, text in reply.rows), tight=True)


# --- programs ------------------------------------------------------------------------------------------------------


def _program_text(reply: replies.ProgramText, page: Page) -> Iterator[Block]:
    yield from _program_part(reply, page)
    yield TextLine(tuple(scan(".END")))


def _program_part(listed: replies.ProgramText | replies.ProgramPart, _page: Page) -> Iterator[Block]:
    from vrs_cli.language.text.parser import variables_in

    if listed.header:
        yield TextLine(tuple(scan(listed.header)))
    variables = variables_in((listed.header, *(step.text for step in listed.steps)))
    for step in listed.steps:
        text = ((step.text, Ink.ERROR),) if step.bad else tuple(scan(step.text, variables))
        yield TextLine(((f"{step.number:5d} {'?' if step.bad else ' '} ", Ink.NOTE), *text))


def _file_table(reply: replies.FileTable, _page: Page) -> Iterator[Block]:
    if not reply.rows:
        yield line(f"No files in {reply.folder}", Ink.NOTE)
        return
    width = max(len(row.name) for row in reply.rows)
    for row in reply.rows:
        size = "folder" if row.size is None else f"{row.size} bytes"
        yield TextLine(((f"{row.name:<{width}}", Ink.NAME), (f"  {size:>14}", Ink.NOTE)))


def _program_names(reply: replies.ProgramNames, _page: Page) -> Iterator[Block]:
    yield Grid(
        (Column("", Ink.ERROR), NAMES, Column("", Ink.NUMBER), Column("", Ink.COMMENT, fold=True)),
        tuple(
            (" " if row.executable else "*", row.name, f"{row.steps:4d} step{'s' * (row.steps != 1)}", row.comment)
            for row in reply.rows
        ),
    )
    if not all(row.executable for row in reply.rows):
        yield line("* not executable: LISTP shows its bad lines, LOAD of the mended file brings it in", Ink.NOTE)


def _status(reply: replies.StatusReport, _page: Page) -> Iterator[Block]:
    yield from _facts(
        ("Robot", reply.robot),
        ("Arm power", "on" if reply.power else "off (ENABLE POWER)"),
        ("Configuration", str(reply.configuration) or "this robot has one"),
        ("Monitor speed", f"{decimal(reply.monitor_speed, 0)} %"),
        ("Program speed", reply.program_speed),
        *((("Next motion", ", ".join(reply.next_motion)),) if reply.next_motion else ()),
        ("Clock", seconds(reply.clock)),
        ("Timeline ends", seconds(reply.end)),
        *(_progress(reply.progress) if reply.progress else (("Program", "none was run yet"),)),
    )


def _status_then(reply: replies.StatusThen, _page: Page) -> Iterator[Block]:
    on = (f"{number} {reply.names.get(number, '')}".rstrip() for number in reply.on)
    yield from _facts(
        ("At", seconds(reply.time)),
        ("Motion", reply.motion or "none: the robot stands"),
        ("Configuration", str(reply.configuration) or "this robot has one"),
        ("Hand", decimal(reply.hand, 3)),
        ("Signals on", ", ".join(on) or "none"),
    )


def _progress(progress: replies.Progress) -> Iterator[tuple[str, str]]:
    step = "" if progress.step is None else f", step {progress.step}"
    yield ("Program", f"{progress.program} {progress.state}{step}")
    left = "for ever" if progress.cycles_left is None else f"{progress.cycles_left} left"
    yield ("Cycles", f"{progress.cycles_done} completed, {left}")


def _facts(*facts: tuple[str, str]) -> Iterator[Block]:
    """Yield names and their values in two columns."""
    yield Grid((Column("", Ink.HEADING, width=NAME_COLUMN), Column("", fold=True)), facts, tight=True)


# --- settings and the system ---------------------------------------------------------------------------------------


def _signals(reply: replies.SignalTable, _page: Page) -> Iterator[Block]:
    columns = (Column("", Ink.NOTE, right=True, width=6), Column("", Ink.NUMBER))
    for bank in reply.banks:
        rows = []
        for i in range(0, len(bank.states), SIGNALS_A_ROW):
            digits = "".join("01"[on] for on in bank.states[i : i + SIGNALS_A_ROW])
            if i < ROWS_ALWAYS * SIGNALS_A_ROW or "1" in digits:
                rows.append((f"{bank.first + i}-", " ".join(digits[j : j + 4] for j in range(0, len(digits), 4))))
        yield line(bank.title, Ink.HEADING)
        yield Grid(columns, tuple(rows))
        if bank.names:
            named = (Column("", Ink.NOTE, right=True, width=6), Column("", Ink.NAME), Column("", Ink.NUMBER))
            shown = ((str(number), name, bank.states[number - bank.first]) for number, name in bank.names.items())
            yield Grid(named, tuple((number, name, "on" if on else "off") for number, name, on in shown))


def _settings(reply: replies.SettingTable, _page: Page) -> Iterator[Block]:
    yield Grid(
        (Column(reply.title, Ink.NAME), Column("", Ink.NUMBER), Column("", Ink.NOTE, fold=True)),
        tuple((row.name, row.value, row.summary) for row in reply.rows),
    )


def _clock(reply: replies.ClockReport, _page: Page) -> Iterator[Block]:
    pace = "" if reply.rate is None else f", rate {reply.rate:g}"
    yield line(f"Robot clock {seconds(reply.clock)}{pace}{', paused' if reply.paused else ''}")


def _body(reply: replies.BodyReport, _page: Page) -> Iterator[Block]:
    body, alarm = reply.body, reply.alarm
    if body is None:
        yield line("No client is the body of this robot")
        yield from _facts(("On an alarm", reply.on_alarm.value))
        return
    order = "to follow" if body.order is measured.BodyMode.FOLLOWS else "to hold still"
    ordered = "" if body.order is body.mode else f"; it is told {order}"
    mode, counts = BODY_MODES[body.mode], body.counts
    last = "none so far" if body.last is None else f"{body.rate:.0f} a second, the last of {seconds(body.last)}"
    unknown = "" if reply.unknown is None else f"; unknown since {seconds(reply.unknown)}"
    early = "ahead" if body.offset >= 0.0 else "behind"
    drift = f"drift {decimal(1e6 * body.drift, 1)} us in a second"
    yield from _facts(
        ("Body", f"{body.name} {mode}{ordered}" if body.name else "none any more"),
        ("Reports", f"{counts.received}: {last}{unknown}"),
        ("", f"{counts.lost} lost, {counts.late} late, {counts.duplicate} duplicate, {counts.reordered} reordered"),
        ("Its clock", f"{decimal(1000.0 * abs(body.offset))} ms {early}, {drift}"),
        ("Delay", f"{decimal(1000.0 * body.delay)} ms"),
        ("On an alarm", reply.on_alarm.value),
    )
    if alarm is not None:
        yield line(measured.alarm_text(alarm), Ink.NOTE)


def _resynchronisation(reply: replies.Resynchronised, _page: Page) -> Iterator[Block]:
    report, units = reply.report, reply.units
    worst = max(range(len(report.distances)), key=lambda place: abs(report.distances[place]))
    size = (
        f"joint {worst + 1} by {decimal(units.one_shown(worst + 1, report.distances[worst]))} {units.unit(worst + 1)}"
    )
    on = f"; then on to {report.goal}" if report.goal else ""
    yield line(f"From {seconds(report.t)} to the measured joints ({size}), there at {seconds(report.until)}{on}")


def _identification(reply: replies.Identification, _page: Page) -> Iterator[Block]:
    yield from _facts(
        ("Software", f"vrs {reply.version}, VAL-II for a virtual robot"),
        ("Robot", f"{reply.robot} ({reply.name}), {reply.joint_count} joints"),
        ("Python", reply.python),
    )


def _free(reply: replies.FreeReport, _page: Page) -> Iterator[Block]:
    yield from _facts(
        ("Programs", f"{reply.programs}, {count(reply.steps, 'step')}"),
        ("Variables", str(reply.variables)),
        ("Timeline", count(reply.segments, "segment")),
        ("Memory", "shared with the computer" if reply.percent is None else f"{decimal(reply.percent, 1)} % free"),
    )


# --- help ----------------------------------------------------------------------------------------------------------


def _help_overview(reply: replies.HelpOverview, page: Page) -> Iterator[Block]:
    for group in reply.groups:
        yield line(group.title, Ink.HEADING)
        words = " ".join(word.replace(" ", "\0") for word in group.words)
        for text in wrap(words, (page.width or PLAIN_WIDTH) - 2, break_on_hyphens=False, break_long_words=False):
            yield TextLine((("  ", Ink.TEXT), *scan(text.replace("\0", " "))))
    yield line("HELP word explains one of them; vrs learn, outside of the shell, teaches them in lessons.", Ink.NOTE)


def _help_topic(reply: replies.HelpTopic, page: Page) -> Iterator[Block]:
    yield line(reply.title, Ink.HEADING)
    width = page.width or PLAIN_WIDTH
    column = min(max(len(form) for form, _ in reply.rows), width // 3)
    for form, summary in reply.rows:
        forms = wrap(form, column) if len(form) <= 2 * column else [form]
        if len(forms[-1]) > column:
            yield TextLine((("  ", Ink.TEXT), *scan(forms.pop())))
        for left, right in zip_longest(forms, wrap(_sentence(summary), width - column - 4), fillvalue=""):
            yield TextLine(
                (("  ", Ink.TEXT), *scan(left), (" " * (column + 2 - len(left)), Ink.TEXT), (right, Ink.TEXT))
            )


def _help_page(reply: replies.HelpPage, page: Page) -> Iterator[Block]:
    for number, entry in enumerate(reply.entries):
        if number:
            yield line()
        lineage = [LINEAGE[mark] for mark in entry.where.split() if mark in LINEAGE]
        yield TextLine((*scan(entry.form), (f"   ({', '.join((entry.sort, *lineage))})", Ink.NOTE)))
        for text in wrap(_sentence(entry.summary), (page.width or PLAIN_WIDTH) - 4):
            yield line(f"    {text}")
        if entry.note:
            yield line(f"    {_sentence(entry.note)}", Ink.WARNING)
        if entry.example:
            yield TextLine((("    Example: ", Ink.NOTE), *scan(entry.example)))


def _sentence(text: str) -> str:
    """Return the text as a sentence: with a capital letter at the start and a full stop at the end."""
    text = text[:1].upper() + text[1:]
    return text if text.endswith((".", "!", "?")) or not text else f"{text}."


# --- the timeline --------------------------------------------------------------------------------------------------


def _timeline(reply: replies.TimelineTable, page: Page) -> Iterator[Block]:
    if not reply.commands:
        yield line(f"No motions yet; the clock is at {seconds(reply.clock)}", Ink.NOTE)
        return
    yield from _latest(_command_grid(reply.commands), "commands", page.rows)
    yield line()
    columns = (
        number_column("No.", 3),
        *number_columns("t_s", "t_f", width=8),
        Column("Phase", width=10),
        Column("Space", width=8),
        Column("Command", Ink.INSTRUCTION, cut=True),
    )
    rows = tuple(
        (str(number), decimal(row.start), decimal(row.finish), row.phase, row.space, _segment_label(row))
        for number, row in enumerate(reply.segments, 1)
    )
    yield from _latest(Grid(columns, rows, boxed=True), "segments", page.rows)
    for row in reply.stops:
        text = f"{_segment_label(row)} stops on its way, at {seconds(row.finish)}, and goes on"
        yield from wrap_lines(text, Ink.NOTE, page)
    for reading in reply.untrue:
        yield line(plain.untrue_sentence(reading), Ink.WARNING)
    yield line(f"The clock is at {seconds(reply.clock)}", Ink.NOTE)


def _latest(grid: Grid, what: str, most: int | None) -> Iterator[Block]:
    """Yield the last rows of a long table, after a line with the number of omitted rows."""
    if most is not None and len(grid.rows) > most:
        yield line(f"The first {len(grid.rows) - most} {what} are not shown; SAVE writes all of them", Ink.NOTE)
        grid = replace(grid, rows=grid.rows[-most:])
    yield grid


def _command_grid(commands: Sequence[results.CommandRecord]) -> Grid:
    """Return a grid of commands with their times; if any motion begins at another time than requested, the grid also
    shows the requested times."""
    displaced = any(row.is_displaced for row in commands)
    headings = ("t_iss", "asked", "t_exec", "t_end") if displaced else ("t_iss", "t_exec", "t_end")
    columns = (
        number_column("No.", 3),
        Column("Command", Ink.INSTRUCTION, width=NAME_COLUMN, fold=True),
        *number_columns(*headings, width=8),
    )
    rows = tuple(
        (str(row.number), row.text, decimal(row.issued), *((_requested_time(row),) if displaced else ()), *_times(row))
        for row in commands
    )
    return Grid(columns, rows, boxed=True)


def _requested_time(record: results.CommandRecord | None) -> str:
    return "" if record is None or record.asked is None else decimal(record.asked)


def _branches(reply: replies.BranchTable, _page: Page) -> Iterator[Block]:
    yield Grid(
        (
            Column("Branch", Ink.NAME, width=NAME_COLUMN),
            number_column("Commands", 0),
            *number_columns("Ends", "Clock"),
            Column("", Ink.NOTE),
        ),
        tuple(
            (row.name, str(row.commands), decimal(row.end), decimal(row.clock), "present" if row.present else "")
            for row in reply.rows
        ),
        boxed=True,
    )


def _comparison(reply: replies.ComparisonTable, page: Page) -> Iterator[Block]:
    compared = reply.comparison
    columns = (NAMES, *number_columns(reply.a, reply.b, "Change"), Column("", Ink.NOTE))
    yield Grid(columns, tuple(_measures(compared.a, compared.b)), boxed=True)
    yield line()
    yield from _latest(_fates(reply), "commands", page.rows)
    yield line(_apart(compared, reply.units), Ink.NOTE)


def _measured_comparison(reply: replies.MeasuredComparisonTable, _page: Page) -> Iterator[Block]:
    compared, units = reply.comparison, reply.units
    shown = [("Tool", compared.tool, 1000.0, "mm"), ("Tool, turned", compared.turned, degrees(1.0), "deg")]
    shown += [
        (name, one, units.one_shown(joint, 1.0), units.unit(joint))
        for joint, (name, one) in enumerate(zip(joint_names(len(compared.joints)), compared.joints, strict=True), 1)
    ]
    rows = (
        (name, *(decimal(scale * x) for x in (one.rms, one.greatest.distance)), decimal(one.greatest.time), unit)
        for name, one, scale, unit in shown
    )
    yield Grid((NAMES, *number_columns("rms", "Greatest", "at"), Column("", Ink.NOTE)), tuple(rows), boxed=True)
    unknown = f"; unknown for {seconds(compared.unknown)} of it" if compared.unknown else ""
    span = f"{seconds(compared.begin)} to {seconds(compared.end)}"
    yield line(f"{count(compared.reports, 'report')} from {span} beside {reply.branch}{unknown}", Ink.NOTE)


def _measures(a: reports.Extent, b: reports.Extent) -> Iterator[tuple[str, ...]]:
    measures = [
        ("Cycle time", a.duration, b.duration, "s"),
        ("Tool path", a.tool_path * 1000.0, b.tool_path * 1000.0, "mm"),
        ("Joint travel", degrees(a.joint_travel), degrees(b.joint_travel), "deg"),
    ]
    if a.joint_slide or b.joint_slide:
        measures.append(("Joint travel", a.joint_slide * 1000.0, b.joint_slide * 1000.0, "mm"))
    for title, one, other, unit in measures:
        yield title, decimal(one), decimal(other), _change(other - one), unit
    for title, few, many in (("Commands", a.commands, b.commands), ("Segments", a.segments, b.segments)):
        yield title, str(few), str(many), f"{many - few:+d}" if many != few else "", ""


def _fates(reply: replies.ComparisonTable) -> Grid:
    """Return a grid of the commands of two timelines, with their times on both; if any motion begins at another time
    than requested, the grid also shows the requested times."""
    pairs = reply.comparison.commands
    displaced = any(record.is_displaced for pair in pairs for record in (pair.a, pair.b) if record is not None)
    columns = (
        Column("Command", Ink.INSTRUCTION, width=NAME_COLUMN),
        *number_columns(*("asked",) * displaced, reply.a, "to", reply.b, "to", "Change", width=8),
    )
    rows = []
    for pair in pairs:
        ends = [record.end for record in (pair.a, pair.b) if record is not None and record.end is not None]
        change = _change(ends[1] - ends[0]) if len(ends) == 2 else ""
        asked = (_requested_time(pair.a or pair.b),) * displaced
        rows.append((pair.text, *asked, *_times(pair.a), *_times(pair.b), change))
    return Grid(columns, tuple(rows), boxed=True)


def _times(record: results.CommandRecord | None) -> tuple[str, str]:
    if record is None:
        return "-", "-"
    return decimal(record.executed), "dropped" if record.end is None else decimal(record.end)


def _change(difference: float) -> str:
    """Return a difference with its sign; "" for zero."""
    text = decimal(difference)
    return "" if not text.strip("0.") else text if difference < 0.0 else f"+{text}"


def _apart(compared: reports.Comparison, units: JointUnits) -> str:
    if compared.since is None:
        return "The robot does the same on both"
    joint = compared.joints.joint
    moved = decimal(units.one_shown(joint, compared.joints.distance))
    return (
        f"The same until {seconds(compared.since)}. At most {decimal(compared.tool.distance * 1000.0)} mm apart, at "
        f"{seconds(compared.tool.time)}; joint {joint} {moved} {units.unit(joint)}, at "
        f"{seconds(compared.joints.time)}"
    )


def _segment_label(row: replies.SegmentRow | replies.ReplayRow) -> str:
    return f"{row.motion} {row.text}".rstrip() if row.motion else ""


def _replay(reply: replies.ReplayTable, _page: Page) -> Iterator[Block]:
    yield Grid(
        (*number_columns("t", *POSE), Column("   Command", Ink.INSTRUCTION)),
        tuple(
            (decimal(row.end), *map(decimal, numbers_of(row.T_world_tool)), f"   {_segment_label(row)}".rstrip())
            for row in reply.rows
        ),
        tight=True,
        keys=1,
    )


LAYOUTS: Mapping[type, Callable[[Any, Page], Iterator[Block]]] = {
    results.Message: _message,
    replies.DiagnosticsReport: _diagnostics,
    results.ProgramStopped: _program_stopped,
    replies.Whereabouts: _whereabouts,
    replies.WhereaboutsTable: _whereabouts_table,
    replies.MeasuredWhereabouts: _measured_whereabouts,
    replies.PartTable: _parts,
    replies.ArmPicture: arm_picture,
    replies.ReachReport: explained.reach_report,
    replies.LocationTable: _locations,
    replies.RealTable: _reals,
    replies.StringTable: _strings,
    replies.ProgramText: _program_text,
    replies.ProgramPart: _program_part,
    replies.FileText: lambda reply, _page: (TextLine(tuple(scan(text))) for text in reply.lines),
    replies.FileTable: _file_table,
    replies.ProgramNames: _program_names,
    replies.StatusReport: _status,
    replies.StatusThen: _status_then,
    replies.SignalTable: _signals,
    replies.SettingTable: _settings,
    replies.ClockReport: _clock,
    replies.BodyReport: _body,
    replies.Resynchronised: _resynchronisation,
    replies.Identification: _identification,
    replies.FreeReport: _free,
    replies.HelpOverview: _help_overview,
    replies.HelpTopic: _help_topic,
    replies.HelpPage: _help_page,
    replies.Displaced: lambda reply, _page: (line(text, Ink.WARNING) for text in plain.sentences(reply.displacement)),
    replies.NoLongerTrue: lambda reply, _page: (
        line(plain.untrue_sentence(one), Ink.WARNING) for one in reply.readings
    ),
    replies.TimelineTable: _timeline,
    replies.BranchTable: _branches,
    replies.ComparisonTable: _comparison,
    replies.MeasuredComparisonTable: _measured_comparison,
    replies.Plot: chart,
    replies.ReplayTable: _replay,
    **explained.EXPLANATIONS,
    replies.Farewell: lambda _reply, _page: iter(()),
}
