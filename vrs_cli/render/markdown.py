"""Blocks as Markdown and as LaTeX, for notebooks: formulas and matrices as LaTeX, tables as tables.

Names and texts of users are escaped: nothing that is typed becomes markup.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from vrs_cli.render.blocks import Block, Grid
from vrs_cli.render.colours import Ink

_MARKUP = re.compile(r"[\\`*_{}\[\]<>()#+!|$~&]")
_LATEX = {"\\": r"\backslash ", "^": r"\^{}", "~": r"\~{}", **{one: f"\\{one}" for one in "{}$&#%_"}}


def markdown(shown: Iterable[Block]) -> str:
    """Blocks as Markdown: formulas between $$, headings of tables in their first row."""
    parts = []
    for block in shown:
        if block.latex:
            parts.append(f"$${block.latex}$$")
        elif isinstance(block, Grid):
            parts.append(_table(block))
        else:
            bold = "**" * all(ink is Ink.HEADING for _, ink in block.pieces)
            parts.append(f"{bold}{_escaped(block.text)}{bold}")
    return "\n\n".join(parts) + "\n"


def _table(grid: Grid) -> str:
    sides = ["---:" if column.right else ":---" for column in grid.columns]
    rows = [[column.heading for column in grid.columns], sides, *grid.rows]
    return "\n".join(f"| {' | '.join(row if row is sides else map(_escaped, row))} |" for row in rows)


def _escaped(text: str) -> str:
    return _MARKUP.sub(lambda found: f"\\{found[0]}", text.strip())


def latex_document(shown: Iterable[Block]) -> str:
    """Blocks as LaTeX that MathJax draws too: texts as they are, formulas and tables between $$."""
    parts = []
    for block in shown:
        if block.latex:
            parts.append(f"$${block.latex}$$")
        elif isinstance(block, Grid):
            sides = "".join("r" if column.right else "l" for column in block.columns)
            heads = [column.heading for column in block.columns]
            rows = [" & ".join(map(_cell, row)) for row in ([heads] if any(heads) else []) + list(block.rows)]
            parts.append(rf"$$\begin{{array}}{{{sides}}}" + r" \\ ".join(rows) + r"\end{array}$$")
        else:
            parts.append(_plain(block.text))
    return "\n\n".join(parts) + "\n"


def _cell(text: str) -> str:
    return rf"\text{{{_plain(text)}}}" if text.strip() else ""


def _plain(text: str) -> str:
    return "".join(_LATEX.get(one, one) for one in text.strip())
