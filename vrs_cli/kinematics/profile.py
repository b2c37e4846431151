"""The profiles of velocity that motions may have."""

from __future__ import annotations

from enum import Enum


class Profile(Enum):
    """How velocity changes: at constant acceleration (linear with parabolic blends), or at constant jerk (S-curve)."""

    LSPB = "lspb"
    SCURVE = "scurve"
