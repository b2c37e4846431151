"""Define sample times and joint names of exports, and export a trajectory as an MCAP log of ROS 2 messages, which
Foxglove shows without plugins and `ros2 bag play` plays.

Each sample has messages on the topics /joint_states (sensor_msgs/JointState), /tool (geometry_msgs/PoseStamped,
T_world_tool) and /tf (tf2_msgs/TFMessage, the frames of all links and the tool, each in the previous frame). There are
further messages on /commands (rcl_interfaces/Log) when a motion begins, on /signals (the same type) when a signal or
the hand is set, and, in a cell, on /tf (T_world_part) when a part has moved since the last sample. Times in the log are
those of the robot's clock, in nanoseconds.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from heapq import merge
from importlib.util import find_spec
from itertools import chain, pairwise
from math import ceil
from operator import attrgetter, itemgetter
from typing import Any, BinaryIO, NamedTuple, Protocol
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from vrs_cli.engine.position import PositionArrays, frames_over, positions_at
from vrs_cli.errors import UsageError
from vrs_cli.extras import how_to_install
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats, quaternions
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import RobotModel, link_transform
from vrs_cli.kinematics.transform import Transform, compose, inverse, position, unit_quaternion
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import HAND
from vrs_cli.version import __version__

CHUNK = 8192  # maximum number of samples that are computed at a time, to limit memory
NANOSECONDS = 1_000_000_000  # number of nanoseconds in a second
Times = NDArray[np.int64]  # times (N,) [ns]
Bytes = NDArray[np.uint8]


def sample_times(timeline: Timeline, rate: float) -> Iterator[Floats]:
    """Yield the sample times of a timeline [s]: start, start + 1/rate, ... and the exact end, in arrays of at most
    CHUNK + 1 times.
    """
    start, end = timeline.start, timeline.end
    count = ceil((end - start) * rate)
    for first in range(0, count, CHUNK):
        times = start + np.arange(first, min(first + CHUNK, count)) / rate
        yield times[times < end]
    yield np.array([end])


def joint_names(count: int) -> list[str]:
    """Return the names jt1, jt2, ... of `count` joints."""
    return [f"jt{i}" for i in range(1, count + 1)]


def nanoseconds(times: Floats) -> Times:
    """Convert times (N,) [s] to integer nanoseconds."""
    return np.rint(times * NANOSECONDS).astype("<i8")


# --- an MCAP log -----------------------------------------------------------------------------------------------------


INFO = 20  # severity level "info" in rcl_interfaces/Log
SAMPLES_PER_CHUNK = 1024  # number of samples in a chunk of the log, about 1.4 MB; readers load whole chunks
COMPRESSION = -1  # compression level of zstd: chunks are 3 % larger than at level 3, but take half the time
MAGIC = b"\x89MCAP0\r\n"
MESSAGE_CODE, INDEX_CODE = 5, 7
# head of a message record: opcode, length, channel, sequence number, two times [ns]
_MESSAGE = struct.Struct("<BQHIQQ")
_INDEX = struct.Struct("<BQHI")  # head of a message index record: opcode, length, channel, length of the entries
CDR_HEAD = b"\x00\x01\x00\x00"
# a field of a message: a string, several strings, or a `struct` format with its numbers
Field = str | list[str] | tuple[Any, ...]

_TIME = "int32 sec\nuint32 nanosec"
_HEADER = "builtin_interfaces/Time stamp\nstring frame_id"
_RULE = "\n" + "=" * 80 + "\n"


def _schema(own: str, *others: tuple[str, str]) -> bytes:
    """Return the schema of a message type, followed by those of the message types that it contains (name, text)."""
    return _RULE.join((own, *(f"MSG: {name}\n{text}" for name, text in others))).encode("ascii")


_STAMPED = (("std_msgs/Header", _HEADER), ("builtin_interfaces/Time", _TIME))
SIGNALS, FRAMES = "/signals", "/tf"
LOG = (
    "rcl_interfaces/msg/Log",
    _schema(
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\n"
        "string file\nstring function\nuint32 line",
        ("builtin_interfaces/Time", _TIME),
    ),
)
TOPICS = {
    "/joint_states": (
        "sensor_msgs/msg/JointState",
        _schema(
            "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort", *_STAMPED
        ),
    ),
    "/tool": (
        "geometry_msgs/msg/PoseStamped",
        _schema(
            "std_msgs/Header header\ngeometry_msgs/Pose pose",
            ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation"),
            ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z"),
            ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w"),
            *_STAMPED,
        ),
    ),
    "/commands": LOG,
    SIGNALS: LOG,
    FRAMES: (
        "tf2_msgs/msg/TFMessage",
        _schema(
            "geometry_msgs/TransformStamped[] transforms",
            (
                "geometry_msgs/TransformStamped",
                "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform",
            ),
            ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"),
            ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z"),
            ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w"),
            *_STAMPED,
        ),
    ),
}


class PartPoses(Protocol):
    """The methods of the class `World` (the parts around the robot) that this file uses. This folder must not import
    the class itself.
    """

    def poses(self, timeline: Timeline, t: float) -> Iterator[tuple[str, Transform]]: ...


def check_mcap() -> None:
    """Check that the package mcap is installed. Raises UsageError."""
    if find_spec("mcap") is None:
        raise UsageError("a log in MCAP needs mcap, which is not installed", how_to_install("mcap"))


class LogMessage(NamedTuple):
    """A message in a log: its time [ns], its topic, and its data in CDR encoding."""

    time: int
    topic: str
    data: bytes


def write_mcap(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: PartPoses | None = None
) -> None:
    """Write the log of a trajectory, with all messages in order of time. `rate`: sampling rate [Hz]."""
    check_mcap()
    log = _Log(stream, arm.model, [topic for topic in TOPICS if topic != SIGNALS or timeline.event_count])
    samples, moved = _Samples(arm.model, log.channels), dict[str, Transform]()
    single = list(merge(_commands(timeline), _signals(timeline), key=attrgetter("time")))
    for times in sample_times(timeline, rate):
        ns = nanoseconds(times)
        rows = samples.encode(ns, timeline, positions_at(arm, timeline, times))
        for first in range(0, len(ns), SAMPLES_PER_CHUNK):
            here = slice(first, first + SAMPLES_PER_CHUNK)
            between = list(_part_frames(world, timeline, times[here], moved))
            while single and single[0].time <= ns[here][-1]:
                between.append((int(ns[here].searchsorted(single[0].time)), single.pop(0)))
            log.write_chunk(ns[here], rows[here], samples.starts, sorted(between, key=itemgetter(0)))
    if single:  # some messages come after the last sample
        log.write_chunk(ns[:0], rows[:0], {}, [(0, message) for message in single])
    log.finish()


class _Log:
    """Writes an MCAP file. Only the record types of the library mcap are used: its own writer handles messages one by
    one, which takes ten times as long as writing arrays of messages. `channels`: the channel number of each topic.
    """

    def __init__(self, stream: BinaryIO, model: RobotModel, topics: Sequence[str]) -> None:
        from mcap import data_stream, records
        from zstandard import ZstdCompressor

        self._records, self._stream = records, stream
        self._builder: Any = data_stream.RecordBuilder()
        self._compress, self._place = ZstdCompressor(level=COMPRESSION).compress, 0
        self.channels = {topic: number for number, topic in enumerate(topics, 1)}
        self._counts, self._chunks = dict.fromkeys(self.channels.values(), 0), list[Any]()
        self._write(MAGIC)
        self._add(records.Header(profile="ros2", library=f"vrs {__version__}"))
        place = self._place
        self._add(records.Metadata(name="robot", metadata={"name": model.name, "title": model.title}))
        index = records.MetadataIndex(name="robot", offset=place, length=self._place - place)
        declared = [
            *(
                records.Schema(id=number, name=TOPICS[topic][0], encoding="ros2msg", data=TOPICS[topic][1])
                for topic, number in self.channels.items()
            ),
            *(
                records.Channel(id=number, topic=topic, message_encoding="cdr", metadata={}, schema_id=number)
                for topic, number in self.channels.items()
            ),
        ]
        self._add(*declared)
        self._summary = [*declared, index]

    def _write(self, data: bytes) -> None:
        self._stream.write(data)
        self._place += len(data)

    def _add(self, *records: Any) -> None:
        """Encode records with the library mcap, and append them to the file."""
        for record in records:
            record.write(self._builder)
        self._write(self._builder.end())

    def write_chunk(
        self, ns: Times, rows: Bytes, starts: Mapping[int, int], between: Sequence[tuple[int, LogMessage]]
    ) -> None:
        """Write a chunk with the samples at times `ns` (N,), encoded as `rows` (N, k) of bytes, and with the other
        messages `between`, each with the index of the sample before which it is written. `starts`: for each channel the
        column of `rows` at which its message starts.
        """
        size, before = rows.shape[1], [row for row, _ in between]
        records = [_record(self.channels[message.topic], message) for _, message in between]
        added = np.cumsum([0, *map(len, records)])
        places = np.arange(len(ns)) * size + added[np.searchsorted(before, np.arange(len(ns)), side="right")]
        entries = {channel: [np.stack((ns, places + start), axis=1)] for channel, start in starts.items()}
        for (row, message), more in zip(between, added.tolist(), strict=False):
            entries.setdefault(self.channels[message.topic], []).append(np.array([[message.time, row * size + more]]))
        pieces = (rows[first:last].tobytes() for first, last in pairwise((0, *before, len(rows))))
        data = b"".join(chain.from_iterable(zip(pieces, (*records, b""), strict=True)))
        self._add_chunk(data, {channel: np.concatenate(some) for channel, some in entries.items()})

    def _add_chunk(self, data: bytes, entries: Mapping[int, Times]) -> None:
        """Write a chunk of encoded messages, and an index for each channel. `entries`: for each channel the times and
        positions of its messages (k, 2).
        """
        records, chunk, packed = self._records, self._place, self._compress(data)
        times = np.concatenate([some[:, 0] for some in entries.values()])
        facts = {
            "compression": "zstd",
            "message_start_time": int(times.min()),
            "message_end_time": int(times.max()),
            "uncompressed_size": len(data),
        }
        self._add(records.Chunk(data=packed, uncompressed_crc=crc32(data), **facts))
        index, offsets = self._place, dict[int, int]()
        for channel, some in entries.items():
            ordered = some[some[:, 1].argsort()].astype("<u8").tobytes()
            offsets[channel] = self._place
            self._write(_INDEX.pack(INDEX_CODE, 6 + len(ordered), channel, len(ordered)) + ordered)
            self._counts[channel] += len(some)
        self._chunks.append(
            records.ChunkIndex(
                **facts,
                chunk_start_offset=chunk,
                chunk_length=index - chunk,
                compressed_size=len(packed),
                message_index_offsets=offsets,
                message_index_length=self._place - index,
            )
        )

    def finish(self) -> None:
        """Write the end of the file: the summary, with which readers find the messages of a given time."""
        records = self._records
        self._add(records.DataEnd(data_section_crc=0))
        counts = records.Statistics(
            message_count=sum(self._counts.values()),
            schema_count=len(self.channels),
            channel_count=len(self.channels),
            attachment_count=0,
            metadata_count=1,
            chunk_count=len(self._chunks),
            message_start_time=min((one.message_start_time for one in self._chunks), default=0),
            message_end_time=max((one.message_end_time for one in self._chunks), default=0),
            channel_message_counts=self._counts,
        )
        summary = self._place
        self._add(*self._summary, *self._chunks, counts)
        self._add(records.Footer(summary_start=summary, summary_offset_start=0, summary_crc=0))
        self._write(MAGIC)


# --- messages --------------------------------------------------------------------------------------------------


def _record(channel: int, message: LogMessage) -> bytes:
    return _MESSAGE.pack(MESSAGE_CODE, 22 + len(message.data), channel, 0, message.time, message.time) + message.data


class _Samples:
    """Encodes the messages of each sample as one row of bytes. Rows differ only in their times and in numbers of type
    double, so many rows are encoded together as arrays. `starts`: for each channel the column at which its message
    starts.
    """

    def __init__(self, model: RobotModel, channels: Mapping[str, int]) -> None:
        n, names = model.joint_count, frame_names(model)
        numbers, no_pose = ("d", *[0.0] * n), ("d", *[0.0] * 7)
        transforms = ((_stamp(0), parent, child, no_pose) for parent, child in pairwise(names))
        messages: dict[str, tuple[Field, ...]] = {
            "/joint_states": (_stamp(0), "", joint_names(n), ("I", n), numbers, ("I", n), numbers, ("I", 0)),
            "/tool": (_stamp(0), "world", no_pose),
            FRAMES: (("I", len(names) - 1), *chain.from_iterable(transforms)),
        }
        self.model, self.starts, row = model, dict[int, int](), bytearray()
        self._stamps, self._blocks, self._clocks = list[int](), list[int](), list[int]()
        for topic, fields in messages.items():
            self.starts[channels[topic]] = len(row)
            self._clocks += len(row) + 15, len(row) + 23
            body, first = bytearray(), len(row) + _MESSAGE.size + len(CDR_HEAD)
            for field in fields:
                _append(body, field)
                if field == _stamp(0):
                    self._stamps.append(first + len(body) - _STAMP.size)
                elif isinstance(field, tuple) and field[0] == "d":
                    self._blocks.append(first + len(body) - 8 * (len(field) - 1))
            row += _record(channels[topic], LogMessage(0, topic, CDR_HEAD + bytes(body)))
        self._row = np.frombuffer(bytes(row), np.uint8)

    def encode(self, ns: Times, timeline: Timeline, here: PositionArrays) -> Bytes:
        """Return the encoded messages (N, k) of N samples at times `ns`. `here`: the positions of the robot at these
        times.
        """
        rows = np.tile(self._row, (len(ns), 1))
        stamps = np.stack(np.divmod(ns, NANOSECONDS), axis=1).astype("<i4")
        T = here.T_world_tool
        tool = np.hstack((T[:, :, 3], quaternions(T[:, :, :3])))
        numbers = here.joints, here.velocity, tool, *_frame_poses(self.model, timeline, here)
        for at, block in (
            *((at, ns[:, None]) for at in self._clocks),
            *((at, stamps) for at in self._stamps),
            *zip(self._blocks, numbers, strict=True),
        ):
            data = np.ascontiguousarray(block).view(np.uint8)
            rows[:, at : at + data.shape[1]] = data
        return rows


def _commands(timeline: Timeline) -> Iterator[LogMessage]:
    """Yield a message for each time at which a motion begins, or continues after an inserted motion."""
    before = 0
    for segment in timeline:
        motion = segment.motion
        if motion.number != before:
            ns, text = round(segment.start * NANOSECONDS), motion.text or motion.kind.value
            yield LogMessage(ns, "/commands", cdr(_stamp(ns), ("B", INFO), "vrs", text, "", "", ("I", 0)))
        before = motion.number


def _signals(timeline: Timeline) -> Iterator[LogMessage]:
    """Yield a message for each time at which a signal or the hand is set."""
    for event in timeline.events:
        if not event.observed:
            ns, on = round(event.time * NANOSECONDS), "on" if event.value else "off"
            text = f"hand {event.value:g}" if event.channel == HAND else f"{event.channel} {on}"
            yield LogMessage(ns, SIGNALS, cdr(_stamp(ns), ("B", INFO), "vrs", text, "", "", ("I", 0)))


def frame_names(model: RobotModel) -> list[str]:
    """Return the names of the frames in a log: world, ROBOT/base, ROBOT/link1, ..., ROBOT/flange, ROBOT/tool. Each is
    the parent frame of the next.
    """
    links = [f"link{i}" for i in range(1, model.joint_count)]
    return ["world", *(f"{model.name}/{name}" for name in ("base", *links, "flange", "tool"))]


def _frame_poses(model: RobotModel, timeline: Timeline, here: PositionArrays) -> Iterator[Floats]:
    """For each frame except the first, yield its poses relative to the previous frame at N times: x, y, z [m] and a
    quaternion; shape (N, 7).
    """
    frames, numbers = frames_over(timeline, here.times)
    ends = ((compose(inverse(one.base), model.base), one.tool) for one in frames)
    bases, tools = (np.array([_pose(T) for T in some])[numbers] for some in zip(*ends, strict=True))
    yield bases
    for i in range(model.joint_count):
        yield _link_poses(model, i, here.joints[:, i])
    yield tools


def _pose(T: Transform) -> tuple[float, ...]:
    """Return the position x, y, z [m] of T, and its unit quaternion x, y, z, w with w >= 0."""
    w, *axis = unit_quaternion(T)
    x, y, z = (-a for a in axis) if w < 0.0 else axis
    return (*position(T), x, y, z, abs(w))


def _link_poses(model: RobotModel, i: int, x: Floats) -> Floats:
    """Return the poses (N, 7) of a link in the previous frame, for values (N,) [rad, m] of the joint with index i that
    moves it. They are equal to the results of `model.link_transform`. For the last joint, return the poses of the
    flange.
    """
    link = model.links[i]
    turns = link.kind is JointKind.REVOLUTE
    # constant part of the pose, after the joint's rotation about z or translation along z
    T = link_transform(link, -link.theta if turns else 0.0)
    px, py, pz, qx, qy, qz, qw = _pose(compose(T, model.flange) if i == model.joint_count - 1 else T)
    half, slide = (0.5 * (link.theta + x), 0.0 * x) if turns else (0.0 * x, x)
    c, s = np.cos(half), np.sin(half)
    cosine, sine = c * c - s * s, 2.0 * s * c
    w = c * qw - s * qz
    sign = np.where(w < 0.0, -1.0, 1.0)
    columns = (
        cosine * px - sine * py, sine * px + cosine * py, pz + slide,
        sign * (c * qx - s * qy), sign * (c * qy + s * qx), sign * (c * qz + s * qw), sign * w,
    )  # fmt: skip
    return np.stack(columns, axis=1)


def _part_frames(
    world: PartPoses | None, timeline: Timeline, times: Floats, before: dict[str, Transform]
) -> Iterator[tuple[int, LogMessage]]:
    """Yield a message for each part that has moved since the last sample, with the index of the sample before which it
    is written. `before`: the poses of the parts at the last sample, which are updated.
    """
    if world is None:
        return
    for row, t in enumerate(times.tolist(), 1):
        ns = round(t * NANOSECONDS)
        for name, T in world.poses(timeline, t):
            if before.get(name) != T:
                before[name] = T
                yield row, LogMessage(ns, FRAMES, cdr(("I", 1), _stamp(ns), "world", name, ("d", *_pose(T))))


_STAMP = struct.Struct("<ii")


def _stamp(nanoseconds: int) -> Field:
    return ("i", *divmod(nanoseconds, NANOSECONDS))


def cdr(*fields: Field) -> bytes:
    """Encode a message in little-endian CDR. The position of each number, counted from the end of the header, is a
    multiple of its size.
    """
    body = bytearray()
    for field in fields:
        _append(body, field)
    return CDR_HEAD + bytes(body)


def _append(body: bytearray, field: Field) -> None:
    if isinstance(field, str):
        data = field.encode("utf-8") + b"\0"
        _append(body, ("I", len(data)))
        body += data
    elif isinstance(field, list):
        _append(body, ("I", len(field)))
        for text in field:
            _append(body, text)
    else:
        code, *numbers = field
        body += bytes(-len(body) % struct.calcsize(code)) + struct.pack(f"<{len(numbers)}{code}", *numbers)
