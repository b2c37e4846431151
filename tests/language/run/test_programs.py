"""A program as it was stored."""

from __future__ import annotations

from tests.language.running import environment_with, program


def test_the_source_of_a_step_is_as_it_was_written() -> None:
    stored = environment_with(program("  x   =1 ; one", "", "y = 2")).program("main")
    assert [stored.source(step) for step in range(3)] == ["x   =1 ; one", "", "y = 2"]
