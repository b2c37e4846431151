"""Define the values of programs, and format numbers as VAL-II prints them."""

from __future__ import annotations

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform

DECIMALS = 3


def decimal(value: float, decimals: int = DECIMALS) -> str:
    """Format a number with a given number of decimals. Zero never has a minus sign, even after rounding."""
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if text.startswith("-") and not text.strip("-0.") else text


def seconds(value: float) -> str:
    """Format a time with its unit."""
    return f"{decimal(value)} s"


def count(number: int, one: str) -> str:
    """Format a count with its noun: `1 step`, `2 steps`."""
    return f"{number} {one}{'s' * (number != 1)}"


Value = float | str | Transform | Joints


LIMIT = 3.4028235e38  # maximum absolute value of a real: single precision (V+ User's Guide p.102)
