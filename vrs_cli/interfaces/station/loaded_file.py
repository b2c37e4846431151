"""The contents of a file for the memory: its programs, analysed among those that are there, and its variables."""

from __future__ import annotations

from collections.abc import Mapping
from operator import itemgetter
from types import MappingProxyType
from typing import NamedTuple, Self

from vrs_cli.errors import FileDamaged, IllegalValue, VrsError
from vrs_cli.files.store import Layout
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.analysis.analyzer import Surroundings, analyze_among
from vrs_cli.language.analysis.lineage import beyond
from vrs_cli.language.run.memory import Memory, StoredProgram
from vrs_cli.language.run.variables import Variables
from vrs_cli.language.text.ast import AXES, Entry, File, Program, Section
from vrs_cli.language.text.collector import free_in_parts
from vrs_cli.language.text.source import heeded
from vrs_cli.language.words.values import rounding
from vrs_cli.values.diagnostics import Diagnostic, error, first_error, warning

NO_PROGRAMS: Mapping[str, Program] = MappingProxyType({})
LONG_TEXT = 1000  # characters that are parsed in some milliseconds
LONG_PROGRAM = 100  # steps that are compiled in some milliseconds
LEAST_TOLD = 1e-6  # rounding of a number of an axis: that of single precision is less


class LoadedFile(NamedTuple):
    """`variables`: those of the sections without a mistake. `diagnostics`: what is wrong with what it means."""

    file: File
    layout: Layout
    variables: Variables
    programs: tuple[StoredProgram, ...]
    diagnostics: tuple[Diagnostic, ...]

    @classmethod
    def of(
        cls, file: File, text: str, memory: Memory, *, vplus: bool, beside: Mapping[str, Program] = NO_PROGRAMS
    ) -> Self:
        """`memory`: a copy of what is there. `beside`: the programs of files that are loaded with it, by key."""
        programs = {part.key: part for part in file.parts if isinstance(part, Program)}
        variables, diagnostics = Variables(memory.units), list[Diagnostic]()
        for section in file.parts:
            if isinstance(section, Section):
                its, found = variables_of(section, memory.units)
                diagnostics += found
                memory.take(its)  # so that not every use of a name is told of too
                if section.whole and first_error(found) is None:
                    variables.take(its)
        everything = {key: stored.program for key, stored in memory.programs.items()} | {**beside, **programs}
        surroundings = Surroundings(memory.kinds, everything)
        lines = tuple(text.split("\n"))
        stored = tuple(StoredProgram(analyze_among(surroundings, program), lines) for program in programs.values())
        for one in stored:
            free_in_parts(one.program, one.program.steps, lines)
            diagnostics += one.analysis.diagnostics
            diagnostics += () if vplus else beyond(one.program, vplus=False)
        return cls(file, Layout.of(file), variables, stored, heeded(lines, diagnostics))


def variables_of(section: Section, units: JointUnits) -> tuple[Variables, tuple[Diagnostic, ...]]:
    """The variables of a section with their values; what is wrong with those that cannot be, and the largest rounding
    of a transformation.
    """
    variables, found = Variables(units), list[Diagnostic]()
    rounded = list[tuple[float, Entry]]()
    for entry in section.entries:
        name = entry.variable.sigil + entry.variable.name
        try:
            variables.define(entry)
        except VrsError as wrong:
            found.append(error(type(wrong), entry.span, f"{name}: {wrong.detail}", wrong.hint))
            continue
        if len(entry.numbers) == AXES and not entry.variable.sigil and (by := rounding(entry.numbers)) > LEAST_TOLD:
            rounded.append((by, entry))
    if rounded:
        by, worst = max(rounded, key=itemgetter(0))
        others = f", and those of {len(rounded) - 1} more in this section by less" if len(rounded) > 1 else ""
        what = f"{worst.variable.name}: its axes are rounded by {by:.1G}{others}"
        found.append(warning(IllegalValue, worst.span, what, "the nearest rotation is taken"))
    if not section.whole or first_error(found):
        found.append(
            warning(FileDamaged, section.span, f"nothing of {section.name} is loaded", "a line of it is wrong")
        )
    return variables, tuple(found)
