"""Draw the arm for SHOW in the terminal, from the side and from above, in braille dots with colours or in letters."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import IntEnum
from itertools import pairwise
from typing import NamedTuple

from vrs_cli.kinematics.transform import Vector, along, position
from vrs_cli.render.blocks import Page, Piece, TextLine
from vrs_cli.render.chart import FINE, PLAIN, Canvas, Cell, Dot, round_step
from vrs_cli.render.colours import Ink
from vrs_cli.values.numbers import decimal, seconds
from vrs_cli.values.replies import ArmPicture, BodyKind

WIDTH, HEIGHT = 80, 21  # columns and rows of the picture, if the size of the page is not known
TEXT_ROWS = 3  # rows of text above and below the drawing
MIN_WIDTH, MIN_HEIGHT = 24, 7
GAP = 2  # columns between the two views
FLAT = 0.01  # fraction of the reach: an arm with a smaller height range is drawn only from above
THICK = 0.055  # fraction of the reach: thickness of the links at the base; it shrinks to half at the tool
HAND = 0.06  # fraction of the reach: length of the fingers, and their distance when open
EDGE = 0.04  # fraction of the reach: free margin around the picture


class DrawnPart(IntEnum):
    """The parts of the picture in the order in which they cover each other, from the back to the front."""

    REACH = 0
    PAST = 1
    PLANNED = 2
    BASE = 3
    FIXTURE = 4
    SENSOR = 5
    SENSOR_ON = 6
    LINK = 7
    JOINT = 8
    HAND = 9
    PART = 10
    TARGET = 11


class PartStyle(NamedTuple):
    """How a part of the picture is drawn: its ink (kind of text, which decides the colour), its letter if the terminal
    shows no dots, and its name in the legend."""

    ink: Ink
    letter: str
    name: str = ""


LOOKS: Mapping[int, PartStyle] = {
    DrawnPart.REACH: PartStyle(Ink.NOTE, "'", "reach"),
    DrawnPart.PAST: PartStyle(Ink.CURVE_3, ".", "past"),
    DrawnPart.PLANNED: PartStyle(Ink.CURVE_2, ":", "planned"),
    DrawnPart.BASE: PartStyle(Ink.NOTE, "="),
    DrawnPart.FIXTURE: PartStyle(Ink.NOTE, "_", "fixture"),
    DrawnPart.SENSOR: PartStyle(Ink.NOTE, "-", "sensor"),
    DrawnPart.SENSOR_ON: PartStyle(Ink.CURVE_2, "*", "sensor on"),
    DrawnPart.PART: PartStyle(Ink.CURVE_4, "&", "part"),
    DrawnPart.LINK: PartStyle(Ink.HEADING, "#"),
    DrawnPart.JOINT: PartStyle(Ink.CURVE_6, "O"),
    DrawnPart.HAND: PartStyle(Ink.CURVE_4, "%"),
    DrawnPart.TARGET: PartStyle(Ink.CURVE_5, "X", "target"),
}


BODIES: Mapping[BodyKind, DrawnPart] = {
    BodyKind.FIXTURE: DrawnPart.FIXTURE,
    BodyKind.PART: DrawnPart.PART,
    BodyKind.HELD: DrawnPart.PART,
    BodyKind.SENSOR: DrawnPart.SENSOR,
    BodyKind.SENSOR_ON: DrawnPart.SENSOR_ON,
}

Points = tuple[Vector, ...]
Lines = tuple[Points, ...]


class View(NamedTuple):
    """One view: the indexes of the coordinates that point right and up."""

    title: str
    right: int
    up: int

    def of(self, p: Vector) -> Dot:
        return p[self.right], p[self.up]


SIDE, ABOVE = View("from the side (X, Z)", 0, 2), View("from above (X, Y)", 0, 1)


class ViewFrame(NamedTuple):
    """The frame of a view: its upper left corner [m] and its horizontal scale in cells per metre. A cell is twice as
    high as it is wide. `size`: half the extent of the arm [m]."""

    view: View
    left: float
    top: float
    scale: float
    width: int
    height: int
    size: float


def arm_picture(picture: ArmPicture, page: Page) -> Iterator[TextLine]:
    """Draw the robot: both views side by side, a scale and a legend."""
    yield from ArmDrawing().lines(picture, page)


class ArmDrawing:
    """A drawing of one arm in successive pictures; the unchanging background is drawn only once."""

    def __init__(self) -> None:
        self._page: tuple[object, ...] = ()
        self._frames: tuple[ViewFrame, ...] = ()
        self._reach: tuple[Canvas, ...] = ()  # for each view, the canvas that shows only the reach
        self._behind: tuple[object, ...] = ()  # the lines of the last picture that belong to the background
        self._canvases: tuple[Canvas, ...] = ()
        # the cells that each line covers in a view, kept from the last picture
        self._kept: dict[tuple[ViewFrame, int], tuple[Points, Sequence[Cell]]] = {}
        self._new = dict(self._kept)
        self._rows: dict[tuple[int, int], tuple[Piece, ...]] = {}  # finished rows of the background, by view and row

    def lines(self, picture: ArmPicture, page: Page) -> Iterator[TextLine]:
        fine, width = page.unicode, max(page.width or WIDTH, MIN_WIDTH)
        canvases = self._draw_canvases(picture, page, width)
        frames = self._frames
        at = picture.position
        x, y, z = (decimal(1e3 * one, 1) for one in position(at.T_world_tool))
        doing = (at.text or "moving") if at.moving else "at rest"
        tool = (f"X {x}  Y {y}  Z {z} mm  ", Ink.NUMBER)
        yield _fit_pieces(((f"At {seconds(at.time)}  ", Ink.NOTE), tool, (doing, Ink.INSTRUCTION)), width)
        yield TextLine(
            tuple((f"{frame.view.title[: frame.width]:<{frame.width + GAP}}", Ink.HEADING) for frame in frames)
        )
        for row in range(frames[0].height):
            yield TextLine(
                tuple(piece for view, canvas in enumerate(canvases) for piece in self._row(view, canvas, row))
            )
        metres = round_step(4.0 / frames[0].scale)  # length of the scale bar: a round number, and at least four cells
        cells = round(metres * frames[0].scale) - 2
        bar = f"├{'─' * cells}┤" if fine else f"|{'-' * cells}|"
        yield _fit_pieces(((f"{bar} {1e3 * metres:g} mm", Ink.NOTE), *_legend(picture, fine)), width)

    def _row(self, view: int, canvas: Canvas, row: int) -> tuple[Piece, ...]:
        """Return the pieces of one row of a view. A row that shows only background is taken from the last picture."""
        kept = self._rows.get((view, row)) if canvas.shared[row] else None
        if kept is None:
            kept = (*canvas.pieces(row, lambda part: LOOKS[part][:2]), (" " * GAP, Ink.TEXT))
            if canvas.shared[row]:
                self._rows[view, row] = kept
        return kept

    def _draw_canvases(self, picture: ArmPicture, page: Page, width: int) -> list[Canvas]:
        here = (page, picture.reach, picture.links[0])
        if here != self._page:
            height = max((page.height or HEIGHT) - TEXT_ROWS, MIN_HEIGHT)
            self._page, self._frames, self._behind, self._kept = here, _frames(picture, width, height), (), {}
            size = FINE if page.unicode else PLAIN
            self._reach = tuple(Canvas(frame.width, frame.height, *size) for frame in self._frames)
            for frame, canvas in zip(self._frames, self._reach, strict=True):
                Pen(frame, page.unicode, canvas).line(DrawnPart.REACH, _outline(frame.view, picture.reach), every=3)
        # the background: all tool paths except the path of the current motion
        behind = (picture.past[:-1], picture.planned[1:])
        if behind != self._behind:
            self._behind, self._rows = behind, {}
            pens = tuple(self._pens(self._reach, page))
            for pen in pens:
                for part, lines in zip((DrawnPart.PAST, DrawnPart.PLANNED), behind, strict=True):
                    for points in lines:
                        pen.canvas.lay(part, self._cells_of(pen, points))
            self._canvases = tuple(pen.canvas for pen in pens)
            self._kept, self._new = self._new, {}
        return [_draw_foreground(pen, picture) for pen in self._pens(self._canvases, page)]

    def _cells_of(self, pen: Pen, points: Points) -> Sequence[Cell]:
        """Return the cells that a line covers; compute them only once for as long as the line stays in the picture."""
        key = (pen.frame, id(points))
        kept = self._new.get(key) or self._kept.get(key)
        if kept is None:
            canvas = pen.canvas.empty()
            Pen(pen.frame, pen.fine, canvas).line(DrawnPart.PAST, points)
            kept = (points, canvas.cells())
        self._new[key] = kept
        return kept[1]

    def _pens(self, canvases: Sequence[Canvas], page: Page) -> Iterator[Pen]:
        """Yield a pen for each view, on a copy of its canvas."""
        for frame, canvas in zip(self._frames, canvases, strict=True):
            yield Pen(frame, page.unicode, canvas.copy())


def _fit_pieces(pieces: Iterable[Piece], width: int) -> TextLine:
    """Return a line with as many pieces as fit into `width`."""
    left, found = width, list[Piece]()
    for text, ink in pieces:
        found.append((text[:left], ink))
        left -= len(found[-1][0])
    return TextLine(tuple(found))


# --- positions of the views ----------------------------------------------------------------------------------------


def _frames(picture: ArmPicture, width: int, height: int) -> tuple[ViewFrame, ...]:
    """Return the frames of the views: one common scale, each view centred."""
    # these points stay the same while the arm moves, and so does the scale
    columns = list(zip(*picture.reach, picture.links[0], strict=True))
    low, high = list(map(min, columns)), list(map(max, columns))
    size = max(b - a for a, b in zip(low, high, strict=True))
    views = (ABOVE,) if high[2] - low[2] <= size * FLAT else (SIDE, ABOVE)
    edge = EDGE * size
    wide = (width - GAP * (len(views) - 1)) // len(views)
    across = high[0] - low[0] + 2 * edge
    up = max(high[view.up] - low[view.up] for view in views) + 2 * edge
    scale = min(wide / across, 2 * height / up)
    rows = min(round(up * scale / 2 + 0.5), height)
    middle = [0.5 * (a + b) for a, b in zip(low, high, strict=True)]
    corners = [(middle[view.right] - 0.5 * wide / scale, middle[view.up] + rows / scale) for view in views]
    return tuple(
        ViewFrame(view, *corner, scale, wide, rows, 0.5 * size) for view, corner in zip(views, corners, strict=True)
    )


# --- drawing -------------------------------------------------------------------------------------------------------


class Pen:
    """A pen that draws points of the world [m] in one view. `size`: the size of the arm [m]."""

    def __init__(self, frame: ViewFrame, fine: bool, canvas: Canvas) -> None:
        self.frame, self.fine, self.canvas, self.size = frame, fine, canvas, frame.size
        self.across = frame.scale * canvas.dots_wide
        self.down = 0.5 * frame.scale * canvas.dots_high

    def dot(self, p: Vector) -> Dot:
        x, y = self.frame.view.of(p)
        return (x - self.frame.left) * self.across - 0.5, (self.frame.top - y) * self.down - 0.5

    def line(self, part: DrawnPart, points: Sequence[Vector], thick: float = 0.0, every: int = 1) -> None:
        dots = round(thick * self.across) if self.fine else 1
        for a, b in pairwise(map(self.dot, points)):
            self.canvas.stroke(part, a, b, max(dots, 1), every if self.fine else 1)

    def disc(self, part: DrawnPart, p: Vector, radius: float) -> None:
        self.canvas.disc(part, self.dot(p), max(radius * self.across, 1.5) if self.fine else 0.0)

    def cross(self, part: DrawnPart, p: Vector) -> None:
        (x, y), arm = self.dot(p), 2 if self.fine else 0
        self.canvas.stroke(part, (x - arm, y), (x + arm, y))
        self.canvas.stroke(part, (x, y - arm), (x, y + arm))


def _draw_foreground(pen: Pen, picture: ArmPicture) -> Canvas:
    """Draw the current motion, the arm and everything in its cell on the canvas of a pen."""
    for part, lines in ((DrawnPart.PAST, picture.past[-1:]), (DrawnPart.PLANNED, picture.planned[:1])):
        for points in lines:
            pen.line(part, points)
    if pen.frame.view is SIDE:
        (x, y, z), half = picture.links[0], THICK * pen.size
        left, right = (x - half, y, z - half), (x + half, y, z - half)
        pen.line(DrawnPart.BASE, (left, picture.links[0], right, left))
    for body in picture.bodies:
        pen.line(BODIES[body.kind], _outline(pen.frame.view, body.points))
    for i, link in enumerate(pairwise(picture.links)):
        pen.line(DrawnPart.LINK, link, THICK * pen.size * (1.0 - 0.5 * i / (len(picture.links) - 1)))
    for p in picture.joints:
        pen.disc(DrawnPart.JOINT, p, 0.5 * THICK * pen.size)
    T, hand, long = picture.position.T_world_tool, picture.position.hand, HAND * pen.size
    # two fingers, whose distance along the tool's Y axis depends on how far the hand is open
    for side in (-0.5 * long * hand, 0.5 * long * hand):
        root = along(position(T), (T.sx, T.sy, T.sz), side)
        pen.line(DrawnPart.HAND, (position(T), root, along(root, (T.ax, T.ay, T.az), long)))
    if picture.target is not None:
        pen.cross(DrawnPart.TARGET, picture.target)
    return pen.canvas


def _outline(view: View, points: Sequence[Vector]) -> list[Vector]:
    """Return the convex hull of points in a view as a closed polygon (Andrew's monotone chain, 1979)."""
    seen = sorted({view.of(p): p for p in points}.items())
    halves = [_half([p for _, p in row], view) for row in (seen, seen[::-1])]
    return [*halves[0], *halves[1][1:]]


def _half(points: Sequence[Vector], view: View) -> list[Vector]:
    """Return the half of the convex hull to the right of the line from the first point to the last."""
    found = list[Vector]()
    for p in points:
        while len(found) > 1 and not _turns_left(*map(view.of, (*found[-2:], p))):
            found.pop()
        found.append(p)
    return found


def _turns_left(a: Dot, b: Dot, c: Dot) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])


# --- cells and words -----------------------------------------------------------------------------------------------


def _legend(picture: ArmPicture, fine: bool) -> Iterator[Piece]:
    there = {
        DrawnPart.REACH: True,
        DrawnPart.PAST: picture.past,
        DrawnPart.PLANNED: picture.planned,
        DrawnPart.TARGET: picture.target,
        **{BODIES[body.kind]: True for body in picture.bodies},
    }
    for part, is_there in there.items():
        if is_there:
            look = LOOKS[part]
            yield f"   {look.letter if not fine else '•'} {look.name}", look.ink
