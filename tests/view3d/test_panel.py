"""The panel over the wire, as a page has it: what is typed and clicked, and what is seen of it."""

from __future__ import annotations

import asyncio
import json
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from math import degrees, inf, radians
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import viser

from tests.live import until
from tests.net.cable import cable
from tests.net.serving import serving
from tests.view3d.pages import Page, asked_of, lost_of
from vrs_cli.engine.position import position_at
from vrs_cli.interfaces.dialogue import no_answer
from vrs_cli.interfaces.roles.supervisor import Supervisor
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.client import hello_of
from vrs_cli.net.hosted import SHELL, Hosted
from vrs_cli.net.messages import LeaseAct
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.net.tokens import add_tokens
from vrs_cli.values.acts import Define, Say, Survey
from vrs_cli.values.results import Untrue
from vrs_cli.view3d.app import App
from vrs_cli.view3d.panel import DRIVE, RELEASE, Panel
from vrs_cli.view3d.panel_hand import HELD, RESTS, HeldButton, Slider, slider_range
from vrs_cli.view3d.panel_line import EARLIER, LATER
from vrs_cli.view3d.parts import put
from vrs_cli.view3d.window import RobotWindow

WAITS = ".PROGRAM waits()\n  TYPE 1\n  WAIT SIG(1001)\n  TYPE 2\n.END\n"
ASK = '.PROGRAM ask()\n  PROMPT "How many? ", n\n  TYPE "got", n\n.END\n'


