"""Read the executed steps of a run from its timeline, as a list that does not depend on any language; `writers` writes
the steps in other languages. The steps are motions, waits, and events with their times. Units are metres, radians and
seconds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby, zip_longest
from math import dist, hypot

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.engine.position import position_at
from vrs_cli.engine.problem import segment_joints
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.kinematics.transform import position as tip
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import FIRST_INPUT, HAND, Event, Frames, Motion, MotionKind, Start

SAME_TIME = 1e-6  # [s] times that differ by no more count as equal
SAME_PLACE = 1e-7  # [rad, m] joint positions that differ by no more count as equal
MIN_BLEND = 1e-4  # [m] minimum distance for a blend; a smaller one is written as a stop
SAMPLES = 9  # number of samples in each segment from which maxima are taken


class RunStep(Struct, frozen=True, kw_only=True):
    """A step that happened at `time` [s]. `late`: for a step during a motion, its time relative to the motion [s]:
    positive after the start of the next motion, negative before the end of the last motion; 0 for other steps."""

    time: float
    late: float = 0.0


class MoveStep(RunStep, frozen=True):
    """A motion: joint-interpolated, or a straight line of the tool tip.

    It ends at `joints`, with the tool at `T_world_tool` relative to BASE; if it was interrupted, these describe the
    point of the interruption. `end`: when the motion ends or is interrupted [s]. `rounded`: the next motion begins
    while this one slows down. `blend`: the distance between the tip and the target when the next motion begins
    [m]; 0 for a stop. `motion`: the command. Maxima during the motion: `joint_rate`, as a fraction of the joints'
    maximum velocity; `axis_speed` and `axis_acceleration` of the joint with the longest travel; `tip_speed`,
    `tip_acceleration` and `turn_speed` of the tool.
    """

    straight: bool
    joints: Joints
    T_world_tool: Transform
    end: float
    motion: Motion
    cut: bool = False
    rounded: bool = False
    blend: float = 0.0
    joint_rate: float = 0.0
    axis_speed: float = 0.0
    axis_acceleration: float = 0.0
    tip_speed: float = 0.0
    tip_acceleration: float = 0.0
    turn_speed: float = 0.0


class FramesStep(RunStep, frozen=True):
    """A change of TOOL and BASE."""

    frames: Frames


class SignalStep(RunStep, frozen=True):
    """A change of an output."""

    number: int
    on: bool


class HandStep(RunStep, frozen=True):
    """A motion of the hand to `opening` (0 closed, 1 open), which takes `duration` [s]."""

    opens: bool
    opening: float
    duration: float


class InputStep(RunStep, frozen=True):
    """A reading of an input by the program. `on`: the value that was read. `waited`: how long the program had waited
    for the input [s]."""

    number: int
    on: bool
    waited: float = 0.0


class WaitStep(RunStep, frozen=True):
    """A time of `seconds` in which the robot was at rest."""

    seconds: float


class ExecutedRun(Struct, frozen=True):
    """A run: its start and its steps. `inputs`: the changes of input signals (time [s], signal, state)."""

    arm: RobotArm
    start: Joints
    frames: Frames
    steps: tuple[RunStep, ...]
    inputs: tuple[tuple[float, int, bool], ...] = ()

    @property
    def moves(self) -> Iterator[MoveStep]:
        return (step for step in self.steps if isinstance(step, MoveStep))


def executed_run(arm: RobotArm, timeline: Timeline) -> ExecutedRun:
    """Read the steps of a run from its timeline."""
    initial, *motions = (list(found) for _, found in groupby(timeline, key=lambda segment: segment.motion.number))
    builder = StepBuilder(arm, timeline, motions, initial[0].motion.frames)
    inputs, on = list[tuple[float, int, bool]](), dict[int, bool]()
    # sensors of a cell change inputs without events, so recorded readings are used for their states
    for event in timeline.events:
        if event.channel >= FIRST_INPUT and on.get(event.channel, False) is not event.value > 0.0:
            on[event.channel] = event.value > 0.0
            inputs.append((event.time, event.channel, event.value > 0.0))
    steps, start = tuple(_without_polling(builder.steps())), segment_joints(arm, initial[0], 0.0)
    return ExecutedRun(arm, start, initial[0].motion.frames, steps, tuple(inputs))


class StepBuilder:
    """A builder of the list of steps of a timeline. `motions`: the segments of the timeline, grouped by motion."""

    def __init__(self, arm: RobotArm, timeline: Timeline, motions: Sequence[Sequence[Segment]], frames: Frames) -> None:
        self.arm, self.timeline, self.motions, self.frames = arm, timeline, motions, frames
        self.opening = 0.0  # current opening of the hand
        self.clock = timeline.start  # [s] time up to which the steps are complete
        self.events = [e for e in timeline.events if e.observed is (e.channel >= FIRST_INPUT)]

    def steps(self) -> Iterator[RunStep]:
        """Yield all steps in the order in which they are written."""
        found = [self._move(*pair) for pair in zip_longest(self.motions, self.motions[1:])]
        moves, waiting = _without_overlaps(found), list(self.events)
        for segments, move in zip(self.motions, moves, strict=True):
            begin, end = segments[0].start, segments[-1].finish
            while waiting and self._belongs_before(waiting[0], segments[0], move):
                yield from self._event(waiting.pop(0), move)
            yield from self._wait(begin)
            frames = segments[0].motion.frames
            if frames != self.frames:
                self.frames = frames
                yield FramesStep(time=begin, frames=frames)
            if move is not None:
                yield move
                self.clock = end
                while waiting and waiting[0].time < end - SAME_TIME:
                    event = waiting.pop(0)
                    yield self._step_of(event, late=event.time - end)
        for event in waiting:
            yield from self._event(event, None)
        yield from self._wait(self.timeline.last)

    def _belongs_before(self, event: Event, first: Segment, move: MoveStep | None) -> bool:
        """Return whether an event is written before a motion. A change of an output during the motion is written before
        it if it happens in the first half of the motion. An event at the start of the motion is written in the order of
        the commands."""
        if abs(event.time - first.start) <= SAME_TIME:
            return move is not None or event.number <= first.motion.number
        if event.time < first.start or move is None or event.channel >= FIRST_INPUT:
            return event.time < first.start
        return event.time - move.time < move.end - event.time

    def _event(self, event: Event, move: MoveStep | None) -> Iterator[RunStep]:
        """Yield the step of an event. If the robot was at rest before the event, yield a wait first."""
        if move is not None and event.time > move.time + SAME_TIME:
            yield from self._wait(move.time)
            yield self._step_of(event, late=event.time - move.time)
            return
        # a program that waited for an input reads it as soon as it changes
        if event.observed and event.duration == 0.0:
            yield self._step_of(event, waited=max(event.time - self.clock, 0.0))
            self.clock = max(self.clock, event.time)
            return
        yield from self._wait(event.time)
        yield self._step_of(event)

    def _step_of(self, event: Event, *, late: float = 0.0, waited: float = 0.0) -> RunStep:
        on = event.value > 0.0
        if event.channel == HAND:
            opens = event.value > self.opening or event.value == 1.0
            self.opening = event.value
            return HandStep(opens, event.value, event.duration, time=event.time, late=late)
        if event.channel >= FIRST_INPUT:
            return InputStep(event.channel, on, waited, time=event.time, late=late)
        return SignalStep(event.channel, on, time=event.time, late=late)

    def _wait(self, until: float) -> Iterator[WaitStep]:
        if until > self.clock + SAME_TIME:
            yield WaitStep(time=self.clock, seconds=until - self.clock)
            self.clock = until

    def _move(self, segments: Sequence[Segment], following: Sequence[Segment] | None) -> MoveStep | None:
        """Return the step of a motion; None if the robot was at rest in it."""
        first, last = segments[0], segments[-1]
        motion, arm = first.motion, self.arm
        if all(segment.phase is Phase.REST for segment in segments):
            return None
        begun, reached = segment_joints(arm, first, 0.0), segment_joints(arm, last, last.duration)
        goal = self._goal(motion, last, reached)
        short = max(abs(a - b) for a, b in zip(goal, reached, strict=True)) > SAME_PLACE
        slows = following is not None and (following[0].motion.start is Start.BLEND or last.phase is Phase.DECELERATE)
        joints = goal if slows else reached
        pose, left = (
            compose(inverse(motion.frames.base), compose(arm.forward(q), motion.frames.tool)) for q in (joints, reached)
        )
        return MoveStep(
            motion.kind is MotionKind.STRAIGHT,
            joints,
            pose,
            last.finish,
            motion,
            short and not slows,
            short and slows,
            dist(tip(pose), tip(left)),
            *self._rates(segments, begun, joints),
            time=first.start,
        )

    def _goal(self, motion: Motion, last: Segment, reached: Joints) -> Joints:
        """Return the joints that a motion would reach if it were not interrupted; `reached` if its goal is unknown."""
        if motion.kind is MotionKind.JOINT and motion.goal is not None:
            return motion.goal
        if motion.pose is None or isinstance(last.path, JointPath):
            return reached
        flange = compose(motion.pose, inverse(motion.frames.tool))
        if max(abs(a - b) for a, b in zip(self.arm.forward(reached), flange, strict=True)) < SAME_PLACE:
            return reached
        found = self.arm.inverse_branch(flange, last.path.configuration, reached)
        return reached if found is None else found

    def _rates(self, segments: Sequence[Segment], begun: Joints, joints: Joints) -> tuple[float, ...]:
        """Return the maxima during a motion, in the order of the fields of MoveStep."""
        arm, tool, limits = self.arm, segments[0].motion.frames.tool, self.arm.model.max_velocity
        farthest = max(range(len(joints)), key=lambda i: abs(joints[i] - begun[i]) / limits[i])
        most = [0.0] * 6
        steady = [
            segment for segment in segments if segment.phase is not Phase.BLEND
        ]  # a blend would include the speed of the previous motion
        for segment in steady or segments:
            h, before = segment.duration / (SAMPLES - 1), None
            for k in range(SAMPLES if h > 0.0 else 0):
                at = position_at(arm, self.timeline, segment.start + k * h)
                if not at.moving:
                    continue
                vx, vy, vz, wx, wy, wz = arm.twist(at.joints, at.velocity, tool)
                speed = hypot(vx, vy, vz)
                rising = 0.0 if before is None else abs(speed - before) / h
                now = (
                    max(abs(v) / limit for v, limit in zip(at.velocity, limits, strict=True)),
                    abs(at.velocity[farthest]),
                    abs(at.acceleration[farthest]),
                    speed,
                    rising,
                    hypot(wx, wy, wz),
                )
                most, before = [max(a, b) for a, b in zip(most, now, strict=True)], speed
        return tuple(most)


def _without_polling(steps: Iterator[RunStep]) -> Iterator[RunStep]:
    """Yield the steps, with repeated readings of one input merged into one step: the last reading, with the time waited
    since the first."""
    held: list[RunStep] = []  # a reading of an input and the waits after it, not yielded yet
    for step in steps:
        first = held[0] if held else None
        if isinstance(step, InputStep) and isinstance(first, InputStep) and step.number == first.number:
            waited = sum(one.seconds for one in held if isinstance(one, WaitStep))
            held = [replace(step, waited=first.waited + waited + step.waited)]
        elif isinstance(step, WaitStep) and held:
            held.append(step)
        else:
            yield from held
            held = [step] if isinstance(step, InputStep) else []
            if not held:
                yield step
    yield from held


def _without_overlaps(moves: Sequence[MoveStep | None]) -> list[MoveStep | None]:
    """Return the moves with each blend limited to half the distance to the neighbouring targets, because controllers do
    not allow overlapping blends."""
    found, places = list(moves), [None if move is None else tip(move.T_world_tool) for move in moves]
    for k, move in enumerate(moves):
        here = places[k]
        if move is not None and here is not None and move.blend:
            near = (*places[max(k - 1, 0) : k], *places[k + 1 : k + 2])
            blend = min([move.blend, *(0.5 * dist(here, place) for place in near if place is not None)])
            found[k] = replace(move, blend=blend if blend >= MIN_BLEND else 0.0)
    return found
