"""Compute the kinematics of one arm: forward, inverse, velocities and limits. `forms.arm_for` makes the arm of a robot.

All methods work on plain floats; `batch` does the same on arrays and imports numpy when it is first used. A subclass
adds `branch_joints`, the inverse of one branch, and names its branches. This module selects a branch for a motion,
checks limits, makes the errors of impossible poses, and computes velocities.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import islice
from math import dist, inf
from operator import mul
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, cast

from vrs_cli.errors import IllegalValue, JointOutOfRange, LocationOutOfRange, LocationTooFar, StraightLineSingular
from vrs_cli.kinematics.clearance import Clearance, Hand, HandPace, Unchanging, difference, unchanging
from vrs_cli.kinematics.compiled import Biases, Formulas, biases, comma_list, formulas, solve, written
from vrs_cli.kinematics.joints import (
    LIMIT_TOLERANCE,
    NONE,
    Asked,
    Configuration,
    Demands,
    Flag,
    Jacobian,
    JointKind,
    Joints,
    Singularity,
    Steps,
    Twist,
    Walk,
    beyond,
    joints_outside,
    nearest_turn,
    turn_within,
)
from vrs_cli.kinematics.model import LEVEL, MEASURED, RobotModel, levers, link_frames, some_joints
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, inverse, position

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Flags, Floats
    from vrs_cli.kinematics.serial_batch import SerialBatch


class Solution(NamedTuple):
    """One branch of the inverse: its joints [rad, m], or None if the pose is out of reach, and the numbers of the
    joints outside their limits."""

    configuration: Configuration
    joints: Joints | None
    outside: tuple[int, ...]  # joint numbers, counted from 1 (JT1)

    @property
    def usable(self) -> bool:
        return self.joints is not None and not self.outside


Branch = Callable[[Transform, Configuration, Joints], Joints | None]  # the inverse of one branch


class Steady(Protocol):
    """The methods of an arm that turns its tool as close to the desired orientation as it can. Its joint rates also
    depend on the desired pose.
    """

    def within_ranges(self, T: Transform, near: Joints) -> Joints | None:
        """Return the joints within the limits that minimise the remaining rotation error, by a descent search from
        `near`."""

    def missing_turn(self, q: Joints, T: Transform) -> float:
        """Return the angle between the tool's turn and the desired turn [rad]."""

    def rates_on(
        self, q: Joints, poses: Callable[[float], Transform], twist: Twist, T_flange_tool: Transform, order: int
    ) -> tuple[Joints, ...]:
        """Return the first `order` derivatives of the joints [rad/s, rad/s2, rad/s3] along a path.

        `poses`: a function of the time from now [s] that returns the desired T_base_flange. `twist`: the twist of the
        tool on this path. Raises StraightLineSingular.
        """


class LineProof(Protocol):
    """Proves that the joints of an arm without a closed form are continuous between samples of a line.

    `sure`: the maximum distance [rad, m] from start joints to the proved joints for which Newton's method finds them.
    """

    sure: float

    def prove(self, gaps: Any, pieces: int) -> Flags:
        """Return whether the joints are proved continuous in each of k gaps between samples (k,). Each gap is divided
        into `pieces` pieces."""

    def step(self, q: Floats, T: Floats, guides: tuple[Floats, Floats] | None) -> Floats:
        """Return joints (N, n) after one step of Newton's method to poses (N, 3, 4)."""


_new = tuple.__new__


