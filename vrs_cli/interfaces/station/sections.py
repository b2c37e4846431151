"""The sections of a file: variables with their values."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain

from vrs_cli.errors import VrsError
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.text.ast import Section
from vrs_cli.language.text.diagnostics import Diagnostic, error


def define_sections(environment: Environment, sections: Iterable[Section]) -> tuple[Diagnostic, ...]:
    """Give the variables of a file their values; what is wrong with those that cannot be."""
    refused: list[Diagnostic] = []
    for entry in chain.from_iterable(section.entries for section in sections):
        try:
            environment.define(entry)
        except VrsError as wrong:
            refused.append(error(type(wrong), entry.span, wrong.detail, wrong.hint))
    return tuple(refused)
