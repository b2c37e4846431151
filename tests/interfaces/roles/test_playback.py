from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.files.trajectories import planned, puma
from vrs_cli.api.robot import Robot
from vrs_cli.engine import position
from vrs_cli.errors import IllegalValue
from vrs_cli.interfaces.roles import playback as viewers
from vrs_cli.interfaces.roles.playback import RATES, Audience, Playback
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.trajectory.timeline import Timeline


def playing(rate: float = 1.0) -> Playback:
    """A trajectory from 2 s to 12 s, played since the wall clock said 100 s."""
    return Playback.of(2.0, 12.0, rate, 100.0)


@pytest.mark.parametrize(("rate", "wall", "t"), [(1.0, 100.0, 2.0), (1.0, 103.0, 5.0), (2.0, 103.0, 8.0)])
def test_time_goes_by_at_its_rate(rate: float, wall: float, t: float) -> None:
    assert playing(rate).at(wall) == t


def test_it_stops_at_the_end() -> None:
    assert playing().at(1000.0) == 12.0
    assert playing().is_over(110.0)
    assert not playing().is_over(109.9)


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
    paused = Playback.begin_live(0.0, 10.0, 4.0, 0.0).toggle(1.0)
    assert (paused.playing, paused.at(9.0)) == (False, 4.0)
    assert paused.toggle(9.0).playing


# --- over and over ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("playback", "wall", "said"),
    [
        (playing(), 103.0, "playing"),
        (playing().pause(103.0), 104.0, "paused"),
        (playing(), 112.0, "ended"),
        (Playback.begin_live(0.0, 10.0, 4.0, 0.0), 1.0, "live"),
        (Playback.begin_live(0.0, 10.0, 4.0, 0.0).look(0.0, 0.0, 10.0, 6.5), 0.0, "2.5 s behind"),
    ],
)
def test_what_it_does_is_said(playback: Playback, wall: float, said: str) -> None:
    assert playback.state_text(wall) == said


# --- from command to command -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def timeline() -> Timeline:
    """Three commands: a stop, a wait, a motion."""
    robot = Robot()
    robot.prompt("MOVE #PPOINT(10, -90, 90, 0, 0, 0)\nDELAY 1\nMOVE #PPOINT(20, -90, 90, 0, 0, 0)")
    return robot.timeline


@dataclass
class RoomServices:
    """A robot, and the clock on the wall of those who watch it."""

    arm: RobotArm = field(default_factory=lambda: arm_for(puma()))
    timeline: Timeline = field(default_factory=lambda: planned(6)[0])
    now: float = 0.0
    wall: float = 0.0

    def audience(self) -> Audience:
        return Audience(self, lambda: self.wall)


def shown(services: RoomServices, audience: Audience) -> list[float]:
    """The times that are shown at the next instant at which somebody looks."""
    services.wall = audience.peek()
    return [look.position.time for look in audience.step()]


def test_a_viewer_looks_at_its_own_rate() -> None:
    services = RoomServices()
    audience = services.audience()
    slow, fast = audience.join(2.0), audience.join(4.0)
    who = []
    while audience.peek() <= 1.0:
        services.wall = audience.peek()
        who.append([look.viewer for look in audience.step()])
    assert who == [[fast], [slow, fast], [fast], [slow, fast]]


def test_nobody_looks_where_nobody_is() -> None:
    audience = RoomServices().audience()
    viewer = audience.join()
    audience.leave(viewer)
    assert audience.peek() == inf
    assert audience.step() == []


def test_looks_that_were_missed_are_left_out() -> None:
    services = RoomServices()
    audience = services.audience()
    viewer = audience.join(10.0)
    services.wall = 5.0
    assert len(audience.step()) == 1
    assert viewer.due == pytest.approx(5.1)


def test_a_viewer_of_real_time_sees_the_present() -> None:
    services = RoomServices()
    audience = services.audience()
    audience.join(4.0)
    for _ in range(8):
        services.now = audience.peek()
        assert shown(services, audience) == [services.now]


def test_following_plays_on_at_its_rate_when_virtual_time_jumps() -> None:
    services = RoomServices()
    audience = services.audience()
    viewer = audience.join(4.0)
    services.wall = 60.0
    audience.step()
    services.now = 40.0
    assert shown(services, audience) == [0.25]
    services.wall = 64.25
    [look] = audience.step()
    assert (look.position.time, viewer.playback.behind(services.wall)) == (4.25, 35.75)
    viewer.playback = viewer.playback.follow(services.wall)
    assert shown(services, audience) == [40.0]


def test_a_viewer_pauses_seeks_and_plays_faster() -> None:
    services = RoomServices(now=5.0)
    audience = services.audience()
    viewer = audience.join(1.0)
    viewer.playback = viewer.playback.rewind(services.wall).at_rate(0.5, services.wall)
    assert shown(services, audience) == [0.5]
    viewer.playback = viewer.playback.pause(services.wall)
    assert shown(services, audience) == [0.5]
    viewer.playback = viewer.playback.play(services.wall)
    assert shown(services, audience) == [1.0]
    viewer.playback = viewer.playback.seek(99.0, services.wall)
    assert shown(services, audience) == [5.0]


def test_undo_takes_who_follows_back() -> None:
    services = RoomServices(now=5.0)
    audience = services.audience()
    audience.join(1.0)
    assert shown(services, audience) == [5.0]
    services.now = 2.0
    assert shown(services, audience) == [2.0]


def test_viewers_of_one_rate_share_one_evaluation(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def counted(arm: RobotArm, timeline: Timeline, t: float) -> position.Position:
        asked.append(t)
        return position.position_at(arm, timeline, t)

    monkeypatch.setattr(viewers, "position_at", counted)
    services = RoomServices()
    audience = services.audience()
    for moment in (0.0, 0.003, 0.011):
        services.wall = moment
        audience.join(20.0)
    services.now = 40.0
    for number in range(1, 6):
        assert len(shown(services, audience)) == 3
        assert len(asked) == number


@pytest.mark.parametrize("rate", [0.0, -1.0, nan, inf, 1e9])
def test_a_rate_that_is_none_is_refused(rate: float) -> None:
    with pytest.raises(IllegalValue, match="looks a second"):
        RoomServices().audience().join(rate)


LOOK_RATES = st.floats(0.1, 10.0)
TIMES = st.lists(st.tuples(st.floats(0.0, 5.0), st.floats(0.0, 60.0)), max_size=20)


@given(LOOK_RATES, TIMES)
def test_who_follows_never_jumps_ahead_nor_faster_than_its_rate(rate: float, times: list[tuple[float, float]]) -> None:
    playback = Playback.of(0.0, 0.0, rate, 0.0).look(0.0, 0.0, 0.0, 0.0).follow(0.0)
    wall = now = 0.0
    for passed, jumped in times:
        before = playback.at(wall)
        wall, now = wall + passed, now + jumped
        playback = playback.look(wall, 0.0, now, now)
        t = playback.at(wall)
        assert before <= t <= min(before + rate * passed + 1e-9, now)
        assert playback.behind(wall) == pytest.approx(now - t)
        assert t == now or t == pytest.approx(before + rate * passed)
