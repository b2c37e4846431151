"""What links of a URDF file look like: each where the file puts it, whatever our frames are."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path
from random import Random

import numpy as np
import pytest

from tests.kinematics.test_urdf import ARM, written
from vrs_cli.errors import FileDamaged
from vrs_cli.kinematics.bodies import capsules, shapes_of
from vrs_cli.kinematics.link_data import Box, Capsule, Cylinder, LinkShape, MeshFile
from vrs_cli.kinematics.model import RobotModel, link_frames
from vrs_cli.kinematics.model_data import from_dict, to_dict
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose, position, rotation_about, rotation_x, translation
from vrs_cli.twin.dynamics import inertial_model, mass_matrix, torques

VISUALS = """
  <material name="sky"><color rgba="0 0.5 1 1"/></material>
  <link name="base"><visual>
    <origin xyz="0 0 0.05" rpy="0.3 0 0"/><geometry><box size="0.2 0.3 0.1"/></geometry><material name="sky"/>
  </visual></link>
  <link name="one"><visual>
    <geometry><cylinder radius="0.05" length="0.4"/></geometry>
    <material name=""><color rgba="1 0 0 1"/></material>
  </visual></link>
  <link name="two"><visual><origin xyz="0.1 0 0"/><geometry><sphere radius="0.07"/></geometry></visual></link>
  <link name="three"><visual>
    <geometry><mesh filename="package://arms/meshes/three.stl" scale="0.001 0.001 -0.001"/></geometry>
  </visual></link>
  <link name="tool0"><visual><geometry><box size="0.01 0.02 0.03"/></geometry></visual></link>
  <link name="lens"><visual><geometry><box size="0.01 0.02 0.04"/></geometry></visual></link>
