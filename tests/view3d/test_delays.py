"""A robot behind a line with delays in the browser: where it is and will be, what was wrong, what nobody has said."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import dist, inf, radians
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser
from msgspec.structs import replace

import vrs_cli as vrs
from tests.examples import only_in_full
from tests.live import until
from tests.net.serving import serving
from tests.net.test_delayed_robot import behind
from tests.view3d.browser import Browser, coloured, needs_browser
from tests.view3d.pages import Page
from tests.view3d.test_figure import matrix
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import Watched, joints_at, position_at
from vrs_cli.interfaces.port.preview import Expected, Previewed
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.kinematics.model import link_frames
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import position
from vrs_cli.net.client import hello_of
from vrs_cli.net.far_end import Ahead
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.values.commands import Move, Stamp
from vrs_cli.values.motion import JointTarget
from vrs_cli.view3d.app import App
from vrs_cli.view3d.bar import FLAGGED
from vrs_cli.view3d.figure import link_node
from vrs_cli.view3d.ghosts import ERROR, HEARD, PRESENT, DelayPanel
from vrs_cli.view3d.parts import Shown

VISIBLE = "(__viserSceneTree.getState()[arguments[0]] ?? {visibility: false}).visibility !== false"
MODEL = load_robot("puma560")
READY = MODEL.poses["ready"]


class Looking:
    """A window at a robot that goes to and fro, without a browser; what is known of it is what a test says."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.engine = Engine(MODEL)
        for k in range(4):
            target = JointTarget((radians(40.0 * (-1) ** k), *READY[1:]))
            self.engine.perform(Move(target, False, stamp=Stamp(1.0 + 2.0 * k), text=f"MOVE {k}"))
        timeline = self.engine.timeline
        self.playback = Playback.following(timeline.start, timeline.end, 0.0, 0.0)
        self.seconds, self.node = 0.0, server.scene.get_handle_by_name
        self.robot: Any = SimpleNamespace(far=SimpleNamespace(ahead=Ahead.AUTO, near=False))
        window: Any = SimpleNamespace(
            client=server,
            watched=self.engine,
            playback=self.playback,
            wall=lambda: self.seconds,
            doing=lambda act: lambda _event: act(),
            again=lambda: None,
            width=1000.0,
        )
        self.window = window
        self.delays = DelayPanel(window, self.robot)
        self.seen = Previewed(timeline, 1.25, 1.0, 1.5, 1.5, predicts=True, round_trip=0.5)

    def show(self, **changes: Any) -> None:
        """What is known now: it is as before, but for these."""
        self.seen = replace(self.seen, **changes)
        self.seconds += 0.4
        arm, seen = self.engine.arm, self.seen
        at = position_at(arm, seen.timeline, seen.reported)
        self.delays.show(Shown(arm, seen.timeline, seen.reported, at, seen.reported, seen=seen))

    def lines(self, name: str) -> np.ndarray:
        """(N, 2, 3): what is seen of them."""
        node = self.node(name)
        return np.array(node.points) if node.visible else np.zeros((0, 2, 3))

    def told(self) -> str:
        panel = self.delays._told
        return "" if panel is None else re.sub("<[^>]*>", " ", panel.content)


@pytest.fixture
def looking(server: viser.ViserServer) -> Looking:
    server.scene.reset()
    return Looking(server)


def test_the_robot_that_is_predicted_stands_where_it_will_be(looking: Looking) -> None:
    looking.show(heard=1.0, shown=1.5)
    joints = joints_at(looking.engine.arm, looking.seen.timeline, 1.5)
    drawn = np.eye(4)
    for i, T in enumerate(link_frames(MODEL, joints)):
        drawn = drawn @ np.vstack([matrix(looking.node(link_node("/predicted", i))), (0.0, 0.0, 0.0, 1.0)])
        assert np.abs(drawn[:3] - np.array(T).reshape(3, 4)).max() < 1e-7
    assert looking.node("/predicted").visible


def test_one_robot_is_shown_where_both_are_in_one_place(looking: Looking) -> None:
    looking.show(heard=1.0, shown=1.5)
    looking.show(heard=30.0, shown=30.5)
    assert not looking.node("/predicted").visible, "it would tint the other"
    looking.show(heard=1.0, shown=1.5)
    assert looking.node("/predicted").visible
    looking.window.playback = looking.playback.pause(0.0)
    looking.show()
    assert not looking.node("/predicted").visible, "who looks back is shown what was"


def test_without_a_prediction_there_is_no_second_robot(looking: Looking) -> None:
    looking.show(predicts=False, shown=1.25)
    assert looking.node("/predicted") is None


