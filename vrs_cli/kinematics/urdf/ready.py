"""Where an arm begins whose file does not say it: not at zeros in which it is singular, as most arms are there, nor
where a joint is at its end.

How near to singular a pose is tells the isotropy of its Jacobian: the geometric mean of the eigenvalues of J J^T over
their arithmetic mean, 1 where the arm does all alike, 0 where it cannot do something (J. Kim, P. Khosla, "Dexterity
measures for design and control of manipulators", IROS 1991). Lengths count as parts of half the reach.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import dist, pi, sqrt
from typing import NamedTuple

from vrs_cli.kinematics.axes import axis_of
from vrs_cli.kinematics.elimination import volume
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.kinematics.model import RobotModel, levers, link_frames
from vrs_cli.kinematics.transform import Transform, Vector, cross, position, rotate, subtracted
from vrs_cli.kinematics.urdf.hand import Z

MOST_JOINTS = 12  # of an arm whose pose is looked for
SINGULAR = 0.02  # isotropy below which a pose is no place to begin from
END = 0.01  # of a joint's range: so near to an end it is there
STEP = pi / 12  # [rad] of the joints of a pose that is looked for
FAR = 2 * pi / 3  # [rad] no joint is turned farther for it
MARGIN = 0.05  # of a joint's range, at either end
STARTS, TRIED, SWEEPS = 150, 3, 3  # poses looked at first, those of them that are bettered, and how often

# what a pose is worth beside its isotropy: few joints turned, and little; the tool pointing down, in front, and high
TURNED, TURNS = 0.05, 0.03  # for each joint, and for each half turn
DOWN, AHEAD, HIGH = 0.25, 0.1, 0.1
STRAIGHT_DOWN, LITTLE = -1.0 + 1e-9, 0.1  # the Z of where it points; what that may cost
NEAR = 0.3  # of the reach: nearer to the first axis is too near


class Ready(NamedTuple):
    """Joints in which an arm may begin, and what is told of them."""

    joints: Joints
    note: str


def better_ready(model: RobotModel, ahead: Vector = Z) -> Ready | None:
    """Another READY, in whole steps, for an arm that is singular there or has a joint at its end; None for one that is
    not, or that is singular everywhere. The same arm has the same one, always. `ahead`: where its tool points, as the
    flange sees it.
    """
    if model.joint_count > MOST_JOINTS:
        return None
    wanted = _Wanted(model, ahead)
    fault = wanted.fault()
    if not fault:
        return None
    starts = sorted(wanted.starts(), key=wanted.worth, reverse=True)
    best = wanted.levelled(max((wanted.bettered(q) for q in starts[:TRIED]), key=wanted.worth))
    if wanted.isotropy(link_frames(model, best)) <= SINGULAR:
        return None
    values = ", ".join(f"{round(x, 3):g}" for x in model.units.shown(best))
    return Ready(best, f"READY: at its zeros {fault}, ours is {values} ([poses] ready of a TOML file is another)")


class _Wanted:
    """The worth of poses to begin from."""

    def __init__(self, model: RobotModel, ahead: Vector) -> None:
        self.model, self.rest, self.ahead = model, model.poses["ready"], ahead
        _, (self.reach, *_) = levers(model)
        self.rows = 6 if model.task.turns else 3
        self.choices = [self._choices(i) for i in range(model.joint_count)]

    def fault(self) -> str:
        """The fault of READY; empty if there is none."""
        if self.isotropy(link_frames(self.model, self.rest)) <= SINGULAR:
            return "the arm is singular"
        rows = zip(self.model.links, self.model.lower, self.model.upper, self.rest, strict=True)
        at_end = (
            f"joint {i} is at its end"
            for i, (link, lower, upper, x) in enumerate(rows, 1)
            if link.kind is JointKind.REVOLUTE and min(x - lower, upper - x) < END * (upper - lower)
        )
        return next(at_end, "")

    def _choices(self, i: int) -> list[float]:
        lower, upper, rest = self.model.lower[i], self.model.upper[i], self.rest[i]
        margin = MARGIN * (upper - lower)
        if not i and self.model.links[i].kind is JointKind.REVOLUTE:
            return [min(max(rest, lower + margin), upper - margin)]  # it turns all alike
        if self.model.links[i].kind is JointKind.PRISMATIC:
            return [rest, 0.5 * (lower + upper)]
        low, high = max(lower + margin, rest - FAR), min(upper - margin, rest + FAR)
        steps = (k * STEP for k in range(round(low / STEP) - 1, round(high / STEP) + 2))
        inside = [x for x in (rest, *steps) if low <= x <= high]
        return list(dict.fromkeys(inside)) or [0.5 * (lower + upper)]

    def starts(self) -> Iterator[Joints]:
        """READY as near as may be, and poses with some of its joints turned, spread evenly (a Weyl sequence)."""
        near = [min(xs, key=lambda x: abs(x - rest)) for xs, rest in zip(self.choices, self.rest, strict=True)]
        yield tuple(near)
        roots = [sqrt(prime) for prime in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29)]
        for k in range(1, STARTS):
            parts = (2.0 * (k * roots[i % len(roots)] % 1.0) - 1.0 for i in range(len(near)))
            rows = zip(self.choices, parts, near, strict=True)
            yield tuple(x if part < 0.0 else xs[int(len(xs) * part)] for xs, part, x in rows)

    def bettered(self, q: Joints) -> Joints:
        """One joint after the other where it is worth most, until none can be bettered."""
        for _ in range(SWEEPS):
            before = q
            for i, xs in enumerate(self.choices):
                q = max(((*q[:i], x, *q[i + 1 :]) for x in (q[i], *xs)), key=self.worth)
            if q == before:
                break
        return q

    def levelled(self, q: Joints) -> Joints:
        """With the tool straight down, where one joint turns it so and that costs little."""
        turned = [(*q[:i], x, *q[i + 1 :]) for i, xs in enumerate(self.choices) for x in xs]
        down = [other for other in turned if rotate(link_frames(self.model, other)[-1], self.ahead)[2] < STRAIGHT_DOWN]
        best = max(down, key=self.worth, default=q)
        return best if self.worth(best) > self.worth(q) - LITTLE else q

    def worth(self, q: Joints) -> float:
        frames = link_frames(self.model, q)
        base, tip = position(frames[0]), position(frames[-1])
        turned = [abs(x - y) for x, y in zip(q, self.rest, strict=True) if x != y]
        heights = [position(T)[2] for T in frames]
        low = min(*heights, 0.0) - min(base[2], 0.0)
        return (
            self.isotropy(frames)
            - TURNED * len(turned)
            - TURNS * sum(turned) / pi
            - DOWN * rotate(frames[-1], self.ahead)[2]
            + AHEAD * (tip[0] - base[0]) / self.reach
            + HIGH * (sum(heights) / len(heights) - base[2]) / self.reach
            + min(low, 0.0) / self.reach
            - max(0.0, NEAR - dist(tip[:2], base[:2]) / self.reach)
        )

    def isotropy(self, frames: Sequence[Transform]) -> float:
        at, unit = position(frames[-1]), 0.5 * self.reach
        columns = list[list[float]]()  # of the Jacobian at the flange
        for link, frame in zip(self.model.links, frames, strict=False):
            axis = axis_of(frame)
            if link.kind is JointKind.PRISMATIC:
                columns.append([*axis.direction, 0.0, 0.0, 0.0][: self.rows])
            else:
                x, y, z = cross(axis.direction, subtracted(at, axis.point))
                columns.append([x / unit, y / unit, z / unit, *axis.direction][: self.rows])
        by_rows = [list(row) for row in zip(*columns, strict=True)]
        vectors = by_rows if len(by_rows) <= len(columns) else columns
        count, mean = len(vectors), sum(x * x for row in vectors for x in row) / len(vectors)
        return float(volume(vectors) ** (2.0 / count) / mean) if mean > 0.0 else 0.0
