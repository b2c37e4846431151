"""The trajectory generation function f: a motion command edits the timeline.

f(theta; p, t, v; tau[k]) -> TimelineDelta. The motion in force at the execution time is truncated there and gives way
to the new one, which starts from the present position and velocity. Motions scheduled later stay: the next is planned
again from the new place to its own target, and so on as long as one blends into the next; from the first boundary
whose position and velocity are what they were, segments are only shifted in time.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from vrs_cli.engine.rates import joint_acceleration
from vrs_cli.engine.straight import SLOWEST, least_duration, line_stop, straight_segments
from vrs_cli.engine.targets import retarget
from vrs_cli.errors import MotionError, PathWithoutJoints, StreamIsOver
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints, largest_change
from vrs_cli.kinematics.transform import Transform, compose, distance, inverse
from vrs_cli.trajectory.delta import Cause, TimelineDelta
from vrs_cli.trajectory.instant import on_grid, up_to_grid
from vrs_cli.trajectory.laws.law import NoTimes
from vrs_cli.trajectory.laws.table import LAWS
from vrs_cli.trajectory.limits import JointLimits
from vrs_cli.trajectory.motion import Kind, Motion, Start
from vrs_cli.trajectory.segment import JointPath, Phase, Segment, rest, stay_inside
from vrs_cli.trajectory.state import JointState, ToolState
from vrs_cli.trajectory.timeline import Timeline

NEARLY_NOW = 1e-6  # [s] to which the instant is found at which a corner is near
STREAM_STAYS = "give a time after it, or end where it begins; with PARAMETER INSERT = OFF it is dropped"
SLOWER = 1e-3  # [s] by which rounding a corner may take longer than stopping in it
SAME_PLACE = 1e-9  # [rad, m] two places that are one


class Here(Struct, frozen=True):
    """Where the robot is and how it moves: the state from which a motion is planned.

    `tool` is T_robot_tool with its velocity, known when the robot is on a straight line, for the TOOL `T_flange_tool`.
    """

    joints: JointState
    tool: ToolState | None = None
    T_flange_tool: Transform | None = None

    def tool_state(self, arm: RobotArm, T_flange_tool: Transform) -> ToolState:
        """The state of the tip of a tool; by the Jacobian when it is not known."""
        if self.tool is not None and self.T_flange_tool == T_flange_tool:
            return self.tool
        q, qd = self.joints.joints, self.joints.velocity
        pose = compose(arm.forward(q), T_flange_tool)
        if self.joints.at_rest:
            return ToolState(pose, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        vx, vy, vz, wx, wy, wz = arm.twist(q, qd, T_flange_tool)
        if not self.joints.acceleration:
            return ToolState(pose, (vx, vy, vz), (wx, wy, wz))
        bias = arm.acceleration_bias(q, qd, T_flange_tool)
        rates = arm.twist(q, self.joints.acceleration, T_flange_tool)
        ax, ay, az, bx, by, bz = (a + b for a, b in zip(rates, bias, strict=True))
        return ToolState(pose, (vx, vy, vz), (wx, wy, wz), (ax, ay, az), (bx, by, bz))


def segment_joints(arm: RobotArm, segment: Segment, s: float) -> Joints:
    """Joints at t_s + s of a segment [rad].

    Raises PathWithoutJoints where none lead to the pose: never for what was planned, for that was decided before.
    """
    path = segment.path
    if isinstance(path, JointPath):
        return path.joints(s)
    flange = compose(path.pose(s), inverse(segment.motion.frames.tool))
    joints = arm.branch_joints(flange, path.configuration, path.seed(s))
    if joints is None:
        raise PathWithoutJoints(
            f"{s:.3f} s into {segment.motion.text or 'a motion'}",
            "the file may be damaged, or of a version that made such lines; UNDO the motion, or plan it again",
        )
    return joints


def state_at(arm: RobotArm, segment: Segment, s: float) -> Here:
    """Position, velocity and acceleration at t_s + s of a segment; at rest from its end on if it ends at rest.

    The acceleration is that of a jerk-limited motion, for the next one to carry on with. That of a motion with
    parabolic blends may jump, so it is not kept.
    """
    path = segment.path
    joints = segment_joints(arm, segment, s)
    smoothly = LAWS[segment.motion.profile].smooth
    if isinstance(path, JointPath):
        return Here(JointState(joints, path.velocity(s), path.acceleration(s) if smoothly else ()))
    (pose, twist), frame = path.state(s), segment.motion.frames.tool
    rates = path.twist_rate(s) if smoothly else (0.0,) * 6
    tool = ToolState(pose, twist[:3], twist[3:], rates[:3], rates[3:])
    still = (0.0,) * len(joints)
    if tool.at_rest:
        return Here(JointState(joints, still), tool, frame)
    velocity = arm.joint_velocity(joints, twist, frame)
    if not smoothly:
        return Here(JointState(joints, velocity), tool, frame)
    acceleration = joint_acceleration(arm, path, s, joints, velocity, frame)
    return Here(JointState(joints, velocity, acceleration), tool, frame)


def standing(here: Here) -> Here:
    """The same place, at rest."""
    joints = JointState(here.joints.joints, (0.0,) * len(here.joints.joints))
    if here.tool is None:
        return Here(joints)
    return Here(joints, ToolState(here.tool.pose, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), here.T_flange_tool)


# --- one motion ------------------------------------------------------------------------------------------------


def plan_motion(
    arm: RobotArm, here: Here, motion: Motion, start: float, slowest: float = SLOWEST
) -> tuple[Segment, ...]:
    """The segments of a motion that starts at `start` [s] from a state; it ends at rest. Where its own way does not go
    there out of a motion, it brakes first. Raises MotionError, NoRoomToStop.
    """
    try:
        return _PLANS[motion.kind](arm, here, motion, start, slowest)
    except NoWay:
        return _braked_first(arm, here, motion, start, slowest)


class NoWay(Exception):
    """A motion has no way that begins with the velocities that there are."""


def _plan_joint(arm: RobotArm, here: Here, motion: Motion, start: float, _slowest: float) -> tuple[Segment, ...]:
    assert motion.goal is not None
    limits = joint_limits(arm, motion)
    try:
        segments = LAWS[motion.profile].joint_motion(here.joints, motion.goal, limits, start, motion, motion.duration)
    except NoTimes as no_times:
        raise NoWay from no_times
    if here.joints.at_rest or stay_inside(segments, limits.lower, limits.upper):
        return segments or _there_already(here, start, motion)
    raise NoWay


def _plan_straight(arm: RobotArm, here: Here, motion: Motion, start: float, slowest: float) -> tuple[Segment, ...]:
    tool = here.tool_state(arm, motion.frames.tool)
    try:
        segments = straight_segments(arm, tool, here.joints, motion, start, slowest)
        return segments or _there_already(here, start, motion)
    except MotionError as error:
        if here.joints.at_rest:
            raise
        raise NoWay from error


def _there_already(here: Here, start: float, motion: Motion) -> tuple[Segment, ...]:
    """A motion that has nothing to do keeps its place on the timeline: it may have, once an earlier one changes."""
    return (rest(here.joints.joints, 0.0, start, motion),)


def _plan_rest(_arm: RobotArm, here: Here, motion: Motion, start: float, _slowest: float) -> tuple[Segment, ...]:
    if here.joints.at_rest:
        return (rest(here.joints.joints, on_grid(motion.duration), start, motion),)
    raise NoWay


def _plan_steered(_arm: RobotArm, _here: Here, _motion: Motion, _start: float, _slowest: float) -> tuple[Segment, ...]:
    """Raises StreamIsOver."""
    raise StreamIsOver("its targets came one by one, from the place where the arm was then", STREAM_STAYS)


_PLANS = {
    Kind.JOINT: _plan_joint,
    Kind.STRAIGHT: _plan_straight,
    Kind.REST: _plan_rest,
    Kind.STEERED: _plan_steered,
}


def joint_limits(arm: RobotArm, motion: Motion) -> JointLimits:
    """Joint velocities and accelerations at the motion's fractions of them; jerks as the robot has them."""
    model = arm.model
    return JointLimits(
        tuple(v * motion.speed for v in model.max_velocity),
        tuple(a * motion.acceleration for a in model.max_acceleration),
        model.max_jerk,
        model.max_velocity,
        model.lower,
        model.upper,
    )


