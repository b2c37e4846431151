"""Carry out `vrs lab experiment`: measure the effect of delays on commands, and on the view of a remote robot. The
experiment `delays` is in this module, all others are in `other_experiments.py`."""

from __future__ import annotations

import gc
from argparse import Namespace
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import groupby, product
from operator import attrgetter
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.cli import commands, main, other_experiments
from vrs_cli.cli.command_line import CommandLineError, chosen_robot
from vrs_cli.cli.other_experiments import lines_of, outcomes, print_rows
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.lab.delays import Error, Strategy, Trial, TrialOutcome, outcome_of, together
from vrs_cli.net.delay_line import DelayWays
from vrs_cli.render.blocks import PIPE, Block, Column, Grid, line, number_column, number_columns
from vrs_cli.render.chart import WIDTH, chart
from vrs_cli.render.plots import Curves, check_plot, plot_panels
from vrs_cli.values import numbers, replies


class Experiment(NamedTuple):
    """An experiment. `run`: carries it out and returns the exit status. `options`: the names of its options, among
    those in OWN_DEFAULTS. `defaults`: the default values that differ from OWN_DEFAULTS."""

    run: Callable[[Namespace], int]
    options: tuple[str, ...]
    defaults: Mapping[str, object]


OWN_DEFAULTS: dict[str, object] = {  # default values of options that only some experiments have
    "lead": (0.0, 0.2, 0.4, 0.6, 0.8),  # [s] from the issue of a command to the start of its motion
    "policy": ("ABORT", "POSTPONE"),
    "seeds": 20,
    "seconds": 200.0,
    "rate": 25.0,
    "plot": None,
    "viewer": (),
    "controller": (),
    "scenario": None,
    "file": None,
    "participant": None,
    "out": None,
    "dry_run": False,
}
CHARTED = {
    "predicted": "p",
    "deltas": "d",
    "ahead": "a",
    "preview": "w",
}  # curves of a plot, and their characters on a terminal; `frames` is left out: its error is much larger


def experiment(options: Namespace) -> int:
    """Run an experiment; return the exit status. Raises CommandLineError for options that the experiment does not
    have."""
    if options.what is None:
        if not (options.viewer or options.controller):
            raise CommandLineError("which experiment?", f"one of {', '.join(EXPERIMENTS)}")
        options.what = "methods"
    kind = EXPERIMENTS[options.what]
    for name, default in OWN_DEFAULTS.items():
        given = getattr(options, name)
        if name not in kind.options:
            if given not in (None, False):
                others = " and ".join(what for what, one in EXPERIMENTS.items() if name in one.options)
                if name == "file":
                    raise CommandLineError(f"one argument too many: {options.file}", f"see {options.prog} --help")
                raise CommandLineError(f"--{name.replace('_', '-')} is of vrs lab experiment {others}", "leave it out")
        elif given is None:
            setattr(options, name, kind.defaults.get(name, default))
    return kind.run(options)


def _delays(options: Namespace) -> int:
    """Try all cases and print tables. Flags mark times at which the view of the robot may be wrong. Return 1 if the
    flagged times differ from those in the logs of both sides, or if the view by `deltas` has an error at another
    time."""
    picture = options.plot if options.plot != commands.STANDARD_STREAM else None
    if picture is not None:
        check_plot(picture)
    robot = chosen_robot(options)
    cases = [
        (name, Trial(robot, DelayWays(forward, backward, options.seed), lead, policy, options.seconds, options.rate))
        for (name, forward, backward), policy, lead in product(lines_of(options), options.policy, options.lead)
    ]
    found = outcomes(_outcome, [trial for _, trial in cases], options)
    rows = [ExperimentRow(name, trial, together(part)) for (name, trial), part in zip(cases, found, strict=True)]
    print_rows(options, rows, _row_object, _report)
    if picture is not None:
        panels = [one._replace(title=f"{one.title} [deg]") for one in _drawings(rows)]
        if not panels:
            raise CommandLineError("a curve needs two leads at which the robot moves", "--lead 0.2 0.4 0.6")
        plot_panels(picture, "lead [s]", panels, "Mean error of what is seen")
    return main.OK if all(row.sound for row in rows) else main.FAILED


# --- trials ------------------------------------------------------------------------------------------------------


class ExperimentRow(Struct, frozen=True):
    """A row of the tables. `delays`: the delays as text. `trial`: the trial of the first seed. `outcome`: the outcome
    over all seeds."""

    delays: str
    trial: Trial
    outcome: TrialOutcome

    @property
    def sound(self) -> bool:
        """Return whether the flagged times agree with the logs of both sides, and the view by `deltas` has no error at
        other times."""
        outside = self.outcome.outside
        return self.outcome.agreed and outside.most_degrees == outside.most_mm == 0.0

    @property
    def has_moved(self) -> bool:
        """Return whether the robot has moved, that is, whether at least one command was not aborted."""
        return self.outcome.aborted < self.outcome.commands


def _outcome(trial: Trial) -> TrialOutcome:
    """Return the outcome of a trial. Garbage collection is off during the trial: a trial leaves no cyclic garbage, and
    searching for it takes a tenth of the time."""
    gc.disable()
    try:
        return outcome_of(trial)
    finally:
        gc.enable()
        gc.collect()


# --- tables ------------------------------------------------------------------------------------------------------


