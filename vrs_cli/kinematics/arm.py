"""Compute the kinematics of one arm: forward, inverse, velocities and limits. `forms.arm_for` makes the arm of a robot.

All methods work on plain floats; `batch` does the same on arrays and imports numpy when it is first used. A subclass
adds `branch_joints`, the inverse kinematics of one branch (one configuration, such as LEFTY ABOVE FLIP), and lists its
configurations. This module selects a branch for a motion, checks limits, makes the errors for impossible poses, and
computes velocities.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import islice
from math import dist, inf
from operator import mul
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, cast

from vrs_cli.errors import IllegalValue, JointOutOfRange, LocationOutOfRange, LocationTooFar, StraightLineSingular
from vrs_cli.kinematics.clearance import Clearance, Hand, HandPace, Unchanging, difference, find_unchanging
from vrs_cli.kinematics.compiled import Biases, Formulas, biases, comma_list, compile_function, formulas, solve
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
    """One solution of the inverse kinematics: its configuration, its joints [rad, m] (None if the pose is out of
    reach), and the numbers of the joints outside their limits.
    """

    configuration: Configuration
    joints: Joints | None
    outside: tuple[int, ...]  # joint numbers, counted from 1 (JT1)

    @property
    def usable(self) -> bool:
        return self.joints is not None and not self.outside


# a function that computes the inverse kinematics of one branch
Branch = Callable[[Transform, Configuration, Joints], Joints | None]


class Steady(Protocol):
    """The additional methods of an arm that cannot reach every orientation and turns its tool as close to the desired
    orientation as it can. Its joint rates also depend on the desired pose.
    """

    def within_ranges(self, T: Transform, near: Joints) -> Joints | None:
        """Return the joints within the limits that minimise the remaining rotation error, by a descent search from
        `near`."""

    def missing_turn(self, q: Joints, T: Transform) -> float:
        """Return the angle between the tool's orientation at joints q and its desired orientation [rad]."""

    def rates_on(
        self, q: Joints, poses: Callable[[float], Transform], twist: Twist, T_flange_tool: Transform, order: int
    ) -> tuple[Joints, ...]:
        """Return the first `order` derivatives of the joints [rad/s, rad/s2, rad/s3] along a path.

        `poses`: a function of the time from now [s] that returns the desired T_base_flange. `twist`: the twist of the
        tool on this path. Raises StraightLineSingular.
        """


class LineProof(Protocol):
    """Proves that the joints of an arm without a closed form are continuous between samples of a line.

    `sure`: if start joints are closer than this [rad, m] to the proved joints, Newton's method surely converges to
    the proved joints.
    """

    sure: float

    def prove(self, gaps: Any, pieces: int) -> Flags:
        """Return for each of k gaps (intervals between samples) whether the joints are proved to be continuous in it
        (k,). The proof divides each gap into `pieces` pieces.
        """

    def step(self, q: Floats, T: Floats, guides: tuple[Floats, Floats] | None) -> Floats:
        """Return joints (N, n) after one step of Newton's method from joints q to poses T (N, 3, 4). `guides`: the
        weights and values of the prescribed sums of joints of a redundant arm.
        """


_new = tuple.__new__


