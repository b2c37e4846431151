"""Generate Python code of functions for one arm: its kinematics, and solvers of small linear systems.

The matrices of a chain of links are mostly zeros and ones, so that symbolic multiplication leaves only a few dozen
products. The functions take floats or, with the sine and cosine of numpy, arrays. Solvers of small linear systems are
also generated without loops: for six unknowns they take less time than one call of numpy.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from math import cos, sin, sqrt
from operator import mul
from typing import Any, cast

from msgspec import Struct

from vrs_cli.kinematics.joints import JointKind, Twist
from vrs_cli.kinematics.model import Link
from vrs_cli.kinematics.transform import Transform

Entry = float | str  # an entry of a matrix: a known number, or the name of a variable in the generated code
Column = tuple[Entry, Entry, Entry]

STILL: Column = (0.0, 0.0, 0.0)
NOTHING = 1e-15  # smaller entries count as 0: they are rounding errors of the sines and cosines of right angles


class Formulas(Struct, frozen=True):
    """The generated functions of one arm. Entries of their results that do not depend on q are plain numbers, even if q
    contains arrays.

    `forward(q)` returns the twelve entries of T_base_flange, row by row. `jacobian(q, tx, ty, tz)` returns six rows of
    n entries, for the point (tx, ty, tz) in the frame of the flange. `both(q)` returns the pose, and the Jacobian of
    the flange's origin.
    """

    forward: Callable[..., tuple[Any, ...]]
    jacobian: Callable[..., tuple[tuple[Any, ...], ...]]
    both: Callable[..., tuple[tuple[Any, ...], tuple[tuple[Any, ...], ...]]]


@cache
def formulas(links: tuple[Link, ...], base: Transform, flange: Transform, *, arrays: bool = False) -> Formulas:
    """Generate and compile the functions of an arm. They take one float for each joint, or with `arrays` one array."""
    names: dict[str, Any] = {**_angles(arrays), "T": Transform, "new": tuple.__new__}
    if arrays:
        names["new"] = lambda _, entries: entries
    exec(compile(Writer(links, base, flange).text(), "<kinematics>", "exec"), names)
    return Formulas(names["forward"], names["jacobian"], names["both"])


def _angles(arrays: bool) -> dict[str, Any]:
    """Return the functions `cos` and `sin` for floats or for arrays."""
    if not arrays:
        return {"cos": cos, "sin": sin}
    import numpy as np

    return {"cos": np.cos, "sin": np.sin}


class Biases(Struct, frozen=True):
    """The functions that compute the parts of a tool's acceleration and jerk that lower derivatives of the joints
    cause: six entries, in the order of a twist.

    `acceleration(q, qd, tx, ty, tz)` returns J' qd, `jerk(q, qd, qdd, tx, ty, tz)` returns J'' qd + 2 J' qdd.
    """

    acceleration: Callable[..., Twist]
    jerk: Callable[..., Twist]


@cache
def biases(links: tuple[Link, ...], base: Transform, flange: Transform, *, arrays: bool = False) -> Biases:
    """Generate and compile the bias functions of an arm. They take one float for each joint, or with `arrays` one
    array.
    """
    names = _angles(arrays)
    for jerk in (False, True):
        exec(compile(Writer(links, base, flange).bias_text(jerk=jerk), "<kinematics>", "exec"), names)
    return Biases(names["acceleration"], names["jerk"])


class Writer:
    """Generates the code of an arm's functions. `lines`: the assignments generated so far."""

    def __init__(self, links: Sequence[Link], base: Transform, flange: Transform) -> None:
        self.links, self.lines, self.count = links, list[str](), 0
        self.axes: list[tuple[Column, Column]] = []  # direction of each joint's axis, and a point on it
        # vectors from each frame's origin to the next, and to the flange, as sums
        self.steps: list[tuple[tuple[Entry, Column], ...]] = []
        self.columns = self.columns_of(base)
        for i, link in enumerate(links):
            self.axes.append((self.columns[2], self.columns[3]))
            self._joint(i, link)
        n, s, a, _ = self.columns
        self.steps.append(((flange.px, n), (flange.py, s), (flange.pz, a)))
        self.columns = self.product(self.columns_of(flange))

    def text(self) -> str:
        n, s, a, p = self.columns
        entries = [text_of(entry) for row in zip(n, s, a, p, strict=True) for entry in row]
        head = [self.unpack_line("q", "q"), *self.lines]
        pose = f"new(T, ({', '.join(entries)}))"
        jacobian = self._jacobian_lines(("tx", "ty", "tz"))
        both = self._jacobian_lines((0.0, 0.0, 0.0))
        return (
            function("forward(q)", [*head, f"return {pose}"])
            + function("jacobian(q, tx=0.0, ty=0.0, tz=0.0)", [*head, *jacobian[:-1], f"return {jacobian[-1]}"])
            + function("both(q)", [*head, *both[:-1], f"return {pose}, {both[-1]}"])
        )

    def _jacobian_lines(self, tool: Column) -> list[str]:
        """Return the assignments that compute the Jacobian of a point fixed to the flange; the last line is the tuple
        of its rows.
        """
        self.lines = []
        n, s, a, p = self.columns
        tx, ty, tz = tool
        tip = self.mix((1.0, p), (tx, n), (ty, s), (tz, a))
        columns: list[tuple[Entry, ...]] = []
        for link, (z, o) in zip(self.links, self.axes, strict=True):
            if link.kind is JointKind.PRISMATIC:
                columns.append((*z, 0.0, 0.0, 0.0))
                continue
            x = self.mix((1.0, tip), (-1.0, o))
            columns.append((*self.cross(z, x), *z))
        rows = ("".join(f"{text_of(entry)}, " for entry in row) for row in zip(*columns, strict=True))
        return [*self.lines, f"({', '.join(f'({row})' for row in rows)})"]

    def bias_text(self, *, jerk: bool) -> str:
        """Return the code of the function `acceleration`, or of `jerk` if `jerk`.

        The code follows the outward recursion of the Newton-Euler method (Luh, Walker and Paul 1980), with one more
        derivative for the jerk. It computes the angular velocity w of each frame, its derivatives, and the derivatives
        of the vectors from frame to frame, which turn with the frames.
        """
        w = w1 = w2 = moved = STILL
        n, s, a, _ = self.columns
        *steps, last, hand = self.steps
        steps.append((*last, *hand, ("tx", n), ("ty", s), ("tz", a)))
        for i, (link, (z, _), step) in enumerate(zip(self.links, self.axes, steps, strict=True)):
            rate, change = f"d{i}", f"e{i}" if jerk else 0.0
            z1 = self.cross(w, z)
            z2 = self.add_crosses(STILL, (w1, z), (w, z1))
            if link.kind is JointKind.PRISMATIC:
                twice, thrice = self.sum([(2.0, rate)]), self.sum([(3.0, rate)])
                slid = ((thrice, z2), (self.sum([(3.0, change)]), z1)) if jerk else ((twice, z1),)
                moved = self.mix((1.0, moved), *slid)
            else:
                w2 = self.mix((1.0, w2), (rate, z2), (self.sum([(2.0, change)]), z1))
                w1 = self.mix((1.0, w1), (rate, z1), (change, z))
                w = self.mix((1.0, w), (rate, z))
            # vector from this frame's origin to the next (or to the tip), which turns with the frame
            p = self.mix(*step)
            p1 = self.cross(w, p)
            if jerk:
                p2 = self.add_crosses(STILL, (w1, p), (w, p1))
                moved = self.add_crosses(moved, (w2, p), (self.mix((2.0, w1)), p1), (w, p2))
            else:
                moved = self.add_crosses(moved, (w1, p), (w, p1))
        entries = ", ".join(map(text_of, (*moved, *(w2 if jerk else w1))))
        # the assignments that the result depends on; all others are left out
        names, needed = set(re.findall(r"t\d+", entries)), list[str]()
        for line in reversed(self.lines):
            if line.partition(" ")[0] in names:
                names.update(re.findall(r"t\d+", line))
                needed.insert(0, line)
        lines = [self.unpack_line("q", "q"), self.unpack_line("d", "qd"), *needed, f"return ({entries})"]
        if jerk:
            return function("jerk(q, qd, qdd, tx=0.0, ty=0.0, tz=0.0)", [self.unpack_line("e", "qdd"), *lines])
        return function("acceleration(q, qd, tx=0.0, ty=0.0, tz=0.0)", lines)

    def unpack_line(self, letter: str, name: str) -> str:
        return f"({' '.join(f'{letter}{i},' for i in range(len(self.links)))}) = {name}"

    @staticmethod
    def columns_of(T: Transform) -> tuple[Column, Column, Column, Column]:
        rows = [[without_rounding(x) for x in T[i : i + 4]] for i in (0, 4, 8)]
        n, s, a, p = zip(*rows, strict=True)
        return n, s, a, p

    def _joint(self, i: int, link: Link) -> None:
        n, s, a, p = self.columns
        c, z, d = self.joint_entries(i, link)
        n, s = self.mix((c, n), (z, s)), self.mix((c, s), (minus(z), n))
        self.steps.append(((link.a, n), (d, a)))
        p = self.mix((1.0, p), *self.steps[-1])
        # cosine and sine of the twist, without rounding errors
        ca, sa = without_rounding(cos(link.alpha)), without_rounding(sin(link.alpha))
        s, a = self.mix((ca, s), (sa, a)), self.mix((ca, a), (-sa, s))
        self.columns = n, s, a, p

    def joint_entries(self, i: int, link: Link) -> tuple[Entry, Entry, Entry]:
        """Return the cosine and sine of a joint's angle, and its offset along the axis."""
        if link.kind is JointKind.PRISMATIC:
            return cos(link.theta), sin(link.theta), self.sum(((1.0, f"q{i}"), (link.d, 1.0)))
        angle = f"q{i} + {link.theta!r}" if link.theta else f"q{i}"
        return self.new(f"cos({angle})"), self.new(f"sin({angle})"), link.d

    def product(self, other: tuple[Column, Column, Column, Column]) -> tuple[Column, Column, Column, Column]:
        n, s, a, p = self.columns
        turned = [self.mix((x, n), (y, s), (z, a)) for x, y, z in other[:3]]
        x, y, z = other[3]
        return turned[0], turned[1], turned[2], self.mix((1.0, p), (x, n), (y, s), (z, a))

    # --- entries ---

    def mix(self, *terms: tuple[Entry, Column]) -> Column:
        """Return the entries of a linear combination of columns, given as (factor, column)."""
        x, y, z = (self.sum((factor, column[i]) for factor, column in terms) for i in range(3))
        return x, y, z

    def cross(self, a: Column, b: Column) -> Column:
        return self.add_crosses(STILL, (a, b))

    def add_crosses(self, start: Column, *pairs: tuple[Column, Column]) -> Column:
        """Return the entries of a column plus the cross products a x b of all pairs."""
        x, y, z = (
            self.sum([(1.0, start[i]), *(term for a, b in pairs for term in ((a[j], b[k]), (minus(a[k]), b[j])))])
            for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        )
        return x, y, z

    def sum(self, terms: Iterable[tuple[Entry, Entry]]) -> Entry:
        """Return the sum of the products of all pairs: as a number, as an existing name, or as the name of a new
        variable.
        """
        known, rest = 0.0, list[str]()
        for a, b in terms:
            if isinstance(a, str) and isinstance(b, str):
                rest.append(_with_sign(f"{a.lstrip('-')}*{b.lstrip('-')}", a.startswith("-") != b.startswith("-")))
            elif isinstance(a, str) or isinstance(b, str):
                factor, name = (b, a) if isinstance(a, str) else (a, b)
                if abs(float(factor)) > NOTHING:
                    bare = str(name).lstrip("-")
                    term = bare if abs(float(factor)) == 1.0 else f"{abs(float(factor))!r}*{bare}"
                    rest.append(_with_sign(term, (float(factor) < 0.0) != str(name).startswith("-")))
            else:
                known += a * b
        if not rest:
            return known
        if abs(known) > NOTHING:
            rest.append(repr(known))
        return rest[0] if len(rest) == 1 and "*" not in rest[0] else self.new(" + ".join(rest).replace("+ -", "- "))

    def new(self, expression: str) -> str:
        self.count += 1
        self.lines.append(f"t{self.count} = {expression}")
        return f"t{self.count}"


