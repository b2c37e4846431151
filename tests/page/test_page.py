"""Test that the page shows the robot of a server."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.net.serving import Serving
from tests.page.browser import changed, drawn, line, picture, until
from vrs_cli.net.messages import Embody, Hello, Measured
from vrs_cli.values.measured import DivergenceAlarm, DivergenceCause

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


@pytest.mark.long
def test_the_way_is_blue_behind_the_tool_and_orange_before_it(shown: Page) -> None:
    line(shown, "DRIVE 3, -60")
    line(shown, "DRIVE 1, 60")
    shown.evaluate("for (const layer of scene.layers) layer.set(layer.name === 'path')")
    for share, colours in ((0.0, {"planned"}), (0.5, {"past", "planned"}), (1.0, {"past"})):
        before = shown.evaluate("scene.stage.pictures")
        shown.evaluate("share => app.playback.seek(share * app.source.timeline.end)", share)
        until(shown, "scene.stage.pictures > x", before)
        seen = {tuple(colour) for colour in picture(shown).reshape(-1, 3)}
        inks = shown.evaluate("({ past: scene.stage.colours.past, planned: scene.stage.colours.planned })")
        assert {name for name, ink in inks.items() if tuple(bytes.fromhex(ink[1:])) in seen} == colours


@pytest.mark.long
def test_a_reload_shows_the_robot_again(shown: Page) -> None:
    shown.reload()
    drawn(shown)
    assert shown.title() == "cell1"


@pytest.mark.long
def test_the_measured_arm_is_beside_the_virtual_one(shown: Page, served: Serving) -> None:
    """Joint 1 stands still while it should turn."""
    line(shown, "DRIVE 1, 60")
    line(shown, "DELAY 1")
    body = shown.locator("section.body")
    assert body.is_hidden()
    before = picture(shown)
    session = served.hub.rooms["cell1"].session
    timeline = session.engine.timeline
    times = tuple(0.1 * i for i in range(int(10 * timeline.end)))
    start = session.engine.model.poses["ready"]
    with served.call(hello=Hello((1,), name="arm")) as arm:
        arm.ask(Embody)
        arm.protocol.send(Measured(first=0, times=times, joints=(start,) * len(times), sent=0.0))
        arm.flush()
        shown.evaluate("app.playback.follow()")
        body.get_by_text("60.00").wait_for()
        assert "arm follows" in body.inner_text()
        assert changed(before, picture(shown)) > 0.005
        session.body.tell(DivergenceAlarm(1.0, 1, 0.5, 0.2, DivergenceCause.BLOCKED, "joint 1 stands still", 0.2))
        body.get_by_role("alert").get_by_text("JT1: likely cause: blocked joint; joint 1 stands still").wait_for()
        body.get_by_role("button", name="Look").click()
        until(shown, "!app.playback.following && Math.abs(app.playback.time - 0.2) < 1e-6")
        assert body.get_by_role("button", name="RESYNC", exact=True).is_enabled()
        body.get_by_role("button", name="Close").click()
        body.get_by_role("alert").wait_for(state="hidden")