class Sat:
    """A page, and who sits before it."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self._field = page.gui("GuiTextMessage", label="VAL-II")["uuid"]

    def type(self, text: str) -> None:
        """With Enter."""
        self.page.set(self._field, text)
        self.page.set(self._field, f"{text}\n")
        self.until(lambda: self.now("GuiTextMessage", label="VAL-II")["value"] == "")

    def press(self, label: str, option: str) -> None:
        self.page.set(self.page.gui("GuiButtonGroupMessage", label=label)["uuid"], option)

    def now(self, kind: str, **props: object) -> dict[str, Any]:
        return self.page.gui(kind, **props)

    def html(self) -> list[str]:
        """What stands in all places for text that are seen."""
        found = {}
        for message in self.page.of("GuiHtmlMessage"):
            found[message["uuid"]] = dict(message["props"])
        for update in self.page.of("GuiUpdateMessage"):
            if update["uuid"] in found:
                found[update["uuid"]].update(update["updates"])
        return [props["content"] for props in found.values() if props["visible"]]

    def sees(self, text: str) -> None:
        self.until(lambda: any(text in one for one in self.html()))

    def drives(self, said: str) -> None:
        self.until(lambda: self.now("GuiButtonGroupMessage", label="Nobody drives")["label"] == said)

    def until(self, found: Callable[[], object]) -> None:
        self.page.until(lambda: bool(found()))


@contextmanager
def sat(app: App) -> Iterator[Sat]:
    """A page whose buttons do something: its window is furnished."""
    before = set(app.windows)
    with Page(app.address) as page:
        page.until(lambda: set(app.windows) - before)
        yield Sat(page)


@pytest.fixture
def ada(app: App) -> Iterator[Sat]:
    with sat(app) as it:
        yield it


def window(app: App) -> RobotWindow:
    until(lambda: app.windows)
    return app.windows[0]


def panel(app: App) -> Panel:
    (found,) = (part for part in window(app).parts if isinstance(part, Panel))
    return found


def test_a_line_moves_the_arm(app: App, ada: Sat) -> None:
    ada.type("JOG 1, 20")
    ada.until(lambda: window(app).watched.timeline.end > 0.1)
    ada.sees("JOG")
    ada.type("TYPE 6*7")
    ada.sees("42")


def test_a_mistake_stands_under_the_line_and_the_line_stays(ada: Sat) -> None:
    field = ada.now("GuiTextMessage", label="VAL-II")["uuid"]
    ada.page.set(field, "MOVEE a\n")
    ada.sees("did you mean MOVE?")
    ada.until(lambda: ada.now("GuiTextMessage", label="VAL-II")["value"] == "MOVEE a")
    assert not any(".</span>" in one and "MOVEE" in one for one in ada.html()), "it was not sent"
    ada.page.set(field, "MOVE a")
    ada.until(lambda: not any("did you mean" in one for one in ada.html()))


def test_a_file_that_is_too_long_is_refused_and_the_connection_stays(app: App, ada: Sat) -> None:
    ada.sees("Programs are typed")
    panel(app).front_end.load("long.v2", b"; much\n" * 400_000)
    ada.sees("at most")
    ada.type("TYPE 6*7")
    ada.sees("42")
    assert not ada.page.said(), "nothing was cut"


def test_words_are_suggested_and_taken(ada: Sat) -> None:
    field = ada.now("GuiTextMessage", label="VAL-II")["uuid"]
    ada.page.set(field, "DEPA")
    ada.until(lambda: "DEPART" in ada.now("GuiButtonGroupMessage", label="Words")["options"])
    ada.press("Words", "DEPART")
    ada.until(lambda: ada.now("GuiTextMessage", label="VAL-II")["value"] == "DEPART")


def test_lines_of_before_come_again(app: App, ada: Sat) -> None:
    for number in (1, 2):
        ada.type(f"x = {number}")
        ada.until(lambda number=number: len(panel(app).front_end.history) == number)
    for expected in ("x = 2", "x = 1", "x = 1"):
        ada.press("Go back", EARLIER)
        ada.until(lambda expected=expected: ada.now("GuiTextMessage", label="VAL-II")["value"] == expected)
    ada.press("Go back", LATER)
    ada.until(lambda: ada.now("GuiTextMessage", label="VAL-II")["value"] == "x = 2")


def test_the_prompt_of_a_program_stands_before_its_lines(ada: Sat) -> None:
    field = "GuiTextMessage"
    ada.type(".PROGRAM a()")
    ada.until(lambda: ada.now(field, label="VAL-II")["label"].startswith("1"))
    ada.type(".END")
    ada.until(lambda: ada.now(field, label="VAL-II")["label"] == "VAL-II")


def test_undo_is_a_button(app: App, ada: Sat) -> None:
    ada.type("JOG 1, 20")
    ada.until(lambda: window(app).watched.timeline.end > 0.1)
    ada.press("Go back", "Undo")
    ada.sees("UNDO")


def test_a_program_is_typed_run_stepped_and_stopped(ada: Sat) -> None:
    ada.type(WAITS)
    ada.until(lambda: "waits" in ada.now("GuiDropdownMessage", label="Program")["options"])
    ada.press("Do", "Step")
    ada.sees("</b> paused, step 2")
    ada.press("Do", "Proceed")
    ada.sees("</b> running, step 2")
    ada.until(lambda: any('data-step="here"' in one and "WAIT" in one.split("data-step")[1] for one in ada.html()))
    ada.press("Do", "Abort")
    ada.sees("</b> aborted, step 2")
    ada.press("Inputs", "\N{WHITE CIRCLE} 1001")
    ada.press("Do", "Run")
    ada.sees("</b> completed")


def test_stop_needs_nothing(app: App, ada: Sat) -> None:
    ada.type("JOG 1, 100")
    ada.until(lambda: window(app).watched.timeline.end > 0.5)
    assert asked_of(app.address, "stop") == (200, "")
    ada.until(lambda: joint_1(app) < 99.0)


def joint_1(app: App) -> float:
    """Where it will come to rest [deg]."""
    it = window(app).watched
    return degrees(position_at(it.arm, it.timeline, it.timeline.end).joints[0])


def test_a_question_is_answered_in_the_panel(ada: Sat) -> None:
    ada.type(ASK)
    ada.type("EXECUTE ask")
    ada.sees("How many?")
    ada.until(lambda: ada.now("GuiTextMessage", label="Answer")["visible"])
    ada.page.set(ada.now("GuiTextMessage", label="Answer")["uuid"], "4\n")
    ada.sees("got 4")
    ada.until(lambda: not ada.now("GuiTextMessage", label="Answer")["visible"])
    ada.type("DELETEP ask")
    ada.until(lambda: ada.now("GuiButtonGroupMessage", label="Answer")["visible"])
    ada.press("Answer", "Yes")
    ada.sees("Programs are typed as")


def test_signals_are_lamps_and_switches(ada: Sat) -> None:
    ada.press("Outputs", "\N{WHITE CIRCLE} 3")
    ada.until(lambda: "\N{BLACK CIRCLE} 3" in ada.now("GuiButtonGroupMessage", label="Outputs")["options"])
    ada.type("SIGNAL 2010")
    ada.until(
        lambda: (
            ada.now("GuiButtonGroupMessage", label="Internal")["options"] == ("\N{BLACK CIRCLE} 2010",)
            or ada.now("GuiButtonGroupMessage", label="Internal")["options"] == ["\N{BLACK CIRCLE} 2010"]
        )
    )
    ada.press("Outputs", "\N{BLACK CIRCLE} 3")
    ada.until(lambda: "\N{WHITE CIRCLE} 3" in ada.now("GuiButtonGroupMessage", label="Outputs")["options"])


def test_a_reading_that_no_longer_holds_is_told_beside_the_programs(ada: Sat, hosted: Hosted) -> None:
    hosted.session.told_untrue = (Untrue(1, 1001, True, True, -1.0, "pick step 4: WAIT SIG(1001)", "MOVE <b>"),)
    ada.type("SIGNAL 3")
    ada.sees("MOVE &lt;b&gt; was given when 1001 came on")
    ada.sees("it no longer does (pick step 4: WAIT SIG(1001))")


def test_a_slider_is_meant_when_it_rests(server: viser.ViserServer) -> None:
    handle = server.gui.add_slider("Joint 1", 0.0, 9.0, 0.1, 0.0)
    slider = Slider(handle)
    for k, angle in enumerate((5.0, 12.0, 20.0)):
        slider.moved(angle, 0.1 * k)
        slider.follow(1.0, 0.1 * k)
        assert slider.taken(0.1 * k + 0.05) is None
    assert slider.taken(0.2 + RESTS) == 20.0, "one motion"
    assert slider.taken(9.0) is None
    slider.follow(3.0, 0.2 + 0.5 * HELD)
    assert handle.value == 0.0, "it does not jump back under the mouse"
    slider.follow(3.0, 0.3 + HELD)
    assert handle.value == 3.0


def test_a_page_is_told_of_a_value_what_the_setter_of_viser_tells(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But who hears the user is not called."""
    told, heard, gui = list[object](), list[object](), server.gui
    monkeypatch.setattr(server._websock_server, "queue_message", told.append)
    handles: tuple[Any, ...] = (
        gui.add_slider("", 0.0, 9.0, 0.1, 0.0),
        gui.add_dropdown("", ("0", "2")),
        gui.add_text("", "0"),
    )
    for handle in handles:
        handle.on_update(heard.append)
        told.clear()
        first, second = handle.value, type(handle.value)(2)
        put(handle, value=second)
        put(handle, value=second)
        assert not heard
        handle.value = first
        handle.value = second
        ours, _, its = told
        assert ours == its
        heard.clear()


