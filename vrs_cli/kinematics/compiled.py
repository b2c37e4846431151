"""Forward kinematics, Jacobian and its derivatives of any serial arm, written out as Python for that arm alone.

A chain of matrices is mostly zeros and ones. Multiplied out once, symbolically, a few dozen products are left:
functions which work on floats and, with the sine and cosine of numpy, on arrays as they are.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from math import cos, sin
from typing import Any, NamedTuple

from vrs_cli.kinematics.axes import Link
from vrs_cli.kinematics.joints import JointKind, Twist
from vrs_cli.kinematics.transform import Transform

Entry = float | str  # a number that is known, or the name of a variable
Column = tuple[Entry, Entry, Entry]

STILL: Column = (0.0, 0.0, 0.0)
NOTHING = 1e-15  # an entry so small is the rounding of a right angle


class Formulas(NamedTuple):
    """`forward(q)`: the twelve entries of T_base_flange, row by row. `jacobian(q, tx, ty, tz)`: its six rows of n, for
    the point of a tool at (tx, ty, tz) of the flange. `both(q)`: the two, for the flange itself. Entries that do not
    depend on q are plain numbers.
    """

    forward: Callable[..., tuple[Any, ...]]
    jacobian: Callable[..., tuple[tuple[Any, ...], ...]]
    both: Callable[..., tuple[tuple[Any, ...], tuple[tuple[Any, ...], ...]]]


@cache
def formulas(links: tuple[Link, ...], base: Transform, flange: Transform, *, arrays: bool = False) -> Formulas:
    """The functions of an arm, for floats or for arrays (one for each joint)."""
    names: dict[str, Any] = {**_angles(arrays), "T": Transform, "new": tuple.__new__}
    if arrays:
        names["new"] = lambda _, entries: entries
    exec(compile(Writer(links, base, flange).text(), "<kinematics>", "exec"), names)
    return Formulas(names["forward"], names["jacobian"], names["both"])


def _angles(arrays: bool) -> dict[str, Any]:
    """The sine and cosine of floats or of arrays."""
    if not arrays:
        return {"cos": cos, "sin": sin}
    import numpy as np

    return {"cos": np.cos, "sin": np.sin}


class Biases(NamedTuple):
    """`acceleration(q, qd, tx, ty, tz)`: J' qd, what the joint rates alone make of the acceleration of that point.
    `jerk(q, qd, qdd, tx, ty, tz)`: J'' qd + 2 J' qdd, the same of its jerk. Six entries as of a twist.
    """

    acceleration: Callable[..., Twist]
    jerk: Callable[..., Twist]


@cache
def biases(links: tuple[Link, ...], base: Transform, flange: Transform, *, arrays: bool = False) -> Biases:
    """The functions of an arm, for floats or for arrays (one for each joint)."""
    names = _angles(arrays)
    for jerk in (False, True):
        exec(compile(Writer(links, base, flange).bias_text(jerk=jerk), "<kinematics>", "exec"), names)
    return Biases(names["acceleration"], names["jerk"])


class Writer:
    """Writes the functions of an arm, or of its links from the `first` on; `lines` are the assignments so far."""

    def __init__(self, links: Sequence[Link], base: Transform, flange: Transform, first: int = 0) -> None:
        self.links, self.lines, self.count = links, list[str](), 0
        self.axes: list[tuple[Column, Column]] = []  # direction and point, joint by joint
        self.steps: list[tuple[tuple[Entry, Column], ...]] = []  # from each frame to the next, and to the flange
        self.columns = self.columns_of(base)
        for i, link in enumerate(links, first):
            self.axes.append((self.columns[2], self.columns[3]))
            self._joint(i, link)
        n, s, a, _ = self.columns
        self.steps.append(((flange.px, n), (flange.py, s), (flange.pz, a)))
        self.columns = self.product(self.columns_of(flange))

    def text(self) -> str:
        n, s, a, p = self.columns
        entries = [text_of(entry) for row in zip(n, s, a, p, strict=True) for entry in row]
        head = [self.unpacked("q", "q"), *self.lines]
        pose = f"new(T, ({', '.join(entries)}))"
        jacobian = self._jacobian_lines(("tx", "ty", "tz"))
        both = self._jacobian_lines((0.0, 0.0, 0.0))
        return (
            function("forward(q)", [*head, f"return {pose}"])
            + function("jacobian(q, tx=0.0, ty=0.0, tz=0.0)", [*head, *jacobian[:-1], f"return {jacobian[-1]}"])
            + function("both(q)", [*head, *both[:-1], f"return {pose}, {both[-1]}"])
        )

    def _jacobian_lines(self, tool: Column) -> list[str]:
        """The assignments for the Jacobian of a point of the flange, and the rows."""
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
        """By the outward half of the recursion of Newton and Euler (Luh, Walker and Paul 1980), one derivative more for
        the jerk: the angular velocity w of each frame, its derivatives, and those of the steps that turn with it.
        """
        w = w1 = w2 = moved = STILL
        n, s, a, _ = self.columns
        *steps, last, hand = self.steps
        steps.append((*last, *hand, ("tx", n), ("ty", s), ("tz", a)))
        for i, (link, (z, _), step) in enumerate(zip(self.links, self.axes, steps, strict=True)):
            rate, change = f"d{i}", f"e{i}" if jerk else 0.0
            z1 = self.cross(w, z)
            z2 = self.crossed(STILL, (w1, z), (w, z1))
            if link.kind is JointKind.PRISMATIC:
                twice, thrice = self.sum([(2.0, rate)]), self.sum([(3.0, rate)])
                slid = ((thrice, z2), (self.sum([(3.0, change)]), z1)) if jerk else ((twice, z1),)
                moved = self.mix((1.0, moved), *slid)
            else:
                w2 = self.mix((1.0, w2), (rate, z2), (self.sum([(2.0, change)]), z1))
                w1 = self.mix((1.0, w1), (rate, z1), (change, z))
                w = self.mix((1.0, w), (rate, z))
            p = self.mix(*step)  # the next point, as seen from this one, which turns with the frame
            p1 = self.cross(w, p)
            if jerk:
                p2 = self.crossed(STILL, (w1, p), (w, p1))
                moved = self.crossed(moved, (w2, p), (self.mix((2.0, w1)), p1), (w, p2))
            else:
                moved = self.crossed(moved, (w1, p), (w, p1))
        entries = ", ".join(map(text_of, (*moved, *(w2 if jerk else w1))))
        names, needed = set(re.findall(r"t\d+", entries)), list[str]()  # assignments that the result asks for
        for line in reversed(self.lines):
            if line.partition(" ")[0] in names:
                names.update(re.findall(r"t\d+", line))
                needed.insert(0, line)
        lines = [self.unpacked("q", "q"), self.unpacked("d", "qd"), *needed, f"return ({entries})"]
        if jerk:
            return function("jerk(q, qd, qdd, tx=0.0, ty=0.0, tz=0.0)", [self.unpacked("e", "qdd"), *lines])
        return function("acceleration(q, qd, tx=0.0, ty=0.0, tz=0.0)", lines)

    def unpacked(self, letter: str, name: str) -> str:
        return f"({' '.join(f'{letter}{i},' for i in range(len(self.links)))}) = {name}"

    @staticmethod
    def columns_of(T: Transform) -> tuple[Column, Column, Column, Column]:
        rows = [[without_rounding(x) for x in T[i : i + 4]] for i in (0, 4, 8)]
        n, s, a, p = zip(*rows, strict=True)
        return n, s, a, p

    def _joint(self, i: int, link: Link) -> None:
        n, s, a, p = self.columns
        c, z, d = self.moved(i, link)
        n, s = self.mix((c, n), (z, s)), self.mix((c, s), (minus(z), n))
        self.steps.append(((link.a, n), (d, a)))
        p = self.mix((1.0, p), *self.steps[-1])
        ca, sa = tilted(link)
        s, a = self.mix((ca, s), (sa, a)), self.mix((ca, a), (-sa, s))
        self.columns = n, s, a, p

    def moved(self, i: int, link: Link) -> tuple[Entry, Entry, Entry]:
        """The cosine and the sine of the angle at a joint, and how far it slides."""
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
        """A sum of columns, each times a factor."""
        x, y, z = (self.sum((factor, column[i]) for factor, column in terms) for i in range(3))
        return x, y, z

    def cross(self, a: Column, b: Column) -> Column:
        return self.crossed(STILL, (a, b))

    def crossed(self, start: Column, *pairs: tuple[Column, Column]) -> Column:
        """A column and cross products."""
        x, y, z = (
            self.sum([(1.0, start[i]), *(term for a, b in pairs for term in ((a[j], b[k]), (minus(a[k]), b[j])))])
            for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        )
        return x, y, z

    def sum(self, terms: Iterable[tuple[Entry, Entry]]) -> Entry:
        """A sum of products: a number, a name that is there, or a new one."""
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


def tilted(link: Link) -> tuple[float, float]:
    """The cosine and the sine of the twist of a link."""
    return without_rounding(cos(link.alpha)), without_rounding(sin(link.alpha))


def without_rounding(x: float) -> float:
    """The rounding of a right angle taken away."""
    for exact in (0.0, 1.0, -1.0):
        if abs(x - exact) < NOTHING:
            return exact
    return x


def text_of(entry: Entry) -> str:
    return entry if isinstance(entry, str) else repr(float(entry))


def function(head: str, lines: Iterable[str]) -> str:
    return f"def {head}:\n" + "".join(f"    {line}\n" for line in lines)
