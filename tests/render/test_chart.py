"""PLOT in the terminal."""

import pytest

from vrs_cli.render.blocks import PIPE, Page
from vrs_cli.render.chart import HEIGHT, WIDTH, chart, round_step
from vrs_cli.render.colours import CURVES
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
    """Every column of the drawing has a mark, also where the curve is steep."""
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
