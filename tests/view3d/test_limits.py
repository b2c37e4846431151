"""Ranges at the joints: hands that show what g says, arcs from end to end, red where an end is near."""

from __future__ import annotations

from math import atan2, pi
from random import Random

import numpy as np
import pytest
import viser

from vrs_cli.engine.engine import Engine
from vrs_cli.kinematics.joints import Joints, nearest_turn
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.view3d.figure import Figure, link_node
from vrs_cli.view3d.parts import Shown
from vrs_cli.view3d.reach import END, HAND, LimitsView


def shown_at(model: RobotModel, q: Joints) -> Shown:
    engine = Engine(model)
    position = engine.position(0.0)
    return Shown(
        engine.arm, engine.timeline, 0.0, type(position)(*(0.0, q, q, q, position.T_world_tool, 0.0, False, "")), 0.0
    )


def drawn(server: viser.ViserServer, name: str) -> np.ndarray:
    """T_scene_node (4, 4)."""
    T = np.eye(4)
    for k in range(2, name.count("/") + 2):
        node = server.scene.get_handle_by_name("/".join(name.split("/")[:k]))
        rotation = viser.transforms.SO3(node.wxyz).as_matrix()
        T = T @ np.block([[rotation, node.position[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])
    return T


@pytest.mark.parametrize("name", robot_names())
def test_hands_show_the_joints(server: viser.ViserServer, name: str) -> None:
    model, random, root = load_robot(name), Random(2), f"/hands_{name}"
    figure, limits = Figure(server.scene, root, model), LimitsView(server.scene, root, model)
    limits.visible = True
    limits.show(shown_at(model, model.poses["ready"]))
    for _ in range(5):
        q = tuple(map(random.uniform, model.lower, model.upper))
        figure.pose(q, 0.0)
        for joint, (x, before) in enumerate(zip(q, link_frames(model, q)[:-1], strict=True), 1):
            hand = (np.linalg.inv(np.array([*before, 0, 0, 0, 1]).reshape(4, 4))
                    @ drawn(server, f"{link_node(root, joint)}/hand{joint}"))  # fmt: skip
            link = model.links[joint - 1]
            if model.units.slides(joint):
                assert hand[2, 3] == pytest.approx(link.d + x, abs=1e-6)
            else:
                assert np.abs(hand[:2, 3]).max() < 1e-6, "about the axis"
                angle = atan2(hand[1, 0], hand[0, 0])
                assert nearest_turn(angle, link.theta + x) == pytest.approx(link.theta + x, abs=1e-6)
    figure.remove()


def test_an_arc_goes_from_end_to_end(server: viser.ViserServer) -> None:
    model = load_robot("puma560")
    Figure(server.scene, "/arcs", model)
    limits = LimitsView(server.scene, "/arcs", model)
    limits.visible = True
    limits.show(shown_at(model, model.poses["ready"]))
    for joint in range(1, 7):
        ends = server.scene.get_handle_by_name(f"{link_node('/arcs', joint - 1)}/ends{joint}").vertices
        free = server.scene.get_handle_by_name(f"{link_node('/arcs', joint - 1)}/range{joint}").vertices
        angles = np.arctan2(ends[:, 1], ends[:, 0])
        for limit in (model.lower[joint - 1], model.upper[joint - 1]):
            assert np.abs((angles - limit + pi) % (2 * pi) - pi).min() < 1e-6
        assert np.ptp(free[:, 2]) < 1e-6, "flat"


def test_nothing_is_made_before_it_is_shown_and_what_is_hidden_costs_nothing(server: viser.ViserServer) -> None:
    model = load_robot("puma560")
    Figure(server.scene, "/quiet", model)
    limits = LimitsView(server.scene, "/quiet", model)
    limits.show(shown_at(model, model.poses["ready"]))
    name = f"{link_node('/quiet', 2)}/hand2"
    assert server.scene.get_handle_by_name(name) is None
    limits.visible = True
    near = (*model.poses["ready"][:1], model.lower[1] + 0.01, *model.poses["ready"][2:])
    limits.show(shown_at(model, near))
    hand, label = (server.scene.get_handle_by_name(f"{name}{part}") for part in ("", "/value"))
    assert (label.text, hand.color) == ("JT2  -224 deg", END)
    limits.show(shown_at(model, model.poses["ready"]))
    assert (label.text, hand.color) == ("JT2  -90 deg", HAND)
    limits.visible = False
    limits.show(shown_at(model, model.poses["ready"]))
    assert not hand.visible
