"""What is around the robot is shown: parts where the world's course says, sensors lit while they are on."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
import viser
from msgspec.structs import replace

import vrs_cli as vrs
from vrs_cli.engine.position import position_at
from vrs_cli.files.cell_file import parse_cell, read_cell
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import position
from vrs_cli.values.scene import Beam, BoxShape, CylinderShape, MeshShape, Proximity, Shape, SphereShape
from vrs_cli.view3d.parts import Shown, transform_of
from vrs_cli.view3d.scene_bodies import DARK, LIT, SceneBodies, region_mesh, shape_mesh
from vrs_cli.view3d.studio import ArmScene, page
from vrs_cli.world.course import SpanKind
from vrs_cli.world.world import World

PROGRAMS = Path(__file__).parents[2] / "programs"
ARM = arm_for(load_robot("puma560"))
CUBE = tuple(product((-0.1, 0.1), repeat=3))
SENSORS = """
[[part]]
name = "box"
shape = "box"
size = [40, 40, 60]
at = [0, 550, -250]

[[part]]
name = "next"
shape = "sphere"
radius = 20
at = [500, 500, 0]

[[sensor]]
name = "there"
signal = 1001
kind = "beam"
from = [-100, 550, -250]
to = [100, 550, -250]

[[sensor]]
name = "nothing.there"
signal = -1002
kind = "box"
at = [500, 500, 0]
size = [100, 100, 100]

[[feeder]]
when = 5
parts = ["next"]
"""


def moment(timeline: vrs.Timeline, t: float) -> Shown:
    return Shown(ARM, timeline, t, position_at(ARM, timeline, t), t)


def test_parts_are_where_the_course_says(server: viser.ViserServer) -> None:
    robot = vrs.Robot()
    robot.run(PROGRAMS / "pick_and_place.v2")
    timeline = robot.timeline
    world = World(ARM, read_cell(str(PROGRAMS / "pick_and_place.toml")))
    bodies = SceneBodies(server.scene, world)
    node = server.scene.get_handle_by_name("/cell/box")
    table = server.scene.get_handle_by_name("/cell/table")
    assert node is not None
    assert table is not None
    assert transform_of(table).pz == pytest.approx(-0.290, abs=1e-7)
    held = 0
    for t in np.linspace(timeline.start, timeline.end, 40):
        bodies.show(moment(timeline, float(t)))
        state = world.course(timeline).state("box", float(t))
        held += state.held
        assert np.allclose(np.array(transform_of(node)), np.array(state.pose), atol=1e-7)
    assert held > 5
    assert position(transform_of(node)) == pytest.approx((0.3, 0.45, -0.2), abs=1e-3)


def test_the_fingers_touch_the_part_that_they_hold(server: viser.ViserServer) -> None:
    robot = vrs.Robot()
    robot.run(PROGRAMS / "pick_and_place.v2")
    world = World(ARM, read_cell(str(PROGRAMS / "pick_and_place.toml")))
    course, scene = world.course(robot.timeline), ArmScene(server.scene, ARM.model, world)
    held = next(span for span in course.spans("box") if span.kind is SpanKind.HELD)
    gaps = []
    for t in (held.begin - 1e-3, held.begin, held.end - 1e-3, held.end, robot.timeline.end):
        scene.show(moment(robot.timeline, t))
        gaps.append(sum(abs(finger.node.position[0]) for finger in scene.figure.fingers))
    assert gaps == pytest.approx([0.064, 0.040, 0.040, 0.064, 0.064])


def test_sensors_are_lit_while_they_are_on_and_parts_that_are_absent_are_not_seen(server: viser.ViserServer) -> None:
    robot = vrs.Robot()
    robot.do("DRIVE 1, 10")
    robot.do("SIGNAL 5 AT 0.5")
    bodies = SceneBodies(server.scene, World(ARM, parse_cell(SENSORS)))
    colours, seen = [], []
    for t in (0.25, 0.55):
        bodies.show(moment(robot.timeline, t))
        colours.append([server.scene.get_handle_by_name(f"/cell/sensors/{k}").color for k in (0, 1)])
        seen.append(server.scene.get_handle_by_name("/cell/next").visible)
    assert colours == [[LIT, DARK], [LIT, LIT]]
    assert seen == [False, True]


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        (BoxShape((0.2, 0.2, 0.2)), 0.008),
        (MeshShape((CUBE,), ""), 0.008),
        (MeshShape((CUBE, tuple((x + 1.0, y, z) for x, y, z in CUBE)), ""), 0.016),
        (CylinderShape(0.1, 0.2), 0.002 * np.pi),
        (SphereShape(0.1), 0.004 / 3.0 * np.pi),
    ],
)
def test_surfaces_are_closed_and_have_the_volume_of_their_shape(shape: Shape, volume: float) -> None:
    mesh = shape_mesh(shape)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(volume, rel=0.03)


def test_thin_beams_are_thick_enough_to_be_seen() -> None:
    beam = region_mesh(Beam((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1e-4))
    near = region_mesh(Proximity((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.5, 0.05))
    assert np.ptp(beam.vertices, axis=0) == pytest.approx([1.006, 0.006, 0.006])
    assert near.vertices.max(axis=0) == pytest.approx([0.05, 0.05, 0.55])


def test_a_page_shows_the_cell() -> None:
    robot = vrs.Robot()
    robot.do("DRIVE 1, 10")
    cell = parse_cell(SENSORS)
    bare = replace(cell, scene=replace(cell.scene, parts=(), sensors=(), feeders=()))
    pages = [page(ARM, robot.timeline, 10.0, World(ARM, one)) for one in (cell, bare)]
    assert len(pages[0]) > len(pages[1])
