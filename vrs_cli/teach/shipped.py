"""The exercises and lessons that come with vrs."""

from __future__ import annotations

from pathlib import Path

import vrs_cli
from vrs_cli.errors import NonexistentFile, did_you_mean


def shipped(kind: str) -> Path:
    """Return the folder of a kind, `exercises` or `lessons`: that of a checkout, or inside the installed package."""
    package = Path(vrs_cli.__file__).parent
    inside = package / "programs"
    return (inside if inside.is_dir() else package.parent / "programs") / kind


def find_exercise(named: str) -> Path:
    """Return the folder of an exercise: a folder, or a shipped one by its name. Raises NonexistentFile."""
    if Path(named).is_dir():
        return Path(named)
    names = sorted(path.name for path in shipped("exercises").glob("*") if path.is_dir())
    if named in names:
        return shipped("exercises") / named
    hint = did_you_mean(named, names, f"it is a folder, or one of {', '.join(names)}" if names else "it is a folder")
    raise NonexistentFile(f"there is no exercise {named}", hint)
