"""The text of TYPE and $ENCODE: values in number formats (V+ Language User's Guide; val2 section 4.7)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import log10

from msgspec import Struct, field

from vrs_cli.kinematics.joints import TURNING, JointUnits
from vrs_cli.language.text.ast import Format
from vrs_cli.language.words.values import EXACT, INTEGER_BITS, Value, default_form, integer, numbers_of, whole


def _fitted(text: str, width: int) -> str:
    """Right-justified; asterisks where it does not fit. A width of 0 is as wide as needed."""
    if not width:
        return text
    return text.rjust(width) if len(text) <= width else "*" * width


def _default(value: float, _width: int, _decimals: int | None) -> str:
    return default_form(value)


def _fixed(value: float, width: int, decimals: int | None) -> str:
    text = f"{value:.{3 if decimals is None else decimals}f}"
    return _fitted(_unsigned_zero(text), width)


def _scientific(value: float, width: int, decimals: int | None) -> str:
    return _fitted(f"{value:.{3 if decimals is None else decimals}E}", width)


def _general(value: float, width: int, decimals: int | None) -> str:
    """F where the number fits the width and is not too small to show a digit, otherwise E with what fits of its digits;
    asterisks where not even one does.
    """
    digits = 3 if decimals is None else decimals
    fixed = _fixed(value, 0, digits)
    small = value != 0.0 and log10(abs(value)) < -digits
    if not small and abs(value) < EXACT and (not width or len(fixed) <= width):
        return _fitted(fixed, width)
    forms = (f"{value:.{fewer}E}" for fewer in range(digits, -1, -1))
    return next((form.rjust(width) for form in forms if not width or len(form) <= width), "*" * width)


def _integer(value: float, width: int, _decimals: int | None) -> str:
    return _fitted(str(whole(value)), width)


def _in_base(letter: str) -> Callable[[float, int, int | None], str]:
    """Negative integers are shown as the 24 bits that they are."""

    def form(value: float, width: int, _decimals: int | None) -> str:
        return _fitted(format(integer(value) % (1 << INTEGER_BITS), letter), width)

    return form


def _unsigned_zero(text: str) -> str:
    """-0.00 is said as 0.00."""
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


NUMBER_FORMS: dict[str, Callable[[float, int, int | None], str]] = {
    "D": _default,
    "F": _fixed,
    "E": _scientific,
    "G": _general,
    "I": _integer,
    "H": _in_base("X"),
    "O": _in_base("o"),
}

CONTROLS: dict[str, Callable[[int], str]] = {
    "B": lambda _: "\a",
    "C": lambda count: "\n" * count,
    "X": lambda count: " " * count,
    "U": lambda count: f"\x1b[{count}A",
}

TypeItem = Value | Format


class _Output(Struct):
    """The text so far, and the number form in force."""

    units: JointUnits = TURNING
    code: str = "D"
    width: int = 0
    decimals: int | None = None
    parts: list[str] = field(default_factory=list)
    newline: bool = True

    def add(self, item: TypeItem) -> None:
        if isinstance(item, Format):
            self._format(item)
        elif isinstance(item, str):
            self.parts.append(item)
        elif isinstance(item, float):
            self.parts.append(self._number(item))
        else:
            self.parts.extend(map(self._spaced, numbers_of(item, self.units)))

    def _format(self, item: Format) -> None:
        if item.code == "S":
            self.newline = False
        elif item.code in CONTROLS:
            self.parts.append(CONTROLS[item.code](1 if item.width is None else item.width))
        else:
            self.code, self.width, self.decimals = item.code, item.width or 0, item.decimals

    def _number(self, value: float) -> str:
        return NUMBER_FORMS[self.code](value, self.width, self.decimals)

    def _spaced(self, value: float) -> str:
        """One of the numbers of a location: with a blank before it in every form."""
        text = self._number(value)
        return text if text.startswith(" ") else f" {text}"


def encode(items: Iterable[TypeItem | None], units: JointUnits = TURNING) -> tuple[str, bool]:
    """The text of a TYPE list, and whether a newline ends it (`/S` keeps it away).

    A location is shown by its six numbers, a precision point by its joints, each in the form in force.
    """
    output = _Output(units)
    for item in items:
        if item is not None:
            output.add(item)
    return "".join(output.parts), output.newline
