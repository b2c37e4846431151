"""Define joint vectors with their units and rates, and the configurations of an arm.

Adding a whole turn to a joint changes its value but not the pose. A twist is (vx, vy, vz, wx, wy, wz): the velocity of
the tool's origin [m/s] and the angular velocity [rad/s], both in the base frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from functools import cache
from itertools import product
from math import ceil, degrees, pi, radians
from operator import mul
from typing import NamedTuple

from msgspec import Struct

Joints = tuple[float, ...]
# intermediate values of a closed-form solution [m, rad, 1], by their symbols in `render/symbols.py`
Steps = dict[str, float]


class JointKind(Enum):
    """The kind of a joint: revolute [rad] or prismatic [m]."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


class JointUnits(Struct, frozen=True):
    """Converts joint values between SI units and those shown to users: degrees for revolute joints, millimetres for
    prismatic joints.

    `kinds`: the kind of each joint; joints beyond its end count as revolute.
    """

    kinds: tuple[JointKind, ...] = ()

    def to_display(self, q: Iterable[float]) -> tuple[float, ...]:
        """Convert joints from [rad, m] to [deg, mm]."""
        return tuple([self.one_shown(i, x) for i, x in enumerate(q, 1)])

    def read(self, numbers: Iterable[float]) -> Joints:
        """Convert joints from [deg, mm] to [rad, m]."""
        return tuple([self.one_read(i, x) for i, x in enumerate(numbers, 1)])

    def slides(self, joint: int) -> bool:
        """Return whether a joint (counted from 1) slides."""
        return 1 <= joint <= len(self.kinds) and self.kinds[joint - 1] is JointKind.PRISMATIC

    def one_shown(self, joint: int, x: float) -> float:
        """Convert the value or rate of a joint (counted from 1) from [rad, m] to [deg, mm]."""
        return 1000.0 * x if self.slides(joint) else degrees(x)

    def one_read(self, joint: int, number: float) -> float:
        """Convert the value of a joint (counted from 1) from [deg, mm] to [rad, m]."""
        return number / 1000.0 if self.slides(joint) else radians(number)

    def unit(self, joint: int) -> str:
        """Return the unit, "deg" or "mm", in which the value of a joint (counted from 1) is shown."""
        return "mm" if self.slides(joint) else "deg"

    def json_units(self, count: int) -> dict[str, list[str]]:
        """Return the field `joint_units` for the JSON of a position with `count` joints; an empty dict if all joints
        are revolute.
        """
        units = [self.unit(joint) for joint in range(1, count + 1)]
        return {"joint_units": units} if "mm" in units else {}


TURNING = JointUnits()

TURN = 2 * pi
LIMIT_TOLERANCE = 1e-9  # [rad, m] a value may exceed a limit by this much, because of rounding errors


def nearest_turn(angle: float, reference: float) -> float:
    """Return the angle that differs from `angle` by whole turns and is within half a turn of `reference` [rad]."""
    off = angle - reference
    return angle if -pi <= off <= pi else angle - TURN * round(off / TURN)


def turned_near(angles: Iterable[float], near: Joints) -> Joints:
    """Return the angles with whole turns added that bring each nearest to its joint in `near` [rad]."""
    rows = zip(angles, near, strict=True)
    return tuple([q if -pi <= (off := q - there) <= pi else q - TURN * round(off / TURN) for q, there in rows])