def test_a_slider_begins_between_its_ends() -> None:
    panda = load_robot("panda")  # joint 4 goes to -4.0 deg
    odd = replace(panda, upper=(*panda.upper[:3], radians(-3.9992), *panda.upper[4:]))
    assert slider_range(odd, 4) == (pytest.approx(-176.0), -4.0, -4.0)
    assert slider_range(panda, 1)[2] == 0.0


def test_a_slider_moves_its_joint_and_follows_the_arm(app: App, ada: Sat) -> None:
    one = ada.now("GuiSliderMessage", label="Joint 1")["uuid"]
    for angle in (5.0, 12.0, 20.0):  # as it is dragged
        ada.page.set(one, angle)
    ada.until(lambda: abs(joint_1(app) - 20.0) < 0.1)
    ada.press("JOG", "Joints")
    ada.until(lambda: "\N{BLACK CIRCLE} Joints" in ada.now("GuiButtonGroupMessage", label="JOG")["options"])
    click(ada, "\N{MINUS SIGN} X", "\N{MINUS SIGN} Joint 1")
    ada.until(lambda: abs(ada.now("GuiSliderMessage", label="Joint 1")["value"] - 10.0) < 0.2)


def button(ada: Sat, first: str, says: str) -> str:
    """A button of JOG that said one thing first, and another one now."""
    ada.until(lambda: ada.now("GuiButtonMessage", label=first)["label"] == says)
    return str(ada.now("GuiButtonMessage", label=first)["uuid"])


def click(ada: Sat, first: str, says: str) -> None:
    """As a browser tells of it: held down, and let go at once."""
    uuid = button(ada, first, says)
    ada.page.hold(uuid)
    ada.page.set(uuid, True)


class HeldByHand:
    """A button, whose page says `h` that it is held, `c` a click, and `-` nothing for a while, `x` while the connection
    is cut; and what comes of it.
    """

    def __init__(self) -> None:
        self.wall, self.done = 0.0, list[str]()
        self.handle: Any = SimpleNamespace(on_hold=self._on_hold, on_click=self._on_click)
        hands: Any = SimpleNamespace(do=lambda act: act())
        acts = [partial(self.done.append, name) for name in ("hold", "let go", "step")]
        self.button = HeldButton(self.handle, hands, lambda: self.wall, *acts)

    def _on_hold(self, hear: Any, _rate: float) -> None:
        self._hear = hear

    def _on_click(self, hear: Any) -> None:
        self._clicked = hear

    def does(self, what: str) -> list[str]:
        for one in what:
            if one == "-":
                self.wall += 1.0
                self.button.look(self.wall)
            elif one == "x":
                self.button.drop()
            else:
                asyncio.run((self._hear if one == "h" else self._clicked)(None))
        return self.done


