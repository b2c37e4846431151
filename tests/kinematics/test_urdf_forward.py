"""Random arms in URDF files: the links that are made of them stand where a reading of the file by itself puts them."""

from __future__ import annotations

from functools import reduce
from math import degrees
from pathlib import Path
from random import Random

import numpy as np
import pytest

from tests.kinematics.test_urdf import six_joints, written
from tests.laws.urdf_files import forward
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import link_transform
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import compose
from vrs_cli.kinematics.urdf.chain import choice
from vrs_cli.kinematics.urdf.robot import arm_of
from vrs_cli.kinematics.urdf.tree import Tree, robot_element

AXES = ("1 0 0", "-1 0 0", "0 1 0", "0 -1 0", "0 0 1", "0 0 -1")


def random_arm(random: Random) -> str:
    """Five to eight joints, some of them fixed; axes along a frame's and beside, origins at right angles and not."""
    count, text = random.randint(4, 7), ""
    for i in range(count):
        kind = random.choice(("revolute", "revolute", "revolute", "continuous", "prismatic", "fixed"))
        xyz = " ".join(f"{random.choice((0.0, 0.0, random.uniform(-0.5, 0.5))):.6f}" for _ in range(3))
        rpy = " ".join(f"{random.choice((0.0, 1.570796, -1.5708, random.uniform(-3, 3))):.6f}" for _ in range(3))
        beside = " ".join(f"{random.uniform(-1.0, 1.0):.3f}" for _ in range(3))
        axis = random.choice((*AXES, beside))
        text += (
            f'<joint name="j{i}" type="{kind}"><parent link="l{i}"/><child link="l{i + 1}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/><limit lower="-1" upper="1"/></joint>'
        )
    last = f'<joint name="end" type="revolute"><parent link="l{count}"/><child link="tip"/><limit lower="-1"/></joint>'
    return f'<robot name="random">{text}{last}</robot>'


@pytest.mark.parametrize("seed", range(40))
def test_links_stand_where_the_file_puts_them(seed: int) -> None:
    random = Random(seed)
    tree = Tree("random.urdf", robot_element("random.urdf", random_arm(random)))
    arm = arm_of(tree, choice(tree, None, None))
    for _ in range(3):
        q = [random.uniform(-2.0, 2.0) for _ in arm.joints]
        steps = [link_transform(link, x) for link, x in zip(arm.chain.links, q, strict=True)]
        found = compose(reduce(compose, steps, arm.chain.base), arm.chain.flange)
        values = {joint.name: x for joint, x in zip(arm.joints, q, strict=True)}
        own = forward(tree.robot, arm.choice.base, arm.choice.tip, values)
        assert np.array(found).reshape(3, 4) == pytest.approx(own[:3], abs=1e-9)


LIKE_A_PUMA = six_joints(
    [
        ("0 0 0.3", "0 0 0", "0 0 1"),
        ("0.1 0 0.2", "0 0 0", "0 1 0"),
        ("0 0 0.5", "0 0 0", "0 1 0"),
        ("0.2 0 0.05", "0 0 0", "1 0 0"),
        ("0.3 0 0", "0 0 0", "0 1 0"),
        ("0.1 0 0", "0 0 0", "1 0 0"),
    ]
)


def test_an_arm_that_is_singular_at_its_zeros_begins_elsewhere(tmp_path: Path) -> None:
    model = load_robot(written(tmp_path, LIKE_A_PUMA))
    ready, arm = model.poses["ready"], arm_for(model)
    assert arm.singularity(model.poses["nest"]).wrist == pytest.approx(0.0, abs=1e-9)
    assert min(arm.singularity(ready)) > 0.2
    assert arm.limits_ok(ready)
    assert [degrees(x) / 15.0 for x in ready] == pytest.approx([round(degrees(x) / 15.0) for x in ready])
    assert arm.forward(ready).px > 0.2  # in front of it
    assert arm.forward(ready).az == pytest.approx(-1.0)  # straight down
    assert model.origin is not None
    shown = ", ".join(f"{degrees(x):g}" for x in ready)
    assert model.origin.notes == (
        f"READY: at its zeros the arm is singular, ours is {shown} ([poses] ready of a TOML file is another)",
    )


def test_who_says_where_it_begins_is_told_nothing(tmp_path: Path) -> None:
    written(tmp_path, LIKE_A_PUMA)
    (tmp_path / "mine.toml").write_text('urdf = "little.urdf"\n[poses]\nready = [0, 0, 0, 0, 0, 0]\n', encoding="utf-8")
    model = load_robot(tmp_path / "mine.toml")
    assert model.origin is not None
    assert (model.poses["ready"], model.origin.notes) == ((0.0,) * 6, ())


def test_one_that_is_not_singular_there_begins_at_its_zeros(tmp_path: Path) -> None:
    bent = LIKE_A_PUMA.replace('"0.3 0 0" rpy="0 0 0"', '"0.3 0 0" rpy="0 0.9 0"').replace(
        '"0 0 0.5" rpy="0 0 0"', '"0 0 0.5" rpy="0 0.3 0"'
    )
    assert bent.count('rpy="0 0 0"') == 4
    model = load_robot(written(tmp_path, bent))
    assert model.origin is not None
    assert (model.poses["ready"], model.origin.notes) == ((0.0,) * 6, ())


def test_one_with_a_joint_at_its_end_begins_elsewhere(tmp_path: Path) -> None:
    bent = LIKE_A_PUMA.replace('"0.3 0 0" rpy="0 0 0"', '"0.3 0 0" rpy="0 0.9 0"').replace(
        '"0 0 0.5" rpy="0 0 0"', '"0 0 0.5" rpy="0 0.3 0"'
    )
    at_end = bent.replace('lower="-6"', 'lower="0"', 2).replace('lower="0"', 'lower="-6"', 1)  # of joint 2
    model = load_robot(written(tmp_path, at_end))
    assert model.lower[:3] == (-6.0, 0.0, -6.0)
    assert model.origin is not None
    (note,) = model.origin.notes
    assert note.startswith("READY: at its zeros joint 2 is at its end, ours is 0, ")
    assert model.poses["ready"][1] > 0.05 * model.upper[1]


def test_one_that_is_singular_everywhere_begins_at_its_zeros(tmp_path: Path) -> None:
    flat = six_joints([("0.1 0 0", "0 0 0", "0 0 1")] * 6)
    model = load_robot(written(tmp_path, flat))
    assert model.poses["ready"] == (0.0,) * 6
