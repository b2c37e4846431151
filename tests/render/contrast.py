"""Compute the contrast of two colours by WCAG 2.2 (definitions of relative luminance and contrast ratio)."""

from __future__ import annotations

LEAST = 4.5  # success criterion 1.4.3


def luminance(colour: str) -> float:
    """Return the relative luminance of `#rrggbb`."""
    red, green, blue = (int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5))
    parts = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in (red, green, blue))
    return sum(weight * part for weight, part in zip((0.2126, 0.7152, 0.0722), parts, strict=True))


def contrast(one: str, other: str) -> float:
    darker, lighter = sorted((luminance(one), luminance(other)))
    return (lighter + 0.05) / (darker + 0.05)
