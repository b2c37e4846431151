"""Times on the timeline are multiples of 2**-30 s (0.93 ns), held as floats.

A float holds such multiples exactly up to 2**23 s (97 days), so sums, differences and shifts of times are exact: a
timeline has not changed by a bit after a million shifts back and forth, and undoing a shift restores every bit.
"""

from __future__ import annotations

from math import ceil, floor

TICKS_PER_SECOND = 2.0**30
TICK = 2.0**-30
LATEST = 2.0**22  # [s] (48 days) latest time allowed, so that the sum of two times is still exact


def on_grid(t: float) -> float:
    """Return the instant nearest to t [s]."""
    return round(t * TICKS_PER_SECOND) * TICK


def up_to_grid(t: float) -> float:
    """Return the first instant that is not before t [s]."""
    return ceil(t * TICKS_PER_SECOND) * TICK


def down_to_grid(t: float) -> float:
    """Return the last instant that is not after t [s]."""
    return floor(t * TICKS_PER_SECOND) * TICK


def round_to_ns(t: float) -> float:
    """Round a time to 1 ns, so that 3.1 is written as 3.1."""
    return round(t, 9) + 0.0
