"""The comments of a file come back from STORE, and go with what they belong to."""

from __future__ import annotations

from pathlib import Path

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.files.store import store
from vrs_cli.interfaces.monitor.files import load
from vrs_cli.interfaces.session.session import Session

TEXT = """\
; first of all

.PROGRAM pick(part) ;fetch
    ; down
    MOVES part

    READY
.END

; the reals
.REALS
; measured
gap              12.5 ;mm

width            3
; last
.END
; the end
"""


def loaded(text: str, *, sure: bool = True) -> Session:
    session = Session(RecordingTerminal(sure=sure))
    assert session.load_text(text) == ()
    return session


def stored(session: Session) -> str:
    return store(session.environment, layout=session.layout)


def test_what_was_loaded_is_stored_to_the_letter() -> None:
    assert stored(loaded(TEXT)) == TEXT


def test_without_its_variable_a_comment_goes() -> None:
    session = loaded(TEXT)
    session.environment.delete("gap")
    assert "measured" not in stored(session)
    assert "; last" in stored(session)


def test_without_its_program_a_comment_goes_and_does_not_come_back() -> None:
    session = loaded(TEXT)
    session.perform("DISABLE INTERACTIVE")
    session.perform("DELETEP pick")
    session.load_text(".PROGRAM pick\nREADY\n.END\n")
    assert "first of all" not in stored(session)


def test_a_file_does_not_begin_with_a_blank_line() -> None:
    session = loaded(TEXT)
    text = store(session.environment, programs=["pick"], layout=session.layout)
    assert text.startswith("; first of all")
    assert "the end" not in text


def test_a_program_that_was_there_already_keeps_its_comments(tmp_path: Path) -> None:
    session = loaded(TEXT, sure=False)
    (tmp_path / "other.v2").write_text("; another\n.PROGRAM pick\n.END\n; new\n.PROGRAM new\nREADY\n.END\n")
    session.converse(load(session, tmp_path / "other.v2"))
    text = stored(session)
    assert "; first of all\n\n.PROGRAM pick(part) ;fetch" in text
    assert "; new\n.PROGRAM new()" in text
    assert "another" not in text
