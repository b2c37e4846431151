"""Every word of the tables as a variable at the prompt, and through STORE and LOAD."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.monitor.people import at, last
from tests.interfaces.terminals import RecordingTerminal
from tests.laws.test_name_laws import WORDS
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.words.instructions import RESERVED
from vrs_cli.language.words.values import NAME_LENGTH, Kind
from vrs_cli.values import replies

NAMES = [word.lower() for word in WORDS if word not in RESERVED]
VALUES = {name: float(number) for number, name in enumerate(NAMES)}


@pytest.fixture
def session() -> Session:
    return at(RecordingTerminal(), *(f"{name} = {value:.0f}" for name, value in VALUES.items()))


def reals(session: Session) -> dict[str, object]:
    return {one.name: one.value for one in session.environment.variables(Kind.REAL)}


def test_every_word_is_assigned_listed_changed_and_deleted(session: Session) -> None:
    assert reals(session) == VALUES
    for name, value in VALUES.items():
        session.perform(f"LISTR {name}+1, {name}")
        assert last(session, replies.RealTable).rows == ((f"{name}+1", value + 1), (name, value))
        session.perform(f"DO {name} = {name}*2")
        session.perform(f"TYPE {name}, -{name}")
        session.perform(f"DELETER {name}")
    assert reals(session) == {}


def test_a_program_with_every_word_is_stored_and_loaded(session: Session, tmp_path: Path) -> None:
    lines = [f"    {name} = {name}+{name}[1]" for name in NAMES]
    text = "\n".join([".PROGRAM store()", *lines, ".END", ".REALS", *(f"{name}[1] 1" for name in NAMES), ".END", ""])
    (tmp_path / "words.v2").write_text(text, encoding="utf-8")
    session.perform(f"LOAD {tmp_path / 'words.v2'}")
    session.perform("LISTP store")
    assert [step.text for step in last(session, replies.ProgramText).steps] == lines
    before = reals(session)
    session.perform(f"STORE {tmp_path / 'again.v2'}")
    fresh = at(RecordingTerminal(), f"LOAD {tmp_path / 'again.v2'}")
    assert reals(fresh) == before
    fresh.perform("EXECUTE store")
    assert {name: value for name, value in reals(fresh).items() if "[" not in name} == {
        name: value + 1 for name, value in VALUES.items()
    }


def test_the_names_are_all_different() -> None:
    assert len({name[:NAME_LENGTH] for name in NAMES}) == len(NAMES)
