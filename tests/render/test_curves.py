"""Test curves as SVG: right places, round ticks, equal bytes for equal numbers."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest

from vrs_cli.render.plots import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH, Curves, curves_svg, ticks

SPACE = "{http://www.w3.org/2000/svg}"
TIMES = [0.0, 1.0, 2.0, 3.0, 4.0]


def drawn(*panels: Curves) -> ElementTree.Element:
    text = curves_svg(panels, "t [s]")
    assert text == curves_svg(panels, "t [s]")
    return ElementTree.fromstring(text)


def lines(svg: ElementTree.Element) -> list[list[tuple[float, float]]]:
    rows = [one.attrib["points"].split() for one in svg.iter(f"{SPACE}polyline")]
    return [[(float(x), float(y)) for x, y in (point.split(",") for point in row)] for row in rows]


def test_a_curve_goes_from_corner_to_corner() -> None:
    ((first, *_, last),) = lines(drawn(Curves("a [mm]", ["X"], [[0.0, 1.0, 4.0, 9.0, 16.0]], TIMES)))
    assert first == (LEFT, pytest.approx(HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * 0.05 / 1.1, abs=0.1))
    assert last == (WIDTH - RIGHT, pytest.approx(TOP + (HEIGHT - TOP - BOTTOM) * 0.05 / 1.1, abs=0.1))


def test_curves_that_coincide_are_dashed_and_level_ones_are_short() -> None:
    level = [5.0] * 5
    svg = drawn(Curves("a", ["X", "Y"], [level, level], TIMES), Curves("b", ["Z"], [[0.0, -0.0, 0.0, 0.0, 0.0]], TIMES))
    assert [len(line) for line in lines(svg)] == [2, 2, 2]
    assert [one.get("stroke-dasharray") for one in svg.iter(f"{SPACE}polyline")] == [None, "6 6", None]
    assert all(one.text != "-0" for one in svg.iter(f"{SPACE}text"))


def test_names_stay_text() -> None:
    svg = drawn(Curves("<script>alert(1)</script>", ["</svg>"], [[1.0, 2.0, 1.0, 2.0, 1.0]], TIMES))
    assert next(one.text for one in svg.iter(f"{SPACE}text")) == "<script>alert(1)</script>"
    assert not list(svg.iter(f"{SPACE}script"))


def test_marks_stand_at_their_values_and_neighbours_names_do_not_touch() -> None:
    svg = drawn(Curves("a", ["X"], [[0.0, 1.0, 2.0, 3.0, 4.0]], TIMES, [(1.0, "<t_s1"), (1.01, "t_s2")]))
    paths = [one.get("d") for one in svg.iter(f"{SPACE}path") if one.get("stroke-dasharray")]
    assert paths[0] == f"M{LEFT + (WIDTH - LEFT - RIGHT) / 4:.1f} {TOP:g}V{HEIGHT - BOTTOM:g}"
    first, second = (next(one for one in svg.iter(f"{SPACE}text") if one.text == name) for name in ("<t_s1", "t_s2"))
    assert float(second.attrib["y"]) - float(first.attrib["y"]) >= 12


@pytest.mark.parametrize(
    ("low", "high", "found"),
    [
        (0.0, 1.0, [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]),
        (-90.0, 90.0, [-50.0, 0.0, 50.0]),
        (3.0, 3.0, [3.0]),
        (0.0012, 0.0031, [0.0015, 0.002, 0.0025, 0.003]),
    ],
)
def test_ticks_are_round(low: float, high: float, found: list[float]) -> None:
    assert ticks(low, high) == pytest.approx(found)


def test_numbers_have_no_more_digits_than_they_need() -> None:
    text = curves_svg([Curves("a", ["X"], [[0.1, 0.2, 0.3, 0.4, 0.5]], TIMES)], "t")
    assert not re.search(r">-?\d+\.\d{4,}<", text)
