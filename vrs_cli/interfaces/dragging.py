"""Drag the tool to a target pose that the user chooses; the arm moves the tool as near to the target as possible. The
joints computed for the target are called the goal. Between two targets the goal changes no faster than the joints can
move at full speed, so the arm never jumps:

- If the target is in reach without changing between LEFTY and RIGHTY or between ABOVE and BELOW, the goal is exactly at
  the target, or on the way to it.
- If the target is out of reach, a descent moves the goal to the nearest pose in reach (`kinematics/numeric/search.py`).
- If the descent makes no more progress, but another path of the joints leads to the target, the joints take that path.

The wrist may pass through its straight position, from FLIP to NOFLIP, if this makes the motion shorter: no joint jumps
there. `Hold` names the limit that keeps the tool from the target.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from math import inf, pi, radians, sin
from typing import NamedTuple

from vrs_cli.engine import position, targets
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import CollisionAhead
from vrs_cli.interfaces.streams import DRAG_TICK, DRAGGING, velocity_between
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Arm, Configuration, Joints, largest_change, put_inside
from vrs_cli.kinematics.model import RobotModel, some_joints
from vrs_cli.kinematics.numeric.search import Aim, Nearest, Side
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.trajectory.state import Target
from vrs_cli.values.dragging import Hold, Limit, Shortfall

MISS_TOLERANCE = 1e-4, radians(0.05)  # [m, rad] the tool counts as at its target within this distance and rotation
# with less progress towards a target (fraction of the remaining distance) the descent counts as stalled
STALL_GAIN = 1e-3
# pass through the straight wrist only if the sum of |sin q5| before and after the passage is below this value
WRIST_PASS_SUM = sin(radians(25.0))
# if a measure of `Singularity` (0 to 1) is below this, the singularity is named as the cause of a lagging joint
NEAR_SINGULAR = 0.1
# fraction of `JointPace.ahead` that stays allowed next to the axis of joint 1, so that the arm can move along the axis
MIN_AHEAD = 0.03
RETREAT_FACTOR = 5.0  # move joints that would cross the axis of joint 1 back by this multiple of the crossing distance
COMING_SHARES = 0.0, 0.25, 0.5, 1.0  # check the planned motion at these fractions of the time until the joints stop
FLAT_SLOPE = 1e-3  # [m/rad] do not limit a joint that changes the distance from the axis of joint 1 by less than this
SIDE_SHARE = 0.005  # keep the arm's end at least this fraction of the arm's length away from the axis of joint 1
# [rad] keep the elbow at least this far from its stretched position, so that ABOVE does not become BELOW
ELBOW_MARGIN = 1e-4
STALLS_BEFORE_WAYS = 5  # try another configuration after this many targets without progress
STALLS_BEFORE_SEARCH = 25  # search another path after this many targets without progress
# restart a search elsewhere if a target brings less progress than this fraction of the remaining distance
PROMISING_GAIN = 0.5
SEARCH_STARTS = 16  # number of random start points that a search tries, the nearest first, before it draws new ones
LAG_S = 0.1  # [s] a joint counts as late if it needs longer than this, at maximum speed, to reach its goal
# the goal may be ahead of a joint by the distance travelled at full speed in this many times the acceleration time
STOPPING_FACTOR = 1.5
REST_TOLERANCE = 1e-7  # [rad, m] an arm at rest does not move if its goal is nearer than this


class Range(NamedTuple):
    lower: Joints
    upper: Joints

    def around(self, q: Joints, below: Joints, above: Joints) -> Range:
        """Return the part of the range between q - `below` and q + `above`. If q is outside the range, use the nearest
        position inside instead of q."""
        q = self.put(q)
        lower = self.put(tuple(x - step for x, step in zip(q, below, strict=True)))
        return Range(lower, self.put(tuple(x + step for x, step in zip(q, above, strict=True))))

    def holds(self, q: Joints) -> bool:
        return all(low <= x <= high for x, low, high in zip(q, self.lower, self.upper, strict=True))

    def put(self, q: Joints) -> Joints:
        return put_inside(q, self.lower, self.upper)


class JointPace(NamedTuple):
    """The distances allowed between each joint and its goal [rad, m]: the goal may lead a joint by at most `ahead`, so
    that the joint can stop there; a joint counts as late if it is more than `lag` behind its goal."""

    ahead: Joints
    lag: Joints


class Search:
    """A search of the whole joint ranges for other joints that bring the tool to a target, for an arm without a
    closed-form inverse. Each target advances the search by one step, because there is no time for a long search between
    two targets."""

    def __init__(self, model: RobotModel, within: Range) -> None:
        self._range, self._speeds = within, model.max_velocity
        self._anywhere = some_joints(model)
        self._starts: list[Joints] = []  # start points of the search that are still to be tried, the nearest last
        self._at: Joints | None = None

    def go_on(self, aim: Aim, now: Joints) -> Joints | None:
        """Continue the search. Return joints that bring the tool to the target; None if no such joints are found yet.
        If the search makes no progress, restart it from another point."""
        if self._at is None:  # begin at the random joint vector that the arm reaches soonest
            if not self._starts:
                some = islice(self._anywhere, SEARCH_STARTS)
                self._starts = sorted(some, key=lambda q: _ticks(now, q, self._speeds), reverse=True)
            self._at = self._starts.pop()
        nearest = aim.nearest(self._range.put(self._at), *self._range)
        there = aim.miss(nearest.joints).within(*MISS_TOLERANCE)
        self._at = nearest.joints if nearest.gain > PROMISING_GAIN and not there else None
        return nearest.joints if there else None


class Pursuit:
    """Computes the joints for a dragged tool, without using a clock. `goal`: the last joints found [rad, m]; `steady`:
    whether they bring the tool to the target. `kept`: the configuration of the arm, which does not change (except the
    wrist); `range`: the joint ranges within which the arm has this configuration."""

    def __init__(self, arm: RobotArm, q: Joints) -> None:
        self.arm = arm
        self.kept = arm.configuration(q)
        self.range = _range_of(arm, q, self.kept)
        self.goal = self.range.put(q)
        self._side = _side_of(arm, q, self.kept)
        self.steady = True
        self._closed = arm.hand is not None  # whether the arm has a closed-form inverse
        self.roundabout = False  # whether the joints take another path to the target, because the descent has stalled
        self._elsewhere: Joints | None = None  # joints found by a search that bring the tool to the target
        self._search = Search(arm.model, self.range)
        self._finds_all = not self._closed and len(arm.ways) > 1
        if self._finds_all:
            # the first call for an arm is slow: make it now, before targets arrive
            arm.inverse_branch(arm.forward(q), self.kept, q)
        self._stalled = 0  # number of successive targets without progress

    def follow(
        self, T_base_flange: Transform, T_flange_tool: Transform, coming: Sequence[Joints], pace: JointPace
    ) -> Shortfall:
        """Compute the goal for one more target. `coming`: the current joints, and the joints that follow if no other
        target arrives; `pace`: the allowed distances between joints and goal. Return how far the tool is from the
        target, and why."""
        now, pose = coming[0], _possible(self.arm, T_base_flange)
        aim, box = Aim(self.arm, pose, T_flange_tool, self._side), self.range.around(now, *self._ahead(coming, pace))
        there = self._joints_there(pose) if self._closed else self._found_again(aim)
        if there is not None and box.holds(there):
            self.goal, self.steady = there, True
            self.roundabout, self._elsewhere, self._stalled = False, None, 0
            late = [abs(b - a) / lag for a, b, lag in zip(now, there, pace.lag, strict=True)]
            return self._lag_shortfall(aim, now, late) if max(late) > 1.0 else Shortfall()
        nearest = aim.nearest(box.put(self.goal), *box)
        stalled = nearest.gain < STALL_GAIN
        self.roundabout = there is not None and (self.roundabout or stalled)
        self.goal, self.steady = nearest.joints, False
        if self.roundabout and there is not None:
            # on this path the joints may cross the axis of joint 1
            self.goal = _towards(now, there, self.range.around(now, pace.ahead, pace.ahead))
            return self._lag_shortfall(
                aim, now, [abs(b - a) / lag for a, b, lag in zip(now, there, pace.lag, strict=True)]
            )
        if aim.miss(self.goal).within(*MISS_TOLERANCE):
            self.steady = True
            return Shortfall()
        if stalled and not self._closed:
            self._stalled += 1
            self._elsewhere = self._another(aim, now)
        return Shortfall(*aim.miss(now), tuple(self._holds(aim, nearest, there, now, pace)))

    def _ahead(self, coming: Sequence[Joints], pace: JointPace) -> tuple[Joints, Joints]:
        """Return how far the goal may be below and above the current value of each joint [rad, m]. The goal must not
        lead the arm across the axis of joint 1. Near this axis, distances in the direction of the axis are reduced in
        proportion to the room that is left, so that the joints can stop before it from any speed. They can still move
        parallel to the axis. If the planned motion would cross the axis, the goal moves back."""
        ahead = pace.ahead
        if self._side is None:
            return ahead, ahead
        room, nearest = min((self._side.room(q), q) for q in coming)
        slope = self._side.slope(nearest)
        passed = sum([abs(a) * x for a, x in zip(slope, ahead, strict=True)])
        part = (room if room > 0.0 else RETREAT_FACTOR * room) / passed + MIN_AHEAD if passed else 1.0
        part = min(max(part, -1.0), 1.0)
        below = tuple([part * x if a > FLAT_SLOPE else x for a, x in zip(slope, ahead, strict=True)])
        above = tuple([part * x if a < -FLAT_SLOPE else x for a, x in zip(slope, ahead, strict=True)])
        return below, above

    @property
    def _configuration(self) -> Configuration:
        """The configuration for the next goal: the arm and the elbow (RIGHTY, ABOVE ...) are as at the start, the wrist
        (FLIP or NOFLIP) is as at the last goal."""
        return Configuration.of(self.kept.arm, self.kept.elbow, self.arm.configuration(self.goal).wrist)

    def _joints_there(self, pose: Transform) -> Joints | None:
        """Return the joints for a pose in the current configuration; None if the configuration cannot reach the
        pose."""
        arm, goal, have, found = self.arm, self.goal, self._configuration, list[Joints]()
        straight = arm.singularity(goal).wrist
        for way in (have, have.other_wrist) if have.wrist is not None and straight < WRIST_PASS_SUM else (have,):
            q = arm.inverse_branch(pose, way, goal)
            if q is not None and (way is have or straight + arm.singularity(q).wrist < WRIST_PASS_SUM):
                inside = self.range.put(q)
                if largest_change(q, inside) <= 2.0 * ELBOW_MARGIN:
                    found.append(inside)
        return min(found, key=lambda q: _ticks(goal, q, arm.model.max_velocity), default=None)

    def _another(self, aim: Aim, now: Joints) -> Joints | None:
        """Return joints of another configuration, or from a search, that reach the target; None if none are found, or
        if the arm has not been stalled for long enough."""
        if self._finds_all and self._stalled > STALLS_BEFORE_WAYS:
            ways = [self.arm.inverse_branch(aim.flange, way, now) for way in self.arm.ways]
            inside = [q for q in ways if q is not None and self.range.holds(q)]
            return min(inside, key=lambda q: _ticks(now, q, self.arm.model.max_velocity), default=None)
        return self._search.go_on(aim, now) if not self._finds_all and self._stalled > STALLS_BEFORE_SEARCH else None

    def _found_again(self, aim: Aim) -> Joints | None:
        """Return the joints that an earlier search has found, moved to the current target; None if no search has found
        joints."""
        if self._elsewhere is not None:
            q = aim.nearest(self.range.put(self._elsewhere), *self.range).joints
            self._elsewhere = q if aim.miss(q).within(*MISS_TOLERANCE) else None
        return self._elsewhere

    # --- limits that keep the tool from its target ---

    @staticmethod
    def _lag_shortfall(aim: Aim, now: Joints, late: list[float]) -> Shortfall:
        """Return the shortfall for a target in reach; it names the joint that lags most as the cause. `late`: the lag
        of each joint as a multiple of the allowed lag."""
        return Shortfall(*aim.miss(now), (Hold(Limit.SPEED, late.index(max(late)) + 1),))

    def _holds(self, aim: Aim, nearest: Nearest, there: Joints | None, now: Joints, pace: JointPace) -> Iterator[Hold]:
        """Yield the limits that keep the tool from its target: first joints at the ends of their ranges, then the
        reach, then joints that are too slow."""
        model, named, hurried = self.arm.model, False, list[int]()
        for i, (side, x) in enumerate(zip(nearest.pressed, self.goal, strict=True)):
            if side and x == self.range[side > 0][i]:
                if x == (model.lower, model.upper)[side > 0][i]:
                    named = True
                    yield Hold(Limit.JOINT, i + 1, "lower" if side < 0 else "upper")
            elif side and abs(x - now[i]) >= MIN_AHEAD * pace.ahead[i]:
                hurried.append(i)
        if there is None and (which := self._out_of_reach(aim)) is not None:
            named = True
            yield Hold(Limit.REACH, which=which)
        singular = self.arm.singularity(self.goal)
        if hurried and min(singular) >= NEAR_SINGULAR:
            yield Hold(Limit.SPEED, hurried[0] + 1)
        elif hurried or (not named and min(singular) < NEAR_SINGULAR):
            yield Hold(Limit.SINGULARITY, hurried[0] + 1 if hurried else 0, which=singular.nearest)
        elif not named:
            yield Hold(Limit.REACH)

    def _out_of_reach(self, aim: Aim) -> str | None:
        """Return which limit of the reach the target exceeds: `far` or `close`, or "" if that limit has no name; None
        if the target is within reach and only joint ranges limit the tool."""
        if not self._closed or self.arm.branch_joints(aim.flange, self._configuration, self.goal) is not None:
            return None
        clearance = self.arm.clearance(aim.flange, self._configuration)
        return "far" if clearance.outer < 0.0 else "close" if min(clearance.shoulder, clearance.inner) < 0.0 else ""


def _possible(arm: RobotArm, T_base_flange: Transform) -> Transform:
    """Return the nearest pose that this kind of arm can take (a SCARA cannot tilt the tool)."""
    while (forbidden := arm.unchanging.forbids(T_base_flange)) is not None:
        T_base_flange = forbidden.right
    return T_base_flange


def _range_of(arm: RobotArm, q: Joints, kept: Configuration) -> Range:
    """Return the joint ranges in which the elbow passes neither its stretched nor its folded position."""
    lower, upper = list(arm.model.lower), list(arm.model.upper)
    if arm.fold is not None:
        i, stretched = arm.fold
        end = stretched + pi * round((q[i] - stretched) / pi)
        above = q[i] > end
        if abs(q[i] - end) < 2.0 * ELBOW_MARGIN:
            above = arm.configuration((*q[:i], end + 4.0 * ELBOW_MARGIN, *q[i + 1 :])) == kept
        low, high = (end, end + pi) if above else (end - pi, end)
        lower[i] = max(lower[i], min(low + ELBOW_MARGIN, q[i]))
        upper[i] = min(upper[i], max(high - ELBOW_MARGIN, q[i]))
    return Range(tuple(lower), tuple(upper))


def _side_of(arm: RobotArm, q: Joints, kept: Configuration) -> Side | None:
    """Return the side of the axis of joint 1 on which the arm stays; None if the arm has no such sides."""
    if (outward := arm.outward(q)) == inf:
        return None
    sign = -1.0 if kept.arm is Arm.RIGHTY else 1.0
    return Side(arm, sign, min(SIDE_SHARE * arm.length, max(sign * outward, 0.0)))


def _ticks(a: Joints, b: Joints, step: Joints) -> float:
    """Return how long the slowest joint needs from the joints a to b, if joint i moves by step[i] per unit of time."""
    return max(abs(y - x) / s for x, y, s in zip(a, b, step, strict=True))


def _towards(a: Joints, b: Joints, box: Range) -> Joints:
    """Return the last point on the straight line in joint space from a to b that is in the box; all joints move in
    proportion."""
    shares = [
        ((high if y > high else low) - x) / (y - x)
        for x, y, low, high in zip(a, b, *box, strict=True)
        if not low <= y <= high
    ]
    part = min([1.0, *shares])
    return tuple(x + part * (y - x) for x, y in zip(a, b, strict=True))


class Dragging:
    """The control of an engine by a stream of tool targets. If no more targets arrive, the arm stops."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.pursuit = Pursuit(engine.arm, engine.position().joints)
        self._last: float | None = None

    def to(self, T_world_tool: Transform, issued: float | None = None) -> Shortfall:
        """Move the arm towards a target pose of the tool. `issued`: when the user sent the target, if earlier than now
        [s]. Return how far the tool is from the target. With ENABLE COLLISION the tool stops before a contact. Raises
        PowerOff."""
        engine, pursuit, frames = self.engine, self.pursuit, self.engine.frames
        now = engine.now
        tick, self._last = DRAGGING.tick(DRAG_TICK if self._last is None else now - self._last), now
        fraction, model = targets.fraction_of_full(1.0, engine.settings).fraction, engine.model
        fastest = [v * fraction for v in model.max_velocity]
        strongest = [a * engine.settings.acceleration for a in model.max_acceleration]
        ahead = [v * max(LAG_S, STOPPING_FACTOR * v / a) for v, a in zip(fastest, strongest, strict=True)]
        pace = JointPace(tuple(ahead), tuple([v * LAG_S for v in fastest]))
        lasting = max(engine.end - now, 0.0)
        coming = [position.joints_at(engine.arm, engine.timeline, now + share * lasting) for share in COMING_SHARES]
        before, steady = pursuit.goal, pursuit.steady
        flange = compose(compose(frames.base, T_world_tool), inverse(frames.tool))
        held = pursuit.follow(flange, frames.tool, coming, pace)
        velocity = velocity_between(before, pursuit.goal, tick)
        if not (steady and pursuit.steady) or any(abs(v) > most for v, most in zip(velocity, fastest, strict=True)):
            velocity = (0.0,) * len(velocity)
        if now < engine.end or largest_change(coming[0], pursuit.goal) > REST_TOLERANCE:
            try:
                target = Target(pursuit.goal, velocity, *pursuit.range)
                engine.steer(target, tick, text=DRAGGING.text, issued=issued)
            # drop the target: the arm continues its previous motion, which ends without a contact
            except CollisionAhead as error:
                return Shortfall(held.away, held.turned, (Hold(Limit.CONTACT, which=error.detail),))
        return held
