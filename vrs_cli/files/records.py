"""The lines of a trajectory file as msgspec records, and the way between them and the values they stand for.

A field that holds its default is not written. `docs/trajectory-file.md` describes every key.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import copysign, hypot
from operator import mul
from typing import Annotated, Any, Literal, cast

import msgspec
from msgspec import Struct

from vrs_cli.kinematics.configuration import Arm, Configuration, Elbow, Flag, Wrist
from vrs_cli.kinematics.profile import Profile
from vrs_cli.kinematics.transform import IDENTITY, Transform
from vrs_cli.trajectory.delta import Cause, TimelineDelta
from vrs_cli.trajectory.instant import LATEST, TICKS_PER_SECOND
from vrs_cli.trajectory.motion import (
    AlignedTarget,
    Frames,
    JointOffsetTarget,
    Kind,
    Motion,
    RelativeTarget,
    Start,
    ToolOffsetTarget,
)
from vrs_cli.trajectory.polynomial import Polynomial
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Path, Phase, Segment, Turn

FORMAT = 1
NEEDS = {Kind.JOINT: "goal", Kind.STEERED: "goal", Kind.STRAIGHT: "pose"}  # to be planned again
UNITS = {"length": "m", "angle": "rad", "time": "s"}

LARGEST = 1e15  # of any number: what is reckoned from it stays finite
DEGREE = 3  # of a polynomial, at most
ORTHONORMAL = 1e-6  # products of the axes of a rotation

Number = Annotated[float, msgspec.Meta(ge=-LARGEST, le=LARGEST)]
Time = Annotated[float, msgspec.Meta(ge=-2.0 * LATEST, le=2.0 * LATEST)]
Numbers = Annotated[tuple[Number, ...], msgspec.Meta(min_length=1)]
Coefficients = Annotated[tuple[Number, ...], msgspec.Meta(min_length=1, max_length=DEGREE + 1)]
Row = tuple[Number, Number, Number, Number]
Rows = tuple[Row, Row, Row]
Axis = tuple[Number, Number, Number]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
Fraction = Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
Rate = Annotated[float, msgspec.Meta(gt=0.0, le=LARGEST)]
Length = Annotated[float, msgspec.Meta(ge=0.0, le=LARGEST)]
Duration = Annotated[float, msgspec.Meta(ge=0.0, le=LATEST)]


class Record(msgspec.Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True):
    """Keys in the order of the fields; an unknown key is refused."""


class FramesRecord(Record, frozen=True):
    base: Rows | None = None
    tool: Rows | None = None


class RelativeRecord(Record, frozen=True):
    """DRIVE: `joint` and `change`; DEPART: `offset`; ALIGN: `aligned`, true."""

    joint: Count | None = None
    change: Number | None = None
    offset: Rows | None = None
    aligned: bool | None = None


class MotionRecord(Record, frozen=True):
    number: Count
    kind: Kind
    start: Start
    text: str = ""
    goal: tuple[Number, ...] | None = None
    pose: Rows | None = None
    speed: Fraction | None = None
    acceleration: Fraction | None = None
    tip_speed: Rate | None = None
    rotation: Rate | None = None
    duration: Duration | None = None
    hand: Number | None = None
    frames: FramesRecord | None = None
    relative: RelativeRecord | None = None
    profile: Profile | None = None
    rounding: Length | None = None


class TurnRecord(Record, frozen=True):
    axis: Axis
    angle: Coefficients


class LineRecord(Record, frozen=True):
    """A Cartesian path."""

    position: tuple[Coefficients, Coefficients, Coefficients]
    orientation: Rows
    turns: tuple[TurnRecord, ...]
    arm: Literal["RIGHTY", "LEFTY"] | None  # null: the robot has no such choice
    elbow: Literal["ABOVE", "BELOW"] | None
    wrist: Literal["NOFLIP", "FLIP"] | None
    seeds: Annotated[tuple[Numbers, ...], msgspec.Meta(min_length=1)]
    seed_interval: Number


class SegmentRecord(Record, frozen=True):
    """`motion` is absent when it is the motion of the delta; exactly one of `joints` and `line` is there."""

    start: Time
    finish: Time
    phase: Phase
    motion: Count | MotionRecord | None = None
    joints: tuple[Coefficients, ...] | None = None
    line: LineRecord | None = None


class DeltaRecord(Record, frozen=True):
    version: Count
    motion: Count | MotionRecord
    issued: Number
    executed: Number
    cut: Time
    keep: Count
    drop: Count
    segments: tuple[SegmentRecord, ...]
    shift: Time | None = None
    cause: Cause | None = None


class HeaderRecord(msgspec.Struct, frozen=True, omit_defaults=True):
    """The first line; keys that a later version may add are passed over. `crc` says that every line has its checksum,
    which `files/checksum.py` puts there and takes away."""

    vrst: Count
    vrs: str
    units: dict[str, str]
    robot: dict[str, Any]
    initial: tuple[SegmentRecord, ...]
    crc: str | None = None


class Form(Struct, frozen=True):
    """What the paths of a robot have: so many joints, and a configuration of these."""

    joint_count: int
    ways: frozenset[Configuration]


class Fault(Struct, frozen=True):
    """What is wrong in a file, and the line that says so."""

    line: int
    what: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.what}"


class RecordError(ValueError):
    """A record that is well formed but cannot be; the message says why."""


class Motions(dict[int, Motion]):
    """The motions that a file has written in full so far: what a bare number in a later line means."""

    def reference(self, motion: Motion) -> int | MotionRecord:
        """The number when the file knows exactly this motion already; else all of it, known from now on."""
        known = self.get(motion.number)
        if known is motion or known == motion:
            return motion.number
        self[motion.number] = motion
        return _motion_record(motion)

    def resolve(self, reference: int | MotionRecord, form: Form) -> Motion:
        """The motion meant. Raises RecordError."""
        if isinstance(reference, MotionRecord):
            motion = _motion(reference, form)
            self[motion.number] = motion
            return motion
        if reference not in self:
            raise RecordError(f"motion {reference} is referred to but not described before")
        return self[reference]


# --- from values to records -----------------------------------------------------------------------------


def segment_records(segments: Iterable[Segment], motions: Motions, owner: Motion | None) -> tuple[SegmentRecord, ...]:
    """`owner`: the motion of the delta, to which its segments need not refer."""
    return tuple(_segment_record(segment, motions, owner) for segment in segments)


def delta_record(delta: TimelineDelta, motions: Motions) -> DeltaRecord:
    """One line. `motions` learns what the line describes."""
    motion = motions.reference(delta.motion)
    return DeltaRecord(
        version=delta.version,
        motion=motion,
        issued=delta.issued,
        executed=delta.executed,
        cut=delta.cut,
        keep=delta.keep,
        drop=delta.drop,
        segments=segment_records(delta.segments, motions, delta.motion),
        shift=_unless(delta.shift, 0.0),
        cause=None if delta.cause is Cause.COMMAND else delta.cause,
    )


def _segment_record(segment: Segment, motions: Motions, owner: Motion | None) -> SegmentRecord:
    own = segment.motion is owner or segment.motion == owner
    path = segment.path
    return SegmentRecord(
        start=segment.start,
        finish=segment.finish,
        phase=segment.phase,
        motion=None if own else motions.reference(segment.motion),
        joints=path.coefficients if isinstance(path, JointPath) else None,
        line=_line_record(path) if isinstance(path, CartesianPath) else None,
    )


def _line_record(path: CartesianPath) -> LineRecord:
    return LineRecord(
        position=path.position,
        orientation=_rows(path.orientation),
        turns=tuple(TurnRecord(turn.axis, turn.angle) for turn in path.turns),
        arm=cast(Literal["RIGHTY", "LEFTY"] | None, _name(path.configuration.arm)),
        elbow=cast(Literal["ABOVE", "BELOW"] | None, _name(path.configuration.elbow)),
        wrist=cast(Literal["NOFLIP", "FLIP"] | None, _name(path.configuration.wrist)),
        seeds=path.seeds,
        seed_interval=path.seed_interval,
    )


def _name(flag: Flag | None) -> str | None:
    return None if flag is None else flag.name


def _motion_record(motion: Motion) -> MotionRecord:
    return MotionRecord(
        number=motion.number,
        kind=motion.kind,
        start=motion.start,
        text=motion.text,
        goal=motion.goal,
        pose=None if motion.pose is None else _rows(motion.pose),
        speed=_unless(motion.speed, 1.0),
        acceleration=_unless(motion.acceleration, 1.0),
        tip_speed=motion.tip_speed,
        rotation=motion.rotation,
        duration=_unless(motion.duration, 0.0),
        hand=_unless(motion.hand, 0.0),
        frames=_frames_record(motion.frames),
        relative=None if motion.relative is None else _relative_record(motion.relative),
        profile=None if motion.profile is Profile.LSPB else motion.profile,
        rounding=motion.rounding,
    )


def _relative_record(target: RelativeTarget) -> RelativeRecord:
    if isinstance(target, JointOffsetTarget):
        return RelativeRecord(joint=target.joint, change=target.change)
    if isinstance(target, ToolOffsetTarget):
        return RelativeRecord(offset=_rows(target.T_destination_target))
    return RelativeRecord(aligned=True)


def _frames_record(frames: Frames) -> FramesRecord | None:
    record = FramesRecord(_rows_unless_identity(frames.base), _rows_unless_identity(frames.tool))
    return None if record == FramesRecord() else record


def _rows(T: Transform) -> Rows:
    return T[0:4], T[4:8], T[8:12]


def _rows_unless_identity(T: Transform) -> Rows | None:
    return None if str(T) == str(IDENTITY) else _rows(T)  # by their digits: -0.0 is no 0.0


def _unless(value: float, default: float) -> float | None:
    """None for the default, to the bit."""
    return None if value == default and copysign(1.0, value) == copysign(1.0, default) else value


# --- from records to values -----------------------------------------------------------------------------


def segments_of(
    records: Iterable[SegmentRecord], motions: Motions, owner: Motion | None, form: Form
) -> tuple[Segment, ...]:
    """The segments of a line. Raises RecordError."""
    return tuple(_segment(record, motions, owner, form) for record in records)


def delta_of(record: DeltaRecord, motions: Motions, form: Form) -> TimelineDelta:
    """The delta of a line; `motions` learns what the line describes. Raises RecordError."""
    motion = motions.resolve(record.motion, form)
    shift = 0.0 if record.shift is None else record.shift
    _check_times(record.cut, shift)
    return TimelineDelta(
        version=record.version,
        cause=Cause.COMMAND if record.cause is None else record.cause,
        motion=motion,
        issued=record.issued,
        executed=record.executed,
        cut=record.cut,
        keep=record.keep,
        drop=record.drop,
        shift=shift,
        segments=segments_of(record.segments, motions, motion, form),
    )


def _segment(record: SegmentRecord, motions: Motions, owner: Motion | None, form: Form) -> Segment:
    motion = owner if record.motion is None else motions.resolve(record.motion, form)
    if motion is None:
        raise RecordError("a segment of the initial timeline names no motion")
    _check_times(record.start, record.finish)
    if not record.start <= record.finish:
        raise RecordError(f"a segment finishes at {record.finish!r} s, before it starts at {record.start!r} s")
    return Segment(record.start, record.finish, _path(record, form), record.phase, motion)


def _path(record: SegmentRecord, form: Form) -> Path:
    if record.joints is not None and record.line is None:
        _check_rows(record.joints, form.joint_count)
        return JointPath(record.joints)
    if record.line is not None and record.joints is None:
        return _line(record.line, form)
    raise RecordError("a segment needs either joints or line")


def _line(record: LineRecord, form: Form) -> CartesianPath:
    for seed in record.seeds:
        _check_count(len(seed), form.joint_count)
    if len(record.seeds) > 1 and not record.seed_interval > 0.0:
        raise RecordError(f"seed_interval is {record.seed_interval!r}; it must be above 0")
    words = (
        None if record.arm is None else Arm[record.arm],
        None if record.elbow is None else Elbow[record.elbow],
        None if record.wrist is None else Wrist[record.wrist],
    )
    configuration = Configuration(*words)
    if configuration not in form.ways:
        raise RecordError("a configuration that the robot has not: arm, elbow and wrist")
    return CartesianPath(
        position=record.position,
        orientation=_transform(record.orientation),
        turns=tuple(_turn(turn) for turn in record.turns),
        configuration=configuration,
        seeds=record.seeds,
        seed_interval=record.seed_interval,
    )


def _turn(record: TurnRecord) -> Turn:
    if abs(hypot(*record.axis) - 1.0) > ORTHONORMAL:
        raise RecordError("the axis of a turn is no unit vector")
    return Turn(record.axis, record.angle)


def _motion(record: MotionRecord, form: Form) -> Motion:
    need = NEEDS.get(record.kind)
    if need is not None and getattr(record, need) is None:
        raise RecordError(f"a motion of kind {record.kind.value} needs a {need}")
    if record.goal is not None:
        _check_count(len(record.goal), form.joint_count)
    return Motion(
        number=record.number,
        kind=record.kind,
        start=record.start,
        goal=record.goal,
        pose=None if record.pose is None else _transform(record.pose),
        speed=1.0 if record.speed is None else record.speed,
        acceleration=1.0 if record.acceleration is None else record.acceleration,
        tip_speed=record.tip_speed,
        rotation=record.rotation,
        duration=0.0 if record.duration is None else record.duration,
        hand=0.0 if record.hand is None else record.hand,
        frames=_frames(record.frames),
        text=record.text,
        relative=None if record.relative is None else _relative(record.relative, form),
        profile=Profile.LSPB if record.profile is None else record.profile,
        rounding=record.rounding,
    )


def _relative(record: RelativeRecord, form: Form) -> RelativeTarget:
    if record.joint is not None and record.change is not None:
        if not 1 <= record.joint <= form.joint_count:
            raise RecordError(f"joint {record.joint} of a robot of {form.joint_count} joints")
        return JointOffsetTarget(record.joint, record.change)
    if record.offset is not None:
        return ToolOffsetTarget(_transform(record.offset))
    if record.aligned:
        return AlignedTarget()
    raise RecordError("a relative target needs joint and change, or offset, or aligned")


def _frames(record: FramesRecord | None) -> Frames:
    if record is None:
        return Frames()
    return Frames(
        base=IDENTITY if record.base is None else _transform(record.base),
        tool=IDENTITY if record.tool is None else _transform(record.tool),
    )


def _transform(rows: Rows) -> Transform:
    R = [row[:3] for row in rows]
    for i, a in enumerate(R):
        for b in R[: i + 1]:
            if abs(sum(map(mul, a, b)) - (a is b)) > ORTHONORMAL:
                raise RecordError("the axes of a transformation are not at right angles, or not of length 1")
    return Transform(*rows[0], *rows[1], *rows[2])


def _check_rows(rows: tuple[Polynomial, ...], joint_count: int) -> None:
    _check_count(len(rows), joint_count)
    lengths = set(map(len, rows))
    if len(lengths) > 1:
        raise RecordError(f"polynomials of {min(lengths)} and of {max(lengths)} coefficients in one segment")


def _check_times(one: float, other: float) -> None:
    if one * TICKS_PER_SECOND % 1.0 or other * TICKS_PER_SECOND % 1.0:
        raise RecordError(f"{one!r} s or {other!r} s is no multiple of 2^-30 s")


def _check_count(found: int, joint_count: int) -> None:
    if found != joint_count:
        raise RecordError(f"{found} joint values for a robot of {joint_count} joints")
