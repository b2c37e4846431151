"""Ways round a line that cannot be moved along."""

from __future__ import annotations

import pytest

from vrs_cli.engine.line_check import _across
from vrs_cli.kinematics.transform import Vector, dot, length


@pytest.mark.parametrize("way", [(0.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.1, -0.2, 0.3), (0.0, 0.0, -0.5)])
def test_via_points_are_looked_for_to_all_sides(way: Vector) -> None:
    found = _across(way)
    assert [length(one) for one in found] == pytest.approx([1.0] * len(found))
    assert [dot(one, way) for one in found] == pytest.approx([0.0] * len(found))
    assert sum(map(abs, map(sum, zip(*found, strict=True)))) == pytest.approx(0.0), "as far to one side as to the other"
    assert len(set(found)) == (4 if length(way) else 6)