def _with_sign(text: str, negative: bool) -> str:
    return f"-{text}" if negative else text


def minus(entry: Entry) -> Entry:
    if isinstance(entry, str):
        return entry[1:] if entry.startswith("-") else f"-{entry}"
    return 0.0 - entry


def without_rounding(x: float) -> float:
    """Return 0, 1 or -1 if x differs from it only by rounding, else x."""
    for exact in (0.0, 1.0, -1.0):
        if abs(x - exact) < NOTHING:
            return exact
    return x


def text_of(entry: Entry) -> str:
    return entry if isinstance(entry, str) else repr(float(entry))


def function(head: str, lines: Iterable[str]) -> str:
    return f"def {head}:\n" + "".join(f"    {line}\n" for line in lines)


def compile_function(head: str, lines: Iterable[str], names: dict[str, Any]) -> Callable[..., Any]:
    """Compile and return the function with this head (name and parameters) and these lines. Its code can use the values
    in `names`.
    """
    name = head.partition("(")[0]
    exec(compile(function(head, lines), f"<{name}>", "exec"), names)
    return cast(Callable[..., Any], names[name])


LOST = 1e-10  # elimination treats pivots below this fraction of the largest coefficient as 0 with rounding errors
SMALL = 1e-4  # [m, 1] if all pivots of a column are smaller, the matrix counts as singular
LARGE = 0.1  # [m, 1] a pivot that is larger is used without searching for the largest
DEMAND = 1e-9  # if all coefficients of an equation are 0 and |right side| is larger, the system has no solution


