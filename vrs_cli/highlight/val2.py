"""Colour VAL-II in Pygments, and so in documentation tools and rich, using `render.colours.scan`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pygments.lexer import Lexer  # type: ignore[import-untyped]  # Pygments has no types of its own
from pygments.token import Comment, Keyword, Name, Number, Operator, String, Text  # type: ignore[import-untyped]

from vrs_cli.language.text.parser import variables_in
from vrs_cli.render.colours import Ink, scan

TOKENS: Mapping[Ink, Any] = {
    Ink.TEXT: Text,
    Ink.NAME: Name,
    Ink.NUMBER: Number,
    Ink.STRING: String,
    Ink.COMMAND: Keyword.Pseudo,
    Ink.INSTRUCTION: Keyword,
    Ink.CONTROL: Keyword.Reserved,
    Ink.FUNCTION: Name.Builtin,
    Ink.OPERATOR: Operator,
    Ink.COMMENT: Comment.Single,
}


class Val2Lexer(Lexer):  # type: ignore[misc]  # Lexer has no types
    """A Pygments lexer for programs, files and lines of the prompt."""

    name = "VAL-II"
    aliases: ClassVar[list[str]] = ["val2", "val-ii", "vplus"]
    filenames: ClassVar[list[str]] = ["*.v2", "*.pg"]
    url = "https://en.wikipedia.org/wiki/Variable_Assembly_Language"

    def get_tokens_unprocessed(self, text: str, *_: Any) -> Iterator[tuple[int, Any, str]]:
        """Yield the index, token and text of each piece. Joined, the pieces give the text."""
        at = 0
        variables = variables_in(text.splitlines())
        for line in text.splitlines(keepends=True):
            body = line.rstrip("\r\n")
            label = len(body) - len(_without_label(body))
            if label:
                yield at, Name.Label, body[:label]
                at += label
            for piece, ink in scan(body[label:], variables):
                yield at, TOKENS[ink], piece
                at += len(piece)
            if len(body) < len(line):
                yield at, Text, line[len(body) :]
                at += len(line) - len(body)


def _without_label(line: str) -> str:
    rest = line.lstrip(" \t")
    digits = rest.lstrip("0123456789")
    return digits if len(digits) < len(rest) and (not digits or digits[0] in " \t") else line
