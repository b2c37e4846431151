"""Variants of a formula give what the formula gives."""

from __future__ import annotations

from collections.abc import Callable
from math import nan, pi, sqrt
from pathlib import Path
from random import Random

import numpy as np
import pytest

from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.formula import interpreted, over_arrays, steps_of
from vrs_cli.kinematics.joints import ALL, Wrist
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.spherical_wrist import inverse


def make_root(shift: float) -> Callable[[float], float | None]:
    """Return a small formula with a choice, a chain of comparisons and a return of None."""

    def root(x: float) -> float | None:
        y = x + shift
        if y < -1.0 or y > 9.0:
            return None
        size = sqrt(y if y > 0.0 else 0.0)
        return size if 1.0 < size < 2.0 else -size

    return root


def test_a_formula_over_arrays_gives_what_it_gives_for_floats() -> None:
    root = make_root(0.5)
    x = np.linspace(-3.0, 12.0, 61)
    wanted = [nan if (y := root(one)) is None else y for one in x.tolist()]
    np.testing.assert_array_equal(over_arrays(root)(x), wanted)
    assert over_arrays(root)(np.array([2.0])).tolist() == [root(2.0)]  # all rows make the same choice


def test_steps_of_a_formula_end_where_it_ends() -> None:
    root = make_root(0.5)
    assert steps_of(root, ("y", "size"), 3.5) == {"y": 4.0, "size": 2.0}
    assert steps_of(root, ("y", "size"), -3.0) == {"y": -2.5}


@pytest.mark.parametrize("robot", ["puma560", "irb120", "kr10", "ur5e"])
def test_all_branches_are_those_that_the_formula_gives_one_by_one(robot: str) -> None:
    """To the bit but for whole turns; FLIP is NOFLIP with the wrist turned on an arm with a spherical wrist."""
    arm, random = arm_for(load_robot(robot)), Random(5)
    for _ in range(200):
        T = arm.forward(
            tuple(random.uniform(low, high) for low, high in zip(arm.model.lower, arm.model.upper, strict=True))
        )
        for way, q in zip(ALL, arm.branches(T), strict=True):
            one = arm.branch_joints(T, way, arm.middle)
            assert (q is None) == (one is None)
            if q is not None and one is not None:
                exact = way.wrist is Wrist.NOFLIP or robot == "ur5e"
                assert q == one if exact else q == pytest.approx(one, abs=1e-12)
                assert all(abs(x - middle) <= pi + 1e-9 for x, middle in zip(q, arm.middle, strict=True))


def test_a_compiled_function_has_an_interpreted_form() -> None:
    """Here the function is an object that only names its place, as functions of compiled modules do."""

    class Compiled:
        __module__, __name__ = inverse.__name__, "flipped_wrist"

    assert interpreted(make_root) is make_root
    found = interpreted(Compiled())  # type: ignore[type-var]
    assert found.__code__.co_filename == str(Path(str(inverse.__file__)).with_name("inverse.py"))
    assert found(0.5, 1.0, -0.5, True) == inverse.flipped_wrist(0.5, 1.0, -0.5, True)
