"""The view in a real browser: the arm stands where g says, time can be played with, two look at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from tests.view3d.browser import Browser, needs_browser
from vrs_cli.api.robot import Robot
from vrs_cli.engine.position import position_at
from vrs_cli.interfaces.roles.observer import RecordedRobot
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import link_frames
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform
from vrs_cli.view3d.app import App
from vrs_cli.view3d.figure import link_node

pytestmark = needs_browser


PLAYED = "MOVE #PPOINT(70, -60, 60, 20, 30, 40)\nMOVES TRANS(300, 400, -200, 90, 90, 0)\nREADY\nDELAY 600"


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


def matrix(T: Transform) -> np.ndarray:
    return np.array([[T.nx, T.sx, T.ax, T.px], [T.ny, T.sy, T.ay, T.py], [T.nz, T.sz, T.az, T.pz], [0, 0, 0, 1]])


def test_the_page_shows_what_g_says_and_another_window_has_a_time_of_its_own(
    app: App, browser: Browser, recorded: RecordedRobot
) -> None:
    """In one test, as a page takes seconds to load."""
    arm, timeline = recorded
    browser.size(320, 240)
    browser.open(app.address, "/robot", "/tool", "/path")
    window = app.windows[0]
    window.change(Playback.pause)
    for share in (0.0, 0.21, 0.5, 0.83, 1.0):
        t = share * timeline[-1].start
        window.change(lambda playback, wall, t=t: playback.seek(t, wall))
        there = position_at(arm, timeline, t)
        expected = matrix(there.T_world_tool)
        browser.until(lambda expected=expected: np.abs(browser.pose("/tool") - expected).max() < 1e-6)
        for number, T in enumerate(link_frames(arm.model, there.joints)):
            np.testing.assert_allclose(browser.pose(link_node("/robot", number)), matrix(T), atol=1e-6)
    assert not browser.errors()

    first = browser.driver.current_window_handle
    browser.another()
    browser.size(320, 240)
    browser.open(app.address, "/tool")
    browser.until(lambda: len(app.windows) == 2)
    window.change(Playback.toggle)
    browser.until_page("document.body.textContent.includes('playing, 1 x')")  # what is told of time comes last
    browser.driver.find_element("tag name", "body").send_keys(" ")
    browser.until(lambda: [window.playback.playing for window in app.windows].count(False) == 1)
    browser.back(first)
    browser.driver.close()
    browser.until(lambda: len(app.windows) == 1)
    assert app.windows[0].playback.playing is False
