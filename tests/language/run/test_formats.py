"""Values as TYPE and $ENCODE show them."""

from __future__ import annotations

import pytest

from vrs_cli.kinematics.joints import TURNING
from vrs_cli.language.run.formats import TypeItem, encode
from vrs_cli.language.text.ast import Format
from vrs_cli.language.words.values import transformation
from vrs_cli.values.diagnostics import Span

NOWHERE = Span(1, 1, 1)


def form(code: str, width: int | None = None, decimals: int | None = None) -> Format:
    return Format(code, width, decimals, span=NOWHERE)


@pytest.mark.parametrize(
    ("item", "value", "text"),
    [
        (form("F", 8, 2), 3.14159, "    3.14"),
        (form("F", 8, 0), 3.7, "       4"),
        (form("F", 0, 3), -3.14159, "-3.142"),
        (form("F", 6, 2), -0.001, "  0.00"),
        (form("F", 4, 2), 12345.0, "****"),
        (form("E", 12, 3), 12345.678, "   1.235E+04"),
        (form("E", 5, 3), 1.0, "*****"),
        (form("G", 8, 2), 12.5, "   12.50"),
        (form("G", 10, 2), 1e12, "  1.00E+12"),
        (form("G", 10, 2), 1e-6, "  1.00E-06"),
        (form("G", 8, 3), 0.0001, "1.00E-04"),
        (form("G", 8, 3), -0.0001, "-1.0E-04"),
        (form("G", 8, 3), 123456789.0, "1.23E+08"),
        (form("G", 5, 3), 0.0001, "1E-04"),
        (form("G", 4, 3), 0.0001, "****"),
        (form("I", 5), 41.5, "   42"),
        (form("I"), -7.0, "-7"),
        (form("I", 2), 1000.0, "**"),
        (form("H", 6), 255.0, "    FF"),
        (form("H"), -1.0, "FFFFFF"),
        (form("O"), 8.0, "10"),
        (form("D"), 1.5, " 1.5"),
    ],
)
def test_number_formats(item: Format, value: float, text: str) -> None:
    assert encode([item, value]) == (text, True)


def test_a_format_holds_until_the_next() -> None:
    assert encode([form("F", 6, 1), 1.0, 2.0, form("D"), 3.0]) == ("   1.0   2.0 3", True)


@pytest.mark.parametrize(
    ("items", "text", "newline"),
    [
        (["a", "b"], "ab", True),
        ([form("X", 3), "a"], "   a", True),
        (["a", form("C", 2), "b"], "a\n\nb", True),
        (["a", form("C"), "b"], "a\nb", True),
        (["a", form("S")], "a", False),
        ([form("B")], "\a", True),
        ([form("U", 2)], "\x1b[2A", True),
        ([], "", True),
    ],
)
def test_controls(items: list[TypeItem], text: str, newline: bool) -> None:
    assert encode(items) == (text, newline)


def test_locations_are_shown_by_their_numbers() -> None:
    place = transformation((500.0, -100.5, 20.0, 90.0, -90.0, 0.0))
    assert encode([place]) == (" 500 -100.5 20 90 -90 0", True)
    assert encode([form("F", 0, 1), TURNING.read((0.0, -90.0, 90.0))]) == (" 0.0 -90.0 90.0", True)
