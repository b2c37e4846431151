"""Dots of a terminal's cells."""

from __future__ import annotations

from random import Random

from vrs_cli.render.blocks import Piece
from vrs_cli.render.canvas import FINE, PLAIN, Canvas
from vrs_cli.render.colours import CURVES, Ink


def pieces(canvas: Canvas, row: int) -> list[Piece]:
    return list(canvas.pieces(row, lambda owner: (CURVES[owner], "#")))


def rows(canvas: Canvas) -> list[str]:
    return ["".join(text for text, _ in pieces(canvas, row)) for row in range(canvas.height)]


def cells(canvas: Canvas) -> set[tuple[int, int]]:
    """Row and column of those that are drawn in."""
    return {(r, c) for r, owner in enumerate(canvas.owner) for c in owner}


def test_dots_of_a_braille_cell() -> None:
    canvas = Canvas(1, 1, *FINE)
    for x, y in ((0, 0), (1, 1), (1, 2), (1, 3)):
        canvas.mark(0, x, y)
    assert rows(canvas) == ["⢱"]


def test_nothing_is_drawn_outside() -> None:
    canvas = Canvas(2, 2, *FINE)
    for x, y in ((-1, 0), (0, -1), (4, 0), (0, 8)):
        canvas.mark(0, x, y)
    assert not cells(canvas)


def test_a_stroke_goes_from_end_to_end_without_a_gap() -> None:
    random = Random(4)
    for _ in range(200):
        a, b = ((random.uniform(0, 19), random.uniform(0, 19)) for _ in range(2))
        canvas = Canvas(20, 20, *PLAIN)
        canvas.stroke(7, a, b)
        drawn = cells(canvas)
        assert {(round(a[1]), round(a[0])), (round(b[1]), round(b[0]))} <= drawn
        for r, c in drawn:
            neighbours = [one for one in drawn if one != (r, c) and max(abs(one[0] - r), abs(one[1] - c)) <= 1]
            assert neighbours or len(drawn) == 1


def test_a_thick_stroke_has_no_holes_whatever_its_slant() -> None:
    random = Random(5)
    for _ in range(100):
        a, b = ((random.uniform(10, 50), random.uniform(10, 50)) for _ in range(2))
        canvas = Canvas(60, 60, *PLAIN)
        canvas.stroke(1, a, b, thick=6)
        filled = cells(canvas)
        holes = [
            (r, c)
            for r in range(60)
            for c in range(60)
            if (r, c) not in filled and {(r, c + 1), (r, c - 1), (r + 1, c), (r - 1, c)} <= filled
        ]
        assert not holes


def test_who_draws_last_owns_the_cell_and_its_dots_stay() -> None:
    canvas = Canvas(1, 1, *FINE)
    canvas.mark(1, 0, 0)
    canvas.mark(2, 1, 3)
    assert canvas.owner == [{0: 2}]
    assert rows(canvas) == ["⢁"]


def test_of_a_dotted_stroke_each_third_dot_is_drawn() -> None:
    canvas = Canvas(12, 1, *PLAIN)
    canvas.stroke(0, (0, 0), (9, 0), every=3)
    assert cells(canvas) == {(0, 0), (0, 3), (0, 6), (0, 9)}


def test_a_disc() -> None:
    canvas = Canvas(5, 5, *PLAIN)
    canvas.disc(0, (2.0, 2.0), 1.0)
    assert cells(canvas) == {(1, 2), (2, 1), (2, 2), (2, 3), (3, 2)}


def test_a_copy_is_drawn_on_alone() -> None:
    canvas = Canvas(2, 1, *PLAIN)
    canvas.mark(1, 0, 0)
    copy = canvas.copy()
    copy.mark(2, 1, 0)
    assert (cells(canvas), cells(copy)) == ({(0, 0)}, {(0, 0), (0, 1)})


def test_a_row_in_pieces_of_one_owner() -> None:
    canvas = Canvas(9, 1, *PLAIN)
    for owner, column in ((1, 1), (1, 2), (2, 3), (2, 6), (3, 7)):
        canvas.mark(owner, column, 0)
    assert pieces(canvas, 0) == [
        (" ", Ink.TEXT),
        ("##", CURVES[1]),
        ("#", CURVES[2]),
        ("  ", Ink.TEXT),
        ("#", CURVES[2]),
        ("#", CURVES[3]),
        (" ", Ink.TEXT),
    ]
    assert pieces(Canvas(3, 1, *PLAIN), 0) == [("   ", Ink.TEXT)]
