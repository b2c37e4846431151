"""Around an arm: the floor where its foot is, the frames where BASE and g say, all of the arm in the picture."""

from __future__ import annotations

from math import tan

import numpy as np
import pytest
import viser

from vrs_cli.kinematics.model import link_frames
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.transform import compose, inverse, rotation_z, translation, unit_quaternion
from vrs_cli.view3d.figure import FIELD, GLYPHS, Stage, camera_for, floor_height, lettered, room_of

BASE = compose(translation(0.1, -0.2, 0.3), rotation_z(0.7))


def test_frames_stand_where_base_and_tool_say(server: viser.ViserServer) -> None:
    model = load_robot("puma560")
    stage = Stage(server.scene, model)
    T_world_tool = compose(inverse(BASE), link_frames(model, model.poses["ready"])[-1])
    node = server.scene.get_handle_by_name
    stage.pose(T_world_tool)
    assert not node("/base").visible, "it is the world"
    stage.pose(T_world_tool, BASE)
    assert node("/base").visible
    expected = {
        "/world": translation(0.0, 0.0, 0.0),
        "/base": inverse(BASE),
        "/floor": inverse(BASE),
        "/tool": T_world_tool,
    }
    for name, T in expected.items():
        assert node(name).position == pytest.approx((T.px, T.py, T.pz), abs=1e-7), name
        assert node(name).wxyz == pytest.approx(unit_quaternion(T), abs=1e-7), name


@pytest.mark.parametrize("name", robot_names())
@pytest.mark.parametrize("aspect", [1400 / 800, 390 / 844])
def test_all_of_the_arm_is_in_the_picture(name: str, aspect: float) -> None:
    model = load_robot(name)
    eye, aim = (np.array(point) for point in camera_for(model, aspect))
    ahead = (aim - eye) / np.linalg.norm(aim - eye)
    right = np.cross(ahead, (0.0, 0.0, 1.0)) / np.linalg.norm(np.cross(ahead, (0.0, 0.0, 1.0)))
    up = np.cross(right, ahead)
    for pose in ("ready", "nest"):
        low, high = room_of(model, model.poses[pose])
        for corner in np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T - eye:
            depth = corner @ ahead
            assert abs(corner @ up) / depth < tan(FIELD / 2)
            assert abs(corner @ right) / depth < aspect * tan(FIELD / 2)


def test_the_puma_stands_as_high_as_the_book_says() -> None:
    assert floor_height(load_robot("puma560")) == pytest.approx(-0.6604, abs=1e-9)


def test_numbers_lie_on_the_floor_and_face_up() -> None:
    points, faces = lettered("".join(GLYPHS), 0.05)
    a, b, c = np.moveaxis(points[faces], 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()
    high, wide, flat = np.ptp(points, axis=0)
    assert flat == 0.0
    assert high == pytest.approx(0.05, rel=0.15)
    assert wide > 10 * high