@pytest.mark.parametrize(
    ("what", "done"),
    [
        ("hc", ["step"]),
        ("h-c", ["step"]),  # a click that comes late
        ("c", ["step"]),  # with the keyboard
        ("hhhhc", ["hold", "hold", "let go"]),
        ("hhh-c", ["hold", "let go"]),
        ("hhh-hhhc", ["hold", "let go", "hold", "let go"]),
        ("hhh-chc", ["hold", "let go", "step"]),
        ("hhhxhhhc", ["hold"]),  # the connection was cut, and it is held on
        ("hhhxhhhchhhc", ["hold", "hold", "let go"]),
        ("hhhxhhh-hhhc", ["hold", "let go"]),
    ],
)
def test_a_click_is_a_step_and_a_button_of_which_nothing_is_heard_is_let_go(what: str, done: list[str]) -> None:
    assert HeldByHand().does(what) == done


def test_a_button_that_is_held_moves_the_arm_until_it_is_let_go(app: App, ada: Sat) -> None:
    ada.press("JOG", "Joints")
    more = button(ada, "+ X", "+ Joint 1")
    before = joint_1(app)
    for _ in range(6):
        ada.page.hold(more)
        ada.page.quiet(0.1)
    ada.page.set(more, True)
    robot = window(app).watched
    ada.until(lambda: not panel(app).hand.buttons[1].held and robot.now > robot.timeline.end > 0.1)
    assert 0.5 < joint_1(app) - before < 8.2 * robot.timeline.end, "a tenth of full speed"
    assert "JOG" not in panel(app).front_end.transcript.html(), "it was no click"


def test_an_arm_whose_page_goes_while_a_button_is_held_stops(app: App, hosted: Hosted) -> None:
    robot = Supervisor(hosted.hold(who=SHELL))
    with sat(app) as ada:
        ada.press("JOG", "Joints")
        more = button(ada, "+ X", "+ Joint 1")
        for _ in range(4):
            ada.page.hold(more)
        ada.until(lambda: robot.timeline.end > 0.1)
    assert robot.say("LISTR 1", no_answer)
    assert robot.timeline.end - robot.timeline[1].start < 1.5
    robot.close()


def test_speed_is_a_slider(ada: Sat) -> None:
    speed = ada.now("GuiSliderMessage", label="SPEED %")["uuid"]
    ada.page.set(speed, 30)
    ada.until(lambda: any("SPEED 30" in re.sub("<[^>]*>", "", one) for one in ada.html()))  # before the next is typed
    ada.type("SPEED 55")
    ada.until(lambda: ada.now("GuiSliderMessage", label="SPEED %")["value"] == 55.0)


def test_at_a_robot_of_ones_own_nobody_asks_who_drives_until_somebody_has_asked(app: App, ada: Sat) -> None:
    ada.type("TYPE 6*7")
    ada.sees("42")
    assert not ada.now("GuiButtonGroupMessage", label="Nobody drives")["visible"]
    panel(app).front_end.drive(LeaseAct.ASK)
    ada.drives("You drive")
    assert ada.now("GuiButtonGroupMessage", label="Nobody drives")["visible"]
    ada.press("Nobody drives", RELEASE)
    ada.until(lambda: not ada.now("GuiButtonGroupMessage", label="Nobody drives")["visible"])


def test_two_browsers_and_one_lease(shared: App) -> None:
    with sat(shared) as ada, sat(shared) as bo:
        ada.until(lambda: ada.now("GuiButtonGroupMessage", label="Nobody drives")["visible"])
        ada.press("Nobody drives", DRIVE)
        ada.drives("You drive")
        bo.drives("browser drives")
        bo.press("Nobody drives", "Ask to drive")
        ada.sees("browser-2 would like to drive")
        ada.until(lambda: "Give to browser-2" in ada.now("GuiButtonGroupMessage", label="Nobody drives")["options"])
        ada.press("Nobody drives", "Give to browser-2")
        bo.drives("You drive")
        ada.drives("browser-2 drives")
        bo.type("JOG 1, 20")
        ada.until(lambda: shared.windows[0].watched.timeline.end > 0.1)
        bo.press("Nobody drives", RELEASE)
        ada.drives("Nobody drives")


