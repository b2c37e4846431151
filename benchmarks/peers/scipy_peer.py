"""scipy's piecewise polynomials read the same timeline: joints only, arrays made anew after every edit."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import PPoly

from benchmarks.peers.timing import at_once, serve


def measure(work: dict[str, Any]) -> dict[str, float]:
    """`starts` (m), `finish`, `coefficients` (m, joints, powers ascending), and sorted times `many`."""
    coefficients = np.array(work["coefficients"]).transpose(2, 0, 1)[::-1]
    breaks = np.array([*work["starts"], work["finish"]])
    polynomials = PPoly(np.ascontiguousarray(coefficients), breaks)
    many = np.array(work["many"])
    return {
        "g many": at_once(lambda: polynomials(many), len(many)),
        "edit": at_once(lambda: _edited(polynomials), 1),
    }


def _edited(old: PPoly) -> object:
    """Five rows inserted in the middle, the later ones shifted, and 1000 times read around them."""
    middle = len(old.x) // 2
    at = old.x[middle]
    breaks = np.concatenate((old.x[:middle], at + np.linspace(0.0, 1.0, 5), old.x[middle:] + 1.25))
    coefficients = np.insert(old.c, [middle] * 5, old.c[:, middle : middle + 1].repeat(5, axis=1), axis=1)
    return PPoly(coefficients, breaks)(np.linspace(at - 500.0, at + 500.0, 1000))


if __name__ == "__main__":
    serve(measure)
