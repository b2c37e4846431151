"""One step of Newton's method to a pose, and the rates of the joints there, written out as Python for one arm.

All is seen in the frame that carries the axis of the third joint, and velocities are those of its origin: there many
entries of the Jacobian are numbers, most of them 0 (Waldron, Wang and Bolin, "A Study of the Jacobian Matrix of Serial
Manipulators", J. Mechanisms, Transmissions, and Automation in Design 107(2), 1985). Unknowns whose pivots are numbers
are eliminated here, once; the others, where it runs, by `elimination`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from math import cos, sin
from typing import Any, cast

from vrs_cli.kinematics.axes import Link
from vrs_cli.kinematics.compiled import STILL, Column, Entry, Writer, function, minus, text_of, tilted
from vrs_cli.kinematics.elimination import LARGE, SMALL, elimination_lines, listed
from vrs_cli.kinematics.joints import Demands, JointKind, Joints, Twist
from vrs_cli.kinematics.numeric.search import as_long_as_angle
from vrs_cli.kinematics.transform import IDENTITY, Transform, inverse

SEEN_FROM = 2  # the frame with the axis of the third joint
SIDES = 2  # of the equations: what is missing, and the rates
NO_TWIST: Twist = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

Table = list[list[Entry]]
Newton = Callable[[Joints, Transform, Demands, Twist, Sequence[float]], tuple[Joints, Joints] | None]


@cache
def newton(links: tuple[Link, ...], base: Transform, flange: Transform) -> Newton:
    """`newton(q, T, demands, twist, rates)`: the step from joints q to the pose T of the flange, with the sums that are
    demanded; and the rates of the joints at q for the twist of the flange and the rates of the sums. None where q is
    singular. There are as many demands as joints more than six.
    """
    names: dict[str, Any] = {"cos": cos, "sin": sin, "turned": as_long_as_angle, "SMALL": SMALL, "LARGE": LARGE}
    exec(compile(_StepWriter(links, base, flange).step_text(), "<newton>", "exec"), names)
    return cast(Newton, names["newton"])


class _StepWriter(Writer):
    """The arm from `SEEN_FROM` on, and back from there to its base; then the equations."""

    def __init__(self, links: Sequence[Link], base: Transform, flange: Transform) -> None:
        super().__init__(links[SEEN_FROM:], IDENTITY, flange, SEEN_FROM)
        self.flange, self.columns = self.columns, self.columns_of(IDENTITY)
        for i in reversed(range(SEEN_FROM)):
            self._joint_before(i, links[i])
        self.columns = self.product(self.columns_of(inverse(base)))
        self.all, self.guides = links, len(links) - 6

    def _joint_before(self, i: int, link: Link) -> None:
        """The inverse of `_joint`."""
        n, s, a, p = self.columns
        c, z, d = self.moved(i, link)
        ca, sa = tilted(link)
        s, a = self.mix((ca, s), (-sa, a)), self.mix((ca, a), (sa, s))
        p = self.mix((1.0, p), (-link.a, n))
        self.axes.insert(0, (a, p))
        n, s = self.mix((c, n), (minus(z), s)), self.mix((c, s), (z, n))
        self.columns = n, s, a, self.mix((1.0, p), (minus(d), a))

    def step_text(self) -> str:
        joints, guides = range(len(self.all)), range(self.guides)
        weights = [[f"g{k}_{i}" for i in joints] for k in guides]
        head = [f"{listed(f'q{i}' for i in joints)} = q", f"{listed(f'p{i}' for i in range(12))} = T"]
        head += [f"{listed(f'u{i}' for i in range(6))} = twist"]
        if self.guides:
            head += [f"{listed(f'(({listed(row)}), v{k})' for k, row in enumerate(weights))} = demands"]
            head += [f"{listed(f'r{k}' for k in guides)} = rates"]
        sums = [self.sum([(1.0, f"v{k}"), *((minus(w), f"q{i}") for i, w in enumerate(weights[k]))]) for k in guides]
        n, s, a, _ = self.columns
        v, w = self.mix(("u0", n), ("u1", s), ("u2", a)), self.mix(("u3", n), ("u4", s), ("u5", a))
        twist = *self.crossed(v, (self.flange[3], w)), *w  # of the flange as one of the origin
        wanted = zip((*self._missing(), *sums), (*twist, *(f"r{k}" for k in guides)), strict=True)
        columns = list[tuple[Entry, ...]]()  # of the Jacobian: the velocity of the origin, and the angular velocity
        for link, (z, o) in zip(self.all, self.axes, strict=True):
            columns.append((*z, *STILL) if link.kind is JointKind.PRISMATIC else (*self.cross(o, z), *z))
        rows = (*zip(*columns, strict=True), *weights)
        table = [[*row, *sides] for row, sides in zip(rows, wanted, strict=True)]
        found = (f"({listed(map(text_of, side))})" for side in zip(*self._solved(table), strict=True))
        return function("newton(q, T, demands, twist, rates)", [*head, *self.lines, f"return {listed(found)}"])

    def _missing(self) -> tuple[Entry, ...]:
        """The way of the origin, if it went with the flange, and the turn to the pose that is wanted."""
        n, s, a, origin = [(f"p{i}", f"p{i + 4}", f"p{i + 8}") for i in range(4)]
        *want, p = self.product((n, s, a, origin))
        *have, o = self.flange
        x, y, z = map(text_of, self.crossed(STILL, *zip(have, want, strict=True)))
        trace = self.sum([pair for a, b in zip(have, want, strict=True) for pair in zip(a, b, strict=True)])
        self.lines.append(f"x, y, z = turned((0.5 * {x}, 0.5 * {y}, 0.5 * {z}), 0.5 * ({text_of(trace)} - 1.0))")
        turn: Column = ("x", "y", "z")
        return *self.crossed(self.mix((1.0, p), (-1.0, o)), (o, turn)), *turn

    # --- equations ---

    def _solved(self, table: Table) -> Table:
        """The unknowns, each on both sides, of rows of coefficients and sides."""
        n = len(table)
        entries = ((r, c, table[r][c]) for r in range(n) for c in range(n))
        r, c, pivot = next(((r, c, x) for r, c, x in entries if isinstance(x, float) and abs(x) >= LARGE), (n, n, 0.0))
        if r == n:  # the rest is solved where the function runs
            table = sorted(table, key=lambda row: row[0] == 0.0)
            self.lines += [f"a{r}_{c} = {text_of(x)}" for r, row in enumerate(table) for c, x in enumerate(row)]
            self.lines += elimination_lines(n, SIDES)
            return [[f"x{k}_{side}" for side in range(SIDES)] for k in range(n)]
        row = [self.sum([(1.0 / pivot, x)]) for x in table[r]]
        others = list[list[Entry]]()  # each less so much of that row that it has none of its unknown
        for other in (*table[:r], *table[r + 1 :]):
            pairs = [(x, y) for k, (x, y) in enumerate(zip(other, row, strict=True)) if k != c]
            others.append([self.sum([(1.0, x), (minus(other[c]), y)]) for x, y in pairs])
        found = self._solved(others)
        known = [minus(x) for x in row[:c] + row[c + 1 : n]]
        sides = zip(row[n:], zip(*found, strict=True), strict=True)
        own = [self.sum([(1.0, wanted), *zip(known, values, strict=True)]) for wanted, values in sides]
        return [*found[:c], own, *found[c:]]
