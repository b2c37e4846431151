"""A robot that is, under other names of directions, zeros and frames, an arm that a closed form knows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.errors import LocationOutOfRange
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.axes import EXACT, Chain, chain_of
from vrs_cli.kinematics.clearance import Clearance, Hand, Pace
from vrs_cli.kinematics.configuration import ALL, ARM, Configuration
from vrs_cli.kinematics.jacobian import Demands, Singularity, Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, joint_axes, link_frames
from vrs_cli.kinematics.task import Task
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, inverse, rotate

if TYPE_CHECKING:
    from vrs_cli.kinematics.serial_batch import SerialBatch

TOOLS = 4  # whose place behind the inner arm is remembered


class Canonical(NamedTuple):
    """A robot's chain with the links of a closed form, and the model that it solves, limits included.

    All of a pose counts for it, whatever counts for the robot.
    """

    chain: Chain
    model: RobotModel

    @property
    def down(self) -> bool:
        """Whether the axis of joint 1 points down: what is above for the closed form is below for the robot."""
        return self.chain.base.az < -EXACT

    @property
    def hand(self) -> float:
        """1.0 where the flange lies on axis 6 as the axis points, from the wrist, or points so; else -1.0."""
        flange = self.chain.flange
        return -1.0 if flange.pz < -EXACT or (abs(flange.pz) <= EXACT and flange.az < 0.0) else 1.0


def canonical(model: RobotModel, alphas: Sequence[float | None]) -> Canonical | None:
    """The way to an arm of turning joints with these alphas; None where the axes of the robot do not lie so."""
    if model.joint_count != len(alphas) + 1 or any(map(model.units.slides, range(1, model.joint_count + 1))):
        return None
    T_base_flange = link_frames(model, (0.0,) * model.joint_count)[-1]
    chain = chain_of(joint_axes(model), model.units.kinds, T_base_flange, alphas)
    if chain is None:
        return None
    ends = zip(chain.of(model.lower), chain.of(model.upper), strict=True)
    lower, upper = zip(*((min(pair), max(pair)) for pair in ends), strict=True)
    links = tuple(link._replace(theta=0.0) for link in chain.links)
    inner = replace(model, links=links, base=IDENTITY, flange=IDENTITY, lower=lower, upper=upper, task=Task.POSE)
    return Canonical(chain, inner)


class MappedArm(RobotArm):
    """Asks the arm that the closed form solves; documented in `arm.RobotArm`. `swapped`: the words whose pair the
    formulas have the other way round, as bits of a configuration's `index`.
    """

    def __init__(self, model: RobotModel, way: Canonical, inner: RobotArm, swapped: int) -> None:
        super().__init__(model)
        self.way, self.inner, self.ways, self._swapped = way, inner, inner.ways, swapped
        self.method = inner.method
        if inner.fold is not None:
            joint, value = inner.fold
            self.fold = joint, way.chain.signs[joint] * (value - way.chain.links[joint].theta)
        self.to_inner, self.from_flange = inverse(way.chain.base), inverse(way.chain.flange)
        self._turns = tuple([(s, link.theta) for s, link in zip(way.chain.signs, way.chain.links, strict=True)])
        self._inner_tool = lru_cache(TOOLS)(partial(compose, way.chain.flange))

    def _inner_joints(self, q: Joints) -> Joints:
        """`Chain.of`, of joints that all turn."""
        return tuple([s * x + theta for x, (s, theta) in zip(q, self._turns, strict=True)])

    def _back(self, q: Joints) -> Joints:
        return tuple([s * (x - theta) for x, (s, theta) in zip(q, self._turns, strict=True)])

    def _inner_pose(self, T: Transform) -> Transform:
        """The pose of the flange as the inner arm has it."""
        return compose(compose(self.to_inner, T), self.from_flange)

    def _other(self, configuration: Configuration) -> Configuration:
        """What the formulas call it, and back."""
        return ALL[configuration.index ^ self._swapped]

    def configuration(self, q: Joints) -> Configuration:
        return self._other(self.inner.configuration(self._inner_joints(q)))

    def outward(self, q: Joints) -> float:
        out = self.inner.outward(self._inner_joints(q))
        return -out if self._swapped & ARM else out

    def twins(self, q: Joints) -> tuple[Configuration, ...]:
        return tuple(map(self._other, self.inner.twins(self._inner_joints(q))))

    def branches(self, T: Transform) -> tuple[Joints | None, ...]:
        back, found, swapped = self._back, self.inner.branches(self._inner_pose(T)), self._swapped
        return tuple([None if (q := found[i ^ swapped]) is None else back(q) for i in range(len(found))])

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        q = self.inner.branch_joints(self._inner_pose(T), self._other(configuration), self._inner_joints(near))
        return None if q is None else self._back(q)

    @cached_property
    def hand(self) -> Hand | None:  # type: ignore[override] # found when asked for
        hand = self.inner.hand
        if hand is None:
            return None
        x, y, z = rotate(self.from_flange, hand.centre)
        centre = x + self.from_flange.px, y + self.from_flange.py, z + self.from_flange.pz
        return Hand(compose(hand.T_axis_base, self.to_inner), centre, rotate(self.from_flange, hand.approach))

    @property
    def boundary(self) -> Clearance:  # type: ignore[override]
        return self.inner.boundary

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:
        return self.inner.clearance(self._inner_pose(T), self._other(configuration))

    def least_clearance(self, a: Clearance, b: Clearance, pace: Pace, h: float) -> Clearance:
        return self.inner.least_clearance(a, b, pace, h)

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:
        return self.inner._out_of_reach(self._inner_pose(T), self._other(configuration), hint)

    def joint_velocity(
        self,
        q: Joints,
        twist: Twist,
        T_flange_tool: Transform = IDENTITY,
        demands: Demands = (),  # noqa: ARG002 (no joint is too many)
    ) -> Joints:
        seen = *rotate(self.to_inner, twist[:3]), *rotate(self.to_inner, twist[3:])
        rates = self.inner.joint_velocity(self._inner_joints(q), seen, self._inner_tool(T_flange_tool))
        return tuple([s * rate for s, rate in zip(self.way.chain.signs, rates, strict=True)])

    def singularity(self, q: Joints) -> Singularity:
        return self.inner.singularity(self._inner_joints(q))

    @cached_property
    def _batch(self) -> SerialBatch:
        from vrs_cli.kinematics.mapped_batch import MappedBatch  # here: it brings numpy

        return MappedBatch(self.model, self.unchanging, self.way.chain, self.inner._batch, self._swapped)
