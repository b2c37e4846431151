"""Define sample times and joint names of exports, and export a trajectory as an MCAP log of ROS 2 messages, which
Foxglove shows without plugins and `ros2 bag play` plays.

Topics: at each sample /joint_states (sensor_msgs/JointState), /tool (geometry_msgs/PoseStamped, T_world_tool) and /tf
(tf2_msgs/TFMessage, the frames of all links and the tool, each in the one before); /commands (rcl_interfaces/Log) when
a motion begins; /signals (the same type) when a signal or the hand is set; in a cell also /tf (T_world_part) when a
part has moved since the last sample. The log's clock is the robot's: 0 is 0 s.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from heapq import merge
from importlib.util import find_spec
from itertools import chain, pairwise
from math import ceil, cos, sin
from typing import Any, BinaryIO, NamedTuple, Protocol

import numpy as np

from vrs_cli.engine.position import positions_at
from vrs_cli.errors import UsageError
from vrs_cli.extras import how_to_install
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats, compose_batch, stack
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform, compose, inverse, position
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import HAND
from vrs_cli.version import __version__

CHUNK = 4096  # maximum number of rows in memory at a time
NANOSECONDS = 1_000_000_000  # number of nanoseconds in a second


def sample_times(timeline: Timeline, rate: float) -> Iterator[Floats]:
    """Yield start, start + 1/rate, ... and the exact end [s], in arrays of at most CHUNK + 1."""
    start, end = timeline.start, timeline.end
    count = ceil((end - start) * rate)
    for first in range(0, count, CHUNK):
        times = start + np.arange(first, min(first + CHUNK, count)) / rate
        yield times[times < end]
    yield np.array([end])


def joint_names(arm: RobotArm) -> list[str]:
    """Return jt1, jt2, ..."""
    return [f"jt{i}" for i in range(1, arm.model.joint_count + 1)]


def nanoseconds(times: Floats) -> list[int]:
    """Convert times (N,) [s] to whole nanoseconds."""
    return [round(t * NANOSECONDS) for t in times.tolist()]


# --- an MCAP log -----------------------------------------------------------------------------------------------------


INFO = 20  # the level of rcl_interfaces/Log
CDR_HEAD = b"\x00\x01\x00\x00"
Field = str | list[str] | tuple[Any, ...]  # a text; texts; or a code of `struct` and numbers

_TIME = "int32 sec\nuint32 nanosec"
_HEADER = "builtin_interfaces/Time stamp\nstring frame_id"
_RULE = "\n" + "=" * 80 + "\n"


def _schema(own: str, *others: tuple[str, str]) -> bytes:
    """Return the schema of a message and of the messages that it contains."""
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
    """The world around a robot; its class is in a folder above this one."""

    def poses(self, timeline: Timeline, t: float) -> Iterator[tuple[str, Transform]]: ...


def check_mcap() -> None:
    """Raise UsageError if the package is missing."""
    if find_spec("mcap") is None:
        raise UsageError("a log in MCAP needs mcap, which is not installed", how_to_install("mcap"))


class LogMessage(NamedTuple):
    """A message of a log: `time` in nanoseconds, `data` in CDR."""

    time: int
    topic: str
    data: bytes


def write_mcap(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: PartPoses | None = None
) -> None:
    """Write the whole trajectory, with messages in order of time."""
    check_mcap()
    from mcap.writer import Writer

    writer = Writer(_Counted(stream.write))  # type: ignore[arg-type]  # the writer calls only write and tell
    writer.start(profile="ros2", library=f"vrs {__version__}")
    writer.add_metadata("robot", {"name": arm.model.name, "title": arm.model.title})
    channels = {}
    absent = {SIGNALS} if not timeline.event_count else set[str]()
    for topic, (name, text) in TOPICS.items():
        if topic in absent:
            continue
        schema = writer.register_schema(name, "ros2msg", text)
        channels[topic] = writer.register_channel(topic, "cdr", schema)
    sources = (
        _commands(timeline),
        _signals(timeline),
        _states(arm, timeline, rate),
        _part_frames(world, timeline, rate),
    )
    for message in merge(*sources, key=lambda message: message.time):
        writer.add_message(channels[message.topic], message.time, message.data, message.time)
    writer.finish()  # type: ignore[no-untyped-call]


class _Counted:
    """A stream that counts the written bytes, also for a pipe."""

    def __init__(self, write: Callable[[bytes], int]) -> None:
        self._write, self._count = write, 0

    def write(self, data: bytes) -> int:
        self._count += len(data)
        return self._write(data)

    def tell(self) -> int:
        return self._count

    def flush(self) -> None:
        """Do nothing: nothing is buffered here."""


# --- messages --------------------------------------------------------------------------------------------------


def _states(arm: RobotArm, timeline: Timeline, rate: float) -> Iterator[LogMessage]:
    n, names = arm.model.joint_count, frame_names(arm.model)
    numbers, no_pose = ("d", *[0.0] * n), ("d", *[0.0] * 7)
    joints = _Template(_stamp(0), "", joint_names(arm), ("I", n), numbers, ("I", n), numbers, ("I", 0))
    tool = _Template(_stamp(0), "world", no_pose)
    transforms = ((_stamp(0), parent, child, no_pose) for parent, child in pairwise(names))
    frames = _Template(("I", len(names) - 1), *chain.from_iterable(transforms))
    for times in sample_times(timeline, rate):
        here = positions_at(arm, timeline, times)
        ns = nanoseconds(times)
        rows = zip(
            ns,
            joints.encode(ns, here.joints, here.velocity),
            tool.encode(ns, _poses(here.T_world_tool)),
            frames.encode(ns, *_frame_poses(arm.model, timeline, times, here.joints)),
            strict=True,
        )
        for t, joint_state, pose, links in rows:
            yield LogMessage(t, "/joint_states", joint_state)
            yield LogMessage(t, "/tool", pose)
            yield LogMessage(t, FRAMES, links)


class _Template:
    """Encodes messages in CDR that differ only in their times and in numbers of type double. The rest is constant."""

    def __init__(self, *fields: Field) -> None:
        self._body, self._stamps, self._blocks = bytearray(), list[int](), list[int]()
        for field in fields:
            _append(self._body, field)
            if field == _stamp(0):
                self._stamps.append(len(CDR_HEAD) + len(self._body) - _STAMP.size)
            elif isinstance(field, tuple) and field[0] == "d":
                self._blocks.append(len(CDR_HEAD) + len(self._body) - (len(field) - 1) * struct.calcsize("d"))

    def encode(self, ns: list[int], *blocks: Floats) -> list[bytes]:
        """Return N messages at times `ns`; each of `blocks` (N, k) replaces numbers."""
        rows = np.tile(np.frombuffer(CDR_HEAD + self._body, np.uint8), (len(ns), 1))
        stamps = np.stack(np.divmod(np.array(ns), NANOSECONDS), axis=1).astype("<i4").view(np.uint8)
        for at in self._stamps:
            rows[:, at : at + _STAMP.size] = stamps
        for at, block in zip(self._blocks, blocks, strict=True):
            data = np.ascontiguousarray(block, "<f8").view(np.uint8)
            rows[:, at : at + data.shape[1]] = data
        whole, size = rows.tobytes(), rows.shape[1]
        return [whole[at : at + size] for at in range(0, len(whole), size)]


def _poses(T: Floats) -> Floats:
    """Convert transformations (N, 3, 4) to x, y, z [m] and a quaternion, (N, 7)."""
    return np.hstack((T[:, :, 3], quaternions(T[:, :, :3])))


def _commands(timeline: Timeline) -> Iterator[LogMessage]:
    """Yield a message when a motion begins, and when it continues after an inserted one."""
    before = 0
    for segment in timeline:
        motion = segment.motion
        if motion.number != before:
            ns, text = round(segment.start * NANOSECONDS), motion.text or motion.kind.value
            yield LogMessage(ns, "/commands", cdr(_stamp(ns), ("B", INFO), "vrs", text, "", "", ("I", 0)))
        before = motion.number


def _signals(timeline: Timeline) -> Iterator[LogMessage]:
    """Yield a message when a signal or the hand is set."""
    for event in timeline.events:
        if not event.observed:
            ns, on = round(event.time * NANOSECONDS), "on" if event.value else "off"
            text = f"hand {event.value:g}" if event.channel == HAND else f"{event.channel} {on}"
            yield LogMessage(ns, SIGNALS, cdr(_stamp(ns), ("B", INFO), "vrs", text, "", "", ("I", 0)))


def frame_names(model: RobotModel) -> list[str]:
    """Return the names of the frames in a log, each the parent of the next: world, ROBOT/base, ROBOT/link1, ...,
    ROBOT/flange, ROBOT/tool.
    """
    links = [f"link{i}" for i in range(1, model.joint_count)]
    return ["world", *(f"{model.name}/{name}" for name in ("base", *links, "flange", "tool"))]


def _frame_poses(model: RobotModel, timeline: Timeline, times: Floats, q: Floats) -> Iterator[Floats]:
    """Yield for each frame its pose at each time, (N, 7), of joints (N, n) [rad, m]."""
    frames = [timeline.locate(t)[0].motion.frames for t in times.tolist()]
    known = {one: (compose(inverse(one.base), model.base), one.tool) for one in set(frames)}
    rows = stack([T for one in frames for T in known[one]]).reshape(-1, 2, 3, 4)
    links = [_link_rows(model, i, q[:, i]) for i in range(model.joint_count)]
    links[-1] = compose_batch(links[-1], stack([model.flange])[0])
    return map(_poses, (rows[:, 0], *links, rows[:, 1]))


def _link_rows(model: RobotModel, i: int, x: Floats) -> Floats:
    """Return the transformations (N, 3, 4) of the joint with index i at values (N,) [rad, m], as `axes.link_transform`
    does.
    """
    link = model.links[i]
    turns = link.kind is JointKind.REVOLUTE
    theta, d = (link.theta + x, link.d + 0.0 * x) if turns else (link.theta + 0.0 * x, link.d + x)
    c, s, ca, sa, zero = np.cos(theta), np.sin(theta), cos(link.alpha), sin(link.alpha), np.zeros_like(x)
    columns = (
        c, -s * ca, s * sa, link.a * c,
        s, c * ca, -c * sa, link.a * s,
        zero, zero + sa, zero + ca, d,
    )  # fmt: skip
    return np.stack(columns, axis=-1).reshape(-1, 3, 4)


def _part_frames(world: PartPoses | None, timeline: Timeline, rate: float) -> Iterator[LogMessage]:
    """Yield a message for each part that has moved since the last sample."""
    before: dict[str, Transform] = {}
    if world is None:
        return
    for times in sample_times(timeline, rate):
        for t, ns in zip(times.tolist(), nanoseconds(times), strict=True):
            for name, T in world.poses(timeline, t):
                if before.get(name) != T:
                    before[name] = T
                    orientation = quaternions(np.array(T).reshape(1, 3, 4)[:, :, :3])[0].tolist()
                    place = ("d", *position(T), *orientation)
                    yield LogMessage(ns, FRAMES, cdr(("I", 1), _stamp(ns), "world", name, place))


_STAMP = struct.Struct("<ii")


def _stamp(nanoseconds: int) -> Field:
    return ("i", *divmod(nanoseconds, NANOSECONDS))


def cdr(*fields: Field) -> bytes:
    """Encode a message in CDR, little-endian: each number is aligned to its size, counted from the end of the head."""
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


def quaternions(R: Floats) -> Floats:
    """Convert rotations (N, 3, 3) to x, y, z, w (N, 4), w not negative. (Shepperd 1978: largest component first.)"""
    m00, m11, m22 = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    squares = np.stack((1 + m00 - m11 - m22, 1 - m00 + m11 - m22, 1 - m00 - m11 + m22, 1 + m00 + m11 + m22), axis=1)
    xy, xz, yz = R[:, 0, 1] + R[:, 1, 0], R[:, 0, 2] + R[:, 2, 0], R[:, 1, 2] + R[:, 2, 1]
    x, y, z = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]
    rows = np.stack(
        [
            np.stack((squares[:, 0], xy, xz, x), axis=1),
            np.stack((xy, squares[:, 1], yz, y), axis=1),
            np.stack((xz, yz, squares[:, 2], z), axis=1),
            np.stack((x, y, z, squares[:, 3]), axis=1),
        ],
        axis=1,
    )
    largest = rows[np.arange(len(R)), np.argmax(squares, axis=1)]
    unit: Floats = largest / np.linalg.norm(largest, axis=1, keepdims=True)
    return np.where(unit[:, 3:] < 0.0, -unit, unit)
