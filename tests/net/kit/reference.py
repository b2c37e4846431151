"""Our own client at the kit: the connection of vrs_cli.net.protocol and a mirror."""

from __future__ import annotations

import base64
import json
from typing import Any

import msgspec

from tests.net.kit.conversation import Message, Step
from vrs_cli.engine.position import joints_at, world_pose
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model_data import from_dict
from vrs_cli.net.messages import (
    Asked,
    Clock,
    Delta,
    Done,
    FromClient,
    Hello,
    Refused,
    Replaced,
    Resync,
    Shown,
    Steered,
    Welcome,
    Withdrawn,
)
from vrs_cli.net.mirror import ClockReading, Mirror
from vrs_cli.net.protocol import ClientConnection
from vrs_cli.wire.codec import Frame
from vrs_cli.wire.messages import ServerMessage, snapshot_of
from vrs_cli.wire.records import Form, Motions, delta_of


class Reference:
    """Answers steps. It computes lines by inverse kinematics, whatever pieces come."""

    def __init__(self) -> None:
        self._client: ClientConnection | None = None
        self._mirror: Mirror | None = None
        self._ended: dict[int, str] = {}
        self._questions: set[int] = set()
        self._clock = Clock(0.0)

    def __call__(self, step: Step) -> Message:
        (kind,) = step
        answer = getattr(self, f"_{kind}")(step[kind])
        frames = () if self._client is None else self._client.frames()
        return {"send": [_object(frame) for frame in frames], kind: answer}

    def _open(self, fields: Message) -> None:
        if self._client is None:
            self._client = ClientConnection(msgspec.convert({"type": "hello", "versions": [1], **fields}, Hello))
        self._client.begin()

    def _cut(self, _: bool) -> None:
        assert self._client is not None
        self._client.cut()

    def _do(self, message: Message) -> None:
        assert self._client is not None
        id = {} if message["type"] == "answer" else {"id": self._client.next_id()}
        if message["type"] == "answer":
            self._questions.discard(message["question"])
        self._client.send(msgspec.convert({**message, **id}, FromClient))  # type: ignore[arg-type]

    def _received(self, message: Message) -> None:
        assert self._client is not None
        frame: Frame = base64.b64decode(message["base64"]) if "base64" in message else json.dumps(message)
        for one in self._client.receive(frame):
            self._take(one)

    def _take(self, message: ServerMessage) -> None:
        assert self._client is not None
        match message:
            case Welcome(model=model):
                self._arm = arm_for(from_dict(model))
                self._form = Form.of(self._arm)
                if not message.resumed:
                    self._questions.clear()
            case Replaced(snapshot, number=number):
                found = snapshot_of(snapshot, self._form)
                if self._mirror is None:
                    self._mirror = Mirror(self._arm, found, number, lambda: 0.0)
                else:
                    self._mirror.replace(found, number)
            case Delta(delta, number=number) if self._mirror is not None:
                self._mirror.change(delta_of(delta, Motions(), self._form), number)
            case Steered(target, number=number) if self._mirror is not None:
                self._mirror.steer(target, number)
            case Shown(snapshot=snapshot) if self._mirror is not None:
                assert self._mirror.extend(snapshot_of(snapshot, self._form))
            case Done(id):
                self._ended[id] = "done" if message.ok else "refused"
            case Refused(id=int(id)):
                self._ended[id] = "refused"
            case Asked(number):
                self._questions.add(number)
            case Withdrawn(number):
                self._questions.discard(number)
            case Clock():
                self._clock = message
        if self._mirror is not None and self._mirror.lost:
            self._client.send(Resync())

    # --- what is asked ---

    def _joints(self, asked: Message) -> list[list[float]]:
        assert self._mirror is not None
        return [list(joints_at(self._arm, self._mirror.timeline, t)) for t in asked["times"]]

    def _tools(self, asked: Message) -> list[list[float]]:
        assert self._mirror is not None
        timeline = self._mirror.timeline
        frames = [timeline.locate(t)[0].motion.frames for t in asked["times"]]
        return [
            list(world_pose(self._arm, one, joints_at(self._arm, timeline, t)))
            for one, t in zip(frames, asked["times"], strict=True)
        ]

    def _values(self, asked: Message) -> list[float]:
        assert self._mirror is not None
        return [self._mirror.timeline.value_at(asked["channel"], t) for t in asked["times"]]

    def _ends(self, _: bool) -> dict[str, str]:
        return {str(id): end for id, end in self._ended.items()}

    def _now(self, asked: Message) -> list[float]:
        clock = self._clock
        goes = clock.realtime and not clock.paused
        reading = ClockReading(clock.now, clock.rate if goes else None, clock.wall)
        return [reading.at(wall) for wall in asked["walls"]]

    def _asked(self, _: bool) -> list[int]:
        return sorted(self._questions)


def _object(frame: Frame) -> Message:
    message: dict[str, Any] = (
        json.loads(frame) if isinstance(frame, str) else {"base64": base64.b64encode(frame).decode()}
    )
    return message
