"""Text formats of bodies: lines of set points and reports in CSV or JSON, and JSON messages of the rosbridge protocol.

A set point has the time of the robot's clock [s], the joints, and their velocities [deg, deg/s; mm, mm/s of a slide]:

    t,jt1,...,jtn,v1,...,vn,mode
    {"t": 2.5, "joints": [...], "velocity": [...], "mode": "follows"}

The mode is the order to the body: `follows`, or `holds` for standing still. A report is such a line as well. In CSV it
has the time, the joints and, if known, the velocities; in JSON `joints` and optionally `t` (default: now), `velocity`,
`effort` [N m, N] and `mode` (`follows`, `holds`, `stopped`). A line that begins with `{` is JSON. Of a rosbridge
message only the fields that are read are checked; unknown fields and operations are ignored, as the protocol demands.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from enum import Enum
from math import isfinite
from typing import Any

import msgspec
from msgspec import Struct

from vrs_cli.errors import FileDamaged, IllegalValue
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.trajectory.state import JointState
from vrs_cli.values.measured import BodyMode, Report
from vrs_cli.values.numbers import count

MAX_SHOWN = 60  # maximum number of characters shown of a wrong line


class LineFormat(Enum):
    """The format of set points."""

    CSV = "csv"
    JSON = "json"


class _ReportLine(msgspec.Struct, forbid_unknown_fields=True):
    joints: list[float]
    t: float | None = None
    velocity: list[float] | None = None
    effort: list[float] | None = None
    mode: BodyMode = BodyMode.FOLLOWS


_DECODER = msgspec.json.Decoder(_ReportLine)


def heading(joint_count: int) -> str:
    """Return the names of the columns of set points in CSV."""
    numbers = range(1, joint_count + 1)
    return ",".join(["t", *(f"jt{i}" for i in numbers), *(f"v{i}" for i in numbers), "mode"])


def setpoint_line(form: LineFormat, t: float, state: JointState, mode: BodyMode, units: JointUnits) -> str:
    """Write a set point as a line of text: joints and velocities of `state` [rad, m] at `t` [s]."""
    joints, velocity = (
        [round(value, 9) + 0.0 for value in units.to_display(row)] for row in (state.joints, state.velocity)
    )
    if form is LineFormat.JSON:
        return json.dumps({"t": round(t, 9), "joints": joints, "velocity": velocity, "mode": mode.value})
    return ",".join([f"{t:.9g}", *(f"{value:.9g}" for value in (*joints, *velocity)), mode.value])


def read_report(line: str, now: float, units: JointUnits, joint_count: int) -> Report:
    """Read a report; `now` [s] is its time if the line has none. Raises FileDamaged."""
    text = line.strip()
    if text.startswith("{"):
        return _read_json(text, now, units, joint_count)
    fields = [field.strip() for field in text.split(",")]
    if len(fields) not in (1 + joint_count, 1 + 2 * joint_count):
        right = f"a report is the time and {count(joint_count, 'joint')}, and as many velocities if they are known"
        raise FileDamaged(f"{count(len(fields), 'field')} in {_quote(text)}", right)
    try:
        t, *numbers = map(float, fields)
    except ValueError:
        raise FileDamaged(f"{_quote(text)} holds what is no number", "a report is the time and the joints") from None
    velocity = numbers[joint_count:]
    return _report(t, numbers[:joint_count], velocity or None, None, BodyMode.FOLLOWS, units, joint_count)


def _read_json(text: str, now: float, units: JointUnits, joint_count: int) -> Report:
    try:
        one = _DECODER.decode(text)
    except msgspec.DecodeError as error:
        raise FileDamaged(f"{_quote(text)}: {error}", 'a report is {"t": s, "joints": [...]}') from None
    t = now if one.t is None else one.t
    return _report(t, one.joints, one.velocity, one.effort, one.mode, units, joint_count)


def _report(
    t: float,
    joints: list[float],
    velocity: list[float] | None,
    effort: list[float] | None,
    mode: BodyMode,
    units: JointUnits,
    joint_count: int,
) -> Report:
    for name, row in (("joints", joints), ("velocity", velocity), ("effort", effort)):
        if row is not None and len(row) != joint_count:
            raise FileDamaged(f"{count(len(row), 'number')} of {name}", f"this robot has {count(joint_count, 'joint')}")
    if not all(map(isfinite, (t, *joints, *(velocity or ()), *(effort or ())))):
        raise FileDamaged("a number that is not finite", "each is a number as 12.5")
    speed = None if velocity is None else units.read(velocity)
    return Report(t, units.read(joints), speed, None if effort is None else tuple(effort), mode)


def _quote(text: str) -> str:
    return repr(text if len(text) <= MAX_SHOWN else text[:MAX_SHOWN] + "...")


class RosbridgeMessage(Struct, frozen=True):
    """A message of a rosbridge server.

    `msg`: the content of a topic, or the text of a status of this `level`; `values`: the answer of a service or action.
    """

    op: str
    id: str | None = None
    topic: str = ""
    msg: Any = None
    level: str = ""
    service: str = ""
    values: Any = None
    result: bool = True
    status: int | None = None


class RosTime(Struct, frozen=True):
    """A builtin_interfaces/msg/Time."""

    sec: int
    nanosec: int

    @property
    def seconds(self) -> float:
        return self.sec + self.nanosec * 1e-9


class Header(Struct, frozen=True):
    """The fields read from a std_msgs/msg/Header."""

    stamp: RosTime


class JointStates(Struct, frozen=True):
    """A sensor_msgs/msg/JointState. JSON has no NaN; rosbridge writes null."""

    header: Header
    name: tuple[str, ...]
    position: tuple[float | None, ...]
    velocity: tuple[float | None, ...] = ()
    effort: tuple[float | None, ...] = ()

    def column(self, values: Sequence[float | None], names: Sequence[str]) -> tuple[float, ...] | None:
        """Return a column in the order of these names; None if a value is missing or not finite."""
        rows = dict(zip(self.name, values, strict=False))
        found = [rows.get(name) for name in names]
        return None if any(x is None or not isfinite(x) for x in found) else tuple(float(x or 0.0) for x in found)


class TimeAnswer(Struct, frozen=True):
    """The answer of /rosapi/get_time."""

    time: RosTime


def read_message(text: str | bytes) -> RosbridgeMessage:
    """Read a message. Raises IllegalValue for invalid JSON."""
    try:
        return msgspec.convert(json.loads(text), RosbridgeMessage)
    except (ValueError, RecursionError) as error:
        raise IllegalValue(f"a message of rosbridge: {error}", "JSON with op") from None


def read_joint_states(message: RosbridgeMessage) -> JointStates:
    """Return the joint states that a topic published. Raises IllegalValue for any other content."""
    try:
        return msgspec.convert(message.msg, JointStates)
    except ValueError as error:
        raise IllegalValue(f"{message.topic}: {error}", "sensor_msgs/msg/JointState of ROS 2") from None


def read_time(message: RosbridgeMessage) -> float | None:
    """Return the time of ROS [s] in the answer of /rosapi/get_time; None if the call failed."""
    try:
        return msgspec.convert(message.values, TimeAnswer).time.seconds if message.result else None
    except ValueError:
        return None


def write_message(message: Mapping[str, Any]) -> str:
    """Return the JSON of a message."""
    return json.dumps(message, allow_nan=False, separators=(",", ":"))
