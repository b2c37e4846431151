"""ALTER at the prompt: what it displaces is taken back and done again with it."""

from __future__ import annotations

import pytest

from vrs_cli.interfaces.session.session import Session


def height(session: Session) -> float:
    """Where a line to a height of -100 mm ends."""
    session.perform("MOVES TRANS(450, 200, -100, 90, 90, 0)")
    reached = session.engine.position(session.engine.end).T_world_tool.pz * 1000.0
    session.perform("UNDO")
    return round(reached, 3)


@pytest.mark.parametrize("mode", [2, 3])
def test_undo_takes_back_what_alter_displaces(session: Session, mode: int) -> None:
    both = -73.0 if mode == 3 else -93.0
    for line in ("MOVE TRANS(500, 150, -100, 90, 90, 0)", f"ALTON {mode}", "ALTER ,,20", "ALTER ,,7"):
        session.perform(line)
    assert height(session) == both
    for lines, reached in (
        (("UNDO",), -80.0),
        (("UNDO", "REDO"), -80.0),
        (("ALTER ,,7",), both),
        (("UNDO 2", "REDO"), -80.0),
        (("UNDO",), -100.0),
    ):
        for line in lines:
            session.perform(line)
        assert height(session) == reached


def test_what_was_altered_before_alton_is_not_displaced_again(session: Session) -> None:
    for line in (
        "MOVE TRANS(500, 150, -100, 90, 90, 0)",
        "ALTON 3",
        "ALTER ,,20",
        "ALTOFF",
        "ALTON 3",
        "ALTER ,,7",
        "UNDO",
    ):
        session.perform(line)
    assert height(session) == -100.0
    session.perform("ALTOFF")
    session.perform("UNDO")
    assert height(session) == -100.0
