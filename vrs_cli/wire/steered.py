"""Deltas of steering in short: what the joints do in one tick. What comes after it, until the next target, follows.

Who has the timeline before such a delta has the place and the velocity that the tick begins with, and makes the rest of
it by the law that made it (`Law.replay_steering`). A checksum over the numbers says that it has become the same to the
bit.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from struct import pack

from vrs_cli.engine.planner import cut_at
from vrs_cli.engine.single_motion import joint_limits
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.trajectory.instant import TICK, TICKS_PER_SECOND
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.segment import JointPath, Segment
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.motion import Motion, MotionKind
from vrs_cli.wire.records import Count, Form, Joints, MotionRecord, Motions, RecordError, StrictRecord, Time


class SteeredRecord(StrictRecord, frozen=True):
    """One target of a stream. `executed`: when [s]; `tick`: for how long [2^-30 s]; `rates`: what each joint does then
    (the velocity that it comes to, for a profile without jerk limits, else its jerk); `crc`: of all numbers of the
    segments, as IEEE 754 doubles. `motion` is absent when it is the one that the timeline ends with.
    """

    version: Count
    executed: Time
    tick: Count
    rates: Joints
    crc: Count
    motion: MotionRecord | None = None


def steered_record(delta: TimelineDelta, before: Timeline, arm: RobotArm) -> SteeredRecord | None:
    """A delta in short, for those who have the timeline before it; None where it is none of steering, or where what
    follows is not all that the joints do.
    """
    motion, segments = delta.motion, delta.segments
    rates = LAWS[motion.profile].steering_of(segments) if motion.kind is MotionKind.STEERED and segments else None
    if rates is None or delta.cause is not Cause.COMMAND:
        return None
    tick = round(segments[0].duration * TICKS_PER_SECOND)
    again, crc = _steered(motion, delta.executed, tick, rates, before, arm), _checksum(segments)
    if again != delta or _checksum(again.segments) != crc:
        return None
    known = before[len(before) - 1].motion == motion
    record = None if known else Motions().reference(motion)
    assert not isinstance(record, int)
    return SteeredRecord(before.version, delta.executed, tick, rates, crc, record)


def steered_delta(record: SteeredRecord, before: Timeline, arm: RobotArm, form: Form, first: int = 0) -> TimelineDelta:
    """The delta in full. `before`: the timeline that it is for, from its segment number `first` on. Raises RecordError
    where it does not become what it was; who has that has to ask for the full form.
    """
    motion = before[len(before) - 1].motion if record.motion is None else Motions().resolve(record.motion, form)
    if motion.kind is not MotionKind.STEERED or len(record.rates) != form.joint_count or not record.tick:
        raise RecordError("a target of steering for a motion, or a robot, that has none")
    if record.executed * TICKS_PER_SECOND % 1.0:
        raise RecordError(f"{record.executed!r} s is no multiple of 2^-30 s")
    if record.version != before.version or record.executed < before.start:
        raise RecordError(f"a target of steering for timeline version {record.version}, not for {before.version}")
    try:
        delta = _steered(motion, record.executed, record.tick, record.rates, before, arm)
    except (ArithmeticError, ValueError):  # of numbers that no robot has
        delta = None
    if delta is None or _checksum(delta.segments) != record.crc:
        raise RecordError("a target of steering has become something else: it was made by another version of vrs")
    return delta if not first else TimelineDelta(*delta[:6], delta.keep + first, *delta[7:])


def _steered(
    motion: Motion, executed: float, tick: int, rates: Joints, before: Timeline, arm: RobotArm
) -> TimelineDelta:
    place = cut_at(arm, before, executed)
    law, limits = LAWS[motion.profile], joint_limits(arm, motion)
    segments = law.replay_steering(place.here.joints, rates, limits, tick * TICK, executed, motion)
    return TimelineDelta(
        version=before.version,
        cause=Cause.COMMAND,
        motion=motion,
        issued=executed,
        executed=executed,
        cut=executed,
        keep=place.keep,
        drop=len(before) - place.keep,
        shift=0.0,
        segments=segments,
    )


def _checksum(segments: Iterable[Segment]) -> int:
    """The same for all segments that are equal to the bit."""
    numbers: list[float] = []
    for segment in segments:
        numbers += (segment.start, segment.finish)
        if isinstance(segment.path, JointPath):
            for row in segment.path.coefficients:
                numbers += row
    return zlib.crc32(pack(f"<{len(numbers)}d", *numbers))
