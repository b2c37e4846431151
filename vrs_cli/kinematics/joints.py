"""Joint vectors, their rates, and the configurations that they are in.

One turn of a joint on is the same pose, but not the same joint value. A twist is (vx, vy, vz, wx, wy, wz): the velocity
of the tool's point [m/s] and the angular velocity [rad/s], both in the base frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
from itertools import product
from math import ceil, degrees, pi, radians
from operator import mul
from typing import NamedTuple

Joints = tuple[float, ...]
Steps = dict[str, float]  # intermediate values of a closed form [m, rad, 1], by their symbols in `render/symbols.py`


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

    def to_display(self, q: Iterable[float]) -> tuple[float, ...]:
        """[rad, m] -> [deg, mm]."""
        return tuple([self.one_shown(i, x) for i, x in enumerate(q, 1)])

    def read(self, numbers: Iterable[float]) -> Joints:
        """[deg, mm] -> [rad, m]."""
        return tuple([self.one_read(i, x) for i, x in enumerate(numbers, 1)])

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

    def json_units(self, count: int) -> dict[str, list[str]]:
        """What a position in JSON says of its joints: `joint_units`, where one slides."""
        units = [self.unit(joint) for joint in range(1, count + 1)]
        return {"joint_units": units} if "mm" in units else {}


TURNING = JointUnits()

TURN = 2 * pi
LIMIT_TOLERANCE = 1e-9  # [rad] rounding that a joint at its very limit is forgiven


def nearest_turn(angle: float, reference: float) -> float:
    """`angle` plus whole turns, within half a turn of `reference` [rad]."""
    off = angle - reference
    return angle if -pi <= off <= pi else angle - TURN * round(off / TURN)


def turned_near(angles: Iterable[float], near: Joints) -> Joints:
    """Each angle on the turn nearest to the reference: `nearest_turn`, written out."""
    rows = zip(angles, near, strict=True)
    return tuple([q if -pi <= (off := q - there) <= pi else q - TURN * round(off / TURN) for q, there in rows])


def six_turned_near(q: Joints, near: Joints) -> Joints:
    """`turned_near` of six joints, which takes half the time."""
    q1, q2, q3, q4, q5, q6 = q
    n1, n2, n3, n4, n5, n6 = near
    return (
        q1 if -pi <= q1 - n1 <= pi else q1 - TURN * round((q1 - n1) / TURN),
        q2 if -pi <= q2 - n2 <= pi else q2 - TURN * round((q2 - n2) / TURN),
        q3 if -pi <= q3 - n3 <= pi else q3 - TURN * round((q3 - n3) / TURN),
        q4 if -pi <= q4 - n4 <= pi else q4 - TURN * round((q4 - n4) / TURN),
        q5 if -pi <= q5 - n5 <= pi else q5 - TURN * round((q5 - n5) / TURN),
        q6 if -pi <= q6 - n6 <= pi else q6 - TURN * round((q6 - n6) / TURN),
    )


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


# --- rates ---------------------------------------------------------------------------------------------------------

Twist = tuple[float, float, float, float, float, float]
Jacobian = tuple[Joints, Joints, Joints, Joints, Joints, Joints]  # six rows of n
Demands = tuple[tuple[Joints, float], ...]  # of joints that are too many: a sum of all of them by weights, what it is

MAX_RATE_ERROR = 1e-5  # part of the joint rates that may be wrong while a line is planned
AT_REST = 1e-9  # [m/s, rad/s] a demand on a lost direction that is rounding and no motion


class Singularity(NamedTuple):
    """How far from each singularity a pose is, 0 (in it) to 1 (as far as can be).

    `shoulder` is |u| over the arm's length, `elbow` |sin psi|, `wrist` |sin q5|.
    """

    shoulder: float
    elbow: float
    wrist: float

    @property
    def nearest(self) -> str:
        return min(zip(self, self._fields, strict=True))[1]


def beyond(rate: Twist, bias: Twist) -> Twist:
    """The part of a rate of the tool that the joints' next derivative makes: all but the bias."""
    vx, vy, vz, wx, wy, wz = rate
    ax, ay, az, bx, by, bz = bias
    return vx - ax, vy - ay, vz - az, wx - bx, wy - by, wz - bz


# --- walks along a line, of joints that are too many (`numeric.arm`) ------------------------------------------

Asked = tuple[tuple[int, float], ...]  # joints, by index, and where each is to end: there its own guide leads


class Walk(NamedTuple):
    """What the guides of a line follow from: the joints at its end, their weights, how far all joints keep from the
    ends of their ranges, as a part of these, and whether they bring the flange there.
    """

    end: Joints
    weights: tuple[Joints, ...]
    margin: float
    arrives: bool

    @property
    def ends(self) -> tuple[float, ...]:
        return tuple([sum(map(mul, weights, self.end)) for weights in self.weights])


# --- configurations ------------------------------------------------------------------------------------------------
#
# The ways in which an arm reaches one location: eight for six joints in the usual arrangements, two for a SCARA. As Lee
# and Ziegler (1984) define them, in the words of VAL-II (`sign` +1 is the first of each pair), for any signs and zeros
# of the joints, and up as the base has it:
#
#     RIGHTY / LEFTY    the arm to the right / left of the axis of joint 1, seen from above along the arm
#     ABOVE / BELOW     elbow above / below the line from shoulder to wrist
#     NOFLIP / FLIP     joint 5, from where the hand points along the forearm, positive (or zero) / negative
#
# An arm straight before that axis is RIGHTY where it reaches forward from its shoulder, LEFTY where it reaches back
# over it; with the shoulder on the axis, where joint 2, turning positively, raises / lowers the wrist. All are the same
# on a PUMA. The module of each closed form says what they mean for other arms.


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
    def other_wrist(self) -> Configuration:
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
        """Return whether it has the words that are asked for, as far as there is such a choice."""
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


# --- links from axes ---------------------------------------------------------------------------------------------


class Profile(Enum):
    """Words of VAL-II, each with its word in files and what it means. The first is that of a robot that names none."""

    LSPB = "lspb", "linear with parabolic blends"
    SCURVE = "scurve", "jerk limited"
    QUINTIC = "quintic", "polynomials of degree 5"

    def __new__(cls, word: str, summary: str) -> Profile:
        profile = object.__new__(cls)
        profile._value_ = word
        profile.summary = summary
        return profile

    summary: str
