"""A page without a browser: it talks with viser's server as viser's own page does, and keeps what it is told."""

from __future__ import annotations

import http.client
import json
import time
from collections.abc import Callable
from contextlib import suppress
from math import dist
from typing import Any, TypeVar
from urllib.parse import urlsplit

import msgspec
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from tests.live import PATIENCE, PAUSE
from vrs_cli.kinematics.transform import Transform, position

PROTOCOL = f"viser-v{viser.__version__}"
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (2.0, 2.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 800,
    "image_width": 1000,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
T = TypeVar("T")
Message = dict[str, Any]


def asked_of(address: str, path: str) -> tuple[int, str]:
    """What the address of a page answers to a request for a path below it: all of it."""
    parts = urlsplit(address)
    connection = http.client.HTTPConnection("127.0.0.1", parts.port or 0, timeout=PATIENCE)
    connection.request("GET", parts.path + path, headers={"Accept-Encoding": "gzip"})
    answer = connection.getresponse()
    return answer.status, answer.read().decode()


def lost_of(address: str) -> str:
    """What the page says of a robot that is not heard; empty where it is."""
    return str(json.loads(asked_of(address, "there")[1])["lost"])


class Page:
    """`address`: that of the page; `camera`: what is otherwise than in CAMERA. `told`: all that the server has said,
    oldest first.
    """

    def __init__(self, address: str, **camera: object) -> None:
        origin = "http://" + address.removeprefix("http://").split("/")[0]
        where = address.replace("http://", "ws://").rstrip("/")
        self._socket = connect(
            where, origin=origin, subprotocols=[PROTOCOL], compression=None, max_size=None, max_queue=None
        )  # type: ignore[arg-type, list-item]
        self.told: list[Message] = []
        self._send(CAMERA | camera)

    def __enter__(self) -> Page:
        return self

    def __exit__(self, *_error: object) -> None:
        with suppress(ConnectionClosed):
            self._socket.close()

    def _send(self, message: Message) -> None:
        self._socket.send(msgspec.msgpack.encode(message))

    # --- what a user does ---

    def set(self, uuid: str, value: object) -> None:
        """An element of the panels is given a value, or pressed."""
        self._send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}})

    def hold(self, uuid: str) -> None:
        """A button is held down: it says so ten times a second."""
        self._send({"type": "GuiButtonHoldMessage", "uuid": uuid, "frequency": 10.0})

    def key(self, label: str) -> None:
        """The key of a command is pressed."""
        there = self.until(
            lambda: next((m for m in self.of("RegisterCommandMessage") if m["props"]["label"] == label), None)
        )
        self._send({"type": "CommandTriggerMessage", "uuid": there["uuid"]})

    # --- what a user sees ---

    def of(self, kind: str) -> list[Message]:
        return [message for message in self.told if message["type"] == kind]

    def pose(self, node: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Where a node was put last: position and wxyz."""
        last: dict[str, tuple[float, ...]] = {}
        for message in self.told:
            if message.get("name") == node and message["type"] in ("SetPositionMessage", "SetOrientationMessage"):
                part = "wxyz" if "wxyz" in message else "position"
                last[part] = tuple(message[part])
        return last["position"], last["wxyz"]

    def is_at(self, node: str, place: Transform) -> bool:
        """Whether a node was put there last."""
        told = [tuple(m["position"]) for m in self.of("SetPositionMessage") if m["name"] == node]
        return bool(told) and dist(told[-1], position(place)) < 1e-7

    def gui(self, kind: str, **props: object) -> Message:
        """The first element of that kind with these properties; its properties are those that it has now."""
        message = self.until(
            lambda: next(
                (m for m in self.of(kind) if all(m["props"].get(name) == value for name, value in props.items())), None
            )
        )
        now = dict(message["props"], value=message.get("value"))
        for update in self.of("GuiUpdateMessage"):
            if update["uuid"] == message["uuid"]:
                now.update(update["updates"])
        return {"uuid": message["uuid"], **now}

    def html(self) -> str:
        """All that panels show as HTML, as it is now."""
        now = {m["uuid"]: m["props"]["content"] for m in self.of("GuiHtmlMessage")}
        for update in self.of("GuiUpdateMessage"):
            if update["uuid"] in now and "content" in update["updates"]:
                now[update["uuid"]] = update["updates"]["content"]
        return "\n".join(now.values())

    def told_of_time(self) -> str:
        """The line under the strip."""
        return next((line for line in self.html().split("\n") if "</b> of " in line), "")

    def said(self) -> list[str]:
        """The notices that were shown."""
        return [message["props"]["body"] for message in self.of("NotificationShowMessage")]

    def until(self, found: Callable[[], T | bool | None]) -> T:
        """Hear more until there is something; that."""
        deadline = time.monotonic() + PATIENCE
        while not (it := found()):
            assert time.monotonic() < deadline, [message["type"] for message in self.told[-20:]]
            self._hear()
        return it  # type: ignore[return-value]

    def quiet(self, seconds: float) -> list[Message]:
        """What is told within that time."""
        before, deadline = len(self.told), time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0.0:
            self._hear(left)
        return self.told[before:]

    def _hear(self, seconds: float = PAUSE) -> None:
        with suppress(TimeoutError):
            frame = self._socket.recv(timeout=seconds)
            assert isinstance(frame, bytes)
            size = int.from_bytes(frame[8:16], "little")
            inner = zstandard.ZstdDecompressor().decompress(frame[16 : 16 + size], int.from_bytes(frame[:8], "little"))
            self.told += msgspec.msgpack.decode(inner)["messages"]
