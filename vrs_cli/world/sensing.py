"""Find when a moving body enters and leaves the region of a sensor, by conservative advancement. Each time step is so
short that the body, at its maximum speed, cannot move farther than its distance from the region (Mirtich and Canny,
Impulse-based simulation of rigid bodies, 1995). Times in a segment count from its start, and the result is cached with
the segment's path. If an edit only shifts the segment, the cached result is used again, so it stays equal bit by
bit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import ceil, hypot, inf, sqrt
from typing import NamedTuple

from vrs_cli.engine.position import world_pose
from vrs_cli.engine.problem import segment_joints
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import levers
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    Vector,
    compose,
    inverse,
    length,
    moved_point,
    vector_difference,
)
from vrs_cli.trajectory.polynomial import Polynomial, derivative, derivative_at, value
from vrs_cli.trajectory.segment import JointPath, Segment
from vrs_cli.values.commands import Frames
from vrs_cli.values.scene import Beam, Proximity, Zone
from vrs_cli.world.solids import Solid, Solids, frame_of, separation, solids_of

GRAVITY = 9.81  # [m/s2] acceleration of gravity
MIN_STEP_S = 2.0**-11  # [s] minimum step: half a millisecond, so that no stay of 1 ms in a region is missed
FINEST = 2.0**-22  # [s] resolution of the instants found, counted from the start of their segment
MAX_PASSAGES = 100_000  # maximum number of results (passages) in the cache


class Crossing(NamedTuple):
    """The instant at which a body enters (`inside`) or leaves the region with the number `region`. `time`: seconds
    since the motion began."""

    time: float
    region: int
    inside: bool


class Passage(NamedTuple):
    """The regions that contain a body when its motion begins, and the crossings during the motion in order of time."""

    begins_in: frozenset[int]
    crossings: tuple[Crossing, ...]


class Region(NamedTuple):
    """The region of a sensor: a solid, its T_region_world, and a function that returns the distance between a point and
    the solid, in the region's frame."""

    solid: Solid
    T_region_world: Transform
    distance: Callable[[Vector], float]

    @classmethod
    def of(cls, sensed: Beam | Zone | Proximity) -> Region:
        (solid,) = solids_of(sensed)
        end = solid.support((-1.0, 0.0, 0.0))
        distance = _from_box(sensed.size) if isinstance(sensed, Zone) else _from_rod(end, solid)
        return cls(solid, inverse(frame_of(sensed)), distance)


def _from_box(size: Vector) -> Callable[[Vector], float]:
    a, b, c = (0.5 * side for side in size)

    def distance(p: Vector) -> float:
        x, y, z = p
        return hypot(max(abs(x) - a, 0.0), max(abs(y) - b, 0.0), max(abs(z) - c, 0.0))

    return distance


def _from_rod(end: Vector, rod: Solid) -> Callable[[Vector], float]:
    """Return a function that returns the distance between a point and a cylinder with round ends. `end`: one end of its
    axis."""
    mx, my, mz = rod.middle
    ax, ay, az = vector_difference(end, rod.middle)
    square = ax * ax + ay * ay + az * az

    def distance(p: Vector) -> float:
        x, y, z = p[0] - mx, p[1] - my, p[2] - mz
        s = min(max((x * ax + y * ay + z * az) / square, -1.0), 1.0) if square else 0.0
        return hypot(x - s * ax, y - s * ay, z - s * az) - rod.radius

    return distance


class SeenBody(NamedTuple):
    """A body that sensors can see, at a fixed pose T relative to the flange, or to the tool's tip (`at_tool`)."""

    body: str
    T: Transform
    at_tool: bool = False


class BodyPath(NamedTuple):
    """The motion of a named body: its `pose` as a function of the time since the start [s], and `pace`, a bound on the
    speed of all its points [m/s] at each time. `growth`: the maximum rate at which that bound increases [m/s2]."""

    body: str
    pose: Callable[[float], Transform]
    pace: Callable[[float], float]
    growth: float
    duration: float


