"""PLOT in the terminal."""

import pytest

from vrs_cli.dialogue.replies import Curve, Plot
from vrs_cli.render.blocks import PIPE, Page
from vrs_cli.render.chart import HEIGHT, WIDTH, chart
from vrs_cli.render.colours import CURVES

TIMES = tuple(k / 100.0 for k in range(101))
RAMP = Curve("JT1", "1", tuple(90.0 * t for t in TIMES))
FLAT = Curve("JT2", "2", (10.0,) * 101)
COLOURED = Page(100, colours=True, unicode=True)


def rows(*curves: Curve, page: Page = PIPE) -> list[str]:
    return [line.text for line in chart(Plot("Joints", "deg", TIMES, curves), page)]


def test_a_ramp_goes_from_corner_to_corner() -> None:
    drawn = rows(RAMP)
    top, bottom = drawn[1], drawn[HEIGHT]
    assert top.startswith("    90.000 |")
    assert bottom.startswith("     0.000 |")
    assert top.rstrip().endswith("1")
    assert bottom[12] == "1"


def test_title_axis_and_legend_say_what_is_drawn() -> None:
    drawn = rows(RAMP, FLAT)
    assert drawn[0] == "Joints [deg]"
    assert drawn[HEIGHT + 1].strip().startswith("+---")
    assert drawn[HEIGHT + 2].split()[0] == "0.000"
    assert drawn[HEIGHT + 2].endswith(" s")
    assert drawn[HEIGHT + 3].split() == ["1", "JT1", "0.000", "to", "90.000"]
    assert drawn[HEIGHT + 4].split() == ["2", "JT2", "10.000", "to", "10.000"]


def test_a_constant_alone_is_a_line_across_the_middle() -> None:
    drawn = rows(FLAT)
    assert [row for row in drawn[1 : HEIGHT + 1] if "2" * WIDTH in row]


def test_curves_without_a_break() -> None:
    """Every column of the drawing has a mark, also where the curve is steep."""
    step = Curve("JT1", "1", tuple(0.0 if t < 0.5 else 90.0 for t in TIMES))
    drawn = [row[12:].ljust(WIDTH) for row in rows(step)[1 : HEIGHT + 1]]
    assert all(any(row[column] == "1" for row in drawn) for column in range(WIDTH))
    assert all("1" in row for row in drawn)


def test_braille_with_a_colour_for_each_curve() -> None:
    drawn = list(chart(Plot("Joints", "deg", TIMES, (RAMP, FLAT)), COLOURED))
    pieces = [piece for line in drawn[1 : HEIGHT + 1] for piece in line.pieces[1:]]
    assert {ink for text, ink in pieces if text.strip()} == set(CURVES[:2])
    assert all(0x2800 < ord(mark) <= 0x28FF for text, _ in pieces for mark in text.strip())


@pytest.mark.parametrize("width", [30, 60, 80, 100, 300])
def test_it_fits_the_page(width: int) -> None:
    drawn = rows(RAMP, page=Page(width, colours=True, unicode=True))
    assert all(len(row) <= width for row in drawn[: HEIGHT + 3])
