"""A scene in a notebook: the whole page below the cell, which plays there."""

from __future__ import annotations

from html import unescape
from pathlib import Path

import numpy as np
import pytest

import vrs_cli as vrs
from tests.examples import only_in_full
from tests.view3d.browser import Browser, needs_browser
from vrs_cli.view3d import needs
from vrs_cli.view3d.figure import link_node

CELL = Path(__file__).parents[2] / "programs" / "pick_and_place.toml"
MOST = 2_000_000  # [bytes] that a short lesson's scene adds to a notebook


@pytest.fixture(autouse=True)
def viser() -> None:
    pytest.importorskip("viser")


def moved() -> vrs.Robot:
    robot = vrs.Robot()
    robot.do("DRIVE 1, 60, 50")
    return robot


def test_a_scene_is_a_frame_with_the_whole_page_in_it(tmp_path: Path) -> None:
    scene = moved().view(height=300)
    shown = scene._repr_html_()
    assert shown.startswith('<iframe srcdoc="')
    assert 'height="300"' in shown
    assert unescape(shown.split('"')[1]) == scene.html
    assert len(shown) < MOST
    scene.save(tmp_path / "a.html")
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == scene.html


def test_another_timeline_of_the_robot_is_shown_as_well() -> None:
    robot = moved()
    before = robot.timeline
    robot.do("DRIVE 2, 20, 50")
    assert repr(robot.view(before)) == f"<Scene of puma560: 0.000 to {before.end:.3f} s; .open() shows it in a browser>"
    assert robot.view(before).html == moved().view().html != robot.view().html


def test_the_cell_of_the_robot_is_around_it() -> None:
    stands, bare = vrs.Robot(cell=CELL), vrs.Robot()
    for robot in (stands, bare):
        robot.do("DRIVE 1, 10")
    assert len(bare.view().html) < len(stands.view().html) == len(bare.view(cell=CELL).html)


def test_without_viser_it_is_said_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(needs, "find_spec", lambda _: None)
    with pytest.raises(vrs.UsageError, match=r"needs viser, which is not installed .*install viser"):
        moved().view()


@needs_browser
@only_in_full()  # a page plays in tests/view3d/test_page.py, and its whole text is in the frame
def test_a_notebook_plays_it_below_the_cell(tmp_path: Path, browser: Browser) -> None:
    formatters = pytest.importorskip("IPython.core.formatters")
    output, _ = formatters.DisplayFormatter().format(moved().view(height=240))  # what a kernel gives a notebook
    page = tmp_path / "notebook.html"
    page.write_text(f"<!doctype html><body>{output['text/html']}", encoding="utf-8")
    browser.size(320, 260)
    browser.open(page.as_uri())
    browser.driver.switch_to.frame(0)
    browser.has(link_node("/robot", 6), "/caption")
    place = browser.pose(link_node("/robot", 3))
    browser.until(lambda: bool(np.abs(browser.pose(link_node("/robot", 3)) - place).max() > 0.05))
    assert np.ptp(browser.canvas()) > 100
    assert browser.errors() == ()


def test_a_script_opens_it_in_a_browser(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    opened: list[str] = []
    monkeypatch.setattr("vrs_cli.api.answers.webbrowser.open", opened.append)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    path = vrs.Robot().move(10, -90, 90, 0, 0, 0).view().open()
    assert opened == [path.as_uri()]
    assert path.read_text().startswith("<!doctype html>")
