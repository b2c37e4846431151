"""What an arm with few joints cannot change, and what is said of it."""

from __future__ import annotations

from math import cos, pi, radians, sin

import pytest

from vrs_cli.kinematics.clearance import _angle, difference
from vrs_cli.kinematics.transform import from_oat


def test_what_to_give_instead() -> None:
    asked = from_oat(0.3, 0.1, 0.05, *map(radians, (90.0, 90.0, 30.0)))
    assert difference(asked, asked._replace(pz=0.0)) == "Z 0"
    assert difference(asked, asked._replace(px=0.2505, pz=-0.01)) == "X 250.5, Z -10"
    assert difference(asked, from_oat(0.3, 0.1, 0.05, *map(radians, (90.0, 0.0, 0.0)))) == "O 90, A 0, T 0"


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-9, 1e-4, 0.3, 1.6, 3.0, pi])
def test_angles_are_exact_also_where_they_are_next_to_nothing(angle: float) -> None:
    assert _angle((0.0, 0.0, 1.0), (sin(angle), 0.0, cos(angle))) == pytest.approx(angle, rel=1e-7, abs=1e-15)
