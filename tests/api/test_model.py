"""What a robot is, frames of links, matrices as locations, and warnings of mixed units."""

from __future__ import annotations

import warnings
from math import radians

import numpy as np
import pytest

import vrs_cli as vrs
from vrs_cli.api.location import Units
from vrs_cli.kinematics.robot_file import load_robot

PART = vrs.trans(300, 450, -200, 90, 90, 0)
JOINTS = (0, -45, 180, 0, 45, 0)


def test_robots_are_those_that_robot_takes() -> None:
    assert "puma560" in vrs.robots()
    assert vrs.Robot("cobra600").model.name in vrs.robots()


@pytest.mark.parametrize("name", ["puma560", "cobra600"])
def test_a_model_tells_limits_and_poses_in_the_units_of_its_robot(name: str) -> None:
    model, si = load_robot(name), vrs.Robot(name, units="SI").model
    assert si.limits.tolist() == [list(pair) for pair in zip(model.lower, model.upper, strict=True)]
    shown = vrs.Robot(name).model
    assert shown.dof == len(shown.names) == model.joint_count
    scales = Units.VAL.scales(model.units, model.joint_count)
    assert shown.max_velocity == pytest.approx(si.max_velocity * scales)
    r = vrs.Robot(name)
    assert r.joints == pytest.approx(shown.poses["ready"])


def test_a_matrix_is_a_location_wherever_one_is_taken() -> None:
    a, b = vrs.Robot(), vrs.Robot()
    a.move(PART).moves(PART @ vrs.trans(0, 0, -50))
    b.move(PART.matrix).moves((PART @ vrs.trans(0, 0, -50)).matrix)
    assert a.where().joints == pytest.approx(b.where().joints, abs=1e-9)
    assert np.array_equal(a.ik(PART).usable, a.ik(PART.matrix).usable)
    many = vrs.trans([300, 310], 450, -200, 90, 90, 0)
    assert a.ik(many.matrix).joints.shape == a.ik(many).joints.shape
    b["part"] = PART.matrix
    assert np.allclose(b["part"].matrix, PART.matrix)  # type: ignore[union-attr]
    with pytest.raises(ValueError, match="a rotation and a position"):
        a.move(2.0 * PART.matrix)


def test_a_tool_is_read_and_changed() -> None:
    r = vrs.Robot()
    r.tool = vrs.trans(0, 0, 100)
    assert r.tool == vrs.trans(0, 0, 100)
    assert r.fk() == r.where().location
    r.tool = vrs.trans(0, 0, 50).matrix
    assert r.tool.xyz.tolist() == pytest.approx([0, 0, 50])
    with pytest.raises(TypeError, match="tool: a Location is wanted"):
        r.tool = 5


def test_the_frame_of_the_last_link_is_the_flange() -> None:
    r = vrs.Robot()
    rows = np.array([JOINTS, r.joints])
    assert np.allclose(r.fk(rows, link=6).matrix, r.fk(rows).matrix)
    r.tool = vrs.trans(10, 0, 100, 20, 30, 40)
    r.do("BASE 100, 0, 50, 30")
    assert np.allclose((r.fk(rows, link=6) @ r.tool).matrix, r.fk(rows).matrix)
    assert r.fk(JOINTS, link=0).shape == ()
    for wrong in (-1, 7):
        with pytest.raises(ValueError, match=r"link: 0 \(the base\) to 6 \(the flange\)"):
            r.fk(link=wrong)


def test_radians_and_metres_are_warned_of() -> None:
    r = vrs.Robot()
    with pytest.warns(UserWarning, match=r"joints are in degrees: Robot\(units=\"SI\"\)"):
        r.move(np.radians(JOINTS))
    with pytest.warns(UserWarning, match="is in mm"), pytest.raises(vrs.MotionError):
        r.move(vrs.trans(0.3, 0.45, -0.2))


def test_degrees_and_millimetres_are_not_warned_of() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        r = vrs.Robot()
        r.move(JOINTS).move(0, 0, 0, 0, 0, 0).move(1, 2, 3, 0.5, 0, 0).move(1.23456, 2, 3, 0.5, 0, 0)
        r.ready().move(1, 2, 3, 0.5, 0.1, -0.7).ready().move(PART).moves(PART @ vrs.trans(0, 0, 0.5))
        vrs.Robot(units="SI").move([radians(x) for x in JOINTS])


def test_samples_end_after_their_start() -> None:
    with pytest.raises(ValueError, match="end: 1 s is before the start, 5 s"):
        vrs.Robot().sample(100, 5, 1)
    assert vrs.Robot().sample(100, 1, 1).t.tolist() == [1.0]
