"""Compute with polynomials, which are tuples of coefficients in ascending powers: (a0, a1, a2) is a0 + a1 t +
a2 t**2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import inf, sqrt

Polynomial = tuple[float, ...]


def value(a: Polynomial, t: float) -> float:
    """Return p(t), by Horner's rule."""
    if len(a) == 3:  # parabolas are by far the most frequent case
        return a[0] + t * (a[1] + t * a[2])
    if len(a) == 4:
        return a[0] + t * (a[1] + t * (a[2] + t * a[3]))
    if len(a) == 2:
        return (0.0 * t + a[1]) * t + a[0]  # with the same sign of a zero as the loop below
    result = 0.0
    for coefficient in reversed(a):
        result = result * t + coefficient
    return result


def values(rows: Sequence[Polynomial], t: float) -> list[float]:
    """Return the value p(t) of each polynomial; all have the same degree."""
    if len(rows[0]) == 3:
        return [c0 + t * (c1 + t * c2) for c0, c1, c2 in rows]
    return [value(a, t) for a in rows]


def value_and_rate(a: Polynomial, t: float) -> tuple[float, float]:
    """Return p(t) and dp/dt."""
    if len(a) == 3:
        c0, c1, c2 = a
        return c0 + t * (c1 + t * c2), c1 + 2.0 * c2 * t
    if len(a) == 4:
        c0, c1, c2, c3 = a
        bend = c2 + t * c3
        slope = c1 + t * bend
        return c0 + t * slope, slope + t * (bend + t * c3)
    result = rate = 0.0
    for coefficient in reversed(a):
        rate = rate * t + result
        result = result * t + coefficient
    return result, rate


def second_derivative(a: Polynomial, t: float) -> float:
    """Return d2p/dt2."""
    if len(a) < 4:
        return 2.0 * a[2] if len(a) == 3 else 0.0
    return 2.0 * a[2] + t * 6.0 * a[3] if len(a) == 4 else value(derivative(derivative(a)), t)


def third_derivative(a: Polynomial, t: float) -> float:
    """Return d3p/dt3."""
    if len(a) == 4:
        return 6.0 * a[3]
    return value(derivative(derivative(derivative(a))), t) if len(a) > 4 else 0.0


def derivative_at(a: Polynomial, t: float, order: int) -> float:
    """Return the derivative of p of the given order at time t; order 0 is p(t) itself."""
    for _ in range(order):
        a = derivative(a)
    return value(a, t)


def derivative(a: Polynomial) -> Polynomial:
    """Return the polynomial dp/dt."""
    if len(a) < 4:  # parabolas are by far the most frequent case
        return (a[1], 2.0 * a[2]) if len(a) == 3 else a[1:] or (0.0,)
    return tuple([power * coefficient for power, coefficient in enumerate(a) if power])


def taylor_shift(a: Polynomial, t: float) -> Polynomial:
    """Return the polynomial p(t + s) in s, by repeated Horner schemes."""
    row = list(a)
    for first in range(len(row) - 1):
        for power in range(len(row) - 2, first - 1, -1):
            row[power] += t * row[power + 1]
    return tuple(row)


def parabola(p0: float, v0: float, v1: float, duration: float) -> Polynomial:
    """Return the parabola from position p0 and velocity v0 to velocity v1, at constant acceleration."""
    return (p0, v0, 0.5 * (v1 - v0) / duration)


def zeros(a: Polynomial, lasting: float) -> list[float]:
    """Return the times between 0 and `lasting` at which p(t) is zero, in order; a zero of odd multiplicity once."""
    if len(a) <= 3:
        c0, c1, c2 = (*a, 0.0, 0.0)[:3]
        return sorted([t for t in turns(c0, c1, 2.0 * c2) if 0.0 < t < lasting])
    found = []
    for low, high in pairwise((0.0, *turning_points(a, lasting), lasting)):
        if value(a, low) * value(a, high) < 0.0:
            found.append(_zero_between(a, low, high))
    return found


def _zero_between(a: Polynomial, low: float, high: float) -> float:
    """Return the zero of p(t) between two times at which p has different signs and between which it is monotonic. The
    search takes Newton steps, but halves the interval if a step leaves it or is more than half as long as the previous
    step.
    """
    rising = value(a, high) > 0.0
    t, step = 0.5 * (low + high), high - low
    while low < t < high:
        p, rate = value_and_rate(a, t)
        low, high = (low, t) if (p > 0.0) == rising else (t, high)
        before, step = abs(step), p / rate if rate else inf
        if t - step == t:
            break
        if abs(step) <= 0.5 * before and low < t - step < high:
            t -= step
        else:
            t, step = 0.5 * (low + high), high - low
    return t


def bisect_interval(holds: Callable[[float], bool], low: float, high: float, steps: int) -> tuple[float, float]:
    """Halve the interval between a value at which a condition holds and one at which it does not; return both ends of
    the remaining interval.
    """
    for _ in range(steps):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low, high


def turning_points(a: Polynomial, lasting: float) -> list[float]:
    """Return the times between 0 and `lasting` at which dp/dt is zero: p(t) turns back, or is at rest for a moment."""
    if len(a) == 4:
        return sorted([t for t in turns(a[1], 2.0 * a[2], 6.0 * a[3]) if 0.0 < t < lasting])
    return zeros(derivative(a), lasting)


def extremes(a: Polynomial, lasting: float) -> tuple[float, float]:
    """Return the minimum and the maximum of p(t) from 0 to `lasting`."""
    values = [value(a, t) for t in (0.0, lasting, *turning_points(a, lasting))]
    return min(values), max(values)


def most(a: Polynomial, lasting: float) -> float:
    """Return the maximum of |p(t)| from 0 to `lasting`."""
    if len(a) < 3:  # |p| of a straight line is greatest at one of its ends
        return abs(a[0]) if len(a) == 1 else max(abs(a[0]), abs(value(a, lasting)))
    return max(map(abs, extremes(a, lasting)))


def turns(v: float, a: float, jerk: float) -> tuple[float, ...]:
    """Return the times at which a velocity v with acceleration a and this jerk is zero: v + a s + jerk s^2 / 2 = 0."""
    if not jerk:
        return (-v / a,) if a else ()
    square = a * a - 2.0 * jerk * v
    if square < 0.0:
        return ()
    middle = -(a + sqrt(square)) if a > 0.0 else sqrt(square) - a
    return (middle / jerk, 2.0 * v / middle) if middle else (0.0,)
