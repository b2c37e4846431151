"""The colours of `render.colours` for what prompt-toolkit draws: bars, messages, menus, and the line that is typed."""

from __future__ import annotations

import os
from collections.abc import Callable, Container

from prompt_toolkit.document import Document
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.lexers import Lexer
from prompt_toolkit.output import ColorDepth
from prompt_toolkit.styles import Style

from vrs_cli.render.colours import COLOURS, Bar, Ink, Palette, bar_style, ink_style

STYLE = Style.from_dict(
    {
        # classes of prompt-toolkit
        "bottom-toolbar": bar_style(Bar.STATUS),
        "validation-toolbar": bar_style(Bar.MISTAKE),
        "completion-menu.completion.current": bar_style(Bar.CHOSEN),
        "exiting": ink_style(Ink.NOTE),
        "aborting": ink_style(Ink.NOTE),
        "control-character": ink_style(Ink.NOTE),
        "search": bar_style(Bar.CHOSEN),
        "auto-suggestion": ink_style(Ink.NOTE),
        # our own
        "argument": f"bold underline {bar_style(Bar.ARGUMENT)}",
        "title": bar_style(Bar.TITLE),
        "margin": ink_style(Ink.NOTE),
        "finding.error": f"underline {ink_style(Ink.ERROR)}",
        "finding.warning": f"underline {ink_style(Ink.WARNING)}",
        "message.error": bar_style(Bar.MISTAKE),
        "message.warning": ink_style(Ink.WARNING),
    }
)


def colour_depth() -> ColorDepth | None:
    """Return the depth of all colours where the terminal has them; None: the nearest of 256, as is usual."""
    if os.environ.get("COLORTERM", "").lower() in ("truecolor", "24bit"):
        return ColorDepth.from_env() or ColorDepth.DEPTH_24_BIT
    return None


class ValLexer(Lexer):
    """Plain text until `ready()`: the tables of the language are heavy, and the first prompt does not wait for them.

    `names`: the keys of the variables that have a value.
    """

    def __init__(
        self, ready: Callable[[], bool], names: Callable[[], Container[str]] = frozenset, palette: Palette = COLOURS
    ) -> None:
        self._styles = {ink: ink_style(ink, palette) for ink in Ink}
        self._ready = ready
        self._names = names

    def lex_document(self, document: Document) -> Callable[[int], StyleAndTextTuples]:
        if not self._ready():
            return lambda number: [("", document.lines[number])]
        from vrs_cli.language.text.parser import variables_in
        from vrs_cli.render.colours import scan

        variables = variables_in(document.lines) if len(document.lines) > 1 else self._names()
        return lambda number: [(self._styles[ink], text) for text, ink in scan(document.lines[number], variables)]

    def invalidation_hash(self) -> object:
        return self._ready()