</robot>
"""
SEEN = ARM.replace("</robot>", VISUALS)


def links_at(q: tuple[float, float, float]) -> dict[str, Transform]:
    """T_world_link, by the file alone."""
    base = translation(0.0, 0.0, 0.5)
    one = compose(compose(base, translation(0.0, 0.0, 0.1)), rotation_about((0, 0, 1), q[0]))
    turned = compose(translation(0.05, 0.0, 0.0), rotation_about((0, 0, 1), pi / 2))
    two = compose(compose(one, turned), rotation_about((0, -1, 0), q[1]))
    three = compose(two, translation(0.0, 0.6 * q[2], 0.8 * q[2]))
    ends = {"tool0": compose(three, translation(0.0, 0.0, 0.07)), "lens": compose(three, translation(1.0, 0.0, 0.0))}
    return {"base": base, "one": one, "two": two, "three": three, **ends}


def where(model: RobotModel, shape: LinkShape, q: tuple[float, ...]) -> Transform:
    """T_world_body of what has a pose."""
    assert isinstance(shape.body, Box | MeshFile)
    return compose(link_frames(model, q)[shape.link], shape.body.pose)


def test_each_is_where_the_file_puts_it_in_every_pose(tmp_path: Path) -> None:
    model, random = load_robot(written(tmp_path, SEEN)), Random(3)
    base, one, two, three, tool, lens = model.shapes
    for _ in range(20):
        q = (random.uniform(-3, 3), random.uniform(-1, 2), random.uniform(0, 0.25))
        links, frames = links_at(q), link_frames(model, q)
        tilted = compose(links["base"], compose(translation(0.0, 0.0, 0.05), rotation_x(0.3)))
        assert where(model, base, q) == pytest.approx(tilted, abs=1e-9)
        for shape, name in ((three, "three"), (tool, "tool0"), (lens, "lens")):
            assert where(model, shape, q) == pytest.approx(links[name], abs=1e-9)
        assert isinstance(one.body, Cylinder)
        for end, z in ((one.body.start, -0.2), (one.body.end, 0.2)):
            expected = position(compose(links["one"], translation(0.0, 0.0, z)))
            assert position(compose(frames[one.link], translation(*end))) == pytest.approx(expected, abs=1e-9)
        assert isinstance(two.body, Capsule)
        expected = position(compose(links["two"], translation(0.1, 0.0, 0.0)))
        assert position(compose(frames[two.link], translation(*two.body.start))) == pytest.approx(expected, abs=1e-9)


def test_bodies_colours_and_files(tmp_path: Path) -> None:
    package = tmp_path / "arms"
    (package / "urdf").mkdir(parents=True)
    (package / "meshes").mkdir()
    (package / "meshes" / "three.stl").write_text("", encoding="utf-8")
    shapes = load_robot(written(package / "urdf", SEEN)).shapes
    assert [shape.link for shape in shapes] == [0, 1, 2, 3, 3, 3]
    assert [shape.colour for shape in shapes] == ["#0080ff", "#ff0000", "grey", "grey", "grey", "grey"]
    mesh = shapes[3].body
    assert isinstance(mesh, MeshFile)
    assert mesh.scale == (0.001, 0.001, -0.001)
    assert Path(mesh.path) == package / "meshes" / "three.stl"


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("meshes/a.stl", "arms/urdf/meshes/a.stl"),
        ("package://arms/meshes/a.stl", "arms/meshes/a.stl"),
        ("package://elsewhere/meshes/a.stl", "arms/meshes/a.stl"),  # a checkout has another name than its package
        ("package://arms/none.stl", "arms/urdf/arms/none.stl"),
    ],
)
def test_where_a_mesh_is_looked_for(tmp_path: Path, name: str, file: str) -> None:
    folder = tmp_path / "arms" / "urdf"
    folder.mkdir(parents=True)
    if "none" not in name:
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_text("", encoding="utf-8")
    text = SEEN.replace("package://arms/meshes/three.stl", name)
    body = load_robot(written(folder, text)).shapes[3].body
    assert isinstance(body, MeshFile)
    assert Path(body.path) == tmp_path / file


def test_the_way_out_and_back(tmp_path: Path) -> None:
    model = load_robot(written(tmp_path, SEEN))
    assert from_dict(json.loads(json.dumps(to_dict(model)))) == model


def test_shapes_of_a_toml_file_stand_for_those_of_the_urdf_file(tmp_path: Path) -> None:
    written(tmp_path, SEEN)
    toml = tmp_path / "mine.toml"
    toml.write_text('urdf = "little.urdf"\nshapes = [{ link = 1, kind = "box", size = [9, 9, 9] }]', encoding="utf-8")
    assert load_robot(toml).shapes == (LinkShape(1, Box((0.009, 0.009, 0.009), IDENTITY)),)


WRONG = {
    'box size="0.2 0.3 0.1"': 'box size="0.2 0.3"',
    'sphere radius="0.07"': 'sphere radius="-1"',
    'cylinder radius="0.05" length="0.4"': "cylinder",
    'scale="0.001 0.001 -0.001"': 'scale="0 0 0"',
    'xyz="0 0 0.05" rpy="0.3 0 0"': 'xyz="here"',
}


@pytest.mark.parametrize("right", WRONG)
def test_what_is_not_understood_is_left_out(tmp_path: Path, right: str) -> None:
    assert right in SEEN
    assert len(load_robot(written(tmp_path, SEEN.replace(right, WRONG[right]))).shapes) == 5


def test_a_joint_beside_the_arm_may_be_wrong(tmp_path: Path) -> None:
    text = SEEN.replace('<origin xyz="1 0 0"/>', '<origin xyz="far away"/>')
    assert [shape.link for shape in load_robot(written(tmp_path, text)).shapes] == [0, 1, 2, 3, 3]


COLLIDES = {
    "one": '<collision><geometry><sphere radius="0.09"/></geometry></collision>',
    "two": '<collision><geometry><box size="here"/></geometry></collision>',
}


def with_collision(text: str) -> str:
    for name, element in COLLIDES.items():
        text = text.replace(f'<link name="{name}"><visual>', f'<link name="{name}">{element}<visual>')
    return text


def test_collision_elements_stand_for_links_where_contacts_are_looked_for(tmp_path: Path) -> None:
    model = load_robot(written(tmp_path, with_collision(SEEN)))
    assert model.shapes == load_robot(written(tmp_path, SEEN)).shapes
    base, one, *others = model.collision
    assert isinstance(one.body, Capsule)
    assert one.body.radii == (0.09, 0.09)
    assert (base, *others) == (model.shapes[0], *model.shapes[2:])
    assert from_dict(json.loads(json.dumps(to_dict(model)))) == model


def test_a_file_without_collision_elements_has_no_other_shapes(tmp_path: Path) -> None:
    assert not load_robot(written(tmp_path, SEEN)).collision


def test_collision_of_a_toml_file_goes_before_that_of_the_urdf_file(tmp_path: Path) -> None:
    written(tmp_path, with_collision(SEEN))
    toml, box = tmp_path / "mine.toml", '{ link = 1, kind = "box", size = [9, 9, 9] }'
    toml.write_text(f'urdf = "little.urdf"\ncollision = [{box}]', encoding="utf-8")
    assert load_robot(toml).collision == (LinkShape(1, Box((0.009, 0.009, 0.009), IDENTITY)),)
    toml.write_text(f'urdf = "little.urdf"\ncollision = [{box.replace("box", "bux")}]', encoding="utf-8")
    with pytest.raises(FileDamaged, match="collision 1: kind: 'bux' is none"):
        load_robot(toml)


def test_a_file_without_visuals_has_capsules(tmp_path: Path) -> None:
    model = load_robot(written(tmp_path))
    assert not model.shapes
    assert shapes_of(model) == capsules(model)


ARM = """<robot name="heavy">
  <link name="base"><inertial>
    <mass value="9"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <link name="trunk"><inertial>
    <origin xyz="0.02 -0.01 0.15" rpy="0.4 -0.3 1.1"/><mass value="6"/>
    <inertia ixx="0.08" iyy="0.07" izz="0.03" ixy="0.004" ixz="-0.003" iyz="0.002"/>
  </inertial></link>
  <link name="box"><inertial>
    <origin xyz="0 0 0.05" rpy="0 0 0.7"/><mass value="1.5"/>
    <inertia ixx="0.01" iyy="0.012" izz="0.02" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <link name="upper"><inertial>
    <origin xyz="0 0.03 0.2"/><mass value="4"/><inertia ixx="0.05" iyy="0.06" izz="0.02" ixy="0" ixz="0" iyz="0.01"/>
  </inertial></link>
  <link name="forearm"><inertial>
    <origin xyz="0.01 0 0.2" rpy="0 0.2 0"/><mass value="2"/>
    <inertia ixx="0.02" iyy="0.025" izz="0.01" ixy="0" ixz="0.003" iyz="0"/>
  </inertial></link>
  <link name="tool0"/>
  <joint name="waist" type="revolute">
    <parent link="base"/><child link="trunk"/><origin xyz="0.1 0 0.2" rpy="0.1 0 0.3"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="2" effort="120"/><dynamics damping="1.5" friction="0.4"/>
  </joint>
  <joint name="glue" type="fixed"><parent link="trunk"/><child link="box"/>
    <origin xyz="-0.1 0.2 0.1" rpy="0 1 0"/>
  </joint>
  <joint name="shoulder" type="revolute">
    <parent link="trunk"/><child link="upper"/><origin xyz="0 0.05 0.3"/><axis xyz="0 1 0"/>
    <limit lower="-1.6" upper="1.6" velocity="2" effort="0"/><dynamics damping="0"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="upper"/><child link="forearm"/><origin xyz="0 0 0.5" rpy="0.2 0 0"/><axis xyz="0 0.6 0.8"/>
    <limit lower="0" upper="0.4" velocity="0.5"/>
  </joint>
  <joint name="end" type="fixed"><parent link="forearm"/><child link="tool0"/><origin xyz="0 0 0.4"/></joint>
