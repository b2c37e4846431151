"""Time in a window, as a user plays with it: buttons, keys and the slider over a real socket, without a browser."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from math import inf

import numpy as np
import pytest

from tests.view3d.pages import Page
from vrs_cli.api.robot import Robot
from vrs_cli.engine.position import position_at
from vrs_cli.interfaces.roles.observer import RecordedRobot
from vrs_cli.interfaces.roles.playback import Playback, command_after
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.view3d.app import App
from vrs_cli.view3d.bar import KINDS, PlaybackBar, TimeSpan
from vrs_cli.view3d.window import RobotWindow

PLAYED = "MOVE #PPOINT(10, -90, 90, 0, 0, 0)\nDELAY 1\nMOVE #PPOINT(80, -90, 90, 0, 0, 0)\nDELAY 5"


@pytest.fixture(scope="module")
def recorded() -> RecordedRobot:
    robot = Robot()
    robot.prompt(PLAYED)
    return RecordedRobot(arm_for(load_robot("puma560")), robot.timeline)


@pytest.fixture
def app(recorded: RecordedRobot) -> Iterator[App]:
    app = App(lambda _told: recorded)
    yield app
    app.close()


@pytest.fixture
def page(app: App) -> Iterator[Page]:
    with Page(app.address) as page:
        page.until(lambda: page.of("GuiSliderMessage"))
        yield page


@pytest.fixture
def window(app: App, page: Page) -> RobotWindow:
    page.until(lambda: app.windows)
    return app.windows[0]


def played(page: Page, window: RobotWindow, found: Callable[[Playback], object]) -> Playback:
    page.until(lambda: found(window.playback))
    return window.playback


def press(page: Page, button: str) -> None:
    page.set(page.gui("GuiButtonGroupMessage")["uuid"], button)


def test_a_trajectory_is_played_from_its_start(page: Page, window: RobotWindow) -> None:
    assert window.playback.playing
    slider = page.gui("GuiSliderMessage")
    page.until(lambda: page.gui("GuiSliderMessage")["value"] > slider["value"])


def test_the_slider_goes_from_start_to_end(page: Page, recorded: RecordedRobot) -> None:
    page.until(lambda: page.gui("GuiSliderMessage")["max"] >= recorded.timeline.end)
    assert page.gui("GuiSliderMessage")["min"] == recorded.timeline.start


def test_pause_seek_and_play_on(page: Page, window: RobotWindow) -> None:
    press(page, "play / pause")
    played(page, window, lambda p: not p.playing)
    page.set(page.gui("GuiSliderMessage")["uuid"], 1.25)
    assert played(page, window, lambda p: p.shown == 1.25).playing is False
    page.key("Play or pause")
    played(page, window, lambda p: p.playing)


def test_the_arm_is_where_it_is_at_the_time_that_is_sought(
    page: Page, window: RobotWindow, recorded: RecordedRobot
) -> None:
    press(page, "play / pause")
    played(page, window, lambda p: not p.playing)
    page.set(page.gui("GuiSliderMessage")["uuid"], 2.0)
    expected = position_at(recorded.arm, recorded.timeline, 2.0).T_world_tool
    page.until(lambda: page.is_at("/tool", expected))


def test_rates_and_loop(page: Page, window: RobotWindow) -> None:
    page.key("Slower")
    played(page, window, lambda p: p.rate == 0.5)
    press(page, "faster")
    played(page, window, lambda p: p.rate == 1.0)
    press(page, "loop")
    played(page, window, lambda p: p.loops)
    page.until(lambda: "over and over" in page.told_of_time())


def test_from_command_to_command(page: Page, window: RobotWindow, recorded: RecordedRobot) -> None:
    page.key("To the start")
    page.key("Play or pause")
    played(page, window, lambda p: not p.playing)
    page.key("To the start")
    played(page, window, lambda p: p.shown == recorded.timeline.start)
    t = recorded.timeline.start
    for _ in range(3):
        t = command_after(recorded.timeline, t)
        page.key("On a command")
        played(page, window, lambda p, t=t: p.shown == t)
    page.key("Back a command")
    assert played(page, window, lambda p: p.shown < t).playing is False


def test_nothing_is_followed_of_what_does_not_live(page: Page) -> None:
    assert "live" not in page.gui("GuiButtonGroupMessage")["options"]
    assert "Follow the robot" not in {m["props"]["label"] for m in page.of("RegisterCommandMessage")}


def test_where_nothing_moves_nothing_is_sent(page: Page, window: RobotWindow) -> None:
    page.key("Play or pause")
    played(page, window, lambda p: not p.playing)
    page.until(lambda: page.quiet(0.25) == [])


def test_less_of_the_timeline_is_shown_at_will(page: Page) -> None:
    press(page, "play / pause")
    for _ in range(3):
        page.key("Show more or less of the timeline")
    page.until(lambda: page.gui("GuiSliderMessage")["max"] - page.gui("GuiSliderMessage")["min"] == 5.0)


def test_the_slider_goes_from_and_to_round_times(app: App) -> None:
    def ends(length: float, start: float) -> TimeSpan:
        bar._length = length
        return bar._span_of(Playback.of(start, start + 90.0, 1.0, 0.0), start + 1.0)

    with Page(app.address) as page:
        page.until(lambda: app.windows)
        bar = next(part for part in app.windows[0].parts if isinstance(part, PlaybackBar))
    assert ends(5.0, 116.172357) == (115.0, 120.0)
    assert ends(60.0, 116.172357) == (60.0, 120.0)
    assert ends(inf, 116.172357) == (115.0, 210.0)


def test_the_strip_is_drawn_and_told(page: Page) -> None:
    page.until(lambda: "MOVE #PPOINT(80" in page.html())
    page.until(lambda: re.search(r"<b>\d+\.\d\d s</b> of \d+\.\d\d s", page.told_of_time()))


# --- plots -----------------------------------------------------------------------------------------------------------


def test_plots_cost_nothing_until_they_are_open(page: Page) -> None:
    page.quiet(0.2)
    assert not page.of("GuiUplotMessage")
    page.set(page.gui("GuiCheckboxMessage", label="joint speeds")["uuid"], True)
    plot = page.until(lambda: page.of("GuiUplotMessage"))[0]
    assert [series["label"] for series in plot["props"]["series"]] == ["s", *(f"JT{n}" for n in range(1, 7))]
    page.until(lambda: any("data" in m.get("updates", {}) for m in page.of("GuiUpdateMessage")))
    page.until(lambda: "JT1" in page.html())
    page.set(page.gui("GuiCheckboxMessage", label="joint speeds")["uuid"], False)
    page.until(lambda: page.of("GuiRemoveMessage"))


def test_plots_tell_what_g_says(recorded: RecordedRobot) -> None:
    arm, timeline = recorded
    times = np.linspace(0.0, timeline.end, 50)
    joints, shares, speed = (kind.values(arm, timeline, times) for kind in KINDS)
    for k, t in enumerate(times.tolist()):
        there = position_at(arm, timeline, t)
        assert joints[k] == pytest.approx(np.degrees(there.joints))
        assert shares[k] == pytest.approx(
            [100.0 * v / m for v, m in zip(there.velocity, arm.model.max_velocity, strict=True)]
        )
    assert np.abs(shares).max() <= 100.0 + 1e-6
    assert speed.max() > 200.0
    assert speed[0] == pytest.approx(0.0, abs=1.0)
