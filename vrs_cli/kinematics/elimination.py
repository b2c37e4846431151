"""Small systems of linear equations in plain floats: numpy costs more to call than six unknowns to solve."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from math import sqrt
from operator import mul
from typing import Any, cast

LOST = 1e-10  # of the largest coefficient: a pivot below it is rounding
SMALL = 1e-4  # [m, 1] a pivot from which on it is looked more closely
LARGE = 0.1  # [m, 1] a pivot that does where what is found is made better again
DEMAND = 1e-9  # what an equation without unknowns left may ask for, in its own unit


def solve(rows: Sequence[Sequence[float]], wanted: Sequence[float]) -> tuple[float, ...] | None:
    """x with rows @ x = wanted; unknowns that nothing decides are 0.

    None where an equation asks for what no unknown can give.
    """
    if len(rows) == len(rows[0]):
        found = squares(rows, wanted)
        if found is not None:
            return found[0]
    # with complete pivoting
    table = [[*row, value] for row, value in zip(rows, wanted, strict=True)]
    count = len(rows[0])
    order: list[int] = []
    least = LOST * max([abs(x) for row in rows for x in row], default=0.0)
    for k in range(len(table)):
        size, r, c = max(
            [(abs(table[r][c]), r, c) for r in range(k, len(table)) for c in range(count) if c not in order],
            default=(0.0, k, 0),
        )
        if size <= least:
            if any(abs(row[count]) > DEMAND for row in table[k:]):
                return None
            break
        table[k], table[r] = table[r], table[k]
        order.append(c)
        pivot = table[k]
        for i in range(k + 1, len(table)):
            factor = table[i][c] / pivot[c]
            if factor:
                table[i] = [x - factor * y for x, y in zip(table[i], pivot, strict=True)]
    x = [0.0] * count
    for row, c in zip(reversed(table[: len(order)]), reversed(order), strict=True):
        known = sum([a * b for a, b in zip(row, x, strict=False)])
        x[c] = (row[count] - known) / row[c]
    return tuple(x)


def squares(rows: Sequence[Sequence[float]], *wanted: Sequence[float]) -> tuple[tuple[float, ...], ...] | None:
    """`solve` for as many equations as unknowns, for each that is wanted, by one elimination with partial pivoting.

    None near a singular matrix. Of several that are wanted a pivot is taken as it comes if it is `LARGE`.
    """
    return _written(len(rows), len(wanted))(rows, *wanted)


@cache
def _written(n: int, sides: int) -> Callable[..., tuple[tuple[float, ...], ...] | None]:
    """The elimination of n equations, written out: without tables it takes a third of the time."""
    rows = ", ".join(f"({listed(f'a{r}_{c}' for c in range(n))})" for r in range(n))
    lines = [f"{rows}, = rows"]
    lines += [f"{listed(f'a{r}_{n + side}' for r in range(n))} = wanted{side}" for side in range(sides)]
    found = (listed(f"x{k}_{side}" for k in range(n)) for side in range(sides))
    lines += [*elimination_lines(n, sides), f"return {listed(f'({one})' for one in found)}"]
    head = f"def square(rows, {listed(f'wanted{side}' for side in range(sides))}):\n"
    names: dict[str, Any] = {"SMALL": SMALL, "LARGE": LARGE}
    exec(compile(head + "".join(f"    {line}\n" for line in lines), "<elimination>", "exec"), names)
    return cast(Callable[..., tuple[tuple[float, ...], ...] | None], names["square"])


def elimination_lines(n: int, sides: int) -> list[str]:
    """From `a1_2`, the entry of row 1 and column 2, to `x2_0`, the unknown of column 2: the columns from n on have what
    is wanted, side by side. Returns None near a singular matrix, and asks for `SMALL` and `LARGE`.
    """
    rows = [[f"a{r}_{c}" for c in range(n + sides)] for r in range(n)]
    lines = list[str]()
    for k, pivot in enumerate(rows):
        below = rows[k + 1 :]
        search = [f"most, r = abs({pivot[k]}), {k}"]
        search += [f"if abs({row[k]}) > most: most, r = abs({row[k]}), {r}" for r, row in enumerate(below, k + 1)]
        search += ["if most < SMALL: return None"]
        for r, row in enumerate(below, k + 1):
            search += [f"if r == {r}: {listed(pivot[k:] + row[k:])} = {listed(row[k:] + pivot[k:])}"]
        lines += [f"if -LARGE < {pivot[k]} < LARGE:", *(f"    {line}" for line in search)] if sides > 1 else search
        for row in below:
            changes = "; ".join(f"{x} -= f * {y}" for x, y in zip(row[k + 1 :], pivot[k + 1 :], strict=True))
            lines += [f"if {row[k]}: f = {row[k]} / {pivot[k]}; {changes}"]
    for k, row in reversed(list(enumerate(rows))):
        for side in range(sides):
            known = " + ".join(f"{row[c]} * x{c}_{side}" for c in range(k + 1, n)) or "0.0"
            lines += [f"x{k}_{side} = ({row[n + side]} - ({known})) / {row[k]}"]
    return lines


def listed(names: Iterable[str]) -> str:
    return "".join(f"{name}, " for name in names)


def gram(rows: Sequence[Sequence[float]]) -> list[list[float]]:
    """rows @ rows^T."""
    return cast(list[list[float]], _written_of_gram("gram", len(rows), len(rows[0]))(rows))


def damped(rows: Sequence[Sequence[float]], wanted: Sequence[float], damping: float) -> tuple[float, ...]:
    """rows^T (rows rows^T + damping)^-1 wanted: no larger than the equations, however many unknowns there are."""
    table = gram(rows)
    for k, row in enumerate(table):
        row[k] += damping
    weights = solve(table, wanted) or (0.0,) * len(rows)
    return tuple([sum(map(mul, weights, column)) for column in zip(*rows, strict=True)])


def volume(rows: Sequence[Sequence[float]]) -> float:
    """Of what rows span: the root of the determinant of rows @ rows^T. 0 of rows that depend on each other."""
    return cast(float, _written_of_gram("volume", len(rows), len(rows[0]))(rows))


@cache
def _written_of_gram(name: str, m: int, n: int) -> Callable[[Sequence[Sequence[float]]], Any]:
    """`gram` or `volume` of m rows of n, written out; entry `g2_1` is of rows @ rows^T."""
    rows = [[f"a{r}_{c}" for c in range(n)] for r in range(m)]
    lines = [f"{listed(f'({listed(row)})' for row in rows)} = rows"]
    for r, row in enumerate(rows):
        dots = (" + ".join(f"{x} * {y}" for x, y in zip(row, other, strict=True)) for other in rows[: r + 1])
        lines += [f"g{r}_{k} = {dot or 0.0}" for k, dot in enumerate(dots)]
    if name == "gram":
        table = (listed(f"g{max(r, k)}_{min(r, k)}" for k in range(m)) for r in range(m))
        lines += [f"return [{listed(f'[{row}]' for row in table)}]"]
    else:
        for k in range(m):
            lines += [f"if g{k}_{k} <= 0.0: return 0.0"]
            for r in range(k + 1, m):
                changes = "; ".join(f"g{r}_{c} -= f * g{c}_{k}" for c in range(k + 1, r + 1))
                lines += [f"f = g{r}_{k} / g{k}_{k}; {changes}"]
        lines += [f"return sqrt({' * '.join(f'g{k}_{k}' for k in range(m))})"]
    names: dict[str, Any] = {"sqrt": sqrt}
    exec(compile(f"def {name}(rows):\n" + "".join(f"    {line}\n" for line in lines), f"<{name}>", "exec"), names)
    return cast(Callable[[Sequence[Sequence[float]]], Any], names[name])


def positive(rows: Sequence[Sequence[float]], wanted: Sequence[float]) -> list[float]:
    """x with rows @ x = wanted, for a symmetric matrix without negative eigenvalues or nearly so (Cholesky)."""
    n = len(rows)
    lower: list[list[float]] = []
    y: list[float] = []
    for i in range(n):
        line: list[float] = []
        for k, above in enumerate(lower):
            line.append((rows[i][k] - sum([a * b for a, b in zip(line, above, strict=False)])) / above[k])
        line.append(sqrt(max(rows[i][i] - sum([a * a for a in line]), LOST * rows[i][i] or LOST)))
        lower.append(line)
        y.append((wanted[i] - sum([a * b for a, b in zip(line, y, strict=False)])) / line[i])
    for i in reversed(range(n)):
        y[i] = (y[i] - sum([lower[k][i] * y[k] for k in range(i + 1, n)])) / lower[i][i]
    return y
