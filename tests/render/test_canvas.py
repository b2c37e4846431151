"""Dots of a terminal's cells."""

from __future__ import annotations

from random import Random

from vrs_cli.render.canvas import FINE, PLAIN, Canvas


def rows(canvas: Canvas) -> list[str]:
    return [
        "".join(canvas.braille(r, c) if (r, c) in canvas.dots else " " for c in range(canvas.width))
        for r in range(canvas.height)
    ]


def test_dots_of_a_braille_cell() -> None:
    canvas = Canvas(1, 1, *FINE)
    for x, y in ((0, 0), (1, 1), (1, 2), (1, 3)):
        canvas.mark(0, x, y)
    assert rows(canvas) == ["⢱"]


def test_nothing_is_drawn_outside() -> None:
    canvas = Canvas(2, 2, *FINE)
    for x, y in ((-1, 0), (0, -1), (4, 0), (0, 8)):
        canvas.mark(0, x, y)
    assert not canvas.dots


def test_a_stroke_goes_from_end_to_end_without_a_gap() -> None:
    random = Random(4)
    for _ in range(200):
        a, b = ((random.uniform(0, 19), random.uniform(0, 19)) for _ in range(2))
        canvas = Canvas(20, 20, *PLAIN)
        canvas.stroke(7, a, b)
        cells = sorted((c, r) for r, c in canvas.owner)
        assert (round(a[0]), round(a[1])) in cells
        assert (round(b[0]), round(b[1])) in cells
        for c, r in cells:
            neighbours = [one for one in cells if one != (c, r) and max(abs(one[0] - c), abs(one[1] - r)) <= 1]
            assert neighbours or len(cells) == 1


def test_a_thick_stroke_has_no_holes_whatever_its_slant() -> None:
    random = Random(5)
    for _ in range(100):
        a, b = ((random.uniform(10, 50), random.uniform(10, 50)) for _ in range(2))
        canvas = Canvas(60, 60, *PLAIN)
        canvas.stroke(1, a, b, thick=6)
        filled = set(canvas.owner)
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
    assert canvas.owner == {(0, 0): 2}
    assert rows(canvas) == ["⢁"]


def test_of_a_dotted_stroke_each_third_dot_is_drawn() -> None:
    canvas = Canvas(12, 1, *PLAIN)
    canvas.stroke(0, (0, 0), (9, 0), every=3)
    assert sorted(c for _, c in canvas.owner) == [0, 3, 6, 9]


def test_a_disc() -> None:
    canvas = Canvas(5, 5, *PLAIN)
    canvas.disc(0, (2.0, 2.0), 1.0)
    assert sorted(canvas.owner) == [(1, 2), (2, 1), (2, 2), (2, 3), (3, 2)]
