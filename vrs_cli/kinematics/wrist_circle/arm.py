"""The arm of six joints whose wrist is not one point: `circle` says which, and how all its solutions are found."""

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

REMEMBERED = 64  # poses whose solutions are


class WristCircleArm(NumericArm):
    """Documented in `arm.RobotArm`. `swapped`: as in `mapped_arm.MappedArm`.

    A line goes on from joint to joint as that of any arm without a closed form, through whatever words.
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
        """Of the solutions with these words one inside the limits, and the nearest to the middle of the ranges."""
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
        """What is asked for is kept strictly; the nearest of all others is taken."""
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
        from vrs_cli.kinematics.wrist_circle.batch import WristCircleBatch  # here: it brings numpy

        return WristCircleBatch(self.model, self.unchanging, self.chain, self.circle, self.configuration)
