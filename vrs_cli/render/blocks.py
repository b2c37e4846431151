"""Define the blocks into which replies are laid out before drawing: lines of coloured pieces, and grids of cells."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from textwrap import wrap

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.render.colours import Ink

Piece = tuple[str, Ink]

SCREEN_ROWS = 200  # maximum rows on a screen for a table that grows with time
GAP = 2  # blanks between the columns of a grid
MIN_FOLD_CHARS = 20  # minimum width of a folded column


class TextLine(Struct, frozen=True):
    """One line of text, in coloured pieces. `latex`: the same line as LaTeX if the line is a formula, otherwise ""."""

    pieces: tuple[Piece, ...]
    latex: str = ""

    @property
    def text(self) -> str:
        return "".join(text for text, _ in self.pieces)


def line(text: str = "", ink: Ink = Ink.TEXT) -> TextLine:
    return TextLine(((text, ink),))


class Column(Struct, frozen=True):
    """A column of a grid. `width`: its minimum number of characters.

    If the grid is too wide, one column becomes narrower: `fold` wraps its long entries over several rows, `cut`
    truncates them.
    """

    heading: str
    ink: Ink = Ink.TEXT
    right: bool = False
    width: int = 0
    fold: bool = False
    cut: bool = False


def number_column(heading: str, width: int = 10) -> Column:
    """Return a column of numbers, ten characters wide as VAL-II prints them."""
    return Column(heading, Ink.NUMBER, right=True, width=width)


def number_columns(*headings: str, width: int = 10) -> tuple[Column, ...]:
    return tuple(number_column(heading, width) for heading in headings)


class Grid(Struct, frozen=True):
    """A table. `tight`: columns have no space between them, because their widths include it. `boxed`: a terminal may
    draw a line below the headings.

    A grid that is too wide is split into grids below each other, which repeat the first `keys` columns. `latex`: the
    same grid as LaTeX, if it is a row of matrices.
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    tight: bool = False
    boxed: bool = False
    keys: int = 0
    latex: str = ""

    def widths(self) -> tuple[int, ...]:
        """Return the width of each column in characters. Columns of numbers in a tight grid include one blank before
        the number."""
        return tuple(
            max(column.width, len(column.heading), *(self.tight * column.right + len(row[i]) for row in self.rows), 0)
            for i, column in enumerate(self.columns)
        )


Block = TextLine | Grid


class Page(Struct, frozen=True):
    """The size and abilities of the output. `width`: characters per line; `rows`: maximum rows of a table that grows
    with time (None: no limit).

    `colours` and `unicode`: whether it shows colours and characters beyond ASCII. `height`: visible rows.
    """

    width: int | None = None
    rows: int | None = None
    colours: bool = False
    unicode: bool = False
    height: int | None = None


PIPE = Page()


def wrap_lines(text: str, ink: Ink, page: Page) -> Iterator[TextLine]:
    """Wrap text into lines that fit the page."""
    return (line(part, ink) for part in wrap(text, page.width or len(text)))


POSE = ("X", "Y", "Z", "O", "A", "T")


def joint_names(count: int) -> tuple[str, ...]:
    """Return the column headings of joints."""
    return tuple(f"JT{i}" for i in range(1, count + 1))


def split(grid: Grid, width: int | None) -> tuple[Grid, ...]:
    """Return the grid unchanged, or split it into several grids that each fit into `width` if possible."""
    gap = 0 if grid.tight else GAP
    widths = grid.widths()
    if width is None or sum(widths) + gap * (len(widths) - 1) <= width:
        return (grid,)
    for i, column in enumerate(grid.columns):
        room = width - (sum(widths) - widths[i]) - gap * (len(widths) - 1)
        if column.fold:
            return (_fold(grid, i, max(room, MIN_FOLD_CHARS)),)
        if column.cut and room >= MIN_FOLD_CHARS:
            cut = (tuple(shorten(cell, room) if k == i else cell for k, cell in enumerate(row)) for row in grid.rows)
            return (replace(grid, rows=tuple(cut)),)
    parts: list[list[int]] = []
    keys = list(range(grid.keys))
    room = 0
    for i in range(grid.keys, len(widths)):
        if not parts or room < widths[i] + gap:
            parts.append([*keys])
            room = width - sum(widths[k] + gap for k in keys) + gap
        parts[-1].append(i)
        room -= widths[i] + gap
    return tuple(
        replace(
            grid,
            columns=tuple(grid.columns[i] for i in part),
            rows=tuple(tuple(row[i] for i in part) for row in grid.rows),
        )
        for part in parts
    )


def _fold(grid: Grid, i: int, room: int) -> Grid:
    """Return the grid with column `i` wrapped at blanks to fit into `room` characters."""
    rows: list[tuple[str, ...]] = []
    for cells in grid.rows:
        first, *others = wrap(cells[i], room) or [""]
        rows.append((*cells[:i], first, *cells[i + 1 :]))
        rows += [tuple(other if k == i else "" for k in range(len(cells))) for other in others]
    return replace(grid, rows=tuple(rows))


def shorten(text: str, room: int) -> str:
    """Truncate text that is too long, and end it in three dots."""
    return text if len(text) <= room else f"{text[: room - 3]}..."


def grid_lines(grid: Grid) -> tuple[TextLine, ...]:
    """Return the lines of a grid: first the headings, then the rows."""
    widths = grid.widths()
    rows = [[(cell, column.ink) for cell, column in zip(row, grid.columns, strict=True)] for row in grid.rows]
    if any(column.heading for column in grid.columns):
        rows.insert(0, [(column.heading, Ink.HEADING) for column in grid.columns])
    return tuple(_row(grid, widths, cells) for cells in rows)


def _row(grid: Grid, widths: tuple[int, ...], cells: list[Piece]) -> TextLine:
    gap = "" if grid.tight else " " * GAP
    last = len(cells) - 1
    pieces: list[Piece] = []
    for i, (column, width, (text, ink)) in enumerate(zip(grid.columns, widths, cells, strict=True)):
        space = " " * (width - len(text))
        if column.right:
            pieces += [(space, Ink.TEXT), (text, ink)]
        else:
            pieces += [(text, ink), ("" if i == last else space, Ink.TEXT)]
        pieces.append(("" if i == last else gap, Ink.TEXT))
    return TextLine(tuple(piece for piece in pieces if piece[0]))


def block_lines(shown: Iterable[Block], width: int | None = None) -> Iterator[TextLine]:
    """Yield the lines of blocks; grids wider than `width` are split."""
    for block in shown:
        for part in split(block, width) if isinstance(block, Grid) else (block,):
            yield from grid_lines(part) if isinstance(part, Grid) else (part,)


def text_of(shown: Iterable[Block]) -> str:
    """Return the text of blocks; each line ends in a newline."""
    return "".join(f"{line.text.rstrip()}\n" for line in block_lines(shown))
