"""The arm: the one object that planner and observer ask about geometry.

`RobotArm` says what an arm can do; `arm_for(model)` finds the class that fits a model's axes: a closed form where
there is one, else the numerical one. Everything here works on plain floats; the `_batch` methods take arrays and
import numpy when first called.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

from vrs_cli.kinematics.clearance import Clearance, Hand, Pace
from vrs_cli.kinematics.configuration import Arm, Configuration, Elbow, Flag, Wrist
from vrs_cli.kinematics.jacobian import Jacobian, Singularity, Twist
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.serial_arm import Solution
from vrs_cli.kinematics.transform import IDENTITY, Transform

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from vrs_cli.kinematics.numeric.continuation import Continuation

    Floats = NDArray[np.float64]
    Flags = NDArray[np.bool_]


class RobotArm(Protocol):
    """What a robot's geometry offers. n joints; joints are tuples of n [rad, m]; poses are T_base_flange.

    Of an arm that cannot do all six freedoms `model.task` says which part of a pose counts; the rest of a pose is what
    the arm makes of it. Where a pose asks for what no joint changes, it is out of reach.
    """

    def __hash__(self) -> int:
        """An arm is one object: what is found for it may be remembered by it."""

    @property
    def model(self) -> RobotModel:
        """The data that the arm was made from."""

    @property
    def method(self) -> str:
        """How the inverse is found, in a few words for the user."""

    def forward(self, q: Joints, /) -> Transform:
        """T_base_flange."""

    def frames(self, q: Joints) -> tuple[Transform, ...]:
        """T_base_0, T_base_1 ... T_base_flange: n + 1 frames, to draw the links."""

    @property
    def ways(self) -> tuple[Configuration, ...]:
        """The configurations that there are; one without words where there is nothing to choose."""

    @property
    def words(self) -> tuple[Flag, ...]:
        """The configuration words that mean something to this arm."""

    @property
    def seed_step(self) -> float:
        """How far [rad, m] joints may be from `near` for `branch_joints` to find the same branch."""

    def configuration(self, q: Joints) -> Configuration:
        """Which of the ways the joints are; on a border the first word of the pair."""

    def twins(self, q: Joints) -> tuple[Configuration, ...]:
        """The other configurations that the joints are in as well, on a border."""

    def check_task(
        self, T: Transform, T_robot_world: Transform = IDENTITY, T_flange_tool: Transform = IDENTITY
    ) -> None:
        """Raises LocationOutOfRange for a pose that asks for what no joint changes, as a tilt of a SCARA's tool.

        The refusal says what would be right of the location that was given, T_world_tool = T_robot_world^-1 T
        T_flange_tool.
        """

    def check_tool(self, T_flange_tool: Transform) -> None:
        """Raises IllegalValue for a tool whose tip a turn would move that does not count."""

    def inverse_all(self, T: Transform) -> tuple[Solution, ...]:
        """All branches, in the order of `ways`, each joint on the turn that suits its limits."""

    def branches(self, T: Transform, /) -> tuple[Joints | None, ...]:
        """The joints of `inverse_all`, and nothing else: the fast form."""

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints, /) -> Joints | None:
        """One branch, every joint on the turn nearest to `near`, whatever its limits: for straight lines.

        None where the location is out of reach. At a singular wrist joint 4 stays as `near` has it.
        """

    def inverse_branch(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        """One branch, every joint on the turn nearest to `near` inside its limits; None if there is none."""

    def select(
        self,
        T: Transform,
        near: Joints,
        *,
        arm: Arm | None = None,
        elbow: Elbow | None = None,
        wrist: Wrist | None = None,
    ) -> Joints:
        """The joints that a MOVE from `near` goes to.

        What is given is kept strictly. What is not: arm and elbow stay as `near` has them, and of the two
        wrists the one that is reached sooner (the slowest joint at its full velocity decides) is taken, of
        those inside the limits. Raises LocationTooFar, LocationTooClose or JointOutOfRange, with the
        configuration that would do, if one would.
        """

    @property
    def hand(self) -> Hand | None:
        """What the clearances follow; None where there is no closed form, and they are not known."""

    @property
    def boundary(self) -> Clearance:
        """The clearances within which a pose is on the boundary of the reach, or its wrist straight."""

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:
        """How far a pose is from where the closed form of one branch ends, or is singular."""

    def least_clearance(self, a: Clearance, b: Clearance, pace: Pace, h: float) -> Clearance:
        """A lower bound of the clearances between two poses that are h apart, on a way of that pace."""

    @property
    def continuation(self) -> Continuation | None:
        """What proves that joints go on between samples of a way; None for closed forms, and for too few joints."""

    def jacobian(self, q: Joints, T_flange_tool: Transform = IDENTITY) -> Jacobian:
        """6 rows (vx, vy, vz, wx, wy, wz) of n, base frame [m/rad, 1]: twist of the tool = J qd."""

    def twist(self, q: Joints, qd: Joints, T_flange_tool: Transform = IDENTITY) -> Twist:
        """(vx, vy, vz, wx, wy, wz) of the tool [m/s, rad/s] in the base frame."""

    def joint_velocity(self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY) -> Joints:
        """Joint rates [rad/s] for a twist of the tool. Raises StraightLineSingular, which names the place."""

    def acceleration_bias(self, q: Joints, qd: Joints, T_flange_tool: Transform = IDENTITY) -> Twist:
        """J' qd [m/s2, rad/s2]: the acceleration of the tool while the joint rates stay the same."""

    def joint_acceleration(self, q: Joints, qd: Joints, rate: Twist, T_flange_tool: Transform = IDENTITY) -> Joints:
        """Joint accelerations [rad/s2] at joint rates qd, for the acceleration of a tool [m/s2, rad/s2].

        Raises StraightLineSingular.
        """

    def joint_jerk(
        self, q: Joints, qd: Joints, qdd: Joints, rate: Twist, T_flange_tool: Transform = IDENTITY
    ) -> Joints:
        """Joint jerks [rad/s3] at joint rates qd and accelerations qdd, for the jerk of a tool [m/s3, rad/s3].

        Raises StraightLineSingular.
        """

    def singularity(self, q: Joints) -> Singularity:
        """How far from each singularity, 0 to 1."""

    def limits_ok(self, q: Joints) -> bool:
        """Every joint inside its limits."""

    def forward_batch(self, q: Floats) -> Floats:
        """(N, n) -> (N, 3, 4)."""

    def inverse_batch(self, T: Floats) -> tuple[Floats, Flags]:
        """(N, 3, 4) -> joints (N, k, n) of the k ways, NaN where out of reach, and whether inside the limits (N, k)."""

    def inverse_branch_batch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        """(N, 3, 4) and near (N, n) or (n,) -> (N, n): `branch_joints` by rows, NaN where out of reach."""

    def jacobian_batch(self, q: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        """(N, n) -> (N, 6, n)."""


@lru_cache
def arm_for(model: RobotModel) -> RobotArm:
    """The arm of a model: of the first closed form that knows its axes; the numerical one knows all."""
    return next(arm for form in _FORMS if (arm := form(model)) is not None)


# A form is imported when a robot may be of it: most are of the first.


def _spherical_wrist(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.spherical_wrist.arm import SphericalWristArm
    from vrs_cli.kinematics.spherical_wrist.geometry import ALPHAS, geometry_of

    geometry = geometry_of(model)
    if geometry is not None:
        return SphericalWristArm(model, geometry)
    from vrs_cli.kinematics.mapped_arm import MappedArm, canonical

    way = canonical(model, ALPHAS[:5])
    geometry = None if way is None else geometry_of(way.model)
    if way is None or geometry is None:
        return None
    return MappedArm(model, way, SphericalWristArm(way.model, geometry))


def _offset_wrist(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.mapped_arm import MappedArm, canonical
    from vrs_cli.kinematics.offset_wrist.arm import OffsetWristArm
    from vrs_cli.kinematics.offset_wrist.offsets import ALPHAS, offsets_of

    way = canonical(model, ALPHAS)
    offsets = None if way is None else offsets_of(way.model)
    return None if way is None or offsets is None else MappedArm(model, way, OffsetWristArm(way.model, offsets))


def _parallel_axes(model: RobotModel) -> RobotArm | None:
    from vrs_cli.kinematics.parallel_axes.arm import ParallelAxesArm
    from vrs_cli.kinematics.parallel_axes.bars import bars_of

    bars = bars_of(model)
    return None if bars is None else ParallelAxesArm(model, bars)


def _numeric(model: RobotModel) -> RobotArm:
    from vrs_cli.kinematics.numeric.arm import NumericArm

    return NumericArm(model)


_FORMS: tuple[Callable[[RobotModel], RobotArm | None], ...] = (
    _spherical_wrist,
    _offset_wrist,
    _parallel_axes,
    _numeric,
)
