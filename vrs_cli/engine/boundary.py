"""Find where a tool path meets the boundary of the reach or a singular pose, and decide what a straight line does
there. These positions are proved, not sampled: a path is halved until every part of it is certainly clear
(`kinematics.clearance`), or partly beyond the reach, or so short that it lies completely on a boundary, within
`ON_BOUNDARY`. Most paths are clear after one or two samples. A path that passes close to a boundary is cut into shorter
and shorter parts towards the boundary, and its joints are sampled more closely there. Source: the branch-and-bound
search of Moore, Kearfott and Cloud, "Introduction to Interval Analysis" (2009).

Where a line is tangent to a boundary, the joints are continuous but change their direction abruptly: the line comes to
rest at that point, and then continues. A line that ends or begins on a boundary must be tangent to it. Otherwise a
joint moves with the square root of the distance of the tool, so its velocity would have to jump. Where a joint would
have to jump, as when the wrist is straight, no line is possible.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import zip_longest
from math import hypot, inf
from typing import NamedTuple

from msgspec import structs

from vrs_cli.engine.following import Follower
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.clearance import ON_BOUNDARY, SHOULDER, WRIST, Clearance, Hand, HandPace
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    at_position,
    compose,
    cross,
    inverse,
    length,
    moved_point,
    position,
    rotate,
    rotation_about,
    translation,
)
from vrs_cli.trajectory.polynomial import Polynomial, derivative, most
from vrs_cli.trajectory.segment import CartesianPath, Turn
from vrs_cli.trajectory.state import FrozenValue

# clearance that must be proved between two samples, as a fraction of the smaller clearance of the two
KEPT_CLEARANCE = 0.25
END_PART = 1e-4  # fraction of a path: its ends need no closer marks, since samples are dense there anyway
MAX_SEARCH_LOOKS = 5000
# number of cached surveys: the same line may be planned again, with other stops or while a jog key is held
REMEMBERED_SURVEYS = 64
FEW_LOOKS = 8  # a search with at most this many samples came close to no boundary, so it returns no marks
# for each clearance, the fraction of its maximum on the path below which it counts as close to the boundary
CLOSE_PARTS = (0.01, 0.01, 0.01, 0.1)
DIFFERENCE_STEP = 1e-5  # [m] step of the finite differences that locate a touch; the error is then about 1e-9 m
TANGENT_STEP = 1e-5  # [m] step of the finite differences at the end of a line that show whether it is a tangent
TANGENT_SLOPE = 1e-8  # [m] maximum slope of a clearance [m2] along a path that counts as a tangent
NEWTON_STEPS = 3
MAX_TOUCH_CHANGE = 0.01  # [rad, m] maximum change of a joint at a touch of a boundary that does not count as a jump
STRAIGHTENINGS = 2  # number of corrections of the wrist; the second one removes the rounding errors of the first


class Touch(NamedTuple):
    """The part of a path, from `begin` to `end` [s], on which a clearance is zero; `which`: the index of this clearance
    in `Clearance.sizes`.
    """

    begin: float
    end: float
    which: int


class PathSurvey(FrozenValue, frozen=True):
    """The result of searching a path for boundaries. `marks`: times [s] around each close approach to a boundary,
    spaced more densely near the approach. `beyond`: a time at which the path is out of reach. `endless`: a time at
    which the search gave up undecided. Each of these two is None if there is no such time.
    """

    touches: tuple[Touch, ...] = ()
    marks: tuple[float, ...] = ()
    beyond: float | None = None
    endless: float | None = None


def survey(follower: Follower, path: CartesianPath, lasting: float) -> PathSurvey:
    """Search a whole path, from 0 to `lasting` [s], for boundaries and singular poses. Raises MotionError if no
    straight line can follow the path.
    """
    found = _survey(follower.arm, follower.tool, structs.replace(path, seeds=()), lasting)
    if found.beyond is not None:
        raise follower.refuse_beyond(path, found.beyond, path.seeds[0])
    if found.endless is not None:
        raise follower.refuse(path, found.endless, "the line goes on along it")
    return found


@lru_cache(REMEMBERED_SURVEYS)
def _survey(arm: RobotArm, T_flange_tool: Transform, path: CartesianPath, lasting: float) -> PathSurvey:
    """Search a path; results are cached. Paths of arms without a `Hand` (the wrist centre and last axis, from which
    clearances are computed) are not searched.
    """
    return PathSurvey() if arm.hand is None else _Search(arm, arm.hand, inverse(T_flange_tool), path, lasting).result()


class _Search:
    """A search of one path, from its start to its end."""

    def __init__(
        self, arm: RobotArm, hand: Hand, T_tool_flange: Transform, path: CartesianPath, lasting: float
    ) -> None:
        self.arm, self.T_tool_flange, self.edges = arm, T_tool_flange, arm.boundary.sizes
        self.path, self.states, self.lasting = path, path.states(), lasting
        self.pace = pace_of(path, lasting, hand, T_tool_flange)
        self.touches: list[Touch] = []
        self.seen: list[tuple[float, Clearance]] = []

    def result(self) -> PathSurvey:
        begin, at_begin = 0.0, self.look(0.0)
        pending = [(self.lasting, self.look(self.lasting))]
        for at, seen in ((0.0, at_begin), pending[0]):
            if self.is_beyond(seen):
                return PathSurvey(beyond=at)
        self.seen.append((begin, at_begin))
        for _ in range(MAX_SEARCH_LOOKS):
            end, at_end = pending[-1]
            sure, on_boundary = self.judge(at_begin, at_end, end - begin)
            if not sure:
                middle = 0.5 * (begin + end)
                seen = self.look(middle)
                if self.is_beyond(seen):
                    return PathSurvey(beyond=middle)
                pending.append((middle, seen))
                continue
            for which in on_boundary:  # the touch may continue one that ends where this part begins
                before = next((touch for touch in self.touches if touch[1:] == (begin, which)), None)
                if before is None:
                    self.touches.append(Touch(begin, end, which))
                else:
                    self.touches[self.touches.index(before)] = before._replace(end=end)
            begin, at_begin = pending.pop()
            self.seen.append((begin, at_begin))
            if not pending:
                return PathSurvey(tuple(self.touches), self.marks() if len(self.seen) > FEW_LOOKS else ())
        return PathSurvey(endless=begin)

    def look(self, s: float) -> Clearance:
        return self.arm.clearance(compose(self.states(s)[0], self.T_tool_flange), self.path.configuration)

    def is_beyond(self, seen: Clearance) -> bool:
        shoulder, outer, inner, wrist = self.edges
        return seen.shoulder < -shoulder or seen.outer < -outer or seen.inner < -inner or seen.wrist < -wrist

    def judge(self, a: Clearance, b: Clearance, h: float) -> tuple[bool, list[int]]:
        """Return whether every clearance is decided between the samples a and b, `h` [s] apart, and the indices of the
        clearances that are on their boundary.

        A clearance is decided if it certainly stays positive, or stays on its boundary from one sample to the other.
        """
        least = self.arm.least_clearance(a, b, self.pace, h).sizes
        on_boundary = list[int]()
        for which, (edge, x, y) in enumerate(zip(self.edges, a.sizes, b.sizes, strict=True)):
            low = least[which]
            if low > edge and low >= KEPT_CLEARANCE * min(x, y):
                continue
            if on_boundary and max(x, y) == inf:
                continue  # unknown: the pose is slightly beyond the boundary, where there are no joints
            if not (max(x, y) <= 2.0 * edge and low >= -edge):
                return False, []
            on_boundary.append(which)
            if which != SHOULDER:
                break  # later clearances depend on this one and have no known bound here, so they are not judged
            least = self.arm.least_clearance(a, b, self.pace, h, beside_axis=True).sizes
        return True, on_boundary

    def marks(self) -> tuple[float, ...]:
        """Return times around each minimum of a clearance, spaced more closely the nearer they are to the minimum."""
        marks = set[float]()
        for k, close in enumerate(CLOSE_PARTS):
            column = [inf, *(seen.sizes[k] for _, seen in self.seen), inf]
            most = close * max(column[1:-1])
            rows = zip(column, column[1:], column[2:], strict=False)
            for i, (before, here, after) in enumerate(rows):
                if before >= here <= after and here < most < inf:
                    marks.update(self.around(i))
        return tuple(sorted(marks))

    def around(self, i: int) -> Iterator[float]:
        """Yield times on both sides of sample `i`, spaced more closely the nearer they are to the sample. Also yield
        the time of the sample itself, unless the sample is an end of the path.
        """
        s, step = self.seen[i][0], self.lasting
        nearest = min(abs(self.seen[k][0] - s) for k in (i - 1, i + 1) if 0 <= k < len(self.seen))
        if s in (0.0, self.lasting):
            nearest = max(nearest, END_PART * self.lasting)
        else:
            yield s
        while step > 0.5 * nearest:
            step *= 0.5
            yield from (at for at in (s - step, s + step) if 0.0 < at < self.lasting)


# --- bounds of the derivatives ---------------------------------------------------------------------------------------


def pace_of(path: CartesianPath, lasting: float, hand: Hand, T_tool_flange: Transform) -> HandPace:
    """Return upper bounds of the speed and turning rate of the hand along a path, and of their derivatives."""
    lever = moved_point(T_tool_flange, hand.centre)
    approach = rotate(T_tool_flange, hand.approach)
    rows: Sequence[Polynomial] = path.position
    if hand.T_axis_base is not IDENTITY:
        places = zip_longest(*rows, fillvalue=0.0)
        rows = list(zip(*(rotate(hand.T_axis_base, (px, py, pz)) for px, py, pz in places), strict=True))
    (vx, ax), (vy, ay), (vz, az) = [_greatest_rates(row, lasting) for row in rows]
    swing, swing_bend = _swing(path.turns, lasting, lever)
    tilt, tilt_bend = _swing(path.turns, lasting, approach)
    return HandPace(
        across=hypot(vx, vy) + swing,
        across_bend=hypot(ax, ay) + swing_bend,
        speed=hypot(vx, vy, vz) + swing,
        bend=hypot(ax, ay, az) + swing_bend,
        tilt=tilt,
        tilt_bend=tilt_bend,
    )


def _swing(turns: tuple[Turn, ...], lasting: float, v: Vector) -> tuple[float, float]:
    """Return upper bounds for the magnitudes of the first and second derivative of a vector `v` that turns with the
    tool.
    """
    if not turns:
        return 0.0, 0.0
    greatest = [_greatest_rates(turn.angle, lasting) for turn in turns]
    across = length(cross(turns[0].axis, v)) if len(turns) == 1 else length(v)
    # earlier turns rotate the axes of later turns, which adds to the second derivative
    total, bend = sum([rate for rate, _ in greatest]), sum([bend for _, bend in greatest])
    return total * across, (bend + total * total * (1.0 if len(turns) < 2 else 2.0)) * across


def _greatest_rates(a: Polynomial, lasting: float) -> tuple[float, float]:
    """Return the maxima of |dp/dt| and |d2p/dt2| from 0 to `lasting`."""
    rate = derivative(a)
    return most(rate, lasting), most(derivative(rate), lasting)


class Stop(FrozenValue, frozen=True):
    """A position at which a line has to stop: the fraction of the line before it, and T_robot_tool, exactly on the
    boundary.
    """

    part: float
    pose: Transform


class Kinks:
    """The points at which a path touches a boundary. The path goes from rest to rest in 1 s."""

    def __init__(self, follower: Follower, path: CartesianPath, touches: tuple[Touch, ...]) -> None:
        self.follower, self.path, self.touches = follower, path, touches
        hand = follower.arm.hand
        assert hand is not None
        pace = pace_of(path, 1.0, hand, follower.T_tool_flange)
        # [m/s] bound of the speed of the hand; if the hand only turns, the speed of a point 1 m away
        self.speed = pace.speed if pace.speed > ON_BOUNDARY else pace.tilt

    def stops(self, near: Joints) -> list[Stop]:
        """Return the points at which the line has to stop. Raises StraightLineSingular if the joints cannot follow the
        line.
        """
        for end in (0.0, 1.0):
            if any(end in touch[:2] for touch in self.touches):
                self._check_tangent(end, near)
        stops = []
        for touch in self.touches:
            if touch.begin > 0.0 and touch.end < 1.0:
                changes = self.follower.changes(self.path, touch.begin, touch.end, near)
                if max(changes) > MAX_TOUCH_CHANGE:  # a joint jumps from one side of the boundary to the other
                    raise self.follower.refuse_jump(self.path, touch.end, changes)
                stops.append(self._stop(touch))
        return sorted(stops, key=lambda stop: stop.part)

    def end_on_boundary(self) -> Transform:
        """Return T_robot_tool at the end of the line, moved exactly onto the boundary to which the line is tangent.

        Without this correction, the joints would change their direction just before the end of the line, next to the
        boundary.
        """
        goal = self.path.pose(1.0)
        for touch in self.touches:
            if touch.begin > 0.0 and touch.end == 1.0 and touch.which != WRIST:
                goal = self._on_boundary(touch.which, goal)
        return goal

    def _check_tangent(self, end: float, near: Joints) -> None:
        """Raise an error if a line that begins or ends on boundaries is not tangent to each of them. `end`: 0.0 for the
        start, 1.0 for the end of the line. The wrist is not checked: its samples show how it turns.
        """
        if self.speed <= ON_BOUNDARY:
            return
        inward = (1.0 if end == 0.0 else -1.0) * min(TANGENT_STEP / self.speed, 0.5)
        seen = [self._clearance_at(self.path.pose(end + k * inward)).sizes[:WRIST] for k in (0, 1, 2)]
        for at, once, twice, edge in zip(*seen, self.follower.arm.boundary.sizes, strict=False):
            slope = 4.0 * once - twice - 3.0 * at
            if at <= 2.0 * edge and abs(slope) > 2.0 * TANGENT_SLOPE * abs(inward) * self.speed:
                raise self.follower.refuse_kink(self.path, end, end + inward, near)

    def _stop(self, touch: Touch) -> Stop:
        """Return the stop at a touch: find the pose with the minimum clearance by Newton's method with finite
        differences, and move it onto the boundary.
        """
        s, step = 0.5 * (touch.begin + touch.end), DIFFERENCE_STEP / self.speed
        for _ in range(NEWTON_STEPS):
            before, here, after = (self._size(touch.which, self.path.pose(s + side)) for side in (-step, 0.0, step))
            bend = after - 2.0 * here + before
            if bend > 0.0:
                s = min(max(s - 0.5 * step * (after - before) / bend, touch.begin), touch.end)
        return Stop(s, self._on_boundary(touch.which, self.path.pose(s)))

    def _on_boundary(self, which: int, pose: Transform) -> Transform:
        """Move a pose along the gradient of a clearance to the point where the clearance is 0, by at most
        `ON_BOUNDARY`."""
        x, y, z = position(pose)
        off = self._size(which, pose)
        slope = []
        for dx, dy, dz in ((DIFFERENCE_STEP, 0.0, 0.0), (0.0, DIFFERENCE_STEP, 0.0), (0.0, 0.0, DIFFERENCE_STEP)):
            ahead = self._size(which, at_position(pose, x + dx, y + dy, z + dz))
            slope.append(
                (ahead - self._size(which, at_position(pose, x - dx, y - dy, z - dz))) / (2.0 * DIFFERENCE_STEP)
            )
        square = sum(g * g for g in slope)
        if not square:
            return pose
        return at_position(pose, *(p - off * g / square for p, g in zip((x, y, z), slope, strict=True)))

    def _size(self, which: int, pose: Transform) -> float:
        return self._clearance_at(pose).sizes[which]

    def _clearance_at(self, pose: Transform) -> Clearance:
        return self.follower.arm.clearance(self.follower.flange(pose), self.path.configuration)


def straighten_wrist(follower: Follower, goal: Transform) -> Transform:
    """Return T_robot_tool at the end of a line, turned so that two wrist axes that nearly coincide then coincide
    exactly.

    The turn is about the wrist's centre, by no more than `ON_BOUNDARY`. Without this turn, a line that passes beside
    the singular pose would turn the joints of the wrist almost instantly.
    """
    hand = follower.arm.hand
    if hand is None:
        return goal
    for _ in range(STRAIGHTENINGS):
        flange = follower.flange(goal)
        across = _across(follower, flange)
        angle = length(across)
        if not 0.0 < angle <= ON_BOUNDARY:
            break
        axis = rotate(inverse(hand.T_axis_base), across)
        at = compose(flange, translation(*hand.centre))
        back = translation(*(-part for part in hand.centre))
        # try a small turn about the centre of the wrist in both directions
        sides = (compose(rotation_about(axis, side), at) for side in (angle, -angle))
        turned = [compose(at_position(side, *position(at)), back) for side in sides]
        goal = compose(min(turned, key=lambda pose: length(_across(follower, pose))), follower.tool)
    return goal


def _across(follower: Follower, flange: Transform) -> Vector:
    """Return the cross product of the two wrist axes that coincide in the singular pose."""
    return follower.arm.clearance(flange, follower.configuration).across
