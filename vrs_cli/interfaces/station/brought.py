"""What a file brings into memory: its programs, analysed among those that are there, and its variables."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, Self

from vrs_cli.errors import VrsError
from vrs_cli.files.layout import Layout
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.analysis.analyzer import Analysis, analyze_among
from vrs_cli.language.analysis.lineage import program_beyond_val2
from vrs_cli.language.analysis.surroundings import Surroundings
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.run.variables import Variables
from vrs_cli.language.text.ast import File, Program, Section
from vrs_cli.language.text.suppression import heeded
from vrs_cli.values.diagnostics import Diagnostic, error


class Brought(NamedTuple):
    """`lines`: those of the file. `diagnostics`: what is wrong with what it means."""

    file: File
    lines: tuple[str, ...]
    layout: Layout
    variables: Variables
    analyses: tuple[Analysis, ...]
    diagnostics: tuple[Diagnostic, ...]

    @classmethod
    def of(cls, file: File, text: str, memory: Memory, *, vplus: bool) -> Self:
        """`memory`: a copy of what is there."""
        variables, refused = variables_of((part for part in file.parts if isinstance(part, Section)), memory.units)
        programs = {part.key: part for part in file.parts if isinstance(part, Program)}
        memory.take(variables)
        everything = {key: stored.program for key, stored in memory.programs.items()} | programs
        surroundings = Surroundings(memory.kinds(), everything)
        analyses = tuple(analyze_among(surroundings, program) for program in programs.values())
        diagnostics = list(refused)
        for analysis in analyses:
            diagnostics += analysis.diagnostics
            diagnostics += () if vplus else program_beyond_val2(analysis.program)
        lines = tuple(text.split("\n"))
        return cls(file, lines, Layout.of(file), variables, analyses, heeded(lines, diagnostics))


def variables_of(sections: Iterable[Section], units: JointUnits) -> tuple[Variables, tuple[Diagnostic, ...]]:
    """The variables of a file with their values; what is wrong with those that cannot be."""
    variables, refused = Variables(units), list[Diagnostic]()
    for section in sections:
        for entry in section.entries:
            try:
                variables.define(entry)
            except VrsError as wrong:
                refused.append(error(type(wrong), entry.span, wrong.detail, wrong.hint))
    return variables, tuple(refused)
