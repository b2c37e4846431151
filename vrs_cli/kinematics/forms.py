"""Choose the class of arm that can solve a robot's axes (`arm_for`), and map the joints of robots to the links of a
closed form.

The first choice is a closed-form solution, then a search that finds all solutions, then a numerical search that works
with any axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache, partial
from math import atan2
from typing import TYPE_CHECKING

from msgspec import Struct, structs

from vrs_cli.errors import LocationOutOfRange
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.clearance import Clearance, Hand, HandPace
from vrs_cli.kinematics.compiled import NOTHING
from vrs_cli.kinematics.joints import ALL, ARM, Configuration, Demands, Joints, Singularity, Steps, Twist
from vrs_cli.kinematics.model import EXACT, ArmTask, Chain, RobotModel, chain_of, joint_axes, link_frames
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, inverse, rotate

if TYPE_CHECKING:
    from vrs_cli.kinematics.serial_batch import SerialBatch


@lru_cache
def arm_for(model: RobotModel) -> RobotArm:
    """Return the arm of a model: an arm with the first closed form that fits its axes, else a numerical arm."""
    closed = _spherical_wrist(model) or _offset_wrist(model) or _wrist_circle(model) or _parallel_axes(model)
    closed = closed or _spherical_shoulder(model)
    if closed is not None:
        return closed
    if model.task is ArmTask.STEADY:
        from vrs_cli.kinematics.numeric.steady.arm import SteadyArm

        return SteadyArm(model)
    from vrs_cli.kinematics.numeric.arm import NumericArm

    return NumericArm(model)


# The module of a closed form is imported only when its function below is called: most robots fit the first one.


def _spherical_wrist(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.spherical_wrist.arm import SphericalWristArm
    from vrs_cli.kinematics.spherical_wrist.inverse import ALPHAS, geometry_of, swapped_words

    geometry = geometry_of(model)
    if geometry is not None and not swapped_words(geometry, down=False, folded=geometry.d4 * geometry.d6 < 0.0):
        return SphericalWristArm(model, geometry)

    way = canonical(model, ALPHAS[:5])
    geometry = None if way is None else geometry_of(way.model)
    if way is None or geometry is None:
        return None
    words = swapped_words(geometry, down=way.down, folded=geometry.d4 * way.hand < 0.0)
    return MappedArm(model, way, SphericalWristArm(way.model, geometry), words)


def _offset_wrist(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.joints import ARM, ELBOW, WRIST
    from vrs_cli.kinematics.offset_wrist.arm import ALPHAS, OffsetWristArm, offsets_of

    way = canonical(model, ALPHAS)
    offsets = None if way is None else offsets_of(way.model)
    if way is None or offsets is None:
        return None
    words = (ARM | ELBOW) * way.down + WRIST * (offsets.right * way.hand < 0.0)
    return MappedArm(model, way, OffsetWristArm(way.model, offsets), words)


def _wrist_circle(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.spherical_wrist.inverse import CIRCLE_ALPHAS, circle_of, swapped_words
    from vrs_cli.kinematics.wrist_circle.arm import WristCircleArm

    way = canonical(model, CIRCLE_ALPHAS, bare=False)
    circle = None if way is None else circle_of(way.model)
    if way is None or circle is None:
        return None
    words = swapped_words(circle.arm, down=way.down, folded=circle.straight * circle.arm.d4 * way.hand < 0.0)
    return WristCircleArm(model, way.chain, circle, words)


def _parallel_axes(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.parallel_axes.arm import ParallelAxesArm, bars_of

    bars = bars_of(model)
    return None if bars is None else ParallelAxesArm(model, bars)


def _spherical_shoulder(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.spherical_shoulder.arm import ALPHAS, SphericalShoulderArm, has_spherical_shoulder

    way = canonical(model, ALPHAS) if model.task is ArmTask.POSE else None
    if way is None or not way.chain.base == way.chain.flange == IDENTITY or not has_spherical_shoulder(way.chain.links):
        return None
    return SphericalShoulderArm(model, way.chain.links)


TOOLS = 4  # size of the cache of tool poses, each relative to the flange of the wrapped arm


class Canonical(Struct, frozen=True):
    """A robot whose axes fit a closed form. `chain`: its kinematics expressed with the links of the closed form.
    `model`: the robot with these links, and with the limits converted to them.

    The whole pose counts for this model, even if only a part of a pose counts for the robot.
    """

    chain: Chain
    model: RobotModel

    @property
    def down(self) -> bool:
        """Return whether the axis of joint 1 points down, so that ABOVE and BELOW are swapped."""
        return self.chain.base.az < -EXACT

    @property
    def hand(self) -> float:
        """Return 1.0 if the flange is on the positive side of the wrist on axis 6, or is at the wrist and its Z axis
        points to this side; else -1.0.
        """
        flange = self.chain.flange
        way = self.chain.links[-1].d + flange.pz
        return -1.0 if way < -EXACT or (abs(way) <= EXACT and flange.az < 0.0) else 1.0


def canonical(model: RobotModel, alphas: Sequence[float | None], *, bare: bool = True) -> Canonical | None:
    """Express the robot as a chain of revolute joints whose links have these twist angles alpha. Return None if the
    robot's axes have another arrangement.

    `bare`: if the transform of the base or the flange is only a rotation about the first or last axis, or a shift along
    it, include it in the first or last link.
    """
    if model.joint_count != len(alphas) + 1 or any(map(model.units.slides, range(1, model.joint_count + 1))):
        return None
    T_base_flange = link_frames(model, (0.0,) * model.joint_count)[-1]
    chain = chain_of(joint_axes(model), model.units.kinds, T_base_flange, alphas)
    if chain is None:
        return None
    base, (first, *others, last), flange = chain.base, chain.links, chain.flange
    if bare and _along_axis(base):
        first = structs.replace(first, theta=first.theta + atan2(base.ny, base.nx), d=first.d + base.pz)
        base = IDENTITY
    if bare and _along_axis(flange):
        last = structs.replace(last, theta=last.theta + atan2(flange.ny, flange.nx), d=last.d + flange.pz)
        flange = IDENTITY
    chain = Chain(base, (first, *others, last), flange, chain.signs)
    ends = zip(chain.of(model.lower), chain.of(model.upper), strict=True)
    lower, upper = zip(*((min(pair), max(pair)) for pair in ends), strict=True)
    links = tuple(structs.replace(link, theta=0.0) for link in chain.links)
    inner = structs.replace(
        model, links=links, base=IDENTITY, flange=IDENTITY, lower=lower, upper=upper, task=ArmTask.POSE
    )
    return Canonical(chain, inner)


def _along_axis(T: Transform) -> bool:
    """Return whether T maps the z axis onto itself, with the same direction."""
    return T.az > 0.0 and max(map(abs, (T.px, T.py, T.ax, T.ay, T.nz, T.sz))) <= NOTHING


class MappedArm(RobotArm):
    """An arm that converts its joints and poses for an inner arm, which has the links of a closed form. The methods are
    those of `arm.RobotArm`.

    `swapped`: the word pairs (of arm, elbow and wrist, such as LEFTY and RIGHTY) for which the inner arm has the
    opposite word, as bits of `Configuration.index`.
    """

    def __init__(self, model: RobotModel, way: Canonical, inner: RobotArm, swapped: int) -> None:
        super().__init__(model)
        self.way, self.inner, self.ways, self._swapped = way, inner, inner.ways, swapped
        self.method, self.boundary = inner.method, inner.boundary
        if inner.fold is not None:
            joint, value = inner.fold
            self.fold = joint, way.chain.signs[joint] * (value - way.chain.links[joint].theta)
        self.to_inner, self.from_flange = inverse(way.chain.base), inverse(way.chain.flange)
        self._bare = way.chain.base == way.chain.flange == IDENTITY
        self._same_senses = all(sign > 0.0 for sign in way.chain.signs)
        zeros = tuple([link.theta for link in way.chain.links])
        self.senses = tuple(zip(way.chain.signs, zeros, strict=True))
        self._order = tuple([i ^ swapped for i in range(len(self.ways))])
        self._inner_tool = lru_cache(TOOLS)(partial(compose, way.chain.flange))
        s1, s2, s3, s4, s5, s6 = way.chain.signs
        z1, z2, z3, z4, z5, z6 = zeros

        # the same as `Chain.of` (and `back` is its inverse), written without loops for speed
        def inner_joints(q: Joints) -> Joints:
            q1, q2, q3, q4, q5, q6 = q
            return s1 * q1 + z1, s2 * q2 + z2, s3 * q3 + z3, s4 * q4 + z4, s5 * q5 + z5, s6 * q6 + z6

        def back(q: Joints) -> Joints:
            q1, q2, q3, q4, q5, q6 = q
            return s1 * (q1 - z1), s2 * (q2 - z2), s3 * (q3 - z3), s4 * (q4 - z4), s5 * (q5 - z5), s6 * (q6 - z6)

        self._inner_joints, self._back = inner_joints, back

    @property
    def constants(self) -> Mapping[str, float]:
        return self.inner.constants

    def _inner_pose(self, T: Transform) -> Transform:
        """Convert a pose T_base_flange of the robot to the pose of the inner arm's flange in its own base."""
        return T if self._bare else compose(compose(self.to_inner, T), self.from_flange)

    def _other(self, configuration: Configuration) -> Configuration:
        """Return the inner arm's configuration for a configuration of the robot, or the reverse."""
        return ALL[configuration.index ^ self._swapped]

    def configuration(self, q: Joints) -> Configuration:
        return self._other(self.inner.configuration(self._inner_joints(q)))

    def outward(self, q: Joints) -> float:
        out = self.inner.outward(self._inner_joints(q))
        return -out if self._swapped & ARM else out

    def twins(self, q: Joints) -> tuple[Configuration, ...]:
        return tuple(map(self._other, self.inner.twins(self._inner_joints(q))))

    def branches(self, T: Transform) -> tuple[Joints | None, ...]:
        back, found = self._back, self.inner.branches(self._inner_pose(T))
        return tuple([None if (q := found[i]) is None else back(q) for i in self._order])

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        q = self.inner.branch_joints(self._inner_pose(T), self._other(configuration), self._inner_joints(near))
        return None if q is None else self._back(q)

    def branch_steps(self, T: Transform, configuration: Configuration, near: Joints) -> Steps:
        return self.inner.branch_steps(self._inner_pose(T), self._other(configuration), self._inner_joints(near))

    @cached_property
    def hand(self) -> Hand | None:  # type: ignore[override] # computed on demand
        hand = self.inner.hand
        if hand is None:
            return None
        x, y, z = rotate(self.from_flange, hand.centre)
        centre = x + self.from_flange.px, y + self.from_flange.py, z + self.from_flange.pz
        return Hand(compose(hand.T_axis_base, self.to_inner), centre, rotate(self.from_flange, hand.approach))

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:
        return self.inner.clearance(self._inner_pose(T), self._other(configuration))

    def least_clearance(
        self, a: Clearance, b: Clearance, pace: HandPace, h: float, *, beside_axis: bool = False
    ) -> Clearance:
        return self.inner.least_clearance(a, b, pace, h, beside_axis=beside_axis)

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:
        return self.inner._out_of_reach(self._inner_pose(T), self._other(configuration), hint)

    def joint_velocity(
        self,
        q: Joints,
        twist: Twist,
        T_flange_tool: Transform = IDENTITY,
        demands: Demands = (),  # noqa: ARG002 (no redundant joints)
    ) -> Joints:
        if not self._bare:
            twist = *rotate(self.to_inner, twist[:3]), *rotate(self.to_inner, twist[3:])
            T_flange_tool = self._inner_tool(T_flange_tool)
        rates = self.inner.joint_velocity(self._inner_joints(q), twist, T_flange_tool)
        if self._same_senses:
            return rates
        return tuple([s * rate for s, rate in zip(self.way.chain.signs, rates, strict=True)])

    def singularity(self, q: Joints) -> Singularity:
        return self.inner.singularity(self._inner_joints(q))

    @cached_property
    def batch(self) -> SerialBatch:
        from vrs_cli.kinematics.serial_batch import MappedBatch  # imported here because it loads numpy

        return MappedBatch(self.model, self.unchanging, self.way.chain, self.inner.batch, self._swapped)
