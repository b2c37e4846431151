"""What no file holds."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.monitor.people import Person, at
from vrs_cli.interfaces.session.session import Session

PROGRAM = ".PROGRAM p\nMOVE part\nSET made = HERE\n.END\n"


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Session:
    monkeypatch.chdir(tmp_path)
    Path("cell.v2").write_text(PROGRAM + ".LOCATIONS\npart 500 150 -100 90 90 0\n.END\n.REALS\nn 1\n.END\n")
    return at(Person(), "LOAD cell")


def told(session: Session) -> tuple[list[str], list[str]]:
    """The programs, and the variables."""
    unstored = session.unstored
    return unstored.programs(), sorted(map(session.environment.name_of, unstored.items()))


def test_what_was_loaded_is_stored(session: Session) -> None:
    assert told(session) == ([], [])


def test_what_is_typed_is_not_until_it_is_stored(session: Session) -> None:
    for line in ("n = 2", "SET part = HERE", "row[3] = 1", '$s = "x"'):
        session.perform(line)
    session.load_text(".PROGRAM q\n.END\n")
    assert told(session) == (["q"], ["$s", "n", "part", "row[3]"])
    session.perform("STORER numbers")
    assert told(session) == (["q"], ["$s", "part"])
    session.perform("STORE all")
    assert told(session) == ([], [])


def test_a_value_that_is_as_it_was_needs_no_storing(session: Session) -> None:
    for line in ("n = 2", "n = 1"):
        session.perform(line)
    assert told(session) == ([], [])


def test_what_a_program_computes_needs_no_storing(session: Session) -> None:
    session.perform("EXECUTE p")
    assert "made" in {item[0] for item in session.environment.values()}
    assert told(session) == ([], [])
    session.perform("SET made = NULL")
    assert told(session) == ([], ["made"])


def test_what_was_typed_before_a_program_changes_it_does(session: Session) -> None:
    session.perform("SET made = NULL")
    session.perform("EXECUTE p")
    assert told(session) == ([], ["made"])


def test_an_edited_program_is_not_stored_and_one_left_as_it_was_is(session: Session) -> None:
    for line in ("EDIT p", "E"):
        session.perform(line)
    assert told(session) == ([], [])
    for line in ("EDIT p", "READY", "E"):
        session.perform(line)
    assert told(session) == (["p"], [])


def test_a_part_that_is_stored_alone(session: Session) -> None:
    session.load_text(".PROGRAM q\nMOVE b\n.END\n.PROGRAM r\n.END\n")
    session.perform("SET b = HERE")
    session.perform("SET c = HERE")
    session.perform("STORE one = q")
    assert told(session) == (["r"], ["c"])
