"""Define msgspec records of segments, motions and deltas, and conversions between the records and the values.

Fields with default values are omitted. `docs/trajectory-file.md` describes every key. Reading checks that a trajectory
fits the robot, but not that its motions obey the motion laws and limits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence, Sized
from math import copysign, hypot
from typing import Annotated

import msgspec

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Configuration, Profile
from vrs_cli.kinematics.transform import IDENTITY, ORTHONORMAL, Transform, is_rotation
from vrs_cli.trajectory.instant import LATEST, TICKS_PER_SECOND
from vrs_cli.trajectory.segment import CartesianPath, Guide, JointPath, Phase, Segment, Turn
from vrs_cli.trajectory.timeline import Cause, TimelineDelta
from vrs_cli.values.commands import (
    AlignedTarget,
    Event,
    EventEdit,
    Frames,
    JointOffsetTarget,
    Motion,
    MotionKind,
    RelativeTarget,
    Start,
    Swivel,
    ToolOffsetTarget,
)

NEEDED_FIELDS = {
    MotionKind.JOINT: "goal",
    MotionKind.STEERED: "goal",
    MotionKind.STRAIGHT: "pose",
}  # the field that a record of this kind must have, because the motion cannot be planned again without it

STANDING_KINDS = (MotionKind.EVENT, MotionKind.RECORDED)  # kinds of motions that move nothing, and so have no segments
MAX_NUMBER = 1e15  # maximum magnitude of a number in a file, so that sums and products stay finite
MAX_DEGREE = 5  # maximum degree of a polynomial that is read from a file
ZERO, FULL = 0.0, 1.0  # default values: msgspec omits a field that holds exactly this object
# default values of a motion's fields
DEFAULTS = (("speed", FULL), ("acceleration", FULL), ("duration", ZERO), ("hand", ZERO))
NO_FRAMES = Frames()

Number = Annotated[float, msgspec.Meta(ge=-MAX_NUMBER, le=MAX_NUMBER)]
Time = Annotated[float, msgspec.Meta(ge=-2.0 * LATEST, le=2.0 * LATEST)]
Numbers = Annotated[tuple[Number, ...], msgspec.Meta(min_length=1)]
COEFFICIENT_COUNT = msgspec.Meta(min_length=1, max_length=MAX_DEGREE + 1)
Coefficients = Annotated[tuple[Number, ...], COEFFICIENT_COUNT]
Row = tuple[Number, Number, Number, Number]
Rows = tuple[Row, Row, Row]
Axis = tuple[Number, Number, Number]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
Channel = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]
Fraction = Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
Rate = Annotated[float, msgspec.Meta(gt=0.0, le=MAX_NUMBER)]
Length = Annotated[float, msgspec.Meta(ge=0.0, le=MAX_NUMBER)]
Duration = Annotated[float, msgspec.Meta(ge=0.0, le=LATEST)]
Joints = Annotated[tuple[Number, ...], msgspec.Meta(min_length=1, max_length=64)]
Columns = Annotated[int, msgspec.Meta(ge=20, le=1000)]
Name = Annotated[str, msgspec.Meta(max_length=200)]
Text = Annotated[str, msgspec.Meta(max_length=100_000)]


class StrictRecord(msgspec.Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True, gc=False):
    """A record with its keys in the order of the fields; unknown keys are refused."""


class FramesRecord(StrictRecord, frozen=True):
    base: Rows | None = None
    tool: Rows | None = None


class RelativeRecord(StrictRecord, frozen=True):
    """A relative target. DRIVE: `joint` and `change`; DEPART: `offset`; ALIGN: `aligned`, true."""

    joint: Count | None = None
    change: Number | None = None
    offset: Rows | None = None
    aligned: bool | None = None


class SwivelRecord(StrictRecord, frozen=True):
    joint: Count
    value: Number | None = None


class MotionRecord(StrictRecord, frozen=True):
    number: Count
    kind: MotionKind
    start: Start
    text: str = ""
    goal: tuple[Number, ...] | None = None
    pose: Rows | None = None
    speed: Fraction = FULL
    acceleration: Fraction = FULL
    tip_speed: Rate | None = None
    rotation: Rate | None = None
    duration: Duration = ZERO
    hand: Number = ZERO
    frames: FramesRecord | None = None
    relative: RelativeRecord | None = None
    profile: Profile = Profile.LSPB
    rounding: Length | None = None
    swivel: SwivelRecord | None = None


class TurnRecord(StrictRecord, frozen=True):
    axis: Axis
    angle: Coefficients


class GuideRecord(StrictRecord, frozen=True):
    weights: Numbers
    value: Coefficients


class LineRecord(StrictRecord, frozen=True):
    """A Cartesian path: the tool's position as polynomials of time, its orientation at the start and the turns from it,
    the arm's configuration, and seeds for the inverse kinematics."""

    position: tuple[Coefficients, Coefficients, Coefficients]
    orientation: Rows
    turns: tuple[TurnRecord, ...]
    arm: str | None  # RIGHTY or LEFTY; null: the robot does not have this choice
    elbow: str | None
    wrist: str | None
    seeds: Annotated[tuple[Numbers, ...], msgspec.Meta(min_length=1)]
    seed_interval: Number
    guides: tuple[GuideRecord, ...] = ()