def hardest_limits(arm: RobotArm) -> JointLimits:
    """All that the joints can, whatever speed and acceleration a motion has."""
    model = arm.model
    most = model.max_velocity
    return JointLimits(most, model.max_acceleration, model.max_jerk, most, model.lower, model.upper)


def _braked_first(arm: RobotArm, here: Here, motion: Motion, start: float, slowest: float) -> tuple[Segment, ...]:
    """Come to rest on the present way, which stays inside all limits, then go. Raises NoRoomToStop."""
    stop = _stopped_on_line(arm, here, motion, start) or braked(arm, here.joints, motion, start)
    last = stop[-1]
    place = standing(state_at(arm, last, last.duration))
    return stop + plan_motion(arm, place, motion, last.finish, slowest)


def _stopped_on_line(arm: RobotArm, here: Here, motion: Motion, start: float) -> tuple[Segment, ...]:
    """To rest on the straight line that the tool moves on; nothing where it moves on none, or cannot."""
    if here.tool is None or here.T_flange_tool != motion.frames.tool:
        return ()
    try:
        return line_stop(arm, here.tool, here.joints, motion, start)
    except MotionError:
        return ()


def braked(arm: RobotArm, state: JointState, motion: Motion, start: float) -> tuple[Segment, ...]:
    """To rest, on a way that stays inside all limits. Raises NoRoomToStop."""
    limits = hardest_limits(arm)
    for stop in LAWS[motion.profile].joint_stops(state, limits, start, motion):
        if stay_inside(stop, limits.lower, limits.upper):
            return stop
    raise NoRoomToStop