def six_turned_near(q: Joints, near: Joints) -> Joints:
    """Return the same as `turned_near` for exactly six joints, in half the time."""
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
    """Return the angle that differs from `angle` by whole turns, is inside the limits, and is nearest to `reference`
    [rad]; None if no such angle is inside.

    An angle that exceeds a limit only by rounding (LIMIT_TOLERANCE) becomes the limit itself.
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
    """Return the numbers of the joints outside their limits, counted from 1."""
    return tuple(
        i
        for i, (angle, low, high) in enumerate(zip(q, lower, upper, strict=True), 1)
        if not low - LIMIT_TOLERANCE <= angle <= high + LIMIT_TOLERANCE
    )


def put_inside(q: Joints, lower: Joints, upper: Joints) -> Joints:
    """Return q with each joint that is outside its range moved to the nearer end of the range."""
    return tuple([min(max(x, low), high) for x, low, high in zip(q, lower, upper, strict=True)])


def largest_change(a: Joints, b: Joints) -> float:
    """Return the largest change of a joint from a to b [rad, m]."""
    return max([abs(y - x) for x, y in zip(a, b, strict=True)])


# --- rates ---------------------------------------------------------------------------------------------------------

Twist = tuple[float, float, float, float, float, float]
Jacobian = tuple[Joints, Joints, Joints, Joints, Joints, Joints]  # six rows (vx, vy, vz, wx, wy, wz) of n numbers
# linear constraints for a redundant arm: for each, the weights of all joints and the required value of the weighted sum
Demands = tuple[tuple[Joints, float], ...]

MAX_RATE_ERROR = 1e-5  # maximum relative error of the joint rates that is accepted while a straight line is planned
AT_REST = 1e-9  # [m/s, rad/s] in a singular pose, a smaller velocity in the direction that is lost counts as 0


class Singularity(NamedTuple):
    """How far a pose is from each singularity, from 0 (singular) to 1 (as far as possible).

    `shoulder`: the distance of the wrist from axis 1, divided by the length of the arm. `elbow`: |sin psi|, with psi
    the angle between upper arm and forearm. `wrist`: |sin q5|.
    """

    shoulder: float
    elbow: float
    wrist: float

    @property
    def nearest(self) -> str:
        return min(zip(self, self._fields, strict=True))[1]


def beyond(rate: Twist, bias: Twist) -> Twist:
    """Return `rate` minus `bias`: the part of a tool's acceleration (or jerk) that joint accelerations (or jerks) must
    produce. `bias` is the part that lower derivatives of the joints cause.
    """
    vx, vy, vz, wx, wy, wz = rate
    ax, ay, az, bx, by, bz = bias
    return vx - ax, vy - ay, vz - az, wx - bx, wy - by, wz - bz


# --- walks: small steps of a redundant arm along a line (`numeric.arm`)
# --------------------------------------------------------

# (index, value at the end of the line) of each redundant joint with a prescribed end value
Asked = tuple[tuple[int, float], ...]


class Walk(Struct, frozen=True):
    """The result of small steps along a straight line (a walk). It determines the guides of a redundant arm: weighted
    sums of joints whose values are prescribed along the line.

    `end`: the joints at the end of the walk. `weights`: the weights of all joints in each guide. `margin`: the least
    distance of any joint from the ends of its range during the walk, as a fraction of the range. `arrives`: whether the
    walk reaches the last pose.
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
# An arm can reach one location in several configurations: eight for six joints in the usual arrangements, two for a
# SCARA. Lee and Ziegler (1984) define them; here they have the words of VAL-II (the first word of each pair has the
# sign +1). The definitions do not depend on the positive directions and zeros of the joints; "up" is the Z axis of the
# base:
#
#     RIGHTY / LEFTY    the arm to the right / left of the axis of joint 1, seen from above along the arm
#     ABOVE / BELOW     elbow above / below the line from shoulder to wrist
#     NOFLIP / FLIP     joint 5 positive (or zero) / negative, measured from where the hand points along the forearm
#
# An arm that moves in a plane through the axis of joint 1 is RIGHTY if it reaches forward from its shoulder, and LEFTY
# if it reaches back over the shoulder. If the shoulder is on this axis, the arm is RIGHTY if a positive turn of joint 2
# raises the wrist, else LEFTY. On a PUMA these definitions agree. The module of each closed form explains the words for
# other arms.


class Arm(Enum):
    RIGHTY = 1
    LEFTY = -1

    __hash__ = object.__hash__  # faster than the hash function of Enum, which is written in Python


class Elbow(Enum):
    ABOVE = 1
    BELOW = -1

    __hash__ = object.__hash__


class Wrist(Enum):
    NOFLIP = 1
    FLIP = -1

    __hash__ = object.__hash__


