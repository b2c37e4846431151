"""The arguments of a program that is called: one reference for each parameter."""

from __future__ import annotations

from collections.abc import Sequence

from vrs_cli.errors import ArgumentMismatch
from vrs_cli.language.run.cells import Reference, new_variable
from vrs_cli.language.run.environment import Executable
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.text.ast import Variable
from vrs_cli.language.text.diagnostics import counted
from vrs_cli.language.words.kind import Kind, kind_of_name


def _omitted_argument(memory: Memory, parameter: Variable) -> Reference:
    """What stands for an argument that is not given: undefined until the program assigns it."""
    name = parameter.sigil + parameter.name
    is_array = parameter.indexes is not None
    return new_variable(memory.spelling, name, kind_of_name(name), array=is_array, omitted=name)


def _check_argument(program: Executable, parameter: Variable, given: Reference, arrays: frozenset[str]) -> Reference:
    name = f"{parameter.sigil}{parameter.name} of {program.name}"
    kind = kind_of_name(parameter.sigil)
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


def bind_arguments(memory: Memory, program: Executable, arguments: Sequence[Reference | None]) -> tuple[Reference, ...]:
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
        _omitted_argument(memory, parameter) if given is None else _check_argument(program, parameter, given, arrays)
        for parameter, given in zip(parameters, padded, strict=True)
    )
