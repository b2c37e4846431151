"""The sections of a file: variables with their values."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain

from vrs_cli.errors import VrsError
from vrs_cli.language.run.cells import Index, Item
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.text.ast import Entry, Number, Section
from vrs_cli.language.text.diagnostics import Diagnostic, error
from vrs_cli.language.words.values import whole


def define_sections(environment: Environment, sections: Iterable[Section]) -> tuple[Diagnostic, ...]:
    """Give the variables of a file their values; what is wrong with those that cannot be."""
    refused: list[Diagnostic] = []
    for entry in chain.from_iterable(section.entries for section in sections):
        try:
            environment.define(entry)
        except VrsError as wrong:
            refused.append(error(type(wrong), entry.span, wrong.detail, wrong.hint))
    return tuple(refused)


def item_of(entry: Entry) -> Item:
    """The variable that a line of a section defines."""
    indexes = tuple(whole(number.value) for number in entry.variable.indexes or () if isinstance(number, Number))
    index: Index | None = None if not indexes else indexes if len(indexes) > 1 else indexes[0]
    return entry.variable.key, index
