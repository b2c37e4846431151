"""Random arms in URDF files: the links that are made of them stand where a reading of the file by itself puts them."""

from __future__ import annotations

from functools import reduce
from random import Random

import numpy as np
import pytest

from tests.laws.urdf_files import forward
from vrs_cli.kinematics.model import link_transform
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
