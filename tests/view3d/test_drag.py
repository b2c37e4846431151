"""The gizmo, over the wire as a page has it, and in a real browser with a real mouse."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from tests.live import until
from tests.view3d.browser import Browser, needs_browser
from tests.view3d.pages import Page
from vrs_cli.engine.position import position_at
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.kinematics.transform import (
    Transform,
    at_position,
    compose,
    distance,
    dot,
    length,
    position,
    subtracted,
    translation,
    unit_quaternion,
)
from vrs_cli.view3d.app import App
from vrs_cli.view3d.panel_hand import END, RECORD, Gizmo
from vrs_cli.view3d.window import RobotWindow


@contextmanager
def opened(app: App) -> Iterator[Page]:
    """A page that goes as a browser that is killed: who does not listen could not say goodbye."""
    page = Page(app.address)
    yield page
    page._socket.close_socket()


def window(app: App, number: int = 0) -> RobotWindow:
    until(lambda: len(app.windows) > number)
    return app.windows[number]


def gizmo(app: App, number: int = 0) -> Gizmo:
    (found,) = (part for part in window(app, number).parts if isinstance(part, Gizmo))
    return found


def tool(app: App) -> Transform:
    watched = window(app).watched
    return position_at(watched.arm, watched.timeline, watched.now).T_world_tool


class Dragged:
    """The gizmo of a page, in a hand."""

    def __init__(self, page: Page) -> None:
        self.page = page
        there = page.until(lambda: next(iter(page.of("TransformControlsMessage")), None))
        page.until(lambda: any(one["name"] == "/drag" for one in page.of("SetPositionMessage")))
        self._its = {"name": "/drag", "owner": there.get("owner", "")}

    def take(self) -> None:
        self.page._send({"type": "TransformControlsDragStartMessage", **self._its})

    def to(self, T: Transform) -> None:
        at = {"wxyz": unit_quaternion(T), "position": (T.px, T.py, T.pz)}
        self.page._send({"type": "TransformControlsUpdateMessage", **self._its, **at})

    def let_go(self) -> None:
        self.page._send({"type": "TransformControlsDragEndMessage", **self._its})


def test_the_arm_follows_what_is_dragged_and_rests_when_it_is_let_go(app: App) -> None:
    with opened(app) as page:
        hand, begin = Dragged(page), tool(app)
        wish = at_position(begin, begin.px - 0.1, begin.py, begin.pz - 0.1)
        hand.take()
        hand.to(begin)
        hand.to(wish)
        until(lambda: gizmo(app).pulled.by == "browser")
        until(lambda: distance(tool(app), wish) < 1e-4)
        hand.let_go()
        until(lambda: gizmo(app).pulled.by == "")
        assert len([one for one in window(app).watched.timeline if one.motion.text == "DRAG"]) > 5


def test_what_holds_it_is_written_at_the_tool_and_its_joint_is_lit(app: App) -> None:
    with opened(app) as page:
        hand, begin = Dragged(page), tool(app)
        hand.take()
        hand.to(at_position(begin, begin.px - 2.0, begin.py, begin.pz - 1.0))
        until(lambda: "out of reach: too far" in gizmo(app).label.text)
        assert gizmo(app).label.visible
        assert "mm away" in gizmo(app).why.content
        hand.to(begin)
        until(lambda: not gizmo(app).label.visible)
        hand.let_go()


def test_a_page_that_is_gone_lets_go(app: App) -> None:
    with opened(app) as page:
        other = Page(app.address)
        hand, begin = Dragged(other), tool(app)
        hand.take()
        for k in range(5):
            hand.to(at_position(begin, begin.px - 0.05 * k, begin.py, begin.pz - 0.05 * k))
        until(lambda: gizmo(app).pulled.by)
        other._socket.close_socket()
        until(lambda: gizmo(app).pulled.by == "")
        watched = window(app).watched
        until(lambda: watched.timeline.end < watched.now)
        assert not page.said()


def test_a_drag_becomes_a_program_and_a_place_a_name(app: App) -> None:
    with opened(app) as page:
        hand, begin = Dragged(page), tool(app)
        page.set(page.gui("GuiTextMessage", label="Name")["uuid"], "mine")
        record = page.gui("GuiButtonMessage", label=RECORD)["uuid"]
        page.set(record, True)
        until(lambda: gizmo(app).record.label == END)
        hand.take()
        for k in range(1, 41):
            hand.to(at_position(begin, begin.px - 0.004 * k, begin.py, begin.pz - 0.004 * k))
            time.sleep(0.01)
        hand.let_go()
        watched = window(app).watched
        until(lambda: gizmo(app).pulled.by == "" and watched.timeline.end < watched.now)
        page.set(page.gui("GuiButtonMessage", label="HERE")["uuid"], True)
        page.set(record, True)

        def kept() -> bool:
            robot = Supervisor(window(app).robot)
            said = robot.say("DIRECTORY", lambda _: None), robot.say("LISTL", lambda _: None)
            return "mine" in str(said[0]) and "mine" in str(said[1])

        until(kept)


def test_the_gizmo_turns_about_its_own_place(app: App) -> None:
    """Along the axes of the world too: what is dragged is the tool, as it was taken."""
    with opened(app) as page:
        hand = Dragged(page)
        page.set(page.gui("GuiButtonGroupMessage", label="Axes")["uuid"], "World")
        until(lambda: abs(gizmo(app).node.wxyz[0]) > 1.0 - 1e-6)
        begin = tool(app)
        hand.take()
        hand.to(translation(begin.px - 0.05, begin.py, begin.pz - 0.05))
        wish = at_position(begin, begin.px - 0.05, begin.py, begin.pz - 0.05)
        until(lambda: max(abs(a - b) for a, b in zip(tool(app), wish, strict=True)) < 1e-4)
        hand.let_go()


def test_of_two_pages_one_drags_and_both_see_what_holds_it(app: App) -> None:
    with opened(app) as page:
        hand = Dragged(page)
        with opened(app):
            other, begin = gizmo(app, 1), tool(app)
            until(lambda: other.node.visible)
            hand.take()
            hand.to(at_position(begin, begin.px - 2.0, begin.py, begin.pz - 1.0))
            until(lambda: "too far" in other.label.text)
            until(lambda: not other.node.visible)
            hand.to(begin)
            until(lambda: "Somebody else drags" in other.why.content)
            hand.let_go()
            until(lambda: not other.pulled.by)


@needs_browser
def test_a_mouse_drags_the_tool_in_a_real_browser(app: App, browser: Browser) -> None:
    from selenium.webdriver.common.action_chains import ActionChains

    browser.size(900, 420)
    browser.open(app.address, "/drag", "/robot")
    robot = Supervisor(window(app).robot)
    robot.say("MOVE #PPOINT(-30, -130, 40, 10, 60, 20)", lambda _: None)
    until(lambda: robot.timeline.end < robot.now)
    begin = tool(app)
    browser.until(lambda: distance(_drawn(browser), begin) < 1e-6)
    handle = compose(begin, translation(0.0, 0.75 * gizmo(app).node.scale, 0.0))  # on the arrow of Y
    (row, column), (far_row, far_column) = (
        browser.pixel(*position(T)) for T in (handle, compose(handle, translation(0.0, 0.15, 0.0)))
    )
    canvas = browser.run("return __viserMutable.canvas")
    width, height = canvas.size["width"], canvas.size["height"]
    mouse = ActionChains(browser.driver, duration=20)
    mouse.move_to_element_with_offset(canvas, int(column - width / 2), int(row - height / 2)).pause(0.5)
    mouse.click_and_hold().pause(0.2)
    for _ in range(8):
        mouse.move_by_offset(round((far_column - column) / 8), round((far_row - row) / 8)).pause(0.05)
    mouse.perform()
    until(lambda: gizmo(app).pulled.by == "browser")
    until(lambda: distance(tool(app), begin) > 0.05)
    ActionChains(browser.driver).release().perform()
    until(lambda: gizmo(app).pulled.by == "")
    moved = subtracted(position(tool(app)), position(begin))
    assert dot(moved, (begin.sx, begin.sy, begin.sz)) > 0.99 * length(moved)
    until(lambda: robot.timeline.end < robot.now)
    browser.until(lambda: distance(_drawn(browser), tool(app)) < 1e-6)
    assert not browser.errors()


def _drawn(browser: Browser) -> Transform:
    return Transform(*map(float, browser.pose("/drag")[:3].ravel()))