</robot>
"""
UPPER = '<inertia ixx="0.05" iyy="0.06" izz="0.02" ixy="0" ixz="0" iyz="0.01"/>'
BESIDE = 'urdf = "arm.urdf"\n[[masses]]\n[[masses]]\nmass = 5\nmax_torque = 70\n[[masses]]\ncentre = [0, 0, 10]\n'


def loaded(folder: Path, text: str = ARM) -> RobotModel:
    (folder / "arm.urdf").write_text(text)
    return load_robot(str(folder / "arm.urdf"))


def test_torques_are_those_that_mujoco_finds_for_the_file(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    model, m = loaded(tmp_path), mujoco.MjModel.from_xml_string(ARM)
    own, d, random = inertial_model(model), mujoco.MjData(m), np.random.default_rng(1)
    bare = own._replace(armature=np.zeros(3))
    inertias = np.zeros((3, 3))
    for _ in range(20):
        q, qd = random.uniform(model.lower, model.upper), random.normal(size=3)
        d.qpos[:], d.qvel[:] = q, qd
        mujoco.mj_forward(m, d)
        mujoco.mj_fullM(m, d, inertias)
        assert mass_matrix(model, bare, q[None])[0] == pytest.approx(inertias, abs=1e-9)
        found = torques(model, bare, q[None], qd[None], np.zeros((1, 3)))[0]
        friction = bare.viscous * qd + bare.coulomb * np.sign(qd)
        assert np.min(np.abs(np.stack([found, found - friction]) - d.qfrc_bias), axis=0) == pytest.approx(0.0, abs=1e-8)


def test_drives_are_those_of_limits_and_dynamics_where_they_are_above_zero(tmp_path: Path) -> None:
    first, second, third = loaded(tmp_path).masses
    assert (first.max_torque, first.viscous, first.coulomb) == (120.0, 1.5, 0.4)
    assert (second.max_torque, second.viscous, second.coulomb) == (None, None, None)
    assert (first.mass, second.mass, third.mass) == (7.5, 4.0, 2.0)


def test_tables_of_the_toml_file_go_before_the_urdf_file(tmp_path: Path) -> None:
    first, second, third = loaded(tmp_path).masses
    (tmp_path / "mine.toml").write_text(BESIDE)
    own = load_robot(str(tmp_path / "mine.toml"))
    assert own.masses == (
        first,
        second._replace(mass=5.0, max_torque=70.0),
        third._replace(centre=(0.0, 0.0, 0.01)),
    )
    assert from_dict(to_dict(own)).masses == own.masses


@pytest.mark.parametrize(
    ("old", "new"),
    [('<mass value="4"/>', '<mass value="-4"/>'), ('<mass value="4"/>', ""), ('iyy="0.06"', 'iyy="thick"')],
)
def test_a_body_with_a_wrong_figure_is_unknown(tmp_path: Path, old: str, new: str) -> None:
    assert old in ARM
    masses = loaded(tmp_path, ARM.replace(old, new)).masses
    assert [one.mass for one in masses] == [7.5, None, 2.0]


def test_an_inertia_of_zeros_is_that_of_the_shapes(tmp_path: Path) -> None:
    look = '<visual><geometry><box size="0.1 0.1 0.4"/></geometry></visual>'
    text = ARM.replace(UPPER + "\n  </inertial>", f"</inertial>{look}")
    model = loaded(tmp_path, text)
    assert model.masses[1].inertia is None
    moments = np.linalg.eigvalsh(inertial_model(model).inertia[1])
    assert moments == pytest.approx([4 * 0.02 / 12, 4 * 0.17 / 12, 4 * 0.17 / 12])


def test_a_file_without_masses_says_nothing(tmp_path: Path) -> None:
    text = ARM.replace("<inertial>", "<!--").replace("</inertial>", "-->")
    assert loaded(tmp_path, text).masses == ()


def test_masses_that_no_body_has_become_those_of_the_nearest_one(tmp_path: Path) -> None:
    text = ARM.replace(UPPER, '<inertia ixx="0.05" iyy="0.01" izz="0.01"/>')
    a, b, c = np.linalg.eigvalsh(inertial_model(loaded(tmp_path, text)).inertia[1])
    assert a > 0.0
    assert a + b >= c * (1.0 - 1e-12)
