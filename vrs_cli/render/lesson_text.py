"""The text of lessons on a terminal, in our colours: a small part of Markdown.

Headings, paragraphs, lists, indented or fenced code; code and strong text in a line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rich.console import Console
from rich.text import Text

from vrs_cli.render.blocks import TextLine
from vrs_cli.render.colours import COLOURS, Ink, Palette
from vrs_cli.render.console import rich_text

NO_BREAK = "\ue000"  # a private character: a blank at which no row ends
WIDTH = 100  # characters of a line at most: longer ones are hard to read
_ITEM = re.compile(r"(\s*(?:[-*]|\d+\.)\s+)(.*)", re.DOTALL)
_PIECE = re.compile(r"(`[^`]+`|\*\*[^*]+\*\*)")


def draw_lesson_text(text: str, palette: Palette = COLOURS, console: Console | None = None) -> None:
    """Write a text on the terminal, with an empty line after each paragraph. Code in a line is not divided."""
    console = console or Console(highlight=False, emoji=False, markup=False)
    width = min(console.width, WIDTH)
    for indent, line in _lines(text):
        if not line.pieces:
            console.print()
            continue
        for number, row in enumerate(rich_text(line, palette).wrap(console, max(width - len(indent), 20))):
            row.rstrip()
            row.plain = row.plain.replace(NO_BREAK, " ")
            console.print(Text(indent if number == 0 else " " * len(indent)).append(row), soft_wrap=True)


def _lines(text: str) -> Iterator[tuple[str, TextLine]]:
    """Yield each heading, paragraph, item and line of code with what stands before its first row."""
    for block in _blocks(text):
        head = block[0]
        if head.startswith("#"):
            yield "", TextLine(((head.lstrip("# "), Ink.HEADING),))
        elif head.startswith(("    ", "```")):
            for line in block:
                if not line.startswith("```"):
                    yield "", TextLine((("    " + line.removeprefix("    "), Ink.INSTRUCTION),))
        else:
            item = _ITEM.fullmatch(" ".join(line.strip() for line in block))
            indent, words = (item[1], item[2]) if item else ("", " ".join(line.strip() for line in block))
            yield indent, TextLine(tuple(_pieces(words)))
        yield "", TextLine(())


def _blocks(text: str) -> Iterator[list[str]]:
    """Divide a text at empty lines; each item of a list, each heading and each piece of code is a block."""
    block, fenced = list[str](), False
    for line in [*text.strip("\n").splitlines(), ""]:
        fences = line.startswith("```")
        begins = fences or line.startswith("#") or _ITEM.match(line) or not line.strip()
        if block and not fenced and begins:
            yield block
            block = []
        fenced ^= fences
        if line.strip() or fenced:
            block.append(line)
        if block and (block[0].startswith("#") or (fences and not fenced)):
            yield block
            block = []
    if block:
        yield block


def _pieces(text: str) -> Iterator[tuple[str, Ink]]:
    for piece in _PIECE.split(text):
        if piece.startswith("`"):
            yield piece.strip("`").replace(" ", NO_BREAK), Ink.INSTRUCTION
        elif piece.startswith("**"):
            yield piece.strip("*"), Ink.HEADING
        elif piece:
            yield piece.replace("*", ""), Ink.TEXT
