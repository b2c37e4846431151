"""Find what a motion demands of the arm, and what a change does to the timeline. EXPLAIN shows these findings, which
are data. The segments are those of the planner f. Joint motions are polynomials, whose peaks are known exactly. Along a
straight line the rates of g are sampled, more closely around each peak.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from operator import attrgetter
from typing import NamedTuple

from msgspec import structs

from vrs_cli.engine.book import Book
from vrs_cli.engine.planner import cut_at
from vrs_cli.engine.position import position_at, rates_in
from vrs_cli.engine.problem import joint_acceleration_and_jerk, segment_joints
from vrs_cli.engine.reach import Standpoint, reach_of
from vrs_cli.engine.single_motion import hardest_limits, joint_limits
from vrs_cli.engine.straight import tool_limits
from vrs_cli.errors import StraightLineSingular, UsageError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Vector, compose, inverse, length, position
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.polynomial import derivative, third_derivative, turning_points
from vrs_cli.trajectory.segment import JointPath, Segment
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values import replies
from vrs_cli.values.commands import MotionKind, PoseTarget
from vrs_cli.values.replies import SegmentFate, SplicedSegment

SEGMENT_SAMPLES = 33  # number of samples of a segment
PEAK_SAMPLES, PEAK_ROUNDS = 9, 2  # number of samples around a peak in each round, and number of rounds
DERIVATIVES = 4  # samples include the extremes of the joints and of their first three derivatives
NEAR_PEAK = 0.02  # a segment may contain the peak if a sample is within this fraction of the largest sample
ROWS_AROUND = 3  # number of segments shown before and after a change


class Sample(NamedTuple):
    """The joints at a time within a segment, their rates [rad/s, rad/s2, rad/s3], the speed of the tool tip [m/s] and
    the turning rate of the tool [rad/s].
    """

    q: Joints
    velocity: Joints
    acceleration: Joints
    jerk: Joints
    speed: float
    turn: float


Measure = Callable[[Sample], float]


def _sampler(arm: RobotArm, segment: Segment) -> Callable[[float], Sample]:
    """Return a function that samples a segment at a time since its start [s]."""
    path, tool = segment.path, segment.motion.frames.tool
    none = (0.0,) * arm.model.joint_count
    smooth = LAWS[segment.motion.profile].smooth

    def on_joints(s: float) -> Sample:
        assert isinstance(path, JointPath)
        q, v = path.joints(s), path.velocity(s)
        jerk = tuple([third_derivative(a, s) for a in path.coefficients]) if smooth else none
        twist = arm.twist(q, v, tool)
        return Sample(q, v, path.acceleration(s), jerk, length(twist[:3]), length(twist[3:]))

    def on_line(s: float) -> Sample:
        assert not isinstance(path, JointPath)
        q = segment_joints(arm, segment, s)
        v, a = rates_in(arm, segment, s, q)
        jerk = none
        if smooth:
            try:
                _, jerk = joint_acceleration_and_jerk(arm, path, s, q, v, tool)
            except StraightLineSingular:  # rates are not defined where a line begins or ends in a singular pose
                jerk = none
        twist = path.twist(s)
        return Sample(q, v, a, jerk, length(twist[:3]), length(twist[3:]))

    return on_joints if isinstance(path, JointPath) else on_line


class _Course:
    """A segment with its samples in order of time."""

    def __init__(self, arm: RobotArm, segment: Segment) -> None:
        self.segment = segment
        self.sample = cache(_sampler(arm, segment))
        lasting, path = segment.duration, segment.path
        self.times = {lasting * k / (SEGMENT_SAMPLES - 1) for k in range(SEGMENT_SAMPLES)}
        rows = path.coefficients if isinstance(path, JointPath) else ()
        for _ in range(DERIVATIVES):  # also sample where joints and their rates turn back
            self.times.update(s for row in rows for s in turning_points(row, lasting))
            rows = tuple(derivative(row) for row in rows)
        self.samples = [(s, self.sample(s)) for s in sorted(self.times)]

    def greatest_sample(self, measure: Measure) -> float:
        """Return the maximum of a measure over the samples."""
        return max(measure(sample) for _, sample in self.samples)

    def greatest(self, measure: Measure) -> tuple[float, float]:
        """Return the maximum of a measure, located more closely than by the samples, and its first time since the start
        of the segment [s].
        """
        rows = [(s, measure(sample)) for s, sample in self.samples]
        for _ in range(PEAK_ROUNDS):
            place = max(range(len(rows)), key=lambda k: rows[k][1])
            around = rows[max(place - 1, 0) : place + 2]
            first, last = around[0][0], around[-1][0]
            times = (first + (last - first) * k / (PEAK_SAMPLES - 1) for k in range(PEAK_SAMPLES))
            rows = sorted({*around, *((s, measure(self.sample(s))) for s in times)})
        s, value = max(rows, key=lambda row: row[1])
        return value, s

    @property
    def way(self) -> float:
        """The length of the path of the tool tip [m]: the integral of the speed of the tip, by Simpson's rule between
        samples.
        """
        return sum(
            (b - a) / 6.0 * (first.speed + 4.0 * self.sample(0.5 * (a + b)).speed + second.speed)
            for (a, first), (b, second) in pairwise(self.samples)
        )


def _peak(courses: Sequence[_Course], measure: Measure) -> tuple[float, float]:
    """Return the maximum of a measure over several segments, and its first time on the timeline [s]."""
    greatest = [course.greatest_sample(measure) for course in courses]
    near = max(greatest) - NEAR_PEAK * abs(max(greatest))
    found = [
        (course.greatest(measure), course.segment.start)
        for course, value in zip(courses, greatest, strict=True)
        if value >= near
    ]
    (value, s), start = max(found, key=lambda one: one[0][0])
    return value, start + s


def motion_plan(arm: RobotArm, before: Timeline, delta: TimelineDelta) -> replies.MotionPlan:
    """Explain how a planned change of a timeline executes the motion for which it was planned."""
    after, motion = before.apply(delta), delta.motion
    own = [segment for segment in delta.segments if segment.motion.number == motion.number]
    courses = [_Course(arm, segment) for segment in own]
    begin, end = own[0].start, own[-1].finish
    last = position_at(arm, after, end)
    asked = tool_limits(arm, motion).speed if motion.kind is MotionKind.STRAIGHT else 0.0
    limits = hardest_limits(arm) if motion.kind is MotionKind.STRAIGHT else joint_limits(arm, motion)

    def place(t: float) -> Vector:
        return position(position_at(arm, after, t).T_world_tool)

    def peak(measure: Measure, limit: float) -> replies.Peak:
        value, time = _peak(courses, measure)
        return replies.Peak(value, limit, time, place(time))

    smooth = LAWS[motion.profile].smooth

    def load(i: int) -> replies.JointLoad:
        velocity = peak(lambda sample: abs(sample.velocity[i]), limits.velocity[i])
        acceleration = peak(lambda sample: abs(sample.acceleration[i]), limits.acceleration[i])
        jerk = peak(lambda sample: abs(sample.jerk[i]), limits.jerk[i]) if smooth else None
        above = peak(lambda sample: sample.q[i], limits.upper[i])
        below = peak(lambda sample: -sample.q[i], -limits.lower[i])
        nearest = above
        if below.limit - below.value < above.limit - above.value:
            nearest = replies.Peak(-below.value, limits.lower[i], below.time, below.place)
        return replies.JointLoad(i + 1, velocity, acceleration, jerk, nearest)

    return replies.MotionPlan(
        begin,
        end,
        motion.kind.space,
        motion.profile.value.upper(),
        motion.speed,
        motion.acceleration,
        _cut_in(arm, before, delta),
        tuple(_stretch(course, limits.velocity) for course in courses),
        peak(lambda sample: sample.speed, asked),
        tuple(map(load, range(arm.model.joint_count))),
        sum(course.way for course in courses),
        last.joints,
        last.T_world_tool,
        arm.configuration(last.joints),
        tuple(place(course.segment.start + s) for course in courses for s, _ in course.samples),
    )


def _stretch(course: _Course, velocity: Joints) -> replies.Stretch:
    """Describe a segment: its greatest speeds, and the joint that comes nearest to its velocity limit."""
    segment = course.segment

    def share_of(i: int) -> Measure:
        return lambda sample: abs(sample.velocity[i]) / velocity[i]

    shares = [course.greatest_sample(share_of(i)) for i in range(len(velocity))]
    joint = shares.index(max(shares))
    share, _ = course.greatest(share_of(joint))
    speed, turn = (course.greatest(attrgetter(name))[0] for name in ("speed", "turn"))
    space = "joint" if isinstance(segment.path, JointPath) else "straight"
    number = joint + 1 if share else 0
    return replies.Stretch(segment.start, segment.finish, segment.phase.value, space, speed, turn, number, share)


def _cut_in(arm: RobotArm, before: Timeline, delta: TimelineDelta) -> replies.CutIn | None:
    """Return the motion that the change interrupts; None if the arm is at rest when the change begins."""
    place = cut_at(arm, before, delta.cut)
    if place.interrupted is None or place.here.joints.at_rest:
        return None
    segment, s = before.locate(delta.cut)
    motion = segment.motion
    return replies.CutIn(
        motion.number, motion.text, segment.phase.value, segment.start, _sampler(arm, segment)(s).speed
    )


# --- inverse kinematics ----------------------------------------------------------------------------------------------


def inverse_report(stand: Standpoint, target: PoseTarget, text: str) -> replies.InverseReport:
    """Return the joints of a location in each configuration, with the steps of the closed form."""
    reach, frames, here = reach_of(stand, target), stand.before.frames, stand.here
    T_robot_flange = compose(compose(frames.base, target.T_world_tool), inverse(frames.tool))
    arm = stand.arm.for_tool(frames.tool)
    solutions = []
    for option in reach.options:
        way = option.configuration
        # joints that the closed form leaves free keep these values
        steps = arm.branch_steps(T_robot_flange, way, option.joints or arm.middle)
        near = arm.inverse_branch(T_robot_flange, way, here) if option.usable else None
        time = None if near is None else arm.shortest_time(here, near)
        solutions.append(replies.SolutionSteps(option, steps, time))
    return replies.InverseReport(
        text,
        arm.method,
        T_robot_flange,
        arm.constants,
        tuple(solutions),
        reach.chosen,
        reach.reason,
        here,
        stand.configuration,
        arm.senses,
        arm.model.units,
    )


# --- the last change of the timeline ---------------------------------------------------------------------------------


def splice(book: Book) -> replies.SpliceReport:
    """Report what the last change did to the segments. Raises UsageError if nothing has changed yet, or if the last
    change is no longer in memory.
    """
    timeline, history = book.timeline, book.history
    last = book.deltas[-1] if len(book.deltas) else None
    undone = history.undone[-1] if history.undone else None
    if last is not None and last.cause is Cause.UNDO and undone is not None:
        return _splice_report(timeline.apply(undone.step.present(timeline.version)), timeline, last)
    step = next((one for one in reversed(history.done) if not one.is_record), None)
    if step is None:
        raise UsageError("no command that is known has changed the timeline", "give a motion first")
    cause = Cause.COMMAND if last is None else last.cause
    return _splice_report(
        timeline.apply(step.taking_back(timeline.version)), timeline, structs.replace(step.delta, cause=cause)
    )


def _splice_report(before: Timeline, after: Timeline, delta: TimelineDelta) -> replies.SpliceReport:
    """Report how a delta replaced segments of the timeline `before` by segments of the timeline `after`."""
    planned, tail = len(delta.segments), delta.keep + delta.drop
    rows = list[SplicedSegment]()
    first = max(delta.keep - ROWS_AROUND, 1)  # the first segment is the initial pose
    for index in range(first, delta.keep):
        old, new = before[index], after[index]
        rows.append(_row(old, new, SegmentFate.CUT if new.finish < old.finish else SegmentFate.KEPT))
    rows += [_row(before[index], None, SegmentFate.DROPPED) for index in range(delta.keep, tail)]
    for segment in delta.segments:
        own = segment.motion.number == delta.motion.number
        fate = SegmentFate.BACK if delta.cause is Cause.UNDO else SegmentFate.PLANNED if own else SegmentFate.AGAIN
        rows.append(_row(None, segment, fate))
    rest = len(before) - tail
    for index in range(tail, tail + min(rest, ROWS_AROUND)):
        new = after[index - tail + delta.keep + planned]
        rows.append(_row(before[index], new, SegmentFate.SHIFTED if delta.shift else SegmentFate.KEPT))
    return replies.SpliceReport(
        delta.motion.text,
        "" if delta.cause is Cause.COMMAND else delta.cause.value.upper(),
        delta.issued,
        delta.executed,
        delta.cut,
        delta.shift,
        tuple(rows),
        first - 1,
        max(rest - ROWS_AROUND, 0),
    )


def _row(old: Segment | None, new: Segment | None, fate: SegmentFate) -> SplicedSegment:
    segment = old or new
    assert segment is not None
    motion = segment.motion
    before, after = (None if one is None else (one.start, one.finish) for one in (old, new))
    return SplicedSegment(motion.number, motion.text, segment.phase.value, motion.kind.space, before, after, fate)
