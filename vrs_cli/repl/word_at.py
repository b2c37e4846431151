"""Which word F1 explains."""

from __future__ import annotations

import re

from prompt_toolkit.document import Document

WORD = re.compile(r"[#$]?[A-Za-z][\w.]*")


def asked_about(document: Document) -> str:
    """The word at the cursor, where there is help on it, else the first of the line."""
    from vrs_cli.interfaces.monitor.help import ALL_NAMES

    words = list(WORD.finditer(document.current_line))
    here = document.cursor_position_col
    at = [word[0] for word in words if word.start() <= here <= word.end() and word[0].upper() in ALL_NAMES]
    return next(iter((*at, *(word[0] for word in words))), "")
