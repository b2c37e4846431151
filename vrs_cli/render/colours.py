"""What a piece of text is, and the colour that goes with it: one table for the input line, listings, tables and bars.

Text stands on the background of the terminal, which may be dark or light. Its colours have a contrast of at least 4.5
to 1 to black and to white (WCAG 2.2, success criterion 1.4.3): their relative luminance is 0.175 to 0.183. The sixteen
colours of terminals have not: bright black on black has 2.4 to 1 in common palettes, yellow on white 1.1. Bars bring a
background of their own.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum


class Ink(Enum):
    """What a piece of text is: that decides how it is drawn."""

    TEXT = "text"
    HEADING = "heading"
    NAME = "name"
    NUMBER = "number"
    STRING = "string"
    COMMAND = "command"
    INSTRUCTION = "instruction"
    CONTROL = "control"
    FUNCTION = "function"
    OPERATOR = "operator"
    COMMENT = "comment"
    NOTE = "note"
    WARNING = "warning"
    ERROR = "error"
    CURVE_1 = "curve1"
    CURVE_2 = "curve2"
    CURVE_3 = "curve3"
    CURVE_4 = "curve4"
    CURVE_5 = "curve5"
    CURVE_6 = "curve6"


CURVES = (Ink.CURVE_1, Ink.CURVE_2, Ink.CURVE_3, Ink.CURVE_4, Ink.CURVE_5, Ink.CURVE_6)

MAGENTA = "#d700af"
GREEN = "#008900"
CYAN = "#008484"
YELLOW = "#b06000"
BLUE = "#5f5fff"
GREY = "#767676"
RED = "#eb0000"

Palette = Mapping[Ink, tuple[str, bool]]  # colour ("" is the terminal's own), bold

COLOURS: Palette = {
    Ink.TEXT: ("", False),
    Ink.HEADING: ("", True),
    Ink.NAME: ("", False),
    Ink.NUMBER: (MAGENTA, False),
    Ink.STRING: (GREEN, False),
    Ink.COMMAND: (CYAN, True),
    Ink.INSTRUCTION: (CYAN, False),
    Ink.CONTROL: (YELLOW, False),
    Ink.FUNCTION: (BLUE, True),
    Ink.OPERATOR: ("", False),
    Ink.COMMENT: (GREY, False),
    Ink.NOTE: (GREY, False),
    Ink.WARNING: (YELLOW, False),
    Ink.ERROR: (RED, False),
    Ink.CURVE_1: (RED, False),
    Ink.CURVE_2: (GREEN, False),
    Ink.CURVE_3: (BLUE, True),
    Ink.CURVE_4: (YELLOW, False),
    Ink.CURVE_5: (MAGENTA, False),
    Ink.CURVE_6: (CYAN, False),
}


class Bar(Enum):
    """A row with a background of its own."""

    STATUS = "status"
    TITLE = "title"
    MISTAKE = "mistake"
    CHOSEN = "chosen"
    ARGUMENT = "argument"


# text, background
BARS: Mapping[Bar, tuple[str, str]] = {
    Bar.STATUS: ("#d0d0d0", "#303030"),
    Bar.TITLE: ("#ffffff", "#005f87"),
    Bar.MISTAKE: ("#ffffff", "#af0000"),
    Bar.CHOSEN: ("#ffffff", "#005f87"),
    Bar.ARGUMENT: ("#ffffff", "#303030"),
}


def ink_style(ink: Ink, palette: Palette = COLOURS) -> str:
    """Return the style in words that rich and prompt-toolkit both read."""
    colour, bold = palette[ink]
    return " ".join(("bold",) * bold + (colour,) * bool(colour))


def bar_style(bar: Bar) -> str:
    """The style of a bar in prompt-toolkit's words."""
    text, background = BARS[bar]
    return f"noreverse fg:{text} bg:{background}"
