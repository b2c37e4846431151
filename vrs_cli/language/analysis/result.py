"""The result of an analysis: a program with what its text decides."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from functools import cached_property

from msgspec import Struct

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program
from vrs_cli.language.words.values import Kind
from vrs_cli.values.diagnostics import Diagnostic, Severity


class BlockKind(Enum):
    IF = "IF"
    WHILE = "WHILE"
    DO = "DO"
    FOR = "FOR"
    CASE = "CASE"


class Block(Struct, frozen=True):
    """A control structure, as step indexes from 0. `middles`: ELSE, or VALUE and ANY; `closer`: END or UNTIL."""

    kind: BlockKind
    opener: int
    middles: tuple[int, ...]
    closer: int


class Own(Struct, frozen=True, dict=True):
    """A variable of a program's own; `automatic`: of AUTO; `array`: declared as one, or first used as one."""

    variable: ast.Variable
    automatic: bool
    array: bool

    @cached_property
    def key(self) -> str:
        return self.variable.key


class Analysis(Struct, frozen=True):
    """A program with what its text decides.

    `kinds`: REAL or LOCATION for each bare name (`Variable.key`) whose use decides it, parameters included.
    `labels`: step index of each label. `needs`: the keys of names that other programs must give a value, `calls`: those
    of the programs that are called, `functions`: those of variables that other programs could have, and that are
    functions here: what else in memory the findings depend on. `own`: the variables of AUTO and LOCAL.
    """

    program: Program
    kinds: Mapping[str, Kind]
    blocks: tuple[Block, ...]
    labels: Mapping[int, int]
    diagnostics: tuple[Diagnostic, ...]
    needs: frozenset[str] = frozenset()
    calls: frozenset[str] = frozenset()
    functions: frozenset[str] = frozenset()
    own: tuple[Own, ...] = ()

    @property
    def executable(self) -> bool:
        return not any(diagnostic.severity is Severity.ERROR for diagnostic in self.diagnostics) and not any(
            isinstance(step.statement, ast.BadLine) for step in self.program.steps
        )
