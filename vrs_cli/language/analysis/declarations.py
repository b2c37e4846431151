"""AUTO, LOCAL and GLOBAL: which variables a program has for itself (V+ Language User's Guide p.36; val2 section 1).

AUTO makes a set of variables for each activation of a program, LOCAL one for the program, which keeps its values
between calls. All other variables are global, and GLOBAL says so. Declarations stand before the first other step.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from weakref import proxy

from msgspec.structs import replace

from vrs_cli.errors import ArgumentMismatch, CannotInterpret, InvalidName, MisplacedDeclaration, TypeMismatch
from vrs_cli.language.analysis.names import NameFindings
from vrs_cli.language.analysis.result import Own
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Expression, Program
from vrs_cli.language.words.instructions import DECLARATIONS
from vrs_cli.language.words.values import SIGIL_KINDS, Kind

SORTS: Mapping[str, Kind] = {"REAL": Kind.REAL, "DOUBLE": Kind.REAL, "LOC": Kind.LOCATION}


def own_variables(program: Program) -> tuple[Own, ...]:
    """What AUTO and LOCAL declare, each name once, in the order of the program."""
    found: dict[str, Own] = {}
    for statement in _declarations(program):
        for argument in statement.arguments:
            if isinstance(argument, ast.Variable) and statement.word != "GLOBAL":
                found.setdefault(argument.key, Own(argument, statement.word == "AUTO", argument.indexes is not None))
    for parameter in program.parameters:
        found.pop(parameter.key, None)
    plain = {key for key, own in found.items() if not own.array}
    for key in _first_used_as_arrays(program, plain) if plain else ():
        found[key] = replace(found[key], array=True)
    return tuple(found.values())


def _first_used_as_arrays(program: Program, keys: set[str]) -> Iterator[str]:
    """Yield the keys whose variable has an index where a step first names it. `keys` are used up."""
    for node in ast.nodes(tuple(step.statement for step in program.steps if not _declares(step.statement))):
        if isinstance(node, ast.Variable) and node.key in keys:
            keys.discard(node.key)
            if node.indexes is not None:
                yield node.key


def _declares(statement: ast.Statement | None) -> bool:
    return isinstance(statement, ast.Instruction) and statement.word in DECLARATIONS


def _declarations(program: Program) -> Iterator[ast.Instruction]:
    for step in program.steps:
        statement = step.statement
        if isinstance(statement, ast.Instruction) and statement.word in DECLARATIONS:
            yield statement
        elif statement is not None and not isinstance(statement, ast.BadLine):
            return


class Declarations:
    """Checks declarations one by one."""

    def __init__(self, names: NameFindings) -> None:
        self._names: NameFindings = proxy(
            names
        )  # which has this: in a cycle, the program would stay in memory for long
        self._declared: dict[str, str] = {}
        self._over = False

    def other(self) -> None:
        """Note a step that is no declaration: no declaration may follow."""
        self._over = True

    def check(self, statement: ast.Instruction) -> None:
        """Check one declaration."""
        if self._over:
            detail = f"{statement.word} stands after a step that does something"
            self._names.fault(MisplacedDeclaration, statement.span, detail, "declarations begin a program")
        for argument in statement.arguments:
            if argument is not None:
                self._check_name(argument, statement)

    def _check_name(self, argument: Expression, statement: ast.Instruction) -> None:
        if not isinstance(argument, ast.Variable):
            self._names.fault(InvalidName, argument.span, "a variable is wanted here")
            return
        name, key = argument.sigil + argument.name, argument.key
        if key in self._names.parameters:
            self._names.fault(ArgumentMismatch, argument.span, f"{name} is a parameter of the program")
        elif key in self._declared:
            self._names.fault(InvalidName, argument.span, f"{name} is in {self._declared[key]} too")
        elif not all(isinstance(index, ast.Number) for index in argument.indexes or ()):
            hint = f"{statement.word} {name}[]"
            self._names.fault(CannotInterpret, argument.span, "the size of an array is a number, or left out", hint)
        else:
            self._declare(argument, statement)
        self._declared.setdefault(key, statement.word)

    def _declare(self, variable: ast.Variable, statement: ast.Instruction) -> None:
        sort = statement.modifiers.sort
        kind = SORTS[sort] if sort is not None else None
        if variable.sigil and kind is not None and not (variable.sigil == "#" and kind is Kind.LOCATION):
            detail = f"{variable.sigil}{variable.name} is a {SIGIL_KINDS[variable.sigil].value}, not {sort}"
            self._names.fault(TypeMismatch, variable.span, detail)
        self._names.declare(variable, None if variable.sigil else kind, own=statement.word != "GLOBAL")