def test_what_is_not_confirmed_and_what_was_wrong_have_their_colours(looking: Looking) -> None:
    arm, timeline = looking.engine.arm, looking.seen.timeline

    def tip(t: float) -> tuple[float, ...]:
        return position(position_at(arm, timeline, t).T_world_tool)

    windows = ((1.1, 1.2), (3.1, 3.25))
    looking.show(unconfirmed=5.1, flagged=windows, expected=(Expected(1, "MOVE 2", 1.0, 5.1),))
    for name, spans in (("/unconfirmed", ((5.1, timeline.end),)), ("/flagged", windows)):
        points = looking.lines(name).reshape(-1, 3)
        ends = [tip(t) for span in spans for t in span]
        assert all(min(dist(end, p) for p in points) < 1e-6 for end in ends), "it begins and ends when they do"
        way = [tip(t) for first, last in spans for t in np.linspace(first, last, 400)]
        assert max(min(dist(p, q) for q in way) for p in points) < 4.0 * ERROR, "it is where the tool goes"
    looking.show(unconfirmed=inf, flagged=())
    assert not looking.node("/unconfirmed").visible
    assert not looking.node("/flagged").visible


def test_what_has_not_changed_is_not_sent_again(looking: Looking) -> None:
    looking.show(unconfirmed=5.1)
    drawn = looking.node("/unconfirmed").points
    looking.show()
    assert looking.node("/unconfirmed").points is drawn
    looking.show(unconfirmed=5.5)
    assert looking.node("/unconfirmed").points is not drawn


def test_a_near_robot_has_no_panel_of_delays(looking: Looking) -> None:
    looking.robot.far.near = True
    looking.show(predicts=False, round_trip=0.3)
    assert looking.told() == ""
    looking.robot.far.near = False
    looking.show()
    assert looking.told().split() == ["D_f", "+", "D_b:", "300", "ms"]
    looking.show(
        predicts=True,
        unconfirmed=9.0,
        flagged=((0.5, 0.75),),
        expected=(Expected(1, "MOVE <a>", 1.0, 9.0),),
    )
    told = looking.told()
    assert "heard: 1.00 s" in told
    assert "predicted: 1.50 s" in told
    assert "flagged: 0.500 to 0.750 s was shown before a command changed it" in told
    assert told.count("unconfirmed from 9.000 s on: MOVE &lt;a&gt;") == 1


# --- over a line ----------------------------------------------------------------------------------------------------


def held(address: str, ahead: float | Ahead) -> Callable[[object], Watched]:
    def hold(_told: object) -> Watched:
        robot = SocketPort.connect(address, hello_of(name="browser"))
        robot.far.ahead = ahead
        return robot

    return hold


@contextmanager
def looked_at(folder: Path, delay: float, ahead: float | Ahead) -> Iterator[tuple[vrs.Robot, App]]:
    """A robot that somebody near moves, and who looks at it is so far away [s], each way."""
    with (
        serving(folder, realtime=1.0, journal=False) as served,
        vrs.connect(served.address) as near,
        behind(served, delay, delay) as far,
    ):
        app = App(held(far.address, ahead))
        try:
            yield near, app
        finally:
            app.close()


def test_over_a_line_both_robots_are_shown_and_the_user_chooses(tmp_path: Path) -> None:
    with looked_at(tmp_path, 0.1, Ahead.PRESENT) as (near, app), Page(app.address) as page:
        choice = page.gui("GuiDropdownMessage", label="The robot is shown")
        assert choice["value"] == PRESENT
        page.set(choice["uuid"], HEARD)
        until(lambda: app.windows[0].robot.far.ahead is Ahead.AUTO)  # type: ignore[union-attr]
        near.move(60, -90, 90, 0, 0, 0, at=near.now + 0.5)
        page.until(lambda: any(it.get("name") == link_node("/predicted", 1) for it in page.told))
        assert not [text for text in page.said() if "Internal" in text]


@needs_browser
@only_in_full()  # what is told to a page is looked at above, and what a page does with it in test_view.py
def test_in_a_browser(tmp_path: Path, browser: Browser) -> None:
    """Somebody else commands, 0.6 s away each way: the prediction goes first, and what was wrong is red."""
    with looked_at(tmp_path, 0.6, Ahead.AUTO) as (near, app):
        browser.open(app.address, "/robot")
        for turn in (150, -150, 150, -150):  # it moves for minutes: a page is slow where many work
            near.move(turn, -60, 60, 0, 30, 0, speed=2)
        browser.until_page(f"{VISIBLE} && {VISIBLE.replace('[0]', '[1]')}", "/predicted", "/flagged")
        browser.until(lambda: coloured(browser.canvas(), FLAGGED) > 0.0)
        robot, predicted = (browser.pose(link_node(root, 1)) for root in ("/robot", "/predicted"))
        assert np.abs(robot - predicted).max() > 1e-3
        near.abort()
        browser.until_page(f"!({VISIBLE})", "/predicted")
        assert browser.errors() == ()
