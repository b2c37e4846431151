"""What functions give where arguments are left out."""

from __future__ import annotations

import struct
from math import inf, nan, nextafter, radians

import pytest

from vrs_cli.errors import IllegalValue, NegativeSquareRoot
from vrs_cli.kinematics.transform import from_oat
from vrs_cli.language.run.operations import _numbers_in, square_root, trans
from vrs_cli.values.numbers import LIMIT


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


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_bytes_of_the_largest_real_are_a_real_and_those_of_a_larger_number_are_none(sign: float) -> None:
    assert _numbers_in(struct.pack(">d", sign * LIMIT).decode("latin-1"), None, "d") == (sign * LIMIT,)
    for number in (nextafter(sign * LIMIT, sign * inf), sign * inf, nan):
        with pytest.raises(IllegalValue, match="bytes of no real"):
            _numbers_in(struct.pack(">d", number).decode("latin-1"), None, "d")
