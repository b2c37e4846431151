"""What a piece of text is, and the colour that goes with it: one table for the input line, listings and tables.

The sixteen colours of the terminal itself are used, so that the user's own palette decides how they look.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum


class Role(Enum):
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


CURVES = (Role.CURVE_1, Role.CURVE_2, Role.CURVE_3, Role.CURVE_4, Role.CURVE_5, Role.CURVE_6)

# colour ("" is the terminal's own), bold
COLOURS: Mapping[Role, tuple[str, bool]] = {
    Role.TEXT: ("", False),
    Role.HEADING: ("", True),
    Role.NAME: ("", False),
    Role.NUMBER: ("magenta", False),
    Role.STRING: ("green", False),
    Role.COMMAND: ("cyan", True),
    Role.INSTRUCTION: ("cyan", False),
    Role.CONTROL: ("yellow", False),
    Role.FUNCTION: ("blue", True),
    Role.OPERATOR: ("", False),
    Role.COMMENT: ("bright_black", False),
    Role.NOTE: ("bright_black", False),
    Role.WARNING: ("yellow", False),
    Role.ERROR: ("red", False),
    Role.CURVE_1: ("red", False),
    Role.CURVE_2: ("green", False),
    Role.CURVE_3: ("blue", True),
    Role.CURVE_4: ("yellow", False),
    Role.CURVE_5: ("magenta", False),
    Role.CURVE_6: ("cyan", False),
}


def rich_style(role: Role) -> str:
    """The style in rich's words."""
    colour, bold = COLOURS[role]
    return " ".join(word for word in ("bold" if bold else "", colour) if word)


def toolkit_style(role: Role) -> str:
    """The style in prompt-toolkit's words."""
    colour, bold = COLOURS[role]
    words = ["bold"] if bold else []
    if colour:
        words.append("fg:ansi" + colour.replace("_", ""))
    return " ".join(words)
