"""The settings of the shell."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from prompt_toolkit.history import InMemoryHistory

from vrs_cli.render.colours import COLOURS, Ink
from vrs_cli.repl.config import Config, config_of, config_path, open_history, read_config, settings_text, state_folder
from vrs_cli.repl.terminal import pager_of, shown_by

HOME = Path("~").expanduser()


@pytest.mark.parametrize(
    ("platform", "environment", "path"),
    [
        ("linux", {"XDG_CONFIG_HOME": "/etc/mine"}, Path("/etc/mine/vrs/config.toml")),
        ("linux", {"XDG_CONFIG_HOME": "not/absolute"}, HOME / ".config/vrs/config.toml"),
        ("darwin", {}, HOME / "Library/Application Support/vrs/config.toml"),
        ("win32", {"APPDATA": "/roaming"}, Path("/roaming/vrs/config.toml")),
    ],
)
def test_the_file_is_where_the_platform_has_such_files(platform: str, environment: dict[str, str], path: Path) -> None:
    assert config_path(environment, platform) == path


def test_what_is_shown_is_a_file_that_says_the_same() -> None:
    config = config_of('keys = "vi"\npager = "less -R"\n[colours]\nnumber = "#00aa00"\n', "f")
    again = config_of(settings_text(config), "f")
    assert (again.keys, again.pager, again.palette) == ("vi", "less -R", config.palette)
    assert config.palette[Ink.NUMBER] == ("#00aa00", COLOURS[Ink.NUMBER][1])
    assert tomllib.loads(settings_text(Config()))["pager"] is True


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("keys = 3", "f: keys: 3 is neither"),
        ("key = 'vi'", "f: key is no setting (did you mean keys?)"),
        ("[colours]\nnumbr = '#000000'", "f: colours: numbr is no piece of text (did you mean number?)"),
        ("[colours]\nnumber = 'red'", "f: colours: number: 'red' is no colour"),
        ("keys =", "f is no TOML"),
        (f"keys = {'1' * 5000}", "f is no TOML"),
        (f"keys = {'[' * 5000}", "f is no TOML"),
    ],
)
def test_what_is_wrong_is_told_and_the_rest_holds(text: str, said: str) -> None:
    (wrong,) = (config := config_of(text, "f")).wrong
    assert wrong.startswith(said)
    assert (config.keys, config.palette) == ("emacs", COLOURS)


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    environment = {"XDG_CONFIG_HOME": str(tmp_path)}
    assert read_config(environment) == Config()
    (tmp_path / "vrs" / "config.toml").mkdir(parents=True)
    assert "cannot be read" in read_config(environment).wrong[0]


def test_which_pager() -> None:
    assert pager_of(True, {"PAGER": "cat -n"}) == pager_of("cat -n", {}) == "cat -n"
    refused: tuple[tuple[bool | str, dict[str, str]], ...] = (
        (False, {"PAGER": "cat"}),
        (True, {"PAGER": ""}),
        (True, {"PAGER": "no.such.pager"}),
        ("cat 'unclosed", {}),
    )
    for wanted, environment in refused:
        assert pager_of(wanted, environment) == ""


def test_a_pager_shows_a_text(tmp_path: Path) -> None:
    assert shown_by(f"tee {tmp_path / 'settings_text'}", "a\nb\n")
    assert (tmp_path / "settings_text").read_text() == "a\nb\n"
    assert not shown_by("no.such.pager", "a")


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
