"""Test the sentences about moved motions."""

from __future__ import annotations

import pytest

from vrs_cli.render.plain import sentences, untrue_sentence
from vrs_cli.values.results import Displacement, Moved, Untrue


def moved(asked: float | None, later: float, text: str = "MOVE a") -> Moved:
    return Moved(text, asked, 10.0, 10.0 + later)


@pytest.mark.parametrize(
    ("it", "said"),
    [
        (Displacement((moved(4.0, 0.528),), (), ()), "1 later motion begins 0.528 s later: AT 4"),
        (
            Displacement((moved(4.0, 0.528), moved(6.25, 0.528), moved(None, 0.528)), (), ()),
            "3 later motions begin 0.528 s later: AT 4, AT 6.25, MOVE a",
        ),
        (
            Displacement((), (moved(4.0, -0.25), moved(20.0, -0.5)), ()),
            "2 later motions begin 0.250 to 0.500 s earlier: AT 4, AT 20",
        ),
        (
            Displacement(tuple(moved(float(k), 1.0) for k in range(10, 18)), (), ()),
            "8 later motions begin 1.000 s later: AT 10, AT 11, AT 12, AT 13, AT 14 and 3 more",
        ),
        (
            Displacement((moved(4.0, 1.0), moved(6.0, 1.0)), (), (), more=True),
            "2 later motions and more begin 1.000 s later: AT 4, AT 6",
        ),
        (Displacement((), (), (Moved("MOVE a", 4.0, 4.0, None),)), "1 later motion is dropped: AT 4"),
    ],
)
def test_sentences(it: Displacement, said: str) -> None:
    assert list(sentences(it)) == [said]


def test_what_is_no_longer_true_is_told_with_its_place() -> None:
    place = "pick step 4: WAIT SIG(1001)"
    came = Untrue(7, 1001, True, True, 3.2, place, "MOVE b")
    assert untrue_sentence(came) == f"MOVE b was given when 1001 came on at 3.200 s; it no longer does ({place})"
    was = Untrue(7, 1001, False, False, 3.2, place, "", "part.there")
    told = f"a program went on when 1001 (part.there) was off at 3.200 s; it no longer is ({place})"
    assert untrue_sentence(was) == told
