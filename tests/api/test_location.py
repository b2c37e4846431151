from __future__ import annotations

from math import inf, nan, pi

import numpy as np
import pytest

from vrs_cli import Location, trans
from vrs_cli.api.location import Units, number, numbers
from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.language.words.values import transformation

PART = trans(300, 450, -200, 90, 90, 0)


def test_it_is_what_val2_makes_of_the_numbers_to_the_bit() -> None:
    assert PART.transform == transformation((300, 450, -200, 90, 90, 0))
    assert trans(0, 0, 0).transform == IDENTITY


def test_what_it_shows() -> None:
    assert PART.xyz.tolist() == [300.0, 450.0, -200.0]
    assert PART.oat.tolist() == pytest.approx([90.0, 90.0, 0.0])
    assert PART.matrix.shape == (4, 4)
    assert PART.matrix[:3, 3] == pytest.approx([0.3, 0.45, -0.2])
    assert repr(PART) == "trans(300, 450, -200, 90, 90, 0)"
    assert eval(repr(PART), {"trans": trans}) == PART


def test_in_si() -> None:
    si = trans(0.3, 0.45, -0.2, pi / 2, pi / 2, 0, units="SI")
    assert si.xyz == pytest.approx([0.3, 0.45, -0.2])
    assert si.oat == pytest.approx([pi / 2, pi / 2, 0.0])
    assert np.allclose(si.matrix, PART.matrix)
    assert repr(si).endswith('units="SI")')


def test_many() -> None:
    row = trans(np.linspace(0, 100, 5), 450, -200, 90, 90, 0)
    assert (row.shape, len(row), row.xyz.shape, row.matrix.shape) == ((5,), 5, (5, 3), (5, 4, 4))
    assert row[4] == trans(100, 450, -200, 90, 90, 0)
    assert repr(row) == "5 locations"
    assert [one.xyz[0] for one in row] == pytest.approx([0, 25, 50, 75, 100])


def test_compound() -> None:
    assert (PART @ trans(0, 0, -50)).xyz == pytest.approx([300, 450, -150])
    assert np.allclose((PART @ PART.inverse()).matrix, np.eye(4))
    assert (PART @ trans(0, 0, [10, 20])).shape == (2,)


def test_of_a_matrix() -> None:
    assert np.allclose(Location.from_matrix(PART.matrix).xyz, PART.xyz)
    with pytest.raises(ValueError, match=r"^matrix: a rotation and a position"):
        Location.from_matrix(2.0 * np.eye(4))
    with pytest.raises(ValueError, match=r"^matrix: the shape"):
        Location.from_matrix(np.eye(3))


def test_it_cannot_be_changed() -> None:
    for array in (PART.xyz, PART.oat, PART.matrix, PART.rows):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


def test_mistakes() -> None:
    with pytest.raises(TypeError, match=r"^x: numbers are wanted, not 'abc'$"):
        trans("abc")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^z: finite numbers are wanted, not nan$"):
        trans(0, 0, float("nan"))
    with pytest.raises(ValueError, match=r"^trans: arrays of shapes"):
        trans([1, 2], [1, 2, 3])
    with pytest.raises(ValueError, match=r"^location: one is wanted"):
        _ = trans([1, 2]).transform


# --- numbers ---


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
