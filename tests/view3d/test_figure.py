"""Arms in a scene: every link where g says, nothing sent of what does not move."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import numpy as np
import pytest
import viser

from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.shapes import Box, LinkShape, Opening, opened
from vrs_cli.kinematics.transform import IDENTITY, compose, inverse, rotation_z, translation
from vrs_cli.view3d.figure import Figure, link_node
from vrs_cli.view3d.parts import transform_of

BASE = compose(translation(0.1, -0.2, 0.3), rotation_z(0.7))


def at_random(model: RobotModel, random: Random) -> Joints:
    return tuple(map(random.uniform, model.lower, model.upper))


def matrix(node: viser.SceneNodeHandle) -> np.ndarray:
    """The pose of a node in its parent, (3, 4)."""
    rotation = viser.transforms.SO3(node.wxyz).as_matrix()
    return np.column_stack([rotation, node.position])


@pytest.mark.parametrize("name", robot_names())
def test_links_stand_where_g_puts_them(server: viser.ViserServer, name: str) -> None:
    model, random = load_robot(name), Random(5)
    figure = Figure(server.scene, f"/{name}", model)
    q = at_random(model, random)
    for near in (1.0, 1.0, 1e-7, 1e-7):
        q = tuple(x + near * (y - x) for x, y in zip(q, at_random(model, random), strict=True))
        figure.pose(q, random.random())
        drawn = np.eye(4)
        for node, T in zip(figure.links, link_frames(model, q), strict=True):
            drawn = drawn @ np.vstack([matrix(node), (0.0, 0.0, 0.0, 1.0)])
            assert np.abs(drawn[:3] - np.array(T).reshape(3, 4)).max() < 1e-7
    figure.remove()


def test_base_moves_the_whole_arm(server: viser.ViserServer) -> None:
    model = load_robot("puma560")
    figure = Figure(server.scene, "/based", model)
    figure.pose(model.poses["ready"], 0.0, BASE)
    root = server.scene.get_handle_by_name("/based")
    assert np.abs(matrix(root) - np.array(inverse(BASE)).reshape(3, 4)).max() < 1e-7
    figure.pose(model.poses["ready"], 0.0)
    assert np.abs(matrix(root) - np.array(IDENTITY).reshape(3, 4)).max() == 0.0
    figure.remove()


def sent(server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str]]:
    """From now on: what is sent of which node."""
    found: list[tuple[str, str]] = []
    send = server.scene._queue_scene_message

    def heard(message: object) -> None:
        found.append((type(message).__name__, str(getattr(message, "name", ""))))
        send(message)

    monkeypatch.setattr(server.scene, "_queue_scene_message", heard)
    return found


def test_nothing_is_sent_of_what_stands_still(server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch) -> None:
    model = load_robot("puma560")
    figure = Figure(server.scene, "/still", model)
    ready = model.poses["ready"]
    figure.pose(ready, 0.0)
    found = sent(server, monkeypatch)
    figure.pose(ready, 0.0)
    assert not found
    figure.pose((*ready[:4], 0.5, 0.0), 0.0)
    assert found == [("SetOrientationMessage", link_node("/still", 5))], "the links behind it move with it"
    found.clear()
    figure.pose((*ready[:4], 0.5, 0.0), 0.5)
    assert found
    assert all(name.startswith(link_node("/still", 6) + "/body") for _, name in found), "the fingers"
    found.clear()
    figure.visible = False
    assert {name for _, name in found} == {"/still"}
    assert not figure.visible
    figure.remove()


def test_a_finger_that_turns_turns_with_the_hand(server: viser.ViserServer) -> None:
    finger = LinkShape(2, Box((0.01, 0.01, 0.05)), opens=(Opening(turn=(0.0, 0.0, 1.2), point=(0.03, 0.0, 0.0)),))
    figure = Figure(server.scene, "/jaw", replace(load_robot("planar2"), shapes=(finger,)))
    ((node, opens),) = figure.fingers
    for hand in (0.0, 0.5, 1.0):
        figure.pose((0.0, 0.0), hand)
        assert transform_of(node) == pytest.approx(opened(opens, hand), abs=1e-7)
    assert transform_of(node).px > 0.015
    figure.remove()


def test_hand_opens_as_far_as_it_is_told(server: viser.ViserServer) -> None:
    model = load_robot("puma560")
    figure = Figure(server.scene, "/hand", model)
    fingers = []
    for hand in (0.0, 0.25, 1.0):
        figure.pose(model.poses["ready"], hand)
        fingers.append([finger.node.position.copy() for finger in figure.fingers])
    closed, quarter, full = np.array(fingers)
    assert not closed.any()
    assert np.abs(full).max() > 0.01
    assert quarter == pytest.approx(0.25 * full)
    figure.remove()
