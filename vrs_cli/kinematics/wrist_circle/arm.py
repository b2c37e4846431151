"""Find all solutions of arms with six joints whose wrist axes do not meet in one point, by a search over joint 6.

    i   theta   d     a    alpha
    1   q1      d1    a1   -90 deg
    2   q2      d2    a2     0
    3   q3      d3    a3   +90
    4   q4      d4    0    alpha4
    5   q5      d5    a5   alpha5
    6   q6      0     0      0

Axes 4 and 5 meet, and axis 6 passes beside that point (or is not perpendicular): the Fanuc CRX (d5), the ABB GoFa and
the xArm 6 (a5), the Jaco (d5, alpha4 and alpha5 of 55 or 60 deg). There is no closed form, but only one unknown to
search. For a given pose, as joint 6 turns, the point where axes 4 and 5 meet moves on a circle. For each point of the
circle joints 1 to 3 are computed as for an arm with a spherical wrist, with up to four solutions. The angle between the
axis z3 of the forearm and the axis z4 must then be alpha4:

    f(q6) = z3 . z4 - cos alpha4 = 0,

one function f for each of the four solutions; two of these functions meet where the arm is stretched or the wrist is as
near to axis 1 as it can be. There are up to 16 solutions of the whole arm. On a grid of joint 6 each shows as a change
of the sign of f, or as a point where f comes near 0 and turns back; Newton's method over all joints makes it exact.

For the configuration words, the wrist is the point where axes 4 and 5 meet, and the hand points along the forearm if
axis 6 is as close as possible to the direction of axis 4. Two solutions may have the same words. The words may change
on a straight line, because poses on the border between two words are not singular.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

from vrs_cli.errors import JointOutOfRange, LocationOutOfRange
from vrs_cli.kinematics.joints import ALL, NONE, Configuration, Joints, turned_near
from vrs_cli.kinematics.model import Chain, RobotModel
from vrs_cli.kinematics.numeric.arm import NumericArm
from vrs_cli.kinematics.spherical_wrist.inverse import Circle, configuration_of
from vrs_cli.kinematics.transform import Transform

if TYPE_CHECKING:
    from vrs_cli.kinematics.wrist_circle.batch import WristCircleBatch

REMEMBERED = 64  # number of poses whose solutions are cached


class WristCircleArm(NumericArm):
    """An arm with six joints whose wrist moves on a circle as joint 6 turns. The methods are those of `arm.RobotArm`.
    `swapped`: the words that are swapped with the other word of their pair, as bits of `Configuration.index`.

    On a straight line the arm always takes the nearest joints, even if their configuration words change.
    """

    ways = ALL
    lines_keep_words = False
    method = "search along the circle of the wrist, all solutions"

    def __init__(self, model: RobotModel, chain: Chain, circle: Circle, swapped: int) -> None:
        super().__init__(model)
        self.chain, self.circle, self._swapped = chain, circle, swapped
        self.solutions = lru_cache(REMEMBERED)(lambda T: self.batch.solutions_of(T))  # noqa: PLW0108 (`batch` brings numpy)

    def configuration(self, q: Joints) -> Configuration:
        return ALL[configuration_of(self.circle.arm, self.chain.of(q)).index ^ self._swapped]

    def branches(self, T: Transform) -> tuple[Joints | None, ...]:
        return tuple([self._best(T, way) for way in self.ways])

    def _best(self, T: Transform, way: Configuration) -> Joints | None:
        """Return the best solution in the configuration `way`: inside the limits if possible, then nearest to the
        middle of the ranges; None if there is none.
        """
        found = (q for q in self.solutions(T) if self.configuration(q) == way)
        return min(found, key=lambda q: (bool(self._outside(q)), self.shortest_time(self.middle, q)), default=None)

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        if configuration == NONE:
            return super().branch_joints(T, configuration, near)
        found = (turned_near(q, near) for q in self.solutions(T) if self.configuration(q) == configuration)
        return min(found, key=lambda q: self.shortest_time(near, q), default=None)

    def inverse_branch(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        return min(
            self._inside_limits(T, (configuration,), near), key=lambda q: self.shortest_time(near, q), default=None
        )

    def select(self, T: Transform, near: Joints, asked: Configuration = NONE) -> Joints:
        """Return the solution that the arm reaches soonest from `near`, among those that have the words in `asked`."""
        self.check_task(T)
        wanted = tuple([way for way in self.ways if way.has(asked)])
        found = self._inside_limits(T, wanted, near)
        if not found:
            raise self._refusal(T, near, wanted)
        return min(found, key=lambda q: self.shortest_time(near, q))

    def _inside_limits(self, T: Transform, wanted: tuple[Configuration, ...], near: Joints) -> list[Joints]:
        suited = (q for q in self.solutions(T) if self.configuration(q) in wanted)
        return [turned for q in suited if (turned := self._inside(q, near)) is not None]

    def _refusal(
        self, T: Transform, near: Joints, wanted: tuple[Configuration, ...]
    ) -> LocationOutOfRange | JointOutOfRange:
        hint = self._other_way(T, near, wanted)
        tries = [q for q in self.solutions(T) if self.configuration(q) in wanted]
        if tries:
            return self._joint_refusal(min(tries, key=lambda q: len(self._outside(q))), hint)
        return self._out_of_reach(T, wanted[0], hint) if hint else self._nowhere(T, near)

    @cached_property
    def batch(self) -> WristCircleBatch:
        from vrs_cli.kinematics.wrist_circle.batch import WristCircleBatch  # imported here because it loads numpy

        return WristCircleBatch(self.model, self.unchanging, self.chain, self.circle, self.configuration)
