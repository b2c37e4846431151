"""Carry out `vrs where`, `verify`, `replay` and `export`, the subcommands about saved trajectories."""

from __future__ import annotations

import json
import os
from argparse import Namespace
from collections.abc import Iterable, Mapping
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING

from msgspec.structs import replace

from vrs_cli.cli import commands, main, sources
from vrs_cli.cli.command_line import DEFAULT_RATE, CommandLineError, refuse
from vrs_cli.cli.outputs import Outputs, check_distinct, check_moment, write_export
from vrs_cli.repl.shell import on_terminal

if TYPE_CHECKING:
    from vrs_cli.files.exports import Exporter
    from vrs_cli.files.trajectory_file import Recording
    from vrs_cli.trajectory.measured import MeasuredTimeline
    from vrs_cli.trajectory.timeline import Timeline


MAX_MEASURED = 500_000  # maximum number of measured reports that are played as a motion


def where(options: Namespace) -> None:
    """Print where the robot is at the given times. With --measured print its measured positions; raises
    CommandLineError for a file without reports."""
    recording = sources.read_recording(options.prog, options.file, lenient=options.lenient)
    from vrs_cli.render.text import plain_text
    from vrs_cli.values.replies import MeasuredWhereabouts, Whereabouts

    arm, timeline, units = recording.arm, recording.timeline, recording.arm.model.units
    objects: Iterable[object]
    if options.measured:
        from vrs_cli.engine.comparison import measured_position, why_unknown

        measured, between = _reports(options, recording), ""
        found = [(t, measured_position(arm, timeline, measured, t)) for t in options.at]
        objects = (
            {"time": t, **sources.position_object(at.measured, units), "mode": at.mode.value}
            if at
            else {"time": t, "mode": None}
            for t, at in found
        )
        texts = (
            plain_text(MeasuredWhereabouts(at, False, units)) if at else f"{why_unknown(measured, t)}\n"
            for t, at in found
        )
    else:
        from vrs_cli.engine.position import position_at

        positions, between = [position_at(arm, timeline, t) for t in options.at], "\n"
        objects = (
            {"time": p.time, **sources.position_object(p, units), "hand": p.hand, "moving": p.moving} for p in positions
        )
        texts = (plain_text(Whereabouts(position, stamped=True, units=units)) for position in positions)
    if options.json:
        print("[\n" + ",\n".join(f"  {json.dumps(one)}" for one in objects) + "\n]")
    else:
        print(between.join(texts), end="")


def _reports(options: Namespace, recording: Recording) -> MeasuredTimeline:
    """Return the reports of the robot's body in a file. Raises CommandLineError if there are none."""
    if not recording.measured:
        raise CommandLineError(f"{options.file} has no measured reports", "leave --measured out")
    return recording.measured


def _measured_timeline(options: Namespace, recording: Recording) -> Timeline:
    """Return the measured motion as a timeline. Raises CommandLineError if there are no reports, or too many."""
    measured = _reports(options, recording)
    what = f"{options.file} has {len(measured)} reports, and {MAX_MEASURED} are played at most"
    refuse((len(measured) > MAX_MEASURED, what, "--to csv, json or npz take all"))
    assert measured.start is not None, "there are reports"
    assert measured.end is not None, "there are reports"
    made = measured.as_timeline(measured.start, measured.end, recording.timeline)
    assert made is not None, "there are reports"
    return made


# --- vrs verify -----------------------------------------------------------------------------------------------------


def verify(options: Namespace) -> int:
    """Print the mistakes in a file, each with its line, or say that there are none; return the exit status."""
    recording = sources.read_recording(options.prog, options.file, lenient=True, warns=False)
    from vrs_cli.engine.breaches import on_lines
    from vrs_cli.files.rebuild import in_lines
    from vrs_cli.files.trajectory_file import MAX_FAULTS

    along = in_lines(on_lines(recording.arm, recording.timeline), recording.timeline, recording.deltas, recording.lines)
    wrong = [*recording.warnings, *map(str, islice(along, MAX_FAULTS))]
    checksums = recording.checksum is not None
    if options.json:
        summary = {"sound": not wrong, "checksums": checksums, "reports": len(recording.measured), "faults": wrong}
        print(json.dumps(summary, indent=2))
    else:
        for what in wrong:
            print(f"{options.file}, {what}")
        held = f"{len(recording.deltas)} changes, {len(recording.timeline)} segments, {recording.timeline.end:.3f} s"
        held += f", {len(recording.measured)} measured reports" if recording.measured else ""
        print(f"{held}{'' if checksums else ', no checksums'}: {'sound' if not wrong else 'not sound'}")
    return main.FAILED if wrong else main.OK