class PieceRecord(StrictRecord, frozen=True):
    """A polynomial for each joint, in the time since the start of the piece; valid for `duration` [s]."""

    duration: Duration
    joints: tuple[Coefficients, ...]


class SegmentRecord(StrictRecord, frozen=True):
    """A segment. `motion` is absent if it is the motion of the delta; exactly one of `joints` and `line` is present.
    `pieces`: the joints of a straight line as consecutive pieces, for clients that requested them."""

    start: Time
    finish: Time
    phase: Phase
    motion: Count | MotionRecord | None = None
    joints: Sequence[Annotated[Sequence[Number], COEFFICIENT_COUNT]] | None = None
    line: LineRecord | None = None
    pieces: tuple[PieceRecord, ...] = ()


# returns the pieces of the joint trajectory that follows a straight line
Pieces = Callable[[Segment], tuple[PieceRecord, ...]]


def no_pieces(_: Segment) -> tuple[PieceRecord, ...]:
    return ()


class EventRecord(StrictRecord, frozen=True):
    """An event with its time. `channel`: 0 for the hand, otherwise the number of a signal."""

    time: Time
    channel: Channel
    value: Number
    number: Count = 0
    tied: bool = False
    duration: Duration = ZERO
    observed: bool = False


class EventEditRecord(StrictRecord, frozen=True):
    """The changes of events in a delta."""

    keep: Count
    drop: Count = 0
    shift: Time = ZERO
    events: tuple[EventRecord, ...] = ()


class DeltaRecord(StrictRecord, frozen=True):
    version: Count
    motion: Count | MotionRecord
    issued: Number
    executed: Number
    cut: Time
    keep: Count
    drop: Count
    segments: tuple[SegmentRecord, ...]
    shift: Time = ZERO
    cause: Cause = Cause.COMMAND
    events: EventEditRecord | None = None


class Form(msgspec.Struct, frozen=True):
    """The properties of a robot that its records depend on: the number of joints, and its configurations by their
    VAL-II words (RIGHTY, ABOVE, ...).

    `redundancy`: the number of guides (conditions on redundant joints) that a straight line must have; `held`: the
    indexes of joints that stood still on lines of older files, which have no guides.
    """

    joint_count: int
    ways: dict[tuple[str | None, ...], Configuration]
    redundancy: int = 0
    held: tuple[int, ...] = ()

    @classmethod
    def of(cls, arm: RobotArm) -> Form:
        return cls(
            arm.model.joint_count,
            {_words(configuration): configuration for configuration in arm.all_line_ways},
            arm.redundancy,
            arm.still_joints,
        )


class RecordError(ValueError):
    """The error for data that are not a valid record."""


class Motions(dict[int, Motion]):
    """The motions that were written completely so far, by number; later records refer to them. `open_hand`: whether one
    of those that were read opens the hand, as motions of older files do.
    """

    open_hand = False

    def reference(self, motion: Motion) -> int | MotionRecord:
        """Return the motion's number if the motion was written before; else return the whole motion, and remember
        it."""
        known = self.get(motion.number)
        if known is motion or known == motion:
            return motion.number
        self[motion.number] = motion
        frames = FramesRecord(*map(_rows_unless_identity, (motion.frames.base, motion.frames.tool)))
        values = msgspec.structs.asdict(motion)
        values |= {name: _default(values[name], default) for name, default in DEFAULTS}
        values |= {
            "pose": None if motion.pose is None else _rows(motion.pose),
            "frames": None if frames == FramesRecord() else frames,
            "relative": None if motion.relative is None else _relative_record(motion.relative),
            "swivel": None if motion.swivel is None else SwivelRecord(motion.swivel.joint, motion.swivel.value),
        }
        return MotionRecord(**values)

    def resolve(self, reference: int | MotionRecord, form: Form) -> Motion:
        """Return the motion of a reference. Raises RecordError."""
        if isinstance(reference, MotionRecord):
            motion = self[reference.number] = _motion_of(reference, form)
            if motion.hand:
                self.open_hand = True
            return motion
        if reference not in self:
            raise RecordError(f"motion {reference} is referred to but not described before")
        return self[reference]


# --- from values to records -----------------------------------------------------------------------------


