"""Write a lesson for tests, with changed files."""

from pathlib import Path

TEXT = """\
# Two steps

What comes first.

## Turn

Turn joint 1 by 30 degrees.

## Say

Keep 5 in `n`.
"""
CHECKS = """\
summary = "a turn and a number"

[[step]]
name = "Turn"
nudge = "DRIVE"
idea = "DRIVE joint, degrees"
model = ["DRIVE 1, 30"]
wrong = [["DRIVE 1, 20"], ["READY"]]
passed = "It has turned."

[[step.check]]
kind = "joints"
at = [30, -90]
deg = 0.1

[[step]]
name = "Say"
nudge = "an equals sign"
idea = "n = ..."
model = ["n = 5"]
passed = "Said."

[[step.check]]
kind = "variable"
of = "n"
value = 5
"""


def lesson(folder: Path, checks: str = CHECKS, text: str = TEXT) -> Path:
    """Write a lesson, and return its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "lesson.md").write_text(text, encoding="utf-8")
    (folder / "checks.toml").write_text(checks, encoding="utf-8")
    return folder
