"""The masses of a URDF file, beside what MuJoCo reads in the same file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import from_dict, to_dict
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.twin.dynamics import inertial_model, mass_matrix, torques

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