def solve(rows: Sequence[Sequence[float]], wanted: Sequence[float]) -> tuple[float, ...] | None:
    """Return the solution x of rows @ x = wanted. Unknowns that no equation determines are 0.

    Return None if an equation cannot be satisfied.
    """
    if len(rows) == len(rows[0]):
        found = squares(rows, wanted)
        if found is not None:
            return found[0]
    # the matrix is not square or nearly singular: eliminate with complete pivoting
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
    """Solve n equations for n unknowns, for each right side in `wanted`, by one elimination with partial pivoting.

    Return None if the matrix is nearly singular. With several right sides, a pivot above `LARGE` is used without
    searching for the largest.
    """
    return _elimination(len(rows), len(wanted))(rows, *wanted)


@cache
def _elimination(n: int, sides: int) -> Callable[..., tuple[tuple[float, ...], ...] | None]:
    """Return a generated function that solves n equations for `sides` right-hand sides. It is fully unrolled, and takes
    a third as long as loops over lists.
    """
    rows = ", ".join(f"({comma_list(f'a{r}_{c}' for c in range(n))})" for r in range(n))
    lines = [f"{rows}, = rows"]
    lines += [f"{comma_list(f'a{r}_{n + side}' for r in range(n))} = wanted{side}" for side in range(sides)]
    found = (comma_list(f"x{k}_{side}" for k in range(n)) for side in range(sides))
    lines += [*elimination_lines(n, sides), f"return {comma_list(f'({one})' for one in found)}"]
    head = f"square(rows, {comma_list(f'wanted{side}' for side in range(sides))})"
    return compile_function(head, lines, {"SMALL": SMALL, "LARGE": LARGE})


