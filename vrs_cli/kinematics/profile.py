"""The profiles of velocity that motions may have. `trajectory/laws` has a file for each, of the same name."""

from __future__ import annotations

from enum import Enum


class Profile(Enum):
    """Words of VAL-II, each with its word in files and what it means. The first is that of a robot that names none."""

    LSPB = "lspb", "linear with parabolic blends"
    SCURVE = "scurve", "jerk limited"
    QUINTIC = "quintic", "polynomials of degree 5"

    def __new__(cls, word: str, summary: str) -> Profile:
        profile = object.__new__(cls)
        profile._value_ = word
        profile.summary = summary
        return profile

    summary: str
