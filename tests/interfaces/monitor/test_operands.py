"""Questions that commands ask before something is lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.monitor.people import Person, last, loaded
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import FileExists
from vrs_cli.values import replies, results


@pytest.mark.parametrize("line", ["DELETE main", "DELETEP main", "DELETER x", "DELETEL only.here", "ZERO"])
def test_nothing_goes_without_a_yes(line: str) -> None:
    for terminal in (Person(sure=False), RecordingTerminal(sure=False)):
        session = loaded(terminal)
        session.perform(line)
        assert (len(session.environment.programs), len(session.environment.kinds)) == (4, 4)
        assert terminal.asked[0].endswith("Are you sure (Y/N)?")
        refused = last(session, results.Message)
        assert (refused.tone is results.Tone.ERROR) is not terminal.attended


def test_disable_interactive_asks_nothing() -> None:
    terminal = Person(sure=False)
    session = loaded(terminal)
    session.perform("DISABLE INTERACTIVE")
    session.perform("ZERO")
    assert (terminal.asked, session.environment.programs, session.environment.kinds) == ([], {}, {})


def test_a_file_that_is_there_is_overwritten_only_when_agreed(folder: Path) -> None:
    (folder / "cell.v2").write_text("; mine\n")
    session = loaded(Person(sure=False))
    with pytest.raises(FileExists, match=r"cell\.v2"):
        session.perform("STORE cell")
    with pytest.raises(FileExists):
        session.perform("SAVE cell.v2")
    assert (folder / "cell.v2").read_text() == "; mine\n"
    loaded(Person(sure=True)).perform("STORE cell")
    assert ".PROGRAM main" in (folder / "cell.v2").read_text()


@pytest.mark.parametrize("sure", [True, False])
def test_load_asks_before_it_replaces(folder: Path, sure: bool) -> None:
    (folder / "new.v2").write_text(".PROGRAM main\nTYPE 1\n.END\n.PROGRAM fresh\n.END\n")
    session = loaded(Person(sure=sure))
    session.perform("LOAD new.v2")
    assert (len(session.environment.programs["main"].program.steps) == 1) is sure
    assert session.terminal.asked == ["Program main exists. Replace it (Y/N)?"]  # type: ignore[attr-defined]
    (said,) = [reply.text for reply in session.terminal.replies]  # type: ignore[attr-defined]
    assert said == f"new.v2 loaded: {'main (replaced), fresh' if sure else 'fresh; main stays as before'}"


@pytest.mark.parametrize("sure", [True, False])
def test_load_asks_before_it_overwrites_a_location_that_is_not_stored(folder: Path, sure: bool) -> None:
    (folder / "new.lc").write_text(".LOCATIONS\npart 1 2 3 90 -90 0\nother 1 2 3 90 -90 0\n.END\n")
    session = loaded(Person(sure=sure))
    session.perform("SET part = HERE")
    session.perform("LOAD new.lc")
    assert session.terminal.asked == ["The location part is not stored. Overwrite (Y/N)?"]  # type: ignore[attr-defined]
    part, other = (session.environment.values()[name, None] for name in ("part", "other"))
    assert (part == other) is sure
    session.perform("LOAD new.lc")
    assert len(session.terminal.asked) == (1 if sure else 2)  # type: ignore[attr-defined]


def test_on_a_pipe_leaving_asks_nothing() -> None:
    terminal = RecordingTerminal(sure=False)
    loaded(terminal).perform("EXIT")
    assert (terminal.asked, terminal.replies) == ([], [replies.Farewell()])
