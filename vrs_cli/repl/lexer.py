"""Colours of the line that is being typed: the pieces of `render.scan`, as prompt-toolkit wants them."""

from __future__ import annotations

from collections.abc import Callable, Container

from prompt_toolkit.document import Document
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.lexers import Lexer

from vrs_cli.render.colours import COLOURS, Ink, Palette, toolkit_style


class ValLexer(Lexer):
    """Plain text until `ready()`: the tables of the language are heavy, and the first prompt does not wait for them.

    `names`: the keys of the variables that have a value.
    """

    def __init__(
        self, ready: Callable[[], bool], names: Callable[[], Container[str]] = frozenset, palette: Palette = COLOURS
    ) -> None:
        self._styles = {ink: toolkit_style(ink, palette) for ink in Ink}
        self._ready = ready
        self._names = names

    def lex_document(self, document: Document) -> Callable[[int], StyleAndTextTuples]:
        if not self._ready():
            return lambda number: [("", document.lines[number])]
        from vrs_cli.language.text.parser import variables_in
        from vrs_cli.render.scan import scan

        variables = variables_in(document.lines) if len(document.lines) > 1 else self._names()
        return lambda number: [(self._styles[ink], text) for text, ink in scan(document.lines[number], variables)]

    def invalidation_hash(self) -> object:
        return self._ready()
