"""The lines typed before, kept between sessions where the user's state folder can be written."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from prompt_toolkit.history import FileHistory, History, InMemoryHistory

PRIVATE = 0o700  # folders of the user's own state (XDG Base Directory Specification)


def state_folder(environment: Mapping[str, str]) -> Path:
    """Return the folder of files that outlive a shell: `$XDG_STATE_HOME/vrs`, or below `~/.local/state` when that is
    not set to an absolute path. The file `history` has the lines, the folder `recovery` what shells have in memory
    alone. Raises RuntimeError where there is no home.
    """
    state = environment.get("XDG_STATE_HOME", "")
    root = Path(state) if os.path.isabs(state) else Path("~/.local/state").expanduser()
    return root / "vrs"


class QuietHistory(FileHistory):
    """A history file whose failing (a full disk) loses the line and nothing else."""

    def store_string(self, string: str) -> None:
        with suppress(OSError):
            super().store_string(string)


def open_history(path: Path) -> tuple[History, str]:
    """The history of that file, and an empty string; or one in memory, and why."""
    try:
        path.parent.mkdir(mode=PRIVATE, parents=True, exist_ok=True)
        with path.open("ab"):
            pass
    except (OSError, RuntimeError) as error:
        return InMemoryHistory(), f"the history cannot be kept in {path}: {reason(error)}"
    return QuietHistory(path), ""


def reason(error: Exception) -> str:
    """The system's reason in lower case."""
    text = (error.strerror if isinstance(error, OSError) else None) or str(error)
    return text[:1].lower() + text[1:]
