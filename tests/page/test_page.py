"""The page shows the robot that a server has."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.page.browser import changed, drawn, line, picture, until

if TYPE_CHECKING:
    from playwright.sync_api import Page


def test_the_arm_is_drawn_and_moves(shown: Page) -> None:
    assert shown.title() == "cell1"
    before = picture(shown)
    assert len({tuple(colour) for colour in before.reshape(-1, 3)[::7]}) > 20, "a picture has many colours"
    line(shown, "DRIVE 1, 60")
    shown.evaluate("app.playback.follow()")
    until(shown, "app.playback.time >= app.source.timeline.end")
    drawn_before = shown.evaluate("scene.stage.pictures")
    shown.evaluate("scene.stage.change()")
    until(shown, "scene.stage.pictures > x", drawn_before)
    assert changed(before, picture(shown)) > 0.005


def test_a_reload_shows_the_robot_again(shown: Page) -> None:
    shown.reload()
    drawn(shown)
    assert shown.title() == "cell1"
