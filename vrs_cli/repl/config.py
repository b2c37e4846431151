"""Read the user's settings of the shell (`config.toml`), and open the history of typed lines."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from msgspec import Struct
from prompt_toolkit.history import FileHistory, History, InMemoryHistory

from vrs_cli.errors import did_you_mean
from vrs_cli.render.colours import COLOURS, Ink, Palette

_COLOUR = re.compile(r"#[0-9a-fA-F]{6}|")


class Config(Struct, frozen=True):
    """The settings of the shell. `keys`: "emacs" or "vi". `pager`: whether long replies go through a pager, or the
    pager's command. `suggestions`: whether to suggest the rest of a line from the history. `colours`: the colour of
    each kind of text. `wrong`: messages about the mistakes in the settings file."""

    keys: str = "emacs"
    pager: bool | str = True
    suggestions: bool = True
    colours: Mapping[str, str] = {}
    wrong: tuple[str, ...] = ()

    @property
    def palette(self) -> Palette:
        return {ink: (self.colours.get(ink.value, colour), bold) for ink, (colour, bold) in COLOURS.items()}


def config_path(environment: Mapping[str, str], platform: str = sys.platform) -> Path:
    """Return the path of the settings file on a platform. Raises RuntimeError if the user has no home folder."""
    if platform == "win32":
        folder = Path(environment.get("APPDATA") or Path("~/AppData/Roaming").expanduser())
    elif platform == "darwin":
        folder = Path("~/Library/Application Support").expanduser()
    else:  # Linux and others: see the XDG Base Directory Specification
        given = environment.get("XDG_CONFIG_HOME", "")
        folder = Path(given) if os.path.isabs(given) else Path("~/.config").expanduser()
    return folder / "vrs" / "config.toml"


def read_config(environment: Mapping[str, str]) -> Config:
    """Read the user's settings file. A missing or wrong setting gets its default value."""
    try:
        path = config_path(environment)
        text = path.read_text(encoding="utf-8")
    except (FileNotFoundError, NotADirectoryError, RuntimeError):
        return Config()
    except (OSError, UnicodeError) as error:
        return Config(wrong=(f"{path} cannot be read: {error}",))
    return config_of(text, str(path))


def config_of(text: str, path: str) -> Config:
    """Return the settings in the text of a settings file. `path`: the file's name in messages."""
    import tomllib

    try:
        given = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # RecursionError for deeply nested lists
        return Config(wrong=(f"{path} is no TOML: {error}",))
    good: dict[str, Any] = {}
    wrong = []
    for name, value in given.items():
        right = SETTINGS.get(name)
        if right is None:
            hint = did_you_mean(name, SETTINGS, f"there are {', '.join(SETTINGS)}")
            wrong.append(f"{path}: {name} is no setting ({hint})")
        elif problem := right(value):
            wrong.append(f"{path}: {name}: {problem}")
        else:
            good[name] = value
    return Config(**good, wrong=tuple(wrong))


def _colours(value: object) -> str:
    if not isinstance(value, dict):
        return 'a table is wanted: [colours], and lines as number = "#d700af"'
    inks = [ink.value for ink in Ink]
    for name, colour in value.items():
        if name not in inks:
            return f"{name} is no piece of text ({did_you_mean(name, inks, ', '.join(inks))})"
        if not isinstance(colour, str) or _COLOUR.fullmatch(colour) is None:
            return f'{name}: {colour!r} is no colour as "#d700af" is, or "" for that of the terminal'
    return ""


# for each setting, a function that returns what is wrong with a value, or "" if the value is valid
SETTINGS: Mapping[str, Callable[[object], str]] = {
    "keys": lambda value: "" if value in ("emacs", "vi") else f'{value!r} is neither "emacs" nor "vi"',
    "pager": lambda value: (
        "" if isinstance(value, bool | str) else f"{value!r} is neither true nor false nor a command"
    ),
    "suggestions": lambda value: "" if isinstance(value, bool) else f"{value!r} is neither true nor false",
    "colours": _colours,
}


def settings_text(config: Config) -> str:
    """Return all settings as the text of a settings file."""
    pager = str(config.pager).lower() if isinstance(config.pager, bool) else f'"{config.pager}"'
    rows = (
        (f'keys = "{config.keys}"', '"emacs" or "vi"'),
        (f"pager = {pager}", 'for answers that are longer than the screen; false, or a command: "less -R"'),
        (f"suggestions = {str(config.suggestions).lower()}", "the rest of a line from the history, in grey"),
    )
    colours = (f'{ink.value} = "{colour}"\n' for ink, (colour, _) in config.palette.items())
    return "".join(f"{setting:22}  # {note}\n" for setting, note in rows) + "\n[colours]\n" + "".join(colours)


def state_folder(environment: Mapping[str, str]) -> Path:
    """Return the folder for files that remain after a shell has ended: `$XDG_STATE_HOME/vrs`, or `~/.local/state/vrs`
    if the variable is not an absolute path.

    The file `history` in it contains the typed lines; the folder `recovery` contains unsaved work of shells. Raises
    RuntimeError if there is no home folder.
    """
    state = environment.get("XDG_STATE_HOME", "")
    root = Path(state) if os.path.isabs(state) else Path("~/.local/state").expanduser()
    return root / "vrs"


class QuietHistory(FileHistory):
    """A file with the history of typed lines. If a line cannot be written (full disk), the line is missing in the file,
    and no error is raised."""

    def store_string(self, string: str) -> None:
        with suppress(OSError):
            super().store_string(string)


def open_history(path: Path) -> tuple[History, str]:
    """Return the history in a file and "", or a history in memory and the reason why the file cannot be used."""
    try:
        # mode 700: other users must not read the state of a user's programs (XDG Base Directory Specification)
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with path.open("ab"):
            pass
    except (OSError, RuntimeError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        return InMemoryHistory(), f"the history cannot be kept in {path}: {reason[:1].lower()}{reason[1:]}"
    return QuietHistory(path), ""
