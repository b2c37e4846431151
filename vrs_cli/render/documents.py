"""Write replies as HTML, Markdown and LaTeX, and sessions as transcripts: text or HTML."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from html import escape
from itertools import groupby
from math import ceil, floor
from pathlib import Path
from typing import NamedTuple, TextIO

from vrs_cli.render import chart, layout, plain
from vrs_cli.render.blocks import PIPE, Block, Grid, Page, Piece, TextLine, block_lines, line
from vrs_cli.render.colours import COLOURS, CURVES, GREY, RED, Ink
from vrs_cli.values.replies import Plot, Reply

WIDTH, HEIGHT = 640, 300  # [px] size of the picture of a plot
LEFT, TOP, RIGHT, BOTTOM = 60, 24, 70, 36  # [px] margins around the curves
LINES = 6  # approximate number of grid lines for each axis


def html(replies: Iterable[Reply]) -> str:
    """Return replies as HTML, one below the other: tables, plots as SVG, and other replies as monospaced lines. Equal
    replies give equal HTML."""
    return "".join(
        picture(reply) if isinstance(reply, Plot) else blocks_html(layout.blocks(reply, PIPE)) for reply in replies
    )


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
    """Return the pieces of a line as HTML with their colours."""
    shown = []
    for text, ink in pieces:
        colour, bold = COLOURS[ink]
        style = f"color:{colour};" * bool(colour) + "font-weight:bold" * bold
        shown.append(f'<span style="{style}">{escape(text)}</span>' if style else escape(text))
    return "".join(shown)


def _table(grid: Grid) -> str:
    """Return a grid as an HTML table, in which no line breaks between a number and its unit."""
    styles = ["text-align:right;white-space:nowrap" if column.right else "text-align:left" for column in grid.columns]
    heads = [column.heading for column in grid.columns]
    head = f"<thead><tr>{_cells('th', heads, styles)}</tr></thead>" if any(heads) else ""
    rows = "".join(f"<tr>{_cells('td', row, styles)}</tr>" for row in grid.rows)
    return f"<table>{head}<tbody>{rows}</tbody></table>"


def _cells(tag: str, texts: Iterable[str], styles: Iterable[str]) -> str:
    return "".join(f'<{tag} style="{how}">{escape(text)}</{tag}>' for text, how in zip(texts, styles, strict=True))


# --- plots as SVG ---------------------------------------------------------------------------------------------------


class SvgScale:
    """A scale that maps values from `low` to `high` to picture coordinates from `begin` to `end` [px]."""

    def __init__(self, low: float, high: float, begin: float, end: float) -> None:
        room = 0.0 if high - low > 1e-9 else 1.0
        self.low, self.high, self.begin, self.end = low - room, high + room, begin, end

    def place(self, value: float) -> float:
        return self.begin + (value - self.low) / (self.high - self.low) * (self.end - self.begin)

    def marks(self) -> Iterator[float]:
        """Return round values along the scale."""
        step = chart.round_step((self.high - self.low) / LINES)
        return (number * step for number in range(ceil(self.low / step), floor(self.high / step) + 1))


def picture(plot: Plot, at: float | None = None) -> str:
    """Return a plot as an SVG element. `at`: a time [s] that a vertical line marks."""
    values = [value for curve in plot.curves for value in curve.values]
    across = SvgScale(plot.times[0], plot.times[-1], LEFT, WIDTH - RIGHT)
    up = SvgScale(min(values), max(values), HEIGHT - BOTTOM, TOP)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        f'font-family="sans-serif" font-size="11" fill="{GREY}">',
        _text(LEFT, 14, f"{plot.title} [{plot.unit}]", "start"),
        *_grid(across, up),
        *_curves(plot, across, up),
    ]
    if at is not None:
        line = f"M{across.place(min(max(at, plot.times[0]), plot.times[-1])):.1f} {TOP}V{HEIGHT - BOTTOM}"
        parts.append(f'<path d="{line}" stroke="{RED}" stroke-width="2" stroke-dasharray="4 3"/>')
    return "\n".join([*parts, "</svg>\n"])


def _grid(across: SvgScale, up: SvgScale) -> Iterator[str]:
    for value in up.marks():
        y = up.place(value)
        yield _stroke(f"M{LEFT} {y:.1f}H{WIDTH - RIGHT}")
        yield _text(LEFT - 6, y + 4, f"{value + 0.0:.6g}", "end")
    for value in across.marks():
        x = across.place(value)
        yield _stroke(f"M{x:.1f} {TOP}V{HEIGHT - BOTTOM}")
        yield _text(x, HEIGHT - BOTTOM + 16, f"{value + 0.0:.6g}", "middle")
    yield _text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 4, "t [s]", "middle")


def _curves(plot: Plot, across: SvgScale, up: SvgScale) -> Iterator[str]:
    for number, curve in enumerate(plot.curves):
        colour, _ = COLOURS[CURVES[number % len(CURVES)]]
        points = zip(plot.times, curve.values, strict=True)
        path = "M" + "L".join(f"{across.place(t):.1f} {up.place(value):.1f}" for t, value in points)
        yield f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
        yield f'<text x="{WIDTH - RIGHT + 8}" y="{TOP + 10 + 16 * number}" fill="{colour}">{escape(curve.label)}</text>'


def _stroke(path: str) -> str:
    return f'<path d="{path}" stroke="{GREY}" stroke-opacity="0.25"/>'


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'


_MARKDOWN_SIGNS = re.compile(r"[\\`*_{}\[\]<>()#+!|$~&]")
_LATEX = {"\\": r"\backslash ", "^": r"\^{}", "~": r"\~{}", **{one: f"\\{one}" for one in "{}$&#%_"}}


def markdown(shown: Iterable[Block]) -> str:
    """Return blocks as Markdown: formulas are between $$, and the first row of each table contains the column headings.
    User text is escaped."""
    parts = []
    for block in shown:
        if block.latex:
            parts.append(f"$${block.latex}$$")
        elif isinstance(block, Grid):
            sides = ["---:" if column.right else ":---" for column in block.columns]
            rows = [[column.heading for column in block.columns], sides, *block.rows]
            parts.append("\n".join(f"| {' | '.join(row if row is sides else map(_escape, row))} |" for row in rows))
        else:
            bold = "**" * all(ink is Ink.HEADING for _, ink in block.pieces)
            parts.append(f"{bold}{_escape(block.text)}{bold}")
    return "\n\n".join(parts) + "\n"


def _escape(text: str) -> str:
    return _MARKDOWN_SIGNS.sub(lambda found: f"\\{found[0]}", text.strip())


def latex_document(shown: Iterable[Block]) -> str:
    """Return blocks as LaTeX that MathJax can also draw: text is copied unchanged, and formulas and tables are between
    $$."""
    parts = []
    for block in shown:
        if block.latex:
            parts.append(f"$${block.latex}$$")
        elif isinstance(block, Grid):
            sides = "".join("r" if column.right else "l" for column in block.columns)
            heads = [column.heading for column in block.columns]
            rows = [
                " & ".join(rf"\text{{{_latex_text(cell)}}}" if cell.strip() else "" for cell in row)
                for row in (*([heads] if any(heads) else []), *block.rows)
            ]
            parts.append(rf"$$\begin{{array}}{{{sides}}}" + r" \\ ".join(rows) + r"\end{array}$$")
        else:
            parts.append(_latex_text(block.text))
    return "\n\n".join(parts) + "\n"


def _latex_text(text: str) -> str:
    return "".join(_LATEX.get(one, one) for one in text.strip())


TRANSCRIPT_PAGE = Page(100, unicode=True)


class TranscriptFormat(NamedTuple):
    """The parts of a transcript: its start, its end, and a function that writes a line."""

    begin: str
    line: Callable[[TextLine], str]
    end: str


TEXT_FORMAT = TranscriptFormat("", lambda line: f"{line.text}\n", "")
HTML_FORMAT = TranscriptFormat(
    '<!DOCTYPE html>\n<html><head><meta charset="utf-8"><title>vrs</title></head><body><pre>\n',
    lambda line: f"{pieces_html(line.pieces)}\n",
    "</pre></body></html>\n",
)


class Transcript:
    """A transcript file that is being written. Raises OSError."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._open_line = ""
        self._format = HTML_FORMAT if path.suffix.lower() in (".html", ".htm") else TEXT_FORMAT
        self._stream: TextIO = path.open("w", encoding="utf-8", newline="\n")
        self._put(self._format.begin)

    def add_typed(self, prompt: str, text: str) -> None:
        self._line(TextLine(((prompt, Ink.NOTE), (text, Ink.HEADING))))

    def reply(self, reply: Reply) -> None:
        for one in block_lines(layout.blocks(reply, TRANSCRIPT_PAGE), TRANSCRIPT_PAGE.width):
            self._line(one)

    def type(self, text: str) -> None:
        """Add output of TYPE. A line is written when it is complete."""
        *complete, self._open_line = (self._open_line + text).split("\n")
        for one in complete:
            self._line(line(one))

    def close(self) -> None:
        if self._open_line:
            self._line(line(self._open_line))
        self._put(self._format.end)
        self._stream.close()

    def _line(self, one: TextLine) -> None:
        self._put(self._format.line(TextLine(tuple((plain.visible(text), ink) for text, ink in one.pieces))))

    def _put(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()
