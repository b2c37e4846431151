"""The colours of `render.colours` for what prompt-toolkit draws: bars, messages, menus."""

from __future__ import annotations

import os

from prompt_toolkit.output import ColorDepth
from prompt_toolkit.styles import Style

from vrs_cli.render.colours import Bar, Ink, bar_style, toolkit_style

STYLE = Style.from_dict(
    {
        # classes of prompt-toolkit
        "bottom-toolbar": bar_style(Bar.STATUS),
        "validation-toolbar": bar_style(Bar.MISTAKE),
        "completion-menu.completion.current": bar_style(Bar.CHOSEN),
        "exiting": toolkit_style(Ink.NOTE),
        "aborting": toolkit_style(Ink.NOTE),
        "control-character": toolkit_style(Ink.NOTE),
        "search": bar_style(Bar.CHOSEN),
        "auto-suggestion": toolkit_style(Ink.NOTE),
        # our own
        "argument": f"bold underline {bar_style(Bar.ARGUMENT)}",
        "title": bar_style(Bar.TITLE),
        "margin": toolkit_style(Ink.NOTE),
        "finding.error": f"underline {toolkit_style(Ink.ERROR)}",
        "finding.warning": f"underline {toolkit_style(Ink.WARNING)}",
        "message.error": bar_style(Bar.MISTAKE),
        "message.warning": toolkit_style(Ink.WARNING),
    }
)


def colour_depth() -> ColorDepth | None:
    """All colours where the terminal says that it has them; None: the nearest of 256, as is usual."""
    if os.environ.get("COLORTERM", "").lower() in ("truecolor", "24bit"):
        return ColorDepth.from_env() or ColorDepth.DEPTH_24_BIT
    return None
