"""Test the HTML file of a trajectory: equal bytes, no requests, and no scripts but its own."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path

import pytest

import vrs_cli as vrs
from tests.page.browser import needs_chromium, page_folder, running_chromium, until, window
from vrs_cli.engine.position import joints_at, position_at
from vrs_cli.files.cell_file import read_cell
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.page_data import moments, recorded_page
from vrs_cli.net.page_data import robot as shown_robot
from vrs_cli.render import pictures
from vrs_cli.render.pictures import PageError, in_script, page, replay, viewer

ARM = arm_for(load_robot("puma560"))
CELL = Path(__file__).parents[2] / "programs" / "pick_and_place.toml"
HOSTILE = (
    "</script><script>alert(1)</script>",
    "<!--<script>",
    '"><img src=x onerror=alert(1)>',
    "]]>\u2028\u2029\\u003c/script>",
    "<svg onload=alert(1)>",
    "{{constructor}}",
)


@pytest.fixture(autouse=True, scope="module")
def built() -> None:
    page_folder()


def moved() -> vrs.Robot:
    robot = vrs.Robot()
    robot.move(0, -45, 180, 0, 45, 0)
    robot.do("HERE part")
    robot.move(30, -60, 150, 0, 30, 0).do("MOVES part")
    return robot


class Scripts(HTMLParser):
    """Parses a page: its scripts, and the attributes of all elements."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[dict[str, str | None], str]] = []
        self.attributes: list[str] = []
        self._open: dict[str, str | None] | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [name for name, _ in attrs]
        self._open = dict(attrs) if tag == "script" else None

    def handle_data(self, data: str) -> None:
        if self._open is not None:
            self.found.append((self._open, data))

    def handle_endtag(self, _tag: str) -> None:
        self._open = None


def scripts_of(text: str) -> tuple[dict[str, object], str, list[str]]:
    """Return the data of a page, its script, and the names of its attributes."""
    parser = Scripts()
    parser.feed(text)
    (data_kind, data), (script_kind, script) = parser.found
    assert data_kind == {"type": "application/json", "id": data_kind["id"]}
    assert script_kind == {}
    return json.loads(data), script, parser.attributes


def test_a_page_is_the_same_each_time_and_small() -> None:
    first, second = (page(recorded_page(ARM, moved().timeline, title="a")) for _ in range(2))
    assert first == second
    assert len(first) < 1_500_000
    assert first.isascii(), "it is the same in any encoding"


def test_its_policy_allows_its_script_alone() -> None:
    text = page(recorded_page(ARM, moved().timeline, title="a"))
    _, script, _ = scripts_of(text)
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    assert f"script-src 'sha256-{b64encode(sha256(script.encode()).digest()).decode()}';" in policy[1]
    assert "default-src 'none'" in policy[1]
    assert "http" not in policy[1]


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_stay_text(name: str) -> None:
    robot = moved()
    text = page(recorded_page(ARM, robot.timeline, title=name))
    data, _, attributes = scripts_of(text)
    assert data["title"] == name
    assert not [one for one in attributes if one.startswith("on")]
    assert json.loads(in_script({"a": name})) == {"a": name}


def test_places_that_motions_name_are_in_it() -> None:
    robot = moved()
    (place,) = recorded_page(ARM, robot.timeline, title="a")["places"]
    assert place["name"] == "part"
    assert tuple(place["pose"]) == position_at(ARM, robot.timeline, robot.end).T_world_tool


def test_a_cell_comes_with_the_course_of_its_parts() -> None:
    robot = moved()
    data = recorded_page(ARM, robot.timeline, cell=read_cell(str(CELL)))
    assert data["cell"] is not None
    assert set(data["world"]["rows"]["parts"]) == {"box"}


def test_where_the_page_is_not_built_the_command_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(pictures, "BUILT_PAGE", tmp_path)
    pictures._page_code.cache_clear()
    try:
        with pytest.raises(PageError, match=r"not built.*hatch_build"):
            pictures.check_page()
    finally:
        pictures._page_code.cache_clear()


@needs_chromium
def test_it_plays_from_a_file(tmp_path: Path) -> None:
    robot = moved()
    file = tmp_path / f"{HOSTILE[2].replace('/', '')}.html"
    file.write_text(page(recorded_page(ARM, robot.timeline, title=HOSTILE[0])), encoding="utf-8")
    with running_chromium() as browser, window(browser, size=(900, 700)) as shown:
        shown.goto(file.as_uri())
        until(shown, "window.scene && scene.stage.pictures > 0")
        assert shown.title() == HOSTILE[0]
        t = 0.7 * robot.end
        shown.evaluate("t => { app.playback.pause(); app.playback.seek(t) }", t)
        until(shown, "app.playback.time === x", t)
        found = shown.evaluate("new Promise((done) => app.add({ show: ({ t, q }) => done([t, q]) }))")
        assert found[0] == t
        assert found[1] == pytest.approx(joints_at(ARM, robot.timeline, t), abs=1e-9)


@pytest.mark.long
@needs_chromium
def test_a_viewer_plays_what_lies_beside_it_and_nothing_else(tmp_path: Path) -> None:
    robot = moved()
    between = (0.25 * robot.end, 0.75 * robot.end)
    (tmp_path / "replays").mkdir()
    (tmp_path / "viewer.html").write_text(viewer(shown_robot(ARM)), encoding="utf-8")
    (tmp_path / "elsewhere.js").write_text("document.title = 'obeyed'\n", encoding="utf-8")
    for name, title in (("ann", HOSTILE[0]), ("bob", "Bob")):
        shown = moments(ARM, robot.timeline, title=title, between=between)
        (tmp_path / "replays" / f"{name}.js").write_text(replay(shown), encoding="utf-8")
    address = (tmp_path / "viewer.html").as_uri()
    with running_chromium() as browser:
        for name, title in (("ann", HOSTILE[0]), ("bob", "Bob")):
            with window(browser, size=(600, 500)) as seen:
                seen.goto(f"{address}#{name}")
                until(seen, "window.scene && scene.stage.pictures > 0")
                assert seen.title() == title
                assert seen.evaluate("[app.playback.begin, app.playback.end]") == list(between)
        for name in ("../elsewhere", "..%2felsewhere", "%22%3E%3Cscript%3E", ""):
            with window(browser, size=(600, 500)) as seen:
                seen.goto(f"{address}#{name}")
                seen.evaluate("new Promise((done) => setTimeout(done))")
                assert seen.title() == "Unimation PUMA 560"
                assert seen.locator("script[src]").count() == 0
