"""The least of a quadratic function of one or two variables, within the box of n joints that these move.

The least lies inside the box, on one of its sides, where one joint is at an end of its range, or on a corner, where two
are. All of these are few, so all are tried at once: this finds the least also where the function does not bend upwards,
and needs no steps from side to side (Nocedal and Wright, "Numerical Optimization", 2006, 16.8, for more variables).
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from vrs_cli.kinematics.arrays import Floats

FLAT = 1e-12  # a bend or a determinant that is none
OVER = 1e-9  # [rad, m] that a step may leave the box, by rounding


def least_in_box(ways: Floats, slope: Floats, bend: Floats, low: Floats, high: Floats) -> Floats:
    """Steps (N, n) of the joints to the least of slope . z + z . bend z / 2, with low <= ways z <= high.

    `ways` (N, n, 2): what the two variables z do to the joints. Where no step stays in the box, the one that leaves it
    least.
    """
    determinant = bend[:, 0, 0] * bend[:, 1, 1] - bend[:, 0, 1] ** 2
    upwards = (determinant > FLAT) & (bend[:, 0, 0] > 0.0)
    x = bend[:, 0, 1] * slope[:, 1] - bend[:, 1, 1] * slope[:, 0]
    y = bend[:, 0, 1] * slope[:, 0] - bend[:, 0, 0] * slope[:, 1]
    z = np.stack((x, y), axis=1) / np.where(upwards, determinant, np.nan)[:, None]
    step = np.asarray(
        (ways @ z[:, :, None])[:, :, 0]
    )  # to where the slope is none; NaN where that is not a least value
    rows = np.flatnonzero(~(_over(step, low, high) <= OVER))
    if len(rows):
        step[rows] = _on_sides(*(some[rows] for some in (ways, slope, bend, low, high, step)))
    return step


def _over(step: Floats, low: Floats, high: Floats) -> Floats:
    """By how much steps (..., n) leave the box at most."""
    return np.asarray(np.maximum(step - high, low - step).max(axis=-1))


def _on_sides(ways: Floats, slope: Floats, bend: Floats, low: Floats, high: Floats, inside: Floats) -> Floats:
    """(N, n): the best of the steps to the sides and corners, and of those inside the box."""
    ends = np.stack((low, high), axis=2)  # (N, n, 2)
    z = np.concatenate((_least_on_sides(ways, slope, bend, ends), _corners(ways, ends)), axis=1)
    steps = np.concatenate((inside[:, None], z @ np.swapaxes(ways, 1, 2)), axis=1)
    value = (z * (slope[:, None] + 0.5 * (z @ bend))).sum(axis=2)
    value = np.concatenate((np.full((len(z), 1), np.inf), value), axis=1)
    over = _over(steps, low[:, None], high[:, None])
    over[np.isnan(over)] = np.inf
    within = over <= OVER
    best = np.where(within.any(axis=1), np.where(within, value, np.inf).argmin(axis=1), over.argmin(axis=1))
    return np.asarray(np.nan_to_num(steps[np.arange(len(steps)), best]))


def _least_on_sides(ways: Floats, slope: Floats, bend: Floats, ends: Floats) -> Floats:
    """(N, 2 n, 2): the variables that are least where one joint is at an end."""
    size = (ways * ways).sum(axis=2)
    foot = (ways / np.where(size > FLAT, size, np.nan)[:, :, None])[:, :, None] * ends[..., None]  # (N, n, 2, 2)
    along = np.stack((-ways[:, :, 1], ways[:, :, 0]), axis=2)
    bent = along @ bend
    curve = (bent * along).sum(axis=2)
    fall = (along * slope[:, None]).sum(axis=2)[:, :, None] + (foot * bent[:, :, None]).sum(axis=3)
    part = -fall / np.where(curve > FLAT, curve, np.nan)[:, :, None]
    return np.asarray((foot + part[..., None] * along[:, :, None]).reshape(len(ways), -1, 2))


def _corners(ways: Floats, ends: Floats) -> Floats:
    """(N, 2 n (n - 1), 2): the variables with which two joints are at ends."""
    first, second = np.array(list(combinations(range(ways.shape[1]), 2))).T
    a, b = ways[:, first], ways[:, second]
    determinant = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    a, b = (one / np.where(np.abs(determinant) > FLAT, determinant, np.nan)[..., None] for one in (a, b))
    at, other = ends[:, first][:, :, :, None], ends[:, second][:, :, None]
    x = at * b[..., 1, None, None] - other * a[..., 1, None, None]
    y = other * a[..., 0, None, None] - at * b[..., 0, None, None]
    return np.stack((x, y), axis=-1).reshape(len(ways), -1, 2)
