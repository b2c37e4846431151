"""Replies as HTML, for notebooks: tables as tables, everything else as lines of one width."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from itertools import groupby

from vrs_cli.render.blocks import PIPE, Block, Grid, Piece, TextLine
from vrs_cli.render.colours import COLOURS, Ink
from vrs_cli.render.layout import blocks
from vrs_cli.render.svg import picture
from vrs_cli.values.replies import Plot, Reply


def html(replies: Iterable[Reply]) -> str:
    """All of them, one below the other. The same for the same replies."""
    return "".join(picture(reply) if isinstance(reply, Plot) else blocks_html(blocks(reply, PIPE)) for reply in replies)


def blocks_html(shown: Iterable[Block]) -> str:
    parts = []
    for is_grid, run in groupby(shown, lambda block: isinstance(block, Grid)):
        if is_grid:
            parts += [_table(grid) for grid in run if isinstance(grid, Grid)]
        else:
            lines = "\n".join(pieces_html(line.pieces) for line in run if isinstance(line, TextLine))
            parts.append(f"<pre>{lines}</pre>")
    return "".join(parts)


def pieces_html(pieces: Iterable[Piece]) -> str:
    """A piece of a line, in its colours."""
    return "".join(_coloured(text, ink) for text, ink in pieces)


def _coloured(text: str, ink: Ink) -> str:
    colour, bold = COLOURS[ink]
    style = f"color:{colour};" * bool(colour) + "font-weight:bold" * bold
    return f'<span style="{style}">{escape(text)}</span>' if style else escape(text)


def _table(grid: Grid) -> str:
    sides = ["right" if column.right else "left" for column in grid.columns]
    heads = [column.heading for column in grid.columns]
    head = f"<thead><tr>{_cells('th', heads, sides)}</tr></thead>" if any(heads) else ""
    rows = "".join(f"<tr>{_cells('td', row, sides)}</tr>" for row in grid.rows)
    return f"<table>{head}<tbody>{rows}</tbody></table>"


def _cells(tag: str, texts: Iterable[str], sides: Iterable[str]) -> str:
    pairs = zip(texts, sides, strict=True)
    return "".join(f'<{tag} style="text-align:{side}">{escape(text)}</{tag}>' for text, side in pairs)