def segment_records(
    segments: Iterable[Segment], motions: Motions, owner: Motion | None, pieces: Pieces = no_pieces
) -> tuple[SegmentRecord, ...]:
    """Convert segments to records. `owner`: the motion of the delta; its own segments omit their reference to it."""
    return tuple(
        [
            SegmentRecord(
                start=segment.start,
                finish=segment.finish,
                phase=segment.phase,
                # `in` tries `is` before the slower `==`
                motion=None if segment.motion in (owner,) else motions.reference(segment.motion),
                joints=segment.path.coefficients if isinstance(segment.path, JointPath) else None,
                line=_line_record(segment.path) if isinstance(segment.path, CartesianPath) else None,
                pieces=pieces(segment),
            )
            for segment in segments
        ]
    )


def delta_record(delta: TimelineDelta, motions: Motions, pieces: Pieces = no_pieces) -> DeltaRecord:
    """Convert a delta to a record, and add its motion to `motions`."""
    edit = delta.events
    values = msgspec.structs.asdict(delta) | {
        "motion": motions.reference(delta.motion),
        "segments": segment_records(delta.segments, motions, delta.motion, pieces),
        "shift": _default(delta.shift, ZERO),
        "events": None
        if edit is None
        else EventEditRecord(edit.keep, edit.drop, _default(edit.shift, ZERO), event_records(edit.events)),
    }
    return DeltaRecord(**values)


def event_records(events: Iterable[Event]) -> tuple[EventRecord, ...]:
    return tuple([EventRecord(*event._replace(duration=_default(event.duration, ZERO))) for event in events])


def _line_record(path: CartesianPath) -> LineRecord:
    return LineRecord(
        path.position,
        _rows(path.orientation),
        tuple(TurnRecord(turn.axis, turn.angle) for turn in path.turns),
        *_words(path.configuration),
        path.seeds,
        path.seed_interval,
        tuple(GuideRecord(guide.weights, guide.value) for guide in path.guides),
    )


def _words(configuration: Configuration) -> tuple[str | None, str | None, str | None]:
    arm, elbow, wrist = (flag and flag.name for flag in configuration.flags)
    return arm, elbow, wrist


def _relative_record(target: RelativeTarget) -> RelativeRecord:
    if isinstance(target, JointOffsetTarget):
        return RelativeRecord(joint=target.joint, change=target.change)
    if isinstance(target, ToolOffsetTarget):
        return RelativeRecord(offset=_rows(target.T_destination_target))
    return RelativeRecord(aligned=True)


def _rows(T: Transform) -> Rows:
    return T[0:4], T[4:8], T[8:12]


def _rows_unless_identity(T: Transform) -> Rows | None:
    """Return the rows of a transformation; None for the identity, compared as text, because -0.0 == 0.0 but they print
    differently."""
    return None if T is IDENTITY or str(T) == str(IDENTITY) else _rows(T)


def _default(value: float, default: float) -> float:
    """Return the default object if the value is equal to it bit by bit."""
    return default if value == default and copysign(1.0, value) > 0.0 else value


# --- from records to values -----------------------------------------------------------------------------


def segments_of(
    records: Iterable[SegmentRecord], motions: Motions, owner: Motion | None, form: Form
) -> tuple[Segment, ...]:
    """Convert records to segments. `owner`: the motion of records that do not name one. Raises RecordError."""
    made, checked = list[Segment](), None
    for record in records:  # the checks are not functions of their own, because they run for each segment of a file
        motion = owner if record.motion is None else motions.resolve(record.motion, form)
        if motion is None:
            raise RecordError("a segment of the initial timeline names no motion")
        if motion is not checked and motion.kind in STANDING_KINDS:
            raise RecordError(f"a segment of a motion of kind {motion.kind.value}, which has none")
        checked, start, finish = motion, record.start, record.finish
        if not ((start * TICKS_PER_SECOND).is_integer() and (finish * TICKS_PER_SECOND).is_integer()):
            raise _off_grid(start, finish)
        if start > finish:
            raise RecordError(f"a segment finishes at {finish!r} s, before it starts at {start!r} s")
        rows, line = record.joints or (), record.line
        if (record.joints is None) is (line is None):
            raise RecordError("a segment needs either joints or line")
        if line is None and len(rows) != form.joint_count:
            raise _wrong_count(rows, form)
        try:
            path = JointPath.make_packed(rows) if line is None else _line(line, form)
        except ValueError as error:
            raise RecordError(str(error)) from None
        made.append(Segment(start, finish, path, record.phase, motion))
    return tuple(made)


def delta_of(record: DeltaRecord, motions: Motions, form: Form) -> TimelineDelta:
    """Convert a record to a delta, and add its motion to `motions`. Raises RecordError."""
    motion = motions.resolve(record.motion, form)
    if not ((record.cut * TICKS_PER_SECOND).is_integer() and (record.shift * TICKS_PER_SECOND).is_integer()):
        raise _off_grid(record.cut, record.shift)
    edit, events = record.events, None
    if edit is not None:
        events = EventEdit(edit.keep, edit.drop, _on_grid(edit.shift), events_of(edit.events))
    segments = segments_of(record.segments, motions, motion, form)
    times = record.issued, record.executed, record.cut
    return TimelineDelta(
        record.version, record.cause, motion, *times, record.keep, record.drop, record.shift, segments, events
    )


