"""What a session has defined, for completion: every name with a note on it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from heapq import nsmallest

from vrs_cli.engine.parameters import PARAMETERS, SWITCHES
from vrs_cli.interfaces.conversation.complete import DefinedNames
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.words.values import Kind, numbers_of, plain
from vrs_cli.values.numbers import Value, count, fixed

MOST = 500  # names of a kind that are offered: a menu is for reading


def names_of(memory: Memory, branches: Iterable[str], begun: str = "") -> DefinedNames:
    """The first programs and variables (elements of arrays too) whose names begin so; all switches and parameters."""
    programs = memory.programs
    first = nsmallest(MOST, (key for key in programs if key.startswith(begun.lower())))
    return DefinedNames(
        programs={programs[key].name: count(len(programs[key].program.steps), "step") for key in first},
        variables=_Variables(memory, begun.lower()),
        switches={row.name: row.summary for row in SWITCHES.values()},
        branches=dict.fromkeys(branches, "branch"),
        parameters={row.name: row.summary for row in PARAMETERS.values()},
    )


class _Variables(Mapping[Kind, Mapping[str, str]]):
    """Names of each kind, collected on demand: most lines need those of one kind, or none."""

    def __init__(self, memory: Memory, begun: str) -> None:
        self._memory, self._begun = memory, begun

    def __getitem__(self, kind: Kind) -> Mapping[str, str]:
        rows = self._memory.first_variables(kind, MOST, self._begun)
        return {name: _noted(value, self._memory.units) for name, value in rows}

    def __iter__(self) -> Iterator[Kind]:
        return iter(Kind)

    def __len__(self) -> int:
        return len(Kind)


def _noted(value: Value, units: JointUnits) -> str:
    if isinstance(value, float | int):
        return plain(value)
    if isinstance(value, str):
        return f'"{value}"'
    return " ".join(fixed(number, 1) for number in numbers_of(value, units))
