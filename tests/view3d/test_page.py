"""A page plays a trajectory offline: small, the same each time, its links where g says."""

from __future__ import annotations

import base64
from math import floor
from pathlib import Path

import numpy as np
import pytest
import zstandard

import vrs_cli as product
from tests.view3d.browser import Browser, changed, needs_browser
from vrs_cli.engine.position import position_at
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import link_frames
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.render.browser import PictureError
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.figure import link_node
from vrs_cli.view3d.paths import Around
from vrs_cli.view3d.studio import MOST_FRAMES, RATE, frame_times, page, stretches, usual_rate

PROGRAMS = Path(__file__).parents[2] / "programs"
BASE_SIZE, A_MINUTE = 1_000_000, 1_000_000  # [bytes] that a page may have
ARM = arm_for(load_robot("puma560"))


def ran(program: str) -> product.Robot:
    robot = product.Robot()
    robot.run(PROGRAMS / program)
    return robot


def page_of(robot: product.Robot) -> str:
    return page(ARM, robot.timeline, usual_rate(robot.timeline))


def test_a_page_is_small_and_the_same_each_time() -> None:
    robot = ran("pick_and_place.v2")
    made = page_of(robot)
    assert len(made) < BASE_SIZE + A_MINUTE * robot.timeline.end / 60.0
    assert made == page_of(robot)


def test_a_page_has_the_robot_in_its_title_and_leaves_standard_output_alone(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert f"<title>{ARM.model.title}</title>" in page_of(ran("hello.v2"))
    assert capsys.readouterr() == ("", "")


def waits_and_moves() -> Timeline:
    robot = product.Robot()
    for line in ("DO DELAY 3", "DRIVE 1, 40, 50", "DRIVE 1, -20, 50 AT 60"):
        robot.do(line)
    return robot.timeline


def test_frames_are_taken_while_the_robot_moves() -> None:
    timeline = waits_and_moves()
    parts = stretches(timeline)
    assert [moves for _, _, moves in parts] == [False, True, False, True]
    assert [first for first, _, _ in parts[1:]] == [last for _, last, _ in parts[:-1]]
    times = list(frame_times(timeline, RATE))
    assert times == sorted(set(times))
    assert times[0] == timeline.start
    assert times[-1] == timeline.end
    for first, last, moves in parts:
        gaps = np.diff([t for t in times if first <= t <= last])
        assert gaps.max() <= (1.0 / RATE if moves else 1.0) + 1e-9
    assert len(times) < 60 + RATE * sum(last - first for first, last, moves in parts if moves) + 10


def test_a_long_trajectory_has_fewer_frames_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    timeline = ran("pick_and_place.v2").timeline
    assert usual_rate(timeline) == RATE
    monkeypatch.setattr("vrs_cli.view3d.studio.MOST_FRAMES", 20)
    assert len(list(frame_times(timeline, usual_rate(timeline)))) <= 20 + len(timeline)


def nodes_of(html: str) -> str:
    """What a page records, as text: the names of its nodes are in it."""
    data = html.partition('__VISER_EMBED_DATA__="')[2].partition('"')[0]
    return zstandard.ZstdDecompressor().decompress(base64.b64decode(data)[8:]).decode("latin-1")


def test_the_way_of_many_segments_is_shown_around_the_present(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = ran("pick_and_place.v2")
    all_of_it = nodes_of(page_of(robot))
    monkeypatch.setattr("vrs_cli.view3d.studio.MOST_SEGMENTS", len(robot.timeline) - 1)
    monkeypatch.setattr("vrs_cli.view3d.studio.NEAR", Around(0.1, 0.1, 0.2))
    near = nodes_of(page_of(robot))
    assert near.count("/path/lines") > all_of_it.count("/path/lines"), "another part of it, again and again"
    assert len(near) < len(all_of_it)


def test_more_frames_than_a_page_holds_are_refused() -> None:
    timeline = ran("hello.v2").timeline
    with pytest.raises(PictureError, match=r"more than a page holds \(without --rate there are 30 a second\)"):
        page(ARM, timeline, 3 * MOST_FRAMES / timeline.end)


# --- in a browser ---------------------------------------------------------------------------------------------------


@needs_browser
def test_a_page_plays_offline(browser: Browser, tmp_path: Path) -> None:
    """Opened by double click: without a server, and without any request."""
    robot = ran("pick_and_place.v2")
    path = tmp_path / "pick and place.html"
    path.write_text(page_of(robot), encoding="utf-8")
    browser.size(320, 240)
    browser.open(path.as_uri(), link_node("/robot", 6), "/caption")
    it_plays_by_itself(browser)
    it_stops_and_goes_on(browser)
    the_links_are_where_g_says_wherever_one_goes(browser, robot)
    assert browser.errors() == ()


def seek(browser: Browser, t: float) -> None:
    """Type a time into the bar under the picture, which stops there."""
    browser.run(
        """
        const field = document.querySelector('input'), set =
            Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set;
        set.call(field, arguments[0]);
        field.dispatchEvent(new Event('input', {bubbles: true}));""",
        f"{t:.3f}",
    )
    browser.until(lambda: abs(float(browser.run("return document.querySelector('input').value")) - t) < 0.06)
    browser.drawn()


def it_plays_by_itself(browser: Browser) -> None:
    before, place = browser.canvas(), browser.pose(link_node("/robot", 3))
    browser.until(lambda: bool(np.abs(browser.pose(link_node("/robot", 3)) - place).max() > 0.05))
    browser.until(lambda: changed(before, browser.canvas()) > 0.005)


def it_stops_and_goes_on(browser: Browser) -> None:
    press_space(browser)
    browser.drawn()
    place = browser.pose(link_node("/robot", 3))
    browser.drawn(4)
    np.testing.assert_array_equal(browser.pose(link_node("/robot", 3)), place)
    press_space(browser)
    browser.until(lambda: bool(np.abs(browser.pose(link_node("/robot", 3)) - place).max() > 1e-3))


def press_space(browser: Browser) -> None:
    browser.run("window.dispatchEvent(new KeyboardEvent('keydown', {code: 'Space'}))")


def the_links_are_where_g_says_wherever_one_goes(browser: Browser, robot: product.Robot) -> None:
    times = list(frame_times(robot.timeline, RATE))
    for t in (times[100], times[10], times[-1]):
        seek(browser, t + 0.001)
        shown = max(time for time in times if time <= t + 0.001)
        for i, T in enumerate(link_frames(ARM.model, position_at(ARM, robot.timeline, shown).joints)):
            np.testing.assert_allclose(browser.pose(link_node("/robot", i))[:3], np.array(T).reshape(3, 4), atol=1e-6)
        caption = browser.run("return __viserSceneTree.getState()['/caption'].message.props.text")
        assert caption.startswith(f"{floor(10 * shown + 1e-6) / 10:.1f} s")
