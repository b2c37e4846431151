"""Joint vectors, and the turns of a joint: one turn on is the same pose, but not the same joint value."""

from __future__ import annotations

from math import ceil, pi

Joints = tuple[float, ...]

TURN = 2 * pi
LIMIT_TOLERANCE = 1e-9  # [rad] rounding that a joint at its very limit is forgiven


def nearest_turn(angle: float, reference: float) -> float:
    """`angle` plus whole turns, within half a turn of `reference` [rad]."""
    off = angle - reference
    return angle if -pi <= off <= pi else angle - TURN * round(off / TURN)


def turn_within(angle: float, reference: float, lower: float, upper: float) -> float | None:
    """Of all turns of `angle` inside the limits the one nearest to `reference` [rad]; None if there is none.

    A value outside by rounding alone (LIMIT_TOLERANCE) is set to the limit itself.
    """
    here = nearest_turn(angle, reference)
    if lower <= here <= upper:
        return here
    if here < lower:
        here += TURN * ceil((lower - LIMIT_TOLERANCE - here) / TURN)
    else:
        here -= TURN * ceil((here - upper - LIMIT_TOLERANCE) / TURN)
    inside = lower - LIMIT_TOLERANCE <= here <= upper + LIMIT_TOLERANCE
    return min(max(here, lower), upper) if inside else None


def joints_outside(q: Joints, lower: Joints, upper: Joints) -> tuple[int, ...]:
    """The joints that are out of their limits, counted from 1, as JT1 is."""
    return tuple(
        i
        for i, (angle, low, high) in enumerate(zip(q, lower, upper, strict=True), 1)
        if not low - LIMIT_TOLERANCE <= angle <= high + LIMIT_TOLERANCE
    )


def largest_change(a: Joints, b: Joints) -> float:
    """The most that any joint moves between two joint vectors [rad]."""
    return max(abs(y - x) for x, y in zip(a, b, strict=True))
