from __future__ import annotations

from math import inf, nan

import numpy as np
import pytest

from vrs_cli.api.numbers import Units, number, numbers


@pytest.mark.parametrize("given", [(1, 2, 3), [1.0, 2.0, 3.0], np.array([1, 2, 3]), [np.float32(1), 2, np.int64(3)]])
def test_numbers_of_all_kinds_are_taken(given: object) -> None:
    found = numbers(given, "joints", 3)  # type: ignore[arg-type]
    assert found.dtype == np.float64
    assert found.tolist() == [1.0, 2.0, 3.0]


def test_what_is_stored_is_a_copy() -> None:
    given = np.zeros(3)
    found = numbers(given, "joints", 3)
    given[0] = 7.0
    assert found[0] == 0.0


@pytest.mark.parametrize(
    "given", ["123", ["1", "2", "3"], [None, 1, 2], [1j, 2, 3], [True, False, True], b"abc", {1: 2}, object()]
)
def test_other_types_are_refused_in_one_line(given: object) -> None:
    with pytest.raises(TypeError, match=r"^joints: numbers are wanted, not [^\n]*$"):
        numbers(given, "joints", 3)  # type: ignore[arg-type]


@pytest.mark.parametrize("given", [1.0, [1.0, 2.0], [[1.0, 2.0]], []])
def test_other_shapes_are_refused(given: object) -> None:
    with pytest.raises(ValueError, match=r"^joints: the shape .* does not fit, \(3,\) or \(N, 3\) is wanted$"):
        numbers(given, "joints", 3)  # type: ignore[arg-type]


def test_ragged_rows_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^joints: the rows are not of one length$"):
        numbers([[1, 2, 3], [1, 2]], "joints", 3)


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_only_finite_numbers(bad: float) -> None:
    with pytest.raises(ValueError, match=r"^joints: finite numbers are wanted, not (nan|-?inf)$"):
        numbers([0.0, bad, 0.0], "joints", 3)


def test_one_number() -> None:
    assert number(np.float32(2.5), "at") == 2.5
    with pytest.raises(TypeError, match=r"^at: one number is wanted"):
        number([1.0], "at")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^at: numbers are wanted, not '1'"):
        number("1", "at")  # type: ignore[arg-type]


def test_units() -> None:
    assert Units.of("SI") is Units.SI
    with pytest.raises(ValueError, match=r"^units 'mm': \"VAL\" \(mm, degrees\) or \"SI\" \(m, radians\) is wanted$"):
        Units.of("mm")
