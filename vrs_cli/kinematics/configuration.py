"""The ways in which an arm reaches one location: eight for six joints in the usual arrangements, two for a SCARA.

As Lee and Ziegler (1984) define them, in the words of VAL-II (`sign` +1 is the first of each pair), for any signs and
zeros of the joints, and up as the base has it:

    RIGHTY / LEFTY    the arm to the right / left of the axis of joint 1, seen from above along the arm
    ABOVE / BELOW     elbow above / below the line from shoulder to wrist
    NOFLIP / FLIP     joint 5, from where the hand points along the forearm, positive (or zero) / negative

An arm straight before that axis is RIGHTY where it reaches forward from its shoulder, LEFTY where it reaches back over
it; with the shoulder on the axis, where joint 2, turning positively, raises / lowers the wrist. All are the same on a
PUMA. What they mean for other arms stands in the module of their closed form.
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


Flag = Arm | Elbow | Wrist
ARM, ELBOW, WRIST = 4, 2, 1  # the bits of `Configuration.index`


@dataclass(frozen=True, slots=True)
class Configuration:
    """Arm, elbow and wrist; None where a robot has no such choice.

    `signs`: the three as +1.0 or -1.0, ready for formulas; `index`: its place in ALL.
    """

    arm: Arm | None = None
    elbow: Elbow | None = None
    wrist: Wrist | None = None
    signs: tuple[float, float, float] = field(init=False, repr=False, compare=False)
    index: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        arm, elbow, wrist = (1.0 if flag is None else float(flag.value) for flag in self.flags)
        signs = (arm, elbow, wrist)
        object.__setattr__(self, "signs", signs)
        object.__setattr__(
            self, "index", sum(w for w, sign in zip((ARM, ELBOW, WRIST), signs, strict=True) if sign < 0)
        )

    @property
    def flags(self) -> tuple[Flag | None, ...]:
        return self.arm, self.elbow, self.wrist

    @property
    def flipped(self) -> Configuration:
        """The same with the other wrist."""
        return Configuration(self.arm, self.elbow, Wrist.FLIP if self.wrist is Wrist.NOFLIP else Wrist.NOFLIP)

    def with_flag(self, flag: Flag) -> Configuration:
        """The same with one word changed."""
        return Configuration(
            flag if isinstance(flag, Arm) else self.arm,
            flag if isinstance(flag, Elbow) else self.elbow,
            flag if isinstance(flag, Wrist) else self.wrist,
        )

    def has(self, asked: Configuration) -> bool:
        """Whether it has the words that are asked for, as far as there is such a choice."""
        return all(word is None or mine in (None, word) for mine, word in zip(self.flags, asked.flags, strict=True))

    def words_beside(self, others: tuple[Configuration, ...]) -> tuple[str, ...]:
        """The words of this one that none of the others has: what to say to get from them to it."""
        return tuple(
            flag.name
            for i, flag in enumerate(self.flags)
            if flag is not None and all(flag is not other.flags[i] for other in others)
        )

    def __str__(self) -> str:
        return " ".join(flag.name for flag in self.flags if flag is not None)


WRIST_SINGULAR = 1e-6  # [rad] joint 5 this near to straight: FLIP and NOFLIP meet
NONE = Configuration()  # of an arm that has one way, or too many to be told by words
SIDES: tuple[Configuration, ...] = tuple(map(Configuration, Arm))  # of an arm that has no other choice, as a SCARA
ALL: tuple[Configuration, ...] = tuple(Configuration(a, e, w) for a, e, w in product(Arm, Elbow, Wrist))