class RobotArm:
    """The geometry of a robot with n joints. Joints are tuples of n numbers [rad, m], poses are T_base_flange.

    `model.task` is the part of a pose that counts for an arm with fewer than six degrees of freedom. A pose that needs
    a motion that no joint can make is out of reach. Each arm has only one object, so the object may cache results.

    `ways`: the configurations of the arm; if it has only one, no word selects it. `lines_keep_words`: true if all poses
    between two configurations are singular; a straight line then stays in one configuration, and so does a MOVE if
    possible. `seed_step`: the maximum distance [rad, m] of `near` from a solution for which `branch_joints` surely
    finds this solution. `method`: the name of the method of inverse kinematics, shown to users.
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
    def forward(self) -> Callable[[Joints], Transform]:
        """Return a function that computes T_base_flange from joints. This is not a method, because calling a function
        stored in an attribute is faster than calling a method.
        """
        return cast(Callable[[Joints], Transform], self._formulas.forward)

    @cached_property
    def forward_and_jacobian(self) -> Callable[[Joints], tuple[Transform, Jacobian]]:
        """Return a function that computes T_base_flange and the Jacobian of the flange from joints."""
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
        """Return the configuration to which joints belong. Joints on the border between two configurations belong to
        the one with the first word of the pair (RIGHTY, ABOVE, NOFLIP).
        """
        return self.ways[0]

    def twins(self, q: Joints) -> tuple[Configuration, ...]:  # noqa: ARG002 (subclasses use q)
        """Return the other configurations (such as LEFTY for RIGHTY) to which the joints also belong if they are on the
        border between two configurations.
        """
        return ()

    def line_ways(self, q: Joints) -> tuple[Configuration, ...]:
        """Return the configuration (or two, on a border) in which a straight line may continue from these joints."""
        return (self.configuration(q), *self.twins(q)) if self.lines_keep_words else (NONE,)

    @property
    def all_line_ways(self) -> tuple[Configuration, ...]:
        """Return all configurations in which the arm can follow a straight line."""
        return self.ways if self.lines_keep_words else (NONE,)

    @cached_property
    def limits_ok(self) -> Callable[[Joints], bool]:
        """Return a function that checks whether every joint is inside its limits."""
        tests = [f"{low!r} <= q{i} <= {high!r}" for i, (low, high) in enumerate(self._nearly_limits)]
        lines = [f"{comma_list(f'q{i}' for i in range(len(tests)))} = q", f"return {' and '.join(tests)}"]
        return compile_function("limits_ok(q)", lines, {"inf": inf})

    def _outside(self, q: Joints) -> tuple[int, ...]:
        return joints_outside(q, self.model.lower, self.model.upper)

    @cached_property
    def words(self) -> tuple[Flag, ...]:
        """Return the configuration words (RIGHTY, LEFTY, ABOVE, ...) that this arm distinguishes."""
        parts = zip(*(way.flags for way in self.ways), strict=True)
        return tuple(dict.fromkeys(flag for part in parts for flag in part if flag is not None))

    # --- inverse -----------------------------------------------------------------------------------------

    @property
    def constants(self) -> Mapping[str, float]:
        """Return the constants of the closed-form solution, lengths [m] and angles [rad], by their symbols; empty for
        an arm without a closed form.
        """
        return {}

    # sign and offset [rad] of each joint: joint value of the robot = sign * (theta - offset), with theta of the closed
    # form; empty if the robot's joints are the thetas
    senses: tuple[tuple[float, float], ...] = ()

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        """Return the joints that reach T in one configuration, ignoring the limits; whole turns are added to each joint
        to bring it nearest to `near`.

        If the wrist is singular, joint 4 keeps the value it has in `near`. Returns None if the pose is out of reach.
        """
        raise NotImplementedError

    def branch_steps(self, T: Transform, configuration: Configuration, near: Joints) -> Steps:  # noqa: ARG002 (FormulaArm uses it)
        """Return the intermediate variables of `branch_joints`; empty for an arm without a closed form."""
        return {}

    redundancy = 0  # number of redundant joints, and of guides (prescribed sums of joints) on a straight line
    # indexes of the redundant joints that keep their values if no guide prescribes them
    still_joints: tuple[int, ...] = ()

    def guided_joints(self, T: Transform, near: Joints, demands: Demands) -> Joints | None:
        """Return the joints near `near` that reach T and meet the demands (prescribed sums of joints), ignoring the
        limits; only redundant arms have this method.
        """
        raise NotImplementedError

    guesses = False  # whether `guided_state` can replace the search if `near` is a good guess of the joints

    def guided_state(
        self,
        T: Transform,  # noqa: ARG002 (NumericArm uses it)
        near: Joints,  # noqa: ARG002
        demands: Demands,  # noqa: ARG002
        twist: Twist,  # noqa: ARG002
        rates: Sequence[float],  # noqa: ARG002
    ) -> tuple[Joints, Joints] | None:
        """Solve one system of equations for the joints of `guided_joints` and their rates, and return both; None if the
        solution does not converge near `near`.

        `twist`: the twist of the flange [m/s, rad/s]. `rates`: the rates of the sums in `demands`.
        """
        return None

    def walks(self, begin: Joints, poses: Sequence[Transform], asked: Asked) -> Iterator[Walk]:
        """Yield walks (sequences of small steps) of a redundant arm from the joints `begin` through poses of the
        flange, inside the joint ranges. The best walk comes first.
        """
        raise NotImplementedError

    def shortest_walk(self, begin: Joints, poses: Sequence[Transform], asked: Asked) -> Walk:
        """Return the walk (small steps) from `begin` through the poses that has the shortest joint motion, ignoring the
        joint ranges.
        """
        raise NotImplementedError

    def branches(self, T: Transform) -> tuple[Joints | None, ...]:
        """Return the joints of each configuration in the order of `ways`, without checking limits; None if the pose is
        out of reach in this configuration.
        """
        middle = self.middle
        found = (self.branch_joints(T, way, middle) for way in self.ways)
        return tuple([None if q is None else self._best_turns(q) for q in found])

    def beyond(self, T: Transform) -> bool:  # noqa: ARG002 (subclasses use T)
        """Check quickly whether T_base_flange is farther away than the stretched arm reaches. If the result is False,
        the pose may still be out of reach.
        """
        return False

    @cached_property
    def length(self) -> float:
        """Return the distance [m] that the flange would have from the axis of joint 1 if all links were in one line."""
        return levers(self.model)[1][0]

    @cached_property
    def middle(self) -> Joints:
        return tuple((low + high) / 2 for low, high in self._limits)

    def inverse_all(self, T: Transform) -> tuple[Solution, ...]:
        """Return all solutions in the order of `ways`. Whole turns are added to each joint to bring it inside its
        limits if possible.
        """
        outside = self._outside
        return tuple(
            [  # a list, because a generator would take 20 % more time
                _new(Solution, (way, q, () if q is None else outside(q)))
                for way, q in zip(self.ways, self.branches(T), strict=True)
            ]
        )

    def inverse_branch(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:
        """Return the joints that reach T in one configuration, inside their limits and nearest to `near` among their
        whole turns; None if there are none.
        """
        q = self.branch_joints(T, configuration, near)
        return None if q is None else self._inside(q, near)

    def _inside(self, q: Joints, near: Joints) -> Joints | None:
        """Return q with whole turns added that bring each joint inside its limits, and as near to `near` as possible;
        None if a joint cannot be brought inside.
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

        The result has the configuration words in `asked`. If `asked` has no word for arm or elbow, the arm keeps the
        word it has at `near`. If `asked` has no word for the wrist, the arm takes the wrist configuration that it
        reaches sooner (see `shortest_time`).

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
        """Return the time [s] to move from joints a to joints b if each joint moves at its maximum velocity: the time
        of the joint that takes longest.
        """
        return max(abs(y - x) / v for x, y, v in zip(a, b, self.model.max_velocity, strict=True))

    # --- errors ----------------------------------------------------------------------------------------

    def _refusal(
        self, T: Transform, near: Joints, wanted: tuple[Configuration, ...]
    ) -> LocationOutOfRange | JointOutOfRange:
        """Return the error to raise if no wanted configuration reaches T. Its hint names another configuration that
        does, if there is one.
        """
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
        """Return q with whole turns added that bring each joint nearest to the middle of its range. A joint is then
        outside its limits only if no whole turn brings it inside.
        """
        rows = zip(q, self.middle, self.turning, strict=True)
        return tuple(nearest_turn(x, middle) if turns else x for x, middle, turns in rows)

    def _other_way(self, T: Transform, near: Joints, wanted: tuple[Configuration, ...]) -> str:
        """Return a hint that names the words of another configuration that reaches T; it is empty if no configuration
        does.

        The hint has as few words as possible. If several configurations need equally few, it names the one with the
        shortest motion.
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
        """Return the error for a pose out of reach. If the pose is too far away, the error contains its distance in
        millimetres.
        """
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
        return find_unchanging(self.model, self.forward)

    def check_task(
        self, T: Transform, T_robot_world: Transform = IDENTITY, T_flange_tool: Transform = IDENTITY
    ) -> None:
        """Check that the joints can make the motions that a pose needs (a SCARA, for example, cannot tilt its tool).
        Raises LocationOutOfRange.

        The error gives the nearest reachable values of the location as the user entered it: T_world_tool =
        T_robot_world^-1 T T_flange_tool.
        """
        if (forbidden := self.unchanging.forbids(T)) is not None:
            asked, instead = (compose(inverse(T_robot_world), compose(P, T_flange_tool)) for P in (T, forbidden.right))
            raise LocationOutOfRange(f"this robot {forbidden.what}", f"give {difference(asked, instead)} instead")

    def check_tool(self, T_flange_tool: Transform) -> None:
        """Check that the tip of this tool stays in place if the flange turns in a way that does not count for the task.
        Raises IllegalValue.
        """
        free = [not counts for counts in self.model.counts[3:]]
        x, y, z = position(T_flange_tool)
        levers = ((y, z), (z, x), (x, y))  # coordinates of the tip perpendicular to the axes X, Y and Z
        steady = self.unchanging.approach is not None  # if true, the flange can only turn about its approach (Z) axis
        for axis, (loose, lever) in enumerate(zip(free, levers, strict=True)):
            if loose and (axis == 2 or not steady) and max(map(abs, lever)) > LEVEL:
                raise IllegalValue(
                    f"a tool {1000 * max(map(abs, lever)):.1f} mm beside an axis whose turn this robot does not choose",
                    "make the last link of the robot file as long as link and tool",
                )

    # --- clearances (distances from unreachable and singular poses)
    # --------------------------------------------------------------------------------------

    # the point and direction fixed to the flange whose clearances are computed; None for an arm without a closed form
    hand: Hand | None = None
    # poses with smaller clearances count as on the boundary of the reach, or as having a straight wrist
    boundary = Clearance()

    def clearance(self, T: Transform, configuration: Configuration) -> Clearance:  # noqa: ARG002 (closed forms use it)
        """Return the clearances of a pose: how far it is from the poses where the closed form of this configuration is
        singular or has no solution.
        """
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
        """Return lower bounds of all clearances on a path between two poses with clearances a and b. `h`: the length of
        the path's parameter interval. `pace`: bounds of the derivatives of the hand's motion by this parameter.

        `beside_axis`: whether the wrist is as near to axis 1 as it can be on the whole path.
        """
        return Clearance()

    # index of the joint that folds the arm, and a value of it at which the arm is straight or folded flat [rad]
    fold: tuple[int, float] | None = None

    def outward(self, q: Joints) -> float:  # noqa: ARG002 (subclasses use q)
        """Return the signed distance of the arm's end from axis 1 in the plane of the arm [m]; it is negative for
        RIGHTY.

        The result is infinite for arms whose configurations do not depend on this distance.
        """
        return inf

    # proves that joints are continuous between samples of a line; None for a closed form, which needs no proof
    continuation: LineProof | None = None

    # the arm itself if its joint rates depend on the desired pose; else None
    steady: Steady | None = None

    def for_tool(self, T_flange_tool: Transform) -> RobotArm:  # noqa: ARG002 (some subclasses use it)
        """Return an arm that solves for positions of the tip of this tool. Most arms do not depend on the tool and
        return themselves.
        """
        return self

    # --- velocities --------------------------------------------------------------------------------------

    def jacobian(self, q: Joints, T_flange_tool: Transform = IDENTITY) -> Jacobian:
        """Return the Jacobian J of the tool in the base frame [m/rad, 1]: six rows (vx, vy, vz, wx, wy, wz) of n
        numbers, with twist = J qd.
        """
        return cast(Jacobian, self._formulas.jacobian(q, T_flange_tool[3], T_flange_tool[7], T_flange_tool[11]))

    def twist(self, q: Joints, qd: Joints, T_flange_tool: Transform = IDENTITY) -> Twist:
        """Return the twist (vx, vy, vz, wx, wy, wz) of the tool in the base frame [m/s, rad/s] for joint rates qd."""
        rows = self.jacobian(q, T_flange_tool)
        vx, vy, vz, wx, wy, wz = [sum(map(mul, row, qd)) for row in rows]
        return vx, vy, vz, wx, wy, wz

    def joint_velocity(
        self, q: Joints, twist: Twist, T_flange_tool: Transform = IDENTITY, demands: Demands = ()
    ) -> Joints:
        """Return the joint rates [rad/s] that give the tool the twist `twist`. Raises StraightLineSingular with the
        name of the singularity.

        `demands` (redundant arms): weighted sums of the joint rates, each given by its weights and its required value.
        """
        return self._rates(q, self.jacobian(q, T_flange_tool), twist, demands)

    def _rates(self, q: Joints, J: Jacobian, twist: Twist, demands: Demands) -> Joints:  # noqa: ARG002 (NumericArm uses it)
        """Solve the Jacobian for joint rates that give the tool the twist `twist`, and return them. If `twist` is the
        result of `beyond`, the solution is a higher derivative of the joints.
        """
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
        """Return the rows of J, and the components of the twist, that count for the task. Rotations are converted from
        the axes of the base to those of the flange.
        """
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
        """Return the time derivative of J times qd [m/s2, rad/s2]: the acceleration of the tool while the joint rates
        are constant.
        """
        return self._biases.acceleration(q, qd, T_flange_tool[3], T_flange_tool[7], T_flange_tool[11])

    def joint_acceleration(
        self, q: Joints, qd: Joints, rate: Twist, T_flange_tool: Transform = IDENTITY, demands: Demands = ()
    ) -> Joints:
        """Return the joint accelerations [rad/s2] that, at joint rates qd, give the tool the acceleration `rate` [m/s2,
        rad/s2].

        Raises StraightLineSingular.
        """
        if any(qd):  # joints at rest have a bias of zero
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
        """Return the joint jerks [rad/s3] that, at joint rates qd and accelerations qdd, give the tool the jerk `rate`
        [m/s3, rad/s3].

        Raises StraightLineSingular.
        """
        bias = self._biases.jerk(q, qd, qdd, T_flange_tool[3], T_flange_tool[7], T_flange_tool[11])
        return self.joint_velocity(q, beyond(rate, bias), T_flange_tool, demands)

    def singularity(self, q: Joints) -> Singularity:
        """Return the distance of joints from each singularity, from 0 to 1.

        For an arm without a closed form, it is unknown which joints are singular; `elbow` is then the `freedom` at q
        divided by the mean freedom, at most 1.
        """
        mean = self._mean_freedom
        return Singularity(1.0, min(self.freedom(q) / mean, 1.0) if mean else 1.0, 1.0)

    @cached_property
    def _mean_freedom(self) -> float:
        return sum(map(self.freedom, islice(some_joints(self.model), MEASURED))) / MEASURED

    def freedom(self, q: Joints) -> float:
        """Return how well the joints move the tool: 0 in a singular pose. Only arms without a closed form have this
        method.
        """
        raise NotImplementedError

    # --- arrays ------------------------------------------------------------------------------------------

    @cached_property
    def batch(self) -> SerialBatch:
        """Return an object with the same functions over arrays of joints and poses, for whole timelines at once."""
        raise NotImplementedError


def _within(x: float, low: float, high: float) -> float | None:
    """Return the value of a sliding joint if it is inside its limits, else None. A value that exceeds a limit only by
    rounding (LIMIT_TOLERANCE) becomes the limit.
    """
    return min(max(x, low), high) if low - LIMIT_TOLERANCE <= x <= high + LIMIT_TOLERANCE else None


class FormulaArm(RobotArm):
    """An arm with a closed-form inverse.

    `formula`: the function of inverse kinematics in one configuration; it requires poses that `unchanging` allows.
    `step_names`: the variables of the formula that `render/symbols.py` shows to users.
    """

    formula: Branch
    step_names: tuple[str, ...]

    def branch_steps(self, T: Transform, configuration: Configuration, near: Joints) -> Steps:
        from vrs_cli.kinematics.formula import steps_of  # imported here because only EXPLAIN shows steps

        return steps_of(self.formula, self.step_names, T, configuration, near) if self.unchanging.allows(T) else {}

    @cached_property
    def batch(self) -> SerialBatch:
        # imported here because it loads numpy, which would take longer than the rest of the start-up of a shell
        from vrs_cli.kinematics.formula import over_arrays
        from vrs_cli.kinematics.serial_batch import SerialBatch

        return SerialBatch(self.model, self.ways, self.unchanging, over_arrays(self.formula))
