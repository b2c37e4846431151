"""Forward kinematics against the reference table and against the plain product of link matrices."""

from __future__ import annotations

import random
import subprocess
import sys
from math import degrees, pi, radians

import pytest

from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import link_frames, link_transform
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, angle_between, compose, from_oat, inverse, position, to_oat

PUMA = load_robot("puma560")
ARM = arm_for(PUMA)

VECTORS = [  # JT1..JT6 [deg], X Y Z [mm], O A T, yaw pitch roll [deg]
    ((0, -90, 90, 0, 0, 0), (-20.32, 149.09, 921.12), (90, -90, 0), (0, 0, 0)),
    ((0, 0, 0, 0, 0, 0), (411.48, 149.09, 489.32), (90, -90, 0), (0, 0, 0)),
    ((90, 0, 90, 0, 0, 0), (-149.09, 921.12, 20.32), (180, 0, 0), (90, 90, 0)),
    ((0, -45, 180, 0, 45, 0), (625.92, 149.09, -42.78), (90, 90, 0), (0, 180, 0)),
    ((0, -45, 180, 0, 0, 0), (665.70, 149.09, -26.30), (90, 45, 0), (0, 135, 0)),
    ((20, -60, 150, 10, 30, -40), (602.95, 383.31, 366.57), (115.725, 29.499, -28.492), (25.725, 119.499, -28.492)),
]


@pytest.mark.parametrize(("joints", "xyz", "oat", "ypr"), VECTORS)
def test_reference_table(
    joints: tuple[float, ...], xyz: tuple[float, ...], oat: tuple[float, ...], ypr: tuple[float, ...]
) -> None:
    T = ARM.forward(tuple(map(radians, joints)))
    assert [1000 * p for p in position(T)] == pytest.approx(xyz, abs=0.0051)
    assert list(map(degrees, to_oat(T))) == pytest.approx(oat, abs=0.00051)
    yaw, pitch, roll = map(radians, ypr)
    assert angle_between(T, from_oat(0.0, 0.0, 0.0, yaw + pi / 2, pitch - pi / 2, roll)) < radians(0.00102)


def test_closed_form_is_the_product_of_the_links() -> None:
    rng = random.Random(560)
    for _ in range(500):
        q = tuple(rng.uniform(-3.0, 3.0) for _ in range(6))
        assert ARM.forward(q) == pytest.approx(ARM.frames(q)[-1], abs=2e-15)


def test_frames_go_from_base_to_flange_link_by_link() -> None:
    q = PUMA.poses["nest"]
    frames = ARM.frames(q)
    assert len(frames) == 7
    assert frames[0] == IDENTITY
    assert frames == link_frames(PUMA, q)
    for before, after, link, angle in zip(frames, frames[1:], PUMA.links, q, strict=False):
        assert compose(inverse(before), after) == pytest.approx(link_transform(link, angle), abs=1e-15)


def test_the_scalar_path_does_not_import_numpy() -> None:
    code = (
        "import sys; from vrs_cli.kinematics.forms import arm_for;"
        "from vrs_cli.kinematics.robot_file import load_robot;"
        "arm = arm_for(load_robot('puma560')); q = arm.model.poses['nest']; T = arm.forward(q);"
        "arm.inverse_all(T); arm.select(T, q); arm.jacobian(q); assert 'numpy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
