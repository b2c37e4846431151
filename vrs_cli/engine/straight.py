"""Plan straight lines for the tool, and slow them down until every joint can follow.

A line that demands too much of the joints is slowed down as a whole. A line near a singularity that would have to be
slowed down too much is refused before it starts, with an error that names the position. If the arm has more joints than
the line needs, guides (conditions on sums of joints) determine the redundant joints.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import reduce
from itertools import chain, repeat
from math import ceil, dist, inf, sqrt
from operator import mul

from msgspec import structs

from vrs_cli.engine.boundary import Kinks, Stop, straighten_wrist, survey
from vrs_cli.engine.following import Follower, Sample, seeds_of
from vrs_cli.engine.load import ACCELERATION_MARGIN, ROUNDING, Load, StretchLoad
from vrs_cli.engine.problem import SLOWEST, Here, Problem, joint_acceleration, joints_on
from vrs_cli.errors import LocationOutOfRange, MotionError, StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.clearance import WRIST
from vrs_cli.kinematics.joints import Asked, Configuration, Joints, Walk
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import (
    Transform,
    at_position,
    axis_angle,
    compose,
    dot,
    inverse,
    position,
    rotation_about,
    vector_difference,
)
from vrs_cli.trajectory.laws.law import LAWS, NoTimes
from vrs_cli.trajectory.polynomial import bisect_interval, value
from vrs_cli.trajectory.segment import STILL, CartesianPath, Guide, Phase, Segment, ToolStretch, Turn, segments_of
from vrs_cli.trajectory.state import GuideState, JointState, ToolLimits, ToolState
from vrs_cli.values.commands import Motion

NEARLY_SINGULAR = 0.02  # singular measure (0: singular) of a start pose below which the error hints at the singularity
NEAR_START = 0.05  # [m] an error this near the start of a line may be due to a singular start pose
SLOWING_MARGIN = 1.001  # additional slowing beyond the necessary factor, so that a single reduction is enough
SAME_VELOCITY = 5e-7  # [rad/s] joint velocities closer than this are equal
SLOWING_FACTOR = 1.05  # additional slowing of a line that starts in motion: it keeps its start, so its load falls less
MAX_SLOWINGS = 6  # maximum number of attempts to slow down a line that starts in motion
INSTANT_STEPS = 50  # number of bisection steps to find the time at which the tool has covered a fraction of a line
SAME_TURN = 1e-6  # [rad] a turn smaller than this counts as none
NO_LENGTH = 1e-9  # [m] on a line shorter than this, the tool only turns
Seeds = tuple[Joints, ...]
Marks = tuple[float, ...]
# [m, rad] maximum step of a walk: a joint path along a line, with one possible motion of the redundant joints
WALK_STEP, WALK_TURN = 0.03, 0.15
MIN_WALK_STEPS = 6  # minimum number of steps of a walk
WALK_FACTORS = (1, 5)  # factors on the number of steps of walks; 5 is tried if no walk with factor 1 leads to a line

_new = tuple.__new__


def straight_segments(problem: Problem) -> tuple[Segment, ...]:
    """Plan a straight-line motion to its pose.

    Raises LocationOutOfRange or JointOutOfRange if the line leaves the reach; StraightLineSingular if the joints could
    follow only at less than 1/`slowest` of the speed, or cannot continue from their current velocities; NotInTime.
    """
    try:
        return _segments_to(problem)
    except MotionError as failure:
        turned = _turned_as_it_can_be(problem)
        if turned is None:
            raise
        try:
            segments = _segments_to(structs.replace(problem, motion=structs.replace(problem.motion, pose=turned)))
        except MotionError:
            raise failure from None
        return tuple(structs.replace(segment, motion=problem.motion) for segment in segments)


def _turned_as_it_can_be(problem: Problem) -> Transform | None:
    """Return the goal pose turned to the nearest orientation that the joint ranges allow, for an arm that cannot reach
    every orientation. A uniform turn to that pose may be possible even if the arm cannot follow the line with the best
    possible orientation at each point. None for other arms, and if the goal itself is in reach.
    """
    motion, tool = problem.motion, problem.motion.frames.tool
    steady = problem.arm.for_tool(tool).steady
    if steady is None or motion.pose is None:
        return None
    T_robot_flange = compose(motion.pose, inverse(tool))
    q = steady.within_ranges(T_robot_flange, problem.here.joints.joints)
    if q is None or steady.missing_turn(q, T_robot_flange) < SAME_TURN:
        return None
    return compose(problem.arm.forward(q), tool)


def _segments_to(problem: Problem) -> tuple[Segment, ...]:
    """Plan a line in the first configuration and with the first guides for which it is possible. If there are none,
    raise the first error.
    """
    arm, joints, state = problem.arm, problem.here.joints.joints, problem.tool
    failure: MotionError | None = None
    for configuration in arm.line_ways(joints):
        for guided in guided_states(problem, state, _goal(problem, state)):
            try:
                return _Line(problem, guided, configuration).segments()
            except MotionError as error:
                failure = failure or error
    assert failure is not None
    assert problem.motion.pose is not None
    T_robot_flange = compose(problem.motion.pose, inverse(problem.motion.frames.tool))
    if arm.beyond(T_robot_flange) if arm.hand is None else not any(arm.branches(T_robot_flange)):
        try:  # no alternative can help if the end of the line is out of reach
            arm.for_tool(problem.motion.frames.tool).select(T_robot_flange, joints)
        except LocationOutOfRange as beyond:
            raise beyond.reworded(place=failure.place) from None
    begins = failure.place is None or dist(failure.place, position(state.pose)) < NEAR_START
    if state.at_rest and begins and _nearly_singular(arm, joints):
        as_ready = ", as READY is" if _nearly_singular(arm, arm.model.poses["ready"]) else ""
        raise failure.reworded(hint=f"the line starts in a singular pose{as_ready}: {{MOVE}} away from it first")
    raise failure


def _goal(problem: Problem, state: ToolState) -> Transform:
    """Return T_robot_tool at the end of the line."""
    pose = problem.motion.pose or state.pose
    if problem.arm.model.task.turns:
        return pose
    # the orientation of the tool is not part of the task, so the line keeps it
    return at_position(state.pose, *position(pose))


def least_duration(problem: Problem) -> float:
    """Return a lower bound of the duration [s] of a line from rest: it follows from the limits of the tool, and from
    the joint accelerations with which the line begins and ends.

    Return 0 for an arm with redundant joints, and for an arm that may replace the goal of a line.
    """
    arm, motion, state = problem.arm, problem.motion, problem.tool
    if arm.redundancy or arm.for_tool(motion.frames.tool).steady is not None:
        return 0.0
    law, limits, goal = LAWS[motion.profile], tool_limits(arm, motion), _goal(problem, state)
    stretches = law.straight_motion(state, goal, limits, motion.duration)
    loads, q, most, tool = [1.0], problem.here.joints.joints, arm.model.max_acceleration, motion.frames.tool
    arm, configuration, still = arm.for_tool(tool), arm.line_ways(q)[0], (0.0,) * len(q)
    # joints must be able to start, and to stop at the end, with the accelerations of parabolic blends
    for index, pose in ((0, state.pose), (-1, goal)) if stretches and not law.smooth else ():
        stretch = stretches[index]
        path, s = _path(stretch, configuration, (q,), 1.0), -index * stretch.duration
        joints = joints_on(arm, path, s, compose(pose, inverse(tool)), q)
        with suppress(StraightLineSingular):
            rates = still if joints is None else joint_acceleration(arm, path, s, joints, still, tool)
            loads += [ACCELERATION_MARGIN * abs(rate) / limit for rate, limit in zip(rates, most, strict=True)]
    return sqrt(max(loads)) * sum([one.duration for one in stretches])


def _path(stretch: ToolStretch, configuration: Configuration, seeds: Seeds, seed_interval: float) -> CartesianPath:
    """Return the path of a stretch, without guides."""
    turns = tuple([_new(Turn, turn) for turn in stretch.turns])
    return CartesianPath(stretch.position, stretch.orientation, turns, configuration, seeds, seed_interval)


def _nearly_singular(arm: RobotArm, joints: Joints) -> bool:
    return min(arm.singularity(joints)) < NEARLY_SINGULAR


def tool_limits(arm: RobotArm, motion: Motion) -> ToolLimits:
    """Return the limits of the tool in a motion: the nominal speeds and accelerations multiplied by the fractions that
    the motion requests.
    """
    model = arm.model
    return ToolLimits(
        model.linear_speed * motion.speed if motion.tip_speed is None else motion.tip_speed,
        model.linear_acceleration * motion.acceleration,
        model.angular_speed * (motion.speed if motion.rotation is None else motion.rotation),
        model.angular_acceleration * motion.acceleration,
        model.linear_jerk,
        model.angular_jerk,
    )


class _Line:
    """A straight-line motion in one configuration, which is being planned; or (`stops`) a stop on the current line of
    the tool.
    """

    def __init__(
        self, problem: Problem, state: ToolState, configuration: Configuration, *, stops: bool = False
    ) -> None:
        arm, motion = problem.arm, problem.motion
        self.problem, self.arm, self.motion, self.configuration = problem, arm, motion, configuration
        self.state, self.joints = state, problem.here.joints
        self.limits, self.least = guide_limits(arm.model, motion, state, tool_limits(arm, motion)), motion.duration
        self.law, self.stops = LAWS[motion.profile], stops
        self.first_sample: Sample | None = None  # the same for all attempts
        self.follower = Follower(arm, configuration, motion.frames.tool, motion.frames.base, problem.slowest)
        if not arm.model.task.turns:
            self.state = structs.replace(state, spin=STILL, spin_rate=STILL)
        self.goal = straighten_wrist(self.follower, state.pose if stops else _goal(problem, state))

    def segments(self) -> tuple[Segment, ...]:
        """Plan the segments. A line that starts in motion is planned again with lower limits until the joints can
        follow it.
        """
        if self.state.at_rest:
            return self._from_rest()
        slowed, closely = 1.0, False
        for _ in range(MAX_SLOWINGS):
            stretches = self._stretches(self.limits)
            seeds, loads = self._follow(stretches, self._marks_in_motion(stretches) if closely else ())
            load = _worst(loads)
            if not closely and load.slowing <= 1.0 + ROUNDING and any(marks := self._marks_in_motion(stretches)):
                closely, (seeds, loads) = True, self._follow(stretches, marks)
                load = _worst(loads)
            if load.slowing <= 1.0 + ROUNDING:
                return self._segments(stretches, seeds)
            # lower the limits of the phase that exceeded them: the blend, slowing down, or the speed
            blend, cruise, slow = (
                _worst(load for stretch, load in zip(stretches, loads, strict=True) if stretch.phase is phase)
                for phase in (Phase.BLEND, Phase.CRUISE, Phase.DECELERATE)
            )
            by_velocity = _easing(max(blend.velocity, cruise.velocity, slow.velocity, sqrt(cruise.acceleration)))
            by_acceleration, by_jerk = _easing(slow.acceleration), _easing(slow.jerk)
            limits = self.limits.slow_down(by_velocity, by_acceleration, by_jerk)
            self.limits = limits.ease_blend(
                _easing(blend.acceleration) / by_acceleration, _easing(blend.jerk) / by_jerk
            )
            self.least *= by_velocity
            slowed *= by_velocity
            if slowed > self.problem.slowest:
                break
        self._marks_in_motion(stretches)  # raises MotionError if the line is impossible
        raise self._too_singular(load)

    def _from_rest(self) -> tuple[Segment, ...]:
        """Plan a straight line that starts at rest. If it must be slower, scale the duration of the whole motion once,
        by an exactly computed factor; the path stays the same.
        """
        stretches = self._stretches(self.limits)
        pose, goal = self.state.pose, self.goal
        axis, angle = self.state.turn_to(goal)
        x, y, z = ((a, b - a) for a, b in zip(position(pose), position(goal), strict=True))
        turns = (Turn(axis, (0.0, angle)),) if angle else ()
        # the line as a function of the covered fraction (0 to 1) in place of time
        line = CartesianPath((x, y, z), pose, turns, self.configuration, (self.joints.joints,), 1.0)
        try:
            found = survey(self.follower, line, 1.0)
            kinks = Kinks(self.follower, line, found.touches) if found.touches else None
            stops = kinks.stops(self.joints.joints) if kinks else []
        except MotionError:
            self._follow(stretches)  # may raise the error of an earlier point of the line
            raise
        if stops:
            return self._in_parts(stops)
        if kinks:
            self.goal = kinks.end_on_boundary()
            stretches = self._stretches(self.limits)
        seeds, loads = self._follow(stretches, self._instants(stretches, found.marks))
        load = _worst(loads)
        if load.slowing > 1.0:
            if load.slowing > self.problem.slowest:
                raise self._too_singular(load)
            factor = load.slowing * SLOWING_MARGIN
            self.least *= factor
            stretches = self._stretches(self.limits.slow_down(factor, factor * factor, factor * factor * factor))
            if len(stretches) != len(seeds):  # the stretches differ: a very short cruise has appeared or disappeared
                seeds, _ = self._follow(stretches, self._instants(stretches, found.marks))
        return self._segments(stretches, seeds)

    # --- the boundary of the reach ---

    def _in_parts(self, stops: list[Stop]) -> tuple[Segment, ...]:
        """Plan the line in several parts, each from rest to rest, with the given stops between them."""
        done, joints, pose, start = 0.0, self.joints.joints, self.state.pose, self.problem.begin
        still = (0.0,) * len(joints)
        segments: list[Segment] = []
        for stop in (*stops, Stop(1.0, self.goal)):
            motion = structs.replace(self.motion, pose=stop.pose, duration=self.motion.duration * (stop.part - done))
            problem = Problem(self.arm, Here(JointState(joints, still)), motion, start, self.problem.slowest)
            part = _Line(problem, ToolState(pose, STILL, STILL), self.configuration)
            segments += [structs.replace(segment, motion=self.motion) for segment in part.segments()]
            start, path = segments[-1].finish, segments[-1].path
            assert isinstance(path, CartesianPath)
            done, joints, pose = stop.part, path.seeds[-1], stop.pose
        return tuple(segments)

    def _marks_in_motion(self, stretches: list[ToolStretch]) -> list[Marks]:
        """Return, for each stretch, the instants that need a sample. Raises MotionError if the line leaves the reach or
        touches a boundary.
        """
        marks = []
        for stretch in stretches:
            path, lasting = self._path(stretch, (self.joints.joints,)), stretch.duration
            found = survey(self.follower, path, lasting)
            for touch in found.touches:
                # a rest at a singular wrist is checked by the samples
                rests = stretch is stretches[-1] and touch[1:] == (lasting, WRIST)
                if touch[:2] != (0.0, lasting) and not rests:  # a stretch that is on the boundary as a whole is allowed
                    raise self.follower.refuse_kink(path, touch.begin, touch.end, self.joints.joints)
            marks.append(found.marks)
        return marks

    def _instants(self, stretches: list[ToolStretch], parts: Marks) -> list[Marks]:
        """Return, for each stretch, the instants at which the tool has covered the fractions `parts` of the line."""
        marks = []
        for stretch in stretches:
            lasting = stretch.duration
            inside = [
                part for part in parts if self._part_done(stretch, 0.0) < part < self._part_done(stretch, lasting)
            ]
            marks.append(tuple(self._instant(stretch, part) for part in inside))
        return marks

    def _instant(self, stretch: ToolStretch, part: float) -> float:
        """Return the instant of a stretch at which the tool has covered this fraction of the line."""
        return bisect_interval(lambda s: self._part_done(stretch, s) < part, 0.0, stretch.duration, INSTANT_STEPS)[1]

    def _part_done(self, stretch: ToolStretch, s: float) -> float:
        """Return the fraction of the line that the tool has covered at an instant of a stretch."""
        begin = position(self.state.pose)
        way = vector_difference(position(self.goal), begin)
        square = dot(way, way)
        if square > NO_LENGTH * NO_LENGTH:
            x, y, z = (value(a, s) for a in stretch.position)
            return dot(vector_difference((x, y, z), begin), way) / square
        _, angle = self.state.turn_to(self.goal)
        return value(stretch.turns[-1][1], s) / angle if stretch.turns and angle else 0.0

    def _stretches(self, limits: ToolLimits) -> list[ToolStretch]:
        """Return the stretches of the tool's motion within limits.

        Raises NotInTime if the motion already takes too long, since the joint limits can only make it longer.
        """
        try:
            if self.stops:
                return self.law.straight_stop(self.state, limits)
            stretches = self.law.straight_motion(self.state, self.goal, limits, self.least)
        except NoTimes:
            raise StraightLineSingular(
                "the tool moves too fast to go over to the line within its limits",
                "use {MOVE}, or let the arm come to rest first",
            ) from None
        self.problem.check_in_time(self.problem.begin + sum([stretch.duration for stretch in stretches]))
        return stretches

    def _follow(self, stretches: list[ToolStretch], marks: Iterable[Marks] = ()) -> tuple[list[Seeds], list[Load]]:
        """Return the seeds and the maximum joint load of each stretch. `marks`: additional instants to sample in each
        stretch.
        """
        seeds, loads, followed, started = [], [], [], Joints()
        before, near = self.first_sample, self.joints.joints
        for stretch, instants in zip(stretches, chain(marks, repeat(())), strict=False):
            path = self._path(stretch, (near,))
            samples = self.follower.samples(path, stretch.duration, near, self.law.samples, before, instants)
            followed.append((path, stretch.duration, samples))
            # the line must continue the current joint velocities; at a singular pose it may not be able to
            if not started:
                self.first_sample, started = samples[0], samples[0].velocity
                jumps = [abs(w - v) for v, w in zip(self.joints.velocity, started, strict=True)]
                if max(jumps) > SAME_VELOCITY:
                    joint = jumps.index(max(jumps)) + 1
                    raise StraightLineSingular(
                        f"joint {joint} would have to change its speed in no time, where the line starts",
                        "use {MOVE}, or let the arm come to rest first",
                        joint=joint,
                    )
            asked = StretchLoad(self.follower, path, samples, closely=bool(instants))
            loads.append(asked.smooth(started) if self.law.smooth else asked.parabolic(started))
            seeds.append(seeds_of(samples, self.follower.widest, self.arm.seed_step))
            before, near = samples[-1], samples[-1].joints
        # other arms have closed-form inverse kinematics, or no proof exists
        if self.follower.arm.continuation is not None:
            from vrs_cli.engine.continuity import check_continuous, leading_seeds

            proved = check_continuous(self.follower.arm.continuation, self.follower, followed)
            seeds = [leading_seeds(self.follower, one, own) for one, own in zip(proved, seeds, strict=True)]
        return seeds, loads

    def _too_singular(self, load: Load) -> StraightLineSingular:
        """Return the error for a line that would have to be slowed down too much: with position, joint and hint."""
        assert load.at is not None
        path, s = load.at
        wanted = f"joint {load.joint} would have to move {load.slowing:.0f} times too fast"
        return self.follower.refuse(path, s, wanted, load.joint)

    def _segments(self, stretches: list[ToolStretch], seeds: list[Seeds]) -> tuple[Segment, ...]:
        rows = zip(stretches, seeds, strict=True)
        paths = ((stretch.duration, stretch.phase, self._path(stretch, seeds)) for stretch, seeds in rows)
        return segments_of(self.problem.begin, self.motion, paths)

    def _path(self, stretch: ToolStretch, seeds: Seeds) -> CartesianPath:
        path = _path(stretch, self.configuration, seeds, stretch.duration / max(len(seeds) - 1, 1))
        if not stretch.guides:
            return path
        rows = zip(self.state.guides, stretch.guides, strict=True)
        return structs.replace(path, guides=tuple(Guide(guide.weights, value) for guide, value in rows))


def line_stop(problem: Problem) -> tuple[Segment, ...]:
    """Plan a stop on the current line of the tool, whatever speed the motion requests. Raises MotionError."""
    arm, motion = problem.arm, problem.motion
    problem = structs.replace(problem, slowest=SLOWEST)
    state = next(guided_states(problem, problem.tool, problem.tool.pose))
    stop = _Line(problem, state, arm.line_ways(problem.here.joints.joints)[0], stops=True)
    stop.limits = tool_limits(arm, structs.replace(motion, speed=1.0, acceleration=1.0, tip_speed=None, rotation=None))
    return stop.segments()


def _worst(loads: Iterable[Load]) -> Load:
    return reduce(Load.worse, loads, Load())


def _easing(load: float) -> float:
    """Return the factor by which to slow down for a load.

    A line that starts in motion keeps its start, so the factor is greater than the load.
    """
    return load * SLOWING_FACTOR if load > 1.0 + ROUNDING else 1.0


def guided_states(problem: Problem, state: ToolState, goal: Transform) -> Iterator[ToolState]:
    """Yield the tool's state with guides for the line to the pose `goal` (T_robot_tool): one state for each possible
    motion of the redundant joints, the best first.

    Yield the state itself if no joint is redundant.
    """
    arm = problem.arm
    if not arm.redundancy:
        yield state
        return
    T_tool_flange, begin = inverse(problem.motion.frames.tool), problem.here.joints
    swivel, none = problem.motion.swivel, True
    asked: Asked = ()
    if swivel is not None:
        i = swivel.joint - 1
        asked = ((i, begin.joints[i] if swivel.value is None else swivel.value),)
    for finer in WALK_FACTORS:
        poses = [compose(pose, T_tool_flange) for pose in _poses(state.pose, goal, finer)]
        for walk in arm.walks(begin.joints, poses, asked):
            none = False
            yield structs.replace(state, guides=_guides(begin, walk))
    if none:
        # No continuous joint path reaches the goal. Keep the shortest one anyway: a later check rejects the line with a
        # specific error.
        yield structs.replace(state, guides=_guides(begin, arm.shortest_walk(begin.joints, poses, asked)))


def _poses(begin: Transform, goal: Transform, finer: int) -> Iterator[Transform]:
    """Yield poses of a tool along a line, from its start to its end. `finer`: factor on the number of steps."""
    axis, angle = axis_angle(compose(inverse(begin), goal))
    p, q = position(begin), position(goal)
    steps = finer * max(ceil(dist(p, q) / WALK_STEP), ceil(angle / WALK_TURN), MIN_WALK_STEPS)
    for k in range(steps + 1):
        part = k / steps
        turned = compose(begin, rotation_about(axis, part * angle)) if angle else begin
        yield at_position(turned, *(a + part * (b - a) for a, b in zip(p, q, strict=True)))


def _guides(state: JointState, walk: Walk) -> tuple[GuideState, ...]:
    """Return the conditions on the redundant joints (`Guide`) that a walk (a possible motion of these joints) fixes,
    with their current values and rates.
    """
    still = (0.0,) * len(state.joints)
    columns = state.joints, state.velocity, state.acceleration or still
    return tuple(
        GuideState(weights, at, end, rate, acceleration)
        for weights, end in zip(walk.weights, walk.ends, strict=True)
        for at, rate, acceleration in [[float(sum(map(mul, weights, column))) for column in columns]]
    )


def guide_limits(model: RobotModel, motion: Motion, state: ToolState, limits: ToolLimits) -> ToolLimits:
    """Return the limits, completed by the limits of the guides (weighted sums of joints that determine how redundant
    joints move) in this motion. A guide may change as fast as the joints could change it if nothing else moved them.
    """
    if not state.guides:
        return limits
    speed, acceleration, jerk = (
        min([a / abs(w) for guide in state.guides for a, w in zip(most, guide.weights, strict=True) if w] or [inf])
        for most in (model.max_velocity, model.max_acceleration, model.max_jerk)
    )
    return structs.replace(
        limits, guide=speed * motion.speed, guide_acceleration=acceleration * motion.acceleration, guide_jerk=jerk
    )
