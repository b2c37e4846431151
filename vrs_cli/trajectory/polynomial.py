"""Polynomials as tuples of coefficients in ascending powers: (a0, a1, a2) is a0 + a1 t + a2 t**2."""

from __future__ import annotations

Polynomial = tuple[float, ...]


def value(a: Polynomial, t: float) -> float:
    """p(t), by Horner's rule."""
    if len(a) == 3:  # by far the most frequent
        return a[0] + t * (a[1] + t * a[2])
    result = 0.0
    for coefficient in reversed(a):
        result = result * t + coefficient
    return result


def value_and_rate(a: Polynomial, t: float) -> tuple[float, float]:
    """p(t) and dp/dt."""
    if len(a) == 3:
        c0, c1, c2 = a
        return c0 + t * (c1 + t * c2), c1 + 2.0 * c2 * t
    result = rate = 0.0
    for coefficient in reversed(a):
        rate = rate * t + result
        result = result * t + coefficient
    return result, rate


def second_derivative(a: Polynomial, t: float) -> float:
    """d2p/dt2."""
    if len(a) == 3:
        return 2.0 * a[2]
    if len(a) == 4:
        return 2.0 * a[2] + t * 6.0 * a[3]
    return value(derivative(derivative(a)), t)


def third_derivative(a: Polynomial, t: float) -> float:
    """d3p/dt3."""
    if len(a) == 4:
        return 6.0 * a[3]
    return value(derivative(derivative(derivative(a))), t) if len(a) > 4 else 0.0


def derivative(a: Polynomial) -> Polynomial:
    """The polynomial dp/dt."""
    return tuple(power * coefficient for power, coefficient in enumerate(a) if power) or (0.0,)


def parabola(p0: float, v0: float, v1: float, duration: float) -> Polynomial:
    """From position p0 and velocity v0 to velocity v1 at constant acceleration."""
    return (p0, v0, 0.5 * (v1 - v0) / duration)
