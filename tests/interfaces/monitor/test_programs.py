"""Programs in memory."""

from __future__ import annotations

import pytest

from tests.interfaces.monitor.people import at, last, loaded
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import ProgramExists, UndefinedName, UndefinedValue
from vrs_cli.values import replies


def test_delete_takes_what_nobody_else_uses() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DELETE main")
    assert list(session.environment.programs) == ["shared", "other"]
    assert sorted(session.environment.kinds) == ["x", "z"]


def test_delete_of_a_called_program_leaves_what_others_need() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DELETE shared")
    assert list(session.environment.programs) == ["main", "helper", "other"]
    assert sorted(session.environment.kinds) == ["only.here", "x", "y", "z"]


def test_deletep_takes_the_program_alone() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DELETEP main, other")
    assert list(session.environment.programs) == ["helper", "shared"]
    assert len(session.environment.kinds) == 4


def test_listp_marks_every_step_that_has_a_mistake() -> None:
    session = at(RecordingTerminal())
    lines = ("MOVEE a", "MOVE", "NEXT", "ELSEIF x THEN", "x = 1", "x = dx", 'y = "a"', "TYPE 1,", "IF x THEN")
    session.load_text("\n".join((".PROGRAM p", *lines, ".END", "")))
    session.perform("LISTP p")
    steps = last(session, replies.ProgramText).steps
    assert [step.text.strip() for step in steps if not step.bad] == ["x = 1", "x = dx"]


def test_zero_forgets_the_last_program() -> None:
    session = loaded(RecordingTerminal())
    session.perform("EXECUTE other")
    session.perform("ZERO")
    assert (session.last_program, session.task) == (None, None)


@pytest.mark.parametrize(
    ("line", "error"),
    [("DELETEL nothing", UndefinedValue), ("DELETEP nothing", UndefinedName), ("COPY main = other", ProgramExists)],
)
def test_what_cannot_be_deleted_or_copied(line: str, error: type[Exception]) -> None:
    with pytest.raises(error):
        loaded(RecordingTerminal()).perform(line)


def test_directory_by_pattern() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DIRECTORY *HE*")
    assert [row.name for row in last(session, replies.ProgramNames).rows] == ["helper", "other"]
