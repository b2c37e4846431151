"""A stand-in for a rosbridge server with a controller behind it, written from ROSBRIDGE_PROTOCOL.md: what it answers
to messages, without a socket (`Bridge`) and with one (`served`).

`python -m tests.bodies.bridge [PORT] [ROBOT] [RATE]` is one to try by hand, with `vrs body --rosbridge`. While it runs
`stop` on standard input is an emergency stop, and `release` ends it.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from typing import Any

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from tests.bodies.controller import Controller, Refusal
from tests.by_hand import command
from vrs_cli.engine.engine import Engine
from vrs_cli.kinematics.robot_file import load_robot

TOPIC = "/joint_trajectory_controller/joint_trajectory"
ACTION = "/joint_trajectory_controller/follow_joint_trajectory"


def stamp(t: float) -> Mapping[str, int]:
    return {"sec": int(t), "nanosec": int(t % 1.0 * 1e9)}


class Bridge:
    """`offset`: the clock of ROS minus that of its caller [s]. `has_time`: rosapi runs. `refuses`: goals."""

    def __init__(self, controller: Controller, offset: float = 0.0) -> None:
        self.controller, self.offset = controller, offset
        self.has_time, self.refuses = True, False
        self.subscribed, self.refused = False, list[str]()
        self.watched = False  # the state of the controller is subscribed to

    def receive(self, text: str | bytes, t: float) -> Iterator[Mapping[str, Any]]:
        """Take a message at the caller's time t [s], and yield the answers."""
        message, now = json.loads(text), t + self.offset
        match message:
            case {"op": "subscribe", "topic": "/joint_states", "type": "sensor_msgs/msg/JointState"}:
                self.subscribed = True
            case {"op": "subscribe", "type": "control_msgs/msg/JointTrajectoryControllerState"}:
                self.watched = True
            case {"op": "advertise", "topic": topic, "type": "trajectory_msgs/msg/JointTrajectory"} if topic == TOPIC:
                pass
            case {"op": "call_service", "service": "/rosapi/get_time", "id": id}:
                answer = {"op": "service_response", "id": id, "service": "/rosapi/get_time", "result": self.has_time}
                yield answer | {"values": {"time": stamp(now)} if self.has_time else "Service does not exist"}
            case {"op": "publish", "topic": topic, "msg": trajectory} if topic == TOPIC:
                with suppress(Refusal):  # a message of a topic has no answer
                    self._take(trajectory, now)
            case {"op": "send_action_goal", "id": id, "action": action, "args": {"trajectory": trajectory}} if (
                action == ACTION and message["action_type"] == "control_msgs/action/FollowJointTrajectory"
            ):
                answer = {"op": "action_result", "id": id, "action": action}
                try:
                    if self.refuses:
                        raise Refusal("Action goal was rejected")
                    self._take(trajectory, now)
                except Refusal as refusal:
                    yield answer | {"values": str(refusal), "status": 0, "result": False}
            case _:
                yield {"op": "status", "level": "error", "msg": f"Unknown operation: {message.get('op')}"}

    def _take(self, trajectory: Mapping[str, Any], now: float) -> None:
        try:
            self.controller.receive(trajectory, now)
        except Refusal as refusal:
            self.refused.append(str(refusal))
            raise

    def controller_states(self) -> list[dict[str, Any]]:
        """Return the state that the controller publishes: none while it is not active."""
        topic = "/joint_trajectory_controller/controller_state"
        message = {"op": "publish", "topic": topic, "msg": {"joint_names": list(self.controller.names)}}
        return [message] if self.watched and not self.controller.stopped else []

    def states(self, t: float) -> dict[str, Any]:
        """Return a message with joint_states of the caller's time t [s]."""
        position, velocity, _ = self.controller.state(t + self.offset)
        header = {"stamp": stamp(t + self.offset), "frame_id": ""}
        effort = [None] * len(position)
        names = list(self.controller.names)
        message = {"header": header, "name": names, "position": position, "velocity": velocity, "effort": effort}
        return {"op": "publish", "topic": "/joint_states", "msg": message}


@asynccontextmanager
async def served(bridge: Bridge, rate: float, port: int = 0) -> AsyncIterator[str]:
    """Serve it on a socket, with joint_states `rate` times a second by the clock of the process; yield its address."""

    async def talk(socket: ServerConnection) -> None:
        async def publish() -> None:
            while True:
                if bridge.subscribed:
                    await socket.send(json.dumps(bridge.states(time.monotonic())))
                    for state in bridge.controller_states():
                        await socket.send(json.dumps(state))
                await asyncio.sleep(1.0 / rate)

        publishing = asyncio.create_task(publish())
        with suppress(ConnectionClosed):
            async for text in socket:
                for answer in bridge.receive(text, time.monotonic()):
                    await socket.send(json.dumps(answer))
        publishing.cancel()
        with suppress(ConnectionClosed, asyncio.CancelledError):
            await publishing

    async with serve(talk, "127.0.0.1", port) as server:
        yield f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}"


def main(port: int = 9090, robot: str = "puma560", rate: float = 100.0) -> int:
    """Serve an arm that stands where the robot begins, for trials by hand."""
    joints = Engine(load_robot(robot)).position().joints
    controller = Controller([f"joint_{i}" for i, _ in enumerate(joints, 1)], joints, replaces=False)
    bridge = Bridge(controller, time.time() - time.monotonic())

    async def serve_arm() -> None:
        async with served(bridge, rate, port) as address:
            print(f"a stand-in for rosbridge at {address}", flush=True)
            while word := await asyncio.to_thread(sys.stdin.readline):
                if word.strip() == "stop":
                    controller.stop(time.monotonic() + bridge.offset)
                elif word.strip() == "release":
                    controller.release()
            await asyncio.Event().wait()

    asyncio.run(serve_arm())
    return 0


if __name__ == "__main__":
    command(main)
