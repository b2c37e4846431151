"""The exercises and lessons that come with vrs."""

from __future__ import annotations

from pathlib import Path

from vrs_cli.errors import NonexistentFile, did_you_mean
from vrs_cli.extras import shipped_folder


def shipped(kind: str) -> Path:
    """Return the folder of a kind, `exercises` or `lessons`."""
    return shipped_folder("programs") / kind


def find_exercise(named: str) -> Path:
    """Return the folder of an exercise: a folder, or a shipped one by its name. Raises NonexistentFile."""
    if Path(named).is_dir():
        return Path(named)
    names = sorted(path.name for path in shipped("exercises").glob("*") if path.is_dir())
    if named in names:
        return shipped("exercises") / named
    hint = did_you_mean(named, names, f"it is a folder, or one of {', '.join(names)}" if names else "it is a folder")
    raise NonexistentFile(f"there is no exercise {named}", hint)