class RobotArm:
    """The geometry of a robot with n joints. Joints are tuples of n numbers [rad, m], poses are T_base_flange.

    `model.task` says which part of a pose counts for an arm with fewer than six freedoms. A pose is out of reach if it
    needs a motion that no joint can make. Each arm has one object, so the object may cache results.

    `ways`: the configurations; a single configuration without words if the arm has no choice. `lines_keep_words`:
    whether poses between two configurations are singular, so that a straight line stays in one configuration, and a
    MOVE too if it can. `seed_step`: the maximum change of the joints [rad, m] for which `branch_joints` finds the same
    branch. `method`: the method of the inverse in a few words, for the user.
    """

    ways: tuple[Configuration, ...] = (NONE,)
    lines_keep_words = True
    seed_step = 1.0
    method = "closed form"

    def __init__(self, model: RobotModel) -> None:
        self.model = model
        self._limits = tuple(zip(model.lower, model.upper, strict=True))
        self._nearly_limits = tuple([(low - LIMIT_TOLERANCE, high + LIMIT_TOLERANCE) for low, high in self._limits])
        self.turning = tuple(link.kind is JointKind.REVOLUTE for link in model.links)

    @cached_property
    def forward(self) -> Callable[[Joints], Transform]:  # a stored function, because it is called often
        """Return T_base_flange of joints."""
        return cast(Callable[[Joints], Transform], self._formulas.forward)

    @cached_property
    def forward_and_jacobian(self) -> Callable[[Joints], tuple[Transform, Jacobian]]:
        """Return T_base_flange and the Jacobian of the flange."""
        return cast(Callable[[Joints], tuple[Transform, Jacobian]], self._formulas.both)

    @cached_property
    def _formulas(self) -> Formulas:
        return formulas(self.model.links, self.model.base, self.model.flange)

    @cached_property
    def _biases(self) -> Biases:
        return biases(self.model.links, self.model.base, self.model.flange)

    def frames(self, q: Joints) -> tuple[Transform, ...]:
        """Return T_base_0, T_base_1 ... T_base_flange: n + 1 frames, for drawing the links."""
        return link_frames(self.model, q)

    def configuration(self, q: Joints) -> Configuration:  # noqa: ARG002 (subclasses use q)
        """Return the configuration of joints; on the border of two configurations, the one with the first word of the
        pair.
        """
        return self.ways[0]

    def twins(self, q: Joints) -> tuple[Configuration, ...]:  # noqa: ARG002 (subclasses use q)
        """Return the other configurations of joints that are on a border."""
        return ()

    def line_ways(self, q: Joints) -> tuple[Configuration, ...]:
        """Return the one or two configurations in which a straight line may continue from these joints."""
        return (self.configuration(q), *self.twins(q)) if self.lines_keep_words else (NONE,)

    @property
    def all_line_ways(self) -> tuple[Configuration, ...]:
        """Return all configurations that a straight line may have."""
        return self.ways if self.lines_keep_words else (NONE,)

    @cached_property
    def limits_ok(self) -> Callable[[Joints], bool]:
        """Return a function that returns whether every joint is inside its limits."""
        tests = [f"{low!r} <= q{i} <= {high!r}" for i, (low, high) in enumerate(self._nearly_limits)]
        lines = [f"{comma_list(f'q{i}' for i in range(len(tests)))} = q", f"return {' and '.join(tests)}"]
        return written("limits_ok(q)", lines, {"inf": inf})

    def _outside(self, q: Joints) -> tuple[int, ...]:
        return joints_outside(q, self.model.lower, self.model.upper)

    @cached_property
    def words(self) -> tuple[Flag, ...]:
        """Return the configuration words that this arm distinguishes."""
        parts = zip(*(way.flags for way in self.ways), strict=True)
        return tuple(dict.fromkeys(flag for part in parts for flag in part if flag is not None))

    # --- inverse -----------------------------------------------------------------------------------------

    @property
    def constants(self) -> Mapping[str, float]:
        """Return the constants of the closed form, lengths [m] and angles [rad], by symbol; empty for an arm without a
        closed form.
        """
        return {}

    # sign and offset [rad] of each joint: the robot's joint is sign (theta - offset) of the closed form's theta; empty
    # if both are the same
    senses: tuple[tuple[float, float], ...] = ()

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        """Return the joints of one branch of the inverse, each on the turn nearest to `near`, ignoring the limits.

        None if the pose is out of reach. At a singular wrist joint 4 keeps its value in `near`.
        """
        raise NotImplementedError

    def branch_steps(self, T: Transform, configuration: Configuration, near: Joints) -> Steps:  # noqa: ARG002 (FormulaArm uses it)
        """Return the intermediate variables of `branch_joints`; empty without a closed form."""
        return {}

    redundancy = 0  # number of redundant joints, which is also the number of guides of a straight line
    still_joints: tuple[int, ...] = ()  # indexes of redundant joints that keep their values without a guide

    def guided_joints(self, T: Transform, near: Joints, demands: Demands) -> Joints | None:
        """Return the joints near `near` that reach T and meet the demands, ignoring the limits (redundant arms)."""
        raise NotImplementedError

    guesses = False  # whether a good guess of the joints saves a search (`guided_state`)

    def guided_state(
        self,
        T: Transform,  # noqa: ARG002 (NumericArm uses it)
        near: Joints,  # noqa: ARG002
        demands: Demands,  # noqa: ARG002
        twist: Twist,  # noqa: ARG002
        rates: Sequence[float],  # noqa: ARG002
    ) -> tuple[Joints, Joints] | None:
        """Return `guided_joints` and their rates from one system of equations; None if the solution does not converge
        near `near`.

        `twist`: the twist of the flange. `rates`: the rates of the demanded sums.
        """
        return None

    def walks(self, begin: Joints, poses: Sequence[Transform], asked: Asked) -> Iterator[Walk]:
        """Yield walks of a redundant arm from `begin` through poses of the flange, inside the joint ranges. The best
        walk comes first.
        """
        raise NotImplementedError

    def shortest_walk(self, begin: Joints, poses: Sequence[Transform], asked: Asked) -> Walk:
        """Return the walk with the shortest joint motion, ignoring the joint ranges."""
        raise NotImplementedError

    def branches(self, T: Transform) -> tuple[Joints | None, ...]:
        """Return the joints of each solution of `inverse_all`, without checking limits."""
        middle = self.middle
        found = (self.branch_joints(T, way, middle) for way in self.ways)
        return tuple([None if q is None else self._best_turns(q) for q in found])

    def beyond(self, T: Transform) -> bool:  # noqa: ARG002 (subclasses use T)
        """Return True if a quick check shows that T_base_flange is farther away than the stretched arm reaches."""
        return False

    @cached_property
    def length(self) -> float:
        """Return the distance [m] of the flange from the axis of joint 1 if all links were in one line."""
        return levers(self.model)[1][0]

    @cached_property
    def middle(self) -> Joints:
        return tuple((low + high) / 2 for low, high in self._limits)

    def inverse_all(self, T: Transform) -> tuple[Solution, ...]:
        """Return all solutions in the order of `ways`, each joint on a turn inside its limits if there is one."""
        outside = self._outside
        return tuple(
            [  # a list, because a generator takes a fifth more time
                _new(Solution, (way, q, () if q is None else outside(q)))
                for way, q in zip(self.ways, self.branches(T), strict=True)
            ]
        )

    def inverse_branch(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        """Return the joints of one branch, each on the turn inside its limits that is nearest to `near`; None if the
        branch has no such joints.
        """
        q = self.branch_joints(T, configuration, near)
        return None if q is None else self._inside(q, near)

    def _inside(self, q: Joints, near: Joints) -> Joints | None:
        """Return q with each joint on the turn inside its limits that is nearest to `near`; None if a joint has no such
        turn.
        """
        turned: list[float] = []
        for x, reference, (low, high), turns in zip(q, near, self._limits, self.turning, strict=True):
            turn = turn_within(x, reference, low, high) if turns else _within(x, low, high)
            if turn is None:
                return None
            turned.append(turn)
        return tuple(turned)

    def select(self, T: Transform, near: Joints, asked: Configuration = NONE) -> Joints:
        """Return the joints that a MOVE from `near` goes to.

        The result has the words in `asked`. If `asked` has no word for arm or elbow, the word of `near` holds. If it
        has no word for the wrist, the arm takes the wrist that it reaches sooner (the slowest joint at its full
        velocity decides).

        Raises LocationTooFar, LocationTooClose or JointOutOfRange; the error names a configuration that would work, if
        there is one.
        """
        self.check_task(T)
        have = self.configuration(near)
        asked = Configuration.of(asked.arm or have.arm, asked.elbow or have.elbow, asked.wrist)
        suited = [way for way in self.ways if way.has(asked)]
        wanted = tuple(sorted(suited, key=lambda way: way.wrist is not have.wrist))
        found = [q for way in wanted if (q := self.inverse_branch(T, way, near)) is not None]
        if not found:
            raise self._refusal(T, near, wanted)
        return min(found, key=lambda q: self.shortest_time(near, q))

    def shortest_time(self, a: Joints, b: Joints) -> float:
        """Return the time that the slowest joint needs from a to b at its full velocity [s]."""
        return max(abs(y - x) / v for x, y, v in zip(a, b, self.model.max_velocity, strict=True))

    # --- errors ----------------------------------------------------------------------------------------

    def _refusal(
        self, T: Transform, near: Joints, wanted: tuple[Configuration, ...]
    ) -> LocationOutOfRange | JointOutOfRange:
        """Return the error if no wanted configuration reaches T, with a hint to another configuration that does."""
        hint = self._other_way(T, near, wanted)
        if self.branch_joints(T, wanted[0], near) is None:
            return self._out_of_reach(T, wanted[0], hint)
        tries = [self._best_turns(q) for way in wanted if (q := self.branch_joints(T, way, near)) is not None]
        return self._joint_refusal(min(tries, key=lambda q: len(self._outside(q))), hint)

    def _joint_refusal(self, q: Joints, hint: str) -> JointOutOfRange:
        joint = self._outside(q)[0]
        no_other = "no other configuration reaches the location either" if len(self.ways) > 1 else ""
        return self.model.refuse_joint(joint, q[joint - 1], hint or no_other)

    def _best_turns(self, q: Joints) -> Joints:
        """Return each joint on the turn nearest to the middle of its range. A joint is outside its limits only if all
        its turns are.
        """
        rows = zip(q, self.middle, self.turning, strict=True)
        return tuple(nearest_turn(x, middle) if turns else x for x, middle, turns in rows)

    def _other_way(self, T: Transform, near: Joints, wanted: tuple[Configuration, ...]) -> str:
        """Return a hint with the words of a configuration that reaches T; empty if none does.

        The hint has as few words as possible; among these, the words of the shortest motion.
        """
        ways = [
            (len(words), self.shortest_time(near, q), words)
            for configuration, q, outside in self.inverse_all(T)
            if q is not None and not outside and (words := configuration.words_beside(wanted))
        ]
        if not ways:
            return ""
        said = " ".join(min(ways)[2])
        return f"in reach {said}; say {said} first"

    def _out_of_reach(self, T: Transform, configuration: Configuration, hint: str) -> LocationOutOfRange:  # noqa: ARG002
        """Return the error for a pose out of reach, with the distance in millimetres if the pose is too far away."""
        start, (most, *_) = levers(self.model)
        far = dist(position(T), start)
        if far > most:
            return LocationTooFar(
                f"the flange would be {1000 * far:.1f} mm from the axis of joint 1, "
                f"all links in one line are {1000 * most:.1f} mm",
                hint or f"move the location at least {1000 * (far - most):.1f} mm nearer",
                value=far,
                upper=most,
            )
        return LocationOutOfRange("no joints bring the flange there", hint or "turn the location, or move it nearer")

    # --- the part of a pose that counts --------------------------------------------------------------------

    @cached_property
    def unchanging(self) -> Unchanging:
        return unchanging(self.model, self.forward)

    def check_task(
        self, T: Transform, T_robot_world: Transform = IDENTITY, T_flange_tool: Transform = IDENTITY
    ) -> None:
        """Raise LocationOutOfRange if a pose needs a motion that the joints cannot make, such as a tilt of a SCARA's
        tool.

        The error names the nearest allowed values of the user's location, T_world_tool = T_robot_world^-1 T
        T_flange_tool.
        """
        if (forbidden := self.unchanging.forbids(T)) is not None:
            asked, instead = (compose(inverse(T_robot_world), compose(P, T_flange_tool)) for P in (T, forbidden.right))
            raise LocationOutOfRange(f"this robot {forbidden.what}", f"give {difference(asked, instead)} instead")

    def check_tool(self, T_flange_tool: Transform) -> None:
        """Raise IllegalValue if a turn of the flange that does not count for the task moves the tip of this tool."""
        free = [not counts for counts in self.model.counts[3:]]
        x, y, z = position(T_flange_tool)
        levers = ((y, z), (z, x), (x, y))  # distances of the tip from the axes X, Y and Z
        steady = self.unchanging.approach is not None  # if true, only turns about the approach axis are possible
        for axis, (loose, lever) in enumerate(zip(free, levers, strict=True)):
            if loose and (axis == 2 or not steady) and max(map(abs, lever)) > LEVEL:
                raise IllegalValue(
                    f"a tool {1000 * max(map(abs, lever)):.1f} mm beside an axis whose turn this robot does not choose",
                    "make the last link of the robot file as long as link and tool",
                )

    # --- clearances --------------------------------------------------------------------------------------

    hand: Hand | None = None  # the point that clearances follow; None without a closed form
    boundary = Clearance()  # a pose with a smaller clearance counts as on a boundary, or its wrist as straight

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:  # noqa: ARG002 (closed forms use it)
        """Return the distances of a pose from the poses where the closed form of one branch ends or is singular."""
        return Clearance()

    def least_clearance(
        self,
        a: Clearance,  # noqa: ARG002 (closed forms use it)
        b: Clearance,  # noqa: ARG002
        pace: HandPace,  # noqa: ARG002
        h: float,  # noqa: ARG002
        *,
        beside_axis: bool = False,  # noqa: ARG002
    ) -> Clearance:
        """Return a lower bound of the clearances between two poses, for a path of length h with the bounds `pace`.

        `beside_axis`: the whole path is on the shoulder's boundary.
        """
        return Clearance()

    # the joint (by index) that folds the arm, and its value where the arm is straight or folded flat [rad]
    fold: tuple[int, float] | None = None

    def outward(self, q: Joints) -> float:  # noqa: ARG002 (subclasses use q)
        """Return the distance of the arm's end from axis 1 in the arm's plane [m], negative for RIGHTY.

        Infinite for arms whose configurations do not depend on it.
        """
        return inf

    # the proof that joints are continuous between samples of a line; None for closed forms
    continuation: LineProof | None = None

    # the arm itself if its joint rates depend on the desired pose; else None
    steady: Steady | None = None

    def holding(self, T_flange_tool: Transform) -> RobotArm:  # noqa: ARG002 (some subclasses use it)
        """Return the arm for a tool: an arm that brings the tip of this tool to a position; for most arms this
        object."""
        return self

    # --- velocities --------------------------------------------------------------------------------------

    def jacobian(self, q: Joints, T_flange_tool: Transform = IDENTITY) -> Jacobian:
        """Return 6 rows (vx, vy, vz, wx, wy, wz) of n in the base frame [m/rad, 1]: twist of the tool = J qd."""
        return cast(Jacobian, self._formulas.jacobian(q, T_flange_tool[3], T_flange_tool[7], T_flange_tool[11]))

    def twist(self, q: Joints, qd: Joints, T_flange_tool: Transform = IDENTITY) -> Twist:
        """Return the twist (vx, vy, vz, wx, wy, wz) of the tool in the base frame [m/s, rad/s]."""
        rows = self.jacobian(q, T_flange_tool)
        vx, vy, vz, wx, wy, wz = [sum(map(mul, row, qd)) for row in rows]
        return vx, vy, vz, wx, wy, wz

    def joint_velocity(
        self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY, demands: Demands = ()
    ) -> Joints:
        """Return joint rates [rad/s] for a twist of the tool. Raises StraightLineSingular with the name of the
        singularity.

        `demands`: rates of sums of the joints of a redundant arm.
        """
        return self._rates(q, self.jacobian(q, T_flange_tool), twist, demands)

    def _rates(self, q: Joints, J: Jacobian, twist: Twist, demands: Demands) -> Joints:  # noqa: ARG002 (NumericArm uses it)
        """Return joint rates for a twist of the tool, or higher derivatives of the joints for the result of
        `beyond`."""
        return self._solve_rates(q, *self.rows_that_count(q, J, twist))

    def _solve_rates(self, q: Joints, rows: Sequence[Sequence[float]], wanted: Sequence[float]) -> Joints:
        qd = solve(rows, wanted)
        if qd is None:
            raise self._cannot_move_so(q)
        return qd

    def _cannot_move_so(self, q: Joints) -> StraightLineSingular:
        return StraightLineSingular(
            f"{self.singularity(q).nearest}: the joints cannot move the tool that way there",
            "take another path, or go there by MOVE",
        )

    def rows_that_count(self, q: Joints, J: Sequence[Joints], twist: Twist) -> tuple[list[Joints], list[float]]:
        """Return the rows of J and of the twist that count for the task; turns are about the axes of the flange."""
        counts = self.model.counts
        if all(counts):
            return list(J), list(twist)
        T = self.forward(q)
        axes = ((T.nx, T.ny, T.nz), (T.sx, T.sy, T.sz), (T.ax, T.ay, T.az))
        rows = [row for row, counted in zip(J[:3], counts, strict=False) if counted]
        wanted = [v for v, counted in zip(twist[:3], counts, strict=False) if counted]
        for (x, y, z), counted in zip(axes, counts[3:], strict=True):
            if counted:
                rows.append(tuple([x * a + y * b + z * c for a, b, c in zip(*J[3:], strict=True)]))
                wanted.append(x * twist[3] + y * twist[4] + z * twist[5])
        return rows, wanted

    def acceleration_bias(self, q: Joints, qd: Joints, T_flange_tool: Transform = IDENTITY) -> Twist:
        """Return J' qd [m/s2, rad/s2]: the acceleration of the tool at constant joint rates."""
        return self._biases.acceleration(q, qd, T_flange_tool[3], T_flange_tool[7], T_flange_tool[11])

    def joint_acceleration(
        self, q: Joints, qd: Joints, rate: Twist, T_flange_tool: Transform = IDENTITY, demands: Demands = ()
    ) -> Joints:
        """Return joint accelerations [rad/s2] at joint rates qd for an acceleration of the tool [m/s2, rad/s2].

        Raises StraightLineSingular.
        """
        if any(qd):  # joints at rest have no bias
            rate = beyond(rate, self.acceleration_bias(q, qd, T_flange_tool))
        return self.joint_velocity(q, rate, T_flange_tool, demands)

    def joint_jerk(
        self,
        q: Joints,
        qd: Joints,
        qdd: Joints,
        rate: Twist,
        T_flange_tool: Transform = IDENTITY,
        demands: Demands = (),
    ) -> Joints:
        """Return joint jerks [rad/s3] at joint rates qd and accelerations qdd for a jerk of the tool [m/s3, rad/s3].

        Raises StraightLineSingular.
        """
        bias = self._biases.jerk(q, qd, qdd, T_flange_tool[3], T_flange_tool[7], T_flange_tool[11])
        return self.joint_velocity(q, beyond(rate, bias), T_flange_tool, demands)

    def singularity(self, q: Joints) -> Singularity:
        """Return the distance of joints from each singularity, from 0 to 1.

        For an arm without a closed form `elbow` is its freedom divided by the mean freedom; the singular joints are
        unknown.
        """
        mean = self._mean_freedom
        return Singularity(1.0, min(self.freedom(q) / mean, 1.0) if mean else 1.0, 1.0)

    @cached_property
    def _mean_freedom(self) -> float:
        return sum(map(self.freedom, islice(some_joints(self.model), MEASURED))) / MEASURED

    def freedom(self, q: Joints) -> float:
        """Return how well the joints move the tool, for an arm without a closed form."""
        raise NotImplementedError

    # --- arrays ------------------------------------------------------------------------------------------

    @cached_property
    def batch(self) -> SerialBatch:
        """Return the same functions over arrays, for whole timelines at once."""
        raise NotImplementedError


def _within(x: float, low: float, high: float) -> float | None:
    """Return a sliding joint inside its limits, or None. Values beyond a limit by rounding alone are accepted."""
    return min(max(x, low), high) if low - LIMIT_TOLERANCE <= x <= high + LIMIT_TOLERANCE else None