# --- vrs replay -----------------------------------------------------------------------------------------------------


def replay(options: Namespace) -> None:
    """Play, print or write a saved trajectory."""
    outputs = Outputs.of(options)
    recording = sources.read_recording(options.prog, options.file, lenient=options.lenient)

    arm = recording.arm
    timeline = _measured_timeline(options, recording) if options.measured else recording.timeline
    if outputs.any:
        if outputs.report_at is not None:
            check_moment("--report-at", outputs.report_at, timeline)
        outputs.write(arm, timeline, options.file)
    elif options.step is None and on_terminal():
        from vrs_cli.repl.player import play

        play(arm, timeline, options.speed)
    else:
        step = options.step or 0.1  # [s]
        many, hint = (timeline.end - timeline.start) / step > 100_000, "at most 100000; --csv writes long tables"
        refuse((many, f"--step {step:g} makes too many rows", hint))
        from vrs_cli.engine.position import position_at
        from vrs_cli.files.samples import sample_times
        from vrs_cli.render.text import plain_text
        from vrs_cli.values.replies import WhereaboutsTable

        # with the exact end as the last time
        times = (t for some in sample_times(timeline, 1.0 / step) for t in some.tolist())
        rows = tuple(position_at(arm, timeline, t) for t in times)
        print(plain_text(WhereaboutsTable(rows, arm.model.units)), end="")


# --- vrs export -----------------------------------------------------------------------------------------------------


def export(options: Namespace) -> None:
    """Write a saved trajectory in another format."""
    from vrs_cli.files.atomic import check_writable

    exporter = _format(formats(options.to), options.to, options.output)
    name, has_rate, is_moment = exporter.name, options.rate is not None, exporter.of_moment
    hides_cell = options.cell is not None and not exporter.shows_cell
    shown = ", ".join(one.name for one in formats().values() if one.shows_cell) if hides_cell else ""
    refuse(
        (has_rate and is_moment, f"{name} is one moment and has no rate", "give --at TIME"),
        (has_rate and name == "html", "html shows every moment and has no rate", "leave --rate out"),
        (options.at is not None and not is_moment, f"{name} is the whole trajectory", "--at TIME is for --to png"),
        (hides_cell, f"{name} has nothing of a cell", f"--cell is for {shown}"),
    )
    if options.output != commands.STANDARD_STREAM:
        check_distinct((options.file, options.output))
        check_writable(options.output)
    exporter.check()
    recording = sources.read_recording(options.prog, options.file, lenient=options.lenient)

    timeline = recording.timeline
    if options.measured and exporter.tells_measured:
        exporter = replace(exporter, write=partial(exporter.write, measured=_reports(options, recording)))
    elif options.measured:
        timeline = _measured_timeline(options, recording)
    if options.at is not None:
        check_moment("--at", options.at, timeline)
    given = options.rate if options.at is None else options.at
    if given is None:
        given = exporter.usual(timeline) if exporter.usual else DEFAULT_RATE
    if options.cell is not None:
        from vrs_cli.files.cell_file import read_cell
        from vrs_cli.world.course import World

        exporter = replace(exporter, write=partial(exporter.write, world=World(recording.arm, read_cell(options.cell))))
    if exporter.name == "html":
        exporter = replace(
            exporter, write=partial(exporter.write, title=os.path.splitext(os.path.basename(options.file))[0])
        )
    write_export(exporter, options.output, recording.arm, timeline, given)


def formats(asked: str | None = None) -> Mapping[str, Exporter]:
    """Return the export formats by name. Picture formats load more modules; leave them out if `asked` is another
    format."""
    from vrs_cli.files.exports import EXPORTERS

    if asked in EXPORTERS:
        return EXPORTERS
    from vrs_cli.render.pictures import PICTURES

    return {**EXPORTERS, **PICTURES}


def _format(formats: Mapping[str, Exporter], asked: str | None, output: str) -> Exporter:
    """Return the export format that --to names, or the format for the output file's suffix. Raises
    CommandLineError."""
    if asked is not None:
        if asked not in formats:
            raise CommandLineError(f"unknown format {asked}", f"known: {', '.join(formats)}")
        return formats[asked]
    suffix = os.path.splitext(output)[1].lower()
    for exporter in formats.values():
        if exporter.suffix == suffix:
            return exporter
    raise CommandLineError("which format?", f"give --to {' or '.join(formats)}")
