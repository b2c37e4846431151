"""The command analyzer: is a program, or a line, one that can be carried out? All findings at once, none raised."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from vrs_cli.language.ast import Kind, Program
from vrs_cli.language.diagnostics import Diagnostic, Severity


class BlockKind(Enum):
    IF = "IF"
    WHILE = "WHILE"
    DO = "DO"
    FOR = "FOR"
    CASE = "CASE"


@dataclass(frozen=True, slots=True)
class Block:
    """A control structure, as step indexes from 0. `middles`: ELSE, or VALUE and ANY; `closer`: END or UNTIL."""

    kind: BlockKind
    opener: int
    middles: tuple[int, ...]
    closer: int


@dataclass(frozen=True)
class Analysis:
    """A program with what its text decides.

    `kinds`: REAL or LOCATION for each bare name (`Variable.key`) whose use decides it, parameters included.
    `labels`: step index of each label.
    """

    program: Program
    kinds: Mapping[str, Kind]
    blocks: tuple[Block, ...]
    labels: Mapping[int, int]
    diagnostics: tuple[Diagnostic, ...]

    @property
    def executable(self) -> bool:
        return all(diagnostic.severity is not Severity.ERROR for diagnostic in self.diagnostics)
