"""Rounding of measured values, comparison with what is allowed, and the verdict of one check.

A value is rounded before it is compared, so that the last bits of a float decide nothing. It passes if it exceeds its
threshold by no more than the rounding. All numbers here are in the units of an exercise: mm, degrees, seconds.
"""

from __future__ import annotations

from math import floor

from msgspec import Struct

from vrs_cli.kinematics.transform import Vector

NOISE_DIGITS = 6  # of a value counted in roundings: what lies behind them is noise of floats
NOISE = 5e-7  # roundings: half of the last such digit
SLACK = 1e-6  # roundings


class Rounding(Struct, frozen=True):
    """The step to which values are rounded: lengths [mm], angles [deg], times [s]."""

    mm: float = 0.1
    deg: float = 0.1
    s: float = 0.01


class Verdict(Struct, frozen=True):
    """`share`: the part of the points that is earned, from 0 to 1. `at`: the time that shows the reason [s]."""

    share: float
    reason: str
    at: float | None = None


def rounded(value: float, step: float) -> float:
    """Return the nearest multiple of a step, half a step upwards; noise of floats next to a half decides nothing."""
    count = floor(round(value / step, NOISE_DIGITS) + 0.5)
    return round(count * step, 12) + 0.0


def exceeds(value: float, most: float, step: float) -> bool:
    """Return whether a value, rounded to a step, is more than the step above what is allowed."""
    return rounded(value, step) / step > most / step + 1.0 + SLACK


def largest(most: float, step: float) -> float:
    """Return the value from which on values exceed what is allowed; `exceeds` draws the same line."""
    return (floor(most / step + 1.0 + SLACK) + 0.5 - NOISE) * step


def smallest(least: float, step: float) -> float:
    """Return the value below which values fall short of what is wanted."""
    return -largest(-least, step)


def falls_short(value: float, least: float, step: float) -> bool:
    """Return whether a value, rounded to a step, is more than the step below what is wanted."""
    return exceeds(-value, -least, step)


def written(value: float, step: float) -> str:
    """Return a rounded value with the decimals of its step: `23.4`."""
    decimals = next((count for count in range(7) if abs(step * 10**count - round(step * 10**count)) < SLACK), 7)
    return f"{rounded(value, step):.{decimals}f}"


def written_place(place: Vector, step: float) -> str:
    """Return a place given in metres as `[0.0, 550.0, -250.0]` in mm."""
    return f"[{', '.join(written(1000.0 * x, step) for x in place)}]"
