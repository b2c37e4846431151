"""URDF files: which joints are the arm, what they say, and what is said of those that cannot be read."""

from __future__ import annotations

from math import degrees, pi
from pathlib import Path

import pytest

from vrs_cli.errors import FileDamaged, NonexistentFile
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import ALL
from vrs_cli.kinematics.model import ArmTask
from vrs_cli.kinematics.model_data import from_dict, to_dict
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import compose, rotation_about, translation

XACRO = "http://www.ros.org/wiki/xacro"
URDF = Path(__file__).parent / "urdf"
ARM = """\
<?xml version="1.0"?>
<!-- a comment -->
<robot name="little">
  <link name="world"/>
  <joint name="stand" type="fixed">
    <parent link="world"/><child link="base"/><origin xyz="0 0 0.5" rpy="0 0 0"/>
  </joint>
  <joint name="turn" type="continuous">
    <parent link="base"/><child link="one"/><origin xyz="0 0 0.1"/><axis xyz="0 0 2"/>
  </joint>
  <joint name="lean" type="revolute">
    <parent link="one"/><child link="two"/><origin xyz="0.05 0 0" rpy="0 0 1.5708"/><axis xyz="0 -1 0"/>
    <limit lower="-1" upper="2" velocity="3" effort="7"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="two"/><child link="three"/><axis xyz="0 0.6 0.8"/>
    <limit lower="0" upper="0.25" velocity="0"/>
  </joint>
  <joint name="grip" type="fixed"><parent link="three"/><child link="tool0"/><origin xyz="0 0 0.07"/></joint>
  <joint name="camera" type="fixed"><parent link="three"/><child link="lens"/><origin xyz="1 0 0"/></joint>
</robot>
"""


def written(folder: Path, text: str = ARM, name: str = "little.urdf") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_the_chain_from_base_to_tip(tmp_path: Path) -> None:
    model = load_robot(written(tmp_path))
    assert (model.name, model.joint_count, model.task) == ("little", 3, ArmTask.POSITION)
    assert [model.units.unit(i) for i in (1, 2, 3)] == ["deg", "deg", "mm"]
    assert model.lower == pytest.approx((-2 * pi, -1.0, 0.0))
    assert model.upper == pytest.approx((2 * pi, 2.0, 0.25))
    assert model.max_velocity == pytest.approx((pi / 2, 3.0, 0.25))  # the usual one where none, or 0, is given
    assert model.max_acceleration == pytest.approx(tuple(v / 0.3 for v in model.max_velocity))
    assert model.poses["nest"] == (0.0, 0.0, 0.0)


def test_forward_kinematics_are_those_of_the_file(tmp_path: Path) -> None:
    arm = arm_for(load_robot(written(tmp_path)))
    q = (0.4, 0.7, 0.11)
    expected = translation(0.0, 0.0, 0.6)
    for step in (
        rotation_about((0, 0, 1), q[0]),
        translation(0.05, 0.0, 0.0),
        rotation_about((0, 0, 1), pi / 2),  # 1.5708 is a right angle
        rotation_about((0, -1, 0), q[1]),
        translation(0.0, 0.6 * q[2], 0.8 * q[2]),
        translation(0.0, 0.0, 0.07),
    ):
        expected = compose(expected, step)
    assert arm.forward(q) == pytest.approx(expected, abs=1e-12)


def test_plain_data_gives_every_bit_back(tmp_path: Path) -> None:
    model = load_robot(written(tmp_path))
    assert from_dict(to_dict(model)) == model


def test_a_toml_file_adds_what_urdf_has_not(tmp_path: Path) -> None:
    written(tmp_path)
    toml = tmp_path / "mine.toml"
    toml.write_text(
        'urdf = "little.urdf"\nurdf_tip = "lens"\nname = "mine"\nprofile = "SCURVE"\n'
        '[[joints]]\nname = "lean"\nmax_velocity = 30\n'
        '[[joints]]\nname = "slide"\nkind = "prismatic"\nupper = 200\nmax_acceleration = 900\n'
        "[tool]\nlinear_speed = 123\n[poses]\nready = [10, 20, 30]\nfar = [0, 0, 200]\n",
        encoding="utf-8",
    )
    model = load_robot(toml)
    assert (model.name, model.title, model.profile) == ("mine", "little", "SCURVE")
    assert degrees(model.max_velocity[1]) == pytest.approx(30)
    assert degrees(model.max_acceleration[1]) == pytest.approx(100)
    assert (model.upper[2], model.max_acceleration[2]) == (0.2, 0.9)
    assert model.linear_speed == pytest.approx(0.123)
    assert model.poses["ready"] == pytest.approx((10 * pi / 180, 20 * pi / 180, 0.03))
    assert model.poses["far"][2] == 0.2
    assert arm_for(model).forward((0.0, 0.0, 0.0)).py == pytest.approx(1.0)  # the lens, a metre along X of link three


