"""Where a node is put: what is sent, against viser's own setters."""

from __future__ import annotations

import numpy as np
import pytest
import viser
from viser.infra import Message

from vrs_cli.kinematics.transform import Transform, compose, rotation_x, rotation_z, translation, unit_quaternion
from vrs_cli.view3d.parts import GRAIN, move_points, place, transform_of

AT = compose(translation(0.5, -0.25, 0.125), compose(rotation_z(0.7), rotation_x(-2.5)))
POSES = ("SetPositionMessage", "SetOrientationMessage")


def told(server: viser.ViserServer, node: str) -> list[dict[str, object]]:
    """The messages about its pose that a page is told which comes now, without its name."""
    recording = server.get_scene_serializer()
    found = [message for _, message in recording._messages if message["type"] in POSES and message["name"] == node]
    recording.serialize()
    return [{key: value for key, value in message.items() if key != "name"} for message in found]


def test_a_page_is_told_what_the_setters_of_viser_tell(server: viser.ViserServer) -> None:
    ours, its = server.scene.add_frame("/ours"), server.scene.add_frame("/its")
    place(ours, AT)
    its.position, its.wxyz = ours.position.copy(), ours.wxyz.copy()
    assert [message["type"] for message in told(server, "/ours")] == list(POSES)
    assert told(server, "/ours") == told(server, "/its")
    assert np.abs(np.subtract(transform_of(its), AT)).max() < 4 * GRAIN
    assert np.abs(np.subtract(its.wxyz, unit_quaternion(AT))).max() < GRAIN


def test_what_moves_less_than_anybody_sees_is_told(server: viser.ViserServer) -> None:
    node = server.scene.add_frame("/node")
    place(node, AT)
    near = AT._replace(px=AT.px + 1e-6)
    place(node, near)
    assert abs(node.position[0] - near.px) < GRAIN
    assert tuple(node.position.tolist()) in [message.get("position") for message in told(server, "/node")]


def test_nothing_is_sent_of_what_stays(server: viser.ViserServer) -> None:
    node = server.scene.add_frame("/node")
    place(node, AT)
    recording = server.get_scene_serializer()
    before = len(recording._messages)
    place(node, Transform(*AT))
    place(node, AT._replace(px=AT.px + 0.1 * GRAIN))
    assert len(recording._messages) == before
    recording.serialize()


def test_a_page_is_told_of_lines_what_the_setter_of_viser_tells(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = server.scene.add_line_segments("/lines", np.zeros((2, 2, 3), np.float32), (0, 0, 0))
    sent = list[Message]()
    monkeypatch.setattr(server._websock_server, "queue_message", sent.append)
    points = np.arange(12, dtype=np.float32).reshape(2, 2, 3)
    move_points(node, points)
    assert np.array_equal(node.points, points)
    node.points = np.zeros_like(points)
    node.points = points
    ours, _, its = sent
    assert ours.as_serializable_dict() == its.as_serializable_dict(), "in a recording"
    arrays = list[memoryview](), list[memoryview]()
    assert ours.as_serializable_dict(arrays[0]) == its.as_serializable_dict(arrays[1]), "on a connection"
    assert arrays[0] == arrays[1]
