"""Closed forms over arrays: what one pose at a time is told, a row is told as well."""

from __future__ import annotations

import numpy as np
import pytest

from vrs_cli.kinematics.arrays import stack
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import from_oat


@pytest.mark.parametrize("name", ["cobra600", "planar2", "planar3"])
def test_a_row_that_cannot_be_is_no_joints_at_all(name: str) -> None:
    """Beside one that can be: too far, and tilted or beside the plane; every joint of these is NaN."""
    arm = arm_for(load_robot(name))
    ready = arm.model.poses["ready"]
    here = arm.forward(ready)
    flat = name.startswith("planar")
    beside = here._replace(pz=here.pz + 0.05) if flat else from_oat(here.px, here.py, here.pz, 0.4, 1.2, 0.1)
    poses = [here, here._replace(px=here.px + 5.0), beside]
    configuration = arm.configuration(ready)
    found = arm.batch.inverse_branch(stack(poses), configuration, np.array(ready))
    assert found[0] == pytest.approx(ready, abs=1e-7)
    for pose, row in zip(poses[1:], found[1:], strict=True):
        assert arm.branch_joints(pose, configuration, ready) is None
        assert np.isnan(row).all()
