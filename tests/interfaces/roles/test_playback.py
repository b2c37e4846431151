from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis.strategies import floats, lists, sampled_from

from vrs_cli.api.robot import Robot
from vrs_cli.interfaces.roles.playback import RATES, Playback, command_after, command_before
from vrs_cli.trajectory.timeline import Timeline


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


# --- over and over ---------------------------------------------------------------------------------------------------


def test_a_loop_goes_on_from_the_start() -> None:
    looped = playing().loop(103.0)
    assert looped.at(103.0) == 5.0
    assert looped.at(109.5) == 11.5
    assert looped.at(112.0) == 4.0
    assert looped.at(1012.0) == 4.0
    assert not looped.ended(1e6)


def test_a_loop_that_is_left_ends_at_the_end() -> None:
    once = playing().loop(103.0).loop(112.0)
    assert (once.at(112.0), once.at(1000.0)) == (4.0, 12.0)


def test_who_loops_does_not_follow_and_who_follows_does_not_loop() -> None:
    following = Playback.following(0.0, 10.0, 4.0, 0.0)
    looped = following.loop(0.0)
    assert (looped.follows, looped.loops) == (False, True)
    assert looped.at(6.5) == 0.5
    again = looped.follow(7.0)
    assert (again.follows, again.loops, again.at(99.0)) == (True, False, 4.0)


@given(
    start=floats(-10.0, 10.0),
    length=floats(0.0, 100.0),
    rate=sampled_from(RATES),
    steps=lists(floats(0.0, 1000.0), max_size=6),
)
def test_a_loop_stays_within_the_trajectory_and_does_not_drift(
    start: float, length: float, rate: float, steps: list[float]
) -> None:
    """Looked at often or rarely, it shows the same."""
    once = looked = Playback.of(start, start + length, rate, 0.0).loop(0.0)
    wall = 0.0
    for step in steps:
        wall += step
        looked = looked.look(wall, start, start + length, start + length)
        assert start <= looked.at(wall) <= start + length
    if length > 0.01:
        apart = abs(looked.at(wall) - once.at(wall))
        assert min(apart, length - apart) < 1e-6


@pytest.mark.parametrize(
    ("playback", "wall", "said"),
    [
        (playing(), 103.0, "playing"),
        (playing().pause(103.0), 104.0, "paused"),
        (playing(), 112.0, "ended"),
        (playing().loop(100.0), 200.0, "playing"),
        (Playback.following(0.0, 10.0, 4.0, 0.0), 1.0, "live"),
        (Playback.following(0.0, 10.0, 4.0, 0.0).look(0.0, 0.0, 10.0, 6.5), 0.0, "2.5 s behind"),
    ],
)
def test_what_it_does_is_said(playback: Playback, wall: float, said: str) -> None:
    assert playback.doing(wall) == said


# --- from command to command -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def timeline() -> Timeline:
    """Three commands: a stop, a wait, a motion."""
    robot = Robot()
    robot.prompt("MOVE #PPOINT(10, -90, 90, 0, 0, 0)\nDELAY 1\nMOVE #PPOINT(20, -90, 90, 0, 0, 0)")
    return robot.timeline


def test_commands_are_stepped_through_to_the_end_and_back(timeline: Timeline) -> None:
    begins = sorted({min(s.start for s in timeline if s.motion.number == n) for n in range(4)})
    there, t = [], timeline.start
    while t < timeline.end:
        there.append(t)
        t = command_after(timeline, t)
    assert there == begins
    assert t == timeline.end
    back = []
    while t > timeline.start:
        t = command_before(timeline, t)
        back.append(t)
    assert back == begins[::-1]


def test_the_command_in_force_is_begun_again_before_the_one_before_it(timeline: Timeline) -> None:
    second = command_after(timeline, timeline.start)
    assert command_before(timeline, second + 0.9) == second
    assert command_before(timeline, second) == timeline.start
