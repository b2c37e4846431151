"""Flags: the times of which something wrong was shown, and no others."""

from __future__ import annotations

from itertools import pairwise
from random import Random

from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from vrs_cli.net.flags import Flags, FlagWindow, merged


def test_what_a_change_makes_wrong_lies_between_its_cut_and_its_arrival() -> None:
    flags = Flags()
    assert flags.arrived(cut=2.0, applied=1.0, at=2.5) == FlagWindow(2.0, 2.5)


def test_a_change_of_the_past_was_right_until_it_was_made() -> None:
    assert Flags().arrived(cut=0.5, applied=1.0, at=1.2) == FlagWindow(1.0, 1.2)


def test_a_change_that_arrives_before_its_cut_makes_nothing_wrong() -> None:
    flags = Flags()
    assert flags.arrived(cut=3.0, applied=1.0, at=2.5) is None
    assert not flags.windows


def test_who_looks_ahead_was_shown_more() -> None:
    assert Flags(ahead=0.75).arrived(cut=3.0, applied=1.0, at=2.5) == FlagWindow(3.0, 3.25)


def test_what_ended_long_ago_is_forgotten() -> None:
    flags = Flags()
    flags.arrived(1.0, 1.0, 1.5)
    flags.arrived(4.0, 4.0, 4.5)
    flags.forget(before=2.0)
    assert flags.windows == (FlagWindow(4.0, 4.5),)


def test_windows_are_kept_merged_and_found_however_many_there_are() -> None:
    random, flags, told = Random(4), Flags(), []
    for _ in range(300):
        begin = random.uniform(0.0, 100.0)
        window = FlagWindow(begin, begin + random.uniform(0.0, 0.5))
        flags.arrived(window.begin, 0.0, window.end)
        told.append(window)
        assert flags.windows == merged(told)
    flags.forget(50.0)
    assert flags.windows == tuple(one for one in merged(told) if one.end >= 50.0)


numbers = st.integers(0, 40).map(lambda count: count / 4)


@examples(200)
@given(st.lists(st.tuples(numbers, numbers)))
def test_merged_windows_are_the_same_times(pairs: list[tuple[float, float]]) -> None:
    windows = [FlagWindow(min(pair), max(pair)) for pair in pairs]
    found = merged(windows)
    for t in (count / 8 for count in range(81)):
        inside = any(window.begin <= t <= window.end for window in windows)
        assert any(window.begin <= t <= window.end for window in found) is inside
    assert all(one.end < other.begin for one, other in pairwise(found))
