"""The colours of `render.roles` for what prompt-toolkit draws: bars, messages, menus."""

from __future__ import annotations

import os

from prompt_toolkit.output import ColorDepth
from prompt_toolkit.styles import Style

from vrs_cli.render.roles import Bar, Role, bar_style, toolkit_style

STYLE = Style.from_dict(
    {
        # classes of prompt-toolkit
        "bottom-toolbar": bar_style(Bar.STATUS),
        "validation-toolbar": bar_style(Bar.MISTAKE),
        "completion-menu.completion.current": bar_style(Bar.CHOSEN),
        "exiting": toolkit_style(Role.NOTE),
        "aborting": toolkit_style(Role.NOTE),
        "control-character": toolkit_style(Role.NOTE),
        "search": bar_style(Bar.CHOSEN),
        # our own
        "title": bar_style(Bar.TITLE),
        "margin": toolkit_style(Role.NOTE),
        "finding.error": f"underline {toolkit_style(Role.ERROR)}",
        "finding.warning": f"underline {toolkit_style(Role.WARNING)}",
        "message.error": bar_style(Bar.MISTAKE),
        "message.warning": toolkit_style(Role.WARNING),
    }
)


def colour_depth() -> ColorDepth | None:
    """All colours where the terminal says that it has them; None: the nearest of 256, as is usual."""
    if os.environ.get("COLORTERM", "").lower() in ("truecolor", "24bit"):
        return ColorDepth.from_env() or ColorDepth.DEPTH_24_BIT
    return None
