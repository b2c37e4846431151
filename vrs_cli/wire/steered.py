"""Encode a steering delta (the effect of one target of a stream) in short form: only the motion of the joints in one
tick. The motion after the tick, until the next target, is computed.

A receiver that has the timeline before the delta takes the position and the velocity at the start of the tick from it,
and plans the rest by the same law (`Law.replay_steering`). A checksum over all numbers verifies that the result is
equal bit by bit.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from functools import partial
from struct import pack

from msgspec import structs

from vrs_cli.engine.approximation import joint_pieces, known_tolerance
from vrs_cli.engine.planner import cut_at
from vrs_cli.engine.single_motion import joint_limits
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform
from vrs_cli.trajectory.instant import TICK, TICKS_PER_SECOND
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Path, Segment
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.commands import Motion, MotionKind
from vrs_cli.wire import records


class SteeredRecord(records.StrictRecord, frozen=True):
    """One target of a stream. `executed` [s]: the time at which it takes effect; `tick` [2^-30 s]: its duration;
    `rates`: for each joint the final velocity if the profile has no jerk limits, otherwise the jerk; `crc`: the
    checksum of all numbers of the segments, as IEEE 754 doubles. `motion` is absent if it is the last motion of the
    timeline."""

    version: records.Count
    executed: records.Time
    tick: records.Count
    rates: records.Joints
    crc: records.Count
    motion: records.MotionRecord | None = None


def steered_record(delta: TimelineDelta, before: Timeline, arm: RobotArm) -> SteeredRecord | None:
    """Return a delta in short form for receivers that have the timeline before it; None if it is not a steering delta,
    or cannot be restored exactly from the short form."""
    motion, segments = delta.motion, delta.segments
    rates = LAWS[motion.profile].steering_of(segments) if motion.kind is MotionKind.STEERED and segments else None
    if rates is None or delta.cause is not Cause.COMMAND:
        return None
    tick = round(segments[0].duration * TICKS_PER_SECOND)
    again, crc = _plan_again(motion, delta.executed, tick, rates, before, arm), _checksum(segments)
    if again != delta or _checksum(again.segments) != crc:
        return None
    record = None if before[len(before) - 1].motion == motion else records.Motions().reference(motion)
    assert not isinstance(record, int)
    return SteeredRecord(before.version, delta.executed, tick, rates, crc, record)


def steered_delta(
    record: SteeredRecord, before: Timeline, arm: RobotArm, form: records.Form, first: int = 0
) -> TimelineDelta:
    """Return the delta in full. `before`: the timeline to which it applies, without its first `first` segments. Raises
    RecordError if the result differs from what was sent; the receiver then requests the full form."""
    motion = before[len(before) - 1].motion if record.motion is None else records.Motions().resolve(record.motion, form)
    if motion.kind is not MotionKind.STEERED or len(record.rates) != form.joint_count or not record.tick:
        raise records.RecordError("a target of steering for a motion, or a robot, that has none")
    if record.executed * TICKS_PER_SECOND % 1.0:
        raise records.RecordError(f"{record.executed!r} s is no multiple of 2^-30 s")
    if record.version != before.version or record.executed < before.start:
        raise records.RecordError(
            f"a target of steering for timeline version {record.version}, not for {before.version}"
        )
    try:
        delta = _plan_again(motion, record.executed, record.tick, record.rates, before, arm)
    except (ArithmeticError, ValueError):  # the record has numbers that no robot can have
        delta = None
    if delta is None or _checksum(delta.segments) != record.crc:
        raise records.RecordError(
            "a target of steering has become something else: it was made by another version of vrs"
        )
    return delta if not first else structs.replace(delta, keep=delta.keep + first)


def _plan_again(
    motion: Motion, executed: float, tick: int, rates: records.Joints, before: Timeline, arm: RobotArm
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
    """Return a checksum of all numbers of the segments, over their bits."""
    numbers: list[float] = []
    for segment in segments:
        numbers += (segment.start, segment.finish)
        if isinstance(segment.path, JointPath):
            for row in segment.path.coefficients:
                numbers += row
    return zlib.crc32(pack(f"<{len(numbers)}d", *numbers))


MAX_REMEMBERED = 4000  # maximum number of cached segments, enough for four long snapshots

Key = tuple[Path, float, Transform, float]


class LinePieces:
    """Computes the pieces of joint trajectories along the straight-line segments of one arm, and caches them, because
    the same segments occur in deltas, snapshots and windows."""

    def __init__(self, arm: RobotArm) -> None:
        self._arm = arm
        self._remembered: dict[Key, tuple[records.PieceRecord, ...]] = {}

    def within(self, tolerance: float | None) -> records.Pieces:
        """Return a function that returns the pieces of a segment. They differ from g, the exact position, by at most
        `tolerance` [rad, m]; None: the function returns no pieces. Raises IllegalValue."""
        return records.no_pieces if tolerance is None else partial(self._of, known_tolerance(tolerance))

    def count_late(self, segments: Sequence[Segment], tolerance: float, most: int) -> int:
        """Return how many segments, counted from the last, can be sent with the pieces of their joint trajectories if
        the pieces of at most `most` straight lines may be computed now; the pieces of the others must be cached."""
        for count, segment in enumerate(reversed(segments)):
            most -= isinstance(segment.path, CartesianPath) and _key(segment, tolerance) not in self._remembered
            if most < 0:
                return max(count, 1)
        return len(segments)

    def _of(self, tolerance: float, segment: Segment) -> tuple[records.PieceRecord, ...]:
        if not isinstance(segment.path, CartesianPath):
            return ()
        key = _key(segment, tolerance)
        if (found := self._remembered.get(key)) is None:
            found = tuple([records.PieceRecord(*piece) for piece in joint_pieces(self._arm, segment, tolerance)])
            self._remembered[key] = found
            if len(self._remembered) > MAX_REMEMBERED:
                del self._remembered[next(iter(self._remembered))]
        return found


def _key(segment: Segment, tolerance: float) -> Key:
    return segment.path, segment.duration, segment.motion.frames.tool, tolerance
