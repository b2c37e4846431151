"""Long answers through a pager."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from collections.abc import Mapping

from vrs_cli.values import replies

USUAL = "less"
OPTIONS = {"LESS": "FRX"}  # as git has them: colours, all that fits at once, and the screen stays as it is
LONG = (
    replies.HelpOverview,
    replies.HelpTopic,
    replies.HelpPage,
    replies.ProgramText,
    replies.ProgramNames,
    replies.FileText,
    replies.FileTable,
    replies.LocationTable,
    replies.RealTable,
    replies.StringTable,
    replies.SettingTable,
    replies.WhereaboutsTable,
    replies.ComparisonTable,
    replies.MeasuredComparisonTable,
    replies.TimelineTable,
    replies.Plot,
)


def pager_of(wanted: bool | str, environment: Mapping[str, str]) -> str:
    """The command of a pager; "" where none is wanted, or there is none."""
    command = wanted if isinstance(wanted, str) else environment.get("PAGER", USUAL) if wanted else ""
    try:
        words = shlex.split(command)
    except ValueError:
        return ""
    return command if words and shutil.which(words[0]) is not None else ""


def shown_by(pager: str, text: str) -> bool:
    """Let a pager show a text; whether it could be started."""
    try:
        subprocess.run(shlex.split(pager), input=text, encoding="utf-8", env={**OPTIONS, **os.environ}, check=False)
    except OSError:
        return False
    return True
