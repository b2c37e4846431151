"""JSON of the rosbridge protocol: the messages that a body reads, and how any message is written.

Checked is only what is read; fields and operations that are not known here are left out, as the protocol wants it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import msgspec
from msgspec import Struct

from vrs_cli.errors import IllegalValue


class RosbridgeMessage(Struct, frozen=True):
    """A message of a rosbridge server.

    `msg`: what a topic publishes, or what a status of this `level` says; `values`: what a service or action answers.
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
    """What is read of a std_msgs/msg/Header."""

    stamp: RosTime


class JointStates(Struct, frozen=True):
    """A sensor_msgs/msg/JointState. JSON has no NaN: rosbridge writes null."""

    header: Header
    name: tuple[str, ...]
    position: tuple[float | None, ...]
    velocity: tuple[float | None, ...] = ()
    effort: tuple[float | None, ...] = ()

    def column(self, values: Sequence[float | None], names: Sequence[str]) -> tuple[float, ...] | None:
        """Return a column in the order of these names; None if a value is missing or no finite number."""
        rows = dict(zip(self.name, values, strict=False))
        found = [rows.get(name) for name in names]
        return None if any(x is None or not isfinite(x) for x in found) else tuple(float(x or 0.0) for x in found)


class TimeAnswer(Struct, frozen=True):
    """The answer of /rosapi/get_time."""

    time: RosTime


def read_message(text: str | bytes) -> RosbridgeMessage:
    """Read a message. Raises IllegalValue for what is none."""
    try:
        return msgspec.convert(json.loads(text), RosbridgeMessage)
    except (ValueError, RecursionError) as error:
        raise IllegalValue(f"a message of rosbridge: {error}", "JSON with op") from None


def read_joint_states(message: RosbridgeMessage) -> JointStates:
    """Return what a topic published. Raises IllegalValue if that is no sensor_msgs/msg/JointState."""
    try:
        return msgspec.convert(message.msg, JointStates)
    except ValueError as error:
        raise IllegalValue(f"{message.topic}: {error}", "sensor_msgs/msg/JointState of ROS 2") from None


def read_time(message: RosbridgeMessage) -> float | None:
    """Return the time of ROS [s] that /rosapi/get_time answers; None if it has failed."""
    try:
        return msgspec.convert(message.values, TimeAnswer).time.seconds if message.result else None
    except ValueError:
        return None


def write_message(message: Mapping[str, Any]) -> str:
    """Return the JSON of a message."""
    return json.dumps(message, allow_nan=False, separators=(",", ":"))
