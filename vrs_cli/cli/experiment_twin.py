"""`vrs lab experiment twin`: what an operator sees of a body that follows the timeline, beside where it is."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Iterator, Sequence
from itertools import product
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from msgspec import structs

from vrs_cli.cli.command_line import STANDARD_STREAM, CommandLineError, chosen_robot, did_you_mean
from vrs_cli.cli.experiment import lines_of, outcomes
from vrs_cli.cli.main import FAILED, OK

if TYPE_CHECKING:
    from vrs_cli.bodies.scenario import Disturbance
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.lab.twin import TwinCurves, TwinRow, TwinTrial
    from vrs_cli.render.blocks import Block

PANELS = 8  # that are drawn, at most


class TwinRows(NamedTuple):
    """A case: the names of its line and of its scenario, what it is tried with, the curves of the first seed, and what
    came of all.
    """

    delays: str
    scenario: str
    trial: TwinTrial
    curves: TwinCurves
    row: TwinRow


def run(options: Namespace) -> int:
    """Try all, print a table and draw; returns 1 where what is seen is wrong without a flag."""
    if options.plot is not None:
        _check_picture(options.plot)
    rows = _rows(options)
    if options.json:
        tried = {"seeds": options.seeds, "seconds": options.seconds}
        print(json.dumps({**tried, "rows": [*map(_row_object, rows)]}, indent=2))
    else:
        from vrs_cli.render.blocks import text_of

        print(text_of(_told(options, rows)), end="")
    if options.plot is not None:
        _draw(options.plot, rows)
    return OK if all(it.row.excess == 0.0 for it in rows) else FAILED


def _check_picture(path: str) -> None:
    """Raise now what would go wrong when a picture is written: CommandLineError, FileError."""
    if path == STANDARD_STREAM or Path(path).suffix.lower() != ".svg":
        raise CommandLineError("--plot of twin wants a picture", "--plot OUT.svg")
    from vrs_cli.files.atomic import check_writable

    check_writable(path)


def _rows(options: Namespace) -> list[TwinRows]:
    from vrs_cli.lab.twin import twin_outcome, twin_row

    cases = list(_cases(options))
    trials = [_seeded(trial, number) for _, _, trial in cases for number in range(options.seeds)]
    found = outcomes(twin_outcome, trials, options.jobs)
    parts = (found[first : first + options.seeds] for first in range(0, len(found), options.seeds))
    return [
        TwinRows(delays, scenario, trial, part[0].curves, twin_row(part))
        for (delays, scenario, trial), part in zip(cases, parts, strict=True)
    ]


def _seeded(it: TwinTrial, number: int) -> TwinTrial:
    """Return a trial with another seed."""
    ways = structs.replace(it.trial.ways, seed=it.trial.ways.seed + number)
    return structs.replace(it, trial=structs.replace(it.trial, ways=ways))


def _cases(options: Namespace) -> Iterator[tuple[str, str, TwinTrial]]:
    """Yield the names of line and scenario, and what is tried."""
    from vrs_cli.lab.delays import Trial
    from vrs_cli.lab.twin import RATE, SCENARIOS, TwinTrial
    from vrs_cli.net.delay_line import DelayWays

    robot = chosen_robot(options)
    scenarios = [(name, _scenario(options, robot, name)) for name in options.scenario or SCENARIOS]
    for name, forward, backward in lines_of(options):
        ways = DelayWays(forward, backward, options.seed)
        for (scenario, disturbances), policy, lead in product(scenarios, options.policy, options.lead):
            yield name, scenario, TwinTrial(Trial(robot, ways, lead, policy, options.seconds, RATE), disturbances)


def _scenario(options: Namespace, robot: RobotModel, name: str) -> tuple[Disturbance, ...]:
    """Return the disturbances of a scenario by its name, or of a file. Raises CommandLineError, FileError."""
    from vrs_cli.bodies.scenario import load_scenario
    from vrs_cli.lab.twin import BEGINS, SCENARIOS

    if name in SCENARIOS:
        return tuple(structs.replace(one, at=BEGINS * options.seconds) for one in SCENARIOS[name])
    if not name.endswith(".toml"):
        hint = did_you_mean(name, SCENARIOS, options.prog)
        raise CommandLineError(f"--scenario: no scenario is {name}", hint)
    return load_scenario(Path(name), tuple(link.kind for link in robot.links)).disturbances


def _told(options: Namespace, rows: Sequence[TwinRows]) -> Iterator[Block]:
    from vrs_cli.lab.twin import SEEN
    from vrs_cli.render.blocks import Column, Grid, line, number_column, number_columns

    columns = (Column("scenario"), Column("policy"), number_column("lead s", 6))
    for delays in dict.fromkeys(it.delays for it in rows):
        some = [it for it in rows if it.delays == delays]
        yield line(f"{delays}; {options.seeds} x {options.seconds:g} s; body: {some[0].row.body}")
        yield line(
            "Mean error [deg] of the farthest joint: what is seen, beside the body; the body, beside its timeline"
        )
        seen = (
            (
                *_named(it),
                *(f"{it.row.mean[name]:.3f}" for name in SEEN),
                f"{it.row.excess:g}",
                f"{100 * it.row.flagged:.2f}",
            )
            for it in some
        )
        yield Grid((*columns, *number_columns(*SEEN, "excess", "flagged %")), tuple(seen))
        yield line()
        yield line("What the operator was told")
        told = (
            (
                *_named(it),
                f"{it.row.alarms}/{it.row.trials}",
                "-" if isnan(it.row.alarm) else f"{it.row.alarm:.2f}",
                str(it.row.false_alarms),
                f"{100 * it.row.misled:.2f}",
                it.row.cause or "-",
            )
            for it in some
        )
        yield Grid((*columns, *number_columns("alarms", "after s", "false", "misled %"), Column("cause")), tuple(told))
        yield line()
    worst = max(it.row.excess for it in rows)
    yield line(f"Outside flagged times the error of timeline, minus that of tracking, is at most {worst:g} deg")


def _named(it: TwinRows) -> tuple[str, str, str]:
    return Path(it.scenario).name, it.trial.trial.policy, f"{it.trial.trial.lead:g}"


def _row_object(it: TwinRows) -> dict[str, object]:
    row = structs.asdict(it.row)
    alarm = None if isnan(it.row.alarm) else it.row.alarm
    lead = it.trial.trial.lead
    named = {"delays": it.delays, "scenario": it.scenario, "policy": it.trial.trial.policy, "lead_s": lead}
    return {**named, **row, "alarm": alarm}


def _draw(path: str, rows: Sequence[TwinRows]) -> None:
    """Draw the errors of the first seed of each case over time. Raises FileError."""
    from vrs_cli.files.atomic import write_atomically
    from vrs_cli.lab.twin import SEEN
    from vrs_cli.render.plots import Curves, curves_svg

    panels = [
        Curves(
            f"{scenario}, lead {lead} s, {policy}: error [deg]",
            SEEN,
            [getattr(it.curves, name) for name in SEEN],
            it.curves.times,
        )
        for it in rows[:PANELS]
        for scenario, policy, lead in (_named(it),)
    ]
    write_atomically(path, curves_svg(panels, "t [s]") + "\n")
