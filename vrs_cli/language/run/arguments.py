"""The arguments of a program that is called: one reference for each parameter."""

from __future__ import annotations

from collections.abc import Sequence

from vrs_cli.errors import ArgumentMismatch
from vrs_cli.language.run.environment import NO_CELLS, Cells, Environment, Reference, StoredProgram
from vrs_cli.language.text.ast import Variable
from vrs_cli.language.text.diagnostics import counted
from vrs_cli.language.words.kind import SIGIL_KINDS, Kind


def _left_out(environment: Environment, parameter: Variable) -> Reference:
    """What stands for an argument that is not given: undefined until the program assigns it."""
    name = parameter.sigil + parameter.name
    kind = SIGIL_KINDS.get(parameter.sigil, Kind.REAL)
    locations = NO_CELLS if parameter.sigil else Cells(environment, Kind.LOCATION, omitted=name)
    key = None if parameter.indexes is not None else name
    return Reference(Cells(environment, kind, omitted=name), locations, key)


def _checked_argument(
    program: StoredProgram, parameter: Variable, given: Reference, arrays: frozenset[str]
) -> Reference:
    name = f"{parameter.sigil}{parameter.name} of {program.name}"
    kind = SIGIL_KINDS.get(parameter.sigil, Kind.REAL)
    if given.cells.kind is not kind:
        wanted = kind.value if parameter.sigil else "real or a transformation"
        raise ArgumentMismatch(f"{name} is given a {given.cells.kind.value}", f"a {wanted} is wanted")
    if (given.key is None) is not (parameter.key in arrays):
        wanted, got = ("an array", "one value") if given.key is not None else ("one value", "an array")
        raise ArgumentMismatch(f"{name} is given {got}", f"{wanted} is wanted")
    decided = program.analysis.kinds.get(parameter.key)
    wrong = given.locations if decided is Kind.REAL else given.cells
    if decided is not None and given.key in wrong:
        raise ArgumentMismatch(f"{name}: {given.name} is not a {decided.value}", f"a {decided.value} is wanted")
    return given


def bind(
    environment: Environment, program: StoredProgram, arguments: Sequence[Reference | None]
) -> tuple[Reference, ...]:
    """One reference for each parameter. Raises ArgumentMismatch."""
    parameters = program.program.parameters
    if len(arguments) > len(parameters):
        raise ArgumentMismatch(
            f"{program.name} is given {counted(len(arguments), 'argument')}",
            f"it has {counted(len(parameters), 'parameter')}",
        )
    arrays = program.compiled.array_parameters
    padded = (*arguments, *(None,) * (len(parameters) - len(arguments)))
    return tuple(
        _left_out(environment, parameter) if given is None else _checked_argument(program, parameter, given, arrays)
        for parameter, given in zip(parameters, padded, strict=True)
    )
