"""`vrs lab experiment methods`: viewers and controllers of users beside those of vrs."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from msgspec import structs

from vrs_cli.cli.command_line import CommandLineError, chosen_robot, did_you_mean
from vrs_cli.cli.experiment import lines_of, outcomes
from vrs_cli.cli.main import OK

if TYPE_CHECKING:
    from vrs_cli.lab.bench import ControllerScore, MethodOutcome, MethodTrial, ViewerScore
    from vrs_cli.render.blocks import Block

VIEWED, FOLLOWED = "What is seen, beside the robot", "The robot, beside its goal"


class MethodRows(NamedTuple):
    """The scores over one line in one scenario, by the names of viewers and controllers."""

    delays: str
    scenario: str
    viewers: dict[str, ViewerScore]
    controllers: dict[str, ControllerScore]


def run(options: Namespace) -> int:
    """Try all, and print tables. Raises MethodError for a class that fails, CommandLineError."""
    from vrs_cli.lab.methods import Predictor, RemoteController, load_method

    for name in options.viewer:
        load_method(name, Predictor)
    for name in options.controller:
        load_method(name, RemoteController)
    rows = list(_rows(options))
    if options.json:
        tried = {"seeds": options.seeds, "seconds": options.seconds, "rate": options.rate}
        print(json.dumps({**tried, "rows": [_row_object(row) for row in rows]}, indent=2))
    else:
        from vrs_cli.render.blocks import text_of

        print(text_of(_told(options, rows)), end="")
    return OK


def _rows(options: Namespace) -> Iterator[MethodRows]:
    from vrs_cli.lab.bench import mean_controller_score, mean_viewer_score, method_outcome
    from vrs_cli.lab.methods import VIEWERS

    cases = list(_cases(options))
    trials = [
        structs.replace(trial, ways=structs.replace(trial.ways, seed=trial.ways.seed + number))
        for _, trial in cases
        for number in range(options.seeds)
    ]
    found = outcomes(method_outcome, trials, options.jobs)
    parts: dict[tuple[str, str], list[tuple[MethodTrial, Sequence[MethodOutcome]]]] = {}
    for k, (name, trial) in enumerate(cases):
        some = found[k * options.seeds : (k + 1) * options.seeds]
        parts.setdefault((name, trial.scenario), []).append((trial, some))
    for (name, scenario), tried in parts.items():
        viewed = tried[0][1]
        names = (*VIEWERS, *viewed[0].viewers)
        seen = {one: [it.viewers[one] for it in viewed if one in it.viewers] for one in dict.fromkeys(names)}
        scores = {
            trial.controller: [it.controller for it in some if it.controller is not None] for trial, some in tried
        }
        yield MethodRows(
            name,
            scenario,
            {one: mean_viewer_score(rows) for one, rows in seen.items() if rows},
            {one: mean_controller_score(rows) for one, rows in scores.items() if rows},
        )


def _cases(options: Namespace) -> Iterator[tuple[str, MethodTrial]]:
    """Yield each trial without its seed, and the name of its line. Viewers are tried with the first controller."""
    from vrs_cli.lab.bench import FOLLOWED as FOLLOWED_SCENARIOS
    from vrs_cli.lab.bench import SCENARIOS, MethodTrial
    from vrs_cli.lab.methods import CONTROLLERS, VIEWERS
    from vrs_cli.net.delay_line import DelayWays

    robot = chosen_robot(options)
    for scenario in options.scenario or ():
        if scenario not in SCENARIOS:
            hint = did_you_mean(scenario, SCENARIOS, options.prog)
            raise CommandLineError(f"--scenario: no scenario is {scenario}", hint)
    viewers = (*VIEWERS, *options.viewer)
    controllers = (*CONTROLLERS, *options.controller)
    for name, forward, backward in lines_of(options):
        ways = DelayWays(forward, backward, options.seed)
        for scenario in options.scenario or SCENARIOS:
            for number, one in enumerate(controllers if scenario in FOLLOWED_SCENARIOS else controllers[:1]):
                seen = viewers if number == 0 else ()
                yield name, MethodTrial(robot, ways, scenario, one, seen, options.seconds, options.rate)


def _told(options: Namespace, rows: Sequence[MethodRows]) -> Iterator[Block]:
    from vrs_cli.lab.bench import SCENARIOS
    from vrs_cli.render.blocks import Column, Grid, line, number_columns

    for delays in dict.fromkeys(row.delays for row in rows):
        some = [row for row in rows if row.delays == delays]
        yield line(f"{delays}; {options.seeds} x {options.seconds:g} s, {options.rate:g} Hz")
        for scenario in (row.scenario for row in some):
            yield line(f"  {scenario:<8}{SCENARIOS[scenario]}")
        yield line()
        yield line(VIEWED)
        columns = number_columns("mean deg", "95 % deg", "max deg", "mean mm", "jump deg")
        viewed = (
            (row.scenario, name.rpartition(":")[2], *map(_three, (it.mean, it.p95, it.most, it.mean_mm, it.jump)))
            for row in some
            for name, it in row.viewers.items()
        )
        yield Grid((Column("scenario"), Column("viewer"), *columns), tuple(viewed))
        followed = tuple(
            (row.scenario, name.rpartition(":")[2], *map(_three, (it.rms, it.most, it.lag, it.effort, 100 * it.held)))
            for row in some
            for name, it in row.controllers.items()
        )
        if followed:
            yield line()
            yield line(FOLLOWED)
            columns = number_columns("rms deg", "max deg", "lag s", "effort", "held %")
            yield Grid((Column("scenario"), Column("controller"), *columns), followed)
        yield line()


def _three(value: float) -> str:
    return f"{value:.3f}"


def _row_object(row: MethodRows) -> dict[str, object]:
    return {
        "delays": row.delays,
        "scenario": row.scenario,
        "viewers": {name: structs.asdict(it) for name, it in row.viewers.items()},
        "controllers": {name: structs.asdict(it) for name, it in row.controllers.items()},
    }