Flag = Arm | Elbow | Wrist
ARM, ELBOW, WRIST = 4, 2, 1  # bits of `Configuration.index`, set for LEFTY, BELOW and FLIP


class ArmWords(Struct, frozen=True):
    """The VAL-II words of a configuration for arm, elbow and wrist; None where the robot has no such choice."""

    arm: Arm | None = None
    elbow: Elbow | None = None
    wrist: Wrist | None = None

    @property
    def flags(self) -> tuple[Flag | None, ...]:
        return self.arm, self.elbow, self.wrist


class Configuration(ArmWords, frozen=True, kw_only=True):
    """A configuration of an arm: its VAL-II words for arm, elbow and wrist; None where the robot has no such choice.
    `signs`: the words as +1.0 or -1.0, for formulas. `index`: the index in ALL. Replies to clients contain these
    fields.
    """

    signs: tuple[float, float, float]
    index: int

    @staticmethod
    @cache
    def of(arm: Arm | None = None, elbow: Elbow | None = None, wrist: Wrist | None = None) -> Configuration:
        """Return the configuration with these words; the same words always give the same object."""
        first, second, third = (1.0 if flag is None else float(flag.value) for flag in (arm, elbow, wrist))
        signs = (first, second, third)
        index = sum(w for w, sign in zip((ARM, ELBOW, WRIST), signs, strict=True) if sign < 0)
        return Configuration(arm, elbow, wrist, signs=signs, index=index)

    @property
    def other_wrist(self) -> Configuration:
        """Return the configuration with FLIP in place of NOFLIP, or the reverse."""
        return Configuration.of(self.arm, self.elbow, Wrist.FLIP if self.wrist is Wrist.NOFLIP else Wrist.NOFLIP)

    def with_flag(self, flag: Flag) -> Configuration:
        """Return the configuration in which `flag` replaces the word of its pair."""
        return Configuration.of(
            flag if isinstance(flag, Arm) else self.arm,
            flag if isinstance(flag, Elbow) else self.elbow,
            flag if isinstance(flag, Wrist) else self.wrist,
        )

    def has(self, asked: Configuration) -> bool:
        """Return whether the configuration has all words in `asked`. Words of `asked` for a choice that the robot does
        not have are ignored.
        """
        return all(word is None or mine in (None, word) for mine, word in zip(self.flags, asked.flags, strict=True))

    def words_beside(self, others: tuple[Configuration, ...]) -> tuple[str, ...]:
        """Return the words of this configuration that none of the configurations `others` has."""
        return tuple(
            flag.name
            for i, flag in enumerate(self.flags)
            if flag is not None and all(flag is not other.flags[i] for other in others)
        )

    def __str__(self) -> str:
        return " ".join(flag.name for flag in self.flags if flag is not None)


# [rad] below this angle of joint 5 the wrist counts as straight, where FLIP and NOFLIP are the same
WRIST_SINGULAR = 1e-6
# the configuration that no word selects, of an arm with only one configuration or with more configurations than words
# can name
NONE = Configuration.of()
SIDES: tuple[Configuration, ...] = tuple(
    map(Configuration.of, Arm)
)  # RIGHTY and LEFTY: the configurations of an arm without elbow and wrist words, such as a SCARA
ALL: tuple[Configuration, ...] = tuple(Configuration.of(a, e, w) for a, e, w in product(Arm, Elbow, Wrist))


class Profile(Enum):
    """The velocity profiles. The name of each is the word in VAL-II, its value the word in files, and `summary`
    explains it to users. The first profile is the default.

    A file named after each profile in `trajectory/laws` implements it.
    """

    LSPB = "lspb", "linear with parabolic blends"
    SCURVE = "scurve", "jerk limited"
    QUINTIC = "quintic", "polynomials of degree 5"

    def __new__(cls, word: str, summary: str) -> Profile:
        profile = object.__new__(cls)
        profile._value_ = word
        profile.summary = summary
        return profile

    summary: str
    __hash__ = object.__hash__
