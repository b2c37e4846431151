"""The boundary of the reach: all places of the tip are inside it, and it is not much larger than they are."""

from __future__ import annotations

from math import hypot, pi
from random import Random

import numpy as np
import pytest
import viser
from msgspec import structs

from vrs_cli.engine.engine import Engine
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.reach_outline import CELLS, Sections, outline
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import moved_point
from vrs_cli.view3d.figure import Figure
from vrs_cli.view3d.parts import Shown
from vrs_cli.view3d.reach import ReachView, boundary

TIP = (0.0, 0.0, 0.1)


def inside(sections: Sections, far: float, z: float) -> bool:
    """Whether a way outwards crosses the outline an odd number of times."""
    (x1, z1), (x2, z2) = (sections[:, end, :2].T for end in (0, 1))
    spans = (z1 > z) != (z2 > z)
    x1, z1, x2, z2 = x1[spans], z1[spans], x2[spans], z2[spans]
    return bool((x1 + (z - z1) / (z2 - z1) * (x2 - x1) > far).sum() % 2)


@pytest.mark.parametrize("name", ["puma560", "ur5e", "irb120", "cobra600"])
def test_the_tip_is_inside_whatever_the_joints(name: str) -> None:
    arm, random = arm_for(load_robot(name)), Random(4)
    model = arm.model
    configuration = arm.configuration(model.poses["ready"])
    sections, missed, looked = outline(arm, configuration, TIP), 0, 0
    while looked < 300:
        q = (0.0, *map(random.uniform, model.lower[1:], model.upper[1:]))
        if arm.configuration(q) == configuration:
            x, y, z = moved_point(arm.forward(q), TIP)
            looked, missed = looked + 1, missed + (not inside(sections, hypot(x, y), z))
    assert missed <= 3, "a place that few poses reach may be missed"


@pytest.mark.parametrize(("name", "most"), [("cobra600", 0.6), ("planar2", 0.5), ("puma560", 0.95)])
def test_it_is_hardly_larger_than_the_arm_is_long(name: str, most: float) -> None:
    arm = arm_for(load_robot(name))
    sections = outline(arm, arm.configuration(arm.model.poses["ready"]), (0.0, 0.0, 0.0))
    farthest = sections[..., 0].max()
    assert most * 0.97 < farthest < most * (1.0 + 1.0 / CELLS)


def test_it_goes_as_far_round_as_joint_1_turns() -> None:
    arm = arm_for(load_robot("planar2"))
    mesh = boundary(arm, arm.configuration(arm.model.poses["ready"]), (0.0, 0.0, 0.0))
    far = np.hypot(*mesh.vertices[:, :2].T)
    stretched = mesh.vertices[far > far.max() - 1e-3]
    angles = np.arctan2(stretched[:, 1], stretched[:, 0])
    assert np.abs(angles).max() <= arm.model.upper[0] + 0.35, "the elbow is a little bent in the last cell"
    assert np.ptp(angles) == pytest.approx(arm.model.upper[0] - arm.model.lower[0], abs=0.4)
    assert np.abs(mesh.vertices[:, 2]).max() < 1e-9
    assert abs(np.ptp(angles)) < 2 * pi


def test_it_is_found_when_it_is_asked_for_and_anew_where_the_configuration_is_another() -> None:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    engine = Engine(load_robot("planar2"))
    Figure(server.scene, "/arm", engine.model)
    reach = ReachView(server.scene, "/arm", engine.arm)
    shown = Shown(engine.arm, engine.timeline, 0.0, engine.position(0.0), 0.0)
    reach.show(shown)
    assert server.scene.get_handle_by_name("/arm/reach") is None
    reach.visible = True
    reach.show(shown)
    reach.wait()
    first = server.scene.get_handle_by_name("/arm/reach")
    assert first.visible
    reach.show(shown)
    reach.wait()
    assert server.scene.get_handle_by_name("/arm/reach") is first, "it is still the same"
    q = shown.position.joints
    lefty = shown._replace(position=structs.replace(shown.position, joints=(q[0], -q[1])))
    reach.show(lefty)
    reach.wait()
    second = server.scene.get_handle_by_name("/arm/reach")
    assert second is not first
    reach.visible = False
    reach.show(lefty)
    assert not second.visible
    server.stop()
