"""Format values as strings for TYPE and $ENCODE, in number formats (V+ Language User's Guide; val2 section 4.7)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import log10

from vrs_cli.kinematics.joints import TURNING, JointUnits
from vrs_cli.language.text.ast import Format
from vrs_cli.language.words.values import EXACT, INTEGER_BITS, default_form, integer, numbers_of, whole
from vrs_cli.values.numbers import Value


def _fit(text: str, width: int) -> str:
    """Right-justify a string in a field of this width; return asterisks if the string does not fit. With a width of 0,
    return it unchanged."""
    if not width:
        return text
    return text.rjust(width) if len(text) <= width else "*" * width


def _fixed_point(value: float, width: int, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    return _fit(text[1:] if text[0] == "-" and not text.strip("-0.") else text, width)  # write -0.00 as 0.00


def _general(value: float, width: int, decimals: int) -> str:
    """Return a number in format F, if it fits the width and is not so small that all decimals would be 0; otherwise in
    format E with as many decimals as fit, or asterisks if even 0 decimals do not fit."""
    text = _fixed_point(value, 0, decimals)
    small = value != 0.0 and log10(abs(value)) < -decimals
    if not small and abs(value) < EXACT and (not width or len(text) <= width):
        return _fit(text, width)
    forms = (f"{value:.{fewer}E}" for fewer in range(decimals, -1, -1))
    return next((form.rjust(width) for form in forms if not width or len(form) <= width), "*" * width)


def _in_base(letter: str) -> Callable[[float, int, int], str]:
    """Return a function that formats integers in the number base of Python's format code `letter`. Negative numbers are
    shown in two's complement with 24 bits."""
    return lambda value, width, _: _fit(format(integer(value) % (1 << INTEGER_BITS), letter), width)


# by format code: a function that formats a value with a width and a number of decimals
NUMBER_FORMS: dict[str, Callable[[float, int, int], str]] = {
    "D": lambda value, _width, _decimals: default_form(value),
    "F": _fixed_point,
    "E": lambda value, width, decimals: _fit(f"{value:.{decimals}E}", width),
    "G": _general,
    "I": lambda value, width, _: _fit(str(whole(value)), width),
    "H": _in_base("X"),
    "O": _in_base("o"),
}
DECIMALS = 3  # number of decimals if the format code gives none

CONTROLS: dict[str, Callable[[int], str]] = {
    "B": lambda _: "\a",
    "C": lambda count: "\n" * count,
    "X": lambda count: " " * count,
    "U": lambda count: f"\x1b[{count}A",
}

TypeItem = Value | Format


def encode(items: Iterable[TypeItem | None], units: JointUnits = TURNING) -> tuple[str, bool]:
    """Return the text for the items of a TYPE, and whether a newline follows it (`/S` suppresses the newline).

    A location is shown as its six numbers, a precision point as its joints; each number follows a blank and has the
    format of the last format code before the item.
    """
    parts, newline = list[str](), True
    form, width, decimals = NUMBER_FORMS["D"], 0, DECIMALS
    for item in items:
        if isinstance(item, float):
            parts.append(form(item, width, decimals))
        elif isinstance(item, str):
            parts.append(item)
        elif isinstance(item, Format):
            if item.code in NUMBER_FORMS:
                form, width = NUMBER_FORMS[item.code], item.width or 0
                decimals = DECIMALS if item.decimals is None else item.decimals
            elif item.code in CONTROLS:
                parts.append(CONTROLS[item.code](1 if item.width is None else item.width))
            elif item.code == "S":  # the remaining code N only changes how WRITE waits, so it is ignored here
                newline = False
        elif item is not None:
            shown = (form(number, width, decimals) for number in numbers_of(item, units))
            parts += (text if text.startswith(" ") else f" {text}" for text in shown)
    return "".join(parts), newline