class NoRoomToStop(Exception):
    """No way of braking keeps every joint in its range: the motion that is interrupted has to go on."""


# --- continuous path -------------------------------------------------------------------------------------------


def slowing_down(segments: Timeline | list[Segment]) -> list[Segment]:
    """The last segments of a timeline, or of a part of it, in which the last motion slows down."""
    found: list[Segment] = []
    for index in range(len(segments) - 1, -1, -1):
        segment = segments[index]
        if segment.phase is not Phase.DECELERATE or (found and segment.motion.number != found[0].motion.number):
            break
        found.insert(0, segment)
    return found


def rounding_begins(arm: RobotArm, slowing: Sequence[Segment], rounding: float | None) -> float:
    """When a motion begins that blends into one that slows down so [s]: then, or once the tip is within `rounding`
    [m] of the place where that one would end.

    From there on the path is another, and at that instant the tip is that near.
    """
    last = slowing[-1]
    if rounding is None:
        return slowing[0].start
    if rounding <= SAME_PLACE:
        return last.finish
    corner = _tip(arm, last, last.duration)
    for segment in slowing:
        if distance(_tip(arm, segment, segment.duration), corner) <= rounding:
            return _arrival(arm, segment, corner, rounding)
    return last.finish


def _arrival(arm: RobotArm, segment: Segment, corner: Transform, near: float) -> float:
    """When the tip comes within `near` [m] of a place that it is so near to when the segment ends."""
    low, high = 0.0, segment.duration
    if distance(_tip(arm, segment, low), corner) <= near:
        return segment.start
    while high - low > NEARLY_NOW:
        middle = 0.5 * (low + high)
        if distance(_tip(arm, segment, middle), corner) <= near:
            high = middle
        else:
            low = middle
    return min(up_to_grid(segment.start + high), segment.finish)


def _tip(arm: RobotArm, segment: Segment, s: float) -> Transform:
    return compose(arm.forward(segment_joints(arm, segment, s)), segment.motion.frames.tool)


class Departure(Struct, frozen=True):
    """When a motion may begin [s], and the state then."""

    begin: float
    here: Here


def plan_corner(
    arm: RobotArm, moving: Departure, resting: Departure, motion: Motion, slowest: float = SLOWEST
) -> tuple[Segment, ...]:
    """A motion that rounds the corner where the one before would end; where that would take longer, it begins once the
    arm stands there. Raises MotionError where it is possible from neither.
    """
    try:
        rounded = _PLANS[motion.kind](arm, moving.here, motion, moving.begin, slowest)
    except NoWay:
        return plan_motion(arm, resting.here, motion, resting.begin, slowest)
    latest = rounded[-1].finish - SLOWER
    try:
        if latest <= resting.begin + _least_duration(arm, resting.here, motion):
            return rounded
        stopped = plan_motion(arm, resting.here, motion, resting.begin, slowest)
    except MotionError:
        return rounded
    return stopped if stopped[-1].finish < latest else rounded


