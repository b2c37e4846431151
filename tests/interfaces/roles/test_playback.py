from __future__ import annotations

import pytest

from vrs_cli.interfaces.roles.playback import RATES, Playback


def playing(rate: float = 1.0) -> Playback:
    """A trajectory from 2 s to 12 s, played since the wall clock said 100 s."""
    return Playback.of(2.0, 12.0, rate, 100.0)


@pytest.mark.parametrize(("rate", "wall", "t"), [(1.0, 100.0, 2.0), (1.0, 103.0, 5.0), (2.0, 103.0, 8.0)])
def test_time_goes_by_at_its_rate(rate: float, wall: float, t: float) -> None:
    assert playing(rate).at(wall) == t


def test_it_stops_at_the_end() -> None:
    assert playing().at(1000.0) == 12.0
    assert playing().ended(110.0)
    assert not playing().ended(109.9)


def test_a_pause_holds_and_play_goes_on_from_there() -> None:
    paused = playing().toggle(103.0)
    assert paused.at(150.0) == 5.0
    assert paused.toggle(150.0).at(151.0) == 6.0


def test_play_at_the_end_begins_again() -> None:
    assert playing().toggle(200.0).at(201.0) == 3.0


def test_seeking_stays_within_the_trajectory() -> None:
    assert playing().skip(-5.0, 104.0).at(104.0) == 2.0
    assert playing().skip(3.0, 104.0).at(105.0) == 10.0
    assert playing().seek(99.0, 104.0).at(104.0) == 12.0


def test_a_change_of_rate_does_not_jump() -> None:
    faster = playing().faster(103.0)
    assert faster.rate == 2.0
    assert faster.at(103.0) == 5.0
    assert faster.at(104.0) == 7.0
    assert faster.slower(104.0).at(105.0) == 8.0


def test_the_rate_has_a_highest_and_a_lowest_step() -> None:
    playback = playing()
    for _ in RATES:
        playback = playback.faster(100.0)
    assert playback.rate == RATES[-1]
    for _ in RATES:
        playback = playback.slower(100.0)
    assert playback.rate == RATES[0]


def test_who_follows_pauses_in_the_present() -> None:
    paused = Playback.following(0.0, 10.0, 4.0, 0.0).toggle(1.0)
    assert (paused.playing, paused.at(9.0)) == (False, 4.0)
    assert paused.toggle(9.0).playing
