"""The arm: the one object that planner and observer ask about geometry.

`RobotArm` says what an arm can do; `arm_for(model)` finds the class that fits a model's links. Everything
here works on plain floats; the `_batch` methods take arrays and import numpy when first called.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from math import degrees, hypot
from typing import TYPE_CHECKING, NamedTuple, Protocol

from vrs_cli.errors import FileDamaged, JointOutOfRange, LocationOutOfRange, LocationTooClose, LocationTooFar
from vrs_cli.kinematics import jacobian as velocity
from vrs_cli.kinematics.configuration import ALL, Arm, Configuration, Elbow, Wrist
from vrs_cli.kinematics.forward import link_frames, make_forward
from vrs_cli.kinematics.inverse import make_branch, make_branches, make_outside, make_within
from vrs_cli.kinematics.jacobian import Jacobian, Singularity, Twist
from vrs_cli.kinematics.joints import Joints, nearest_turn, turn_within
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.spherical_wrist import Geometry, configuration_of, geometry_of, wrist_centre
from vrs_cli.kinematics.transform import IDENTITY, Transform

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from vrs_cli.kinematics.arm_batch import ArmBatch

    Floats = NDArray[np.float64]
    Flags = NDArray[np.bool_]


_new = tuple.__new__


class Solution(NamedTuple):
    """One branch of the inverse: joints [rad] (None: out of reach) and those of them that are out of limits."""

    configuration: Configuration
    joints: Joints | None
    outside: tuple[int, ...]  # counted from 1, as JT1 is

    @property
    def usable(self) -> bool:
        return self.joints is not None and not self.outside


class Reach(NamedTuple):
    """Where the wrist centre can be, limits of joints left aside [m].

    Between `inner` and `outer` from the axis of joint 2, and no nearer than `axis` to the axis of joint 1.
    """

    outer: float
    inner: float
    axis: float


class RobotArm(Protocol):
    """What a robot's geometry offers. n joints; joints are tuples of n [rad]; poses are T_base_flange."""

    @property
    def model(self) -> RobotModel:
        """The data that the arm was made from."""

    def forward(self, q: Joints, /) -> Transform:
        """T_base_flange."""

    def frames(self, q: Joints) -> tuple[Transform, ...]:
        """T_base_0 (identity), T_base_1 ... T_base_flange: n + 1 frames, to draw the links."""

    def configuration(self, q: Joints) -> Configuration:
        """Which of the eight ways the joints are; on a border the first word of the pair."""

    def inverse_all(self, T: Transform) -> tuple[Solution, ...]:
        """All branches, in the order of `configuration.ALL`, each joint on the turn that suits its limits."""

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

    def jacobian(self, q: Joints, T_flange_tool: Transform = IDENTITY) -> Jacobian:
        """6 rows (vx, vy, vz, wx, wy, wz) of n, base frame [m/rad, 1]: twist of the tool = J qd."""

    def twist(self, q: Joints, qd: Joints, T_flange_tool: Transform = IDENTITY) -> Twist:
        """(vx, vy, vz, wx, wy, wz) of the tool [m/s, rad/s] in the base frame."""

    def joint_velocity(self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY) -> Joints:
        """Joint rates [rad/s] for a twist of the tool. Raises StraightLineSingular, which names the place."""

    def acceleration_bias(self, q: Joints, qd: Joints, T_flange_tool: Transform = IDENTITY) -> Twist:
        """J' qd [m/s2, rad/s2]: qdd = joint_velocity(q, acceleration - bias)."""

    def singularity(self, q: Joints) -> Singularity:
        """How far from each singularity, 0 to 1."""

    def limits_ok(self, q: Joints) -> bool:
        """Every joint inside its limits."""

    @property
    def reach(self) -> Reach:
        """Where the wrist centre can be."""

    def forward_batch(self, q: Floats) -> Floats:
        """(N, n) -> (N, 3, 4)."""

    def inverse_batch(self, T: Floats) -> tuple[Floats, Flags]:
        """(N, 3, 4) -> joints (N, 8, n), NaN where out of reach, and whether inside the limits (N, 8)."""

    def inverse_branch_batch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        """(N, 3, 4) and near (N, n) or (n,) -> (N, n): `branch_joints` by rows, NaN where out of reach."""

    def jacobian_batch(self, q: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        """(N, n) -> (N, 6, n)."""

    def joint_velocity_batch(self, q: Floats, twist: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        """(N, n) and (N, 6) -> (N, n); NaN in a row that is singular."""


class SphericalWristArm:
    """Six revolute joints, the last three meeting in one point; the formulas are those of `spherical_wrist`.

    The methods are documented in `RobotArm`.
    """

    def __init__(self, model: RobotModel, geometry: Geometry) -> None:
        self.model = model
        self.geometry = geometry
        self.forward = make_forward(geometry)
        self.branches = make_branches(geometry, model)
        self.branch_joints = make_branch(geometry)
        self._within = make_within(model)
        self._outside = make_outside(model)
        self._limits = tuple(zip(model.lower, model.upper, strict=True))
        a2, forearm, side = geometry.a2, geometry.forearm, abs(geometry.side)
        self.reach = Reach(outer=a2 + forearm, inner=abs(a2 - forearm), axis=side)

    def frames(self, q: Joints) -> tuple[Transform, ...]:
        return link_frames(self.model.links, q)

    def configuration(self, q: Joints) -> Configuration:
        return configuration_of(self.geometry, q)

    def limits_ok(self, q: Joints) -> bool:
        return not self._outside(q)

    # --- inverse -----------------------------------------------------------------------------------------

    def inverse_all(self, T: Transform) -> tuple[Solution, ...]:
        outside = self._outside
        return tuple(
            [  # a list first: a generator costs a fifth more
                _new(Solution, (configuration, q, () if q is None else outside(q)))
                for configuration, q in zip(ALL, self.branches(T), strict=True)
            ]
        )

    def inverse_branch(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        q = self.branch_joints(T, configuration, near)
        return None if q is None else self._inside(q, near)

    def _inside(self, q: Joints, near: Joints) -> Joints | None:
        """The turns of q inside the limits, each the nearest to `near`."""
        if self._within(q):
            return q
        turned: list[float] = []
        for angle, reference, (low, high) in zip(q, near, self._limits, strict=True):
            turn = turn_within(angle, reference, low, high)
            if turn is None:
                return None
            turned.append(turn)
        return tuple(turned)

    def select(
        self,
        T: Transform,
        near: Joints,
        *,
        arm: Arm | None = None,
        elbow: Elbow | None = None,
        wrist: Wrist | None = None,
    ) -> Joints:
        have = self.configuration(near)
        arm, elbow = arm or have.arm, elbow or have.elbow
        if wrist is None:
            other = Wrist.FLIP if have.wrist is Wrist.NOFLIP else Wrist.NOFLIP
            wrists: tuple[Wrist, ...] = (have.wrist, other)
        else:
            wrists = (wrist,)
        wanted = tuple(Configuration(arm, elbow, each) for each in wrists)
        found = [q for configuration in wanted if (q := self.inverse_branch(T, configuration, near)) is not None]
        if not found:
            raise self._refusal(T, near, wanted)
        return min(found, key=lambda q: self._duration(near, q))

    def _duration(self, a: Joints, b: Joints) -> float:
        """The time that the slowest joint needs at its full velocity [s]."""
        return max(abs(y - x) / v for x, y, v in zip(a, b, self.model.max_velocity, strict=True))

    def _refusal(
        self, T: Transform, near: Joints, wanted: tuple[Configuration, ...]
    ) -> LocationOutOfRange | JointOutOfRange:
        """Why none of the wanted configurations reaches T, and which other one would."""
        q = self.branch_joints(T, wanted[0], near)
        hint = self._other_way(T, near, wanted)
        if q is None:
            return self._out_of_reach(T, wanted[0], hint)
        tries = [self._best_turns(joints) for c in wanted if (joints := self.branch_joints(T, c, near)) is not None]
        q = min(tries, key=lambda joints: len(self._outside(joints)))
        joint = self._outside(q)[0]
        low, high = self._limits[joint - 1]
        span = f"{degrees(low):.2f} to {degrees(high):.2f} deg"
        detail = f"would be {degrees(q[joint - 1]):.2f} deg, its range is {span}"
        return JointOutOfRange(joint, detail, hint or "no other configuration reaches the location either")

    def _best_turns(self, q: Joints) -> Joints:
        """Each joint on the turn nearest to the middle of its range: outside only if every turn is."""
        return tuple(nearest_turn(angle, (low + high) / 2) for angle, (low, high) in zip(q, self._limits, strict=True))

    def _other_way(self, T: Transform, near: Joints, wanted: tuple[Configuration, ...]) -> str:
        """The words that bring T in reach: the fewest that do, then those of the shortest way; empty if none do."""
        ways = [
            (len(words), self._duration(near, q), words)
            for configuration, q, outside in self.inverse_all(T)
            if q is not None and not outside and (words := configuration.words_beside(wanted))
        ]
        if not ways:
            return ""
        said = " ".join(min(ways)[2])
        return f"in reach {said}; say {said} first"

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:
        """Too far or too close, in millimetres, for the arm of this configuration."""
        outward, down, across = wrist_centre(self.geometry, T, configuration)
        if across < self.reach.axis:
            return LocationTooClose(
                f"the wrist would be {1000 * across:.1f} mm from the axis of joint 1, "
                f"it cannot come nearer than {1000 * self.reach.axis:.1f} mm",
                hint or f"move the location {1000 * (self.reach.axis - across):.1f} mm away from the axis",
                self.reach.axis - across,
            )
        far = hypot(outward, down)
        where = f"the wrist would be {1000 * far:.1f} mm from the shoulder, "
        if far > self.reach.outer:
            return LocationTooFar(
                where + f"the arm reaches {1000 * self.reach.outer:.1f} mm",
                hint or f"move the location {1000 * (far - self.reach.outer):.1f} mm nearer",
                far - self.reach.outer,
            )
        return LocationTooClose(
            where + f"the folded arm comes no nearer than {1000 * self.reach.inner:.1f} mm",
            hint or f"move the location {1000 * (self.reach.inner - far):.1f} mm away",
            self.reach.inner - far,
        )

    # --- velocities --------------------------------------------------------------------------------------

    def jacobian(self, q: Joints, T_flange_tool: Transform = IDENTITY) -> Jacobian:
        return velocity.jacobian(self.geometry, q, T_flange_tool)

    def twist(self, q: Joints, qd: Joints, T_flange_tool: Transform = IDENTITY) -> Twist:
        return velocity.twist(self.geometry, q, qd, T_flange_tool)

    def joint_velocity(self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY) -> Joints:
        return velocity.joint_velocity(self.geometry, q, twist, T_flange_tool)

    def acceleration_bias(self, q: Joints, qd: Joints, T_flange_tool: Transform = IDENTITY) -> Twist:
        return velocity.acceleration_bias(self.geometry, q, qd, T_flange_tool)

    def singularity(self, q: Joints) -> Singularity:
        return velocity.singularity(self.geometry, q)

    # --- arrays ------------------------------------------------------------------------------------------

    def forward_batch(self, q: Floats) -> Floats:
        return self._batch.forward(q)

    def inverse_batch(self, T: Floats) -> tuple[Floats, Flags]:
        return self._batch.inverse(T)

    def inverse_branch_batch(self, T: Floats, configuration: Configuration, near: Floats) -> Floats:
        return self._batch.inverse_branch(T, configuration, near)

    def jacobian_batch(self, q: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        return self._batch.jacobian(q, T_flange_tool)

    def joint_velocity_batch(self, q: Floats, twist: Floats, T_flange_tool: Transform = IDENTITY) -> Floats:
        return self._batch.joint_velocity(q, twist, T_flange_tool)

    @cached_property
    def _batch(self) -> ArmBatch:
        # Here and not above: it brings numpy, which is most of the start-up time of a shell that needs no arrays.
        from vrs_cli.kinematics.arm_batch import ArmBatch

        return ArmBatch(self.geometry, self.model)


@lru_cache
def arm_for(model: RobotModel) -> RobotArm:
    """The arm of a model. Raises FileDamaged where no closed form fits its links."""
    geometry = geometry_of(model)
    if geometry is None:
        raise FileDamaged(
            f"robot {model.name}: its links are of no kind that has a closed-form inverse here",
            "six joints, alpha -90, 0, 90, -90, 90, 0 deg, and a of joints 4 to 6 and d of joint 5 zero",
        )
    return SphericalWristArm(model, geometry)
