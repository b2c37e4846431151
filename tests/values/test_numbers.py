"""Numbers on the screen."""

from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.values.numbers import count, decimal, seconds


def test_three_decimals() -> None:
    assert [decimal(1.0), decimal(-74.1454), decimal(921.12)] == ["1.000", "-74.145", "921.120"]


def test_zero_has_no_sign() -> None:
    assert [decimal(-0.0), decimal(-0.0004), decimal(-1e-12), decimal(-0.0005001)] == [
        "0.000",
        "0.000",
        "0.000",
        "-0.001",
    ]


@given(st.floats(-1e6, 1e6))
def test_law_only_a_zero_loses_its_sign(value: float) -> None:
    shown = float(decimal(value))
    assert abs(shown - value) <= 0.0005000001
    assert not decimal(value).startswith("-0.000") or shown != 0.0


def test_words() -> None:
    assert (count(1, "step"), count(2, "step"), seconds(-0.0)) == ("1 step", "2 steps", "0.000 s")