def test_what_is_typed_and_wished_while_the_connection_is_cut_is_dropped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vrs_cli.view3d.panel_line.PATIENCE", inf)  # a line waits to be checked, as for a moment
    monkeypatch.setattr("vrs_cli.view3d.panel_hand.RESTS", inf)  # and a slider until it rests
    with serving(tmp_path, realtime=1.0) as it, cable(it.address) as to_it:
        app = App(lambda told: SocketPort.connect(to_it.url, hello_of(attended=True), told=told))
        try:
            with sat(app) as ada:
                ada.type(ASK)
                ada.type("EXECUTE ask")
                here = panel(app)
                until(lambda: here.front_end.question)
                to_it.freeze()
                ada.type("b = 5")
                until(lambda: here.line._checking is not None)
                here.hand.joints[0].moved(40.0, 0.0)
                to_it.shut()
                until(lambda: lost_of(app.address).startswith("No connection to the robot since "))
                code, said = asked_of(app.address, "stop")
                assert (code, said.split(".")[0]) == (503, "STOP did not reach the robot")
                asked = here.front_end.question
                assert asked is not None
                here.front_end.answer(asked, "3")
                assert here.front_end.question is asked, "it was not answered"
                to_it.open()
                ada.sees("Not given, for the connection was cut meanwhile: b = 5")
                until(lambda: lost_of(app.address) == "")
                assert here.front_end.history[-1] == "b = 5"
                assert here.hand.joints[0].wanted is None
                here.front_end.answer(asked, "4")
                ada.sees("got 4")
                assert "b" not in {name for name, _ in it.hub.rooms["cell1"].session.environment.values()}
        finally:
            app.close()


def test_who_may_not_drive_sees_and_presses_nothing(tmp_path: Path) -> None:
    tokens = add_tokens(file := tmp_path / "tokens.toml", ["ada"]) | add_tokens(file, ["eve"], "observer")
    with serving(tmp_path, tokens=tmp_path / "tokens.toml") as it:
        ada = Supervisor(SocketPort.connect(it.address, hello_of(tokens["ada"])))
        app = App(lambda told: SocketPort.connect(it.address, hello_of(tokens["eve"], attended=True), told=told))
        try:
            with Page(app.address) as page:
                eve = Sat(page)
                eve.sees("Nobody drives")
                ada.act(Define(WAITS))
                ada.act(Say("SIGNAL 3"))
                eve.sees("ada drives")
                eve.sees("WAIT")
                eve.until(lambda: "\N{BLACK CIRCLE} 3" in eve.now("GuiButtonGroupMessage", label="Outputs")["options"])
                assert json.loads(asked_of(app.address, "there")[1])["drives"] is False
                assert asked_of(app.address, "stop") == (503, "STOP did not reach the robot.")
                assert not eve.now("GuiButtonGroupMessage", label="Nobody drives")["visible"]
                assert "Joint 1" not in [message["props"]["label"] for message in page.of("GuiSliderMessage")]
                folders = [message["props"]["visible"] for message in page.of("GuiFolderMessage")]
                assert folders[0] is False, "of the line"
                eve.press("Outputs", "\N{BLACK CIRCLE} 3")
                page.quiet(0.3)
                assert ada.act(Survey()).on == (3,)
        finally:
            app.close()
            ada.close()


def test_a_robot_that_comes_back(tmp_path: Path) -> None:
    with serving(tmp_path) as it, cable(it.address) as wire:
        app = App(lambda told: SocketPort.connect(wire.url, hello_of(attended=True), told=told))
        try:
            with Page(app.address) as page:
                ada = Sat(page)
                ada.type("x = 1")
                ada.drives("You drive")
                wire.pull()
                ada.sees("connected again")
                ada.type("TYPE 6*x")
                ada.sees("6")
        finally:
            app.close()


def test_a_key_is_heard_though_the_field_is_emptied_at_that_moment(app: App) -> None:
    with sat(app) as it:
        it.type("TYPE 6*7")
        it.sees("42")
        hands, field, heard = panel(app).hands, panel(app).line.field, list[str]()
        hands.on(field, heard.append)

        def emptied(*_said: object) -> None:
            """Between what the page says and its being heard."""
            thread = threading.Thread(target=hands.fill, args=(field, ""))
            thread.start()
            thread.join()

        field._impl.sync_cb = emptied
        it.page.set(field._impl.uuid, "x")
        it.until(lambda: heard == ["x"])


def test_nothing_is_left_of_a_browser_that_goes(app: App) -> None:
    with sat(app):
        done: list[int] = []
        panel(app).hands.do(lambda: done.append(1))
        until(lambda: done)
        assert any(thread.name.startswith("vrs panel") for thread in threading.enumerate())
    until(lambda: not app.windows)
    until(lambda: not any(thread.name.startswith("vrs panel") for thread in threading.enumerate()))