def _report(options: Namespace, rows: Sequence[ExperimentRow]) -> Iterator[Block]:
    for name, group in groupby(rows, lambda row: row.delays):
        some = list(group)
        yield from _tables(options, name, some)
        if options.plot == commands.STANDARD_STREAM:
            yield from _charts(some)
        yield line()
    agreed = "are" if all(row.outcome.agreed for row in rows) else "ARE NOT"
    trials = numbers.count(options.seeds * len(rows), "trial")
    yield line(f"The flagged times {agreed} those of the logs of both sides ({trials})")
    outside = [row.outcome.outside for row in rows]
    degrees, mm = max(one.most_degrees for one in outside), max(one.most_mm for one in outside)
    yield line(f"At all other times the error of deltas is at most {degrees:g} deg, {mm:g} mm")


def _tables(options: Namespace, delays: str, rows: Sequence[ExperimentRow]) -> Iterator[Block]:
    first = rows[0].outcome
    each = f"{options.seeds} x {options.seconds:g} s, {first.commands / options.seeds:.0f} commands each"
    median, most = first.round_trip
    yield line(f"{delays}; {each}")
    yield line(f"Measured: D_f + D_b is {median:.3f} s (median), up to {most:.3f} s (95 of 100)")
    yield line()
    yield _grid(rows, ("aborted %", "postponed %", "flagged %", "unconfirmed %"), _shares)
    strategies = tuple(strategy.value for strategy in Strategy)
    for unit, name in (("deg", "degrees"), ("mm", "mm")):
        yield line()
        yield line(f"Mean error [{unit}]")
        yield _grid(rows, strategies, partial(_errors, attrgetter(name)))


def _grid(
    rows: Sequence[ExperimentRow], headings: Sequence[str], cells: Callable[[ExperimentRow], tuple[str, ...]]
) -> Grid:
    columns: tuple[Column, ...] = (Column("policy"), number_column("lead s", 6), *number_columns(*headings))
    return Grid(columns, tuple((row.trial.policy, f"{row.trial.lead:g}", *cells(row)) for row in rows))


def _shares(row: ExperimentRow) -> tuple[str, ...]:
    it = row.outcome
    return tuple(
        f"{100.0 * x:.2f}" for x in (it.aborted / it.commands, it.postponed / it.commands, it.flagged, it.unconfirmed)
    )


def _errors(of: Callable[[Error], float], row: ExperimentRow) -> tuple[str, ...]:
    """Return the mean error of each strategy (a way to show the robot) as text, or dashes if the robot has not
    moved."""
    return tuple(f"{of(error):.3f}" if row.has_moved else "-" for error in row.outcome.errors.values())


# --- plots -------------------------------------------------------------------------------------------------------


def _drawings(rows: Sequence[ExperimentRow]) -> Iterator[Curves]:
    """Yield the curves of the mean error [deg] over the lead [s] for each policy and each setting of the delays. They
    contain only leads at which the robot moved."""
    for (name, policy), group in groupby(rows, lambda row: (row.delays, row.trial.policy)):
        some = sorted((row for row in group if row.has_moved), key=lambda row: row.trial.lead)
        errors = [{strategy.value: error.degrees for strategy, error in row.outcome.errors.items()} for row in some]
        columns = [[each[strategy] for each in errors] for strategy in CHARTED]
        if len(some) > 1:
            yield Curves(f"{policy}, {name}", tuple(CHARTED), columns, [row.trial.lead for row in some])


def _charts(rows: Sequence[ExperimentRow]) -> Iterator[Block]:
    for one in _drawings(rows):
        first, last = one.along[0], one.along[-1]
        even = tuple(first + (last - first) * k / (WIDTH - 1) for k in range(WIDTH))
        curves = (
            replies.Curve(name, CHARTED[name], tuple(_between(one.along, values, lead) for lead in even))
            for name, values in zip(one.names, one.columns, strict=True)
        )
        yield line()
        yield from chart(replies.Plot(f"Mean error over the lead, {one.title}", "deg", even, tuple(curves)), PIPE)


def _between(at: Sequence[float] | Floats, values: Sequence[float] | Floats, x: float) -> float:
    """Return the value at x, linearly interpolated. `at`: the ascending positions of the values."""
    right = min(max(bisect_right(at, x), 1), len(at) - 1)
    part = (x - at[right - 1]) / (at[right] - at[right - 1])
    return values[right - 1] + part * (values[right] - values[right - 1])


def _row_object(row: ExperimentRow) -> dict[str, object]:
    it = row.outcome
    errors = {
        strategy.value: {"mean_deg": one.degrees, "max_deg": one.most_degrees, "mean_mm": one.mm, "max_mm": one.most_mm}
        for strategy, one in it.errors.items()
    }
    return {
        "delays": row.delays,
        "policy": row.trial.policy,
        "lead_s": row.trial.lead,
        "commands": it.commands,
        "aborted": it.aborted,
        "postponed": it.postponed,
        "flagged": it.flagged,
        "unconfirmed": it.unconfirmed,
        "round_trip_s": {"median": it.round_trip[0], "95": it.round_trip[1]},
        "errors": errors if row.has_moved else None,
        "flags_agree": it.agreed,
        "unflagged_error": {"max_deg": it.outside.most_degrees, "max_mm": it.outside.most_mm},
    }


EXPERIMENTS: dict[str, Experiment] = {
    "delays": Experiment(_delays, ("lead", "policy", "seeds", "seconds", "rate", "plot"), {}),
    "methods": Experiment(
        other_experiments.run_methods,
        ("viewer", "controller", "scenario", "seeds", "seconds", "rate"),
        {"seeds": 5, "seconds": 30.0},
    ),
    "twin": Experiment(
        other_experiments.run_twin,
        ("lead", "policy", "scenario", "seeds", "seconds", "plot"),
        {"lead": (0.2, 0.6), "policy": ("ABORT",), "seeds": 2, "seconds": 40.0},
    ),
    "study": Experiment(other_experiments.run_study, ("file", "participant", "out", "dry_run"), {}),
}
