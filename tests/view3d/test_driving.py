"""A robot driven from a real browser: keys are pressed, buttons clicked, and what a user sees is looked for."""

from __future__ import annotations

from pathlib import Path

from tests.examples import only_in_full
from tests.live import PATIENCE
from tests.net.cable import cable
from tests.net.serving import serving
from tests.view3d.browser import Browser, needs_browser
from vrs_cli.net.client import hello_of
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.view3d.app import App

pytestmark = needs_browser

BACKSPACE = "\ue003"
PROGRAM = '.PROGRAM ask()\n  PROMPT "How many? ", n\n  TYPE "got", 2*n\n  WAIT SIG(1001)\n.END\n'


BAND = "document.getElementById('vrs-band').innerText"
ON_TOP = """
    const box = document.getElementById('vrs-stop')?.getBoundingClientRect();
    return box?.width > 0
        && document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2).id === 'vrs-stop';
"""
LOOK = """
    const canvas = document.querySelector('canvas'), cloud = document.querySelector('.tabler-icon-cloud-check');
    return [getComputedStyle(canvas).filter.includes('grayscale(1)'), document.getElementById('vrs-stop').innerText,
        cloud === null || getComputedStyle(cloud).stroke === 'rgb(208, 31, 31)'];
"""  # whether the arm is grey, what the button says, and whether the cloud is red


class User:
    """Somebody before the page that is shown."""

    def __init__(self, browser: Browser, address: str) -> None:
        self.browser = browser
        browser.size(820, 300)
        browser.open(address)
        self.sees("VAL-II")
        browser.hide_notices()

    def types(self, keys: str, field: str = "VAL-II") -> None:
        """Into the field with that label."""
        xpath = f"//label[.='{field}']/ancestor::div[contains(@class, 'Flex')][1]//textarea"
        self.browser.until(lambda: self.browser.driver.find_elements("xpath", xpath), what=field)
        self.browser.driver.find_element("xpath", xpath).send_keys(keys)

    def clicks(self, label: str) -> None:
        def found() -> bool:
            for one in self.browser.driver.find_elements("css selector", "button,[role=tab]"):
                if one.text.strip() == label and one.is_displayed():
                    one.click()
                    return True
            return False

        self.browser.until(found, what=f"a button {label}")

    def sees(self, text: str) -> None:
        self.browser.until_page("document.body.textContent.includes(arguments[0])", text, patience=PATIENCE)

    def sees_no(self, text: str) -> None:
        self.browser.until_page("!document.body.textContent.includes(arguments[0])", text, patience=PATIENCE)


def test_a_robot_is_driven_from_a_browser(browser: Browser, app: App) -> None:
    user = User(browser, app.address)
    user.types("MOVE #PPOINT(20,-45,180)\n")
    browser.until(lambda: app.windows[0].watched.timeline.end > 0.5)
    for k in (1, 2, 3):  # as fast as a browser can be typed into: nothing is lost, and nothing comes twice
        user.types(f"x = {k}\nTYPE 900+x\n")
    user.sees("903")
    said = browser.run("return document.body.innerText")
    assert [said.count(f"{900 + k}") for k in (1, 2, 3)] == [1] * 3
    user.types("MOVEE a\n")
    user.sees("did you mean MOVE?")
    user.sees("^^^^^")
    user.types(BACKSPACE * 7)
    user.sees_no("did you mean MOVE?")
    user.types(PROGRAM)
    user.sees("Program ask: 3 steps")
    user.clicks("Run")
    user.sees("How many?")
    user.types("21\n", "Answer")
    user.sees("got 42")
    user.sees("running, step 3")
    user.clicks("STOP")
    user.sees("aborted, step 3")
    assert not browser.errors()


def test_stop_is_there_and_says_whether_it_stops(browser: Browser, tmp_path: Path) -> None:
    """On a screen and on a phone, above all else; a page without a connection looks so."""
    with serving(tmp_path, realtime=1.0) as it, cable(it.address) as to_it:
        app = App(lambda told: SocketPort.connect(to_it.url, hello_of(attended=True), told=told))
        try:
            browser.size(820, 400)
            browser.open(app.address)
            for size in ((820, 400), (390, 844)):
                browser.size(*size)
                browser.until(lambda: browser.run(ON_TOP) is True, what=f"STOP is seen at {size}")
                browser.driver.find_element("id", "vrs-stop").click()
                browser.until_page("document.getElementById('vrs-stop').innerText === 'STOPPED'")
                to_it.shut()
                browser.until_page(
                    "document.getElementById('vrs-band').innerText.startsWith('No connection to the ro')"
                )
                assert browser.run(LOOK) == [True, "STOP: no connection", True], size
                assert browser.run(ON_TOP), size
                browser.driver.find_element("id", "vrs-stop").click()
                browser.until_page("document.getElementById('vrs-stop').innerText === 'NOT STOPPED'")
                to_it.open()
                browser.until_page("document.getElementById('vrs-stop').innerText === 'STOP'")
                assert browser.run(LOOK) == [False, "STOP", False], size
            app.close()
            browser.until_page(f"{BAND}.startsWith('vrs view has ended')")
            assert browser.run(LOOK) == [True, "STOP: no connection", True]
        finally:
            app.close()


@only_in_full()  # tests/view3d/test_panel.py has it without a browser
def test_two_browsers_and_one_lease(browser: Browser, shared: App) -> None:
    ada = User(browser, shared.address)
    first = browser.driver.current_window_handle
    ada.sees("Nobody drives")
    ada.clicks("Drive")
    ada.sees("You drive")
    second = browser.another()
    bo = User(browser, shared.address)
    bo.sees("browser drives")
    bo.types("MOVE #PPOINT(20,-45,180)\n")
    bo.sees("browser drives")
    bo.clicks("Ask to drive")
    browser.back(first)
    ada.sees("browser-2 would like to drive")
    ada.clicks("Give to browser-2")
    ada.sees("browser-2 drives")
    browser.back(second)
    bo.sees("You drive")
    bo.types("MOVE #PPOINT(20,-45,180)\n")
    for window in shared.windows:
        browser.until(lambda window=window: window.watched.timeline.end > 0.5)
