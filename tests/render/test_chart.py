"""Test PLOT in the terminal, and the canvas of dots."""

from random import Random

import pytest

from vrs_cli.render.blocks import PIPE, Page, Piece
from vrs_cli.render.chart import FINE, HEIGHT, PLAIN, WIDTH, Canvas, chart, round_step
from vrs_cli.render.colours import CURVES, Ink
from vrs_cli.values.replies import Curve, Plot

TIMES = tuple(k / 100.0 for k in range(101))
RAMP = Curve("JT1", "1", tuple(90.0 * t for t in TIMES))
FLAT = Curve("JT2", "2", (10.0,) * 101)
COLOURED = Page(100, colours=True, unicode=True)


def rows(*curves: Curve, page: Page = PIPE) -> list[str]:
    return [line.text for line in chart(Plot("Joints", "deg", TIMES, curves), page)]


def test_a_ramp_goes_from_corner_to_corner() -> None:
    drawn = rows(RAMP)
    top, bottom = drawn[1], drawn[HEIGHT]
    assert top.rstrip().endswith("1")
    assert bottom.startswith("         0 +1")


def test_title_axis_and_legend_say_what_is_drawn() -> None:
    drawn = rows(RAMP, FLAT)
    assert drawn[0] == "Joints [deg]"
    assert drawn[HEIGHT + 1].strip().startswith("+---")
    assert drawn[HEIGHT + 2].split() == ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0", "s"]
    assert drawn[HEIGHT + 3].split() == ["1", "JT1", "0.000", "to", "90.000", "2", "JT2", "10.000", "to", "10.000"]
    assert len(drawn) == HEIGHT + 4


def test_figures_are_round() -> None:
    figures = [row[:11].split()[0] for row in rows(RAMP)[1 : HEIGHT + 1] if row[11] == "+"]
    assert figures == ["80", "60", "40", "20", "0"]


@pytest.mark.parametrize(
    ("least", "step"), [(0.03, 0.05), (0.1, 0.1), (1.0, 1.0), (1.1, 2.0), (22.0, 50.0), (600.0, 1000.0)]
)
def test_steps_are_1_2_or_5_times_a_power_of_ten(least: float, step: float) -> None:
    assert round_step(least) == pytest.approx(step)


def test_curves_that_coincide_are_told_apart() -> None:
    drawn = rows(FLAT, Curve("JT3", "3", FLAT.values), RAMP)
    assert any("22332233" in row for row in drawn[: HEIGHT + 3])


@pytest.mark.parametrize("height", [16, 32])
def test_all_of_it_is_seen_at_once(height: int) -> None:
    curves = [Curve(f"JT{k}", str(k), tuple(k * value for value in RAMP.values)) for k in range(1, 7)]
    drawn = rows(*curves, page=Page(80, colours=True, unicode=True, height=height))
    assert len(drawn) == min(height, HEIGHT + 6)
    assert max(map(len, drawn)) <= 80


def test_a_constant_alone_is_a_line_across_the_middle() -> None:
    drawn = rows(FLAT)
    assert [row for row in drawn[1 : HEIGHT + 1] if "2" * WIDTH in row]


def test_curves_without_a_break() -> None:
    """Every column of the drawing has a mark, also at steep parts."""
    step = Curve("JT1", "1", tuple(0.0 if t < 0.5 else 90.0 for t in TIMES))
    drawn = [row[12:].ljust(WIDTH) for row in rows(step)[1 : HEIGHT + 1]]
    assert all(any(row[column] == "1" for row in drawn) for column in range(WIDTH))
    assert all("1" in row for row in drawn[: HEIGHT + 3])


def test_braille_with_a_colour_for_each_curve() -> None:
    drawn = list(chart(Plot("Joints", "deg", TIMES, (RAMP, FLAT)), COLOURED))
    pieces = [piece for line in drawn[1 : HEIGHT + 1] for piece in line.pieces[1:]]
    assert {ink for text, ink in pieces if text.strip()} == set(CURVES[:2])
    assert all(0x2800 < ord(mark) <= 0x28FF for text, _ in pieces for mark in text.strip())


@pytest.mark.parametrize("width", [30, 60, 80, 100, 300])
def test_it_fits_the_page(width: int) -> None:
    drawn = rows(RAMP, page=Page(width, colours=True, unicode=True))
    assert all(len(row) <= width for row in drawn[: HEIGHT + 3])


# --- the canvas ----------------------------------------------------------------------------------------------------


def pieces(canvas: Canvas, row: int) -> list[Piece]:
    return list(canvas.pieces(row, lambda owner: (CURVES[owner], "#")))


def canvas_rows(canvas: Canvas) -> list[str]:
    return ["".join(text for text, _ in pieces(canvas, row)) for row in range(canvas.height)]


def cells(canvas: Canvas) -> set[tuple[int, int]]:
    """Return row and column of each cell with dots."""
    return {(r, c) for r, owner in enumerate(canvas.owner) for c in owner}


def test_dots_of_a_braille_cell() -> None:
    canvas = Canvas(1, 1, *FINE)
    for x, y in ((0, 0), (1, 1), (1, 2), (1, 3)):
        canvas.mark(0, x, y)
    assert canvas_rows(canvas) == ["⢱"]


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
    assert canvas_rows(canvas) == ["⢁"]


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