def _least_duration(arm: RobotArm, here: Here, motion: Motion) -> float:
    """A time that a motion from rest takes at least [s], known at once. Raises MotionError."""
    if motion.kind is not Kind.STRAIGHT:
        return 0.0
    return least_duration(arm, here.tool_state(arm, motion.frames.tool), here.joints, motion)


# --- the edit --------------------------------------------------------------------------------------------------


def plan(
    arm: RobotArm,
    timeline: Timeline,
    motion: Motion,
    issued: float,
    executed: float,
    *,
    insert: bool = True,
    slowest: float = SLOWEST,
) -> TimelineDelta:
    """f: the change of the timeline that lets `motion` start at `executed` [s].

    `insert` false: what was scheduled after it is dropped. Raises MotionError when the motion, or a scheduled one that
    would have to be planned again, is not possible; the message names the latter.
    """
    place, new = _begun(arm, timeline, motion, executed, slowest)
    begin = new[0].start
    if insert:
        replanned = _Rescheduling(arm, timeline, place, new, slowest).result()
    else:
        replanned = Replanned(new, len(timeline) - place.keep, 0.0)
    return TimelineDelta(
        version=timeline.version,
        cause=Cause.COMMAND,
        motion=motion,
        issued=issued,
        executed=begin if motion.start is Start.BLEND else executed,
        cut=begin,
        keep=place.keep,
        drop=replanned.drop,
        shift=replanned.shift,
        segments=replanned.segments,
    )


class Place(Struct, frozen=True):
    """Where a time cuts the timeline: after `keep` segments, the state then, and the motion that is interrupted.

    That is the motion of the first segment that ends later, also when it would begin just then: the later command
    counts. None in a gap and after the end.
    """

    keep: int
    here: Here
    interrupted: Motion | None


def place_at(arm: RobotArm, timeline: Timeline, t: float) -> Place:
    keep = timeline.index_at(t) + 1
    while keep > 1 and timeline[keep - 1].start >= t and timeline[keep - 1].duration > 0.0:
        keep -= 1  # of segments of no length those at t have happened
    segment = timeline[keep - 1]
    here = state_at(arm, segment, min(t - segment.start, segment.duration))
    if segment.finish > t:
        return Place(keep, here, segment.motion)
    if keep == len(timeline) or timeline[keep].start > t:
        return Place(keep, standing(here), None)
    moving = not state_at(arm, timeline[keep], 0.0).joints.at_rest
    return Place(keep, here if moving else standing(here), timeline[keep].motion)


def _begun(
    arm: RobotArm, timeline: Timeline, motion: Motion, executed: float, slowest: float
) -> tuple[Place, tuple[Segment, ...]]:
    """Where a motion cuts the timeline, and its segments: out of what is under way, or once the arm stands."""
    place = place_at(arm, timeline, executed)
    if motion.start is Start.BLEND and place.interrupted is not None:
        corner, end = _next_rest(arm, timeline, place.keep)
        new = plan_corner(arm, Departure(executed, place.here), Departure(end, corner.here), motion, slowest)
        return place if new[0].start == executed else corner, new
    try:
        return place, plan_motion(arm, place.here, motion, executed, slowest)
    except NoRoomToStop:
        place, begin = _next_rest(arm, timeline, place.keep)
        return place, plan_motion(arm, place.here, motion, begin, slowest)


def _next_rest(arm: RobotArm, timeline: Timeline, keep: int) -> tuple[Place, float]:
    """The first place and time at which the robot stands after the first `keep` segments have begun."""
    while True:
        segment = timeline[keep - 1]
        if keep == len(timeline) or timeline[keep].start > segment.finish:
            break
        if state_at(arm, timeline[keep], 0.0).joints.at_rest:
            break
        keep += 1
    return Place(keep, standing(state_at(arm, segment, segment.duration)), None), segment.finish


class Replanned(Struct, frozen=True):
    """What comes in place of `drop` old segments; those after them move by `shift`."""

    segments: tuple[Segment, ...]
    drop: int
    shift: float


