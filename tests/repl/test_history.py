"""History across sessions."""

from pathlib import Path

import pytest
from prompt_toolkit.history import InMemoryHistory

from vrs_cli.repl.config import open_history, state_folder


def test_it_follows_the_state_folder(tmp_path: Path) -> None:
    assert state_folder({"XDG_STATE_HOME": str(tmp_path)}) / "history" == tmp_path / "vrs" / "history"


@pytest.mark.parametrize("state", ["", "relative/folder"])
def test_without_an_absolute_folder_it_is_below_home(
    state: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert state_folder({"XDG_STATE_HOME": state}) / "history" == tmp_path / ".local" / "state" / "vrs" / "history"


def test_lines_come_back_in_the_next_session(tmp_path: Path) -> None:
    path = tmp_path / "vrs" / "history"
    first, note = open_history(path)
    first.append_string("WHERE")
    first.append_string("MOVE é")
    second, _ = open_history(path)
    assert list(second.load_history_strings()) == ["MOVE é", "WHERE"]
    assert note == ""


def test_where_it_cannot_be_written_there_is_one_note(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    history, note = open_history(tmp_path / "file" / "vrs" / "history")
    assert isinstance(history, InMemoryHistory)
    assert note.startswith("the history cannot be kept in ")


def test_a_history_that_fails_later_loses_the_line_only(tmp_path: Path) -> None:
    path = tmp_path / "history"
    history, _ = open_history(path)
    path.unlink()
    path.mkdir()
    history.append_string("WHERE")
    assert history.get_strings() == ["WHERE"]
