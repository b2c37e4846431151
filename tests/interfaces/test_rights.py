"""Roles and words: who may say what."""

from __future__ import annotations

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import RoleWanted
from vrs_cli.interfaces.rights import check_may, need_of
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.text.ast import ProgramHeader
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import Role, Route


def check(line: str, role: Role) -> None:
    statement = parse_prompt(line, frozenset())
    assert statement is not None
    assert not isinstance(statement, ProgramHeader)
    check_may(*need_of(statement), role)


@pytest.mark.parametrize("line", ["WHERE", "WHERE AT 3", "LISTL", "HELP", "TYPE 1", "1 + 2", "DO TYPE 1", "PLOT"])
def test_an_observer_sees(line: str) -> None:
    check(line, Role.OBSERVER)


@pytest.mark.parametrize(
    ("line", "word", "role"),
    [
        ("MOVE part", "MOVE", "a designer"),
        ("DO MOVE part", "MOVE", "a designer"),
        ("ABORT", "ABORT", "a designer"),
        ("SPEED 50", "SPEED", "a designer"),
        ("ENABLE CP", "ENABLE", "a supervisor"),
        ("EXECUTE pick", "EXECUTE", "a supervisor"),
        ("x = 3", "a change of a variable", "a supervisor"),
    ],
)
def test_an_observer_is_refused_by_name(line: str, word: str, role: str) -> None:
    with pytest.raises(RoleWanted, match=rf"\*Not in your role\* {word}.* is for {role} \(you are an observer\)"):
        check(line, Role.OBSERVER)


def test_a_designer_moves_and_does_not_see() -> None:
    for line in ("MOVES part AT 2", "READY", "OPENI", "JOG Z, 10", "DELAY 1", "ABORT", "SPEED 50", "DO SPEED 30"):
        check(line, Role.DESIGNER)
    with pytest.raises(RoleWanted, match="WHERE is for an observer"):
        check("WHERE", Role.DESIGNER)


def test_a_supervisor_does_all_of_it() -> None:
    assert Role.OBSERVER in Role.SUPERVISOR
    assert Role.DESIGNER in Role.SUPERVISOR
    assert (Role.OBSERVER | Role.DESIGNER) != Role.SUPERVISOR
    for line in ("WHERE", "MOVE part", "ABORT"):
        check(line, Role.SUPERVISOR)


def test_a_session_refuses_what_is_not_for_the_role() -> None:
    session = Session(RecordingTerminal())
    session.user_state.role = Role.OBSERVER
    session.perform("WHERE")
    with pytest.raises(RoleWanted, match="READY is for a designer"):
        session.perform("READY")
    session.user_state.role = Role.DESIGNER
    session.perform("READY")
    with pytest.raises(RoleWanted, match="EXECUTE is for a supervisor"):
        session.perform("EXECUTE pick")


def test_every_motion_is_a_designers() -> None:
    for row in INSTRUCTIONS.values():
        assert (row.route is not Route.MOTION) or row.role is Role.DESIGNER
    assert COMMANDS["UNDO"].role is Role.SUPERVISOR
