"""How often a trajectory is sampled. Apart from `exports`, so that a command line is read without numpy."""

from __future__ import annotations

DEFAULT_RATE = 100.0  # [Hz]
FASTEST = 100_000.0  # [Hz]
