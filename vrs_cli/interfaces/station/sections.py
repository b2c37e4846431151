"""The sections of a file: variables with their values."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain

from vrs_cli.dialogue.talk import Slice, Talk
from vrs_cli.errors import VrsError
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.text.ast import Section
from vrs_cli.language.text.diagnostics import Diagnostic, error

AT_ONCE = 200  # variables, before whoever waits may have his turn


def define_sections(environment: Environment, sections: Iterable[Section]) -> Talk[tuple[Diagnostic, ...]]:
    """Give the variables of a file their values, a part at a time; what is wrong with those that cannot be."""
    refused: list[Diagnostic] = []
    for number, entry in enumerate(chain.from_iterable(section.entries for section in sections), 1):
        try:
            environment.define(entry)
        except VrsError as wrong:
            refused.append(error(type(wrong), entry.span, wrong.detail, wrong.hint))
        if not number % AT_ONCE:
            yield Slice.MORE
    return tuple(refused)