def elimination_lines(n: int, sides: int) -> list[str]:
    """Return the code that solves n equations. Their coefficients are in variables such as `a1_2` (row 1, column 2),
    the solutions in variables such as `x2_0` (unknown 2, right side 0).

    Columns n and higher are the right sides. The code returns None if the matrix is nearly singular; it uses the names
    `SMALL` and `LARGE`.
    """
    rows = [[f"a{r}_{c}" for c in range(n + sides)] for r in range(n)]
    lines = list[str]()
    for k, pivot in enumerate(rows):
        below = rows[k + 1 :]
        search = [f"most, r = abs({pivot[k]}), {k}"]
        search += [f"if abs({row[k]}) > most: most, r = abs({row[k]}), {r}" for r, row in enumerate(below, k + 1)]
        search += ["if most < SMALL: return None"]
        for r, row in enumerate(below, k + 1):
            search += [f"if r == {r}: {comma_list(pivot[k:] + row[k:])} = {comma_list(row[k:] + pivot[k:])}"]
        lines += [f"if -LARGE < {pivot[k]} < LARGE:", *(f"    {line}" for line in search)] if sides > 1 else search
        for row in below:
            changes = "; ".join(f"{x} -= f * {y}" for x, y in zip(row[k + 1 :], pivot[k + 1 :], strict=True))
            lines += [f"if {row[k]}: f = {row[k]} / {pivot[k]}; {changes}"]
    for k, row in reversed(list(enumerate(rows))):
        for side in range(sides):
            known = " + ".join(f"{row[c]} * x{c}_{side}" for c in range(k + 1, n)) or "0.0"
            lines += [f"x{k}_{side} = ({row[n + side]} - ({known})) / {row[k]}"]
    return lines


