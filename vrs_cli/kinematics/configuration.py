"""The eight ways in which an arm with a spherical wrist reaches one location.

Signs as Lee and Ziegler (1984) define them, in the words of VAL-II (`sign` +1 is the first of each pair):

    RIGHTY / LEFTY    joint 2, turning positively, raises / lowers the wrist
    ABOVE / BELOW     elbow above / below the line from shoulder to wrist
    NOFLIP / FLIP     joint 5 positive (or zero) / negative
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from itertools import product


class Arm(Enum):
    RIGHTY = 1
    LEFTY = -1


class Elbow(Enum):
    ABOVE = 1
    BELOW = -1


class Wrist(Enum):
    NOFLIP = 1
    FLIP = -1


@dataclass(frozen=True, slots=True)
class Configuration:
    """Arm, elbow and wrist. `signs`: the three as +1.0 or -1.0, ready for formulas; `index`: its place in ALL."""

    arm: Arm
    elbow: Elbow
    wrist: Wrist
    signs: tuple[float, float, float] = field(init=False, repr=False, compare=False)
    index: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        signs = (float(self.arm.value), float(self.elbow.value), float(self.wrist.value))
        object.__setattr__(self, "signs", signs)
        object.__setattr__(self, "index", sum(w for w, sign in zip((4, 2, 1), signs, strict=True) if sign < 0))

    def words_beside(self, others: tuple[Configuration, ...]) -> tuple[str, ...]:
        """The words of this one that none of the others has: what to say to get from them to it."""
        return tuple(
            getattr(self, part).name
            for part in ("arm", "elbow", "wrist")
            if all(getattr(self, part) is not getattr(other, part) for other in others)
        )

    def __str__(self) -> str:
        return f"{self.arm.name} {self.elbow.name} {self.wrist.name}"


ALL: tuple[Configuration, ...] = tuple(Configuration(a, e, w) for a, e, w in product(Arm, Elbow, Wrist))