class _Rescheduling:
    """What becomes of the motions that were scheduled after the new one."""

    def __init__(
        self,
        arm: RobotArm,
        old: Timeline,
        cut: Place,
        new: tuple[Segment, ...],
        slowest: float,
    ) -> None:
        self.arm, self.old, self.cut, self.slowest = arm, old, cut, slowest
        self.planned = list(new)
        self.end = new[-1].finish  # of what is planned
        self.place = self._rest_of(new)  # where the robot is then
        self.index = self._after(cut.interrupted, cut.keep) if cut.interrupted else cut.keep

    def result(self) -> Replanned:
        while self.index < len(self.old):
            following = self.old[self.index]
            if self._unchanged(following):
                return Replanned(
                    tuple(self.planned), self.index - self.cut.keep, self._begin(following) - following.start
                )
            self._plan_again(following)
        return Replanned(tuple(self.planned), self.index - self.cut.keep, 0.0)

    def _after(self, motion: Motion, index: int) -> int:
        """The first segment from `index` on that serves another motion."""
        while index < len(self.old) and self.old[index].motion.number == motion.number:
            index += 1
        return index

    def _rest_of(self, segments: tuple[Segment, ...]) -> Here:
        last = segments[-1]
        return standing(state_at(self.arm, last, last.duration))

    def _unchanged(self, following: Segment) -> bool:
        """Whether a motion begins as before: at rest, in the same place."""
        before = state_at(self.arm, following, 0.0).joints
        return before.at_rest and largest_change(self.place.joints.joints, before.joints) <= SAME_PLACE

    def _begin(self, following: Segment) -> float:
        """When a motion that starts from rest begins."""
        if following.motion.start is Start.AT or not (self.cut.interrupted or self.index > self.cut.keep):
            return max(following.start, self.end)
        return self.end + following.start - self.old[self.index - 1].finish

    def _plan_again(self, following: Segment) -> None:
        after = self._after(following.motion, self.index)
        motion = self.old[after - 1].motion  # not of its first segment, a stop of another profile where it braked first
        try:
            motion = retarget(self.arm, motion, self.place.joints.joints)
            segments = self._segments(motion, following)
        except MotionError as error:
            when_again = f"when {motion.text or 'the next motion'}, scheduled later, is planned again"
            raise error.reworded(f"{when_again}: {error.detail}") from None
        self._end_at(segments[0].start)
        self.planned += segments
        self.end, self.place = segments[-1].finish, self._rest_of(segments)
        self.index = after

    def _segments(self, motion: Motion, following: Segment) -> tuple[Segment, ...]:
        """The segments of a motion: out of the one before where it blends into that, or interrupts it."""
        resting = Departure(self._begin(following), self.place)
        if self._blends(motion):
            begin = rounding_begins(self.arm, slowing_down(self.planned), motion.rounding)
            return plan_corner(self.arm, self._departure(begin), resting, motion, self.slowest)
        if self._interrupts(following):
            moving = self._departure(following.start)
            try:
                return plan_motion(self.arm, moving.here, motion, moving.begin, self.slowest)
            except NoRoomToStop:
                pass
        return plan_motion(self.arm, resting.here, motion, resting.begin, self.slowest)

    def _blends(self, motion: Motion) -> bool:
        return motion.start is Start.BLEND and self.planned[-1].phase is Phase.DECELERATE

    def _interrupts(self, following: Segment) -> bool:
        """Whether a motion begins at its own time in the middle of the one before, and that is still under way then."""
        if following.motion.start is not Start.AT or not self.planned:
            return False
        if state_at(self.arm, following, 0.0).joints.at_rest:
            return False
        number = self.old[self.index - 1].motion.number
        begins = next((segment.start for segment in self.planned if segment.motion.number == number), None)
        return begins is not None and begins < following.start < self.end

    def _departure(self, begin: float) -> Departure:
        """A time at which what is planned is under way, and the state then."""
        planned = self.planned
        segment = next((segment for segment in reversed(planned) if segment.start < begin), planned[0])
        return Departure(begin, state_at(self.arm, segment, min(begin - segment.start, segment.duration)))

    def _end_at(self, begin: float) -> None:
        """What is planned ends at that time."""
        planned = self.planned
        while planned and planned[-1].start >= begin < planned[-1].finish:
            planned.pop()
        if planned and planned[-1].finish > begin:
            planned[-1] = planned[-1].truncated(begin)
