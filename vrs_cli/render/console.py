"""Draw replies and lessons on a terminal with rich, in colours, with a line below the headings of large tables."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from typing import TextIO

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from vrs_cli.render import layout, plain
from vrs_cli.render.blocks import SCREEN_ROWS, Block, Grid, Page, TextLine, grid_lines, split
from vrs_cli.render.colours import COLOURS, Ink, Palette, ink_style
from vrs_cli.values.replies import Reply

PROMPT_ROWS = 8  # number of rows that the next prompt needs for its toolbar and menu


def has_unicode(environ: Mapping[str, str]) -> bool:
    """Return whether the terminal can show Unicode, according to the environment.

    The result is False for a locale with another encoding, and for the Linux console, whose fonts have 512 characters.
    It is True if the environment says nothing.
    """
    locale = next((value for name in ("LC_ALL", "LC_CTYPE", "LANG") if (value := environ.get(name))), "")
    encoding = locale.partition(".")[2].partition("@")[0].replace("-", "").lower()
    return (
        locale not in ("C", "POSIX")
        and encoding in ("", "utf8")
        and environ.get("TERM") not in ("linux", "vt100", "vt220")
    )


class TerminalRenderer:
    """A renderer of replies on one terminal. Tests set `width` and `stream`."""

    def __init__(self, stream: TextIO | None = None, width: int | None = None, palette: Palette = COLOURS) -> None:
        self._palette = palette
        self.console = Console(file=stream, width=width, highlight=False, emoji=False, markup=False)

    @property
    def page(self) -> Page:
        console = self.console
        unicode = (console.encoding or "").lower().startswith("utf") and has_unicode(os.environ)
        return Page(console.width, SCREEN_ROWS, console.color_system is not None, unicode, console.height - PROMPT_ROWS)

    def draw(self, reply: Reply) -> None:
        page = self.page
        for block in layout.blocks(reply, page):
            for part in (block,) if isinstance(block, TextLine) else _fit_grid(block, page):
                self.console.print(
                    _table(part, self._palette) if isinstance(part, Grid) else rich_text(part, self._palette)
                )

    def to_text(self, reply: Reply) -> str:
        with self.console.capture() as captured:
            self.draw(reply)
        return captured.get()


def _fit_grid(grid: Grid, page: Page) -> Iterator[Block]:
    """Yield parts of a grid that fit the page. If the page has no Unicode, or the grid is not boxed, yield lines of
    text instead."""
    rules = len(grid.columns) if grid.boxed else 0  # rich draws one more character between columns
    for part in split(grid, None if page.width is None else page.width - rules):
        yield from (part,) if part.boxed and page.unicode else grid_lines(part)


def rich_text(line: TextLine, palette: Palette = COLOURS) -> Text:
    return Text.assemble(*((plain.visible(text), ink_style(ink, palette)) for text, ink in line.pieces))


def _table(grid: Grid, palette: Palette) -> Table:
    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False, header_style=ink_style(Ink.HEADING, palette))
    for column in grid.columns:
        table.add_column(
            column.heading,
            justify="right" if column.right else "left",
            style=ink_style(column.ink, palette),
            no_wrap=True,
        )
    for row in grid.rows:
        table.add_row(*(Text(plain.visible(cell)) for cell in row))
    return table


NO_BREAK = "\ue000"  # a private-use character in place of a blank at which a row must not end
WIDTH = 100  # maximum number of characters in a line, because longer lines are hard to read
_ITEM = re.compile(r"(\s*(?:[-*]|\d+\.)\s+)(.*)", re.DOTALL)
_PIECE = re.compile(r"(`[^`]+`|\*\*[^*]+\*\*)")


def draw_lesson_text(text: str, palette: Palette = COLOURS, console: Console | None = None) -> None:
    """Write the text of a lesson, in a small subset of Markdown, with an empty line after each paragraph. Inline code
    is not wrapped."""
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
    """Yield each heading, paragraph, item and line of code, with the prefix for its first row, such as a bullet."""
    for block in _blocks(text):
        head = block[0]
        if head.startswith("#"):
            yield "", TextLine(((head.lstrip("# "), Ink.HEADING),))
        elif head.startswith(("    ", "```")):
            code = (f"    {line.removeprefix('    ')}" for line in block if not line.startswith("```"))
            yield from (("", TextLine(((line, Ink.INSTRUCTION),))) for line in code)
        else:
            words = " ".join(line.strip() for line in block)
            item = _ITEM.fullmatch(words)
            yield item[1] if item else "", TextLine(tuple(_pieces(item[2] if item else words)))
        yield "", TextLine(())


def _blocks(text: str) -> Iterator[list[str]]:
    """Split Markdown at empty lines. Each list item, heading and code section is one block."""
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
