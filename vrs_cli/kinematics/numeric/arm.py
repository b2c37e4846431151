"""Solve arms with any arrangement of axes by a numerical search (`numeric.search`).

A redundant arm can follow a straight line with infinitely many joint motions, so guides select one of them. A guide is
a weighted sum of all joints; it goes from its value at the start to its value at the end by the motion law of the line
(`segment.Guide`). There is one guide for each redundant joint. So the joints are an exact function of time, without
integration. This is the augmented task of Sciavicco and Siciliano ("A solution algorithm to the inverse kinematic
problem for redundant manipulators", IEEE J. Robotics and Automation 4(4), 1988) with a constant linear task.

Weights and end values are found by a walk: small steps along the line with the pseudo-inverse (the shortest joint
motion), plus, in the null space, a weighted gradient that pulls joints towards the middle of their ranges (Liegeois,
"Automatic supervisory control of the configuration and behavior of multibody mechanisms", IEEE Trans. Systems, Man and
Cybernetics 7(12), 1977). The weights are the mean direction of the null space during the walk, the direction in which
joints can move most freely; the end values are the weighted sums at the end of the walk. If the first walk leaves a
joint range, walks with other weights of the gradient are tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, cached_property, partial
from itertools import islice
from math import degrees, dist, hypot, inf
from operator import add, mul
from typing import TYPE_CHECKING

from vrs_cli.errors import JointOutOfRange, LocationOutOfRange, LocationTooFar
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.compiled import comma_list, compile_function, gram, solve_damped, squares, volume
from vrs_cli.kinematics.joints import MAX_RATE_ERROR, NONE, Asked, Configuration, Demands, Jacobian, Joints, Twist, Walk
from vrs_cli.kinematics.model import LEVEL, MEASURED, STRAIGHT, ArmTask, RobotModel, levers, some_joints
from vrs_cli.kinematics.numeric import search
from vrs_cli.kinematics.numeric.search import newton
from vrs_cli.kinematics.transform import Transform, position

if TYPE_CHECKING:
    from vrs_cli.kinematics.numeric.batch import Continuation, NumericBatch


# weights of the gradient that pulls joints towards the middle of their ranges, in the order in which walks try them;
# each walk distributes its weight evenly over its steps
PARTS = (0.0, 0.5, 1.0, 2.0, 4.0)
# fraction of a joint's range: a joint path (walk) that stays at least this far from every joint limit is accepted
# immediately
MIN_MARGIN = 0.03
ROUNDING = 1e-9  # allowed rounding error of a margin, as a fraction of a range
# fraction of a joint's range: a walk may exceed a joint limit by this much, because its coarse steps are not the exact
# line
BEYOND = 0.02
# [rad] rotation errors that differ by less count as equal; the arm then takes the joints that it reaches sooner
SAME_TURN = 1e-5
THERE = 0.01  # [m, rad] a walk counts as successful if its error at the last pose is smaller
WALK_DAMPING = 1e-9  # [m2, rad2] damping of the pseudo-inverse at singular joints
SHORTEST = 1e-6  # minimum length of a direction to divide by
ANOTHER_TASK = f"teach the location by HERE, or give the arm the task {ArmTask.STEADY.value!r}"


class NumericArm(RobotArm):
    """An arm with any arrangement of axes, solved numerically. It has one configuration, which no word (RIGHTY, ABOVE
    ...) selects. The methods are those of `arm.RobotArm`.
    """

    seed_step = 0.1
    method = "damped least squares within the limits"

    def __init__(self, model: RobotModel) -> None:
        super().__init__(model)
        self._all = tuple(range(model.joint_count))
        self.short = (
            model.joint_count < model.task.size
        )  # true if the arm has fewer joints than its task needs: most poses are then out of reach
        self.redundancy = max(0, model.joint_count - model.task.size)
        # other arms may end a line in a singular pose, where `guided_state` could converge to wrong joints
        self.guesses = self.redundancy > 0

    # --- redundancy ------------------------------------------------------------------------------------------

    @cached_property
    def still_joints(self) -> tuple[int, ...]:  # type: ignore[override] # computed on demand
        """Return the indexes of the redundant joints that keep their values if no guide prescribes them: the joints
        without which the others move the flange best.
        """
        held: tuple[int, ...] = ()
        while self.model.joint_count - len(held) > self.model.task.size:
            rest = [i for i in self._all if i not in held]
            held += (max(rest, key=lambda i: self._freedom([k for k in rest if k != i])),)
        return held

    def _still(self, q: Joints) -> Demands:
        """Return the demands that keep `still_joints` at their values in q."""
        return tuple([(tuple([float(i == k) for k in self._all]), q[i]) for i in self.still_joints])

    def freedom(self, q: Joints) -> float:
        return self._freedom_at(q, self._all)

    def _freedom(self, joints: Sequence[int]) -> float:
        """Return how well these joints alone move the flange: Yoshikawa's manipulability, summed over sample poses."""
        return sum([self._freedom_at(q, joints) for q in islice(some_joints(self.model), MEASURED)])

    def _freedom_at(self, q: Joints, joints: Sequence[int]) -> float:
        """Return how well these joints move the flange at q (Yoshikawa's manipulability). If there are fewer joints
        than the task needs, only the directions in which they can move the flange count.
        """
        rows, _ = self.rows_that_count(q, self.jacobian(q), search.NO_TWIST)
        if joints != self._all:
            rows = [tuple(row[i] for i in joints) for row in rows]
        return volume(list(zip(*rows, strict=True)) if self.short else rows)

    def _rates(self, q: Joints, J: Jacobian, twist: Twist, demands: Demands) -> Joints:
        rows, wanted = self.rows_that_count(q, J, twist)
        for weights, rate in demands or self._still((0.0,) * len(q)):
            rows.append(weights)
            wanted.append(rate)
        if self.short:
            columns = list(zip(*rows, strict=True))
            wanted = [sum([a * v for a, v in zip(column, wanted, strict=True)]) for column in columns]
            return self._solve_rates(q, gram(columns), wanted)
        return self._solve_rates(q, rows, wanted)

    # --- inverse ---------------------------------------------------------------------------------------------

    def branch_joints(self, T: Transform, configuration: Configuration, near: Joints) -> Joints | None:  # noqa: ARG002
        return self.guided_joints(T, near, self._still(near))

    def guided_joints(self, T: Transform, near: Joints, demands: Demands) -> Joints | None:
        # of all methods, this one leads from a stored seed to the joints that the planner has checked
        at_once = NumericArm.guided_state(self, T, near, demands, search.NO_TWIST, (0.0,) * len(demands))
        return at_once[0] if at_once else self._search(T, near, demands, bounded=False)[0]

    def guided_state(
        self, T: Transform, near: Joints, demands: Demands, twist: Twist, rates: Sequence[float]
    ) -> tuple[Joints, Joints] | None:
        q, before = near, search.LAST
        if self.short or len(demands) != self.redundancy or not self.unchanging.allows(T):
            return None
        for _ in range(search.FEW):
            found = self._newton(q, T, demands, twist, rates)
            if found is None:
                return None
            step, qd = found
            largest = max(map(abs, step))
            if largest > search.SHORT:
                return None
            q = tuple(map(add, q, step))
            shrunk = (
                largest / before
                # relative size of the next step, and relative error of the rates, if Newton's method converges
                # quadratically
            ) ** 2
            if shrunk < MAX_RATE_ERROR and shrunk * largest < search.CONVERGED:
                return q, qd
            before = largest
        return None

    @cached_property
    def _newton(self) -> search.Newton:
        model = self.model
        return newton(model.links, model.base, model.flange) if all(model.counts) else self._newton_of_parts

    def _newton_of_parts(
        self, q: Joints, T: Transform, demands: Demands, twist: Twist, rates: Sequence[float]
    ) -> tuple[Joints, Joints] | None:
        """Return one Newton step and the joint rates, for a task that leaves parts of a pose free. (`search.newton`
        generates the function for whole poses.)
        """
        rows, error = self.missing(q, T)
        _, wanted = self.rows_that_count(q, (), twist)
        error += [value - sum(map(mul, weights, q)) for weights, value in demands]
        found = squares((*rows, *[weights for weights, _ in demands]), error, (*wanted, *rates))
        return None if found is None else (found[0], found[1])

    # --- walks along a line ----------------------------------------------------------------------------------

    def walks(self, begin: Joints, poses: Sequence[Transform], asked: Asked) -> Iterator[Walk]:
        """Yield walks that keep a margin from the ends of the joint ranges, in the order of `PARTS`.

        Then yield the other walks that reach the last pose inside the ranges, the walk with the widest margin first.
        """
        found, enough = list[Walk](), min(MIN_MARGIN, self._margin(begin) - ROUNDING)
        free = len(begin) > self.model.task.size + len(asked)
        for part in PARTS if free else PARTS[:1]:
            walk = self._walk(begin, poses, asked, part)
            if walk.arrives and walk.margin >= enough:
                yield walk
            else:
                found.append(walk)
        inside = [walk for walk in found if walk.arrives and walk.margin >= -BEYOND]
        yield from sorted(inside, key=lambda walk: -walk.margin)

    def shortest_walk(self, begin: Joints, poses: Sequence[Transform], asked: Asked) -> Walk:
        return self._walk(begin, poses, asked, PARTS[0])

    def _walk(self, begin: Joints, poses: Sequence[Transform], asked: Asked, part: float) -> Walk:
        """Return the walk (small steps along the poses). `part`: the weight of the gradient in the whole walk, one of
        `PARTS`.
        """
        q, margin, bases, steps = begin, 1.0, list[list[Joints]](), len(poses) - 1
        axes = [_axis(joint, len(q)) for joint, _ in asked]
        others = [i for i in self.still_joints if i not in dict(asked)]
        basis = [_axis(joint, len(q)) for joint in others[: len(self.still_joints) - len(asked)]]
        for k, pose in enumerate(poses):
            held = [(axis, begin[i] + k / steps * (end - begin[i])) for axis, (i, end) in zip(axes, asked, strict=True)]
            q, basis, least = self._walk_step(q, pose, held, basis, part / len(poses))
            bases.append(basis)
            margin = min(margin, least)
        arrives = max(map(abs, self.missing(q, poses[-1])[1])) < THERE
        sums = [tuple(map(sum, zip(*units, strict=True))) for units in zip(*bases, strict=True)]
        return Walk(q, (*axes, *_orthonormal(sums)), margin, arrives)

    @cached_property
    def _pulls(self) -> list[tuple[float, float, float]]:
        """Return for each joint the middle of its range, 1 divided by its range, and the weight of its distance from
        the middle in the gradient.
        """
        ranges = [high - low for low, high in self._limits]
        mean = sum(ranges) / len(ranges)
        return [(x, 1.0 / size, (mean / size) ** 2) for x, size in zip(self.middle, ranges, strict=True)]

    @cached_property
    def _shortened(self) -> Callable[[Joints, Joints, Joints, float], tuple[Joints, Joints, float]]:
        """Return the function of `_walk_step` for a null space of one direction. It takes the joints, any step to the
        pose, the direction and `part`. Its code has the terms of all joints written out.
        """
        q, d, n = ([f"{name}{i}" for i in self._all] for name in "qdn")
        pulls = (f"{n[i]} * {pull!r} * ({x!r} - {q[i]})" for i, (x, _, pull) in enumerate(self._pulls))
        margins = (f"abs({q[i]} - {x!r}) * {unit!r}" for i, (x, unit, _) in enumerate(self._pulls))
        lines = [
            f"({comma_list(q)}), ({comma_list(d)}), ({comma_list(n)}) = joints, step, direction",
            f"size = max(hypot({comma_list(n)}), {SHORTEST})",
            f"along = {' + '.join(map('{} * {}'.format, n, d))}",
            f"back = (part * ({' + '.join(pulls)}) - along) / (size * size)",
            f"{comma_list(q)} = there = {comma_list(map('{} + {} + back * {}'.format, q, d, n))}",
            f"return there, ({comma_list(map('{} / size'.format, n))}), 0.5 - max({comma_list(margins)})",
        ]
        return compile_function("shortened(joints, step, direction, part)", lines, {"hypot": hypot})

    def _margin(self, q: Joints) -> float:
        """Return the least distance of any joint from the ends of its range, as a fraction of the range; negative if a
        joint is outside.
        """
        rows = zip(q, self._pulls, strict=True)
        return 0.5 - max([abs(x - middle) * unit for x, (middle, unit, _) in rows])

    def _walk_step(
        self, q: Joints, pose: Transform, held: list[tuple[Joints, float]], near: list[Joints], part: float
    ) -> tuple[Joints, list[Joints], float]:
        """Take the shortest step from joints q to a pose and to the sums in `held`. Return the joints after it, an
        orthonormal basis of the null space, and the margin of the joints.

        In the null space, the step adds the gradient times `part`: the gradient of the sum of the squared distances of
        joints from the middles of their ranges, relative to these ranges. `near`: the previous basis; each new
        direction is close to one of its directions.
        """
        demands = *held, *[(unit, _dot(unit, q)) for unit in near]
        step, directions = Joints(), list[Joints]()
        for k in range(len(held), max(len(demands), len(held) + 1)):
            found = self._newton(q, pose, demands, search.NO_TWIST, _axis(k, len(demands)))
            if found is None:
                rows, error = self.missing(q, pose)
                rest = [value - _dot(axis, q) for axis, value in held]
                step = solve_damped([*rows, *(axis for axis, _ in held)], [*error, *rest], WALK_DAMPING)
                there = tuple(map(add, q, step))
                return there, near, self._margin(there)
            step = found[0]
            if len(near) == 1:
                there, unit, margin = self._shortened(q, step, found[1], part)
                return there, [unit], margin
            directions.append(found[1])
        there, basis = tuple(map(add, q, step)), _orthonormal(directions[: len(near)])
        inward = [(middle - x) * pull for x, (middle, _, pull) in zip(q, self._pulls, strict=True)]
        for unit in basis:
            there = _plus(there, part * _dot(unit, inward) - _dot(unit, step), unit)
        return there, basis, self._margin(there)

    # --- all solutions --------------------------------------------------------------------------------------

    def branches(self, T: Transform) -> tuple[Joints | None, ...]:
        q = self._least(T, self.middle)
        if q is None:
            found, _ = self._search(T, self.middle, bounded=False)
            q = None if found is None else self._best_turns(found)
        return (q,)

    def select(self, T: Transform, near: Joints, asked: Configuration = NONE) -> Joints:  # noqa: ARG002 (the arm has no words)
        self.check_task(T)
        q = self._least(T, near)
        if q is None:
            raise self._nowhere(T, near)
        return q

    def _least(self, T: Transform, near: Joints) -> Joints | None:
        """Return the joints within the limits that have the least rotation error; among equal errors those that the arm
        reaches soonest from `near`. Return None if no joints are found.

        For a redundant arm, return the joints that a search from `near` finds, if there are any.
        """
        if not self.unchanging.allows(T) or self.beyond(T):
            return None
        if self.redundancy and (near_by := self._search(T, near, bounded=True)[0]) is not None:
            return near_by
        solutions = self.batch.solutions(T, near)
        found = [(q, turned) for solved, turned in solutions if (q := self._inside(solved, near)) is not None]
        most = min([turned for _, turned in found], default=inf) + SAME_TURN
        least = [q for q, turned in found if turned <= most]
        return min(least, key=partial(self.shortest_time, near), default=None)

    def beyond(self, T: Transform) -> bool:
        start, (most, *_) = levers(self.model)
        return self.model.counts[:3] == (True,) * 3 and dist(position(T), start) > most + LEVEL

    def _nowhere(self, T: Transform, near: Joints) -> LocationOutOfRange | JointOutOfRange:
        q, _ = self._search(T, near, bounded=False)
        if q is not None and self._outside(best := self._best_turns(q)):
            return self._joint_refusal(best, "turn the location, or move it nearer")
        refusal = self._out_of_reach(T, self.ways[0], "")
        away, turned = self._search(T, near, bounded=True)[1]
        hint = None
        if self.short and not isinstance(refusal, LocationTooFar):
            hint = f"{self.model.joint_count} joints cannot turn the tool every way: {ANOTHER_TASK}"
        nearest = f"the search from here comes as near as {1000 * away:.1f} mm and {degrees(turned):.1f} deg"
        return refusal.reworded(f"{refusal.detail}; {nearest}", hint)

    @cached_property
    def continuation(self) -> Continuation:  # type: ignore[override] # made on demand because it loads numpy
        from vrs_cli.kinematics.numeric.batch import Continuation

        return Continuation(self.batch)

    @cached_property
    def batch(self) -> NumericBatch:
        from vrs_cli.kinematics.numeric.batch import NumericBatch  # imported here because it loads numpy

        return NumericBatch(self.model, self.unchanging, self.still_joints)

    def _search(
        self, T: Transform, q: Joints, demands: Demands = (), *, bounded: bool
    ) -> tuple[Joints | None, tuple[float, float]]:
        """Search from the start q for joints that reach T and meet the demands (prescribed sums of joints). Return the
        joints, or None and the remaining distance [m] and angle [rad].
        """
        if not self.unchanging.allows(T):
            return None, (0.0, 0.0)
        held = list(q)
        before = inf
        for _ in range(search.STEPS):
            at = tuple(held)
            rows, error = self.missing(at, T)
            for weights, value in demands:
                rows.append(weights)
                error.append(value - sum(map(mul, weights, at)))
            if max(map(abs, error)) < search.CONVERGED:
                return at, (0.0, 0.0)
            damping = search.DAMPING * sum([e * e for e in error]) + search.LEAST_DAMPING
            room = [(low - x, high - x) for x, (low, high) in zip(at, self._limits, strict=True)] if bounded else ()
            step = search.step_within(rows, error, damping, room)
            largest = max(map(abs, step))
            if self.short and largest < search.CONVERGED and search.Aim(self, T).miss(at).within(LEVEL, STRAIGHT):
                return at, (0.0, 0.0)
            if largest <= before and largest < search.HOPELESS * max(map(abs, error)):
                break
            before = largest
            scale = min(1.0, search.LARGEST_STEP / largest) if largest else 0.0
            held = [x + scale * dx for x, dx in zip(at, step, strict=True)]
            if bounded:
                held = [min(max(x, low), high) for x, (low, high) in zip(held, self._limits, strict=True)]
        return None, search.Aim(self, T).miss(tuple(held))

    def missing(self, q: Joints, T: Transform) -> tuple[list[Joints], list[float]]:
        """Return the rows of the Jacobian that count for the task, and the remaining error from q to T in these rows
        [m, rad].
        """
        have, J = self.forward_and_jacobian(q)
        return self.rows_that_count(q, J, search.missing(self.model.task, have, T))


def _orthonormal(directions: Iterable[Joints]) -> list[Joints]:
    """Return an orthonormal basis made from the directions in their order (Gram-Schmidt method)."""
    basis = list[Joints]()
    for direction in directions:
        for unit in basis:
            direction = _plus(direction, -_dot(direction, unit), unit)  # noqa: PLW2901
        size = max(hypot(*direction), SHORTEST)
        basis.append(tuple([x / size for x in direction]))
    return basis


@cache
def _axis(joint: int, count: int) -> Joints:
    """Return the weights of a sum of `count` joints that contains only this joint: a unit vector."""
    return tuple([float(i == joint) for i in range(count)])


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(map(mul, a, b), 0.0)


def _plus(a: Joints, factor: float, b: Joints) -> Joints:
    return tuple([x + factor * y for x, y in zip(a, b, strict=True)])
