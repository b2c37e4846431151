"""What a session has defined, for completion: every name with a note on it."""

from __future__ import annotations

from vrs_cli.engine.parameters import PARAMETERS, SWITCHES
from vrs_cli.interfaces.conversation.complete import Names
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.words.values import Kind, numbers_of, plain
from vrs_cli.values.numbers import Value, count, fixed

MOST = 500  # names of a kind that are offered: a menu is for reading


def names_of(station: Station) -> Names:
    """All programs, variables (elements of arrays too), switches and parameters."""
    environment = station.environment
    return Names(
        programs={stored.name: count(len(stored.program.steps), "step") for stored in environment.programs.values()},
        variables={kind: _variables(station, kind) for kind in Kind},
        switches={row.name: row.summary for row in SWITCHES.values()},
        branches=dict.fromkeys(station.branches.names, "branch"),
        parameters={row.name: row.summary for row in PARAMETERS.values()},
    )


def _variables(station: Station, kind: Kind) -> dict[str, str]:
    rows = station.environment.variables(kind)
    units = station.environment.units
    return {name: _noted(value, units) for (name, value), _ in zip(rows, range(MOST), strict=False)}


def _noted(value: Value, units: JointUnits) -> str:
    if isinstance(value, float | int):
        return plain(value)
    if isinstance(value, str):
        return f'"{value}"'
    return " ".join(fixed(number, 1) for number in numbers_of(value, units))
