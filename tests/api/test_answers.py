"""Test a scene in a notebook: the whole page plays below the cell."""

from __future__ import annotations

from html import unescape
from pathlib import Path

import pytest

import vrs_cli as vrs
from tests.page.browser import needs_chromium, page_folder, running_chromium, until, window
from vrs_cli.render import pictures

CELL = Path(__file__).parents[2] / "programs" / "pick_and_place.toml"
MOST = 2_000_000  # [bytes] that a short lesson's scene adds to a notebook


@pytest.fixture(autouse=True, scope="module")
def built() -> None:
    page_folder()


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


def test_without_the_page_it_is_said_how_to_build_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(pictures, "BUILT_PAGE", tmp_path)
    pictures._page_code.cache_clear()
    try:
        with pytest.raises(vrs.UsageError, match="the page of the browser is not built"):
            moved().view()
    finally:
        pictures._page_code.cache_clear()


@pytest.mark.long
@needs_chromium
def test_a_notebook_plays_it_below_the_cell(tmp_path: Path) -> None:
    formatters = pytest.importorskip("IPython.core.formatters")
    output, _ = formatters.DisplayFormatter().format(moved().view(height=240))  # what a kernel gives a notebook
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f"<!doctype html><body>{output['text/html']}", encoding="utf-8")
    with running_chromium() as browser, window(browser, size=(640, 300)) as page:
        page.goto(notebook.as_uri())
        frame = page.frames[1]
        until(frame, "window.scene && scene.stage.pictures > 0 && app.playback.time > 0.1")
        assert frame.evaluate("scene.stage.height") > 60


def test_a_script_opens_it_in_a_browser(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    opened: list[str] = []
    monkeypatch.setattr("vrs_cli.api.answers.webbrowser.open", opened.append)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    path = vrs.Robot().move(10, -90, 90, 0, 0, 0).view().open()
    assert opened == [path.as_uri()]
    assert path.read_text().startswith("<!doctype html>")
