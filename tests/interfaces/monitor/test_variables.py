"""Variables listed and deleted."""

from __future__ import annotations

import pytest

from tests.interfaces.monitor.people import at, last
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import VrsError
from vrs_cli.interfaces import replies
from vrs_cli.language.ast import Kind


def test_elements_and_whole_arrays() -> None:
    session = at(RecordingTerminal(), "a[1] = 1", "a[2] = 2", "b[1,2] = 3", "i = 1")
    session.perform("DELETER a[i+1], b")
    assert [variable.name for variable in session.environment.variables(Kind.REAL)] == ["a[1]", "i"]


def test_listr_is_a_desk_calculator() -> None:
    session = at(RecordingTerminal(), "n = 3", "LISTR n*2, SQRT(16)")
    assert last(session, replies.RealTable).rows == (("n*2", 6.0), ("SQRT(16)", 4.0))


@pytest.mark.parametrize("line", ["LISTL a", "LISTL a[1]", "LISTS a", "LISTR $s"])
def test_values_of_another_kind_are_refused(line: str) -> None:
    session = at(RecordingTerminal(), "a[1] = 1", '$s = "text"')
    with pytest.raises(VrsError, match="type mismatch"):
        session.perform(line)


def test_a_name_alone_is_the_variable_and_its_array() -> None:
    session = at(RecordingTerminal(), "a = 5", "a[1] = 1", "LISTR a", "LISTR A[1]")
    tables = [reply.rows for reply in session.terminal.replies]  # type: ignore[attr-defined]
    assert tables == [(("a", 5.0), ("a[1]", 1.0)), (("a[1]", 1.0),)]
