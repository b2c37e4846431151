"""Every ink has a colour that both libraries know."""

import pytest
from prompt_toolkit.styles import Style
from rich.style import Style as RichStyle

from tests.render.contrast import LEAST, contrast
from vrs_cli.render.colours import BARS, COLOURS, Bar, Ink, ink_style


def test_every_ink_has_a_colour() -> None:
    assert set(COLOURS) == set(Ink)


@pytest.mark.parametrize("ink", Ink)
def test_both_libraries_take_the_style(ink: Ink) -> None:
    RichStyle.parse(ink_style(ink))
    attributes = Style([]).get_attrs_for_style_str(ink_style(ink))
    assert attributes.bold == COLOURS[ink][1]


@pytest.mark.parametrize("ink", [ink for ink in Ink if COLOURS[ink][0]])
def test_text_is_readable_on_dark_and_on_light_backgrounds(ink: Ink) -> None:
    colour, _ = COLOURS[ink]
    assert contrast(colour, "#000000") >= LEAST
    assert contrast(colour, "#ffffff") >= LEAST


@pytest.mark.parametrize("bar", Bar)
def test_bars_are_readable(bar: Bar) -> None:
    assert contrast(*BARS[bar]) >= LEAST


def test_the_measure_is_that_of_the_standard() -> None:
    assert contrast("#000000", "#ffffff") == 21.0
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)  # the known border case