def events_of(records: Iterable[EventRecord]) -> tuple[Event, ...]:
    """Convert records to events. Raises RecordError."""
    return tuple([Event(_on_grid(one.time), *msgspec.structs.astuple(one)[1:]) for one in records])


def _on_grid(t: float) -> float:
    if not (t * TICKS_PER_SECOND).is_integer():
        raise _off_grid(t, t)
    return t


def _line(record: LineRecord, form: Form) -> CartesianPath:
    for joints in (*record.seeds, *[guide.weights for guide in record.guides]):
        _check_count(joints, form)
    if len(record.seeds) > 1 and not record.seed_interval > 0.0:
        raise RecordError(f"seed_interval is {record.seed_interval!r}; it must be above 0")
    if (configuration := form.ways.get((record.arm, record.elbow, record.wrist))) is None:
        raise RecordError("a configuration that the robot has not: arm, elbow and wrist")
    orientation, turns = _transform(record.orientation), tuple(map(_turn, record.turns))
    guides = [Guide(guide.weights, guide.value) for guide in record.guides] or [
        # older files have no guides: redundant joints stood still on their lines
        Guide(tuple(float(i == k) for k in range(form.joint_count)), (record.seeds[0][i],))
        for i in form.held
    ]
    if len(guides) != form.redundancy:
        raise RecordError(f"{len(guides)} guides of a line of a robot that needs {form.redundancy}")
    return CartesianPath(
        record.position, orientation, turns, configuration, record.seeds, record.seed_interval, tuple(guides)
    )


def _turn(record: TurnRecord) -> Turn:
    if abs(hypot(*record.axis) - 1.0) > ORTHONORMAL:
        raise RecordError("the axis of a turn is no unit vector")
    return Turn(record.axis, record.angle)


def _motion_of(record: MotionRecord, form: Form) -> Motion:
    target = record.pose if record.kind is MotionKind.STRAIGHT else record.goal
    if target is None and record.kind in NEEDED_FIELDS:
        raise RecordError(f"a motion of kind {record.kind.value} needs a {NEEDED_FIELDS[record.kind]}")
    if record.goal is not None:
        _check_count(record.goal, form)
    frames, relative, swivel = record.frames, record.relative, record.swivel
    fields = (
        record.number,
        record.kind,
        record.start,
        record.goal,
        None if record.pose is None else _transform(record.pose),
        record.speed,
        record.acceleration,
        record.tip_speed,
        record.rotation,
        record.duration,
        record.hand,
        NO_FRAMES if frames is None else Frames(_frame(frames.base), _frame(frames.tool)),
        record.text,
        None if relative is None else _relative(relative, form),
        record.profile,
        record.rounding,
        None if swivel is None else _swivel(swivel, form),
    )
    return Motion(*fields)


def _frame(rows: Rows | None) -> Transform:
    return IDENTITY if rows is None else _transform(rows)


def _swivel(record: SwivelRecord, form: Form) -> Swivel:
    if not form.redundancy:
        raise RecordError("a swivel of a robot that has no joint too many")
    _check_joint(record.joint, form)
    return Swivel(record.joint, record.value)


def _check_joint(joint: int, form: Form) -> None:
    if not 1 <= joint <= form.joint_count:
        raise RecordError(f"joint {joint} of a robot of {form.joint_count} joints")


def _relative(record: RelativeRecord, form: Form) -> RelativeTarget:
    if record.joint is not None and record.change is not None:
        _check_joint(record.joint, form)
        return JointOffsetTarget(record.joint, record.change)
    if record.offset is not None:
        return ToolOffsetTarget(_transform(record.offset))
    if record.aligned:
        return AlignedTarget()
    raise RecordError("a relative target needs joint and change, or offset, or aligned")


def _transform(rows: Rows) -> Transform:
    if not is_rotation([row[:3] for row in rows]):
        raise RecordError("the axes of a transformation are not at right angles, or not of length 1")
    return Transform(*rows[0], *rows[1], *rows[2])


def _off_grid(one: float, other: float) -> RecordError:
    return RecordError(f"{one!r} s or {other!r} s is no multiple of 2^-30 s")


def _check_count(joints: Sized, form: Form) -> None:
    if len(joints) != form.joint_count:
        raise _wrong_count(joints, form)


def _wrong_count(joints: Sized, form: Form) -> RecordError:
    return RecordError(f"{len(joints)} joint values for a robot of {form.joint_count} joints")
