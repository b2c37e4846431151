"""Joint vectors, and the turns of a joint: one turn on is the same pose, but not the same joint value."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import repeat
from math import ceil, degrees, pi, radians

Joints = tuple[float, ...]


class JointKind(Enum):
    """What a joint does: turn [rad], or slide [m]."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


@dataclass(frozen=True, slots=True)
class JointUnits:
    """The numbers of joints as people see them: degrees of those that turn, millimetres of those that slide.

    `kinds` may be shorter than a joint vector: the joints that it does not tell turn.
    """

    kinds: tuple[JointKind, ...] = ()

    def shown(self, q: Iterable[float]) -> tuple[float, ...]:
        """[rad, m] -> [deg, mm]."""
        return tuple(1000.0 * x if slides else degrees(x) for x, slides in zip(q, self._slides(), strict=False))

    def read(self, numbers: Iterable[float]) -> Joints:
        """[deg, mm] -> [rad, m]."""
        return tuple(x / 1000.0 if slides else radians(x) for x, slides in zip(numbers, self._slides(), strict=False))

    def slides(self, joint: int) -> bool:
        """Whether a joint, counted from 1, slides."""
        return 1 <= joint <= len(self.kinds) and self.kinds[joint - 1] is JointKind.PRISMATIC

    def one_shown(self, joint: int, x: float) -> float:
        """A value of a joint, counted from 1, or its rate: [rad, m] -> [deg, mm]."""
        return 1000.0 * x if self.slides(joint) else degrees(x)

    def one_read(self, joint: int, number: float) -> float:
        """A value of a joint, counted from 1: [deg, mm] -> [rad, m]."""
        return number / 1000.0 if self.slides(joint) else radians(number)

    def unit(self, joint: int) -> str:
        """The unit of a joint, counted from 1."""
        return "mm" if self.slides(joint) else "deg"

    def told(self, count: int) -> dict[str, list[str]]:
        """What a position in JSON says of its joints: `joint_units`, where one slides."""
        units = [self.unit(joint) for joint in range(1, count + 1)]
        return {"joint_units": units} if "mm" in units else {}

    def _slides(self) -> Iterator[bool]:
        yield from (kind is JointKind.PRISMATIC for kind in self.kinds)
        yield from repeat(False)


TURNING = JointUnits()

TURN = 2 * pi
LIMIT_TOLERANCE = 1e-9  # [rad] rounding that a joint at its very limit is forgiven


def nearest_turn(angle: float, reference: float) -> float:
    """`angle` plus whole turns, within half a turn of `reference` [rad]."""
    off = angle - reference
    return angle if -pi <= off <= pi else angle - TURN * round(off / TURN)


def turn_within(angle: float, reference: float, lower: float, upper: float) -> float | None:
    """Of all turns of `angle` inside the limits the one nearest to `reference` [rad]; None if there is none.

    A value outside by rounding alone (LIMIT_TOLERANCE) is set to the limit itself.
    """
    here = nearest_turn(angle, reference)
    if lower <= here <= upper:
        return here
    if here < lower:
        here += TURN * ceil((lower - LIMIT_TOLERANCE - here) / TURN)
    else:
        here -= TURN * ceil((here - upper - LIMIT_TOLERANCE) / TURN)
    inside = lower - LIMIT_TOLERANCE <= here <= upper + LIMIT_TOLERANCE
    return min(max(here, lower), upper) if inside else None


def joints_outside(q: Joints, lower: Joints, upper: Joints) -> tuple[int, ...]:
    """The joints that are out of their limits, counted from 1, as JT1 is."""
    return tuple(
        i
        for i, (angle, low, high) in enumerate(zip(q, lower, upper, strict=True), 1)
        if not low - LIMIT_TOLERANCE <= angle <= high + LIMIT_TOLERANCE
    )


def put_inside(q: Joints, lower: Joints, upper: Joints) -> Joints:
    """Each joint, or the end of its range that is nearest to it."""
    return tuple([min(max(x, low), high) for x, low, high in zip(q, lower, upper, strict=True)])


def largest_change(a: Joints, b: Joints) -> float:
    """The most that any joint moves between two joint vectors [rad]."""
    return max(abs(y - x) for x, y in zip(a, b, strict=True))
