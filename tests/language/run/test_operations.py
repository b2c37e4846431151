"""What functions give where arguments are left out."""

from __future__ import annotations

from math import radians

import pytest

from vrs_cli.errors import NegativeSquareRoot
from vrs_cli.kinematics.transform import from_oat
from vrs_cli.language.run.operations import square_root, trans


@pytest.mark.parametrize(
    ("given", "meant"),
    [((None, 0, 0), (90, 0, 0)), ((30, None, 20), (30, -90, 20)), ((30, 40, None), (30, 40, 0)), ((), (90, -90, 0))],
)
def test_angles_that_are_left_out_are_those_of_null(given: tuple[float | None, ...], meant: tuple[float, ...]) -> None:
    assert trans(1.0, None, 3.0, *given) == pytest.approx(from_oat(0.001, 0.0, 0.003, *map(radians, meant)))


def test_the_root_of_zero_is_zero_and_nothing_below_has_one() -> None:
    assert (square_root(0.0), square_root(-0.0), square_root(2.25)) == (0.0, 0.0, 1.5)
    with pytest.raises(NegativeSquareRoot):
        square_root(-5e-324)