def six_joints(rows: list[tuple[str, str, str]]) -> str:
    """Origins and axes one after the other."""
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/><limit lower="-6" upper="6" velocity="3"/></joint>'
        for i, (xyz, rpy, axis) in enumerate(rows)
    )
    return f'<robot name="six">{joints}</robot>'


def test_axes_that_lie_like_a_pumas_are_solved_in_closed_form(tmp_path: Path) -> None:
    lines = [
        ("0 0 0.3", "0 0 1"),
        ("0.1 0 0.2", "0 1 0"),
        ("0 0 0.5", "0 1 0"),
        ("0.2 0 0.05", "-1 0 0"),
        ("0.3 0 0", "0 1 0"),
        ("0.1 0 0", "1 0 0"),
    ]
    arm = arm_for(load_robot(written(tmp_path, six_joints([(xyz, "0 0 0", axis) for xyz, axis in lines]))))
    assert (arm.ways, arm.method) == (ALL, "closed form, spherical wrist")
    q = (0.3, -0.4, 0.5, 0.6, -0.7, 0.8)
    assert arm.inverse_branch(arm.forward(q), arm.configuration(q), q) == pytest.approx(q, abs=1e-10)


def test_axes_that_lie_like_those_of_a_ur_are_too(tmp_path: Path) -> None:
    rows = [
        ("0 0 0.16", "0 0 0", "0 0 1"),
        ("0 0.14 0", "0 1.570796 0", "0 1 0"),
        ("0 -0.13 0.43", "0 0 0", "0 1 0"),
        ("0 0 0.39", "0 1.5708 0", "0 1 0"),
        ("0 0.13 0", "0 0 0", "0 0 1"),
        ("0 0 0.1", "0 0 0", "0 1 0"),
    ]
    arm = arm_for(load_robot(written(tmp_path, six_joints(rows))))
    assert (arm.ways, arm.method) == (ALL, "closed form, joints 2 to 4 parallel")
    q = (0.3, -0.4, 1.5, 0.6, -0.7, 0.8)
    assert arm.inverse_branch(arm.forward(q), arm.configuration(q), q) == pytest.approx(q, abs=1e-10)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<robot name", "<robt name", r"mismatched tag: line \d+, column \d+"),
        ("", "", r"robot description is an XML file"),
        ('<?xml version="1.0"?>', "<!DOCTYPE x>", r"it defines a document type"),
        (
            '<robot name="little">',
            f'<robot xmlns:xacro="{XACRO}"><xacro:arm/>',
            r"xacro(:| macros, and)",
        ),
        ('<parent link="one"/>', "", r"joint lean: has no parent link"),
        (
            'type="revolute"',
            'type="floating"',
            r"joint lean: is of type 'floating' .*revolute, continuous, prismatic and",
        ),
        ('xyz="0.05 0 0"', 'xyz="0.05 0"', r"joint lean: origin xyz is '0.05 0' \(give 3 numbers"),
        ('rpy="0 0 1.5708"', 'rpy="0 0 pi"', r"joint lean: origin rpy is '0 0 pi'"),
        ('xyz="0.05 0 0"', 'xyz="1e9 0 0"', r"'1e9 0 0' \(give 3 numbers below 1e\+06, with blanks between them"),
        ('xyz="0 -1 0"', 'xyz="0 0 0"', r"joint lean: axis xyz is 0 0 0"),
        ('lower="-1"', 'lower="3"', r"joint lean: limit: lower 3 is not below upper 2"),
        ('rpy="0 0 1.5708"', 'rpy="0 0 1e308"', r"joint lean: origin rpy is '0 0 1e308'"),
        ('lower="-1"', 'lower="nan"', r"joint lean: limit lower is 'nan' \(give a number below 1e\+06\)"),
        ('lower="-1" ', "", r"joint lean: limit has no lower"),
        ('velocity="3"', 'velocity="-3"', r"joint lean: limit: velocity -3 is below zero \(give it without a sign"),
        ('<child link="one"/>', '<child link="base"/>', r"joint turn: link 'base' has two parents"),
        ('<parent link="world"/>', '<parent link="base"/>', r"joint stand: leads from link 'base' to itself"),
        (
            '<limit lower="-1" upper="2" velocity="3" effort="7"/>',
            '<limit lower="-1" upper="2"/><mimic joint="turn"/>',
            r"joint lean: mimics another joint",
        ),
        ('<child link="lens"/>', '<child link="tool0"/>', r"joint camera: link 'tool0' has two parents"),
        ('<parent link="world"/>', '<parent link="three"/>', r"no link is without a parent"),
        (
            '<joint name="camera" type="fixed"><parent link="three"/>',
            '<joint name="camera" type="continuous"><parent link="two"/>',
            r"it has several arms, with the ends tool0, lens \(choose one: --tip tool0, or urdf_tip",
        ),
        (
            'name="grip" type="fixed"><parent link="three"/>',
            'name="grip" type="fixed"><parent link="loose"/>',
            r"world, loose are without a parent",
        ),
    ],
)
def test_what_is_wrong_is_said_with_file_and_element(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in ARM
    path = written(tmp_path, ARM.replace(old, new, 1) if old else "hello")
    with pytest.raises(FileDamaged, match=rf"little\.urdf: .*{message}|little\.urdf: .*{message}"):
        load_robot(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('urdf = "none.urdf"', r"none\.urdf"),
        ("urdf = 7", r"urdf: 7 is not a text"),
        ('urdf = "little.urdf"\nurdf_tip = "nose"', r"no joint has a link 'nose' \(links are base, lens,"),
        ('urdf = "little.urdf"\nurdf_base = "three"', r"no joint moves between base and tip"),
        (
            'urdf = "little.urdf"\nurdf_base = "lens"\nurdf_tip = "tool0"',
            r"no chain of joints leads from lens to tool0",
        ),
        ('urdf = "little.urdf"\n[[joints]]\nname = "lena"', r"no joint 'lena' that moves \(it has turn, lean, slide\)"),
        ('urdf = "little.urdf"\n[[joints]]\nname = []', r"joint 1: name: \[\] is not a text"),
        (
            'urdf = "little.urdf"\n[poses]\nready = [0, 0, 300]',
            r"poses.ready: puts joint 3 at 300 mm \(its range is 0 to 250 mm",
        ),
        (
            'urdf = "little.urdf"\n[poses]\nready = [0, 0]',
            r"not a list of 3 numbers \(give the 3 joint values in deg and mm",
        ),
        ('urdf = "little.urdf"\ntask = "pose"', r"task: 'pose' takes 6 joints \(the robot has 3"),
        ('urdf = "little.urdf"\ntask = "all"', r"task: 'all' is none \(give one of pose,"),
        ('urdf = "little.urdf"\nprofile = "SQUARE"', r"profile: 'SQUARE' is no profile"),
        ('urdf = "little.urdf"\ncolour = 1', r"unknown key 'colour'"),
    ],
)
def test_what_is_wrong_in_the_toml_beside_it(tmp_path: Path, text: str, message: str) -> None:
    written(tmp_path)
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    with pytest.raises((FileDamaged, NonexistentFile), match=message):
        load_robot(tmp_path / "mine.toml")


def test_entities_are_not_expanded(tmp_path: Path) -> None:
    bomb = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><robot name="&b;"/>'
    with pytest.raises(FileDamaged, match="document type or entities"):
        load_robot(written(tmp_path, bomb))


def test_a_task_that_is_not_the_usual_one_is_kept_in_plain_data() -> None:
    gantry = load_robot(URDF / "gantry.urdf")
    assert gantry.task is ArmTask.UPRIGHT
    for task in (ArmTask.POSE, ArmTask.POSITION):
        asked = from_dict({**to_dict(gantry), "task": task.value})
        assert from_dict(to_dict(asked)).task is asked.task is task


def test_every_sample_file_loads() -> None:
    counts = {path.stem: load_robot(path).joint_count for path in URDF.glob("*.urdf")}
    assert counts == {"seven": 7, "crooked": 6, "five": 5, "short": 5, "gantry": 4}
