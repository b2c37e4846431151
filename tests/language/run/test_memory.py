"""Programs by name."""

from __future__ import annotations

import gc
from weakref import ref

import pytest

from tests.language.running import environment_with, program
from vrs_cli.errors import UndefinedName
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.words.values import Kind


def test_a_program_that_is_not_there_has_a_near_name() -> None:
    environment = environment_with(program(name="Pick.place"))
    assert environment.program("PICK.PLACE").name == "Pick.place"
    with pytest.raises(UndefinedName, match=r"did you mean Pick\.place\?"):
        environment.program("pick.plase")


def test_the_source_of_a_step_is_as_it_was_written() -> None:
    stored = environment_with(program("  x   =1 ; one", "", "y = 2")).program("main")
    assert [stored.source(step) for step in range(3)] == ["x   =1 ; one", "", "y = 2"]


def test_a_copy_is_freed_without_the_collector_of_cycles() -> None:
    memory = Memory()
    memory.put_back(("row", 3), 1.0)
    gc.disable()
    try:
        copied = memory.copy()
        cells = [ref(copied.cells(kind, array)) for kind in Kind for array in (None, "row")]
        del copied
        assert [cell() for cell in cells] == [None] * len(cells)
    finally:
        gc.enable()
