"""What a straight line does where it touches a boundary: it stops there, or it is refused.

On a tangent the joints are continuous, but change their direction at once: the line comes to rest at that point, and
goes on. A line that ends on a boundary, or begins there, has to come along a tangent: otherwise the way of a joint goes
like the square root of the way of the tool, and the joint would be in motion at once. Where a joint would have to jump,
as at a straight wrist, there is no line.
"""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.engine.boundary import Touch, pace_of
from vrs_cli.engine.following import Follower
from vrs_cli.kinematics.clearance import ON_BOUNDARY, WRIST, Clearance
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import (
    Transform,
    Vector,
    at_position,
    compose,
    inverse,
    length,
    position,
    rotate,
    rotation_about,
    translation,
)
from vrs_cli.trajectory.segment import CartesianPath

NEAR = 1e-5  # [m] of a touch, where its place is found to a billionth by differences
INSIDE = 1e-5  # [m] of the end of a line, where it is seen whether it is a tangent
SLOPE = 1e-8  # [m] of a clearance [m2] by the way: less is a tangent
NEWTON_STEPS = 3
STRAIGHTENINGS = 2  # the second one for what rounding left


class Stop(Struct, frozen=True):
    """Where a line has to stop on its way: after which part of it, and T_robot_tool, exactly on the boundary."""

    part: float
    pose: Transform


class Kinks:
    """The touches of one path, which comes from rest and goes to rest in a time of 1."""

    def __init__(self, follower: Follower, path: CartesianPath, touches: tuple[Touch, ...]) -> None:
        self.follower, self.path, self.touches = follower, path, touches
        hand = follower.arm.hand
        assert hand is not None
        pace = pace_of(path, 1.0, hand, follower.T_tool_flange)
        self.speed = pace.speed if pace.speed > ON_BOUNDARY else pace.tilt  # of a hand that stands, as [m] at 1 m

    def stops(self, near: Joints) -> list[Stop]:
        """Where the line has to stop. Raises StraightLineSingular where it cannot be."""
        for end in (0.0, 1.0):
            if any(end in touch[:2] for touch in self.touches):
                self._check_tangent(end, near)
        stops = []
        for touch in self.touches:
            if touch.begin > 0.0 and touch.end < 1.0:
                self.follower.check_goes_on(self.path, touch.begin, touch.end, near)
                stops.append(self._stop(touch))
        return sorted(stops, key=lambda stop: stop.part)

    def end_on_boundary(self) -> Transform:
        """T_robot_tool at the end of the line, exactly on the boundary to which it is a tangent: a hair beside it, the
        joints would change their direction in the last instant.
        """
        goal = self.path.pose(1.0)
        for touch in self.touches:
            if touch.begin > 0.0 and touch.end == 1.0 and touch.which != WRIST:
                goal = self._on_boundary(touch.which, goal)
        return goal

    def _check_tangent(self, end: float, near: Joints) -> None:
        """Check that a line from boundaries, or to them, is a tangent of each; samples show how the wrist turns."""
        if self.speed <= ON_BOUNDARY:
            return
        inward = (1.0 if end == 0.0 else -1.0) * min(INSIDE / self.speed, 0.5)
        seen = [self._seen(self.path.pose(end + k * inward)).sizes[:WRIST] for k in (0, 1, 2)]
        for at, once, twice, edge in zip(*seen, self.follower.arm.boundary.sizes, strict=False):
            slope = 4.0 * once - twice - 3.0 * at
            if at <= 2.0 * edge and abs(slope) > 2.0 * SLOPE * abs(inward) * self.speed:
                raise self.follower.refuse_kink(self.path, end, end + inward, near)

    def _stop(self, touch: Touch) -> Stop:
        """The place of the least clearance, by Newton's method on differences, moved onto the boundary."""
        s, step = 0.5 * (touch.begin + touch.end), NEAR / self.speed
        for _ in range(NEWTON_STEPS):
            before, here, after = (self._size(touch.which, self.path.pose(s + side)) for side in (-step, 0.0, step))
            bend = after - 2.0 * here + before
            if bend > 0.0:
                s = min(max(s - 0.5 * step * (after - before) / bend, touch.begin), touch.end)
        return Stop(s, self._on_boundary(touch.which, self.path.pose(s)))

    def _on_boundary(self, which: int, pose: Transform) -> Transform:
        """The pose moved along the gradient of a clearance to where that is 0: by no more than `ON_BOUNDARY`."""
        x, y, z = position(pose)
        off = self._size(which, pose)
        slope = []
        for dx, dy, dz in ((NEAR, 0.0, 0.0), (0.0, NEAR, 0.0), (0.0, 0.0, NEAR)):
            ahead = self._size(which, at_position(pose, x + dx, y + dy, z + dz))
            slope.append((ahead - self._size(which, at_position(pose, x - dx, y - dy, z - dz))) / (2.0 * NEAR))
        square = sum(g * g for g in slope)
        if not square:
            return pose
        return at_position(pose, *(p - off * g / square for p, g in zip((x, y, z), slope, strict=True)))

    def _size(self, which: int, pose: Transform) -> float:
        return self._seen(pose).sizes[which]

    def _seen(self, pose: Transform) -> Clearance:
        return self.follower.arm.clearance(self.follower.flange(pose), self.path.configuration)


def straighten_wrist(follower: Follower, goal: Transform) -> Transform:
    """T_robot_tool at the end of a line: turned about the wrist's centre, by no more than `ON_BOUNDARY`, so that two
    axes of the wrist which are one as nearly as that are one exactly. Otherwise the joints of the wrist would turn by
    some of what the line passes beside the singular pose, in next to no time.
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
        turned = [_turn_about(flange, hand.centre, axis, side) for side in (angle, -angle)]
        goal = compose(min(turned, key=lambda pose: length(_across(follower, pose))), follower.tool)
    return goal


def _turn_about(flange: Transform, centre: Vector, axis: Vector, angle: float) -> Transform:
    """Turn the flange about an axis of the robot through a point of the flange."""
    x, y, z = centre
    at = compose(flange, translation(x, y, z))
    return compose(at_position(compose(rotation_about(axis, angle), at), *position(at)), translation(-x, -y, -z))


def _across(follower: Follower, flange: Transform) -> Vector:
    """The cross product of the axes of the wrist."""
    return follower.arm.clearance(flange, follower.configuration).across