class Sensing:
    """Finds when bodies (given by name) enter and leave regions (given by number), and caches the results."""

    def __init__(self, arm: RobotArm, bodies: Mapping[str, Solids], regions: Sequence[Region]) -> None:
        self._arm, self._bodies, self.regions = arm, bodies, regions
        self._levers = levers(arm.model)[1]
        self._known: dict[object, tuple[object, Passage]] = {}
        self.looks = 0  # number of distances computed

    def regions_of(self, body: str, T_world_body: Transform) -> frozenset[int]:
        """Return the numbers of the regions that contain a body at a fixed pose."""
        return self._recall(
            (body, T_world_body), None, BodyPath(body, lambda _: T_world_body, lambda _: 0.0, 0.0, 0.0)
        ).begins_in

    def on_segment(self, sight: SeenBody, segment: Segment) -> Passage:
        """Return the passage (regions at the start, and crossings) of a body that the arm moves during a segment; times
        count from the segment's start."""
        path = segment.path
        if (known := self._known.get((id(path), segment.duration, sight))) is not None:
            return known[1]
        return self._recall((id(path), segment.duration, sight), path, self._body_path(sight, segment))

    def in_fall(self, body: str, T_world_body: Transform, duration: float) -> Passage:
        """Return the passage (regions at the start, and crossings) of a body that falls from rest for `duration` [s];
        times count from the start of the fall."""

        def pose(s: float) -> Transform:
            return T_world_body._replace(pz=T_world_body.pz - 0.5 * GRAVITY * s * s)

        return self._recall(
            (body, T_world_body, duration), None, BodyPath(body, pose, lambda s: GRAVITY * s, GRAVITY, duration)
        )

    def _recall(self, key: object, kept: object, path: BodyPath) -> Passage:
        """Return the passage from the cache, or compute and cache it. `kept`: an object whose id is in the key; the
        cache keeps it alive."""
        if (found := self._known.get(key)) is None:
            if len(self._known) >= MAX_PASSAGES:
                for old in list(self._known)[: MAX_PASSAGES // 2]:
                    del self._known[old]
            found = self._known[key] = (kept, self._passage(path))
        return found[1]

    def _passage(self, path: BodyPath) -> Passage:
        """Find when a moving body enters and leaves each region that it can reach."""
        T, inside, found = path.pose(0.0), set[int](), list[Crossing]()
        # [m] maximum length of the path of any point of the body; regions farther away are skipped
        far = path.pace(0.0) * path.duration + 0.5 * path.growth * path.duration**2 if path.duration else 0.0
        for number, region in enumerate(self.regions):
            if _far_apart(self._bodies[path.body], T, region) > far:
                continue
            (_, first), *rest = self._search(path, number, still=far == 0.0)
            if first:
                inside.add(number)
            found += (Crossing(s, number, now) for s, now in rest)
        return Passage(frozenset(inside), tuple(sorted(found)))

    def _clearance(self, path: BodyPath, s: float, region: int) -> float:
        self.looks += 1
        return clearance(self._bodies[path.body], path.pose(s), self.regions[region])

    # --- how a body moves ---

    def _body_path(self, sight: SeenBody, segment: Segment) -> BodyPath:
        path, frames, duration = segment.path, segment.motion.frames, segment.duration
        solids = self._bodies[sight.body]
        far = max(length(moved_point(sight.T, solid.middle)) + solid.reach for solid in solids)
        tool = frames.tool if sight.at_tool else IDENTITY
        mounted = Frames(frames.base, tool)

        def pose(s: float) -> Transform:
            return compose(world_pose(self._arm, mounted, segment_joints(self._arm, segment, s)), sight.T)

        if isinstance(path, JointPath):
            far += length((tool.px, tool.py, tool.pz))
            arms = [
                1.0 if link.kind is JointKind.PRISMATIC else lever + far
                for link, lever in zip(self._arm.model.links, self._levers, strict=True)
            ]
            rates = [derivative(row) for row in path.coefficients]
            growth = sum(lever * _most(row, duration, 2) for lever, row in zip(arms, path.coefficients, strict=True))

            def pace(s: float) -> float:
                return sum([lever * abs(value(rate, s)) for lever, rate in zip(arms, rates, strict=True)])

            return BodyPath(sight.body, pose, pace, growth, duration)
        # no bound on the tool's speed is known for this arm: search in steps of the minimum length
        if self._arm.steady is not None:
            return BodyPath(sight.body, pose, lambda _: inf, 0.0, duration)
        base = inverse(frames.base)
        at_tip = sight.T if sight.at_tool else compose(inverse(frames.tool), sight.T)
        far = max(length(moved_point(at_tip, solid.middle)) + solid.reach for solid in solids)
        states, angles = path.states(), [turn.angle for turn in path.turns]
        growth = sqrt(sum(_most(row, duration, 2) ** 2 for row in path.position))
        growth += far * sum(_most(row, duration, 2) for row in angles)

        def tip_pace(s: float) -> float:
            vx, vy, vz, *_ = states(s)[1]
            return sqrt(vx * vx + vy * vy + vz * vz) + far * sum(abs(derivative_at(row, s, 1)) for row in angles)

        return BodyPath(sight.body, lambda s: compose(compose(base, states(s)[0]), at_tip), tip_pace, growth, duration)

    # --- the search ---

    def _search(self, path: BodyPath, region: int, *, still: bool) -> Iterator[tuple[float, bool]]:
        """Yield pairs of a time [s] and whether the body is in the region: at the start, then at each change."""
        s, gap = 0.0, self._clearance(path, 0.0, region)
        yield 0.0, gap <= 0.0
        while s < path.duration and not still:
            later = min(s + max(_safe(abs(gap), path.pace(s), path.growth), MIN_STEP_S), path.duration)
            after = self._clearance(path, later, region)
            if (after <= 0.0) is not (gap <= 0.0):
                yield self._instant(path, region, (s, later), gap <= 0.0), after <= 0.0
            s, gap = later, after

    def _instant(self, path: BodyPath, region: int, between: tuple[float, float], before: bool) -> float:
        """Return the instant at which the body enters or leaves a region between two times, found by bisection."""
        low, high = int(between[0] / FINEST), ceil(between[1] / FINEST)
        while high - low > 1:
            middle = (low + high) // 2
            if (self._clearance(path, middle * FINEST, region) <= 0.0) is before:
                low = middle
            else:
                high = middle
        return min(high * FINEST, between[1])


def _safe(gap: float, pace: float, growth: float) -> float:
    """Return a time h [s] in which the body moves at most `gap` [m]: pace h + growth h^2 / 2 <= gap."""
    if growth > 0.0:
        return (sqrt(pace * pace + 2.0 * growth * gap) - pace) / growth
    return gap / pace if pace > 0.0 else inf


def _most(row: Polynomial, duration: float, order: int) -> float:
    """Return an upper bound on the absolute value of a polynomial's derivative from 0 to `duration`. `order`: the order
    of the derivative."""
    found = 0.0
    for power in range(order, len(row)):
        factor = abs(row[power])
        for lowered in range(order):
            factor *= power - lowered
        found += factor * duration ** (power - order)
    return found


def clearance(solids: Solids, T_world_body: Transform, region: Region) -> float:
    """Return a lower bound on the distance between a body and a region [m]. It is 0 or negative if and only if the body
    touches or overlaps the region; then its absolute value is at most the depth of the overlap."""
    T_region_body = compose(region.T_region_world, T_world_body)
    return min([_clearance(solid, T_region_body, region) for solid in solids])


def _far_apart(solids: Solids, T_world_body: Transform, region: Region) -> float:
    """Return a lower bound on the distance between a body and a region [m] that is quick to compute."""
    T = compose(region.T_region_world, T_world_body)
    return min([region.distance(moved_point(T, one.middle)) - one.reach for one in solids])


def _clearance(solid: Solid, T_region_body: Transform, region: Region) -> float:
    between = region.distance(moved_point(T_region_body, solid.middle))
    if between > 1.5 * solid.reach:
        return between - solid.reach
    if between <= 0.0 < solid.depth:  # the bodies overlap at least as deep as the ball inside the solid shows
        return between - solid.depth
    found = separation(solid, T_region_body, region.solid).distance
    return found if found > 0.0 else min(found, between - solid.depth, -0.0)