def comma_list(names: Iterable[str]) -> str:
    return "".join(f"{name}, " for name in names)


def gram(rows: Sequence[Sequence[float]]) -> list[list[float]]:
    """Return rows @ rows^T."""
    return cast(list[list[float]], _written_of_gram("gram", len(rows), len(rows[0]))(rows))


def solve_damped(rows: Sequence[Sequence[float]], wanted: Sequence[float], damping: float) -> tuple[float, ...]:
    """Return rows^T (rows rows^T + damping I)^-1 wanted: the damped least-squares solution of rows @ x = wanted."""
    table = gram(rows)
    for k, row in enumerate(table):
        row[k] += damping
    weights = solve(table, wanted) or (0.0,) * len(rows)
    return tuple([sum(map(mul, weights, column)) for column in zip(*rows, strict=True)])


def volume(rows: Sequence[Sequence[float]]) -> float:
    """Return the volume of the parallelepiped spanned by the rows, sqrt(det(rows @ rows^T)); 0 if they are linearly
    dependent.
    """
    return cast(float, _written_of_gram("volume", len(rows), len(rows[0]))(rows))


@cache
def _written_of_gram(name: str, m: int, n: int) -> Callable[[Sequence[Sequence[float]]], Any]:
    """Return the function `gram` or `volume` for m rows of n numbers, generated without loops. A variable such as
    `g2_1` is an entry of rows @ rows^T.
    """
    rows = [[f"a{r}_{c}" for c in range(n)] for r in range(m)]
    lines = [f"{comma_list(f'({comma_list(row)})' for row in rows)} = rows"]
    for r, row in enumerate(rows):
        dots = (" + ".join(f"{x} * {y}" for x, y in zip(row, other, strict=True)) for other in rows[: r + 1])
        lines += [f"g{r}_{k} = {dot or 0.0}" for k, dot in enumerate(dots)]
    if name == "gram":
        table = (comma_list(f"g{max(r, k)}_{min(r, k)}" for k in range(m)) for r in range(m))
        lines += [f"return [{comma_list(f'[{row}]' for row in table)}]"]
    else:
        for k in range(m):
            lines += [f"if g{k}_{k} <= 0.0: return 0.0"]
            for r in range(k + 1, m):
                changes = "; ".join(f"g{r}_{c} -= f * g{c}_{k}" for c in range(k + 1, r + 1))
                lines += [f"f = g{r}_{k} / g{k}_{k}; {changes}"]
        lines += [f"return sqrt({' * '.join(f'g{k}_{k}' for k in range(m))})"]
    return compile_function(f"{name}(rows)", lines, {"sqrt": sqrt})
